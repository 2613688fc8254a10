use dymlm_core::{PinholeCamera, Pose, check_range};
use nalgebra::{Matrix6, Vector3, Vector6};

use super::observation::PoseObservation;
use super::step::{moved, step_between};
use crate::Error;

/// The influence of large residuals, in standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum RobustKernel {
    /// Least squares.
    None,
    /// The cost grows linearly beyond this many standard deviations; 1.345 has 95 % efficiency on normal
    /// noise.
    Huber(f64),
    /// Residuals beyond this many standard deviations have no influence; 4.685 has 95 % efficiency on normal
    /// noise.
    Tukey(f64),
}

impl RobustKernel {
    /// Weight of a residual of `r` standard deviations in the next least-squares step.
    fn weight(self, r: f64) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Huber(k) => {
                if r <= k {
                    1.0
                } else {
                    k / r
                }
            }
            Self::Tukey(k) => {
                let rest = (1.0 - (r / k) * (r / k)).max(0.0);
                rest * rest
            }
        }
    }

    /// Cost of a residual of `r` standard deviations.
    fn cost(self, r: f64) -> f64 {
        match self {
            Self::None => 0.5 * r * r,
            Self::Huber(k) => {
                if r <= k {
                    0.5 * r * r
                } else {
                    k * (r - 0.5 * k)
                }
            }
            Self::Tukey(k) => {
                let rest = (1.0 - (r / k) * (r / k)).max(0.0);
                k * k / 6.0 * (1.0 - rest * rest * rest)
            }
        }
    }

    fn limit(self) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Huber(k) | Self::Tukey(k) => k,
        }
    }
}

/// Largest number of steps of a refinement; from a start given by flow, three to six are needed.
const MOST_STEPS: usize = 20;
/// A smaller step, metres and radians, is the last.
const EPSILON: f64 = 1e-6;

impl Default for RobustKernel {
    /// Tukey's, at 95 % efficiency on normal noise.
    fn default() -> Self {
        Self::Tukey(4.685)
    }
}

/// Refines a pose to fit pixels, depths and surfaces, each weighted by its own standard deviation.
///
/// Levenberg-Marquardt on the pose's six parameters, weighted by the robust kernel (iteratively reweighted
/// least squares). O(observations x iterations). Directions that no observation constrains stay unchanged.
///
/// ```
/// use dymlm_core::{PinholeCamera, Pose};
/// use dymlm_tracking::{PoseObservation, PoseRefiner, RobustKernel};
///
/// let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5)?;
/// let truth = Pose::new([0.1, 0.0, 1.2], [0.0, 0.0, 0.0, 1.0])?;
/// let points = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.05], [0.0, 0.1, 0.0], [-0.1, -0.1, 0.02]];
/// let seen: Vec<_> = points
///     .iter()
///     .filter_map(|&point| {
///         let pixel = camera.project(truth.transform_point(point))?;
///         Some(PoseObservation::Pixel { point, pixel, sigma: 0.5 })
///     })
///     .collect();
/// let refiner = PoseRefiner::new(RobustKernel::default())?;
/// let start = Pose::new([0.1, 0.005, 1.21], [0.01, 0.0, 0.0, 1.0])?;
/// let found = refiner.refine(&camera, &start, &seen).ok_or("four points")?;
/// assert!(found.camera_from_body.distance(&truth) < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct PoseRefiner {
    kernel: RobustKernel,
}

/// A pose with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RefinedPose {
    /// The pose.
    pub camera_from_body: Pose,
    /// Covariance of (rotation about the camera's axes, radians; place of the body's origin, metres), by
    /// rows, from the curvature and the residuals at the end. `None` when the observations leave a direction
    /// undetermined.
    pub covariance: Option<[[f64; 6]; 6]>,
    /// Number of observations within three standard deviations.
    pub inliers: usize,
    /// Number of observations that could be used.
    pub used: usize,
    /// Number of steps.
    pub iterations: usize,
}

/// What is known of a pose before any observation.
#[derive(Debug, Clone)]
pub(crate) struct PosePrior {
    pub(crate) camera_from_body: Pose,
    /// Inverse covariance of (rotation, translation).
    pub(crate) information: Matrix6<f64>,
}

impl PosePrior {
    /// Squared Mahalanobis distance of a pose from the expected one, in standard deviations.
    pub(crate) fn squared_distance(&self, camera_from_body: &Pose) -> f64 {
        let step = step_between(&self.camera_from_body, camera_from_body);
        step.dot(&(self.information * step))
    }
}

