use dymlm_core::BoundingBox;

/// Noise of one component of a box: process noise of the value and of its rate per frame of 1/30 s,
/// measurement noise, and initial variances of value and rate. Only the ratios matter, so the values hold for
/// images of any size.
struct Noise {
    value_q: f64,
    rate_q: f64,
    r: f64,
    value_p0: f64,
    rate_p0: f64,
}

/// Noise of the centre's coordinates, as published with SORT.
const CENTER: Noise = Noise { value_q: 1.0, rate_q: 0.01, r: 1.0, value_p0: 10.0, rate_p0: 1e4 };
const AREA: Noise = Noise { value_q: 1.0, rate_q: 1e-4, r: 10.0, value_p0: 10.0, rate_p0: 1e4 };
/// The aspect ratio is modelled without a rate.
const ASPECT: Noise = Noise { value_q: 1.0, rate_q: 0.0, r: 10.0, value_p0: 10.0, rate_p0: 0.0 };

/// The frame rate for which the noise is published, 1/s.
const FRAME_RATE: f64 = 30.0;

/// Motion of one box: the constant-velocity Kalman filter of SORT over (u, v, s, r, u', v', s'), where (u, v)
/// is the centre in pixels, s the area in square pixels, r the aspect ratio width / height.
///
/// Source: Bewley, Ge, Ott, Ramos, Upcroft: "Simple Online and Realtime Tracking", ICIP 2016, with the noise
/// of the published program: R = diag(1, 1, 10, 10), P0 = diag(10, 10, 10, 10, 1e4, 1e4, 1e4), Q = diag(1, 1,
/// 1, 1, 0.01, 0.01, 1e-4) per frame of 1/30 s. Rates are per such frame; a time step is converted to a
/// (fractional) number of frames, and Q grows in proportion.
///
/// P0, Q and R are diagonal, and the motion couples only u with u', v with v', s with s'. The covariance
/// therefore stays block-diagonal, and the filter of seven states splits exactly into four small filters. A
/// step costs O(1).
///
/// ```
/// use dymlm_core::BoundingBox;
/// use dymlm_dynamics::BoxKalman;
///
/// let mut filter = BoxKalman::new(&BoundingBox::new(10.0, 10.0, 50.0, 90.0)?);
/// filter.predict(1.0 / 30.0);
/// filter.update(&BoundingBox::new(13.0, 10.0, 53.0, 90.0)?);
/// filter.predict(1.0 / 30.0);
/// let ahead = filter.bounding_box().unwrap();
/// assert!((ahead.center()[0] - 36.0).abs() < 0.1); // it continues at 3 pixels per frame
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct BoxKalman {
    u: AxisFilter,
    v: AxisFilter,
    area: AxisFilter,
    aspect: f64,
    aspect_variance: f64,
}

impl BoxKalman {
    /// A box at rest, of unknown rate. A side shorter than 1e-6 pixels counts as 1e-6 pixels.
    pub fn new(bounding_box: &BoundingBox) -> Self {
        let [u, v, area, aspect] = measurement(bounding_box);
        Self {
            u: AxisFilter::new(u, &CENTER),
            v: AxisFilter::new(v, &CENTER),
            area: AxisFilter::new(area, &AREA),
            aspect,
            aspect_variance: ASPECT.value_p0,
        }
    }

    /// Predicts the state `seconds` >= 0 later. An area about to become negative stops shrinking, as in SORT.
    pub fn predict(&mut self, seconds: f64) {
        let frames = seconds * FRAME_RATE;
        if self.area.value + self.area.rate * frames <= 0.0 {
            self.area.rate = 0.0;
        }
        self.u.predict(frames, &CENTER);
        self.v.predict(frames, &CENTER);
        self.area.predict(frames, &AREA);
        self.aspect_variance += ASPECT.value_q * frames;
    }

    /// Updates the state with a measured box.
    pub fn update(&mut self, bounding_box: &BoundingBox) {
        let [u, v, area, aspect] = measurement(bounding_box);
        self.u.update(u, &CENTER);
        self.v.update(v, &CENTER);
        self.area.update(area, &AREA);
        let gain = self.aspect_variance / (self.aspect_variance + ASPECT.r);
        self.aspect += gain * (aspect - self.aspect);
        self.aspect_variance *= 1.0 - gain;
    }

    /// The state (u, v, s, r, u', v', s'); rates are per frame of 1/30 s.
    pub fn state(&self) -> [f64; 7] {
        [self.u.value, self.v.value, self.area.value, self.aspect, self.u.rate, self.v.rate, self.area.rate]
    }

