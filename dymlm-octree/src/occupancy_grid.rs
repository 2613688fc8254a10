use std::cmp::Ordering;
use std::io::Write;
use std::path::Path;

use dymlm_core::Pose;
use dymlm_core::vector3::{dot, norm};

use crate::accessor::Accessor;
use crate::ray_cast::Walk;
use crate::{CellState, Error, Octree};

/// A 2D map seen from above, as ROS `map_server` reads it: what is in the way of a robot of a certain height.
///
/// The grid lies in the plane of its own x and y axes; its z axis is "up". Cells are square, row by row from
/// the lowest y, x running fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct OccupancyGrid {
    width: usize,
    height: usize,
    resolution: f64,
    origin: [f64; 2],
    world_from_grid: Pose,
    cells: Vec<CellState>,
}

impl Octree {
    /// Projects the cells between two heights onto a 2D grid. Heights are measured along `up` (any length,
    /// any direction) from the world's origin, metres; infinite heights mean no limit.
    ///
    /// A grid cell is occupied when the line along `up` through its centre meets an occupied cell between the
    /// heights, else free when it meets a free one, else unknown. The grid's x and y axes are the world's,
    /// turned on the shortest way that takes z to `up`; for `up` = z its cells are columns of the octree's.
    /// Costs O(grid cells x leaves in a column), blocks of 8 cells a side taken cell by cell.
    ///
    /// # Errors
    ///
    /// [`Error::Projection`] when `up` is zero or not finite, or `min_height < max_height` does not hold;
    /// [`Error::GridSize`].
    ///
    /// ```
    /// use dymlm_octree::{CellState, Octree, OctreeConfig};
    ///
    /// let mut map = Octree::new(OctreeConfig::default())?;
    /// map.insert_scan([0.0, 0.0, 1.01], &[[2.0, 0.01, 1.01]])?;
    /// let grid = map.project([0.0, 0.0, 1.0], 0.1, 1.8)?;
    /// assert_eq!((grid.width(), grid.height()), (41, 1));
    /// assert_eq!(grid.at(40, 0), CellState::Occupied);
    /// assert_eq!(grid.at(20, 0), CellState::Free);
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn project(&self, up: [f64; 3], min_height: f64, max_height: f64) -> Result<OccupancyGrid, Error> {
        let refused = Error::Projection { up, min_height, max_height };
        let Some(axes) = grid_axes(up) else { return Err(refused) };
        if min_height.partial_cmp(&max_height) != Some(Ordering::Less) {
            return Err(refused);
        }
        let world_from_grid = world_from_grid(axes)?;
        let bounds = self.bounds_between(axes, min_height, max_height);
        let mut grid = OccupancyGrid::over(&bounds, self.resolution(), world_from_grid)?;
        grid.fill(&mut self.accessor(), axes, &bounds);
        Ok(grid)
    }

    /// The box, in the grid's axes, around the leaves that reach between the heights.
    fn bounds_between(&self, axes: [[f64; 3]; 3], min_height: f64, max_height: f64) -> Bounds {
        let mut bounds = Bounds { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };
        for leaf in self.leaves() {
            let center = axes.map(|axis| dot(axis, leaf.center));
            let half = axes.map(|axis| 0.5 * leaf.size * axis.iter().map(|value| value.abs()).sum::<f64>());
            if center[2] + half[2] <= min_height || center[2] - half[2] >= max_height {
                continue;
            }
            for axis in 0..3 {
                bounds.min[axis] = bounds.min[axis].min(center[axis] - half[axis]);
                bounds.max[axis] = bounds.max[axis].max(center[axis] + half[axis]);
            }
        }
        bounds.min[2] = bounds.min[2].max(min_height);
        bounds.max[2] = bounds.max[2].min(max_height);
        bounds
    }
}

struct Bounds {
    min: [f64; 3],
    max: [f64; 3],
}

impl OccupancyGrid {
    /// Largest number of cells.
    pub const MAX_CELLS: u64 = 1 << 28;

