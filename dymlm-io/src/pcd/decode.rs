use std::fs;
use std::path::Path;

use dymlm_core::{Point, PointCloud, Rgb};

use super::cloud::{PcdCloud, PcdField};
use super::header::{Encoding, FieldHeader, PcdHeader};
use super::lzf;
use crate::Error;
use crate::scalar::Scalar;
use crate::text_lines::quoted;

/// Reads a PCD file: ascii, binary or `binary_compressed`, of version 0.7 or older.
///
/// Points are the fields `x y z`, of any type; colours `rgb` or `rgba`, packed into an integer or into the
/// bits of a float (alpha is dropped). Other fields are kept as they are, except padding (`_`). Points that
/// are not finite are kept: see [`PcdCloud::finite`].
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Malformed`] or, with a line, [`Error::Line`] when the file is not a PCD file, has
/// no coordinates or ends before its last point.
pub fn read_pcd(path: impl AsRef<Path>) -> Result<PcdCloud, Error> {
    let path = path.as_ref();
    let file = fs::read(path).map_err(Error::io(path))?;
    decode_pcd(&file, path)
}

/// Reads the bytes of a PCD file; errors call it `name`.
///
/// # Errors
///
/// As [`read_pcd`].
pub fn decode_pcd(file: &[u8], name: impl AsRef<Path>) -> Result<PcdCloud, Error> {
    let name = name.as_ref();
    let header = PcdHeader::parse(file, name)?;
    let body = file.get(header.body..).unwrap_or_default();
    let columns = match header.encoding {
        Encoding::Ascii => ascii_columns(body, &header, name),
        Encoding::Binary => binary_columns(body, &header).map_err(|reason| Error::malformed(name, reason)),
        Encoding::BinaryCompressed => {
            compressed_columns(body, &header).map_err(|reason| Error::malformed(name, reason))
        }
    };
    assemble(&header, columns?, name)
}

/// The values of a field, by their use.
enum Column {
    /// Coordinates along an axis, 0 to 2.
    Coordinate(usize, Vec<f32>),
    Color(Vec<Rgb>),
    Further(Vec<f64>),
    Padding,
}

impl Column {
    fn of(field: &FieldHeader) -> Self {
        match field.name.as_str() {
            "_" => Self::Padding,
            "x" if field.count == 1 => Self::Coordinate(0, Vec::new()),
            "y" if field.count == 1 => Self::Coordinate(1, Vec::new()),
            "z" if field.count == 1 => Self::Coordinate(2, Vec::new()),
            "rgb" | "rgba" if field.count == 1 && field.scalar.size() == 4 => Self::Color(Vec::new()),
            _ => Self::Further(Vec::new()),
        }
    }

    /// Appends a value from its little-endian bytes.
    #[inline]
    fn push_bytes(&mut self, scalar: Scalar, value: &[u8]) {
        let mut bytes = [0; 8];
        bytes[..value.len()].copy_from_slice(value);
        match self {
            Self::Coordinate(_, values) => values.push(scalar.to_f64(bytes) as f32),
            Self::Color(values) => values.push([bytes[2], bytes[1], bytes[0]]),
            Self::Further(values) => values.push(scalar.to_f64(bytes)),
            Self::Padding => {}
        }
    }

    /// Appends a value from its text; `None` when the text is not a value of that type.
    fn push_token(&mut self, scalar: Scalar, token: &str) -> Option<()> {
        if let Self::Color(values) = self {
            let [_, red, green, blue] = packed_color(scalar, token)?.to_be_bytes();
            values.push([red, green, blue]);
            return Some(());
        }
        let value: f64 =
            token.parse().ok().filter(|value: &f64| !scalar.is_whole() || value.fract() == 0.0)?;
        match self {
            Self::Coordinate(_, values) => values.push(value as f32),
            Self::Further(values) => values.push(value),
            Self::Color(_) | Self::Padding => {}
        }
        Some(())
    }
}

/// The bits of a packed colour. A colour declared as float is written as the float with those bits or, by
/// some versions of PCL, as the bits themselves in a whole number.
fn packed_color(scalar: Scalar, token: &str) -> Option<u32> {
    let whole = || token.parse().ok().or_else(|| token.parse::<i32>().ok().map(i32::cast_unsigned));
    let float = || token.parse::<f32>().ok().filter(|_| scalar == Scalar::F32).map(f32::to_bits);
    whole().or_else(float)
}

/// The columns of points that are stored one after the other.
fn binary_columns(body: &[u8], header: &PcdHeader) -> Result<Vec<Column>, String> {
    check_length(body, header)?;
    let mut base = 0;
    let columns = header.fields.iter().map(|field| {
        let rows = body.chunks(header.stride.max(1)).take(header.points());
        let column = binary_column(field, rows.map(|row| &row[base..base + field.size()]));
        base += field.size();
        column
    });
    Ok(columns.collect())
}

/// The columns of a compressed body, which stores all values of one field before those of the next.
fn compressed_columns(body: &[u8], header: &PcdHeader) -> Result<Vec<Column>, String> {
    let body = decompress_body(body, header)?;
    check_length(&body, header)?;
    let mut rest = body.as_slice();
    let columns = header.fields.iter().map(|field| {
        let own;
        (own, rest) = rest.split_at(header.points() * field.size());
        binary_column(field, own.chunks(field.size()))
    });
    Ok(columns.collect())
}

fn binary_column<'a>(field: &FieldHeader, points: impl Iterator<Item = &'a [u8]>) -> Column {
    let mut column = Column::of(field);
    for point in points {
        point.chunks(field.scalar.size()).for_each(|value| column.push_bytes(field.scalar, value));
    }
    column
}

fn needed_bytes(header: &PcdHeader) -> Result<usize, String> {
    header.points().checked_mul(header.stride).ok_or_else(|| {
        format!("{} points of {} bytes are more than can be addressed", header.points(), header.stride)
    })
}

/// Checks that the body is as long as the header's counts say: later code relies on it.
fn check_length(body: &[u8], header: &PcdHeader) -> Result<(), String> {
    let (points, needed, given) = (header.points(), needed_bytes(header)?, body.len());
    if given >= needed {
        return Ok(());
    }
    Err(format!("{points} points need {needed} bytes, but only {given} follow"))
}

fn decompress_body(body: &[u8], header: &PcdHeader) -> Result<Vec<u8>, String> {
    let needed = needed_bytes(header)?;
    if needed == 0 {
        return Ok(Vec::new());
    }
    let (sizes, rest) = body.split_at_checked(8).ok_or("the sizes of the compressed data are missing")?;
    let mut sizes = sizes.as_chunks().0.iter().map(|&size| u32::from_le_bytes(size) as usize);
    let (compressed, uncompressed) = (sizes.next().unwrap_or(0), sizes.next().unwrap_or(0));
    if uncompressed != needed {
        let points = header.points();
        return Err(format!("{points} points need {needed} bytes, but {uncompressed} were compressed"));
    }
    let stream = rest.get(..compressed).ok_or_else(|| {
        format!("{compressed} bytes of compressed data are announced, but only {} follow", rest.len())
    })?;
    lzf::decompress(stream, uncompressed).map_err(|error| error.to_string())
}

fn ascii_columns(body: &[u8], header: &PcdHeader, path: &Path) -> Result<Vec<Column>, Error> {
    // No memory is reserved for the number of points in the header, which may be wrong.
    let mut columns: Vec<Column> = header.fields.iter().map(Column::of).collect();
    let lines = body.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii).zip(header.body_line..);
    let mut points = 0;
    for (line, number) in lines.filter(|(line, _)| !line.is_empty()).take(header.points()) {
        add_line(&mut columns, header, line).map_err(|reason| Error::line(path, number, reason))?;
        points += 1;
    }
    if points == header.points() {
        return Ok(columns);
    }
    let reason = format!("{} points are announced, but only {points} follow", header.points());
    Err(Error::malformed(path, reason))
}

/// Adds the values of one point.
fn add_line(columns: &mut [Column], header: &PcdHeader, line: &[u8]) -> Result<(), String> {
    let line = std::str::from_utf8(line).map_err(|_| "no UTF-8")?;
    let mut tokens = line.split_ascii_whitespace();
    for (column, field) in columns.iter_mut().zip(&header.fields) {
        for _ in 0..field.count {
            let name = quoted(&field.name);
            let token = tokens.next().ok_or_else(|| format!("no value for the field {name}"))?;
            column
                .push_token(field.scalar, token)
                .ok_or_else(|| format!("{} is no value of the field {name}", quoted(token)))?;
        }
    }
    tokens.next().map_or(Ok(()), |token| Err(format!("{} is beyond the last field", quoted(token))))
}

/// Sorts the columns into points, colours and further fields.
fn assemble(header: &PcdHeader, columns: Vec<Column>, path: &Path) -> Result<PcdCloud, Error> {
    let mut coordinates: [Option<Vec<f32>>; 3] = [None, None, None];
    let mut colors = None;
    let mut fields = Vec::new();
    for (FieldHeader { name, count, .. }, column) in header.fields.iter().zip(columns) {
        match column {
            Column::Coordinate(axis, values) => coordinates[axis] = Some(values),
            Column::Color(values) => colors = Some(values),
            Column::Further(values) => fields.push(PcdField { name: name.clone(), count: *count, values }),
            Column::Padding => {}
        }
    }
    let [Some(x), Some(y), Some(z)] = coordinates else {
        return Err(Error::malformed(path, "a PCD file without the fields x, y and z"));
    };
    let points: Vec<Point> = x.into_iter().zip(y).zip(z).map(|((x, y), z)| [x, y, z]).collect();
    let cloud = match colors {
        Some(colors) => PointCloud::with_colors(points, colors),
        None => Ok(PointCloud::new(points)),
    };
    let cloud = cloud.map_err(|error| Error::malformed(path, error.to_string()))?;
    let PcdHeader { width, height, viewpoint, .. } = *header;
    Ok(PcdCloud { cloud, width, height, viewpoint, fields })
}
