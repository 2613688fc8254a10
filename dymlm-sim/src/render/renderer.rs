use std::ops::Range;

use dymlm_core::{PinholeCamera, Rgb};
use parry3d::math::{Pose3, Vec3};
use parry3d::query::Ray;
#[cfg(feature = "parallel")]
use rayon::prelude::*;

use super::shader::{Shader, TILE};
use super::view::View;
use crate::scene::Part;

/// What the rays through the pixels' centres hit, row by row.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rendering {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Exact depth along the optical axis, metres; 0 where the ray hits nothing.
    pub(crate) depth: Vec<f32>,
    /// Cosine of the angle between ray and surface normal.
    pub(crate) incidence: Vec<f32>,
    /// Index of the part, or [`NOTHING`].
    pub(crate) part: Vec<u16>,
    pub(crate) color: Vec<Rgb>,
}

/// The part index of a pixel that shows nothing.
pub(crate) const NOTHING: u16 = u16::MAX;

/// Casts one ray a pixel at the parts.
///
/// Each part is bounded by a rectangle of the image and by its nearest depth. The rays of a tile test only
/// the parts whose rectangles overlap the tile, nearest first, until all other parts are behind the hit:
/// O(pixels x parts that overlap the pixel).
pub(crate) fn render(
    camera: &PinholeCamera,
    scene_from_camera: &Pose3,
    parts: &[Part],
    rendering: &mut Rendering,
) {
    rendering.clear(camera.width(), camera.height());

    let camera_from_scene = scene_from_camera.inverse();
    let mut views: Vec<View<'_>> = parts
        .iter()
        .zip(0..NOTHING)
        .filter_map(|(part, index)| View::new(part, index, camera, &camera_from_scene))
        .collect();
    views.sort_by(|a, b| a.nearest.total_cmp(&b.nearest));

    let bands = bands(rendering);
    #[cfg(feature = "parallel")]
    bands.into_par_iter().for_each(|band| render_band(band, camera, &views));
    #[cfg(not(feature = "parallel"))]
    for band in bands {
        render_band(band, camera, &views);
    }
}

impl Rendering {
    /// Sets the size of all images and empties them.
    fn clear(&mut self, width: usize, height: usize) {
        fn refill<T: Copy>(values: &mut Vec<T>, pixels: usize, value: T) {
            values.clear();
            values.resize(pixels, value);
        }
        let pixels = width * height;
        (self.width, self.height) = (width, height);
        refill(&mut self.depth, pixels, 0.0);
        refill(&mut self.incidence, pixels, 0.0);
        refill(&mut self.part, pixels, NOTHING);
        refill(&mut self.color, pixels, [0; 3]);
    }
}

/// Some rows of a rendering, filled independently of the other rows.
struct Band<'a> {
    first_row: usize,
    width: usize,
    depth: &'a mut [f32],
    incidence: &'a mut [f32],
    part: &'a mut [u16],
    color: &'a mut [Rgb],
}

fn bands(rendering: &mut Rendering) -> Vec<Band<'_>> {
    let width = rendering.width;
    let size = width * TILE[1];
    let planes = rendering
        .depth
        .chunks_mut(size)
        .zip(rendering.incidence.chunks_mut(size))
        .zip(rendering.part.chunks_mut(size))
        .zip(rendering.color.chunks_mut(size));
    planes
        .enumerate()
        .map(|(k, (((depth, incidence), part), color))| Band {
            first_row: k * TILE[1],
            width,
            depth,
            incidence,
            part,
            color,
        })
        .collect()
}

