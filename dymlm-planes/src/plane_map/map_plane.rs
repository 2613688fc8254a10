use dymlm_core::{Plane, PlaneId, Point};

use super::fixed_moments::FixedMoments;
use crate::association::FinitePlane;
use crate::boundary::{BoundaryPolygon, trace_boundary};
use crate::linear_algebra::foot_on;
use crate::patch::{Bounds, Patch};
use crate::plane_grid::{PlaneFrame, PlaneGrid};

/// One finite plane of the map. World frame.
#[derive(Debug, Clone, PartialEq)]
pub struct MapPlane {
    pub(super) id: PlaneId,
    pub(super) plane: Plane,
    pub(super) centroid: [f64; 3],
    pub(super) mse: f64,
    pub(super) sightings: Sightings,
    /// Number of key frames that looked at its centroid, where that decides whether it is confirmed; else 0.
    pub(super) looks: usize,
    pub(super) is_confirmed: bool,
    /// Whether it was judged to stand there no more.
    pub(super) is_gone: bool,
    pub(super) moments: FixedMoments,
    pub(super) patch: Patch,
    pub(super) bounds: Bounds,
    pub(super) shape: ShapeSettings,
}

/// How a plane's shape is kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ShapeSettings {
    pub(super) voxel_size: f64,
    pub(super) max_hole_area: f64,
    pub(super) boundary_tolerance: f64,
}

/// When a plane was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sightings {
    /// Number of key frames that saw it.
    pub(super) count: u32,
    /// Times of the first and the last of them, seconds.
    times: [f64; 2],
}

impl Default for Sightings {
    fn default() -> Self {
        Self { count: 0, times: [f64::INFINITY, f64::NEG_INFINITY] }
    }
}

impl Sightings {
    pub(super) fn add(&mut self, timestamp: f64) {
        self.count += 1;
        self.times = [self.times[0].min(timestamp), self.times[1].max(timestamp)];
    }
}

impl MapPlane {
    /// A plane that nothing has been added to.
    pub(super) fn new(id: PlaneId, plane: Plane, shape: ShapeSettings) -> Self {
        Self {
            id,
            plane,
            centroid: [0.0; 3],
            mse: 0.0,
            sightings: Sightings::default(),
            looks: 0,
            is_confirmed: false,
            is_gone: false,
            moments: FixedMoments::default(),
            bounds: Patch::default().bounds(shape.voxel_size),
            patch: Patch::default(),
            shape,
        }
    }

    /// Fits the plane to its sums.
    pub(super) fn refit(&mut self) {
        self.bounds = self.patch.bounds(self.shape.voxel_size);
        if let Some(fit) = self.moments.fit()
            && let Some(plane) = fit.plane()
        {
            self.plane = plane;
            self.centroid = fit.centroid;
            self.mse = fit.mse;
        }
    }

    /// Id of the plane. It never changes and never comes again.
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

    /// Weighted mean squared distance of its inliers, square metres: noise, and how well the poses fit.
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

    /// Sum of the weights of its inliers; a reading at 0.4 m weighs 1.
    pub fn weight(&self) -> f64 {
        self.moments.weight()
    }

    /// Its inliers: the centres of their voxels set onto the plane, in a fixed order. Metres.
    pub fn inlier_points(&self) -> impl Iterator<Item = Point> + '_ {
        let voxels = self.patch.voxels().iter();
        voxels.map(|voxel| foot_on(&self.plane, voxel.center(self.shape.voxel_size)).map(|x| x as f32))
    }

    /// Its outlines with their holes, largest first. O(its voxels).
    pub fn boundary(&self) -> Vec<BoundaryPolygon> {
        let ShapeSettings { max_hole_area, boundary_tolerance, .. } = self.shape;
        self.grid().map_or_else(Vec::new, |grid| trace_boundary(&grid, max_hole_area, boundary_tolerance))
    }

    /// Area of the cells that hold inliers, square metres. O(its voxels).
    pub fn area(&self) -> f64 {
        let cells = self.grid().map_or(0, |grid| grid.occupied().iter().filter(|&&cell| cell).count());
        cells as f64 * self.shape.voxel_size * self.shape.voxel_size
    }

    /// Which cells of the plane hold inliers.
    pub(crate) fn grid(&self) -> Option<PlaneGrid> {
        let frame = PlaneFrame::new(self.centroid, self.plane.normal());
        PlaneGrid::filled_by(&self.patch, self.shape.voxel_size, frame)
    }

    /// Whether there are inliers at a point of the plane, or beside it by no more than a voxel.
    pub fn holds(&self, point: [f64; 3]) -> bool {
        self.patch.is_near(point, self.shape.voxel_size)
    }

    /// Number of its voxels.
    pub fn inlier_voxels(&self) -> usize {
        self.patch.voxels().len()
    }

    pub(super) fn finite(&self) -> FinitePlane<'_> {
        FinitePlane {
            plane: self.plane,
            centroid: self.centroid,
            patch: &self.patch,
            bounds: self.bounds,
            edge_points: None,
        }
    }
}
