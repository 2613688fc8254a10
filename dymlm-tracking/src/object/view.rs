use std::ops::Range;

use dymlm_core::{BoundingBox, DepthImage, PinholeCamera, Pose, axial_noise};
use nalgebra::{Matrix2, Matrix3, Matrix6, Vector2, Vector3};

use super::ObjectModel;
use super::silhouette::silhouette;
use crate::flow::{AlignmentLimits, Template};
use crate::pose::pixel_motion;
use crate::{CornerDetector, GrayImage, ImagePyramid, Lighting};

/// Rim of the image kept around the object's box, pixels.
const RIM: f32 = 24.0;
/// Halvings kept of a cut-out, for finding the object again.
const HALVINGS: usize = 3;
/// A point's surface must face the camera by this cosine to be measured.
const LEAST_COSINE: f64 = 0.18;
/// How far a window may be found from where it was expected, pixels.
const LARGEST_SHIFT: f32 = 7.0;
/// Frames that follow each other err alike: a pixel counts in the correction of a point as if it erred by this factor
/// more.
const LIKE_FRAMES: f64 = 3.0;
/// Points are never known better, square metres.
const LEAST_VARIANCE: f64 = 1e-6;
/// Least share of a window that shows the object.
const LEAST_SHARE: f32 = 0.4;
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
    /// 1 where the cut-out shows the object.
    masks: ImagePyramid,
    pub(super) points: Vec<ViewPoint>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ViewPoint {
    /// Place and unit normal, object frame.
    pub(super) position: [f64; 3],
    normal: [f64; 3],
    /// In the cut-out, pixels.
    pub(super) pixel: [f32; 2],
    /// From the view's camera to the point, of unit length, object frame: along it the point's place is uncertain.
    ray: [f64; 3],
    /// Variance of the place along the ray, square metres.
    variance: f64,
}

/// A point of the object found in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sighting {
    pub(super) position: [f64; 3],
    pub(super) pixel: [f32; 2],
    /// Factor on the standard deviation of a pixel.
    pub(super) blur: f64,
    /// Standard deviation of the pixel for the point's place is uncertain, pixels.
    pub(super) spread: f64,
    /// The view and its point that was found.
    pub(super) source: [usize; 2],
}

/// What is needed of a frame.
#[derive(Clone, Copy)]
pub(super) struct Sight<'a> {
    pub(super) camera: &'a PinholeCamera,
    pub(super) pyramid: &'a ImagePyramid,
    pub(super) depth: &'a DepthImage,
}

/// Which window of an image shows a point of a view.
#[derive(Debug, Clone, Copy)]
pub(super) struct Likeness {
    /// Of the window, pixels.
    pub(super) radius: usize,
    /// Of the image in which it is searched.
    pub(super) halvings: usize,
    pub(super) min_correlation: f32,
}

