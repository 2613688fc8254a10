use std::collections::BTreeMap;

use dymlm_core::PlaneId;

use super::gap::{GapLook, MAX_THROUGH};

/// Two planes, smaller id first.
pub(super) type PlanePair = [PlaneId; 2];

/// What one key frame saw between pairs of planes.
pub(super) type GapLooks = BTreeMap<PlanePair, GapLook>;

/// What all key frames saw between pairs of planes.
#[derive(Debug, Clone, Default)]
pub(super) struct GapRecord {
    pairs: BTreeMap<PlanePair, GapTally>,
}

/// How many key frames saw a gap occluded, and how many looked through it.
#[derive(Debug, Clone, Copy, Default)]
struct GapTally {
    occluded: u32,
    through: u32,
}

impl GapRecord {
    /// Adds what one key frame saw.
    pub(super) fn add(&mut self, gap_looks: &GapLooks) {
        for (pair, gap_look) in gap_looks {
            let tally = self.pairs.entry(*pair).or_default();
            match gap_look {
                GapLook::Occluded => tally.occluded += 1,
                GapLook::LookedThrough => tally.through += 1,
            }
        }
    }

    /// Whether at least `least` key frames saw the gap occluded, and next to none looked through it.
    pub(super) fn is_occluded(&self, pair: PlanePair, least: u32) -> bool {
        self.pairs.get(&pair).is_some_and(|tally| {
            let through = f64::from(tally.through);
            tally.occluded >= least && through <= MAX_THROUGH * (through + f64::from(tally.occluded))
        })
    }
}

/// The pair of two planes: smaller id first.
pub(super) fn pair_of(a: PlaneId, b: PlaneId) -> PlanePair {
    if a < b { [a, b] } else { [b, a] }
}

/// A key frame's looks between planes by the ids that `resolve` gives to the planes now. Where pairs have
/// become one, what was looked through counts.
pub(super) fn resolve_looks(gap_looks: &GapLooks, resolve: impl Fn(PlaneId) -> PlaneId) -> GapLooks {
    let mut resolved = GapLooks::new();
    for (&[a, b], &gap_look) in gap_looks {
        let (a, b) = (resolve(a), resolve(b));
        if a != b {
            resolved.entry(pair_of(a, b)).and_modify(|seen| *seen = gap_look.max(*seen)).or_insert(gap_look);
        }
    }
    resolved
}
