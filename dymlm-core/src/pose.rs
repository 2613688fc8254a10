use std::ops::Mul;

use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::Error;
use crate::paging::Record;

/// A rigid motion: takes coordinates of one frame to another, x' = R x + t.
///
/// A pose is always named with both frames: `world_from_camera` takes camera coordinates to the world, and
/// `world_from_camera * camera_from_object` is `world_from_object`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawPose", into = "RawPose"))]
pub struct Pose {
    isometry: Isometry3<f64>,
}

impl Pose {
    /// A translation in metres and a quaternion x y z w, which is normalized. One of unit length, to rounding,
    /// is taken as it is: who hands back the [`translation`](Self::translation) and
    /// [`quaternion`](Self::quaternion) of a pose gets this pose, to the bit.
    ///
    /// # Errors
    ///
    /// [`Error::Pose`] when a value is not finite or the quaternion's norm is more than 0.01 from 1.
    ///
    /// ```
    /// use dymlm_core::Pose;
    ///
    /// // A quarter turn about z, then one metre along x.
    /// let half = 0.5_f64.sqrt();
    /// let pose = Pose::new([1.0, 0.0, 0.0], [0.0, 0.0, half, half])?;
    /// let [x, y, z] = pose.transform_point([2.0, 0.0, 0.0]);
    /// assert!((x - 1.0).abs() < 1e-12 && (y - 2.0).abs() < 1e-12 && z == 0.0);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    pub fn new(translation: [f64; 3], quaternion: [f64; 4]) -> Result<Self, Error> {
        // Some dozens of products are off by less.
        Self::normalized_beyond(1e-14, translation, quaternion)
    }

    /// With a quaternion that is normalized where its length is more than `tolerance` from 1.
    fn normalized_beyond(tolerance: f64, translation: [f64; 3], quaternion: [f64; 4]) -> Result<Self, Error> {
        let norm = quaternion.iter().map(|q| q * q).sum::<f64>().sqrt();
        if !(translation.iter().all(|t| t.is_finite()) && (norm - 1.0).abs() <= 0.01) {
            return Err(Error::Pose { translation, quaternion, norm });
        }
        let [x, y, z, w] = quaternion;
        let quaternion = Quaternion::new(w, x, y, z);
        let rotation = if (norm - 1.0).abs() <= tolerance {
            UnitQuaternion::new_unchecked(quaternion)
        } else {
            UnitQuaternion::new_normalize(quaternion)
        };
        Ok(Self { isometry: Isometry3::from_parts(Translation3::from(translation), rotation) })
    }

    /// From a rotation matrix, given by rows, and a translation in metres.
    ///
    /// # Errors
    ///
    /// [`Error::Rotation`] when the rows are not orthonormal to 1e-3 or the determinant is not +1;
    /// [`Error::Pose`] when the translation is not finite.
    pub fn from_rotation_matrix(rows: [[f64; 3]; 3], translation: [f64; 3]) -> Result<Self, Error> {
        let matrix = Matrix3::from_fn(|row, column| rows[row][column]);
        let departure = (matrix * matrix.transpose() - Matrix3::identity()).amax();
        // A NaN in the matrix fails the comparison.
        if !(departure <= 1e-3 && matrix.determinant() > 0.0) {
            return Err(Error::Rotation(rows));
        }
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
        Self::new(translation, rotation.coords.into())
    }

    /// The motion that moves nothing.
    pub fn identity() -> Self {
        Self { isometry: Isometry3::identity() }
    }

    /// Translation, metres.
    #[inline]
    pub fn translation(&self) -> [f64; 3] {
        self.isometry.translation.vector.into()
    }

    /// Rotation as a unit quaternion x y z w.
    #[inline]
    pub fn quaternion(&self) -> [f64; 4] {
        self.isometry.rotation.coords.into()
    }

    /// Rotation as a matrix, by rows.
    #[inline]
    pub fn rotation_matrix(&self) -> [[f64; 3]; 3] {
        let matrix = self.isometry.rotation.to_rotation_matrix();
        std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
    }

    /// The inverse motion: `a_from_b.inverse()` is `b_from_a`.
    #[inline]
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self { isometry: self.isometry.inverse() }
    }

    /// R x + t.
    #[inline]
    pub fn transform_point(&self, point: [f64; 3]) -> [f64; 3] {
        (self.isometry * Point3::from(point)).coords.into()
    }

    /// R x: for directions and normals.
    #[inline]
    pub fn rotate(&self, direction: [f64; 3]) -> [f64; 3] {
        (self.isometry.rotation * Vector3::from(direction)).into()
    }

    /// The pose a `fraction` of the way from this one (0) to `other` (1): the translation linearly, the
    /// rotation on the shorter great circle (slerp).
    #[must_use]
    pub fn interpolate(&self, other: &Self, fraction: f64) -> Self {
        let translation = self.isometry.translation.vector.lerp(&other.isometry.translation.vector, fraction);
        // For rotations half a turn apart every axis is as good: keep this rotation rather than let rounding
        // choose.
        let rotation = self
            .isometry
            .rotation
            .try_slerp(&other.isometry.rotation, fraction, 1e-12)
            .unwrap_or(self.isometry.rotation);
        Self { isometry: Isometry3::from_parts(translation.into(), rotation) }
    }

    /// Distance between the two origins, metres.
    pub fn distance(&self, other: &Self) -> f64 {
        (self.isometry.translation.vector - other.isometry.translation.vector).norm()
    }

    /// Angle between the two rotations, radians, 0..=pi.
    pub fn angle(&self, other: &Self) -> f64 {
        self.isometry.rotation.angle_to(&other.isometry.rotation)
    }
}

impl Default for Pose {
    fn default() -> Self {
        Self::identity()
    }
}

impl Mul for Pose {
    type Output = Self;

    /// `a_from_b * b_from_c` is `a_from_c`.
    fn mul(self, other: Self) -> Self {
        Self { isometry: self.isometry * other.isometry }
    }
}

impl Record for Pose {
    fn write(&self, out: &mut Vec<u8>) {
        self.translation().write(out);
        self.quaternion().write(out);
    }

    fn read(from: &mut &[u8]) -> Option<Self> {
        let (translation, [x, y, z, w]) = (<[f64; 3]>::read(from)?, <[f64; 4]>::read(from)?);
        // Not normalized again, which would change bits.
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        Some(Self { isometry: Isometry3::from_parts(Translation3::from(translation), rotation) })
    }
}

#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct RawPose {
    translation: [f64; 3],
    quaternion: [f64; 4],
}

#[cfg(feature = "serde")]
impl TryFrom<RawPose> for Pose {
    type Error = Error;

    /// A pose that was written is read back bit by bit, also where it is the product of millions.
    fn try_from(raw: RawPose) -> Result<Self, Error> {
        Self::normalized_beyond(1e-9, raw.translation, raw.quaternion)
    }
}

#[cfg(feature = "serde")]
impl From<Pose> for RawPose {
    fn from(pose: Pose) -> Self {
        Self { translation: pose.translation(), quaternion: pose.quaternion() }
    }
}
