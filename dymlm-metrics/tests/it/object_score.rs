//! The score of objects on maps made wrong on purpose, each with the figure that it must give.
use std::f64::consts::PI;

use dymlm_core::Pose;
use dymlm_geometry::OrientedBox;
use dymlm_metrics::{
    Demand, EstimatedObject, LabelVerdict, ObjectScore, TrueObject, YawSymmetry, score_objects,
};
use proptest::prelude::*;

fn place(center: [f64; 3], yaw_degrees: f64) -> Pose {
    let (sin, cos) = (0.5 * yaw_degrees.to_radians()).sin_cos();
    Pose::new(center, [0.0, 0.0, sin, cos]).unwrap()
}

fn object(id: usize, label: &str, center: [f64; 3], yaw_degrees: f64, lengths: [f64; 3]) -> TrueObject {
    TrueObject::new(id, label, OrientedBox::new(place(center, yaw_degrees), lengths).unwrap(), 20)
}

/// A screen, a chair with a square footprint, a cup declared round, a book seen in 7 frames.
fn room() -> Vec<TrueObject> {
    let mut objects = vec![
        object(10, "tv", [0.0, 1.0, 1.0], 10.0, [0.5, 0.2, 0.4]),
        object(11, "chair", [1.0, 0.0, 0.5], 30.0, [0.6, 0.58, 1.0]),
        object(12, "cup", [0.5, 1.0, 0.8], 0.0, [0.1, 0.08, 0.1]),
        object(13, "book", [-0.5, 1.0, 0.8], -20.0, [0.3, 0.2, 0.1]),
    ];
    objects[2].symmetry = YawSymmetry::Full;
    objects[3].frames_visible = 7;
    objects
}

/// A map that equals the truth.
fn perfect(objects: &[TrueObject]) -> Vec<EstimatedObject> {
    let exact = |object: &TrueObject| EstimatedObject {
        label: object.label.clone(),
        world_from_object: object.oriented_box.world_from_box(),
        dimensions: object.oriented_box.lengths(),
    };
    objects.iter().map(exact).collect()
}

fn score(estimates: &[EstimatedObject], objects: &[TrueObject]) -> ObjectScore {
    score_objects(estimates, objects)
}

fn close(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} is not {expected}");
}

#[test]
fn the_truth_scores_full_marks() {
    let objects = room();
    let score = score(&perfect(&objects), &objects);
    assert_eq!(
        (score.recall(), score.precision(), score.label_accuracy()),
        (Some(1.0), Some(1.0), Some(1.0))
    );
    assert_eq!((score.asked, score.matches.len(), score.duplicates.len()), (3, 4, 0));
    close(score.mean_iou.unwrap(), 1.0, 1e-9);
    assert_eq!(score.center_error.unwrap().p95, 0.0);
    close(score.yaw_error_degrees.unwrap().p95, 0.0, 1e-6);
    assert_eq!(score.matches[2].yaw_error_degrees, None, "the cup is round");
    assert_eq!((score.matches[0].demand, score.matches[3].demand), (Demand::Asked, Demand::Optional));
}

#[test]
fn an_object_removed_is_missed_if_it_was_asked_for() {
    let objects = room();
    let mut estimates = perfect(&objects);
    // The book was seen in seven frames, too few to be asked for.
    estimates.remove(3);
    let optional = score(&estimates, &objects);
    assert_eq!((optional.recall(), optional.precision()), (Some(1.0), Some(1.0)));
    estimates.remove(0);
    let missed = score(&estimates, &objects);
    assert_eq!((missed.recall(), missed.precision(), missed.missed), (Some(2.0 / 3.0), Some(1.0), vec![10]));
}

#[test]
fn an_invented_object_costs_precision() {
    let objects = room();
    let mut estimates = perfect(&objects);
    estimates.insert(
        0,
        EstimatedObject {
            label: "tv".to_owned(),
            world_from_object: place([-2.0, -2.0, 1.0], 0.0),
            dimensions: [0.5, 0.2, 0.4],
        },
    );
    let score = score(&estimates, &objects);
    assert_eq!((score.recall(), score.precision()), (Some(1.0), Some(0.8)));
    assert_eq!((score.unmatched, score.duplicates.len()), (vec![0], 0));
}

#[test]
fn a_second_estimate_is_a_duplicate() {
    let objects = room();
    let mut estimates = perfect(&objects);
    // In turn: half as long, with IoU 0.5; a crumb inside the chair; one beside the screen, without overlap.
    let crumb = place([1.1, 0.1, 0.7], 0.0);
    estimates.push(EstimatedObject { dimensions: [0.25, 0.2, 0.4], ..estimates[0].clone() });
    estimates.push(EstimatedObject {
        world_from_object: crumb,
        dimensions: [0.05; 3],
        ..estimates[1].clone()
    });
    estimates
        .push(EstimatedObject { world_from_object: place([0.0, 2.0, 1.0], 0.0), ..estimates[0].clone() });
    let score = score(&estimates, &objects);
    assert_eq!((score.recall(), score.precision()), (Some(1.0), Some(4.0 / 7.0)));
    assert_eq!(score.unmatched, [4, 5, 6]);
    let pairs: Vec<(usize, usize)> =
        score.duplicates.iter().map(|found| (found.estimate, found.of)).collect();
    assert_eq!(pairs, [(4, 0), (5, 1)]);
}

