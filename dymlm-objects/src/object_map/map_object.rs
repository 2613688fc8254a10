use std::sync::Arc;

use dymlm_core::vector3::along;
use dymlm_core::{Birth, ObjectId, Plane, PlaneId, SensorModel};
use dymlm_geometry::OrientedBox;

#[cfg(feature = "state")]
use super::counter::MOST_COUNTED;
use super::counter::counted;
use super::{
    BoxMotion, CentroidCloud, CloudPatch, DetectedShare, FULL, KeyView, KeyViews, LabelEvidence, ObjectCloud,
    ObjectSighting, SeenApart, SightedPoints, Sightings, ViewWeight,
};
use crate::association::{JointBox, sample_places};
use crate::{
    BoxAxes, ObjectObservation, ObjectShape, ObjectView, Relief, ShapeKind, SizePriors, SupportPlane,
};

/// An object of the map.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub struct MapObject {
    pub(crate) birth: Birth,
    /// Its name for callers; no result depends on it.
    pub(crate) id: ObjectId,
    pub(crate) label: String,
    pub(crate) shape: ShapeKind,
    pub(crate) oriented_box: OrientedBox,
    pub(crate) axes: BoxAxes,
    pub(crate) state: ObjectState,
    pub(crate) evidence: LabelEvidence,
    pub(crate) observations: u32,
    /// Observations in which only colour told it from its supporting plane.
    pub(crate) flat_observations: u32,
    /// Frames on which the detector ran and the object was in view, detected or not.
    pub(crate) frames_in_view: u32,
    /// Of these, the frames that looked through the place where it should be.
    pub(crate) looked_through: u32,
    pub(crate) detected_share: DetectedShare,
    pub(crate) first_seen: f64,
    pub(crate) last_seen: f64,
    pub(crate) supports: Vec<SupportVotes>,
    /// Sum of the weights of the observations that could vote for them.
    pub(crate) voters: u32,
    /// Nearly all of its memory: clones share the cloud until a point is added.
    pub(crate) cloud: Arc<ObjectCloud>,
    pub(crate) centroids: CentroidCloud,
    pub(crate) key_views: KeyViews,
    pub(crate) sightings: Sightings,
    pub(crate) seen_apart: SeenApart,
    pub(crate) motion: BoxMotion,
    pub(crate) sighted_points: SightedPoints,
    pub(crate) view: ViewWeight,
    /// Sum of the observations' weights.
    pub(crate) weight: u32,
    /// `weight` when it was last parameterized.
    pub(crate) parameterized_at: u32,
    /// How many times in a row new parameters were refused.
    pub(crate) refusals: u32,
}

/// A plane on which observations found an object, and the summed weight of these observations.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct SupportVotes {
    pub(crate) support: SupportPlane,
    pub(crate) votes: u32,
}

impl SupportVotes {
    /// Adds votes for the same plane. A plane of the map gets more accurate with time, so its newest version
    /// counts; local patches are averaged.
    fn joined(&self, new: &Self) -> Self {
        let votes = self.votes.saturating_add(new.votes);
        if new.support.id.is_some() {
            return Self { support: new.support, votes };
        }
        let share = f64::from(new.votes) / f64::from(votes.max(1));
        let (a, b) = (self.support.plane, new.support.plane);
        let normal = [0, 1, 2].map(|k| (1.0 - share) * a.normal()[k] + share * b.normal()[k]);
        let d = (1.0 - share) * a.d() + share * b.d();
        let plane = Plane::new(normal, d).unwrap_or(b);
        Self { support: SupportPlane { plane, ..new.support }, votes }
    }
}

/// Whether an object is part of the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum ObjectState {
    /// A candidate: seen too seldom, of an implausible size for its label, or hardly shown by any view.
    Tentative,
    /// Part of the map.
    Confirmed,
}

