use dymlm_core::vector3::{Vector3, any_across, combined, cross, dot, norm, with_positive_greatest};
use dymlm_core::{Point, Pose};

use super::OrientedBox;
use super::minimal::MinimalAxes;
use crate::finite::is_finite;
use crate::minimum_area_rectangle::{MinimumAreaRectangleScratch, minimum_area_rectangle_with};
use crate::principal_axes::PrincipalAxes;

/// How [`fit_oriented_box`] orients the box.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum BoxFit {
    /// Along the [`PrincipalAxes`], by descending variance: the paper's eq. 6. Robust, but turned by uneven
    /// sampling, and by up to 45 degrees when the footprint is nearly square.
    PrincipalAxes,
    /// The third principal axis, and across it the sides of the footprint's
    /// [`minimum_area_rectangle`](crate::minimum_area_rectangle()), the longer first: the paper's eq. 7 and
    /// 8.
    MinimumRectangle,
    /// The box of least volume, its sides by descending length; no direction needs to be known. Local
    /// searches from all over the rotations find it within a small fraction of a per cent of the least
    /// volume; no bound is proven. Points in a plane, to rounding, get the
    /// [`MinimumRectangle`](Self::MinimumRectangle).
    ///
    /// O(n), the convex hull of the points that are not clearly inside (quickhull), and some thousands of
    /// boxes around the hull, each found by steps from vertex to vertex.
    MinimumVolume,
    /// The [`MinimumRectangle`](Self::MinimumRectangle) about a known direction, for example the normal of
    /// the plane that the thing stands on: that direction, of any length, is the box's third axis, whatever
    /// the points say.
    Upright {
        /// Direction of the box's third axis.
        up: [f64; 3],
    },
}

/// The box around a cloud, with axes chosen by `fit`; `None` without a finite point, without an upward
/// direction where one is asked for, or when the points are more than [`OrientedBox::MAX_LENGTH`] apart.
///
/// The box [`contains`](OrientedBox::contains) every finite point: its lengths are rounded up, by some 1e-15
/// of the coordinates. The component of greatest magnitude is positive in the first two axes, with
/// [`Upright`](BoxFit::Upright) in the first. The axes are right-handed. Points at one place, on a line or in
/// a plane have boxes without length, width or height. Points that are not finite are skipped.
///
/// O(n), and the convex hull of the footprint.
///
/// ```
/// use dymlm_geometry::{BoxFit, fit_oriented_box};
///
/// // A brick on a table, seen from above: its top face only.
/// let points: Vec<[f32; 3]> = (0..200).map(|i| [0.01 * (i % 20) as f32, 0.01 * (i / 20) as f32, 0.75]).collect();
/// let brick = fit_oriented_box(&points, BoxFit::Upright { up: [0.0, 0.0, 1.0] }).expect("finite points");
/// assert!((brick.lengths()[0] - 0.19).abs() < 1e-6 && (brick.lengths()[1] - 0.09).abs() < 1e-6);
/// assert!(points.iter().all(|point| brick.contains(point.map(f64::from))));
/// ```
pub fn fit_oriented_box(points: &[Point], fit: BoxFit) -> Option<OrientedBox> {
    fit_oriented_box_with(points, fit, &mut OrientedBoxScratch::default())
}

/// [`fit_oriented_box`] with a caller's working memory, whose content does not matter: allocates nothing once
/// it has grown.
pub fn fit_oriented_box_with(
    points: &[Point],
    fit: BoxFit,
    scratch: &mut OrientedBoxScratch,
) -> Option<OrientedBox> {
    match fit {
        BoxFit::PrincipalAxes => {
            let PrincipalAxes { centroid, axes, .. } = PrincipalAxes::of(points)?;
            around(points, centroid, axes)
        }
        BoxFit::MinimumRectangle => on_rectangle(points, &PrincipalAxes::of(points)?, scratch),
        BoxFit::MinimumVolume => {
            let principal = PrincipalAxes::of(points)?;
            match scratch.minimal.find(points, &principal) {
                Some(axes) => around(points, principal.centroid, axes),
                None => on_rectangle(points, &principal, scratch),
            }
        }
        BoxFit::Upright { up } => {
            let up = direction(up)?;
            let origin = points.iter().find(|point| is_finite(point))?.map(f64::from);
            let across = any_across(up);
            let axes = [across, cross(up, across), up];
            let [long, _, _] = sides_across(points, origin, axes, scratch)?.map(with_positive_greatest);
            around(points, origin, [long, cross(up, long), up])
        }
    }
}

