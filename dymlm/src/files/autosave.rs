use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use dymlm_io::Error;

use super::MapSaver;
use crate::{MapReader, Revision};

/// Saves the maps that a builder publishes at regular intervals, on a thread of its own: the builder does not
/// wait.
///
/// ```
/// # let parent = tempfile::tempdir()?;
/// # let folder = parent.path().join("map");
/// use std::time::Duration;
/// use dymlm::files::{Autosave, MapSaver};
/// use dymlm::{MapBuilder, MapConfig};
///
/// let mut builder = MapBuilder::new(MapConfig::default())?;
/// let saver = MapSaver::create(&folder)?;
/// let autosave = Autosave::start(builder.reader(), saver, Duration::from_secs(10))?;
/// // Frames are inserted here.
/// builder.settle();
/// autosave.finish()?;
/// assert!(folder.join("manifest.json").exists());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Autosave {
    /// Ends the thread when it is dropped.
    stop: Option<Sender<Finish>>,
    thread: Option<JoinHandle<Result<MapSaver, Error>>>,
    failure: Failure,
}

/// Why the last save has failed, if it has.
type Failure = Arc<Mutex<Option<Arc<Error>>>>;

impl Autosave {
    /// Starts saving. Every `interval` it saves the maps published last, if they are newer than those that were
    /// saved last. The maps at the beginning count as saved where the saver has saved or loaded maps that are
    /// not older, and where nothing has changed since they were loaded, from whatever folder. A save that fails
    /// is tried again after the next interval; [`failure`](Self::failure) tells of it meanwhile.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] when the system gives no thread.
    pub fn start(reader: MapReader, saver: MapSaver, interval: Duration) -> Result<Self, Error> {
        let path = saver.folder().to_path_buf();
        let (stop, stopped) = channel();
        // Maps that have never changed, or not since they were loaded, are saved by `finish` alone: those of a
        // builder that came to nothing must not replace others.
        let latest = reader.latest();
        let saved =
            saver.saved_revision(&latest).unwrap_or_default().max(latest.past.loaded).min(latest.revision());
        drop(latest);
        let failure = Failure::default();
        let last_failure = Arc::clone(&failure);
        let run = move || {
            let mut autosaver = Autosaver { saver, reader, saved };
            loop {
                let signal = stopped.recv_timeout(interval);
                let result = autosaver.save_newer(signal == Ok(Finish));
                if signal != Err(RecvTimeoutError::Timeout) {
                    return result.map(|()| autosaver.saver);
                }
                *last_failure.lock().unwrap_or_else(PoisonError::into_inner) = result.err().map(Arc::new);
            }
        };
        let thread = std::thread::Builder::new().name("dymlm-autosave".into()).spawn(run);
        let thread = thread.map_err(|source| Error::Io { path, source })?;
        Ok(Self { stop: Some(stop), thread: Some(thread), failure })
    }

    /// Why the last save has failed, on a full disk, say: the folder has the maps of the save before. `None` after
    /// one that has succeeded. Never waits for a save.
    pub fn failure(&self) -> Option<Arc<Error>> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Saves the maps that were published last, also those of a builder that was given no frame if the saver has
    /// not saved them yet, ends the thread, and gives back the saver, which still has the folder.
    ///
    /// # Errors
    ///
    /// Those of the last save.
    pub fn finish(mut self) -> Result<MapSaver, Error> {
        if let Some(stop) = self.stop.take() {
            // A thread that no longer listens is joined all the same.
            stop.send(Finish).ok();
        }
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(result)) => result,
            // Only if the thread had panicked, which its code does not.
            _ => Err(Error::Io { path: "autosave".into(), source: std::io::ErrorKind::Other.into() }),
        }
    }
}

impl Drop for Autosave {
    /// Saves the maps that were published last, if they have changed since they were made or loaded, and waits
    /// until that is done.
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            // `drop` cannot report an error.
            thread.join().ok();
        }
    }
}

/// Tells the thread that the maps are complete.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Finish;

struct Autosaver {
    saver: MapSaver,
    reader: MapReader,
    /// Revision of the maps that were saved last, or that count as saved.
    saved: Revision,
}

impl Autosaver {
    /// Saves the maps published last if they are newer; if it `is_last`, also where they only count as saved.
    fn save_newer(&mut self, is_last: bool) -> Result<(), Error> {
        let map = self.reader.latest();
        let is_unsaved = self.saver.saved_revision(&map).is_none_or(|saved| saved < map.revision());
        if map.revision() > self.saved || is_last && is_unsaved {
            self.saver.save(&map)?;
            self.saved = map.revision();
        }
        Ok(())
    }
}
