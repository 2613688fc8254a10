use dymlm_core::{ColorImage, DepthImage, Mask, PinholeCamera, Point, Pose, Rgb};

use super::ScanScratch;
use super::cell_colors::CellColors;
use super::ray::RayOrigin;
use crate::lattice::{Key, Lattice, OUTSIDE};
use crate::{InsertReport, OctreeConfig, RayMode};

/// What is inserted.
pub(crate) enum Readings<'a> {
    Points {
        points: &'a [Point],
        colors: Option<&'a [Rgb]>,
    },
    /// All images of the camera's size.
    Depth {
        camera: &'a PinholeCamera,
        depth: &'a DepthImage,
        static_mask: Option<&'a Mask>,
        color: Option<&'a ColorImage>,
        world_from_camera: &'a Pose,
    },
}

/// A box of cells, from and to including.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    min: Key,
    max: Key,
}

impl Bounds {
    /// The part that rays can reach, `reach` cells far.
    pub(crate) fn within_reach(&self, origin: Key, reach: f64) -> ([i32; 3], [i32; 3]) {
        let reach = reach.min(65536.0).ceil() as i32 + 2;
        let origin = origin.map(i32::from);
        (
            std::array::from_fn(|axis| i32::from(self.min[axis]).max(origin[axis] - reach)),
            std::array::from_fn(|axis| i32::from(self.max[axis]).min(origin[axis] + reach)),
        )
    }
}

/// Buffers for one row of a depth image, an array for each of x, y, z.
#[derive(Debug, Default)]
pub(crate) struct DepthRow {
    /// Direction of each column's pixel in the middle row, in the world.
    rays: [Vec<f32>; 3],
    world: [Vec<f32>; 3],
    indices: [Vec<u32>; 3],
}

/// Finds the cells of readings: fills `keys` (and `ends`) of the scratch, and sums up colours. Returns the box around
/// the cells and the origin.
pub(crate) fn find_cells(
    readings: &Readings<'_>,
    origin: &RayOrigin,
    lattice: &Lattice,
    config: &OctreeConfig,
    scratch: &mut ScanScratch,
    report: &mut InsertReport,
) -> Bounds {
    scratch.keys.clear();
    scratch.ends.clear();
    let mut cells = CellList {
        origin,
        lattice,
        config,
        keys: &mut scratch.keys,
        ends: &mut scratch.ends,
        colors: &mut scratch.colors,
        bounds: Bounds { min: origin.key, max: origin.key },
        last: [OUTSIDE; 3],
        report,
    };
    match *readings {
        Readings::Points { points, colors } => cells.add_points(points, colors),
        Readings::Depth { camera, depth, static_mask, color, world_from_camera } => {
            scratch.row.prepare(camera, world_from_camera);
            for v in 0..camera.height() {
                let pixels = v * camera.width()..(v + 1) * camera.width();
                let depths = &depth.data()[pixels.clone()];
                scratch.row.fill(camera, world_from_camera, v, depths, lattice);
                let mask = static_mask.map(|mask| &mask.data()[pixels.clone()]);
                let colors = color.map(|color| &color.data()[pixels.clone()]);
                cells.add_row(&scratch.row, depths, mask, colors);
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
    keys: &'a mut Vec<Key>,
    ends: &'a mut Vec<Point>,
    colors: &'a mut CellColors,
    bounds: Bounds,
    last: [u32; 3],
    report: &'a mut InsertReport,
}

impl CellList<'_> {
    fn add_points(&mut self, points: &[Point], colors: Option<&[Rgb]>) {
        const CHUNK: usize = 256;
        let mut indices = [0; 3 * CHUNK];
        for (chunk, points) in points.chunks(CHUNK).enumerate() {
            let indices = &mut indices[..3 * points.len()];
            self.lattice.indices(points.as_flattened(), indices);
            for (i, (&point, &indices)) in points.iter().zip(indices.as_chunks::<3>().0).enumerate() {
                let color = colors.map(|colors| colors[chunk * CHUNK + i]);
                self.add(indices, || point, color);
            }
        }
    }

    fn add_row(&mut self, row: &DepthRow, depths: &[f32], mask: Option<&[bool]>, colors: Option<&[Rgb]>) {
        let [x, y, z] = &row.indices;
        for (u, (((&depth, &x), &y), &z)) in depths.iter().zip(x).zip(y).zip(z).enumerate() {
            if depth > 0.0 && mask.is_none_or(|mask| mask[u]) {
                let point = || [row.world[0][u], row.world[1][u], row.world[2][u]];
                self.add([x, y, z], point, colors.map(|colors| colors[u]));
            }
        }
    }

    #[inline]
    fn add(&mut self, indices: [u32; 3], point: impl Fn() -> Point, color: Option<Rgb>) {
        self.report.readings += 1;
        let again = indices == self.last;
        if !again && indices.iter().any(|&index| index >= OUTSIDE) {
            self.skip(point());
            return;
        }
        let key = indices.map(|index| index as u16);
        if let Some(color) = color {
            self.add_color(key, point(), color);
        }
        if self.config.rays == RayMode::PerPoint {
            self.ends.push(point());
        } else if again {
            // Neighbouring pixels mostly share a cell.
            return;
        }
        self.last = indices;
        self.keys.push(key);
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

/// Back-projection: world = (ray of the column + what a row adds) * depth + camera centre, with the rays already
/// turned into the world. Loops over plain arrays, which the compiler makes vector code of.
impl DepthRow {
    fn prepare(&mut self, camera: &PinholeCamera, world_from_camera: &Pose) {
        let rotation = world_from_camera.rotation_matrix();
        for (rays, [x, _, z]) in self.rays.iter_mut().zip(rotation) {
            rays.clear();
            rays.extend((0..camera.width()).map(|u| ((u as f64 - camera.cx()) / camera.fx() * x + z) as f32));
        }
        for (world, indices) in self.world.iter_mut().zip(&mut self.indices) {
            world.resize(camera.width(), 0.0);
            indices.resize(camera.width(), 0);
        }
    }

    fn fill(
        &mut self,
        camera: &PinholeCamera,
        world_from_camera: &Pose,
        v: usize,
        depths: &[f32],
        lattice: &Lattice,
    ) {
        let rotation = world_from_camera.rotation_matrix();
        let translation = world_from_camera.translation();
        let ray_y = (v as f64 - camera.cy()) / camera.fy();
        for axis in 0..3 {
            let (row, center) = ((ray_y * rotation[axis][1]) as f32, translation[axis] as f32);
            let world = &mut self.world[axis];
            for ((world, &ray), &depth) in world.iter_mut().zip(&self.rays[axis]).zip(depths) {
                *world = (ray + row) * depth + center;
            }
            lattice.indices(world, &mut self.indices[axis]);
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        9 * size_of::<f32>() * self.rays[0].capacity()
    }
}
