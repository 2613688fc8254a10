use crate::support::Support;

/// Greatest opinion of a cell, either way. With a lower value, a few frames decide as much as many; without a
/// limit, a surface watched for minutes outvotes the trace of a mover that touched it
/// (`a_movers_trace_beside_a_long_seen_surface_is_removed`).
pub(crate) const MAX_OPINION: f32 = 10.0;
/// Frames after which a period has its full say: a robot that stands still adds no certainty.
const ENOUGH_FRAMES: f32 = 5.0;
/// Share of the say of older periods that is left by a period with its full say. At 0.7 two and a half epochs
/// outweigh any past (`a_new_wall_is_believed_within_ten_seconds`); with a lower value somebody who stops for
/// two seconds becomes a part of the map, with a higher one new things wait longer.
const PAST: f32 = 0.7;
/// How soon a majority is clear: frames that are divided 3 to 1 have their full say.
const CLARITY: f32 = 2.0;
/// Readings in a cell that one look through it outweighs when the question is whether it is firm. Nearly every
/// frame that sees a surface reads it; a place where somebody walks to and fro is looked through whenever he is
/// elsewhere (`where_somebody_walks_to_and_fro_nothing_stands`).
const READINGS_PER_LOOK: f32 = 4.0;
/// Periods that would weigh less than this are left out.
const NEGLIGIBLE: f32 = 0.01;

/// What the counts of a cell say, newer periods outweighing older ones; each part from -10 to 10.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Opinion {
    /// Above 0: something stands there; below 0: the place is free.
    pub(crate) presence: f32,
    /// Whether nearly every frame reads something there, be it a mover, unlike at the rim of a thing; and not
    /// enough frames have looked through it since to decide.
    pub(crate) is_firm: bool,
    /// Below 0: what is read there is mostly a mover.
    pub(crate) staticness: f32,
    /// Whether a surface was ever read there.
    pub(crate) is_read: bool,
}

/// A weighted sum over periods, newest first.
#[derive(Clone, Copy)]
struct Fold {
    sum: f32,
    weight: f32,
}

impl Opinion {
    /// What the counts of periods say, the newest first. One reading of a surface outweighs
    /// `looks_per_reading` looks through it.
    pub(crate) fn of(periods: impl IntoIterator<Item = Support>, looks_per_reading: f32) -> Self {
        let mut fold = OpinionFold::NEW;
        for counts in periods {
            fold.add(counts, looks_per_reading);
            if fold.is_done() {
                break;
            }
        }
        fold.opinion()
    }

    /// Whether something stands there that does not move.
    pub(crate) fn is_static(&self) -> bool {
        self.is_read && self.presence >= 0.0 && self.staticness >= 0.0
    }
}

/// An opinion in the making, from the newest period on.
#[derive(Clone, Copy)]
pub(crate) struct OpinionFold {
    presence: Fold,
    firmness: Fold,
    staticness: Fold,
    is_read: bool,
    /// Frames that have looked through the cell since the last period with a reading, and whether the periods
    /// so far include that one.
    looks_since: u32,
    is_reached: bool,
}

impl OpinionFold {
    pub(crate) const NEW: Self = Self {
        presence: Fold::NEW,
        firmness: Fold::NEW,
        staticness: Fold::NEW,
        is_read: false,
        looks_since: 0,
        is_reached: false,
    };

    /// Takes in the counts of the next older period.
    #[inline]
    pub(crate) fn add(&mut self, counts: Support, looks_per_reading: f32) {
        if self.is_done() {
            return;
        }
        let [surface, looked_through, movers] =
            [counts.support, counts.looked_through, counts.movers].map(|count| count as f32);
        self.is_read |= counts.support > 0;
        self.is_reached |= counts.support > 0 || counts.movers > 0;
        if !self.is_reached {
            self.looks_since = self.looks_since.saturating_add(counts.looked_through);
        }
        self.presence.add(looks_per_reading * surface - looked_through, surface + looked_through);
        let readings = surface + movers;
        self.firmness.add(readings - READINGS_PER_LOOK * looked_through, readings + looked_through);
        self.staticness.add(surface - movers, surface + movers);
    }

    /// Whether older periods have no influence any more.
    #[inline]
    fn is_done(&self) -> bool {
        self.presence.weight.max(self.staticness.weight) < NEGLIGIBLE
    }

    pub(crate) fn opinion(self) -> Opinion {
        let Self { presence, firmness, staticness, is_read, looks_since, is_reached } = self;
        let is_cleared = looks_since as f32 >= ENOUGH_FRAMES;
        let is_firm = is_reached && firmness.sum >= 0.0 && !is_cleared;
        Opinion { presence: presence.limited(), is_firm, staticness: staticness.limited(), is_read }
    }
}

impl Fold {
    const NEW: Self = Self { sum: 0.0, weight: 1.0 };

    /// Adds a period of `frames` frames; `balance`: those for, less those against.
    fn add(&mut self, balance: f32, frames: f32) {
        if frames > 0.0 {
            let certainty = (frames / ENOUGH_FRAMES).min(1.0);
            let majority = (CLARITY * balance / frames).clamp(-1.0, 1.0);
            self.sum += self.weight * certainty * majority * MAX_OPINION;
            self.weight *= 1.0 - (1.0 - PAST) * certainty;
        }
    }

