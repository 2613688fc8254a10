//! Queries of the static cloud.

use std::sync::Arc;

use dymlm::MultiLevelMap;
use dymlm::cloud::StaticPoint;
use dymlm::core::{Point, Rgb};
use dymlm::geometry::OrientedBox;
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::arrays::{Array1, Array2, points, rows, rows_to_array, vector};
use crate::error::{OrRaise, refused};
use crate::pose::PoseArgument;

/// Positions (float32) and colours of points.
type Colored<'py> = (Array2<'py, f32>, Array2<'py, u8>);

/// Queries of the static cloud for many places at once: n places give n results. Lengths in metres, world.
#[pyclass(frozen, name = "StaticPoints", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyStaticPoints(pub(crate) Arc<MultiLevelMap>);

#[pymethods]
impl PyStaticPoints {
    /// The static point nearest to each of the places (n, 3), within `radius`: positions (n, 3) float32 and
    /// distances (n,) float64; NaN and inf where there is none.
    #[pyo3(signature = (places, radius = f64::INFINITY))]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        places: &Bound<'py, PyAny>,
        radius: f64,
    ) -> PyResult<(Array2<'py, f32>, Array1<'py, f64>)> {
        let places = rows::<3>(places, "places")?;
        let (positions, distances): (Vec<Point>, Vec<f64>) = py.detach(|| {
            let points = self.0.cloud().static_points();
            let nearest = |place| match points.nearest(place, radius) {
                Some(point) => (point.position, distance(place, point.position)),
                None => ([f32::NAN; 3], f64::INFINITY),
            };
            places.into_iter().map(nearest).unzip()
        });
        Ok((rows_to_array(py, positions)?, PyArray1::from_vec(py, distances)))
    }

    /// The points in a box from corner `low` (3,) to `high` (3,), in the frame `world_from_box` (by default
    /// the world): positions (n, 3) float32 and colours (n, 3) uint8, black for points without colour.
    #[pyo3(signature = (low, high, world_from_box = None))]
    fn in_box<'py>(
        &self,
        py: Python<'py>,
        low: &Bound<'py, PyAny>,
        high: &Bound<'py, PyAny>,
        world_from_box: Option<PoseArgument>,
    ) -> PyResult<Colored<'py>> {
        let between = OrientedBox::between(vector(low, "low")?, vector(high, "high")?).or_raise()?;
        let region = world_from_box.map_or(between, |pose| between.transformed(&pose.0));
        let (positions, colors): (Vec<Point>, Vec<Rgb>) = py.detach(|| {
            let mut found: Vec<StaticPoint> = Vec::new();
            self.0.cloud().static_points().in_box(&region, &mut found);
            found.into_iter().map(|point| (point.position, point.color.unwrap_or_default())).unzip()
        });
        Ok((rows_to_array(py, positions)?, rows_to_array(py, colors)?))
    }

    /// The first static point along each ray, within `max_range` and at most `radius` beside the ray:
    /// positions (n, 3) float32 and distances along the rays (n,) float64; NaN and inf where there is none.
    /// origins (n, 3) or (3,) for all; directions (n, 3), of any length.
    #[pyo3(signature = (origins, directions, max_range = f64::INFINITY, radius = 0.015))]
    fn cast_rays<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        max_range: f64,
        radius: f64,
    ) -> PyResult<(Array2<'py, f32>, Array1<'py, f64>)> {
        let rays = rays(origins, directions)?;
        let (positions, distances): (Vec<Point>, Vec<f64>) = py.detach(|| {
            let points = self.0.cloud().static_points();
            let cast = |[origin, direction]: [[f64; 3]; 2]| match points
                .cast_ray(origin, direction, max_range, radius)
            {
                Some(hit) => (hit.point.position, hit.distance),
                None => ([f32::NAN; 3], f64::INFINITY),
            };
            rays.into_iter().map(cast).unzip()
        });
        Ok((rows_to_array(py, positions)?, PyArray1::from_vec(py, distances)))
    }

    /// Normals (n, 3) float64 of the surface around each of the places (n, 3), from the points within
    /// `radius`. They point to the side that frames looked through; NaN where there are too few points. Four
    /// voxels are a good radius.
    fn normals<'py>(
        &self,
        py: Python<'py>,
        places: &Bound<'py, PyAny>,
        radius: f64,
    ) -> PyResult<Array2<'py, f64>> {
        let places = points(places, "places")?;
        let normals: Vec<[f64; 3]> = py.detach(|| {
            let points = self.0.cloud().static_points();
            let normal =
                |place| points.normal_at(place, radius).map_or([f64::NAN; 3], |normal| normal.direction);
            places.into_iter().map(normal).collect()
        });
        rows_to_array(py, normals)
    }
}

fn distance(place: [f64; 3], point: Point) -> f64 {
    place.iter().zip(point).map(|(a, b)| (a - f64::from(b)).powi(2)).sum::<f64>().sqrt()
}

/// Rays of (n, 3) directions, each from its own origin or all from one.
pub(crate) fn rays(
    origins: &Bound<'_, PyAny>,
    directions: &Bound<'_, PyAny>,
) -> PyResult<Vec<[[f64; 3]; 2]>> {
    let (origins, directions) = (rows::<3>(origins, "origins")?, rows::<3>(directions, "directions")?);
    match *origins {
        [origin] => Ok(directions.into_iter().map(|direction| [origin, direction]).collect()),
        _ if origins.len() == directions.len() => {
            Ok(origins.into_iter().zip(directions).map(|(origin, direction)| [origin, direction]).collect())
        }
        _ => Err(refused(format!("{} origins for {} directions", origins.len(), directions.len()))),
    }
}
