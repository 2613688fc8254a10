use std::hint::black_box;
use std::sync::OnceLock;

use crate::block_store::{BLOCK_CELLS, CellBits, for_each_bit};
use crate::cell_counts::CellCounts;
use crate::direction::Direction;
use crate::finding::Finding;
use crate::opinion::{Opinion, OpinionFold};
use crate::paging::{Record, record};
use crate::support::Support;

/// Length of an epoch, seconds. A thing that comes to stand in a place that was free for long is believed
/// after three epochs (`a_new_wall_is_believed_within_ten_seconds`), so an epoch must be shorter than a third
/// of the time that a map may take to show it. With shorter epochs, a person is believed who stops for a
/// shorter time.
pub(crate) const EPOCH: f64 = 2.5;
/// Periods of more than 2^`MAX_LEVEL` epochs, 85 years, are not made: the next level would overflow the
/// numbers.
const MAX_LEVEL: u32 = 30;

/// The epoch that contains a time, seconds.
pub(crate) fn epoch_of(timestamp: f64) -> i32 {
    // Casts saturate.
    (timestamp / EPOCH).floor() as i32
}

/// The counts of a block of cells over time: by epochs where they are recent, by ever longer periods where
/// they are old.
///
/// Counts within a period are sums, so they do not depend on the order of frames, frames can be taken out
/// again, and two histories add up. Where periods begin and end depends only on the newest epoch in which the
/// block was seen: a period of 2^k epochs, which starts at a multiple of 2^k, is formed as soon as 2^k epochs
/// have passed since its end. So there are about 1.5 periods for each doubling of time, and nothing needs to
/// be forgotten: a wall that was seen once and then occluded for a day is still a wall, and a place that is
/// looked through in the morning is known to have been read the evening before.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Epochs {
    /// By time, the newest last.
    periods: Vec<Period>,
    read: OlderReads,
}

/// The cells that all periods but the newest have read, cached until an older period changes: after hours
/// there are many periods, and each block is asked when its verdicts are made anew.
#[derive(Debug, Clone, Default)]
struct OlderReads(OnceLock<CellBits>);

/// The cache follows from the periods, so comparisons ignore it.
impl PartialEq for OlderReads {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Record for OlderReads {
    fn write(&self, _: &mut Vec<u8>) {}

    fn read(_: &mut &[u8]) -> Option<Self> {
        Some(Self::default())
    }
}

/// What was counted in 2^`level` epochs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Period {
    pub(crate) first: i32,
    pub(crate) level: u32,
    /// Frames that look through the whole block, in addition to the counts of its cells.
    pub(crate) looked_through: u32,
    pub(crate) cells: CellCounts,
}

record!(Epochs { periods, read });
record!(Period { first, level, looked_through, cells });

impl Epochs {
    /// The periods by time, the newest last.
    #[cfg(feature = "state")]
    pub(crate) fn periods(&self) -> &[Period] {
        &self.periods
    }

    /// Counts with these periods; `None` where they do not follow each other, or are not joined as the newest
    /// of them requires.
    #[cfg(feature = "state")]
    pub(crate) fn restored(mut periods: Vec<Period>) -> Option<Self> {
        let is_aligned = |period: &Period| {
            period.level <= MAX_LEVEL && period.first >> period.level << period.level == period.first
        };
        // Periods of other levels have no end.
        if !periods.iter().all(is_aligned) {
            return None;
        }
        let is_ordered = |pair: &[Period]| pair[0].end() < i64::from(pair[1].first);
        let newest = periods.last().map_or(0, Period::end);
        let is_joined = |period: &Period| period.level >= level_of(period.first, newest);
        if !periods.iter().all(is_joined) || !periods.windows(2).all(is_ordered) {
            return None;
        }
        // Most blocks of a loaded map do not come into view: their newest period is packed as well, until it grows.
        for period in &mut periods {
            period.cells.pack();
        }
        Some(Self { periods, read: OlderReads::default() })
    }

