use std::ops::RangeInclusive;

use dymlm_core::{DepthImage, Error, Frame, Mask, Point, Pose};

use crate::SeenPoints;

/// Points in free space that were looked through: samples along the rays of a grid of pixels, from the camera
/// to the reading or the exact surface, whichever is nearer.
///
/// The grid of pixels shifts from frame to frame, so that a camera at rest covers all of its image in time.
#[derive(Debug, Clone)]
pub(crate) struct FreeSpace {
    depths: RangeInclusive<f32>,
    samples: SeenPoints,
}

/// Side of the cubes into which free space is thinned, and step along rays, metres: the size of usual map
/// cells.
const SAMPLE_DISTANCE: f64 = 0.05;
/// Number of frames that must look through a cube before maps are scored there.
const MIN_VIEWS: u32 = 3;
/// Approximate number of rays per frame; these cost about 6 ms.
const RAYS_PER_FRAME: u32 = 2500;

impl FreeSpace {
    pub(crate) fn new(depths: RangeInclusive<f32>) -> Self {
        Self { depths, samples: SeenPoints::new(SAMPLE_DISTANCE) }
    }

    pub(crate) fn observe(
        &mut self,
        frame: &Frame,
        exact_depth: &DepthImage,
        movers: &Mask,
        world_from_camera: &Pose,
    ) -> Result<(), Error> {
        let camera = frame.camera();
        camera.check_size("the exact depth", exact_depth.width(), exact_depth.height())?;
        camera.check_size("the mask of the movers", movers.width(), movers.height())?;
        let number = self.samples.next_frame() as usize;
        let (width, height) = (camera.width(), camera.height());
        let stride = Self::pixel_stride(width * height);
        for v in (number / stride % stride..height).step_by(stride) {
            for u in (number % stride..width).step_by(stride) {
                let (reading, exact) = (frame.depth().at(u, v), exact_depth.at(u, v));
                if movers.at(u, v) || !self.is_used(reading) || !self.depths.contains(&exact) {
                    continue;
                }
                let end = camera.back_project([u as f64, v as f64], reading.min(exact).into());
                self.look_along(world_from_camera.translation(), world_from_camera.transform_point(end));
            }
        }
        Ok(())
    }

    /// The points that at least three frames looked through, one per cube.
    pub(crate) fn points(&self) -> Vec<Point> {
        self.samples.points(MIN_VIEWS)
    }

    /// Distance between the pixels of rays, chosen so that a frame has about [`RAYS_PER_FRAME`].
    fn pixel_stride(pixels: usize) -> usize {
        (pixels as f64 / f64::from(RAYS_PER_FRAME)).sqrt().round().max(1.0) as usize
    }

    fn is_used(&self, reading: f32) -> bool {
        reading > 0.0 && self.depths.contains(&reading)
    }

    /// Samples the segment from the camera to a surface.
    fn look_along(&mut self, eye: [f64; 3], end: [f64; 3]) {
        let way: [f64; 3] = std::array::from_fn(|axis| end[axis] - eye[axis]);
        let length = way.iter().map(|c| c * c).sum::<f64>().sqrt();
        // The last whole step ends in front of the surface.
        let steps = (length / SAMPLE_DISTANCE).ceil() - 1.0;
        for step in 1..=steps.max(0.0) as u32 {
            let part = f64::from(step) * SAMPLE_DISTANCE / length;
            self.samples.see(std::array::from_fn(|axis| (eye[axis] + part * way[axis]) as f32));
        }
    }
}
