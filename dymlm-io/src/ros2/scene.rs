//! `foxglove_msgs/SceneUpdate`: entities in 3D by id. Fields are in the order of the message definitions.

use serde::Serialize;

use super::messages::{Time, Transform, Vector3};

/// The type of entities that are never drawn: their sequences are empty.
pub(crate) type Never = [(); 0];

#[derive(Debug, Default, Serialize)]
pub(crate) struct SceneUpdate {
    pub(crate) deletions: Vec<SceneEntityDeletion>,
    pub(crate) entities: Vec<SceneEntity>,
}

#[derive(Debug, Serialize)]
pub(crate) struct SceneEntityDeletion {
    pub(crate) timestamp: Time,
    /// 0: deletes the entity with this id.
    pub(crate) kind: u8,
    pub(crate) id: String,
}

/// An entity. It replaces an earlier one of the same id.
#[derive(Debug, Serialize)]
pub(crate) struct SceneEntity {
    pub(crate) timestamp: Time,
    pub(crate) frame_id: String,
    pub(crate) id: String,
    /// 0: the entity stays until it is replaced or deleted.
    pub(crate) lifetime: Time,
    pub(crate) frame_locked: bool,
    pub(crate) metadata: Vec<KeyValuePair>,
    pub(crate) arrows: Vec<Never>,
    pub(crate) cubes: Vec<SolidPrimitive>,
    pub(crate) spheres: Vec<SolidPrimitive>,
    pub(crate) cylinders: Vec<Never>,
    pub(crate) lines: Vec<LinePrimitive>,
    pub(crate) triangles: Vec<TriangleListPrimitive>,
    pub(crate) texts: Vec<TextPrimitive>,
    pub(crate) models: Vec<Never>,
}

#[derive(Debug, Serialize)]
pub(crate) struct KeyValuePair {
    pub(crate) key: &'static str,
    pub(crate) value: String,
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Color {
    pub(crate) r: f64,
    pub(crate) g: f64,
    pub(crate) b: f64,
    pub(crate) a: f64,
}

/// A cube or a sphere: both have the same kinds of fields.
#[derive(Debug, Serialize)]
pub(crate) struct SolidPrimitive {
    pub(crate) pose: Transform,
    pub(crate) size: Vector3,
    pub(crate) color: Color,
}

#[derive(Debug, Serialize)]
pub(crate) struct LinePrimitive {
    /// 1: a closed line.
    pub(crate) kind: u8,
    pub(crate) pose: Transform,
    pub(crate) thickness: f64,
    pub(crate) scale_invariant: bool,
    pub(crate) points: Vec<Vector3>,
    pub(crate) color: Color,
    pub(crate) colors: Vec<Color>,
    pub(crate) indices: Vec<u32>,
}

#[derive(Debug, Serialize)]
pub(crate) struct TriangleListPrimitive {
    pub(crate) pose: Transform,
    pub(crate) points: Vec<Vector3>,
    pub(crate) color: Color,
    pub(crate) colors: Vec<Color>,
    pub(crate) indices: Vec<u32>,
}

#[derive(Debug, Serialize)]
pub(crate) struct TextPrimitive {
    pub(crate) pose: Transform,
    pub(crate) billboard: bool,
    pub(crate) font_size: f64,
    pub(crate) scale_invariant: bool,
    pub(crate) color: Color,
    pub(crate) text: String,
}
