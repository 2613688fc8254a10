//! Point clouds as PLY files.
//!
//! The parsing and the writing are those of the crate `ply-rs-bw`; a file's header is checked between its two steps.

use std::fs;
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::Path;

use dymlm_core::{Point, PointCloud, Rgb};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult, PropertyDef, PropertyType,
    ScalarType, Version,
};
use ply_rs_bw::writer::Writer;

use crate::text_lines::quoted;
use crate::{Error, write_atomically};

const VERTEX: &str = "vertex";

/// Reads a point cloud from a PLY file: the `x y z` of its vertices, of any scalar type, and their colours when there
/// are `red green blue` (or `diffuse_red` ...) of type uchar. Everything else (normals, faces ...) is passed over.
/// Ascii and binary of both byte orders. Points that are not finite are kept, so that points keep their numbers.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Malformed`] or, with a line, [`Error::Line`] when the file is no PLY, has no vertices with
/// coordinates or ends before its last vertex.
pub fn read_ply(path: impl AsRef<Path>) -> Result<PointCloud, Error> {
    let path = path.as_ref();
    let file = fs::File::open(path).map_err(Error::io(path))?;
    decode_ply(BufReader::with_capacity(1 << 16, file), path)
}

/// Reads a point cloud in PLY format from a stream; `name` is what errors call it.
///
/// # Errors
///
/// As [`read_ply`].
pub fn decode_ply(stream: impl BufRead, name: impl AsRef<Path>) -> Result<PointCloud, Error> {
    let name = name.as_ref();
    let mut reader = Reader::new(stream);
    let header = Parser::<Passed>::new().read_header(&mut reader).map_err(|error| with_line(name, &error))?;
    let vertices = read_vertices(&mut reader, &header, name)?;

    let points = vertices.iter().map(|vertex| vertex.point).collect();
    if has_colors(&header) {
        let colors = vertices.iter().map(|vertex| vertex.color).collect();
        PointCloud::with_colors(points, colors).map_err(|error| Error::malformed(name, error.to_string()))
    } else {
        Ok(PointCloud::new(points))
    }
}

/// Writes a point cloud as PLY, binary little endian, atomically: float x y z, and uchar red green blue when the cloud
/// has colours.
///
/// # Errors
///
/// As [`write_atomically`].
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("cloud.ply");
/// use dymlm_core::PointCloud;
///
/// let cloud = PointCloud::with_colors(vec![[0.0, 1.0, 2.5]], vec![[255, 128, 0]])?;
/// dymlm_io::write_ply(&path, &cloud)?;
/// assert_eq!(dymlm_io::read_ply(&path)?, cloud);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_ply(path: impl AsRef<Path>, cloud: &PointCloud) -> Result<(), Error> {
    write_atomically(path, |out| encode_ply(out, cloud))
}

/// Writes a point cloud as PLY to a stream, as [`write_ply`] does to a file.
///
/// # Errors
///
/// Those of the stream.
pub fn encode_ply(out: &mut dyn Write, cloud: &PointCloud) -> io::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 16, out);
    let writer = Writer::<Vertex>::new();
    let definition = vertex_definition(cloud);
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.version = Version { major: 1, minor: 0 };
    header.elements.add(definition.clone());
    writer.write_header(&mut out, &header)?;

    let colors = cloud.colors().unwrap_or_default();
    for (i, &point) in cloud.points().iter().enumerate() {
        let vertex = Vertex { point, color: colors.get(i).copied().unwrap_or_default() };
        writer.write_little_endian_element(&mut out, &vertex, &definition)?;
    }
    out.flush()
}

fn vertex_definition(cloud: &PointCloud) -> ElementDef {
    let mut definition = ElementDef::new(VERTEX.to_owned());
    definition.count = cloud.len();
    let mut add = |name: &str, scalar| {
        definition.properties.add(PropertyDef::new(name.to_owned(), PropertyType::Scalar(scalar)));
    };
    ["x", "y", "z"].into_iter().for_each(|name| add(name, ScalarType::Float));
    if cloud.colors().is_some() {
        ["red", "green", "blue"].into_iter().for_each(|name| add(name, ScalarType::UChar));
    }
    definition
}

