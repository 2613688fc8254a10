//! Property tests: whatever has happened in sessions, and in whatever order their maps are merged, the maps
//! are those of one builder.

use std::sync::Arc;

use dymlm_core::{DepthImage, Frame, FrameId, PinholeCamera, Pose};
use proptest::prelude::*;

use crate::common::{fingerprint, fingerprint_without_ids, poses};
use crate::random_session::{Correction, FRAMES, Session, Step, few, moved, session};
use crate::{Error, MapBuilder, MultiLevelMap};

/// Where in the walk a session begins, what its clock shows then, and what happens in it.
type Recording = (usize, f64, Vec<Step>);

fn recording() -> impl Strategy<Value = Recording> {
    // Robots that record at the same time, one after the other, or on clocks that begin anew.
    let start = prop_oneof![Just(0.0), Just(3.0), 0.0..20.0, 1.79e9..1.80e9];
    (0..FRAMES / 2, start, session())
}

fn map((next, time, steps): &Recording) -> MultiLevelMap {
    let mut session = Session::starting(*next, *time);
    for step in steps {
        session.take(step);
    }
    session.builder.map().clone()
}

/// Merges the maps in the order and by the tree that `choices` gives.
fn merged(mut maps: Vec<MultiLevelMap>, choices: &[usize]) -> MultiLevelMap {
    let mut choices = choices.iter().cycle();
    while maps.len() > 1 {
        let mut next = |count: usize| choices.next().map_or(0, |choice| choice % count);
        let other = maps.remove(next(maps.len()));
        let into = next(maps.len());
        maps[into].merge(&other, &Pose::identity()).unwrap();
    }
    maps.remove(0)
}

fn frames(count: usize) -> Vec<Step> {
    vec![Step::Frame { is_detector_run: true }; count]
}

fn resumed(map: &MultiLevelMap, next: usize, steps: &[Step]) -> MultiLevelMap {
    // The clocks of two branches, and of what they go on with, differ: a session that begins with the same frame
    // at the same time would be the same.
    let mut session = Session::starting(next, next as f64 / 64.0);
    session.builder = MapBuilder::resume(map.clone()).unwrap();
    for step in steps {
        session.take(step);
    }
    session.builder.map().clone()
}

proptest! {
    #![proptest_config(few(3))]

    #[test]
    fn merging_is_commutative_and_associative_to_the_bit(
        recordings in prop::collection::vec(recording(), 2..5),
        choices in [prop::collection::vec(0..100_usize, 8), prop::collection::vec(0..100_usize, 8)],
    ) {
        // Two sessions that begin with the same frame at the same time would be one recording that differs; the
        // fraction of a second is that of further sessions too.
        let begun = |(k, (next, start, steps)): (usize, Recording)| (next, start + 0.125 * k as f64, steps);
        let maps: Vec<MultiLevelMap> = recordings.into_iter().enumerate().map(begun).map(|it| map(&it)).collect();
        let [one, other] = choices.map(|choices| merged(maps.clone(), &choices));
        prop_assert!(fingerprint(&one) == fingerprint(&other));
        let [one, other] = [one, other].map(|map| MapBuilder::resume(map).unwrap());
        prop_assert_eq!(poses(&one), poses(&other));

        // Built from nothing, in another way, they are the same.
        let mut again = one;
        let right = poses(&again);
        again.transform(&moved(7.0, 0.5)).unwrap();
        again.correct_poses(&right).unwrap();
        prop_assert!(fingerprint_without_ids(again.map()) == fingerprint_without_ids(other.map()));
    }

    /// Maps that go on from the same session have that session once.
    #[test]
    fn what_both_know_is_there_once(
        first in recording(),
        branches in [session(), session()],
    ) {
        let trunk = map(&first);
        // A correction of the trunk in one branch alone would make it another session.
        let only_adds = |step: &&Step| !matches!(step, Step::Correct(_) | Step::Remove { .. });
        let [one, other] = [3, 5].map(|next| {
            let steps: Vec<Step> = branches[usize::from(next == 5)].iter().filter(only_adds).cloned().collect();
            resumed(&trunk, next, &steps)
        });
        let mut with_trunk = one.clone();
        let report = with_trunk.merge(&trunk, &Pose::identity()).unwrap();
        prop_assert!(report.sessions.iter().all(|session| session.own == Some(session.first)));
        let both = [vec![one.clone(), other.clone()], vec![other, trunk, one]];
        let [both, again] = both.map(|maps| merged(maps, &[0]));
        prop_assert!(fingerprint(&both) == fingerprint(&again));
    }
}

