//! Generates a floor of a building from a seed.

mod layout;
mod shell;

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use parry3d::math::{Pose3, Rot3, Vec2, Vec3};
use rand::RngExt;

use self::layout::{Column, Layout, SIDES};
use super::builder::Builder;
use super::random_room::{ATTEMPTS, Site, SiteTable, furnish};
use super::tour::Tour;
use super::walk::Walk;
use super::{Activity, Cast, Scene, Viewpoint};
use crate::SequenceConfig;
use crate::noise::{Use, stream};

/// How long the camera's tour takes for each room, seconds.
pub(crate) const SECONDS_A_ROOM: f64 = 40.0;
/// How long the camera stands at the far end of the corridor, seconds.
const REST: f64 = 15.0;
/// What people do in successive rooms; `None`: nobody is there.
pub(super) const ACTIVITIES: [Option<Activity>; 4] =
    [Some(Activity::Sitting), Some(Activity::Walking), None, None];

impl Scene {
    /// A floor of a building; its shell is the first thing.
    pub(super) fn building(config: &SequenceConfig, rooms: usize) -> Self {
        let layout = Layout::new(config.seed, rooms);
        let mut b = Builder::default();
        shell::build(&mut b, &layout);
        let mut people = Vec::new();
        for (number, room) in layout.rooms().enumerate() {
            let seed = config.seed.wrapping_mul(100).wrapping_add(number as u64);
            let activity = ACTIVITIES[number % ACTIVITIES.len()];
            let cast =
                Cast::new(&SequenceConfig { seed, activity: activity.unwrap_or_default(), ..config.clone() });
            let (built, actions) =
                furnish(&layout.site(room, activity), &cast, seed, ATTEMPTS).unwrap_or_default();
            let scene_from_room = layout.scene_from_room(room);
            b.join(built, scene_from_room);
            people.push((cast, actions, scene_from_room));
        }
        for (cast, actions, scene_from_room) in people {
            cast.enter_room(&mut b, actions, scene_from_room);
        }
        // A trolley would stand in the middle of the first room: no event is made for buildings.
        let [x, y, _] = layout.hub(&layout.columns[0], SIDES[0]).to_array();
        let mut scene = Self::of(b, Viewpoint::OFFICE, Walk::new(&[[x, y]], 0.0, 0.0));
        scene.tour = Some(layout.tour().lasting(SECONDS_A_ROOM * rooms as f64));
        scene
    }
}

/// A room: its column and which side of the corridor it is on (1 or -1).
type Place<'a> = (&'a Column, f32);

impl Layout {
    /// All rooms, column after column.
    fn rooms(&self) -> impl Iterator<Item = Place<'_>> {
        let both = self.columns.iter().flat_map(|column| SIDES.map(|side| (column, side)));
        both.filter(|&(column, side)| column.has_room(side))
    }

    fn scene_from_room(&self, (column, side): Place<'_>) -> Pose3 {
        let turned = if side > 0.0 { 0.0 } else { PI };
        let middle = Vec3::new(column.middle(), side * self.middle_of_rooms(), column.floor);
        Pose3::from_parts(middle, Rot3::from_rotation_z(turned))
    }

    /// The point on the floor where a room's lanes meet.
    fn hub(&self, column: &Column, side: f32) -> Vec3 {
        let from_corridor = self.middle_of_rooms() + self.hub;
        Vec3::new(column.door, side * from_corridor, column.floor)
    }

    /// The size, lanes and tables of a room, from which it is furnished.
    fn site(&self, (column, side): Place<'_>, activity: Option<Activity>) -> Site {
        let size = [column.width(), self.depth];
        let door = side * (column.door - column.middle());
        let hub = Vec2::new(door, self.hub);
        let mut lanes = vec![[Vec2::new(door, -0.5 * size[1]), hub]];
        let mut tables = Vec::new();
        for (neighbour, towards) in [(column.before, -1.0_f32), (column.after, 1.0)] {
            let Some(wall) = neighbour.filter(|_| self.has_neighbour(column, side, towards)) else {
                continue;
            };
            // In the room's frame.
            let towards = side * towards;
            if side > 0.0 {
                lanes.push([hub, Vec2::new(towards * 0.5 * size[0], self.hub)]);
            }
            let mut rng = stream(self.seed, Use::Scene, 7, 2 * wall as u64 + u64::from(side > 0.0));
            let table = [rng.random_range(1.1..1.4), rng.random_range(0.6..0.75)];
            let free = [self.hub + 0.6 + 0.5 * table[0], 0.5 * size[1] - 0.1 - 0.5 * table[0]];
            tables.push(SiteTable {
                side: towards,
                y: rng.random_range(free[0]..free[1].max(free[0] + 0.01)),
                size: table,
                height: self.desk,
                seed: rng.random_range(0..u64::from(u32::MAX)),
            });
        }
        let (openings, passed) = (Vec::new(), Vec::new());
        Site { size, height: self.height, lanes, openings, passed, has_window: true, tables, activity }
    }

    /// The camera goes into each room through its door and out again, up to the far end of the corridor,
    /// rests there, and comes back through the connected rooms of the first side.
    fn tour(&self) -> Tour {
        let in_corridor = |column: &Column| Vec3::new(column.door, 0.0, column.floor);
        let start = in_corridor(&self.columns[0]);
        let mut tour = Tour::begin(start, 0.0);
        for column in &self.columns {
            self.pass_ramp(&mut tour, column, -1.0);
            tour.go_to(in_corridor(column));
            for side in SIDES.into_iter().filter(|&side| column.has_room(side)) {
                tour.go_to(self.hub(column, side));
                tour.turn(TAU);
                tour.go_to(in_corridor(column));
            }
        }
        tour.turn(FRAC_PI_2);
        tour.rest(REST);
        for column in self.columns.iter().rev() {
            let [enters, leaves] = [column.after, column.before].map(|wall| wall.is_none());
            if enters {
                self.pass_ramp(&mut tour, column, 1.0);
                tour.go_to(in_corridor(column));
            }
            tour.go_to(self.hub(column, SIDES[0]));
            tour.turn(-TAU);
            if leaves {
                tour.go_to(in_corridor(column));
            }
        }
        tour.go_to(start);
        tour
    }

    /// Passes the ramp before (-1) or after (1) a column, if there is one.
    fn pass_ramp(&self, tour: &mut Tour, column: &Column, towards: f32) {
        let Some(ramp) = &self.ramp else { return };
        let is_next =
            if towards < 0.0 { column.number == ramp.after + 1 } else { column.number == ramp.after };
        if is_next {
            let [low, high] = ramp.ends();
            let [first, last] = if towards < 0.0 { [low, high] } else { [high, low] };
            tour.go_to(first);
            tour.go_to(last);
        }
    }
}
