use std::ops::Range;

use super::rows::{Row, Rows};

/// The blocks that touch a block, itself among them: up to three of each of nine rows.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TouchingBlocks {
    /// The first touching block of each row.
    first: [u32; 9],
    /// Number of touching blocks of each row, two bits per row.
    counts: u32,
}

/// A row beside a row, or the row itself: offsets of x and y, each -1, 0 or 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowOffset {
    pub(super) x: i32,
    pub(super) y: i32,
}

impl RowOffset {
    pub(super) const OWN: Self = Self { x: 0, y: 0 };

    /// All nine, the nearest first.
    pub(super) const ALL: [Self; 9] = [
        Self::OWN,
        Self { x: 0, y: -1 },
        Self { x: 0, y: 1 },
        Self { x: -1, y: 0 },
        Self { x: 1, y: 0 },
        Self { x: -1, y: -1 },
        Self { x: -1, y: 1 },
        Self { x: 1, y: -1 },
        Self { x: 1, y: 1 },
    ];

    /// The rows after the own row.
    pub(super) const AFTER: [Self; 4] =
        [Self { x: 0, y: 1 }, Self { x: 1, y: -1 }, Self { x: 1, y: 0 }, Self { x: 1, y: 1 }];

    #[inline]
    fn place(self) -> usize {
        ((self.x + 1) * 3 + self.y + 1) as usize
    }
}

impl TouchingBlocks {
    /// The touching blocks of a row.
    #[inline]
    pub(super) fn of_row(&self, row: RowOffset) -> Range<usize> {
        let place = row.place();
        let first = self.first[place] as usize;
        first..first + (self.counts >> (2 * place) & 3) as usize
    }

    /// Finds the touching blocks of successive blocks, from `first_block` on.
    pub(super) fn find(rows: &Rows, first_block: usize, found: &mut [Self]) {
        let mut walk = Walk::new(rows);
        for (block, found) in (first_block..).zip(found) {
            walk.go_to(block);
            *found = walk.touching_blocks();
        }
    }
}

/// A walk along blocks: three cursors into the rows, one for each x, and nine into the blocks
/// of the neighbouring rows. They only move forward, so that the whole walk takes O(blocks).
struct Walk<'a> {
    rows: &'a Rows,
    z: i32,
    /// The row after the present one, and the block it begins with.
    next_row: usize,
    next_row_start: usize,
    /// For each x, the first row that is not before (x, y - 1).
    row_cursors: [usize; 3],
    /// What is left of the blocks of each neighbouring row.
    rest: [Range<usize>; 9],
}

impl<'a> Walk<'a> {
    fn new(rows: &'a Rows) -> Self {
        Self {
            rows,
            z: 0,
            next_row: usize::MAX,
            next_row_start: 0,
            row_cursors: [0; 3],
            rest: std::array::from_fn(|_| 0..0),
        }
    }

    /// Goes to a block: any block in the first call, then always the next one.
    fn go_to(&mut self, block: usize) {
        if block >= self.next_row_start {
            let row = if self.next_row == usize::MAX { self.enter(block) } else { self.next_row };
            self.go_to_row(row);
        }
        self.z = self.rows.z_of_block(block);
    }

    /// Sets the cursors by bisection.
    fn enter(&mut self, block: usize) -> usize {
        let row = self.rows.row_of_block(block);
        let Row { x, y, .. } = self.rows.all()[row];
        for (dx, cursor) in (-1..).zip(&mut self.row_cursors) {
            *cursor = self.rows.all().partition_point(|row| (row.x, row.y) < (x + dx, y - 1));
        }
        row
    }

    fn go_to_row(&mut self, row: usize) {
        let rows = self.rows.all();
        let here = rows[row];
        self.next_row = row + 1;
        self.next_row_start = self.rows.blocks_of_row(row).end;
        self.rest = std::array::from_fn(|_| 0..0);
        for (dx, cursor) in (-1..).zip(&mut self.row_cursors) {
            let before = (here.x + dx, here.y - 1);
            *cursor += rows[*cursor..].iter().take_while(|row| (row.x, row.y) < before).count();
            for (neighbor, row) in (*cursor..).zip(&rows[*cursor..]).take(3) {
                if row.x != here.x + dx || row.y > here.y + 1 {
                    break;
                }
                let offset = RowOffset { x: dx, y: row.y - here.y };
                self.rest[offset.place()] = self.rows.blocks_of_row(neighbor);
            }
        }
    }

    #[inline]
    fn touching_blocks(&mut self) -> TouchingBlocks {
        let mut touching = TouchingBlocks::default();
        for (place, rest) in self.rest.iter_mut().enumerate() {
            while rest.start < rest.end && self.rows.z_of_block(rest.start) < self.z - 1 {
                rest.start += 1;
            }
            let touches = |block: &usize| *block < rest.end && self.rows.z_of_block(*block) <= self.z + 1;
            let count = (rest.start..rest.start + 3).take_while(touches).count();
            touching.first[place] = rest.start as u32;
            touching.counts |= (count as u32) << (2 * place);
        }
        touching
    }
}
