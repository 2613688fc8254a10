//! Tests of the true faces and objects of rendered rooms, and of the scores of maps that equal them.
use std::sync::LazyLock;

use dymlm_core::vector3::{cross, dot};
use dymlm_core::{PinholeCamera, Point, Pose};
use dymlm_metrics::{
    EstimatedObject, EstimatedPlane, SpaceTruth, TrueFace, TrueObject, YawSymmetry, score_objects,
    score_planes,
};
use dymlm_sim::{Sequence, SequenceConfig, Truth, TruthConfig};

/// The map that equals the truth.
fn perfect(faces: &[TrueFace]) -> Vec<EstimatedPlane> {
    let exact = |face: &TrueFace| EstimatedPlane {
        normal: face.plane.normal(),
        d: face.plane.d(),
        boundary: face.visible_boundary(),
    };
    faces.iter().map(exact).collect()
}

/// Twelve frames of a room whose world is tilted.
struct Recorded {
    truth: Truth,
    world_from_scene: Pose,
}

static RECORDED: LazyLock<Recorded> = LazyLock::new(|| {
    let mut config = SequenceConfig::default();
    config.frames = 12;
    config.frame_rate = 2.0;
    config.camera = Some(PinholeCamera::new(320, 240, 262.0, 262.0, 159.5, 119.5).unwrap());
    config.world_from_scene = Pose::new([3.0, -7.0, 1.0], [0.5, -0.5, 0.5, 0.5]).unwrap();
    let sequence = Sequence::new(&config).unwrap();
    Recorded {
        truth: Truth::of(&sequence, &TruthConfig::default()).unwrap(),
        world_from_scene: config.world_from_scene,
    }
});

/// The office as seen from its middle, in an upright world; all that has a reading counts as seen.
fn upright_office() -> Truth {
    let mut config = SequenceConfig::default();
    config.frames = 12;
    config.frame_rate = 2.0;
    let sequence = Sequence::new(&config).unwrap();
    let mut truth_config = TruthConfig::default();
    truth_config.max_depth = 10.0;
    Truth::of(&sequence, &truth_config).unwrap()
}

#[test]
fn a_wall_on_a_border_of_the_cubes_counts_once() {
    // The far wall is at y = 3.1 m, where one cube of 2 cm ends and the next begins. Between door and poster,
    // above the partition.
    let (across, up) = (-1.7..1.7_f32, 1.7..2.2_f32);
    let points = upright_office().visible_points().into_iter();
    let on_wall =
        |point: &Point| (point[1] - 3.1).abs() < 1e-3 && across.contains(&point[0]) && up.contains(&point[2]);
    let count = points.filter(on_wall).count();
    // Rows of squares may begin and end outside.
    assert!((3000..=171 * 26).contains(&count), "{count} points on 170 x 25 squares");
}

#[test]
fn thin_is_what_has_free_space_on_both_sides() {
    let truth = upright_office();
    let visible = truth.visible_points();
    let on_floor = visible.iter().filter(|point| (point[2] - 0.01).abs() < 1e-3);
    let on_poster = visible.iter().filter(|point| (point[1] - 3.08).abs() < 1e-3 && point[2] > 1.2);
    for points in [on_floor.collect::<Vec<_>>(), on_poster.collect()] {
        let on_thin = points.iter().filter(|point| truth.on_thin_things(***point)).count();
        // Feet that stand on the carpet reach into its surface.
        assert!(points.len() > 500 && on_thin * 200 < points.len(), "{on_thin} of {}", points.len());
    }
    // The door is flat on the wall.
    assert!(!truth.on_thin_things([-2.3, 3.04, 1.0]));
    // The desk's top between the things on it, its lower side, and the partition behind it.
    for point in [[0.2, 1.40, 0.74], [0.2, 1.40, 0.71], [0.0, 2.115, 1.2]] {
        assert!(truth.surface_distance(point) < 1e-4 && truth.on_thin_things(point), "{point:?}");
    }
    let on_thin = visible.iter().filter(|point| truth.on_thin_things(**point)).count();
    assert!((0.05..0.4).contains(&(on_thin as f64 / visible.len() as f64)), "{on_thin} of {}", visible.len());
}

