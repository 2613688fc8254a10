//! The state of a map in parts, by cubes of 4 x 4 x 4 blocks: two parts for the voxels in a cube, one for the
//! evidence.
//!
//! What is only cached is not saved: verdicts and the static cloud are made again when they are asked for.

mod counts;
mod evidence;
mod sums;
mod voxels;

use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::{DamagedState, SensorModel, StateSink, decode_part, encode_part};
use serde::{Deserialize, Serialize};

use crate::block_store::{BlockKey, BlockStore, CUBE_BLOCKS};
use crate::paging::Block;
use crate::{CloudMap, CloudMapConfig, Error};
use evidence::SavedEvidence;
use voxels::SavedVoxels;

/// What a part holds, in two bits of its key.
const VOXELS: u64 = 0;
/// The rests of the voxels' sums, which no compression makes smaller.
const RESTS: u64 = 1;
const EVIDENCE: u64 = 2;
/// What belongs to no place.
const HEAD: u64 = 3;

/// More frames than come in two years.
const MOST_FRAMES: u32 = 1 << 31;

#[derive(Serialize, Deserialize)]
struct Head {
    frames: u32,
    epoch: i32,
    revision: u32,
    /// Number of cubes with voxels, and with evidence: none may be missing.
    cubes: [usize; 2],
}

impl CloudMap {
    /// Gives to `sink` the parts of the map that differ from those of an earlier state, or all parts without
    /// an earlier state. What the two states share is skipped.
    ///
    /// # Errors
    ///
    /// Those of `sink`.
    pub fn save_state(&self, earlier: Option<&Self>, sink: &mut StateSink<'_>) -> std::io::Result<()> {
        let evidence = &self.evidence;
        for cube in changed_cubes(&self.voxels, earlier.map(|earlier| &earlier.voxels), &[]) {
            let (saved, rests) = SavedVoxels::of(cube, &self.voxels).unzip();
            let saved = saved.map(|saved| encode_part(&saved)).transpose()?;
            sink(part_of(cube, VOXELS), saved.as_deref())?;
            sink(part_of(cube, RESTS), rests.as_deref())?;
        }
        let noted = earlier.map_or_else(Vec::new, |earlier| evidence.noted_since(&earlier.evidence));
        let before = earlier.map(|earlier| earlier.evidence.blocks());
        for cube in changed_cubes(evidence.blocks(), before, &noted) {
            let saved = SavedEvidence::of(cube, evidence);
            sink(part_of(cube, EVIDENCE), saved.map(|saved| encode_part(&saved)).transpose()?.as_deref())?;
        }
        let head = encode_part(&self.head())?;
        let is_known = match earlier {
            Some(earlier) => encode_part(&earlier.head())? == head,
            None => false,
        };
        if is_known { Ok(()) } else { sink(HEAD, Some(&head)) }
    }

    fn head(&self) -> Head {
        Head {
            frames: self.frames(),
            epoch: self.evidence.epoch(),
            revision: self.evidence.revision(),
            cubes: [cubes_of(&self.voxels).len(), cubes_of(self.evidence.blocks()).len()],
        }
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
        let mut map = Self::new(config, sensor)?;
        let mut by_key: BTreeMap<u64, Vec<u8>> = BTreeMap::new();
        for (part, bytes) in parts {
            if by_key.insert(part, bytes).is_some() {
                return Err(DamagedState::new(part, "it is there twice").into());
            }
        }
        let head = by_key.remove(&HEAD).ok_or_else(|| DamagedState::new(HEAD, "it is missing"))?;
        let Head { frames, epoch, revision, cubes } = decode_part(HEAD, &head)?;
        while let Some((part, bytes)) = by_key.pop_first() {
            let damaged = |what: &str| DamagedState::new(part, what);
            let cube = cube_of(part).ok_or_else(|| damaged("no such place"))?;
            let is_right = match part & 3 {
                VOXELS => {
                    let rests = by_key.remove(&part_of(cube, RESTS));
                    let rests = rests.ok_or_else(|| damaged("the rests of its sums are missing"))?;
                    decode_part::<SavedVoxels>(part, &bytes)?.put_into(cube, &rests, &mut map)
                }
                EVIDENCE => decode_part::<SavedEvidence>(part, &bytes)?.put_into(cube, &mut map.evidence),
                _ => None,
            };
            is_right.ok_or_else(|| damaged("numbers that no map holds"))?;
        }
        if frames.max(revision) >= MOST_FRAMES {
            return Err(DamagedState::new(HEAD, "more frames than a map can have taken in").into());
        }
        map.restore(frames, epoch, revision);
        let found = map.head().cubes;
        if found != cubes {
            let what = format!("{cubes:?} cubes of voxels and of evidence, but {found:?} are there");
            return Err(DamagedState::new(HEAD, what).into());
        }
        Ok(map)
    }
}

/// The key of a part. The lowest two bits of a cube's coordinates are zero, which leaves room for the kind.
fn part_of(cube: BlockKey, kind: u64) -> u64 {
    cube.number() << 1 | kind
}

fn cube_of(part: u64) -> Option<BlockKey> {
    let key = BlockKey::of_number(part >> 1 & !1);
    (key.in_cube().0 == key).then_some(key)
}

/// The blocks of a cube that are there, each with its place in the cube and its slot.
fn blocks_of<B: Block>(cube: BlockKey, store: &BlockStore<B>) -> impl Iterator<Item = (usize, usize)> {
    (0..CUBE_BLOCKS).filter_map(move |place| Some((place, store.slot(cube.of_cube(place))?)))
}

fn cubes_of<B: Block>(store: &BlockStore<B>) -> BTreeSet<BlockKey> {
    store.keys().iter().map(|key| key.in_cube().0).collect()
}

/// The cubes in which a store differs from an earlier one, and the cubes of some more of its blocks.
fn changed_cubes<B: Block>(
    store: &BlockStore<B>,
    earlier: Option<&BlockStore<B>>,
    more: &[BlockKey],
) -> BTreeSet<BlockKey> {
    let Some(earlier) = earlier else { return cubes_of(store) };
    let changed = store.changed_since(earlier).chain(earlier.gone_from(store));
    changed.chain(more.iter().copied()).map(|key| key.in_cube().0).collect()
}
