use std::collections::BTreeSet;

use dymlm_core::vector3::{difference, dot, norm, unit};
use dymlm_core::{Birth, DepthView, FrameId, PinholeCamera, Pose, Visibility};

use super::super::insertion::Insertion;
use super::super::judgement::Judgement;
use super::super::map_plane::{MapPlane, Sightings};
use super::PlaneMap;
use crate::detector::{SMALLEST_BLOCK, patch_range};
use crate::linear_algebra::{foot_on, rows, width};
use crate::patches::{BlockKey, PatchVoxel, VoxelBox};

/// Cosine of the angle from the optical axis within which a key frame counts as looking at a place: 25
/// degrees, the inner half of a Kinect's view.
const COS_VIEW: f64 = 0.906_308;
/// Narrow side, pixels of a Kinect, below which a plane that is not found is not missed: two sides of a block
/// of the detector's, which in small images are of [`SMALLEST_BLOCK`]. What is narrower may hold no whole
/// block (`what_is_too_narrow_from_far_away_is_not_missed_there`). With 24, planes fitted across edges stay:
/// precision on the eight sequences falls from 100 to 96 %.
const LEAST_NARROW_SIDE: f64 = 16.0;

/// Confirmation of planes.
impl PlaneMap {
    /// Judges the planes that reach into some boxes (lowest and highest corner, metres, world). A plane is
    /// gone, and not confirmed until judged otherwise, when more than `gone_share` of its inliers stand in
    /// free space, among those of which something is known, and the others are fewer than that leaves of the most
    /// that stood at once: what is pushed along leaves inliers behind, more and more, and is still there. `is_free`
    /// tells whether a place is free space; `None` = unknown. `looked_at` is a box around all that is known better
    /// than before: what lies in it of planes that are gone, and what was free or unknown of others, is judged as
    /// well, since it may be back. All other judgements stay.
    ///
    /// O(inliers in the boxes, and those in `looked_at` that were gone).
    pub fn judge(
        &mut self,
        boxes: impl IntoIterator<Item = [[f64; 3]; 2]>,
        looked_at: Option<[[f64; 3]; 2]>,
        gone_share: f64,
        is_free: impl Fn([f64; 3]) -> Option<bool>,
    ) {
        let around = |corners| VoxelBox::around(corners, self.config.voxel_size);
        let regions = boxes.into_iter().map(|corners| (around(corners), false));
        let mut blocks: Vec<(Birth, _)> = Vec::new();
        for (region, only_gone) in regions.chain(looked_at.map(|corners| (around(corners), true))) {
            for plane in self.near(region) {
                let is_asked = |block| !only_gone || plane.is_gone || plane.judged.contains_key(&block);
                let birth = plane.birth;
                plane.patch.visit_blocks_in(&region, |block| {
                    if is_asked(block) {
                        blocks.push((birth, block));
                    }
                });
            }
        }
        blocks.sort_unstable();
        blocks.dedup();
        for of_plane in blocks.chunk_by(|a, b| a.0 == b.0) {
            let Some(plane) = self.planes.get_mut(&of_plane[0].0) else { continue };
            // What was seen since the last time stood together with what was left then.
            plane.most_stood = plane.standing().max(plane.most_stood);
            for &(_, block) in of_plane {
                plane.judge_block(block, &is_free);
            }
            plane.is_gone = plane.is_free(gone_share);
        }
        let judged: Vec<Birth> = blocks.chunk_by(|a, b| a.0 == b.0).map(|blocks| blocks[0].0).collect();
        self.confirm(judged.iter().copied());
        self.drop_refuted(judged);
    }

    /// The planes at which a key frame looks without having seen them, although they appear wide enough to be
    /// found. Those that are gone are left out: that they are not seen says nothing about what was seen of
    /// them before, and will be if they come back.
    pub(super) fn missed_by(
        &self,
        insertion: &Insertion,
        view: &DepthView<'_>,
        world_from_camera: &Pose,
    ) -> Vec<Birth> {
        let camera = view.camera();
        let (eye, range) = (world_from_camera.translation(), f64::from(patch_range(&self.sensor)));
        let around = [-range, range].map(|side| eye.map(|c| c + side));
        let mut near = self.index.near(&VoxelBox::around(around, self.config.voxel_size));
        let camera_from_world = world_from_camera.inverse();
        near.retain(|birth| {
            let plane = self.planes.get(birth).filter(|_| !insertion.associations.contains(birth));
            plane.filter(|plane| !plane.is_gone).is_some_and(|plane| {
                let sighting = view.look_at_world(&camera_from_world, plane.centroid, 0.0);
                matches!(sighting.visibility, Visibility::Present | Visibility::Absent)
                    && self.is_before(world_from_camera, plane)
                    && narrow_side(plane, camera, world_from_camera)
                        >= (LEAST_NARROW_SIDE * camera.focal_scale()).max(2.0 * SMALLEST_BLOCK as f64)
            })
        });
        near
    }

    /// Whether a plane's centroid is in front of a camera and near its optical axis, near enough to draw a
    /// patch there, and the camera is on the side to which the normal points.
    fn is_before(&self, world_from_camera: &Pose, plane: &MapPlane) -> bool {
        let ray = difference(plane.centroid, world_from_camera.translation());
        let depth = dot(ray, world_from_camera.rotate([0.0, 0.0, 1.0]));
        (depth > 0.0 && depth <= patch_range(&self.sensor).into() && depth >= COS_VIEW * norm(ray))
            && dot(ray, plane.plane.normal()) < 0.0
    }

