//! Tests of what must hold in every room: things do not intersect and stand on something, people and cameras
//! move through free space.

use std::sync::LazyLock;

use dymlm_test_support::cases;
use parry3d::math::Vec3;

use super::person::Action;
use super::*;
use crate::{CameraPath, SequenceConfig};

const PATHS: [CameraPath; 6] = [
    CameraPath::Handheld,
    CameraPath::Static,
    CameraPath::Xyz,
    CameraPath::Rpy,
    CameraPath::HalfSphere,
    CameraPath::Robot,
];

static WALKING: LazyLock<Vec<(String, Scene)>> = LazyLock::new(|| rooms(Activity::Walking));
static AT_DESKS: LazyLock<Vec<(String, Scene)>> = LazyLock::new(|| rooms(Activity::AtDesks));
static SITTING: LazyLock<Vec<(String, Scene)>> = LazyLock::new(|| rooms(Activity::Sitting));

/// All designed rooms and random ones, with two people.
fn rooms(activity: Activity) -> Vec<(String, Scene)> {
    let designed = [Room::Office, Room::TwoTables].map(|room| (room, 7));
    // The camera came within 10 cm of a pillar in 44, of a wall in 136.
    let random = (0..u64::from(cases(10))).chain([44, 136]).map(|seed| (Room::Random, seed));
    let all = designed.into_iter().chain(random);
    let scene = |(room, seed)| {
        let config = SequenceConfig { seed, room, activity, ..SequenceConfig::default() };
        (format!("{room:?} {seed} {activity:?}"), Scene::new(&config))
    };
    all.map(scene).collect()
}

/// Every arrangement of furniture: in random rooms it is the same for walkers and sitters.
fn arrangements() -> impl Iterator<Item = &'static (String, Scene)> {
    WALKING.iter().chain(SITTING.iter().take(2))
}

/// Buildings without and with a ramp, one of them with an odd number of rooms.
static BUILDINGS: LazyLock<Vec<(String, Scene)>> = LazyLock::new(|| {
    let building =
        |(seed, rooms)| (format!("{rooms} rooms {seed}"), Scene::new(&SequenceConfig::building(seed, rooms)));
    [(0, 2), (1, 9), (2, 16)].map(building).into()
});

/// Buildings made from a floor plan: a hall of 17 x 11 m that is open on one side, and a room that a door of 1 m
/// leads to.
static PLANNED: LazyLock<Vec<(String, Scene)>> = LazyLock::new(|| {
    let (width, height) = (240, 110);
    let is_wall = |x: usize, y: usize| {
        let is_outer = !(2..108).contains(&y) || x < 2;
        let parts = (170..172).contains(&x) && !(50..60).contains(&y);
        let is_pillar = (80..84).contains(&x) && (50..54).contains(&y);
        is_outer || parts || is_pillar
    };
    let cell = |k: usize| if is_wall(k % width, k / width) { PlanCell::Occupied } else { PlanCell::Free };
    let cells = (0..width * height).map(cell).collect();
    let grid = PlanGrid { width, height, resolution: 0.1, origin: [-4.0, 1.5], cells };
    let plan = BuildingPlan::new(&grid, 2.7).unwrap();
    let building = |seed: u64| {
        let config = SequenceConfig::planned_building(plan.clone(), seed, 10.0, 4000);
        (format!("planned {seed}"), Scene::new(&config))
    };
    (0..4).map(building).collect()
});

/// All buildings.
fn buildings() -> impl Iterator<Item = &'static (String, Scene)> {
    BUILDINGS.iter().chain(PLANNED.iter())
}

/// Points of a body's surface at most `spacing` apart, in the scene.
fn surface_points(part: &Part, spacing: f32) -> Vec<Vec3> {
    let half = part.shape.half_extents();
    let steps = |half: f32| (2.0 * half / spacing).ceil().max(1.0) as usize;
    let along = |k: usize, half: f32| half * (2.0 * k as f32 / steps(half) as f32 - 1.0);
    let mut points = Vec::new();
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        for i in 0..=steps(half[a]) {
            for j in 0..=steps(half[b]) {
                for side in [-1.0, 1.0] {
                    let mut point = Vec3::ZERO;
                    point[axis] = side * half[axis];
                    point[a] = along(i, half[a]);
                    point[b] = along(j, half[b]);
                    points.push(part.scene_from_part * onto_surface(&part.shape, point));
                }
            }
        }
    }
    points
}

