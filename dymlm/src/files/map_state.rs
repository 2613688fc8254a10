use std::sync::Arc;

use dymlm_cloud::{CloudLoader, CloudMap};
use dymlm_core::{DamagedState, FrameId, Pages, StateSink, decode_part, encode_part};
use dymlm_history::{History, HistoryConfig};
use dymlm_io::{DamagedPart, MapFolder, StateWriter};
use dymlm_objects::ObjectMapper;
use dymlm_octree::Octree;
use dymlm_planes::PlaneMap;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::LoadOptions;
use super::saved_state::SavedState;
use crate::ghost_removal::GhostRemoval;
use crate::logged_sessions::Session;
use crate::map_pager::MapPager;
use crate::session_log::{Event, InsertedFrame, SessionLog};
use crate::{Error, MapConfig, MultiLevelMap, Revision};

/// Sections of a saved state.
const HEAD: &str = "head";
const CLOUD: &str = "cloud";
const OCTREE: &str = "octree";
const PLANES: &str = "planes";
const OBJECTS: &str = "objects";
const HISTORY: &str = "history";
const FRAMES: &str = "frames";
const EVENTS: &str = "events";

/// The small parts of the state, which change with each frame.
#[derive(Serialize, Deserialize)]
struct Head {
    /// As a config file: a field that later versions add has its default.
    config: String,
    ghost_removal: GhostRemoval,
    revision: Revision,
    frames_given: u64,
    newest: f64,
    differs_from_log: bool,
    log: Option<LogHead>,
}

/// The small parts of the log.
#[derive(Serialize, Deserialize)]
struct LogHead {
    frames: usize,
    events: usize,
    sessions: Vec<Session>,
}

type Parts = Vec<(u64, Vec<u8>)>;

/// A map of a folder that could not be read: an empty one is in its place.
#[derive(Debug)]
#[non_exhaustive]
pub struct MissingMap {
    /// `"cloud"`, `"octree"`, `"planes"`, `"objects"`, or `"history"`: then poses cannot be corrected.
    pub section: &'static str,
    /// Why.
    pub error: Error,
}

impl MultiLevelMap {
    /// Writes the parts of the state that have changed since an earlier one; all parts without an earlier
    /// one.
    pub(super) fn write_state(
        &self,
        earlier: Option<&SavedState>,
        state: &mut StateWriter,
    ) -> Result<(), dymlm_io::Error> {
        state.packed_section(CLOUD, |sink| self.cloud.save_state(earlier.map(|map| &map.cloud), sink))?;
        state.section(OCTREE, |sink| self.octree.save_state(earlier.map(|map| &map.octree), sink))?;
        state.section(PLANES, |sink| self.planes.save_state(earlier.map(|map| &map.planes), sink))?;
        state.section(OBJECTS, |sink| self.objects.save_state(earlier.map(|map| &map.objects), sink))?;
        if let Some(log) = &self.past.log {
            let earlier = earlier.and_then(|map| map.log.as_ref());
            state.section(HISTORY, |sink| log.history.save_state(earlier.map(|log| &log.history), sink))?;
            state.section(FRAMES, |sink| save_pages(&log.frames, earlier.map(|log| &log.frames), sink))?;
            state.section(EVENTS, |sink| save_pages(&log.events, earlier.map(|log| &log.events), sink))?;
        }
        state.section(HEAD, |sink| sink(0, Some(&encode_part(&self.head()?)?)))
    }

    fn head(&self) -> std::io::Result<Head> {
        Ok(Head {
            config: toml::to_string(&*self.config).map_err(std::io::Error::other)?,
            ghost_removal: self.ghost_removal.clone(),
            revision: self.revision,
            frames_given: self.past.frames,
            newest: self.past.newest,
            differs_from_log: self.past.differs_from_log,
            log: self.past.log.as_ref().map(|log| LogHead {
                frames: log.frames.len(),
                events: log.events.len(),
                sessions: log.sessions.clone(),
            }),
        })
    }

