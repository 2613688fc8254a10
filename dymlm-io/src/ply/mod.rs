//! Point clouds as PLY files (Turk 1994, <https://paulbourke.net/dataformats/ply/>).
//!
//! Own code for the part of the format that clouds need. The maintained crate for the whole format,
//! `ply-rs-bw` 4.0, refuses the `nan` of ascii clouds, trusts the count of elements that have no bytes, and
//! needs a parser generator.

mod decode;
mod encode;
mod header;
mod rows;

pub use decode::{decode_ply, read_ply};
pub use encode::{PlyEncoder, encode_ply, write_ply};