impl View {
    /// Finds corners on the object in a frame in which its pose is known, where `is_shown` says that nothing hides it;
    /// `None` when there are none.
    pub(super) fn take(
        sight: Sight<'_>,
        model: &ObjectModel,
        camera_from_object: &Pose,
        detector: &mut CornerDetector,
        margin: f64,
        model_sigma: f64,
        is_shown: impl Fn([f64; 2]) -> bool,
    ) -> Option<Self> {
        let region = projected_bounds(model, sight.camera, camera_from_object)?;
        let object_from_camera = camera_from_object.inverse();
        let Sight { camera, pyramid, depth } = sight;
        let image = pyramid.base();
        let projections = project_facing(model, camera, camera_from_object);
        let cut = CutOut::about(image, region)?;
        let mask = cut.mask(model, camera, camera_from_object, |u, v| {
            // What stands before the object, where there is depth.
            let reading = depth.at(u, v);
            let place = camera.back_project([u as f64, v as f64], reading.into());
            reading <= 0.0 || model.contains(object_from_camera.transform_point(place), margin)
        })?;
        let mut corners = Vec::new();
        let on_object = |u: usize, v: usize| {
            mask.at(u - cut.columns.start, v - cut.rows.start) > 0.0 && is_shown([u as f64, v as f64])
        };
        detector.detect_into(image, region, on_object, &[], &mut corners);

        let offset = [cut.columns.start as f32, cut.rows.start as f32];
        let mut points = Vec::with_capacity(corners.len());
        for corner in &corners {
            let pixel = corner.point.map(f64::from);
            let surface = plane_of_readings(camera, depth, pixel).map(|(place, normal)| {
                let sigma = f64::from(axial_noise(place[2] as f32));
                (object_from_camera.transform_point(place), object_from_camera.rotate(normal), sigma)
            });
            let on_model = || {
                let nearest = nearest_projection(&projections, pixel)?;
                let (place, normal) = (nearest.place, camera_from_object.rotate(nearest.normal));
                let hit = meet_plane(camera, pixel, place, normal)?;
                Some((object_from_camera.transform_point(hit), nearest.normal, model_sigma))
            };
            let reading = depth.at(pixel[0].round() as usize, pixel[1].round() as usize);
            let found = if reading > 0.0 { surface } else { on_model() };
            if let Some((position, normal, sigma)) =
                found.filter(|(position, ..)| model.contains(*position, 2.0 * margin))
            {
                let pixel = [corner.point[0] - offset[0], corner.point[1] - offset[1]];
                let ray = Vector3::from(position) - Vector3::from(object_from_camera.translation());
                let ray = ray.normalize().into();
                points.push(ViewPoint { position, normal, pixel, ray, variance: sigma * sigma });
            }
        }
        let [pyramid, masks] = [cut.pixels(image)?, mask].map(|image| ImagePyramid::new(&image, HALVINGS));
        (!points.is_empty()).then_some(Self {
            camera_from_object: *camera_from_object,
            pyramid,
            masks,
            points,
        })
    }

    /// The angle between the directions from which this view and a pose see the object, radians.
    pub(super) fn angle_to(&self, camera_from_object: &Pose) -> f64 {
        let direction = |pose: &Pose| Vector3::from(pose.inverse().translation()).normalize();
        direction(&self.camera_from_object).angle(&direction(camera_from_object))
    }

    /// Corrects the place of a point along its ray by where it was seen at a pose of the given covariance: without depth
    /// it was laid on the model's surface, which may not be the object's. From the side from which the view was taken
    /// nothing is learned.
    pub(super) fn correct(
        &mut self,
        sighting: &Sighting,
        camera: &PinholeCamera,
        camera_from_object: &Pose,
        covariance: &[[f64; 6]; 6],
        pixel_sigma: f64,
    ) {
        let Some(point) = self.points.get_mut(sighting.source[1]) else { return };
        let Some([u, v]) = camera.project(camera_from_object.transform_point(point.position)) else { return };
        let motion = pixel_motion(camera, camera_from_object, point.position, point.ray);
        let [by_u, by_v] = motion.by_shift;
        let slope = by_u.hypot(by_v);
        if slope <= 0.0 {
            return;
        }
        // Along the line on which the pixel moves with the point.
        let residual =
            (by_u * (f64::from(sighting.pixel[0]) - u) + by_v * (f64::from(sighting.pixel[1]) - v)) / slope;
        let by_pose = (motion.by_pose[0] * by_u + motion.by_pose[1] * by_v) / slope;
        let covariance = Matrix6::from_fn(|row, column| covariance[row][column]);
        let sigma = LIKE_FRAMES * sighting.blur * pixel_sigma;
        let noise = sigma * sigma + by_pose.dot(&(covariance * by_pose));
        let gain = point.variance * slope / (point.variance * slope * slope + noise);
        let shift = gain * residual;
        point.position = std::array::from_fn(|i| point.position[i] + shift * point.ray[i]);
        point.variance = (point.variance * (1.0 - gain * slope)).max(LEAST_VARIANCE);
    }

