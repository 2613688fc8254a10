use dymlm_core::vector3::{along, difference, dot, unit};
use dymlm_core::{BoundingBox, PinholeCamera, Point, Pose, symmetric_eigen3};

use crate::Error;

/// Number of cells along the longest side to which a cloud is thinned.
const CELLS: f32 = 40.0;
/// Number of neighbours from which a normal is estimated.
const NEIGHBOURS: usize = 16;
/// Fewer points do not make a surface.
const LEAST_POINTS: usize = 12;
/// Number of points on an ellipsoid.
const ELLIPSOID_POINTS: usize = 1200;

/// The surface of an object in its own frame: points with outward normals.
///
/// ```
/// use dymlm_tracking::ObjectModel;
///
/// let book = ObjectModel::cuboid([0.24, 0.17, 0.03])?;
/// assert!(book.surface().iter().all(|point| point.position[0].abs() <= 0.1201));
/// # Ok::<(), dymlm_tracking::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectModel {
    surface: Vec<SurfacePoint>,
    low: [f64; 3],
    high: [f64; 3],
}

/// A point of an object's surface.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SurfacePoint {
    /// Position in the object's frame, metres.
    pub position: [f64; 3],
    /// Unit normal, outwards.
    pub normal: [f64; 3],
}

impl ObjectModel {
    /// A model from the object's cloud in its own frame, whose origin should be near the object's centre. The
    /// cloud is thinned to cells of 1/40 of its longest side. Normals come from the 16 nearest points and
    /// face away from the middle. Points that are not finite are ignored. O(points + cells^2).
    ///
    /// # Errors
    ///
    /// [`Error::ModelPoints`] when fewer than 12 cells hold a point.
    pub fn from_points(points: &[Point]) -> Result<Self, Error> {
        let finite: Vec<Point> = points.iter().copied().filter(|p| p.iter().all(|x| x.is_finite())).collect();
        let (low, high) = bounds(&finite);
        let longest = (0..3).map(|i| high[i] - low[i]).fold(0.0_f32, f32::max);
        if !(longest > 0.0 && longest.is_finite()) {
            return Err(Error::ModelPoints { points: finite.len().min(1), least: LEAST_POINTS });
        }
        let thin = thinned(&finite, low, longest / CELLS);
        if thin.len() < LEAST_POINTS {
            return Err(Error::ModelPoints { points: thin.len(), least: LEAST_POINTS });
        }
        let middle: [f64; 3] = std::array::from_fn(|i| 0.5 * f64::from(low[i] + high[i]));
        let surface = thin
            .iter()
            .map(|&position| SurfacePoint { position, normal: normal_at(&thin, position, middle) })
            .collect();
        Ok(Self { surface, low: low.map(f64::from), high: high.map(f64::from) })
    }

    /// A cuboid of the given full lengths around the origin.
    ///
    /// # Errors
    ///
    /// [`Error::ModelPoints`] when a length is not within 1e-4..=100 m.
    pub fn cuboid(lengths: [f64; 3]) -> Result<Self, Error> {
        check_lengths(lengths)?;
        let half = lengths.map(|l| 0.5 * l);
        let step = lengths.iter().copied().fold(0.0, f64::max) / f64::from(CELLS);
        let mut surface = Vec::new();
        for axis in 0..3 {
            let [b, c] = [(axis + 1) % 3, (axis + 2) % 3];
            let [nb, nc] = [b, c].map(|i| (lengths[i] / step).round().max(1.0) as usize);
            let at =
                |i: usize, count: usize, side: usize| ((i as f64 + 0.5) / count as f64 - 0.5) * lengths[side];
            for sign in [-1.0, 1.0] {
                for (i, j) in (0..nb).flat_map(|i| (0..nc).map(move |j| (i, j))) {
                    let (mut position, mut normal) = ([0.0; 3], [0.0; 3]);
                    (position[axis], position[b], position[c]) =
                        (sign * half[axis], at(i, nb, b), at(j, nc, c));
                    normal[axis] = sign;
                    surface.push(SurfacePoint { position, normal });
                }
            }
        }
        Ok(Self { surface, low: half.map(|h| -h), high: half })
    }

    /// An ellipsoid of the given full lengths around the origin.
    ///
    /// # Errors
    ///
    /// [`Error::ModelPoints`] when a length is not within 1e-4..=100 m.
    pub fn ellipsoid(lengths: [f64; 3]) -> Result<Self, Error> {
        check_lengths(lengths)?;
        let half = lengths.map(|l| 0.5 * l);
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let surface = (0..ELLIPSOID_POINTS)
            .filter_map(|i| {
                let z = 1.0 - 2.0 * (i as f64 + 0.5) / ELLIPSOID_POINTS as f64;
                let radius = (1.0 - z * z).sqrt();
                let (sin, cos) = (golden * i as f64).sin_cos();
                let on_sphere = [radius * cos, radius * sin, z];
                let normal = unit(std::array::from_fn(|axis| on_sphere[axis] / half[axis]))?;
                Some(SurfacePoint {
                    position: std::array::from_fn(|axis| on_sphere[axis] * half[axis]),
                    normal,
                })
            })
            .collect();
        Ok(Self { surface, low: half.map(|h| -h), high: half })
    }

    /// The points of the surface.
    pub fn surface(&self) -> &[SurfacePoint] {
        &self.surface
    }

