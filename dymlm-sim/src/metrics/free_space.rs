use super::OccupancyScoreConfig;
use super::seen_points::SeenPoints;
use crate::SimulatedFrame;
use dymlm_core::Point;

/// Points of the air that readings were seen through: samples along the rays of a grid of pixels, from the camera to
/// the reading or the exact surface, whichever is nearer.
///
/// The grid of pixels moves from frame to frame, so that a camera at rest sees through all of its image in time.
#[derive(Debug, Clone)]
pub(super) struct FreeSpace {
    config: OccupancyScoreConfig,
    samples: SeenPoints,
}

impl FreeSpace {
    pub(super) fn new(config: OccupancyScoreConfig) -> Self {
        Self { config, samples: SeenPoints::new(config.sample_distance) }
    }

    pub(super) fn observe(&mut self, frame: &SimulatedFrame) {
        let number = self.samples.next_frame() as usize;
        let (width, height) = (frame.true_depth.width(), frame.true_depth.height());
        let stride = self.pixel_stride(width * height);
        for v in (number / stride % stride..height).step_by(stride) {
            for u in (number % stride..width).step_by(stride) {
                self.look_along(frame, u, v);
            }
        }
    }

    /// The points that at least `min_views` frames looked through, one a cube.
    pub(super) fn points(&self) -> Vec<Point> {
        self.samples.points(self.config.min_views)
    }

    /// Every how many pixels there is a ray, so that a frame has about as many as wanted.
    fn pixel_stride(&self, pixels: usize) -> usize {
        (pixels as f64 / f64::from(self.config.rays_per_frame)).sqrt().round().max(1.0) as usize
    }

    /// Samples the ray through a pixel, if it is one that maps use: with a reading within range of a static surface
    /// within range.
    fn look_along(&mut self, frame: &SimulatedFrame, u: usize, v: usize) {
        let (reading, exact) = (frame.frame.depth().at(u, v), frame.true_depth.at(u, v));
        let range = self.config.min_depth as f32..=self.config.max_depth as f32;
        if frame.mover_mask.at(u, v) || !(reading > 0.0 && range.contains(&reading) && range.contains(&exact))
        {
            return;
        }
        let at_depth = |z: f64| {
            let point = frame.frame.camera().back_project([u as f64, v as f64], z);
            frame.world_from_camera.transform_point(point)
        };
        let (eye, end) = (frame.world_from_camera.translation(), at_depth(reading.min(exact).into()));
        let way: [f64; 3] = std::array::from_fn(|axis| end[axis] - eye[axis]);
        let length = way.iter().map(|c| c * c).sum::<f64>().sqrt();
        // The last whole step stays before the surface.
        let steps = (length / self.config.sample_distance).ceil() - 1.0;
        for step in 1..=steps.max(0.0) as u32 {
            let part = f64::from(step) * self.config.sample_distance / length;
            self.samples.see(std::array::from_fn(|axis| (eye[axis] + part * way[axis]) as f32));
        }
    }
}
