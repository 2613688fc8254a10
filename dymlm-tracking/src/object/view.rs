use dymlm_core::Pose;
use dymlm_core::vector3::{difference, dot, unit};
use nalgebra::{Matrix2, Matrix6, Vector2, Vector3};

use super::cut_out::CutOut;
use super::model::ObjectModel;
use super::pixel_lengths::{HALVINGS, PixelLengths};
use super::scene::Scene;
use super::surface_point::SurfaceFinder;
use crate::flow::{AlignmentLimits, Template};
use crate::pose::pixel_motion;
use crate::{CornerDetector, ImagePyramid, Lighting};

/// Standard deviation of a tracked point in the image, pixels.
pub(super) const PIXEL_SIGMA: f64 = 0.5;
/// Least share of a window that shows the object. Without it, and without depth, an occluded book is off by
/// up to 15 cm instead of 9.
const LEAST_SHARE: f32 = 0.4;
/// Least correlation of two windows that show the same. Without it, an occluded book is taken for its
/// occluder: 38 cm off without depth.
const LEAST_CORRELATION: f32 = 0.6;

/// The object as one frame shows it: a cut-out of the image, and points on its surface.
///
/// Later frames are compared with views, not with the frame before, so that errors do not add up.
#[derive(Debug, Clone)]
pub(super) struct View {
    pub(super) camera_from_object: Pose,
    pyramid: ImagePyramid,
    /// 1 where the cut-out shows the object.
    masks: ImagePyramid,
    points: Vec<ViewPoint>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct ViewPoint {
    /// Position and unit normal, object frame.
    position: [f64; 3],
    normal: [f64; 3],
    /// Place in the cut-out, pixels.
    pixel: [f32; 2],
    /// Unit direction from the view's camera to the point, object frame: the position is uncertain along it.
    ray: [f64; 3],
    /// Variance of the position along the ray, square metres.
    variance: f64,
}

/// A point of the object found in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PointMatch {
    pub(super) position: [f64; 3],
    pub(super) pixel: [f32; 2],
    /// Factor on the standard deviation of a pixel.
    pub(super) blur: f64,
    /// Standard deviation of the pixel due to the uncertain position of the point, pixels.
    pub(super) spread: f64,
    /// Indices of the view and of its point.
    pub(super) source: [usize; 2],
}

impl View {
    /// Finds corners on the object in a frame where its pose is known, at pixels that `is_shown` accepts as
    /// not occluded; `None` when there are none.
    pub(super) fn take(
        scene: Scene<'_>,
        model: &ObjectModel,
        camera_from_object: &Pose,
        detector: &mut CornerDetector,
        lengths: &PixelLengths,
        model_sigma: f64,
        is_shown: impl Fn([f64; 2]) -> bool,
    ) -> Option<Self> {
        let Scene { camera, pyramid, depth, .. } = scene;
        let region = model.bounds_in_image(camera, camera_from_object)?;
        let object_from_camera = camera_from_object.inverse();
        let image = pyramid.base();
        let cut = CutOut::about(image, region, lengths.rim)?;
        let mask = cut.mask(model, camera, camera_from_object, |u, v| {
            // Excludes pixels whose depth is not the object's.
            let reading = depth.at(u, v);
            let place = camera.back_project([u as f64, v as f64], reading.into());
            reading <= 0.0 || model.contains(object_from_camera.transform_point(place), model_sigma)
        })?;
        let mut corners = Vec::new();
        let on_object = |u: usize, v: usize| {
            mask.at(u - cut.columns.start, v - cut.rows.start) > 0.0 && is_shown([u as f64, v as f64])
        };
        detector.detect_into(image, region, on_object, &mut corners);

        let surface = SurfaceFinder::new(scene, model, camera_from_object, lengths, model_sigma);
        let offset = [cut.columns.start as f32, cut.rows.start as f32];
        let point_at = |corner: [f32; 2]| {
            let found = surface.at(corner.map(f64::from))?;
            let position = object_from_camera.transform_point(found.place);
            Some(ViewPoint {
                position,
                normal: object_from_camera.rotate(found.normal),
                pixel: [corner[0] - offset[0], corner[1] - offset[1]],
                ray: unit(difference(position, object_from_camera.translation()))?,
                variance: found.sigma * found.sigma,
            })
        };
        let points: Vec<ViewPoint> = corners.iter().filter_map(|corner| point_at(corner.point)).collect();
        let [pyramid, masks] = [cut.pixels(image)?, mask].map(|image| ImagePyramid::new(&image, HALVINGS));
        (!points.is_empty()).then_some(Self {
            camera_from_object: *camera_from_object,
            pyramid,
            masks,
            points,
        })
    }

    /// Number of points.
    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// Positions of the points, object frame.
    pub(super) fn positions(&self) -> impl Iterator<Item = [f64; 3]> {
        self.points.iter().map(|point| point.position)
    }

    /// The angle between the directions from which this view and a pose see the object, radians.
    pub(super) fn angle_to(&self, camera_from_object: &Pose) -> f64 {
        let direction = |pose: &Pose| unit(pose.inverse().translation());
        match (direction(&self.camera_from_object), direction(camera_from_object)) {
            (Some(a), Some(b)) => dot(a, b).clamp(-1.0, 1.0).acos(),
            _ => std::f64::consts::PI,
        }
    }

