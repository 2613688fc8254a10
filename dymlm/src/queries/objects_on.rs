use dymlm_core::PlaneId;
use dymlm_objects::MapObject;

use crate::MultiLevelMap;

impl MultiLevelMap {
    /// The objects that were seen to stand on a plane, the oldest first. For a plane that was merged away:
    /// those on the plane that it became. O(objects).
    pub fn objects_on(&self, plane: PlaneId) -> impl Iterator<Item = &MapObject> {
        self.objects().on_plane(self.planes.current_id(plane).unwrap_or(plane))
    }
}
