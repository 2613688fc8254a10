use std::path::Path;

use dymlm::core::{Point, PointCloud, Rgb};
use dymlm_examples::{AnyError, Orthographic};
use dymlm_io::write_png;
use dymlm_metrics::SpaceTruth;
use dymlm_sim::{Sequence, Truth};

/// A cloud from above, with the residue of people in red.
pub(crate) struct Panel {
    width: usize,
    height: usize,
    pixels: Vec<Rgb>,
}

const RED: Rgb = [230, 0, 30];
/// A point farther than this from all static surfaces is residue or stray, as in
/// [`dymlm_metrics::score_cloud`], metres.
const OFF_SURFACE: f32 = 0.06;
/// Sides of the squares that points are drawn as, metres: residue is drawn larger, so that little of it can
/// be seen.
const POINT: f64 = 0.01;
const RESIDUE: f64 = 0.03;
/// Points higher above the floor are not drawn, since they occlude the room, metres.
const CEILING: f64 = 2.1;
/// Reduction of a panel: one pixel for this many pixels of the picture, along each side.
const REDUCTION: usize = 2;
/// White between panels, pixels.
const GAP: usize = 8;

impl Panel {
    /// Draws a cloud of a sequence.
    pub(crate) fn draw(cloud: &PointCloud, truth: &Truth, sequence: &Sequence) -> Self {
        let world_from_scene = sequence.config().world_from_scene;
        let scene_from_world = world_from_scene.inverse();
        let height = |point: Point| scene_from_world.transform_point(point.map(f64::from))[2];
        let seen = truth.visible_points().into_iter().filter(|&point| height(point) < CEILING);
        let (down, level) =
            (world_from_scene.rotate([0.0, 0.0, -1.0]), world_from_scene.rotate([0.0, -1.0, 0.0]));
        let mut view = Orthographic::onto(down, level, seen.map(|point| point.map(f64::from)));

        let colors = cloud.colors().unwrap_or_default();
        for (index, &point) in
            cloud.points().iter().enumerate().filter(|&(_, &point)| height(point) < CEILING)
        {
            draw_point(&mut view, point, colors.get(index), truth);
        }
        Self::reduced(&view)
    }

    fn reduced(view: &Orthographic) -> Self {
        let (width, height) = (view.width() / REDUCTION, view.height() / REDUCTION);
        let mut pixels = Vec::with_capacity(width * height);
        for v in 0..height {
            pixels.extend((0..width).map(|u| view.pixels()[v * REDUCTION * view.width() + u * REDUCTION]));
        }
        Self { width, height, pixels }
    }
}

/// Draws a point of a cloud in faded colour; residue of people is red.
pub(crate) fn draw_point(view: &mut Orthographic, point: Point, color: Option<&Rgb>, truth: &Truth) {
    let is_residue = truth.surface_distance(point) > OFF_SURFACE && truth.swept_by_movers(point);
    let faded = color.map_or([170; 3], |color| color.map(|c| 128 + c / 2));
    let (side, color) = if is_residue { (RESIDUE, RED) } else { (POINT, faded) };
    view.draw(point.map(f64::from), side, color);
}

/// Writes the panels of one sequence side by side: one column for each treatment, before late removal above,
/// after it below.
pub(crate) fn write(panels: &[Panel], sequence: &str, folder: &Path) -> Result<(), AnyError> {
    let Some(first) = panels.first() else { return Ok(()) };
    let columns = panels.len().div_ceil(2);
    let (width, height) = (columns * (first.width + GAP) - GAP, 2 * (first.height + GAP) - GAP);
    let mut pixels = vec![[255; 3]; width * height];
    for (index, panel) in panels.iter().enumerate() {
        let (left, top) = (index / 2 * (first.width + GAP), index % 2 * (first.height + GAP));
        for (v, row) in panel.pixels.chunks(panel.width.max(1)).enumerate() {
            let begin = (top + v) * width + left;
            pixels[begin..begin + row.len()].copy_from_slice(row);
        }
    }
    Ok(write_png(folder.join(format!("residue_{sequence}.png")), width, height, &pixels)?)
}
