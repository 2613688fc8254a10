use std::collections::BTreeMap;
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
/// The newest 32 epochs in which a block was seen are joined only as if no time had passed between them: what
/// older ones say is nearly forgotten after as many (`PAST` to the 32nd, in `opinion.rs`), so that later nothing
/// is lost by joining them by time alone. A power of two, and a bit of [`Period::seen`] each.
const RECENT: u32 = u32::BITS;
/// Longest period that can be among the recent ones.
const RECENT_LEVEL: u32 = RECENT.ilog2();

/// The epoch that contains a time, seconds.
pub(crate) fn epoch_of(timestamp: f64) -> i32 {
    // Casts saturate.
    (timestamp / EPOCH).floor() as i32
}

/// The counts of a block of cells over time: by epochs where they are recent, by ever longer periods where
/// they are old.
///
/// Counts within a period are sums, so they do not depend on the order of frames, frames can be taken out
/// again, and two histories add up. Where periods begin and end depends only on the epochs in which the block
/// was seen, not on their order: a period of 2^k epochs, which starts at a multiple of 2^k, is formed as soon as
/// 2^k epochs have passed since its end, and the block was seen in as many of them, or in [`RECENT`]. So there
/// are about 1.5 periods for each doubling of time, and nothing needs to be forgotten: a wall that was seen once
/// and then occluded for a day is still a wall, and a place that is looked through in the morning is known to
/// have been read the evening before.
///
/// Time alone would not do: after an hour without a look, the last minutes before it would be one period, and a
/// thing put down in the last of them would be outvoted by the emptiness before.
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
    /// The epochs in which the block was seen, the first in the lowest bit; 0 above [`RECENT_LEVEL`], where no
    /// rule asks.
    pub(crate) seen: u32,
    /// The first and the last epoch in which it was seen.
    pub(crate) ends: [i32; 2],
    /// Frames that look through the whole block, in addition to the counts of its cells.
    pub(crate) looked_through: u32,
    pub(crate) cells: CellCounts,
}

