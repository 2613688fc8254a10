use dymlm_core::Plane;
use dymlm_core::vector3::{along, dot};

use super::EstimatedPlane;
use super::criteria::LEAST_COSINE;
use crate::nearest::{CELL, MATCHED};
use crate::true_face::{CellRaster, TrueFace, raster_over};

/// An estimated plane divided into cells, with the faces that it may match.
#[derive(Debug)]
pub(super) struct PlacedPlane<'a> {
    pub(super) plane: Plane,
    /// The rings of its boundary, projected onto the plane.
    pub(super) boundary: Vec<Vec<[f64; 3]>>,
    raster: CellRaster,
    /// For each cell, whether its middle is within the boundary.
    filled: Vec<bool>,
    candidates: Vec<Candidate<'a>>,
}

#[derive(Debug)]
struct Candidate<'a> {
    index: usize,
    face: &'a TrueFace,
}

/// The face that a point of a plane lies on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OnFace {
    /// Index of the face.
    pub(super) index: usize,
    /// Distance of the point from the face, metres, positive in front of it.
    pub(super) distance: f64,
    pub(super) view: CellView,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CellView {
    /// The cell has a reading.
    Read,
    /// The cell has no reading.
    Unread,
}

impl<'a> PlacedPlane<'a> {
    /// `None` for a plane without area.
    pub(super) fn new(estimate: &EstimatedPlane, faces: &'a [TrueFace]) -> Option<Self> {
        let plane = Plane::new(estimate.normal, estimate.d).ok()?;
        let boundary = projected(&plane, &estimate.boundary);
        let raster = raster_over(&boundary, plane.normal(), CELL)?;
        let filled = raster.fill(&boundary);
        if !filled.contains(&true) {
            return None;
        }
        let candidates = faces.iter().enumerate().filter_map(|(index, face)| {
            let cosine = dot(plane.normal(), face.plane.normal());
            let near = || may_meet(&raster, face, MATCHED.into());
            (cosine.abs() >= LEAST_COSINE && near() && face.cells.read.contains(&true))
                .then_some(Candidate { index, face })
        });
        let candidates = candidates.collect();
        Some(Self { plane, boundary, raster, filled, candidates })
    }

    /// Middles of the cells within the boundary.
    pub(super) fn cells(&self) -> impl Iterator<Item = [f64; 3]> {
        let cells = self.filled.iter().enumerate().filter(|(_, filled)| **filled);
        cells.map(|(cell, _)| self.raster.center(cell))
    }

    /// Area of a cell, square metres.
    pub(super) fn cell_area(&self) -> f64 {
        self.raster.cell_area()
    }

    /// Area within the boundary, square metres.
    pub(super) fn area(&self) -> f64 {
        self.cells().count() as f64 * self.cell_area()
    }

    /// The nearest face, along its normal, whose outline contains the point.
    pub(super) fn face_at(&self, point: [f64; 3]) -> Option<OnFace> {
        let on_faces = self.candidates.iter().filter_map(|candidate| {
            let face = candidate.face;
            let distance = face.plane.signed_distance(point);
            let cell = face.cells.raster.cell_at(face.cells.raster.coordinates(point))?;
            let view = if face.cells.read[cell] { CellView::Read } else { CellView::Unread };
            let is_on = distance.abs() <= f64::from(MATCHED) && face.cells.inside[cell];
            is_on.then_some(OnFace { index: candidate.index, distance, view })
        });
        on_faces.min_by(|own, other| own.distance.abs().total_cmp(&other.distance.abs()))
    }

    /// For each cell of a face, whether it is within the boundary, where the plane lies on faces that
    /// `belongs` accepts.
    pub(super) fn covered(&self, face: &TrueFace, belongs: impl Fn(usize) -> bool) -> Vec<bool> {
        let raster = &face.cells.raster;
        let mut covered = raster.fill(&self.boundary);
        for (cell, covered) in covered.iter_mut().enumerate().filter(|(_, covered)| **covered) {
            let center = raster.center(cell);
            let on_plane = along(center, -self.plane.signed_distance(center), self.plane.normal());
            *covered = self.face_at(on_plane).is_some_and(|on_face| belongs(on_face.index));
        }
        covered
    }

    /// Whether the plane may match a face that `belongs` accepts.
    pub(super) fn may_lie_on(&self, belongs: impl Fn(usize) -> bool) -> bool {
        self.candidates.iter().any(|candidate| belongs(candidate.index))
    }
}

fn projected(plane: &Plane, rings: &[Vec<[f64; 3]>]) -> Vec<Vec<[f64; 3]>> {
    let finite = |point: &&[f64; 3]| point.iter().all(|c| c.is_finite());
    let onto = |&point: &[f64; 3]| along(point, -plane.signed_distance(point), plane.normal());
    rings.iter().map(|ring| ring.iter().filter(finite).map(onto).collect()).collect()
}

/// Whether the bounds of a raster along the world's axes are within `reach` of a face's.
fn may_meet(raster: &CellRaster, face: &TrueFace, reach: f64) -> bool {
    let bounds = |raster: &CellRaster| {
        let corners = [(0, 0), (0, 1), (1, 0), (1, 1)];
        let corners = corners.map(|(c, r)| raster.corner_at(c * raster.columns(), r * raster.rows()));
        let fold = |start: f64, pick: fn(f64, f64) -> f64| -> [f64; 3] {
            std::array::from_fn(|axis| corners.iter().map(|corner| corner[axis]).fold(start, pick))
        };
        (fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max))
    };
    let ((low_a, high_a), (low_b, high_b)) = (bounds(raster), bounds(&face.cells.raster));
    (0..3).all(|axis| low_a[axis] - reach <= high_b[axis] && low_b[axis] - reach <= high_a[axis])
}
