use nalgebra::{Isometry3, SMatrix, SVector};

/// What a pose has seen of a thing that has three unknowns: a plane, or a landmark. Its error has `R`
/// numbers, in standard deviations.
pub(crate) trait View<const R: usize>: Sized {
    /// The thing in the world.
    type Thing;

    fn pose(&self) -> usize;

    fn error(&self, pose: &Isometry3<f64>, thing: &Self::Thing) -> SVector<f64, R>;

    /// The error, and its derivatives by the pose and by the thing.
    fn linearized(
        &self,
        pose: &Isometry3<f64>,
        thing: &Self::Thing,
    ) -> (SVector<f64, R>, SMatrix<f64, R, 6>, SMatrix<f64, R, 3>);

    /// The thing of least cost at these poses. So the poses alone decide the cost. Views count by their
    /// weights; when all weights are 0 the thing adds nothing to the cost, and any will do.
    fn best(views: &[Self], poses: &[Isometry3<f64>], weights: &[f64]) -> Option<Self::Thing>;
}
