use dymlm_core::{BoundingBox, DepthImage, PinholeCamera, Pose};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::ObjectModel;
use crate::flow::{AlignmentLimits, Template};
use crate::{CornerDetector, GrayImage, ImagePyramid, Lighting};

/// Rim of the image kept around the object's box, pixels.
const RIM: f32 = 24.0;
/// Halvings kept of a cut-out, for finding the object again.
const HALVINGS: usize = 3;
/// A point's surface must face the camera by this cosine to be measured.
const LEAST_COSINE: f64 = 0.18;
/// How far a window may be found from where it was expected, pixels.
const LARGEST_SHIFT: f32 = 7.0;
/// Least texture of a window.
const LEAST_EIGENVALUE: f32 = 4e-6;
/// Readings for a point's plane: a grid of this many steps to each side, this many pixels apart.
const PLANE_STEPS: isize = 2;
const PLANE_STEP: isize = 2;

/// The object as one frame showed it: a cut-out of the image, and points on its surface.
///
/// Later frames are compared with it, not with the frame before, so errors do not add up.
#[derive(Debug, Clone)]
pub(super) struct View {
    pub(super) camera_from_object: Pose,
    pub(super) pyramid: ImagePyramid,
    pub(super) points: Vec<ViewPoint>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ViewPoint {
    /// Place and unit normal, object frame.
    pub(super) position: [f64; 3],
    normal: [f64; 3],
    /// In the cut-out, pixels.
    pub(super) pixel: [f32; 2],
}

/// A point of the object found in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sighting {
    pub(super) position: [f64; 3],
    pub(super) pixel: [f32; 2],
}

/// What is needed of a frame.
#[derive(Clone, Copy)]
pub(super) struct Sight<'a> {
    pub(super) camera: &'a PinholeCamera,
    pub(super) image: &'a GrayImage,
    pub(super) depth: &'a DepthImage,
}

impl View {
    /// Finds corners on the object in a frame in which its pose is known; `None` when there are none.
    pub(super) fn take(
        sight: Sight<'_>,
        model: &ObjectModel,
        camera_from_object: &Pose,
        detector: &mut CornerDetector,
        margin: f64,
    ) -> Option<Self> {
        let region = projected_bounds(model, sight.camera, camera_from_object)?;
        let object_from_camera = camera_from_object.inverse();
        let Sight { camera, image, depth } = sight;
        let projections = project_facing(model, camera, camera_from_object);
        let on_object = |u: usize, v: usize| {
            let reading = depth.at(u, v);
            if reading <= 0.0 {
                return nearest_projection(&projections, [u as f64, v as f64]).is_some();
            }
            let place = camera.back_project([u as f64, v as f64], reading.into());
            model.contains(object_from_camera.transform_point(place), margin)
        };
        let mut corners = Vec::new();
        detector.detect_into(image, region, on_object, &[], &mut corners);

        let (cut_out, offset) = cut_out(image, region)?;
        let mut points = Vec::with_capacity(corners.len());
        for corner in &corners {
            let pixel = corner.point.map(f64::from);
            let surface = plane_of_readings(camera, depth, pixel).map(|(place, normal)| {
                (object_from_camera.transform_point(place), object_from_camera.rotate(normal))
            });
            let on_model = || {
                let nearest = nearest_projection(&projections, pixel)?;
                let (place, normal) = (nearest.place, camera_from_object.rotate(nearest.normal));
                let hit = meet_plane(camera, pixel, place, normal)?;
                Some((object_from_camera.transform_point(hit), nearest.normal))
            };
            let reading = depth.at(pixel[0].round() as usize, pixel[1].round() as usize);
            let found = if reading > 0.0 { surface } else { on_model() };
            if let Some((position, normal)) = found.filter(|(p, _)| model.contains(*p, 2.0 * margin)) {
                let pixel = [corner.point[0] - offset[0], corner.point[1] - offset[1]];
                points.push(ViewPoint { position, normal, pixel });
            }
        }
        let pyramid = ImagePyramid::new(&cut_out, HALVINGS);
        (!points.is_empty()).then_some(Self { camera_from_object: *camera_from_object, pyramid, points })
    }

