use crate::session_log::SessionLog;
use crate::{MapBuilder, MultiLevelMap};

/// Approximate bytes of memory that each map and the history take: with what queries and output cache,
/// without the builder's buffers and what is [paged out](crate::MemoryConfig).
///
/// The allocator adds a tenth to a fifth, and seldom gives back to the system what has become free. That of Linux
/// keeps such memory for each thread: with `MALLOC_ARENA_MAX=1` in the environment, an hour of mapping with
/// corrections and feature `parallel` ended with 165 MB resident instead of 278, no slower.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MapMemory {
    /// The dense cloud with its evidence.
    pub cloud: usize,
    /// The occupancy octree.
    pub octree: usize,
    /// The planes with what their key frames have seen of them.
    pub planes: usize,
    /// The objects.
    pub objects: usize,
    /// What is kept of frames, key frames and scans.
    pub history: usize,
    /// The part of `history` that belongs into a [folder](dymlm_history::HistoryConfig::Folder) but could not
    /// be written, on a full disk, say ([why](MultiLevelMap::history_failure)). It goes there as soon as the
    /// file takes something again.
    #[cfg_attr(feature = "serde", serde(default))]
    pub unfiled_history: usize,
    /// Earlier states of the maps, from which a correction begins, besides what they share with the maps: a
    /// builder has them, a map has none.
    pub snapshots: usize,
    /// The maps that readers see, besides what they share with the builder's.
    #[cfg_attr(feature = "serde", serde(default))]
    pub published: usize,
}

impl MapMemory {
    /// Bytes of all these together.
    pub fn total(&self) -> usize {
        let maps = self.cloud + self.octree + self.planes + self.objects + self.history;
        maps + self.snapshots + self.published
    }
}

impl MultiLevelMap {
    /// How much memory each map takes, and what is kept for corrections. O(blocks + frames).
    pub fn memory(&self) -> MapMemory {
        MapMemory {
            cloud: self.cloud.memory_bytes(),
            octree: self.octree.memory_bytes(),
            planes: self.planes.memory_bytes(),
            objects: self.objects.map().memory_bytes(),
            history: self.past.log.as_ref().map_or(0, SessionLog::memory_bytes),
            unfiled_history: self.past.log.as_ref().map_or(0, |log| log.history.unfiled_bytes()),
            ..MapMemory::default()
        }
    }

    /// Why the file of the [history](crate::MapConfig::history) has refused something last, while such things
    /// stay in memory ([`MapMemory::unfiled_history`]); `None` when all is written.
    pub fn history_failure(&self) -> Option<&std::io::Error> {
        self.past.log.as_ref()?.history.failure()
    }

    /// How much memory each map takes that another state of it does not share, without the history.
    pub(crate) fn memory_beside(&self, other: &Self) -> MapMemory {
        MapMemory {
            cloud: self.cloud.memory_bytes_beside(&other.cloud),
            octree: self.octree.memory_bytes_beside(&other.octree),
            planes: self.planes.memory_bytes_beside(&other.planes),
            objects: self.objects.map().memory_bytes_beside(other.objects.map()),
            ..MapMemory::default()
        }
    }
}

impl MapBuilder {
    /// How much memory each map takes, and what is kept for corrections and for readers. O(blocks + frames).
    pub fn memory(&self) -> MapMemory {
        MapMemory {
            snapshots: self.snapshots.memory_bytes(&self.map),
            published: self.publisher.memory_bytes(&self.map),
            ..self.map.memory()
        }
    }
}