    /// The period of an epoch, made when there is none.
    pub(crate) fn period_mut(&mut self, epoch: i32) -> &mut Period {
        let place = match self.periods.last() {
            Some(last) if last.contains(epoch) => self.periods.len() - 1,
            Some(last) if epoch < last.first => {
                self.read = OlderReads::default();
                self.place_of_older(epoch)
            }
            _ => {
                self.read = OlderReads(OnceLock::from(self.cells_read()));
                self.periods.push(Period::new(epoch, 0));
                self.coarsen();
                self.periods.len() - 1
            }
        };
        &mut self.periods[place]
    }

    /// What was counted in a cell, newest period first.
    pub(crate) fn of_cell(&self, index: usize) -> impl Iterator<Item = (&Period, Support)> {
        self.periods.iter().rev().map(move |period| (period, period.at(index)))
    }

    /// Calls `visit` with what the counts say of each of these cells.
    pub(crate) fn for_each_opinion(
        &self,
        cells: &CellBits,
        looks_per_reading: f32,
        mut visit: impl FnMut(usize, Opinion),
    ) {
        let mut folds = [OpinionFold::NEW; BLOCK_CELLS];
        self.fetch();
        for period in self.periods.iter().rev() {
            period.for_each(cells, |index, counts| folds[index].add(counts, looks_per_reading));
        }
        for_each_bit(*cells, |index| visit(index, folds[index].opinion()));
    }

    /// Brings the counts from memory, those of all periods at once: after hours there are many, and one after the
    /// other each would be waited for. Nothing but time depends on it.
    fn fetch(&self) {
        let packed = || self.periods.iter().filter_map(|period| period.cells.packed());
        // Where the numbers are is in the packed counts themselves.
        black_box(packed().fold(0, |all, counts| all ^ counts.most()));
        black_box(packed().fold(0, |all, counts| all ^ counts.touch_numbers()));
    }

    /// The counts of a cell before an epoch, newest period first; all its counts when there are none before.
    pub(crate) fn settled(&self, index: usize, epoch: i32) -> impl Iterator<Item = Support> {
        let is_newer = |period: &&Period| period.end() >= i64::from(epoch);
        let newer = self.periods.iter().rev().take_while(is_newer).count();
        let counts = self.periods.iter().rev().map(move |period| period.at(index));
        let is_settled = counts.clone().skip(newer).any(|counts| counts != Support::default());
        counts.skip(if is_settled { newer } else { 0 })
    }

    /// Whether any cell differs from the others: if none does, no surface and no mover was read.
    pub(crate) fn has_cells(&self) -> bool {
        self.periods.iter().any(|period| !period.cells.is_empty())
    }

    /// The cells in which a surface or a mover was ever read.
    pub(crate) fn cells_read(&self) -> CellBits {
        let Some((newest, older)) = self.periods.split_last() else { return CellBits::default() };
        let join = |read: CellBits, period: &Period| {
            let cells = period.cells.read();
            std::array::from_fn(|word| read[word] | cells[word])
        };
        let older = self.read.0.get_or_init(|| older.iter().fold(CellBits::default(), join));
        join(*older, newest)
    }

