use crate::block_store::{
    BLOCK_CELLS, BLOCK_SIDE, BlockKey, CellBits, Neighbor, Retained, has, put, step_to, without,
};
use crate::evidence::{Evidence, EvidenceBlock};
use crate::opinion::MAX_OPINION;
use crate::paging::{Paged, record};
use crate::stamps::Stamps;
use dymlm_core::Pages;

/// What the evidence of all frames says of a voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Verdict {
    /// It belongs to the static world.
    Static,
    /// Something moved there, or nothing ever was there: a mover's trace or a flying pixel.
    Ghost,
    /// It was read by too few frames, or is only the noise of a heavier surface beside it.
    Noise,
}

/// Cells along the side of a block with its neighbours' nearest cells around it.
const PADDED: usize = BLOCK_SIDE + 2;
/// Votes are counted in twelfths.
const VOTE_UNIT: f32 = 12.0;

/// The verdict on every cell that was ever read, by a vote of the 3^3 cells around it.
///
/// A cell votes with its [`Opinion`](crate::opinion::Opinion) of whether something stands there; cells in
/// which nothing was ever read have no vote. A single cell errs: its centre may lie just beside the surface
/// in it, or in the one spot of a mover's trace that no later frame looked through. Its neighbours on the
/// same thing outvote it, unless it is as sure as a cell can be that it is free: frames that look through it
/// have outweighed whatever was read there, and none has read it since. So a thing that was taken away leaves
/// no strip beside what stays (`a_wall_that_was_taken_away_leaves_no_strip_above_the_floor`).
///
/// A rim is the rim of something: where no cell of the 27 is firm (nearly every frame reads it), frames that
/// read something and frames that look through disagree because it moves
/// (`where_somebody_walks_to_and_fro_nothing_stands`).
///
/// Whether a mover stands there each cell decides for itself, since movers touch what does not move.
///
/// Verdicts are kept. They are made anew for the blocks whose evidence has changed, and counted again where
/// votes or firmness of the cells around have changed.
#[derive(Debug, Clone, Default)]
pub(crate) struct VerdictGrid {
    /// By the slots of the evidence; `None` where nothing was ever read.
    blocks: Pages<Option<Paged<BlockVerdict>>>,
    /// The last change of the evidence that has been taken in.
    taken_in: u32,
    /// Number of calls that have changed a verdict.
    revision: u32,
    /// By slot, the last call that has changed which cells of the block are static.
    stamps: Stamps,
}

#[derive(Debug, Clone)]
pub(crate) struct BlockVerdict {
    votes: [i8; BLOCK_CELLS],
    /// Cells in which a surface or a mover was ever read.
    read: CellBits,
    /// Cells that are mostly read as movers.
    movers: CellBits,
    /// Cells that are free whatever the cells around say: their opinion is at its limit.
    free: CellBits,
    /// Cells that are [firm](crate::opinion::Opinion::is_firm).
    firm: CellBits,
    /// Cells that the majority of the cells around them takes for occupied, by a mover or not, and that are
    /// firm or beside a firm one.
    present: CellBits,
    /// Cells that are part of the static world.
    statics: CellBits,
}

record!(BlockVerdict { votes, read, movers, free, firm, present, statics });

/// The verdict on a block in which nothing was ever read.
impl Default for BlockVerdict {
    fn default() -> Self {
        let none = CellBits::default();
        Self {
            votes: [0; BLOCK_CELLS],
            read: none,
            movers: none,
            free: none,
            firm: none,
            present: none,
            statics: none,
        }
    }
}

