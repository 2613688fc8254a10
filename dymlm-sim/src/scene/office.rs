use parry3d::math::{Pose3, Vec3};
use parry3d::shape::Cuboid;

use super::builder::Builder;
use super::material::Pattern::{Checker, Glyphs, Noise, Stripes, Wood};
use super::person::Clothes;
use super::walk::Walk;
use super::{Instance, Material, Motion, Person, Scene, Shape};

const PLASTER: Material = Material::new(Noise, 0.35, [0.78, 0.77, 0.72], [0.88, 0.87, 0.83]);
const CARPET: Material = Material::new(Checker, 0.5, [0.33, 0.36, 0.40], [0.42, 0.44, 0.47]);
const FABRIC: Material = Material::new(Noise, 0.06, [0.38, 0.45, 0.55], [0.50, 0.58, 0.68]);
const BEECH: Material = Material::new(Wood, 0.05, [0.66, 0.50, 0.33], [0.80, 0.66, 0.47]);
const STEEL: Material = Material::new(Noise, 0.2, [0.55, 0.56, 0.58], [0.66, 0.67, 0.69]);
const BLACK: Material = Material::new(Noise, 0.04, [0.07, 0.07, 0.08], [0.15, 0.15, 0.16]);
const SCREEN: Material = Material::new(Glyphs, 0.02, [0.10, 0.12, 0.20], [0.75, 0.85, 0.95]).absorbing(0.35);
const KEYS: Material = Material::new(Glyphs, 0.019, [0.06, 0.06, 0.07], [0.45, 0.45, 0.47]);
const CUSHION: Material = Material::new(Noise, 0.03, [0.12, 0.16, 0.30], [0.24, 0.30, 0.48]);
const CABINET: Material = Material::new(Noise, 0.3, [0.62, 0.63, 0.60], [0.72, 0.73, 0.70]);
const PAPER: Material = Material::new(Glyphs, 0.012, [0.93, 0.92, 0.88], [0.25, 0.25, 0.28]);
const SPINES: Material = Material::new(Stripes, 0.035, [0.55, 0.14, 0.12], [0.16, 0.35, 0.55]);
const PLUSH: Material = Material::new(Noise, 0.02, [0.45, 0.29, 0.15], [0.64, 0.45, 0.27]);
const LEAVES: Material = Material::new(Noise, 0.04, [0.10, 0.28, 0.10], [0.30, 0.52, 0.20]);
const CLAY: Material = Material::new(Noise, 0.1, [0.60, 0.33, 0.22], [0.70, 0.42, 0.30]);
const GLASS: Material = Material::new(Stripes, 0.07, [0.12, 0.40, 0.22], [0.85, 0.88, 0.80]).absorbing(0.15);
const CHINA: Material = Material::new(Stripes, 0.03, [0.90, 0.90, 0.88], [0.75, 0.20, 0.18]);

/// Height of the desk's top, metres.
const DESK: f32 = 0.74;

impl Scene {
    /// An office of 6.0 x 6.4 m: a desk before a partition with two monitors, keyboards and small things, three
    /// swivel chairs, a cabinet, a shelf, a plant, and up to two people who walk between the desk and the camera.
    /// `choice` (two values of 0..1 a person) sets where they start and how fast they walk.
    pub(crate) fn office(people: usize, choice: [[f64; 2]; 2]) -> Self {
        let mut b = Builder::default();
        room(&mut b);
        desk(&mut b);
        desk_things(&mut b);
        for (place, yaw) in [([-0.55, 1.16], 0.5), ([0.62, 1.20], -0.4), ([1.55, 1.20], 2.3)] {
            swivel_chair(&mut b, [place[0], place[1], 0.0], yaw);
        }
        cabinet(&mut b);
        shelf(&mut b);
        plant(&mut b);

        let people = walkers(choice).into_iter().take(people).map(|(walk, height, clothes)| {
            b.instances.push(Instance {
                label: Some("person"),
                motion: Motion::Moves,
                scene_from_thing: Pose3::IDENTITY,
            });
            Person { walk, height, clothes, instance: b.instances.len() - 1 }
        });
        let people = people.collect();
        Self { static_parts: b.parts, instances: b.instances, people }
    }
}

