use std::fmt;

use dymlm::core::Pose;
use dymlm_sim::{CarriedKind, CarriedThing};

/// Errors of a followed pose against the truth.
#[derive(Debug, Clone, Default)]
pub(crate) struct Errors {
    /// Centimetres.
    pub(crate) distances: Vec<f64>,
    /// Degrees; for round things, between their axes.
    pub(crate) angles: Vec<f64>,
}

impl Errors {
    /// Adds a frame: the tracked and the true pose of the same frame on the object. Returns their distance
    /// and angle.
    pub(crate) fn add(&mut self, kind: CarriedKind, tracked: &Pose, truth: &Pose) -> [f64; 2] {
        let errors = [100.0 * tracked.distance(truth), angle(kind, tracked, truth).to_degrees()];
        self.distances.push(errors[0]);
        self.angles.push(errors[1]);
        errors
    }
}

impl fmt::Display for Errors {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [d, a] = [&self.distances, &self.angles].map(|values| Quantiles::of(values.clone()));
        write!(
            out,
            "{:.2} cm and {:.2} deg (median), {:.2} cm and {:.2} deg (95 %)",
            d.at(0.5),
            a.at(0.5),
            d.at(0.95),
            a.at(0.95)
        )
    }
}

/// Whether the thing looks the same when it turns about its own z axis.
pub(crate) fn is_round(kind: CarriedKind) -> bool {
    matches!(kind, CarriedKind::Bottle | CarriedKind::Cup)
}

fn angle(kind: CarriedKind, a: &Pose, b: &Pose) -> f64 {
    if !is_round(kind) {
        return a.angle(b);
    }
    let [a, b] = [a, b].map(|pose| pose.rotate([0.0, 0.0, 1.0]));
    a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>().clamp(-1.0, 1.0).acos()
}

/// The pose of the thing's own frame, from the tracked pose of another frame on it and both poses at the
/// start.
pub(crate) fn thing_pose(tracked: &Pose, tracked_at_start: &Pose, thing_at_start: &CarriedThing) -> Pose {
    *tracked * tracked_at_start.inverse() * thing_at_start.world_from_object
}

/// Values in ascending order.
pub(crate) struct Quantiles(Vec<f64>);

impl Quantiles {
    pub(crate) fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        Self(values)
    }

    /// A quantile; NaN without values.
    pub(crate) fn at(&self, share: f64) -> f64 {
        let last = self.0.len().saturating_sub(1) as f64;
        self.0.get((last * share) as usize).copied().unwrap_or(f64::NAN)
    }
}
