use std::collections::BTreeMap;

use dymlm_core::vector3::{difference, norm};
use dymlm_core::{Birth, FrameId, Plane, PlaneId, Point};

use super::fixed_moments::FixedMoments;
use super::judgement::Judgement;
use super::key_frame::KeyFrame;
use super::looks::Looks;
use crate::association::FinitePlane;
use crate::boundary::{BoundaryPolygon, CellPicture, FilledCells, trace_boundary};
use crate::linear_algebra::{Symmetric3, foot_on};
use crate::patches::{BlockKey, Patch, PatchVoxel, VoxelBox};
use crate::plane_frame::PlaneFrame;

/// One finite plane of the map. World frame.
#[derive(Debug, Clone, PartialEq)]
pub struct MapPlane {
    pub(super) birth: Birth,
    /// Its name for callers; no result depends on it.
    pub(super) id: PlaneId,
    pub(super) plane: Plane,
    pub(super) centroid: [f64; 3],
    pub(super) mse: f64,
    /// Covariance of its inliers, square metres.
    pub(super) spread: Symmetric3,
    pub(super) sightings: Sightings,
    pub(super) is_confirmed: bool,
    /// Whether it was judged to be no longer there.
    pub(super) is_gone: bool,
    pub(super) moments: FixedMoments,
    pub(super) patch: Patch,
    /// What the evidence says of blocks of the patch in which not all voxels stand.
    pub(super) judged: BTreeMap<BlockKey, Judgement>,
    /// The most of its voxels that stood at once, neither in free space nor unknown.
    pub(super) most_stood: usize,
    pub(super) shape: ShapeSettings,
}

/// Settings for a plane's patch and boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ShapeSettings {
    pub(super) voxel_size: f64,
    pub(super) max_hole_area: f64,
    pub(super) boundary_tolerance: f64,
}

/// Counts of the key frames that have seen a plane, and of those that looked at it without seeing it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Sightings {
    /// Number of key frames that saw it.
    pub(super) count: u32,
    /// Number of later key frames that looked at its centroid and did not see it.
    pub(super) missed: u32,
    pub(super) looks: Looks,
    /// The first key frame that saw it.
    pub(super) first: FrameId,
    /// Times of the earliest and the latest key frame that saw it, seconds.
    times: [f64; 2],
}

impl Default for Sightings {
    fn default() -> Self {
        let (first, times) = (FrameId::new(u64::MAX), [f64::INFINITY, f64::NEG_INFINITY]);
        Self { count: 0, missed: 0, looks: Looks::default(), first, times }
    }
}

impl Sightings {
    /// Whether the numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(super) fn is_possible(&self) -> bool {
        self.count.max(self.missed) < 1 << 30
            && self.looks.is_possible()
            && self.times.iter().all(|time| !time.is_nan())
    }

    pub(super) fn add(&mut self, id: FrameId, key_frame: &KeyFrame) {
        let timestamp = key_frame.timestamp;
        self.looks.count(key_frame.look, true);
        self.count += 1;
        self.first = self.first.min(id);
        self.times = [self.times[0].min(timestamp), self.times[1].max(timestamp)];
    }

    pub(super) fn miss(&mut self, look: FrameId) {
        self.looks.count(look, false);
        self.missed += 1;
    }

    /// The counts for the merger of two planes; `both_saw` key frames saw both of them, and `both_looked` saw
    /// or looked at both.
    pub(super) fn united(&self, other: &Self, both_saw: u32, both_looked: u32, looks: Looks) -> Self {
        let count = (self.count + other.count).saturating_sub(both_saw);
        let looked = (self.count + self.missed + other.count + other.missed).saturating_sub(both_looked);
        let times = [self.times[0].min(other.times[0]), self.times[1].max(other.times[1])];
        let (missed, first) = (looked.saturating_sub(count), self.first.min(other.first));
        Self { count, missed, looks, first, times }
    }
}

/// How far off a plane its inliers' voxels are looked for, in voxels: as far as association lets them be, and
/// the plane tilts afterwards.
const OFF_PLANE: f64 = 4.0;

impl MapPlane {
    /// A plane without any share added to it yet.
    pub(super) fn new((birth, id): (Birth, PlaneId), plane: Plane, shape: ShapeSettings) -> Self {
        Self {
            birth,
            id,
            plane,
            centroid: [0.0; 3],
            mse: 0.0,
            spread: [0.0; 6],
            sightings: Sightings::default(),
            is_confirmed: false,
            is_gone: false,
            moments: FixedMoments::default(),
            patch: Patch::default(),
            judged: BTreeMap::new(),
            most_stood: 0,
            shape,
        }
    }