fn room(b: &mut Builder) {
    let half = Vec3::new(3.0, 3.225, 1.3);
    let above_floor = Pose3::from_translation(Vec3::new(0.0, -0.125, half.z));
    b.thing(None, [0.0; 3], 0.0).part(Shape::Interior(Cuboid::new(half)), above_floor, PLASTER);
    // A carpet that covers the room, 1 cm thick.
    b.thing(None, [0.0; 3], 0.0).cuboid([0.0, -0.125, 0.005], [5.98, 6.43, 0.01], CARPET);
    // A door frame and a poster give the far walls something to look at.
    b.thing(None, [-2.3, 3.07, 0.0], 0.0).cuboid([0.0, 0.0, 1.03], [0.9, 0.06, 2.06], BEECH);
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
        b.thing(Some("tv"), [x, 1.88, DESK], yaw)
            .cuboid([0.0, 0.0, 0.01], [0.24, 0.18, 0.02], BLACK)
            .cuboid([0.0, 0.05, 0.12], [0.06, 0.03, 0.22], BLACK)
            .cuboid([0.0, 0.02, 0.31], [0.54, 0.04, 0.33], BLACK)
            .cuboid([0.0, -0.002, 0.31], [0.51, 0.012, 0.30], SCREEN);
        b.thing(Some("keyboard"), [x, 1.52, DESK], 0.6 * yaw).cuboid(
            [0.0, 0.0, 0.012],
            [0.44, 0.14, 0.024],
            KEYS,
        );
        b.thing(Some("mouse"), [x + 0.31, 1.50, DESK], 0.0).ellipsoid(
            [0.0, 0.0, 0.015],
            [0.033, 0.055, 0.022],
            BLACK,
        );
    }
    b.thing(Some("book"), [-0.80, 1.58, DESK], 0.3)
        .cuboid([0.0, 0.0, 0.015], [0.17, 0.24, 0.03], SPINES)
        .cuboid([0.01, 0.01, 0.045], [0.15, 0.21, 0.03], CLAY);
    b.thing(None, [0.0, 1.46, DESK], -0.2).cuboid([0.0, 0.0, 0.003], [0.21, 0.297, 0.006], PAPER);
    b.thing(Some("bottle"), [0.74, 1.72, DESK], 0.0).cylinder([0.0; 3], 0.17, 0.036, GLASS).cylinder(
        [0.0, 0.0, 0.17],
        0.08,
        0.016,
        GLASS,
    );
    b.thing(Some("cup"), [0.02, 1.70, DESK], 0.0).cylinder([0.0; 3], 0.095, 0.04, CHINA).rod(
        [0.045, 0.0, 0.03],
        [0.055, 0.0, 0.07],
        0.008,
        CHINA,
    );
    b.thing(Some("teddy bear"), [-0.84, 1.92, DESK], 0.2)
        .ellipsoid([0.0, 0.0, 0.10], [0.085, 0.075, 0.10], PLUSH)
        .ellipsoid([0.0, -0.01, 0.235], [0.065, 0.06, 0.06], PLUSH)
        .ellipsoid([-0.05, 0.0, 0.29], [0.025, 0.015, 0.025], PLUSH)
        .ellipsoid([0.05, 0.0, 0.29], [0.025, 0.015, 0.025], PLUSH)
        .rod([-0.08, -0.03, 0.15], [-0.12, -0.09, 0.08], 0.028, PLUSH)
        .rod([0.08, -0.03, 0.15], [0.12, -0.09, 0.08], 0.028, PLUSH)
        .rod([-0.05, -0.05, 0.035], [-0.09, -0.13, 0.035], 0.033, PLUSH)
        .rod([0.05, -0.05, 0.035], [0.09, -0.13, 0.035], 0.033, PLUSH);
}

fn swivel_chair(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("chair"), place, yaw);
    for k in 0_u8..5 {
        let (sin, cos) = (f32::from(k) * std::f32::consts::TAU / 5.0).sin_cos();
        b.rod([0.0, 0.0, 0.09], [0.27 * cos, 0.27 * sin, 0.06], 0.022, BLACK);
    }
    b.cylinder([0.0, 0.0, 0.08], 0.36, 0.028, STEEL)
        .cuboid([0.0, 0.0, 0.47], [0.46, 0.45, 0.08], CUSHION)
        .cuboid([0.0, -0.25, 0.56], [0.07, 0.03, 0.24], BLACK)
        .tilted([0.0, -0.26, 0.80], [0.42, 0.06, 0.46], 0.12, CUSHION);
    for x in [-0.26, 0.26] {
        b.cuboid([x, 0.02, 0.56], [0.03, 0.04, 0.20], BLACK).cuboid(
            [x, 0.03, 0.67],
            [0.05, 0.26, 0.03],
            BLACK,
        );
    }
}

fn cabinet(b: &mut Builder) {
    b.thing(None, [-1.62, 1.95, 0.0], 0.0).cuboid([0.0, 0.0, 0.55], [0.8, 0.42, 1.10], CABINET);
    for z in [0.2, 0.55, 0.9] {
        b.cuboid([0.0, -0.215, z], [0.74, 0.02, 0.31], STEEL).cuboid(
            [0.0, -0.235, z + 0.08],
            [0.14, 0.02, 0.02],
            BLACK,
        );
    }
    b.thing(Some("book"), [-1.62, 1.98, 1.10], 0.0).cuboid([-0.05, 0.0, 0.12], [0.38, 0.19, 0.24], SPINES);
}

