//! The rows of values after the header, as they are stored.

use std::io::{self, BufRead, Read};
use std::path::Path;

use dymlm_core::{Point, Rgb};

use super::header::{Element, Format, Kind, PlyHeader};
use crate::Error;
use crate::scalar::Scalar;
use crate::text_lines::quoted;

/// Rows of one size are read so many at a time.
const ROWS_A_BLOCK: usize = 1 << 12;

/// What a property is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Coordinate(usize),
    Color(usize),
    Passed,
}

/// A row of the vertices.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Vertex {
    point: Point,
    color: Rgb,
}

/// The vertices read so far.
pub(super) struct Vertices {
    pub(super) points: Vec<Point>,
    pub(super) colors: Option<Vec<Rgb>>,
}

impl Vertices {
    pub(super) fn with_capacity(capacity: usize, has_colors: bool) -> Self {
        Self {
            points: Vec::with_capacity(capacity),
            colors: has_colors.then(|| Vec::with_capacity(capacity)),
        }
    }

    #[inline]
    pub(super) fn push(&mut self, vertex: Vertex) {
        self.points.push(vertex.point);
        if let Some(colors) = &mut self.colors {
            colors.push(vertex.color);
        }
    }
}

/// Bytes of a row of a binary file; `None` when lists make the rows differ.
pub(super) fn row_size(element: &Element) -> Option<usize> {
    element.properties.iter().try_fold(0, |sum, property| match property.kind {
        Kind::Scalar(scalar) => Some(sum + scalar.size()),
        Kind::List { .. } => None,
    })
}

/// The rows after the header.
pub(super) struct Rows<'a, R> {
    stream: R,
    pub(super) format: Format,
    /// The last line of an ascii file.
    line: Vec<u8>,
    /// Its number.
    lines: usize,
    pub(super) path: &'a Path,
}

/// Why there is no next row.
pub(super) enum Fault {
    Io(io::Error),
    Line(String),
}

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl<'a, R: BufRead> Rows<'a, R> {
    /// The stream stands at the first row.
    pub(super) fn new(stream: R, header: &PlyHeader, path: &'a Path) -> Self {
        Self { stream, format: header.format, line: Vec::new(), lines: header.lines, path }
    }

    /// Passes over the rows of an element; those without properties take nothing, however many they are.
    pub(super) fn pass_over(&mut self, element: &Element) -> Result<(), Error> {
        if element.properties.is_empty() {
            return Ok(());
        }
        if let (Format::LittleEndian | Format::BigEndian, Some(size)) = (self.format, row_size(element)) {
            let bytes = (element.count as u64).saturating_mul(size as u64);
            return pass_bytes(&mut self.stream, bytes).map_err(|error| self.error(error.into(), element, 0));
        }
        let roles: Vec<(Kind, Role)> = element.properties.iter().map(|p| (p.kind, Role::Passed)).collect();
        for row in 0..element.count {
            self.next(&roles).map_err(|fault| self.error(fault, element, row))?;
        }
        Ok(())
    }

    /// Reads rows of one size, many at a time.
    pub(super) fn blocks(
        &mut self,
        element: &Element,
        row_size: usize,
        roles: &[(Kind, Role)],
        vertices: &mut Vertices,
        to_little_endian: impl Fn(&mut [u8]),
    ) -> Result<(), Error> {
        let columns = columns(roles);
        let mut block = Vec::new();
        let mut done = 0;
        while done < element.count {
            block.clear();
            let wanted = ((element.count - done).min(ROWS_A_BLOCK) * row_size) as u64;
            self.stream.by_ref().take(wanted).read_to_end(&mut block).map_err(Error::io(self.path))?;
            for row in block.chunks_exact(row_size) {
                vertices.push(vertex_of(row, &columns, &to_little_endian));
            }
            done += block.len() / row_size;
            if (block.len() as u64) < wanted {
                let end = io::Error::from(io::ErrorKind::UnexpectedEof);
                return Err(self.error(end.into(), element, done));
            }
        }
        Ok(())
    }

    /// Reads one row.
    pub(super) fn next(&mut self, roles: &[(Kind, Role)]) -> Result<Vertex, Fault> {
        match self.format {
            Format::Ascii => self.next_line(roles),
            Format::LittleEndian => next_binary(&mut self.stream, roles, |_| ()),
            Format::BigEndian => next_binary(&mut self.stream, roles, <[u8]>::reverse),
        }
    }

    /// One row of an ascii file: a line that is not blank.
    fn next_line(&mut self, roles: &[(Kind, Role)]) -> Result<Vertex, Fault> {
        loop {
            self.line.clear();
            self.lines += 1;
            if self.stream.read_until(b'\n', &mut self.line)? == 0 {
                return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
            }
            if !self.line.trim_ascii().is_empty() {
                break;
            }
        }
        let line = std::str::from_utf8(&self.line).map_err(|_| Fault::Line("no UTF-8".to_owned()))?;
        let mut tokens = line.split_ascii_whitespace();
        let mut vertex = Vertex::default();
        for &(kind, role) in roles {
            let token = tokens.next().ok_or_else(|| Fault::Line("the line ends too early".to_owned()))?;
            let is_value = match (kind, role) {
                (Kind::List { .. }, _) => pass_list(token, &mut tokens),
                (_, Role::Coordinate(axis)) => token.parse().map(|value| vertex.point[axis] = value).is_ok(),
                (_, Role::Color(channel)) => token.parse().map(|value| vertex.color[channel] = value).is_ok(),
                (_, Role::Passed) => true,
            };
            if !is_value {
                return Err(Fault::Line(format!("{} is not what belongs there", quoted(token))));
            }
        }
        match tokens.next() {
            Some(token) => Err(Fault::Line(format!("{} is beyond the last property", quoted(token)))),
            None => Ok(vertex),
        }
    }

    /// Tells where a row is missing or bad.
    pub(super) fn error(&self, fault: Fault, element: &Element, row: usize) -> Error {
        match fault {
            Fault::Line(reason) => Error::line(self.path, self.lines, reason),
            Fault::Io(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                let (count, name) = (element.count, &element.name);
                let reason =
                    format!("{count} elements {} are announced, but only {row} follow", quoted(name));
                Error::malformed(self.path, reason)
            }
            Fault::Io(error) => Error::io(self.path)(error),
        }
    }
}

