//! A map whose far blocks are in a file is the map that it is in memory.

use dymlm_cloud::{CloudMap, CloudMapConfig, CloudPager, Selection};
use dymlm_core::{ColorImage, DepthImage, Frame, PinholeCamera, Pose, SensorModel};
use dymlm_test_support::cases;
use proptest::prelude::*;

const WIDTH: usize = 48;
const HEIGHT: usize = 36;
/// Metres from one place to the next: what is seen from one is not seen from the others.
const APART: f64 = 20.0;

fn empty() -> CloudMap {
    let mut config = CloudMapConfig::default();
    config.voxel_size = 0.02;
    CloudMap::new(config, SensorModel::kinect()).unwrap()
}

/// A wall with steps in it, and a thing before it that comes and goes; seen from one of some places.
fn view(step: usize, place: usize) -> (Frame, Pose) {
    let pixels = || (0..HEIGHT).flat_map(|v| (0..WIDTH).map(move |u| (u, v)));
    let thing = 8 * (step / 16 % 4);
    let depth = |(u, v): (usize, usize)| match u {
        _ if (thing..thing + 6).contains(&u) => 1.3,
        _ => 2.0 + 0.2 * ((u / 8 + v / 12 + place) % 3) as f32,
    };
    let depth = DepthImage::new(WIDTH, HEIGHT, pixels().map(depth).collect()).unwrap();
    let color = pixels().map(|(u, v)| [u as u8, v as u8, place as u8]).collect();
    let color = ColorImage::new(WIDTH, HEIGHT, color).unwrap();
    let camera = PinholeCamera::new(WIDTH, HEIGHT, 40.0, 40.0, 23.5, 17.5).unwrap();
    let frame = Frame::new(0.2 * step as f64, camera, depth, Some(color)).unwrap();
    let shift = 0.03 * (step % 7) as f64;
    (frame, Pose::new([APART * place as f64 + shift, 0.5 * shift, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap())
}

fn insert(map: &mut CloudMap, step: usize, place: usize) {
    let (frame, pose) = view(step, place);
    map.insert(&frame, None, &pose).unwrap();
}

fn assert_same(paged: &CloudMap, whole: &CloudMap) {
    for selection in [Selection::Static, Selection::All] {
        assert!(paged.point_cloud(selection) == whole.point_cloud(selection), "{selection:?}");
    }
    assert!(paged.voxels(Selection::All).eq(whole.voxels(Selection::All)));
    assert_eq!((paged.len(), paged.held_voxels()), (whole.len(), whole.held_voxels()));
}

#[cfg(feature = "state")]
fn saved(map: &CloudMap) -> Vec<(u64, Option<Vec<u8>>)> {
    let mut parts = Vec::new();
    map.save_state(None, &mut |part, bytes| {
        parts.push((part, bytes.map(<[u8]>::to_vec)));
        Ok(())
    })
    .unwrap();
    parts
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(3)))]

    /// Goes from place to place and back; reads, forgets, takes out, clones in between.
    #[test]
    fn a_map_within_a_budget_is_the_map_without(
        places in prop::collection::vec((0_usize..3, 33_usize..80, 0_u8..6), 3..7),
    ) {
        let (mut paged, mut whole) = (empty(), empty());
        let mut pager = CloudPager::new(&std::env::temp_dir()).unwrap();
        let mut earlier = [paged.clone(), whole.clone()];
        let mut step = 0;
        for (place, frames, then) in places {
            for _ in 0..frames {
                step += 1;
                insert(&mut paged, step, place);
                insert(&mut whole, step, place);
                pager.page_out(&mut paged, || 0).unwrap();
            }
            match then {
                0 => assert_same(&paged, &whole),
                1 => {
                    let center = [APART * place as f64, 0.0, 2.0];
                    paged.forget_outside(center, APART + 1.0);
                    whole.forget_outside(center, APART + 1.0);
                }
                2 => {
                    let (frame, pose) = view(step, place);
                    paged.remove(&frame, None, &pose).unwrap();
                    whole.remove(&frame, None, &pose).unwrap();
                }
                3 => prop_assert_eq!(paged.changes_since(&earlier[0]), whole.changes_since(&earlier[1])),
                4 => {
                    earlier[0].page_out_like(&paged);
                    assert_same(&earlier[0], &earlier[1]);
                    earlier = [paged.clone(), whole.clone()];
                }
                _ => {
                    let [boxes, whole_boxes] = [&paged, &whole].map(|map| {
                        map.verdicts().ghost_boxes_since(0).collect::<Vec<_>>()
                    });
                    prop_assert_eq!(boxes, whole_boxes);
                }
            }
        }
        #[cfg(feature = "state")]
        prop_assert!(saved(&paged) == saved(&whole));
        assert_same(&paged, &whole);
    }
}

#[test]
fn memory_is_that_of_one_place_though_there_are_ten() {
    let mut map = empty();
    let mut pager = CloudPager::new(&std::env::temp_dir()).unwrap();
    let mut most = 0;
    let mut first = 0;
    for place in 0..10 {
        for step in 0..100 {
            insert(&mut map, 100 * place + step, place);
            pager.page_out(&mut map, || 2 * first).unwrap();
            if place > 2 {
                most = most.max(map.memory_bytes());
            }
        }
        if place == 0 {
            map.point_cloud(Selection::Static);
            first = map.memory_bytes();
        }
    }
    assert!(most < 4 * first, "{most} bytes with ten places, {first} with one");
    // Reading all of it leaves it where it is, and so does working out what of it is static.
    assert!(map.point_cloud(Selection::All).len() > 9 * map.held_voxels() / 10);
    assert!(map.len() > map.held_voxels() / 2);
    assert!(map.memory_bytes() < 4 * first);

    // So do exports, merges and comparisons, and forgetting does not read what stays.
    assert_eq!(map.voxels(Selection::All).count(), map.held_voxels());
    assert!(map.memory_bytes() < 4 * first, "after an export");
    let mut whole = empty();
    whole.merge(&map).unwrap();
    assert_eq!((whole.held_voxels(), whole.len()), (map.held_voxels(), map.len()));
    assert!(map.memory_bytes() < 4 * first, "after a merge");
    assert!(whole.changes_since(&map).is_empty() && !map.changes_since(&empty()).is_empty());
    assert!(map.memory_bytes() < 4 * first, "after comparisons");
    let (before, held) = (map.memory_bytes(), map.held_voxels());
    map.forget_outside([0.0, 0.0, 2.0], APART * 8.5);
    assert!((8 * held / 10..held).contains(&map.held_voxels()));
    assert_eq!(map.held_voxels(), map.voxels(Selection::All).count());
    assert!(map.memory_bytes() <= before, "after forgetting");
}
