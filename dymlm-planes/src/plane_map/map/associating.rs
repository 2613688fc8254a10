use dymlm_core::Birth;

use super::super::map_plane::MapPlane;
use super::super::placed_share::PlacedShare;
use super::PlaneMap;
use crate::association::{Agreement, FinitePlane, Partition};
use crate::patches::VoxelBox;

/// The plane of the map with which a detected one is associated.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pairing {
    cost: f64,
    pub(super) plane: Birth,
    pub(super) agreement: Agreement,
}

/// Association of detected planes with those of the map.
impl PlaneMap {
    /// The best plane of the map for each detected one. Several detected planes may share it, as parts of one
    /// surface, but not those with a step between them (`steps`, by index): of these the best keeps it.
    pub(super) fn associate(&self, placed: &[PlacedShare], steps: &[[usize; 2]]) -> Vec<Option<Pairing>> {
        let candidates: Vec<Vec<Pairing>> = placed.iter().map(|share| self.candidates_for(share)).collect();
        let mut by_cost: Vec<usize> = (0..placed.len()).collect();
        let least = |share: &usize| candidates[*share].first().map_or(f64::INFINITY, |best| best.cost);
        by_cost.sort_by(|a, b| least(a).total_cmp(&least(b)));
        let mut pairings: Vec<Option<Pairing>> = vec![None; placed.len()];
        for share in by_cost {
            let is_free = |pairing: &&Pairing| {
                !steps.iter().any(|&[a, b]| {
                    let other = if a == share { Some(b) } else { (b == share).then_some(a) };
                    let taken = other.and_then(|other| pairings[other]);
                    taken.is_some_and(|taken| taken.plane == pairing.plane)
                })
            };
            pairings[share] = candidates[share].iter().find(is_free).copied();
        }
        pairings
    }

    /// The planes of the map that may be a detected one, the best first.
    fn candidates_for(&self, share: &PlacedShare) -> Vec<Pairing> {
        let detected = share.finite();
        let region = detected.patch.bounds().grown(self.criterion.reach());
        let pairing = |mapped: &MapPlane| {
            let agreement = self.test([&detected, &mapped.finite()], &region)?;
            Some(Pairing { cost: self.criterion.cost(&agreement), plane: mapped.birth, agreement })
        };
        let mut candidates: Vec<Pairing> = self.near(region).filter_map(pairing).collect();
        // Of equal costs the first wins: the oldest plane.
        candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        candidates
    }

    /// How well two planes agree; `None` unless they adjoin, with no wall between them, and are one.
    pub(super) fn test(
        &self,
        [detected, mapped]: [&FinitePlane<'_>; 2],
        region: &VoxelBox,
    ) -> Option<Agreement> {
        let agreement = self.criterion.test(detected, mapped, region)?;
        self.adjoin_clear_of_walls([detected, mapped], region).then_some(agreement)
    }

    /// Whether two planes that adjoin also do so away from any wall that stands between them.
    fn adjoin_clear_of_walls(&self, [detected, mapped]: [&FinitePlane<'_>; 2], region: &VoxelBox) -> bool {
        // If one plane reaches to the middle of the other, both are on the same side of any wall.
        if mapped.patch.is_near(detected.centroid, self.config.voxel_size) {
            return true;
        }
        let partitions = self.partitions([detected, mapped], region, |wall| wall.is_confirmed);
        partitions.is_empty() || self.criterion.patches_adjoin(detected, mapped, region, &partitions)
    }

    /// The planes that stand between two others in or near a region, among those for which `may_part` holds.
    pub(super) fn partitions(
        &self,
        planes: [&FinitePlane<'_>; 2],
        region: &VoxelBox,
        may_part: impl Fn(&MapPlane) -> bool,
    ) -> Vec<Partition> {
        let [a, b] = planes.map(|plane| self.criterion.near(&plane.patch.bounds()));
        // Two ceilings of a building may be near each other along a whole corridor.
        let region = a.intersection(&b).intersection(&self.criterion.near(region));
        let near = self.near(region).filter(|wall| may_part(wall));
        self.criterion.partitions(planes, &region, near.map(MapPlane::finite))
    }
}
