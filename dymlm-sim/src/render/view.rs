use dymlm_core::PinholeCamera;
use parry3d::math::{Mat3, Pose3, Vec3};

use crate::scene::{Material, Part, Shape};

/// A part as the camera sees it: the rectangle of the image that it can cover, and the transform into its
/// frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) shape: Shape,
    pub(super) material: &'a Material,
    pub(super) index: u16,
    /// Rotates directions from the camera's frame into the part's.
    pub(super) part_from_camera: Mat3,
    /// The camera's position in the part's frame.
    pub(super) eye: Vec3,
    /// Directions to the lamps in the part's frame; their lengths are the lamps' brightness.
    pub(super) lamps: [Vec3; 2],
    /// Columns and rows outside of which no ray meets the part, half-open.
    pub(super) columns: [usize; 2],
    pub(super) rows: [usize; 2],
    /// Lower bound of the depths of hits, metres; for a room a huge value, so that it is tested last.
    pub(super) nearest: f32,
}

/// Depth of the plane at which bodies are cut off before they are projected, metres.
const NEAR: f32 = 0.02;

/// Directions to the two lamps in the scene's frame, and their brightness.
const LAMPS: [(Vec3, f32); 2] = [(Vec3::new(0.30, -0.45, 0.84), 0.45), (Vec3::new(-0.80, -0.30, 0.52), 0.18)];

impl<'a> View<'a> {
    /// `None` when the part cannot be in the image.
    pub(super) fn new(
        part: &'a Part,
        index: u16,
        camera: &PinholeCamera,
        camera_from_scene: &Pose3,
    ) -> Option<Self> {
        if part.shape.half_extents() == Vec3::ZERO {
            return None;
        }
        let camera_from_part = *camera_from_scene * part.scene_from_part;
        let corners = corners(part.shape.half_extents()).map(|corner| camera_from_part * corner);
        let nearest = match part.shape {
            // The room is behind everything else: it is tested last, and only where nothing else was hit.
            Shape::Interior(_) => 0.5 * f32::MAX,
            _ => corners.iter().map(|corner| corner.z).fold(f32::INFINITY, f32::min),
        };
        let (columns, rows) = image_bounds(&corners, camera)?;
        let part_from_camera = camera_from_part.inverse();
        Some(Self {
            shape: part.shape,
            material: &part.material,
            index,
            lamps: LAMPS
                .map(|(direction, power)| part.scene_from_part.rotation.inverse() * direction * power),
            part_from_camera: Mat3::from_quat(part_from_camera.rotation),
            eye: part_from_camera.translation,
            columns,
            rows,
            nearest,
        })
    }

    /// Whether rays through a rectangle of the image can hit the part.
    pub(super) fn overlaps(&self, columns: [usize; 2], rows: [usize; 2]) -> bool {
        self.columns[0] < columns[1]
            && columns[0] < self.columns[1]
            && self.rows[0] < rows[1]
            && rows[0] < self.rows[1]
    }
}

fn corners(half: Vec3) -> [Vec3; 8] {
    std::array::from_fn(|k| {
        let side = |bit: usize| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
        half * Vec3::new(side(0), side(1), side(2))
    })
}

/// Columns and rows that the box with the given corners can cover: the image bounds of what is before the
/// near plane.
fn image_bounds(corners: &[Vec3; 8], camera: &PinholeCamera) -> Option<([usize; 2], [usize; 2])> {
    let mut low = [f32::INFINITY; 2];
    let mut high = [f32::NEG_INFINITY; 2];
    let mut include = |point: Vec3| {
        let u = camera.fx() as f32 * point.x / point.z + camera.cx() as f32;
        let v = camera.fy() as f32 * point.y / point.z + camera.cy() as f32;
        low = [low[0].min(u), low[1].min(v)];
        high = [high[0].max(u), high[1].max(v)];
    };
    for (k, &corner) in corners.iter().enumerate() {
        if corner.z >= NEAR {
            include(corner);
        }
        // An edge that crosses the near plane is cut there.
        for bit in 0..3 {
            let other = corners[k ^ (1 << bit)];
            if corner.z < NEAR && other.z > NEAR {
                include(corner.lerp(other, (NEAR - corner.z) / (other.z - corner.z)));
            }
        }
    }
    let span = |low: f32, high: f32, count: usize| {
        // Half a pixel is added on both sides, against rounding.
        let first = (low - 0.5).ceil().max(0.0) as usize;
        let end = ((high + 0.5).floor().max(-1.0) + 1.0) as usize;
        let end = end.min(count);
        (first < end).then_some([first, end])
    };
    Some((span(low[0], high[0], camera.width())?, span(low[1], high[1], camera.height())?))
}