    /// Reads the maps of a folder, and names those that could not be read.
    pub(super) fn read_state(
        folder: &MapFolder,
        options: &LoadOptions,
    ) -> Result<(Self, Vec<MissingMap>), Error> {
        let (_, head) = parts(folder, HEAD)?.pop().ok_or_else(|| DamagedState::new(0, "it is missing"))?;
        let head: Head = decode_part(0, &head)?;
        head.check()?;
        let mut config =
            MapConfig::from_toml(&head.config).map_err(|error| Error::SavedConfig(error.to_string()))?;
        config.validate()?;
        if let Some(history) = options.history.as_ref().filter(|_| head.log.is_some()) {
            config.history.clone_from(history);
        }
        if let Some(memory) = &options.memory {
            config.memory.clone_from(memory);
        }
        let config = Arc::new(config);
        let mut map = Self::new(&config)?;
        (map.ghost_removal, map.revision) = (head.ghost_removal, head.revision);
        (map.past.frames, map.past.newest) = (head.frames_given, head.newest);
        (map.past.differs_from_log, map.past.loaded) = (head.differs_from_log, head.revision);

        let (sensor, mut missing) = (config.sensor, Vec::new());
        let mut read = |section, result: Result<(), Error>| {
            missing.extend(result.err().map(|error| MissingMap { section, error }));
        };
        let MultiLevelMap { octree, planes, objects, past, .. } = &mut map;
        read(
            OCTREE,
            replace(octree, || {
                with_parts(folder, OCTREE, |parts| Ok(Octree::load_state(config.octree.clone(), parts)?))
            }),
        );
        read(
            PLANES,
            replace(planes, || {
                with_parts(folder, PLANES, |parts| {
                    Ok(PlaneMap::load_state(config.planes.map.clone(), sensor, parts)?)
                })
            }),
        );
        read(
            OBJECTS,
            replace(objects, || {
                with_parts(folder, OBJECTS, |parts| {
                    Ok(ObjectMapper::load_state(config.objects.clone(), sensor, parts)?)
                })
            }),
        );
        if let Some(log) = head.log {
            read(HISTORY, replace(&mut past.log, || read_log(folder, &config.history, log)));
        }
        // The cloud comes last: it has what the other maps leave of the memory budget.
        read(CLOUD, read_cloud(folder, &map).map(|cloud| map.cloud = cloud));
        if missing.iter().any(|missing| missing.section == CLOUD) {
            // The other maps have been compared with evidence that is lost; that of the new cloud counts from 0.
            map.ghost_removal = GhostRemoval::default();
        }
        map.past.differs_from_log |= !missing.is_empty();
        Ok((map, missing))
    }
}

impl Head {
    /// Refuses counts from which no mapping can go on; a damaged file may hold them.
    fn check(&self) -> Result<(), DamagedState> {
        const MOST: u64 = 1 << 62;
        let frames = self.log.as_ref().map_or(self.frames_given, |log| log.frames as u64);
        if self.frames_given > MOST || self.revision.get() > MOST || frames != self.frames_given {
            return Err(DamagedState::new(0, "impossible counts"));
        }
        // Minus infinity before the first frame.
        if self.newest.is_nan() || self.newest == f64::INFINITY {
            return Err(DamagedState::new(0, "a time that is none"));
        }
        Ok(())
    }
}

/// Reads the cloud. What has no room within the memory budget goes to a file, part by part.
fn read_cloud(folder: &MapFolder, map: &MultiLevelMap) -> Result<CloudMap, Error> {
    let mut loader = CloudLoader::new(map.config.cloud.clone(), map.config.sensor)?;
    // A folder for that file that is not there, on the machine where somebody looks at the map, is an error only when
    // the mapping goes on.
    let mut pager = MapPager::new(&map.config.memory, || 0).ok();
    if let Some(pager) = &pager {
        pager.page_out_planes(&map.planes)?;
    }
    let others = map.memory().total();
    for part in folder.state(CLOUD)? {
        let (part, bytes) = part.map_err(dymlm_io::Error::from)?;
        loader.load(part, &bytes)?;
        if let Some(pager) = &mut pager {
            pager.page_out_loaded(&mut loader, others)?;
        }
    }
    Ok(loader.finish()?)
}

/// Replaces a value by what is read; on an error the value stays.
fn replace<T>(place: &mut T, read: impl FnOnce() -> Result<T, Error>) -> Result<(), Error> {
    *place = read()?;
    Ok(())
}

/// Passes the parts of a section to `read` one by one, so that only those are in memory which it keeps. A
/// damaged part is an error, whatever `read` has made of the parts before it.
fn with_parts<T>(
    folder: &MapFolder,
    section: &str,
    read: impl FnOnce(&mut dyn Iterator<Item = (u64, Vec<u8>)>) -> Result<T, Error>,
) -> Result<T, Error> {
    let mut damaged = None;
    let result =
        read(&mut folder.state(section)?.map_while(|part| part.map_err(|error| damaged = Some(error)).ok()));
    match damaged {
        Some(error) => Err(dymlm_io::Error::from(error).into()),
        None => result,
    }
}

