use dymlm_core::{PointCloud, Rgb};

use crate::ros2::map_messages::PointField;

/// Of points without colours.
const PLACE: [PointField; 3] = [
    PointField::new("x", 0, PointField::FLOAT32),
    PointField::new("y", 4, PointField::FLOAT32),
    PointField::new("z", 8, PointField::FLOAT32),
];

/// Of points with colours: `rgb` is where ROS looks for them, as 0x00RRGGBB, and `colors`, 0xRRGGBBAA, is what
/// Rerun calls the colours of its points: it takes fields for those parts of a cloud that have their names.
const COLORED: [PointField; 5] = [
    PLACE[0],
    PLACE[1],
    PLACE[2],
    PointField::new("rgb", 12, PointField::FLOAT32),
    PointField::new("colors", 16, PointField::UINT32),
];

/// A cloud as `sensor_msgs/PointCloud2` holds it.
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
