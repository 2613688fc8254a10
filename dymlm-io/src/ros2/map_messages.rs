//! The ROS 2 messages that maps are written in. Fields are in the order of the message definitions.

use serde::Serialize;

use super::messages::{Header, Time, Transform, as_bytes};

/// A field of the points of a cloud: `sensor_msgs/PointField`.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct PointField {
    name: &'static str,
    offset: u32,
    datatype: u8,
    count: u32,
}

impl PointField {
    pub(crate) const UINT32: u8 = 6;
    pub(crate) const FLOAT32: u8 = 7;

    /// A field with one number per point.
    pub(crate) const fn new(name: &'static str, offset: u32, datatype: u8) -> Self {
        Self { name, offset, datatype, count: 1 }
    }
}

#[derive(Debug, Serialize)]
pub(crate) struct PointCloud2<'a> {
    pub(crate) header: Header,
    pub(crate) height: u32,
    pub(crate) width: u32,
    pub(crate) fields: &'a [PointField],
    pub(crate) is_bigendian: bool,
    pub(crate) point_step: u32,
    pub(crate) row_step: u32,
    #[serde(serialize_with = "as_bytes")]
    pub(crate) data: &'a [u8],
    pub(crate) is_dense: bool,
}

#[derive(Debug, Serialize)]
pub(crate) struct MapMetaData {
    pub(crate) map_load_time: Time,
    pub(crate) resolution: f32,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) origin: Transform,
}

#[derive(Debug, Serialize)]
pub(crate) struct OccupancyGrid<'a> {
    pub(crate) header: Header,
    pub(crate) info: MapMetaData,
    /// Signed bytes: their two's complement.
    #[serde(serialize_with = "as_bytes")]
    pub(crate) data: &'a [u8],
}
