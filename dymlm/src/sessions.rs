use dymlm_core::{FrameId, ObjectId};
use dymlm_dynamics::Preprocessor;

use crate::key_frames::KeyFrames;
use crate::session_clock::SessionClock;
use crate::session_log::Event;
use crate::snapshots::Snapshots;
use crate::{Error, FrameReport, MapBuilder, MultiLevelMap};

/// Maps outlive a session: another day's goes on with them.
impl MapBuilder {
    /// Goes on with maps of an earlier session. Their ids go on, and so does their clock: where the new
    /// session's clock begins anew, its times follow the old ones. Movers are tracked anew, and nobody
    /// carries an object any more. Poses are in the maps' world, as a relocalization gives them.
    ///
    /// The maps are those that one builder would have made of both sessions, told of the second by
    /// [`begin_session`](Self::begin_session), to the bit.
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
    /// None that the builder that made the maps has not excluded.
    pub fn resume(map: MultiLevelMap) -> Result<Self, Error> {
        let mut builder = Self::of_map(map)?;
        builder.begin_session_of_maps();
        Ok(builder)
    }

    /// Begins a further session without giving the builder up: [`resume`](Self::resume) of its maps. Readers
    /// stay. Frames that wait for detections are processed before; their reports are given.
    ///
    /// # Errors
    ///
    /// As [`process_waiting`](Self::process_waiting).
    pub fn begin_session(&mut self) -> Result<Vec<FrameReport>, Error> {
        let reports = self.process_waiting()?;
        self.preprocessor = Preprocessor::new(self.config.dynamics.clone(), self.config.sensor)?;
        self.key_frames = KeyFrames::new(self.config.key_frames)?;
        self.clock = SessionClock::default();
        self.carried.clear();
        self.begin_session_of_maps();
        Ok(reports)
    }

    fn begin_session_of_maps(&mut self) {
        let first = Some(FrameId::new(self.map.past.frames));
        self.map.release_held();
        self.note(Some(Event::SessionBegan { first }));
        self.snapshots = match &self.map.past.log {
            Some(log) => Snapshots::at_the_beginning_of(&self.map, &log.events),
            None => Snapshots::default(),
        };
    }
}

impl MultiLevelMap {
    /// Nobody carries an object any more.
    pub(crate) fn release_held(&mut self) {
        let held: Vec<ObjectId> = self.objects.held().collect();
        for object in held {
            self.objects.release(object);
        }
    }
}
