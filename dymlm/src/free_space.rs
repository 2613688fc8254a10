use dymlm_cloud::CloudMap;
use dymlm_dynamics::FreeSpace;

/// The free space of the cloud's evidence, in which movers without a label betray themselves.
pub(crate) struct MappedFreeSpace<'a>(pub(crate) &'a CloudMap);

impl FreeSpace for MappedFreeSpace<'_> {
    fn is_long_free(&self, place: [f64; 3], margin: f64) -> bool {
        self.0.is_long_free(place, margin)
    }
}
