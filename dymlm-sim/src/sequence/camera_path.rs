use std::f64::consts::TAU;

use parry3d::math::{Mat3, Pose3, Rot3, Vec3};

use crate::scene::{Tour, Viewpoint};

/// How the camera moves through the room, after the sequence types of the TUM RGB-D benchmark (Sturm 2012).
///
/// All paths keep near a station that belongs to the room and look at the furniture before it (in the office
/// from about 3 m before the desk); the people are between. Through a building the camera is carried, rides
/// on a robot, or stands at the start of its tour ([`Static`](Self::Static)).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum CameraPath {
    /// Somebody carries the camera: it sways by up to half a metre and turns slowly, with a walker's tremor.
    #[default]
    Handheld,
    /// On a tripod.
    Static,
    /// Moves along the three axes in turn, without turning.
    Xyz,
    /// Turns about its three axes in turn, in place.
    Rpy,
    /// Moves on a half sphere of radius 1.1 m about a point before the desk.
    HalfSphere,
    /// On a robot, 0.3 m above the floor, level.
    Robot,
}

/// Heights of a camera on a robot and in a hand, metres.
const ROBOT: f32 = 0.3;
const HAND: f32 = 1.45;

impl CameraPath {
    /// The camera's pose in the scene at `time` seconds.
    pub(crate) fn scene_from_camera(self, viewpoint: &Viewpoint, time: f64) -> Pose3 {
        viewpoint.scene_from_view * self.view_from_camera(viewpoint, time)
    }

    /// The camera's pose in a building.
    pub(crate) fn scene_from_camera_on(self, tour: &Tour, time: f64) -> Pose3 {
        let wave = |period: f64, phase: f64| (TAU * (time / period + phase)).sin() as f32;
        let (carrier, height, tremor, down) = match self {
            Self::Static => (tour.scene_from_carrier(0.0), HAND, 0.0, 0.2),
            Self::Robot => (tour.scene_from_carrier(time), ROBOT, 0.0, 0.0),
            _ => (tour.scene_from_carrier(time), HAND, 1.0, 0.2),
        };
        let sway = tremor
            * Vec3::new(
                0.02 * wave(1.1, 0.3),
                0.03 * wave(1.7, 0.0),
                0.02 * wave(0.55, 0.1) + 0.04 * wave(5.9, 0.4),
            );
        // Somebody who carries a camera looks to both sides.
        let glance = tremor * (0.35 * wave(6.7, 0.15) + 0.01 * wave(1.3, 0.0));
        let eye = Vec3::new(0.0, 0.0, height) + sway;
        let ahead = Vec3::new(glance.cos(), glance.sin(), -(down + tremor * 0.08 * wave(8.3, 0.5)));
        carrier * looking(eye, eye + ahead)
    }

    fn view_from_camera(self, viewpoint: &Viewpoint, time: f64) -> Pose3 {
        let Viewpoint { station, target, pivot, .. } = *viewpoint;
        let wave = |period: f64, phase: f64| (TAU * (time / period + phase)).sin() as f32;
        let leg = |k: f64| {
            // One axis after the other, each with a full wave of 5 s.
            let within = time.rem_euclid(15.0) - 5.0 * k;
            if (0.0..5.0).contains(&within) { (TAU * within / 5.0).sin() as f32 } else { 0.0 }
        };
        match self {
            Self::Static => looking(station, target),
            Self::Xyz => {
                let offset = Vec3::new(0.4 * leg(0.0), 0.3 * leg(1.0), 0.3 * leg(2.0));
                looking(station + offset, target + offset)
            }
            Self::Rpy => {
                let turn = Vec3::new(0.25 * leg(0.0), 0.3 * leg(1.0), 0.3 * leg(2.0));
                looking(station, target) * Pose3::from_rotation(Rot3::from_scaled_axis(turn))
            }
            Self::HalfSphere => {
                let azimuth = 0.75 * wave(13.0, 0.0);
                let elevation = 0.35 + 0.3 * wave(5.2, 0.1);
                let back = Vec3::new(
                    azimuth.sin() * elevation.cos(),
                    -azimuth.cos() * elevation.cos(),
                    elevation.sin(),
                );
                looking(pivot + 1.1 * back, target.lerp(pivot, 0.3))
            }
            Self::Robot => {
                let eye = Vec3::new(0.5 * wave(11.0, 0.0), station.y + 0.25 * wave(7.3, 0.2), ROBOT);
                looking(eye, Vec3::new(target.x + 0.8 * wave(12.1, 0.15), target.y, ROBOT))
            }
            Self::Handheld => {
                let sway = Vec3::new(
                    0.50 * wave(11.0, 0.0) + 0.010 * wave(1.1, 0.3),
                    0.25 * wave(7.3, 0.2) + 0.008 * wave(0.9, 0.0),
                    0.12 * wave(5.9, 0.4) + 0.012 * wave(0.55, 0.1),
                );
                let glance = Vec3::new(
                    0.80 * wave(12.1, 0.15) + 0.020 * wave(1.3, 0.0),
                    0.0,
                    0.25 * wave(8.3, 0.5) + 0.015 * wave(0.7, 0.2),
                );
                let roll = Rot3::from_rotation_z(0.03 * wave(3.7, 0.0));
                looking(station + sway, target + glance) * Pose3::from_rotation(roll)
            }
        }
    }
}

/// The pose of a camera at `eye` that looks at `target`, with z up in the image.
fn looking(eye: Vec3, target: Vec3) -> Pose3 {
    let forward = (target - eye).normalize();
    let right = forward.cross(Vec3::Z).normalize();
    let down = forward.cross(right);
    let rotation = Rot3::from_mat3(&Mat3::from_cols(right, down, forward));
    Pose3::from_parts(eye, rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_at_the_desk_with_the_room_upright() {
        for path in [
            CameraPath::Handheld,
            CameraPath::Static,
            CameraPath::Xyz,
            CameraPath::Rpy,
            CameraPath::HalfSphere,
        ] {
            for step in 0..300 {
                let pose = path.scene_from_camera(&Viewpoint::OFFICE, 0.1 * f64::from(step));
                let forward = pose.rotation * Vec3::Z;
                let down = pose.rotation * Vec3::Y;
                assert!(forward.y > 0.7, "{path:?} looks along {forward}");
                assert!(down.z < -0.6, "{path:?}: image down is {down}");
                assert!(pose.translation.z > 0.5 && pose.translation.z < 2.3);
            }
        }
    }
}
