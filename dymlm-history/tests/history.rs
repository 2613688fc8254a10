//! Observations and scans in memory and in a file, and the bytes that one takes.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::PathBuf;
use std::sync::Arc;

use dymlm_core::{ColorImage, DepthImage, Frame, PinholeCamera, Point, SensorModel};
use dymlm_history::{Error, History, HistoryConfig, Observation};
use dymlm_planes::{PlaneDetector, PlaneDetectorConfig};
use dymlm_test_support::{recorded_frames, recording};

fn observation(number: usize) -> Arc<Observation> {
    let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).unwrap();
    let depth = (0..64 * 48).map(|i| 1.0 + 0.001 * ((i * number) % 300) as f32).collect();
    let depth = DepthImage::new(64, 48, depth).unwrap();
    let frame = Frame::new(number as f64, camera, depth, None).unwrap();
    Arc::new(Observation::of_frame(&frame).unwrap())
}

#[test]
fn what_is_kept_comes_back_whether_it_is_packed_yet_or_not() {
    let folder = tempfile::tempdir().unwrap();
    for config in [HistoryConfig::Memory, HistoryConfig::Folder(folder.path().into())] {
        let mut history = History::new(&config).unwrap().unwrap();
        let numbers: Vec<usize> = (0..40).map(|number| history.push(observation(number))).collect();
        assert!(numbers.iter().copied().eq(0..40));
        for is_packed in [false, true] {
            if is_packed {
                history.settle();
            }
            history.remove(7);
            for number in (0..40).filter(|&number| number != 7) {
                assert!(history.get(number).unwrap() == observation(number));
            }
            assert!(matches!(history.get(7), Err(Error::Unknown { index: 7 })));
            assert!(matches!(history.get(40), Err(Error::Unknown { index: 40 })));
        }
        let in_memory = 40 * observation(1).frame.depth().data().len();
        assert!(history.memory_bytes() < in_memory, "{} bytes", history.memory_bytes());
    }
}

#[test]
fn what_is_observed_in_buffers_of_another_is_what_the_frame_shows() {
    let frame = |number: usize, [width, height]: [usize; 2], is_colored: bool| {
        let camera = PinholeCamera::new(width, height, 52.5, 52.5, 31.5, 23.5).unwrap();
        let pixels = 0..width * height;
        let depth = pixels.clone().map(|i| 1.0 + 0.001 * ((i * number) % 300) as f32).collect();
        let color = pixels.map(|i| [(i * number) as u8, (i / 3) as u8, 77]).collect();
        let color = is_colored.then(|| ColorImage::new(width, height, color).unwrap());
        Frame::new(number as f64, camera, DepthImage::new(width, height, depth).unwrap(), color).unwrap()
    };
    let mut history = History::new(&HistoryConfig::Memory).unwrap().unwrap();
    let sizes = [[64, 48], [64, 48], [31, 17], [80, 61], [64, 48]];
    for (number, size) in sizes.into_iter().enumerate() {
        for is_colored in [true, false, true] {
            let frame = frame(number, size, is_colored);
            let mut observed = history.observe(&frame).unwrap();
            assert!(observed == Observation::of_frame(&frame).unwrap(), "frame {number}");
            // Nothing of it may be seen in the next one.
            observed.static_mask.fill(false);
            observed.mover_mask.fill(true);
            observed.unproven_mask.fill(true);
            observed.detections = Some(Vec::new());
            let kept = observed.clone();
            let index = history.push(Arc::new(observed));
            history.settle();
            assert!(*history.get(index).unwrap() == kept);
        }
    }
}

#[test]
fn a_file_takes_no_memory_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let files = || std::fs::read_dir(folder.path()).unwrap().count();
    let mut history = History::new(&HistoryConfig::Folder(folder.path().into())).unwrap().unwrap();
    for number in 0..100 {
        history.push(observation(number));
    }
    history.settle();
    assert!(history.memory_bytes() < 100 * 64, "{} bytes", history.memory_bytes());
    assert_eq!(files(), usize::from(!cfg!(unix)), "without a name where the system allows it");
    drop(history);
    assert_eq!(files(), 0);
}

