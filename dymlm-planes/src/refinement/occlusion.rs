use dymlm_core::{DepthImage, PinholeCamera, Plane, Point, axial_noise};

use super::DetectedPlane;
use crate::linear_algebra::{dot, norm, subtract};

/// Planes of one frame are one surface behind something when their normals differ by less than this ...
const COS_MAX_ANGLE: f64 = 0.985;
/// ... each one's centroid lies this near to the other, metres at 1 m of depth and growing with the noise ...
const MAX_OFFSET: f64 = 0.03;
/// ... and no more than this is hidden between them, metres.
const MAX_HIDDEN: f64 = 0.8;
/// Edge points of a plane that are looked at, and places along the way between two.
const MOST_EDGE_POINTS: usize = 64;
const PLACES: usize = 12;
/// Share of the places between that must be hidden, and that may be looked through (noise at the rims).
const MIN_HIDDEN: f64 = 0.5;
const MAX_OPEN: f64 = 0.1;

/// Finds planes that are one surface with something standing before its middle: a wall behind a person or a cabinet. On the
/// shortest way between them the depth image shows nearer things, and never looks through to what lies behind. Where one sees
/// past both (between two desks of one height) they are two.
///
/// O(coplanar pairs x edge points^2), with at most 64 edge points each.
pub(super) fn link_continued(planes: &mut [DetectedPlane], camera: &PinholeCamera, depth: &DepthImage) {
    for j in 1..planes.len() {
        for i in 0..j {
            let (a, b) = (&planes[i], &planes[j]);
            if are_coplanar(a, b) && is_hidden_between(a, b, camera, depth) {
                let (of_a, of_b) = (a.segment, b.segment);
                planes[i].continued_by.push(of_b);
                planes[j].continued_by.push(of_a);
            }
        }
    }
}

fn are_coplanar(a: &DetectedPlane, b: &DetectedPlane) -> bool {
    let near = |plane: &Plane, point: [f64; 3]| {
        let noise = f64::from(axial_noise(point[2] as f32));
        plane.signed_distance(point).abs() < MAX_OFFSET.max(2.0 * noise)
    };
    dot(a.plane.normal(), b.plane.normal()) > COS_MAX_ANGLE
        && near(&a.plane, b.centroid)
        && near(&b.plane, a.centroid)
}

fn is_hidden_between(
    a: &DetectedPlane,
    b: &DetectedPlane,
    camera: &PinholeCamera,
    depth: &DepthImage,
) -> bool {
    let Some([from, to]) = nearest_pair(&a.edge_points, &b.edge_points) else { return false };
    if norm(subtract(to, from)) > MAX_HIDDEN {
        return false;
    }
    let (mut hidden, mut open) = (0.0, 0.0);
    for k in 1..=PLACES {
        let part = k as f64 / (PLACES + 1) as f64;
        let place: [f64; 3] = std::array::from_fn(|axis| from[axis] + part * (to[axis] - from[axis]));
        let Some(pixel) = camera.project(place).filter(|pixel| camera.sees(*pixel)) else { continue };
        let reading = f64::from(depth.at(pixel[0].round() as usize, pixel[1].round() as usize));
        let margin = 0.03 + 3.0 * f64::from(axial_noise(place[2] as f32));
        if reading > 0.0 && reading < place[2] - margin {
            hidden += 1.0;
        } else if reading > place[2] + margin {
            open += 1.0;
        }
    }
    hidden >= MIN_HIDDEN * PLACES as f64 && open <= MAX_OPEN * PLACES as f64
}

/// The two points, one of each set, that are nearest to each other.
fn nearest_pair(a: &[Point], b: &[Point]) -> Option<[[f64; 3]; 2]> {
    let some = |points: &[Point]| -> Vec<[f64; 3]> {
        let stride = points.len().div_ceil(MOST_EDGE_POINTS).max(1);
        points.iter().step_by(stride).map(|point| point.map(f64::from)).collect()
    };
    let (a, b) = (some(a), some(b));
    let pairs = a.iter().flat_map(|from| b.iter().map(move |to| [*from, *to]));
    pairs.min_by(|[a, b], [c, d]| norm(subtract(*b, *a)).total_cmp(&norm(subtract(*d, *c))))
}
