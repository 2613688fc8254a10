use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::MultiLevelMap;

/// Number of a state of a builder's maps: later states have greater ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
pub struct Revision(pub(crate) u64);

impl Revision {
    /// Its number.
    pub fn get(self) -> u64 {
        self.0
    }
}

/// Reads the maps of a builder on any thread: see [`MapBuilder::reader`](crate::MapBuilder::reader).
///
/// The maps that it gives are complete and do not change while the builder goes on; neither waits for the
/// other. A map that is held shares with the builder's maps whatever has not changed since.
///
/// ```
/// use dymlm::core::{DepthImage, Frame, PinholeCamera, Pose};
/// use dymlm::{MapBuilder, MapConfig, Selection};
///
/// let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5)?;
/// let mut builder = MapBuilder::new(MapConfig::default())?;
/// let reader = builder.reader();
/// let empty = reader.latest().revision();
/// let planner = std::thread::spawn(move || {
///     let map = reader.wait_newer(empty, std::time::Duration::from_secs(10));
///     map.map(|map| map.cloud().point_cloud(Selection::All).len())
/// });
/// let depth = DepthImage::new(64, 48, vec![1.5; 64 * 48])?;
/// builder.insert(&Frame::new(0.0, camera, depth, None)?, &[], &Pose::identity())?;
/// assert!(planner.join().is_ok_and(|points| points > Some(1000)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct MapReader {
    published: Arc<Published>,
}

#[derive(Debug)]
struct Published {
    /// Locked only for the time that it takes to count a reference.
    latest: Mutex<Arc<MultiLevelMap>>,
    newer: Condvar,
}

impl MapReader {
    pub(crate) fn new(map: MultiLevelMap) -> Self {
        Self { published: Arc::new(Published { latest: Mutex::new(Arc::new(map)), newer: Condvar::new() }) }
    }

    /// The maps that were published last.
    pub fn latest(&self) -> Arc<MultiLevelMap> {
        Arc::clone(&self.locked())
    }

    /// Waits for maps that are newer than a revision, and returns those published last; `None` when none came
    /// in time.
    pub fn wait_newer(&self, than: Revision, timeout: Duration) -> Option<Arc<MultiLevelMap>> {
        // `None`: the clock cannot express the end, so the wait has none.
        let end = Instant::now().checked_add(timeout);
        let mut latest = self.locked();
        while latest.revision() <= than {
            let left = end.map_or(Duration::MAX, |end| end.saturating_duration_since(Instant::now()));
            if left.is_zero() {
                return None;
            }
            let woken = self.published.newer.wait_timeout(latest, left.min(Duration::from_secs(3600)));
            latest = woken.unwrap_or_else(PoisonError::into_inner).0;
        }
        Some(Arc::clone(&latest))
    }

    /// Publishes maps as the latest ones.
    pub(crate) fn publish(&self, map: MultiLevelMap) {
        let map = Arc::new(map);
        let before = std::mem::replace(&mut *self.locked(), map);
        self.published.newer.notify_all();
        // Maps that nobody holds any more are freed after the lock.
        drop(before);
    }

    /// Whether there is any other reader of these maps.
    pub(crate) fn is_shared(&self) -> bool {
        Arc::strong_count(&self.published) > 1
    }

    fn locked(&self) -> MutexGuard<'_, Arc<MultiLevelMap>> {
        self.published.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
