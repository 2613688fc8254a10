use std::f32::consts::{FRAC_PI_2, PI};

use parry3d::math::Vec2;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::floor_plan::{FloorPlan, Footprint};
use super::table_setting::set_table;
use crate::noise::{Use, stream};
use crate::scene::builder::Builder;
use crate::scene::furniture::{self, SEAT};
use crate::scene::palette::{
    BEECH, CARPET, CLAY, CUSHION, FABRIC, MINT, OAK, OCHRE, PANE, PLANKS, PLASTER, SPINES, TILES, TWEED,
    WALNUT, WHITE,
};
use crate::scene::table_top::TableTop;
use crate::scene::{Activity, Cast, things};

/// A room with its furniture.
#[derive(Debug)]
pub(super) struct Furnished {
    pub(super) builder: Builder,
    pub(super) floor: FloorPlan,
    /// Distance from the floor to the ceiling, metres.
    height: f32,
    tables: Vec<Table>,
    /// The chairs of the first and the second person, with room for the legs.
    pub(super) seats: Vec<Chair>,
    /// Whether people sit close at the tables.
    pub(super) has_desks: bool,
}

/// Where a chair stands; somebody who sits on it faces its +y axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Chair {
    pub(super) place: [f32; 2],
    pub(super) yaw: f32,
}

/// Furniture keeps this far from other furniture, and its back this far from the wall, metres.
const GAP: f32 = 0.06;
const FROM_WALL: f32 = 0.04;

fn pick<T: Copy>(rng: &mut ChaCha8Rng, choices: &[T]) -> T {
    choices[rng.random_range(0..choices.len())]
}

/// A table and its footprint.
#[derive(Debug, Clone, Copy)]
struct Table {
    top: TableTop,
    footprint: Footprint,
}

/// How far hands reach over a desk from its front edge, metres.
const HANDS: f32 = 0.28;

/// Random places that are tried before a piece of furniture is given up.
const THROWS: usize = 30;

impl Furnished {
    /// A room of random size with two or three tables, things on them and two seats; `None` when the seats do
    /// not fit.
    pub(super) fn with_tables(cast: &Cast, rng: &mut ChaCha8Rng) -> Option<Self> {
        let size = [0, 1].map(|_| rng.random_range(4.8_f32..6.8));
        let height = rng.random_range(2.4_f32..3.0);
        let mut builder = Builder::default();
        let walls = pick(rng, &[PLASTER, OCHRE, MINT, WHITE]);
        let ground = pick(rng, &[CARPET, PLANKS, TILES]);
        builder.walls_and_floor([0.0; 2], [size[0], size[1], height], walls, ground);
        let mut room = Self::empty(builder, size, height);
        room.has_desks = cast.activity == Activity::AtDesks;
        room.hang_things(false, rng);
        for _ in 0..rng.random_range(2..=3) {
            room.add_table(rng);
        }
        room.seat_all(cast, rng)?;
        Some(room)
    }

    /// A room of the given lengths without furniture.
    pub(super) fn empty(builder: Builder, size: [f32; 2], height: f32) -> Self {
        let floor = FloorPlan::new(0.5 * Vec2::from(size) - Vec2::splat(FROM_WALL));
        Self { builder, floor, height, tables: Vec::new(), seats: Vec::new(), has_desks: false }
    }

    /// Adds chairs for both people; `None` when they do not fit.
    pub(super) fn seat_all(&mut self, cast: &Cast, rng: &mut ChaCha8Rng) -> Option<()> {
        for height in cast.seat_heights() {
            let seat = self.seat(height, rng)?;
            self.seats.push(seat);
        }
        Some(())
    }

    /// Adds more furniture on the free floor.
    pub(super) fn fill(&mut self, rng: &mut ChaCha8Rng) {
        for _ in 0..rng.random_range(1..=3) {
            self.empty_chair(rng);
        }
        for _ in 0..rng.random_range(3..=5) {
            self.along_a_wall(rng);
        }
        for _ in 0..rng.random_range(1..=3) {
            self.somewhere(rng);
        }
    }