    fn limited(self) -> f32 {
        self.sum.clamp(-MAX_OPINION, MAX_OPINION)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direction::Direction;
    use crate::epochs::Epochs;
    use crate::finding::Finding;

    fn opinion(frames: &[(i32, usize, Finding)]) -> Opinion {
        let mut epochs = Epochs::default();
        for &(epoch, count, finding) in frames {
            for _ in 0..count {
                epochs.period_mut(epoch).count(3, finding, Direction::Insert);
            }
        }
        Opinion::of(epochs.of_cell(3).map(|(_, counts)| counts), 2.0)
    }

    #[test]
    fn opinions_are_cut_and_need_a_reading() {
        assert_eq!(opinion(&[]), Opinion::default());
        assert!(!opinion(&[(0, 9, Finding::LookedThrough)]).is_read);
        assert_eq!(opinion(&[(0, 5, Finding::Surface)]).presence, 10.0);
        assert_eq!(opinion(&[(0, 5, Finding::LookedThrough)]).presence, -10.0);
        // One frame alone has a fifth of the full say.
        assert_eq!(opinion(&[(0, 1, Finding::Surface)]).presence, 2.0);
        // A reading outweighs two looks.
        assert_eq!(opinion(&[(0, 3, Finding::Surface), (0, 6, Finding::LookedThrough)]).presence, 0.0);
    }

    #[test]
    fn three_epochs_outweigh_any_past_and_one_does_not() {
        for hours in [1, 1440, 8 * 1440] {
            let past: Vec<_> = (0..hours).map(|epoch| (epoch, 5, Finding::LookedThrough)).collect();
            let after = |epochs: i32| {
                let new = (0..epochs).map(|epoch| (hours + epoch, 5, Finding::Surface));
                opinion(&past.iter().copied().chain(new).collect::<Vec<_>>()).presence
            };
            assert!(after(3) > 0.0, "{hours} epochs before");
            assert!(hours == 1 || after(1) < 0.0, "{hours} epochs before");
        }
    }

    /// The opinion of a cell that for some epochs was free, then occupied, or the reverse; before an absence,
    /// and after its end, when a frame has seen another cell of the block.
    fn before_and_after_absence(
        start: i32,
        finding: [Finding; 2],
        epochs: [i32; 2],
        absence: i32,
    ) -> [f32; 2] {
        let mut history = Epochs::default();
        let change = start + epochs[0];
        for (range, finding) in [start..change, change..change + epochs[1]].into_iter().zip(finding) {
            for epoch in range {
                (0..5).for_each(|_| _ = history.period_mut(epoch).count(3, finding, Direction::Insert));
            }
        }
        let presence =
            |history: &Epochs| Opinion::of(history.of_cell(3).map(|(_, counts)| counts), 2.0).presence;
        let before = presence(&history);
        history.period_mut(change + epochs[1] + absence).count(5, Finding::Surface, Direction::Insert);
        [before, presence(&history)]
    }

    /// Regression: an hour's absence joined the last minutes before it to one period, whose majority was what
    /// had stood there for longer. A thing put down half a minute before was removed, and one taken away came
    /// back.
    #[test]
    fn an_absence_leaves_what_was_last_seen() {
        for absence in [20, 300, 1440, 14 * 1440] {
            for start in (0..600).step_by(37) {
                for [first, second] in [[120, 3], [120, 12], [1440, 12], [13, 5]] {
                    let put_down = [Finding::LookedThrough, Finding::Surface];
                    let [before, after] = before_and_after_absence(start, put_down, [first, second], absence);
                    assert!(before > 0.0 && after > 0.0, "put down: {before}, {after}; {start} {absence}");
                    let taken = [Finding::Surface, Finding::LookedThrough];
                    let [before, after] = before_and_after_absence(start, taken, [first, second], absence);
                    assert!(before < 0.0 && after < 0.0, "taken away: {before}, {after}; {start} {absence}");
                }
            }
        }
    }

    /// Regression: after an absence, what was free for hours had the say of one epoch, and who stopped for a
    /// second in a doorway became a part of the map.
    #[test]
    fn after_an_absence_one_epoch_does_not_outweigh_hours() {
        for absence in [300, 1440, 14 * 1440] {
            for start in (0..600).step_by(37) {
                let end = start + 1440;
                let mut frames: Vec<_> =
                    (start..end).map(|epoch| (epoch, 5, Finding::LookedThrough)).collect();
                frames.push((end + absence, 5, Finding::Surface));
                let presence = opinion(&frames).presence;
                assert!(presence < 0.0, "{presence} from epoch {start}, {absence} epochs");
            }
        }
    }

    #[test]
    fn who_stays_is_a_mover_until_static_readings_have_the_newest_majority() {
        let mut frames = vec![(0, 70, Finding::Mover), (0, 5, Finding::Surface)];
        frames.extend([(1, 40, Finding::Mover), (1, 35, Finding::Surface)]);
        assert!(opinion(&frames).staticness < 0.0);
        frames.extend((2..5).map(|epoch| (epoch, 20, Finding::Surface)));
        assert!(opinion(&frames).staticness > 0.0);
    }
}