/// Here the masks of the second session do not depend on the first.
#[test]
fn merged_maps_are_those_of_one_builder_that_was_told_of_both_sessions() {
    let mut one = Session::starting(0, 0.0);
    for step in frames(5) {
        one.take(&step);
    }
    let first = one.builder.map().clone();
    one.take(&Step::BeginSession);
    one.set_clock(100.0);
    for step in frames(5) {
        one.take(&step);
    }
    let second = map(&(5, 100.0, frames(5)));
    for maps in [vec![first.clone(), second.clone()], vec![second, first]] {
        let merged = merged(maps, &[0]);
        assert!(fingerprint(&merged) == fingerprint(one.builder.map()));
        assert_eq!(poses(&MapBuilder::resume(merged).unwrap()), poses(&one.builder));
    }
}

#[test]
fn maps_that_were_resumed_in_vain_merge_with_those_that_went_on() {
    let mut trunk = Session::starting(0, 100.0);
    let take = |session: &mut Session, count: usize| {
        for step in frames(count) {
            session.take(&step);
        }
    };
    take(&mut trunk, 5);
    let before = trunk.builder.map().clone();
    let resumed_in_vain = resumed(&resumed(&before, 0, &[]), 0, &[]);
    take(&mut trunk, 3);
    let went_on = trunk.builder.map();
    for (one, other) in [(&resumed_in_vain, went_on), (went_on, &resumed_in_vain)] {
        assert!(fingerprint(&merged(vec![one.clone(), other.clone()], &[0])) == fingerprint(went_on));
    }
    let pairs = [vec![before.clone(), resumed_in_vain.clone()], vec![resumed_in_vain, before]];
    let [one, other] = pairs.map(|maps| merged(maps, &[0]));
    assert!(fingerprint(&one) == fingerprint(&other));
}

#[test]
fn what_comes_later_is_mapped_alone() {
    let [first, second] = [(0, 100.0), (6, 200.0)].map(|(next, time)| map(&(next, time, frames(6))));
    let mut merged = first.clone();
    let report = merged.merge(&second, &Pose::identity()).unwrap();
    assert_eq!((report.key_frames, report.mapped_again), (12, 6));
    let firsts: Vec<_> = report.sessions.iter().map(|it| (it.first.get(), it.own, it.other)).collect();
    let zero = Some(FrameId::new(0));
    assert_eq!(firsts, [(0, zero, None), (6, None, zero)]);
    // The older map's ids stay, and the other's ids lead to the same things where both saw the same.
    assert!(report.own.planes.len() >= 3 && report.own.planes.iter().all(|(old, new)| old == new));
    assert!(report.own.objects.iter().all(|(old, new)| old == new));
    assert!(report.other.planes.values().any(|plane| report.own.planes.contains_key(plane)));

    let mut the_other_way = second;
    let report = the_other_way.merge(&first, &Pose::identity()).unwrap();
    assert_eq!((report.key_frames, report.mapped_again), (12, 6));
    assert!(fingerprint(&the_other_way) == fingerprint(&merged));
}

#[test]
fn the_other_world_is_brought_to_this_one() {
    let here = map(&(0, 100.0, frames(6)));
    let mut there = MapBuilder::resume(map(&(6, 200.0, frames(6)))).unwrap();
    let mut straight = here.clone();
    straight.merge(there.map(), &Pose::identity()).unwrap();
    let there_from_here = moved(2.0, 0.4);
    there.transform(&there_from_here).unwrap();
    let mut merged = here;
    merged.merge(there.map(), &there_from_here.inverse()).unwrap();
    let [counts, expected] = [&merged, &straight].map(MultiLevelMap::counts);
    let differ = counts.cloud_voxels.abs_diff(expected.cloud_voxels);
    // By the rounding of a pose, a reading at the border of a voxel may fall into the voxel beside.
    assert!(differ * 1000 < expected.cloud_voxels, "{counts:?} {expected:?}");
    assert_eq!((counts.planes, counts.objects), (expected.planes, expected.objects));
}

