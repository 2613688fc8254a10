use crate::Failure;

/// A solved pose graph.
pub(crate) struct Solved {
    pub(crate) iterations: usize,
    /// Translation and quaternion x y z w of each pose, in the order of the file.
    pub(crate) poses: Vec<[f64; 7]>,
}

impl Solved {
    /// Writes all numbers as f64, the iterations first.
    pub(crate) fn write(&self, path: &str) -> Result<(), Failure> {
        let numbers = [self.iterations as f64].into_iter().chain(self.poses.iter().flatten().copied());
        Ok(std::fs::write(path, numbers.flat_map(f64::to_le_bytes).collect::<Vec<u8>>())?)
    }
}