    /// Variances of the state, the diagonal of P.
    pub fn variances(&self) -> [f64; 7] {
        [self.u.p00, self.v.p00, self.area.p00, self.aspect_variance, self.u.p11, self.v.p11, self.area.p11]
    }

    /// The box of the state; `None` when it exceeds the range of f32.
    pub fn bounding_box(&self) -> Option<BoundingBox> {
        let width = (self.area.value * self.aspect).sqrt();
        self.box_of_size([width, self.area.value / width])
    }

    /// The same for a box that has not been measured since the state's area was `area`, and the box itself of
    /// this width and height: the state's centre, and the box's sides with the trend of the state's area. It
    /// shrinks as that of a thing that recedes at constant speed, s / (1 + x)^2 with x = -s' t / (2 s): to first
    /// order as the state's area, but it never comes near zero. In a step of a second the state's area would, as
    /// soon as somebody walks away.
    pub(super) fn box_since(&self, area: f64, [width, height]: [f64; 2]) -> Option<BoundingBox> {
        let shrunk = 0.5 * (area - self.area.value) / area;
        let factor = if shrunk > 0.0 { 1.0 / (1.0 + shrunk) } else { (self.area.value / area).sqrt() };
        self.box_of_size([width * factor, height * factor])
    }

    /// Area of the state, square pixels.
    pub(super) fn area(&self) -> f64 {
        self.area.value
    }

    fn box_of_size(&self, [width, height]: [f64; 2]) -> Option<BoundingBox> {
        let (left, top) = (self.u.value - 0.5 * width, self.v.value - 0.5 * height);
        let (right, bottom) = (left + width, top + height);
        BoundingBox::new(left as f32, top as f32, right as f32, bottom as f32).ok()
    }

    /// Centre `[u, v]`, pixels.
    pub fn center(&self) -> [f64; 2] {
        [self.u.value, self.v.value]
    }

    /// Transfers the box to another image: its centre moves to `center`, all lengths are multiplied by
    /// `scale` > 0.
    pub(super) fn reproject(&mut self, center: [f64; 2], scale: f64) {
        self.u.rescale(scale);
        self.v.rescale(scale);
        self.area.rescale(scale * scale);
        [self.u.value, self.v.value] = center;
    }

    /// Turns the box's motion with the image, by an angle in radians.
    pub(super) fn turn(&mut self, angle: f64) {
        let ((sin, cos), [u, v]) = (angle.sin_cos(), [self.u.rate, self.v.rate]);
        [self.u.rate, self.v.rate] = [cos * u - sin * v, sin * u + cos * v];
    }
}

/// (u, v, s, r) of a box.
fn measurement(bounding_box: &BoundingBox) -> [f64; 4] {
    let [x_min, y_min, x_max, y_max] = <[f32; 4]>::from(*bounding_box).map(f64::from);
    let (width, height) = ((x_max - x_min).max(1e-6), (y_max - y_min).max(1e-6));
    [0.5 * (x_min + x_max), 0.5 * (y_min + y_max), width * height, width / height]
}

/// A Kalman filter of a value and its rate; the value is measured.
#[derive(Debug, Clone, PartialEq)]
struct AxisFilter {
    value: f64,
    rate: f64,
    p00: f64,
    p01: f64,
    p11: f64,
}

impl AxisFilter {
    fn new(value: f64, noise: &Noise) -> Self {
        Self { value, rate: 0.0, p00: noise.value_p0, p01: 0.0, p11: noise.rate_p0 }
    }

    /// x = F x, P = F P F' + Q over `t` frames, F = [1 t; 0 1].
    fn predict(&mut self, t: f64, noise: &Noise) {
        self.value += self.rate * t;
        self.p00 += t * (2.0 * self.p01 + t * self.p11) + noise.value_q * t;
        self.p01 += t * self.p11;
        self.p11 += noise.rate_q * t;
    }

    /// K = P H' / (H P H' + R), x += K (z - H x), P = (I - K H) P, H = [1 0].
    fn update(&mut self, measured: f64, noise: &Noise) {
        let innovation = measured - self.value;
        let k0 = self.p00 / (self.p00 + noise.r);
        let k1 = self.p01 / (self.p00 + noise.r);
        self.value += k0 * innovation;
        self.rate += k1 * innovation;
        self.p11 -= k1 * self.p01;
        self.p01 *= 1.0 - k0;
        self.p00 *= 1.0 - k0;
    }

    fn rescale(&mut self, scale: f64) {
        self.value *= scale;
        self.rate *= scale;
        for p in [&mut self.p00, &mut self.p01, &mut self.p11] {
            *p *= scale * scale;
        }
    }
}
