use parry3d::math::Vec2;
use rand_chacha::ChaCha8Rng;

use super::floor_plan::Footprint;
use super::furnishing::Furnished;
use super::ways::{CLEARANCE, choose_free_way};
use crate::noise::{Use, stream};
use crate::scene::builder::Builder;
use crate::scene::person::Action;
use crate::scene::{Activity, Cast};

/// A room of a building before it is furnished, in a frame of its own: the origin in the middle of the floor,
/// the door towards the corridor in the wall at -y.
#[derive(Debug, Clone)]
pub(in crate::scene) struct Site {
    /// Full lengths, metres.
    pub(in crate::scene) size: [f32; 2],
    pub(in crate::scene) height: f32,
    /// Lanes that are kept free, each from one point to another along an axis.
    pub(in crate::scene) lanes: Vec<[Vec2; 2]>,
    /// Stretches of the sides where no wall is, each from one point to another along an axis.
    pub(in crate::scene) openings: Vec<[Vec2; 2]>,
    /// Points of the ways of the camera and of those who walk through.
    pub(in crate::scene) passed: Vec<Vec2>,
    /// Whether a window may be in the wall at +y.
    pub(in crate::scene) has_window: bool,
    /// Tables with their backs to the walls at +x (1) and -x (-1).
    pub(in crate::scene) tables: Vec<SiteTable>,
    /// What people do in the room; `None`: nobody is there.
    pub(in crate::scene) activity: Option<Activity>,
}

/// A table whose twin stands on the other side of the wall.
#[derive(Debug, Clone, Copy)]
pub(in crate::scene) struct SiteTable {
    pub(in crate::scene) side: f32,
    pub(in crate::scene) y: f32,
    pub(in crate::scene) size: [f32; 2],
    pub(in crate::scene) height: f32,
    /// Decides what stands on the table.
    pub(in crate::scene) seed: u64,
}

/// Half the width of a lane, metres.
const LANE: f32 = 0.45;
/// Half the width of the strip that keeps things from hanging and standing where no wall is, metres.
const OPENING: f32 = 0.06;
/// Smallest distance of a walker's middle from these ways, metres.
const FROM_WAYS: f32 = 0.9;

/// Furnishes a room and gives what was built, without walls and floor, and what its people do; `None` when people
/// find no place in any attempt.
pub(in crate::scene) fn furnish(
    site: &Site,
    cast: &Cast,
    seed: u64,
    attempts: u64,
) -> Option<(Builder, Vec<Action>)> {
    (0..attempts).find_map(|attempt| {
        let mut rng = stream(seed, Use::Scene, 6, attempt);
        let mut room = begin(site, &mut rng);
        let actions = inhabit(site, cast, &mut room, &mut rng)?;
        room.fill(&mut rng);
        room.hard_to_see(&mut rng);
        Some((room.builder, actions))
    })
}

/// Reserves the lanes, hangs things on the walls and adds the tables.
fn begin(site: &Site, rng: &mut ChaCha8Rng) -> Furnished {
    let mut room = Furnished::empty(Builder::default(), site.size, site.height);
    for [from, to] in &site.lanes {
        let half = 0.5 * (*to - *from).abs() + LANE;
        room.floor.reserve(Footprint::new(0.5 * (*from + *to), 0.0, half.to_array()));
    }
    for [from, to] in &site.openings {
        let half = 0.5 * (*to - *from).abs() + OPENING;
        room.floor.reserve(Footprint::new(0.5 * (*from + *to), 0.0, half.to_array()));
    }
    room.floor.keep_free(site.passed.iter().copied(), CLEARANCE);
    room.hang_things(site.has_window, rng);
    for table in &site.tables {
        room.table_at_wall(table.side, table.y, table.size, table.height, table.seed);
    }
    room.add_table(rng);
    room
}

/// Finds the people's seats or ways; `None` when there is no place for them.
fn inhabit(site: &Site, cast: &Cast, room: &mut Furnished, rng: &mut ChaCha8Rng) -> Option<Vec<Action>> {
    match site.activity {
        None => Some(Vec::new()),
        Some(Activity::Walking) => {
            let is_off_ways = |at: Vec2| site.passed.iter().all(|passed| passed.distance(at) > FROM_WAYS);
            let way = choose_free_way(&room.floor, rng, is_off_ways, |_| true)?;
            room.floor.keep_free(way.samples.iter().copied(), CLEARANCE);
            Some(vec![Action::Walks(way.walk(rng))])
        }
        Some(Activity::Sitting | Activity::AtDesks) => {
            room.seat_all(cast, rng)?;
            Some(room.seats.iter().map(|chair| cast.sits((chair.place, chair.yaw), 0.0)).collect())
        }
    }
}