    /// A grid of unknown cells over a box, its lines at multiples of the cell size.
    fn over(bounds: &Bounds, resolution: f64, world_from_grid: Pose) -> Result<Self, Error> {
        // A hair's breadth within, so that rounding adds no row.
        let first = [0, 1].map(|axis| (bounds.min[axis] / resolution + 1e-6).floor());
        let end = [0, 1].map(|axis| (bounds.max[axis] / resolution - 1e-6).ceil());
        let [width, height] = [0, 1].map(|axis| (end[axis] - first[axis]).max(0.0) as u64);
        if width == 0 || height == 0 {
            let origin = [0.0; 2];
            return Ok(Self { width: 0, height: 0, resolution, origin, world_from_grid, cells: Vec::new() });
        }
        let cells = width.checked_mul(height).filter(|&cells| cells <= Self::MAX_CELLS);
        let Some(cells) = cells else { return Err(Error::GridSize { width, height }) };
        Ok(Self {
            width: width as usize,
            height: height as usize,
            resolution,
            origin: first.map(|index| index * resolution),
            world_from_grid,
            cells: vec![CellState::Unknown; cells as usize],
        })
    }

    fn fill(&mut self, accessor: &mut Accessor<'_>, axes: [[f64; 3]; 3], bounds: &Bounds) {
        // Heights on a border between cells belong to the cells within.
        let margin = 0.01 * self.resolution;
        let (bottom, length) = (bounds.min[2] + margin, bounds.max[2] - bounds.min[2] - 2.0 * margin);
        for i in 0..self.cells.len() {
            let [x, y] = self.center(i % self.width, i / self.width);
            let start = std::array::from_fn(|k| x * axes[0][k] + y * axes[1][k] + bottom * axes[2][k]);
            self.cells[i] = column_state(accessor, start, axes[2], length);
        }
    }

    /// Number of cells along x; 0 when nothing was observed between the heights.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of cells along y.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Side of a cell, metres.
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// The lower left corner of cell (0, 0) in the grid's axes, metres.
    pub fn origin(&self) -> [f64; 2] {
        self.origin
    }

    /// Where the grid's axes are in the world.
    pub fn world_from_grid(&self) -> Pose {
        self.world_from_grid
    }

    /// All cells, row by row from the lowest y.
    pub fn cells(&self) -> &[CellState] {
        &self.cells
    }

    /// A cell; unknown outside the grid.
    pub fn at(&self, x: usize, y: usize) -> CellState {
        if x < self.width {
            self.cells.get(y * self.width + x).copied().unwrap_or(CellState::Unknown)
        } else {
            CellState::Unknown
        }
    }

    /// Centre of a cell in the grid's axes, metres.
    pub fn center(&self, x: usize, y: usize) -> [f64; 2] {
        let at = |origin: f64, i: usize| origin + (i as f64 + 0.5) * self.resolution;
        [at(self.origin[0], x), at(self.origin[1], y)]
    }

    /// Writes the image that `map_server` reads: binary PGM, the highest y on top; occupied 0, free 254,
    /// unknown 205.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn write_pgm(&self, mut writer: impl Write) -> Result<(), Error> {
        write!(writer, "P5\n{} {}\n255\n", self.width, self.height)?;
        for row in self.cells.chunks_exact(self.width.max(1)).rev() {
            let row: Vec<u8> = row.iter().map(|&cell| gray(cell)).collect();
            writer.write_all(&row)?;
        }
        writer.flush()?;
        Ok(())
    }

    /// Writes the description that `map_server` reads beside the image named `image`.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn write_yaml(&self, mut writer: impl Write, image: &str) -> Result<(), Error> {
        let image = image.replace('\\', "\\\\").replace('"', "\\\"");
        let Self { resolution, origin: [x, y], .. } = self;
        write!(
            writer,
            "image: \"{image}\"\nresolution: {resolution}\norigin: [{x}, {y}, 0.0]\nnegate: 0\n\
             occupied_thresh: 0.65\nfree_thresh: 0.196\n"
        )?;
        writer.flush()?;
        Ok(())
    }

    /// Writes `name.pgm` and `name.yaml` into a folder; each replaces an older file only when it is whole.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], naming the file.
    pub fn save(&self, folder: impl AsRef<Path>, name: &str) -> Result<(), Error> {
        let image = format!("{name}.pgm");
        let image_path = folder.as_ref().join(&image);
        let yaml_path = folder.as_ref().join(format!("{name}.yaml"));
        crate::files::save(&image_path, |writer| self.write_pgm(writer))?;
        crate::files::save(&yaml_path, |writer| self.write_yaml(writer, &image))
    }
}

