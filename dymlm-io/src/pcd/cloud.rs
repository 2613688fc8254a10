use dymlm_core::{PointCloud, Pose};

use crate::Error;
use crate::scalar::{Scalar, with_scalars};

/// A point cloud as PCD files hold it: points with or without colours, possibly as the rows and columns of
/// the image they come from, further fields beside, and the place of the sensor.
///
/// In organized clouds pixels without a reading are points whose coordinates are NaN. They are kept here, so
/// that point `v * width + u` is pixel (u, v) and the further fields match; [`Self::finite`] leaves them out.
#[derive(Debug, Clone, PartialEq)]
pub struct PcdCloud {
    cloud: PointCloud,
    width: usize,
    height: usize,
    viewpoint: Pose,
    fields: Vec<PcdField>,
}

/// A further field of a PCD file: `label`, `intensity`, `normal_x` ...
#[derive(Debug, Clone, PartialEq)]
pub struct PcdField {
    name: String,
    count: usize,
    values: PcdValues,
}

/// The values of a field, point by point.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the variants are the scalar types of their values")]
pub enum PcdValues {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    I64(Vec<i64>),
    U64(Vec<u64>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// Runs the same expression on the vector of any variant.
macro_rules! with_values {
    ($values:expr, $vector:ident => $expression:expr) => {
        match $values {
            PcdValues::I8($vector) => $expression,
            PcdValues::U8($vector) => $expression,
            PcdValues::I16($vector) => $expression,
            PcdValues::U16($vector) => $expression,
            PcdValues::I32($vector) => $expression,
            PcdValues::U32($vector) => $expression,
            PcdValues::I64($vector) => $expression,
            PcdValues::U64($vector) => $expression,
            PcdValues::F32($vector) => $expression,
            PcdValues::F64($vector) => $expression,
        }
    };
}
pub(super) use with_values;

impl PcdCloud {
    /// A cloud without organization or further fields, seen from its origin.
    pub fn new(cloud: PointCloud) -> Self {
        Self { width: cloud.len(), height: 1, viewpoint: Pose::identity(), fields: Vec::new(), cloud }
    }

    /// The cloud as rows and columns of an image.
    ///
    /// # Errors
    ///
    /// [`Error::PcdField`] when `width * height` is not the number of points.
    pub fn organized(mut self, width: usize, height: usize) -> Result<Self, Error> {
        if width.checked_mul(height) != Some(self.cloud.len()) {
            let reason = format!("{width}x{height} for {} points", self.cloud.len());
            return Err(Error::PcdField { field: "width x height".to_owned(), reason });
        }
        (self.width, self.height) = (width, height);
        Ok(self)
    }

    /// The cloud seen from elsewhere: the pose that takes sensor coordinates to the cloud's.
    #[must_use]
    pub fn with_viewpoint(mut self, cloud_from_sensor: Pose) -> Self {
        self.viewpoint = cloud_from_sensor;
        self
    }

    /// Adds a field.
    ///
    /// # Errors
    ///
    /// [`Error::PcdField`] when the cloud has a field of that name, or the values are not as many as the
    /// points ask for.
    pub fn with_field(mut self, field: PcdField) -> Result<Self, Error> {
        let refused = |reason: String| Error::PcdField { field: field.name.clone(), reason };
        if self.field(&field.name).is_some() {
            return Err(refused("the cloud has a field of this name".to_owned()));
        }
        if field.count.checked_mul(self.cloud.len()) != Some(field.values.len()) {
            let (values, points, count) = (field.values.len(), self.cloud.len(), field.count);
            return Err(refused(format!("{values} values for {points} points of {count} values each")));
        }
        self.fields.push(field);
        Ok(self)
    }

    /// All points with their colours, those that are not finite among them.
    pub fn cloud(&self) -> &PointCloud {
        &self.cloud
    }

    /// The points that are finite, with their colours.
    #[must_use]
    pub fn finite(&self) -> PointCloud {
        let finite = |point: &[f32; 3]| point.iter().all(|x| x.is_finite());
        let points = self.cloud.points().iter().enumerate();
        let kept: Vec<usize> = points.filter(|(_, point)| finite(point)).map(|(i, _)| i).collect();
        self.cloud.select(&kept)
    }

    /// Columns of an organized cloud; the number of points of another.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows of an organized cloud; 1 for another.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Where the sensor was: takes sensor coordinates to the cloud's.
    pub fn viewpoint(&self) -> Pose {
        self.viewpoint
    }

    /// The further fields, in the order of the file.
    pub fn fields(&self) -> &[PcdField] {
        &self.fields
    }

    /// A further field.
    pub fn field(&self, name: &str) -> Option<&PcdField> {
        self.fields.iter().find(|field| field.name == name)
    }
}

impl PcdField {
    /// A field of one value a point.
    ///
    /// # Errors
    ///
    /// [`Error::PcdField`] when the name is empty, has white space in it or is one of the cloud's own: `x y z
    /// rgb rgba _`.
    pub fn new(name: impl Into<String>, values: PcdValues) -> Result<Self, Error> {
        Self::with_count(name, 1, values)
    }

    /// A field of `count` values a point, one point's after the other's.
    ///
    /// # Errors
    ///
    /// As [`Self::new`], and when `count` is 0.
    pub fn with_count(name: impl Into<String>, count: usize, values: PcdValues) -> Result<Self, Error> {
        let name = name.into();
        let reason = if name.is_empty() || name.contains(|c: char| c.is_whitespace() || c.is_control()) {
            "no name for a field"
        } else if ["x", "y", "z", "rgb", "rgba", "_"].contains(&name.as_str()) {
            "a name that points and colours have taken"
        } else if count == 0 {
            "a field of no values"
        } else {
            return Ok(Self { name, count, values });
        };
        Err(Error::PcdField { field: name, reason: reason.to_owned() })
    }

    /// The field's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Number of values a point.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The values: those of the first point, then those of the second ...
    pub fn values(&self) -> &PcdValues {
        &self.values
    }
}

macro_rules! scalar_of_values {
    ($($name:ident $type:ty),*) => {
        impl PcdValues {
            /// No values yet, of a type.
            pub(super) fn with_capacity(scalar: Scalar, capacity: usize) -> Self {
                match scalar {
                    $(Scalar::$name => Self::$name(Vec::with_capacity(capacity))),*
                }
            }

            /// The type of the values.
            pub(super) fn scalar(&self) -> Scalar {
                match self {
                    $(Self::$name(_) => Scalar::$name),*
                }
            }
        }
    };
}
with_scalars!(scalar_of_values);

impl PcdValues {
    /// Number of values.
    pub fn len(&self) -> usize {
        with_values!(self, values => values.len())
    }

    /// Whether there is no value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The values as f64, whatever their type; 64-bit integers beyond 2^53 are rounded.
    pub fn to_f64(&self) -> Vec<f64> {
        #[allow(clippy::cast_lossless, clippy::unnecessary_cast, reason = "one line for all types")]
        {
            with_values!(self, values => values.iter().map(|&value| value as f64).collect())
        }
    }
}
