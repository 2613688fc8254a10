use std::collections::BTreeMap;

use dymlm_core::vector3::{difference, norm};
use dymlm_core::{Plane, SensorModel};

use crate::association::Criterion;
use crate::detector::RayLattice;

/// Two labels of a label image, the lower first.
type LabelPair = [u16; 2];

/// Where two labelled surfaces are nearest, among places next to each other in a row or a column of the label
/// image.
#[derive(Debug, Clone, Copy)]
struct Contact {
    /// Distance, metres.
    distance: f64,
    /// A point on each surface, camera frame.
    points: [[f64; 3]; 2],
}

/// The pairs of labels that an image shows as two parallel surfaces with a step between them, and its height
/// in micrometres: as a cupboard's front and that of the oven in it, 4 cm behind. In the map, planes so near
/// would pass for one.
///
/// Errors of the pose move both, and errors of the camera's calibration hardly differ where the two are
/// nearest; there the step must be larger than the tolerance of a single reading. (Elsewhere a small angle
/// between parts of one wall would look like a step.) `planes` gives the plane of each label, in the camera's
/// frame. O(places), and O(log labels) where the label changes.
pub(super) fn steps(
    labels: &[u16],
    lattice: RayLattice,
    planes: &BTreeMap<u16, Plane>,
    criterion: &Criterion,
    sensor: &SensorModel,
) -> Vec<(LabelPair, u32)> {
    let step = |([a, b], contact): (LabelPair, Contact)| {
        let (plane_a, plane_b) = (planes.get(&a)?, planes.get(&b)?);
        let [on_a, on_b] = contact.points;
        let step = plane_a.signed_distance(on_b).abs().min(plane_b.signed_distance(on_a).abs());
        let depth = on_a[2].max(on_b[2]);
        let is_step = step > sensor.tolerance(depth as f32, 0.0)
            && criterion.could_pass_for_one([plane_a, plane_b], contact.distance, step);
        is_step.then_some(([a, b], (1e6 * step) as u32))
    };
    contacts(labels, lattice, planes).into_iter().filter_map(step).collect()
}

/// For each pair of labels that are next to each other, with nothing or only places without label between
/// them, where they are nearest.
fn contacts(
    labels: &[u16],
    lattice: RayLattice,
    planes: &BTreeMap<u16, Plane>,
) -> BTreeMap<LabelPair, Contact> {
    let mut nearest: BTreeMap<LabelPair, Contact> = BTreeMap::new();
    let mut meet = |places: [usize; 2]| {
        let pair = places.map(|place| labels[place]);
        if pair[0] == pair[1] {
            return;
        }
        let [a, b] = if pair[0] < pair[1] { places } else { [places[1], places[0]] };
        let point = |place: usize| Some(lattice.center(place as u32, planes.get(&labels[place])?));
        let (Some(on_a), Some(on_b)) = (point(a), point(b)) else { return };
        let contact = Contact { distance: norm(difference(on_a, on_b)), points: [on_a, on_b] };
        let least = nearest.entry([labels[a], labels[b]]).or_insert(contact);
        if contact.distance.total_cmp(&least.distance).is_lt() {
            *least = contact;
        }
    };
    let columns = lattice.columns.max(1) as usize;
    let mut above: Vec<Option<usize>> = vec![None; columns];
    for first in (0..labels.len()).step_by(columns) {
        let mut before = None;
        for (place, above) in (first..labels.len()).zip(&mut above).filter(|(place, _)| labels[*place] > 0) {
            [before, *above].into_iter().flatten().for_each(|neighbor| meet([neighbor, place]));
            (before, *above) = (Some(place), Some(place));
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlaneMapConfig;

    /// Steps between two parts of a row of seven places, at these depths, with a place without label between
    /// them; `tilt` turns the second part.
    fn steps_of(depths: [f64; 2], tilt: f64) -> Vec<LabelPair> {
        let lattice = RayLattice { first: [-0.03, 0.0], step: [0.01, 0.01], columns: 7 };
        let config = PlaneMapConfig::default();
        let criterion = Criterion::new(&config.association, config.voxel_size);
        let plane = |depth: f64, tilt: f64| Plane::new([tilt.sin(), 0.0, -tilt.cos()], depth).unwrap();
        let planes = BTreeMap::from([(3, plane(depths[0], 0.0)), (5, plane(depths[1], tilt))]);
        let steps = steps(&[5, 5, 5, 0, 3, 3, 3], lattice, &planes, &criterion, &SensorModel::kinect());
        assert!(steps.iter().all(|(_, height)| height.abs_diff(40_000) <= 1));
        steps.into_iter().map(|(pair, _)| pair).collect()
    }

    #[test]
    fn steps_are_larger_than_the_noise_and_lie_between_parallel_planes() {
        assert_eq!(steps_of([1.0, 1.04], 0.0), [[3, 5]]);
        assert_eq!(steps_of([1.04, 1.0], 0.0), [[3, 5]]);
        // 6 mm are the noise at 1 m, 100 mm at 4 m.
        assert_eq!(steps_of([1.0, 1.004], 0.0), [[0; 2]; 0]);
        assert_eq!(steps_of([4.0, 4.04], 0.0), [[0; 2]; 0]);
        assert_eq!(steps_of([1.0, 1.04], 0.5), [[0; 2]; 0], "another direction");
        assert_eq!(steps_of([1.0, 1.3], 0.0), [[0; 2]; 0], "too far apart to pass for one");
        assert_eq!(steps_of([1e300, 1.0], 0.0), [[0; 2]; 0]);
    }

    #[test]
    fn no_labels_no_steps() {
        let config = PlaneMapConfig::default();
        let criterion = Criterion::new(&config.association, config.voxel_size);
        let of = |labels: &[u16]| {
            steps(labels, RayLattice::default(), &BTreeMap::new(), &criterion, &SensorModel::kinect())
        };
        assert!(of(&[]).is_empty());
        assert!(of(&[0, 0, 4, 5]).is_empty());
    }
}