    /// The angle between the directions from which this view and a pose see the object, radians.
    pub(super) fn angle_to(&self, camera_from_object: &Pose) -> f64 {
        let direction = |pose: &Pose| Vector3::from(pose.inverse().translation()).normalize();
        direction(&self.camera_from_object).angle(&direction(camera_from_object))
    }

    /// Finds one of its points in an image, near where it should be at a pose.
    pub(super) fn sight(
        &self,
        point: &ViewPoint,
        sight: Sight<'_>,
        camera_from_object: &Pose,
        template: &mut Template,
        radius: usize,
        min_correlation: f32,
    ) -> Option<Sighting> {
        let expected = sight.camera.project(camera_from_object.transform_point(point.position))?;
        if !sight.camera.sees(expected) {
            return None;
        }
        let warp = self.warp(point, sight.camera, camera_from_object)?;
        // One level down where the view shows the surface much larger.
        let (level, scale) = if warp.determinant().abs() > 2.5 { (1, 0.5) } else { (0, 1.0) };
        let source = self.pyramid.levels().get(level)?;
        let rows = [[warp[(0, 0)], warp[(0, 1)]], [warp[(1, 0)], warp[(1, 1)]]];
        let rows = rows.map(|row| row.map(|x| x as f32 * scale));
        template.take_warped(source, point.pixel.map(|c| c * scale), rows, radius);
        if template.min_eigenvalue() < LEAST_EIGENVALUE {
            return None;
        }
        let expected = expected.map(|c| c as f32);
        let limits = AlignmentLimits { iterations: 15, epsilon: 0.02, lighting: Lighting::Affine };
        let found = template.align(sight.image, expected, limits)?;
        let shift = (found.point[0] - expected[0]).hypot(found.point[1] - expected[1]);
        (shift <= LARGEST_SHIFT && found.correlation >= min_correlation)
            .then_some(Sighting { position: point.position, pixel: found.point })
    }

    /// From pixels about the point in an image to pixels about it in this view, to first order; `None` where either sees
    /// the surface too obliquely or too small.
    fn warp(&self, point: &ViewPoint, camera: &PinholeCamera, pose: &Pose) -> Option<Matrix2<f64>> {
        let here = surface_jacobian(camera, pose, point)?;
        let there = surface_jacobian(camera, &self.camera_from_object, point)?;
        let warp = there * here.try_inverse()?;
        (0.08..=12.0).contains(&warp.determinant()).then_some(warp)
    }
}

/// How pixels move with a point on its surface: the derivative by two tangents. `None` when it does not face the camera.
fn surface_jacobian(camera: &PinholeCamera, pose: &Pose, point: &ViewPoint) -> Option<Matrix2<f64>> {
    let place = Vector3::from(pose.transform_point(point.position));
    let normal = Vector3::from(pose.rotate(point.normal));
    if -normal.dot(&place) < LEAST_COSINE * place.norm() || place.z <= 0.0 {
        return None;
    }
    let normal = Vector3::from(point.normal);
    let axis = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let first = normal.cross(&axis).normalize();
    let second = normal.cross(&first);
    let columns = [first, second].map(|tangent| {
        let d = Vector3::from(pose.rotate(tangent.into()));
        let inverse = 1.0 / place.z;
        Vector2::new(
            camera.fx() * (d.x - place.x * inverse * d.z) * inverse,
            camera.fy() * (d.y - place.y * inverse * d.z) * inverse,
        )
    });
    Some(Matrix2::from_columns(&columns))
}

/// The smallest box around the model's projected corners; `None` when one of them lies behind the camera.
pub(super) fn projected_bounds(
    model: &ObjectModel,
    camera: &PinholeCamera,
    camera_from_object: &Pose,
) -> Option<BoundingBox> {
    let mut sides = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for corner in model.corners() {
        let [u, v] = camera.project(camera_from_object.transform_point(corner))?;
        sides = [sides[0].min(u), sides[1].min(v), sides[2].max(u), sides[3].max(v)];
    }
    // Half a pixel and more, so that pixels at the rim belong to it.
    let [x_min, y_min, x_max, y_max] = sides.map(|side| side as f32);
    BoundingBox::new(x_min, y_min, x_max + 1.0, y_max + 1.0).ok()
}

