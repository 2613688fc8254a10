use crate::CloudMap;
use crate::block_store::{BLOCK_SIDE, BlockKey, for_each_bit};

/// Greatest [`Opinion::presence`](crate::opinion::Opinion), of -10 to 10, of a cell that is clearly free.
const CLEARLY_FREE: f32 = -5.0;

impl CloudMap {
    /// Whether a place (metres, world) has been free for long, and nothing static stood within `margin`
    /// metres of it: then a new reading there is of something that moves, or of something that has just come
    /// to stay. `false` for places that were never looked through, and for a margin below 0. Costs O(periods)
    /// for a place that was not free, else as much for each cell within the margin in which a surface was
    /// ever read, and a look-up for each block of cells there, or for each block of the map if these are
    /// fewer.
    ///
    /// The readings of the last seconds do not count where there are older ones: they may be of the very
    /// thing that is in question.
    ///
    /// This is the free space of Dynablox (Schmid 2023), which finds movers of any kind.
    pub fn is_long_free(&self, place: [f64; 3], margin: f64) -> bool {
        let Some(voxel) = self.voxel_at(place).filter(|_| margin >= 0.0) else { return false };
        let cell = self.evidence.cell_at(voxel);
        // A reading and a look through count alike: the place in question is not the rim of a thing.
        let opinion = self.evidence.settled_opinion(cell, 1.0);
        if opinion.is_none_or(|opinion| opinion.presence > CLEARLY_FREE) {
            return false;
        }
        // Casts saturate.
        let reach = (margin / self.evidence.cell_size()).ceil() as i32;
        let ends = [cell.map(|c| c.saturating_sub(reach)), cell.map(|c| c.saturating_add(reach))];
        let [low, high] = ends.map(|end| end.map(|c| c.div_euclid(BLOCK_SIDE as i32)));
        let blocks: f64 = (0..3).map(|axis| f64::from(high[axis]) - f64::from(low[axis]) + 1.0).product();
        let keys = self.evidence.blocks().keys();
        if blocks > keys.len() as f64 {
            return !keys.iter().any(|&key| self.has_static_cell(key, ends));
        }
        let [xs, ys, zs] = [0, 1, 2].map(|axis| low[axis]..=high[axis]);
        let mut around = zs.flat_map(|z| {
            let xs = xs.clone();
            ys.clone().flat_map(move |y| xs.clone().map(move |x| BlockKey::new([x, y, z])))
        });
        !around.any(|key| self.has_static_cell(key, ends))
    }

    /// Whether a static thing stood, before the newest epoch, in a cell of this block of the evidence,
    /// from the lowest of two cells to the highest.
    fn has_static_cell(&self, key: BlockKey, [low, high]: [[i32; 3]; 2]) -> bool {
        let Some(block) = self.evidence.blocks().get(key) else { return false };
        let looks_per_reading = self.config.looks_per_reading as f32;
        let is_within = |cell: [i32; 3]| (0..3).all(|axis| (low[axis]..=high[axis]).contains(&cell[axis]));
        let mut stands = false;
        // Where nothing was ever read, nothing is static.
        for_each_bit(block.cells_read(), |index| {
            stands = stands
                || is_within(key.cell(index))
                    && self.evidence.settled_opinion_in(block, index, looks_per_reading).is_static();
        });
        stands
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose, SensorModel, SplitMix64};

    use super::*;
    use crate::CloudMapConfig;

    /// Looks at all cells within the margin, one by one.
    fn is_long_free(map: &CloudMap, place: [f64; 3], margin: f64) -> bool {
        let cell = map.evidence.cell_at(map.voxel_at(place).unwrap());
        let is_free = |opinion: Option<crate::opinion::Opinion>| {
            opinion.is_some_and(|opinion| opinion.presence <= CLEARLY_FREE)
        };
        let reach = (margin / map.evidence.cell_size()).ceil() as i32;
        let side = 2 * reach + 1;
        let stands = |number: i32| {
            let step = [number % side, number / side % side, number / side / side].map(|c| c - reach);
            let other = [0, 1, 2].map(|axis| cell[axis] + step[axis]);
            let opinion = map.evidence.settled_opinion(other, map.config.looks_per_reading as f32);
            opinion.is_some_and(|opinion| opinion.is_static())
        };
        is_free(map.evidence.settled_opinion(cell, 1.0)) && !(0..side.pow(3)).any(stands)
    }

    #[test]
    fn the_margin_is_free_as_by_looking_at_all_cells() {
        let mut random = SplitMix64::new(5);
        let config = CloudMapConfig { voxel_size: 0.02, ..CloudMapConfig::default() };
        let mut map = CloudMap::new(config, SensorModel::kinect()).unwrap();
        let camera = PinholeCamera::new(64, 48, 55.0, 55.0, 31.5, 23.5).unwrap();
        for step in 0..40 {
            // A wall with a post before it on the left, and somebody in the last frames.
            let depth = |i: usize| match i % 64 {
                10..14 => 1.5,
                40..50 if step > 30 => 1.2,
                _ => 2.6,
            };
            let depth = DepthImage::new(64, 48, (0..64 * 48).map(depth).collect()).unwrap();
            let frame = Frame::new(0.1 * f64::from(step), camera, depth, None).unwrap();
            map.insert(&frame, None, &Pose::identity()).unwrap();
        }
        let mut free = 0;
        for _ in 0..600 {
            let [x, y, z] = [0, 1, 2].map(|_| random.fraction());
            let depth = 0.8 + 1.9 * z;
            let place = [depth * (x - 0.5), 0.8 * depth * (y - 0.5), depth];
            let margin = 0.5 * random.fraction().powi(2);
            let is_free = map.is_long_free(place, margin);
            assert_eq!(is_free, is_long_free(&map, place, margin), "{place:?}, {margin} m");
            free += usize::from(is_free);
        }
        assert!((100..500).contains(&free), "{free}");
    }
}
