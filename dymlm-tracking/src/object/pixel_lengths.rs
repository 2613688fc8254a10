use dymlm_core::PinholeCamera;

/// Lengths in the image that stand for angles. They are chosen for a Kinect (f = 525 px) and scaled to the
/// camera's focal length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PixelLengths {
    /// Rim of the image kept around the object's box, so that windows at its outline are complete.
    pub(super) rim: f32,
    /// Radius of the windows that are compared with stored views.
    pub(super) window_radius: usize,
    /// Radius of the windows that flow follows from frame to frame.
    pub(super) flow_radius: usize,
    /// Least distance between corners.
    pub(super) corner_distance: f32,
    /// Least distance between two points of a frame that count as two.
    pub(super) point_distance: f32,
    /// Largest distance of an inlier from its pixel in the consensus; a smaller one would lose the consensus
    /// to the flow's drift.
    pub(super) consensus: f64,
    /// Step of the grid of readings to which a surface's plane is fitted.
    pub(super) plane_step: isize,
}

/// Halvings of the image: with three, flow bridges about eight window radii.
pub(super) const HALVINGS: usize = 3;

impl PixelLengths {
    pub(super) fn of(camera: &PinholeCamera) -> Self {
        let scale = camera.focal_scale();
        let narrow = scale as f32;
        // Matching is unreliable with windows of fewer than 7x7 pixels, and too slow with more than 31x31.
        let radius = |radius: f64| (radius * scale).round().clamp(3.0, 15.0) as usize;
        Self {
            rim: 24.0 * narrow,
            window_radius: radius(6.0),
            flow_radius: radius(7.0),
            corner_distance: (5.0 * narrow).max(1.0),
            point_distance: 2.0 * narrow,
            consensus: 3.0 * scale,
            plane_step: (2.0 * scale).round().max(1.0) as isize,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twice_the_focal_length_doubles_every_length() {
        let at = |scale: f64| {
            let [width, height] = [640.0, 480.0].map(|side| (side * scale) as usize);
            let camera = PinholeCamera::new(width, height, 525.0 * scale, 525.0 * scale, 1.0, 1.0).unwrap();
            PixelLengths::of(&camera)
        };
        let [one, two] = [at(1.0), at(2.0)];
        assert_eq!([one.rim, one.corner_distance], [24.0, 5.0]);
        assert_eq!([two.rim, two.corner_distance], [48.0, 10.0]);
        assert_eq!([one.window_radius, two.window_radius, one.flow_radius, two.flow_radius], [6, 12, 7, 14]);
        assert_eq!([one.plane_step, two.plane_step, at(0.3).plane_step], [2, 4, 1]);
    }
}
