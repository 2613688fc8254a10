use dymlm_core::{BoundingBox, PinholeCamera, Pose};
use dymlm_geometry::OrientedBox;

use super::DualQuadric;
use crate::ShapeKind;

/// A box, or the ellipsoid inscribed in it.
///
/// ```
/// use dymlm_core::{PinholeCamera, Pose};
/// use dymlm_geometry::OrientedBox;
/// use dymlm_objects::{ObjectShape, ShapeKind};
///
/// let camera = PinholeCamera::new(640, 480, 500.0, 500.0, 320.0, 240.0)?;
/// let place = OrientedBox::new(Pose::new([0.0, 0.0, 2.0], [0.0, 0.0, 0.0, 1.0])?, [0.4, 0.4, 0.2])?;
/// let image_box = ObjectShape::new(ShapeKind::Cuboid, place).image_box(&camera, &Pose::identity());
/// // The front side, at a depth of 1.9 m, occludes the rest.
/// assert!((image_box.ok_or("in view")?.width() - 500.0 * 0.4 / 1.9).abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ObjectShape {
    kind: ShapeKind,
    oriented_box: OrientedBox,
}

/// Depth below which a box is cut off before it is projected, metres.
const NEAR: f64 = 0.05;

impl ObjectShape {
    /// A shape that fills a box.
    pub fn new(kind: ShapeKind, oriented_box: OrientedBox) -> Self {
        Self { kind, oriented_box }
    }

    /// Box or ellipsoid.
    pub fn kind(&self) -> ShapeKind {
        self.kind
    }

    /// The box around it.
    pub fn oriented_box(&self) -> OrientedBox {
        self.oriented_box
    }

    /// The smallest box in the image around the shape, not clipped to the image; `None` when nothing of the
    /// shape is in front of the camera. Only the part of a box in front of the camera counts; an ellipsoid
    /// that reaches behind the camera is replaced by its box.
    pub fn image_box(&self, camera: &PinholeCamera, world_from_camera: &Pose) -> Option<BoundingBox> {
        let ellipse = match self.kind {
            ShapeKind::Cuboid => None,
            ShapeKind::Ellipsoid => DualQuadric::new(&self.oriented_box).project(camera, world_from_camera),
        };
        match ellipse {
            Some(ellipse) => ellipse.bounding_box(),
            None => box_in_image(&self.oriented_box, camera, world_from_camera),
        }
    }
}

/// Bounds of the projection of the part of a box beyond the near plane.
fn box_in_image(own: &OrientedBox, camera: &PinholeCamera, world_from_camera: &Pose) -> Option<BoundingBox> {
    let camera_from_box = world_from_camera.inverse() * own.world_from_box();
    let in_camera = OrientedBox::new(camera_from_box, own.lengths()).ok()?;
    let corners = in_camera.corners();
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let mut include = |corner: [f64; 3]| {
        if let Some(pixel) = camera.project(corner) {
            for axis in 0..2 {
                low[axis] = low[axis].min(pixel[axis]);
                high[axis] = high[axis].max(pixel[axis]);
            }
        }
    };
    for (k, &corner) in corners.iter().enumerate() {
        if corner[2] >= NEAR {
            include(corner);
        }
        for other in [k ^ 1, k ^ 2, k ^ 4] {
            let other = corners[other];
            if corner[2] >= NEAR && other[2] < NEAR {
                let share = (corner[2] - NEAR) / (corner[2] - other[2]);
                include([0, 1, 2].map(|axis| corner[axis] + share * (other[axis] - corner[axis])));
            }
        }
    }
    let [low, high] = [low, high].map(|side| side.map(|c| c as f32));
    BoundingBox::new(low[0], low[1], high[0], high[1]).ok()
}
