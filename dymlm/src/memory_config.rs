use std::path::PathBuf;

/// How much memory maps may take.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct MemoryConfig {
    /// Bytes that the maps may take, including a history that is kept in memory: parts of the cloud that no
    /// frame has seen for longest go to a file and come back when a frame or a query reaches them. The maps
    /// are the same, to the bit. Saved maps are loaded within it. The other maps, which take a twentieth of the
    /// cloud, stay in memory, and so do the parts that the last 12 frames have seen and some 100 bytes for each
    /// 8^3 voxels that are not empty. Whatever the budget, what all but the last key frames have seen of planes
    /// goes to a file too: it grows with the hours. The first query of the static cloud works it out in batches,
    /// and puts what it has worked out into the file as well. Not included are the earlier states from which
    /// corrections begin and the maps that readers see: [`MapMemory`](crate::MapMemory) counts what they do not
    /// share with the maps. Default none: no limit.
    pub budget: Option<usize>,
    /// The folder in which the file is made; it must exist. The file has no name where the system allows
    /// that, and is deleted with the maps. Default: the system's folder for temporary files.
    pub path: Option<PathBuf>,
}