impl VerdictGrid {
    /// Takes in what has changed in the evidence since the last call. O(blocks that changed), the votes
    /// around only where a vote has changed.
    pub(crate) fn refresh(&mut self, evidence: &Evidence, looks_per_reading: f32) {
        let blocks = evidence.blocks();
        self.blocks.grow(blocks.blocks().len(), || None);
        let changed: Vec<usize> = blocks.stamps().after(self.taken_in).collect();
        self.taken_in = evidence.revision();
        if changed.is_empty() {
            return;
        }
        let judged = crate::parallel::map(changed.clone(), |slot| {
            // A block in the file stays there: after loading a map all blocks are judged.
            let block = blocks.blocks()[slot].look();
            block.may_be_read().then(|| BlockVerdict::of(&block, looks_per_reading))
        });
        // Most blocks in view were looked through once more, which changes no vote of a cell that is sure.
        let mut around: Vec<usize> = Vec::new();
        for (&slot, mut verdict) in changed.iter().zip(judged) {
            let old = self.blocks[slot].as_deref();
            if verdict.as_ref().is_some_and(|new| old.is_some_and(|old| new.has_evidence_of(old))) {
                continue;
            }
            let changes = BlockVerdict::changes_for_others(verdict.as_ref(), old);
            if let (Some(new), Some(old)) = (&mut verdict, old) {
                (new.present, new.statics) = (old.present, old.statics);
            }
            let Some(block) = self.blocks.get_mut(slot) else { continue };
            *block = verdict.map(Paged::new);
            around.push(slot);
            let neighbors = blocks.keys()[slot].neighborhood();
            let concerned = neighbors.filter(|neighbor| touches(&changes, neighbor.step));
            around.extend(concerned.filter_map(|neighbor| blocks.slot(neighbor.key)));
        }
        around.sort_unstable();
        around.dedup();
        around.retain(|&slot| self.blocks[slot].is_some());
        let occupied = crate::parallel::map(around.clone(), |slot| {
            self.surroundings(blocks.keys()[slot], evidence).occupied_cells()
        });
        self.revision += 1;
        for (slot, occupied) in around.into_iter().zip(occupied) {
            let Some(block) = &self.blocks[slot] else { continue };
            let present = without(occupied, block.free);
            let statics = without(present, block.movers);
            // A block that stays the same is not copied for a map that has a clone.
            if (statics, present) == (block.statics, block.present) {
                continue;
            }
            let Some(block) = self.blocks.get_mut(slot).and_then(Option::as_mut).and_then(Paged::to_mut)
            else {
                continue;
            };
            if statics != block.statics {
                block.statics = statics;
                self.stamps.note(slot, self.revision);
            }
            block.present = present;
        }
    }

    /// Forgets blocks of the evidence that are gone, and the verdicts on those around: their own evidence is as
    /// before, but who voted on their cells is gone.
    pub(crate) fn forget(&mut self, evidence: &Retained) {
        self.blocks.keep(&evidence.stays);
        self.stamps.keep(&evidence.stays);
        self.revision += 1;
        for &slot in &evidence.around {
            if let Some(block) = self.blocks.get_mut(slot) {
                *block = None;
                // Where nothing is static any more, no later verdict is a change.
                self.stamps.note(slot, self.revision);
            }
        }
    }

    /// The verdicts on the block at a slot, to page them out.
    pub(crate) fn paged_mut(&mut self, slot: usize) -> Option<&mut Paged<BlockVerdict>> {
        self.blocks.get_mut(slot)?.as_mut()
    }

    /// Frees the memory of blocks that a clone has paged out.
    pub(crate) fn page_out_like(&mut self, other: &Self) {
        let is_filed = |slot: &usize| {
            let other = other.blocks.get(*slot).and_then(Option::as_ref);
            other.is_some_and(|other| other.in_memory().is_none())
        };
        let filed: Vec<usize> = self.blocks.unshared(&other.blocks).filter(is_filed).collect();
        for slot in filed {
            if let (Some(Some(block)), Some(Some(other))) =
                (self.blocks.get_mut(slot), other.blocks.get(slot))
            {
                block.page_out_like(other);
            }
        }
    }

    /// At least the number of the last call that has changed a verdict.
    pub(crate) fn revision(&self) -> u32 {
        self.revision
    }

    /// By slots of the evidence, the last call that has changed which cells are static.
    pub(crate) fn stamps(&self) -> &Stamps {
        &self.stamps
    }

    /// The cells that are part of the static world in the evidence's block at a slot. Verdicts in the file
    /// stay there.
    pub(crate) fn statics(&self, slot: usize) -> Option<CellBits> {
        self.blocks.get(slot)?.as_ref().map(|block| block.look().statics)
    }

    /// The last change of the evidence that has been taken in.
    pub(crate) fn taken_in(&self) -> u32 {
        self.taken_in
    }