/// Limits that tell a damaged object: counts beyond where they stop, and boxes longer than any that is
/// mapped.
#[cfg(feature = "state")]
impl MapObject {
    /// Whether its numbers are plausible; a damaged file may hold others.
    pub(crate) fn is_possible(&self) -> bool {
        let counts = [
            self.observations,
            self.flat_observations,
            self.frames_in_view,
            self.looked_through,
            self.voters,
            self.weight,
            self.parameterized_at,
            self.refusals,
        ];
        let place = self.oriented_box.world_from_box().translation();
        counts.iter().all(|&count| count <= MOST_COUNTED)
            && self.oriented_box.lengths().iter().all(|&length| length <= crate::SizeRange::LONGEST)
            && place.iter().all(|c| c.abs() < 1e9)
            && self.seen_apart.is_possible()
            && self.first_seen.is_finite()
            && self.last_seen.is_finite()
            && self.sighted_points.is_possible()
            && self.cloud.is_possible()
            && self.centroids.is_possible()
            && self.key_views.is_possible()
            && self.sightings.is_possible()
            && self.motion.is_possible()
            && self.view.is_possible()
            && self.detected_share.is_possible()
            && self.evidence.is_possible()
    }
}

impl MapObject {
    /// Its id, which no other object of the map ever gets.
    pub fn id(&self) -> ObjectId {
        self.id
    }

    /// The label with the most evidence.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// The label's share of the evidence, 0..=1.
    pub fn score(&self) -> f64 {
        self.evidence.share(&self.label)
    }

    /// All labels with which it was detected, and their scores.
    pub fn evidence(&self) -> &LabelEvidence {
        &self.evidence
    }

    /// Its box in the world. On a supporting plane the third axis is the plane's normal.
    pub fn oriented_box(&self) -> OrientedBox {
        self.oriented_box
    }

    /// How the box's axes were found.
    pub fn axes(&self) -> BoxAxes {
        self.axes
    }

    /// The shape that represents it: its box, or the ellipsoid inscribed in it.
    pub fn shape(&self) -> ObjectShape {
        ObjectShape::new(self.shape, self.oriented_box)
    }

    /// Approximate size in bytes, nearly all for its points.
    pub fn memory_bytes(&self) -> usize {
        self.memory_bytes_beside(None)
    }

    /// Approximate bytes that it does not share with another state of it.
    pub(crate) fn memory_bytes_beside(&self, other: Option<&Self>) -> usize {
        let is_shared = other.is_some_and(|other| Arc::ptr_eq(&self.cloud, &other.cloud));
        let cloud = if is_shared { 0 } else { size_of::<ObjectCloud>() + self.cloud.memory_bytes() };
        size_of::<Self>()
            + cloud
            + self.key_views.memory_bytes()
            + self.sightings.memory_bytes()
            + self.seen_apart.memory_bytes()
            + self.supports.capacity() * size_of::<SupportVotes>()
            + self.sighted_points.memory_bytes()
    }

    /// Whether it is confirmed.
    pub fn state(&self) -> ObjectState {
        self.state
    }

    /// Number of detections associated with it.
    pub fn observations(&self) -> u32 {
        self.observations
    }

    /// Whether depth or only colour told it from its surroundings, in most observations.
    pub fn relief(&self) -> Relief {
        if 2 * self.flat_observations > self.observations { Relief::Flat } else { Relief::Raised }
    }

    /// Number of frames on which the detector ran and the object was in view and not occluded, detected or
    /// not.
    pub fn frames_in_view(&self) -> u32 {
        self.frames_in_view
    }

    /// Time of the first observation, seconds.
    pub fn first_seen(&self) -> f64 {
        self.first_seen
    }

    /// Time of the last observation, seconds.
    pub fn last_seen(&self) -> f64 {
        self.last_seen
    }

    /// The plane on which most observations found it; `None` when too few found one.
    pub fn support(&self) -> Option<SupportPlane> {
        let most =
            self.supports.iter().reduce(|most, next| if next.votes > most.votes { next } else { most })?;
        (f64::from(most.votes) >= SUPPORT_SHARE * f64::from(self.voters)).then_some(most.support)
    }

    /// The centroids of its observations.
    pub fn centroids(&self) -> &CentroidCloud {
        &self.centroids
    }

