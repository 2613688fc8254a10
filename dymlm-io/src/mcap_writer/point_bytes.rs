use dymlm_core::{PointCloud, Rgb};

use crate::ros2::map_messages::PointField;

/// The fields of points without colours.
const PLACE: [PointField; 3] = [
    PointField::new("x", 0, PointField::FLOAT32),
    PointField::new("y", 4, PointField::FLOAT32),
    PointField::new("z", 8, PointField::FLOAT32),
];

/// The fields of points with colours. ROS looks for colours in `rgb`, as 0x00RRGGBB. Rerun takes fields by
/// its own names for parts of a cloud, and calls colours `colors`, 0xRRGGBBAA.
const COLORED: [PointField; 5] = [
    PLACE[0],
    PLACE[1],
    PLACE[2],
    PointField::new("rgb", 12, PointField::FLOAT32),
    PointField::new("colors", 16, PointField::UINT32),
];

/// The points of a `sensor_msgs/PointCloud2`.
pub(super) struct PointBytes {
    pub(super) fields: &'static [PointField],
    pub(super) step: u32,
    pub(super) data: Vec<u8>,
}

impl PointBytes {
    pub(super) fn of(cloud: &PointCloud) -> Self {
        let Some(colors) = cloud.colors() else {
            let data = cloud.points().iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
            return Self { fields: &PLACE, step: 12, data };
        };
        let mut data = Vec::with_capacity(20 * cloud.len());
        for (point, &[r, g, b]) in cloud.points().iter().zip::<&[Rgb]>(colors) {
            data.extend(point.iter().flat_map(|c| c.to_le_bytes()));
            data.extend_from_slice(&[b, g, r, 0, u8::MAX, b, g, r]);
        }
        Self { fields: &COLORED, step: 20, data }
    }
}
