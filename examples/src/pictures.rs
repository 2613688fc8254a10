use std::io::Write;

use dymlm::core::{DepthImage, Frame, PointCloud, Pose, Rgb};
use dymlm::files::{id_color, plane_cloud};
use dymlm::octree::CellState;
use dymlm::{Octree, PlaneMap};

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use crate::{AnyError, Orthographic};

/// A picture and the name of its file.
#[derive(Debug, Clone)]
pub struct Picture {
    /// File name.
    pub name: &'static str,
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Row by row.
    pub pixels: Vec<Rgb>,
}

impl Picture {
    fn new(name: &'static str, view: Orthographic) -> Self {
        Self { name, width: view.width(), height: view.height(), pixels: view.into_pixels() }
    }

    /// Colours a pixel; outside the picture nothing happens.
    pub fn set(&mut self, u: i64, v: i64, color: Rgb) {
        let (Ok(u), Ok(v)) = (usize::try_from(u), usize::try_from(v)) else { return };
        if u < self.width
            && let Some(pixel) = self.pixels.get_mut(v * self.width + u)
        {
            *pixel = color;
        }
    }

    /// Writes the picture as PNG.
    ///
    /// # Errors
    ///
    /// When writing fails.
    pub fn encode_png(&self, out: &mut dyn Write) -> Result<(), AnyError> {
        let bytes = self.pixels.as_flattened();
        PngEncoder::new(out).write_image(
            bytes,
            self.width as u32,
            self.height as u32,
            ExtendedColorType::Rgb8,
        )?;
        Ok(())
    }
}

/// Colour of points without one.
const GREY: Rgb = [110; 3];

/// The cloud from above, without its highest tenth, and from the side.
pub fn cloud_pictures(cloud: &PointCloud, up: [f64; 3], point_size: f64) -> Vec<Picture> {
    draw_cloud("cloud_above.png", "cloud_side.png", cloud, up, point_size)
}

fn draw_cloud(
    above: &'static str,
    side: &'static str,
    cloud: &PointCloud,
    up: [f64; 3],
    point_size: f64,
) -> Vec<Picture> {
    let points: Vec<[f64; 3]> = cloud.points().iter().map(|point| point.map(f64::from)).collect();
    let color = |index: usize| cloud.colors().and_then(|colors| colors.get(index)).copied().unwrap_or(GREY);
    draw_two_sides(above, side, &points, up, |view, keep| {
        for (index, &point) in points.iter().enumerate().filter(|(_, point)| keep(point)) {
            view.draw(point, point_size, color(index));
        }
    })
}

/// The occupied leaves of an octree from above and from the side, coloured by height.
pub fn octree_pictures(octree: &Octree, up: [f64; 3]) -> Vec<Picture> {
    let leaves: Vec<_> = octree.leaves().filter(|leaf| leaf.state == CellState::Occupied).collect();
    let centers: Vec<[f64; 3]> = leaves.iter().map(|leaf| leaf.center).collect();
    let heights: Vec<f64> = centers.iter().map(|&center| height(up, center)).collect();
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    draw_two_sides("octree_above.png", "octree_side.png", &centers, up, |view, keep| {
        for (leaf, &height) in leaves.iter().zip(&heights).filter(|(leaf, _)| keep(&leaf.center)) {
            view.draw(leaf.center, leaf.size, rainbow((height - low) / (high - low).max(1e-9)));
        }
    })
}

/// The planes of a map from above and from the side, one colour each.
pub fn plane_pictures(planes: &PlaneMap, up: [f64; 3]) -> Vec<Picture> {
    let cloud = plane_cloud(planes);
    draw_cloud("planes_above.png", "planes_side.png", &cloud, up, planes.config().voxel_size)
}

/// The planes of a map as a camera sees them, one colour each, over the camera's picture in grey.
pub fn planes_from_camera(planes: &PlaneMap, frame: &Frame, world_from_camera: &Pose) -> Picture {
    const FAR: f64 = 10.0;
    let camera = frame.camera();
    let (width, height) = (camera.width(), camera.height());
    let eye = world_from_camera.translation();
    let mut pixels = Vec::with_capacity(width * height);
    for v in 0..height {
        for u in 0..width {
            let color = frame.color().and_then(|color| color.at(u, v)).unwrap_or([128; 3]);
            let [r, g, b] = color.map(u32::from);
            let grey = (r + 2 * g + b) / 4;
            let ray = world_from_camera.rotate(camera.back_project([u as f64, v as f64], 1.0));
            let color = planes.cast_ray(eye, ray, FAR).map(|hit| id_color(hit.plane.get()));
            // Half the plane's colour and half the picture, so that things on the plane remain visible.
            pixels.push(
                color.map_or([grey as u8 / 2; 3], |color| {
                    color.map(|c| u32::midpoint(u32::from(c), grey) as u8)
                }),
            );
        }
    }
    Picture { name: "planes_camera.png", width, height, pixels }
}

/// Draws from above only what is below the highest tenth (a ceiling would occlude the room), and from the
/// side everything.
fn draw_two_sides(
    above: &'static str,
    side: &'static str,
    points: &[[f64; 3]],
    up: [f64; 3],
    draw: impl Fn(&mut Orthographic, &dyn Fn(&[f64; 3]) -> bool),
) -> Vec<Picture> {
    let mut heights: Vec<f64> = points.iter().map(|&point| height(up, point)).collect();
    heights.sort_unstable_by(f64::total_cmp);
    let ceiling = heights.get(heights.len() * 9 / 10).copied().unwrap_or(f64::INFINITY);
    let level = any_level_direction(up);
    let down = up.map(|c| -c);

    let mut from_above = Orthographic::onto(down, level, points.iter().copied());
    draw(&mut from_above, &|point| height(up, *point) <= ceiling);
    let mut from_side = Orthographic::onto(level, down, points.iter().copied());
    draw(&mut from_side, &|_| true);
    vec![Picture::new(above, from_above), Picture::new(side, from_side)]
}

fn height(up: [f64; 3], point: [f64; 3]) -> f64 {
    up[0] * point[0] + up[1] * point[1] + up[2] * point[2]
}

/// A direction at right angles to `up`: the most level of the world's axes, projected to be level.
pub(crate) fn any_level_direction(up: [f64; 3]) -> [f64; 3] {
    let axis = (0..3).min_by(|&a, &b| up[a].abs().total_cmp(&up[b].abs())).unwrap_or(0);
    std::array::from_fn(|c| f64::from(u8::from(c == axis)) - up[axis] * up[c])
}

/// Depth as colours: blue near, red far (5 m), black without a reading.
pub fn depth_colors(depth: &DepthImage) -> Vec<Rgb> {
    const FAR: f64 = 5.0;
    let color = |&z: &f32| if z > 0.0 { rainbow((f64::from(z) / FAR).min(1.0)) } else { [0; 3] };
    depth.data().iter().map(color).collect()
}

/// Blue for 0, through green, to red for 1.
fn rainbow(share: f64) -> Rgb {
    let ramp = |middle: f64| (((1.5 - (4.0 * (share - middle)).abs()).clamp(0.0, 1.0)) * 230.0) as u8;
    [ramp(0.75), ramp(0.5), ramp(0.25)]
}
