use crate::output_grid::Candidate;

/// Non-maximum suppression class by class: of two boxes of one class that overlap by more than `max_overlap`
/// (intersection over union), the one with the lower score is removed, unless the other one was removed
/// itself. The best come first; of equal scores the one that came first.
pub(crate) fn suppress(mut candidates: Vec<Candidate>, max_overlap: f64) -> Vec<Candidate> {
    candidates.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in candidates {
        let overlaps = |better: &Candidate| better.bounding_box.iou(&candidate.bounding_box) > max_overlap;
        if !kept.iter().any(|better| better.class == candidate.class && overlaps(better)) {
            kept.push(candidate);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use dymlm::core::BoundingBox;
    use proptest::prelude::*;

    use super::*;

    fn candidate(class: usize, score: f32, left: f32) -> Candidate {
        Candidate { class, score, bounding_box: BoundingBox::new(left, 0.0, left + 10.0, 10.0).unwrap() }
    }

    #[test]
    fn what_overlaps_only_a_suppressed_box_stays() {
        // The overlaps are 1/4 (a and c), 7/13 (a and b) and 3/5 (b and c).
        let (a, b, c) = (candidate(0, 0.9, 0.0), candidate(0, 0.8, 3.0), candidate(0, 0.7, 6.0));
        assert_eq!(suppress(vec![c, b, a], 0.45), [a, c]);
        assert_eq!(suppress(vec![c, b, a], 0.6), [a, b, c]);
        assert_eq!(suppress(vec![c, b, a], 0.0), [a]);
    }

    #[test]
    fn other_classes_are_left_alone_and_the_first_of_equals_stays() {
        let (cup, bowl) = (candidate(41, 0.7, 0.0), candidate(45, 0.7, 0.0));
        assert_eq!(suppress(vec![cup, bowl, candidate(41, 0.7, 0.1)], 0.45), [cup, bowl]);
        assert!(suppress(Vec::new(), 0.45).is_empty());
    }

    #[test]
    fn boxes_without_area_overlap_nothing() {
        let empty = Candidate {
            bounding_box: BoundingBox::new(3.0, 3.0, 3.0, 3.0).unwrap(),
            ..candidate(0, 0.5, 0.0)
        };
        assert_eq!(suppress(vec![empty, empty], 0.45).len(), 2);
    }

    /// Overlap by counting cells of whole pixels.
    fn counted(a: &Candidate, b: &Candidate) -> f64 {
        let [a, b] = [a, b].map(|one| one.bounding_box);
        let cells =
            || (0..24_u8).flat_map(|v| (0..24_u8).map(move |u| [u, v].map(|cell| f32::from(cell) + 0.5)));
        let shared = cells().filter(|&cell| a.contains(cell) && b.contains(cell)).count();
        let either = cells().filter(|&cell| a.contains(cell) || b.contains(cell)).count();
        if either == 0 { 0.0 } else { shared as f64 / either as f64 }
    }

    prop_compose! {
        fn any_candidate()(
            class in 0..3_usize, score in 0..6_u8, left in 0..12_u8, upper in 0..12_u8, width in 0..12_u8, height in 0..12_u8
        ) -> Candidate {
            let [left, upper, width, height] = [left, upper, width, height].map(f32::from);
            let bounding_box = BoundingBox::new(left, upper, left + width, upper + height).unwrap();
            Candidate { class, score: f32::from(score) / 5.0, bounding_box }
        }
    }

    proptest! {
        /// By the definition: repeatedly, the best remaining candidate is kept, and those that it suppresses
        /// are removed.
        #[test]
        fn it_is_that_of_the_definition(candidates in prop::collection::vec(any_candidate(), 0..24), limit in 0.0..1.0) {
            let mut left = candidates.clone();
            let mut kept = Vec::new();
            while !left.is_empty() {
                let best = left.iter().map(|one| one.score).fold(f32::MIN, f32::max);
                let first = left.iter().position(|one| one.score == best).unwrap();
                let taken = left.remove(first);
                left.retain(|one| one.class != taken.class || counted(one, &taken) <= limit);
                kept.push(taken);
            }
            prop_assert_eq!(suppress(candidates, limit), kept);
        }
    }
}
