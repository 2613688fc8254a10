use std::f32::consts::FRAC_PI_2;

use parry3d::math::{Pose3, Rot3, Vec2, Vec3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::floor_plan::Footprint;
use super::furnishing::{Chair, Furnished};
use crate::scene::{Part, Viewpoint, first_hit};

/// Where the camera is in a random room.
#[derive(Debug, Clone, Copy)]
pub(super) struct Station {
    /// The floor that the camera's paths need; the camera looks along its y axis.
    pub(super) footprint: Footprint,
    scene_from_view: Pose3,
    height: f32,
    target: Vec3,
}

/// Half lengths of the floor that the camera's paths need, across and along the view, and how far ahead of
/// the station its middle is, metres: see [`Viewpoint`].
const NEEDED: [f32; 2] = [0.85, 0.525];
const AHEAD: f32 = 0.225;
/// How far things and walls are from that floor at least, metres.
const BESIDE_CAMERA: f32 = 0.1;
/// Tangents of the angles from the view's axis at which things count as seen; a Kinect has 0.61 and 0.46.
const WIDTH: f32 = 0.5;
const HEIGHT: f32 = 0.4;
/// Nothing may be nearer than this within the view, metres.
const OPEN: f32 = 0.9;
/// Random places that are tried.
const TRIES: usize = 400;
/// Fewest labelled things that a good station sees.
const MIN_SEEN: usize = 10;

/// Of the places that see both seats, the one that sees the most labelled things; `None` when no place sees
/// enough.
pub(super) fn choose_station(furnished: &Furnished, rng: &mut ChaCha8Rng) -> Option<Station> {
    let mut best: Option<(usize, Station)> = None;
    for _ in 0..TRIES {
        let Some(station) = station(furnished, rng).filter(|station| station.sees_enough(furnished)) else {
            continue;
        };
        let seen = station.things_seen(furnished);
        if best.as_ref().is_none_or(|(most, _)| seen > *most) {
            best = Some((seen, station));
        }
    }
    best.map(|(_, station)| station)
}

/// A random place on enough free floor, looking towards the seats.
fn station(furnished: &Furnished, rng: &mut ChaCha8Rng) -> Option<Station> {
    let Vec2 { x, y } = furnished.floor.half;
    let place = Vec2::new(rng.random_range(-x..x), rng.random_range(-y..y));
    let seats = furnished.seats.iter().map(|chair| Vec2::from(chair.place));
    let ahead = seats.sum::<Vec2>() / furnished.seats.len().max(1) as f32 - place;
    let yaw = ahead.y.atan2(ahead.x) - FRAC_PI_2 + rng.random_range(-0.2..0.2);
    let middle = Footprint::new(place, yaw, NEEDED).point(0.0, AHEAD);
    let station = Station {
        footprint: Footprint::new(middle, yaw, NEEDED),
        scene_from_view: Pose3::from_parts(Vec3::new(place.x, place.y, 0.0), Rot3::from_rotation_z(yaw)),
        height: rng.random_range(1.3..1.55),
        target: Vec3::new(0.0, rng.random_range(2.4..3.0), rng.random_range(0.7..0.9)),
    };
    furnished.floor.fits(&station.floor(), 0.0).then_some(station)
}

impl Station {
    /// The floor on which nothing else may stand.
    pub(super) fn floor(&self) -> Footprint {
        self.footprint.widened(BESIDE_CAMERA)
    }

    pub(super) fn viewpoint(&self) -> Viewpoint {
        Viewpoint {
            scene_from_view: self.scene_from_view,
            station: Vec3::new(0.0, 0.0, self.height),
            target: self.target,
            pivot: Vec3::new(0.0, 1.2, 0.95),
        }
    }

    /// Whether both seats, 1.4 to 3.6 m away, and some labelled things are seen.
    pub(super) fn sees_enough(&self, furnished: &Furnished) -> bool {
        let sees_seat = |chair: &Chair| {
            let [x, y] = chair.place;
            let away = self.scene_from_view.translation.truncate().distance(Vec2::new(x, y));
            // Seen from behind, the chair hides a sitter's chest, so points higher up are tested.
            let heights = if furnished.has_desks { [1.2, 1.25] } else { [0.85, 1.15] };
            let [chest, head] = heights.map(|z| Vec3::new(x, y, z));
            (1.4..3.6).contains(&away)
                && self.sees(furnished, chest, None)
                && self.sees(furnished, head, None)
        };
        furnished.seats.iter().all(sees_seat)
            && self.things_seen(furnished) >= MIN_SEEN
            && self.has_open_view(furnished)
    }

    /// Whether nothing large stands right before the camera.
    fn has_open_view(&self, furnished: &Furnished) -> bool {
        let eye = Vec3::new(0.0, 0.0, self.height);
        let axis = (self.target - eye).normalize_or(Vec3::Y);
        let up = Vec3::X.cross(axis);
        let mut rays = (-2..=2).flat_map(|i| (-1..=1).map(move |j| (i as f32 / 2.0, j as f32)));
        rays.all(|(right, high)| {
            let ahead = OPEN * (axis + right * WIDTH * Vec3::X + high * HEIGHT * up);
            let [from, to] = [eye, eye + ahead].map(|point| self.scene_from_view * point);
            first_hit(&furnished.builder.parts, from, to).is_none()
        })
    }

    /// Number of labelled things in view, judged by one point of each thing.
    fn things_seen(&self, furnished: &Furnished) -> usize {
        let things = labelled_things(furnished);
        things.iter().filter(|(thing, point)| self.sees(furnished, *point, Some(*thing))).count()
    }

    /// Whether a point is well within the image, 0.6 to 4 m away, and occluded by nothing except `thing`
    /// itself.
    pub(super) fn sees(&self, furnished: &Furnished, point: Vec3, thing: Option<usize>) -> bool {
        let eye = Vec3::new(0.0, 0.0, self.height);
        let local = self.scene_from_view.inverse_transform_point(point) - eye;
        let axis = (self.target - eye).normalize_or(Vec3::Y);
        let depth = local.dot(axis);
        let up = Vec3::X.cross(axis);
        let within = (0.6..4.0).contains(&depth)
            && local.x.abs() < WIDTH * depth
            && local.dot(up).abs() < HEIGHT * depth;
        let from = self.scene_from_view * eye;
        within && first_hit(&furnished.builder.parts, from, point).is_none_or(|hit| Some(hit) == thing)
    }
}

/// All labelled things, each with the centre of its largest part.
fn labelled_things(furnished: &Furnished) -> Vec<(usize, Vec3)> {
    let volume = |part: &&Part| part.shape.half_extents().element_product();
    let largest = |thing: usize| {
        let parts = furnished.builder.parts.iter().filter(|part| part.instance == thing);
        parts.max_by(|a, b| volume(a).total_cmp(&volume(b)))
    };
    let labelled = furnished.builder.instances.iter().enumerate().filter(|(_, thing)| thing.label.is_some());
    labelled.filter_map(|(thing, _)| Some((thing, largest(thing)?.scene_from_part.translation))).collect()
}