    /// Corrects a point's position along its ray by the pixel where it was found at a pose of the given
    /// covariance. Without depth, the position was placed on the model's surface, which may not be the
    /// object's. From the view's own direction, a pixel says nothing about the position. `repeated` is a
    /// factor on the pixel's standard deviation, since errors of successive frames are correlated.
    pub(super) fn correct(
        &mut self,
        found: &PointMatch,
        scene: Scene<'_>,
        camera_from_object: &Pose,
        covariance: &[[f64; 6]; 6],
        repeated: f64,
    ) {
        let camera = scene.camera;
        let Some(point) = self.points.get_mut(found.source[1]) else { return };
        let Some([u, v]) = camera.project(camera_from_object.transform_point(point.position)) else { return };
        let motion = pixel_motion(camera, camera_from_object, point.position, point.ray);
        let [by_u, by_v] = motion.by_shift;
        let slope = by_u.hypot(by_v);
        if slope <= 0.0 {
            return;
        }
        // Measured along the line in the image on which the pixel moves with the point.
        let residual =
            (by_u * (f64::from(found.pixel[0]) - u) + by_v * (f64::from(found.pixel[1]) - v)) / slope;
        let by_pose = (motion.by_pose[0] * by_u + motion.by_pose[1] * by_v) / slope;
        let covariance = Matrix6::from_fn(|row, column| covariance[row][column]);
        let sigma = repeated * found.blur * PIXEL_SIGMA;
        let noise = sigma * sigma + by_pose.dot(&(covariance * by_pose));
        let gain = point.variance * slope / (point.variance * slope * slope + noise);
        let shift = gain * residual;
        point.position = std::array::from_fn(|i| point.position[i] + shift * point.ray[i]);
        point.variance *= 1.0 - gain * slope;
    }

    /// Finds the point `source[1]` near its predicted place in the scene's image, halved `halvings` times.
    pub(super) fn find(
        &self,
        source: [usize; 2],
        scene: Scene<'_>,
        camera_from_object: &Pose,
        template: &mut Template,
        lengths: &PixelLengths,
        halvings: usize,
    ) -> Option<PointMatch> {
        let camera = scene.camera;
        let point = self.points.get(source[1])?;
        let expected = camera.project(camera_from_object.transform_point(point.position))?;
        if !camera.sees(expected) {
            return None;
        }
        let warp = self.warp(point, scene, camera_from_object)?;
        // One level coarser where the view shows the surface much larger.
        let level = halvings + usize::from(warp.determinant().abs() > 2.5);
        let [here, there] = [halvings, level].map(|halvings| (1 << halvings) as f32);
        let rows = [[warp[(0, 0)], warp[(0, 1)]], [warp[(1, 0)], warp[(1, 1)]]];
        let rows = rows.map(|row| row.map(|x| x as f32 * here / there));
        let (source_image, mask) = (self.pyramid.levels().get(level)?, self.masks.levels().get(level)?);
        let center = point.pixel.map(|c| c / there);
        template.take_warped(source_image, Some(mask), center, rows, lengths.window_radius);
        if template.share() < LEAST_SHARE {
            return None;
        }
        let expected = expected.map(|c| c as f32 / here);
        let limits = AlignmentLimits { iterations: 15, epsilon: 0.02, lighting: Lighting::Affine };
        let found = template.align(scene.pyramid.levels().get(halvings)?, expected, limits)?;
        if found.correlation < LEAST_CORRELATION {
            return None;
        }
        let [by_u, by_v] = pixel_motion(camera, camera_from_object, point.position, point.ray).by_shift;
        Some(PointMatch {
            position: point.position,
            pixel: found.point.map(|c| c * here),
            blur: blur(found.correlation),
            spread: by_u.hypot(by_v) * point.variance.sqrt(),
            source,
        })
    }

    /// The points that face the camera at a pose, in the camera's frame.
    pub(super) fn facing<'a>(
        &'a self,
        scene: Scene<'a>,
        camera_from_object: &'a Pose,
    ) -> impl Iterator<Item = [f64; 3]> + 'a {
        let facing = self
            .points
            .iter()
            .filter(move |point| surface_jacobian(scene, camera_from_object, point).is_some());
        facing.map(|point| camera_from_object.transform_point(point.position))
    }

    /// The linear map from pixels around the point in an image to pixels around it in this view; `None` where
    /// either shows the surface too obliquely or too small.
    fn warp(&self, point: &ViewPoint, scene: Scene<'_>, pose: &Pose) -> Option<Matrix2<f64>> {
        let here = surface_jacobian(scene, pose, point)?;
        let there = surface_jacobian(scene, &self.camera_from_object, point)?;
        let warp = there * here.try_inverse()?;
        (0.08..=12.0).contains(&warp.determinant()).then_some(warp)
    }
}

/// Factor on a pixel's standard deviation, 1 at a correlation of 0.8. What only one of the windows shows acts
/// as noise, and the error of an alignment is proportional to the noise.
fn blur(correlation: f32) -> f64 {
    let correlation = f64::from(correlation);
    ((1.0 - correlation * correlation).max(0.0).sqrt() / (0.75 * correlation)).clamp(0.5, 10.0)
}

/// Derivative of a point's pixel by two tangents of its surface. `None` when the surface does not face the
/// camera.
fn surface_jacobian(scene: Scene<'_>, pose: &Pose, point: &ViewPoint) -> Option<Matrix2<f64>> {
    let place = Vector3::from(pose.transform_point(point.position));
    let normal = Vector3::from(pose.rotate(point.normal));
    if normal.dot(&place) >= 0.0 || place.z <= 0.0 {
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
            scene.camera.fx() * (d.x - place.x * inverse * d.z) * inverse,
            scene.camera.fy() * (d.y - place.y * inverse * d.z) * inverse,
        )
    });
    Some(Matrix2::from_columns(&columns))
}
