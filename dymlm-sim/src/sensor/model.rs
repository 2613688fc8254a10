pub(crate) struct Sensor;
