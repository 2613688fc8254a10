use std::fmt::Display;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::cloud::{PcdCloud, PcdValues, with_values};
use super::lzf;
use crate::scalar::Scalar;
use crate::{Error, write_atomically};

/// How the points of a PCD file are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PcdEncoding {
    /// A line a point, with as many digits as reading it back needs.
    Ascii,
    /// Point after point, little endian.
    #[default]
    Binary,
    /// Field after field, little endian, compressed with LZF; at most 4 GiB before compression.
    BinaryCompressed,
}

/// Writes a PCD file of version 0.7, atomically: `x y z`, the colours as `rgba` (an unsigned integer,
/// opaque), then the further fields.
///
/// # Errors
///
/// As [`write_atomically`] and [`encode_pcd`].
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("cloud.pcd");
/// use dymlm_core::PointCloud;
/// use dymlm_io::{PcdCloud, PcdEncoding, PcdField, PcdValues};
///
/// let cloud = PcdCloud::new(PointCloud::new(vec![[0.0, 1.0, 2.5], [0.1, 1.0, 2.5]]))
///     .with_field(PcdField::new("label", PcdValues::U32(vec![7, 9]))?)?;
/// dymlm_io::write_pcd(&path, &cloud, PcdEncoding::BinaryCompressed)?;
/// assert_eq!(dymlm_io::read_pcd(&path)?, cloud);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_pcd(path: impl AsRef<Path>, cloud: &PcdCloud, encoding: PcdEncoding) -> Result<(), Error> {
    write_atomically(path, |out| encode_pcd(out, cloud, encoding))
}

/// Writes a PCD file to a stream, as [`write_pcd`] does to a file.
///
/// # Errors
///
/// Those of the stream; a cloud of more than 4 GiB is invalid input for [`PcdEncoding::BinaryCompressed`].
pub fn encode_pcd(out: &mut dyn Write, cloud: &PcdCloud, encoding: PcdEncoding) -> io::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 16, out);
    let columns = columns(cloud);
    write_header(&mut out, cloud, &columns, encoding)?;
    let points = cloud.cloud().len();
    match encoding {
        PcdEncoding::Ascii => write_ascii(&mut out, &columns, points)?,
        PcdEncoding::Binary => {
            for point in 0..points {
                columns.iter().try_for_each(|column| column.write_binary(&mut out, point))?;
            }
        }
        PcdEncoding::BinaryCompressed => write_compressed(&mut out, &columns, points)?,
    }
    out.flush()
}

/// A field to be written.
struct Column<'a> {
    name: &'a str,
    count: usize,
    values: ColumnValues<'a>,
}

enum ColumnValues<'a> {
    /// One coordinate of the points.
    Coordinate(&'a [[f32; 3]], usize),
    /// Colours, packed into integers.
    Colors(&'a [[u8; 3]]),
    /// A further field.
    Field(&'a PcdValues),
}

fn columns(cloud: &PcdCloud) -> Vec<Column<'_>> {
    let points = cloud.cloud().points();
    let coordinates = ["x", "y", "z"].into_iter().enumerate().map(|(axis, name)| Column {
        name,
        count: 1,
        values: ColumnValues::Coordinate(points, axis),
    });
    let colors = cloud.cloud().colors().map(|colors| Column {
        name: "rgba",
        count: 1,
        values: ColumnValues::Colors(colors),
    });
    let fields = cloud.fields().iter().map(|field| Column {
        name: field.name(),
        count: field.count(),
        values: ColumnValues::Field(field.values()),
    });
    coordinates.chain(colors).chain(fields).collect()
}

fn write_header<'a>(
    out: &mut impl Write,
    cloud: &'a PcdCloud,
    columns: &'a [Column<'a>],
    encoding: PcdEncoding,
) -> io::Result<()> {
    let [tx, ty, tz] = cloud.viewpoint().translation();
    let [qx, qy, qz, qw] = cloud.viewpoint().quaternion();
    let data = match encoding {
        PcdEncoding::Ascii => "ascii",
        PcdEncoding::Binary => "binary",
        PcdEncoding::BinaryCompressed => "binary_compressed",
    };
    writeln!(out, "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7")?;
    write_entry(out, "FIELDS", columns, |column| column.name)?;
    write_entry(out, "SIZE", columns, Column::size)?;
    write_entry(out, "TYPE", columns, Column::kind)?;
    write_entry(out, "COUNT", columns, |column| column.count)?;
    writeln!(out, "WIDTH {}\nHEIGHT {}", cloud.width(), cloud.height())?;
    writeln!(out, "VIEWPOINT {tx} {ty} {tz} {qw} {qx} {qy} {qz}")?;
    writeln!(out, "POINTS {}\nDATA {data}", cloud.cloud().len())
}

