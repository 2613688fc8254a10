use dymlm_core::PlaneId;

use super::PlaneMap;

/// Forgetting what is far.
impl PlaneMap {
    /// Forgets what lies farther than `radius` metres from `center`: the map is as if no key frame had seen it.
    /// What a key frame has seen of one plane is forgotten as a whole, when no part of it lies within the
    /// radius; so planes go, and of a large plane all but what was seen from near.
    ///
    /// Key frames of which nothing is left can be taken out no more. Merges of planes stay. O(all that the key
    /// frames have seen).
    pub fn forget_outside(&mut self, center: [f64; 3], radius: f64) {
        let voxel_size = self.config.voxel_size;
        let (mut gone, mut touched) = (Vec::new(), Vec::<PlaneId>::new());
        for key_frame in self.key_frames.values_mut() {
            let pose = key_frame.world_from_camera;
            let outside =
                key_frame.shares.extract_if(.., |share| share.is_outside(&pose, voxel_size, center, radius));
            gone.extend(outside.map(|share| (share, pose)));
        }
        for (share, pose) in gone {
            self.subtract(&share, &pose);
            touched.push(self.resolve(share.plane));
        }
        touched.sort_unstable();
        touched.dedup();
        self.recount(&touched);
        let known = &self.planes;
        for key_frame in self.key_frames.values_mut() {
            let is_known = |id: &PlaneId| known.contains_key(&super::resolve(&self.merged, *id));
            key_frame.missed.retain(is_known);
            key_frame.gap_looks.retain(|(pair, _)| pair.iter().all(is_known));
            key_frame.merges.retain(|merge| is_known(&merge.merge.into));
        }
        let is_empty = |frame: &super::KeyFrame| frame.shares.is_empty() && frame.merges.is_empty();
        self.key_frames.retain(|_, key_frame| !is_empty(key_frame));
        let merged = self.merged.clone();
        self.merged.retain(|_, into| self.planes.contains_key(&super::resolve(&merged, *into)));
        self.collect_gaps();
    }
}
