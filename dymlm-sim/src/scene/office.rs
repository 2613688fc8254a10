use std::f32::consts::FRAC_PI_2;

use parry3d::math::{Pose3, Vec3};
use parry3d::shape::Cuboid;

use super::builder::Builder;
use super::furniture::{self, SEAT};
use super::palette::{BEECH, CARPET, FABRIC, PAPER, PLASTER, SPINES, STEEL};
use super::person::Action;
use super::walk::Walk;
use super::{Activity, Cast, Scene, Shape, Viewpoint, things};

/// Ways of the two walkers: up and down between desk and camera, and round the room, behind the camera.
const NEAR: [[f32; 2]; 6] = [[-2.1, 0.2], [-0.7, 0.0], [0.8, -0.15], [2.1, 0.08], [1.0, 0.17], [-0.6, 0.24]];
const FAR: [[f32; 2]; 8] = [
    [2.1, 0.4],
    [0.6, 0.47],
    [-0.9, 0.46],
    [-2.1, 0.1],
    [-2.05, -1.4],
    [-1.3, -2.7],
    [1.2, -2.7],
    [2.1, -1.2],
];
/// A trolley's way round the camera, clear of people who sit at the desk.
const ROUND: [[f32; 2]; 8] = [
    [2.0, -0.1],
    [0.7, 0.05],
    [-0.8, 0.05],
    [-2.0, -0.15],
    [-2.05, -1.4],
    [-1.3, -2.7],
    [1.2, -2.7],
    [2.1, -1.3],
];

/// Height of the desk's top, metres.
const DESK: f32 = 0.74;

impl Scene {
    /// An office of 6.0 x 6.4 m: a desk before a partition with two monitors, keyboards and small things,
    /// three swivel chairs, a cabinet, a shelf, a plant, and up to two people. They walk between the desk and
    /// the camera; or sit before the ends of the desk, half turned to each other, so that the desk is seen
    /// between them; or sit at the desk with their backs to the camera.
    pub(crate) fn office(cast: &Cast) -> Self {
        let mut b = Builder::default();
        room(&mut b);
        desk(&mut b);
        desk_things(&mut b);
        let walks = cast.walk([&NEAR, &FAR]);
        let way = match cast.activity {
            Activity::Walking => walks[1].ahead(),
            Activity::Sitting | Activity::AtDesks => Walk::new(&ROUND, 0.6, 0.0),
        };
        let (third, actions) = match cast.activity {
            Activity::Walking => {
                for (place, yaw) in [([-0.55, 1.16], 0.5), ([0.62, 1.20], -0.4)] {
                    furniture::swivel_chair(&mut b, place, yaw, SEAT);
                }
                ([1.55, 1.20], walks.map(Action::Walks))
            }
            Activity::Sitting => {
                ([1.75, 1.15], cast.sit(&mut b, [([-0.95, 0.85], -1.25), ([0.95, 0.80], 1.25)]))
            }
            Activity::AtDesks => {
                ([1.75, 1.15], cast.sit(&mut b, [([-0.45, 1.0], 0.06), ([0.40, 1.0], -0.08)]))
            }
        };
        furniture::swivel_chair(&mut b, third, 2.3, SEAT);
        along_the_walls(&mut b);
        cast.enter(&mut b, actions);
        Self::of(b, Viewpoint::OFFICE, way)
    }
}

fn room(b: &mut Builder) {
    let half = Vec3::new(3.0, 3.225, 1.3);
    let above_floor = Pose3::from_translation(Vec3::new(0.0, -0.125, half.z));
    b.thing(None, [0.0; 3], 0.0).part(Shape::Interior(Cuboid::new(half)), above_floor, PLASTER);
    // A carpet 1 cm thick covers the room.
    b.thing(None, [0.0; 3], 0.0).cuboid([0.0, -0.125, 0.005], [5.98, 6.43, 0.01], CARPET);
    // A door and a poster give texture to the far wall.
    b.door([-2.3, 3.07], 0.0, BEECH);
    b.thing(None, [2.1, 3.09, 1.6], 0.0).cuboid([0.0, 0.0, 0.0], [0.7, 0.02, 0.9], SPINES);
}

