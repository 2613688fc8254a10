use std::io::{BufRead, Read};
use std::path::Path;

use crate::Error;
use crate::scalar::Scalar;
use crate::text_lines::quoted;

/// Longer lines are no header's, and need not be read to their end to know that.
const LONGEST_LINE: u64 = 1 << 16;

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

/// All that stands before the values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PlyHeader {
    pub(super) format: Format,
    pub(super) elements: Vec<Element>,
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
    /// Reads a header and leaves the stream at the first value.
    pub(super) fn read(stream: &mut impl BufRead, path: &Path) -> Result<Self, Error> {
        let mut format = None;
        let mut elements = Vec::new();
        let mut lines = 0;
        loop {
            let bytes = read_line(stream).map_err(Error::io(path))?;
            lines += 1;
            let fault = |reason: String| Error::line(path, lines, reason);
            if !bytes.ends_with(b"\n") {
                return Err(fault("no PLY file: its header does not end".to_owned()));
            }
            // Comments may be in any encoding; nothing else is beyond ASCII.
            let text = String::from_utf8_lossy(&bytes);
            let columns: Vec<&str> = text.split_ascii_whitespace().collect();
            match (lines, columns.as_slice()) {
                (1, ["ply"]) => {}
                (1, _) => return Err(fault("no PLY file: it does not begin with \"ply\"".to_owned())),
                (_, ["comment" | "obj_info", ..] | []) => {}
                (_, ["format", name, "1.0"]) => format = Some(parse_format(name).map_err(fault)?),
                (_, ["element", name, count]) => elements.push(parse_element(name, count).map_err(fault)?),
                (_, ["property", kind @ .., name]) => {
                    add_property(elements.last_mut(), kind, name).map_err(fault)?;
                }
                (_, ["end_header"]) => {
                    let format = format.ok_or_else(|| fault("a header without format".to_owned()))?;
                    return Ok(Self { format, elements, lines });
                }
                _ => return Err(fault(format!("{} is no line of a PLY header", quoted(text.trim())))),
            }
        }
    }
}

fn read_line(stream: &mut impl BufRead) -> std::io::Result<Vec<u8>> {
    let mut line = Vec::new();
    stream.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line)?;
    Ok(line)
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

fn add_property(element: Option<&mut Element>, kind: &[&str], name: &str) -> Result<(), String> {
    let element = element.ok_or("a property of no element")?;
    let kind = match kind {
        [kind] => Kind::Scalar(scalar(kind)?),
        ["list", count, values] => Kind::List { count: scalar(count)?, values: scalar(values)? },
        _ => return Err(format!("{} is no property", quoted(&kind.join(" ")))),
    };
    if element.properties.iter().any(|property| property.name == name) {
        return Err(format!("two properties of the name {}", quoted(name)));
    }
    element.properties.push(Property { name: name.to_owned(), kind });
    Ok(())
}