#[test]
fn the_better_estimate_is_the_match() {
    let objects = room();
    let mut estimates = perfect(&objects);
    let good = estimates[0].clone();
    estimates[0].dimensions[0] = 0.25;
    estimates.push(good);
    let score = score(&estimates, &objects);
    let screen = score.matches.iter().find(|found| found.object == 10).unwrap();
    assert_eq!((screen.estimate, score.duplicates[0].estimate, score.duplicates[0].of), (4, 0, 4));
}

#[test]
fn two_objects_in_one_box_leave_one_missed() {
    // Two books side by side with one box around both: IoU 0.5 with either.
    let objects = vec![
        object(0, "book", [0.1, 0.0, 0.0], 0.0, [0.2, 0.3, 0.1]),
        object(1, "book", [-0.1, 0.0, 0.0], 0.0, [0.2, 0.3, 0.1]),
    ];
    let both = EstimatedObject {
        label: "book".to_owned(),
        world_from_object: Pose::identity(),
        dimensions: [0.4, 0.3, 0.1],
    };
    let score = score(&[both], &objects);
    assert_eq!((score.recall(), score.precision(), score.missed.len()), (Some(0.5), Some(1.0), 1));
    close(score.mean_iou.unwrap(), 0.5, 1e-12);
    close(score.center_error.unwrap().median, 0.1, 1e-12);
}

#[test]
fn the_assignment_is_the_best_in_sum() {
    // Taking the best pair first (0 with 0) would leave estimate 1 without a match.
    let objects =
        vec![object(0, "a", [0.0, 0.0, 0.0], 0.0, [1.0; 3]), object(1, "b", [0.8, 0.0, 0.0], 0.0, [1.0; 3])];
    let at = |x: f64| EstimatedObject {
        label: "a".to_owned(),
        world_from_object: place([x, 0.0, 0.0], 0.0),
        dimensions: [1.0; 3],
    };
    let score = score(&[at(0.3), at(-0.4)], &objects);
    let pairs: Vec<(usize, usize)> =
        score.matches.iter().map(|found| (found.estimate, found.object)).collect();
    assert_eq!(pairs, [(0, 1), (1, 0)]);
    close(score.mean_iou.unwrap(), 0.5 * (0.5 / 1.5 + 0.6 / 1.4), 1e-12);
}

#[test]
fn a_shifted_object_is_off_by_the_shift() {
    let objects = room();
    let mut estimates = perfect(&objects);
    let along = place([0.1, 0.0, 0.0], 0.0);
    estimates[0].world_from_object = estimates[0].world_from_object * along;
    let near = score(&estimates, &objects);
    close(near.matches[0].center_error, 0.1, 1e-12);
    close(near.matches[0].iou, 0.4 / 0.6, 1e-9);
    close(near.center_error.unwrap().p95, 0.1, 1e-12);
    assert_eq!(near.center_error.unwrap().median, 0.0);
    // Below IoU 0.25 (a shift of 0.3 m) there is no match.
    estimates[0].world_from_object = objects[0].oriented_box.world_from_box() * place([0.31, 0.0, 0.0], 0.0);
    let far = score(&estimates, &objects);
    assert_eq!((far.recall(), far.precision(), &far.unmatched[..]), (Some(2.0 / 3.0), Some(0.75), &[0][..]));
}

#[test]
fn yaw_counts_up_to_symmetry() {
    let objects = room();
    let yaw_error = |index: usize, turn: f64| {
        let mut estimates = perfect(&objects);
        let center = objects[index].oriented_box.center();
        let yaw = [10.0, 30.0, 0.0, -20.0][index];
        estimates[index].world_from_object = place(center, yaw + turn);
        score(&estimates, &objects).matches[index].yaw_error_degrees
    };
    // The screen: half a turn is no error.
    for (turn, error) in [(7.0, 7.0), (-7.0, 7.0), (180.0, 0.0), (187.0, 7.0), (30.0, 30.0)] {
        close(yaw_error(0, turn).unwrap(), error, 1e-6);
    }
    // The chair: a quarter turn is no error either, and no error exceeds an eighth of a turn.
    for (turn, error) in [(7.0, 7.0), (90.0, 0.0), (97.0, 7.0), (-180.0, 0.0), (45.0, 45.0), (60.0, 30.0)] {
        close(yaw_error(1, turn).unwrap(), error, 1e-6);
    }
    assert_eq!(yaw_error(2, 33.0), None);
}

