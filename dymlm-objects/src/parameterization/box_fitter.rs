use dymlm_core::vector3::{Vector3, along, any_across, cross, dot, unit};
use dymlm_core::{ConfigError, Plane, Point, Pose, check_range};
use dymlm_geometry::{MinimumAreaRectangleScratch, OrientedBox, PrincipalAxes, minimum_area_rectangle_with};

use super::edge_alignment::EdgeAlignment;
use crate::UprightPose;

/// Settings of [`BoxFitter`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct BoxFitterConfig {
    /// Whether an upright box is turned so that the lines of its footprint run along its sides, instead of to
    /// the smallest rectangle. Default false, as in the paper; the objects of the map are fitted with true:
    /// around an L, a thing seen at a corner, the rectangle on the long side and the one on the diagonal have
    /// the same area, and the smallest around a screen and its foot is turned against the screen.
    pub along_edges: bool,
    /// Share of the points that is left out at each end of each axis, 0..=0.2. Default 0: the extent of all
    /// points, as in the paper.
    pub trim: f64,
}

/// The minimum-area rectangle corrects the yaw when its area is below this share of the area along the
/// principal axes. Near-square footprints, clusters and outliers, whose principal axes are arbitrary, gain 5
/// to 50 %; a smaller gain is noise.
const RECTANGLE_GAIN: f64 = 0.97;

impl Default for BoxFitterConfig {
    fn default() -> Self {
        Self { along_edges: false, trim: 0.0 }
    }
}

impl BoxFitterConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("trim", self.trim, 0.0..=0.2)
    }
}

/// Fits an oriented box around points: the paper's object parameterization O = {R, t, s}.
///
/// - **Principal axes** (eq. 6): the covariance's eigenvectors by descending eigenvalue, right-handed, with
///   fixed signs; extents along them; the centre in the middle of the extents.
/// - **Minimum-area rectangle** (eq. 7, 8, corrected: directions are rotated, not translated): in the plane
///   of the two long axes it corrects the yaw where its area is markedly smaller.
/// - **Vertical axis**: with only one or two faces in view the third principal axis is wrong; when the
///   vertical is known from a supporting plane, it becomes the third axis, and the footprint is fitted
///   perpendicular to it.
///
/// O(n log n) at worst, for the hull; no allocation once the scratch has grown.
///
/// ```
/// use dymlm_objects::{BoxFitter, BoxFitterConfig};
///
/// let mut points = Vec::new();
/// for i in 0..40 {
///     for j in 0..20 {
///         points.push([0.01 * i as f32, 0.01 * j as f32, 2.0]);
///     }
/// }
/// let fit = BoxFitter::new(BoxFitterConfig::default())?.fit(&points, None).expect("points");
/// let [length, width, height] = fit.oriented_box.lengths();
/// assert!((length - 0.39).abs() < 1e-6 && (width - 0.19).abs() < 1e-6 && height < 1e-6);
/// # Ok::<(), dymlm_core::ConfigError>(())
/// ```
#[derive(Debug, Clone)]
pub struct BoxFitter {
    config: BoxFitterConfig,
    rectangle: MinimumAreaRectangleScratch,
    edges: EdgeAlignment,
    footprint: Vec<[f64; 2]>,
    values: Vec<f64>,
}

/// A box around points.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct BoxFit {
    /// The box, in the points' frame. Its axes are sorted by descending variance; with a vertical, the third
    /// axis is the vertical. A correction of the yaw turns the first two.
    pub oriented_box: OrientedBox,
    /// How its axes were found.
    pub axes: BoxAxes,
}

/// How the axes of a box were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum BoxAxes {
    /// The principal axes.
    Principal,
    /// The principal axes, their yaw corrected by the minimum-area rectangle.
    Rectangle,
    /// The vertical, and the principal axes of the footprint.
    Vertical,
    /// The vertical, and the footprint's minimum-area rectangle.
    VerticalRectangle,
    /// The vertical, and the direction of the footprint's straight lines.
    VerticalEdges,
}