/// Projects a point of a body's bounding box onto the body's surface.
fn onto_surface(shape: &Shape, point: Vec3) -> Vec3 {
    match shape {
        Shape::Cuboid(_) | Shape::Interior(_) => point,
        Shape::Ellipsoid(radii) => (point / *radii).normalize() * *radii,
        Shape::Capsule(capsule) => {
            let reach = capsule.segment.b.y.abs();
            let on_axis = Vec3::new(0.0, point.y.clamp(-reach, reach), 0.0);
            on_axis + (point - on_axis).normalize_or(Vec3::X) * capsule.radius
        }
        Shape::Cylinder(cylinder) => {
            let radial = Vec3::new(point.x, 0.0, point.z);
            // On the caps, the square is shrunk to the disc; points of the box's sides move onto the
            // cylinder's side.
            let square = radial.abs().max_element().max(1e-6);
            let scaled = radial.normalize_or(Vec3::X) * square.min(cylinder.radius);
            Vec3::new(scaled.x, point.y, scaled.z)
        }
    }
}

/// Half extents of the box around a body along the scene's axes.
fn reach(part: &Part) -> Vec3 {
    let half = part.shape.half_extents();
    let rotation = part.scene_from_part.rotation;
    [Vec3::X, Vec3::Y, Vec3::Z]
        .iter()
        .zip(half.to_array())
        .map(|(&axis, half)| (rotation * axis * half).abs())
        .sum()
}

fn near(a: &Part, b: &Part) -> bool {
    let apart = (a.scene_from_part.translation - b.scene_from_part.translation).abs();
    let radius = |part: &Part| part.shape.half_extents().length();
    apart.length() < radius(a) + radius(b) && (apart - reach(a) - reach(b)).max_element() < 0.0
}

/// Largest depth of the points inside a body, metres.
fn depth_of(points: &[Vec3], body: &Part) -> f32 {
    let local = points.iter().map(|&point| body.scene_from_part.inverse_transform_point(point));
    let inside = local.filter(|&point| body.shape.reaches(point, 0.0));
    inside.map(|point| body.shape.surface_distance(point)).fold(0.0, f32::max)
}

fn is_room(part: &Part) -> bool {
    matches!(part.shape, Shape::Interior(_))
}

/// The floor is the second thing of every room.
const FLOOR: usize = 1;

/// The shell is the first thing of a building (walls, floors), the first two of a room (walls, floor).
fn is_shell(scene: &Scene, thing: usize) -> bool {
    if scene.tour.is_some() { thing == 0 } else { thing <= FLOOR }
}

#[test]
fn things_do_not_intersect() {
    for (name, scene) in arrangements().chain(buildings()) {
        let parts = &scene.static_parts;
        let points: Vec<Vec<Vec3>> = parts.iter().map(|part| surface_points(part, 0.03)).collect();
        for (i, a) in parts.iter().enumerate().filter(|(_, part)| !is_room(part)) {
            for (j, b) in parts.iter().enumerate() {
                if a.instance != b.instance && !is_room(b) && near(a, b) {
                    // In the office, things stand 1 cm deep in the carpet, and a mouse on a sheet of paper.
                    let office = scene.viewpoint == Viewpoint::OFFICE;
                    let depth = depth_of(&points[i], b);
                    assert!(
                        depth < if office { 0.011 } else { 0.0075 },
                        "{name}: {i} of {:?} is {depth} m deep in {j} of {:?} at {}",
                        scene.instances[a.instance].label,
                        scene.instances[b.instance].label,
                        a.scene_from_part.translation
                    );
                }
            }
        }
    }
}

