//! Makes a building from a floor plan.

mod building_plan;
mod contour;
mod error;
mod grid;
mod passers;
mod raster;
mod round;
mod route;
mod solid;
mod straightening;
mod tiles;
mod walls;

use parry3d::math::{Pose3, Vec2, Vec3};
use rand::RngExt;

pub use self::building_plan::BuildingPlan;
use self::building_plan::Plan;
pub use self::error::PlanError;
pub use self::grid::{PlanCell, PlanGrid};
use self::passers::passages;
use self::tiles::{Tile, tiles};
use super::builder::Builder;
use super::building::ACTIVITIES;
use super::palette::{CARPET, PLASTER};
use super::person::Action;
use super::random_room::{Site, furnish};
use super::tour::Tour;
use super::walk::Walk;
use super::{Cast, Scene, Viewpoint};
use crate::SequenceConfig;
use crate::noise::{Use, stream};

/// Thickness of floor and ceiling, metres, and how far they stick out beyond the plan.
const SLAB: f64 = 0.1;
/// Of this many rectangles of floor, all but one are furnished.
const ONE_EMPTY_OF: u32 = 5;
/// Attempts to furnish a rectangle with people before it is furnished without.
const ATTEMPTS: u64 = 60;
/// Distance between the points of the camera's way around which the floor is kept free, metres.
const KNOTS: f64 = 0.15;

impl Scene {
    /// A building made from a floor plan, furnished from the seed; its shell is the first thing.
    pub(super) fn planned(config: &SequenceConfig, building: &BuildingPlan) -> Self {
        let plan = building.plan();
        let seconds = config.frames as f64 / config.frame_rate;
        let tour = tour(building, config.seed, seconds);
        let mut b = Builder::default();
        shell(&mut b, plan);
        let mut rng = stream(config.seed, Use::Scene, 9, 0);
        let mut way = points(&tour);
        let begin = way.first().copied().unwrap_or_default();
        let mut people = Vec::new();
        let passages =
            passages(plan, &tour, seconds, config.people, &mut stream(config.seed, Use::Scene, 11, 0));
        for (number, passage) in (1..).zip(passages) {
            way.extend(passage.way);
            let cast =
                Cast::new(&SequenceConfig { seed: config.seed.wrapping_sub(number), ..config.clone() });
            let actions = passage.walks.into_iter().map(Action::Walks).collect();
            people.push((cast, actions, Pose3::IDENTITY));
        }
        let mut number = 0;
        for tile in tiles(&plan.free, plan.grid.resolution) {
            if rng.random_range(0..ONE_EMPTY_OF) == 0 {
                continue;
            }
            let mut site = plan.site(&tile, &way);
            let seed = config.seed.wrapping_mul(1000).wrapping_add(number as u64);
            site.activity = ACTIVITIES[number % ACTIVITIES.len()];
            number += 1;
            let activity = site.activity.unwrap_or_default();
            let cast = Cast::new(&SequenceConfig { seed, activity, ..config.clone() });
            let (built, actions) = furnish(&site, &cast, seed, ATTEMPTS).unwrap_or_else(|| {
                site.activity = None;
                furnish(&site, &cast, seed, 1).unwrap_or_default()
            });
            let scene_from_room = Pose3::from_translation(plan.middle(&tile));
            b.join(built, scene_from_room);
            people.push((cast, actions, scene_from_room));
        }
        for (cast, actions, scene_from_room) in people {
            cast.enter_room(&mut b, actions, scene_from_room);
        }
        // A trolley would stand where the tour begins: no event is made for buildings.
        let mut scene = Self::of(b, Viewpoint::OFFICE, Walk::new(&[begin.to_array()], 0.0, 0.0));
        scene.tour = Some(tour);
        scene
    }
}

/// The camera's tour of at most the given time.
fn tour(building: &BuildingPlan, seed: u64, seconds: f64) -> Tour {
    round::round(building, seconds, &mut stream(seed, Use::Scene, 10, 0))
}

/// How long the camera's tour takes, seconds, when it may take so long.
pub(crate) fn tour_seconds(building: &BuildingPlan, seed: u64, seconds: f64) -> f64 {
    tour(building, seed, seconds).seconds()
}

