use dymlm_core::{PointCloud, Pose};

/// What a PCD file holds: points with or without colours, possibly as the rows and columns of the image they
/// come from, further fields beside, and the place of the sensor.
///
/// In organized clouds pixels without a reading are points whose coordinates are NaN. They are kept here, so
/// that point `v * width + u` is pixel (u, v) and the further fields match; [`Self::finite`] leaves them out.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PcdCloud {
    /// All points with their colours, those that are not finite among them.
    pub cloud: PointCloud,
    /// Columns of an organized cloud; the number of points of another.
    pub width: usize,
    /// Rows of an organized cloud; 1 for another.
    pub height: usize,
    /// Where the sensor was: takes sensor coordinates to the cloud's.
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
    /// Number of values a point.
    pub count: usize,
    /// The values: those of the first point, then those of the second ... 64-bit integers beyond 2^53 are
    /// rounded.
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

    /// A further field.
    pub fn field(&self, name: &str) -> Option<&PcdField> {
        self.fields.iter().find(|field| field.name == name)
    }
}