#[test]
fn things_are_in_the_room_and_stand_on_something() {
    for (name, scene) in arrangements().chain(buildings()) {
        let parts = &scene.static_parts;
        let walls: Vec<&Part> = parts
            .iter()
            .filter(|part| if scene.tour.is_some() { part.instance == 0 } else { is_room(part) })
            .collect();
        for thing in 0..scene.instances.len() {
            let own: Vec<&Part> = parts.iter().filter(|part| part.instance == thing).collect();
            if own.iter().any(|part| is_room(part)) || scene.is_mover(thing) || own.is_empty() {
                continue;
            }
            let points: Vec<Vec3> = own.iter().flat_map(|part| surface_points(part, 0.03)).collect();
            for &point in points.iter().filter(|_| scene.tour.is_none()) {
                let local = walls[0].scene_from_part.inverse_transform_point(point);
                let bound = walls[0].shape.half_extents() + 1e-3;
                assert!(local.abs().cmple(bound).all(), "{name}: {point} is not in the room");
            }
            if is_shell(scene, thing) {
                continue;
            }
            let label = scene.instances[thing].label;
            let lowest = points.iter().map(|point| point.z).fold(f32::INFINITY, f32::min);
            // Swivel chairs have no castors.
            let gap = if label == Some("chair") { 0.04 } else { 0.004 };
            let touches = |point: &Vec3, margin: f32| {
                parts.iter().any(|part| {
                    part.instance != thing
                        && part.shape.reaches(part.scene_from_part.inverse_transform_point(*point), margin)
                })
            };
            let stands =
                points.iter().filter(|point| point.z < lowest + 2e-3).any(|point| touches(point, gap));
            let thin = own.iter().all(|part| part.shape.half_extents().min_element() < 0.011);
            let hangs = thin && {
                let on_wall = |point: &&Vec3| {
                    walls.iter().any(|wall| {
                        let local = wall.scene_from_part.inverse_transform_point(**point);
                        wall.shape.surface_distance(local) < 2e-3
                    })
                };
                points.iter().filter(on_wall).count() > 20
            };
            let place = scene.instances[thing].scene_from_thing.translation;
            assert!(stands || hangs, "{name}: {label:?} at {place} floats, lowest point at {lowest}");
            // The thing's own frame is at the height of its lowest point.
            assert!(hangs || (lowest - place.z).abs() <= gap + 0.008, "{name}: {label:?}: {lowest}, {place}");
        }
    }
}

#[test]
fn people_meet_no_furniture_but_the_chairs_they_sit_on() {
    for (name, scene) in WALKING.iter().chain(SITTING.iter()).chain(AT_DESKS.iter()) {
        let mut bodies = Vec::new();
        for step in 0..40 {
            scene.moving_parts(1.06 * f64::from(step), &mut bodies);
            assert_eq!(bodies.len(), 36);
            for body in &bodies {
                for part in scene.static_parts.iter().filter(|part| part.instance != FLOOR && !is_room(part))
                {
                    if !near(body, part) {
                        continue;
                    }
                    let depth = depth_of(&surface_points(body, 0.05), part);
                    // Hands that type touch keys.
                    let touch = if name.ends_with("AtDesks") { 0.02 } else { 0.0 };
                    let allowed = if sits_on(scene, body.instance, part.instance) { 0.03 } else { touch };
                    assert!(
                        depth <= allowed,
                        "{name}, step {step}: {depth} m in {:?} at {}",
                        scene.instances[part.instance].label,
                        body.scene_from_part.translation
                    );
                }
            }
        }
    }
}

