use std::path::Path;

use dymlm_cloud::Selection;
use dymlm_io::{MapFolderWriter, encode_objects, encode_planes, encode_ply};

use super::{object_records, plane_cloud, plane_records};
use crate::{MapConfig, MultiLevelMap};

impl MultiLevelMap {
    /// Writes the standard files of a map into a folder that is being made: `cloud.ply` (the static cloud),
    /// `octree.bt`, `octree.ot`, `planes.json`, `planes.ply` (inliers, a colour a plane) and `objects.json`.
    ///
    /// # Errors
    ///
    /// [`dymlm_io::Error`] when a file cannot be written.
    pub fn write_files(&self, folder: &mut MapFolderWriter) -> Result<(), dymlm_io::Error> {
        folder.file("cloud.ply", |out| encode_ply(out, &self.cloud().point_cloud(Selection::Static)))?;
        folder.file("octree.bt", |out| self.octree().write_bt(out))?;
        folder.file("octree.ot", |out| self.octree().write_ot(out))?;
        folder.file("planes.json", |out| encode_planes(out, &plane_records(self.planes())))?;
        folder.file("objects.json", |out| encode_objects(out, &object_records(self.objects())))?;
        folder.file("planes.ply", |out| encode_ply(out, &plane_cloud(self.planes())))
    }

    /// Writes a map folder: [`write_files`](Self::write_files) and a manifest with the config and the counts.
    /// A crash leaves the older map or the new one, never half of it. Other programs read the files; a
    /// builder does not go on from them.
    ///
    /// # Errors
    ///
    /// [`dymlm_io::Error`] when the folder is something else than a map, or a file cannot be written.
    ///
    /// ```
    /// # let parent = tempfile::tempdir()?;
    /// # let folder = parent.path().join("map");
    /// use dymlm::{MapBuilder, MapConfig};
    ///
    /// let builder = MapBuilder::new(MapConfig::default())?;
    /// // Frames are inserted here.
    /// builder.map().export(&folder, builder.config())?;
    /// assert!(folder.join("cloud.ply").exists() && folder.join("manifest.json").exists());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn export(&self, folder: &Path, config: &MapConfig) -> Result<(), dymlm_io::Error> {
        let mut writer = MapFolderWriter::create(folder)?;
        self.write_files(&mut writer)?;
        writer.finish(config, &self.counts())
    }
}
