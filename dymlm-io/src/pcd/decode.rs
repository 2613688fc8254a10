use std::fs;
use std::path::Path;

use dymlm_core::{Point, PointCloud, Rgb};

use super::cloud::{PcdCloud, PcdField, PcdValues, with_values};
use super::encode::PcdEncoding;
use super::header::{FieldHeader, PcdHeader};
use super::lzf;
use crate::Error;
use crate::scalar::with_scalars;
use crate::text_lines::quoted;

/// Reads a PCD file: ascii, binary or `binary_compressed`, of version 0.7 or an older one.
///
/// Points are the fields `x y z`, of any type; colours `rgb` or `rgba`, packed into an integer or into the
/// bits of a float (alpha is dropped). Other fields are kept as they are, except padding (`_`). Points that
/// are not finite are kept: see [`PcdCloud::finite`].
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Malformed`] or, with a line, [`Error::Line`] when the file is no PCD, has no
/// coordinates or ends before its last point.
pub fn read_pcd(path: impl AsRef<Path>) -> Result<PcdCloud, Error> {
    let path = path.as_ref();
    let file = fs::read(path).map_err(Error::io(path))?;
    decode_pcd(&file, path)
}

/// Reads the bytes of a PCD file; `name` is what errors call it.
///
/// # Errors
///
/// As [`read_pcd`].
pub fn decode_pcd(file: &[u8], name: impl AsRef<Path>) -> Result<PcdCloud, Error> {
    let name = name.as_ref();
    let header = PcdHeader::parse(file, name)?;
    let body = file.get(header.body..).unwrap_or_default();
    let columns = match header.encoding {
        PcdEncoding::Ascii => ascii_columns(body, &header, name)?,
        PcdEncoding::Binary => {
            let layout = interleaved(&header);
            binary_columns(body, &header, &layout).map_err(|reason| Error::malformed(name, reason))?
        }
        PcdEncoding::BinaryCompressed => {
            let layout = field_by_field(&header).map_err(|reason| Error::malformed(name, reason))?;
            decompress_body(body, &header)
                .and_then(|body| binary_columns(&body, &header, &layout))
                .map_err(|reason| Error::malformed(name, reason))?
        }
    };
    assemble(&header, columns, name)
}

/// Where the values of a field lie: the first point's at `base`, each next `step` bytes on.
struct Layout {
    base: usize,
    step: usize,
}

/// One point after the other.
fn interleaved(header: &PcdHeader) -> Vec<Layout> {
    let mut base = 0;
    let mut layout = Vec::with_capacity(header.fields.len());
    for field in &header.fields {
        layout.push(Layout { base, step: header.stride });
        base += field.size();
    }
    layout
}

/// One field after the other.
fn field_by_field(header: &PcdHeader) -> Result<Vec<Layout>, String> {
    needed_bytes(header)?;
    let mut base = 0;
    let mut layout = Vec::with_capacity(header.fields.len());
    for field in &header.fields {
        layout.push(Layout { base, step: field.size() });
        base += header.points() * field.size();
    }
    Ok(layout)
}

fn needed_bytes(header: &PcdHeader) -> Result<usize, String> {
    header.points().checked_mul(header.stride).ok_or_else(|| {
        format!("{} points of {} bytes are more than can be addressed", header.points(), header.stride)
    })
}

fn binary_columns(body: &[u8], header: &PcdHeader, layout: &[Layout]) -> Result<Vec<PcdValues>, String> {
    let needed = needed_bytes(header)?;
    // From here on every count is backed by bytes.
    if body.len() < needed {
        return Err(format!(
            "{} points need {needed} bytes, but only {} follow",
            header.points(),
            body.len()
        ));
    }
    Ok(header
        .fields
        .iter()
        .zip(layout)
        .map(|(field, layout)| binary_column(body, header.points(), field, layout))
        .collect())
}

fn binary_column(body: &[u8], points: usize, field: &FieldHeader, layout: &Layout) -> PcdValues {
    let body = body.get(layout.base..).unwrap_or_default();
    let mut column = PcdValues::with_capacity(field.scalar, points * field.count);
    macro_rules! gather {
        ($($name:ident $type:ty),*) => {
            match &mut column {
                $(PcdValues::$name(values) => {
                    for point in body.chunks(layout.step).take(points) {
                        let own = point.as_chunks().0.iter().take(field.count);
                        values.extend(own.map(|&bytes| <$type>::from_le_bytes(bytes)));
                    }
                }),*
            }
        };
    }
    with_scalars!(gather);
    column
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
        return Err(format!(
            "{} points need {needed} bytes, but {uncompressed} were compressed",
            header.points()
        ));
    }
    let stream = rest.get(..compressed).ok_or_else(|| {
        format!("{compressed} bytes of compressed data are announced, but only {} follow", rest.len())
    })?;
    lzf::decompress(stream, uncompressed).map_err(|error| error.to_string())
}

fn ascii_columns(body: &[u8], header: &PcdHeader, path: &Path) -> Result<Vec<PcdValues>, Error> {
    let mut columns = empty_columns(header, body.len());
    let lines = body
        .split(|&byte| byte == b'\n')
        .enumerate()
        .map(|(index, line)| (header.body_line + index, line.trim_ascii()))
        .filter(|(_, line)| !line.is_empty());
    let mut points = 0;
    for (number, line) in lines.take(header.points()) {
        add_line(&mut columns, header, line).map_err(|reason| Error::line(path, number, reason))?;
        points += 1;
    }
    if points == header.points() {
        Ok(columns)
    } else {
        Err(Error::malformed(
            path,
            format!("{} points are announced, but only {points} follow", header.points()),
        ))
    }
}

/// Columns with room for the points that a body of so many bytes can hold, whatever the header promises.
fn empty_columns(header: &PcdHeader, body: usize) -> Vec<PcdValues> {
    let values = header.fields.iter().fold(0, |sum: usize, field| sum.saturating_add(field.count));
    // A value takes two bytes at least.
    let possible = body / values.max(1).saturating_mul(2) + 1;
    let capacity = header.points().min(possible);
    header.fields.iter().map(|field| PcdValues::with_capacity(field.scalar, capacity)).collect()
}

/// Adds the values of one point.
fn add_line(columns: &mut [PcdValues], header: &PcdHeader, line: &[u8]) -> Result<(), String> {
    let line = std::str::from_utf8(line).map_err(|_| "no UTF-8")?;
    let mut tokens = line.split_ascii_whitespace();
    for (column, field) in columns.iter_mut().zip(&header.fields) {
        for _ in 0..field.count {
            let token =
                tokens.next().ok_or_else(|| format!("no value for the field {}", quoted(&field.name)))?;
            add_token(column, field, token).ok_or_else(|| {
                format!("{} is no value of the field {}", quoted(token), quoted(&field.name))
            })?;
        }
    }
    tokens.next().map_or(Ok(()), |token| Err(format!("{} is beyond the last field", quoted(token))))
}

fn add_token(column: &mut PcdValues, field: &FieldHeader, token: &str) -> Option<()> {
    if let (PcdValues::F32(values), true) = (&mut *column, is_color(field)) {
        values.push(packed_float(token)?);
        return Some(());
    }
    with_values!(column, values => values.push(token.parse().ok()?));
    Some(())
}

/// A packed colour declared as float: the float whose bits they are, or the bits themselves as a whole number
/// (as some versions of PCL write it).
fn packed_float(token: &str) -> Option<f32> {
    match token.parse::<u32>() {
        Ok(bits) => Some(f32::from_bits(bits)),
        Err(_) => token.parse().ok(),
    }
}

fn is_color(field: &FieldHeader) -> bool {
    ["rgb", "rgba"].contains(&field.name.as_str()) && field.count == 1 && field.scalar.size() == 4
}

/// Sorts the columns into points, colours and further fields.
fn assemble(header: &PcdHeader, columns: Vec<PcdValues>, path: &Path) -> Result<PcdCloud, Error> {
    let mut coordinates: [Option<Vec<f32>>; 3] = [None, None, None];
    let mut colors: Option<Vec<Rgb>> = None;
    let mut fields = Vec::new();
    for (field, values) in header.fields.iter().zip(columns) {
        let axis = ["x", "y", "z"].iter().position(|&name| name == field.name);
        if let (Some(axis), 1) = (axis, field.count) {
            coordinates[axis] = Some(to_f32(values));
        } else if is_color(field) {
            colors = Some(unpack_colors(values));
        } else if field.name != "_" {
            let field = PcdField::with_count(field.name.as_str(), field.count, values);
            fields.push(field.map_err(|error| Error::malformed(path, error.to_string()))?);
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
    let organized = PcdCloud::new(cloud)
        .organized(header.width, header.height)
        .map(|cloud| cloud.with_viewpoint(header.viewpoint));
    fields
        .into_iter()
        .try_fold(organized?, PcdCloud::with_field)
        .map_err(|error| Error::malformed(path, error.to_string()))
}

fn to_f32(values: PcdValues) -> Vec<f32> {
    match values {
        PcdValues::F32(values) => values,
        other => other.to_f64().into_iter().map(|value| value as f32).collect(),
    }
}

fn unpack_colors(values: PcdValues) -> Vec<Rgb> {
    let rgb = |bits: u32| {
        let [_, red, green, blue] = bits.to_be_bytes();
        [red, green, blue]
    };
    match values {
        PcdValues::F32(values) => values.into_iter().map(|value| rgb(value.to_bits())).collect(),
        PcdValues::U32(values) => values.into_iter().map(rgb).collect(),
        PcdValues::I32(values) => values.into_iter().map(|value| rgb(value.cast_unsigned())).collect(),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_fields_reserve_no_more_than_the_file_can_hold() {
        let padding = |value: &str| format!(" {value}").repeat(50_000);
        let header = format!(
            "FIELDS x y z{}\nSIZE 4 4 4{}\nTYPE F F F{}\nWIDTH 4000000000\nDATA ascii\n",
            padding("_"),
            padding("8"),
            padding("F"),
        );
        let file = header + &"1 ".repeat(350_000);
        let header = PcdHeader::parse(file.as_bytes(), Path::new("test.pcd")).unwrap();
        let reserved: usize = empty_columns(&header, file.len() - header.body)
            .iter()
            .map(|column| with_values!(column, values => values.capacity() * 8))
            .sum();
        assert!(reserved <= 4 * file.len(), "{reserved} bytes for a file of {}", file.len());
        assert!(decode_pcd(file.as_bytes(), "test.pcd").is_err());
    }
}
