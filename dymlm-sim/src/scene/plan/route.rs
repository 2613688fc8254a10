use parry3d::math::Vec2;

use super::raster::{Counts, Raster};
use super::{PlanError, PlanGrid};

/// The places of a plan where a camera can be carried or somebody can walk, and ways between them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Route {
    origin: Vec2,
    /// Distance between neighbouring places, metres.
    step: f32,
    /// The places that are open and can be reached from each other.
    open: Raster,
}

/// Places are about this far apart, metres.
const STEP: f64 = 0.1;
/// More free floor than this makes no place better, metres.
const AMPLE: f32 = 1.5;
/// Lengths of ways to the neighbours at a side and across a corner, in fifths of a step.
const STRAIGHT: u32 = 5;
const DIAGONAL: u32 = 7;
/// What is not reached is this far away.
const FAR: u32 = u32::MAX;

impl Route {
    /// The largest region of places with free floor for `clearance` metres on all sides.
    pub(super) fn new(grid: &PlanGrid, free: &Raster, clearance: f32) -> Result<Self, PlanError> {
        let cells = (STEP / grid.resolution).ceil().max(1.0) as usize;
        let counts = Counts::of(free);
        let (width, height) = (grid.width / cells, grid.height / cells);
        let is_open: Vec<bool> = (0..width * height)
            .map(|place| {
                has_clearance(&counts, [place % width, place / width], cells, grid.resolution, clearance)
            })
            .collect();
        let mut open = Raster { width, height, cells: is_open };
        let largest = open.largest_component().ok_or(PlanError::NoWay(2.0 * clearance))?;
        open.cells.fill(false);
        for place in largest {
            open.cells[place] = true;
        }
        let step = (cells as f64 * grid.resolution) as f32;
        Ok(Self { origin: Vec2::from(grid.origin.map(|c| c as f32)), step, open })
    }

    /// Number of open places.
    fn len(&self) -> usize {
        self.open.cells.iter().filter(|&&open| open).count()
    }

    /// Area of the open places, square metres.
    pub(super) fn area(&self) -> f32 {
        self.len() as f32 * self.step * self.step
    }

    /// Where a place is on the floor.
    pub(super) fn point(&self, place: usize) -> Vec2 {
        let [x, y] = self.open.place(place).map(|c| c as f32 + 0.5);
        self.origin + self.step * Vec2::new(x, y)
    }

    /// Whether a straight way between two points leads over open places only.
    pub(super) fn is_straight_way(&self, from: Vec2, to: Vec2) -> bool {
        let steps = (2.0 * from.distance(to) / self.step).ceil().max(1.0) as u32;
        (0..=steps).all(|k| {
            let at = (from.lerp(to, k as f32 / steps as f32) - self.origin) / self.step;
            self.open.at(at.x.floor() as i64, at.y.floor() as i64)
        })
    }

    /// Open places such that a straight way of less than `spacing` metres leads to each other open place from one
    /// of them: first where the most free floor is, no two with such a way between them.
    pub(super) fn stops(&self, free: &Counts, resolution: f64, spacing: f32) -> Vec<usize> {
        let cells = (f64::from(self.step) / resolution).round() as usize;
        let clearance = |place: usize| {
            let at = [place % self.open.width, place / self.open.width];
            let levels = (AMPLE / self.step) as u32;
            let level = (1..=levels)
                .find(|&level| !has_clearance(free, at, cells, resolution, level as f32 * self.step));
            level.unwrap_or(levels + 1)
        };
        let open = (0..self.open.cells.len()).filter(|&place| self.open.cells[place]);
        let mut places: Vec<(u32, usize)> = open.map(|place| (clearance(place), place)).collect();
        places.sort_by_key(|&(clearance, place)| (std::cmp::Reverse(clearance), place));
        let mut stops: Vec<usize> = Vec::new();
        for (_, place) in places {
            let at = self.point(place);
            let is_near = |&stop: &usize| {
                let stop = self.point(stop);
                stop.distance(at) < spacing && self.is_straight_way(stop, at)
            };
            if !stops.iter().any(is_near) {
                stops.push(place);
            }
        }
        stops
    }

    /// Lengths of the ways from a place to all places, in fifths of a step: Dijkstra's algorithm with a bucket
    /// for each length, of which only the next few are in use.
    pub(super) fn lengths_from(&self, place: usize) -> Vec<u32> {
        const BUCKETS: usize = DIAGONAL as usize + 1;
        let mut lengths = vec![FAR; self.open.cells.len()];
        let mut buckets: [Vec<usize>; BUCKETS] = Default::default();
        lengths[place] = 0;
        buckets[0].push(place);
        let (mut length, mut waiting) = (0_u32, 1_usize);
        while waiting > 0 {
            for place in std::mem::take(&mut buckets[length as usize % BUCKETS]) {
                waiting -= 1;
                if lengths[place] != length {
                    continue;
                }
                for (next, way) in self.neighbours(place) {
                    if length + way < lengths[next] {
                        lengths[next] = length + way;
                        buckets[(length + way) as usize % BUCKETS].push(next);
                        waiting += 1;
                    }
                }
            }
            length += 1;
        }
        lengths
    }

    /// The corners of a short way from the place that the lengths were counted from, which is left out, to another
    /// one.
    pub(super) fn way(&self, lengths: &[u32], to: usize) -> Vec<Vec2> {
        let mut places = vec![to];
        let mut here = to;
        while lengths[here] > 0 {
            let back =
                self.neighbours(here).find(|&(next, way)| lengths[next].saturating_add(way) == lengths[here]);
            let Some((next, _)) = back else { break };
            places.push(next);
            here = next;
        }
        places.reverse();
        let mut points = places.into_iter().map(|place| self.point(place)).peekable();
        let mut corners = Vec::new();
        let Some(mut from) = points.next() else { return corners };
        while let Some(point) = points.next() {
            // A corner is where the next place cannot be reached in a straight line.
            if points.peek().is_none_or(|&next| !self.is_straight_way(from, next)) {
                corners.push(point);
                from = point;
            }
        }
        corners
    }

    /// The open places around a place, and the lengths of the ways to them.
    fn neighbours(&self, place: usize) -> impl Iterator<Item = (usize, u32)> + '_ {
        let near = self.open.neighbours(place).filter(|&(next, _)| self.open.cells[next]);
        near.map(|(next, is_diagonal)| (next, if is_diagonal { DIAGONAL } else { STRAIGHT }))
    }
}

/// Whether all cells are free that are less than `clearance` metres along x and y from the middle of a place of
/// `cells` x `cells` cells.
fn has_clearance(free: &Counts, place: [usize; 2], cells: usize, resolution: f64, clearance: f32) -> bool {
    let reach = f64::from(clearance) / resolution;
    let middle = place.map(|c| (c as f64 + 0.5) * cells as f64);
    free.are_all_in(middle.map(|c| (c - reach).floor() as i64), middle.map(|c| (c + reach).ceil() as i64))
}