#[test]
fn scans_are_kept_beside_observations_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let scan: Arc<[Point]> = (0..5000).map(|i| [5.0, 0.001 * i as f32, -0.5]).collect();
    for config in [HistoryConfig::Memory, HistoryConfig::Folder(folder.path().into())] {
        let mut history = History::new(&config).unwrap().unwrap();
        assert_eq!(history.push(observation(3)), 0);
        assert_eq!(history.push_scan(Arc::clone(&scan)), 1);
        for is_packed in [false, true] {
            if is_packed {
                history.settle();
            }
            assert_eq!(history.scan(1).unwrap(), scan);
            assert!(history.get(0).unwrap() == observation(3));
            assert!(matches!(history.get(1), Err(Error::Unknown { index: 1 })));
            assert!(matches!(history.scan(0), Err(Error::Unknown { index: 0 })));
        }
        assert!(history.memory_bytes() < size_of_val(&*scan) / 2, "{} bytes", history.memory_bytes());
        history.remove(1);
        assert!(matches!(history.scan(1), Err(Error::Unknown { index: 1 })));
    }
}

#[test]
fn a_scan_of_a_lidar_takes_two_thirds() {
    let Some(path) = recording("octomap/scan.dat") else { return };
    let text = std::fs::read_to_string(path).unwrap();
    let numbers: Vec<f32> = text.split_whitespace().map(|word| word.parse().unwrap()).collect();
    let scan: Arc<[Point]> = numbers.chunks_exact(3).map(|point| [point[0], point[1], point[2]]).collect();
    let mut history = History::new(&HistoryConfig::Memory).unwrap().unwrap();
    history.push_scan(Arc::clone(&scan));
    history.settle();
    let each = history.memory_bytes() as f64 / scan.len() as f64;
    assert!(each < 8.2, "{each} bytes a point");
    assert_eq!(history.scan(0).unwrap(), scan);
}

