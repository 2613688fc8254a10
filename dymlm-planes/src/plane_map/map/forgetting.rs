use dymlm_core::Birth;

use super::super::key_frame::KeyFrame;
use super::PlaneMap;

/// Forgetting of what is far away.
impl PlaneMap {
    /// Forgets what lies farther than `radius` metres from `center` (world), as if no key frame had seen it.
    /// A key frame's share of a plane is forgotten as a whole, if no part of it lies within the radius. So
    /// distant planes disappear, and of a large plane all that was not seen from near.
    ///
    /// Key frames of which nothing is left can no longer be removed. Merges of planes stay. O(all that the
    /// key frames have seen).
    pub fn forget_outside(&mut self, center: [f64; 3], radius: f64) {
        let (mut touched, mut key_frames) = (Vec::new(), std::mem::take(&mut self.key_frames));
        key_frames.renew(|key_frame| {
            let mut key_frame = key_frame.clone();
            let outside = key_frame.take_outside(center, radius, self.config.voxel_size);
            touched.extend(outside.iter().map(|share| self.resolve(share.plane)));
            self.subtract(&key_frame, &outside);
            (!outside.is_empty()).then_some(key_frame)
        });
        self.key_frames = key_frames;
        touched.sort_unstable();
        touched.dedup();
        self.recount(&touched);
        let is_there = |plane: Birth| self.planes.contains_key(&plane) || self.dropped.contains_key(&plane);
        let is_known = |plane: &Birth| is_there(self.merged.current(*plane));
        self.key_frames.renew(|before| {
            let mut key_frame = before.clone();
            key_frame.missed.retain(is_known);
            key_frame.gap_looks.retain(|(pair, _)| pair.iter().all(is_known));
            key_frame.merges.retain(|merge| is_known(&merge.merge.into));
            let lengths = |of: &KeyFrame| [of.missed.len(), of.gap_looks.len(), of.merges.len()];
            (lengths(&key_frame) != lengths(before)).then_some(key_frame)
        });
        // One that has only missed planes, or seen gaps, speaks of planes that are there.
        let is_empty = |of: &KeyFrame| {
            of.shares.is_empty() && of.missed.is_empty() && of.gap_looks.is_empty() && of.merges.is_empty()
        };
        self.key_frames.retain(|key_frame| !is_empty(key_frame));
        self.merged.retain(is_there);
        self.merged_ids.retain(|id| self.names.birth(id).is_some_and(is_there));
        self.names.retain(|plane| is_there(plane) || self.merged.has_merged(plane));
        self.index.shrink_bounds();
        self.collect_gaps();
    }
}