#[test]
fn maps_that_do_not_fit_are_refused_by_name_and_nothing_changes() {
    let own = map(&(0, 0.0, frames(3)));
    let refused = |other: &MultiLevelMap| {
        let mut merged = own.clone();
        let error = merged.merge(other, &Pose::identity()).unwrap_err();
        assert!(fingerprint(&merged) == fingerprint(&own));
        error
    };
    let with = |change: fn(&mut crate::MapConfig)| {
        let mut config = own.config().clone();
        change(&mut config);
        refused(MapBuilder::new(config).unwrap().map()).to_string()
    };
    let said = with(|config| config.cloud.voxel_size = 0.02);
    assert_eq!(said, "the maps were made with different configs: cloud.voxel_size is 0.05 and 0.02");
    assert!(with(|config| config.octree.resolution = 0.1).ends_with("octree.resolution is 0.2 and 0.1"));
    assert!(with(|config| config.sensor.max_depth = 3.0).ends_with(": sensor"));
    assert!(with(|config| config.history = crate::HistoryConfig::None).starts_with("no key-frame"));

    // The same recording, with other poses in one map.
    let mut corrected = Session::new();
    for step in frames(3) {
        corrected.take(&step);
    }
    corrected.correct(&Correction { chosen: vec![1], metres: 0.2, radians: 0.0 });
    let error = refused(corrected.builder.map());
    assert!(matches!(error, Error::SessionsDiffer { .. }), "{error}");
}

/// Machines of a fleet have other folders, memory and intervals; the other's sessions may be the first.
#[test]
fn the_merged_maps_have_the_config_of_the_map_that_was_merged_into() {
    let [early, late] = [0.0, 50.0].map(|time| map(&(0, time, frames(3))));
    for [into, other] in [[&late, &early], [&early, &late]] {
        let (mut into, mut other) = (into.clone(), other.clone());
        Arc::make_mut(&mut other.config).publish_interval = 7.0;
        let config = Arc::clone(&into.config);
        into.merge(&other, &Pose::identity()).unwrap();
        assert!(into.config() == &*config);
    }
}

/// Regression: what is up was compared as if both worlds were parallel.
#[test]
fn maps_whose_up_is_given_in_their_own_worlds_merge() {
    let turn = Pose::new([1.0, 0.0, 0.0], [0.6, 0.0, 0.0, 0.8]).unwrap();
    let [early, late] = [0.0, 50.0].map(|time| map(&(0, time, frames(3))));
    let with_up = |map: &MultiLevelMap, up: [f64; 3]| {
        let mut map = map.clone();
        Arc::make_mut(&mut map.config).objects.parameterization.up = Some(up);
        map
    };
    let up = [0.0, 0.0, 2.0];
    let mut merged = with_up(&early, up);
    merged.merge(&with_up(&late, turn.rotate([0.0, 0.0, 1.0])), &turn.inverse()).unwrap();
    assert_eq!((merged.sessions().len(), merged.config().objects.parameterization.up), (2, Some(up)));
    let error = with_up(&early, up).merge(&with_up(&late, [1.0, 0.0, 0.0]), &turn.inverse()).unwrap_err();
    assert!(matches!(error, Error::ConfigsDiffer { .. }), "{error}");
}

/// What a session's first key frame has shown may be mended or taken out later: it is the same session.
#[test]
fn a_session_whose_first_key_frame_is_gone_in_one_map_is_the_same_session() {
    let whole = map(&(0, 0.0, frames(3)));
    let beheaded = map(&(0, 0.0, [frames(3), vec![Step::Remove { which: 0 }]].concat()));
    assert_eq!(key_frames(&beheaded), 2);
    let error = whole.clone().merge(&beheaded, &Pose::identity()).unwrap_err();
    assert!(matches!(error, Error::SessionsDiffer { .. }), "{error}");
}

/// Regression: they counted as one session that differs.
#[test]
fn sessions_that_begin_without_a_reading_are_told_apart_by_what_comes_then() {
    let [one, other] = [2.0, 3.0].map(|depth| {
        let mut builder = Session::new().builder;
        let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).unwrap();
        builder.insert_scan(0.0, &[], &Pose::identity()).unwrap();
        for (time, depth) in [(1.0, 0.0), (2.0, depth)] {
            let depth = DepthImage::new(64, 48, vec![depth; 64 * 48]).unwrap();
            builder.insert(&Frame::new(time, camera, depth, None).unwrap(), &[], &Pose::identity()).unwrap();
        }
        builder.map().clone()
    });
    let mut merged = one.clone();
    let report = merged.merge(&other, &Pose::identity()).unwrap();
    assert_eq!((report.sessions.len(), report.key_frames), (2, 4));
    let mut the_other_way = other;
    the_other_way.merge(&one, &Pose::identity()).unwrap();
    assert!(fingerprint(&merged) == fingerprint(&the_other_way));
}

