use dymlm_core::{FrameId, Pose};

use super::pose_problem::{PoseProblem, key_frame_poses};
use super::{LoopClosure, RefineConfig, UnheldMotion};
use crate::{Error, MultiLevelMap};

/// Better poses of the key frames, by what the maps know ([`MultiLevelMap::refined_poses`]).
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RefinedPoses {
    /// Each key frame's pose, for [`MapBuilder::correct_poses`](crate::MapBuilder::correct_poses).
    pub poses: Vec<(FrameId, Pose)>,
    /// Planes that more than one key frame has seen.
    pub planes: usize,
    /// Views of planes, in all.
    pub views: usize,
    /// Views that were left out, since they are of another plane than the map has them.
    pub views_left_out: usize,
    /// Pairs of planes of the map that turned out to be one plane, met again after a while.
    pub met_again: usize,
    /// Times that a plane of the map turned out to be two: it was out of view for a while, drift brought another
    /// plane to its place, and the map took that for it. Maps that are built at these poses have both, so that
    /// after the first round it is usually 0.
    pub parted: usize,
    /// Objects of which key frames have seen more than one side, or one side more than once.
    pub objects: usize,
    /// Views of objects, in all: a few a side.
    pub object_views: usize,
    /// Views that were left out, since they are of another thing than the map has them, or it was moved.
    pub object_views_left_out: usize,
    /// Motions that only odometry determines, at up to 32 key frames, evenly chosen, in their order: along a
    /// corridor, or within the only plane that is seen. In these the poses are as good as the caller's.
    pub unheld: Vec<UnheldMotion>,
    /// Half the sum of squared errors, in standard deviations: before and after the solve. The first counts
    /// what a plane shows before and after it was out of view as two planes, and all that may join such; the
    /// last has one plane where they turned out to be one, and counts nothing that was left out.
    pub cost: [f64; 2],
    /// Loop closures that were left out as wrong, by their places in the list.
    pub left_out: Vec<usize>,
}

impl MultiLevelMap {
    /// One round of [`MapBuilder::refine_poses_with`](crate::MapBuilder::refine_poses_with) that changes
    /// nothing; the poses of these maps count as odometry. So a separate thread can find better poses with
    /// maps of a [`MapReader`](crate::MapReader), while mapping goes on. Frames that came later move with the
    /// last key frame when the builder is [corrected](crate::MapBuilder::correct_poses).
    ///
    /// ```
    /// # use dymlm::core::{DepthImage, Frame, PinholeCamera, Pose};
    /// # use dymlm::{HistoryConfig, MapBuilder, MapConfig, RefineConfig};
    /// let mut config = MapConfig::default();
    /// config.history = HistoryConfig::Memory;
    /// let mut builder = MapBuilder::new(config)?;
    /// # let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5)?;
    /// # for time in 0..3 {
    /// #     let depth = DepthImage::new(64, 48, vec![2.0; 64 * 48])?;
    /// #     builder.insert(&Frame::new(f64::from(time), camera, depth, None)?, &[], &Pose::identity())?;
    /// # }
    /// let reader = builder.reader();
    /// let refining = std::thread::spawn(move || {
    ///     reader.latest().refined_poses(&RefineConfig::default(), &[])
    /// });
    /// // Frames are inserted meanwhile.
    /// let refined = refining.join().map_err(|_| "the thread panicked")??;
    /// builder.correct_poses(&refined.poses)?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::Config`]; [`Error::NoHistory`]; [`Error::UnknownFrame`] when a closure names a frame that was
    /// never inserted; [`Error::LoopClosureDeviations`] when its deviations are not positive;
    /// [`Error::NoKeyFrames`] when there are closures but no key frames; [`Error::Refinement`].
    pub fn refined_poses(
        &self,
        config: &RefineConfig,
        closures: &[LoopClosure],
    ) -> Result<RefinedPoses, Error> {
        config.validate()?;
        let log = self.past.log.as_ref().ok_or(Error::NoHistory)?;
        PoseProblem::new(self, log, &key_frame_poses(log), config, closures)?.solve()
    }
}
