use parry3d::math::Vec2;

/// A closed walk over the floor at constant speed: a Catmull-Rom spline through way points, by arc length.
#[derive(Debug, Clone)]
pub(super) struct Walk {
    /// Points along the walk with their distance along it from the start, metres; the last point equals the
    /// first.
    samples: Vec<(f32, Vec2)>,
    speed: f64,
    start: f64,
}

/// Where a walker is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    pub(super) position: Vec2,
    /// Direction of the walk, radians from x.
    pub(super) heading: f32,
    /// Distance walked since the start, metres.
    pub(super) distance: f64,
}

/// Samples of each leg between two way points; in a room they are 2 to 5 cm apart.
const SAMPLES: usize = 48;

impl Walk {
    /// A walk through at least one way point, `start` metres along it at time 0, `speed` in metres a second.
    pub(super) fn new(way_points: &[[f32; 2]], speed: f64, start: f64) -> Self {
        let n = way_points.len();
        let at = |i: usize| Vec2::from(way_points.get(i % n.max(1)).copied().unwrap_or_default());
        let mut samples: Vec<(f32, Vec2)> = Vec::with_capacity(n * SAMPLES + 1);
        for i in 0..n {
            let [p0, p1, p2, p3] = [at(i + n - 1), at(i), at(i + 1), at(i + 2)];
            for k in 0..SAMPLES + usize::from(i + 1 == n) {
                let t = k as f32 / SAMPLES as f32;
                let point = 0.5
                    * (2.0 * p1
                        + (p2 - p0) * t
                        + (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) * (t * t)
                        + (3.0 * p1 - p0 - 3.0 * p2 + p3) * (t * t * t));
                let distance = samples.last().map_or(0.0, |&(walked, last)| walked + last.distance(point));
                samples.push((distance, point));
            }
        }
        Self { samples, speed, start }
    }

    /// The same walk a quarter of a round ahead.
    pub(super) fn ahead(&self) -> Self {
        let start = self.start + 0.25 * f64::from(self.length());
        Self { start, ..self.clone() }
    }

    /// Length of one round, metres.
    pub(super) fn length(&self) -> f32 {
        self.samples.last().map_or(0.0, |&(walked, _)| walked)
    }

    /// The walker at `time` seconds.
    pub(super) fn at(&self, time: f64) -> Step {
        let distance = self.start + self.speed * time;
        let along = distance.rem_euclid(f64::from(self.length()).max(1e-3)) as f32;
        let position = self.position(along);
        // The heading is that of a chord 0.3 m long, which smooths the turns as a walker does.
        let ahead = self.position((along + 0.15).rem_euclid(self.length().max(1e-3)));
        let behind = self.position((along - 0.15).rem_euclid(self.length().max(1e-3)));
        let course = ahead - behind;
        Step { position, heading: course.y.atan2(course.x), distance }
    }

    fn position(&self, along: f32) -> Vec2 {
        let next = self.samples.partition_point(|&(walked, _)| walked <= along);
        let from = self.samples.get(next.saturating_sub(1)).copied().unwrap_or_default();
        let to = self.samples.get(next).copied().unwrap_or(from);
        let span = to.0 - from.0;
        if span > 0.0 { from.1.lerp(to.1, (along - from.0) / span) } else { from.1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walks_at_its_speed_and_comes_round() {
        let walk = Walk::new(&[[-2.0, 0.0], [0.0, -0.3], [2.0, 0.0], [0.0, 0.5]], 0.8, 1.0);
        let mut last = walk.at(0.0);
        for step in 1..400 {
            let now = walk.at(f64::from(step) * 0.05);
            let moved = last.position.distance(now.position);
            // The chord of a tight turn is a little shorter than the arc.
            assert!((0.036..0.0405).contains(&moved), "moved {moved} m in 50 ms");
            last = now;
        }
        let round = f64::from(walk.length()) / 0.8;
        assert!(walk.at(0.0).position.distance(walk.at(round).position) < 1e-3);
    }

    #[test]
    fn a_single_way_point_is_stood_upon() {
        let walk = Walk::new(&[[1.0, 2.0]], 0.8, 0.0);
        assert!(walk.at(3.0).position.distance(Vec2::new(1.0, 2.0)) < 1e-6);
        assert!(Walk::new(&[], 0.8, 0.0).at(1.0).position.is_finite());
    }
}