    /// Fits the plane to its sums.
    pub(super) fn refit(&mut self) {
        if let Some(fit) = self.moments.fit()
            && let Some(plane) = fit.plane()
        {
            self.plane = plane;
            self.centroid = fit.centroid;
            self.mse = fit.mse;
            self.spread = self.moments.spread();
        }
    }

    /// Id of the plane. It stays the same and is never given to another plane.
    pub fn id(&self) -> PlaneId {
        self.id
    }

    /// Whether enough key frames have seen it, see [`PlaneMap::iter`](crate::PlaneMap::iter).
    pub fn is_confirmed(&self) -> bool {
        self.is_confirmed
    }

    /// The plane, fitted to all its inliers; the normal points to the cameras that saw it.
    pub fn plane(&self) -> Plane {
        self.plane
    }

    /// Weighted mean of its inliers, metres.
    pub fn centroid(&self) -> [f64; 3] {
        self.centroid
    }

    /// Weighted mean squared distance of its inliers from the plane, square metres: noise, and errors of the
    /// poses.
    pub fn mse(&self) -> f64 {
        self.mse
    }

    /// Number of key frames that saw it.
    pub fn observations(&self) -> u32 {
        self.sightings.count
    }

    /// Time of the first key frame that saw it, seconds.
    pub fn first_seen(&self) -> f64 {
        self.sightings.times[0]
    }

    /// Time of the last key frame that saw it, seconds.
    pub fn last_seen(&self) -> f64 {
        self.sightings.times[1]
    }

    /// Sum of the weights of its inliers; a reading with the sensor's least noise (a Kinect's at 0.4 m) has
    /// weight 1, and those of the 21st and later key frames from one place have less and less.
    pub fn weight(&self) -> f64 {
        self.moments.weight()
    }

