//! Maps as glTF 2.0 (feature `gltf`): `document` is the file's JSON and bytes, `map_scene` what is drawn.

mod document;
mod linear_color;
mod map_scene;

pub use map_scene::encode_glb;
