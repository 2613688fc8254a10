use parry3d::math::Vec3;
use rand::RngExt;

use crate::noise::{Use, stream};

/// The floor plan: the corridor runs along x about y = 0, rooms are on both sides of it in columns, and a
/// ramp separates the columns on the lower level from those on the upper one.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    pub(super) seed: u64,
    pub(super) columns: Vec<Column>,
    pub(super) ramp: Option<Ramp>,
    /// Inner length of all rooms across the corridor, metres.
    pub(super) depth: f32,
    /// From the floor to the ceiling, metres.
    pub(super) height: f32,
    /// Height of the desks at walls, metres.
    pub(super) desk: f32,
    /// Position of the doors between rooms across the corridor, metres from the rooms' middle; negative:
    /// nearer to the corridor.
    pub(super) hub: f32,
    /// Number of rooms on each side.
    rooms: [usize; 2],
}

/// One or two rooms that face each other.
#[derive(Debug, Clone)]
pub(super) struct Column {
    pub(super) number: usize,
    /// From wall to wall, metres along the corridor.
    pub(super) span: [f32; 2],
    /// Middle of its doors, metres along the corridor.
    pub(super) door: f32,
    /// Height of its floor, metres.
    pub(super) floor: f32,
    has_room: [bool; 2],
    /// Numbers of the walls to its neighbours; `None` at the building's ends and at the ramp.
    pub(super) before: Option<usize>,
    pub(super) after: Option<usize>,
}

/// The ramp in the corridor.
#[derive(Debug, Clone)]
pub(super) struct Ramp {
    /// The column before it.
    pub(super) after: usize,
    pub(super) span: [f32; 2],
}

/// The sides of the corridor: towards +y and -y.
pub(super) const SIDES: [f32; 2] = [1.0, -1.0];
/// Width of the corridor, thickness of walls, metres.
pub(super) const CORRIDOR: f32 = 2.4;
pub(super) const WALL: f32 = 0.12;
/// Height of the ramp, metres: 5 degrees steep.
pub(super) const RISE: f32 = 0.35;
const RAMP: f32 = 4.0;
/// Fewest columns of a building with a ramp.
const COLUMNS_WITH_RAMP: usize = 4;

impl Layout {
    pub(super) fn new(seed: u64, rooms: usize) -> Self {
        let mut rng = stream(seed, Use::Scene, 8, 0);
        let first = rooms.div_ceil(2).max(2);
        let rooms = [first, rooms.saturating_sub(first)];
        let depth = rng.random_range(4.8..6.2);
        let last = first - 1;
        let ramp_after = (first >= COLUMNS_WITH_RAMP).then_some(first / 2 - 1);
        let mut ramp = None;
        let (mut x, mut floor) = (WALL, 0.0);
        let mut columns = Vec::new();
        for number in 0..first {
            let span = [x, x + rng.random_range(4.8_f32..6.4)];
            let middle = 0.5 * (span[0] + span[1]);
            let joins = |other: usize| Some(other) != ramp_after;
            columns.push(Column {
                number,
                span,
                door: middle + rng.random_range(-0.6..0.6),
                floor,
                has_room: rooms.map(|count| number < count),
                before: number.checked_sub(1).filter(|&wall| joins(wall)),
                after: (number < last && joins(number)).then_some(number),
            });
            x = span[1] + WALL;
            if Some(number) == ramp_after {
                ramp = Some(Ramp { after: number, span: [x, x + RAMP] });
                x += RAMP + WALL;
                floor = RISE;
            }
        }
        Self {
            seed,
            columns,
            ramp,
            depth,
            height: rng.random_range(2.4..3.0),
            desk: rng.random_range(0.70..0.76),
            hub: -0.08 * depth,
            rooms,
        }
    }

    /// Distance of the rooms' middles from the corridor's middle, metres.
    pub(super) fn middle_of_rooms(&self) -> f32 {
        0.5 * CORRIDOR + WALL + 0.5 * self.depth
    }

    /// Whether another room adjoins the room of a column beyond the wall before (-1) or after (1) it.
    pub(super) fn has_neighbour(&self, column: &Column, side: f32, towards: f32) -> bool {
        let count = self.rooms[usize::from(side < 0.0)];
        if towards < 0.0 {
            column.before.is_some()
        } else {
            column.after.is_some() && column.number + 1 < count
        }
    }
}

impl Column {
    pub(super) fn has_room(&self, side: f32) -> bool {
        self.has_room[usize::from(side < 0.0)]
    }

    pub(super) fn middle(&self) -> f32 {
        0.5 * (self.span[0] + self.span[1])
    }

    pub(super) fn width(&self) -> f32 {
        self.span[1] - self.span[0]
    }
}

impl Ramp {
    /// Its lower and upper end, on the floor.
    pub(super) fn ends(&self) -> [Vec3; 2] {
        [Vec3::new(self.span[0], 0.0, 0.0), Vec3::new(self.span[1], 0.0, RISE)]
    }
}