#[test]
fn a_folder_that_is_none_is_refused() {
    let nowhere = PathBuf::from("/nowhere/at/all");
    let refused = History::new(&HistoryConfig::Folder(nowhere.clone())).unwrap_err();
    assert!(matches!(&refused, Error::Create { folder, .. } if *folder == nowhere));
    assert!(refused.to_string().contains("/nowhere/at/all"), "{refused}");
    assert!(History::new(&HistoryConfig::None).unwrap().is_none());
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn a_kitchen_frame_takes_less_than_100_kilobytes() {
    let Some(folder) = recording("kitchen_people") else { return };
    let mut detector = PlaneDetector::new(&PlaneDetectorConfig::default(), &SensorModel::kinect()).unwrap();
    let mut history = History::new(&HistoryConfig::Memory).unwrap().unwrap();
    let mut count = 0;
    for recorded in recorded_frames(&folder).step_by(10) {
        let mut observation = Observation::of_frame(&recorded.frame).unwrap();
        observation.planes = detector.detect(&recorded.frame, None, &[]).unwrap().to_vec();
        history.push(Arc::new(observation));
        count += 1;
    }
    history.settle();
    let each = history.memory_bytes() / count;
    assert!(each < 100_000, "{each} bytes");
}

#[cfg(feature = "state")]
mod saved_state {
    use dymlm_core::encode_part;
    use dymlm_test_support::{SavedParts, incomplete_parts, save_into, saved_parts};

    use super::*;

    fn load(parts: impl IntoIterator<Item = (u64, Vec<u8>)>) -> Result<Option<History>, Error> {
        History::load_state(&HistoryConfig::Memory, parts)
    }

    #[test]
    fn it_comes_back_and_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        for config in [HistoryConfig::Memory, HistoryConfig::Folder(folder.path().into())] {
            let mut history = History::new(&config).unwrap().unwrap();
            let points: Arc<[_]> = vec![[1.0, f32::NAN, -0.0]; 5].into();
            for seed in 0..70 {
                history.push(observation(seed));
            }
            history.push_scan(Arc::clone(&points));
            history.remove(3);
            let mut parts = saved_parts(|sink| history.save_state(None, sink));
            for index in [0, 69] {
                let loaded = load(parts.clone()).unwrap().unwrap();
                assert_eq!(*loaded.get(index).unwrap(), *observation(index));
                assert!(matches!(loaded.get(3), Err(Error::Unknown { index: 3 })));
                assert_eq!(loaded.scan(70).unwrap().len(), 5);
            }
            let mut loaded = load(parts.clone()).unwrap().unwrap();
            assert_eq!(loaded.push(observation(71)), 71, "numbers go on");

            history.settle();
            let earlier = history.clone();
            history.push(observation(71));
            history.remove(0);
            history.settle();
            let changed = save_into(&mut parts, |sink| history.save_state(Some(&earlier), sink));
            assert_eq!(changed, 3, "one new, one gone, the head");
            assert!(parts == saved_parts(|sink| history.save_state(None, sink)));
            assert!(saved_parts(|sink| history.save_state(Some(&history.clone()), sink)).is_empty());
        }
    }

    /// However far each of the two has come with packing.
    #[test]
    fn what_the_earlier_one_holds_is_not_written_again() {
        let folder = tempfile::tempdir().unwrap();
        for config in [HistoryConfig::Memory, HistoryConfig::Folder(folder.path().into())] {
            let mut history = History::new(&config).unwrap().unwrap();
            for seed in 0..12 {
                history.push(observation(seed));
            }
            history.push_scan(vec![[1.0, 2.0, 3.0]; 9].into());
            let earlier = history.clone();
            let mut parts = saved_parts(|sink| earlier.save_state(None, sink));
            assert_eq!(save_into(&mut parts, |sink| history.save_state(Some(&earlier), sink)), 0);

            history.settle();
            assert_eq!(save_into(&mut parts, |sink| history.save_state(Some(&earlier), sink)), 0);
            assert_eq!(save_into(&mut parts, |sink| earlier.save_state(Some(&history), sink)), 0);

            // Taken over under the same number, by another history.
            let mut other = History::new(&HistoryConfig::Memory).unwrap().unwrap();
            for index in 0..13 {
                assert_eq!(other.push_from(&history, index).unwrap(), index);
            }
            assert_eq!(save_into(&mut parts, |sink| other.save_state(Some(&earlier), sink)), 0);

            history.push(observation(20));
            history.remove(2);
            assert_eq!(save_into(&mut parts, |sink| history.save_state(Some(&earlier), sink)), 3);
            assert!(parts == saved_parts(|sink| history.save_state(None, sink)));
        }
    }

    /// A number says nothing where two histories that were one have gone on by themselves.
    #[test]
    fn what_another_one_holds_under_the_number_is_written() {
        for is_packed in [false, true] {
            let mut history = History::new(&HistoryConfig::Memory).unwrap().unwrap();
            history.push(observation(1));
            let mut other = history.clone();
            history.push(observation(2));
            other.push(observation(3));
            if is_packed {
                history.settle();
            }
            let mut parts = saved_parts(|sink| other.save_state(None, sink));
            assert_eq!(save_into(&mut parts, |sink| history.save_state(Some(&other), sink)), 1);
            assert!(parts == saved_parts(|sink| history.save_state(None, sink)));
        }
    }

    #[test]
    fn parts_that_are_missing_or_too_many_are_named() {
        let mut history = History::new(&HistoryConfig::Memory).unwrap().unwrap();
        for seed in 0..3 {
            history.push(observation(seed));
        }
        let parts = saved_parts(|sink| history.save_state(None, sink));
        for (part, both) in incomplete_parts(&parts) {
            for parts in both {
                assert!(matches!(load(parts), Err(Error::State(_))), "{part}");
            }
        }
        let more = parts.clone().into_iter().chain([(9, Vec::new())]);
        assert!(matches!(load(more), Err(Error::State(_))));
        let huge = encode_part(&(usize::MAX, vec![1_usize])).unwrap();
        assert!(matches!(load([(0, huge)]), Err(Error::State(_))));
        let damaged = parts.into_iter().map(|(key, bytes)| (key, bytes[..bytes.len() - key as usize].into()));
        let damaged = load(damaged).unwrap().unwrap();
        assert!((0..3).all(|index| matches!(damaged.get(index), Err(Error::Damaged { .. }))));
    }

    #[test]
    fn without_a_history_there_is_none() {
        assert!(History::load_state(&HistoryConfig::None, SavedParts::new()).unwrap().is_none());
    }
}
