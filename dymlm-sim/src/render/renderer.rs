use dymlm_core::{PinholeCamera, Rgb};
use parry3d::math::{Pose3, Vec3};
use parry3d::query::Ray;
#[cfg(feature = "parallel")]
use rayon::prelude::*;

use super::view::View;
use crate::scene::Part;

/// What the rays through the pixels' centres meet, row by row.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rendering {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Exact depth along the optical axis, metres; 0 where there is nothing.
    pub(crate) depth: Vec<f32>,
    /// Cosine of the angle between ray and surface normal.
    pub(crate) incidence: Vec<f32>,
    /// Index of the part, or [`NOTHING`].
    pub(crate) part: Vec<u16>,
    pub(crate) color: Vec<Rgb>,
}

/// The part index of a pixel that shows nothing.
pub(crate) const NOTHING: u16 = u16::MAX;

/// Size of the tiles that share a list of parts, pixels.
const TILE: [usize; 2] = [32, 16];

/// Light that comes from all sides, beside the two lamps.
const AMBIENT: f32 = 0.48;

/// Casts one ray a pixel at the parts.
///
/// Each part is bounded by a rectangle of the image and by its nearest depth; a tile's rays ask only the parts whose
/// rectangles meet it, nearest first, until the rest lies behind the hit: O(pixels x parts that overlap there).
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
    /// Nothing anywhere.
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

/// Some rows of a rendering, to be filled independently of the others.
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
    let mut candidates = Vec::with_capacity(views.len());
    for first_column in (0..band.width).step_by(TILE[0]) {
        let columns = [first_column, (first_column + TILE[0]).min(band.width)];
        candidates.clear();
        candidates.extend(views.iter().filter(|view| view.overlaps(columns, rows)));
        for v in rows[0]..rows[1] {
            let y = ((v as f64 - camera.cy()) / camera.fy()) as f32;
            for (u, &x) in ray_x.iter().enumerate().take(columns[1]).skip(columns[0]) {
                let pixel = (v - rows[0]) * band.width + u;
                shade_pixel(&mut band, pixel, [u, v], Vec3::new(x, y, 1.0), &candidates);
            }
        }
    }
}

/// A ray direction with z = 1 makes the parameter of a hit its depth.
#[inline]
fn shade_pixel(band: &mut Band<'_>, pixel: usize, [u, v]: [usize; 2], ray: Vec3, candidates: &[&View<'_>]) {
    let mut hit: Option<&View<'_>> = None;
    let mut depth = f32::MAX;
    for &view in candidates {
        if view.nearest >= depth {
            break;
        }
        if !(view.columns[0]..view.columns[1]).contains(&u) || !(view.rows[0]..view.rows[1]).contains(&v) {
            continue;
        }
        let local = Ray::new(view.eye, view.part_from_camera * ray);
        if let Some(t) = view.shape.cast(&local, depth).filter(|&t| t < depth) {
            (hit, depth) = (Some(view), t);
        }
    }
    let Some(view) = hit else { return };

    let direction = view.part_from_camera * ray;
    let point = view.eye + direction * depth;
    let normal = view.shape.normal(point);
    band.depth[pixel] = depth;
    band.incidence[pixel] = (-normal.dot(direction) / ray.length()).clamp(0.0, 1.0);
    band.part[pixel] = view.index;
    band.color[pixel] = lit_color(view, point, normal);
}

/// The material's colour in the light of the room (Lambert).
#[inline]
fn lit_color(view: &View<'_>, point: Vec3, normal: Vec3) -> Rgb {
    let light = view.lamps.iter().fold(AMBIENT, |light, &lamp| light + normal.dot(lamp).max(0.0));
    view.material.color(point, normal, view.index.into()).map(|c| (c * light * 255.0).clamp(0.0, 255.0) as u8)
}
