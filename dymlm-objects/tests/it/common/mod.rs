//! Boxes on a table before a wall, seen exactly.
#![allow(clippy::unwrap_used, reason = "tests")]
#![allow(dead_code, reason = "each test uses a part")]

use dymlm_core::vector3::{cross, difference, unit};
use dymlm_core::{
    BoundingBox, DepthImage, Detection, Frame, Mask, PinholeCamera, Plane, PlaneId, Pose, SensorModel,
};
use dymlm_geometry::OrientedBox;
use dymlm_objects::{ObjectConfig, ObjectMapper, SupportPlane};
use dymlm_test_support::{Cuboid, Rectangle, World};

pub(crate) const TABLE: PlaneId = PlaneId::new(3);

pub(crate) fn mapper() -> ObjectMapper {
    ObjectMapper::new(ObjectConfig::default(), SensorModel::kinect()).unwrap()
}

/// World: z up, the table's top at z = 0, a wall at y = 1.5.
pub(crate) struct Scene {
    pub(crate) camera: PinholeCamera,
    pub(crate) boxes: Vec<OrientedBox>,
    /// Walls, floors, table tops.
    pub(crate) rectangles: Vec<Rectangle>,
}

pub(crate) fn upright(center: [f64; 3], yaw: f64, lengths: [f64; 3]) -> OrientedBox {
    let (sin, cos) = (0.5 * yaw).sin_cos();
    OrientedBox::new(Pose::new(center, [0.0, 0.0, sin, cos]).unwrap(), lengths).unwrap()
}

/// A camera at a place that looks at another, upright but for a roll about its axis.
pub(crate) fn looking_at(place: [f64; 3], target: [f64; 3], roll: f64) -> Pose {
    let forward = unit(difference(target, place)).unwrap();
    let right = unit(cross(forward, [0.0, 0.0, 1.0])).unwrap();
    let down = cross(forward, right);
    let (sin, cos) = roll.sin_cos();
    let turned = |a: f64, b: f64| [0, 1, 2].map(|k| a * right[k] + b * down[k]);
    let (x, y) = (turned(cos, sin), turned(-sin, cos));
    Pose::from_rotation_matrix([0, 1, 2].map(|k| [x[k], y[k], forward[k]]), place).unwrap()
}

/// A hand-held camera around a place.
pub(crate) fn near(place: [f64; 3], step: usize, target: [f64; 3]) -> Pose {
    let phase = 0.4 * step as f64;
    let place = [place[0] + 0.12 * phase.sin(), place[1], place[2] + 0.05 * phase.cos()];
    looking_at(place, target, 0.0)
}

/// A camera at a place that looks along y and down by an angle.
pub(crate) fn looking(place: [f64; 3], down: f64) -> Pose {
    let (sin, cos) = down.sin_cos();
    Pose::from_rotation_matrix([[1.0, 0.0, 0.0], [0.0, -sin, cos], [0.0, -cos, -sin]], place).unwrap()
}

pub(crate) fn planes(point: [f64; 3], reach: f64, found: &mut Vec<SupportPlane>) {
    if point[2].abs() <= reach && point[0].abs() < 0.8 && (-0.5..1.0).contains(&point[1]) {
        found.push(SupportPlane::new(TABLE, Plane::new([0.0, 0.0, 1.0], 0.0).unwrap()));
    }
    if (point[1] - 1.5).abs() <= reach {
        found.push(SupportPlane::new(PlaneId::new(8), Plane::new([0.0, -1.0, 0.0], 1.5).unwrap()));
    }
}

/// What a pixel shows: a box by its index, or nothing of the kind.
pub(crate) struct View {
    pub(crate) depth: Vec<f32>,
    pub(crate) shown: Vec<Option<usize>>,
}

impl Scene {
    pub(crate) fn new(boxes: Vec<OrientedBox>) -> Self {
        let table = Rectangle::level([0.0, 0.25, 0.0], 0.8, 0.75);
        Self::with_rectangles(boxes, vec![Rectangle::upright([0.0, 1.5, 0.0], 100.0, 100.0), table])
    }

    pub(crate) fn with_rectangles(boxes: Vec<OrientedBox>, rectangles: Vec<Rectangle>) -> Self {
        let camera = PinholeCamera::new(320, 240, 262.0, 262.0, 159.5, 119.5).unwrap();
        Self { camera, boxes, rectangles }
    }

    pub(crate) fn view(&self, world_from_camera: &Pose) -> View {
        let cuboid =
            |own: &OrientedBox| Cuboid { world_from_cuboid: own.world_from_box(), lengths: own.lengths() };
        let world = World {
            rectangles: self.rectangles.clone(),
            cuboids: self.boxes.iter().map(cuboid).collect(),
            ..World::default()
        };
        let hits = world.view(&self.camera, world_from_camera);
        View {
            depth: hits.iter().map(|hit| hit.map_or(0.0, |hit| hit.length as f32)).collect(),
            shown: hits.iter().map(|hit| hit.and_then(|hit| hit.cuboid)).collect(),
        }
    }

    pub(crate) fn frame(&self, time: f64, world_from_camera: &Pose) -> Frame {
        let (width, height) = (self.camera.width(), self.camera.height());
        let depth = DepthImage::new(width, height, self.view(world_from_camera).depth).unwrap();
        Frame::new(time, self.camera, depth, None).unwrap()
    }

    /// A frame, and detections of those of some things that it shows.
    pub(crate) fn detected(
        &self,
        time: f64,
        world_from_camera: &Pose,
        labels: &[(usize, &str)],
    ) -> (Frame, Vec<Detection>) {
        let view = self.view(world_from_camera);
        let found = |&(index, label): &(usize, &str)| {
            Some(Detection::new(label, 0.8, self.box_of(&view, index)?).unwrap())
        };
        let detections = labels.iter().filter_map(found).collect();
        let depth = DepthImage::new(self.camera.width(), self.camera.height(), view.depth).unwrap();
        (Frame::new(time, self.camera, depth, None).unwrap(), detections)
    }

    /// The box around the pixels that show a thing; `None` when none does.
    pub(crate) fn image_box(&self, world_from_camera: &Pose, index: usize) -> Option<BoundingBox> {
        self.box_of(&self.view(world_from_camera), index)
    }

    fn box_of(&self, view: &View, index: usize) -> Option<BoundingBox> {
        let width = self.camera.width();
        let shown =
            || view.shown.iter().enumerate().filter(|(_, own)| **own == Some(index)).map(|(pixel, _)| pixel);
        let (left, right) = (shown().map(|p| p % width).min()?, shown().map(|p| p % width).max()?);
        let (top, bottom) = (shown().map(|p| p / width).min()?, shown().map(|p| p / width).max()?);
        BoundingBox::new(left as f32, top as f32, (right + 1) as f32, (bottom + 1) as f32).ok()
    }

    pub(crate) fn detection(&self, world_from_camera: &Pose, index: usize, label: &str) -> Detection {
        Detection::new(label, 0.8, self.image_box(world_from_camera, index).unwrap()).unwrap()
    }

    /// Static where a thing is not shown.
    pub(crate) fn mask_without(&self, world_from_camera: &Pose, index: usize) -> Mask {
        let shown = self.view(world_from_camera).shown;
        let data = shown.iter().map(|own| *own != Some(index)).collect();
        Mask::new(self.camera.width(), self.camera.height(), data).unwrap()
    }
}
