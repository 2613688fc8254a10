use crate::vector3::dot;
use crate::{Error, Pose};

/// An infinite plane in Hessian form: normal . x + d = 0, the normal of unit length.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawPlane"))]
pub struct Plane {
    normal: [f64; 3],
    d: f64,
}

impl Plane {
    /// Makes the plane normal . x + d = 0. A normal of any length is accepted; both parameters are divided by
    /// it.
    ///
    /// # Errors
    ///
    /// [`Error::Plane`] when a parameter is not finite or the normal is zero.
    ///
    /// ```
    /// let table = dymlm_core::Plane::new([0.0, 0.0, 2.0], -1.5)?;
    /// assert_eq!(table.signed_distance([3.0, 1.0, 1.0]), 0.25);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    pub fn new(normal: [f64; 3], d: f64) -> Result<Self, Error> {
        let length = dot(normal, normal).sqrt();
        if !(length.is_finite() && length > 1e-12 && d.is_finite()) {
            return Err(Error::Plane { normal, d });
        }
        Ok(Self { normal: normal.map(|n| n / length), d: d / length })
    }

    /// Unit normal.
    #[inline]
    pub fn normal(&self) -> [f64; 3] {
        self.normal
    }

    /// The plane of a [`Self::normal`] and a [`Self::d`] that a plane gave, bit by bit: nothing is
    /// normalized. `None` when the normal is not of unit length.
    #[must_use]
    pub fn of_unit_normal(normal: [f64; 3], d: f64) -> Option<Self> {
        let is_unit = (dot(normal, normal) - 1.0).abs() < 1e-9;
        (is_unit && d.is_finite()).then_some(Self { normal, d })
    }

    /// Offset d of normal . x + d = 0, metres.
    #[inline]
    pub fn d(&self) -> f64 {
        self.d
    }

    /// Distance of a point from the plane, metres, positive on the side the normal points to.
    #[inline]
    pub fn signed_distance(&self, point: [f64; 3]) -> f64 {
        dot(self.normal, point) + self.d
    }

    /// The plane in the frame `a`, given in frame `b`: n' = R n, d' = d - t . n'.
    #[must_use]
    pub fn transformed(&self, a_from_b: &Pose) -> Self {
        let normal = a_from_b.rotate(self.normal);
        Self { normal, d: self.d - dot(a_from_b.translation(), normal) }
    }

    /// The same plane seen from its other side.
    #[must_use]
    pub fn flipped(&self) -> Self {
        Self { normal: self.normal.map(|n| -n), d: -self.d }
    }
}

#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct RawPlane {
    normal: [f64; 3],
    d: f64,
}

#[cfg(feature = "serde")]
impl TryFrom<RawPlane> for Plane {
    type Error = Error;

    fn try_from(RawPlane { normal, d }: RawPlane) -> Result<Self, Error> {
        let plane = Self::new(normal, d)?;
        // A plane that was written with a unit normal is read back bit by bit.
        let is_unit = (dot(normal, normal) - 1.0).abs() < 1e-9;
        Ok(if is_unit { Self { normal, d } } else { plane })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_with_its_points() {
        let plane = Plane::new([0.3, -0.2, 0.9], 0.4).unwrap();
        let a_from_b = Pose::new([1.0, -2.0, 0.5], [0.5, 0.5, 0.5, 0.5]).unwrap();
        let point = [0.7, 0.1, -2.0];
        let moved = plane.transformed(&a_from_b).signed_distance(a_from_b.transform_point(point));
        assert!((moved - plane.signed_distance(point)).abs() < 1e-12);
        assert!((plane.flipped().signed_distance(point) + plane.signed_distance(point)).abs() < 1e-12);
    }

    #[test]
    fn refuses_a_normal_without_direction() {
        assert!(Plane::new([0.0; 3], 1.0).is_err());
        assert!(Plane::new([f64::NAN, 0.0, 1.0], 1.0).is_err());
        assert!(Plane::new([0.0, 0.0, 1.0], f64::INFINITY).is_err());
    }
}