    /// Adds a door and up to two pictures, flat on the walls, and if asked for, a window in the wall at +y.
    pub(super) fn hang_things(&mut self, with_window: bool, rng: &mut ChaCha8Rng) {
        let mut hung = self.floor.clone();
        if with_window {
            let Vec2 { x, y } = self.floor.half;
            let at = Vec2::new(rng.random_range(0.8 - x..x - 0.8), y - 0.01);
            hung.reserve(Footprint::new(at, 0.0, [0.65, 0.01]));
            let at = [at.x, y + FROM_WALL - 0.01, 1.55];
            self.builder.thing(None, at, 0.0).cuboid([0.0; 3], [1.3, 0.02, 0.9], PANE);
        }
        let mut on_wall = |room: &Self, rng: &mut ChaCha8Rng, size: [f32; 2]| {
            let half = [0.5 * size[0], 0.5 * size[1]];
            let (at, yaw) = room.at_wall(rng, half[0], half[1]);
            let footprint = Footprint::new(at, yaw, half);
            hung.take(footprint, 0.05).then(|| (footprint, footprint.point(0.0, FROM_WALL)))
        };
        if let Some((footprint, at)) = on_wall(self, rng, [0.9, 0.06]) {
            // The door's footprint is occupied on the floor, so that no furniture intersects the door.
            self.floor.take(footprint, 0.0);
            self.builder.door(at.to_array(), footprint.yaw, BEECH);
        }
        for material in [SPINES, CLAY] {
            if let Some((footprint, at)) = on_wall(self, rng, [0.7, 0.02]) {
                self.builder.thing(None, [at.x, at.y, 1.65], footprint.yaw).cuboid(
                    [0.0; 3],
                    [0.7, 0.02, 0.5],
                    material,
                );
            }
        }
    }

    /// A place at a random wall for something of the given half lengths: its centre, and the yaw with which
    /// its front (-y) faces the room.
    fn at_wall(&self, rng: &mut ChaCha8Rng, half_width: f32, half_depth: f32) -> (Vec2, f32) {
        let wall = rng.random_range(0..4_u8);
        let half = self.floor.half;
        let (along, across) = if wall % 2 == 0 { (half.x, half.y) } else { (half.y, half.x) };
        let slack = along - half_width;
        let place = Vec2::new(rng.random_range(-slack..slack), across - half_depth);
        let yaw = f32::from(wall) * FRAC_PI_2;
        (Vec2::from_angle(yaw).rotate(place), yaw)
    }

    /// Tries random places and occupies the first one that fits.
    fn throw(
        &mut self,
        rng: &mut ChaCha8Rng,
        half: [f32; 2],
        mut place: impl FnMut(&Self, &mut ChaCha8Rng) -> (Vec2, f32),
    ) -> Option<Footprint> {
        (0..THROWS).find_map(|_| {
            let (at, yaw) = place(self, rng);
            let footprint = Footprint::new(at, yaw, half);
            self.floor.take(footprint, GAP).then_some(footprint)
        })
    }

    fn anywhere(&self, rng: &mut ChaCha8Rng) -> (Vec2, f32) {
        let Vec2 { x, y } = self.floor.half;
        (Vec2::new(rng.random_range(-x..x), rng.random_range(-y..y)), rng.random_range(-PI..PI))
    }

    /// Adds a table with its back to the wall at +x (`side` = 1) or -x (-1), its middle at `y`; the things on
    /// it depend on `seed` alone.
    pub(super) fn table_at_wall(&mut self, side: f32, y: f32, size: [f32; 2], height: f32, seed: u64) {
        let half = [0.5 * size[0], 0.5 * size[1]];
        let at = Vec2::new(side * (self.floor.half.x - half[1]), y);
        let footprint = Footprint::new(at, -side * FRAC_PI_2, half);
        if self.floor.take(footprint, GAP) {
            let table = self.set_up_table(footprint, height, &mut stream(seed, Use::Scene, 5, 0));
            self.tables.push(table);
        }
    }

    pub(super) fn add_table(&mut self, rng: &mut ChaCha8Rng) {
        let table = self.table(rng);
        self.tables.extend(table);
    }

    /// A table with things on it: against a wall, or anywhere at any yaw, then perhaps with a partition
    /// behind it.
    fn table(&mut self, rng: &mut ChaCha8Rng) -> Option<Table> {
        let size = [rng.random_range(1.0_f32..1.9), rng.random_range(0.55_f32..0.9)];
        let height = if self.has_desks { rng.random_range(0.70..0.74) } else { rng.random_range(0.60..0.95) };
        let half = [0.5 * size[0], 0.5 * size[1]];
        let at_wall = rng.random_range(0..3) == 0;
        let footprint = if at_wall {
            self.throw(rng, half, |room, rng| room.at_wall(rng, half[0], half[1]))?
        } else {
            self.throw(rng, half, Self::anywhere)?
        };
        let table = self.set_up_table(footprint, height, rng);

        let behind = footprint.point(0.0, half[1] + 0.26);
        let screen = Footprint::new(behind, footprint.yaw, [0.5 * size[0] + 0.1, 0.2]);
        if !at_wall && rng.random_range(0..3) == 0 && self.floor.take(screen, 0.01) {
            furniture::partition(&mut self.builder, behind.to_array(), footprint.yaw, size[0] + 0.2, FABRIC);
        }
        Some(table)
    }

