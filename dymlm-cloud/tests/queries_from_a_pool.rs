//! Queries of one map from rayon's threads and from others at the same time end. A program of its own, since the
//! pool is the process's.
#![cfg(feature = "parallel")]
#![allow(clippy::unwrap_used, reason = "tests")]

use std::sync::mpsc::channel;
use std::time::Duration;

use dymlm_cloud::{CloudMap, CloudMapConfig, Selection};
use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose, SensorModel};

/// A map that nobody has queried, so that the first query has work to do.
fn unread() -> CloudMap {
    let camera = PinholeCamera::new(160, 120, 128.0, 128.0, 79.5, 59.5).unwrap();
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    for step in 0..4 {
        let depth = (0..160 * 120).map(|pixel| 2.0 + (pixel % 160) as f32 / 128.0);
        let depth = DepthImage::new(160, 120, depth.collect()).unwrap();
        let frame = Frame::new(f64::from(step), camera, depth, None).unwrap();
        map.insert(&frame, None, &Pose::identity()).unwrap();
    }
    map
}

#[test]
fn queries_from_the_pool_and_from_outside_of_it_end() {
    // With one thread every wait is for itself.
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    let unread = unread();
    let expected = unread.clone().point_cloud(Selection::Static);
    let (done, is_done) = channel();
    std::thread::spawn(move || {
        for _ in 0..40 {
            let map = unread.clone();
            std::thread::scope(|scope| {
                for _ in 0..2 {
                    scope.spawn(|| assert!(map.point_cloud(Selection::Static) == expected));
                }
                rayon::scope(|pool| {
                    for _ in 0..8 {
                        pool.spawn(|_| assert!(map.point_cloud(Selection::Static) == expected));
                    }
                });
            });
        }
        done.send(()).unwrap();
    });
    is_done.recv_timeout(Duration::from_secs(60)).expect("a query waits for ever");
}

/// Regression: a thread of the pool that waited for the cache ran the next query on its own stack, which waited as
/// well, and so on until the stack was full.
#[test]
fn thousands_of_queries_wait_for_one_who_holds_the_verdicts() {
    let map = unread();
    let place = [0.0, 0.0, 2.5];
    let expected = map.verdicts().at(place);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    std::thread::scope(|scope| {
        let held = map.verdicts();
        let queries = scope.spawn(|| {
            pool.scope(|pool| {
                for _ in 0..20_000 {
                    pool.spawn(|_| assert_eq!(map.verdicts().at(place), expected));
                }
            });
        });
        std::thread::sleep(Duration::from_millis(500));
        drop(held);
        queries.join().unwrap();
    });
}

#[test]
fn whoever_holds_the_verdicts_may_query_the_map() {
    let map = unread();
    let place = [0.0, 0.0, 2.5];
    let expected = map.verdicts().at(place);
    let held = map.verdicts();
    assert_eq!(map.verdicts().at(place), expected);
    assert_eq!(map.clone().verdicts().at(place), expected);
    assert!(map.memory_bytes() > 0);
    assert!(map.point_cloud(Selection::Static).len() > 100);
    assert_eq!(held.at(place), expected);
}
