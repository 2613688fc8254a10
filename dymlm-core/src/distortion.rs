use crate::{ConfigError, check_range};

/// How a lens bends the rays of a pinhole camera, on normalized coordinates x / z, y / z.
///
/// ```
/// use dymlm_core::Distortion;
///
/// let lens = Distortion::brown_conrady(&[0.2624, -0.9531, -0.0054, 0.0026, 1.1633])?;
/// let seen = lens.distort([0.3, -0.2]);
/// let back = lens.undistort(seen).unwrap_or_default();
/// assert!((back[0] - 0.3).abs() < 1e-12 && (back[1] + 0.2).abs() < 1e-12);
/// # Ok::<(), dymlm_core::ConfigError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "DistortionTable", into = "DistortionTable"))]
#[non_exhaustive]
pub enum Distortion {
    /// Radial and tangential (Brown 1966; Conrady 1919), with the rational denominator of `OpenCV`:
    /// (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6).
    #[doc(alias = "plumb_bob")]
    #[doc(alias = "rational_polynomial")]
    BrownConrady {
        /// k1 to k6.
        radial: [f64; 6],
        /// p1, p2.
        tangential: [f64; 2],
    },
    /// Wide-angle lenses (Kannala, Brandt 2006), `OpenCV`'s fisheye model: the angle theta to the axis
    /// appears at theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
    #[doc(alias = "kannala_brandt")]
    #[doc(alias = "fisheye")]
    Equidistant {
        /// k1 to k4.
        radial: [f64; 4],
    },
}

/// Step over which slopes are taken, normalized coordinates.
const STEP: f64 = 1e-6;
/// Most Newton steps to undistort a point; some five are usual.
const STEPS: usize = 30;

impl Distortion {
    /// Radial and tangential distortion with coefficients in the order of `OpenCV`: k1 k2 p1 p2, then k3,
    /// then k4 k5 k6; those left out are 0.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when there are not 4 to 8 of them, or one is not within -1000..=1000.
    pub fn brown_conrady(coefficients: &[f64]) -> Result<Self, ConfigError> {
        check_range("distortion.coefficients (their number)", coefficients.len() as f64, 4.0..=8.0)?;
        check_coefficients(coefficients)?;
        let mut all = [0.0; 8];
        all.iter_mut().zip(coefficients).for_each(|(all, &given)| *all = given);
        let [k1, k2, p1, p2, k3, k4, k5, k6] = all;
        Ok(Self::BrownConrady { radial: [k1, k2, k3, k4, k5, k6], tangential: [p1, p2] })
    }

    /// Equidistant distortion with k1 to k4.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when one is not within -1000..=1000.
    pub fn equidistant(coefficients: [f64; 4]) -> Result<Self, ConfigError> {
        check_coefficients(&coefficients)?;
        Ok(Self::Equidistant { radial: coefficients })
    }

    /// Where the lens shows a point that a pinhole camera would show at `[x, y]`, both normalized.
    #[must_use]
    pub fn distort(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let factor = self.radial_factor(x * x + y * y);
        let [dx, dy] = self.tangential([x, y]);
        [x * factor + dx, y * factor + dy]
    }

    /// The inverse of [`Self::distort`], by Newton's method; `None` outside the part of the image that the
    /// model describes (it folds back there, or sees behind the camera).
    #[must_use]
    pub fn undistort(&self, seen: [f64; 2]) -> Option<[f64; 2]> {
        let limit = self.largest_radius_squared();
        let [mut x, mut y] = seen;
        for _ in 0..STEPS {
            let [found_x, found_y] = self.distort([x, y]);
            let (error_x, error_y) = (seen[0] - found_x, seen[1] - found_y);
            if error_x.abs().max(error_y.abs()) < 1e-14 {
                break;
            }
            // Slopes are taken by differences: the models have no derivative in common.
            let [right_x, right_y] = self.distort([x + STEP, y]).map(|c| c / STEP);
            let [down_x, down_y] = self.distort([x, y + STEP]).map(|c| c / STEP);
            let (xx, yx) = (right_x - found_x / STEP, right_y - found_y / STEP);
            let (xy, yy) = (down_x - found_x / STEP, down_y - found_y / STEP);
            let determinant = xx * yy - xy * yx;
            let (step_x, step_y) =
                ((yy * error_x - xy * error_y) / determinant, (xx * error_y - yx * error_x) / determinant);
            // A step is no longer than half the distance from the axis plus 0.05: a longer one could jump
            // over a fold.
            let longest = 0.5 * (x.hypot(y) + 0.1);
            let shorter = (longest / step_x.hypot(step_y)).min(1.0);
            (x, y) = (x + step_x * shorter, y + step_y * shorter);
        }
        let [found_x, found_y] = self.distort([x, y]);
        let is_found = (found_x - seen[0]).abs().max((found_y - seen[1]).abs()) < 1e-9;
        (is_found && x * x + y * y <= limit).then_some([x, y])
    }

