//! Point clouds as PCD files, version 0.7
//! (<https://pointclouds.org/documentation/tutorials/pcd_file_format.html>).

mod cloud;
mod decode;
mod encode;
mod header;
mod lzf;

pub use cloud::{PcdCloud, PcdField};
pub use decode::{decode_pcd, read_pcd};
pub use encode::{encode_pcd, write_pcd};
