/// What a map knows of free space.
///
/// A surface that is read in space that was free for long has moved there: the idea of Dynablox (Schmid et
/// al., "Dynablox: Real-time Detection of Diverse Dynamic Objects in Complex Environments", RA-L 2023).
pub trait FreeSpace {
    /// Whether a place (metres, world) was free for long and nothing static is within `margin` metres of it.
    fn is_long_free(&self, place: [f64; 3], margin: f64) -> bool;
}

impl<F: Fn([f64; 3], f64) -> bool> FreeSpace for F {
    fn is_long_free(&self, place: [f64; 3], margin: f64) -> bool {
        self(place, margin)
    }
}
