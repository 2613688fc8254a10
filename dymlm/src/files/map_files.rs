use std::io::{self, Write};
use std::path::Path;

use dymlm_cloud::CloudMap;
use dymlm_io::{
    MapFolder, MapFolderWriter, PlaneRecord, PlyEncoder, encode_objects, encode_planes, encode_ply,
};

use super::{LoadOptions, MapSaver, MissingMap, object_records, plane_cloud, plane_records};
use crate::{Error, MultiLevelMap};

impl MultiLevelMap {
    /// Writes the standard files of a map into a folder that is being made: `cloud.ply` (the static cloud),
    /// `octree.bt`, `octree.ot`, `planes.json`, `planes.ply` (inliers, a colour a plane) and `objects.json`.
    ///
    /// # Errors
    ///
    /// [`dymlm_io::Error`] when a file cannot be written.
    pub fn write_files(&self, folder: &mut MapFolderWriter) -> Result<(), dymlm_io::Error> {
        self.write_files_with(folder, &plane_records(self.planes()))
    }

    /// [`write_files`](Self::write_files), with the records of the planes given.
    pub(super) fn write_files_with(
        &self,
        folder: &mut MapFolderWriter,
        planes: &[PlaneRecord],
    ) -> Result<(), dymlm_io::Error> {
        folder.file("cloud.ply", |out| encode_static_cloud(out, self.cloud()))?;
        folder.file("octree.bt", |out| self.octree().write_bt(out))?;
        folder.file("octree.ot", |out| self.octree().write_ot(out))?;
        folder.file("planes.json", |out| encode_planes(out, planes))?;
        folder.file("objects.json", |out| encode_objects(out, &object_records(self.objects())))?;
        folder.file("planes.ply", |out| encode_ply(out, &plane_cloud(self.planes())))
    }

    /// Saves the maps: the standard files (see [`write_files`](Self::write_files)), and the state that these
    /// cannot hold, from which a builder [goes on](crate::MapBuilder::resume) to the same bits. A crash
    /// leaves the older map or the new one, never half of one. To save repeatedly use a [`MapSaver`], which
    /// writes only what has changed.
    ///
    /// # Errors
    ///
    /// [`dymlm_io::Error`] when the folder holds something else than a map, when somebody else writes it, or
    /// when a file cannot be written.
    ///
    /// ```
    /// # let parent = tempfile::tempdir()?;
    /// # let folder = parent.path().join("map");
    /// use dymlm::{MapBuilder, MapConfig, MultiLevelMap};
    ///
    /// let builder = MapBuilder::new(MapConfig::default())?;
    /// // Frames are inserted here.
    /// builder.map().save(&folder)?;
    /// assert!(folder.join("cloud.ply").exists() && folder.join("manifest.json").exists());
    /// let map = MultiLevelMap::load(&folder)?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn save(&self, folder: impl AsRef<Path>) -> Result<(), dymlm_io::Error> {
        MapSaver::create(folder)?.save(self)
    }

    /// Loads the maps that were [saved](Self::save) in a folder, to the bit. Observations of key frames stay
    /// where they were kept: in memory, or in a folder, which must still be there.
    ///
    /// # Errors
    ///
    /// [`Error::Files`] when the folder holds no map, only the standard files of one, or a map of another
    /// format version; else an error that names what is damaged.
    pub fn load(folder: impl AsRef<Path>) -> Result<Self, Error> {
        Self::load_with(folder, &LoadOptions::default())
    }

    /// [`load`](Self::load), where the observations of key frames are kept in another place, or the maps have
    /// another budget of memory.
    ///
    /// # Errors
    ///
    /// As [`load`](Self::load).
    pub fn load_with(folder: impl AsRef<Path>, options: &LoadOptions) -> Result<Self, Error> {
        let open = || Ok(MapFolder::open(&folder)?);
        MapFolder::read_unreplaced(open, |folder| Self::read_whole_state(folder, options))
    }

    /// Loads what is undamaged of a folder, and names the maps that are damaged: these are empty.
    ///
    /// # Errors
    ///
    /// As [`load`](Self::load), when not even the manifest and the head of the state can be read.
    pub fn load_partial(folder: impl AsRef<Path>) -> Result<(Self, Vec<MissingMap>), Error> {
        let open = || Ok(MapFolder::open_unverified(&folder)?);
        MapFolder::read_unreplaced(open, |folder| Self::read_state(folder, &LoadOptions::default()))
    }

    /// The maps of a folder, when none is missing.
    pub(super) fn read_whole_state(folder: &MapFolder, options: &LoadOptions) -> Result<Self, Error> {
        let (map, missing) = Self::read_state(folder, options)?;
        missing.into_iter().next().map_or(Ok(map), |missing| Err(missing.error))
    }
}

/// Writes the static cloud, block by block: as a whole it would be in memory twice.
fn encode_static_cloud(out: &mut dyn Write, cloud: &CloudMap) -> io::Result<()> {
    let points = cloud.static_points();
    let mut ply = PlyEncoder::new(out, points.len(), points.has_colors())?;
    points.try_for_each_block(|points, colors| ply.put(points, colors))?;
    ply.finish()
}