#[test]
fn the_faces_of_a_room_lie_on_its_surfaces_and_were_seen_from_before() {
    let faces = RECORDED.truth.faces();
    let visible: Vec<&TrueFace> = faces.iter().filter(|face| face.visible_area > 0.05).collect();
    assert!(visible.len() > 15, "{}", visible.len());
    for face in &faces {
        assert!(face.visible_area <= face.area + 1e-9 && face.relief < faces.len());
        assert_eq!(faces[face.relief].relief, face.relief, "reliefs do not chain");
        for &corner in face.outline.iter().flatten() {
            assert!(face.plane.signed_distance(corner).abs() < 0.0021);
            // The tolerance covers the 1 % by which discs are enlarged.
            assert!(RECORDED.truth.surface_distance(corner.map(|c| c as f32)) < 0.002);
        }
        // Counterclockwise about the normal.
        let ring = &face.outline[0];
        let side = |a: usize, b: usize| std::array::from_fn(|k| ring[b][k] - ring[a][k]);
        assert!(dot(cross(side(0, 1), side(1, 2)), face.plane.normal()) > 0.0);
    }
    // Desk top, seat, screen and floor, by height and orientation in the scene.
    let up = RECORDED.world_from_scene.rotate([0.0, 0.0, 1.0]);
    let origin = RECORDED.world_from_scene.translation();
    let level = |height: f64| {
        let is_level = |face: &&&TrueFace| {
            let at_height: [f64; 3] = std::array::from_fn(|k| origin[k] + height * up[k]);
            dot(face.plane.normal(), up) > 0.9999 && face.plane.signed_distance(at_height).abs() < 1e-4
        };
        visible.iter().filter(is_level).count()
    };
    assert_eq!((level(0.01), level(0.74)), (1, 1), "the carpet and the desk are one face each");
    assert!(visible.iter().any(|face| face.label.as_deref() == Some("tv")));
    // The only visible face that looks down is the ceiling.
    let looks_down = visible.iter().filter(|face| dot(face.plane.normal(), up) < -0.9);
    assert!(looks_down.clone().all(|face| face.area > 30.0));
}

#[test]
fn a_map_of_a_rooms_visible_faces_is_faultless() {
    let faces = RECORDED.truth.faces();
    let seen: Vec<TrueFace> = faces.iter().filter(|face| face.visible_area >= 0.02).cloned().collect();
    let score = score_planes(&perfect(&seen), &faces);
    assert!(score.faces.len() > 10, "{} asked for", score.faces.len());
    assert_eq!((score.recall(), score.precision(), score.sign_errors()), (Some(1.0), Some(1.0), 0));
    assert!(score.duplicates.is_empty() && score.wrongly_merged.is_empty(), "{score:?}");
    assert!(score.mean_boundary_iou().unwrap() > 0.999 && score.area_recall.unwrap() > 0.999);
    assert!(score.area_precision.unwrap() > 0.9999 && score.offset.unwrap().p95 < 1e-6);
}

#[test]
fn a_plane_on_a_face_seen_too_steeply_is_no_error() {
    // With a limit of 60 degrees the desk and the floor are not seen: a map need not have them, but may.
    let mut config = SequenceConfig::default();
    config.frames = 4;
    config.frame_rate = 1.0;
    config.camera = Some(PinholeCamera::new(320, 240, 262.0, 262.0, 159.5, 119.5).unwrap());
    let sequence = Sequence::new(&config).unwrap();
    let desk = |faces: &[TrueFace]| {
        let at_desk = |face: &&TrueFace| {
            face.plane.normal()[2] > 0.99 && (face.plane.d() + 0.74).abs() < 1e-4 && face.area > 1.0
        };
        faces.iter().find(at_desk).cloned().unwrap()
    };
    let mut truth_config = TruthConfig::default();
    truth_config.min_views = 1;
    let shallow = desk(&Truth::of(&sequence, &truth_config).unwrap().faces());
    assert!(shallow.visible_area > 0.08);
    truth_config.max_incidence_deg = 60.0;
    let faces = Truth::of(&sequence, &truth_config).unwrap().faces();
    assert_eq!(desk(&faces).visible_area, 0.0);
    let score = score_planes(&perfect(&[shallow]), &faces);
    assert_eq!((score.precision(), score.area_precision), (Some(1.0), Some(1.0)));
    assert!(score.faces.iter().all(|face| face.face != desk(&faces).id));
}

