use crate::{CloudMap, block_store::BlockStore};

/// The memory of a map, counted a part of its blocks a frame: a count of all at once would be a pause that
/// grows with the map.
#[derive(Debug, Default)]
pub(super) struct MemoryCount {
    /// Bytes of the blocks that have been counted.
    bytes: usize,
    /// How many blocks of voxels, with their static points, and of the evidence, with their verdicts.
    voxels: usize,
    evidence: usize,
}

impl MemoryCount {
    /// Counts blocks up to a share of all, which is 1 in the last call: new blocks come last, so that none is
    /// left out.
    pub(super) fn go_on(&mut self, map: &CloudMap, share: f64) {
        let to = |blocks: usize| (blocks as f64 * share) as usize;
        let voxels = self.voxels..to(map.voxels.blocks().len());
        let evidence = self.evidence..to(map.evidence.blocks().blocks().len());
        (self.voxels, self.evidence) = (voxels.end, evidence.end);
        self.bytes += map.block_bytes(evidence, voxels);
    }

    /// Bytes of the map; the next count begins.
    pub(super) fn finish(&mut self, map: &CloudMap) -> usize {
        std::mem::take(self).bytes + map.list_bytes()
    }
}

impl CloudMap {
    /// Bytes of memory of some blocks of the evidence and of voxels, by their slots, with what is known of
    /// them.
    pub(crate) fn block_bytes(
        &self,
        evidence: impl IntoIterator<Item = usize> + Clone,
        voxels: impl IntoIterator<Item = usize> + Clone,
    ) -> usize {
        let kept = self.kept.block_bytes(evidence.clone(), voxels.clone());
        let evidence: usize = evidence.into_iter().map(|slot| self.evidence.block_bytes(slot)).sum();
        let blocks = voxels.into_iter().filter_map(|slot| self.voxels.blocks().get(slot));
        let voxels = blocks.map(|block| block.memory_bytes_beside(None, |block, _| block.memory_bytes()));
        kept + evidence + voxels.sum::<usize>()
    }

    /// Bytes of all but the blocks.
    pub(crate) fn list_bytes(&self) -> usize {
        self.voxels.list_bytes_beside(&BlockStore::default())
            + self.evidence.list_bytes()
            + self.kept.list_bytes()
            + self.scratch.memory_bytes()
    }
}