/// The normal equations of one step.
struct Normal {
    matrix: Matrix6<f64>,
    gradient: Vector6<f64>,
    cost: f64,
    inliers: usize,
    used: usize,
    /// Weighted sum of squares and sum of weights, from which the actual noise is estimated.
    squares: f64,
    weights: f64,
}

impl PoseRefiner {
    /// A refiner with a robust kernel, whose limit is 0.1..=1000.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    pub fn new(kernel: RobustKernel) -> Result<Self, Error> {
        check_range("kernel", kernel.limit(), 0.1..=1000.0)?;
        Ok(Self { kernel })
    }

    /// The best pose `camera_from_body` near `start`; `None` with fewer than three usable observations.
    pub fn refine(
        &self,
        camera: &PinholeCamera,
        start: &Pose,
        observations: &[PoseObservation],
    ) -> Option<RefinedPose> {
        self.refine_with(camera, start, observations, None)
    }

    /// As [`Self::refine`], with a prior.
    pub(crate) fn refine_with(
        &self,
        camera: &PinholeCamera,
        start: &Pose,
        observations: &[PoseObservation],
        prior: Option<&PosePrior>,
    ) -> Option<RefinedPose> {
        let mut pose = *start;
        let mut normal = self.linearize(camera, &pose, observations, prior);
        if normal.used < 3 {
            return None;
        }
        let mut damping = 1e-4;
        let mut iterations = 0;
        while iterations < MOST_STEPS {
            iterations += 1;
            let Some(step) = solve(&normal, damping) else { break };
            let next = moved(&pose, &step);
            let tried = self.linearize(camera, &next, observations, prior);
            if tried.used >= normal.used && tried.cost <= normal.cost {
                (pose, normal) = (next, tried);
                damping = (0.2 * damping).max(1e-9);
                if step.amax() < EPSILON {
                    break;
                }
            } else {
                damping *= 10.0;
                if damping > 1e6 {
                    break;
                }
            }
        }
        Some(RefinedPose {
            camera_from_body: pose,
            covariance: covariance(&normal, prior),
            inliers: normal.inliers,
            used: normal.used,
            iterations,
        })
    }

    fn linearize(
        &self,
        camera: &PinholeCamera,
        pose: &Pose,
        observations: &[PoseObservation],
        prior: Option<&PosePrior>,
    ) -> Normal {
        let mut normal = Normal {
            matrix: Matrix6::zeros(),
            gradient: Vector6::zeros(),
            cost: 0.0,
            inliers: 0,
            used: 0,
            squares: 0.0,
            weights: 0.0,
        };
        for observation in observations.iter().filter(|observation| observation.is_usable()) {
            let Some(rows) = residuals(camera, pose, observation) else { continue };
            let size = rows.iter().flatten().map(|row| row.residual * row.residual).sum::<f64>().sqrt();
            let weight = self.kernel.weight(size);
            normal.cost += self.kernel.cost(size);
            normal.used += 1;
            normal.inliers += usize::from(size <= 3.0);
            for row in rows.iter().flatten() {
                normal.matrix += weight * row.jacobian * row.jacobian.transpose();
                normal.gradient += weight * row.residual * row.jacobian;
                normal.squares += weight * row.residual * row.residual;
                normal.weights += weight;
            }
        }
        if let Some(prior) = prior {
            normal.add(prior, pose);
        }
        normal
    }
}

impl Normal {
    /// Adds the prior, to first order in the step from the expected pose.
    fn add(&mut self, prior: &PosePrior, pose: &Pose) {
        let pull = prior.information * step_between(&prior.camera_from_body, pose);
        self.matrix += prior.information;
        self.gradient += pull;
        self.cost += 0.5 * prior.squared_distance(pose);
    }
}

/// A residual in standard deviations, and its derivative by (rotation, translation).
struct Row {
    residual: f64,
    jacobian: Vector6<f64>,
}