/// Working memory of [`fit_oriented_box_with`].
#[derive(Debug, Clone, Default)]
pub struct OrientedBoxScratch {
    footprint: Vec<[f64; 2]>,
    rectangle: MinimumAreaRectangleScratch,
    minimal: MinimalAxes,
}

/// The box along the third principal axis and the sides of the footprint's rectangle.
fn on_rectangle(
    points: &[Point],
    principal: &PrincipalAxes,
    scratch: &mut OrientedBoxScratch,
) -> Option<OrientedBox> {
    let PrincipalAxes { centroid, axes, .. } = *principal;
    let [long, _, _] = sides_across(points, centroid, axes, scratch)?.map(with_positive_greatest);
    let middle = with_positive_greatest(cross(axes[2], long));
    around(points, centroid, [long, middle, cross(long, middle)])
}

/// The directions of the footprint's longer and shorter side, and the third axis.
fn sides_across(
    points: &[Point],
    origin: Vector3,
    axes: [Vector3; 3],
    scratch: &mut OrientedBoxScratch,
) -> Option<[Vector3; 3]> {
    let [u, v, w] = axes;
    scratch.footprint.clear();
    scratch.footprint.extend(finite(points).map(|point| {
        let point = difference(point, origin);
        [dot(u, point), dot(v, point)]
    }));
    let rectangle = minimum_area_rectangle_with(&scratch.footprint, &mut scratch.rectangle)?;
    let ([a, b], [c, d]) = (rectangle.axis, rectangle.cross_axis());
    Some([combined(a, u, b, v), combined(c, u, d, v), w])
}

/// The box along given axes.
fn around(points: &[Point], origin: Vector3, axes: [Vector3; 3]) -> Option<OrientedBox> {
    let Range { min, max } = Range::of(points, origin, axes);
    let middle: Vector3 = std::array::from_fn(|axis| f64::midpoint(min[axis], max[axis]));
    let offset = combined(1.0, combined(middle[0], axes[0], middle[1], axes[1]), middle[2], axes[2]);
    let center = combined(1.0, origin, 1.0, offset);
    let lengths = std::array::from_fn(|axis| max[axis] - min[axis]);
    // Columns of the matrix are the axes.
    let rows = std::array::from_fn(|row| axes.map(|axis| axis[row]));
    let world_from_box = Pose::from_rotation_matrix(rows, center).ok()?;
    OrientedBox::new(world_from_box, rounded_up(lengths, center)).ok()
}

/// Number of points that are taken together; where one of them is not finite, they are taken one by one.
const BLOCK: usize = 256;

/// Number of points side by side in vector registers.
const LANES: usize = 2;

/// The least and the greatest coordinates of finite points along three axes.
#[derive(Clone, Copy)]
struct Range {
    min: Vector3,
    max: Vector3,
}

impl Range {
    const NOTHING: Self = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    fn of(points: &[Point], origin: Vector3, axes: [Vector3; 3]) -> Self {
        let blocks = points.chunks(BLOCK).map(|block| {
            let (chunks, rest) = block.as_chunks::<LANES>();
            let along = chunks.iter().fold(Lanes::NOTHING, |lanes, chunk| lanes.with(chunk, origin, axes));
            match along.joined() {
                Some(range) => range.with_each(rest, origin, axes),
                None => Self::NOTHING.with_each(block, origin, axes),
            }
        });
        blocks.fold(Self::NOTHING, |a, b| a.with(b.min, b.max))
    }

