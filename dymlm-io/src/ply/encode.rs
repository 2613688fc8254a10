use std::io::{self, BufWriter, Write};
use std::path::Path;

use dymlm_core::PointCloud;

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
    let mut out = BufWriter::with_capacity(1 << 16, out);
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", cloud.len())?;
    for axis in ["x", "y", "z"] {
        writeln!(out, "property float {axis}")?;
    }
    if cloud.colors().is_some() {
        for channel in ["red", "green", "blue"] {
            writeln!(out, "property uchar {channel}")?;
        }
    }
    writeln!(out, "end_header")?;

    let mut colors = cloud.colors().unwrap_or_default().iter();
    for point in cloud.points() {
        out.write_all(point.map(f32::to_le_bytes).as_flattened())?;
        if let Some(color) = colors.next() {
            out.write_all(color)?;
        }
    }
    out.flush()
}
