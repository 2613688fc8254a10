use dymlm_core::{Mask, PinholeCamera, Point, Pose, Rgb};

use crate::block_store::split;
use crate::frame_readings::Reading;
use crate::rounding::{ROUNDING_LIMIT, round_far, round_to_i32};
use crate::voxel::{SUBVOXEL_BITS, SUBVOXELS};
use crate::weighting::Weighting;

/// One row of pixels, or a scan's points, as fixed-point world coordinates (1/256 voxel) and weights; weight
/// 0 = not mapped.
///
/// Coordinates relative to the camera are exact to a fraction of a unit in f32; the camera's own place is
/// added as an integer, so that precision does not fall with the distance from the world's origin.
#[derive(Debug, Default)]
pub(crate) struct PixelRow {
    x: Vec<i32>,
    y: Vec<i32>,
    z: Vec<i32>,
    weight: Vec<u32>,
    /// Black where there are none.
    colors: Vec<Rgb>,
}

impl PixelRow {
    /// The voxel of the reading in column `u`.
    #[inline]
    pub(crate) fn cell(&self, u: usize) -> [i32; 3] {
        [self.x[u], self.y[u], self.z[u]].map(|c| c >> SUBVOXEL_BITS)
    }

    /// Bytes that the row takes.
    pub(crate) fn memory_bytes(&self) -> usize {
        let coordinates = self.x.capacity() + self.y.capacity() + self.z.capacity();
        coordinates * size_of::<i32>()
            + self.weight.capacity() * size_of::<u32>()
            + self.colors.capacity() * size_of::<Rgb>()
    }

    fn set_colors(&mut self, colors: Option<&[Rgb]>, width: usize) {
        self.colors.clear();
        self.colors.extend_from_slice(colors.unwrap_or(&[]));
        self.colors.resize(width, Rgb::default());
    }

    /// The readings, each with the coordinates of its block of voxels.
    pub(crate) fn readings(&self) -> impl Iterator<Item = ([i32; 3], Reading)> {
        let mapped = (0..self.weight.len()).filter(|&u| self.weight[u] > 0);
        mapped.map(|u| {
            let (block, cell) = split(self.cell(u));
            let within = [self.x[u], self.y[u], self.z[u]].map(|c| (c & (SUBVOXELS - 1)) as u8);
            (block, Reading { weight: self.weight[u], place: cell as u16, within, color: self.colors[u] })
        })
    }
}

/// Takes the readings of one frame or scan to the world's lattice, a row at a time.
#[derive(Debug, Clone)]
pub(crate) struct FixedPointFrame {
    /// Columns of the rotation, in units of 1/256 voxel a metre.
    columns: [[f32; 3]; 3],
    /// The camera's place, 1/256 voxel.
    origin: [i32; 3],
    /// Whether all readings lie within [`ROUNDING_LIMIT`] of the camera.
    is_near: bool,
    weighting: Weighting,
}

impl FixedPointFrame {
    /// `farthest`: greatest distance of a mapped reading from the camera, metres. `None` when such a reading
    /// could lie `limit` units or more from the world's origin.
    pub(crate) fn new(
        farthest: f64,
        world_from_camera: &Pose,
        voxel_size: f64,
        weighting: Weighting,
        limit: i32,
    ) -> Option<Self> {
        let units_per_metre = f64::from(SUBVOXELS) / voxel_size;
        let rotation = world_from_camera.rotation_matrix();
        let columns = std::array::from_fn(|column| {
            std::array::from_fn(|row| (rotation[row][column] * units_per_metre) as f32)
        });
        let origin = world_from_camera.translation().map(|t| (t * units_per_metre).round());
        let reach = (farthest * units_per_metre).ceil();
        let inside = origin.iter().all(|place| place.abs() + reach < f64::from(limit));
        let is_near = reach < f64::from(ROUNDING_LIMIT);
        inside.then(|| Self { columns, origin: origin.map(|place| place as i32), is_near, weighting })
    }

    /// Fills `row` with the pixels of row `v`, whose (v - cy) / fy is `ray_y`. `ray_x` holds (u - cx) / fx of
    /// each column; pixels that are not static, have no reading or are out of range get weight 0.
    #[expect(clippy::too_many_arguments, reason = "what belongs to a row of the frame")]
    pub(crate) fn fill(
        &self,
        row: &mut PixelRow,
        v: usize,
        ray_y: f32,
        ray_x: &[f32],
        depths: &[f32],
        colors: Option<&[Rgb]>,
        static_mask: Option<&Mask>,
    ) {
        let width = depths.len();
        for buffer in [&mut row.x, &mut row.y, &mut row.z] {
            buffer.resize(width, 0);
        }
        row.weight.resize(width, 0);
        row.set_colors(colors, width);
        let [right, down, forward] = self.columns;
        for (axis, out) in [&mut row.x, &mut row.y, &mut row.z].into_iter().enumerate() {
            let base = down[axis] * ray_y + forward[axis];
            let (slope, origin) = (right[axis], self.origin[axis]);
            let readings = out.iter_mut().zip(ray_x).zip(depths);
            if self.is_near {
                for ((out, &ray_x), &z) in readings {
                    *out = origin.wrapping_add(round_to_i32((slope * ray_x + base) * z));
                }
            } else {
                for ((out, &ray_x), &z) in readings {
                    *out = origin.wrapping_add(round_far((slope * ray_x + base) * z));
                }
            }
        }
        for (out, &z) in row.weight.iter_mut().zip(depths) {
            *out = self.weighting.weight(z);
        }
        if let Some(mask) = static_mask {
            mask.overwrite_outside(v, &mut row.weight, 0);
        }
    }

    /// Fills `row` with the points of a scan, sensor frame. A point's distance from the sensor counts as its
    /// depth; points that are not finite or out of range get weight 0.
    pub(crate) fn fill_points(&self, row: &mut PixelRow, points: &[Point]) {
        let [right, down, forward] = self.columns;
        for (axis, out) in [&mut row.x, &mut row.y, &mut row.z].into_iter().enumerate() {
            let origin = self.origin[axis];
            out.clear();
            let place = |[x, y, z]: &Point| right[axis] * x + down[axis] * y + forward[axis] * z;
            if self.is_near {
                out.extend(points.iter().map(|point| origin.wrapping_add(round_to_i32(place(point)))));
            } else {
                out.extend(points.iter().map(|point| origin.wrapping_add(round_far(place(point)))));
            }
        }
        row.set_colors(None, points.len());
        row.weight.clear();
        row.weight.extend(points.iter().map(|&point| self.weighting.weight(range(point))));
    }
}

/// Distance of a point from the sensor.
#[inline]
pub(crate) fn range([x, y, z]: Point) -> f32 {
    (x * x + y * y + z * z).sqrt()
}

/// Longest ray of the image at depth 1: the one through the corner farthest from the principal point.
pub(crate) fn ray_length(camera: &PinholeCamera) -> f64 {
    let farthest = |size: usize, centre: f64, focal: f64| {
        ((0.0 - centre) / focal).abs().max(((size as f64 - 1.0 - centre) / focal).abs())
    };
    let x = farthest(camera.width(), camera.cx(), camera.fx());
    let y = farthest(camera.height(), camera.cy(), camera.fy());
    (x * x + y * y + 1.0).sqrt()
}