fn desk(b: &mut Builder) {
    b.thing(None, [0.0, 1.72, 0.0], 0.0).cuboid([0.0, 0.0, DESK - 0.015], [1.9, 0.75, 0.03], BEECH).cuboid(
        [0.0, 0.30, 0.45],
        [1.8, 0.02, 0.35],
        STEEL,
    );
    for x in [-0.92, 0.92] {
        b.cuboid([x, 0.0, 0.355], [0.04, 0.66, 0.71], STEEL);
    }
    b.thing(None, [0.0, 2.14, 0.0], 0.0).cuboid([0.0, 0.0, 0.70], [2.3, 0.05, 1.38], FABRIC);
}

fn desk_things(b: &mut Builder) {
    for (x, yaw) in [(-0.42, 0.18), (0.35, -0.15)] {
        things::monitor(b, [x, 1.88, DESK], yaw);
        things::keyboard(b, [x, 1.52, DESK], 0.6 * yaw);
        things::mouse(b, [x + 0.31, 1.50, DESK], 0.0);
    }
    things::two_books(b, [-0.80, 1.58, DESK], 0.3);
    b.thing(None, [0.0, 1.46, DESK], -0.2).cuboid([0.0, 0.0, 0.003], [0.21, 0.297, 0.006], PAPER);
    things::bottle(b, [0.74, 1.72, DESK], 0.0);
    things::cup(b, [0.02, 1.70, DESK], 0.0);
    things::teddy_bear(b, [-0.84, 1.92, DESK], 0.2);
}

fn along_the_walls(b: &mut Builder) {
    furniture::cabinet(b, [-1.62, 1.95], 0.0);
    things::row_of_books(b, [-1.62, 1.98, 1.10], 0.0, [-0.05, 0.12], [0.38, 0.19, 0.24]);
    furniture::shelf(b, [-2.72, 0.35], FRAC_PI_2);
    for z in [0.115, 0.615, 1.115] {
        things::row_of_books(b, [-2.74, 0.35, z], FRAC_PI_2, [-0.12, 0.14], [0.85, 0.2, 0.28]);
    }
    furniture::plant(b, [1.55, 2.1], 0.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_stands_in_the_room_and_belongs_to_a_thing() {
        let scene = Scene::office(&Cast::usual(Activity::Walking, 2));
        assert!(scene.static_parts.len() > 80);
        assert_eq!(scene.people.len(), 2);
        for part in &scene.static_parts {
            assert!(part.instance < scene.instances.len() && !scene.is_mover(part.instance));
            let center = part.scene_from_part.translation;
            assert!(
                center.x.abs() <= 3.0 && (-3.35..=3.1).contains(&center.y) && (0.0..=2.6).contains(&center.z)
            );
        }
    }

    #[test]
    fn people_walk_through_the_air_only() {
        let mut cast = Cast::usual(Activity::Walking, 2);
        cast.choice = [[0.5, 0.0]; 2];
        let scene = Scene::office(&cast);
        let mut bodies = Vec::new();
        for step in 0..400 {
            scene.moving_parts(0.1 * f64::from(step), &mut bodies);
            assert_eq!(bodies.len(), 36);
            // Above the shoes, which touch the floor.
            for body in bodies.iter().filter(|body| body.scene_from_part.translation.z > 0.3) {
                let center = body.scene_from_part.translation;
                assert!(center.x.abs() < 2.8 && (-3.1..2.3).contains(&center.y));
                for part in &scene.static_parts {
                    let local = part.scene_from_part.inverse_transform_point(center);
                    assert!(
                        !part.shape.reaches(local, 0.02),
                        "at step {step}: {center} in {:?}",
                        part.scene_from_part
                    );
                }
            }
        }
    }
}