/// A line of the header that says something of each column.
fn write_entry<'a, T: Display>(
    out: &mut impl Write,
    key: &str,
    columns: &'a [Column<'a>],
    value: impl Fn(&'a Column<'a>) -> T,
) -> io::Result<()> {
    write!(out, "{key}")?;
    columns.iter().try_for_each(|column| write!(out, " {}", value(column)))?;
    writeln!(out)
}

fn write_ascii(out: &mut impl Write, columns: &[Column<'_>], points: usize) -> io::Result<()> {
    for point in 0..points {
        for (i, column) in columns.iter().enumerate() {
            if i > 0 {
                out.write_all(b" ")?;
            }
            column.write_ascii(out, point)?;
        }
        out.write_all(b"\n")?;
    }
    Ok(())
}

fn write_compressed(out: &mut impl Write, columns: &[Column<'_>], points: usize) -> io::Result<()> {
    let mut body = Vec::new();
    for column in columns {
        (0..points).try_for_each(|point| column.write_binary(&mut body, point))?;
    }
    let too_large =
        || io::Error::new(io::ErrorKind::InvalidInput, "more than 4 GiB for a compressed PCD file");
    let uncompressed = u32::try_from(body.len()).map_err(|_| too_large())?;
    let stream = lzf::compress(&body);
    let compressed = u32::try_from(stream.len()).map_err(|_| too_large())?;
    out.write_all(&compressed.to_le_bytes())?;
    out.write_all(&uncompressed.to_le_bytes())?;
    out.write_all(&stream)
}

impl Column<'_> {
    /// Bytes of a value.
    fn size(&self) -> usize {
        match self.values {
            ColumnValues::Coordinate(..) | ColumnValues::Colors(_) => 4,
            ColumnValues::Field(values) => values.scalar().size(),
        }
    }

    fn kind(&self) -> &'static str {
        match self.values {
            ColumnValues::Coordinate(..) => "F",
            ColumnValues::Colors(_) => "U",
            ColumnValues::Field(values) => match values.scalar() {
                Scalar::I8 | Scalar::I16 | Scalar::I32 | Scalar::I64 => "I",
                Scalar::U8 | Scalar::U16 | Scalar::U32 | Scalar::U64 => "U",
                Scalar::F32 | Scalar::F64 => "F",
            },
        }
    }

    fn write_binary(&self, out: &mut impl Write, point: usize) -> io::Result<()> {
        match self.values {
            ColumnValues::Coordinate(points, axis) => out.write_all(&points[point][axis].to_le_bytes()),
            ColumnValues::Colors(colors) => out.write_all(&packed(colors[point]).to_le_bytes()),
            ColumnValues::Field(values) => with_values!(values, values => {
                let values = &values[point * self.count..(point + 1) * self.count];
                values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
            }),
        }
    }

    fn write_ascii(&self, out: &mut impl Write, point: usize) -> io::Result<()> {
        match self.values {
            ColumnValues::Coordinate(points, axis) => write_number(out, points[point][axis]),
            ColumnValues::Colors(colors) => write!(out, "{}", packed(colors[point])),
            ColumnValues::Field(values) => with_values!(values, values => {
                let values = &values[point * self.count..(point + 1) * self.count];
                values.iter().enumerate().try_for_each(|(i, &value)| {
                    if i > 0 {
                        out.write_all(b" ")?;
                    }
                    write_number(out, value)
                })
            }),
        }
    }
}

/// A number as PCL reads it: it knows `nan`, not `NaN`.
fn write_number<T: Display + PartialEq + Copy>(out: &mut impl Write, value: T) -> io::Result<()> {
    // Only NaN is not equal to itself.
    #[allow(clippy::eq_op, reason = "the test for NaN of all scalar types")]
    if value == value { write!(out, "{value}") } else { out.write_all(b"nan") }
}

/// An opaque colour as 0xffrrggbb.
fn packed([red, green, blue]: [u8; 3]) -> u32 {
    u32::from_be_bytes([0xff, red, green, blue])
}
