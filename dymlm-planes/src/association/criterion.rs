use dymlm_core::Plane;
use dymlm_core::vector3::dot;

use super::config::{AssociationConfig, Sides};
use super::contact::Contact;
use super::finite_plane::FinitePlane;
use super::partition::Partition;
use crate::linear_algebra::quadratic_form;
use crate::patches::VoxelBox;
use crate::plane_frame::PlaneFrame;

/// How well two planes agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Agreement {
    /// Angle between the normals, radians.
    pub(crate) angle: f64,
    /// Root mean square distance of the detected patch from the map plane, metres.
    pub(crate) distance: f64,
    /// Whether they agree only when one normal is reversed.
    pub(crate) flipped: bool,
}

/// The test whether a detected plane `P_c` is the plane `P_w` of the map: equations 1 and 2, and the patches
/// adjoin. Paper III-B, with corrections:
///
/// - everything is compared in the world, n = `R_wc` `n_c`, d = `d_c` - n . `t_wc`;
/// - normals point to the camera that saw them, and equation 1 has no absolute value: the other side of a
///   thin thing is another face ([`Sides`]);
/// - equation 2 compares the planes over the detected patch. At the world's origin a small angle makes a large
///   difference; at the patch's centroid alone it makes none, and a floor takes in the ramp that begins on it;
/// - equation 3, by which planes are also one when more than half of the patch's edge points are near the
///   plane of the map, is left out: the edge that is near the camera has most of the points, so that it
///   accepts the same ramp. In rooms and buildings it joined nothing else that equation 2 does not, and with
///   poses that drift hardly anything;
/// - patches must overlap or nearly touch, because two desks of one height are two planes. (Unless key frames
///   showed that something nearer occludes their connection; see [`Self::test_across_gap`].)
#[derive(Debug, Clone)]
pub(crate) struct Criterion {
    config: AssociationConfig,
    voxel_size: f64,
    cos_max_angle: f64,
}

impl Criterion {
    pub(crate) fn new(config: &AssociationConfig, voxel_size: f64) -> Self {
        Self { config: config.clone(), voxel_size, cos_max_angle: config.max_angle_deg.to_radians().cos() }
    }

    /// How well two planes agree, compared within a region; `None` when they are not one plane.
    pub(crate) fn test(
        &self,
        detected: &FinitePlane<'_>,
        mapped: &FinitePlane<'_>,
        region: &VoxelBox,
    ) -> Option<Agreement> {
        let reach = f64::from(self.reach());
        if detected.patch.bounds().distance(&mapped.patch.bounds()) > reach {
            return None;
        }
        let agreement = self.compare(detected, mapped)?;
        let is_near = self.offsets_agree(agreement.distance);
        (is_near && self.patches_adjoin(detected, mapped, region, &[])).then_some(agreement)
    }

    /// Those of `others` that stand between two planes in a region: see [`Partition`].
    pub(crate) fn partitions<'a>(
        &self,
        planes: [&FinitePlane<'_>; 2],
        region: &VoxelBox,
        others: impl Iterator<Item = FinitePlane<'a>>,
    ) -> Vec<Partition> {
        let lengths = [self.max_offset(), f64::from(self.reach()) * self.voxel_size];
        let of = |wall: FinitePlane<'a>| Partition::new(&wall, planes, region, self.voxel_size, lengths);
        others.filter_map(of).collect()
    }

    /// The region in which what lies in another may be joined with something across a gap.
    pub(crate) fn near(&self, region: &VoxelBox) -> VoxelBox {
        region.grown((self.config.max_occluded_gap / self.voxel_size).ceil() as i32)
    }

    /// Largest distance between patches that adjoin, voxels.
    pub(crate) fn reach(&self) -> i32 {
        ((self.config.max_gap + 2.0 * self.max_offset()) / self.voxel_size).ceil() as i32
    }

    /// Whether two surfaces at this distance from each other, metres, one of them `step` metres before the
    /// other, could pass for one in the map.
    pub(crate) fn could_pass_for_one(&self, [a, b]: [&Plane; 2], distance: f64, step: f64) -> bool {
        distance <= f64::from(self.reach()) * self.voxel_size
            && step <= self.max_offset()
            && self.normals_agree(a, b).is_some()
    }

    /// Largest distance of a patch's voxels from the plane, metres.
    fn max_offset(&self) -> f64 {
        self.config.max_distance + 2.0 * self.voxel_size
    }

    /// How well planes agree whose patches do not adjoin. Without contact they must agree better: the sum of
    /// the squared errors of equations 1 and 2, each relative to its threshold, must be at most 1.
    pub(crate) fn test_across_gap(
        &self,
        detected: &FinitePlane<'_>,
        mapped: &FinitePlane<'_>,
    ) -> Option<Agreement> {
        self.compare(detected, mapped).filter(|agreement| self.cost(agreement) <= 1.0)
    }

    /// How well two planes agree, wherever their patches lie; `None` when their normals do not (equation 1).
    fn compare(&self, detected: &FinitePlane<'_>, mapped: &FinitePlane<'_>) -> Option<Agreement> {
        let (angle, flipped) = self.normals_agree(&detected.plane, &mapped.plane)?;
        Some(Agreement { angle, distance: distance_between(detected, mapped), flipped })
    }

    /// Equation 1: the angle beta between the normals is below `beta_Th`. Returns the angle, and whether one
    /// normal must be reversed.
    fn normals_agree(&self, a: &Plane, b: &Plane) -> Option<(f64, bool)> {
        let cosine = dot(a.normal(), b.normal());
        let flipped = self.config.sides == Sides::Joined && cosine < 0.0;
        let cosine = if flipped { -cosine } else { cosine };
        (cosine > self.cos_max_angle).then(|| (cosine.min(1.0).acos(), flipped))
    }

    /// Equation 2: the distance is below `d_Th`.
    fn offsets_agree(&self, distance: f64) -> bool {
        distance < self.config.max_distance
    }

    /// Whether the patches overlap or lie within the gap of each other on the map plane, elsewhere than
    /// beside a wall that stands between them.
    pub(crate) fn patches_adjoin(
        &self,
        detected: &FinitePlane<'_>,
        mapped: &FinitePlane<'_>,
        region: &VoxelBox,
        partitions: &[Partition],
    ) -> bool {
        let frame = PlaneFrame::new(mapped.centroid, mapped.plane.normal());
        let Self { voxel_size, config: AssociationConfig { max_gap, .. }, .. } = *self;
        let contact = Contact { voxel_size, frame, max_gap, reach: self.reach(), region, partitions };
        contact.holds(detected.patch, mapped.patch)
    }

    /// Cost of an agreement, for choosing the best one: 0 is perfect, 1 is at a threshold.
    pub(crate) fn cost(&self, agreement: &Agreement) -> f64 {
        let angle = agreement.angle / self.config.max_angle_deg.to_radians();
        let distance = agreement.distance / self.config.max_distance.max(1e-9);
        angle * angle + distance * distance
    }
}

/// Root mean square distance from a plane of the map, metres, of the part of the detected plane that has
/// inliers. The noise of the inliers is not part of it.
fn distance_between(detected: &FinitePlane<'_>, mapped: &FinitePlane<'_>) -> f64 {
    let offset = mapped.plane.signed_distance(detected.centroid);
    let variance = |plane: &Plane| quadratic_form(&detected.spread, plane.normal());
    let by_inclination = (variance(&mapped.plane) - variance(&detected.plane)).max(0.0);
    (offset * offset + by_inclination).sqrt()
}
