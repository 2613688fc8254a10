use std::fs;
use std::path::Path;

use dymlm_core::PointCloud;

use super::header::{Element, Kind, PlyHeader, Property};
use super::rows::{Role, Rows};
use crate::Error;
use crate::scalar::Scalar;

/// Reads a point cloud from a PLY file: the `x y z` of its vertices, of any scalar type, and their colours
/// when there are `red green blue` (or `diffuse_red` ...) of type uchar. Everything else (normals, faces ...)
/// is skipped. The format may be ascii or binary of either byte order. Points that are not finite are kept,
/// so that points keep their indices.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Malformed`] or, with a line, [`Error::Line`] when the file is not a PLY file, has
/// no vertices with coordinates or ends before its last vertex.
pub fn read_ply(path: impl AsRef<Path>) -> Result<PointCloud, Error> {
    let path = path.as_ref();
    let file = fs::read(path).map_err(Error::io(path))?;
    decode_ply(&file, path)
}

/// Reads a point cloud from the bytes of a PLY file; errors call it `name`.
///
/// # Errors
///
/// As [`read_ply`].
pub fn decode_ply(file: &[u8], name: impl AsRef<Path>) -> Result<PointCloud, Error> {
    let name = name.as_ref();
    let header = PlyHeader::parse(file, name)?;
    let mut rows = Rows::new(file, &header, name);
    for element in &header.elements {
        if element.name == "vertex" {
            check_coordinates(element, name)?;
            return read_vertices(&mut rows, element);
        }
        rows.pass_over(element)?;
    }
    Err(Error::malformed(name, "a PLY file without vertices"))
}

fn check_coordinates(vertex: &Element, path: &Path) -> Result<(), Error> {
    let has = |axis| vertex.properties.iter().any(|property| role(property) == Role::Coordinate(axis));
    match (0..3).find(|&axis| !has(axis)) {
        Some(axis) => {
            let name = ["x", "y", "z"][axis];
            Err(Error::malformed(path, format!("vertices without a scalar property {name}")))
        }
        None => Ok(()),
    }
}

fn role(property: &Property) -> Role {
    match (property.name.as_str(), property.kind) {
        ("x", Kind::Scalar(_)) => Role::Coordinate(0),
        ("y", Kind::Scalar(_)) => Role::Coordinate(1),
        ("z", Kind::Scalar(_)) => Role::Coordinate(2),
        ("red" | "diffuse_red", Kind::Scalar(Scalar::U8)) => Role::Color(0),
        ("green" | "diffuse_green", Kind::Scalar(Scalar::U8)) => Role::Color(1),
        ("blue" | "diffuse_blue", Kind::Scalar(Scalar::U8)) => Role::Color(2),
        _ => Role::Passed,
    }
}

fn read_vertices(rows: &mut Rows<'_>, element: &Element) -> Result<PointCloud, Error> {
    let roles: Vec<(Kind, Role)> = element.properties.iter().map(|p| (p.kind, role(p))).collect();
    let has_colors = (0..3).all(|channel| roles.iter().any(|&(_, role)| role == Role::Color(channel)));
    // At most as many points as the rest of the file can hold, whatever the header says.
    let room = element.count.min(rows.bytes_left() / 3);
    let mut points = Vec::with_capacity(room);
    let mut colors = Vec::with_capacity(if has_colors { room } else { 0 });
    for row in 0..element.count {
        let vertex = rows.next(&roles).map_err(|fault| rows.error(fault, element, row))?;
        points.push(vertex.point);
        if has_colors {
            colors.push(vertex.color);
        }
    }
    if !has_colors {
        return Ok(PointCloud::new(points));
    }
    PointCloud::with_colors(points, colors).map_err(|error| Error::malformed(rows.path, error.to_string()))
}
