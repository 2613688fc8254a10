use dymlm_core::{Frame, Mask, Pose, SensorModel};

use crate::block_depths::mean_place;
use crate::past_views::PastView;

/// Places along each side of a tile: the mean of 16 places, each the mean of 16 readings, has a sixteenth of
/// the noise of a reading.
const PLACES: usize = 4;
/// Pixels between places and along the side of a place, in an image of 640x480.
const SPACING: f64 = 24.0;
const SIDE: f64 = 4.0;
/// Least places of a tile that a view must read, and least tiles for a misfit to be known: a quarter of a tile
/// is more than an edge.
const LEAST_READ: usize = PLACES;
const LEAST_TILES: usize = 5;
/// Median of the absolute values of a normal distribution, in standard deviations.
const MEDIAN: f64 = 0.674;

/// The static surroundings of a frame's movers in square tiles, to measure by how much poses err.
///
/// How far a view's readings are from the frame's is averaged over each tile, which takes the noise away, and
/// the median over the tiles takes away tiles with edges and those in which something moves.
#[derive(Debug, Clone, Default)]
pub(crate) struct Surroundings {
    /// Places in the camera's frame, each with the index of its tile, by ascending tile.
    places: Vec<(usize, [f64; 3])>,
    means: Vec<f64>,
}

impl Surroundings {
    /// Reads the places of a frame that lie outside the movers' boxes.
    pub(crate) fn read(&mut self, frame: &Frame, boxes: &Mask, sensor: &SensorModel) {
        let (depth, scale) = (frame.depth(), frame.camera().size_scale());
        let [spacing, side] = [SPACING, SIDE].map(|pixels| (pixels * scale).round().max(1.0) as usize);
        let tile = PLACES * spacing;
        self.places.clear();
        let [columns, rows] = [depth.width() / tile, depth.height() / tile];
        for index in 0..columns * rows {
            for place in 0..PLACES * PLACES {
                let u = (index % columns) * tile + (place % PLACES) * spacing;
                let v = (index / columns) * tile + (place / PLACES) * spacing;
                if !boxes.at(u, v)
                    && let Some(place) = mean_place([u, v], side, frame, sensor)
                {
                    self.places.push((index, place));
                }
            }
        }
    }

    /// Standard deviation of the distance between what a view and the frame read in a tile, metres; infinite
    /// when the view sees too few tiles.
    pub(crate) fn misfit(&mut self, view: &PastView, view_from_camera: &Pose, sensor: &SensorModel) -> f64 {
        self.means.clear();
        for tile in self.places.chunk_by(|a, b| a.0 == b.0) {
            let (mut read, mut sum) = (0, 0.0);
            for (_, place) in tile {
                let displacement = view.displacement(view_from_camera.transform_point(*place), sensor);
                if let Some(displacement) = displacement.filter(|displacement| displacement.is_finite()) {
                    read += 1;
                    sum += displacement;
                }
            }
            if read >= LEAST_READ {
                self.means.push((sum / read as f64).abs());
            }
        }
        if self.means.len() < LEAST_TILES {
            return f64::INFINITY;
        }
        let middle = self.means.len() / 2;
        *self.means.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::{DepthImage, PinholeCamera, SplitMix64};
    use dymlm_test_support::normal;

    use super::*;
    use crate::PastViews;

    const WIDTH: usize = 640;
    const HEIGHT: usize = 480;

    /// A wall 2 m ahead of the first pose, read with the sensor's noise from a camera that has moved towards
    /// it. In the columns that `hides` names something is before it, and moves.
    fn frame(time: f64, moved: f64, hides: impl Fn(usize) -> bool) -> Frame {
        let camera = PinholeCamera::new(WIDTH, HEIGHT, 525.0, 525.0, 319.5, 239.5).unwrap();
        let (sensor, mut random) = (SensorModel::kinect(), SplitMix64::new(7 + time as u64));
        let depth = (0..WIDTH * HEIGHT).map(|pixel| {
            let z = if hides(pixel % WIDTH) { 1.5 - 0.05 * time } else { 2.0 - moved };
            (z + normal(&mut random) * f64::from(sensor.sigma(z as f32))) as f32
        });
        let depth = DepthImage::new(WIDTH, HEIGHT, depth.collect()).unwrap();
        Frame::new(time, camera, depth, None).unwrap()
    }

    /// The misfit that is measured when a pose errs by so much along the view.
    fn misfit(error: f64, boxes: &Mask, hides: impl Fn(usize) -> bool) -> f64 {
        let sensor = SensorModel::kinect();
        let at = |z: f64| Pose::new([0.0, 0.0, z], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let mut past = PastViews::default();
        past.remember(&frame(0.0, 0.0, &hides), &at(0.0), &sensor);
        past.measure_misfits(&frame(2.0, 0.1, &hides), &at(0.1 + error), boxes, &sensor);
        past.iter().next().unwrap().misfit()
    }

    #[test]
    fn the_error_of_a_pose_is_measured() {
        let nothing = Mask::filled(WIDTH, HEIGHT, false).unwrap();
        assert!(misfit(0.0, &nothing, |_| false) < 0.001);
        for error in [-0.01, 0.005, 0.02] {
            let measured = misfit(error, &nothing, |_| false) * MEDIAN;
            assert!((measured - error.abs()).abs() < 0.001, "{measured} for {error}");
        }
    }

    #[test]
    fn what_moves_in_a_few_tiles_or_in_a_box_is_no_error_of_the_pose() {
        let nothing = Mask::filled(WIDTH, HEIGHT, false).unwrap();
        assert!(misfit(0.0, &nothing, |u| u < WIDTH / 4) < 0.001);
        let mut boxes = nothing.clone();
        (0..HEIGHT).for_each(|v| boxes.fill_row(v, 0..3 * WIDTH / 5, true));
        assert!(misfit(0.0, &boxes, |u| u < 3 * WIDTH / 5) < 0.001);
    }

    #[test]
    fn too_few_tiles_tell_nothing() {
        let nothing = Mask::filled(WIDTH, HEIGHT, false).unwrap();
        assert!(misfit(0.0, &nothing.inverted(), |_| false).is_infinite());
        // What the frame reads would lie hidden behind what the view has read.
        assert!(misfit(3.0, &nothing, |_| false).is_infinite());
    }
}
