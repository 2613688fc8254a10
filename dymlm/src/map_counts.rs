use crate::MultiLevelMap;

/// What is in the maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MapCounts {
    /// Points of the static cloud.
    pub cloud_points: usize,
    /// Voxels of the cloud before late removal.
    pub cloud_voxels: usize,
    /// Nodes of the pruned octree.
    pub octree_nodes: usize,
    /// Leaves of the pruned octree.
    pub octree_leaves: usize,
    /// Occupied leaves.
    pub octree_occupied_leaves: usize,
    /// Confirmed planes.
    pub planes: usize,
    /// Confirmed objects.
    pub objects: usize,
}

impl MultiLevelMap {
    /// Counts what is in the maps. Goes through the whole octree.
    pub fn counts(&self) -> MapCounts {
        let octree = self.octree().counts();
        MapCounts {
            cloud_points: self.cloud().len(),
            cloud_voxels: self.cloud().held_voxels(),
            octree_nodes: octree.nodes,
            octree_leaves: octree.leaves,
            octree_occupied_leaves: octree.occupied_leaves,
            planes: self.planes().len(),
            objects: self.objects().objects().count(),
        }
    }
}
