mod asked_faces;
mod criteria;
mod estimated_plane;
mod placed_plane;
mod report;

use std::collections::BTreeMap;

use asked_faces::{AskedFace, asked_faces};
use criteria::{MIN_AREA, MIN_COVERAGE, MIN_WIDTH};
use dymlm_core::vector3::{cross, dot};
pub use estimated_plane::EstimatedPlane;
use placed_plane::{CellView, OnFace, PlacedPlane};
pub use report::{DuplicatePlane, FaceScore, FaceState, Facing, MergedPlane, PlaneMatch, PlaneScore};

use crate::Spread;
use crate::TrueFace;

/// Scores the finite planes of a map against the true faces.
///
/// A plane is divided into cells of 2 cm within its boundary. A cell lies on a face when the angle between
/// plane and face is at most 10 degrees, up to sign, and the cell's middle, projected along the face's
/// normal, is inside the face's outline and at most 5 cm away; among several such faces, it lies on the
/// nearest one. Faces without any reading are not considered. All areas below are counted in these cells, or
/// in the faces' own. A face and its [reliefs](TrueFace::relief) are asked for together, and are called a
/// face here.
///
/// - **Match**: a plane matches the face that contains most of its area, if that is more than half of it.
/// - **Asked for** are faces with a visible area of at least 0.08 m2, not counting strips narrower than 10
///   cm. Their reliefs below 0.08 m2 may be covered or not, in all figures.
/// - **Recall** = faces found / faces asked for. A face is found if planes match it, and all of these
///   together cover at least a quarter of its visible area.
/// - **Precision** = planes with a match / planes.
/// - **Duplicates**: planes that match the same face as an earlier plane, on the same visible piece of it. A
///   face has several pieces where unseen strips of at least 10 cm part what was seen: a wall on both sides of
///   a door whose lintel was never in view may be one plane or two, as two desks of one height are. On a face
///   with reliefs, planes with most of their area on different members are not duplicates: a map may
///   distinguish a keyboard from the desk, but need not.
/// - **Wrongly merged**: planes with more than 0.08 m2 on each of several faces asked for.
/// - **Area recall** = visible area of the faces asked for that any plane covers / their visible area. **Area
///   precision** = area of the planes on parts of faces with a reading / (that area + area on no face). Area
///   on parts without a reading (below things that stand there) is left out.
/// - **Angle** of a match: between the normals, up to sign; a normal of the wrong sign is a sign error.
///   **Offset**: absolute mean of the signed distance to the face over the plane's area on it.
/// - **Boundary `IoU`** of a face: seen cells covered by its planes / (seen cells + area of its planes
///   outside it).
///
/// O(planes x cells x faces within reach); 50 planes of a room take well below a second.
///
/// ```
/// use dymlm_core::Plane;
/// use dymlm_metrics::{EstimatedPlane, TrueFace, score_planes};
///
/// let outline = vec![[0.0, 0.0, 0.7], [1.2, 0.0, 0.7], [1.2, 0.6, 0.7], [0.0, 0.6, 0.7]];
/// let table = TrueFace::new(0, Plane::new([0.0, 0.0, 1.0], -0.7)?, vec![outline.clone()], 0.02).ok_or("no area")?;
/// let estimate = EstimatedPlane { normal: [0.0, 0.0, 1.0], d: -0.71, boundary: vec![outline] };
///
/// let score = score_planes(&[estimate], &[table]);
/// assert_eq!((score.recall(), score.precision()), (Some(1.0), Some(1.0)));
/// assert!((score.offset.ok_or("no match")?.median - 0.01).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn score_planes(planes: &[EstimatedPlane], faces: &[TrueFace]) -> PlaneScore {
    let placed: Vec<Option<PlacedPlane<'_>>> =
        planes.iter().map(|plane| PlacedPlane::new(plane, faces)).collect();
    let readings: Vec<Reading> = placed
        .iter()
        .map(|placed| placed.as_ref().map_or_else(Reading::default, |p| Reading::of(p, faces)))
        .collect();
    let matches: Vec<PlaneMatch> = placed
        .iter()
        .zip(&readings)
        .enumerate()
        .filter_map(|(index, (placed, reading))| find_match(index, placed.as_ref()?, reading, faces))
        .collect();
    let asked = asked_faces(faces);
    let with_area: Vec<&PlacedPlane<'_>> = placed.iter().flatten().collect();
    let visible_area = asked.iter().map(|face| face.visible_area).sum();
    let covered: f64 = asked.iter().map(|face| covered_area(&face.wanted, face.id, &with_area, faces)).sum();
    let matched = |index: &usize| matches.iter().any(|found| found.plane == *index);
    PlaneScore {
        planes: planes.len(),
        unmatched: (0..planes.len()).filter(|index| !matched(index)).collect(),
        faces: asked.iter().map(|face| score_face(face, &matches, &placed, &readings, faces)).collect(),
        duplicates: find_duplicates(&matches, &placed, faces),
        wrongly_merged: find_merged(&readings, &asked),
        visible_area,
        area_recall: (visible_area > 0.0).then(|| covered / visible_area),
        area_precision: area_precision(&readings),
        angle_degrees: Spread::of(matches.iter().map(|found| found.angle_degrees).collect()),
        offset: Spread::of(matches.iter().map(|found| found.offset.abs()).collect()),
        matches,
    }
}

