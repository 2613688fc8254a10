use dymlm_core::BoundingBox;

/// An ellipse in the image: the outline of an ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ImageEllipse {
    /// Centre `[u, v]`, pixels. It is not where the ellipsoid's centre appears.
    pub center: [f64; 2],
    /// Semi-axes, the longer first, pixels.
    pub semi_axes: [f64; 2],
    /// Unit direction of the longer axis, its u not negative.
    pub axis: [f64; 2],
}

impl ImageEllipse {
    /// The ellipse of the points c + E^(1/2) x for all unit vectors x, where c is `center`; `shape` is (uu,
    /// uv, vv) of E. `None` when an eigenvalue of E is negative or not finite.
    pub(super) fn from_shape_matrix(center: [f64; 2], [uu, uv, vv]: [f64; 3]) -> Option<Self> {
        let (mean, half_difference) = (0.5 * (uu + vv), 0.5 * (uu - vv));
        let spread = half_difference.hypot(uv);
        let (greater, less) = (mean + spread, mean - spread);
        if !(less >= 0.0 && greater.is_finite() && center.iter().all(|c| c.is_finite())) {
            return None;
        }
        // The eigenvector is computed from the row with the greater diagonal element, where no digits cancel.
        let axis = if half_difference >= 0.0 {
            [half_difference + spread, uv]
        } else {
            [uv, spread - half_difference]
        };
        let length = axis[0].hypot(axis[1]);
        let axis = if length > 0.0 { axis.map(|c| c / length) } else { [1.0, 0.0] };
        let axis = if axis[0] < 0.0 { axis.map(|c| -c) } else { axis };
        Some(Self { center, semi_axes: [greater.sqrt(), less.sqrt()], axis })
    }

    /// The smallest box around it, pixels; `None` when it exceeds the range of f32.
    pub fn bounding_box(&self) -> Option<BoundingBox> {
        let [cos, sin] = self.axis;
        let [long, short] = self.semi_axes;
        let half = [(long * cos).hypot(short * sin), (long * sin).hypot(short * cos)];
        let [low, high] = [-1.0, 1.0].map(|side| [0, 1].map(|k| (self.center[k] + side * half[k]) as f32));
        BoundingBox::new(low[0], low[1], high[0], high[1]).ok()
    }

    /// Whether a pixel lies on or inside the ellipse.
    pub fn contains(&self, pixel: [f64; 2]) -> bool {
        let offset = [pixel[0] - self.center[0], pixel[1] - self.center[1]];
        let along = offset[0] * self.axis[0] + offset[1] * self.axis[1];
        let across = offset[1] * self.axis[0] - offset[0] * self.axis[1];
        let [long, short] = self.semi_axes;
        (along * short).powi(2) + (across * long).powi(2) <= (long * short).powi(2)
    }

    /// `count` points on the ellipse, at even steps of its parameter, starting at the end of the longer axis.
    pub fn outline(&self, count: usize) -> impl Iterator<Item = [f64; 2]> + '_ {
        (0..count).map(move |k| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
            let (along, across) = (self.semi_axes[0] * cos, self.semi_axes[1] * sin);
            [
                self.center[0] + along * self.axis[0] - across * self.axis[1],
                self.center[1] + along * self.axis[1] + across * self.axis[0],
            ]
        })
    }
}