    /// The verdict on the cell of a voxel; `None` when nothing was ever read in it.
    pub(crate) fn of_voxel(&self, evidence: &Evidence, voxel: [i32; 3]) -> Option<Verdict> {
        let (block, index) = evidence.cell_of(voxel);
        let block = self.block(evidence, block).filter(|block| has(&block.read, index))?;
        Some(if has(&block.statics, index) { Verdict::Static } else { Verdict::Ghost })
    }

    /// Whether the cell of a voxel is free; `None` when nothing was ever read in it.
    pub(crate) fn is_free(&self, evidence: &Evidence, voxel: [i32; 3]) -> Option<bool> {
        let (block, index) = evidence.cell_of(voxel);
        let block = self.block(evidence, block).filter(|block| has(&block.read, index))?;
        Some(!has(&block.present, index))
    }

    /// Slots of blocks that hold a ghost, among those whose evidence has changed since a revision, and of
    /// blocks around that hold one beside such a block: its cells have voted on it.
    pub(crate) fn ghost_blocks_since(&self, evidence: &Evidence, revision: u32) -> Vec<usize> {
        let blocks = evidence.blocks();
        // A block with the step to one that has changed; the step of one that has changed itself is none.
        let mut concerned: Vec<(usize, [i32; 3])> = Vec::new();
        for slot in blocks.stamps().after(revision) {
            concerned.push((slot, [0; 3]));
            for (place, neighbor) in blocks.neighborhood(slot).into_iter().enumerate() {
                let Some(neighbor) = (neighbor as usize).checked_sub(1) else { continue };
                if blocks.stamps().of(neighbor) <= revision {
                    concerned.push((neighbor, step_to(place).map(|step| -step)));
                }
            }
        }
        concerned.sort_unstable();
        let of_blocks = concerned.chunk_by(|a, b| a.0 == b.0);
        let holds_ghost = |of_block: &&[(usize, [i32; 3])]| {
            let block = self.blocks.get(of_block[0].0).and_then(Option::as_ref).map(Paged::look);
            let ghosts = block.map(|block| without(block.read, block.statics));
            ghosts.is_some_and(|ghosts| of_block.iter().any(|(_, step)| touches(&ghosts, *step)))
        };
        of_blocks.filter(holds_ghost).map(|of_block| of_block[0].0).collect()
    }

    /// Bytes that another grid does not share.
    pub(crate) fn memory_bytes_beside(&self, other: &Self) -> usize {
        let own = self.blocks.unshared(&other.blocks).filter_map(|slot| {
            let other = other.blocks.get(slot).and_then(Option::as_ref);
            Some(self.blocks[slot].as_ref()?.memory_bytes_beside(other, |_, _| 0))
        });
        self.list_bytes_beside(other) + own.sum::<usize>()
    }

    /// The same without the blocks.
    pub(crate) fn list_bytes_beside(&self, other: &Self) -> usize {
        self.blocks.memory_bytes_beside(&other.blocks) + self.stamps.memory_bytes_beside(&other.stamps)
    }

    /// Bytes of memory of the verdicts on a block.
    pub(crate) fn block_bytes(&self, slot: usize) -> usize {
        let block = self.blocks.get(slot).and_then(Option::as_ref);
        block.map_or(0, |block| block.memory_bytes_beside(None, |_, _| 0))
    }

    fn block(&self, evidence: &Evidence, block: [i32; 3]) -> Option<&BlockVerdict> {
        let slot = evidence.blocks().slot(BlockKey::new(block))?;
        self.blocks.get(slot)?.as_deref()
    }

