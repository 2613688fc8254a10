//! The state of a map in parts: one for each block of voxels, and one for each block of the evidence.
//!
//! A frame changes a fraction of the blocks that it sees, and each save writes those. They are coded in bits:
//! deflating numbers takes several times as long, and saves less.
//!
//! What is only cached is not saved: verdicts and the static cloud are made again when they are asked for.

mod cells;
mod cloud_loader;
mod counts;
mod evidence;
mod number_code;
mod saved_blocks;
mod saved_cloud;
mod voxel_code;
mod voxels;

use std::collections::BTreeSet;

use dymlm_core::{SensorModel, StateSink, encode_part};
use serde::{Deserialize, Serialize};

use crate::block_store::{BlockKey, BlockStore};
use crate::paging::Block;
use crate::{CloudMap, CloudMapConfig, Error};
pub use cloud_loader::CloudLoader;
use evidence::evidence_of;
use saved_blocks::SavedBlocks;
pub use saved_cloud::SavedCloud;
use voxels::voxels_of;

/// What a part holds, in the lowest bit of its key; the others are the block's.
const VOXELS: u64 = 0;
const EVIDENCE: u64 = 1;
/// The key of what belongs to no place: that of a block which no reading reaches.
const HEAD: u64 = BlockKey::LAST.number() << 1 | 1;

/// Number of parts that are encoded before they are written: enough for all threads, and few enough that they
/// take little memory, about 2 kB each.
const BATCH: usize = 2048;

/// More frames than come in two years.
const MOST_FRAMES: u32 = 1 << 31;

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Head {
    frames: u32,
    epoch: i32,
    revision: u32,
    /// Number of blocks of voxels, and of evidence: none may be missing.
    blocks: [usize; 2],
}

impl CloudMap {
    /// Gives to `sink` the parts of the map that differ from those of an earlier [saved](SavedCloud) state, or
    /// all parts without an earlier state.
    ///
    /// # Errors
    ///
    /// Those of `sink`.
    pub fn save_state(&self, earlier: Option<&SavedCloud>, sink: &mut StateSink<'_>) -> std::io::Result<()> {
        let (voxels, evidence) = (&self.voxels, &self.evidence);
        let changed = changed_blocks(voxels, earlier.map(|earlier| &earlier.voxels));
        save_blocks(changed, VOXELS, |block| voxels_of(block, voxels), sink)?;
        let mut changed = changed_blocks(evidence.blocks(), earlier.map(|earlier| &earlier.evidence));
        // A block that was looked at without any change in it has another revision.
        changed.extend(earlier.into_iter().flat_map(|earlier| earlier.evidence.noted_in(evidence.blocks())));
        save_blocks(changed, EVIDENCE, |block| evidence_of(block, evidence), sink)?;
        let head = self.head();
        if earlier.is_some_and(|earlier| earlier.head == head) {
            return Ok(());
        }
        sink(HEAD, Some(&encode_part(&head)?))
    }

    fn head(&self) -> Head {
        Head {
            frames: self.frames(),
            epoch: self.evidence.newest(),
            revision: self.evidence.revision(),
            blocks: self.block_numbers(),
        }
    }

    /// How many blocks of voxels and of the evidence there are.
    fn block_numbers(&self) -> [usize; 2] {
        [self.voxels.keys().len(), self.evidence.blocks().keys().len()]
    }

    /// Restores the map from its parts, in any order, to the bit.
    ///
    /// # Errors
    ///
    /// [`Error::Config`]; [`Error::State`] names a part that is damaged, or says that some are missing.
    pub fn load_state(
        config: CloudMapConfig,
        sensor: SensorModel,
        parts: impl IntoIterator<Item = (u64, Vec<u8>)>,
    ) -> Result<Self, Error> {
        let mut loader = CloudLoader::new(config, sensor)?;
        for (part, bytes) in parts {
            loader.load(part, &bytes)?;
        }
        loader.finish()
    }
}

/// Encodes some blocks, on rayon's threads (feature `parallel`), and gives them to `sink` by key.
fn save_blocks(
    blocks: BTreeSet<BlockKey>,
    kind: u64,
    encode: impl Fn(BlockKey) -> Option<Vec<u8>> + Send + Sync,
    sink: &mut StateSink<'_>,
) -> std::io::Result<()> {
    let blocks: Vec<BlockKey> = blocks.into_iter().collect();
    for batch in blocks.chunks(BATCH) {
        for (block, part) in crate::parallel::map(batch.to_vec(), |block| (block, encode(block))) {
            sink(block.number() << 1 | kind, part.as_deref())?;
        }
    }
    Ok(())
}

/// The blocks in which a store differs from an earlier one, also those that are gone; all without an earlier
/// one.
fn changed_blocks<B: Block>(store: &BlockStore<B>, earlier: Option<&SavedBlocks>) -> BTreeSet<BlockKey> {
    match earlier {
        Some(earlier) => earlier.changed_in(store).collect(),
        None => store.keys().iter().copied().collect(),
    }
}