/// The one or two rows of an observation; `None` when its point is behind the camera.
fn residuals(camera: &PinholeCamera, pose: &Pose, observation: &PoseObservation) -> Option<[Option<Row>; 2]> {
    // `arm`: from the body's origin to where the residual grows along `gradient`, in the camera's axes.
    let row = |arm: Vector3<f64>, gradient: Vector3<f64>, residual: f64, sigma: f64| {
        let by_rotation = arm.cross(&gradient);
        let jacobian = Vector6::new(
            by_rotation[0],
            by_rotation[1],
            by_rotation[2],
            gradient[0],
            gradient[1],
            gradient[2],
        );
        Some(Row { residual: residual / sigma, jacobian: jacobian / sigma })
    };
    match *observation {
        PoseObservation::Pixel { point, pixel, sigma } => {
            let turned = Vector3::from(pose.rotate(point));
            let seen = turned + Vector3::from(pose.translation());
            let [u, v] = camera.project(seen.into())?;
            let [by_u, by_v] = pixel_gradients(camera, seen);
            Some([row(turned, by_u, u - pixel[0], sigma), row(turned, by_v, v - pixel[1], sigma)])
        }
        PoseObservation::Depth { point, depth, sigma } => {
            let turned = Vector3::from(pose.rotate(point));
            let z = turned.z + pose.translation()[2];
            Some([row(turned, Vector3::z(), z - depth, sigma), None])
        }
        PoseObservation::Surface { point, normal, measured, sigma } => {
            let turned = Vector3::from(pose.rotate(point));
            let normal = Vector3::from(pose.rotate(normal));
            let apart = turned + Vector3::from(pose.translation()) - Vector3::from(measured);
            // Not where it was measured: on a curved surface, that it lies beside the point says nothing of
            // how the body is turned.
            Some([row(turned, normal, normal.dot(&apart), sigma), None])
        }
        PoseObservation::Plane { point, normal, measured, sigma } => {
            let normal = Vector3::from(pose.rotate(normal));
            let to_measured = Vector3::from(measured) - Vector3::from(pose.translation());
            let apart = Vector3::from(pose.rotate(point)) - to_measured;
            // The normal turns with the body, so a rotation moves the plane where it was measured, which
            // may be far from the point.
            Some([row(to_measured, normal, normal.dot(&apart), sigma), None])
        }
    }
}

/// Gradients of a point's u and v by its position in the camera's frame.
fn pixel_gradients(camera: &PinholeCamera, seen: Vector3<f64>) -> [Vector3<f64>; 2] {
    let inverse = 1.0 / seen.z;
    [
        Vector3::new(camera.fx() * inverse, 0.0, -camera.fx() * seen.x * inverse * inverse),
        Vector3::new(0.0, camera.fy() * inverse, -camera.fy() * seen.y * inverse * inverse),
    ]
}

/// The motion of a body point's pixel when the body moves ([`moved`]), and when the point moves along
/// `direction`; `point` and `direction` are in the body's frame.
pub(crate) fn pixel_motion(
    camera: &PinholeCamera,
    camera_from_body: &Pose,
    point: [f64; 3],
    direction: [f64; 3],
) -> PixelMotion {
    let turned = Vector3::from(camera_from_body.rotate(point));
    let direction = Vector3::from(camera_from_body.rotate(direction));
    let gradients = pixel_gradients(camera, turned + Vector3::from(camera_from_body.translation()));
    let by_pose = gradients.map(|gradient| {
        let by_turn = turned.cross(&gradient);
        Vector6::new(by_turn.x, by_turn.y, by_turn.z, gradient.x, gradient.y, gradient.z)
    });
    PixelMotion { by_pose, by_shift: gradients.map(|gradient| gradient.dot(&direction)) }
}

/// Derivatives of a point's u and v.
pub(crate) struct PixelMotion {
    /// Pixels per radian and per metre.
    pub(crate) by_pose: [Vector6<f64>; 2],
    /// Pixels per metre.
    pub(crate) by_shift: [f64; 2],
}

/// The damped step; `None` when the equations have no solution.
fn solve(normal: &Normal, damping: f64) -> Option<Vector6<f64>> {
    let mut matrix = normal.matrix;
    let floor = 1e-9 * matrix.diagonal().amax();
    for i in 0..6 {
        matrix[(i, i)] += damping * matrix[(i, i)] + floor;
    }
    let step = -matrix.cholesky()?.solve(&normal.gradient);
    step.iter().all(|x| x.is_finite()).then_some(step)
}

fn covariance(normal: &Normal, prior: Option<&PosePrior>) -> Option<[[f64; 6]; 6]> {
    // More noise than the given sigmas makes the pose less certain; less noise does not make it more certain.
    let excess = (normal.squares / (normal.weights - 6.0).max(1.0)).max(1.0);
    let known = prior.map_or_else(Matrix6::zeros, |prior| prior.information);
    let information = (normal.matrix - known) / excess + known;
    // Scaled to a unit diagonal, so that metres and radians can be compared.
    let scale = information.diagonal().map(|x| if x > 0.0 { 1.0 / x.sqrt() } else { 0.0 });
    let scaled = Matrix6::from_fn(|i, j| information[(i, j)] * scale[i] * scale[j]);
    let smallest = scaled.symmetric_eigenvalues().min();
    if smallest.is_nan() || smallest <= 1e-9 {
        return None;
    }
    let inverse = scaled.cholesky()?.inverse();
    Some(std::array::from_fn(|i| std::array::from_fn(|j| inverse[(i, j)] * scale[i] * scale[j])))
}
