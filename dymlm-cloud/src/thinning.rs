use crate::CloudMapConfig;
use crate::block_store::{BLOCK_SIDE, BlockKey, BlockStore, Neighbor, cell_in_block};
use crate::verdict::Verdict;
use crate::voxel::Voxel;
use crate::voxel_block::VoxelBlock;
use crate::weighting::Weighting;

/// Farthest that a voxel looks for heavier ones, voxels: no farther than the blocks around its own.
const MAX_RADIUS: i32 = BLOCK_SIDE as i32;
/// Voxels along the side of a window: a block and that radius on each side.
const WINDOW: usize = BLOCK_SIDE + 2 * MAX_RADIUS as usize;

/// A voxel with less than this share of the weight of one within its radius is noise: what is 1.4 standard
/// deviations off a surface has that share of readings. Less leaves a thicker shell of noise, more takes true
/// surfaces away (`a_far_noisy_surface_is_thinned_and_keeps_no_hole_whatever_the_sensor`).
const MIN_WEIGHT_SHARE: f32 = 0.4;

/// Tells which voxels hold only the noise of a surface beside them.
///
/// Readings of a surface scatter along the line of sight by sigma(z), at 4 m over many voxels: the true
/// surface is where most weight lies, and a shell of light voxels surrounds it. A voxel is noise when another
/// static voxel within [`thinning_radius`](CloudMapConfig::thinning_radius) standard deviations has more than
/// 1 / [`MIN_WEIGHT_SHARE`] times its weight. The deviation is that of the voxel's own readings: what was
/// seen from near is exact, reaches not even the next voxel, and is left alone, and two surfaces stay two as
/// long as they are further apart than that.
///
/// O(voxels x ball), cut off at the first heavier voxel; the nearest are asked first.
pub(crate) struct Thinning<'a> {
    config: &'a CloudMapConfig,
    weighting: &'a Weighting,
    blocks: &'a BlockStore<VoxelBlock>,
    /// For each slot the weights of the block's voxels, in its order; 0 for ghosts, which outweigh nothing.
    /// That of any other voxel is greater: those without a reading are dropped.
    weights: Vec<Vec<f32>>,
    /// Offsets in a window by ascending distance, each with its square in voxels.
    ball: Vec<Offset>,
}

#[derive(Debug, Clone, Copy)]
struct Offset {
    squared_distance: f32,
    step: isize,
}

impl<'a> Thinning<'a> {
    pub(crate) fn of(
        blocks: &'a BlockStore<VoxelBlock>,
        is_ghost: impl Fn([i32; 3]) -> bool,
        config: &'a CloudMapConfig,
        weighting: &'a Weighting,
    ) -> Self {
        let weights = |(&key, block): (&BlockKey, &VoxelBlock)| {
            let weight = |(place, voxel): (usize, &Voxel)| {
                if is_ghost(key.cell(place)) { 0.0 } else { weighting.total(voxel) as f32 }
            };
            block.iter().map(weight).collect()
        };
        Self {
            config,
            weighting,
            blocks,
            weights: blocks.keys().iter().zip(blocks.blocks()).map(weights).collect(),
            ball: ball(),
        }
    }

    /// The verdict on each voxel of the block at a slot, in its order.
    pub(crate) fn verdicts_of_block(&self, slot: usize) -> Vec<Verdict> {
        let key = self.blocks.keys()[slot];
        let mut window = None;
        let verdict = |((place, voxel), &weight): ((usize, &Voxel), &f32)| {
            if weight == 0.0 {
                return Verdict::Ghost;
            }
            if voxel.observations < self.config.min_observations {
                return Verdict::Noise;
            }
            let radius = self.radius_of(voxel);
            // Most voxels seen from near need no window.
            let is_noise = radius >= 1.0 && {
                let window = window.get_or_insert_with(|| self.window_around(key));
                self.is_outweighed(window, place, voxel, radius)
            };
            if is_noise { Verdict::Noise } else { Verdict::Static }
        };
        self.blocks.blocks()[slot].iter().zip(&self.weights[slot]).map(verdict).collect()
    }

    /// How far a voxel looks, voxels.
    fn radius_of(&self, voxel: &Voxel) -> f32 {
        let deviations =
            self.config.thinning_radius * self.weighting.standard_deviation(voxel) / self.config.voxel_size;
        (deviations as f32).min(MAX_RADIUS as f32)
    }

    fn is_outweighed(&self, window: &[f32], place: usize, voxel: &Voxel, radius: f32) -> bool {
        let [x, y, z] = cell_in_block(place).map(|c| (c + MAX_RADIUS) as usize);
        let center = (z * WINDOW + y) * WINDOW + x;
        let limit = self.weighting.total(voxel) as f32 / MIN_WEIGHT_SHARE;
        let within = self.ball.iter().take_while(|offset| offset.squared_distance <= radius * radius);
        within.map(|offset| window[center.wrapping_add_signed(offset.step)]).any(|weight| weight > limit)
    }

    /// The weights of the static voxels in and around a block.
    fn window_around(&self, key: BlockKey) -> Vec<f32> {
        let mut window = vec![0.0; WINDOW * WINDOW * WINDOW];
        for Neighbor { step, key } in key.neighborhood() {
            let Some(slot) = self.blocks.slot(key) else { continue };
            let voxels = self.blocks.blocks()[slot].iter().zip(&self.weights[slot]);
            for ((place, _), &weight) in voxels {
                let within = cell_in_block(place);
                let cell: [i32; 3] =
                    std::array::from_fn(|axis| within[axis] + step[axis] * BLOCK_SIDE as i32 + MAX_RADIUS);
                if cell.iter().all(|c| (0..WINDOW as i32).contains(c)) {
                    let [x, y, z] = cell.map(|c| c as usize);
                    window[(z * WINDOW + y) * WINDOW + x] = weight;
                }
            }
        }
        window
    }
}

/// Offsets to the cells of the largest ball, nearest first, without its centre.
fn ball() -> Vec<Offset> {
    let mut offsets = Vec::new();
    for z in -MAX_RADIUS..=MAX_RADIUS {
        for y in -MAX_RADIUS..=MAX_RADIUS {
            for x in -MAX_RADIUS..=MAX_RADIUS {
                let squared = x * x + y * y + z * z;
                if (1..=MAX_RADIUS * MAX_RADIUS).contains(&squared) {
                    let step = (z as isize * WINDOW as isize + y as isize) * WINDOW as isize + x as isize;
                    offsets.push(Offset { squared_distance: squared as f32, step });
                }
            }
        }
    }
    offsets.sort_by(|a, b| a.squared_distance.total_cmp(&b.squared_distance));
    offsets
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ball_is_whole_and_nearest_first() {
        let ball = ball();
        assert_eq!(ball.iter().filter(|offset| offset.squared_distance <= 1.0).count(), 6);
        assert_eq!(ball.iter().filter(|offset| offset.squared_distance <= 3.0).count(), 26);
        assert!(ball.is_sorted_by(|a, b| a.squared_distance <= b.squared_distance));
        // Point symmetric, so the steps cancel.
        assert_eq!(ball.iter().map(|offset| offset.step).sum::<isize>(), 0);
    }
}