    /// Adds another map's counts of the block.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.read = OlderReads::default();
        self.periods.extend(other.periods.iter().cloned());
        self.periods.sort_by_key(|period| period.first);
        self.coarsen();
    }

    /// Removes the surface readings of a cell.
    pub(crate) fn clear_support(&mut self, index: usize) {
        self.read = OlderReads::default();
        for period in &mut self.periods {
            period.cells.clear(index, Finding::Surface);
        }
    }

    /// Replaces a cell's history by `support` surface readings in the newest period.
    pub(crate) fn give_support(&mut self, index: usize, support: u32) {
        self.read = OlderReads::default();
        for period in &mut self.periods {
            // The looks that all cells have in common become each cell's own, so that one cell can lose them.
            let common = std::mem::take(&mut period.looked_through);
            for other in 0..BLOCK_CELLS {
                period.cells.add(other, Finding::LookedThrough, common);
            }
            for finding in [Finding::Surface, Finding::LookedThrough, Finding::Mover] {
                period.cells.clear(index, finding);
            }
        }
        if let Some(period) = self.periods.last_mut() {
            period.cells.add(index, Finding::Surface, support);
        }
    }

    /// Bytes that the counts own and do not share with others.
    pub(crate) fn memory_bytes_beside(&self, other: Option<&Self>) -> usize {
        let others = other.map_or(&[][..], |other| &other.periods);
        let is_shared =
            |period: &Period| others.iter().any(|other| period.cells.is_shared_with(&other.cells));
        let own = self.periods.iter().filter(|period| !is_shared(period));
        self.periods.capacity() * size_of::<Period>()
            + own.map(|period| period.cells.memory_bytes()).sum::<usize>()
    }

    fn place_of_older(&mut self, epoch: i32) -> usize {
        let place = self.periods.partition_point(|period| period.end() < i64::from(epoch));
        if !self.periods.get(place).is_some_and(|period| period.contains(epoch)) {
            let level = level_of(epoch, self.newest());
            self.periods.insert(place, Period::new(epoch, level));
        }
        place
    }

    fn newest(&self) -> i64 {
        self.periods.last().map_or(0, Period::end)
    }

    /// Joins the periods that have become one since the newest epoch began.
    fn coarsen(&mut self) {
        let newest = self.newest();
        let mut joined: Vec<Period> = Vec::with_capacity(self.periods.len());
        for mut period in self.periods.drain(..) {
            period.grow_to(level_of(period.first, newest));
            match joined.last_mut() {
                Some(last) if last.contains(period.first) => last.add(&period),
                _ => joined.push(period),
            }
        }
        let older = joined.len().saturating_sub(1);
        joined.iter_mut().take(older).for_each(|period| period.cells.pack());
        self.periods = joined;
    }
}

/// Level of the period that an epoch belongs to, when `newest` is the newest epoch.
fn level_of(epoch: i32, newest: i64) -> u32 {
    let is_whole = |level: u32| {
        let length = 1_i64 << level;
        let end = (i64::from(epoch) >> level) * length + length - 1;
        newest - end >= length
    };
    (1..=MAX_LEVEL).take_while(|&level| is_whole(level)).last().unwrap_or(0)
}

impl Period {
    fn new(epoch: i32, level: u32) -> Self {
        Self { first: epoch >> level << level, level, looked_through: 0, cells: CellCounts::None }
    }

    /// When it begins and ends, seconds.
    pub(crate) fn span(&self) -> [f64; 2] {
        [f64::from(self.first) * EPOCH, (self.end() + 1) as f64 * EPOCH]
    }

    fn end(&self) -> i64 {
        i64::from(self.first) + (1 << self.level) - 1
    }

    fn contains(&self, epoch: i32) -> bool {
        epoch >= self.first && i64::from(epoch) <= self.end()
    }

    fn grow_to(&mut self, level: u32) {
        self.level = self.level.max(level);
        self.first = self.first >> self.level << self.level;
    }

    fn add(&mut self, other: &Self) {
        self.grow_to(other.level);
        self.looked_through = self.looked_through.wrapping_add(other.looked_through);
        self.cells.add_all(&other.cells);
    }

    /// Counts a look through the whole block; returns whether more is taken out than was put in.
    pub(crate) fn count_whole(&mut self, direction: Direction) -> bool {
        let before = self.looked_through;
        self.looked_through = before.wrapping_add(direction.unit());
        direction == Direction::Remove && before == 0
    }

