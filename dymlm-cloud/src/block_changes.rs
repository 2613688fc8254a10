use dymlm_core::{Point, Rgb};

use crate::CloudMap;
use crate::block_store::BlockKey;

/// All static points of a block of 8^3 voxels.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct CloudBlock {
    /// Place of the block: its lowest corner is this times 8 voxels.
    pub place: [i32; 3],
    /// Metres, world; empty when nothing static is left in the block.
    pub points: Vec<Point>,
    /// Colours of the first of these points, as many as have one.
    pub colors: Vec<Rgb>,
}

impl CloudMap {
    /// The blocks in which the static cloud differs from that of an earlier map, as they are now: replacing
    /// them in a copy of the earlier cloud gives this one. They come in the order of the slots that a map
    /// gives its blocks when it first meets them.
    ///
    /// Where the earlier map was cloned from a state that this one has gone on from, O(blocks / 64) comparisons of
    /// pointers, and what has changed; else O(points).
    pub fn changes_since(&self, earlier: &Self) -> Vec<CloudBlock> {
        let (new, old) = (self.kept_cloud(), earlier.kept_cloud());
        // Of two clones that both went on, each may have another block at a slot.
        let has_same_slots = self.is_clone_of(earlier) && self.voxels.begins_with(&earlier.voxels);
        let has_changed = |slot: &usize| {
            let key = self.voxels.keys()[*slot];
            match if has_same_slots { Some(*slot) } else { earlier.voxels.slot(key) } {
                Some(before) => !new.has_same_points(*slot, &old, before),
                None => new.has_points(*slot),
            }
        };
        let block = |slot: usize| {
            let (points, colors) = new.copied(slot);
            CloudBlock { place: self.voxels.keys()[slot].block(), points, colors }
        };
        let mut changes: Vec<CloudBlock> = if has_same_slots {
            new.unshared(&old).filter(has_changed).map(block).collect()
        } else {
            (0..self.voxels.keys().len()).filter(has_changed).map(block).collect()
        };
        if !has_same_slots {
            let gone = earlier.voxels.keys().iter().enumerate();
            let gone = gone.filter(|(slot, key)| self.voxels.slot(**key).is_none() && old.has_points(*slot));
            let empty =
                |key: BlockKey| CloudBlock { place: key.block(), points: Vec::new(), colors: Vec::new() };
            changes.extend(gone.map(|(_, &key)| empty(key)));
        }
        changes
    }
}
