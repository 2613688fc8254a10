use dymlm_core::{PointCloud, Pose};

/// The content of a PCD file: points with or without colours, perhaps organized in rows and columns of an
/// image, further fields, and the pose of the sensor.
///
/// In an organized cloud, pixels without a reading are points with NaN coordinates. They are kept here, so
/// that point `v * width + u` is pixel (u, v) and the further fields match; [`Self::finite`] leaves them out.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PcdCloud {
    /// All points with their colours, including points that are not finite.
    pub cloud: PointCloud,
    /// Columns of an organized cloud; otherwise the number of points.
    pub width: usize,
    /// Rows of an organized cloud; otherwise 1.
    pub height: usize,
    /// Pose of the sensor: takes sensor coordinates to the cloud's.
    pub viewpoint: Pose,
    /// The further fields, in the order of the file.
    pub fields: Vec<PcdField>,
}

/// A further field of a PCD file: `label`, `intensity`, `normal_x` ...
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PcdField {
    /// The field's name.
    pub name: String,
    /// Number of values per point.
    pub count: usize,
    /// The values of the first point, then those of the second ... 64-bit integers beyond 2^53 are rounded.
    pub values: Vec<f64>,
}

impl PcdCloud {
    /// The points that are finite, with their colours.
    #[must_use]
    pub fn finite(&self) -> PointCloud {
        let points = self.cloud.points().iter().enumerate();
        let finite = points.filter(|(_, point)| point.iter().all(|x| x.is_finite()));
        self.cloud.select(&finite.map(|(index, _)| index).collect::<Vec<usize>>())
    }

    /// The further field of a name, if the file has one.
    pub fn field(&self, name: &str) -> Option<&PcdField> {
        self.fields.iter().find(|field| field.name == name)
    }
}