#[test]
fn the_order_of_the_axes_does_not_matter() {
    let objects = room();
    let expected = score(&perfect(&objects), &objects);
    // x y z -> y z x, and a turn of 180 degrees about x: the same boxes with their axes renamed.
    let third = 2.0 * PI / 3.0;
    let diagonal = (0.5 * third).sin() / 3.0_f64.sqrt();
    let cycle = Pose::new([0.0; 3], [diagonal, diagonal, diagonal, (0.5 * third).cos()]).unwrap();
    let over = Pose::new([0.0; 3], [1.0, 0.0, 0.0, 0.0]).unwrap();
    let mut estimates = perfect(&objects);
    for estimate in &mut estimates {
        // The cycle takes x to y: the new x axis is the old y axis.
        let [x, y, z] = estimate.dimensions;
        estimate.world_from_object = estimate.world_from_object * cycle * over;
        estimate.dimensions = [y, z, x];
    }
    let actual = score(&estimates, &objects);
    assert_eq!((actual.recall(), actual.precision()), (expected.recall(), expected.precision()));
    close(actual.mean_iou.unwrap(), 1.0, 1e-9);
    close(actual.yaw_error_degrees.unwrap().p95, 0.0, 1e-5);
}

#[test]
fn a_wrong_label_is_a_match_all_the_same() {
    let objects = room();
    let mut estimates = perfect(&objects);
    estimates[1].label = "couch".to_owned();
    let score = score(&estimates, &objects);
    assert_eq!(
        (score.recall(), score.precision(), score.label_accuracy()),
        (Some(1.0), Some(1.0), Some(0.75))
    );
    assert_eq!(score.matches[1].label, LabelVerdict::Wrong);
}

#[test]
fn nothing_in_nothing_out() {
    let objects = room();
    let none = score(&[], &objects);
    assert_eq!((none.recall(), none.precision(), none.label_accuracy()), (Some(0.0), None, None));
    assert_eq!((none.mean_iou, none.center_error, none.yaw_error_degrees), (None, None, None));
    let unasked = score(&perfect(&objects), &[]);
    assert_eq!((unasked.recall(), unasked.precision(), unasked.unmatched.len()), (None, Some(0.0), 4));
    let empty = score(&[], &[]);
    assert_eq!((empty.recall(), empty.precision()), (None, None));
}

#[test]
fn estimates_that_are_no_boxes_match_nothing() {
    let objects = room();
    let mut estimates = perfect(&objects);
    let clean = score(&estimates, &objects);
    for dimensions in [[f64::NAN, 0.1, 0.1], [-1.0, 1.0, 1.0], [f64::INFINITY; 3], [0.0; 3], [0.5, 0.0, 0.4]]
    {
        estimates.push(EstimatedObject {
            label: "tv".to_owned(),
            world_from_object: place([0.0, -1.0, 1.0], 10.0),
            dimensions,
        });
    }
    let score = score(&estimates, &objects);
    assert_eq!((&score.matches, score.duplicates.len()), (&clean.matches, 0));
    assert_eq!(score.unmatched, [4, 5, 6, 7, 8]);
}

proptest! {
    #[test]
    fn neither_motion_nor_order_matters(
        axis in prop::array::uniform3(-1.0..1.0_f64), angle in -PI..PI,
        to in prop::array::uniform3(-50.0..50.0_f64), rotate_by in 0..5_usize,
        noise in prop::array::uniform4(prop::array::uniform3(-0.03..0.03_f64)),
    ) {
        let length = axis.iter().map(|c| c * c).sum::<f64>().sqrt();
        prop_assume!(length > 0.1);
        let [x, y, z] = axis.map(|c| c / length * (0.5 * angle).sin());
        let motion = Pose::new(to, [x, y, z, (0.5 * angle).cos()]).unwrap();
        let objects = room();
        let mut estimates = perfect(&objects);
        for (estimate, [shift, grow, yaw]) in estimates.iter_mut().zip(noise) {
            estimate.world_from_object = estimate.world_from_object * place([shift, -shift, grow], 100.0 * yaw);
            estimate.dimensions = estimate.dimensions.map(|length| length + grow);
        }
        estimates.push(estimates[1].clone());
        let expected = score(&estimates, &objects);

        let mut moved = estimates;
        for estimate in &mut moved {
            estimate.world_from_object = motion * estimate.world_from_object;
        }
        moved.rotate_left(rotate_by);
        let mut moved_objects = objects;
        for object in &mut moved_objects {
            object.oriented_box = object.oriented_box.transformed(&motion);
        }
        moved_objects.reverse();
        let actual = score(&moved, &moved_objects);
        prop_assert_eq!(actual.recall(), expected.recall());
        prop_assert_eq!(actual.precision(), expected.precision());
        prop_assert_eq!(actual.duplicates.len(), expected.duplicates.len());
        prop_assert_eq!(&actual.missed, &expected.missed);
        let figures = |score: &ObjectScore| {
            let (center, yaw) = (score.center_error.unwrap(), score.yaw_error_degrees.unwrap());
            [score.mean_iou.unwrap(), center.median, center.p95, yaw.median, yaw.p95]
        };
        for (a, b) in figures(&actual).into_iter().zip(figures(&expected)) {
            prop_assert!((a - b).abs() < 1e-5, "{} for {}", a, b);
        }
    }
}
