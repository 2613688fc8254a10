use dymlm::core::vector3::{difference, norm};

use super::things::PageObject;

/// Least overlap of two objects' boxes, placed into each other, for a vanished object to be the same as one
/// first seen afterwards; as in [`world_changes_since`](dymlm::MultiLevelMap::world_changes_since).
const LEAST_OVERLAP: f64 = 0.5;

/// Finds which vanished objects stand elsewhere now: pairs of indices into `gone` and `present`, each in at
/// most one pair; of several candidates, the nearest.
pub(super) fn moved_objects(gone: &[PageObject], present: &[PageObject]) -> Vec<(usize, usize)> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (g, from) in gone.iter().enumerate() {
        for (p, to) in present.iter().enumerate().filter(|(_, to)| may_be_one(from, to)) {
            pairs.push((norm(difference(to.translation, from.translation)), g, p));
        }
    }
    pairs.sort_by(|one, other| one.0.total_cmp(&other.0));
    let mut moved: Vec<(usize, usize)> = Vec::new();
    for (_, g, p) in pairs {
        if moved.iter().all(|&(other_g, other_p)| other_g != g && other_p != p) {
            moved.push((g, p));
        }
    }
    moved
}

/// Whether a vanished object may be the same as one that appeared after the vanished one was last seen.
fn may_be_one(gone: &PageObject, present: &PageObject) -> bool {
    let sorted = |object: &PageObject| {
        let mut lengths = object.dimensions;
        lengths.sort_by(f64::total_cmp);
        lengths
    };
    let (a, b) = (sorted(gone), sorted(present));
    let common: f64 = a.iter().zip(b).map(|(a, b)| a.min(b)).product();
    let [volume_a, volume_b] = [a, b].map(|lengths| lengths.iter().product::<f64>());
    gone.label == present.label
        && present.first_seen > gone.last_seen
        && common > LEAST_OVERLAP * (volume_a + volume_b - common)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn object(label: &str, x: f64, dimensions: [f64; 3], seen: [f64; 2]) -> PageObject {
        let place = [x, 0.0, 0.0];
        PageObject {
            label: label.to_owned(),
            translation: place,
            dimensions,
            first_seen: seen[0],
            last_seen: seen[1],
            ..PageObject::default()
        }
    }

    #[test]
    fn of_those_that_came_later_the_nearest_of_its_kind_and_size() {
        let (size, turned) = ([0.5, 0.6, 1.0], [1.0, 0.5, 0.5]);
        let gone = [object("chair", 0.0, size, [0.0, 4.0]), object("chair", 3.0, size, [0.0, 4.0])];
        let present = [
            object("chair", 0.1, size, [3.0, 9.0]),
            object("cup", 0.2, size, [5.0, 9.0]),
            object("chair", 0.3, [0.1, 0.1, 0.1], [5.0, 9.0]),
            object("chair", 1.0, turned, [5.0, 9.0]),
        ];
        assert_eq!(moved_objects(&gone, &present), [(0, 3)]);
        assert_eq!(moved_objects(&[], &present), []);
        let more = [present[3].clone(), object("chair", 9.0, size, [6.0, 9.0])];
        assert_eq!(moved_objects(&gone, &more), [(0, 0), (1, 1)]);
    }
}
