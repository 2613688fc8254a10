use dymlm_core::{DamagedState, SensorModel, decode_part};

use super::evidence::put_evidence;
use super::voxels::put_voxels;
use super::{EVIDENCE, HEAD, Head, MOST_FRAMES};
use crate::block_store::BlockKey;
use crate::{CloudMap, CloudMapConfig, CloudPager, Error};

/// Puts a saved map together from its parts, which come in any order. What has come can be paged out meanwhile, so
/// that a map can be loaded that is larger than its memory budget.
#[derive(Debug)]
pub struct CloudLoader {
    map: CloudMap,
    head: Option<Head>,
    /// Blocks of voxels and of the evidence that have been paged out, which come first, and bytes of the others.
    paged_out: [usize; 2],
    in_memory: usize,
    /// The bytes of the others at which it is looked again whether they have room: a look goes through the lists of all
    /// blocks.
    next_look: usize,
}

/// Bytes between two looks. Fewer are not worth a write either.
const PORTION: usize = 1 << 20;

impl CloudLoader {
    /// A loader that has no part yet.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    pub fn new(config: CloudMapConfig, sensor: SensorModel) -> Result<Self, Error> {
        let map = CloudMap::new(config, sensor)?;
        Ok(Self { map, head: None, paged_out: [0; 2], in_memory: 0, next_look: PORTION })
    }

    /// Takes in a part, by its key.
    ///
    /// # Errors
    ///
    /// [`Error::State`] names a part that is damaged, or that has come before.
    pub fn load(&mut self, part: u64, bytes: &[u8]) -> Result<(), Error> {
        let damaged = |what: &str| Error::from(DamagedState::new(part, what));
        let (key, is_evidence) = (BlockKey::of_number(part >> 1), part & 1 == EVIDENCE);
        let is_there = match part {
            HEAD => self.head.is_some(),
            _ if is_evidence => self.map.evidence.blocks().slot(key).is_some(),
            _ => self.map.voxels.slot(key).is_some(),
        };
        if is_there {
            return Err(damaged("it is there twice"));
        }
        if part == HEAD {
            self.head = Some(decode_part(HEAD, bytes)?);
            return Ok(());
        }
        let [voxels, evidence] = self.map.block_numbers();
        let put = if is_evidence {
            put_evidence(bytes, key, &mut self.map.evidence)
        } else {
            put_voxels(bytes, key, &mut self.map)
        };
        put.ok_or_else(|| damaged("numbers that no map holds"))?;
        let [more_voxels, more_evidence] = self.map.block_numbers();
        self.in_memory += self.map.block_bytes(evidence..more_evidence, voxels..more_voxels);
        Ok(())
    }

    /// Pages out the blocks that have come, when the map takes more than `budget` bytes of memory. Call it after each
    /// part. What stays are some 100 bytes for each block, whatever the budget.
    ///
    /// # Errors
    ///
    /// Those of writing, on a full disk, for example.
    pub fn page_out(&mut self, pager: &mut CloudPager, budget: usize) -> std::io::Result<()> {
        // Other maps may have put pages into it already.
        pager.file_of(&mut self.map);
        if self.in_memory < self.next_look {
            return Ok(());
        }
        if self.in_memory + self.map.list_bytes() <= budget {
            self.next_look = self.in_memory + PORTION;
            return Ok(());
        }
        let [voxels, evidence] = self.paged_out;
        pager.page_out_from(&mut self.map, voxels, evidence)?;
        self.paged_out = self.map.block_numbers();
        (self.in_memory, self.next_look) = (0, PORTION);
        Ok(())
    }

    /// The map.
    ///
    /// # Errors
    ///
    /// [`Error::State`] when parts are missing, or do not belong together.
    pub fn finish(self) -> Result<CloudMap, Error> {
        let Self { mut map, head, .. } = self;
        let damaged = |what: &str| Error::from(DamagedState::new(HEAD, what));
        let Head { frames, epoch, revision, blocks } = head.ok_or_else(|| damaged("it is missing"))?;
        if frames.max(revision) >= MOST_FRAMES {
            return Err(damaged("more frames than a map can have taken in"));
        }
        map.restore(frames, epoch, revision);
        let found = map.block_numbers();
        if found != blocks {
            return Err(damaged(&format!(
                "{blocks:?} blocks of voxels and of evidence, but {found:?} are there"
            )));
        }
        Ok(map)
    }
}
