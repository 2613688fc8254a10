//! What is found in the box of a thing that other things hide, or stand beside.
use dymlm_core::{BoundingBox, Detection, Plane, PlaneId, Pose};
use dymlm_geometry::OrientedBox;
use dymlm_objects::{MapObject, ObjectMapper, ObjectView, SupportPlane, SupportingPlanes};
use dymlm_test_support::Rectangle;

use crate::common::{Scene, mapper, near, upright};

/// The top of the table.
const TOP: f64 = 0.75;

/// The floor, and the top of a table around (0, 1.8).
struct Levels;

impl SupportingPlanes for Levels {
    fn near(&self, point: [f64; 3], reach: f64, found: &mut Vec<SupportPlane>) {
        let level =
            |id: u64, z: f64| SupportPlane::new(PlaneId::new(id), Plane::new([0.0, 0.0, 1.0], -z).unwrap());
        if point[2].abs() <= reach {
            found.push(level(0, 0.0));
        }
        if (point[2] - TOP).abs() <= reach
            && point[0].abs() <= 0.8 + reach
            && (point[1] - 1.8).abs() <= 0.4 + reach
        {
            found.push(level(1, TOP));
        }
    }
}

fn table() -> OrientedBox {
    upright([0.0, 1.8, TOP - 0.02], 0.0, [1.6, 0.8, 0.04])
}

/// A room with a wall at y = 6 and a floor at z = 0.
fn room(boxes: Vec<OrientedBox>) -> Scene {
    let floor = Rectangle::level([0.0; 3], 50.0, 50.0);
    Scene::with_rectangles(boxes, vec![floor, Rectangle::upright([0.0, 6.0, 1.5], 50.0, 1.5)])
}

/// Where a thing would appear if nothing were before it, as detectors guess.
fn whole_box(pose: &Pose, thing: OrientedBox) -> BoundingBox {
    room(vec![thing]).image_box(pose, 0).unwrap()
}

fn detection(label: &str, bounding_box: BoundingBox) -> Detection {
    Detection::new(label, 0.8, bounding_box).unwrap()
}

fn insert(mapper: &mut ObjectMapper, scene: &Scene, step: usize, pose: &Pose, detections: &[Detection]) {
    let frame = scene.frame(0.1 * step as f64, pose);
    mapper.insert(&ObjectView::new(&frame, detections, pose), &Levels).unwrap();
}

fn labelled(mapper: &ObjectMapper, label: &str) -> Vec<OrientedBox> {
    mapper.map().with_label(label).map(MapObject::oriented_box).collect()
}

/// The back of a chair looks out behind a table with a laptop before it, which fills more of the chair's box.
#[test]
fn a_chair_behind_a_table_is_not_what_stands_on_the_table() {
    let back = upright([0.0, 2.6, 0.75], 0.0, [0.4, 0.05, 0.4]);
    let laptop = upright([0.06, 1.75, 0.87], 0.0, [0.3, 0.02, 0.24]);
    let (scene, mut mapper) = (room(vec![back, laptop, table()]), mapper());
    let chair = upright([0.0, 2.4, 0.475], 0.0, [0.5, 0.5, 0.95]);
    for step in 0..24 {
        let pose = near([-0.1, 0.0, 1.35], step, [0.0, 2.0, 0.7]);
        let of_laptop = detection("laptop", scene.image_box(&pose, 1).unwrap());
        let of_chair = detection("chair", whole_box(&pose, chair));
        // From time to time the detector misses the laptop, which is in the map.
        let found = if step > 6 && step % 3 == 2 { vec![of_chair] } else { vec![of_laptop, of_chair] };
        insert(&mut mapper, &scene, step, &pose, &found);
    }
    let found = labelled(&mapper, "chair");
    assert_eq!((found.len(), labelled(&mapper, "laptop").len()), (1, 1), "{found:?}");
    assert!(found[0].center()[1] > 2.2, "{found:?}");
}

/// At first, something nearer was taken for the chair. Its box in the image goes on to move as the chair's
/// does.
#[test]
fn what_is_far_behind_an_object_is_none_of_it() {
    let chair = upright([0.0, 3.5, 0.45], 0.0, [0.5, 0.5, 0.9]);
    let nearer = upright([0.02, 1.85, 0.85], 0.0, [0.28, 0.1, 0.45]);
    let mut mapper = mapper();
    for step in 0..16 {
        let pose = near([0.0, 0.4, 1.2], step, [0.0, 3.5, 0.45]);
        let scene = room(if step < 2 { vec![chair, nearer] } else { vec![chair] });
        insert(&mut mapper, &scene, step, &pose, &[detection("chair", whole_box(&pose, chair))]);
    }
    let found = labelled(&mapper, "chair");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].iou(&chair) > 0.6, "{} {found:?}", found[0].iou(&chair));
}

/// Of two chairs, the one that is hidden is detected, too: its box shows the back of the other one.
#[test]
fn a_hidden_chair_is_not_made_of_the_one_before_it() {
    let seat = upright([0.0, 2.15, 0.25], 0.0, [0.5, 0.5, 0.5]);
    let back = upright([0.0, 2.42, 0.475], 0.0, [0.5, 0.05, 0.95]);
    let chair = upright([0.0, 2.17, 0.475], 0.0, [0.5, 0.54, 0.95]);
    let hidden = upright([0.1, 3.1, 0.35], 0.0, [0.4, 0.4, 0.7]);
    let (scene, mut mapper) = (room(vec![seat, back, hidden]), mapper());
    for step in 0..24 {
        let pose = near([0.0, 0.2, 1.1], step, [0.0, 2.4, 0.45]);
        let mut found = vec![detection("chair", whole_box(&pose, chair))];
        if step % 2 == 1 {
            found.push(detection("chair", whole_box(&pose, hidden)));
        }
        insert(&mut mapper, &scene, step, &pose, &found);
    }
    let found = labelled(&mapper, "chair");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].iou(&chair) > 0.6, "{found:?}");
}
