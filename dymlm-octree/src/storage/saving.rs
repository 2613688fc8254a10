//! A tree in parts: one for the leaves of each branch, one for each group of eight neighbouring blocks (16 x
//! 16 x 16 cells).

use std::collections::BTreeMap;
use std::sync::Arc;

use dymlm_core::{DamagedState, Rgb, StateSink, decode_part, encode_part};
use serde::{Deserialize, Serialize};

use super::colors::EntryColors;
use super::forgetting::corner_of;
use super::{Bits, Block, Branch, ENTRIES, Entry, ROOT_LEVEL, Tree, entry_of, for_each_bit, has};
use crate::lattice::Key;

/// Number of blocks in a part.
const GROUP: usize = 8;

/// The key of a branch's part, by its level and its lowest cell.
fn branch_part(level: u8, corner: Key) -> u64 {
    let [x, y, z] = corner.map(u64::from);
    u64::from(level) << 48 | z << 32 | y << 16 | x
}

/// The key of a part of blocks, by the lowest cell of their branch (level 1) and the entry of the first
/// block.
fn group_part(corner: Key, first: usize) -> u64 {
    branch_part(0, corner_of(corner, first, 8))
}

/// Level and lowest cell of what a part holds; `None` for a key that no part can have.
fn place_of(part: u64) -> Option<(u8, Key)> {
    let corner = [part as u16, (part >> 16) as u16, (part >> 32) as u16];
    let level = u8::try_from(part >> 48).ok().filter(|level| *level <= ROOT_LEVEL)?;
    let side = if level == 0 { 16 } else { 1_u32 << (3 * u32::from(level) + 3) };
    let is_corner = corner.iter().all(|&cell| u32::from(cell) % side == 0);
    is_corner.then_some((level, corner))
}

/// What a branch holds apart from the nodes below.
#[derive(Serialize, Deserialize)]
struct SavedBranch {
    leaves: Bits,
    children: Bits,
    values: Values,
    colors: Option<Vec<Rgb>>,
}

#[derive(Serialize, Deserialize)]
struct SavedBlock {
    /// Which of the part's eight blocks it is.
    place: u8,
    known: Bits,
    values: Values,
    colors: Option<Vec<Rgb>>,
}

/// Log-odds, bit by bit. They are clamped sums of few amounts, so that few different values occur.
#[derive(Serialize, Deserialize)]
enum Values {
    Few { values: Vec<u32>, indices: Vec<u8> },
    Many(Vec<u32>),
}

impl Values {
    fn new(values: Vec<f32>) -> Self {
        let bits: Vec<u32> = values.into_iter().map(f32::to_bits).collect();
        let mut few = bits.clone();
        few.sort_unstable();
        few.dedup();
        let index = |bits: &u32| few.binary_search(bits).ok().and_then(|index| u8::try_from(index).ok());
        match bits.iter().map(index).collect() {
            Some(indices) => Self::Few { values: few, indices },
            None => Self::Many(bits),
        }
    }

    /// The values; `None` when they are not `count` finite ones.
    fn get(self, count: usize) -> Option<Vec<f32>> {
        let bits: Vec<u32> = match self {
            Self::Few { values, indices } => indices
                .into_iter()
                .map(|index| values.get(usize::from(index)).copied())
                .collect::<Option<_>>()?,
            Self::Many(bits) => bits,
        };
        let values: Vec<f32> = bits.into_iter().map(f32::from_bits).collect();
        (values.len() == count && values.iter().all(|value| value.is_finite())).then_some(values)
    }
}

fn count(bits: &Bits) -> usize {
    bits.iter().map(|word| word.count_ones() as usize).sum()
}

fn entries(bits: &Bits) -> Vec<usize> {
    let mut entries = Vec::with_capacity(count(bits));
    for_each_bit(bits, |entry| entries.push(entry));
    entries
}

/// Whether all bits are entries of a branch; the root uses only its first eight.
fn is_within(bits: &Bits, level: u8) -> bool {
    level < ROOT_LEVEL || (bits[0] >> 8 == 0 && bits[1..].iter().all(|&word| word == 0))
}

/// Saving.
impl Tree {
    /// Gives to `sink` the parts that differ from those of an earlier tree.
    pub(crate) fn save(&self, earlier: Option<&Self>, sink: &mut StateSink<'_>) -> std::io::Result<()> {
        save_below(self.root(), earlier.map(Self::root), [0; 3], sink)
    }
}