/// Merged by a tree, each key frame is mapped again at most once a level; merged in the order of time, once
/// in all.
#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn forty_sessions_by_a_tree_and_in_sequence() {
    const SESSIONS: usize = 40;
    let recording = |index: usize| map(&(index % FRAMES, 100.0 * index as f64, frames(2)));
    let maps: Vec<MultiLevelMap> = (0..SESSIONS).map(recording).collect();
    let key_frames: usize = maps.iter().map(key_frames).sum();

    let mut mapped_again = 0;
    let mut tree = maps.clone();
    while tree.len() > 1 {
        let pairs = tree.chunks(2).map(|pair| {
            let mut one = pair[0].clone();
            if let Some(other) = pair.get(1) {
                mapped_again += one.merge(other, &Pose::identity()).unwrap().mapped_again;
            }
            one
        });
        tree = pairs.collect();
    }
    let levels = usize::BITS as usize - (SESSIONS - 1).leading_zeros() as usize;
    assert!(mapped_again <= key_frames * levels, "{mapped_again} of {key_frames} key frames");

    let mut sequence = maps[0].clone();
    let again: Vec<usize> = maps[1..]
        .iter()
        .map(|other| sequence.merge(other, &Pose::identity()).unwrap().mapped_again)
        .collect();
    assert_eq!(again.iter().sum::<usize>(), key_frames - self::key_frames(&maps[0]));
    assert!(fingerprint(&sequence) == fingerprint(&tree[0]));
    assert_eq!(self::key_frames(&sequence), key_frames);
}

fn key_frames(map: &MultiLevelMap) -> usize {
    map.past.log.as_ref().map_or(0, |log| log.key_frames().count())
}

/// Regression: what happened in the trunk, in a session without frames, was taken for a part of the branches'
/// sessions, and happened again in each.
#[test]
fn what_happened_before_the_branches_began_happens_once() {
    let put_down =
        [Step::Frame { is_detector_run: true }, Step::BeginSession, Step::PutDown { which: 0, by: 0.1 }];
    let trunk = map(&(0, 0.0, put_down.to_vec()));
    let [one, other] = [3, 5].map(|next| resumed(&trunk, next, &frames(4)));
    let [both, again] =
        [vec![one.clone(), other.clone()], vec![other, trunk, one]].map(|maps| merged(maps, &[0]));
    assert!(fingerprint(&both) == fingerprint(&again));
}

/// A session found by chance: a builder that was told of a session before its first frame was said to have
/// recorded something else.
#[test]
fn a_session_that_begins_before_anything_happened_is_the_first() {
    let short = map(&(4, 0.0, frames(3)));
    let longer = map(&(4, 0.0, [vec![Step::BeginSession; 2], frames(4)].concat()));
    for (one, other) in [(&short, &longer), (&longer, &short)] {
        let mut merged = one.clone();
        let report = merged.merge(other, &Pose::identity()).unwrap();
        assert_eq!((report.key_frames, report.sessions.len()), (4, 1));
        assert!(fingerprint(&merged) == fingerprint(&longer));
    }
}

/// What decides is whether a frame has come, not whether an event is left.
#[test]
fn a_session_after_one_whose_only_frame_was_removed_is_another() {
    let emptied = [frames(1), vec![Step::Remove { which: 0 }, Step::BeginSession], frames(3)].concat();
    let (mut merged, other) = (map(&(4, 0.5, emptied)), map(&(0, 100.0, frames(2))));
    let report = merged.merge(&other, &Pose::identity()).unwrap();
    assert_eq!((report.key_frames, report.sessions.len()), (5, 3));
    // All of them are in the maps: taken out, they leave nothing.
    let mut builder = MapBuilder::resume(merged).unwrap();
    for (frame, _) in poses(&builder) {
        builder.remove(frame).unwrap();
    }
    assert_eq!(builder.map().counts().cloud_voxels, 0);
}