impl BoxAxes {
    /// Whether the third axis is the vertical.
    pub fn pose(self) -> UprightPose {
        match self {
            Self::Principal | Self::Rectangle => UprightPose::Unknown,
            Self::Vertical | Self::VerticalRectangle | Self::VerticalEdges => UprightPose::Upright,
        }
    }
}

impl BoxFit {
    /// The box extended down to the plane on which it stands, whose normal is the box's third axis; the upper
    /// side stays, and the box is at least `least_height` metres high. Unchanged when it would have no
    /// height.
    #[must_use]
    pub fn standing_on(self, plane: &Plane, least_height: f64) -> Self {
        let [length, width, own] = self.oriented_box.lengths();
        let pose = self.oriented_box.world_from_box();
        let middle = plane.signed_distance(pose.translation());
        let height = (middle + 0.5 * own).max(least_height);
        let center = along(pose.translation(), 0.5 * height - middle, plane.normal());
        let moved = Pose::new(center, pose.quaternion()).ok().filter(|_| height > 0.0);
        match moved.and_then(|pose| OrientedBox::new(pose, [length, width, height]).ok()) {
            Some(oriented_box) => Self { oriented_box, ..self },
            None => self,
        }
    }
}

impl BoxFitter {
    /// Checks the config and makes a fitter.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] names the field outside its range.
    pub fn new(config: BoxFitterConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        Ok(Self {
            config,
            rectangle: MinimumAreaRectangleScratch::default(),
            edges: EdgeAlignment::default(),
            footprint: Vec::new(),
            values: Vec::new(),
        })
    }

    /// The box around points; `None` when no point is finite. `vertical` is the normal of the plane on which
    /// they stand, a unit vector in the points' frame. Points that are not finite are ignored.
    pub fn fit(&mut self, points: &[Point], vertical: Option<[f64; 3]>) -> Option<BoxFit> {
        let principal = PrincipalAxes::of(points)?;
        let (frame, is_upright) = match vertical.and_then(unit) {
            Some(vertical) => (self.upright(points, &principal, vertical), true),
            None => (principal.axes, false),
        };
        let (frame, axes) = if is_upright && self.config.along_edges {
            self.aligned(points, principal.centroid, frame)
        } else {
            self.corrected(points, principal.centroid, frame, is_upright)
        };
        let oriented_box = self.bounds(points, principal.centroid, frame)?;
        Some(BoxFit { oriented_box, axes })
    }

    /// Axes with the third along `normal` and the first along the footprint's larger spread.
    fn upright(&mut self, points: &[Point], principal: &PrincipalAxes, normal: Vector3) -> [Vector3; 3] {
        let u = any_across(normal);
        let v = cross(normal, u);
        self.lay_footprint(points, principal.centroid, u, v);
        let [mut uu, mut uv, mut vv] = [0.0; 3];
        for &[x, y] in &self.footprint {
            (uu, uv, vv) = (uu + x * x, uv + x * y, vv + y * y);
        }
        let turn = 0.5 * (2.0 * uv).atan2(uu - vv);
        let (sin, cos) = turn.sin_cos();
        let long = [0, 1, 2].map(|k| cos * u[k] + sin * v[k]);
        let long = if dot(long, principal.axes[0]) < 0.0 { long.map(|c| -c) } else { long };
        [long, cross(normal, long), normal]
    }

