use dymlm_core::{ColorImage, Frame, Mask, Point, Pose, Rgb, SensorModel};

use super::cell_colors::CellColors;
use super::ray::RayOrigin;
use super::reading_row::{NO_READING, Row};
use super::scan_scratch::{RayEnds, ScanScratch};
use crate::lattice::{Key, Lattice, OUTSIDE};
use crate::{InsertReport, OctreeConfig, RayMode};

/// What is inserted.
pub(crate) enum Readings<'a> {
    Points {
        points: &'a [Point],
        colors: Option<&'a [Rgb]>,
    },
    /// All images have the camera's size.
    Depth {
        frame: &'a Frame,
        sensor: &'a SensorModel,
        static_mask: Option<&'a Mask>,
        color: Option<&'a ColorImage>,
        world_from_camera: &'a Pose,
    },
}

/// A box of cells, both corners included.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    min: Key,
    max: Key,
}

impl Bounds {
    /// The part of the box that rays of `reach` cells can reach from the origin.
    pub(crate) fn within_reach(&self, origin: Key, reach: f64) -> ([i32; 3], [i32; 3]) {
        let reach = reach.min(65536.0).ceil() as i32 + 2;
        let origin = origin.map(i32::from);
        (
            std::array::from_fn(|axis| i32::from(self.min[axis]).max(origin[axis] - reach)),
            std::array::from_fn(|axis| i32::from(self.max[axis]).min(origin[axis] + reach)),
        )
    }
}

/// Number of points of a cloud that are handled together.
const STRETCH: usize = 512;

/// Finds the cells of readings: fills `hits` and `cut` of the scratch, and sums up colours. Returns the box
/// around the cells and the origin.
pub(crate) fn find_cells(
    readings: &Readings<'_>,
    origin: &RayOrigin,
    lattice: &Lattice,
    config: &OctreeConfig,
    scratch: &mut ScanScratch,
    report: &mut InsertReport,
) -> Bounds {
    scratch.hits.clear();
    scratch.cut.clear();
    let mut cells = CellList {
        origin,
        lattice,
        config,
        hits: &mut scratch.hits,
        cut: &mut scratch.cut,
        colors: &mut scratch.colors,
        bounds: Bounds { min: origin.key(), max: origin.key() },
        report,
    };
    match *readings {
        Readings::Points { points, colors } => {
            for start in (0..points.len()).step_by(STRETCH) {
                let stretch = start..(start + STRETCH).min(points.len());
                scratch.row.copy_points(&points[stretch.clone()]);
                scratch.row.find_indices(lattice);
                cells.add_row(&mut scratch.row, colors.map(|colors| &colors[stretch]));
            }
        }
        Readings::Depth { frame, sensor, static_mask, color, world_from_camera } => {
            let camera = frame.camera();
            scratch.row.prepare(camera, world_from_camera);
            for v in 0..camera.height() {
                let pixels = v * camera.width()..(v + 1) * camera.width();
                let depths = &frame.depth().data()[pixels.clone()];
                scratch.row.back_project(camera, sensor, world_from_camera, v, depths);
                scratch.row.find_indices(lattice);
                scratch.row.drop_pixels(sensor, depths, v, static_mask);
                let colors = color.map(|color| &color.data()[pixels.clone()]);
                cells.add_row(&mut scratch.row, colors);
            }
        }
    }
    cells.bounds
}

/// The cells found so far.
struct CellList<'a> {
    origin: &'a RayOrigin,
    lattice: &'a Lattice,
    config: &'a OctreeConfig,
    hits: &'a mut RayEnds,
    cut: &'a mut RayEnds,
    colors: &'a mut CellColors,
    bounds: Bounds,
    report: &'a mut InsertReport,
}

impl CellList<'_> {
    fn add_row(&mut self, row: &mut Row, colors: Option<&[Rgb]>) {
        let summary = row.compare_neighbors();
        self.report.readings += summary.readings;
        if self.config.rays == RayMode::PerCell && colors.is_none() && !summary.some_outside {
            self.add_changes(row);
        } else {
            let count = row.world[0].len();
            for i in (0..count).filter(|&i| row.indices[0][i] != NO_READING) {
                self.add(row.cell(i), row.point(i), row.is_cut[i] != 0, colors.map(|colors| colors[i]));
            }
        }
    }

    /// The common case of one ray per cell. Neighbouring pixels mostly share a cell: only changes are added.
    fn add_changes(&mut self, row: &mut Row) {
        row.list_changed();
        for column in row.changed.iter().map(|&column| column as usize) {
            self.add_key(row.cell(column).map(|index| index as u16), row.is_cut[column] != 0);
        }
    }

    fn add(&mut self, cell: [u32; 3], point: Point, is_cut: bool, color: Option<Rgb>) {
        if cell.iter().any(|&index| index >= OUTSIDE) {
            self.skip(point);
            return;
        }
        let key = cell.map(|index| index as u16);
        if let Some(color) = color.filter(|_| !is_cut) {
            self.add_color(key, point, color);
        }
        let ends = if is_cut { &mut *self.cut } else { &mut *self.hits };
        if self.config.rays == RayMode::PerPoint {
            ends.points.push(point);
        } else if ends.keys.last() == Some(&key) {
            return;
        }
        self.add_key(key, is_cut);
    }

    #[inline]
    fn add_key(&mut self, key: Key, is_cut: bool) {
        let ends = if is_cut { &mut *self.cut } else { &mut *self.hits };
        ends.keys.push(key);
        for ((min, max), index) in self.bounds.min.iter_mut().zip(&mut self.bounds.max).zip(key) {
            *min = index.min(*min);
            *max = index.max(*max);
        }
    }

    fn skip(&mut self, point: Point) {
        if point.iter().all(|coordinate| coordinate.is_finite()) {
            self.report.outside += 1;
        } else {
            self.report.not_finite += 1;
        }
    }

    fn add_color(&mut self, key: Key, point: Point, color: Rgb) {
        let end = match self.config.rays {
            RayMode::PerCell => self.lattice.center_f32(key),
            RayMode::PerPoint => point,
        };
        if self.origin.distance(end) <= self.config.max_range {
            self.colors.add(key, color);
        }
    }
}
