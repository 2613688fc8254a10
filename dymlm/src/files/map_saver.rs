use std::path::Path;
use std::sync::Arc;

use dymlm_history::HistoryConfig;
use dymlm_io::{Error, MapFolderSaver, MapFolderWriter, PlaneRecord};
use serde::{Serialize, Serializer};

use super::planes::renewed_records;
use super::saved_state::SavedState;
use super::{LoadOptions, plane_records};
use crate::{MultiLevelMap, Revision};

/// Saves maps into one folder again and again; of the state it writes only what has changed since the last
/// time.
///
/// It holds clones of the octree, the planes, the objects and the log that it saved last, which share with the
/// maps what has not changed since, and for each block of the cloud a few hundred bytes. As long as the saver
/// lives, nobody else can write the folder.
///
/// ```
/// # let parent = tempfile::tempdir()?;
/// # let folder = parent.path().join("map");
/// use dymlm::files::MapSaver;
/// use dymlm::{MapBuilder, MapConfig, MultiLevelMap};
///
/// let mut saver = MapSaver::create(&folder)?;
/// let builder = MapBuilder::new(MapConfig::default())?;
/// // Frames are inserted here; every now and then:
/// saver.save(builder.map())?;
///
/// let resumed = MapBuilder::resume(MultiLevelMap::load(&folder)?)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct MapSaver {
    folder: MapFolderSaver,
    saved: Option<SavedState>,
    /// Of the planes that were saved last. Their outlines take long to trace, and most stay as they are.
    planes: Vec<PlaneRecord>,
}

impl MapSaver {
    /// A saver whose first save replaces what the folder holds.
    ///
    /// # Errors
    ///
    /// [`Error::Locked`] when somebody else writes the folder; [`Error::InTheWay`] when something stands
    /// there that is neither a map nor empty; [`Error::Io`].
    pub fn create(folder: impl AsRef<Path>) -> Result<Self, Error> {
        Ok(Self { folder: MapFolderSaver::create(folder)?, saved: None, planes: Vec::new() })
    }

    /// Loads maps as [`MultiLevelMap::load`] does, and goes on saving them in that folder: the first save
    /// writes what has changed since they were saved.
    ///
    /// # Errors
    ///
    /// Those of [`MultiLevelMap::load`] and of [`create`](Self::create).
    ///
    /// ```
    /// # let parent = tempfile::tempdir()?;
    /// # let folder = parent.path().join("map");
    /// use dymlm::files::{LoadOptions, MapSaver};
    /// use dymlm::{MapBuilder, MapConfig};
    ///
    /// # MapBuilder::new(MapConfig::default())?.map().save(&folder)?;
    /// let (mut saver, map) = MapSaver::load(&folder, &LoadOptions::default())?;
    /// let builder = MapBuilder::resume(map)?;
    /// // Frames are inserted here.
    /// saver.save(builder.map())?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn load(
        folder: impl AsRef<Path>,
        options: &LoadOptions,
    ) -> Result<(Self, MultiLevelMap), crate::Error> {
        let (saver, folder) = MapFolderSaver::open(folder)?;
        // A history that is no longer kept goes with the first save, which writes all anew.
        let goes_on = options.history != Some(HistoryConfig::None);
        let map = MultiLevelMap::read_whole_state(&folder, options)?;
        Ok((Self { folder: saver, saved: goes_on.then(|| SavedState::of(&map)), planes: Vec::new() }, map))
    }

    /// The map's folder.
    pub fn folder(&self) -> &Path {
        self.folder.folder()
    }

    /// The revision at which a builder's maps were saved or loaded last, if those were the last: revisions of
    /// different builders say nothing of each other.
    pub(super) fn saved_revision(&self, map: &MultiLevelMap) -> Option<Revision> {
        let of_builder = self.saved.as_ref().filter(|saved| Arc::ptr_eq(&saved.config, &map.config));
        of_builder.map(|saved| saved.revision)
    }

    /// Saves maps: the standard files (see [`MultiLevelMap::write_files`]), and the parts of the state that
    /// have changed. A crash leaves either the maps that were saved before or these, never half of them.
    /// Where somebody has removed or replaced the folder, all is written again.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] and [`Error::Content`] when a file cannot be written, or when parts of the maps that had
    /// no room in memory cannot be read back. What was saved before is still there.
    pub fn save(&mut self, map: &MultiLevelMap) -> Result<(), Error> {
        self.save_with(map, |_| Ok(()))
    }

    /// [`save`](Self::save) that writes files of the caller's beside those of the maps.
    ///
    /// # Errors
    ///
    /// Those of [`save`](Self::save) and of `write`.
    pub fn save_with(
        &mut self,
        map: &MultiLevelMap,
        write: impl FnOnce(&mut MapFolderWriter) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let Self { folder, saved, planes } = self;
        // Maps of another config share nothing with those that were saved last, and a log that comes or goes
        // leaves nothing of the one before.
        let is_other = |saved: &SavedState| {
            *saved.config != *map.config || saved.log.is_some() != map.past.log.is_some()
        };
        if saved.as_ref().is_some_and(is_other) || !folder.is_as_left() {
            *saved = None;
        }
        if saved.is_none() {
            folder.forget();
        }
        let (earlier, before) = (saved.as_ref(), std::mem::take(planes));
        let records = || match earlier {
            Some(earlier) => renewed_records(map.planes(), &earlier.planes, before),
            None => plane_records(map.planes()),
        };
        let mut written = Vec::new();
        folder.save(map.config(), &CountsOf(map), |folder, state| {
            let (state, files) = crate::parallel::join(
                || map.write_state(earlier, state),
                || {
                    written = records();
                    map.write_files_with(folder, &written)
                },
            );
            state.and(files)?;
            check_whole(map)?;
            write(folder)
        })?;
        (*saved, *planes) = (Some(SavedState::of(map)), written);
        Ok(())
    }
}

/// Refuses maps of which blocks could not be read back from their page file: what was saved before has them.
fn check_whole(map: &MultiLevelMap) -> Result<(), Error> {
    let failure = map.cloud.page_file().and_then(|file| file.failure());
    let path = map.config.memory.path.clone().unwrap_or_else(std::env::temp_dir);
    failure.map_or(Ok(()), |source| Err(Error::Io { path, source }))
}

/// What is in maps, counted when it is written, which is last: counting needs the static cloud, which is worked out
/// beside the state where a thread is free (feature `parallel`).
struct CountsOf<'a>(&'a MultiLevelMap);

impl Serialize for CountsOf<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.counts().serialize(serializer)
    }
}