    fn set_up_table(&mut self, footprint: Footprint, height: f32, rng: &mut ChaCha8Rng) -> Table {
        let Footprint { center, yaw, half, .. } = footprint;
        let top = TableTop { center: center.to_array(), yaw, size: (2.0 * half).to_array(), height };
        let material = pick(rng, &[BEECH, OAK, WALNUT, WHITE]);
        furniture::table(&mut self.builder, top.center, yaw, top.size, height, material);
        let free_front = if self.has_desks { HANDS } else { 0.0 };
        set_table(&mut self.builder, &top, rng.random_range(5..=9), free_front, rng);
        Table { top, footprint }
    }

    /// Adds a round pillar on the free floor, and at a wall a cabinet that gives no depth readings.
    pub(super) fn hard_to_see(&mut self, rng: &mut ChaCha8Rng) {
        let radius = rng.random_range(0.2_f32..0.5);
        if let Some(it) = self.throw(rng, [radius; 2], Self::anywhere) {
            furniture::round_pillar(&mut self.builder, it.center.to_array(), radius, self.height);
        }
        let half = [0.4, 0.25];
        if let Some(it) = self.throw(rng, half, |room, rng| room.at_wall(rng, half[0], half[1])) {
            let at = [it.center.x, it.center.y, 0.0];
            self.builder.thing(None, at, it.yaw).cuboid([0.0, 0.0, 0.45], [0.8, 0.5, 0.9], PANE);
        }
    }

    fn any_table(&self, rng: &mut ChaCha8Rng) -> Option<Table> {
        self.tables.get(rng.random_range(0..self.tables.len().max(1))).copied()
    }

    /// Adds a swivel chair near a table for somebody to sit on, with room for legs and hands.
    fn seat(&mut self, seat: f32, rng: &mut ChaCha8Rng) -> Option<Chair> {
        let (place, yaw) = (0..3 * THROWS).find_map(|_| {
            let table = self.any_table(rng)?;
            if self.has_desks {
                return self.seat_at_desk(&table, rng);
            }
            let (place, yaw) = beside(&table, rng.random_range(0.70..0.95), rng);
            let yaw = yaw + rng.random_range(-0.9..0.9);
            // From the chair's back to the finger tips.
            let taken = Footprint::new(place, yaw, [0.33, 0.33]).point(0.0, 0.16);
            self.floor.take(Footprint::new(taken, yaw, [0.34, 0.52]), 0.02).then_some((place, yaw))
        })?;
        furniture::swivel_chair(&mut self.builder, place.to_array(), yaw, seat);
        Some(Chair { place: place.to_array(), yaw })
    }

    /// A seat so close to a table that the legs are below it.
    fn seat_at_desk(&mut self, table: &Table, rng: &mut ChaCha8Rng) -> Option<(Vec2, f32)> {
        let half = table.footprint.half;
        let free = half.x - 0.35;
        let place = table.footprint.point(rng.random_range(-free..free), -half.y - 0.35);
        let yaw = table.top.yaw + rng.random_range(-0.08..0.08);
        self.floor.take(Footprint::new(place, yaw, [0.33, 0.31]), 0.0).then_some((place, yaw))
    }

    /// Adds a chair at a table on which nobody sits.
    fn empty_chair(&mut self, rng: &mut ChaCha8Rng) {
        for _ in 0..THROWS {
            let Some(table) = self.any_table(rng) else { return };
            let (at, yaw) = beside(&table, rng.random_range(0.36..0.6), rng);
            if self.floor.take(Footprint::new(at, yaw, [0.32, 0.32]), 0.02) {
                let material = pick(rng, &[WALNUT, BEECH, CUSHION]);
                if material == CUSHION {
                    furniture::swivel_chair(&mut self.builder, at.to_array(), yaw, SEAT);
                } else {
                    furniture::wooden_chair(&mut self.builder, at.to_array(), yaw, material);
                }
                return;
            }
        }
    }