    /// Finds one of its points in an image halved `halvings` times, within [`LARGEST_SHIFT`] pixels of that from where it
    /// should be at a pose.
    pub(super) fn sight(
        &self,
        [view, index]: [usize; 2],
        sight: Sight<'_>,
        camera_from_object: &Pose,
        template: &mut Template,
        like: Likeness,
    ) -> Option<Sighting> {
        let point = self.points.get(index)?;
        let expected = sight.camera.project(camera_from_object.transform_point(point.position))?;
        if !sight.camera.sees(expected) {
            return None;
        }
        let warp = self.warp(point, sight.camera, camera_from_object)?;
        // One level down where the view shows the surface much larger.
        let level = like.halvings + usize::from(warp.determinant().abs() > 2.5);
        let [here, there] = [like.halvings, level].map(|halvings| (1 << halvings) as f32);
        let rows = [[warp[(0, 0)], warp[(0, 1)]], [warp[(1, 0)], warp[(1, 1)]]];
        let rows = rows.map(|row| row.map(|x| x as f32 * here / there));
        let (source, mask) = (self.pyramid.levels().get(level)?, self.masks.levels().get(level)?);
        template.take_warped(source, Some(mask), point.pixel.map(|c| c / there), rows, like.radius);
        if template.share() < LEAST_SHARE || template.min_eigenvalue() < LEAST_EIGENVALUE {
            return None;
        }
        let expected = expected.map(|c| c as f32 / here);
        let limits = AlignmentLimits { iterations: 15, epsilon: 0.02, lighting: Lighting::Affine };
        let found = template.align(sight.pyramid.levels().get(like.halvings)?, expected, limits)?;
        let shift = (found.point[0] - expected[0]).hypot(found.point[1] - expected[1]);
        if shift > LARGEST_SHIFT || found.correlation < like.min_correlation {
            return None;
        }
        let [by_u, by_v] = pixel_motion(sight.camera, camera_from_object, point.position, point.ray).by_shift;
        let spread = by_u.hypot(by_v) * point.variance.sqrt();
        let pixel = found.point.map(|c| c * here);
        let blur = blur(found.correlation);
        Some(Sighting { position: point.position, pixel, blur, spread, source: [view, index] })
    }

    /// Its points that face the camera at a pose, in the camera's frame.
    pub(super) fn facing<'a>(
        &'a self,
        camera: &'a PinholeCamera,
        camera_from_object: &'a Pose,
    ) -> impl Iterator<Item = [f64; 3]> + 'a {
        let facing =
            self.points.iter().filter(|point| surface_jacobian(camera, camera_from_object, point).is_some());
        facing.map(|point| camera_from_object.transform_point(point.position))
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

/// How much less sure a window's place is than that of one with a correlation of 0.8: what the windows do not share is
/// noise to what they share, and the error of an alignment goes with the noise.
fn blur(correlation: f32) -> f64 {
    let correlation = f64::from(correlation);
    ((1.0 - correlation * correlation).max(0.0).sqrt() / (0.75 * correlation)).clamp(0.5, 10.0)
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

/// The part of an image about the object.
struct CutOut {
    columns: Range<usize>,
    rows: Range<usize>,
}

impl CutOut {
    fn about(image: &GrayImage, region: BoundingBox) -> Option<Self> {
        let wider = BoundingBox::new(
            region.x_min() - RIM,
            region.y_min() - RIM,
            region.x_max() + RIM,
            region.y_max() + RIM,
        )
        .ok()?;
        Some(Self { columns: wider.columns(image.width()), rows: wider.rows(image.height()) })
    }

    fn pixels(&self, image: &GrayImage) -> Option<GrayImage> {
        let row = |v: usize| image.clamped_row(v as isize).get(self.columns.clone()).unwrap_or(&[]);
        let data = self.rows.clone().flat_map(row).copied().collect();
        GrayImage::new(self.columns.len(), self.rows.len(), data).ok()
    }

    /// Where it shows the object, as far as the model's outline and `is_seen` say.
    fn mask(
        &self,
        model: &ObjectModel,
        camera: &PinholeCamera,
        camera_from_object: &Pose,
        is_seen: impl Fn(usize, usize) -> bool,
    ) -> Option<GrayImage> {
        let mut mask = silhouette(model, camera, camera_from_object, &self.columns, &self.rows)?;
        let pixels = self.rows.clone().flat_map(|v| self.columns.clone().map(move |u| (u, v)));
        for (value, (u, v)) in mask.data_mut().iter_mut().zip(pixels) {
            if *value > 0.0 && !is_seen(u, v) {
                *value = 0.0;
            }
        }
        Some(mask)
    }
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
