//! Maps as glTF 2.0 (feature `gltf`): `map_scene` builds the scene, `document` holds the file's JSON and
//! bytes.

mod document;
mod linear_color;
mod map_scene;

pub use map_scene::encode_glb;
