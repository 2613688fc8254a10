use dymlm_core::Pose;
use rand::Rng;

use super::PoseErrorConfig;
use crate::noise::{NormalTable, Use, stream};

/// The poses that a SLAM system would estimate.
///
/// Odometry adds a small error to each step in the camera's frame, estimate <- estimate * step * exp(n),
/// which makes the drift a random walk in SE(3); n is the integral of a velocity that is linear between
/// independent normal values, so that the walk is smooth. When the loop with the first frame closes at time
/// T, the error there, C = exact(T) estimate(T)^-1, becomes known, and frame t <= T is corrected by the share
/// t / T of the motion from the identity to C (Lu and Milios 1997 for a chain of equally certain links);
/// frames after T are corrected by C. Each frame's own jitter comes on top.
///
/// The walk is computed once, O(frames); each pose then costs O(1).
#[derive(Debug, Clone)]
pub(super) struct PoseError {
    config: PoseErrorConfig,
    seed: u64,
    normals: NormalTable,
    /// The first camera's exact pose: all errors are relative to it, so that the world's origin does not
    /// matter.
    world_from_first: Pose,
    /// Odometry's estimates.
    first_from_camera: Vec<Pose>,
    closure: Option<Closure>,
}

#[derive(Debug, Clone, Copy)]
struct Closure {
    frame: usize,
    /// Takes the estimate of that frame to the exact pose.
    correction: Pose,
}

/// Whether the back end has closed the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Knowledge {
    BeforeClosure,
    AfterClosure,
}

/// Streams of random numbers.
#[derive(Debug, Clone, Copy)]
enum Part {
    Drift = 0,
    Jitter = 1,
}

/// A small motion: translation and rotation vector, camera frame.
type Twist = [f64; 6];

impl PoseError {
    /// Computes the random walk along the exact poses, one for each frame, `frame_time` seconds apart; `None`
    /// when the config asks for exact poses.
    pub(super) fn new(
        config: &PoseErrorConfig,
        seed: u64,
        frame_time: f64,
        exact: impl Iterator<Item = Pose>,
    ) -> Option<Self> {
        if config.is_exact() {
            return None;
        }
        let mut exact = exact.peekable();
        let world_from_first = *exact.peek()?;
        let mut error = Self {
            config: *config,
            seed,
            normals: NormalTable::new(),
            world_from_first,
            first_from_camera: Vec::new(),
            closure: None,
        };
        error.drift(frame_time, exact);
        Some(error)
    }

    /// The first frame after the loop closure, if a loop closes within the sequence.
    pub(super) fn closure_frame(&self) -> Option<usize> {
        self.closure.map(|closure| closure.frame)
    }

    /// The estimate of frame `index` at the time when the frame was taken.
    pub(super) fn estimate(&self, index: usize) -> Option<Pose> {
        self.pose(index, self.knowledge_at(index))
    }

    /// The estimates of frames 0 to `index` as the back end has them at frame `index`.
    pub(super) fn estimates_at(&self, index: usize) -> Vec<Pose> {
        let knowledge = self.knowledge_at(index);
        (0..self.first_from_camera.len().min(index.saturating_add(1)))
            .filter_map(|frame| self.pose(frame, knowledge))
            .collect()
    }

    fn knowledge_at(&self, index: usize) -> Knowledge {
        match self.closure {
            Some(closure) if index >= closure.frame => Knowledge::AfterClosure,
            _ => Knowledge::BeforeClosure,
        }
    }

    fn pose(&self, index: usize, knowledge: Knowledge) -> Option<Pose> {
        let estimate = *self.first_from_camera.get(index)?;
        let corrected = match (self.closure, knowledge) {
            (Some(closure), Knowledge::AfterClosure) => closure.share(index) * estimate,
            _ => estimate,
        };
        Some(self.world_from_first * corrected * self.jitter(index))
    }