    /// What frames have seen of it since it stands where it is: of each side (directions that differ by up to
    /// 15 degrees) up to eight sightings, in the order of time. Poses can be refined with it.
    pub fn sightings_by_side(&self) -> impl Iterator<Item = &[ObjectSighting]> {
        self.sightings.by_side()
    }

    /// Its fused surface points in the world, metres, one per voxel, in a fixed order.
    pub fn points(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.cloud.points().map(|(place, _)| along(place, 1.0, self.cloud.origin()))
    }

    /// Number of its points.
    pub fn point_count(&self) -> usize {
        self.cloud.len()
    }
}

/// Settings for an object's points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ObjectLimits {
    pub(crate) voxel_size: f64,
    pub(crate) max_voxels: usize,
    pub(crate) sensor: SensorModel,
}

impl MapObject {
    /// An object from its first observation.
    pub(crate) fn new(
        (birth, id): (Birth, ObjectId),
        observation: &ObjectObservation,
        view: &ObjectView<'_>,
        shape: ShapeKind,
        limits: &ObjectLimits,
        priors: &SizePriors,
    ) -> Self {
        let timestamp = view.frame.timestamp();
        let mut object = Self {
            birth,
            id,
            label: observation.label.clone(),
            shape,
            oriented_box: observation.fit.oriented_box,
            axes: observation.fit.axes,
            state: ObjectState::Tentative,
            evidence: LabelEvidence::default(),
            observations: 0,
            flat_observations: 0,
            frames_in_view: 0,
            looked_through: 0,
            detected_share: DetectedShare::default(),
            first_seen: timestamp,
            last_seen: timestamp,
            supports: Vec::new(),
            voters: 0,
            cloud: Arc::new(ObjectCloud::new(observation.centroid, limits.voxel_size)),
            centroids: CentroidCloud::default(),
            key_views: KeyViews::default(),
            sightings: Sightings::default(),
            seen_apart: SeenApart::default(),
            motion: BoxMotion::default(),
            sighted_points: SightedPoints::default(),
            view: ViewWeight::default(),
            weight: 0,
            parameterized_at: 0,
            refusals: 0,
        };
        object.observe(observation, view, limits, priors);
        object
    }

    /// Adds an observation; returns the points that were added.
    pub(crate) fn observe(
        &mut self,
        observation: &ObjectObservation,
        view: &ObjectView<'_>,
        limits: &ObjectLimits,
        priors: &SizePriors,
    ) -> CloudPatch {
        let (place, camera) = (self.oriented_box.center(), view.world_from_camera.translation());
        let weight = self.view.next(place, camera);
        self.detected_share.count(place, camera, true);
        let patch = self.patch(observation, weight, view, &limits.sensor, priors);
        Arc::make_mut(&mut self.cloud).add(&patch, limits.max_voxels);
        self.centroids.add(observation.centroid);
        let is_flat = observation.relief == Relief::Flat;
        self.flat_observations = counted(self.flat_observations, u32::from(is_flat));
        let share_of_view = f64::from(weight) / f64::from(FULL);
        self.evidence.add(&observation.label, share_of_view * f64::from(observation.score));
        if let Some(best) = self.evidence.best().filter(|best| *best != self.label) {
            self.label = best.to_owned();
        }
        if let Some(support) = observation.support {
            self.vote(SupportVotes { support, votes: weight });
        }
        let key_view = KeyView {
            camera: *view.frame.camera(),
            world_from_camera: view.world_from_camera,
            bounding_box: observation.bounding_box,
            completeness: observation.completeness,
        };
        self.key_views.add(key_view, weight);
        let sighting = ObjectSighting::of(observation, view.frame.timestamp(), &view.world_from_camera);
        if let Some(sighting) = sighting {
            self.sightings.add(&sighting, self.oriented_box.center());
        }
        self.motion.observe(view.frame.timestamp(), observation.bounding_box);
        self.sighted_points.add(&observation.sighted_points);
        self.observations = counted(self.observations, 1);
        self.voters = counted(self.voters, weight);
        self.weight = counted(self.weight, weight);
        self.frames_in_view = counted(self.frames_in_view, 1);
        self.last_seen = view.frame.timestamp();
        patch
    }