/// Points along a tour.
fn points(tour: &Tour) -> Vec<Vec2> {
    let steps = (tour.seconds() / (KNOTS / f64::from(Tour::SPEED))) as u32;
    let at = |k: u32| tour.scene_from_carrier(f64::from(k) * KNOTS / f64::from(Tour::SPEED)).translation;
    let mut points: Vec<Vec2> = (0..=steps).map(|k| at(k).truncate()).collect();
    points.dedup();
    points
}

/// Floor, ceiling and walls: one thing of many cuboids.
fn shell(b: &mut Builder, plan: &Plan) {
    let grid = &plan.grid;
    let [width, height] = [grid.width, grid.height].map(|cells| cells as f64 * grid.resolution);
    let [x, y] = grid.origin;
    let x = [x - SLAB, x + width + SLAB];
    let y = [y - SLAB, y + height + SLAB];
    let top = f64::from(plan.wall_height);
    b.thing(None, [0.0; 3], 0.0);
    let mut slab = |bounds: [[f64; 2]; 3], material| {
        let center = bounds.map(|[low, high]| (0.5 * (low + high)) as f32);
        b.cuboid(center, bounds.map(|[low, high]| (high - low) as f32), material);
    };
    slab([x, y, [-SLAB, 0.0]], CARPET);
    slab([x, y, [top, top + SLAB]], PLASTER);
    for wall in &plan.walls {
        slab([[wall.low[0], wall.high[0]], [wall.low[1], wall.high[1]], [0.0, top]], PLASTER);
    }
}

impl Plan {
    /// The middle of a tile, on the floor.
    fn middle(&self, tile: &Tile) -> Vec3 {
        let [x, y] = [0, 1].map(|axis| {
            let middle = 0.5 * (tile.low[axis] + tile.high[axis]) as f64;
            (self.grid.origin[axis] + middle * self.grid.resolution) as f32
        });
        Vec3::new(x, y, 0.0)
    }

    /// A tile before it is furnished: things stand and hang along its sides only where walls are, and off the
    /// ways of the camera and of those who walk through.
    fn site(&self, tile: &Tile, way: &[Vec2]) -> Site {
        let size = tile.lengths().map(|cells| (cells as f64 * self.grid.resolution) as f32);
        let half = 0.5 * Vec2::from(size);
        let middle = self.middle(tile).truncate();
        let near = |at: &Vec2| (at.abs() - half).max_element() < 1.0;
        let passed = way.iter().map(|&at| at - middle).filter(near).collect();
        let openings: Vec<[Vec2; 2]> = (0..4).flat_map(|side| self.openings(tile, side)).collect();
        let has_window = !openings.iter().any(|[from, to]| from.y > 0.0 && from.y == to.y);
        let (lanes, tables) = (Vec::new(), Vec::new());
        let height = self.wall_height;
        Site { size, height, lanes, openings, passed, has_window, tables, activity: None }
    }

    /// The stretches of a tile's side where no wall is, in the frame of its middle. Sides 0 and 1 are at the lower
    /// and upper end of x, 2 and 3 of y.
    fn openings(&self, tile: &Tile, side: usize) -> Vec<[Vec2; 2]> {
        let (axis, is_upper) = (side / 2, side % 2 == 1);
        let other = 1 - axis;
        let resolution = self.grid.resolution as f32;
        let half = 0.5 * Vec2::from(tile.lengths().map(|cells| cells as f32 * resolution));
        let is_wall = |t: usize| {
            let beyond = if is_upper { Some(tile.high[axis]) } else { tile.low[axis].checked_sub(1) };
            beyond.is_some_and(|beyond| {
                let [x, y] = if axis == 0 { [beyond, t] } else { [t, beyond] };
                let is_within = x < self.grid.width && y < self.grid.height;
                is_within && self.grid.cells[y * self.grid.width + x] == PlanCell::Occupied
            })
        };
        let cells: Vec<bool> = (tile.low[other]..tile.high[other]).map(is_wall).collect();
        let mut openings = Vec::new();
        let mut begin = 0;
        for run in cells.chunk_by(|a, b| a == b) {
            let end = begin + run.len();
            if run.first() == Some(&false) {
                let point = |cell: usize| {
                    let mut point = if is_upper { half } else { -half };
                    point[other] = cell as f32 * resolution - half[other];
                    point
                };
                openings.push([point(begin), point(end)]);
            }
            begin = end;
        }
        openings
    }
}
