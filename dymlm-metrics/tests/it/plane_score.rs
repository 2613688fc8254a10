//! The score of planes on maps made wrong on purpose, each with the figure that it must give.
use dymlm_core::vector3::{cross, dot};
use dymlm_core::{Plane, Pose};
use dymlm_metrics::{EstimatedPlane, FaceCells, FaceState, Facing, PlaneScore, TrueFace, score_planes};
use proptest::prelude::*;

const CELL: f64 = 0.02;

/// A rectangle around `center` with sides along the orthogonal unit vectors `u` and `v`; its normal is u x v.
fn rectangle(center: [f64; 3], u: [f64; 3], v: [f64; 3], size: [f64; 2]) -> Vec<[f64; 3]> {
    [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]
        .map(|[a, b]| std::array::from_fn(|k| center[k] + a * size[0] * u[k] + b * size[1] * v[k]))
        .to_vec()
}

fn face(id: usize, center: [f64; 3], u: [f64; 3], v: [f64; 3], size: [f64; 2]) -> TrueFace {
    let normal = cross(u, v);
    let plane = Plane::new(normal, -dot(normal, center)).unwrap();
    TrueFace::new(id, plane, vec![rectangle(center, u, v, size)], CELL).unwrap()
}

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const MINUS_X: [f64; 3] = [-1.0, 0.0, 0.0];

/// A floor of 4 x 3 m; two desks of the same height, 1.2 x 0.6 m, 40 cm apart; both sides of a partition 5 cm
/// thick, 2 x 1 m; a book of 0.04 m2. All are completely visible.
fn room() -> Vec<TrueFace> {
    vec![
        face(0, [0.0, 0.0, 0.0], X, Y, [4.0, 3.0]),
        face(1, [-0.8, 0.5, 0.74], X, Y, [1.2, 0.6]),
        face(2, [0.8, 0.5, 0.74], X, Y, [1.2, 0.6]),
        face(3, [0.0, 1.0, 0.7], X, Z, [2.0, 1.0]),
        face(4, [0.0, 1.05, 0.7], MINUS_X, Z, [2.0, 1.0]),
        face(5, [-0.8, 0.5, 0.80], X, Y, [0.2, 0.2]),
    ]
}

/// A map that equals the truth.
fn perfect(faces: &[TrueFace]) -> Vec<EstimatedPlane> {
    let exact = |face: &TrueFace| EstimatedPlane {
        normal: face.plane.normal(),
        d: face.plane.d(),
        boundary: face.visible_boundary(),
    };
    faces.iter().map(exact).collect()
}

fn score(planes: &[EstimatedPlane], faces: &[TrueFace]) -> PlaneScore {
    score_planes(planes, faces)
}

fn close(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} is not {expected}");
}

/// The plane and its boundary moved by `pose`.
fn moved(plane: &EstimatedPlane, pose: &Pose) -> EstimatedPlane {
    let parameters = Plane::new(plane.normal, plane.d).unwrap().transformed(pose);
    let ring = |ring: &Vec<[f64; 3]>| ring.iter().map(|&point| pose.transform_point(point)).collect();
    EstimatedPlane {
        normal: parameters.normal(),
        d: parameters.d(),
        boundary: plane.boundary.iter().map(ring).collect(),
    }
}

fn about(point: [f64; 3], axis: [f64; 3], degrees: f64) -> Pose {
    let (sin, cos) = (0.5 * degrees.to_radians()).sin_cos();
    let turn = Pose::new([0.0; 3], [axis[0] * sin, axis[1] * sin, axis[2] * sin, cos]).unwrap();
    let at = |place: [f64; 3]| Pose::new(place, [0.0, 0.0, 0.0, 1.0]).unwrap();
    at(point) * turn * at(point.map(|c| -c))
}

fn shifted(by: [f64; 3]) -> Pose {
    Pose::new(by, [0.0, 0.0, 0.0, 1.0]).unwrap()
}

