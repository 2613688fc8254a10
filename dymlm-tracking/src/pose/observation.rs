/// A camera's measurement of one point of a body.
///
/// Points and normals are in the body's frame, measurements in the camera's; `sigma` is the standard
/// deviation of the measurement in its own unit. Observations with a number that is not finite, or with a
/// `sigma` that is not positive, are ignored.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum PoseObservation {
    /// The pixel at which the point is seen.
    Pixel {
        /// The point, metres.
        point: [f64; 3],
        /// The pixel.
        pixel: [f64; 2],
        /// Standard deviation along u and v, pixels.
        sigma: f64,
    },
    /// The point's depth along the optical axis.
    Depth {
        /// The point, metres.
        point: [f64; 3],
        /// Its depth, metres.
        depth: f64,
        /// Standard deviation, metres.
        sigma: f64,
    },
    /// A place measured near a point of a surface, by its distance from the plane there (point-to-plane
    /// ICP, Chen and Medioni 1991). The surface may be curved: how it is inclined is taken to count at the
    /// point alone. Of a flat face that is measured far from its known points, see [`Plane`](Self::Plane).
    Surface {
        /// A point of the surface, metres.
        point: [f64; 3],
        /// The surface's unit normal there.
        normal: [f64; 3],
        /// The measured place, metres, camera frame.
        measured: [f64; 3],
        /// Standard deviation along the normal, metres.
        sigma: f64,
    },
    /// A place measured anywhere on a plane.
    Plane {
        /// A point of the plane, metres.
        point: [f64; 3],
        /// The plane's unit normal.
        normal: [f64; 3],
        /// The measured place, metres, camera frame.
        measured: [f64; 3],
        /// Standard deviation along the normal, metres.
        sigma: f64,
    },
}

impl PoseObservation {
    pub(super) fn is_usable(&self) -> bool {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let (is_finite, sigma) = match self {
            Self::Pixel { point, pixel, sigma } => (finite(point) && finite(pixel), *sigma),
            Self::Depth { point, depth, sigma } => (finite(point) && depth.is_finite(), *sigma),
            Self::Surface { point, normal, measured, sigma }
            | Self::Plane { point, normal, measured, sigma } => {
                (finite(point) && finite(normal) && finite(measured), *sigma)
            }
        };
        is_finite && sigma > 0.0 && sigma.is_finite()
    }
}