    /// What a block and one layer of cells around it say.
    fn surroundings(&self, key: BlockKey, evidence: &Evidence) -> Surroundings {
        let mut around = Surroundings::NOTHING;
        for Neighbor { step, key } in key.neighborhood() {
            let Some(block) = self.block(evidence, key.block()) else { continue };
            // Along an axis: the last cell of the block before, all of this one, the first of the one after;
            // and where the first of them goes.
            let [(xs, px), (ys, py), (zs, pz)] = step.map(|step| match step {
                -1 => (BLOCK_SIDE - 1..BLOCK_SIDE, 0),
                0 => (0..BLOCK_SIDE, 1),
                _ => (0..1, BLOCK_SIDE + 1),
            });
            for (layer, z) in zs.enumerate() {
                for (row, y) in ys.clone().enumerate() {
                    let from = (z * BLOCK_SIDE + y) * BLOCK_SIDE;
                    let to = (pz + layer) * PADDED + py + row;
                    let own = &block.votes[from + xs.start..from + xs.end];
                    let places = &mut around.votes[to * PADDED + px..][..own.len()];
                    places.iter_mut().zip(own).for_each(|(place, &vote)| *place = vote.into());
                    let firm = block.firm[z] >> (y * BLOCK_SIDE + xs.start) & ((1 << xs.len()) - 1);
                    around.firm[to] |= (firm as u16) << px;
                }
            }
        }
        around
    }
}

/// The votes of a block's cells and of one layer of cells around it, and which of them are firm.
struct Surroundings {
    /// x fastest.
    votes: [i16; PADDED * PADDED * PADDED],
    /// A row along x each; x = 0 in the lowest bit.
    firm: [u16; PADDED * PADDED],
}

impl Surroundings {
    const NOTHING: Self = Self { votes: [0; PADDED * PADDED * PADDED], firm: [0; PADDED * PADDED] };

    /// The cells of the block that the cells around them take for occupied, and that are firm or beside a
    /// firm one.
    fn occupied_cells(self) -> CellBits {
        let (majority, firm) = (cells_with_majority(self.votes), cells_with_one_around(self.firm));
        std::array::from_fn(|layer| majority[layer] & firm[layer])
    }
}

impl BlockVerdict {
    fn of(block: &EvidenceBlock, looks_per_reading: f32) -> Self {
        let mut verdict = Self::default();
        let read = block.cells_read();
        // Cells that were only looked through need no opinion.
        block.for_each_opinion(&read, looks_per_reading, |index, opinion| {
            if opinion.is_read {
                verdict.votes[index] = (opinion.presence * VOTE_UNIT).round() as i8;
            }
            if opinion.presence <= -MAX_OPINION {
                put(&mut verdict.free, index);
            }
            if opinion.is_firm {
                put(&mut verdict.firm, index);
            }
            if opinion.is_read || opinion.staticness < 0.0 {
                put(&mut verdict.read, index);
            }
            if opinion.staticness < 0.0 {
                put(&mut verdict.movers, index);
            }
        });
        verdict
    }

    /// Whether the evidence of the block itself says the same.
    fn has_evidence_of(&self, other: &Self) -> bool {
        (&self.votes, self.read, self.movers, self.free, self.firm)
            == (&other.votes, other.read, other.movers, other.free, other.firm)
    }

    /// The cells whose votes differ, or that are firm in one of the two only: what the cells around ask.
    /// Where nothing was ever read, no cell votes and none is firm.
    fn changes_for_others(new: Option<&Self>, old: Option<&Self>) -> CellBits {
        let votes = |block: Option<&Self>| block.map_or([0; BLOCK_CELLS], |block| block.votes);
        let firm = |block: Option<&Self>| block.map_or(CellBits::default(), |block| block.firm);
        let (new_firm, old_firm) = (firm(new), firm(old));
        let mut bits: CellBits = std::array::from_fn(|layer| new_firm[layer] ^ old_firm[layer]);
        for (index, (new, old)) in votes(new).into_iter().zip(votes(old)).enumerate() {
            bits[index / 64] |= u64::from(new != old) << (index % 64);
        }
        bits
    }
}

/// Whether any of a block's cells lies beside the block that is a step away, or in it (step 0).
fn touches(cells: &CellBits, step: [i32; 3]) -> bool {
    // A word holds a layer of cells, x in the lowest three bits of a cell's index, y in the next three.
    let [columns, rows] = [(0x0101_0101_0101_0101_u64, 7), (0xff, 56)];
    let side = |(first, to_last): (u64, u32), step: i32| match step {
        -1 => first,
        0 => u64::MAX,
        _ => first << to_last,
    };
    let mask = side(columns, step[0]) & side(rows, step[1]);
    let layers = match step[2] {
        -1 => &cells[..1],
        0 => &cells[..],
        _ => &cells[BLOCK_SIDE - 1..],
    };
    layers.iter().any(|layer| layer & mask != 0)
}

