use std::io::{self, BufWriter, Write};
use std::path::Path;

use dymlm_core::PointCloud;

use crate::{Error, write_atomically};

/// Writes a point cloud atomically as binary PCD of version 0.7: `x y z`, and the colours as `rgba` (an
/// unsigned integer, opaque) when the cloud has any.
///
/// # Errors
///
/// As [`write_atomically`].
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("cloud.pcd");
/// use dymlm_core::PointCloud;
///
/// let cloud = PointCloud::with_colors(vec![[0.0, 1.0, 2.5]], vec![[255, 128, 0]])?;
/// dymlm_io::write_pcd(&path, &cloud)?;
/// assert_eq!(dymlm_io::read_pcd(&path)?.cloud, cloud);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_pcd(path: impl AsRef<Path>, cloud: &PointCloud) -> Result<(), Error> {
    write_atomically(path, |out| encode_pcd(out, cloud))
}

/// Writes a PCD file to a stream, as [`write_pcd`] does to a file.
///
/// # Errors
///
/// Those of the stream.
pub fn encode_pcd(out: &mut dyn Write, cloud: &PointCloud) -> io::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 16, out);
    let fields = match cloud.colors() {
        Some(_) => "FIELDS x y z rgba\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1",
        None => "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1",
    };
    let points = cloud.len();
    writeln!(out, "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n{fields}")?;
    writeln!(out, "WIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA binary")?;
    let mut colors = cloud.colors().unwrap_or_default().iter();
    for point in cloud.points() {
        out.write_all(point.map(f32::to_le_bytes).as_flattened())?;
        if let Some(&[red, green, blue]) = colors.next() {
            out.write_all(&[blue, green, red, 0xff])?;
        }
    }
    out.flush()
}