    pub(super) fn count_missed(&mut self, missed: &[Birth], look: FrameId) {
        for birth in missed {
            if let Some(plane) = self.planes.get_mut(birth) {
                plane.sightings.miss(look);
            }
        }
    }

    /// Confirms planes, or withdraws that, by the key frames that saw or missed them.
    pub(super) fn confirm(&mut self, planes: impl IntoIterator<Item = Birth>) {
        for birth in planes {
            let Some(plane) = self.planes.get_mut(&birth) else { continue };
            let Sightings { count, missed, looks, .. } = plane.sightings;
            plane.is_confirmed = !plane.is_gone
                && count >= self.config.least_observations(missed)
                && looks.share() >= self.config.min_observation_share;
        }
    }

    /// Counts anew the key frames that have seen a plane or looked at it. O(key frames).
    pub(super) fn sightings(&self, birth: Birth) -> Sightings {
        let mut sightings = Sightings::default();
        for (number, key_frame) in self.key_frames.iter() {
            let [saw, looked] = key_frame.looks_at(birth, |birth| self.resolve(birth));
            if saw {
                sightings.add(number, &key_frame);
            } else if looked && sightings.count > 0 {
                // Key frames before the first that saw it do not count: it may not have been there yet.
                sightings.miss(key_frame.look);
            }
        }
        sightings
    }
}

/// The narrow side of a plane as a camera sees it, pixels: of a rectangle with the spread that the plane's
/// inliers have across the line of sight.
fn narrow_side(plane: &MapPlane, camera: &PinholeCamera, world_from_camera: &Pose) -> f64 {
    let ray = difference(plane.centroid, world_from_camera.translation());
    let Some(sight) = unit(ray) else { return 0.0 };
    let spread = rows(&plane.spread);
    let with_sight = spread.map(|row| dot(row, sight));
    let along = dot(with_sight, sight);
    let entry = |a: usize, b: usize| {
        spread[a][b] - with_sight[a] * sight[b] - sight[a] * with_sight[b] + along * sight[a] * sight[b]
    };
    // Along the line of sight nothing is left, so that the two extents are those across it.
    let across = [0, 1, 2].map(|a| [0, 1, 2].map(|b| entry(a, b)));
    width(across) * camera.fx().abs() / norm(ray)
}

impl MapPlane {
    fn judge_block(&mut self, block: BlockKey, is_free: &impl Fn([f64; 3]) -> Option<bool>) {
        let place = |voxel: PatchVoxel| foot_on(&self.plane, voxel.center(self.shape.voxel_size));
        match Judgement::of(self.patch.voxels_of(block), |voxel| is_free(place(voxel))) {
            Some(judgement) => self.judged.insert(block, judgement),
            None => self.judged.remove(&block),
        };
    }

    /// Takes over how an earlier state of it was judged, where it still is.
    pub(super) fn keep_judgement(&mut self, before: Self) {
        (self.is_gone, self.judged, self.most_stood) = (before.is_gone, before.judged, before.most_stood);
        self.forget_gone_voxels();
    }

    /// Forgets how voxels were judged that it has no longer.
    pub(super) fn forget_gone_voxels(&mut self) {
        let patch = &self.patch;
        self.judged.retain(|block, judged| judged.keep(patch.voxels_of(*block)));
    }

    /// The same in some blocks.
    pub(super) fn forget_gone_voxels_in(&mut self, blocks: impl Iterator<Item = BlockKey>) {
        for block in blocks {
            if let Some(judged) = self.judged.get_mut(&block)
                && !judged.keep(self.patch.voxels_of(block))
            {
                self.judged.remove(&block);
            }
        }
    }

    /// Takes over how another plane was judged that is about to become part of it.
    pub(super) fn unite_judgements(&mut self, other: &Self) {
        let blocks: BTreeSet<BlockKey> = self.judged.keys().chain(other.judged.keys()).copied().collect();
        for block in blocks {
            let united = Judgement::united(
                [&*self, other].map(|of| (of.judged.get(&block), of.patch.voxels_of(block))),
            );
            match united {
                Some(judged) => self.judged.insert(block, judged),
                None => self.judged.remove(&block),
            };
        }
        self.most_stood = self.most_stood.max(other.most_stood);
    }

    /// Forgets how it was judged.
    pub(super) fn forget_judgement(&mut self) {
        self.is_gone = false;
        self.judged.clear();
        self.most_stood = 0;
    }

    /// Whether more than a share of its inliers, among those of which something is known, is in free space, and
    /// fewer are left than that leaves of the most that stood at once.
    fn is_free(&self, share: f64) -> bool {
        let (unknown, free) = (self.unknown_voxels(), self.free_voxels());
        let known = self.patch.len().saturating_sub(unknown);
        let most_stood = self.most_stood.min(self.patch.len());
        free as f64 > share * known as f64
            && (known.saturating_sub(free) as f64) < (1.0 - share) * most_stood as f64
    }

    /// Number of its voxels that are neither in free space nor unknown.
    pub(super) fn standing(&self) -> usize {
        self.patch.len().saturating_sub(self.unknown_voxels() + self.free_voxels())
    }

    /// Number of its voxels of which nothing is known.
    fn unknown_voxels(&self) -> usize {
        self.judged.values().map(Judgement::unknown_voxels).sum()
    }

    /// Number of its voxels in free space.
    pub(in crate::plane_map) fn free_voxels(&self) -> usize {
        self.judged.values().map(Judgement::free_voxels).sum()
    }
}
