use crate::{MapBuilder, MultiLevelMap};

/// Approximate bytes of memory that each map and the history take: with what queries and output cache,
/// without the builder's buffers and what is [paged out](crate::MemoryConfig).
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
    /// What is kept of key frames and scans.
    pub history: usize,
    /// Earlier states of the maps, from which a correction begins: a builder has them, a map has none.
    pub snapshots: usize,
}

impl MapMemory {
    /// Bytes of all these together.
    pub fn total(&self) -> usize {
        self.cloud + self.octree + self.planes + self.objects + self.history + self.snapshots
    }
}

impl MultiLevelMap {
    /// How much memory each map takes, and what is kept for corrections. O(blocks + key frames).
    pub fn memory(&self) -> MapMemory {
        MapMemory {
            cloud: self.cloud().memory_bytes(),
            octree: self.octree().memory_bytes(),
            planes: self.planes().memory_bytes(),
            objects: self.objects().memory_bytes(),
            history: self.past.log.as_ref().map_or(0, |log| log.history.memory_bytes()),
            snapshots: 0,
        }
    }
}

impl MapBuilder {
    /// How much memory each map takes, and what is kept for corrections. O(blocks + key frames).
    pub fn memory(&self) -> MapMemory {
        MapMemory { snapshots: self.snapshots.memory_bytes(&self.map), ..self.map.memory() }
    }
}
