#[cfg(feature = "io")]
use dymlm_cloud::CloudLoader;
use dymlm_cloud::CloudPager;
#[cfg(feature = "io")]
use dymlm_planes::PlaneMap;

use crate::map_bytes::MapBytes;
use crate::snapshots::Snapshots;
use crate::{Error, MemoryConfig, MultiLevelMap};

/// Keeps maps within their memory budget, if they have one.
#[derive(Debug)]
pub(crate) struct MapPager {
    budgeted: Option<Budgeted>,
}

#[derive(Debug)]
struct Budgeted {
    /// Bytes.
    budget: usize,
    /// Bytes that are none of these maps' and count, too.
    beside: usize,
    /// Its file, or rather the cloud's, also takes what key frames have seen of planes.
    cloud: CloudPager,
    /// Of the maps beside the cloud.
    others: MapBytes,
}

impl MapPager {
    /// `beside` tells how many bytes of the budget are taken by what is none of these maps'.
    pub(crate) fn new(config: &MemoryConfig, beside: impl FnOnce() -> usize) -> Result<Self, Error> {
        let Some(budget) = config.budget else { return Ok(Self { budgeted: None }) };
        let folder = config.path.clone().unwrap_or_else(std::env::temp_dir);
        let cloud = CloudPager::new(&folder).map_err(Error::Paging)?;
        Ok(Self { budgeted: Some(Budgeted { budget, beside: beside(), cloud, others: MapBytes::default() }) })
    }

    /// Must be called once a frame. What is paged out of the maps is paged out of their snapshots as well.
    pub(crate) fn page_out(
        &mut self,
        map: &mut MultiLevelMap,
        snapshots: &mut Snapshots,
    ) -> Result<(), Error> {
        let Some(Budgeted { budget, beside, cloud: pager, others }) = &mut self.budgeted else {
            return Ok(());
        };
        others.go_on(map);
        let mut is_asked = false;
        let budget = || {
            is_asked = true;
            budget.saturating_sub(others.total() + *beside)
        };
        pager.page_out(&mut map.cloud, budget).map_err(Error::Paging)?;
        if is_asked {
            // Whatever the budget: they are seldom asked, and grow with the hours.
            let file = map.cloud.page_file().unwrap_or(pager.file());
            map.planes.page_out(file).map_err(Error::Paging)?;
            snapshots.page_out_like(map);
        }
        Ok(())
    }

    /// Pages out what older key frames have seen of planes, in maps that have been loaded.
    #[cfg(feature = "io")]
    pub(crate) fn page_out_planes(&self, planes: &PlaneMap) -> Result<(), Error> {
        let Some(Budgeted { cloud, .. }) = &self.budgeted else { return Ok(()) };
        planes.page_out(cloud.file()).map_err(Error::Paging)
    }

    /// Pages out what has been loaded of a cloud, when it takes more than the other maps, whose bytes are `others`,
    /// leave of the budget.
    #[cfg(feature = "io")]
    pub(crate) fn page_out_loaded(&mut self, loader: &mut CloudLoader, others: usize) -> Result<(), Error> {
        let Some(Budgeted { budget, cloud: pager, .. }) = &mut self.budgeted else { return Ok(()) };
        loader.page_out(pager, budget.saturating_sub(others)).map_err(Error::Paging)
    }
}
