use std::path::Path;

use dymlm_cloud::Selection;
use dymlm_io::{Error, encode_glb, write_atomically};

use super::{object_records, plane_records};
use crate::MultiLevelMap;

impl MultiLevelMap {
    /// Writes the static cloud, the planes and the objects as one glTF 2.0 file (`.glb`), atomically, turned
    /// so that `up` (any length) is where glTF has it: see [`encode_glb`].
    ///
    /// # Errors
    ///
    /// As [`write_atomically`].
    ///
    /// ```
    /// # let folder = tempfile::tempdir()?;
    /// # let path = folder.path().join("map.glb");
    /// use dymlm::{MapBuilder, MapConfig};
    ///
    /// let builder = MapBuilder::new(MapConfig::default())?;
    /// // Frames are inserted here.
    /// builder.map().write_glb(&path, builder.map().up().unwrap_or([0.0, 0.0, 1.0]))?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn write_glb(&self, path: impl AsRef<Path>, up: [f64; 3]) -> Result<(), Error> {
        let cloud = self.cloud().point_cloud(Selection::Static);
        let (planes, objects) = (plane_records(self.planes()), object_records(self.objects()));
        write_atomically(path, |out| encode_glb(out, &cloud, &planes, &objects, up))
    }
}
