use dymlm::ObjectMap;
use dymlm::core::{Frame, PinholeCamera, PointCloud, Pose, Rgb};
use dymlm::files::id_color;
use dymlm::geometry::OrientedBox;
use dymlm::objects::{DualQuadric, ObjectShape, ShapeKind};

use crate::{Orthographic, Picture};

/// Pairs of corners that share an edge; the bits of a corner's number are the signs of its coordinates.
const EDGES: [(usize, usize); 12] =
    [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)];
/// Number of points that are drawn along an edge or outline.
const STEPS: usize = 200;

/// Draws the objects of a map on a frame: the edges of boxes, the outlines of ellipsoids.
pub fn objects_from_camera(objects: &ObjectMap, frame: &Frame, world_from_camera: &Pose) -> Picture {
    let camera = frame.camera();
    let (width, height) = (camera.width(), camera.height());
    let pixels = frame.color().map_or_else(|| vec![[128; 3]; width * height], |color| color.data().to_vec());
    let mut picture = Picture { name: "objects_camera.png", width, height, pixels };
    for object in objects.objects() {
        draw_object(&mut picture, &object.shape(), camera, world_from_camera, id_color(object.id().get()));
    }
    picture
}

/// Draws a box's edges or an ellipsoid's outline, two pixels wide, into a camera's image.
pub fn draw_object(
    picture: &mut Picture,
    shape: &ObjectShape,
    camera: &PinholeCamera,
    world_from_camera: &Pose,
    color: Rgb,
) {
    for [u, v] in outline(shape, camera, world_from_camera) {
        for (du, dv) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            picture.set(u.round() as i64 + du, v.round() as i64 + dv, color);
        }
    }
}

/// Points of the image along a shape's edges or outline.
fn outline(shape: &ObjectShape, camera: &PinholeCamera, world_from_camera: &Pose) -> Vec<[f64; 2]> {
    match shape.kind() {
        ShapeKind::Ellipsoid => DualQuadric::new(&shape.oriented_box())
            .project(camera, world_from_camera)
            .map(|ellipse| ellipse.outline(STEPS).collect())
            .unwrap_or_default(),
        ShapeKind::Cuboid => {
            let camera_from_world = world_from_camera.inverse();
            let points = edge_points(&shape.oriented_box());
            points.filter_map(|point| camera.project(camera_from_world.transform_point(point))).collect()
        }
    }
}

/// The cloud from above in grey, with the objects' boxes on top.
pub fn objects_from_above(objects: &ObjectMap, cloud: &PointCloud, up: [f64; 3]) -> Picture {
    let height = |point: [f64; 3]| up[0] * point[0] + up[1] * point[1] + up[2] * point[2];
    let points: Vec<[f64; 3]> = cloud.points().iter().map(|point| point.map(f64::from)).collect();
    let mut heights: Vec<f64> = points.iter().map(|&point| height(point)).collect();
    heights.sort_unstable_by(f64::total_cmp);
    let ceiling = heights.get(heights.len() * 9 / 10).copied().unwrap_or(f64::INFINITY);

    let level = crate::any_level_direction(up);
    let mut view = Orthographic::onto(up.map(|c| -c), level, points.iter().copied());
    for (index, &point) in points.iter().enumerate().filter(|&(_, &point)| height(point) <= ceiling) {
        let color = cloud.colors().and_then(|colors| colors.get(index)).copied().unwrap_or([128; 3]);
        view.draw(point, 0.01, color.map(|c: u8| 128 + c / 2));
    }
    // The boxes are lifted above all points, so that nothing occludes them.
    for object in objects.objects() {
        for point in edge_points(&object.oriented_box()) {
            view.draw(
                std::array::from_fn(|axis| point[axis] + 10.0 * up[axis]),
                0.015,
                id_color(object.id().get()),
            );
        }
    }
    let (width, height) = (view.width(), view.height());
    Picture { name: "objects_above.png", width, height, pixels: view.into_pixels() }
}

fn edge_points(oriented_box: &OrientedBox) -> impl Iterator<Item = [f64; 3]> + use<> {
    let corners = oriented_box.corners();
    EDGES.into_iter().flat_map(move |(a, b)| {
        (0..=STEPS).map(move |step| {
            let along = step as f64 / STEPS as f64;
            std::array::from_fn(|axis| corners[a][axis] + along * (corners[b][axis] - corners[a][axis]))
        })
    })
}