/// A property that is asked for: where it begins in a row of one size.
#[derive(Debug, Clone, Copy)]
struct Column {
    offset: usize,
    scalar: Scalar,
    role: Role,
}

fn columns(roles: &[(Kind, Role)]) -> Vec<Column> {
    let mut offset = 0;
    let mut columns = Vec::new();
    for &(kind, role) in roles {
        if let Kind::Scalar(scalar) = kind {
            if role != Role::Passed {
                columns.push(Column { offset, scalar, role });
            }
            offset += scalar.size();
        }
    }
    columns
}

#[inline]
fn vertex_of(row: &[u8], columns: &[Column], to_little_endian: &impl Fn(&mut [u8])) -> Vertex {
    let mut vertex = Vertex::default();
    for &Column { offset, scalar, role } in columns {
        let value = row.get(offset..).unwrap_or_default();
        match role {
            Role::Coordinate(axis) => vertex.point[axis] = coordinate(value, scalar, to_little_endian),
            Role::Color(channel) => vertex.color[channel] = value.first().copied().unwrap_or_default(),
            Role::Passed => {}
        }
    }
    vertex
}

#[inline]
fn coordinate(value: &[u8], scalar: Scalar, to_little_endian: &impl Fn(&mut [u8])) -> f32 {
    if let (Scalar::F32, Some(&bytes)) = (scalar, value.first_chunk()) {
        // Nearly every file's: without the detour over eight bytes.
        let mut bytes: [u8; 4] = bytes;
        to_little_endian(&mut bytes);
        return f32::from_le_bytes(bytes);
    }
    let mut bytes = [0; 8];
    if let (Some(bytes), Some(value)) = (bytes.get_mut(..scalar.size()), value.get(..scalar.size())) {
        bytes.copy_from_slice(value);
        to_little_endian(bytes);
    }
    scalar.to_f64(bytes) as f32
}

/// Passes over the values of a list; says whether they are there.
fn pass_list<'a>(count: &str, values: &mut impl Iterator<Item = &'a str>) -> bool {
    match count.parse::<usize>() {
        Ok(0) => true,
        Ok(count) => values.nth(count - 1).is_some(),
        Err(_) => false,
    }
}

/// One row of a binary file; `to_little_endian` turns the bytes of a value around if need be.
fn next_binary(
    stream: &mut impl BufRead,
    roles: &[(Kind, Role)],
    to_little_endian: impl Fn(&mut [u8]),
) -> Result<Vertex, Fault> {
    let read = |scalar: Scalar, stream: &mut _| -> io::Result<[u8; 8]> {
        let mut bytes = [0; 8];
        if let Some(value) = bytes.get_mut(..scalar.size()) {
            Read::read_exact(stream, value)?;
            to_little_endian(value);
        }
        Ok(bytes)
    };
    let mut vertex = Vertex::default();
    for &(kind, role) in roles {
        match (kind, role) {
            (Kind::List { count, values }, _) => {
                let count = list_length(count, read(count, stream)?)?;
                pass_bytes(stream, count.saturating_mul(values.size() as u64))?;
            }
            (Kind::Scalar(scalar), Role::Coordinate(axis)) => {
                vertex.point[axis] = scalar.to_f64(read(scalar, stream)?) as f32;
            }
            (Kind::Scalar(scalar), Role::Color(channel)) => vertex.color[channel] = read(scalar, stream)?[0],
            (Kind::Scalar(scalar), Role::Passed) => {
                read(scalar, stream)?;
            }
        }
    }
    Ok(vertex)
}

fn list_length(scalar: Scalar, bytes: [u8; 8]) -> Result<u64, Fault> {
    let length = scalar.to_f64(bytes);
    if scalar.is_whole() && length >= 0.0 {
        return Ok(length as u64);
    }
    Err(io::Error::new(io::ErrorKind::InvalidData, "a list whose length is no number of values").into())
}

fn pass_bytes(stream: &mut impl BufRead, count: u64) -> io::Result<()> {
    let passed = io::copy(&mut stream.take(count), &mut io::sink())?;
    if passed == count { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
}
