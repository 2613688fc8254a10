use dymlm_core::{Pose, Rgb};

use crate::ros2::messages::{Rotation, Time, Transform, Vector3};
use crate::ros2::scene::{
    Color, KeyValuePair, LinePrimitive, SceneEntity, SceneEntityDeletion, SolidPrimitive, TextPrimitive,
    TriangleListPrimitive,
};
use crate::shapes::PlaneMesh;
use crate::{ObjectRecord, PlaneRecord, ShapeRecord, id_color};

/// Opacity of planes and of objects.
const PLANE_ALPHA: f64 = 0.35;
const OBJECT_ALPHA: f64 = 0.45;
/// Width of lines and size of text, pixels.
const LINE_WIDTH: f64 = 2.0;
const FONT_SIZE: f64 = 14.0;
/// [`LinePrimitive::kind`] of a closed line.
const LINE_LOOP: u8 = 1;

/// A plane as half-transparent faces with their outlines.
pub(super) fn plane_entity(plane: &PlaneRecord, time: Time, frame: &str) -> SceneEntity {
    let mesh = PlaneMesh::of(plane);
    let rgb = id_color(plane.id);
    let mut entity = entity(plane.id, time, frame);
    entity.metadata = vec![
        KeyValuePair { key: "area_m2", value: format!("{:.3}", plane.area_m2) },
        KeyValuePair { key: "observations", value: plane.observations.to_string() },
    ];
    let line = |ring: &[[f64; 3]]| LinePrimitive {
        kind: LINE_LOOP,
        pose: transform(&Pose::identity()),
        thickness: LINE_WIDTH,
        scale_invariant: true,
        points: ring.iter().copied().map(vector).collect(),
        color: color(rgb, 1.0),
        colors: Vec::new(),
        indices: Vec::new(),
    };
    entity.lines = mesh.rings.iter().filter_map(|ring| mesh.corners.get(ring.clone())).map(line).collect();
    entity.triangles.push(TriangleListPrimitive {
        pose: transform(&Pose::identity()),
        points: mesh.corners.iter().copied().map(vector).collect(),
        color: color(rgb, PLANE_ALPHA),
        colors: Vec::new(),
        indices: mesh.triangles,
    });
    entity
}

/// An object as a box or an ellipsoid, with its label above it; `None` when its pose is invalid.
pub(super) fn object_entity(
    object: &ObjectRecord,
    up: [f64; 3],
    time: Time,
    frame: &str,
) -> Option<SceneEntity> {
    let pose = Pose::new(object.translation, object.rotation).ok()?;
    let rgb = id_color(object.id);
    let mut entity = entity(object.id, time, frame);
    entity.metadata = vec![
        KeyValuePair { key: "label", value: object.label.clone() },
        KeyValuePair { key: "score", value: format!("{:.3}", object.score) },
        KeyValuePair { key: "observations", value: object.observations.to_string() },
    ];
    let solid = SolidPrimitive {
        pose: transform(&pose),
        size: vector(object.dimensions),
        color: color(rgb, OBJECT_ALPHA),
    };
    match object.shape {
        ShapeRecord::Cuboid => entity.cubes.push(solid),
        ShapeRecord::Ellipsoid => entity.spheres.push(solid),
    }
    entity.texts.push(TextPrimitive {
        pose: transform(&Pose::new(label_place(&pose, object.dimensions, up), [0.0, 0.0, 0.0, 1.0]).ok()?),
        billboard: true,
        font_size: FONT_SIZE,
        scale_invariant: true,
        color: color([u8::MAX; 3], 1.0),
        text: object.label.clone(),
    });
    Some(entity)
}

/// A place just above a box.
fn label_place(pose: &Pose, lengths: [f64; 3], up: [f64; 3]) -> [f64; 3] {
    let up_in_box = pose.inverse().rotate(up);
    let height: f64 = up_in_box.iter().zip(lengths).map(|(c, length)| 0.5 * c.abs() * length).sum();
    let center = pose.translation();
    std::array::from_fn(|k| {
        let at = |vector: [f64; 3]| vector.get(k).copied().unwrap_or_default();
        at(center) + (height + 0.05) * at(up)
    })
}

pub(super) fn deletion(id: u64, time: Time) -> SceneEntityDeletion {
    SceneEntityDeletion { timestamp: time, kind: 0, id: id.to_string() }
}

fn entity(id: u64, timestamp: Time, frame: &str) -> SceneEntity {
    SceneEntity {
        timestamp,
        frame_id: frame.to_owned(),
        id: id.to_string(),
        lifetime: Time { sec: 0, nanosec: 0 },
        frame_locked: true,
        metadata: Vec::new(),
        arrows: Vec::new(),
        cubes: Vec::new(),
        spheres: Vec::new(),
        cylinders: Vec::new(),
        lines: Vec::new(),
        triangles: Vec::new(),
        texts: Vec::new(),
        models: Vec::new(),
    }
}

pub(super) fn transform(pose: &Pose) -> Transform {
    let [x, y, z, w] = pose.quaternion();
    Transform { translation: vector(pose.translation()), rotation: Rotation { x, y, z, w } }
}

fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

fn color(rgb: Rgb, a: f64) -> Color {
    let [r, g, b] = rgb.map(|channel| f64::from(channel) / 255.0);
    Color { r, g, b, a }
}