record!(Epochs { periods, read });
record!(Period { first, level, seen, ends, looked_through, cells });

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
        if !periods.iter().all(is_aligned) || !periods.iter().all(Period::is_seen_within) {
            return None;
        }
        let is_ordered = |pair: &[Period]| pair[0].end() < i64::from(pair[1].first);
        let is_joined = |period: &Period| period.level >= level_of(period.first, &periods);
        if !periods.windows(2).all(is_ordered) || !periods.iter().all(is_joined) {
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
                self.periods.push(Period::of_epoch(epoch));
                self.coarsen();
                self.periods.len() - 1
            }
        };
        &mut self.periods[place]
    }

    /// Counts something in the period of an epoch. What was counted in an older one is packed again: the
    /// block may not come into view for long, as where a frame of hours ago is taken out.
    pub(crate) fn count(&mut self, epoch: i32, count: impl FnOnce(&mut Period) -> bool) -> bool {
        let is_overdrawn = count(self.period_mut(epoch));
        if self.periods.last().is_some_and(|newest| epoch < newest.first) {
            self.pack_older();
        }
        is_overdrawn
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

    /// Whether all that was counted has been taken out again.
    pub(crate) fn is_void(&self) -> bool {
        (0..BLOCK_CELLS).all(|index| self.of_cell(index).all(|(_, counts)| counts == Support::default()))
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
        // An epoch that both have seen counts once, so what overlaps is joined before anything is counted.
        self.join(|period, _| period.level);
        self.coarsen();
    }

    /// Removes the surface readings of some cells.
    pub(crate) fn clear_support(&mut self, cells: impl IntoIterator<Item = usize>) {
        self.read = OlderReads::default();
        for index in cells {
            for period in &mut self.periods {
                period.cells.clear(index, Finding::Surface);
            }
        }
        self.pack_older();
    }

    /// Replaces the history of some cells by so many surface readings each in the newest period.
    pub(crate) fn give_support(&mut self, cells: &BTreeMap<usize, u32>) {
        self.read = OlderReads::default();
        for period in &mut self.periods {
            // The looks that all cells have in common become each cell's own, so that one cell can lose them.
            let common = std::mem::take(&mut period.looked_through);
            if common > 0 {
                for other in 0..BLOCK_CELLS {
                    period.cells.add(other, Finding::LookedThrough, common);
                }
            }
            for &index in cells.keys() {
                for finding in [Finding::Surface, Finding::LookedThrough, Finding::Mover] {
                    period.cells.clear(index, finding);
                }
            }
        }
        if let Some(period) = self.periods.last_mut() {
            for (&index, &support) in cells {
                period.cells.add(index, Finding::Surface, support);
            }
        }
        self.pack_older();
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

    /// The place of the period of an epoch before the newest, which is noted as seen.
    fn place_of_older(&mut self, epoch: i32) -> usize {
        let place_in = |periods: &[Period]| periods.partition_point(|period| period.end() < i64::from(epoch));
        let place = place_in(&self.periods);
        let is_new = match self.periods.get_mut(place) {
            Some(period) if period.contains(epoch) => period.note_seen(epoch),
            _ => {
                self.periods.insert(place, Period::of_epoch(epoch));
                true
            }
        };
        if !is_new {
            return place;
        }
        // Since the end of the periods before it, the block was seen once more.
        self.coarsen();
        place_in(&self.periods)
    }

    /// Joins the periods that have become one since an epoch was added.
    fn coarsen(&mut self) {
        self.join(|period, later| level_of(period.first, later).max(period.level));
        self.pack_older();
    }

    /// Packs the counts of all periods but the newest.
    fn pack_older(&mut self) {
        let older = self.periods.len().saturating_sub(1);
        self.periods.iter_mut().take(older).for_each(|period| period.cells.pack());
    }

    /// Lets each period grow to the level that `level` gives it, from the period and all that are not older,
    /// and joins those that are one then.
    fn join(&mut self, level: impl Fn(&Period, &[Period]) -> u32) {
        let mut joined = 0;
        for place in 0..self.periods.len() {
            let grown = level(&self.periods[place], &self.periods[place..]);
            self.periods[place].grow_to(grown);
            let (before, others) = self.periods.split_at_mut(place);
            match before[..joined].last_mut() {
                Some(last) if last.contains(others[0].first) => last.add(&others[0]),
                _ => {
                    self.periods.swap(joined, place);
                    joined += 1;
                }
            }
        }
        self.periods.truncate(joined);
    }
}

/// Level of the period that an epoch belongs to, among `periods` by time; those before it are not needed.
fn level_of(epoch: i32, periods: &[Period]) -> u32 {
    let Some(newest) = periods.last().map(Period::end) else { return 0 };
    let is_whole = |level: u32| {
        let length = 1_i64 << level;
        let end = (i64::from(epoch) >> level) * length + length - 1;
        newest - end >= length && is_seen_after(end, 1 << level.min(RECENT_LEVEL), periods)
    };
    (1..=MAX_LEVEL).take_while(|&level| is_whole(level)).last().unwrap_or(0)
}

/// Whether the block was seen after an epoch, in at least so many epochs, at most [`RECENT`].
fn is_seen_after(epoch: i64, least: u32, periods: &[Period]) -> bool {
    let mut seen = 0;
    for period in periods.iter().rev().take_while(|period| i64::from(period.first) > epoch) {
        // The block was seen `RECENT` times after a longer one.
        seen += if period.level > RECENT_LEVEL { RECENT } else { period.seen.count_ones() };
        if seen >= least {
            return true;
        }
    }
    false
}

impl Period {
    fn of_epoch(epoch: i32) -> Self {
        Self { first: epoch, level: 0, seen: 1, ends: [epoch; 2], looked_through: 0, cells: CellCounts::None }
    }

    /// From when to when the block was seen in it, seconds, in whole epochs.
    pub(crate) fn span(&self) -> [f64; 2] {
        let [first, last] = self.ends.map(f64::from);
        [first * EPOCH, (last + 1.0) * EPOCH]
    }

    fn end(&self) -> i64 {
        i64::from(self.first) + (1 << self.level) - 1
    }

    fn contains(&self, epoch: i32) -> bool {
        epoch >= self.first && i64::from(epoch) <= self.end()
    }

    /// Notes that the block was seen in one of the period's epochs; returns whether that is known to be new.
    fn note_seen(&mut self, epoch: i32) -> bool {
        self.ends = [self.ends[0].min(epoch), self.ends[1].max(epoch)];
        if self.level > RECENT_LEVEL {
            return false;
        }
        let before = self.seen;
        self.seen |= 1 << (epoch - self.first);
        self.seen != before
    }

    /// Whether the block was seen in an epoch, and in none beyond the period.
    #[cfg(feature = "state")]
    fn is_seen_within(&self) -> bool {
        if self.ends[0] > self.ends[1] || !self.ends.iter().all(|&epoch| self.contains(epoch)) {
            return false;
        }
        match self.level {
            level if level > RECENT_LEVEL => self.seen == 0,
            RECENT_LEVEL => self.seen != 0,
            level => self.seen != 0 && self.seen >> (1 << level) == 0,
        }
    }

    fn grow_to(&mut self, level: u32) {
        let first = self.first;
        self.level = self.level.max(level);
        self.first = self.first >> self.level << self.level;
        self.seen = self.seen_from(first, self.seen);
    }

    /// The epochs seen, when those in `seen` are counted from the epoch `first`.
    fn seen_from(&self, first: i32, seen: u32) -> u32 {
        if self.level > RECENT_LEVEL { 0 } else { seen << (first - self.first) }
    }

    fn add(&mut self, other: &Self) {
        self.grow_to(other.level);
        self.seen |= self.seen_from(other.first, other.seen);
        self.ends = [self.ends[0].min(other.ends[0]), self.ends[1].max(other.ends[1])];
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

    /// Sessions of 20 epochs with an hour between them, and single looks at other times.
    #[test]
    fn the_order_of_sessions_does_not_matter() {
        let session = |session: i32| (0..20).map(move |epoch| (session * 1440 + epoch, epoch as usize % 7));
        let looks = (0..30).map(|look| (look * 773, 3));
        let frames: Vec<_> = (0..12).flat_map(session).chain(looks).collect();
        let in_order = |step: usize| {
            let order = (0..frames.len()).map(|place| frames[place * step % frames.len()]);
            counted(order.map(|(epoch, index)| (epoch, index, Finding::Surface)))
        };
        let by_time = in_order(1);
        // Steps that have no divisor in common with the 270 frames.
        for step in [7, 11, 101, 269] {
            assert_eq!(in_order(step), by_time, "every {step}th frame");
        }
        let part = |rest: usize| {
            let part = frames.iter().enumerate().filter(|(place, _)| place % 3 == rest);
            counted(part.map(|(_, &(epoch, index))| (epoch, index, Finding::Surface)))
        };
        let mut merged = part(2);
        merged.merge(&part(0));
        merged.merge(&part(1));
        assert_eq!(merged, by_time);
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
        let mut kept = counted((0..17).map(|epoch| (epoch, 0, Finding::Surface)));
        assert_eq!(kept.periods[0].level, 3);
        kept.periods[0].level = 0;
        kept.periods[0].seen = 1;
        assert_eq!(Epochs::restored(kept.periods), None);
    }

    #[cfg(feature = "state")]
    #[test]
    fn periods_longer_than_any_that_is_made_are_not_restored() {
        for level in [MAX_LEVEL + 1, 63, 64, u32::MAX] {
            let endless = Period { level, seen: 0, ..Period::of_epoch(0) };
            assert_eq!(Epochs::restored(vec![endless.clone()]), None);
            assert_eq!(Epochs::restored(vec![Period::of_epoch(-9), endless]), None);
        }
    }

    #[cfg(feature = "state")]
    #[test]
    fn periods_seen_in_none_of_their_epochs_are_not_restored() {
        for (level, seen, is_right) in
            [(0, 1, true), (0, 0, false), (0, 2, false), (5, 1 << 31, true), (5, 0, false)]
        {
            let period = Period { level, seen, ..Period::of_epoch(0) };
            assert_eq!(Epochs::restored(vec![period]).is_some(), is_right, "level {level}, seen {seen:b}");
        }
        for (seen, is_right) in [(0, true), (1, false)] {
            let period = Period { level: 6, seen, ..Period::of_epoch(0) };
            assert_eq!(Epochs::restored(vec![period]).is_some(), is_right, "seen {seen:b}");
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
                epochs.clear_support([index * 71]);
                epochs.give_support(&BTreeMap::from([(step % 512, 2)]));
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

    /// Regression: periods that were joined reached back to the round number at which they would begin, hours
    /// before the first frame, and until after the last one before a pause.
    #[test]
    fn no_period_is_longer_than_what_was_seen() {
        for start in [0, 1, 100, 739_313] {
            let mut epochs = Epochs::default();
            let seen = (start..start + 700).chain(start + 5000..start + 5100);
            for epoch in seen.clone() {
                epochs.period_mut(epoch).count(0, Finding::Surface, Direction::Insert);
            }
            let spans: Vec<[f64; 2]> = epochs.of_cell(0).map(|(period, _)| period.span()).collect();
            let is_end =
                |time: f64, shift: i32| seen.clone().any(|epoch| f64::from(epoch + shift) * EPOCH == time);
            assert!(spans.iter().all(|&[from, to]| is_end(from, 0) && is_end(to, 1)), "{spans:?}");
            assert_eq!(spans.last().unwrap()[0], f64::from(start) * EPOCH);
        }
    }

    #[test]
    fn a_year_takes_few_periods() {
        for step in [1000, 1440, 24 * 1440] {
            let mut epochs = Epochs::default();
            for epoch in (0..365 * 24 * 1440).step_by(step) {
                epochs.period_mut(epoch).count(0, Finding::Surface, Direction::Insert);
            }
            let most = 40 + RECENT as usize;
            assert!(epochs.periods.len() <= most, "{} periods, one in {step} epochs", epochs.periods.len());
        }
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
