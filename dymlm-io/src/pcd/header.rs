use std::collections::BTreeSet;
use std::path::Path;

use dymlm_core::Pose;

use crate::Error;
use crate::scalar::Scalar;
use crate::text_lines::{number, quoted};

/// How the points are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Binary,
    BinaryCompressed,
}

/// A field as declared in the header.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FieldHeader {
    pub(super) name: String,
    pub(super) scalar: Scalar,
    pub(super) count: usize,
}

/// The content of a header.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PcdHeader {
    pub(super) fields: Vec<FieldHeader>,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) viewpoint: Pose,
    pub(super) encoding: Encoding,
    /// Bytes per point.
    pub(super) stride: usize,
    /// Offset of the first point in the file, bytes.
    pub(super) body: usize,
    /// Number of the line after the header, from 1.
    pub(super) body_line: usize,
}

fn scalar(kind: &str, size: &str) -> Result<Scalar, String> {
    Ok(match (kind, size) {
        ("I", "1") => Scalar::I8,
        ("U", "1") => Scalar::U8,
        ("I", "2") => Scalar::I16,
        ("U", "2") => Scalar::U16,
        ("I", "4") => Scalar::I32,
        ("U", "4") => Scalar::U32,
        ("I", "8") => Scalar::I64,
        ("U", "8") => Scalar::U64,
        ("F", "4") => Scalar::F32,
        ("F", "8") => Scalar::F64,
        _ => return Err(format!("a field of unknown type {} and size {}", quoted(kind), quoted(size))),
    })
}

impl FieldHeader {
    /// Bytes of the field in a point.
    pub(super) fn size(&self) -> usize {
        self.scalar.size() * self.count
    }
}

impl PcdHeader {
    /// Number of points.
    pub(super) fn points(&self) -> usize {
        self.width * self.height
    }

    /// Reads the header of a file.
    pub(super) fn parse(file: &[u8], path: &Path) -> Result<Self, Error> {
        let mut entries = Entries::default();
        let mut body = 0;
        for (index, line) in file.split_inclusive(|&byte| byte == b'\n').enumerate() {
            body += line.len();
            let text = std::str::from_utf8(line)
                .map_err(|_| Error::line(path, index + 1, "no UTF-8 in the header of a PCD file"))?
                .trim();
            if text.is_empty() || text.starts_with('#') {
                continue;
            }
            let last = entries.add(text).map_err(|reason| Error::line(path, index + 1, reason))?;
            if last {
                let header = entries.finish(body, index + 2);
                return header.map_err(|reason| Error::malformed(path, reason));
            }
        }
        Err(Error::malformed(path, "no PCD file: the header has no DATA line"))
    }
}

/// The entries of a header, collected in any order.
#[derive(Default)]
struct Entries<'a> {
    names: Vec<&'a str>,
    sizes: Vec<&'a str>,
    kinds: Vec<&'a str>,
    counts: Option<Vec<usize>>,
    width: Option<usize>,
    height: Option<usize>,
    points: Option<usize>,
    viewpoint: Option<Pose>,
    encoding: Option<Encoding>,
}

impl<'a> Entries<'a> {
    /// Adds a line; returns whether it was the last one.
    fn add(&mut self, line: &'a str) -> Result<bool, String> {
        let mut columns = line.split_ascii_whitespace();
        let key = columns.next().unwrap_or_default();
        let values: Vec<&str> = columns.collect();
        match key {
            "VERSION" => {}
            // Version 0.5 has COLUMNS instead.
            "FIELDS" | "COLUMNS" => self.names = values,
            "SIZE" => self.sizes = values,
            "TYPE" => self.kinds = values,
            "COUNT" => {
                self.counts = Some(values.iter().map(|value| whole(value)).collect::<Result<_, _>>()?);
            }
            "WIDTH" => self.width = Some(single(&values)?),
            "HEIGHT" => self.height = Some(single(&values)?),
            "POINTS" => self.points = Some(single(&values)?),
            "VIEWPOINT" => self.viewpoint = Some(viewpoint(&values)?),
            "DATA" => {
                self.encoding = Some(encoding(&values)?);
                return Ok(true);
            }
            _ => return Err(format!("{} is no entry of a PCD header", quoted(key))),
        }
        Ok(false)
    }

