use crate::CloudMap;
use crate::block_store::BLOCK_CELLS;

/// Greatest [`Opinion::presence`](crate::opinion::Opinion), of -10 to 10, of a cell that is clearly free.
const CLEARLY_FREE: f32 = -5.0;

impl CloudMap {
    /// Whether a place (metres, world) has been free for long, and nothing static stood within `margin`
    /// metres of it: then a new reading there is of something that moves, or of something that has just come
    /// to stay. `false` for places that were never looked through, and for a margin below 0. Costs O(periods)
    /// for a place that was not free, else as much for each cell within the margin or, if these are fewer,
    /// each cell of the map.
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
        let stands = |cell: [i32; 3]| {
            let opinion = self.evidence.settled_opinion(cell, self.config.looks_per_reading as f32);
            opinion.is_some_and(|opinion| opinion.is_static())
        };
        let reach = (margin / self.evidence.cell_size()).ceil();
        let keys = self.evidence.blocks().keys();
        if (2.0 * reach + 1.0).powi(3) > (keys.len() * BLOCK_CELLS) as f64 {
            let is_within =
                |other: &[i32; 3]| (0..3).all(|axis| f64::from(cell[axis].abs_diff(other[axis])) <= reach);
            let mut cells = keys.iter().flat_map(|key| (0..BLOCK_CELLS).map(|index| key.cell(index)));
            return !cells.any(|other| is_within(&other) && stands(other));
        }
        let steps = -(reach as i32)..=reach as i32;
        let mut around = steps.clone().flat_map(|z| {
            let steps = steps.clone();
            steps.clone().flat_map(move |y| steps.clone().map(move |x| [x, y, z]))
        });
        !around.any(|step| stands([0, 1, 2].map(|axis| cell[axis] + step[axis])))
    }
}