    fn with_each(self, points: &[Point], origin: Vector3, axes: [Vector3; 3]) -> Self {
        finite(points).fold(self, |range, point| {
            let point = difference(point, origin);
            let along = axes.map(|axis| dot(axis, point));
            range.with(along, along)
        })
    }

    fn with(self, low: Vector3, high: Vector3) -> Self {
        Self { min: least(self.min, low), max: greatest(self.max, high) }
    }
}

/// The [`Range`] of each lane's points, and sums that are 0 when all points are finite.
#[derive(Clone, Copy)]
struct Lanes {
    min: [[f64; LANES]; 3],
    max: [[f64; LANES]; 3],
    not_finite: [f64; LANES],
}

impl Lanes {
    const NOTHING: Self = Self {
        min: [[f64::INFINITY; LANES]; 3],
        max: [[f64::NEG_INFINITY; LANES]; 3],
        not_finite: [0.0; LANES],
    };

    #[inline]
    fn with(self, points: &[Point; LANES], origin: Vector3, axes: [Vector3; 3]) -> Self {
        let Self { mut min, mut max, mut not_finite } = self;
        let coordinate = |axis: usize| -> [f64; LANES] {
            std::array::from_fn(|lane| f64::from(points[lane][axis]) - origin[axis])
        };
        let (x, y, z) = (coordinate(0), coordinate(1), coordinate(2));
        for axis in 0..3 {
            let [a, b, c] = axes[axis];
            let along: [f64; LANES] = std::array::from_fn(|lane| a * x[lane] + b * y[lane] + c * z[lane]);
            min[axis] = least(min[axis], along);
            max[axis] = greatest(max[axis], along);
        }
        for lane in 0..LANES {
            // NaN for NaN and the infinities.
            not_finite[lane] += 0.0 * x[lane] + 0.0 * y[lane] + 0.0 * z[lane];
        }
        Self { min, max, not_finite }
    }

    /// `None` when a point is not finite.
    fn joined(&self) -> Option<Range> {
        let all_finite = self.not_finite.iter().all(|&sum| sum == 0.0);
        all_finite.then(|| Range {
            min: self.min.map(|lanes| lanes.into_iter().fold(f64::INFINITY, f64::min)),
            max: self.max.map(|lanes| lanes.into_iter().fold(f64::NEG_INFINITY, f64::max)),
        })
    }
}

#[inline]
fn least<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    std::array::from_fn(|i| if b[i] < a[i] { b[i] } else { a[i] })
}

#[inline]
fn greatest<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    std::array::from_fn(|i| if b[i] > a[i] { b[i] } else { a[i] })
}

/// Lengths enlarged by the rounding of the pose and of its application to the points; each rounding is some
/// units in the last place of the greatest coordinate.
fn rounded_up(lengths: Vector3, center: Vector3) -> Vector3 {
    const ROUNDINGS: u8 = 16;
    let greatest = lengths.into_iter().chain(center.map(f64::abs)).fold(0.0, f64::max);
    lengths.map(|length| length + f64::from(ROUNDINGS) * f64::EPSILON * greatest)
}

fn direction(vector: Vector3) -> Option<Vector3> {
    // Scaled by the greatest component first, so that squares neither overflow nor vanish.
    let greatest = vector.into_iter().fold(0.0, |greatest: f64, x| greatest.max(x.abs()));
    let scaled = vector.map(|x| x / greatest);
    let length = norm(scaled);
    length.is_finite().then(|| scaled.map(|x| x / length))
}

fn finite(points: &[Point]) -> impl Iterator<Item = &Point> {
    points.iter().filter(|point| is_finite(point))
}

#[inline]
fn difference(point: &Point, origin: Vector3) -> Vector3 {
    std::array::from_fn(|axis| f64::from(point[axis]) - origin[axis])
}