    fn finish(self, body: usize, body_line: usize) -> Result<PcdHeader, String> {
        let fields = self.fields()?;
        let stride = fields
            .iter()
            .try_fold(0_usize, |sum, field| sum.checked_add(field.scalar.size().checked_mul(field.count)?))
            .ok_or("points of more bytes than can be addressed")?;
        let (width, height) = self.organization()?;
        Ok(PcdHeader {
            fields,
            width,
            height,
            viewpoint: self.viewpoint.unwrap_or_default(),
            encoding: self.encoding.ok_or("no DATA line")?,
            stride,
            body,
            body_line,
        })
    }

    fn fields(&self) -> Result<Vec<FieldHeader>, String> {
        let ones = vec![1; self.names.len()];
        let counts = self.counts.as_ref().unwrap_or(&ones);
        if [self.sizes.len(), self.kinds.len(), counts.len()].iter().any(|&n| n != self.names.len()) {
            return Err(format!(
                "{} FIELDS, but {} of SIZE, {} of TYPE and {} of COUNT",
                self.names.len(),
                self.sizes.len(),
                self.kinds.len(),
                counts.len()
            ));
        }
        let mut fields: Vec<FieldHeader> = Vec::with_capacity(self.names.len());
        let mut known = BTreeSet::new();
        for (i, &name) in self.names.iter().enumerate() {
            let scalar = scalar(self.kinds[i], self.sizes[i])?;
            // Only padding may occur more than once.
            if name != "_" && !known.insert(name) {
                return Err(format!("two fields of the name {}", quoted(name)));
            }
            if counts[i] == 0 {
                return Err(format!("the field {} has no values", quoted(name)));
            }
            fields.push(FieldHeader { name: name.to_owned(), scalar, count: counts[i] });
        }
        Ok(fields)
    }

    fn organization(&self) -> Result<(usize, usize), String> {
        let (width, height) = match (self.width, self.height, self.points) {
            (Some(width), height, _) => (width, height.unwrap_or(1)),
            (None, _, Some(points)) => (points, 1),
            (None, _, None) => return Err("the header has neither WIDTH nor POINTS".to_owned()),
        };
        let points = width
            .checked_mul(height)
            .ok_or_else(|| format!("{width}x{height} points are more than can be addressed"))?;
        match self.points {
            Some(given) if given != points => {
                Err(format!("POINTS {given} is not WIDTH {width} times HEIGHT {height}"))
            }
            _ => Ok((width, height)),
        }
    }
}

fn single(values: &[&str]) -> Result<usize, String> {
    match values {
        [value] => whole(value),
        _ => Err(format!("{} values instead of one", values.len())),
    }
}

fn whole(value: &str) -> Result<usize, String> {
    value.parse().map_err(|_| format!("{} is not a count", quoted(value)))
}

/// `tx ty tz qw qx qy qz`.
fn viewpoint(values: &[&str]) -> Result<Pose, String> {
    let numbers: Vec<f64> = values.iter().map(|value| number(value)).collect::<Result<_, _>>()?;
    match numbers.as_slice() {
        &[tx, ty, tz, qw, qx, qy, qz] => {
            Pose::new([tx, ty, tz], [qx, qy, qz, qw]).map_err(|error| error.to_string())
        }
        _ => Err(format!("a VIEWPOINT of {} numbers instead of 7", numbers.len())),
    }
}

fn encoding(values: &[&str]) -> Result<Encoding, String> {
    match values {
        ["ascii"] => Ok(Encoding::Ascii),
        ["binary"] => Ok(Encoding::Binary),
        ["binary_compressed"] => Ok(Encoding::BinaryCompressed),
        _ => Err(format!("DATA {} is none of ascii, binary, binary_compressed", quoted(&values.join(" ")))),
    }
}
