use std::collections::BTreeMap;

use super::gap::GapSight;

/// A gap counts as hidden while at most this share of the key frames that look there see through it: noise at the rims.
const MAX_OPEN: f64 = 0.1;

/// What one key frame saw between pairs of planes, smaller id first.
pub(super) type GapSights = BTreeMap<[u64; 2], GapSight>;

/// What all key frames saw between pairs of planes.
#[derive(Debug, Clone, Default)]
pub(super) struct GapRecord {
    pairs: BTreeMap<[u64; 2], GapTally>,
}

/// How many key frames saw a gap hidden, and how many saw through it.
#[derive(Debug, Clone, Copy, Default)]
struct GapTally {
    hidden: u32,
    open: u32,
}

impl GapRecord {
    /// Adds what one key frame saw.
    pub(super) fn add(&mut self, sights: &GapSights) {
        for (pair, sight) in sights {
            let tally = self.pairs.entry(*pair).or_default();
            match sight {
                GapSight::Hidden => tally.hidden += 1,
                GapSight::Open => tally.open += 1,
            }
        }
    }

    /// Whether at least `least` key frames saw the gap hidden, and next to none through it.
    pub(super) fn is_hidden(&self, pair: [u64; 2], least: u32) -> bool {
        self.pairs.get(&pair).is_some_and(|tally| {
            let open = f64::from(tally.open);
            tally.hidden >= least && open <= MAX_OPEN * (open + f64::from(tally.hidden))
        })
    }
}

/// The pair of two planes: smaller id first.
pub(super) fn pair_of(a: u64, b: u64) -> [u64; 2] {
    if a < b { [a, b] } else { [b, a] }
}

/// A key frame's sights by the ids that `resolve` gives to the planes now. Where pairs have become one, what was seen through
/// counts.
pub(super) fn resolve_sights(sights: &GapSights, resolve: impl Fn(u64) -> u64) -> GapSights {
    let mut resolved = GapSights::new();
    for (&[a, b], &sight) in sights {
        let (a, b) = (resolve(a), resolve(b));
        if a != b {
            resolved.entry(pair_of(a, b)).and_modify(|seen| *seen = sight.max(*seen)).or_insert(sight);
        }
    }
    resolved
}