#[test]
fn the_truth_scores_full_marks() {
    let faces = room();
    let score = score(&perfect(&faces), &faces);
    assert_eq!((score.recall(), score.precision(), score.sign_errors()), (Some(1.0), Some(1.0), 0));
    assert_eq!(
        (score.area_recall, score.area_precision, score.mean_boundary_iou()),
        (Some(1.0), Some(1.0), Some(1.0))
    );
    assert!(score.duplicates.is_empty() && score.wrongly_merged.is_empty() && score.unmatched.is_empty());
    // The book is too small to be asked for, but is matched nevertheless.
    assert_eq!(score.faces.iter().map(|face| face.face).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
    assert_eq!((score.planes, score.matches.len(), score.matches[5].face), (6, 6, 5));
    close(score.visible_area, 12.0 + 2.0 * 0.72 + 2.0 * 2.0, 1e-9);
    let (angle, offset) = (score.angle_degrees.unwrap(), score.offset.unwrap());
    assert!(angle.p95 < 1e-9 && offset.p95 < 1e-12, "{angle:?}, {offset:?}");
}

#[test]
fn a_plane_removed_is_a_face_missed() {
    let faces = room();
    let mut planes = perfect(&faces);
    planes.remove(2);
    let score = score(&planes, &faces);
    assert_eq!((score.recall(), score.precision()), (Some(0.8), Some(1.0)));
    close(score.area_recall.unwrap(), 1.0 - 0.72 / 17.44, 1e-9);
    let missed: Vec<usize> =
        score.faces.iter().filter(|face| face.state == FaceState::Missed).map(|face| face.face).collect();
    assert_eq!(missed, [2]);
}

#[test]
fn a_plane_doubled_is_a_duplicate() {
    let faces = room();
    let mut planes = perfect(&faces);
    planes.push(planes[3].clone());
    let score = score(&planes, &faces);
    assert_eq!(
        (score.recall(), score.precision(), score.mean_boundary_iou()),
        (Some(1.0), Some(1.0), Some(1.0))
    );
    assert_eq!((score.duplicates.len(), score.duplicates[0].plane, score.duplicates[0].of), (1, 6, 3));

    // Two halves of a face are duplicates, too: a face should be one plane.
    let mut planes = perfect(&faces);
    planes[0].boundary = vec![rectangle([-1.0, 0.0, 0.0], X, Y, [2.0, 3.0])];
    planes.push(EstimatedPlane {
        boundary: vec![rectangle([1.0, 0.0, 0.0], X, Y, [2.0, 3.0])],
        ..planes[0].clone()
    });
    let halves = self::score(&planes, &faces);
    assert_eq!(
        (halves.duplicates.len(), halves.mean_boundary_iou(), halves.area_recall),
        (1, Some(1.0), Some(1.0))
    );
}

/// The true face of a wall of 4 x 2.5 m, of which the columns of cells for which `is_seen` holds were seen.
fn partly_seen_wall(is_seen: impl Fn(f64) -> bool) -> TrueFace {
    let whole = face(0, [0.0, 0.0, 1.25], X, Z, [4.0, 2.5]);
    let mut cells = whole.cells().clone();
    for (cell, seen) in cells.seen.iter_mut().enumerate() {
        *seen = is_seen(cells.raster.center(cell)[0]);
    }
    cells.read.clone_from(&cells.seen);
    TrueFace::from_cells(0, whole.plane, whole.outline.clone(), cells).unwrap()
}

#[test]
fn cells_and_their_lists_must_fit() {
    let whole = face(0, [0.0, 0.0, 1.25], X, Z, [4.0, 2.5]);
    let lists: [fn(&mut FaceCells) -> &mut Vec<bool>; 3] =
        [|cells| &mut cells.inside, |cells| &mut cells.seen, |cells| &mut cells.read];
    for list in lists {
        let mut cells = whole.cells().clone();
        list(&mut cells).pop();
        assert!(TrueFace::from_cells(0, whole.plane, whole.outline.clone(), cells).is_none());
    }
}

#[test]
fn planes_on_parts_that_were_read_but_not_well_seen_are_no_duplicates() {
    let whole = face(0, [0.0, 0.0, 1.25], X, Z, [4.0, 2.5]);
    let mut cells = whole.cells().clone();
    cells.seen.fill(false);
    let unseen = TrueFace::from_cells(0, whole.plane, whole.outline.clone(), cells).unwrap();
    let end = |x: f64| {
        let end = face(0, [x, 0.0, 1.25], X, Z, [0.8, 2.5]);
        EstimatedPlane { normal: end.plane.normal(), d: end.plane.d(), boundary: end.outline.clone() }
    };
    let score = self::score(&[end(-1.5), end(1.5)], &[unseen]);
    assert!(score.duplicates.is_empty(), "{:?}", score.duplicates);
}

#[test]
fn planes_on_pieces_that_nothing_seen_connects_are_no_duplicates() {
    let piece = |from: f64, to: f64| EstimatedPlane {
        normal: [0.0, -1.0, 0.0],
        d: 0.0,
        boundary: vec![rectangle([f64::midpoint(from, to), 0.0, 1.25], X, Z, [to - from, 2.5])],
    };
    // A wall on both sides of a door, 90 cm wide, whose lintel was not seen.
    let planes = [piece(-2.0, -0.5), piece(0.4, 2.0)];
    let parted = partly_seen_wall(|x| !(-0.5..0.4).contains(&x));
    let score = self::score(&planes, std::slice::from_ref(&parted));
    assert_eq!((score.recall(), score.precision(), score.duplicates.len()), (Some(1.0), Some(1.0), 0));
    // One plane for both is right as well.
    let one = self::score(
        &[EstimatedPlane { boundary: parted.visible_boundary(), ..planes[0].clone() }],
        &[parted],
    );
    assert_eq!((one.recall(), one.precision(), one.duplicates.len()), (Some(1.0), Some(1.0), 0));

    // A second plane on one of the pieces is a duplicate of the plane there.
    let parted = partly_seen_wall(|x| !(-0.5..0.4).contains(&x));
    let doubled = self::score(&[planes[0].clone(), planes[1].clone(), piece(0.5, 1.9)], &[parted]);
    assert_eq!((doubled.duplicates.len(), doubled.duplicates[0].plane, doubled.duplicates[0].of), (1, 2, 1));

    // Nothing but a narrow strip was not seen, or the planes alone leave the middle out.
    for wall in [partly_seen_wall(|x| !(0.0..0.06).contains(&x)), partly_seen_wall(|_| true)] {
        assert_eq!(self::score(&planes, &[wall]).duplicates.len(), 1);
    }
}

#[test]
fn two_desks_in_one_plane_are_wrongly_merged() {
    let faces = room();
    let mut planes = perfect(&faces);
    let second = planes.remove(2).boundary;
    planes[1].boundary.extend(second);
    let merged = score(&planes, &faces);
    assert_eq!(merged.wrongly_merged.len(), 1);
    assert_eq!((merged.wrongly_merged[0].plane, &merged.wrongly_merged[0].faces[..]), (1, &[1, 2][..]));
    // Neither desk contains more than half of the plane, so it matches none.
    assert_eq!((&merged.unmatched[..], merged.matches.len()), (&[1][..], 4));
    assert_eq!(merged.faces.iter().filter(|face| face.state == FaceState::Found).count(), 3);
    // All area is still covered, and correct.
    assert_eq!((merged.area_recall, merged.area_precision), (Some(1.0), Some(1.0)));

    // With only 0.3 m2 on the second desk, the plane matches the first one; the rest is outside it.
    planes[1].boundary[1] = rectangle([0.45, 0.5, 0.74], X, Y, [0.5, 0.6]);
    let partly = score(&planes, &faces);
    assert_eq!((partly.matches.len(), partly.wrongly_merged.len(), partly.recall()), (5, 1, Some(0.8)));
    close(partly.faces[1].boundary_iou, 0.72 / 1.02, 1e-9);
    close(partly.matches[1].share, 0.72 / 1.02, 1e-9);
}

#[test]
fn a_tilted_plane_is_off_by_its_angle() {
    let faces = room();
    let mut planes = perfect(&faces);
    planes[1] = moved(&planes[1], &about([-0.8, 0.5, 0.74], Y, 1.0));
    let score = score(&planes, &faces);
    close(score.matches[1].angle_degrees, 1.0, 1e-9);
    // Rotated about its centre, so the mean offset is zero.
    close(score.matches[1].offset, 0.0, 1e-9);
    assert_eq!(
        (score.recall(), score.precision(), score.angle_degrees.unwrap().median),
        (Some(1.0), Some(1.0), 0.0)
    );
    close(score.angle_degrees.unwrap().p95, 1.0, 1e-9);
    // cos 1 degree of its length is covered, which is less than a cell less.
    close(score.faces[1].boundary_iou, 1.0, 1e-9);
}

#[test]
fn a_plane_tilted_too_far_stands_for_nothing() {
    let faces = room();
    let mut planes = perfect(&faces);
    planes[1] = moved(&planes[1], &about([-0.8, 0.5, 0.74], Y, 10.5));
    let score = score(&planes, &faces);
    assert_eq!((score.recall(), score.precision(), score.unmatched), (Some(0.8), Some(5.0 / 6.0), vec![1]));
}

#[test]
fn a_shifted_plane_is_off_by_the_shift() {
    let faces = room();
    let mut planes = perfect(&faces);
    for plane in &mut planes {
        let normal = plane.normal;
        *plane = moved(plane, &shifted(normal.map(|c| 0.007 * c)));
    }
    let near = score(&planes, &faces);
    assert_eq!(
        (near.recall(), near.precision(), near.mean_boundary_iou()),
        (Some(1.0), Some(1.0), Some(1.0))
    );
    for found in &near.matches {
        close(found.offset, 0.007, 1e-9);
    }
    close(near.offset.unwrap().median, 0.007, 1e-9);

    // Beyond 5 cm there is no match.
    planes[1] = moved(&planes[1], &shifted([0.0, 0.0, -0.06]));
    assert_eq!(score(&planes, &faces).unmatched, [1]);
}

#[test]
fn a_flipped_normal_is_a_sign_error_and_nothing_else() {
    let faces = room();
    let mut planes = perfect(&faces);
    for plane in [1, 3] {
        planes[plane].normal = planes[plane].normal.map(|c| -2.0 * c);
        planes[plane].d *= -2.0;
    }
    let score = score(&planes, &faces);
    assert_eq!((score.sign_errors(), score.recall(), score.precision()), (2, Some(1.0), Some(1.0)));
    // The other side of the partition, 5 cm behind, has the flipped normal, but does not match the plane: the
    // nearest face counts.
    assert_eq!(score.matches.iter().map(|found| found.face).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5]);
    assert_eq!((score.matches[3].facing, score.matches[4].facing), (Facing::Inwards, Facing::Outwards));
    assert!(score.duplicates.is_empty() && score.angle_degrees.unwrap().p95 < 1e-9);
}