    /// The lowest and the highest corner of the box around the surface, object frame, metres.
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        [self.low, self.high]
    }

    /// Half of the longest side of the bounds, metres.
    pub(super) fn reach(&self) -> f64 {
        (0..3).map(|i| 0.5 * (self.high[i] - self.low[i])).fold(0.0, f64::max)
    }

    /// Approximate distance between neighbouring points, metres.
    pub(super) fn spacing(&self) -> f64 {
        2.0 * self.reach() / f64::from(CELLS)
    }

    /// The eight corners of the bounds, object frame.
    pub(super) fn corners(&self) -> [[f64; 3]; 8] {
        std::array::from_fn(|k| {
            std::array::from_fn(|i| if k >> i & 1 == 0 { self.low[i] } else { self.high[i] })
        })
    }

    /// The smallest box around the projected corners, pixels; `None` when one of them is behind the camera.
    pub(super) fn bounds_in_image(
        &self,
        camera: &PinholeCamera,
        camera_from_object: &Pose,
    ) -> Option<BoundingBox> {
        let mut sides = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for corner in self.corners() {
            let [u, v] = camera.project(camera_from_object.transform_point(corner))?;
            sides = [sides[0].min(u), sides[1].min(v), sides[2].max(u), sides[3].max(v)];
        }
        // Boxes are half-open: plus half a pixel from pixel to box coordinates, and half a pixel on each
        // side.
        let [x_min, y_min, x_max, y_max] = sides.map(|side| side as f32);
        BoundingBox::new(x_min, y_min, x_max + 1.0, y_max + 1.0).ok()
    }

    /// Whether a point of the object frame lies in the bounds, widened by `margin` metres.
    pub(super) fn contains(&self, point: [f64; 3], margin: f64) -> bool {
        (0..3).all(|i| (self.low[i] - margin..=self.high[i] + margin).contains(&point[i]))
    }

    /// The points that face the camera, with their positions in its frame.
    pub(super) fn facing(
        &self,
        camera_from_object: &Pose,
    ) -> impl Iterator<Item = (&SurfacePoint, [f64; 3])> {
        let eye = camera_from_object.inverse().translation();
        let pose = *camera_from_object;
        self.surface.iter().filter_map(move |point| {
            let to_eye = unit(difference(eye, point.position))?;
            (dot(to_eye, point.normal) > 0.0).then(|| (point, pose.transform_point(point.position)))
        })
    }
}

fn check_lengths(lengths: [f64; 3]) -> Result<(), Error> {
    // Nothing that is carried is thinner than a hundred micrometres or longer than a hundred metres.
    if lengths.iter().all(|l| (1e-4..=100.0).contains(l)) {
        Ok(())
    } else {
        Err(Error::ModelPoints { points: 0, least: LEAST_POINTS })
    }
}

fn bounds(points: &[Point]) -> (Point, Point) {
    points.iter().fold(([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]), |(low, high), p| {
        (std::array::from_fn(|i| low[i].min(p[i])), std::array::from_fn(|i| high[i].max(p[i])))
    })
}

/// The mean of the points in each cell, in the order of the cells.
fn thinned(points: &[Point], low: Point, cell: f32) -> Vec<[f64; 3]> {
    let key = |p: &Point| -> [u16; 3] { std::array::from_fn(|i| ((p[i] - low[i]) / cell) as u16) };
    let mut keyed: Vec<([u16; 3], Point)> = points.iter().map(|p| (key(p), *p)).collect();
    // A stable sort: points of a cell keep their order.
    keyed.sort_by_key(|(key, _)| *key);
    keyed
        .chunk_by(|a, b| a.0 == b.0)
        .map(|chunk| {
            let share = 1.0 / chunk.len() as f64;
            std::array::from_fn(|i| chunk.iter().map(|(_, p)| f64::from(p[i])).sum::<f64>() * share)
        })
        .collect()
}

/// The direction of least spread among the nearest points, oriented away from `middle`.
fn normal_at(points: &[[f64; 3]], at: [f64; 3], middle: [f64; 3]) -> [f64; 3] {
    let apart = |p: &[f64; 3]| {
        let d = difference(*p, at);
        dot(d, d)
    };
    let mut near: Vec<(f64, usize)> = points.iter().enumerate().map(|(i, p)| (apart(p), i)).collect();
    let count = NEIGHBOURS.min(near.len());
    near.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    near.truncate(count);
    near.sort_by_key(|&(_, i)| i);
    let mean = near.iter().fold([0.0; 3], |sum, &(_, i)| along(sum, 1.0 / count as f64, points[i]));
    let mut spread = [[0.0; 3]; 3];
    for &(_, i) in &near {
        let d = difference(points[i], mean);
        for (row, x) in spread.iter_mut().zip(d) {
            *row = along(*row, x, d);
        }
    }
    let outwards = difference(at, middle);
    // Never fails: points of a cloud are finite, and so is their spread.
    let normal = symmetric_eigen3(spread).map_or(outwards, |eigen| eigen.vectors[2]);
    if dot(normal, outwards) < 0.0 { normal.map(|x| -x) } else { normal }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_a_body_faces_the_camera() {
        let pose = Pose::new([0.0, 0.0, 50.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let ball = ObjectModel::ellipsoid([0.1; 3]).unwrap();
        let facing = ball.facing(&pose).count();
        assert!(facing.abs_diff(600) < 20, "{facing}");
        assert!(ball.facing(&pose).all(|(_, seen)| seen[2] < 50.001));
    }
}