    /// Adds a cabinet, a shelf, a refrigerator or a couch with its back to a wall.
    fn along_a_wall(&mut self, rng: &mut ChaCha8Rng) {
        match rng.random_range(0..6) {
            0 | 1 => self.cabinet(rng),
            2 | 3 => self.shelf(rng),
            4 => {
                let half = [0.32, 0.33];
                if let Some(it) = self.throw(rng, half, |room, rng| room.at_wall(rng, half[0], half[1])) {
                    furniture::refrigerator(&mut self.builder, it.center.to_array(), it.yaw);
                }
            }
            _ => {
                let half = [0.76, 0.41];
                if let Some(it) = self.throw(rng, half, |room, rng| room.at_wall(rng, half[0], half[1])) {
                    let material = pick(rng, &[CUSHION, TWEED, FABRIC]);
                    furniture::couch(&mut self.builder, it.center.to_array(), it.yaw, material);
                }
            }
        }
    }

    fn cabinet(&mut self, rng: &mut ChaCha8Rng) {
        // The drawers' fronts and handles stand 3.5 cm before the body.
        let half = [0.41, 0.25];
        let Some(it) = self.throw(rng, half, |room, rng| room.at_wall(rng, half[0], half[1])) else { return };
        let at = it.center.to_array();
        furniture::cabinet(&mut self.builder, at, it.yaw);
        let top = TableTop { center: at, yaw: it.yaw, size: [0.78, 0.40], height: 1.10 };
        if rng.random_range(0..2) == 0 {
            things::microwave(&mut self.builder, top.point([-0.13, 0.0]), it.yaw);
            things::bowl(&mut self.builder, top.point([0.25, 0.0]), 0.0);
        } else {
            set_table(&mut self.builder, &top, 4, 0.0, rng);
        }
    }

    fn shelf(&mut self, rng: &mut ChaCha8Rng) {
        let half = [0.63, 0.18];
        let Some(it) = self.throw(rng, half, |room, rng| room.at_wall(rng, half[0], half[1])) else { return };
        let at = it.center.to_array();
        furniture::shelf(&mut self.builder, at, it.yaw);
        for height in [0.115, 0.615, 1.115] {
            let board = TableTop { center: at, yaw: it.yaw, size: [1.1, 0.32], height };
            let length = rng.random_range(0.25..0.6);
            let books = [length, 0.2, rng.random_range(0.2..0.3)];
            things::row_of_books(
                &mut self.builder,
                board.point([0.5 * length - 0.56, 0.0]),
                it.yaw,
                [0.0, 0.5 * books[2]],
                books,
            );
            // Other things stand on the free end.
            let rest = 0.52 - length.max(0.0) + 0.56;
            let [x, y, _] = board.point([0.56 - 0.5 * rest, 0.0]);
            let end = TableTop { center: [x, y], yaw: it.yaw, size: [rest, 0.30], height };
            set_table(&mut self.builder, &end, 2, 0.0, rng);
        }
    }

    /// Adds a partition, a pillar, boxes, steps, a plant, a suitcase or a ball on the free floor.
    fn somewhere(&mut self, rng: &mut ChaCha8Rng) {
        let kind = rng.random_range(0..7_u8);
        let half = match kind {
            0 => [0.6, 0.21],
            1 => [0.18, 0.18],
            2 => [0.30, 0.24],
            3 => [0.46, 0.36],
            4 => [0.31, 0.31],
            5 => [0.23, 0.13],
            _ => [0.12, 0.12],
        };
        let Some(it) = self.throw(rng, half, Self::anywhere) else { return };
        let (b, at, yaw) = (&mut self.builder, it.center.to_array(), it.yaw);
        match kind {
            0 => furniture::partition(b, at, yaw, 1.2, FABRIC),
            1 => furniture::pillar(b, at, yaw, 0.34, self.height - 0.01),
            2 => furniture::boxes(b, at, yaw),
            3 => furniture::steps(b, at, yaw),
            4 => furniture::plant(b, at, yaw),
            5 => things::suitcase(b, [at[0], at[1], 0.0], yaw),
            _ => things::ball(b, [at[0], at[1], 0.0], yaw),
        }
    }
}

/// A place at one of a table's sides, `away` metres from its edge, and the yaw that faces the table.
fn beside(table: &Table, away: f32, rng: &mut ChaCha8Rng) -> (Vec2, f32) {
    let half = table.footprint.half;
    let (sideways, turned) = (rng.random_range(-0.8_f32..0.8), rng.random_range(0..4_u8));
    let (x, y) = match turned {
        0 => (sideways * half.x, -half.y - away),
        1 => (half.x + away, sideways * half.y),
        2 => (sideways * half.x, half.y + away),
        _ => (-half.x - away, sideways * half.y),
    };
    (table.footprint.point(x, y), table.top.yaw + f32::from(turned) * FRAC_PI_2)
}