#[test]
fn an_invented_plane_costs_precision() {
    let faces = room();
    let mut planes = perfect(&faces);
    planes.push(EstimatedPlane {
        normal: Z,
        d: -1.5,
        boundary: vec![rectangle([0.0, 0.0, 1.5], X, Y, [1.0, 1.0])],
    });
    let score = score(&planes, &faces);
    assert_eq!((score.recall(), score.unmatched), (Some(1.0), vec![6]));
    assert_eq!(score.matches.len(), 6);
    close(score.area_precision.unwrap(), 17.48 / 18.48, 1e-9);
}

#[test]
fn a_plane_too_large_is_beyond_its_face_and_one_too_small_covers_a_part() {
    let faces = room();
    let mut planes = perfect(&faces);
    planes[1].boundary = vec![rectangle([-0.8, 0.5, 0.74], X, Y, [1.2, 0.9])];
    planes[2].boundary = vec![rectangle([0.8, 0.5, 0.74], X, Y, [0.6, 0.6])];
    let sized = score(&planes, &faces);
    close(sized.faces[1].boundary_iou, 0.72 / 1.08, 0.03);
    close(sized.matches[1].share, 0.72 / 1.08, 0.03);
    assert_eq!((sized.faces[2].boundary_iou, sized.faces[2].coverage, sized.recall()), (0.5, 0.5, Some(1.0)));

    // A plane over less than a quarter of a desk does not find it.
    planes[2].boundary = vec![rectangle([0.8, 0.5, 0.74], X, Y, [0.28, 0.6])];
    let patch = score(&planes, &faces);
    assert_eq!(
        (patch.faces[2].state, patch.recall(), patch.precision()),
        (FaceState::Missed, Some(0.8), Some(1.0))
    );
}

