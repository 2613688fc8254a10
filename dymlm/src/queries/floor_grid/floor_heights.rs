use std::collections::VecDeque;

use dymlm_core::Pose;
use dymlm_octree::GridRegion;
use dymlm_planes::PlaneMap;

use super::floor::Floor;

/// Heights are rounded to this share of a cell: a plane that is fitted anew by a hair changes no column.
const STEPS_IN_CELL: f64 = 10.0;

/// How many cells of the floor beside a step the step itself takes: its riser stands on the border between two
/// floors, and noise moves both.
const RISER_CELLS: usize = 2;

/// The height of the floor under each cell of a region. Where no plane of the floor was read it goes on as
/// high as at the nearest place where one was.
#[derive(Debug, Clone)]
pub(super) struct FloorHeights {
    resolution: f64,
    first: [i64; 2],
    size: [usize; 2],
    /// Metres, x fastest.
    heights: Vec<f64>,
    /// The same, but beside a step up to the height that it leads to: a riser that may be taken is floor.
    on_steps: Vec<f64>,
}

impl FloorHeights {
    pub(super) fn of(
        floor: &Floor,
        planes: &PlaneMap,
        grid_from_world: &Pose,
        region: &GridRegion,
        resolution: f64,
        max_step: f64,
    ) -> Self {
        // As grids place their cells.
        let first = region.min.map(|c| (c / resolution + 1e-6).floor() as i64);
        let end = region.max.map(|c| (c / resolution - 1e-6).ceil() as i64);
        let size = [0, 1].map(|axis| (end[axis] - first[axis]).max(0) as usize);
        let heights = vec![f64::NAN; size[0] * size[1]];
        let mut own = Self { resolution, first, size, heights, on_steps: Vec::new() };
        own.read(floor, planes, grid_from_world);
        own.go_on(floor);
        own.climb(max_step);
        own
    }

    /// Height of the floor at a place, metres; `None` outside of the region.
    pub(super) fn at(&self, place: [f64; 2]) -> Option<f64> {
        self.heights.get(self.index(place)?).copied()
    }

    /// The height above which something is not floor at a place, metres.
    pub(super) fn on_step(&self, place: [f64; 2]) -> Option<f64> {
        self.on_steps.get(self.index(place)?).copied()
    }

    /// How high planes were read in cells; of several in one cell the one nearest to the height at which the
    /// floor began.
    fn read(&mut self, floor: &Floor, planes: &PlaneMap, grid_from_world: &Pose) {
        let Some(start) = floor.0.first() else { return };
        let mut sums = vec![(0.0, 0_u32); self.heights.len()];
        for own in &floor.0 {
            sums.fill((0.0, 0));
            for center in planes.plane(own.id).into_iter().flat_map(dymlm_planes::MapPlane::voxel_centers) {
                let [x, y, height] = grid_from_world.transform_point(center);
                if let Some((sum, count)) = self.index([x, y]).and_then(|index| sums.get_mut(index)) {
                    *sum += height;
                    *count += 1;
                }
            }
            for (index, &(sum, count)) in sums.iter().enumerate().filter(|(_, (_, count))| *count > 0) {
                let center = self.center(index);
                let read = own.height_read(center, sum / f64::from(count));
                let away = |height: f64| (height - start.height(center)).abs();
                let known = self.heights[index];
                if known.is_nan() || away(read) < away(known) {
                    self.heights[index] = rounded(read, self.resolution);
                }
            }
        }
    }

    /// From the cells that were read to those around them, and on; where none was read, all have the height of
    /// the plane with which the floor began.
    fn go_on(&mut self, floor: &Floor) {
        let mut known: VecDeque<usize> =
            (0..self.heights.len()).filter(|&index| !self.heights[index].is_nan()).collect();
        if let (true, Some(start)) = (known.is_empty(), floor.0.first()) {
            for index in 0..self.heights.len() {
                self.heights[index] = rounded(start.height(self.center(index)), self.resolution);
            }
        }
        while let Some(index) = known.pop_front() {
            let height = self.heights[index];
            let [x, y] = [index % self.size[0], index / self.size[0]];
            for y in y.saturating_sub(1)..=(y + 1).min(self.size[1] - 1) {
                for x in x.saturating_sub(1)..=(x + 1).min(self.size[0] - 1) {
                    let neighbour = y * self.size[0] + x;
                    if self.heights[neighbour].is_nan() {
                        self.heights[neighbour] = height;
                        known.push_back(neighbour);
                    }
                }
            }
        }
    }

    /// Beside each step up: how high it leads.
    fn climb(&mut self, max_step: f64) {
        let [width, height] = self.size;
        self.on_steps = self.heights.clone();
        for index in 0..self.heights.len() {
            let (own, [x, y]) = (self.heights[index], [index % width, index / width]);
            let rows = y.saturating_sub(RISER_CELLS)..(y + RISER_CELLS + 1).min(height);
            let columns = x.saturating_sub(RISER_CELLS)..(x + RISER_CELLS + 1).min(width);
            for row in rows {
                let beside = &self.heights[row * width + columns.start..row * width + columns.end];
                let highest = beside.iter().filter(|&&other| other <= own + max_step);
                self.on_steps[index] = highest.fold(self.on_steps[index], |top, other| top.max(*other));
            }
        }
    }

    fn index(&self, place: [f64; 2]) -> Option<usize> {
        let [x, y] = [0, 1].map(|axis| {
            let index = (place[axis] / self.resolution).floor() - self.first[axis] as f64;
            (index >= 0.0 && index < self.size[axis] as f64).then_some(index as usize)
        });
        Some(y? * self.size[0] + x?)
    }

    fn center(&self, index: usize) -> [f64; 2] {
        let cell = [index % self.size[0], index / self.size[0]];
        [0, 1].map(|axis| (self.first[axis] as f64 + cell[axis] as f64 + 0.5) * self.resolution)
    }
}

fn rounded(height: f64, resolution: f64) -> f64 {
    let step = resolution / STEPS_IN_CELL;
    (height / step).round() * step
}
