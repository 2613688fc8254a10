use dymlm_core::{FrameId, ObjectId};
use dymlm_dynamics::Preprocessor;

use crate::key_frames::KeyFrames;
use crate::session_clock::SessionClock;
use crate::session_log::Event;
use crate::snapshots::Snapshots;
use crate::{Error, FrameReport, MapBuilder, MultiLevelMap};

/// Maps outlive a session: the session of another day goes on with them.
impl MapBuilder {
    /// Goes on with maps of an earlier session. Ids go on, and so does the maps' clock: where the new
    /// session's clock begins anew, its times are shifted to follow the old ones. Movers are tracked anew,
    /// no object counts as carried any more, and ids of map points
    /// ([`with_sighted_points`](crate::FrameInput::with_sighted_points)) mean other points than before. Poses
    /// are in the maps' world, as a relocalization gives them.
    ///
    /// The maps will be, to the bit, those of one builder that takes in both sessions with
    /// [`begin_session`](Self::begin_session) between them.
    ///
    /// ```
    /// # use dymlm::core::{DepthImage, Frame, PinholeCamera, Pose};
    /// use dymlm::{MapBuilder, MapConfig};
    ///
    /// # let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5)?;
    /// # let frame = Frame::new(0.0, camera, DepthImage::new(64, 48, vec![1.5; 64 * 48])?, None)?;
    /// let mut monday = MapBuilder::new(MapConfig::default())?;
    /// monday.insert(&frame, &[], &Pose::identity())?;
    ///
    /// let mut tuesday = MapBuilder::resume(monday.into_map())?;
    /// let report = tuesday.insert(&frame, &[], &Pose::identity())?;
    /// assert_eq!(report.id.get(), 1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::Paging`] for a folder in which no file can be made; the config was checked when the maps were
    /// made.
    pub fn resume(map: MultiLevelMap) -> Result<Self, Error> {
        let mut builder = Self::of_map(map)?;
        builder.begin_session_of_maps();
        Ok(builder)
    }

    /// Begins a further session with the same builder, as [`resume`](Self::resume) does with its maps.
    /// Readers stay. Frames that wait for detections are processed first; their reports are returned.
    ///
    /// # Errors
    ///
    /// As [`process_waiting`](Self::process_waiting).
    pub fn begin_session(&mut self) -> Result<Vec<FrameReport>, Error> {
        let reports = self.process_waiting()?;
        self.preprocessor = Preprocessor::new(self.config.dynamics.clone(), self.config.sensor)?;
        self.key_frames = KeyFrames::new(self.config.key_frames)?;
        self.processed = None;
        self.clock = SessionClock::default();
        self.followed.clear();
        self.begin_session_of_maps();
        Ok(reports)
    }

    fn begin_session_of_maps(&mut self) {
        let first = Some(FrameId::new(self.map.past.frames));
        self.map.begin_session();
        // Before any frame has come, this is the first session, as it is without being told so: the same recording
        // has the same log.
        if self.map.past.log.as_ref().is_some_and(|log| !log.sessions.is_empty()) {
            self.note(Some(Event::SessionBegan { first }));
        }
        self.snapshots = match &self.map.past.log {
            Some(log) => Snapshots::at_the_beginning_of(&self.map, &log.events),
            None => Snapshots::default(),
        };
    }
}

impl MultiLevelMap {
    /// Begins a further session: releases all objects that somebody carries, and forgets the ids of the
    /// caller's map points, which are those of another run of the SLAM, or of another robot, from now on.
    pub(crate) fn begin_session(&mut self) {
        let held: Vec<ObjectId> = self.objects.held().collect();
        for object in held {
            self.objects.release(object);
        }
        self.objects.forget_sighted_points();
    }
}