fn cut_out(image: &GrayImage, region: BoundingBox) -> Option<(GrayImage, [f32; 2])> {
    let wider = BoundingBox::new(
        region.x_min() - RIM,
        region.y_min() - RIM,
        region.x_max() + RIM,
        region.y_max() + RIM,
    )
    .ok()?;
    let (columns, rows) = (wider.columns(image.width()), wider.rows(image.height()));
    let data =
        rows.clone().flat_map(|v| image.clamped_row(v as isize).get(columns.clone()).unwrap_or(&[])).copied();
    let cut = GrayImage::new(columns.len(), rows.len(), data.collect()).ok()?;
    Some((cut, [columns.start as f32, rows.start as f32]))
}

/// A model point that faces the camera.
struct Projection {
    pixel: [f64; 2],
    place: [f64; 3],
    normal: [f64; 3],
}

fn project_facing(model: &ObjectModel, camera: &PinholeCamera, camera_from_object: &Pose) -> Vec<Projection> {
    let facing = model.facing(camera_from_object, 0.15);
    facing
        .filter_map(|(point, place)| {
            Some(Projection { pixel: camera.project(place)?, place, normal: point.normal })
        })
        .collect()
}

/// The model point seen nearest to a pixel, if one is near.
fn nearest_projection(projections: &[Projection], [u, v]: [f64; 2]) -> Option<&Projection> {
    let squared = |p: &Projection| (p.pixel[0] - u).powi(2) + (p.pixel[1] - v).powi(2);
    let nearest = projections.iter().min_by(|a, b| squared(a).total_cmp(&squared(b)))?;
    (squared(nearest) <= 16.0).then_some(nearest)
}

/// Where a pixel's ray meets the plane through `place`.
fn meet_plane(
    camera: &PinholeCamera,
    pixel: [f64; 2],
    place: [f64; 3],
    normal: [f64; 3],
) -> Option<[f64; 3]> {
    let ray = Vector3::from(camera.back_project(pixel, 1.0));
    let normal = Vector3::from(normal);
    let slope = normal.dot(&ray);
    let depth = normal.dot(&Vector3::from(place)) / slope;
    (depth.is_finite() && depth > 0.0).then(|| (ray * depth).into())
}

/// Place and normal (towards the camera) of the surface at a pixel, from the plane through the readings about it: less
/// noisy than its own reading. `None` at edges.
fn plane_of_readings(
    camera: &PinholeCamera,
    depth: &DepthImage,
    pixel: [f64; 2],
) -> Option<([f64; 3], [f64; 3])> {
    let [u, v] = pixel.map(|c| c.round() as isize);
    let at = |u: isize, v: isize| {
        let (u, v) = (usize::try_from(u).ok()?, usize::try_from(v).ok()?);
        let reading = depth.at(u, v);
        (reading > 0.0).then(|| Vector3::from(camera.back_project([u as f64, v as f64], reading.into())))
    };
    let middle = at(u, v)?;
    let near = 0.02 + 0.015 * middle.z;
    let offsets = -PLANE_STEPS..=PLANE_STEPS;
    let readings: Vec<Vector3<f64>> = offsets
        .clone()
        .flat_map(|dv| offsets.clone().map(move |du| (du, dv)))
        .filter_map(|(du, dv)| at(u + PLANE_STEP * du, v + PLANE_STEP * dv))
        .filter(|p| (p.z - middle.z).abs() < near)
        .collect();
    if readings.len() < 13 {
        return None;
    }
    let mean = readings.iter().sum::<Vector3<f64>>() / readings.len() as f64;
    let spread: Matrix3<f64> = readings.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let normal = if normal.dot(&mean) > 0.0 { -normal } else { normal };
    let place = meet_plane(camera, pixel, mean.into(), normal.into())?;
    ((place[2] - middle.z).abs() < near).then(|| (place, normal.into()))
}
