use std::io::{self, Write};
use std::path::Path;

use dymlm_core::{Point, PointCloud, Rgb};

use crate::{Error, write_atomically};

/// Writes a point cloud atomically as binary little-endian PLY: float x y z, and uchar red green blue when
/// the cloud has colours.
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
    let mut ply = PlyEncoder::new(out, cloud.len(), cloud.colors().is_some())?;
    ply.put(cloud.points(), cloud.colors().unwrap_or_default())?;
    ply.finish()
}

/// Writes a point cloud as PLY to a stream, some points at a time: a cloud need not be in memory as a whole.
///
/// ```
/// use dymlm_core::PointCloud;
/// use dymlm_io::{PlyEncoder, decode_ply};
///
/// let mut bytes = Vec::new();
/// let mut ply = PlyEncoder::new(&mut bytes, 3, true)?;
/// ply.put(&[[0.0, 1.0, 2.5]], &[[255, 128, 0]])?;
/// ply.put(&[[0.5, 0.0, 2.0], [1.0, 0.0, 2.0]], &[])?;
/// ply.finish()?;
/// let cloud = decode_ply(&bytes, "cloud.ply")?;
/// assert_eq!((cloud.len(), cloud.colors().and_then(|colors| colors.last())), (3, Some(&[0; 3])));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct PlyEncoder<'a> {
    out: &'a mut dyn Write,
    /// Points that are still to come.
    left: usize,
    are_colored: bool,
    /// Bytes that have not gone to the stream yet.
    rows: Vec<u8>,
}

/// Bytes that go to the stream at a time.
const CHUNK: usize = 1 << 16;

impl<'a> PlyEncoder<'a> {
    /// Begins a cloud of so many points.
    ///
    /// # Errors
    ///
    /// Those of the stream.
    pub fn new(out: &'a mut dyn Write, points: usize, are_colored: bool) -> io::Result<Self> {
        let mut rows = Vec::with_capacity(CHUNK);
        writeln!(rows, "ply\nformat binary_little_endian 1.0\nelement vertex {points}")?;
        for axis in ["x", "y", "z"] {
            writeln!(rows, "property float {axis}")?;
        }
        if are_colored {
            for channel in ["red", "green", "blue"] {
                writeln!(rows, "property uchar {channel}")?;
            }
        }
        writeln!(rows, "end_header")?;
        Ok(Self { out, left: points, are_colored, rows })
    }

    /// The next points, and the colours of the first of them; those without are black.
    ///
    /// # Errors
    ///
    /// Those of the stream; [`io::ErrorKind::InvalidInput`] for more points than were announced.
    pub fn put(&mut self, points: &[Point], colors: &[Rgb]) -> io::Result<()> {
        self.left =
            self.left.checked_sub(points.len()).ok_or_else(|| invalid("more points than announced"))?;
        let mut colors = colors.iter();
        for point in points {
            self.rows.extend_from_slice(point.map(f32::to_le_bytes).as_flattened());
            if self.are_colored {
                self.rows.extend_from_slice(colors.next().unwrap_or(&[0; 3]));
            }
            if self.rows.len() > CHUNK - ROW {
                self.flush()?;
            }
        }
        Ok(())
    }

    /// Ends the cloud.
    ///
    /// # Errors
    ///
    /// Those of the stream; [`io::ErrorKind::InvalidInput`] for fewer points than were announced.
    pub fn finish(mut self) -> io::Result<()> {
        if self.left > 0 {
            return Err(invalid("fewer points than announced"));
        }
        self.flush()
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.write_all(&self.rows)?;
        self.rows.clear();
        Ok(())
    }
}

/// The most bytes of a point.
const ROW: usize = size_of::<Point>() + size_of::<Rgb>();

fn invalid(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, what)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_number_of_points_than_announced_is_an_error() {
        let encode = |announced: usize, puts: &[usize]| {
            let mut bytes = Vec::new();
            let mut ply = PlyEncoder::new(&mut bytes, announced, false)?;
            puts.iter().try_for_each(|&points| ply.put(&vec![[0.0; 3]; points], &[]))?;
            ply.finish()
        };
        assert!(encode(0, &[]).is_ok() && encode(5, &[2, 0, 3]).is_ok());
        for (announced, puts) in [(5, [2, 2]), (5, [3, 3]), (1, [0, 0])] {
            assert_eq!(encode(announced, &puts).unwrap_err().kind(), io::ErrorKind::InvalidInput);
        }
    }

    #[test]
    fn points_put_in_pieces_are_those_put_at_once() {
        let points: Vec<Point> = (0..30_000_u16).map(|index| [index.into(), 0.5, -2.0]).collect();
        let colors: Vec<Rgb> = (0..30_000_u16).map(|index| [index as u8, 7, (index >> 8) as u8]).collect();
        let (mut whole, mut pieces) = (Vec::new(), Vec::new());
        let cloud = PointCloud::with_colors(points.clone(), colors.clone()).unwrap();
        encode_ply(&mut whole, &cloud).unwrap();
        let mut ply = PlyEncoder::new(&mut pieces, points.len(), true).unwrap();
        for (points, colors) in points.chunks(777).zip(colors.chunks(777)) {
            ply.put(points, colors).unwrap();
        }
        ply.finish().unwrap();
        assert_eq!(whole, pieces);
        assert_eq!(crate::decode_ply(&whole, "cloud").unwrap(), cloud);
    }
}
