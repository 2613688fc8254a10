use std::f32::consts::FRAC_PI_2;

use parry3d::math::{Pose3, Vec3};

use super::builder::Builder;
use super::furniture::{self, SEAT};
use super::palette::{CLAY, MINT, OAK, PLANKS, SPINES, WALNUT, WHITE};
use super::person::Action;
use super::table_top::TableTop;
use super::{Activity, Cast, Scene, Viewpoint, things};

/// The dining table and the high table.
const DINING: TableTop = TableTop { center: [-0.95, 1.0], yaw: 0.35, size: [1.6, 0.8], height: 0.72 };
const HIGH: TableTop = TableTop { center: [1.45, 1.2], yaw: -0.6, size: [1.2, 0.6], height: 0.95 };

/// Ways of the two walkers: up and down between camera and tables; between the tables and round the high one.
const NEAR: [[f32; 2]; 6] =
    [[-2.3, -0.75], [-0.8, -1.0], [0.7, -1.0], [2.2, -0.85], [0.7, -0.65], [-0.8, -0.6]];
const ROUND: [[f32; 2]; 7] =
    [[0.42, 0.2], [0.36, 1.0], [0.75, 2.0], [1.7, 2.3], [2.4, 1.6], [2.35, 0.45], [1.4, 0.1]];

const VIEWPOINT: Viewpoint = Viewpoint {
    scene_from_view: Pose3::IDENTITY,
    station: Vec3::new(0.0, -2.2, 1.45),
    target: Vec3::new(-0.05, 1.3, 0.75),
    pivot: Vec3::new(0.0, -1.0, 0.95),
};

impl Scene {
    /// A room of 6.4 x 6.6 m with a dining table and a high table that stand askew, a pillar, a plant and a
    /// cabinet. One person walks between the camera and the tables and one round the high table, or both sit
    /// before the tables, or both sit at the dining table.
    pub(super) fn two_tables(cast: &Cast) -> Self {
        let mut b = Builder::default();
        b.walls_and_floor([0.0, -0.2], [6.4, 6.6, 2.7], MINT, PLANKS);
        b.thing(None, [1.9, 3.09, 1.55], 0.0).cuboid([0.0, 0.0, 0.0], [0.8, 0.02, 0.9], SPINES);
        dining_table(&mut b);
        high_table(&mut b);
        along_the_walls(&mut b);
        let walks = cast.walk([&NEAR, &ROUND]);
        let way = walks[usize::from(cast.activity == Activity::Walking)].ahead();
        let actions = match cast.activity {
            Activity::Walking => {
                furniture::swivel_chair(&mut b, [-2.35, 0.55], -1.2, SEAT);
                walks.map(Action::Walks)
            }
            Activity::Sitting => cast.sit(&mut b, [([-1.05, -0.1], -1.4), ([0.65, 0.2], 1.15)]),
            Activity::AtDesks => {
                let seats = [-0.42, 0.36].map(|along| DINING.point([along, -0.74]));
                cast.sit(&mut b, seats.map(|[x, y, _]| ([x, y], DINING.yaw)))
            }
        };
        cast.enter(&mut b, actions);
        Self::of(b, VIEWPOINT, way)
    }
}

fn dining_table(b: &mut Builder) {
    furniture::table(b, DINING.center, DINING.yaw, DINING.size, DINING.height, OAK);
    for (x, y, turned) in [(-0.35, 0.70, 3.0), (0.4, 0.72, 3.3)] {
        let [x, y, _] = DINING.point([x, y]);
        furniture::wooden_chair(b, [x, y], DINING.yaw + turned, WALNUT);
    }
    things::laptop(b, DINING.point([-0.30, -0.12]), DINING.yaw + 0.2);
    things::cup(b, DINING.point([0.02, -0.22]), 1.0);
    things::bowl(b, DINING.point([0.25, 0.12]), 0.0);
    things::orange(b, DINING.point([0.42, 0.05]), 0.0);
    things::bottle(b, DINING.point([0.08, 0.22]), 0.0);
    things::book(b, DINING.point([0.55, -0.20]), DINING.yaw - 0.5);
    things::teddy_bear(b, DINING.point([-0.62, 0.16]), DINING.yaw + 0.4);
    things::vase(b, DINING.point([0.62, 0.24]), 0.0);
}

fn high_table(b: &mut Builder) {
    furniture::table(b, HIGH.center, HIGH.yaw, HIGH.size, HIGH.height, WHITE);
    things::monitor(b, HIGH.point([-0.25, 0.12]), HIGH.yaw + 0.1);
    things::keyboard(b, HIGH.point([-0.25, -0.17]), HIGH.yaw);
    things::mouse(b, HIGH.point([0.06, -0.17]), HIGH.yaw);
    things::cup(b, HIGH.point([0.22, 0.10]), 2.0);
    things::small_plant(b, HIGH.point([0.45, 0.12]), 0.0);
    things::two_books(b, HIGH.point([0.42, -0.12]), HIGH.yaw + 0.3);
}

fn along_the_walls(b: &mut Builder) {
    furniture::pillar(b, [0.05, 2.55], 0.0, 0.36, 2.69);
    furniture::plant(b, [2.75, 2.65], 0.0);
    furniture::cabinet(b, [-2.2, 2.82], 0.0);
    things::microwave(b, [-2.3, 2.82, 1.10], 0.0);
    things::bowl(b, [-1.93, 2.80, 1.10], 0.0);
    furniture::boxes(b, [-2.75, 1.75], 1.4);
    furniture::shelf(b, [2.98, 0.6], -FRAC_PI_2);
    for z in [0.615, 1.115] {
        things::row_of_books(b, [2.98, 0.55, z], -FRAC_PI_2, [0.05, 0.13], [0.7, 0.2, 0.26]);
    }
    b.door([-1.0, 3.07], 0.0, CLAY);
}