#[test]
fn rings_within_rings_are_holes() {
    let faces = room();
    let mut planes = perfect(&faces);
    planes[0].boundary.push(rectangle([0.0, 0.0, 0.0], X, Y, [2.0, 1.5]));
    let score = score(&planes, &faces);
    close(score.faces[0].boundary_iou, 0.75, 1e-9);
    close(score.area_recall.unwrap(), 1.0 - 3.0 / 17.44, 1e-9);
    assert_eq!(score.area_precision, Some(1.0));
}

#[test]
fn nothing_in_nothing_out() {
    let faces = room();
    let none = score(&[], &faces);
    assert_eq!(
        (none.recall(), none.precision(), none.area_recall, none.area_precision),
        (Some(0.0), None, Some(0.0), None)
    );
    assert_eq!((none.offset, none.angle_degrees, none.mean_boundary_iou()), (None, None, None));
    let unasked = score(&perfect(&faces), &[]);
    assert_eq!((unasked.recall(), unasked.precision(), unasked.area_precision), (None, Some(0.0), Some(0.0)));
    let empty = score(&[], &[]);
    assert_eq!((empty.recall(), empty.precision(), empty.visible_area), (None, None, 0.0));
}

#[test]
fn planes_that_are_none_count_against_precision_only() {
    let faces = room();
    let mut planes = perfect(&faces);
    let clean = score(&planes, &faces);
    let square = || vec![rectangle([0.0; 3], X, Y, [1.0, 1.0])];
    planes.extend([
        EstimatedPlane::default(),
        EstimatedPlane { normal: [0.0; 3], d: 1.0, boundary: square() },
        EstimatedPlane { normal: [f64::NAN, 0.0, 1.0], d: 0.0, boundary: square() },
        EstimatedPlane { normal: Z, d: f64::INFINITY, boundary: square() },
        EstimatedPlane {
            normal: Z,
            d: 0.0,
            boundary: vec![vec![[0.0; 3], [1.0, 0.0, 0.0]], vec![[f64::NAN; 3]; 5]],
        },
        EstimatedPlane {
            normal: Z,
            d: 0.0,
            boundary: vec![vec![[0.0; 3], [1e300, 0.0, 0.0], [0.0, -1e300, 0.0]]],
        },
        EstimatedPlane { normal: Z, d: -1e6, boundary: vec![rectangle([0.0, 0.0, 1e6], X, Y, [1e6, 1e-3])] },
    ]);
    // An invalid point in a valid ring.
    planes[1].boundary[0].insert(1, [f64::NAN, 0.0, f64::INFINITY]);
    let score = score(&planes, &faces);
    assert_eq!((&score.matches, score.planes), (&clean.matches, clean.planes + 7));
    assert_eq!((score.recall(), score.mean_boundary_iou(), score.unmatched.len()), (Some(1.0), Some(1.0), 7));
}

