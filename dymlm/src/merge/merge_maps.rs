use std::sync::Arc;

use dymlm_core::Pose;
use dymlm_core::vector3::{dot, norm};
use dymlm_dynamics::Preprocessor;

use super::merged_log::{EventPlace, MergedLog};
use super::session_union::Source;
use crate::key_frame_view::MappingContext;
use crate::past::Past;
use crate::replay::Replay;
use crate::session_log::{Event, SessionLog};
use crate::snapshots::Snapshots;
use crate::{Error, MergeReport, MultiLevelMap, NewIds, Revision};

/// Cosine of the angle within which two directions are both what is up, 1 degree: as exactly as an inertial
/// sensor tells it.
const SAME_UP: f64 = 0.999_847;

/// Maps of several sessions or robots become one.
impl MultiLevelMap {
    /// Takes in the sessions of another map, moved to this one's world: afterwards all four maps are those
    /// that one builder would have made of all key frames, session after session, to the bit. The sessions
    /// are ordered by the times at which they were recorded, whichever map is merged into which: where all
    /// are in one world (`world_from_other` is the identity), merging is commutative and associative. A
    /// session that both maps hold counts once. Give timestamps since the epoch, as cameras and recordings
    /// have them, so that the order is the true one.
    ///
    /// Things that both have seen become one. Ids are those that one builder would have given: where the
    /// sessions of this map come first, its ids stay, unless poses were corrected; the report maps old ids to
    /// new ones.
    ///
    /// Needs a [history](crate::MapConfig::history) in both. Key frames are mapped again, without the search
    /// for movers and planes, except those of a map whose sessions come first: a series of merges in the
    /// order of time maps each key frame again only once.
    ///
    /// ```
    /// # use dymlm::core::{DepthImage, Frame, PinholeCamera, Pose};
    /// # use dymlm::{HistoryConfig, MapBuilder, MapConfig};
    /// # let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5)?;
    /// # let frame = |time| Frame::new(time, camera, DepthImage::new(64, 48, vec![1.5; 64 * 48])?, None);
    /// let mut config = MapConfig::default();
    /// config.history = HistoryConfig::Memory;
    /// let [mut upstairs, mut downstairs] = [MapBuilder::new(config.clone())?, MapBuilder::new(config)?];
    /// upstairs.insert(&frame(1_790_000_000.0)?, &[], &Pose::identity())?;
    /// downstairs.insert(&frame(1_790_000_060.0)?, &[], &Pose::identity())?;
    ///
    /// let mut building = upstairs.into_map();
    /// let up_from_down = Pose::new([0.0, 0.0, -3.0], [0.0, 0.0, 0.0, 1.0])?;
    /// let report = building.merge(&downstairs.into_map(), &up_from_down)?;
    /// assert_eq!((report.sessions.len(), report.mapped_again), (2, 1));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::ConfigsDiffer`] names the setting that differs; [`Error::SessionsDiffer`] when both hold a
    /// session, but with different contents (its poses were corrected in one of them alone, for example);
    /// [`Error::NoHistory`]; [`Error::History`] when an observation cannot be read; [`Error::Cloud`],
    /// [`Error::Octree`] and [`Error::Planes`] when a pose lies outside what the maps can reach;
    /// [`Error::Paging`] when a file for pages cannot be made. Nothing has changed then.
    pub fn merge(&mut self, other: &Self, world_from_other: &Pose) -> Result<MergeReport, Error> {
        self.check_configs(other, world_from_other)?;
        let [own_log, other_log] = [&*self, other].map(|map| map.past.log.as_ref().ok_or(Error::NoHistory));
        let (own_log, other_log) = (own_log?, other_log?);
        let world_from_log = (*world_from_other != Pose::identity()).then_some(world_from_other);
        let merged = MergedLog::of([
            Source { log: own_log, world_from_log: None },
            Source { log: other_log, world_from_log },
        ])?;

        let known = [Some(&*self), world_from_log.is_none().then_some(other)];
        let (mut start, events) = merged.known_beginning(known, &self.config)?;
        // The beginning may be the other map's, whose config may have another memory, history or interval.
        start.config = Arc::clone(&self.config);
        let already = events.iter().filter_map(Event::key_frame).count();
        let poses: Vec<Pose> = merged.log.poses().collect();
        let preprocessor = Preprocessor::new(self.config.dynamics.clone(), self.config.sensor)?;
        let context =
            MappingContext { sensor: &self.config.sensor, mover_labels: preprocessor.mover_labels() };
        let mut snapshots = Snapshots::default();
        let replay = Replay::new(&merged.log, &poses, start, events, &mut snapshots)?;
        let (mut map, events) = replay.run(&context, &mut |_| true)?;

        let new_ids = |before: &Self, log: &SessionLog, places: &[EventPlace]| {
            NewIds::of(before, log, places, &map, &events)
        };
        let key_frames = events.iter().filter_map(Event::key_frame).count();
        let report = MergeReport {
            sessions: merged.report(),
            key_frames,
            mapped_again: key_frames - already,
            own: new_ids(self, own_log, &merged.event_places[0]),
            other: new_ids(other, other_log, &merged.event_places[1]),
        };
        map.revision = self.revision.max(other.revision);
        map.change();
        map.past = Past {
            frames: merged.log.frames.len() as u64,
            newest: merged.newest,
            differs_from_log: false,
            loaded: Revision::default(),
            log: Some(SessionLog { events, ..merged.log }),
        };
        *self = map;
        Ok(report)
    }

    /// Refuses maps that were made with other configs; a different resolution is named first.
    fn check_configs(&self, other: &Self, world_from_other: &Pose) -> Result<(), Error> {
        let (own, other) = (&*self.config, &*other.config);
        let mut other_objects = other.objects.clone();
        // What is up is given in each map's own world.
        if let (Some(up), Some(other_up)) =
            (own.objects.parameterization.up, other.objects.parameterization.up)
        {
            let other_up = world_from_other.rotate(other_up);
            if dot(up, other_up) >= SAME_UP * norm(up) * norm(other_up) {
                other_objects.parameterization.up = Some(up);
            }
        }
        for (field, own, other) in [
            ("cloud.voxel_size", own.cloud.voxel_size, other.cloud.voxel_size),
            ("octree.resolution", own.octree.resolution, other.octree.resolution),
        ] {
            if own.to_bits() != other.to_bits() {
                return Err(Error::ConfigsDiffer { what: field, values: Some([own, other]) });
            }
        }
        let mover_labels = own.dynamics.mover_labels == other.dynamics.mover_labels
            && own.dynamics.own_mover_labels == other.dynamics.own_mover_labels;
        let parts = [
            ("sensor", own.sensor == other.sensor),
            ("cloud", own.cloud == other.cloud),
            ("octree", own.octree == other.octree),
            ("planes.map", own.planes.map == other.planes.map),
            ("objects", own.objects == other_objects),
            ("dynamics.mover_labels", mover_labels),
        ];
        match parts.into_iter().find(|(_, is_same)| !is_same) {
            Some((what, _)) => Err(Error::ConfigsDiffer { what, values: None }),
            None => Ok(()),
        }
    }
}
