//! Property tests: whatever happens in a session, and whichever poses are corrected in whatever order, the
//! maps are those of their frames at their poses.

use dymlm_core::FrameId;
use proptest::prelude::*;

use crate::MapBuilder;
#[cfg(feature = "io")]
use crate::common::fingerprint;
use crate::common::{fingerprint_without_ids, ids, poses};
use crate::random_session::{Correction, FRAMES, Session, Step, correction, few, moved, session};

/// A session with corrections of poses in its middle: what comes afterwards meets things that kept the ids of
/// earlier maps.
fn corrected_session() -> impl Strategy<Value = Vec<Step>> {
    (session(), prop::collection::vec((0..24_usize, correction()), 1..4)).prop_map(
        |(mut steps, corrections)| {
            for (place, correction) in corrections {
                steps.insert(place % steps.len(), Step::Correct(correction));
            }
            steps
        },
    )
}

/// Corrects a session and corrects it back: the maps are the first again, and ids still lead to things.
fn check_corrected_back(steps: &[Step], corrections: &[Correction]) {
    let mut session = Session::run(steps);
    let (planes, objects) = ids(session.builder.map());
    check_maps_corrected_back(&mut session, corrections);
    // The id of a thing that was merged on the way leads to the thing that it was merged into.
    let map = session.builder.map();
    assert!(planes.into_iter().all(|id| map.planes().current_id(id).is_some()));
    assert!(objects.into_iter().all(|id| map.objects().object(id).is_some()));
}

fn check_maps_corrected_back(session: &mut Session, corrections: &[Correction]) {
    let right = poses(&session.builder);
    let first = fingerprint_without_ids(session.builder.map());
    for correction in corrections {
        session.correct(correction);
        session.check_copy();
    }
    // This builds all maps from the beginning.
    session.builder.transform(&moved(7.0, 0.5)).unwrap();
    session.builder.correct_poses(&right).unwrap();
    session.check_copy();
    assert_eq!(poses(&session.builder), right);
    assert!(fingerprint_without_ids(session.builder.map()) == first);
}

/// Runs sessions one after the other, each from a given frame of the walk on, with the maps of the one
/// before.
fn run_one_after_the_other(sessions: &[(usize, Vec<Step>)]) -> Session {
    let mut current = Session::new();
    for (place, (next, steps)) in sessions.iter().enumerate() {
        let map = current.builder.map().clone();
        current = Session::starting(*next, 0.0);
        if place > 0 {
            current.builder = MapBuilder::resume(map).unwrap();
        }
        for step in steps {
            current.take(step);
        }
    }
    current.check_copy();
    current
}

/// Takes all frames of a session out of the maps, in a given order: the maps are empty then.
fn check_nothing_left(steps: &[Step], order: impl IntoIterator<Item = u64>) {
    let mut session = Session::run(steps);
    let frames = poses(&session.builder).len() as u64;
    for id in order.into_iter().filter(|&id| id < frames) {
        session.builder.remove(FrameId::new(id)).unwrap();
        session.check_copy();
    }
    let counts = session.builder.map().counts();
    assert_eq!((counts.cloud_voxels, counts.octree_leaves, counts.planes, counts.objects), (0, 0, 0, 0));
    assert_eq!(ids(session.builder.map()), (Vec::new(), Vec::new()));
}

proptest! {
    #![proptest_config(few(3))]

    /// This holds for what was forgotten, carried and put down on the way, too.
    #[test]
    fn corrected_back_the_maps_are_the_first_to_the_bit(
        steps in session(),
        corrections in prop::collection::vec(correction(), 1..3),
    ) {
        check_corrected_back(&steps, &corrections);
    }

    /// A further session meets what an earlier one has mapped, and what was corrected there.
    #[test]
    fn what_was_corrected_goes_on_as_what_was_built_so(
        sessions in prop::collection::vec((0..FRAMES / 2, corrected_session()), 1..3),
        corrections in prop::collection::vec(correction(), 0..3),
    ) {
        check_maps_corrected_back(&mut run_one_after_the_other(&sessions), &corrections);
    }

    /// The maps do not depend on how many corrections come after the frames, in which order, and how many
    /// poses each has.
    #[test]
    fn only_the_last_poses_count(
        steps in session(),
        corrections in prop::collection::vec(correction(), 2..5),
    ) {
        let is_uncorrected =
            |step: &&Step| !matches!(step, Step::Correct(_) | Step::Remove { .. } | Step::PutDown { .. });
        let steps: Vec<Step> = steps.iter().filter(is_uncorrected).cloned().collect();
        let mut session = Session::run(&steps);
        for correction in &corrections {
            session.correct(correction);
        }
        let mut again = Session::run(&steps);
        again.builder.correct_poses(&poses(&session.builder)).unwrap();
        prop_assert!(
            fingerprint_without_ids(again.builder.map()) == fingerprint_without_ids(session.builder.map())
        );
    }

    #[test]
    fn without_its_frames_a_session_leaves_nothing(
        steps in session(),
        order in Just((0..FRAMES as u64).collect::<Vec<_>>()).prop_shuffle(),
    ) {
        check_nothing_left(&steps, order);
    }
}