/// All parts of a section.
fn parts(folder: &MapFolder, section: &str) -> Result<Parts, Error> {
    let parts: Result<Parts, DamagedPart> = folder.state(section)?.collect();
    Ok(parts.map_err(dymlm_io::Error::from)?)
}

fn read_log(folder: &MapFolder, history: &HistoryConfig, head: LogHead) -> Result<Option<SessionLog>, Error> {
    let history = with_parts(folder, HISTORY, |parts| Ok(History::load_state(history, parts)?))?;
    let Some(history) = history else { return Ok(None) };
    let frames: Pages<InsertedFrame> = read_pages(parts(folder, FRAMES)?, head.frames)?;
    let events: Pages<Event> = read_pages(parts(folder, EVENTS)?, head.events)?;
    let is_known = |frame: FrameId| frame.get() < frames.len() as u64;
    if let Some(place) = events.iter().position(|event| event.frame().is_some_and(|frame| !is_known(frame))) {
        return Err(DamagedState::new(page_of(place), "an event of an unknown frame").into());
    }
    if let Some(place) = frames.iter().position(|frame| !frame.map_time().is_finite()) {
        return Err(DamagedState::new(page_of(place), "a frame whose time is not finite").into());
    }
    let follow = head.sessions.is_sorted_by(|one, next| one.first < next.first && one.start <= next.start);
    let first = head.sessions.first().map(|session| session.first.get());
    if !follow || first.unwrap_or(0) != 0 || head.sessions.iter().any(|session| !is_known(session.first)) {
        return Err(DamagedState::new(0, "sessions that do not follow each other").into());
    }
    Ok(Some(SessionLog { history, sessions: head.sessions, frames, events }))
}

/// Passes to `sink` the pages that differ from those of an earlier list.
fn save_pages<T: Serialize>(
    pages: &Pages<T>,
    earlier: Option<&Pages<T>>,
    sink: &mut StateSink<'_>,
) -> std::io::Result<()> {
    let (none, earlier) = (Pages::default(), earlier);
    let earlier = earlier.unwrap_or(&none);
    for (page, items) in pages.unshared_pages(earlier) {
        sink(page as u64, Some(&encode_part(items)?))?;
    }
    for page in pages.pages().count()..earlier.pages().count() {
        sink(page as u64, None)?;
    }
    Ok(())
}

/// The list that these pages make up, which must have `len` items.
fn read_pages<T: DeserializeOwned>(parts: Parts, len: usize) -> Result<Pages<T>, DamagedState> {
    let mut pages = Pages::default();
    for ((part, bytes), page) in parts.into_iter().zip(0..) {
        let items: Vec<T> = decode_part(part, &bytes)?;
        if part != page {
            return Err(DamagedState::new(page, "it is missing"));
        }
        for item in items {
            pages.push(item);
        }
    }
    if pages.len() == len {
        Ok(pages)
    } else {
        Err(DamagedState::new(page_of(len), format!("{} items instead of {len}", pages.len())))
    }
}

/// The page that holds an item.
fn page_of(place: usize) -> u64 {
    (place / Pages::<()>::PAGE) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MapBuilder;
    use crate::random_session::{Session, Step};

    #[test]
    fn maps_whose_cloud_is_lost_are_compared_with_the_evidence_of_the_next_one() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("map");
        let steps = vec![Step::Frame { is_detector_run: true }; 3];
        let builder = Session::run(&steps).builder;
        builder.map().save(&folder).unwrap();
        let segment = folder.join("state-000001.bin");
        let mut bytes = std::fs::read(&segment).unwrap();
        bytes[10] ^= 0x10;
        std::fs::write(&segment, bytes).unwrap();
        let (map, missing) = MultiLevelMap::load_partial(&folder).unwrap();
        assert_eq!(missing.iter().map(|missing| missing.section).collect::<Vec<_>>(), [CLOUD]);
        assert!(map.is_settled());
    }

    #[test]
    fn a_head_from_which_no_mapping_can_go_on_is_refused() {
        let config = MapConfig { history: HistoryConfig::Memory, ..MapConfig::default() };
        let builder = MapBuilder::new(config).unwrap();
        let with = |change: fn(&mut Head)| {
            let mut head = builder.map().head().unwrap();
            change(&mut head);
            head.check().is_ok()
        };
        assert!(with(|_| ()));
        assert!(!with(|head| head.newest = f64::NAN));
        assert!(!with(|head| head.newest = f64::INFINITY));
        assert!(!with(|head| head.revision = Revision(u64::MAX)));
        assert!(!with(|head| head.frames_given = 1), "the log has none");
        assert!(!with(|head| (head.frames_given, head.log) = (u64::MAX, None)));
    }
}
