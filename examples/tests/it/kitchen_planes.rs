//! The plane map of a real kitchen, with people walking through it and without, from the recordings of the
//! data folder: is each surface one plane, and does none stand on a person?
//!
//! `cargo test -p dymlm-examples --test it -- --nocapture kitchen_planes` prints what each surface is made of.
//! The rendered counterparts, whose truth is exact, are the quick rows of the example `evaluate`.
use crate::kitchen::Kitchen;
use dymlm::planes::{MapPlane, PlaneMap};
use dymlm_test_support::recording;

/// A surface of the kitchen. Its place was read off the map of `kitchen` and checked by eye in the pictures;
/// everything else about it is tested.
pub(crate) struct Surface {
    pub(crate) name: &'static str,
    /// A point on it, metres, and its normal; world.
    point: [f64; 3],
    normal: [f64; 3],
    /// Planes whose centroids are within this distance of `point` may belong to the surface, metres.
    reach: f64,
}

/// Least share of a surface's mapped area that one plane must hold: a little less than the current value,
/// which is all of it.
const LEAST_SHARE: f64 = 0.9;

const UP: [f64; 3] = [0.0089, -0.9044, -0.4265];
pub(crate) const SURFACES: [Surface; 7] = [
    Surface { name: "table top", point: [-0.08, 0.01, 1.77], normal: UP, reach: 1.2 },
    // No frame shows both of its parts, before the table and far behind it.
    Surface { name: "floor", point: [-1.51, 0.67, 2.03], normal: UP, reach: 4.0 },
    Surface { name: "counter", point: [-0.99, -0.45, 2.96], normal: [0.02, 0.45, -0.89], reach: 1.2 },
    Surface { name: "cabinet", point: [-1.91, 0.0, 2.02], normal: [0.995, 0.0, 0.1], reach: 0.8 },
    Surface { name: "far wall", point: [0.19, -0.84, 3.39], normal: [0.0, 0.46, -0.89], reach: 1.5 },
    Surface { name: "left wall", point: [2.0, -0.47, 2.74], normal: [-1.0, -0.01, 0.04], reach: 1.0 },
    Surface { name: "right wall", point: [-2.53, -0.59, 1.93], normal: [0.99, 0.04, 0.12], reach: 1.0 },
];

/// A plane belongs to a surface if it is parallel to within 10 degrees and within 4 cm of it. (The board that
/// leans on the right wall is 4.8 cm before it.)
const COS_ANGLE: f64 = 0.985;
const OFFSET: f64 = 0.04;

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn surfaces_are_planes_and_people_are_none() {
    for name in ["kitchen_people", "kitchen"] {
        let Some(kitchen) = Kitchen::of(name) else { return };
        println!(
            "{name}: {} planes, {} candidates",
            kitchen.planes.len(),
            kitchen.planes.candidates().count()
        );
        let failed: Vec<&str> = SURFACES
            .iter()
            .filter(|surface| !is_one(surface, &kitchen.planes))
            .map(|surface| surface.name)
            .collect();

        let most = kitchen.people_shares().max_by(|a, b| a.1.total_cmp(&b.1));
        let (plane, share) = most.unwrap();
        println!("  at most {:.1} % of a plane's pixels show people (plane {plane})", 100.0 * share);
        assert!(share < 0.05, "{name}: {share} of plane {plane} are people");
        assert!(failed.is_empty(), "{name}: {failed:?} have come apart");
    }
}

/// People are round: even without detections they give no planes.
#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn undetected_people_are_no_planes() {
    let Some(folder) = recording("kitchen_people") else { return };
    let kitchen = Kitchen::map(&folder, |_| Some(Vec::new()));
    let (plane, share) = kitchen.people_shares().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    println!("without detections {:.1} % of plane {plane} are people", 100.0 * share);
    assert!(share < 0.05, "{share} of plane {plane} are people");
    assert!(kitchen.people_pixels > 100_000, "{}", kitchen.people_pixels);
}

/// Prints the planes of a surface, and returns whether one of them holds enough of it.
fn is_one(surface: &Surface, planes: &PlaneMap) -> bool {
    let mut parts: Vec<&MapPlane> = planes.iter().filter(|plane| surface.has(plane)).collect();
    parts.sort_by(|a, b| b.area().total_cmp(&a.area()));
    let sum: f64 = parts.iter().map(|plane| plane.area()).sum();
    let share = parts.first().map_or(0.0, |plane| plane.area() / sum);
    let list: Vec<String> = parts
        .iter()
        .map(|plane| {
            let height = 100.0 * offset(plane, surface);
            format!("{:.2} m2 at {height:+.1} cm, seen {} times", plane.area(), plane.observations())
        })
        .collect();
    println!("  {}: {}; the largest holds {:.0} %", surface.name, list.join(", "), 100.0 * share);
    share >= LEAST_SHARE
}

/// Distance of a plane's centroid before the surface, metres.
fn offset(plane: &MapPlane, surface: &Surface) -> f64 {
    dot(plane.centroid(), surface.normal) - dot(surface.point, surface.normal)
}

impl Surface {
    /// Whether a plane of the map belongs to the surface.
    pub(crate) fn has(&self, plane: &MapPlane) -> bool {
        let to_centroid: [f64; 3] = std::array::from_fn(|axis| plane.centroid()[axis] - self.point[axis]);
        dot(plane.plane().normal(), self.normal) >= COS_ANGLE
            && offset(plane, self).abs() <= OFFSET
            && dot(to_centroid, to_centroid) <= self.reach * self.reach
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
