use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::Birth;

use super::gap::{GapLook, MAX_THROUGH};

/// Two planes, the older first.
pub(super) type PlanePair = [Birth; 2];

/// What one key frame saw between pairs of planes; each pair once, sorted.
pub(super) type GapLooks = Vec<(PlanePair, GapLook)>;

/// What all key frames saw between pairs of planes.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct GapRecord {
    pairs: BTreeMap<PlanePair, GapTally>,
}

/// Number of key frames that saw a gap occluded, that looked through it, that saw one surface there, and that
/// saw a step; and the sum of the steps' heights, micrometres.
#[derive(Debug, Clone, Copy, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
struct GapTally {
    occluded: u32,
    through: u32,
    joined: u32,
    steps: u32,
    heights: u64,
}

impl GapTally {
    fn of(&mut self, gap_look: GapLook) -> &mut u32 {
        match gap_look {
            GapLook::Occluded => &mut self.occluded,
            GapLook::LookedThrough => &mut self.through,
            GapLook::Joined => &mut self.joined,
            GapLook::Step(_) => &mut self.steps,
        }
    }

    fn add(&mut self, other: &Self) {
        self.occluded += other.occluded;
        self.through += other.through;
        self.joined += other.joined;
        self.steps += other.steps;
        self.heights += other.heights;
    }
}

/// The height of the step that was seen, micrometres; 0 for what is none.
fn height(gap_look: GapLook) -> u64 {
    if let GapLook::Step(height) = gap_look { height.into() } else { 0 }
}

impl GapRecord {
    /// Adds what one key frame saw.
    pub(super) fn add(&mut self, gap_looks: &GapLooks) {
        for (pair, gap_look) in gap_looks {
            let tally = self.pairs.entry(*pair).or_default();
            *tally.of(*gap_look) += 1;
            tally.heights += height(*gap_look);
        }
    }

    /// Subtracts what one key frame saw.
    pub(super) fn subtract(&mut self, gap_looks: &GapLooks) {
        for (pair, gap_look) in gap_looks {
            let Some(tally) = self.pairs.get_mut(pair) else { continue };
            let looks = tally.of(*gap_look);
            *looks = looks.saturating_sub(1);
            tally.heights = tally.heights.saturating_sub(height(*gap_look));
            if [tally.occluded, tally.through, tally.joined, tally.steps] == [0; 4] {
                self.pairs.remove(pair);
            }
        }
    }

    /// Counts what was seen between a plane and others for the plane that it has become. O(all pairs).
    pub(super) fn rename(&mut self, from: Birth, into: Birth) {
        let renamed: Vec<PlanePair> =
            self.pairs.keys().filter(|pair| pair.contains(&from)).copied().collect();
        for pair in renamed {
            let [a, b] = pair.map(|plane| if plane == from { into } else { plane });
            if let Some(tally) = self.pairs.remove(&pair).filter(|_| a != b) {
                self.pairs.entry(pair_of(a, b)).or_default().add(&tally);
            }
        }
    }

    /// Forgets what was seen between some planes and others. O(all pairs), if there are any planes.
    pub(super) fn forget(&mut self, planes: &BTreeSet<Birth>) {
        if !planes.is_empty() {
            self.pairs.retain(|pair, _| !pair.iter().any(|plane| planes.contains(plane)));
        }
    }

    /// Whether the numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(super) fn is_possible(&self) -> bool {
        self.pairs.values().all(|tally| {
            let counts = [tally.occluded, tally.through, tally.joined, tally.steps];
            counts.iter().all(|&count| count < 1 << 30) && tally.heights < 1 << 62
        })
    }

    /// Approximate size in bytes.
    pub(super) fn memory_bytes(&self) -> usize {
        self.pairs.len() * size_of::<(PlanePair, GapTally)>()
    }

    /// Whether key frames saw a step between two planes: more than a share [`MAX_THROUGH`] of those that
    /// could see it.
    pub(super) fn is_step(&self, pair: PlanePair) -> bool {
        self.pairs.get(&pair).is_some_and(|tally| {
            let steps = f64::from(tally.steps);
            steps > MAX_THROUGH * (steps + f64::from(tally.joined))
        })
    }

    /// The mean height of the steps that key frames saw between two planes, metres.
    pub(super) fn step_height(&self, pair: PlanePair) -> Option<f64> {
        let tally = self.pairs.get(&pair).filter(|tally| tally.steps > 0)?;
        Some(1e-6 * tally.heights as f64 / f64::from(tally.steps))
    }

    /// Whether at least `least` key frames saw the gap occluded, and at most a share [`MAX_THROUGH`] looked
    /// through it.
    pub(super) fn is_occluded(&self, pair: PlanePair, least: u32) -> bool {
        self.pairs.get(&pair).is_some_and(|tally| {
            let through = f64::from(tally.through);
            tally.occluded >= least && through <= MAX_THROUGH * (through + f64::from(tally.occluded))
        })
    }
}

/// The pair of two planes: the older first.
pub(super) fn pair_of(a: Birth, b: Birth) -> PlanePair {
    if a < b { [a, b] } else { [b, a] }
}

/// A key frame's looks between planes, with each plane replaced by the one that it has become (`resolve`).
/// Where several pairs have become one, a step counts first, then `Joined`, then `LookedThrough`.
pub(super) fn resolve_looks(gap_looks: &GapLooks, resolve: impl Fn(Birth) -> Birth) -> GapLooks {
    let resolved = gap_looks.iter().map(|&([a, b], gap_look)| (pair_of(resolve(a), resolve(b)), gap_look));
    let mut resolved: GapLooks = resolved.filter(|([a, b], _)| a != b).collect();
    resolved.sort_unstable();
    // After the reversal, a pair's highest `Step` comes first, then `Joined`, `LookedThrough`, `Occluded`.
    resolved.reverse();
    resolved.dedup_by_key(|(pair, _)| *pair);
    resolved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_counts_until_the_last_key_frame_that_showed_it_is_gone() {
        let [a, b, c] = [1, 2, 3].map(Birth::new);
        let [step, occluded, joined] =
            [GapLook::Step(40_000), GapLook::Occluded, GapLook::Joined].map(|look| vec![([a, b], look)]);
        let mut record = GapRecord::default();
        record.add(&step);
        record.add(&step);
        record.add(&occluded);
        record.subtract(&step);
        assert!(record.is_step([a, b]) && !record.is_step([a, c]));
        record.subtract(&step);
        assert!(!record.is_step([a, b]) && record.is_occluded([a, b], 1));
        record.subtract(&occluded);
        // A step that one key frame of ten and more has seen is an error.
        record.add(&step);
        (0..8).for_each(|_| record.add(&joined));
        assert!(record.is_step([a, b]));
        assert_eq!(record.step_height([a, b]), Some(0.04));
        record.add(&joined);
        assert!(!record.is_step([a, b]));
        (0..9).for_each(|_| record.subtract(&joined));
        record.subtract(&step);
        assert_eq!(record.memory_bytes(), 0);
    }

    #[test]
    fn of_pairs_that_have_become_one_a_step_counts_first() {
        let [a, b, c] = [1, 2, 3].map(Birth::new);
        let looks =
            vec![([a, b], GapLook::Occluded), ([a, c], GapLook::Step(9)), ([b, c], GapLook::LookedThrough)];
        // The third has become the second.
        let resolved = resolve_looks(&looks, |birth| if birth == c { b } else { birth });
        assert_eq!(resolved, [([a, b], GapLook::Step(9))]);
    }
}