    /// The points of an observation that may belong to the object: all of them while the object is little
    /// known or may be large enough to hold them, otherwise those in its box and somewhat around it.
    fn patch(
        &self,
        observation: &ObjectObservation,
        weight: u32,
        view: &ObjectView<'_>,
        sensor: &SensorModel,
        priors: &SizePriors,
    ) -> CloudPatch {
        let (points, world_from_camera) = (&observation.points, &view.world_from_camera);
        let may_reach_all = || {
            let mut places = Vec::new();
            sample_places(observation, world_from_camera, &mut places);
            JointBox::around(self, &places).is_some_and(|joint| joint.fits(self, priors))
        };
        if self.observations < KNOWN || may_reach_all() {
            return self.cloud.patch(points, weight, world_from_camera, sensor, |_| true);
        }
        let box_from_world = self.oriented_box.world_from_box().inverse();
        let reach = self.oriented_box.lengths().map(|length| 0.5 * GROWTH * length);
        self.cloud.patch(points, weight, world_from_camera, sensor, |place| {
            let local = box_from_world.transform_point(place);
            (0..3).all(|axis| local[axis].abs() <= reach[axis])
        })
    }

    fn vote(&mut self, new: SupportVotes) {
        match self.supports.iter_mut().find(|own| own.support.id == new.support.id) {
            Some(own) => *own = own.joined(&new),
            None => self.supports.push(new),
        }
    }

    /// Updates the ids of supporting planes; the votes for two planes that were merged are added.
    pub(crate) fn follow_planes(&mut self, mut current_id: impl FnMut(PlaneId) -> PlaneId) {
        let mut current =
            |support: &SupportPlane| SupportPlane { id: support.id.map(&mut current_id), ..*support };
        if self.supports.iter().any(|votes| current(&votes.support).id != votes.support.id) {
            for votes in std::mem::take(&mut self.supports) {
                self.vote(SupportVotes { support: current(&votes.support), ..votes });
            }
        }
    }

    /// Adds all that is known of a duplicate.
    pub(crate) fn merge(&mut self, other: &Self, limits: &ObjectLimits) {
        Arc::make_mut(&mut self.cloud).merge(&other.cloud, limits.max_voxels);
        self.centroids.merge(&other.centroids);
        self.evidence.merge(&other.evidence);
        if let Some(best) = self.evidence.best().filter(|best| *best != self.label) {
            self.label = best.to_owned();
        }
        self.key_views.merge(&other.key_views, other.last_seen > self.last_seen);
        self.sightings.merge(&other.sightings);
        self.seen_apart.merge(&other.seen_apart, [self.birth, other.birth]);
        other.supports.iter().for_each(|votes| self.vote(*votes));
        self.sighted_points.merge(&other.sighted_points, other.last_seen > self.last_seen);
        self.observations = counted(self.observations, other.observations);
        self.voters = counted(self.voters, other.voters);
        self.weight = counted(self.weight, other.weight);
        self.flat_observations = counted(self.flat_observations, other.flat_observations);
        self.frames_in_view = self.frames_in_view.max(other.frames_in_view).max(self.observations);
        self.looked_through = self.looked_through.min(other.looked_through);
        self.detected_share.merge(&other.detected_share);
        if other.last_seen > self.last_seen {
            self.motion = other.motion.clone();
        }
        self.first_seen = self.first_seen.min(other.first_seen);
        self.last_seen = self.last_seen.max(other.last_seen);
    }
}

/// Least share of the observations, by weight, that must have found an object on a plane for it to be its
/// support. A lower value takes the edge of a table below the object for its support, a higher one leaves an
/// object among other things without support.
const SUPPORT_SHARE: f64 = 0.2;
/// Observations after which an object's box is reliable enough to select its points.
const KNOWN: u32 = 4;
/// Factor by which the box may grow at once. A lower value cuts off parts that are seen later, a higher one
/// adds neighbouring things.
pub(crate) const GROWTH: f64 = 1.5;