/// A desk with a sheet of paper (6 mm), a keyboard (24 mm) and a box of 10 cm on it.
fn laid_desk() -> Vec<TrueFace> {
    let mut faces = vec![
        face(0, [0.0, 0.0, 0.7], X, Y, [1.6, 0.8]),
        face(1, [-0.4, 0.0, 0.706], X, Y, [0.2, 0.3]),
        face(2, [0.1, 0.0, 0.724], X, Y, [0.44, 0.14]),
        face(3, [0.6, 0.0, 0.8], X, Y, [0.3, 0.3]),
    ];
    faces[1].relief = 0;
    faces[2].relief = 0;
    faces
}

#[test]
fn thin_things_on_a_desk_may_be_planes_or_not() {
    let faces = laid_desk();
    let all = perfect(&faces);
    // In turn: all planes; desk and box; keyboard, box and desk, in another order.
    let maps = [
        all.clone(),
        vec![all[0].clone(), all[3].clone()],
        vec![all[2].clone(), all[3].clone(), all[0].clone()],
    ];
    for planes in maps {
        let score = score(&planes, &faces);
        assert_eq!(
            (score.recall(), score.precision(), score.mean_boundary_iou()),
            (Some(1.0), Some(1.0), Some(1.0))
        );
        assert!(score.duplicates.is_empty() && score.wrongly_merged.is_empty(), "{score:?}");
        assert_eq!(score.faces.iter().map(|face| face.face).collect::<Vec<_>>(), [0, 3]);
    }
    // The keyboard's plane alone does not find the desk.
    let keyboard = score(&all[2..3], &faces);
    assert_eq!((keyboard.recall(), keyboard.precision()), (Some(0.0), Some(1.0)));
    // A second plane over the whole desk is a duplicate, even if it is near the keyboard's height.
    let mut double = vec![all[0].clone(), moved(&all[0], &shifted([0.0, 0.0, 0.012]))];
    assert_eq!(score(&double, &faces).duplicates.len(), 1);
    double[1] = moved(&all[0], &shifted([0.0, 0.0, 0.02]));
    assert_eq!(score(&double, &faces).duplicates.len(), 1);
}