#[test]
fn the_visible_boundary_encloses_the_visible_area() {
    for face in RECORDED.truth.faces().iter().filter(|face| face.visible_area > 0.0) {
        // The area by the shoelace formula; holes run the other way round and count negative.
        let normal = face.plane.normal();
        let ring_area = |ring: &Vec<[f64; 3]>| -> f64 {
            let from: Vec<[f64; 3]> =
                ring.iter().map(|point| std::array::from_fn(|k| point[k] - ring[0][k])).collect();
            from.windows(2).map(|pair| 0.5 * dot(normal, cross(pair[0], pair[1]))).sum()
        };
        let boundary = face.visible_boundary();
        let area: f64 = boundary.iter().map(ring_area).sum();
        assert!((area - face.visible_area).abs() < 1e-9 + 1e-9 * face.visible_area);
    }
}

#[test]
fn the_objects_of_a_room_hold_the_points_that_show_them() {
    let mut config = SequenceConfig::default();
    config.frames = 12;
    config.frame_rate = 2.0;
    config.camera = Some(PinholeCamera::new(320, 240, 262.0, 262.0, 159.5, 119.5).unwrap());
    config.world_from_scene = Pose::new([3.0, -7.0, 1.0], [0.5, -0.5, 0.5, 0.5]).unwrap();
    let sequence = Sequence::new(&config).unwrap();
    let mut truth = Truth::new(&sequence, &TruthConfig::default()).unwrap();
    let mut frames_of = std::collections::BTreeMap::<usize, u32>::new();
    for frame in sequence.frames() {
        truth.observe(&frame);
        for thing in frame.visible_things.iter().filter(|thing| !thing.moves) {
            *frames_of.entry(thing.id).or_default() += 1;
        }
    }
    let objects = truth.objects();
    let named = |label: &str| objects.iter().filter(|object| object.label == label).count();
    assert!(named("tv") >= 2 && named("chair") >= 2 && named("person") == 0);
    let up = config.world_from_scene.rotate([0.0, 0.0, 1.0]);
    for object in &objects {
        let z = object.oriented_box.world_from_box().rotate([0.0, 0.0, 1.0]);
        assert!((0..3).all(|axis| (z[axis] - up[axis]).abs() < 1e-6), "upright");
        assert!((0.0..=1.0).contains(&object.visible_share));
        assert!(object.frames_visible <= frames_of.get(&object.id).copied().unwrap_or(0));
        // A box is tight, so its centre is within half a diagonal of a surface.
        let reach =
            object.oriented_box.lengths().iter().map(|length| 0.25 * length * length).sum::<f64>().sqrt();
        let center = object.oriented_box.center().map(|c| c as f32);
        assert!(f64::from(truth.surface_distance(center)) < reach);
    }
    // Both screens are in plain view all the time, and half of a screen's surface faces away.
    for screen in objects.iter().filter(|object| object.label == "tv") {
        assert!(screen.frames_visible >= 8 && (0.2..0.75).contains(&screen.visible_share), "{screen:?}");
        assert_eq!(screen.symmetry, YawSymmetry::HalfTurn);
        let [x, y, z] = screen.oriented_box.lengths();
        assert!((x - 0.54).abs() < 1e-6 && (y - 0.18).abs() < 1e-6 && (z - 0.475).abs() < 1e-6);
    }
    let symmetry = |label: &str| objects.iter().find(|object| object.label == label).unwrap().symmetry;
    assert_eq!(
        [symmetry("bottle"), symmetry("cup"), symmetry("chair"), symmetry("keyboard")],
        [YawSymmetry::Full, YawSymmetry::Full, YawSymmetry::QuarterTurn, YawSymmetry::HalfTurn]
    );
    let exact = |object: &TrueObject| EstimatedObject {
        label: object.label.clone(),
        world_from_object: object.oriented_box.world_from_box(),
        dimensions: object.oriented_box.lengths(),
    };
    let estimates: Vec<EstimatedObject> = objects.iter().map(exact).collect();
    assert_eq!(score_objects(&estimates, &objects).recall(), Some(1.0));
}