fn shelf(b: &mut Builder) {
    b.thing(None, [-2.72, 0.35, 0.0], std::f32::consts::FRAC_PI_2);
    for x in [-0.6, 0.6] {
        b.cuboid([x, 0.0, 0.9], [0.03, 0.34, 1.8], BEECH);
    }
    for z in [0.1, 0.6, 1.1, 1.6] {
        b.cuboid([0.0, 0.0, z], [1.2, 0.34, 0.03], BEECH);
    }
    for z in [0.115, 0.615, 1.115] {
        b.thing(Some("book"), [-2.74, 0.35, z], std::f32::consts::FRAC_PI_2).cuboid(
            [-0.12, 0.0, 0.14],
            [0.85, 0.2, 0.28],
            SPINES,
        );
    }
}

fn plant(b: &mut Builder) {
    b.thing(Some("potted plant"), [1.55, 2.1, 0.0], 0.0).cylinder([0.0; 3], 0.32, 0.17, CLAY).rod(
        [0.0, 0.0, 0.3],
        [0.02, 0.0, 0.8],
        0.02,
        PLUSH,
    );
    for k in 0_u8..7 {
        let angle = f32::from(k) * 2.4;
        let (sin, cos) = angle.sin_cos();
        let height = 0.65 + 0.09 * f32::from(k);
        b.ellipsoid([0.16 * cos, 0.16 * sin, height], [0.14, 0.10, 0.09], LEAVES);
    }
}

/// The two people: ways, heights, clothes. The first walks up and down between desk and camera, the second round
/// the room, passing behind the camera.
fn walkers(choice: [[f64; 2]; 2]) -> [(Walk, f32, Clothes); 2] {
    let skin = Material::new(Noise, 0.08, [0.78, 0.58, 0.47], [0.86, 0.67, 0.56]);
    let first = Clothes {
        shirt: Material::new(Checker, 0.06, [0.55, 0.10, 0.12], [0.75, 0.65, 0.60]),
        trousers: Material::new(Noise, 0.05, [0.12, 0.17, 0.32], [0.22, 0.28, 0.46]),
        skin,
        hair: Material::new(Noise, 0.02, [0.15, 0.10, 0.06], [0.28, 0.19, 0.11]),
        shoes: BLACK,
    };
    let second = Clothes {
        shirt: Material::new(Stripes, 0.05, [0.15, 0.35, 0.25], [0.55, 0.70, 0.45]),
        trousers: Material::new(Noise, 0.05, [0.28, 0.26, 0.23], [0.42, 0.40, 0.36]),
        skin,
        hair: Material::new(Noise, 0.02, [0.45, 0.35, 0.20], [0.62, 0.50, 0.30]),
        shoes: Material::new(Noise, 0.05, [0.45, 0.42, 0.40], [0.60, 0.58, 0.55]),
    };
    let near = [[-2.1, 0.2], [-0.7, 0.0], [0.8, -0.15], [2.1, 0.08], [1.0, 0.17], [-0.6, 0.24]];
    let far = [
        [2.1, 0.4],
        [0.6, 0.47],
        [-0.9, 0.46],
        [-2.1, 0.1],
        [-2.05, -1.4],
        [-1.3, -2.7],
        [1.2, -2.7],
        [2.1, -1.2],
    ];
    [(&near[..], 1.76, first, choice[0]), (&far[..], 1.68, second, choice[1])].map(
        |(way, height, clothes, [speed, start])| {
            // 0.6 to 1 m/s: an unhurried walk indoors.
            let walk = Walk::new(way, 0.6 + 0.4 * speed, 0.0);
            let start = start * f64::from(walk.length());
            (Walk::new(way, 0.6 + 0.4 * speed, start), height, clothes)
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_stands_in_the_room_and_belongs_to_a_thing() {
        let scene = Scene::office(2, [[0.5; 2]; 2]);
        assert!(scene.static_parts.len() > 80);
        assert_eq!(scene.people.len(), 2);
        for part in &scene.static_parts {
            assert!(part.instance < scene.instances.len() && !scene.moves(part.instance));
            let center = part.scene_from_part.translation;
            assert!(
                center.x.abs() <= 3.0 && (-3.35..=3.1).contains(&center.y) && (0.0..=2.6).contains(&center.z)
            );
        }
    }

    #[test]
    fn people_walk_through_the_air_only() {
        let scene = Scene::office(2, [[0.5, 0.0], [0.5, 0.0]]);
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