/// The faces that a plane's area lies on.
#[derive(Debug, Clone, Default)]
struct Reading {
    /// The plane's area, square metres.
    area: f64,
    /// Area on no face.
    off_faces: f64,
    /// Area on each face that the plane meets, by ascending index.
    on_faces: Vec<AreaOnFace>,
}

#[derive(Debug, Clone, Copy)]
struct AreaOnFace {
    /// Index and relief of the face.
    face: usize,
    relief: usize,
    read: f64,
    unread: f64,
    /// Integral of the signed distance from the face over the area.
    moment: f64,
}

impl AreaOnFace {
    fn area(&self) -> f64 {
        self.read + self.unread
    }
}

impl Reading {
    fn of(placed: &PlacedPlane<'_>, faces: &[TrueFace]) -> Self {
        let mut by_face: Vec<Option<AreaOnFace>> = vec![None; faces.len()];
        let cell_area = placed.cell_area();
        let mut off_faces = 0.0;
        for cell in placed.cells() {
            let Some(OnFace { index, distance, view }) = placed.face_at(cell) else {
                off_faces += cell_area;
                continue;
            };
            let empty =
                AreaOnFace { face: index, relief: faces[index].relief, read: 0.0, unread: 0.0, moment: 0.0 };
            let on_face = by_face[index].get_or_insert(empty);
            match view {
                CellView::Read => on_face.read += cell_area,
                CellView::Unread => on_face.unread += cell_area,
            }
            on_face.moment += distance * cell_area;
        }
        Self { area: placed.area(), off_faces, on_faces: by_face.into_iter().flatten().collect() }
    }

    /// Area that is not on the face `relief` or its reliefs.
    fn area_beyond(&self, relief: usize) -> f64 {
        let others = self.on_faces.iter().filter(|on_face| on_face.relief != relief);
        self.off_faces + others.map(AreaOnFace::area).sum::<f64>()
    }

    /// Area on the face `relief` and its reliefs.
    fn area_on(&self, relief: usize) -> f64 {
        self.on_faces.iter().filter(|on_face| on_face.relief == relief).map(AreaOnFace::area).sum()
    }
}

/// The face that contains more than half of a plane.
fn find_match(
    plane: usize,
    placed: &PlacedPlane<'_>,
    reading: &Reading,
    faces: &[TrueFace],
) -> Option<PlaneMatch> {
    let by_relief =
        |a: &&AreaOnFace, b: &&AreaOnFace| reading.area_on(a.relief).total_cmp(&reading.area_on(b.relief));
    let relief = reading.on_faces.iter().max_by(by_relief)?.relief;
    let on_relief = || reading.on_faces.iter().filter(|on_face| on_face.relief == relief);
    let most = on_relief().max_by(|a, b| a.area().total_cmp(&b.area()))?;
    let (face, area) = (&faces[most.face], reading.area_on(relief));
    let share = area / reading.area;
    let cosine = dot(placed.plane.normal(), face.plane.normal());
    (share > 0.5).then(|| PlaneMatch {
        plane,
        face: face.id,
        relief,
        share,
        angle_degrees: angle_degrees(placed.plane.normal(), face.plane.normal()),
        offset: on_relief().map(|on_face| on_face.moment).sum::<f64>() / area,
        facing: if cosine > 0.0 { Facing::Outwards } else { Facing::Inwards },
    })
}

/// Angle between two normals, up to sign, degrees; computed from the sine, which is precise for small angles.
fn angle_degrees(a: [f64; 3], b: [f64; 3]) -> f64 {
    let sine = cross(a, b);
    dot(sine, sine).sqrt().atan2(dot(a, b).abs()).to_degrees()
}