/// At most five levels deep.
fn save_below(
    own: &Branch,
    earlier: Option<&Branch>,
    corner: Key,
    sink: &mut StateSink<'_>,
) -> std::io::Result<()> {
    if earlier.is_some_and(|earlier| std::ptr::eq(own, earlier)) {
        return Ok(());
    }
    let saved = encode_part(&SavedBranch::of(own))?;
    let is_known = match earlier {
        Some(earlier) => encode_part(&SavedBranch::of(earlier))? == saved,
        None => false,
    };
    if !is_known {
        sink(branch_part(own.level, corner), Some(&saved))?;
    }
    if own.level == 1 {
        return save_blocks(own, earlier, corner, sink);
    }
    for entry in 0..ENTRIES {
        let below = corner_of(corner, entry, own.side());
        match (own.entry(entry), earlier.map(|earlier| earlier.entry(entry))) {
            (Entry::Branch(own), Some(Entry::Branch(earlier))) => {
                save_below(own, Some(earlier), below, sink)?;
            }
            (Entry::Branch(own), _) => save_below(own, None, below, sink)?,
            (_, Some(Entry::Branch(earlier))) => remove_below(earlier, below, sink)?,
            _ => {}
        }
    }
    Ok(())
}

fn save_blocks(
    own: &Branch,
    earlier: Option<&Branch>,
    corner: Key,
    sink: &mut StateSink<'_>,
) -> std::io::Result<()> {
    for first in (0..ENTRIES).step_by(GROUP) {
        let places = first..first + GROUP;
        let is_same = |entry: usize| {
            let earlier = earlier.and_then(|earlier| earlier.block(entry));
            match (own.block(entry), earlier) {
                (Some(own), Some(earlier)) => Arc::ptr_eq(own, earlier),
                (own, earlier) => own.is_none() && earlier.is_none(),
            }
        };
        if places.clone().all(is_same) {
            continue;
        }
        let blocks = places.zip(0..).filter_map(|(entry, place)| Some((place, own.block(entry)?)));
        let saved: Vec<SavedBlock> = blocks.map(|(place, block)| SavedBlock::of(place, block)).collect();
        let part = group_part(corner, first);
        if saved.is_empty() { sink(part, None)? } else { sink(part, Some(&encode_part(&saved)?))? }
    }
    Ok(())
}

/// Removes the parts of a branch that no longer exists.
fn remove_below(earlier: &Branch, corner: Key, sink: &mut StateSink<'_>) -> std::io::Result<()> {
    sink(branch_part(earlier.level, corner), None)?;
    for entry in 0..ENTRIES {
        if let Entry::Branch(below) = earlier.entry(entry) {
            remove_below(below, corner_of(corner, entry, earlier.side()), sink)?;
        }
    }
    for first in (0..ENTRIES).step_by(GROUP) {
        if (first..first + GROUP).any(|entry| earlier.block(entry).is_some()) {
            sink(group_part(corner, first), None)?;
        }
    }
    Ok(())
}

impl SavedBranch {
    fn of(branch: &Branch) -> Self {
        let value = |entry: usize| match branch.entry(entry) {
            Entry::Leaf(value) => Some(*value),
            _ => None,
        };
        Self {
            leaves: branch.leaves,
            children: branch.children,
            values: Values::new((0..ENTRIES).filter_map(value).collect()),
            colors: branch.colors.to_vec(),
        }
    }
}

impl SavedBlock {
    fn of(place: u8, block: &Block) -> Self {
        let values = entries(&block.known).into_iter().map(|entry| block.cells.get(entry)).collect();
        Self { place, known: block.known, values: Values::new(values), colors: block.colors.to_vec() }
    }
}

