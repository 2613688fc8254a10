use std::sync::Arc;

use dymlm_cloud::SavedCloud;
use dymlm_objects::ObjectMapper;
use dymlm_octree::Octree;
use dymlm_planes::PlaneMap;

use crate::session_log::SessionLog;
use crate::{MapConfig, MultiLevelMap, Revision};

/// What must be known of maps that were saved, so that only what has changed since is saved next. Of the cloud
/// only the versions of its blocks: their contents would soon take its memory once more.
#[derive(Debug)]
pub(super) struct SavedState {
    pub(super) config: Arc<MapConfig>,
    pub(super) revision: Revision,
    pub(super) cloud: SavedCloud,
    pub(super) octree: Octree,
    pub(super) planes: PlaneMap,
    pub(super) objects: ObjectMapper,
    pub(super) log: Option<SessionLog>,
}

impl SavedState {
    /// The state of maps that have just been saved or loaded.
    pub(super) fn of(map: &MultiLevelMap) -> Self {
        Self {
            config: Arc::clone(&map.config),
            revision: map.revision,
            cloud: map.cloud.to_saved(),
            octree: map.octree.clone(),
            planes: map.planes.clone(),
            objects: map.objects.clone(),
            log: map.past.log.clone(),
        }
    }
}