/// The cells of the block for which the votes of the 27 cells around add up to zero or more.
fn cells_with_majority(mut votes: [i16; PADDED * PADDED * PADDED]) -> CellBits {
    // Sums of three along x, then y, then z: each entry becomes the sum of itself and the two after it.
    for stride in [1, PADDED, PADDED * PADDED] {
        for first in 0..votes.len() - 2 * stride {
            votes[first] += votes[first + stride] + votes[first + 2 * stride];
        }
    }
    let mut bits = CellBits::default();
    for index in 0..BLOCK_CELLS {
        let [x, y, z] = [index & 7, index >> 3 & 7, index >> 6];
        if votes[(z * PADDED + y) * PADDED + x] >= 0 {
            bits[index / 64] |= 1 << (index % 64);
        }
    }
    bits
}

/// The cells of the block for which one of the 27 bits around is set.
fn cells_with_one_around(mut rows: [u16; PADDED * PADDED]) -> CellBits {
    // Each row becomes the union of itself and the two after it: along x within the row, then y, then z.
    rows = rows.map(|row| row | row >> 1 | row >> 2);
    for stride in [1, PADDED] {
        for first in 0..rows.len() - 2 * stride {
            rows[first] |= rows[first + stride] | rows[first + 2 * stride];
        }
    }
    let row = |z: usize, y: usize| u64::from(rows[z * PADDED + y] & 0xff) << (y * BLOCK_SIDE);
    std::array::from_fn(|z| (0..BLOCK_SIDE).fold(0, |layer, y| layer | row(z, y)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block_store::cell_in_block;

    #[test]
    fn a_cell_touches_the_blocks_that_count_its_vote() {
        for index in 0..BLOCK_CELLS {
            let mut cells = CellBits::default();
            put(&mut cells, index);
            for neighbor in BlockKey::new([0; 3]).neighborhood() {
                let is_beside = cell_in_block(index)
                    .into_iter()
                    .zip(neighbor.step)
                    .all(|(c, step)| (8 * step - 1..8 * step + 9).contains(&c));
                assert_eq!(touches(&cells, neighbor.step), is_beside, "cell {index}, {:?}", neighbor.step);
            }
        }
    }

    #[test]
    fn the_majority_is_that_of_27_cells() {
        let mut votes = [0; PADDED * PADDED * PADDED];
        for (index, vote) in votes.iter_mut().enumerate() {
            *vote = ((index * 7919) % 21) as i16 - 10;
        }
        let bits = cells_with_majority(votes);
        for index in 0..BLOCK_CELLS {
            let [x, y, z] = [index & 7, index >> 3 & 7, index >> 6];
            let mut sum = 0;
            for neighbor in 0..27 {
                let (dx, dy, dz) = (neighbor % 3, neighbor / 3 % 3, neighbor / 9);
                sum += votes[((z + dz) * PADDED + y + dy) * PADDED + x + dx];
            }
            assert_eq!(bits[index / 64] >> (index % 64) & 1 == 1, sum >= 0, "cell {index}");
        }
    }

    #[test]
    fn one_of_27_cells_is_enough() {
        for (seed, share) in [(1, 2), (2, 40), (3, 1000)] {
            let mut rows = [0_u16; PADDED * PADDED];
            let is_set = |x: usize, row: usize| ((row * PADDED + x) * 7919 + seed * 31).is_multiple_of(share);
            for (place, row) in rows.iter_mut().enumerate() {
                *row = (0..PADDED).map(|x| u16::from(is_set(x, place)) << x).sum();
            }
            let bits = cells_with_one_around(rows);
            for index in 0..BLOCK_CELLS {
                let [x, y, z] = [index & 7, index >> 3 & 7, index >> 6];
                let expected = (0..27).any(|neighbor| {
                    let (dx, dy, dz) = (neighbor % 3, neighbor / 3 % 3, neighbor / 9);
                    is_set(x + dx, (z + dz) * PADDED + y + dy)
                });
                assert_eq!(has(&bits, index), expected, "cell {index}, one in {share}");
            }
        }
    }
}
