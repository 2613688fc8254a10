use dymlm_core::{FrameId, Pages, Pose};

use crate::session_log::InsertedFrame;

/// The poses of all frames after some of them were corrected. A frame between two corrected ones moves with
/// both, more with the one nearer in time. A frame after the last moves with that one, since its pose was
/// found from there on; a frame before the first stays.
///
/// `given` ascends by frame, names each frame once, and only frames within `frames`.
pub(super) fn new_poses(frames: &Pages<InsertedFrame>, given: &[(FrameId, Pose)]) -> Vec<Pose> {
    let mut poses = Vec::with_capacity(frames.len());
    let mut behind = given.iter().peekable();
    let mut before: Option<&(FrameId, Pose)> = None;
    for (index, frame) in frames.iter().enumerate() {
        while let Some(next) = behind.next_if(|(id, _)| id.get() as usize <= index) {
            before = Some(next);
        }
        poses.push(match (before, behind.peek()) {
            (Some((id, pose)), _) if id.get() as usize == index => *pose,
            (Some(before), Some(behind)) => {
                let [first, last] = [before, *behind].map(|(id, _)| frames[id.get() as usize].map_time());
                let share = if last > first { (frame.map_time() - first) / (last - first) } else { 0.5 };
                let [with_first, with_last] = [before, *behind].map(|given| moved_with(frames, given, frame));
                // Where both agree, rounding must not move the frame.
                if with_first == with_last { with_first } else { with_first.interpolate(&with_last, share) }
            }
            (Some(only), None) => moved_with(frames, only, frame),
            (None, _) => frame.world_from_camera,
        });
    }
    poses
}

/// The pose of a frame that keeps its pose relative to a corrected frame.
fn moved_with(frames: &Pages<InsertedFrame>, (id, pose): &(FrameId, Pose), frame: &InsertedFrame) -> Pose {
    let before = frames[id.get() as usize].world_from_camera;
    if before == *pose {
        // No rounding for a frame that has not moved.
        return frame.world_from_camera;
    }
    *pose * (before.inverse() * frame.world_from_camera)
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;

    use super::*;

    fn at(x: f64) -> Pose {
        Pose::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap()
    }

    fn frames(places: &[f64]) -> Pages<InsertedFrame> {
        let frame = |(index, &x)| InsertedFrame {
            timestamp: index as f64,
            clock_offset: 0.0,
            world_from_camera: at(x),
        };
        places.iter().enumerate().map(frame).collect()
    }

    fn corrected(places: &[f64], given: &[(u64, f64)]) -> Vec<f64> {
        let given: Vec<_> = given.iter().map(|&(id, x)| (FrameId::new(id), at(x))).collect();
        new_poses(&frames(places), &given).iter().map(|pose| pose.translation()[0]).collect()
    }

    #[test]
    fn frames_between_corrected_ones_move_with_both() {
        let places = [0.0, 1.0, 2.0, 3.0, 4.0];
        assert_eq!(corrected(&places, &[(0, 0.0), (4, 8.0)]), [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert_eq!(corrected(&places, &[(2, 2.5)]), [0.0, 1.0, 2.5, 3.5, 4.5]);
        assert_eq!(corrected(&places, &[]), places);
    }

    #[test]
    fn a_turn_carries_along_what_follows() {
        let turned = Pose::new([0.0; 3], [0.0, 0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt()]).unwrap();
        let poses = new_poses(&frames(&[0.0, 1.0]), &[(FrameId::new(0), turned)]);
        let [x, y, _] = poses[1].translation();
        assert!(x.abs() < 1e-12 && (y - 1.0).abs() < 1e-12);
    }

    /// Times and poses without round numbers, as a SLAM has them.
    fn irregular_frames(count: usize) -> Pages<InsertedFrame> {
        let (mut random, mut timestamp) = (SplitMix64::new(5), 0.0);
        let frame = |_| {
            timestamp += 0.01 + 0.3 * random.fraction();
            let mut between = || 2.0 * random.fraction() - 1.0;
            let (place, turn) = ([(); 3].map(|()| between()), [(); 4].map(|()| between()));
            let norm = turn.iter().map(|c| c * c).sum::<f64>().sqrt();
            let world_from_camera = Pose::new(place, turn.map(|c| c / norm)).unwrap();
            InsertedFrame { timestamp, clock_offset: 0.0, world_from_camera }
        };
        (0..count).map(frame).collect()
    }

    /// Regression: between two frames that had not moved, rounding moved one frame in eight.
    #[test]
    fn what_is_corrected_to_where_it_is_stays_to_the_bit() {
        let frames = irregular_frames(1000);
        let poses = |frames: &Pages<InsertedFrame>| -> Vec<Pose> {
            frames.iter().map(|frame| frame.world_from_camera).collect()
        };
        let right = poses(&frames);
        let mut given: Vec<(FrameId, Pose)> =
            right.iter().copied().enumerate().map(|(id, pose)| (FrameId::new(id as u64), pose)).collect();
        given.retain(|(id, _)| matches!(id.get() % 7, 0 | 3 | 4));
        assert_eq!(new_poses(&frames, &given), right);
        // The last frame that is given moves, and with it those from the one given before on.
        let [.., (before, _), (_, last)] = given.as_mut_slice() else { panic!() };
        *last = at(0.1) * *last;
        let before = before.get() as usize;
        let now = new_poses(&frames, &given);
        assert_eq!(now[..=before], right[..=before]);
        assert!(now.iter().zip(&right).skip(before + 1).all(|(now, right)| now != right));
    }
}