/// What the cells along a line say together.
fn column_state(accessor: &mut Accessor<'_>, start: [f64; 3], up: [f64; 3], length: f64) -> CellState {
    let Some(mut walk) = Walk::new(accessor, start, up) else { return CellState::Unknown };
    let mut state = CellState::Unknown;
    loop {
        match accessor.cell_state(walk.key) {
            CellState::Occupied => return CellState::Occupied,
            CellState::Free => state = CellState::Free,
            CellState::Unknown => {}
        }
        let side_bits = accessor.side_bits(walk.key);
        let goes_on = if side_bits > 0 { walk.leave(side_bits) } else { walk.step() };
        if !goes_on || walk.entered > length {
            return state;
        }
    }
}

fn gray(cell: CellState) -> u8 {
    match cell {
        CellState::Occupied => 0,
        CellState::Free => 254,
        CellState::Unknown => 205,
    }
}

/// The world's axes turned so that z becomes `up`, on the shortest way; `None` when `up` has no direction.
fn grid_axes(up: [f64; 3]) -> Option<[[f64; 3]; 3]> {
    // Scaled first: squares of large or small components would not be representable.
    let largest = up.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let up = up.map(|value| value / largest);
    let length = norm(up);
    // Not for zero, infinity and NaN.
    if !length.is_finite() {
        return None;
    }
    let [x, y, z] = up.map(|value| value / length);
    if z < -1.0 + 1e-9 {
        // Every axis is as short: half a turn about x.
        return Some([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
    }
    // Rodrigues' formula for the rotation about z x up.
    let k = 1.0 / (1.0 + z);
    Some([[1.0 - k * x * x, -k * x * y, -x], [-k * x * y, 1.0 - k * y * y, -y], [x, y, z]])
}

fn world_from_grid(axes: [[f64; 3]; 3]) -> Result<Pose, Error> {
    let rows = std::array::from_fn(|row| std::array::from_fn(|column| axes[column][row]));
    Ok(Pose::from_rotation_matrix(rows, [0.0; 3])?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_a_rotation_with_up_as_z() {
        for up in [[0.0, 0.0, 2.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [0.3, -0.5, 0.1], [1e-7, 0.0, -1.0]] {
            let axes = grid_axes(up).unwrap();
            for (i, a) in axes.iter().enumerate() {
                for (j, b) in axes.iter().enumerate() {
                    assert!((dot(*a, *b) - f64::from(u8::from(i == j))).abs() < 1e-6, "{up:?}");
                }
            }
            assert!((dot(axes[2], up) - dot(up, up).sqrt()).abs() < 1e-6);
            assert!(world_from_grid(axes).is_ok(), "{up:?}");
        }
        for (tiny, huge) in [(1e-200, 1e200), (1e-320, f64::MAX)] {
            assert_eq!(grid_axes([0.0, 0.0, tiny]), grid_axes([0.0, 0.0, 1.0]));
            assert_eq!(grid_axes([0.0, huge, huge]), grid_axes([0.0, 1.0, 1.0]));
        }
        assert_eq!(grid_axes([0.0; 3]), None);
        assert_eq!(grid_axes([f64::INFINITY, 0.0, 1.0]), None);
        assert_eq!(grid_axes([f64::NAN, 0.0, 1.0]), None);
    }
}
