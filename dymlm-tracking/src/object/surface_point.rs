use dymlm_core::{PinholeCamera, Pose, symmetric_eigen3};
use nalgebra::{Matrix3, Vector3};

use super::model::ObjectModel;
use super::pixel_lengths::PixelLengths;
use super::scene::Scene;

/// A point's plane is fitted to a grid of readings, this many steps to each side.
const PLANE_STEPS: isize = 2;
/// Least number of the 25 readings that must be near the middle one: otherwise the pixel is at an edge.
const LEAST_READINGS: usize = 13;
/// Standard deviation of neighbouring readings of an oblique surface from the middle one, as a share of the
/// depth: that of surfaces at 45 degrees over the grid's four pixels. Without a limit, planes extend over
/// edges, and a bottle is off by 1.7 mm instead of 1.2.
const SLOPE: f64 = 0.01;

/// The place on the object's surface that a pixel shows, with its unit normal, in the camera's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct SurfacePlace {
    pub(super) place: [f64; 3],
    pub(super) normal: [f64; 3],
    /// Standard deviation along the ray, metres.
    pub(super) sigma: f64,
}

/// Finds the place on the object that a pixel shows: from the readings around it or, without a reading, on
/// the model.
pub(super) struct SurfaceFinder<'a> {
    scene: Scene<'a>,
    plane_step: isize,
    model_sigma: f64,
    /// The model's points that face the camera, and their pixels.
    facing: Vec<(SurfacePlace, [f64; 2])>,
    /// Squared distance in the image beyond which a model point does not belong to a pixel.
    most_apart: f64,
}

impl<'a> SurfaceFinder<'a> {
    pub(super) fn new(
        scene: Scene<'a>,
        model: &ObjectModel,
        camera_from_object: &Pose,
        lengths: &PixelLengths,
        model_sigma: f64,
    ) -> Self {
        let facing = model.facing(camera_from_object).filter_map(|(point, place)| {
            let normal = camera_from_object.rotate(point.normal);
            Some((SurfacePlace { place, normal, sigma: model_sigma }, scene.camera.project(place)?))
        });
        let most_apart = f64::from(2.0 * lengths.point_distance).powi(2);
        let plane_step = lengths.plane_step;
        Self { scene, plane_step, model_sigma, facing: facing.collect(), most_apart }
    }

    pub(super) fn at(&self, pixel: [f64; 2]) -> Option<SurfacePlace> {
        match self.scene.reading_at(pixel.map(|c| c as f32)) {
            Some(reading) => self.on_readings(pixel, reading),
            None => self.on_model(pixel),
        }
    }

    /// On the plane fitted to the readings around a pixel, which is less noisy than its own reading. `None`
    /// at edges.
    fn on_readings(&self, pixel: [f64; 2], middle: f64) -> Option<SurfacePlace> {
        let offsets = -PLANE_STEPS..=PLANE_STEPS;
        let grid = offsets.clone().flat_map(|dv| offsets.clone().map(move |du| [du, dv]));
        let near = self.scene.sensor.tolerance(middle as f32, SLOPE * middle);
        let readings: Vec<Vector3<f64>> = grid
            .filter_map(|offset| {
                let place = [0, 1].map(|i| pixel[i].round() + (self.plane_step * offset[i]) as f64);
                let reading = self.scene.reading_at(place.map(|c| c as f32))?;
                let is_near = (reading - middle).abs() < near;
                is_near.then(|| Vector3::from(self.scene.camera.back_project(place, reading)))
            })
            .collect();
        if readings.len() < LEAST_READINGS {
            return None;
        }
        let mean = readings.iter().sum::<Vector3<f64>>() / readings.len() as f64;
        let spread: Matrix3<f64> = readings.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
        let normal = Vector3::from(symmetric_eigen3(spread.into())?.vectors[2]);
        let normal = if normal.dot(&mean) > 0.0 { -normal } else { normal };
        let place = meet_plane(self.scene.camera, pixel, mean.into(), normal.into())?;
        let is_near = (place[2] - middle).abs() < near;
        is_near.then(|| SurfacePlace { place, normal: normal.into(), sigma: self.scene.sigma(place[2]) })
    }

    /// On the ray, where it meets the tangent plane of the nearest model point.
    fn on_model(&self, pixel: [f64; 2]) -> Option<SurfacePlace> {
        let apart = |seen: [f64; 2]| (seen[0] - pixel[0]).powi(2) + (seen[1] - pixel[1]).powi(2);
        let (nearest, seen) = self.facing.iter().min_by(|(_, a), (_, b)| apart(*a).total_cmp(&apart(*b)))?;
        let place = meet_plane(self.scene.camera, pixel, nearest.place, nearest.normal)?;
        let found = SurfacePlace { place, normal: nearest.normal, sigma: self.model_sigma };
        (apart(*seen) <= self.most_apart).then_some(found)
    }
}

/// The intersection of a pixel's ray with the plane through `place`.
fn meet_plane(
    camera: &PinholeCamera,
    pixel: [f64; 2],
    place: [f64; 3],
    normal: [f64; 3],
) -> Option<[f64; 3]> {
    let ray = Vector3::from(camera.back_project(pixel, 1.0));
    let normal = Vector3::from(normal);
    let depth = normal.dot(&Vector3::from(place)) / normal.dot(&ray);
    (depth.is_finite() && depth > 0.0).then(|| (ray * depth).into())
}