    fn drift(&mut self, frame_time: f64, exact: impl Iterator<Item = Pose>) {
        let first_from_world = self.world_from_first.inverse();
        let closes_at =
            |index: usize| self.config.loop_closure.is_some_and(|at| index as f64 * frame_time >= at);
        let spacing = self.config.smoothness.max(frame_time);
        let mut walk = vec![];
        let mut closure = None;
        let mut last: Option<(Pose, Pose)> = None;
        for (index, exact) in exact.enumerate() {
            let exact = first_from_world * exact;
            let estimate = match last {
                None => exact,
                Some((exact_before, estimate_before)) => {
                    let step = exact_before.inverse() * exact;
                    let end = index as f64 * frame_time;
                    let drift = self.integral([end - frame_time, end].map(|time| time / spacing));
                    estimate_before * step * self.scaled(drift, &step, frame_time, spacing)
                }
            };
            if closure.is_none() && closes_at(index) {
                closure = Some(Closure { frame: index, correction: exact * estimate.inverse() });
            }
            walk.push(estimate);
            last = Some((exact, estimate));
        }
        self.first_from_camera = walk;
        self.closure = closure;
    }

    /// The error of a step: the integral of noise with knots of unit variance, scaled by the rates. With
    /// knots every `spacing` seconds, the integral over a time t >> spacing has the variance t / spacing in
    /// units of the spacing.
    fn scaled(&self, drift: Twist, step: &Pose, frame_time: f64, spacing: f64) -> Pose {
        let rate = |per_second: f64, per_motion: f64, motion: f64| {
            let variance = per_second.powi(2) + per_motion.powi(2) * motion / frame_time;
            (variance * spacing / 3.0).sqrt()
        };
        let still = Pose::identity();
        let translation = rate(
            self.config.translation_per_second,
            self.config.translation_per_metre,
            step.distance(&still),
        );
        let rotation =
            rate(self.config.rotation_per_second, self.config.rotation_per_radian, step.angle(&still));
        let [x, y, z, a, b, c] = drift;
        motion([x, y, z].map(|v| v * translation), [a, b, c].map(|v| v * rotation))
    }

    /// The integral of the piecewise linear noise through the knots; `from` and `to` count in knots.
    fn integral(&self, [from, to]: [f64; 2]) -> Twist {
        let mut sum = [0.0; 6];
        let mut knot = from.max(0.0).floor();
        let mut before = self.knot(knot);
        while knot < to {
            let after = self.knot(knot + 1.0);
            let [begin, end] = [from, to].map(|place| (place - knot).clamp(0.0, 1.0));
            // The integral of a line from `before` to `after` is the width times the value in the middle.
            let middle = f64::midpoint(begin, end);
            for (sum, (before, after)) in sum.iter_mut().zip(before.iter().zip(&after)) {
                *sum += (end - begin) * (before + middle * (after - before));
            }
            before = after;
            knot += 1.0;
        }
        sum
    }

    fn knot(&self, knot: f64) -> Twist {
        self.normal_numbers(knot as u64, Part::Drift)
    }

    fn jitter(&self, index: usize) -> Pose {
        let [x, y, z, a, b, c] = self.normal_numbers(index as u64, Part::Jitter);
        let [translation, rotation] =
            [self.config.translation_jitter, self.config.rotation_jitter].map(|rms| rms / 3.0_f64.sqrt());
        motion([x, y, z].map(|v| v * translation), [a, b, c].map(|v| v * rotation))
    }

    fn normal_numbers(&self, index: u64, part: Part) -> Twist {
        let mut rng = stream(self.seed, Use::PoseError, index, part as u64);
        std::array::from_fn(|_| f64::from(self.normals.normal(rng.next_u64())))
    }
}

impl Closure {
    /// The correction of frame `index`.
    fn share(&self, index: usize) -> Pose {
        if index >= self.frame {
            return self.correction;
        }
        Pose::identity().interpolate(&self.correction, index as f64 / self.frame as f64)
    }
}

