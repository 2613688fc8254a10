use dymlm_core::{Plane, Pose};

use crate::linear_algebra::{Symmetric3, dot, eigenvector, quadratic_form, smallest_eigenvalue, subtract};

/// Sums over weighted points up to second order: all that a least-squares plane needs. They add up and can be taken
/// apart, so a plane of two sets of points costs the same as one of two points.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Moments {
    /// Sum of weights.
    pub(crate) weight: f64,
    /// Sums of w x, w y, w z.
    pub(crate) first: [f64; 3],
    /// Sums of w xx, w xy, w xz, w yy, w yz, w zz.
    pub(crate) second: Symmetric3,
}

/// A least-squares plane.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Fit {
    pub(crate) centroid: [f64; 3],
    /// Unit length, towards the origin of the frame: the camera.
    pub(crate) normal: [f64; 3],
    /// Weighted mean of squared distances, square metres.
    pub(crate) mse: f64,
}

impl Moments {
    #[inline]
    pub(crate) fn add(&mut self, other: &Self) {
        self.weight += other.weight;
        for (sum, term) in self.first.iter_mut().zip(other.first) {
            *sum += term;
        }
        for (sum, term) in self.second.iter_mut().zip(other.second) {
            *sum += term;
        }
    }

    #[inline]
    #[must_use]
    pub(crate) fn plus(&self, other: &Self) -> Self {
        let mut sum = *self;
        sum.add(other);
        sum
    }

    pub(crate) fn add_point(&mut self, [x, y, z]: [f64; 3], weight: f64) {
        self.add(&Self {
            weight,
            first: [weight * x, weight * y, weight * z],
            second: [x * x, x * y, x * z, y * y, y * z, z * z].map(|product| weight * product),
        });
    }

    #[inline]
    pub(crate) fn centroid(&self) -> [f64; 3] {
        self.first.map(|sum| sum / self.weight)
    }

    #[inline]
    pub(crate) fn covariance(&self) -> Symmetric3 {
        let [x, y, z] = self.centroid();
        let [xx, xy, xz, yy, yz, zz] = self.second.map(|sum| sum / self.weight);
        [xx - x * x, xy - x * y, xz - x * z, yy - y * y, yz - y * z, zz - z * z]
    }

    /// Mean of squared distances from the best plane.
    #[inline]
    pub(crate) fn mse(&self) -> f64 {
        smallest_eigenvalue(&self.covariance())
    }

    /// Mean of squared distances from a given plane.
    #[inline]
    pub(crate) fn mse_about(&self, normal: [f64; 3], point: [f64; 3]) -> f64 {
        let offset = dot(normal, subtract(self.centroid(), point));
        quadratic_form(&self.covariance(), normal).max(0.0) + offset * offset
    }

    /// The best plane; `None` when the points have none (too few, or one place) or are not finite.
    pub(crate) fn fit(&self) -> Option<Fit> {
        if self.weight.is_nan() || self.weight <= 0.0 {
            return None;
        }
        let covariance = self.covariance();
        let mse = smallest_eigenvalue(&covariance);
        let normal = eigenvector(&covariance, mse)?;
        let centroid = self.centroid();
        let away = dot(normal, centroid) > 0.0;
        Some(Fit { centroid, normal: if away { normal.map(|n| -n) } else { normal }, mse })
    }

    /// Moves the points: x' = R x + t.
    pub(crate) fn transformed(&self, a_from_b: &Pose) -> Self {
        if self.weight <= 0.0 {
            return *self;
        }
        // About the centroid, where nothing large cancels.
        let covariance = rotated(&self.covariance(), &a_from_b.rotation_matrix());
        Self::from_covariance(self.weight, a_from_b.transform_point(self.centroid()), &covariance)
    }

    pub(crate) fn from_covariance(weight: f64, centroid: [f64; 3], covariance: &Symmetric3) -> Self {
        let [x, y, z] = centroid;
        let of_centroid = [x * x, x * y, x * z, y * y, y * z, z * z];
        Self {
            weight,
            first: centroid.map(|c| weight * c),
            second: std::array::from_fn(|i| weight * (covariance[i] + of_centroid[i])),
        }
    }
}

impl Fit {
    /// In Hessian form; `None` never happens for a fit of finite points.
    pub(crate) fn plane(&self) -> Option<Plane> {
        Plane::new(self.normal, -dot(self.normal, self.centroid)).ok()
    }
}

/// R A R'.
pub(crate) fn rotated(matrix: &Symmetric3, rotation: &[[f64; 3]; 3]) -> Symmetric3 {
    let [xx, xy, xz, yy, yz, zz] = *matrix;
    let columns = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let times = |row: [f64; 3]| columns.map(|column| dot(row, column));
    let products = rotation.map(times);
    let entry = |i: usize, j: usize| dot(products[i], rotation[j]);
    [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tilted_square() -> Moments {
        let mut moments = Moments::default();
        for i in -5..=5 {
            for j in -5..=5 {
                let (x, y) = (0.1 * f64::from(i), 0.1 * f64::from(j));
                moments.add_point([x, y, 2.0 + 0.5 * x], 2.0);
            }
        }
        moments
    }

    #[test]
    fn fits_the_plane_of_its_points_towards_the_origin() {
        let fit = tilted_square().fit().unwrap();
        let length = 1.25_f64.sqrt();
        let expected = [0.5 / length, 0.0, -1.0 / length];
        assert!(subtract(fit.normal, expected).iter().all(|difference| difference.abs() < 1e-9));
        assert!(fit.mse < 1e-12 && (fit.centroid[2] - 2.0).abs() < 1e-12);
        assert!(fit.plane().unwrap().d() > 0.0);
    }

    #[test]
    fn moves_with_its_points() {
        let pose = Pose::new([1.0, -2.0, 30.0], [0.5, 0.5, 0.5, 0.5]).unwrap();
        let moved = tilted_square().transformed(&pose);
        let fit = moved.fit().unwrap();
        assert!(fit.mse < 1e-9);
        let expected = pose.transform_point([0.0, 0.0, 2.0]);
        assert!(subtract(fit.centroid, expected).iter().all(|difference| difference.abs() < 1e-9));
    }

    #[test]
    fn no_points_no_plane() {
        assert_eq!(Moments::default().fit(), None);
        let mut one_place = Moments::default();
        one_place.add_point([0.0, 0.0, 1.0], 1.0);
        assert_eq!(one_place.fit(), None);
    }
}