    /// The axes rotated about the third to the minimum-area rectangle, if that makes the footprint markedly
    /// smaller.
    fn corrected(
        &mut self,
        points: &[Point],
        center: Vector3,
        axes: [Vector3; 3],
        is_upright: bool,
    ) -> ([Vector3; 3], BoxAxes) {
        let [long, wide, up] = axes;
        self.lay_footprint(points, center, long, wide);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for corner in &self.footprint {
            for axis in 0..2 {
                low[axis] = low[axis].min(corner[axis]);
                high[axis] = high[axis].max(corner[axis]);
            }
        }
        let area = (high[0] - low[0]) * (high[1] - low[1]);
        match minimum_area_rectangle_with(&self.footprint, &mut self.rectangle) {
            Some(rectangle) if rectangle.area() < RECTANGLE_GAIN * area => {
                let axes = turned([long, wide, up], rectangle.axis);
                (axes, if is_upright { BoxAxes::VerticalRectangle } else { BoxAxes::Rectangle })
            }
            _ => (axes, if is_upright { BoxAxes::Vertical } else { BoxAxes::Principal }),
        }
    }

    /// The axes rotated about the third so that the footprint's lines run along them.
    fn aligned(&mut self, points: &[Point], center: Vector3, axes: [Vector3; 3]) -> ([Vector3; 3], BoxAxes) {
        self.lay_footprint(points, center, axes[0], axes[1]);
        match self.edges.find(&self.footprint) {
            Some(axis) => (turned(axes, axis), BoxAxes::VerticalEdges),
            None => (axes, BoxAxes::Vertical),
        }
    }

    /// The points' coordinates along two axes, relative to a centre.
    fn lay_footprint(&mut self, points: &[Point], center: Vector3, u: Vector3, v: Vector3) {
        self.footprint.clear();
        self.footprint.extend(finite(points).map(|point| {
            let offset = [0, 1, 2].map(|k| point[k] - center[k]);
            [dot(offset, u), dot(offset, v)]
        }));
    }

    /// The box along given axes.
    fn bounds(&mut self, points: &[Point], center: Vector3, axes: [Vector3; 3]) -> Option<OrientedBox> {
        let (mut middle, mut lengths) = (center, [0.0; 3]);
        for (length, axis) in lengths.iter_mut().zip(axes) {
            self.values.clear();
            self.values
                .extend(finite(points).map(|point| dot([0, 1, 2].map(|k| point[k] - center[k]), axis)));
            let [low, high] = trimmed_extent(&mut self.values, self.config.trim)?;
            *length = high - low;
            let offset = f64::midpoint(low, high);
            middle = [0, 1, 2].map(|k| middle[k] + offset * axis[k]);
        }
        let rows = [0, 1, 2].map(|row| [axes[0][row], axes[1][row], axes[2][row]]);
        OrientedBox::new(Pose::from_rotation_matrix(rows, middle).ok()?, lengths).ok()
    }
}

/// Least and greatest value when the share `trim` is left out at each end; `None` when there are no values.
fn trimmed_extent(values: &mut [f64], trim: f64) -> Option<[f64; 2]> {
    let last = values.len().checked_sub(1)?;
    let left_out = ((trim * values.len() as f64) as usize).min(last / 2);
    let low = *values.select_nth_unstable_by(left_out, f64::total_cmp).1;
    let high = *values.select_nth_unstable_by(last - left_out, f64::total_cmp).1;
    Some([low, high])
}

/// Axes rotated about the third, so that the first points along `axis`, given in the first two.
fn turned([long, wide, up]: [Vector3; 3], [x, y]: [f64; 2]) -> [Vector3; 3] {
    let long = [0, 1, 2].map(|k| x * long[k] + y * wide[k]);
    [long, cross(up, long), up]
}

fn finite(points: &[Point]) -> impl Iterator<Item = Vector3> + '_ {
    points.iter().filter(|point| point.iter().all(|c| c.is_finite())).map(|point| point.map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outermost_are_left_out() {
        let mut values: Vec<f64> = (0..100).map(|k| f64::from(k * 37 % 100)).collect();
        assert_eq!(trimmed_extent(&mut values, 0.02), Some([2.0, 97.0]));
        assert_eq!(trimmed_extent(&mut [3.0, -1.0], 0.02), Some([-1.0, 3.0]));
        assert_eq!(trimmed_extent(&mut [], 0.02), None);
    }
}