#[test]
fn drawers_may_be_one_plane_but_not_two() {
    // Three drawers, 1.5 cm before a cabinet's front.
    let front = |z: f64, id: usize| {
        let mut drawer = face(id, [0.0, -0.015, z], X, Z, [0.74, 0.31]);
        drawer.relief = 0;
        drawer
    };
    let faces =
        vec![face(0, [0.0, 0.0, 0.55], X, Z, [0.8, 1.1]), front(0.2, 1), front(0.55, 2), front(0.9, 3)];
    // With noise, a map may have one plane between drawers and front.
    let one = |offset: f64| EstimatedPlane {
        normal: [0.0, -1.0, 0.0],
        d: -offset,
        boundary: vec![rectangle([0.0, -offset, 0.55], X, Z, [0.8, 1.1])],
    };
    let whole = score(&[one(0.011)], &faces);
    assert_eq!((whole.recall(), whole.precision(), whole.faces.len()), (Some(1.0), Some(1.0), 1));
    assert!(whole.wrongly_merged.is_empty() && whole.duplicates.is_empty() && whole.area_recall == Some(1.0));
    // 4 mm behind the drawers (0.688 of 0.88 m2), 11 mm in front of the rest.
    close(whole.matches[0].offset, (-0.004 * 0.688_2 + 0.011 * 0.191_8) / 0.88, 3e-4);
    assert_eq!(score(&[one(0.011), one(0.009)], &faces).duplicates.len(), 1);
    assert!(score(&perfect(&faces[1..]), &faces).duplicates.is_empty(), "each drawer may have its own");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn neither_motion_nor_order_matters(
        axis in prop::array::uniform3(-1.0..1.0_f64), degrees in -180.0..180.0_f64,
        place in prop::array::uniform3(-30.0..30.0_f64), rotate_by in 0..7_usize,
    ) {
        let length = dot(axis, axis).sqrt();
        prop_assume!(length > 0.1);
        let motion = shifted(place) * about([0.0; 3], axis.map(|c| c / length), degrees);
        let faces = room();
        let mut planes = perfect(&faces);
        planes[1] = moved(&planes[1], &about([-0.8, 0.5, 0.74], Y, 1.0));
        planes[2] = moved(&planes[2], &shifted([0.013, 0.0, 0.007]));
        planes[3].boundary = vec![rectangle([-0.303, 1.0, 0.7], X, Z, [1.111, 0.9])];
        planes.push(planes[4].clone());
        let expected = score(&planes, &faces);

        let mut moved_planes: Vec<EstimatedPlane> = planes.iter().map(|plane| moved(plane, &motion)).collect();
        moved_planes.rotate_left(rotate_by);
        let moved_faces: Vec<TrueFace> = faces.iter().rev().map(|face| {
            let outline = face.outline[0].iter().map(|&point| motion.transform_point(point)).collect();
            TrueFace::new(face.id, face.plane.transformed(&motion), vec![outline], CELL).unwrap()
        }).collect();
        let actual = score(&moved_planes, &moved_faces);
        prop_assert_eq!(actual.recall(), expected.recall());
        prop_assert_eq!(actual.precision(), expected.precision());
        prop_assert_eq!(actual.duplicates.len(), expected.duplicates.len());
        prop_assert_eq!(actual.unmatched.len(), expected.unmatched.len());
        // Cells on a border may be on either side.
        let near = |a: Option<f64>, b: Option<f64>, tolerance: f64| (a.unwrap() - b.unwrap()).abs() < tolerance;
        prop_assert!(near(actual.mean_boundary_iou(), expected.mean_boundary_iou(), 0.01));
        prop_assert!(near(actual.area_recall, expected.area_recall, 0.01));
        prop_assert!(near(actual.area_precision, expected.area_precision, 0.01));
        let of = |score: &PlaneScore| [score.angle_degrees.unwrap().p95, score.offset.unwrap().p95];
        let (a, b) = (of(&actual), of(&expected));
        prop_assert!((a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-4, "{:?}, {:?}", a, b);
    }
}