    /// Counts a finding in a cell; returns whether more is taken out than was put in.
    #[inline]
    pub(crate) fn count(&mut self, index: usize, finding: Finding, direction: Direction) -> bool {
        let before = self.cells.add(index, finding, direction.unit());
        direction == Direction::Remove && before == 0
    }

    /// Counts a finding in some cells; returns whether more is taken out than was put in, in any of them.
    pub(crate) fn count_all(&mut self, cells: &CellBits, finding: Finding, direction: Direction) -> bool {
        if direction == Direction::Insert {
            self.cells.add_one(cells, finding);
            return false;
        }
        let mut is_overdrawn = false;
        for_each_bit(*cells, |index| is_overdrawn |= self.count(index, finding, direction));
        is_overdrawn
    }

    /// Calls `visit` for all of the cells that have counts, and perhaps for some that have none.
    fn for_each(&self, cells: &CellBits, mut visit: impl FnMut(usize, Support)) {
        if self.looked_through == 0 {
            self.cells.for_each(cells, |index, counts| visit(index, Support::of(counts)));
        } else {
            for_each_bit(*cells, |index| visit(index, self.at(index)));
        }
    }

    #[inline]
    fn at(&self, index: usize) -> Support {
        let cell = self.cells.support(index);
        Support { looked_through: cell.looked_through.wrapping_add(self.looked_through), ..cell }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Some frames at irregular epochs.
    fn frames() -> Vec<(i32, usize, Finding)> {
        let findings = [Finding::Surface, Finding::Mover, Finding::LookedThrough];
        (0..400).map(|i| (i * i % 1009 - 300, i as usize % 7, findings[i as usize % 3])).collect()
    }

    fn counted(frames: impl IntoIterator<Item = (i32, usize, Finding)>) -> Epochs {
        let mut epochs = Epochs::default();
        for (epoch, index, finding) in frames {
            epochs.period_mut(epoch).count(index, finding, Direction::Insert);
        }
        epochs
    }

    #[test]
    fn the_order_of_frames_does_not_matter() {
        let mut by_time = frames();
        by_time.sort_by_key(|frame| frame.0);
        assert_eq!(counted(frames()), counted(by_time));
        assert_eq!(counted(frames()), counted(frames().into_iter().rev()));
    }

    /// Regression, found by `saved_cloud`: a reading of the second epoch came into a period of sixteen
    /// epochs, beside the first epoch, which is a part of that period.
    #[cfg(feature = "state")]
    #[test]
    fn periods_that_should_have_been_joined_are_not_restored() {
        for count in 0..frames().len() {
            let kept = counted(frames().into_iter().take(count));
            assert_eq!(Epochs::restored(kept.periods.clone()), Some(kept));
        }
        let periods = |level| vec![Period::new(0, level), Period::new(33, 0)];
        assert!(Epochs::restored(periods(4)).is_some());
        assert_eq!(Epochs::restored(periods(0)), None);
    }

    #[cfg(feature = "state")]
    #[test]
    fn periods_longer_than_any_that_is_made_are_not_restored() {
        for level in [MAX_LEVEL + 1, 63, 64, u32::MAX] {
            let endless = Period { level, ..Period::new(0, 0) };
            assert_eq!(Epochs::restored(vec![endless.clone()]), None);
            assert_eq!(Epochs::restored(vec![Period::new(-9, 0), endless]), None);
        }
    }

    #[test]
    fn parts_merge_to_the_whole() {
        let all = frames();
        let (even, odd): (Vec<_>, Vec<_>) = all.iter().partition(|frame| frame.1 % 2 == 0);
        let mut merged = counted(even.iter().copied());
        merged.merge(&counted(odd.iter().copied()));
        assert_eq!(merged, counted(all));
        let mut swapped = counted(odd);
        swapped.merge(&counted(even));
        assert_eq!(swapped, merged);
    }

    #[test]
    fn what_was_counted_is_taken_out_again() {
        let mut epochs = counted(frames());
        for (epoch, index, finding) in frames() {
            assert!(!epochs.period_mut(epoch).count(index, finding, Direction::Remove));
        }
        assert!((0..7).flat_map(|cell| epochs.of_cell(cell)).all(|(_, counts)| counts == Support::default()));
        assert!(epochs.period_mut(5).count(0, Finding::Mover, Direction::Remove), "overdrawn");
    }

    #[test]
    fn what_was_read_a_month_ago_is_known_in_any_order() {
        let month = 30 * 24 * 1440;
        let frames = [0, 700, month - 1, month, month + 300].map(|epoch| (epoch, 0, Finding::Surface));
        let by_time = counted(frames);
        assert_eq!(by_time.of_cell(0).map(|(_, counts)| counts.support).sum::<u32>(), 5);
        for order in [[4, 3, 2, 1, 0], [4, 0, 3, 1, 2], [1, 4, 2, 0, 3]] {
            assert_eq!(counted(order.map(|index| frames[index])), by_time);
        }
    }

    /// The cells read in any period, found without the cache.
    fn found_read(epochs: &Epochs) -> CellBits {
        epochs.periods.iter().fold(CellBits::default(), |read, period| {
            let cells = period.cells.read();
            std::array::from_fn(|word| read[word] | cells[word])
        })
    }

    #[test]
    fn the_cells_read_are_those_of_all_periods_whatever_has_changed() {
        let mut epochs = Epochs::default();
        for (step, (epoch, index, finding)) in frames().into_iter().enumerate() {
            let direction = if step % 5 == 4 { Direction::Remove } else { Direction::Insert };
            epochs.period_mut(epoch).count((index * 71 + step) % 512, finding, direction);
            if step % 50 == 49 {
                epochs.clear_support(index * 71);
                epochs.give_support(step % 512, 2);
            }
            if step % 3 == 0 {
                assert_eq!(epochs.cells_read(), found_read(&epochs), "step {step}");
            }
        }
        epochs.merge(&counted(frames()));
        assert_eq!(epochs.cells_read(), found_read(&epochs));
    }

    #[test]
    fn hours_take_few_periods() {
        let mut epochs = Epochs::default();
        let (mut most, frames) = (0, 8 * 1440);
        for epoch in 0..frames {
            epochs.period_mut(epoch).count(0, Finding::Surface, Direction::Insert);
            most = most.max(epochs.periods.len());
        }
        assert!(most <= 26, "{most} periods");
        assert!(epochs.memory_bytes_beside(None) < 10_000, "{} bytes", epochs.memory_bytes_beside(None));
        let sum: u32 = epochs.of_cell(0).map(|(_, counts)| counts.support).sum();
        assert_eq!(sum, frames as u32);
        let spans: Vec<[f64; 2]> = epochs.of_cell(0).map(|(period, _)| period.span()).collect();
        assert!(spans.windows(2).all(|pair| pair[1][1] == pair[0][0]), "no gap, no overlap");
        assert_eq!(spans[0], [11_519.0 * EPOCH, 11_520.0 * EPOCH]);
    }

    #[test]
    fn a_year_takes_few_periods() {
        let mut epochs = Epochs::default();
        for epoch in (0..365 * 24 * 1440).step_by(100) {
            epochs.period_mut(epoch).count(0, Finding::Surface, Direction::Insert);
        }
        assert!(epochs.periods.len() <= 40, "{} periods", epochs.periods.len());
    }

    #[test]
    fn the_first_and_the_last_epoch_of_all_are_counted() {
        let mut epochs = Epochs::default();
        for epoch in [i32::MAX, i32::MIN, 0, i32::MAX - 1, i32::MIN + 1] {
            epochs.period_mut(epoch).count(0, Finding::Surface, Direction::Insert);
        }
        assert_eq!(epochs.of_cell(0).map(|(_, counts)| counts.support).sum::<u32>(), 5);
    }
}
