use std::ops::{Add, Div, Mul, Sub};

use dymlm_core::vector3::{difference, dot, norm, unit};
use dymlm_core::{Plane, Pose};
use wide::f64x2;

use crate::linear_algebra::{Symmetric3, quadratic_form};

/// Sums over weighted points up to second order, which is all that a least-squares plane needs. They can be
/// added and subtracted, so a plane of two sets of points costs the same as one of two points.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Moments {
    /// Sum of weights.
    pub(crate) weight: f64,
    /// Sums of w x, w y, w z.
    pub(crate) first: [f64; 3],
    /// Sums of w xx, w xy, w xz, w yy, w yz, w zz.
    pub(crate) second: Symmetric3,
}

/// Weighted sums over points z (a, b, 1) of one row of an image. They share b, which is therefore multiplied
/// in once per row, not once per point.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RowSums {
    pub(crate) weight: f64,
    pub(crate) z: f64,
    pub(crate) az: f64,
    pub(crate) zz: f64,
    pub(crate) azz: f64,
    pub(crate) aazz: f64,
}

/// A least-squares plane.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Fit {
    pub(crate) centroid: [f64; 3],
    /// Unit normal towards the origin of the frame, the camera.
    pub(crate) normal: [f64; 3],
    /// Weighted mean of squared distances, square metres.
    pub(crate) mse: f64,
    /// Weighted mean of squared distances along the optical axis (z), square metres.
    pub(crate) depth_mse: f64,
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

    /// The moments of points z (a, b, 1) of one row.
    #[inline]
    pub(crate) fn of_row(b: f64, sums: RowSums) -> Self {
        let RowSums { weight, z, az, zz, azz, aazz } = sums;
        Self { weight, first: [az, b * z, z], second: [aazz, b * azz, azz, b * b * zz, b * zz, zz] }
    }

    #[cfg(test)]
    pub(crate) fn add_point(&mut self, [x, y, z]: [f64; 3], weight: f64) {
        self.add(&Self {
            weight,
            first: [weight * x, weight * y, weight * z],
            second: [x * x, x * y, x * z, y * y, y * z, z * z].map(|product| weight * product),
        });
    }

    #[inline]
    pub(crate) fn centroid(&self) -> [f64; 3] {
        let share = 1.0 / self.weight;
        self.first.map(|sum| share * sum)
    }

    #[inline]
    pub(crate) fn covariance(&self) -> Symmetric3 {
        self.covariance_about(self.centroid())
    }

    #[inline]
    fn covariance_about(&self, centroid: [f64; 3]) -> Symmetric3 {
        covariance_about(1.0 / self.weight, centroid, &self.second)
    }

    /// Mean of squared distances of these points and of some others from their common plane, that of
    /// [`Moments::fit`].
    #[inline]
    pub(crate) fn mse_with(&self, other: &Self) -> f64 {
        let Self { weight, first, second } = self.plus(other);
        mean_square([1.0, weight], first, &second).max(0.0)
    }

    /// [`Self::mse_with`] of two sets of others, side by side: the same bits in less time.
    #[inline]
    pub(crate) fn mse_with_each(&self, [a, b]: [&Self; 2]) -> [f64; 2] {
        let lanes = |own: f64, of: fn(&Self, usize) -> f64, i: usize| {
            f64x2::splat(own) + f64x2::from([of(a, i), of(b, i)])
        };
        let weight = lanes(self.weight, |moments, _| moments.weight, 0);
        let first = std::array::from_fn(|i| lanes(self.first[i], |moments, i| moments.first[i], i));
        let second = std::array::from_fn(|i| lanes(self.second[i], |moments, i| moments.second[i], i));
        mean_square([f64x2::ONE, weight], first, &second).to_array().map(|mse| mse.max(0.0))
    }

    /// Mean of squared distances from a given plane.
    #[inline]
    pub(crate) fn mse_about(&self, normal: [f64; 3], point: [f64; 3]) -> f64 {
        let offset = dot(normal, difference(self.centroid(), point));
        quadratic_form(&self.covariance(), normal).max(0.0) + offset * offset
    }

    /// The best plane for noise along the ray from the origin, the camera, to the centroid. `None` when the
    /// points define no plane (too few, on a line, at one place, or only on planes through the camera) or are
    /// not finite.
    ///
    /// A depth camera errs along its rays. Far away the noise of a block is as large as the block, and least
    /// squares across the plane would find planes that stand along the ray. Minimizing n' C n / (n . r)^2
    /// instead, for covariance C and ray r, gives n = C^-1 r in closed form; the adjugate is used in place of
    /// the inverse, because it stays finite for flat points.
    pub(crate) fn fit(&self) -> Option<Fit> {
        if self.weight.is_nan() || self.weight <= 0.0 {
            return None;
        }
        let centroid = self.centroid();
        let covariance = self.covariance_about(centroid);
        let (direction, determinant) = adjugate_times(&covariance, centroid);
        let largest = covariance[0] + covariance[3] + covariance[5];
        // The adjugate of a small block is of the order of its side to the fourth power.
        let normal = unit(direction.map(|x| x / (largest * largest)))?;
        let along = dot(normal, centroid);
        let flat = dot(direction, direction) > (1e-12 * largest * largest * norm(centroid)).powi(2);
        if !(flat && along.abs() > 1e-9 * norm(centroid)) {
            return None;
        }
        let mse = (determinant * dot(direction, centroid) / dot(direction, direction)).max(0.0);
        let slant = along / centroid[2];
        let depth_mse = mse / (slant * slant);
        let normal = if along > 0.0 { normal.map(|n| -n) } else { normal };
        Some(Fit { centroid, normal, mse, depth_mse })
    }

    /// The moments of the moved points x' = R x + t.
    pub(crate) fn transformed(&self, a_from_b: &Pose) -> Self {
        if self.weight <= 0.0 {
            return *self;
        }
        // Computed about the centroid, where no large numbers cancel.
        let covariance = rotated(&self.covariance(), &a_from_b.rotation_matrix());
        Self::from_covariance(self.weight, a_from_b.transform_point(self.centroid()), &covariance)
    }

    /// The moments of the same points with weights multiplied by a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self {
            weight: factor * self.weight,
            first: self.first.map(|sum| factor * sum),
            second: self.second.map(|sum| factor * sum),
        }
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
    /// The plane in Hessian form; never `None` for a fit of finite points.
    pub(crate) fn plane(&self) -> Option<Plane> {
        Plane::new(self.normal, -dot(self.normal, self.centroid)).ok()
    }
}