    /// Its inliers: the centres of their voxels projected onto the plane, in a fixed order. Metres. What it has
    /// left behind, in what is [free space](crate::PlaneMap::judge) now, is in none of its queries.
    pub fn inlier_points(&self) -> impl Iterator<Item = Point> + '_ {
        let voxels = self.standing_blocks().flatten();
        voxels.map(|voxel| foot_on(&self.plane, voxel.center(self.shape.voxel_size)).map(|x| x as f32))
    }

    /// Centres of the voxels that hold its inliers, in the order of [`inlier_points`](Self::inlier_points):
    /// where they were read, to half a voxel, where those are on the plane. Metres.
    pub fn voxel_centers(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.standing_blocks().flatten().map(|voxel| voxel.center(self.shape.voxel_size))
    }

    /// Its outlines with their holes, largest first. O(its voxels).
    pub fn boundary(&self) -> Vec<BoundaryPolygon> {
        self.boundary_of(&self.picture())
    }

    /// Area within its [boundary](Self::boundary), before that is simplified, square metres. O(its voxels).
    pub fn area(&self) -> f64 {
        self.area_of(&self.picture())
    }

    /// Its [boundary](Self::boundary) and [area](Self::area), at the cost of little more than one of them.
    pub fn boundary_and_area(&self) -> (Vec<BoundaryPolygon>, f64) {
        let picture = self.picture();
        let area = self.area_of(&picture);
        (self.boundary_of(&picture), area)
    }

    fn boundary_of(&self, picture: &CellPicture) -> Vec<BoundaryPolygon> {
        trace_boundary(picture, self.frame(), self.shape.voxel_size, self.shape.boundary_tolerance)
    }

    fn area_of(&self, picture: &CellPicture) -> f64 {
        picture.len() as f64 * self.shape.voxel_size * self.shape.voxel_size
    }

    /// Approximate side of a square of its area, metres.
    pub(crate) fn size(&self) -> f64 {
        (self.inlier_voxels() as f64).sqrt() * self.shape.voxel_size
    }

    fn frame(&self) -> PlaneFrame {
        PlaneFrame::new(self.centroid, self.plane.normal())
    }

    /// The picture of the plane's cells that hold inliers, without its small holes.
    fn picture(&self) -> CellPicture {
        let ShapeSettings { voxel_size, max_hole_area, .. } = self.shape;
        let cells = FilledCells::new(self.standing_blocks(), voxel_size, self.frame());
        let mut picture = CellPicture::of(&cells);
        picture.fill_holes((max_hole_area / (voxel_size * voxel_size)) as usize);
        picture
    }

    /// Its voxels that are not in free space, block by block.
    fn standing_blocks(&self) -> impl Iterator<Item = impl Iterator<Item = PatchVoxel>> {
        self.patch.blocks().map(|block| {
            let judged = self.judged.get(&block);
            self.patch.voxels_of(block).filter(move |voxel| judged.is_none_or(|it| !it.is_free(*voxel)))
        })
    }

    /// Whether a voxel of it is not in free space.
    pub(super) fn stands(&self, voxel: PatchVoxel) -> bool {
        self.judged.get(&BlockKey::of(voxel.cell)).is_none_or(|judged| !judged.is_free(voxel))
    }

    /// Whether there are inliers at a point of the plane, or within a voxel of it; at no point that is not
    /// finite.
    pub fn holds(&self, point: [f64; 3]) -> bool {
        let voxel_size = self.shape.voxel_size;
        let beside = || VoxelBox::around([point, point], voxel_size).grown(1);
        point.iter().all(|c| c.is_finite())
            && (self.patch.is_near(point, voxel_size)
                && (self.judged.is_empty()
                    || self.patch.voxels_in(&beside()).any(|voxel| self.stands(voxel)))
                || self.holds_off_plane(point))
    }

    /// Whether an inlier that was read farther off the plane than a voxel, at a pose that was off, is at a
    /// point of the plane, or within a voxel of it.
    fn holds_off_plane(&self, point: [f64; 3]) -> bool {
        let voxel_size = self.shape.voxel_size;
        let off = self.plane.normal().map(|n| OFF_PLANE * voxel_size * n.abs());
        let corners = [-1.0, 1.0].map(|side| [0, 1, 2].map(|axis| point[axis] + side * off[axis]));
        let region = VoxelBox::around(corners, voxel_size).grown(1);
        let is_there = |voxel: PatchVoxel| {
            let foot = foot_on(&self.plane, voxel.center(voxel_size));
            norm(difference(foot, point)) <= voxel_size
        };
        self.patch.voxels_in(&region).any(|voxel| self.stands(voxel) && is_there(voxel))
    }

    /// The inlier nearest to a point of the plane, if one is within `reach` metres; the first among equally
    /// near ones. None for a point that is not finite. O(its voxels up to about twice that distance).
    pub fn nearest_inlier(&self, point: [f64; 3], reach: f64) -> Option<[f64; 3]> {
        if reach.is_nan() || !point.iter().all(|c| c.is_finite()) {
            return None;
        }
        let voxel_size = self.shape.voxel_size;
        let mut radius = (8.0 * voxel_size).min(reach);
        loop {
            let region = VoxelBox::around([-radius, radius].map(|side| point.map(|c| c + side)), voxel_size);
            let voxels = self.patch.voxels_in(&region.grown(1)).filter(|voxel| self.stands(*voxel));
            let inliers = voxels.map(|voxel| foot_on(&self.plane(), voxel.center(voxel_size)));
            let measured = inliers.map(|inlier| (norm(difference(inlier, point)), inlier));
            let nearest = measured.min_by(|a, b| a.0.total_cmp(&b.0));
            match nearest.filter(|(distance, _)| *distance <= radius) {
                Some((_, inlier)) => return Some(inlier),
                None if radius >= reach => return None,
                None => radius = (2.0 * radius).min(reach),
            }
        }
    }

    /// Number of its voxels that hold inliers.
    pub fn inlier_voxels(&self) -> usize {
        self.patch.len().saturating_sub(self.free_voxels())
    }

    /// Approximate bytes that the plane owns and does not share with another state of it.
    pub(super) fn memory_bytes_beside(&self, other: Option<&Self>) -> usize {
        self.patch.memory_bytes_beside(other.map(|other| &other.patch))
            + self.judged.len() * size_of::<(BlockKey, Judgement)>()
            + self.judged.values().map(Judgement::memory_bytes).sum::<usize>()
    }

    pub(super) fn finite(&self) -> FinitePlane<'_> {
        FinitePlane { plane: self.plane, centroid: self.centroid, spread: self.spread, patch: &self.patch }
    }
}
