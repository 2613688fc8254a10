use crate::Spread;
use crate::share::share;

/// How a map's planes compare with the true faces; see [`score_planes`](crate::score_planes) for the
/// formulas.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlaneScore {
    /// Number of planes scored.
    pub planes: usize,
    /// Planes that match a face, by ascending index.
    pub matches: Vec<PlaneMatch>,
    /// Indices of the planes that match no face, ascending.
    pub unmatched: Vec<usize>,
    /// The faces asked for, each with its reliefs, by ascending id.
    pub faces: Vec<FaceScore>,
    /// Planes on the same visible piece of a face as an earlier plane, by ascending index.
    pub duplicates: Vec<DuplicatePlane>,
    /// Planes that cover substantial parts of several faces asked for, by ascending index.
    pub wrongly_merged: Vec<MergedPlane>,
    /// Visible area of the faces asked for, square metres.
    pub visible_area: f64,
    /// Share of the visible area of the faces asked for that planes cover, 0..=1; `None` when no face is
    /// asked for.
    pub area_recall: Option<f64>,
    /// Share of the planes' area that lies on faces, 0..=1, leaving out area on parts of faces without a
    /// reading; `None` without such area.
    pub area_precision: Option<f64>,
    /// Angles between matched planes and their faces, up to sign, degrees; `None` without a match.
    pub angle_degrees: Option<Spread>,
    /// Offsets of matched planes from their faces, metres; `None` without a match.
    pub offset: Option<Spread>,
}

/// A plane that matches a face.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlaneMatch {
    /// Index of the plane.
    pub plane: usize,
    /// Id of the face that contains most of it.
    pub face: usize,
    /// Id of the face that `face` lies on, or `face` itself.
    pub relief: usize,
    /// Share of the plane's area that lies on the face and its reliefs, above 0.5.
    pub share: f64,
    /// Angle between the normals, up to sign, degrees.
    pub angle_degrees: f64,
    /// Mean of the signed distance over the plane's area on the face and its reliefs, metres: positive where
    /// the plane is in front of the face. For a single face, this is the distance at the centroid of that
    /// area.
    pub offset: f64,
    /// The direction of the plane's normal.
    pub facing: Facing,
}

/// The direction of a plane's normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Facing {
    /// Outwards, like the face's normal.
    Outwards,
    /// Into the thing that the face belongs to.
    Inwards,
}

/// A face asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct FaceScore {
    /// Id of the face.
    pub face: usize,
    /// Visible area, including reliefs of at least 0.08 m2, square metres.
    pub visible_area: f64,
    /// Share of that area that the matching planes cover, 0..=1.
    pub coverage: f64,
    /// Intersection over union of the visible area and the area of the matching planes; unseen parts within
    /// the outline do not count. 0 when no plane matches the face.
    pub boundary_iou: f64,
    /// Whether the face was found.
    pub state: FaceState,
}

/// Whether a face was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum FaceState {
    /// Planes match it, and together they cover enough of it.
    Found,
    /// No plane matches it, or too little of it is covered.
    Missed,
}

/// A plane on the same visible piece of a face as an earlier plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct DuplicatePlane {
    /// Index of the plane.
    pub plane: usize,
    /// Index of the first plane on that piece.
    pub of: usize,
}

/// A plane that covers several faces.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MergedPlane {
    /// Index of the plane.
    pub plane: usize,
    /// Ids of the faces, ascending.
    pub faces: Vec<usize>,
}

impl PlaneScore {
    /// Share of the faces asked for that were found; `None` when none is asked for.
    pub fn recall(&self) -> Option<f64> {
        let found = self.faces.iter().filter(|face| face.state == FaceState::Found).count();
        share(found as u64, self.faces.len() as u64)
    }

    /// Share of the planes that match a face; `None` without planes.
    pub fn precision(&self) -> Option<f64> {
        share(self.matches.len() as u64, self.planes as u64)
    }

    /// Number of matched planes whose normal points into the thing.
    pub fn sign_errors(&self) -> usize {
        self.matches.iter().filter(|found| found.facing == Facing::Inwards).count()
    }

    /// Mean boundary `IoU` of the faces that were found; `None` when none was.
    pub fn mean_boundary_iou(&self) -> Option<f64> {
        let found = || self.faces.iter().filter(|face| face.state == FaceState::Found);
        let sum: f64 = found().map(|face| face.boundary_iou).sum();
        (found().count() > 0).then(|| sum / found().count() as f64)
    }
}