/// The rigid motion by a translation and a rotation vector (angle times axis).
fn motion(translation: [f64; 3], rotation: [f64; 3]) -> Pose {
    let angle = rotation.iter().map(|r| r * r).sum::<f64>().sqrt();
    let scale = if angle > 1e-9 { (0.5 * angle).sin() / angle } else { 0.5 };
    let [x, y, z] = rotation.map(|r| r * scale);
    // A finite translation and a unit quaternion are never refused.
    Pose::new(translation, [x, y, z, (0.5 * angle).cos()]).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn still(config: &PoseErrorConfig, seed: u64, frame_time: f64, frames: usize) -> PoseError {
        let world_from_camera = Pose::new([1.0, 2.0, 3.0], [0.1, 0.7, -0.1, 0.7]).unwrap();
        PoseError::new(config, seed, frame_time, std::iter::repeat_n(world_from_camera, frames)).unwrap()
    }

    /// Root mean square over seeds of the error of a camera that stands still.
    fn drift_after(config: &PoseErrorConfig, frame_time: f64, frame: usize) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for seed in 0..400 {
            let error = still(config, seed, frame_time, frame + 1);
            let (first, last) = (error.world_from_first, error.estimate(frame).unwrap());
            sums[0] += first.distance(&last).powi(2) / 400.0;
            sums[1] += first.angle(&last).powi(2) / 400.0;
        }
        sums.map(f64::sqrt)
    }

    #[test]
    fn drift_grows_like_the_root_of_time_at_any_frame_rate() {
        let config = PoseErrorConfig {
            translation_per_second: 0.01,
            rotation_per_second: 0.002,
            ..PoseErrorConfig::default()
        };
        // The time spans at least 20 knots, since those at the ends count half.
        for (frame_time, times) in [(1.0 / 30.0, [10.0, 40.0]), (0.1, [10.0, 40.0]), (2.0, [50.0, 200.0])] {
            for seconds in times {
                let seconds: f64 = seconds;
                let [translation, rotation] =
                    drift_after(&config, frame_time, (seconds / frame_time).round() as usize);
                // 1200 normal numbers give a standard deviation to 2 %; the errors of the table and of the
                // ends come on top.
                assert!((translation / (0.01 * seconds.sqrt()) - 1.0).abs() < 0.08, "{translation} m");
                assert!((rotation / (0.002 * seconds.sqrt()) - 1.0).abs() < 0.08, "{rotation} rad");
            }
        }
    }

    #[test]
    fn drift_is_smooth() {
        let config = PoseErrorConfig { translation_per_second: 0.01, ..PoseErrorConfig::default() };
        let error = still(&config, 3, 0.01, 1000);
        let place = |index: usize| error.estimate(index).unwrap().translation();
        let velocity = |index: usize| -> [f64; 3] {
            std::array::from_fn(|axis| (place(index + 1)[axis] - place(index)[axis]) / 0.01)
        };
        for index in 0..998 {
            let change = (0..3).map(|axis| (velocity(index + 1)[axis] - velocity(index)[axis]).abs());
            // A velocity of one sigma (0.01 / sqrt(3 * 0.5)) needs 0.5 s, 50 frames, to build up.
            assert!(change.fold(0.0, f64::max) < 6.0 * 0.0082 / 50.0);
        }
    }

    #[test]
    fn motion_adds_its_share() {
        let config = PoseErrorConfig { translation_per_metre: 0.02, ..PoseErrorConfig::default() };
        let along = |index: i32| Pose::new([0.1 * f64::from(index), 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let mut sum = 0.0;
        for seed in 0..400 {
            let error = PoseError::new(&config, seed, 0.1, (0..101).map(along)).unwrap();
            sum += error.estimate(100).unwrap().distance(&along(100)).powi(2) / 400.0;
        }
        // 10 m in 10 s.
        assert!((sum.sqrt() / (0.02 * 10.0_f64.sqrt()) - 1.0).abs() < 0.08, "{} m", sum.sqrt());
        let stands = still(&config, 0, 0.1, 50);
        assert!(stands.estimate(49).unwrap().distance(&stands.world_from_first) < 1e-12);
    }

    #[test]
    fn errors_do_not_depend_on_where_the_world_begins() {
        let config = PoseErrorConfig::slam();
        let far = Pose::new([500.0, -20.0, 9.0], [0.5, 0.5, 0.5, 0.5]).unwrap();
        let along =
            |index: i32| Pose::new([0.01 * f64::from(index), 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let mut config_with_loop = config;
        config_with_loop.loop_closure = Some(5.0);
        for config in [config, config_with_loop] {
            let here = PoseError::new(&config, 1, 0.1, (0..100).map(along)).unwrap();
            let there = PoseError::new(&config, 1, 0.1, (0..100).map(|i| far * along(i))).unwrap();
            for (a, b) in here.estimates_at(99).into_iter().zip(there.estimates_at(99)) {
                assert!((far * a).distance(&b) < 1e-9 && (far * a).angle(&b) < 1e-6);
            }
        }
    }
}
