use std::collections::VecDeque;

use dymlm_core::Pose;
use dymlm_octree::GridRegion;
use dymlm_planes::PlaneMap;

use super::floor::Floor;

/// Heights are rounded to this share of a cell: a plane that is fitted anew by a hair changes no column.
const STEPS_IN_CELL: f64 = 10.0;

/// Steps of a height that is not known.
const UNKNOWN: i32 = i32::MIN;

/// How many cells of the floor beside a step the step itself takes: its riser stands on the border between two
/// floors, and noise moves both.
const RISER_CELLS: usize = 2;

/// The height of the floor under each cell of a region. Where no plane of the floor was read it goes on as
/// high as at a place nearby where one was: that of the fewest steps from cell to cell, straight or across. 4
/// bytes a cell, beside 17 of the grid, which has two heights for each.
#[derive(Debug, Clone)]
pub(super) struct FloorHeights {
    resolution: f64,
    first: [i64; 2],
    size: [usize; 2],
    /// In steps of a tenth of a cell, x fastest.
    steps: Vec<i32>,
    max_step: f64,
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
        let size = [0, 1].map(|axis| end[axis].saturating_sub(first[axis]).max(0) as usize);
        let steps = vec![UNKNOWN; size[0] * size[1]];
        let mut own = Self { resolution, first, size, steps, max_step };
        own.read(floor, planes, grid_from_world);
        own.go_on(floor);
        own
    }

    /// Height of the floor at a place, metres; `None` outside of the region.
    pub(super) fn at(&self, place: [f64; 2]) -> Option<f64> {
        self.known(self.index(place)?)
    }

    /// The height above which something is not floor at a place, metres: beside a step up that to which it
    /// leads, since a riser that may be taken is floor.
    pub(super) fn on_step(&self, place: [f64; 2]) -> Option<f64> {
        let index = self.index(place)?;
        let own = self.known(index)?;
        let ([width, height], [x, y]) = (self.size, [index % self.size[0], index / self.size[0]]);
        let columns = x.saturating_sub(RISER_CELLS)..(x + RISER_CELLS + 1).min(width);
        let rows = y.saturating_sub(RISER_CELLS)..(y + RISER_CELLS + 1).min(height);
        let beside = rows.flat_map(|row| columns.clone().map(move |column| row * width + column));
        let highest =
            beside.filter_map(|cell| self.known(cell)).filter(|other| *other <= own + self.max_step);
        Some(highest.fold(own, f64::max))
    }

    /// The height in a cell, metres.
    fn known(&self, index: usize) -> Option<f64> {
        let steps = self.steps.get(index).copied().filter(|&steps| steps != UNKNOWN)?;
        Some(f64::from(steps) * self.step())
    }

    fn step(&self) -> f64 {
        self.resolution / STEPS_IN_CELL
    }

    fn set(&mut self, index: usize, height: f64) {
        // A cast saturates; the lowest number means that nothing is known.
        self.steps[index] = ((height / self.step()).round() as i32).max(UNKNOWN + 1);
    }

    /// How high planes were read in cells; of several in one cell the one nearest to the height at which the
    /// floor began.
    fn read(&mut self, floor: &Floor, planes: &PlaneMap, grid_from_world: &Pose) {
        let Some(start) = floor.0.first() else { return };
        let mut voxels: Vec<(usize, f64)> = Vec::new();
        for own in &floor.0 {
            voxels.clear();
            for center in planes.plane(own.id).into_iter().flat_map(dymlm_planes::MapPlane::voxel_centers) {
                let [x, y, height] = grid_from_world.transform_point(center);
                voxels.extend(self.index([x, y]).map(|index| (index, height)));
            }
            // Stable: those of a cell stay in the order of the plane.
            voxels.sort_by_key(|(index, _)| *index);
            for in_cell in voxels.chunk_by(|a, b| a.0 == b.0) {
                let Some(&(index, _)) = in_cell.first() else { continue };
                let sum: f64 = in_cell.iter().map(|(_, height)| height).sum();
                let center = self.center(index);
                let read = own.height_read(center, sum / in_cell.len() as f64);
                let away = |height: f64| (height - start.height(center)).abs();
                if self.known(index).is_none_or(|known| away(read) < away(known)) {
                    self.set(index, read);
                }
            }
        }
    }

    /// From the cells that were read to those around them, and on; where none was read, all have the height of
    /// the plane with which the floor began.
    fn go_on(&mut self, floor: &Floor) {
        // Those inside of what was read lead to nothing new.
        let is_known = |index: &usize| self.steps[*index] != UNKNOWN;
        let mut rim: VecDeque<usize> = (0..self.steps.len())
            .filter(|index| is_known(index) && !self.around(*index).all(|beside| is_known(&beside)))
            .collect();
        if let (false, Some(start)) = ((0..self.steps.len()).any(|index| is_known(&index)), floor.0.first()) {
            for index in 0..self.steps.len() {
                self.set(index, start.height(self.center(index)));
            }
        }
        while let Some(index) = rim.pop_front() {
            for beside in self.around(index) {
                if self.steps[beside] == UNKNOWN {
                    self.steps[beside] = self.steps[index];
                    rim.push_back(beside);
                }
            }
        }
    }

    /// A cell and those around it.
    fn around(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let ([width, height], [x, y]) = (self.size, [index % self.size[0], index / self.size[0]]);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.flat_map(move |row| {
            (x.saturating_sub(1)..(x + 2).min(width)).map(move |column| row * width + column)
        })
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