/// Loading.
impl Tree {
    /// The tree that these parts hold.
    pub(crate) fn load(
        has_colors: bool,
        parts: impl IntoIterator<Item = (u64, Vec<u8>)>,
    ) -> Result<Self, DamagedState> {
        let mut by_place: BTreeMap<u64, Vec<u8>> = BTreeMap::new();
        for (part, bytes) in parts {
            if by_place.insert(part, bytes).is_some() {
                return Err(DamagedState::new(part, "it is there twice"));
            }
        }
        let mut tree = Self::new(has_colors);
        // The upper levels first; each of them says which nodes are below.
        let mut awaited: BTreeMap<u64, Bits> = BTreeMap::new();
        awaited.insert(branch_part(ROOT_LEVEL, [0; 3]), [0; 8]);
        for level in (1..=ROOT_LEVEL).rev() {
            let branches = by_place.split_off(&branch_part(level, [0; 3]));
            let mut expected = std::mem::take(&mut awaited);
            for (part, bytes) in branches {
                let damaged = |what: &str| DamagedState::new(part, what);
                expected.remove(&part).ok_or_else(|| damaged("it belongs to nothing"))?;
                let (_, corner) = place_of(part).ok_or_else(|| damaged("no such place"))?;
                let saved: SavedBranch = decode_part(part, &bytes)?;
                if !is_within(&saved.children, level) {
                    return Err(damaged("nodes outside the map"));
                }
                for entry in entries(&saved.children) {
                    let below = corner_of(corner, entry, 1 << (3 * u32::from(level)));
                    if level > 1 {
                        awaited.insert(branch_part(level - 1, below), [0; 8]);
                    } else {
                        let group = awaited.entry(group_part(corner, entry / GROUP * GROUP)).or_default();
                        group[0] |= 1 << (entry % GROUP);
                    }
                }
                let branch = tree.branch_to_fill(corner, level).ok_or_else(|| damaged("no such place"))?;
                saved.fill(branch, has_colors).ok_or_else(|| damaged("values that no map holds"))?;
            }
            if let Some((part, _)) = expected.pop_first() {
                return Err(DamagedState::new(part, "it is missing"));
            }
        }
        for (part, bytes) in by_place {
            let damaged = |what: &str| DamagedState::new(part, what);
            let expected = awaited.remove(&part).ok_or_else(|| damaged("it belongs to nothing"))?;
            let (_, corner) = place_of(part).ok_or_else(|| damaged("no such place"))?;
            let saved: Vec<SavedBlock> = decode_part(part, &bytes)?;
            let branch = tree.branch_to_fill(corner, 1).ok_or_else(|| damaged("no such place"))?;
            let mut found = 0;
            for block in saved {
                if usize::from(block.place) >= GROUP || found >> block.place & 1 == 1 {
                    return Err(damaged("a block twice, or too many"));
                }
                found |= 1_u64 << block.place;
                let entry = entry_of(corner, 1) + usize::from(block.place);
                let block = block.block(has_colors).ok_or_else(|| damaged("values that no map holds"))?;
                branch.set(entry, Entry::Block(Arc::new(block)));
            }
            if found != expected[0] {
                return Err(damaged("other blocks than there should be"));
            }
        }
        if let Some((part, _)) = awaited.pop_first() {
            return Err(DamagedState::new(part, "it is missing"));
        }
        tree.settle_all();
        Ok(tree)
    }

    /// The branch of a level that holds a cell, created if needed.
    fn branch_to_fill(&mut self, corner: Key, level: u8) -> Option<&mut Branch> {
        let mut branch = self.root_mut();
        while branch.level > level {
            let entry = entry_of(corner, branch.level);
            match branch.parted(entry) {
                Entry::Branch(below) => branch = Arc::make_mut(below),
                _ => return None,
            }
        }
        Some(branch)
    }
}

impl SavedBranch {
    /// `None` for leaves or colours that no map can hold.
    fn fill(self, branch: &mut Branch, has_colors: bool) -> Option<()> {
        let has_both =
            self.leaves.iter().zip(&self.children).any(|(leaves, children)| leaves & children != 0);
        if has_both || !is_within(&self.leaves, branch.level) {
            return None;
        }
        let leaves = entries(&self.leaves);
        for (entry, value) in leaves.iter().zip(self.values.get(leaves.len())?) {
            branch.set(*entry, Entry::Leaf(value));
        }
        branch.colors = EntryColors::of_vec(self.colors, has_colors)?;
        Some(())
    }
}

impl SavedBlock {
    fn block(self, has_colors: bool) -> Option<Block> {
        let known = entries(&self.known);
        // No map holds a block in which nothing is known.
        let values = self.values.get(known.len()).filter(|values| !values.is_empty())?;
        let mut block = Block::EMPTY;
        for (entry, value) in known.into_iter().zip(values) {
            block.set(entry, Some(value));
        }
        block.colors = EntryColors::of_vec(self.colors, has_colors)?;
        Some(block)
    }
}

impl Branch {
    /// Side of an entry, cells.
    fn side(&self) -> u32 {
        1 << (3 * u32::from(self.level))
    }

    fn block(&self, entry: usize) -> Option<&Arc<Block>> {
        match self.entry(entry) {
            Entry::Block(block) if has(&self.children, entry) => Some(block),
            _ => None,
        }
    }
}