/// Reads up to the vertices and no further.
fn read_vertices(
    reader: &mut Reader<impl BufRead>,
    header: &Header,
    name: &Path,
) -> Result<Vec<Vertex>, Error> {
    let broken = |error: ParseError| match header.encoding {
        Encoding::Ascii => with_line(name, &error),
        _ => Error::malformed(name, one_line(&error)),
    };
    for (_, element) in &header.elements {
        // An element of no properties takes no bytes: the parser would make as many as the header claims.
        if element.properties.is_empty() && element.count > 0 {
            let reason = format!("{} elements {} without properties", element.count, quoted(&element.name));
            return Err(Error::malformed(name, reason));
        }
        if element.name == VERTEX {
            check_coordinates(element, name)?;
            return Parser::<Vertex>::new().read_payload_for_element(reader, element, header).map_err(broken);
        }
        Parser::<Passed>::new().read_payload_for_element(reader, element, header).map_err(broken)?;
    }
    Err(Error::malformed(name, "a PLY file without vertices"))
}

fn check_coordinates(vertex: &ElementDef, name: &Path) -> Result<(), Error> {
    let is_scalar = |name: &str| {
        vertex.properties.get(name).is_some_and(|p| matches!(p.data_type, PropertyType::Scalar(_)))
    };
    match ["x", "y", "z"].into_iter().find(|coordinate| !is_scalar(coordinate)) {
        Some(missing) => Err(Error::malformed(name, format!("vertices without a scalar property {missing}"))),
        None => Ok(()),
    }
}

fn has_colors(header: &Header) -> bool {
    let is_uchar = |name: &str| {
        header
            .elements
            .get(VERTEX)
            .and_then(|vertex| vertex.properties.get(name))
            .is_some_and(|property| matches!(property.data_type, PropertyType::Scalar(ScalarType::UChar)))
    };
    [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"]]
        .iter()
        .any(|names| names.iter().all(|name| is_uchar(name)))
}

fn with_line(name: &Path, error: &ParseError) -> Error {
    let reason = one_line(error);
    match error.line() {
        Some(line) => Error::line(name, line, reason),
        None => Error::malformed(name, reason),
    }
}

/// The parser's message on one line and of bounded length: it repeats the file's own line, however long that is.
fn one_line(error: &ParseError) -> String {
    const LONGEST: usize = 200;
    let message = error.to_string();
    let words = message.split_whitespace().flat_map(|word| [word, " "]);
    let flat: String = words.flat_map(str::chars).take(LONGEST).collect();
    let flat = flat.trim_end();
    // The line is told apart.
    match flat.strip_prefix("Line ").and_then(|rest| rest.split_once(": ")) {
        Some((_, reason)) => reason.to_owned(),
        None => flat.to_owned(),
    }
}

/// A vertex as it is parsed and written. What is not asked for is passed over.
#[derive(Debug, Clone, Copy)]
struct Vertex {
    point: Point,
    color: Rgb,
}

impl Vertex {
    fn set_coordinate(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        match name {
            "x" => self.point[0] = value,
            "y" => self.point[1] = value,
            "z" => self.point[2] = value,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self { point: [0.0; 3], color: [0; 3] }
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set_coordinate(name, value)
    }

    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set_coordinate(name, value as f32)
    }

    fn set_char(&mut self, name: &str, value: i8) -> PropertyAccessResult {
        self.set_coordinate(name, value.into())
    }

    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        match name {
            "red" | "diffuse_red" => self.color[0] = value,
            "green" | "diffuse_green" => self.color[1] = value,
            "blue" | "diffuse_blue" => self.color[2] = value,
            _ => return self.set_coordinate(name, value.into()),
        }
        PropertyAccessResult::Set
    }

    fn set_short(&mut self, name: &str, value: i16) -> PropertyAccessResult {
        self.set_coordinate(name, value.into())
    }

    fn set_ushort(&mut self, name: &str, value: u16) -> PropertyAccessResult {
        self.set_coordinate(name, value.into())
    }

    fn set_int(&mut self, name: &str, value: i32) -> PropertyAccessResult {
        self.set_coordinate(name, value as f32)
    }

    fn set_uint(&mut self, name: &str, value: u32) -> PropertyAccessResult {
        self.set_coordinate(name, value as f32)
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        match name {
            "x" => Some(self.point[0]),
            "y" => Some(self.point[1]),
            "z" => Some(self.point[2]),
            _ => None,
        }
    }

    fn get_uchar(&self, name: &str) -> Option<u8> {
        match name {
            "red" => Some(self.color[0]),
            "green" => Some(self.color[1]),
            "blue" => Some(self.color[2]),
            _ => None,
        }
    }
}

/// An element that is passed over; takes no memory, however many there are.
#[derive(Debug, Clone, Copy)]
struct Passed;

impl PropertyAccess for Passed {
    fn new() -> Self {
        Self
    }
}
