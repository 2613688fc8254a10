use dymlm_core::Detection;

/// What the 2D detector says of a frame.
///
/// A detector is often slower than the camera. "It did not run" and "it ran and found nothing" are different
/// evidence: the first says nothing about who is in view, the second speaks against each known mover and
/// object.
///
/// ```
/// use dymlm::Detections;
/// use dymlm::core::Detection;
///
/// let nothing: [Detection; 0] = [];
/// assert!(matches!(Detections::from(&nothing), Detections::Found([])));
/// assert!(matches!(Detections::from(None::<&[Detection]>), Detections::NotRun));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Detections<'a> {
    /// The detector ran and found these; an empty slice means that it found nothing.
    Found(&'a [Detection]),
    /// The detector did not run on this frame, and will not.
    NotRun,
    /// The detector is still running; [`MapBuilder::detections_for`](crate::MapBuilder::detections_for)
    /// brings its result.
    Pending,
}

impl<'a> From<&'a [Detection]> for Detections<'a> {
    fn from(found: &'a [Detection]) -> Self {
        Self::Found(found)
    }
}

impl<'a> From<&'a Vec<Detection>> for Detections<'a> {
    fn from(found: &'a Vec<Detection>) -> Self {
        Self::Found(found)
    }
}

impl<'a, const N: usize> From<&'a [Detection; N]> for Detections<'a> {
    fn from(found: &'a [Detection; N]) -> Self {
        Self::Found(found)
    }
}

/// `None`: the detector did not run.
impl<'a> From<Option<&'a [Detection]>> for Detections<'a> {
    fn from(found: Option<&'a [Detection]>) -> Self {
        found.map_or(Self::NotRun, Self::Found)
    }
}