/// A number, or several side by side.
trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> {}

impl<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Div<Output = T>> Lanes for T {}

/// Mean of squared distances from the plane of [`Moments::fit`], from one and the sum of weights, and the
/// sums of first and second order; 0 / 0 for points on a line towards the camera, which define no plane.
#[inline]
fn mean_square<T: Lanes>([one, weight]: [T; 2], first: [T; 3], second: &[T; 6]) -> T {
    let share = one / weight;
    let centroid = first.map(|sum| share * sum);
    let covariance = covariance_about(share, centroid, second);
    let (direction, determinant) = adjugate_times(&covariance, centroid);
    determinant * product(direction, centroid) / product(direction, direction)
}

/// The covariance for a known centroid; `share` is 1 / the sum of weights. It uses one division instead of
/// nine, because clustering computes it for every pair.
#[inline]
fn covariance_about<T: Lanes>(share: T, [x, y, z]: [T; 3], second: &[T; 6]) -> [T; 6] {
    let [xx, xy, xz, yy, yz, zz] = second.map(|sum| share * sum);
    [xx - x * x, xy - x * y, xz - x * z, yy - y * y, yz - y * z, zz - z * z]
}

/// The scalar product.
#[inline]
fn product<T: Lanes>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// adj(A) r and det(A), for A^-1 r = adj(A) r / det(A); A is symmetric.
#[inline]
fn adjugate_times<T: Lanes>(matrix: &[T; 6], r: [T; 3]) -> ([T; 3], T) {
    let [xx, xy, xz, yy, yz, zz] = *matrix;
    let adjugate = [
        yy * zz - yz * yz,
        xz * yz - xy * zz,
        xy * yz - xz * yy,
        xx * zz - xz * xz,
        xy * xz - xx * yz,
        xx * yy - xy * xy,
    ];
    let [a, b, c, d, e, f] = adjugate;
    let determinant = xx * a + xy * b + xz * c;
    let product =
        [a * r[0] + b * r[1] + c * r[2], b * r[0] + d * r[1] + e * r[2], c * r[0] + e * r[1] + f * r[2]];
    (product, determinant)
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
        assert!(difference(fit.normal, expected).iter().all(|difference| difference.abs() < 1e-9));
        assert!(fit.mse < 1e-12 && (fit.centroid[2] - 2.0).abs() < 1e-12);
        assert!(fit.plane().unwrap().d() > 0.0);
    }

    #[test]
    fn moves_with_its_points() {
        let pose = Pose::new([1.0, -2.0, 30.0], [0.5, 0.5, 0.5, 0.5]).unwrap();
        let moved = tilted_square().transformed(&pose);
        let fit = moved.fit().unwrap();
        assert!(fit.mse < 1e-9, "{fit:?}");
        let expected = pose.transform_point([0.0, 0.0, 2.0]);
        assert!(difference(fit.centroid, expected).iter().all(|difference| difference.abs() < 1e-9));
    }

    #[test]
    fn noise_along_the_ray_does_not_turn_the_plane() {
        // A block of 6 cm at 3 m, tilted by 30 degrees, with noise of 3 cm in depth: least squares across the
        // plane would find a plane along the ray.
        let slope = 30_f64.to_radians().tan();
        let mut moments = Moments::default();
        for i in -5..=5 {
            for j in -5..=5 {
                let noise = 0.03 * if (i + j) % 2 == 0 { 1.0 } else { -1.0 };
                let (a, b) = (0.002 * f64::from(i), 0.002 * f64::from(j));
                let z = 3.0 / (1.0 - slope * a) + noise;
                moments.add_point([a * z, b * z, z], 1.0);
            }
        }
        let fit = moments.fit().unwrap();
        assert!((fit.normal[0] - 0.5).abs() < 0.03 && (fit.normal[2] + 0.866).abs() < 0.02, "{fit:?}");
        assert!((fit.depth_mse.sqrt() - 0.03).abs() < 1e-3);
        let none = Moments::default();
        assert!((moments.mse_with(&none) - fit.mse).abs() < 1e-12);
        let square = tilted_square();
        let each = [&none, &square].map(|other| moments.mse_with(other));
        assert_eq!(moments.mse_with_each([&none, &square]), each);
    }

    #[test]
    fn no_points_no_plane() {
        assert_eq!(Moments::default().fit(), None);
        let mut one_place = Moments::default();
        one_place.add_point([0.0, 0.0, 1.0], 1.0);
        assert_eq!(one_place.fit(), None);
    }
}