fn render_band(mut band: Band<'_>, camera: &PinholeCamera, views: &[View<'_>]) {
    let rows = [band.first_row, band.first_row + band.depth.len() / band.width];
    let ray_x: Vec<f32> = (0..band.width).map(|u| ((u as f64 - camera.cx()) / camera.fx()) as f32).collect();
    let mut in_tile: Vec<&View<'_>> = Vec::with_capacity(views.len());
    let mut candidates = Vec::with_capacity(views.len());
    let mut shader = Shader::default();
    for first_column in (0..band.width).step_by(TILE[0]) {
        let columns = [first_column, (first_column + TILE[0]).min(band.width)];
        in_tile.clear();
        in_tile.extend(views.iter().filter(|view| view.overlaps(columns, rows)));
        for v in rows[0]..rows[1] {
            candidates.clear();
            candidates.extend(in_tile.iter().filter(|view| (view.rows[0]..view.rows[1]).contains(&v)));
            let y = ((v as f64 - camera.cy()) / camera.fy()) as f32;
            let first_pixel = (v - rows[0]) * band.width + columns[0];
            let mut row = band.row(first_pixel..first_pixel + columns[1] - columns[0]);
            let rays = Rays { first_column, x: &ray_x[columns[0]..columns[1]], y };
            render_row(&mut row, &rays, &candidates, &mut shader);
        }
    }
}

impl Band<'_> {
    /// Some neighbouring pixels of a row.
    fn row(&mut self, pixels: Range<usize>) -> Row<'_> {
        Row {
            depth: &mut self.depth[pixels.clone()],
            incidence: &mut self.incidence[pixels.clone()],
            part: &mut self.part[pixels.clone()],
            color: &mut self.color[pixels],
        }
    }
}

/// The pixels of a row that belong to one tile, to be filled.
struct Row<'a> {
    depth: &'a mut [f32],
    incidence: &'a mut [f32],
    part: &'a mut [u16],
    color: &'a mut [Rgb],
}

/// Casts the rays, then shades neighbours that see the same part together.
fn render_row(row: &mut Row<'_>, rays: &Rays<'_>, candidates: &[&View<'_>], shader: &mut Shader) {
    let mut seen: [Option<&View<'_>>; TILE[0]] = [None; TILE[0]];
    for (k, (seen, depth)) in seen.iter_mut().zip(row.depth.iter_mut()).enumerate() {
        if let Some((view, hit)) = cast(rays, k, candidates) {
            (*seen, *depth) = (Some(view), hit);
        }
    }
    let mut end = 0;
    for run in seen[..row.depth.len()].chunk_by(|a, b| a.map(|view| view.index) == b.map(|view| view.index)) {
        let pixels = end..end + run.len();
        end = pixels.end;
        let Some(&Some(view)) = run.first() else { continue };
        row.part[pixels.clone()].fill(view.index);
        shader.shade(
            view,
            &rays.x[pixels.clone()],
            rays.y,
            &row.depth[pixels.clone()],
            &mut row.incidence[pixels.clone()],
            &mut row.color[pixels],
        );
    }
}

/// The first hit of the `k`-th ray and its depth; `candidates` are the views that overlap the row, nearest
/// first. The ray's direction has z = 1, so that the parameter of a hit is its depth.
#[inline]
fn cast<'a>(rays: &Rays<'_>, k: usize, candidates: &[&'a View<'a>]) -> Option<(&'a View<'a>, f32)> {
    let u = rays.first_column + k;
    let ray = Vec3::new(rays.x[k], rays.y, 1.0);
    let mut hit: Option<&View<'_>> = None;
    let mut depth = f32::MAX;
    for &view in candidates {
        if view.nearest >= depth {
            break;
        }
        if !(view.columns[0]..view.columns[1]).contains(&u) {
            continue;
        }
        let local = Ray::new(view.eye, view.part_from_camera * ray);
        if let Some(t) = view.shape.cast(&local, depth).filter(|&t| t < depth) {
            (hit, depth) = (Some(view), t);
        }
    }
    hit.map(|view| (view, depth))
}

/// Rays through neighbouring pixels of a row: directions (x, y, 1) in the camera's frame.
struct Rays<'a> {
    first_column: usize,
    x: &'a [f32],
    y: f32,
}