#[test]
fn in_buildings_people_sit_and_walk_in_rooms() {
    for (name, scene) in buildings() {
        let sits = |person: &&Person| matches!(person.action, Action::Sits(_));
        let sitting = scene.people.iter().filter(sits).count();
        assert!(sitting >= 2 && scene.people.len() > sitting, "{name}: {sitting} sit");
        let mut bodies = Vec::new();
        for step in 0..40 {
            scene.moving_parts(0.53 * f64::from(step), &mut bodies);
            for body in &bodies {
                let is_floor = |part: &Part| part.instance == 0 && part.scene_from_part.translation.z < 0.4;
                for part in scene.static_parts.iter().filter(|part| !is_floor(part) && near(body, part)) {
                    let allowed = if sits_on(scene, body.instance, part.instance) { 0.03 } else { 0.0 };
                    let depth = depth_of(&surface_points(body, 0.05), part);
                    let at = body.scene_from_part.translation;
                    assert!(depth <= allowed, "{name}, step {step}: {depth} m in {} at {at}", part.instance);
                }
            }
        }
    }
}

#[test]
fn in_planned_buildings_people_walk_through_and_meet_neither_each_other_nor_the_camera() {
    for (name, scene) in PLANNED.iter() {
        let tour = scene.tour.as_ref().unwrap();
        let walks = |person: &&Person| matches!(person.action, Action::Walks(_));
        let mut reach = vec![[Vec3::INFINITY, Vec3::NEG_INFINITY]; scene.people.iter().filter(walks).count()];
        let mut bodies = Vec::new();
        for step in 0..(5.0 * tour.seconds()) as u32 {
            let time = 0.2 * f64::from(step);
            let mut places = vec![tour.scene_from_carrier(time).translation];
            for (person, [low, high]) in scene.people.iter().filter(walks).zip(&mut reach) {
                bodies.clear();
                person.pose(time, &mut bodies);
                let hips = bodies[0].scene_from_part.translation.with_z(0.0);
                assert!(
                    places.iter().all(|place| place.distance(hips) > 0.85),
                    "{name}: met at {hips}, {time} s"
                );
                places.push(hips);
                (*low, *high) = (low.min(hips), high.max(hips));
            }
        }
        let farthest = reach.iter().map(|[low, high]| (high - low).max_element()).fold(0.0, f32::max);
        assert!(farthest > 8.0, "{name}: {farthest} m of {} walkers", reach.len());
    }
}

#[test]
fn things_of_one_height_and_kind_stand_on_both_sides_of_walls() {
    for (name, scene) in BUILDINGS.iter() {
        let (labelled, _): (Vec<&Instance>, Vec<_>) =
            scene.instances.iter().partition(|thing| thing.label.is_some());
        let twin = |thing: &&&Instance| {
            let at = thing.scene_from_thing.translation;
            labelled.iter().any(|other| {
                let other_at = other.scene_from_thing.translation;
                let apart = (at - other_at).abs();
                other.label == thing.label
                    && apart.z < 1e-3
                    && (0.2..2.0).contains(&apart.x)
                    && apart.y < 1.3
                    && at.z - at.z.floor() > 0.01
            })
        };
        assert!(labelled.iter().filter(twin).count() > 6, "{name}");
    }
}

/// Whether a person sits on a thing: the thing stands within 10 cm of the seat.
fn sits_on(scene: &Scene, person: usize, thing: usize) -> bool {
    let chair = scene.instances[thing].scene_from_thing.translation;
    scene.people.iter().filter(|it| it.instance == person).any(|it| match &it.action {
        Action::Sits(seat) => {
            let seat = it.scene_from_room * Vec3::new(seat.position.x, seat.position.y, 0.0);
            seat.distance(chair) < 0.1
        }
        Action::Walks(_) => false,
    })
}

#[test]
fn every_random_room_is_one() {
    let other = Scene::two_tables(&Cast::usual(Activity::Walking, 0)).viewpoint;
    assert!(WALKING.iter().skip(2).all(|(_, scene)| scene.viewpoint != other));
}

#[test]
fn people_stay_apart() {
    // The office is left out: its ways meet at their ends, and only the seed keeps the people apart.
    for (name, scene) in WALKING.iter().skip(1).chain(SITTING.iter()) {
        let mut bodies = Vec::new();
        for step in 0..300 {
            scene.moving_parts(0.37 * f64::from(step), &mut bodies);
            let (first, second) = bodies.split_at(18);
            for a in first {
                for b in second.iter().filter(|b| near(a, b)) {
                    assert!(
                        depth_of(&surface_points(a, 0.08), b) == 0.0,
                        "{name}: people meet at step {step}"
                    );
                }
            }
        }
    }
}

