use serde::{Deserialize, Serialize};

use super::blocks_of;
use super::counts::SavedCounts;
use crate::block_store::{BlockKey, CUBE_BLOCKS};
use crate::cell_counts::CellCounts;
use crate::epochs::{Epochs, Period};
use crate::evidence::Evidence;

/// More periods than a block's evidence keeps.
const MOST_PERIODS: usize = 256;
/// The same limit as for a cell: see [`SavedCounts`].
const MOST_FRAMES: u32 = 1 << 26;

/// The evidence of a cube of blocks.
#[derive(Serialize, Deserialize)]
pub(super) struct SavedEvidence {
    /// A bit for each block of the cube that is there.
    blocks: u64,
    /// The last change of each of these blocks.
    revisions: Vec<u32>,
    periods: Vec<Vec<SavedPeriod>>,
}

#[derive(Serialize, Deserialize)]
struct SavedPeriod {
    first: i32,
    level: u32,
    looked_through: u32,
    cells: Option<SavedCounts>,
}

impl SavedEvidence {
    /// `None` for a cube without blocks.
    pub(super) fn of(cube: BlockKey, evidence: &Evidence) -> Option<Self> {
        let mut saved = Self { blocks: 0, revisions: Vec::new(), periods: Vec::new() };
        for (place, slot) in blocks_of(cube, evidence.blocks()) {
            saved.blocks |= 1 << place;
            saved.revisions.push(evidence.blocks().stamps().of(slot));
            let block = evidence.blocks().blocks()[slot].look();
            saved.periods.push(block.epochs().periods().iter().map(SavedPeriod::of).collect());
        }
        (saved.blocks != 0).then_some(saved)
    }

    /// Puts the blocks where there are none; `None` for blocks that no map can hold.
    pub(super) fn put_into(self, cube: BlockKey, evidence: &mut Evidence) -> Option<()> {
        let count = self.blocks.count_ones() as usize;
        if count == 0 || self.revisions.len() != count || self.periods.len() != count {
            return None;
        }
        let places = (0..CUBE_BLOCKS).filter(|place| self.blocks >> place & 1 == 1);
        for ((place, revision), periods) in places.zip(self.revisions).zip(self.periods) {
            if periods.len() > MOST_PERIODS {
                return None;
            }
            let periods = periods.into_iter().map(SavedPeriod::restored).collect::<Option<Vec<_>>>()?;
            evidence.put_block(cube.of_cube(place), Epochs::restored(periods)?, revision);
        }
        Some(())
    }
}

impl SavedPeriod {
    fn of(period: &Period) -> Self {
        Self {
            first: period.first,
            level: period.level,
            looked_through: period.looked_through,
            cells: SavedCounts::of(&period.cells),
        }
    }

    fn restored(self) -> Option<Period> {
        let Self { first, level, looked_through, cells } = self;
        if looked_through >= MOST_FRAMES {
            return None;
        }
        let cells = match cells {
            Some(cells) => cells.restored()?,
            None => CellCounts::default(),
        };
        Some(Period { first, level, looked_through, cells })
    }
}
