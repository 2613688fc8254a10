use super::OrientedBox;
use super::polyhedron::Polyhedron;

impl OrientedBox {
    /// Volume that two boxes share, cubic metres, exact to rounding: some 1e-15 of the larger box's volume.
    ///
    /// One box is clipped by the six half spaces of the other, face by face (Sutherland and Hodgman,
    /// "Reentrant polygon clipping", 1974), each clip closing the surface with a new face; the volume follows
    /// from the divergence theorem. Neighbouring faces share their vertices, so that the surface stays closed
    /// however rounding decides where the boxes share planes.
    ///
    /// Constant time, two to three microseconds where the boxes cross, and no allocation.
    pub fn intersection_volume(&self, other: &Self) -> f64 {
        intersection_volume(self, other)
    }

    /// Intersection over union of the volumes, 0..=1; 0 when both boxes are flat.
    pub fn iou(&self, other: &Self) -> f64 {
        let shared = self.intersection_volume(other);
        if shared > 0.0 { (shared / (self.volume() + other.volume() - shared)).min(1.0) } else { 0.0 }
    }
}

/// Volume that two boxes share, cubic metres.
fn intersection_volume(a: &OrientedBox, b: &OrientedBox) -> f64 {
    // What is left lies in the box that clips: the smaller one, so that its coordinates are small.
    let (clipped, clip) = if diagonal(a) >= diagonal(b) { (a, b) } else { (b, a) };
    let Some(corners) = corners_in(clipped, clip) else { return 0.0 };
    let half = clip.lengths.map(|length| 0.5 * length);
    let mut shared = Polyhedron::cuboid(corners);
    for (axis, limit) in half.into_iter().enumerate() {
        for side in [1.0, -1.0] {
            shared.clip(axis, side, limit);
        }
    }
    shared.volume().clamp(0.0, a.volume().min(b.volume()))
}

/// Length of the diagonal, metres.
fn diagonal(own: &OrientedBox) -> f64 {
    length(own.lengths)
}

fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Corners of a box in another's frame, in the order of [`OrientedBox::corners`]; `None` when the spheres
/// around the boxes do not meet.
fn corners_in(own: &OrientedBox, other: &OrientedBox) -> Option<[[f64; 3]; 8]> {
    // Far from the origin, centres are compared before anything is multiplied.
    let (from, to) = (other.center(), own.center());
    let offset: [f64; 3] = std::array::from_fn(|axis| to[axis] - from[axis]);
    // NaN fails the comparison, as the difference of infinite places does.
    let spheres_meet = length(offset) <= 0.5 * (diagonal(own) + diagonal(other));
    if !spheres_meet {
        return None;
    }
    let (own_axes, other_axes) =
        (own.world_from_box.rotation_matrix(), other.world_from_box.rotation_matrix());
    let to_other =
        |vector: [f64; 3]| std::array::from_fn(|i| (0..3).map(|k| other_axes[k][i] * vector[k]).sum::<f64>());
    let center: [f64; 3] = to_other(offset);
    let half_sides: [[f64; 3]; 3] = std::array::from_fn(|axis| {
        to_other(std::array::from_fn(|k| own_axes[k][axis] * 0.5 * own.lengths[axis]))
    });
    Some(std::array::from_fn(|corner| {
        let sign = |axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
        std::array::from_fn(|k| center[k] + (0..3).map(|axis| sign(axis) * half_sides[axis][k]).sum::<f64>())
    }))
}