    /// The square of the greatest distance from the axis up to which points farther out in space are farther
    /// out in the image; at most that of a ray 84 degrees off the axis.
    pub(crate) fn largest_radius_squared(&self) -> f64 {
        let seen = |radius: f64| radius * self.radial_factor(radius * radius);
        let mut radius = 0.0;
        while radius < 10.0 {
            let next = radius + 0.01;
            // NaN ends the loop too.
            if seen(next).partial_cmp(&seen(radius)) != Some(std::cmp::Ordering::Greater) {
                break;
            }
            radius = next;
        }
        radius * radius
    }

    fn radial_factor(&self, r2: f64) -> f64 {
        match self {
            Self::BrownConrady { radial: [k1, k2, k3, k4, k5, k6], .. } => {
                let cubic = |a: &f64, b: &f64, c: &f64| 1.0 + r2 * (a + r2 * (b + r2 * c));
                cubic(k1, k2, k3) / cubic(k4, k5, k6)
            }
            Self::Equidistant { radial: [k1, k2, k3, k4] } => {
                let radius = r2.sqrt();
                if radius < 1e-8 {
                    return 1.0;
                }
                let angle = radius.atan();
                let a2 = angle * angle;
                angle * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4)))) / radius
            }
        }
    }

    fn tangential(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        match self {
            Self::BrownConrady { tangential: [p1, p2], .. } => {
                let r2 = x * x + y * y;
                [2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y]
            }
            Self::Equidistant { .. } => [0.0; 2],
        }
    }
}

fn check_coefficients(coefficients: &[f64]) -> Result<(), ConfigError> {
    coefficients.iter().try_for_each(|&k| check_range("distortion.coefficients", k, -1000.0..=1000.0))
}

/// A distortion in a file: `{"model": "brown_conrady", "coefficients": [...]}`, with the names that ROS has
/// for the models as well.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct DistortionTable {
    model: Model,
    coefficients: Vec<f64>,
}

#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
enum Model {
    #[serde(alias = "plumb_bob", alias = "rational_polynomial")]
    BrownConrady,
    #[serde(alias = "kannala_brandt", alias = "fisheye")]
    Equidistant,
}

#[cfg(feature = "serde")]
impl TryFrom<DistortionTable> for Distortion {
    type Error = ConfigError;

    fn try_from(DistortionTable { model, coefficients }: DistortionTable) -> Result<Self, ConfigError> {
        match (model, coefficients.as_slice()) {
            (Model::BrownConrady, coefficients) => Self::brown_conrady(coefficients),
            (Model::Equidistant, &[k1, k2, k3, k4]) => Self::equidistant([k1, k2, k3, k4]),
            (Model::Equidistant, other) => {
                check_range("distortion.coefficients (their number)", other.len() as f64, 4.0..=4.0)?;
                Self::equidistant([0.0; 4])
            }
        }
    }
}

#[cfg(feature = "serde")]
impl From<Distortion> for DistortionTable {
    fn from(distortion: Distortion) -> Self {
        match distortion {
            Distortion::BrownConrady { radial: [k1, k2, k3, k4, k5, k6], tangential: [p1, p2] } => {
                Self { model: Model::BrownConrady, coefficients: vec![k1, k2, p1, p2, k3, k4, k5, k6] }
            }
            Distortion::Equidistant { radial } => {
                Self { model: Model::Equidistant, coefficients: radial.to_vec() }
            }
        }
    }
}