#[test]
fn who_sits_stays_and_moves_a_little() {
    for (name, scene) in SITTING.iter() {
        let at = |time: f64| {
            let mut bodies = Vec::new();
            scene.moving_parts(time, &mut bodies);
            bodies.iter().map(|body| body.scene_from_part.translation).collect::<Vec<_>>()
        };
        let start = at(0.0);
        let mut farthest = [0.0_f32; 36];
        for step in 1..150 {
            for (far, (a, b)) in farthest.iter_mut().zip(at(0.1 * f64::from(step)).iter().zip(&start)) {
                *far = far.max(a.distance(*b));
            }
        }
        // The order is legs, trunk, left arm, right arm, head: hands move, feet hardly.
        for far in farthest.chunks(18) {
            assert!(far.iter().all(|&far| far < 0.45), "{name}: {far:?}");
            assert!(far[..6].iter().all(|&far| far < 0.05), "{name}: {far:?}");
            assert!(far[11] > 0.15 && far[14] > 0.15, "{name}: {far:?}");
        }
        for person in &scene.people {
            let Action::Sits(seat) = &person.action else { panic!("{name}: somebody walks") };
            let mut bodies = Vec::new();
            person.pose(3.0, &mut bodies);
            for body in bodies {
                let away = body.scene_from_part.translation.truncate().distance(seat.position);
                assert!(away < 0.75, "{name}: {away} m from the seat");
                let lowest = surface_points(&body, 0.02).iter().map(|p| p.z).fold(f32::INFINITY, f32::min);
                assert!(lowest > -0.01, "{name}: {lowest} m below the floor");
            }
        }
    }
}

#[test]
fn the_camera_moves_through_air() {
    for (name, scene) in arrangements() {
        for path in PATHS {
            let mut bodies = Vec::new();
            for step in 0..250 {
                let time = 0.27 * f64::from(step);
                let eye = path.scene_from_camera(&scene.viewpoint, time).translation;
                let local = scene.viewpoint.scene_from_view.inverse_transform_point(eye);
                let from_station = local - scene.viewpoint.station;
                let aside = (local.x - scene.viewpoint.pivot.x).abs().min(from_station.x.abs());
                assert!(
                    aside < 0.85 && (-0.3..0.75).contains(&from_station.y),
                    "{name} {path:?}: {from_station} from the station"
                );
                scene.moving_parts(time, &mut bodies);
                for part in scene.static_parts.iter().chain(&bodies) {
                    let local = part.scene_from_part.inverse_transform_point(eye);
                    let far = (local.abs() - part.shape.half_extents()).max_element() > 0.1 && !is_room(part);
                    assert!(
                        far || !part.shape.reaches(local, 0.1),
                        "{name} {path:?} at {eye}, {time} s: {part:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_camera_goes_through_the_doors_of_a_building() {
    for (name, scene) in buildings() {
        for path in [CameraPath::Handheld, CameraPath::Robot] {
            let (mut bodies, mut last) = (Vec::new(), None);
            // In a planned building people stay off the camera for one tour.
            let seconds = scene.tour.as_ref().map_or(0.0, Tour::seconds);
            let steps = if name.starts_with("planned") { (2.0 * seconds) as u32 } else { 1300 };
            for step in 0..steps {
                let time = 0.5 * f64::from(step);
                let eye = scene.scene_from_camera(path, time).translation;
                assert!(last.is_none_or(|last: Vec3| last.distance(eye) < 0.8), "{name}: a jump to {eye}");
                last = Some(eye);
                scene.moving_parts(time, &mut bodies);
                for part in scene.static_parts.iter().chain(&bodies) {
                    let local = part.scene_from_part.inverse_transform_point(eye);
                    assert!(!part.shape.reaches(local, 0.15), "{name} {path:?} at {eye}, {time} s");
                }
            }
        }
    }
}
