use std::collections::BTreeMap;

use dymlm_core::PlaneId;

use super::gap::GapSight;

/// A gap is occluded while at most this share of the key frames that look there look through it: noise at the rims.
const MAX_THROUGH: f64 = 0.1;

/// Two planes, smaller id first.
pub(super) type PlanePair = [PlaneId; 2];

/// What one key frame saw between pairs of planes.
pub(super) type GapSights = BTreeMap<PlanePair, GapSight>;

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
    pub(super) fn add(&mut self, sights: &GapSights) {
        for (pair, sight) in sights {
            let tally = self.pairs.entry(*pair).or_default();
            match sight {
                GapSight::Occluded => tally.occluded += 1,
                GapSight::LookedThrough => tally.through += 1,
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

/// A key frame's sights by the ids that `resolve` gives to the planes now. Where pairs have become one, what was looked
/// through counts.
pub(super) fn resolve_sights(sights: &GapSights, resolve: impl Fn(PlaneId) -> PlaneId) -> GapSights {
    let mut resolved = GapSights::new();
    for (&[a, b], &sight) in sights {
        let (a, b) = (resolve(a), resolve(b));
        if a != b {
            resolved.entry(pair_of(a, b)).and_modify(|seen| *seen = sight.max(*seen)).or_insert(sight);
        }
    }
    resolved
}
