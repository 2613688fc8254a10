use dymlm_core::Plane;
use dymlm_core::vector3::{along, cross, difference, dot, unit};

use super::finite_plane::FinitePlane;
use crate::linear_algebra::foot_on;
use crate::patches::{Patch, VoxelBox};

/// Cosine of the least angle at which one plane stands across another: 45 degrees. A smaller angle would let
/// a copy of a wall, tilted by noise, divide the wall; with a larger one only upright walls divide.
const COS_ACROSS: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A plane that stands between two coplanar ones: a side of the wall that separates the ceilings of two
/// rooms.
///
/// Depth images do not end a patch exactly at the wall: in the corner readings are within the noise of both,
/// and where they lie on the patch's plane they may be a hand's breadth behind the wall. So it proves nothing
/// that two patches share voxels beside a partition, nor that the partition occludes the way between them.
#[derive(Debug, Clone)]
pub(crate) struct Partition {
    plane: Plane,
    /// How far before and behind the partition patches may stray, metres.
    reach: f64,
    /// Direction of the line in which it meets the two planes. Along this line, in steps of a voxel, `stands`
    /// tells where the partition exists, starting at step `first`.
    along: [f64; 3],
    first: i64,
    stands: Vec<bool>,
    voxel_size: f64,
}

impl Partition {
    /// `None` unless one plane is before the wall and the other behind it within `region`, where they are
    /// near each other. The end of the wall's corner with them may not have been seen, so the partition
    /// extends up to `apart` metres beyond its own voxels. O(voxels of the three planes in the region).
    pub(super) fn new(
        wall: &FinitePlane<'_>,
        [a, b]: [&FinitePlane<'_>; 2],
        region: &VoxelBox,
        voxel_size: f64,
        [apart, reach]: [f64; 2],
    ) -> Option<Self> {
        let is_across =
            |other: &FinitePlane<'_>| dot(wall.plane.normal(), other.plane.normal()).abs() < COS_ACROSS;
        let side = |patch: &Patch| -> f64 {
            patch.voxels_in(region).map(|voxel| wall.plane.signed_distance(voxel.center(voxel_size))).sum()
        };
        if !(is_across(a) && is_across(b) && side(a.patch) * side(b.patch) < 0.0) {
            return None;
        }
        let along = unit(cross(wall.plane.normal(), a.plane.normal()))?;
        let centers = wall.patch.voxels_in(region).map(|voxel| voxel.center(voxel_size));
        let beside = centers.filter(|center| a.plane.signed_distance(*center).abs() <= reach);
        let steps: Vec<i64> = beside.map(|center| (dot(along, center) / voxel_size).floor() as i64).collect();
        let margin = (apart / voxel_size).ceil() as i64;
        let (first, last) = (steps.iter().min()? - margin, steps.iter().max()? + margin);
        let mut stands = vec![false; (last - first + 1) as usize];
        for step in steps {
            stands[(step - margin - first) as usize..=(step + margin - first) as usize].fill(true);
        }
        Some(Self { plane: wall.plane, reach, along, first, stands, voxel_size })
    }

    /// Whether each of two patches lies wholly on its own side of the partition, as the walls of two rooms
    /// do. A thing that stands across a part of one surface does not divide it so. O(blocks, and voxels
    /// beside the partition's plane).
    pub(crate) fn divides(&self, patches: [&Patch; 2]) -> bool {
        let distance = |place: [f64; 3]| self.plane.signed_distance(place);
        let keeps_to = |patch: &Patch, side: f64| {
            patch.blocks().all(|block| {
                let (center, half) = block.sphere(self.voxel_size);
                let from_center = side * distance(center);
                let mut voxels = patch.voxels_of(block).map(|voxel| voxel.center(self.voxel_size));
                from_center >= half
                    || (from_center >= -(half + self.reach)
                        && voxels.all(|place| side * distance(place) >= -self.reach))
            })
        };
        let [a, b] = patches;
        [1.0, -1.0].into_iter().any(|side| keeps_to(a, side) && keeps_to(b, -side))
    }

    /// The place of the partition's plane that is nearest to where a way on a surface crosses it or, when the
    /// way is beside it, to the way's start; off the surface, along its `normal`, by as far as patches may
    /// stray. There the partition would stand if it went on.
    pub(crate) fn passage(&self, [from, to]: [[f64; 3]; 2], normal: [f64; 3]) -> [f64; 3] {
        let [s, t] = [from, to].map(|place| self.plane.signed_distance(place));
        let share = if s * t < 0.0 { s / (s - t) } else { 0.0 };
        foot_on(&self.plane, along(along(from, share, difference(to, from)), self.reach, normal))
    }

    /// Whether the way from one place to another goes through the partition or, when it is too short for
    /// that, runs beside it.
    pub(crate) fn separates(&self, from: [f64; 3], to: [f64; 3]) -> bool {
        let [s, t] = [from, to].map(|place| self.plane.signed_distance(place));
        let share = if s * t < 0.0 { s / (s - t) } else { f64::from(u8::from(s.abs() > t.abs())) };
        let [from, to] = [from, to].map(|place| dot(self.along, place));
        let step = ((from + share * (to - from)) / self.voxel_size).floor() as i64 - self.first;
        let is_there = usize::try_from(step).is_ok_and(|step| self.stands.get(step) == Some(&true));
        is_there && (s * t < 0.0 || s.abs().min(t.abs()) <= self.reach)
    }
}