#[cfg(feature = "io")]
proptest! {
    #![proptest_config(few(2))]

    #[test]
    fn maps_that_were_saved_and_loaded_go_on_to_the_same_bits(
        steps in session(),
        cut in 0..20_usize,
        last in correction(),
    ) {
        let mut steps = steps;
        steps.insert(cut % steps.len(), Step::BeginSession);
        check_saved_and_loaded(&steps, &last);
    }
}

/// Saves and loads the maps in the middle of a session: they stay the same as without.
#[cfg(feature = "io")]
fn check_saved_and_loaded(steps: &[Step], last: &Correction) {
    let folder = tempfile::tempdir().unwrap();
    let mut direct = Session::run(steps);
    let mut loaded = Session::run_saved(steps, &folder.path().join("map"));
    for _ in 0..2 {
        assert!(fingerprint(loaded.builder.map()) == fingerprint(direct.builder.map()));
        assert_eq!(poses(&loaded.builder), poses(&direct.builder));
        direct.correct(last);
        loaded.correct(last);
    }
}

#[test]
fn there_is_something_in_the_sessions() {
    let steps: Vec<Step> = (0..FRAMES).map(|_| Step::Frame { is_detector_run: true }).collect();
    let session = Session::run(&steps);
    let counts = session.builder.map().counts();
    assert!(counts.cloud_voxels > 1000 && counts.octree_leaves > 300, "{counts:?}");
    assert!(counts.planes >= 3 && counts.objects >= 3, "{counts:?}");
}

fn frames(detected: &[bool]) -> Vec<Step> {
    detected.iter().map(|&is_detector_run| Step::Frame { is_detector_run }).collect()
}

/// Regression: one map merged two ids, the next merged them the other way round, and both things went. Their
/// ids led to each other, and looking one up never ended.
#[test]
fn merged_ids_of_two_maps_do_not_lead_round_in_a_circle() {
    let mut steps = frames(&[false, true, false, false, true, false, false, true]);
    steps.push(Step::Forget { radius: 1.0 });
    check_nothing_left(&steps, 0..8);
}

#[test]
fn what_vanished_after_it_was_put_down_is_put_down_again() {
    let mut steps = vec![Step::Frame { is_detector_run: true }; 3];
    steps.push(Step::PutDown { which: 0, by: 0.1 });
    steps.extend(vec![Step::Frame { is_detector_run: false }; 8]);
    check_corrected_back(&steps, &[]);
}

#[test]
fn the_same_object_is_put_down_again_after_it_was_one_with_another() {
    let away =
        |chosen: usize, metres: f64, radians: f64| Correction { chosen: vec![chosen], metres, radians };
    let mut steps = frames(&[false, true, false]);
    steps.push(Step::Correct(away(0, -0.145_098_309_393_193_65, 0.067_525_432_119_628_91)));
    steps.extend(frames(&[false; 3]));
    steps.push(Step::PutDown { which: 5, by: 0.605_813_115_440_317_5 });
    steps.extend(frames(&[false, false, true]));
    check_corrected_back(&steps, &[away(2, 0.118_289_911_335_110_98, 0.0)]);
}

/// Regression: a correction gave objects their earlier ids, which were no longer in the order in which the
/// objects came into the map; and what came afterwards was fused in the order of the ids.
#[test]
fn what_comes_after_a_correction_is_fused_in_the_same_order() {
    let mut first = frames(&[false, false, true, false, false, true, true]);
    first.push(Step::Correct(Correction {
        chosen: vec![3],
        metres: 0.291_984_579_082_277_15,
        radians: -0.039_220_069_732_349_53,
    }));
    first.push(Step::Remove { which: 0 });
    let further = frames(&[false, false, false, false, true]);
    check_maps_corrected_back(&mut run_one_after_the_other(&[(6, first), (3, further)]), &[]);
}

/// Regression: how often the detector runs decides how far the motion of boxes may be predicted, and that was
/// not saved.
#[cfg(feature = "io")]
#[test]
fn what_was_loaded_knows_when_the_detector_ran_last() {
    let [mut steps, further] = [frames(&[true]), frames(&[true])];
    steps.push(Step::BeginSession);
    steps.extend(further);
    check_saved_and_loaded(&steps, &Correction { chosen: vec![0], metres: 0.0, radians: 0.0 });
}

/// A session found by chance: the cells beside the forgotten ones kept the verdict for which those had voted.
#[cfg(feature = "io")]
#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn what_is_forgotten_votes_no_more_on_the_cells_beside_it() {
    let correct = |metres| Step::Correct(Correction { chosen: vec![0], metres, radians: 0.0 });
    let mut steps = vec![Step::Scan];
    steps.extend(frames(&[false; 10]));
    steps.extend([correct(-0.122), correct(-0.069)]);
    steps.extend(frames(&[false; 2]));
    steps.extend([Step::Forget { radius: 3.44 }, Step::BeginSession]);
    let last = Correction { chosen: vec![12, 9, 1, 2], metres: -0.075, radians: 0.076 };
    check_saved_and_loaded(&steps, &last);
}
