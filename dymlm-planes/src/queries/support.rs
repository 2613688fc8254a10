use dymlm_core::Point;
use dymlm_core::vector3::dot;

use crate::linear_algebra::{foot_on, normalized};
use crate::plane_map::{MapPlane, PlaneMap};

/// Share of the points that may lie below a plane that carries them: noise, and what hangs over its rim.
const MOST_BELOW: f64 = 0.1;
/// Points so far below a plane are below it, metres.
const BELOW: f64 = 0.02;

impl PlaneMap {
    /// The plane that a set of points stands on: level to 30 degrees and facing up, its nearest point no more than
    /// `max_gap` metres under the lowest of the points (or above it by as much), with at most a tenth of the points below it, and with
    /// inliers under or beside at least half of the points; the highest of those. Points that are not finite are passed over.
    /// O(planes x points).
    pub fn supporting_plane(&self, points: &[Point], up: [f64; 3], max_gap: f64) -> Option<&MapPlane> {
        let up = normalized(up)?;
        let points: Vec<[f64; 3]> = points
            .iter()
            .map(|point| point.map(f64::from))
            .filter(|point| point.iter().all(|x| x.is_finite()))
            .collect();
        let carries = self.planes().iter().filter(|plane| carries(plane, &points, up, max_gap));
        let height = |plane: &MapPlane| dot(plane.centroid(), up);
        carries.max_by(|a, b| height(a).total_cmp(&height(b)).then(b.id().cmp(&a.id())))
    }
}

fn carries(plane: &MapPlane, points: &[[f64; 3]], up: [f64; 3], max_gap: f64) -> bool {
    if points.is_empty() || dot(plane.plane().normal(), up) < 0.866 {
        return false;
    }
    let distances = || points.iter().map(|point| plane.plane().signed_distance(*point));
    let below = distances().filter(|&distance| distance < -BELOW).count() as f64;
    let rank = (MOST_BELOW * points.len() as f64) as usize;
    if below > MOST_BELOW * points.len() as f64 {
        return false;
    }
    let mut sorted: Vec<f64> = distances().collect();
    sorted.sort_by(f64::total_cmp);
    let lowest = sorted.get(rank).copied().unwrap_or(f64::INFINITY);
    if lowest > max_gap {
        return false;
    }
    let over = points.iter().filter(|point| plane.holds(foot_on(&plane.plane(), **point))).count();
    2 * over >= points.len()
}
