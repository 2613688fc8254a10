pub(crate) struct Detector;
