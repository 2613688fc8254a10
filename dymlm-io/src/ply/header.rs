use std::collections::BTreeSet;
use std::path::Path;

use crate::Error;
use crate::scalar::Scalar;
use crate::text_lines::quoted;

/// How the values are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// What a property holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, values: Scalar },
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

/// The content of a header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PlyHeader {
    pub(super) format: Format,
    pub(super) elements: Vec<Element>,
    /// Offset of the first value in the file, bytes.
    pub(super) body: usize,
    /// Number of lines of the header.
    pub(super) lines: usize,
}

fn scalar(name: &str) -> Result<Scalar, String> {
    Ok(match name {
        "char" | "int8" => Scalar::I8,
        "uchar" | "uint8" => Scalar::U8,
        "short" | "int16" => Scalar::I16,
        "ushort" | "uint16" => Scalar::U16,
        "int" | "int32" => Scalar::I32,
        "uint" | "uint32" => Scalar::U32,
        "float" | "float32" => Scalar::F32,
        "double" | "float64" => Scalar::F64,
        _ => return Err(format!("{} is no type of a property", quoted(name))),
    })
}

impl PlyHeader {
    /// Reads the header of a file.
    pub(super) fn parse(file: &[u8], path: &Path) -> Result<Self, Error> {
        let mut format = None;
        let mut elements = Vec::new();
        // Names of the last element's properties.
        let mut names = BTreeSet::new();
        let mut body = 0;
        for (number, bytes) in (1..).zip(file.split_inclusive(|&byte| byte == b'\n')) {
            let fault = |reason: String| Error::line(path, number, reason);
            body += bytes.len();
            // Comments may be in any encoding; everything else is ASCII.
            let text = String::from_utf8_lossy(bytes);
            let columns: Vec<&str> = text.split_ascii_whitespace().collect();
            match (number, columns.as_slice()) {
                (1, ["ply"]) => {}
                (1, _) => return Err(fault("no PLY file: it does not begin with \"ply\"".to_owned())),
                (_, ["comment" | "obj_info", ..] | []) => {}
                (_, ["format", name, "1.0"]) => format = Some(parse_format(name).map_err(fault)?),
                (_, ["element", name, count]) => {
                    names.clear();
                    elements.push(parse_element(name, count).map_err(fault)?);
                }
                (_, ["property", kind @ .., name]) => {
                    add_property(elements.last_mut(), &mut names, kind, name).map_err(fault)?;
                }
                (_, ["end_header"]) if bytes.ends_with(b"\n") => {
                    let format = format.ok_or_else(|| fault("a header without format".to_owned()))?;
                    return Ok(Self { format, elements, body, lines: number });
                }
                _ => return Err(fault(format!("{} is no line of a PLY header", quoted(text.trim())))),
            }
        }
        Err(Error::malformed(path, "no PLY file: its header does not end"))
    }
}

fn parse_format(name: &str) -> Result<Format, String> {
    match name {
        "ascii" => Ok(Format::Ascii),
        "binary_little_endian" => Ok(Format::LittleEndian),
        "binary_big_endian" => Ok(Format::BigEndian),
        _ => Err(format!("{} is no format", quoted(name))),
    }
}

fn parse_element(name: &str, count: &str) -> Result<Element, String> {
    let count = count.parse().map_err(|_| format!("{} is no number of elements", quoted(count)))?;
    Ok(Element { name: name.to_owned(), count, properties: Vec::new() })
}

fn add_property(
    element: Option<&mut Element>,
    names: &mut BTreeSet<String>,
    kind: &[&str],
    name: &str,
) -> Result<(), String> {
    let element = element.ok_or("a property before the first element")?;
    let kind = match kind {
        [kind] => Kind::Scalar(scalar(kind)?),
        ["list", count, values] => Kind::List { count: scalar(count)?, values: scalar(values)? },
        _ => return Err(format!("{} is no property", quoted(&kind.join(" ")))),
    };
    if !names.insert(name.to_owned()) {
        return Err(format!("two properties of the name {}", quoted(name)));
    }
    element.properties.push(Property { name: name.to_owned(), kind });
    Ok(())
}
