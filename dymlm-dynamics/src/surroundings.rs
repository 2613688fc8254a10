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
