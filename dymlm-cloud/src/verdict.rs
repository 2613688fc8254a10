use crate::block_store::{BLOCK_CELLS, BLOCK_SIDE, BlockKey, BlockStore, CellBits, Neighbor, split};
use crate::evidence::{Evidence, EvidenceBlock, Support};
use crate::opinion::Opinion;

/// What the evidence of all frames says of a voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Verdict {
    /// It belongs to the static world.
    Static,
    /// Something was there that moved, or nothing ever was: a mover's trace or a flying pixel.
    Ghost,
    /// Read by too few frames, or only the noise of a heavier surface beside it.
    Noise,
}

/// Cells along the side of a block with its neighbours' nearest cells around it.
const PADDED: usize = BLOCK_SIDE + 2;

/// The verdict on every cell that was ever read, by a vote of the 3^3 cells around it.
///
/// A cell votes with its [`Opinion`] of whether something stands there; cells in which nothing was ever read
/// have no vote. A single cell errs: its centre may lie just beside the surface that it holds, or in the one
/// spot of a mover's trace that no later frame looked through. Its neighbours of the same thing know better.
/// Whether it is a mover that stands there each cell decides for itself: movers touch what does not move.
pub(crate) struct Verdicts<'a> {
    evidence: &'a Evidence,
    static_cells: BlockStore<CellBits>,
}

impl<'a> Verdicts<'a> {
    pub(crate) fn of(evidence: &'a Evidence, looks_per_reading: f64) -> Self {
        let mut static_cells = BlockStore::default();
        let blocks = evidence.blocks();
        for (&key, block) in blocks.keys().iter().zip(blocks.blocks()) {
            if block.may_be_read() {
                let looks_per_reading = looks_per_reading as f32;
                let votes = votes_around(key, blocks, looks_per_reading);
                let slot = static_cells.slot_or_insert(key);
                if let Some(bits) = static_cells.blocks_mut().get_mut(slot) {
                    *bits = cells_with_majority(votes);
                    remove_movers(block, looks_per_reading, bits);
                }
            }
        }
        Self { evidence, static_cells }
    }

    #[inline]
    pub(crate) fn is_ghost(&self, voxel: [i32; 3]) -> bool {
        let (block, index) = self.evidence.cell_of(voxel);
        let bits = self.static_cells.get(BlockKey::new(block));
        bits.is_none_or(|bits| bits[index / 64] >> (index % 64) & 1 == 0)
    }

    pub(crate) fn evidence_of_voxel(&self, voxel: [i32; 3]) -> Support {
        self.evidence.of_voxel(voxel)
    }
}

/// Takes out the cells that are mostly read as movers.
fn remove_movers(block: &EvidenceBlock, looks_per_reading: f32, cells: &mut CellBits) {
    for index in 0..BLOCK_CELLS {
        if Opinion::of(block.epochs(), index, looks_per_reading).staticness < 0.0 {
            cells[index / 64] &= !(1 << (index % 64));
        }
    }
}

fn vote(block: &EvidenceBlock, index: usize, looks_per_reading: f32) -> f32 {
    let opinion = Opinion::of(block.epochs(), index, looks_per_reading);
    if opinion.is_read { opinion.presence } else { 0.0 }
}

/// The votes of a block and of one layer of cells around it, x fastest.
fn votes_around(
    key: BlockKey,
    blocks: &BlockStore<EvidenceBlock>,
    looks_per_reading: f32,
) -> [f32; PADDED * PADDED * PADDED] {
    let mut votes = [0.0; PADDED * PADDED * PADDED];
    for Neighbor { step, key } in key.neighborhood() {
        let Some(block) = blocks.get(key).filter(|block| block.may_be_read()) else {
            continue;
        };
        // Along an axis: the last cell of the block before, all of this one, the first of the one after.
        let [xs, ys, zs] = step.map(|step| match step {
            -1 => 7..8,
            0 => 0..8,
            _ => 0..1_i32,
        });
        for z in zs {
            for y in ys.clone() {
                for x in xs.clone() {
                    let (_, index) = split([x, y, z]);
                    let [px, py, pz]: [usize; 3] =
                        std::array::from_fn(|axis| ([x, y, z][axis] + 8 * step[axis] + 1) as usize);
                    votes[(pz * PADDED + py) * PADDED + px] = vote(block, index, looks_per_reading);
                }
            }
        }
    }
    votes
}

/// The cells of the block around which the votes add up to zero or more.
fn cells_with_majority(mut votes: [f32; PADDED * PADDED * PADDED]) -> CellBits {
    // Sums of three along x, then y, then z: each entry becomes the sum from itself on.
    for stride in [1, PADDED, PADDED * PADDED] {
        for first in 0..votes.len() - 2 * stride {
            votes[first] += votes[first + stride] + votes[first + 2 * stride];
        }
    }
    let mut bits = CellBits::default();
    for index in 0..BLOCK_CELLS {
        let [x, y, z] = [index & 7, index >> 3 & 7, index >> 6];
        if votes[(z * PADDED + y) * PADDED + x] >= 0.0 {
            bits[index / 64] |= 1 << (index % 64);
        }
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_majority_is_that_of_27_cells() {
        let mut votes = [0.0; PADDED * PADDED * PADDED];
        for (index, vote) in votes.iter_mut().enumerate() {
            *vote = ((index * 7919) % 21) as f32 - 10.0;
        }
        let bits = cells_with_majority(votes);
        for index in 0..BLOCK_CELLS {
            let [x, y, z] = [index & 7, index >> 3 & 7, index >> 6];
            let mut sum = 0.0;
            for neighbor in 0..27 {
                let (dx, dy, dz) = (neighbor % 3, neighbor / 3 % 3, neighbor / 9);
                sum += votes[((z + dz) * PADDED + y + dy) * PADDED + x + dx];
            }
            assert_eq!(bits[index / 64] >> (index % 64) & 1 == 1, sum >= 0.0, "cell {index}");
        }
    }
}
