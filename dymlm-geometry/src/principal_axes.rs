use dymlm_core::vector3::Vector3;
use dymlm_core::{Point, symmetric_eigen3};

use crate::finite::is_finite;

/// Deviations below this many roundings of the coordinates count as 0.
const ROUNDINGS: u8 = 4;

/// Principal component analysis of a cloud: its centroid, its covariance, and the directions in which it
/// extends.
///
/// The axes are ordered by descending variance and right-handed. Their signs are those of
/// [`symmetric_eigen3`](dymlm_core::symmetric_eigen3()): of the first two, the component of greatest
/// magnitude is positive. Axes of equal variances are some basis of their space, the same on each call. Sums
/// are taken in f64 relative to a point of the cloud, so that its distance from the origin costs no digits.
/// Points that are not finite are skipped. O(n), without allocation.
///
/// Pearson: "On lines and planes of closest fit to systems of points in space", Philosophical Magazine 1901.
///
/// ```
/// use dymlm_geometry::PrincipalAxes;
///
/// let points = [[1.0, 0.0, 2.0], [3.0, 4.0, 2.0], [5.0, 8.0, 2.0]];
/// let line = PrincipalAxes::of(&points).expect("finite points");
/// assert_eq!(line.centroid, [3.0, 4.0, 2.0]);
/// assert_eq!(line.rank, 1);
/// assert!((line.axes[0][1] / line.axes[0][0] - 2.0).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PrincipalAxes {
    /// Mean of the points, metres.
    pub centroid: [f64; 3],
    /// Mean of the outer products of the points' differences from the centroid (divided by the number of
    /// points, not by one less), square metres.
    pub covariance: [[f64; 3]; 3],
    /// Unit eigenvectors of the covariance, in the order of the variances.
    pub axes: [[f64; 3]; 3],
    /// Variances along the axes, descending, at least 0, square metres.
    pub variances: [f64; 3],
    /// Number of axes along which the points extend beyond the rounding of their coordinates: 0 for one
    /// place, 1 for a line, 2 for a plane, else 3.
    pub rank: usize,
    /// Number of finite points.
    pub count: usize,
}

impl PrincipalAxes {
    /// The axes of a cloud; `None` when it has no finite point.
    pub fn of(points: &[Point]) -> Option<Self> {
        let origin = *points.iter().find(|point| is_finite(point))?;
        let mut moments = Moments::about(origin);
        for block in points.chunks(BLOCK) {
            moments.add_block(block);
        }
        moments.axes()
    }
}

/// Number of points that are added at once; where one of them is not finite, they are added one by one.
const BLOCK: usize = 256;

/// Number of points side by side in vector registers.
const LANES: usize = 2;

/// x, y, z, xx, xy, xz, yy, yz, zz.
const SUMS: usize = 9;

/// Sums over points, relative to an origin near them.
struct Moments {
    origin: Vector3,
    sums: [f64; SUMS],
    count: usize,
}

impl Moments {
    fn about(origin: Point) -> Self {
        Self { origin: origin.map(f64::from), sums: [0.0; SUMS], count: 0 }
    }

    fn add_block(&mut self, points: &[Point]) {
        let mut lanes = [[0.0; LANES]; SUMS];
        let (chunks, rest) = points.as_chunks::<LANES>();
        for chunk in chunks {
            add_terms(&mut lanes, *chunk, self.origin);
        }
        let sums = lanes.map(|lanes| lanes.iter().sum::<f64>());
        // Sums of finite f32 are finite; with a point that is not finite, one of the first three is not.
        if sums[..3].iter().all(|sum| sum.is_finite()) {
            for (sum, more) in self.sums.iter_mut().zip(sums) {
                *sum += more;
            }
            self.count += points.len() - rest.len();
            self.add_few(rest);
        } else {
            self.add_few(points);
        }
    }

    fn add_few(&mut self, points: &[Point]) {
        for point in points.iter().filter(|point| is_finite(point)) {
            self.add_point(*point);
        }
    }

    fn add_point(&mut self, point: Point) {
        let mut terms = [[0.0]; SUMS];
        add_terms(&mut terms, [point], self.origin);
        for (sum, [term]) in self.sums.iter_mut().zip(terms) {
            *sum += term;
        }
        self.count += 1;
    }

    fn axes(&self) -> Option<PrincipalAxes> {
        let [x, y, z, xx, xy, xz, yy, yz, zz] = self.sums.map(|sum| sum / self.count as f64);
        let (xy, xz, yz) = (xy - x * y, xz - x * z, yz - y * z);
        let covariance = [[xx - x * x, xy, xz], [xy, yy - y * y, yz], [xz, yz, zz - z * z]];
        let eigen = symmetric_eigen3(covariance)?;
        let variances = eigen.values.map(|value| value.max(0.0));
        let centroid = [self.origin[0] + x, self.origin[1] + y, self.origin[2] + z];
        Some(PrincipalAxes {
            centroid,
            covariance,
            axes: eigen.vectors,
            variances,
            rank: rank(centroid, variances),
            count: self.count,
        })
    }
}

/// Adds the terms of each point to the sums of its lane.
#[inline]
fn add_terms<const N: usize>(lanes: &mut [[f64; N]; SUMS], points: [Point; N], origin: Vector3) {
    let [x, y, z]: [[f64; N]; 3] =
        std::array::from_fn(|axis| points.map(|point| f64::from(point[axis]) - origin[axis]));
    let product = |a: [f64; N], b: [f64; N]| -> [f64; N] { std::array::from_fn(|lane| a[lane] * b[lane]) };
    let (xy, xz, yz) = (product(x, y), product(x, z), product(y, z));
    let terms = [x, y, z, product(x, x), xy, xz, product(y, y), yz, product(z, z)];
    for (sums, terms) in lanes.iter_mut().zip(terms) {
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum += term;
        }
    }
}

/// How many of the variances are more than the rounding of the coordinates.
fn rank(centroid: Vector3, variances: [f64; 3]) -> usize {
    let reach = centroid.into_iter().fold(variances[0].sqrt(), |reach, x| reach.max(x.abs()));
    let rounding = f64::from(ROUNDINGS) * f64::from(f32::EPSILON) * reach;
    variances.iter().filter(|variance| variance.sqrt() > rounding).count()
}
