use crate::CloudMap;
use crate::evidence::Evidence;

/// How clearly a cell must be free, of [`Opinion::presence`](crate::opinion::Opinion)'s 10: a place that has
/// been free for long stays so until it was read in two epochs; one that was looked through a few times is
/// not free for long.
const CLEARLY_FREE: f32 = -5.0;

impl CloudMap {
    /// Whether a place (metres, world) has long been free, and nothing stands within `margin` metres of it: a
    /// new reading there is of something that moves, or of something that has just come to stay. `false` for
    /// places that were never looked through. Costs O(periods) for a place that is not free, and for others
    /// as much for each cell within the margin.
    ///
    /// This is the free space of Dynablox (Schmid 2023), which tells movers of any kind.
    pub fn is_long_free(&self, place: [f64; 3], margin: f64) -> bool {
        let Some(voxel) = self.voxel_at(place) else { return false };
        let cell = self.evidence.cell_at(voxel);
        let looks_per_reading = self.config.looks_per_reading as f32;
        if !is_free(&self.evidence, cell, looks_per_reading) {
            return false;
        }
        let reach = (margin / self.evidence.cell_size()).ceil() as i32;
        let steps = -reach..=reach;
        let mut around = steps.clone().flat_map(|z| {
            let steps = steps.clone();
            steps.clone().flat_map(move |y| steps.clone().map(move |x| [x, y, z]))
        });
        around.all(|step| {
            let neighbor = [0, 1, 2].map(|axis| cell[axis] + step[axis]);
            !self.evidence.opinion_at(neighbor, looks_per_reading).is_some_and(|opinion| opinion.is_static())
        })
    }
}

fn is_free(evidence: &Evidence, cell: [i32; 3], looks_per_reading: f32) -> bool {
    evidence.opinion_at(cell, looks_per_reading).is_some_and(|opinion| opinion.presence <= CLEARLY_FREE)
}
