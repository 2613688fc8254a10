use super::merged_log::EventPlace;
use super::report::NewIds;
use crate::MultiLevelMap;
use crate::correction::leading_ids;
use crate::session_log::{Event, SeenThings, SessionLog};
use dymlm_core::Pages;

impl NewIds {
    /// For each thing of a map, its id in the merged map, by the observations that both share.
    pub(super) fn of(
        before: &MultiLevelMap,
        log: &SessionLog,
        places: &[EventPlace],
        now: &MultiLevelMap,
        events: &Pages<Event>,
    ) -> Self {
        let pairs = || {
            places.iter().filter_map(|place| {
                let old = log.events.get(place.before)?.key_frame()?;
                Some((&old.seen, &events.get(place.merged)?.key_frame()?.seen))
            })
        };
        let planes = pairs().flat_map(|(old, new)| SeenThings::shared_planes(old, new));
        let objects = pairs().flat_map(|(old, new)| SeenThings::shared_objects(old, new));
        Self {
            planes: leading_ids(planes.filter_map(|(old, new)| {
                Some((before.planes.current_id(old)?, now.planes.current_id(new)?))
            })),
            objects: leading_ids(objects.filter_map(|(old, new)| {
                Some((before.objects().object(old)?.id(), now.objects().object(new)?.id()))
            })),
        }
    }
}
