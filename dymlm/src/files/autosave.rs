use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
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
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<Result<MapSaver, Error>>>,
}

impl Autosave {
    /// Starts saving. Every `interval` it saves the maps published last, if they are newer than those at the
    /// beginning or saved last. A save that fails is tried again after the next interval.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] when the system gives no thread.
    pub fn start(reader: MapReader, saver: MapSaver, interval: Duration) -> Result<Self, Error> {
        let path = saver.folder().to_path_buf();
        let (stop, stopped) = channel();
        let saved = reader.latest().revision();
        let run = move || {
            let mut autosaver = Autosaver { saver, reader, saved };
            loop {
                let ends = stopped.recv_timeout(interval) != Err(RecvTimeoutError::Timeout);
                let result = autosaver.save_newer();
                if ends {
                    return result.map(|()| autosaver.saver);
                }
            }
        };
        let thread = std::thread::Builder::new().name("dymlm-autosave".into()).spawn(run);
        let thread = thread.map_err(|source| Error::Io { path, source })?;
        Ok(Self { stop: Some(stop), thread: Some(thread) })
    }

    /// Saves the maps that were published last, ends the thread, and gives back the saver, which still has
    /// the folder.
    ///
    /// # Errors
    ///
    /// Those of the last save.
    pub fn finish(mut self) -> Result<MapSaver, Error> {
        self.stop = None;
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(result)) => result,
            // Only if the thread had panicked, which its code does not.
            _ => Err(Error::Io { path: "autosave".into(), source: std::io::ErrorKind::Other.into() }),
        }
    }
}

impl Drop for Autosave {
    /// Saves the maps that were published last, and waits until that is done.
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            // `drop` cannot report an error.
            thread.join().ok();
        }
    }
}

struct Autosaver {
    saver: MapSaver,
    reader: MapReader,
    /// Revision of the maps that were saved last, or that were there at the beginning.
    saved: Revision,
}

impl Autosaver {
    fn save_newer(&mut self) -> Result<(), Error> {
        let map = self.reader.latest();
        if map.revision() > self.saved {
            self.saver.save(&map)?;
            self.saved = map.revision();
        }
        Ok(())
    }
}
