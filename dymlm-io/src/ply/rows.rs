//! The rows of values after the header.

use std::path::Path;

use dymlm_core::{Point, Rgb};

use super::header::{Element, Format, Kind, PlyHeader};
use crate::Error;
use crate::scalar::Scalar;
use crate::text_lines::quoted;

/// The use of a property.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Coordinate(usize),
    Color(usize),
    Passed,
}

/// The values of a vertex's row.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Vertex {
    pub(super) point: Point,
    pub(super) color: Rgb,
}

/// The rows after the header.
pub(super) struct Rows<'a> {
    /// Bytes that have not been read.
    rest: &'a [u8],
    format: Format,
    /// For ascii, number of lines read so far.
    lines: usize,
    pub(super) path: &'a Path,
}

/// Why there is no next row.
pub(super) enum Fault {
    End,
    Line(String),
}

impl<'a> Rows<'a> {
    pub(super) fn new(file: &'a [u8], header: &PlyHeader, path: &'a Path) -> Self {
        let rest = file.get(header.body..).unwrap_or_default();
        Self { rest, format: header.format, lines: header.lines, path }
    }

    pub(super) fn bytes_left(&self) -> usize {
        self.rest.len()
    }

    /// Skips the rows of an element. Without properties they have no bytes, however many there are.
    pub(super) fn pass_over(&mut self, element: &Element) -> Result<(), Error> {
        if element.properties.is_empty() {
            return Ok(());
        }
        let roles: Vec<(Kind, Role)> = element.properties.iter().map(|p| (p.kind, Role::Passed)).collect();
        for row in 0..element.count {
            self.next(&roles).map_err(|fault| self.error(fault, element, row))?;
        }
        Ok(())
    }

    /// Reads one row.
    #[inline]
    pub(super) fn next(&mut self, roles: &[(Kind, Role)]) -> Result<Vertex, Fault> {
        match self.format {
            Format::Ascii => self.next_line(roles),
            Format::LittleEndian | Format::BigEndian => self.next_binary(roles),
        }
    }

    /// Reads one row of an ascii file: the next line that is not blank.
    fn next_line(&mut self, roles: &[(Kind, Role)]) -> Result<Vertex, Fault> {
        let mut line: &[u8] = &[];
        while line.is_empty() {
            if self.rest.is_empty() {
                return Err(Fault::End);
            }
            self.lines += 1;
            let end = self.rest.iter().position(|&byte| byte == b'\n').map_or(self.rest.len(), |end| end + 1);
            (line, self.rest) = self.rest.split_at(end);
            line = line.trim_ascii();
        }
        let line = std::str::from_utf8(line).map_err(|_| Fault::Line("no UTF-8".to_owned()))?;
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
                return Err(Fault::Line(format!("{} is not a value of the property there", quoted(token))));
            }
        }
        match tokens.next() {
            Some(token) => Err(Fault::Line(format!("{} is beyond the last property", quoted(token)))),
            None => Ok(vertex),
        }
    }

    /// Reads one row of a binary file.
    #[inline]
    fn next_binary(&mut self, roles: &[(Kind, Role)]) -> Result<Vertex, Fault> {
        let mut vertex = Vertex::default();
        for &(kind, role) in roles {
            match (kind, role) {
                (Kind::List { count, values }, _) => {
                    let length = count.to_f64(self.value(count)?);
                    if !count.is_whole() || length < 0.0 {
                        return Err(Fault::Line("a list whose length is no number of values".to_owned()));
                    }
                    self.take((length as usize).saturating_mul(values.size()))?;
                }
                (Kind::Scalar(scalar), Role::Coordinate(axis)) => {
                    vertex.point[axis] = scalar.to_f64(self.value(scalar)?) as f32;
                }
                (Kind::Scalar(scalar), Role::Color(channel)) => {
                    vertex.color[channel] = self.value(scalar)?[0];
                }
                (Kind::Scalar(scalar), Role::Passed) => {
                    self.take(scalar.size())?;
                }
            }
        }
        Ok(vertex)
    }

    /// The next value's bytes, little endian.
    #[inline]
    fn value(&mut self, scalar: Scalar) -> Result<[u8; 8], Fault> {
        let own = self.take(scalar.size())?;
        let mut bytes = [0; 8];
        bytes[..own.len()].copy_from_slice(own);
        if self.format == Format::BigEndian {
            bytes[..own.len()].reverse();
        }
        Ok(bytes)
    }

    #[inline]
    fn take(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        let (own, rest) = self.rest.split_at_checked(count).ok_or(Fault::End)?;
        self.rest = rest;
        Ok(own)
    }

    /// The error of a row that is missing or bad.
    pub(super) fn error(&self, fault: Fault, element: &Element, row: usize) -> Error {
        match (fault, self.format) {
            (Fault::Line(reason), Format::Ascii) => Error::line(self.path, self.lines, reason),
            (Fault::Line(reason), _) => Error::malformed(self.path, reason),
            (Fault::End, _) => {
                let (count, name) = (element.count, quoted(&element.name));
                let reason = format!("{count} elements {name} are announced, but only {row} follow");
                Error::malformed(self.path, reason)
            }
        }
    }
}

/// Skips the values of a list; returns whether they are all there.
fn pass_list<'a>(count: &str, values: &mut impl Iterator<Item = &'a str>) -> bool {
    match count.parse::<usize>() {
        Ok(0) => true,
        Ok(count) => values.nth(count - 1).is_some(),
        Err(_) => false,
    }
}