/// Seen area of the faces `members` that planes cover, where the planes lie on the face with id `relief` or
/// on one of its reliefs.
fn covered_area(members: &[usize], relief: usize, planes: &[&PlacedPlane<'_>], faces: &[TrueFace]) -> f64 {
    let belongs = |index: usize| faces[index].relief == relief;
    let covered = members.iter().map(|&member| {
        let cells = &faces[member].cells;
        let mut covered = vec![false; cells.seen.len()];
        for plane in planes.iter().filter(|plane| plane.may_lie_on(belongs)) {
            covered.iter_mut().zip(plane.covered(&faces[member], belongs)).for_each(|(any, one)| *any |= one);
        }
        covered.iter_mut().zip(&cells.seen).for_each(|(covered, &seen)| *covered &= seen);
        cells.area_of(&covered)
    });
    covered.sum()
}

fn score_face(
    asked: &AskedFace,
    matches: &[PlaneMatch],
    placed: &[Option<PlacedPlane<'_>>],
    readings: &[Reading],
    faces: &[TrueFace],
) -> FaceScore {
    let matching = || matches.iter().filter(|found| found.relief == asked.id).map(|found| found.plane);
    let planes: Vec<&PlacedPlane<'_>> = matching().filter_map(|plane| placed[plane].as_ref()).collect();
    let covered = covered_area(&asked.wanted, asked.id, &planes, faces);
    let covered_too = covered_area(&asked.optional, asked.id, &planes, faces);
    let beyond: f64 = matching().map(|plane| readings[plane].area_beyond(asked.id)).sum();
    let coverage = covered / asked.visible_area;
    let found = !planes.is_empty() && coverage >= MIN_COVERAGE;
    FaceScore {
        face: asked.id,
        visible_area: asked.visible_area,
        coverage,
        boundary_iou: (covered + covered_too) / (asked.visible_area + covered_too + beyond),
        state: if found { FaceState::Found } else { FaceState::Missed },
    }
}

fn find_duplicates(
    matches: &[PlaneMatch],
    placed: &[Option<PlacedPlane<'_>>],
    faces: &[TrueFace],
) -> Vec<DuplicatePlane> {
    let mut duplicates = Vec::new();
    for (index, face) in faces.iter().enumerate() {
        let planes: Vec<usize> =
            matches.iter().filter(|found| found.face == face.id).map(|found| found.plane).collect();
        if planes.len() < 2 {
            continue;
        }
        let pieces = face.cells.visible_pieces(MIN_WIDTH);
        let mut first_on: BTreeMap<usize, usize> = BTreeMap::new();
        for plane in planes {
            let Some(placed) = &placed[plane] else { continue };
            let Some(piece) = main_piece(placed, index, face, &pieces) else { continue };
            let of = *first_on.entry(piece).or_insert(plane);
            if of != plane {
                duplicates.push(DuplicatePlane { plane, of });
            }
        }
    }
    duplicates.sort_unstable_by_key(|duplicate| duplicate.plane);
    duplicates
}

/// The visible piece of a face that a plane covers most of; `None` when it covers nothing seen.
fn main_piece(
    placed: &PlacedPlane<'_>,
    index: usize,
    face: &TrueFace,
    pieces: &[Option<usize>],
) -> Option<usize> {
    let mut cells_on: BTreeMap<usize, usize> = BTreeMap::new();
    for (covered, piece) in placed.covered(face, |other| other == index).into_iter().zip(pieces) {
        if let (true, Some(piece)) = (covered, piece) {
            *cells_on.entry(*piece).or_insert(0) += 1;
        }
    }
    cells_on.into_iter().max_by_key(|&(_, cells)| cells).map(|(piece, _)| piece)
}

fn find_merged(readings: &[Reading], asked: &[AskedFace]) -> Vec<MergedPlane> {
    let merged = |(plane, reading): (usize, &Reading)| {
        let substantial = asked.iter().filter(|face| reading.area_on(face.id) > MIN_AREA);
        let faces: Vec<usize> = substantial.map(|face| face.id).collect();
        (faces.len() > 1).then_some(MergedPlane { plane, faces })
    };
    readings.iter().enumerate().filter_map(merged).collect()
}

fn area_precision(readings: &[Reading]) -> Option<f64> {
    let on_faces = readings.iter().flat_map(|reading| &reading.on_faces);
    let read: f64 = on_faces.map(|on_face| on_face.read).sum();
    let off_faces: f64 = readings.iter().map(|reading| reading.off_faces).sum();
    (read + off_faces > 0.0).then(|| read / (read + off_faces))
}
