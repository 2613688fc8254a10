use dymlm_cloud::CloudPager;

use crate::session_log::SessionLog;
use crate::snapshots::Snapshots;
use crate::{Error, MemoryConfig, MultiLevelMap};

/// Keeps maps within their memory budget, if they have one.
#[derive(Debug)]
pub(crate) struct MapPager {
    /// The pager and the budget, bytes.
    pager: Option<(CloudPager, usize)>,
}

impl MapPager {
    pub(crate) fn new(config: &MemoryConfig) -> Result<Self, Error> {
        let Some(budget) = config.budget else { return Ok(Self { pager: None }) };
        let folder = config.path.clone().unwrap_or_else(std::env::temp_dir);
        let pager = CloudPager::new(&folder).map_err(Error::Paging)?;
        Ok(Self { pager: Some((pager, budget)) })
    }

    /// Must be called once a frame. What is paged out of the maps is paged out of their snapshots as well.
    pub(crate) fn page_out(
        &mut self,
        map: &mut MultiLevelMap,
        snapshots: &mut Snapshots,
    ) -> Result<(), Error> {
        let Some((pager, budget)) = &mut self.pager else { return Ok(()) };
        let MultiLevelMap { cloud, octree, planes, objects, past, .. } = map;
        let mut has_counted = false;
        let budget = || {
            has_counted = true;
            let history = past.log.as_ref().map_or(0, SessionLog::memory_bytes);
            let others =
                octree.memory_bytes() + planes.memory_bytes() + objects.map().memory_bytes() + history;
            budget.saturating_sub(others)
        };
        pager.page_out(cloud, budget).map_err(Error::Paging)?;
        if has_counted {
            snapshots.page_out_like(map);
        }
        Ok(())
    }
}
