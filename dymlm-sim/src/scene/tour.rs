use parry3d::math::{Pose3, Vec3};

/// A camera's way through a building and back to its start.
#[derive(Debug, Clone)]
pub(crate) struct Tour {
    knots: Vec<Knot>,
}

/// Where the camera is at a time; between two knots it moves straight and turns at a constant rate.
#[derive(Debug, Clone, Copy)]
struct Knot {
    time: f64,
    /// The point of the floor below the camera.
    place: Vec3,
    /// Direction of view, radians from x, not wrapped.
    yaw: f32,
}

/// Speed of turning, radians a second.
const TURN: f32 = 0.7;

impl Tour {
    /// Speed of moving, metres a second.
    pub(super) const SPEED: f32 = 0.7;

    pub(super) fn begin(place: Vec3, yaw: f32) -> Self {
        Self { knots: vec![Knot { time: 0.0, place, yaw }] }
    }

    /// Turns towards a point and goes there.
    pub(super) fn go_to(&mut self, place: Vec3) {
        let last = self.last();
        let way = place - last.place;
        if way.length() > 1e-3 {
            let turn = way.y.atan2(way.x) - last.yaw;
            self.turn(turn - std::f32::consts::TAU * (turn / std::f32::consts::TAU).round());
            self.add(f64::from(way.length() / Self::SPEED), place, self.last().yaw);
        }
    }

    /// Turns in place by `angle` radians.
    pub(super) fn turn(&mut self, angle: f32) {
        let last = self.last();
        self.add(Self::seconds_to_turn(angle), last.place, last.yaw + angle);
    }

    /// How long a turn by `angle` radians takes.
    pub(super) fn seconds_to_turn(angle: f32) -> f64 {
        f64::from(angle.abs() / TURN)
    }

    /// How long the tour takes.
    pub(super) fn seconds(&self) -> f64 {
        self.last().time
    }

    /// Stands for some seconds.
    pub(super) fn rest(&mut self, seconds: f64) {
        let last = self.last();
        self.add(seconds, last.place, last.yaw);
    }

    /// The same tour, slower or faster throughout, so that it takes the given time.
    pub(super) fn lasting(mut self, seconds: f64) -> Self {
        let scale = seconds / self.last().time.max(1e-3);
        self.knots.iter_mut().for_each(|knot| knot.time *= scale);
        self
    }

    fn add(&mut self, seconds: f64, place: Vec3, yaw: f32) {
        let time = self.last().time + seconds;
        self.knots.push(Knot { time, place, yaw });
    }

    fn last(&self) -> Knot {
        self.knots.last().copied().unwrap_or(Knot { time: 0.0, place: Vec3::ZERO, yaw: 0.0 })
    }

    /// Pose, at `time` seconds, of a frame on the floor below the camera: x in the direction of view, z up.
    /// The tour repeats.
    pub(crate) fn scene_from_carrier(&self, time: f64) -> Pose3 {
        let time = time.rem_euclid(self.last().time.max(1e-3));
        let next = self.knots.partition_point(|knot| knot.time <= time);
        let from = self.knots.get(next.saturating_sub(1)).copied().unwrap_or_else(|| self.last());
        let to = self.knots.get(next).copied().unwrap_or(from);
        let span = to.time - from.time;
        let share = if span > 0.0 { ((time - from.time) / span) as f32 } else { 0.0 };
        let yaw = from.yaw + share * (to.yaw - from.yaw);
        Pose3::from_parts(from.place.lerp(to.place, share), parry3d::math::Rot3::from_rotation_z(yaw))
    }
}
