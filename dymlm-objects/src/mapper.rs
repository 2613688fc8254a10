use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use dymlm_core::vector3::{Vector3, bounds, boxes_touch, difference, norm};
use dymlm_core::{Birth, ObjectId, PlaneId, Pose, SensorModel};
use dymlm_geometry::OrientedBox;

use crate::association::{Associator, visible_iou};
use crate::object_map::{ObjectLimits, counted};
use crate::optimization::{
    Existence, PRIOR_SLACK, Proposal, Reparameterizer, are_duplicates, judge_existence, may_touch,
};
use crate::parameterization::{Parameterizer, Rival, Vertical};
use crate::{
    Error, MapObject, ObjectAssociation, ObjectConfig, ObjectMap, ObjectMerge, ObjectObservation,
    ObjectReport, ObjectShape, ObjectState, ObjectView, RejectedDetection, RejectionCause, Relief,
    SupportingPlanes,
};

/// Builds the object map, one frame at a time (paper IV).
///
/// [`insert`](Self::insert) runs the steps in order. A refused frame changes nothing. The cost of a frame
/// depends on the objects that it may show, neither on the number of earlier frames nor on objects elsewhere.
///
/// ```
/// use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, PinholeCamera, Pose, SensorModel};
/// use dymlm_objects::{NoPlanes, ObjectConfig, ObjectMapper, ObjectView};
///
/// // A box of 0.4 x 0.3 m at 1.5 m, before a wall at 3 m.
/// let camera = PinholeCamera::new(320, 240, 262.0, 262.0, 159.5, 119.5)?;
/// let holds = |u: usize, v: usize| (125..195).contains(&u) && (94..146).contains(&v);
/// let depth = (0..320 * 240).map(|i| if holds(i % 320, i / 320) { 1.5 } else { 3.0 }).collect();
/// let frame = Frame::new(0.0, camera, DepthImage::new(320, 240, depth)?, None)?;
/// let detection = Detection::new("microwave", 0.8, BoundingBox::new(125.0, 94.0, 195.0, 146.0)?)?;
///
/// let mut mapper = ObjectMapper::new(ObjectConfig::default(), SensorModel::kinect())?;
/// for _ in 0..3 {
///     mapper.insert(&ObjectView::new(&frame, &[detection.clone()], &Pose::identity()), &NoPlanes)?;
/// }
/// let object = mapper.map().objects().next().ok_or("seen three times")?;
/// assert_eq!((object.label(), object.observations()), ("microwave", 3));
/// assert!((object.oriented_box().lengths()[0] - 0.4).abs() < 0.03);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct ObjectMapper {
    pub(crate) config: ObjectConfig,
    pub(crate) sensor: SensorModel,
    limits: ObjectLimits,
    parameterizer: Parameterizer,
    pub(crate) associator: Associator,
    pub(crate) reparameterizer: Reparameterizer,
    pub(crate) map: ObjectMap,
    pub(crate) last_timestamp: Option<f64>,
    /// The objects that somebody carries, and whether the place where each stood is known to be free.
    pub(crate) held: BTreeMap<Birth, bool>,
    pub(crate) vertical: Vertical,
    observations: Vec<ObjectObservation>,
    /// The associated object of each observation.
    matches: Vec<Option<Birth>>,
    /// The objects that the frame may show and those that it created, the oldest first.
    in_view: Vec<Birth>,
    /// The objects that the frame observed, and the indices of their observations.
    observed: Vec<(Birth, usize)>,
    /// The objects whose boxes changed, which may therefore have become duplicates of others.
    pub(crate) changed: BTreeSet<Birth>,
    pub(crate) near: Vec<Birth>,
    /// Ids of the planes that objects were seen to stand on.
    pub(crate) supports: BTreeSet<PlaneId>,
    /// The revision of the planes' ids that `supports` follow, where it is known.
    followed: Option<u64>,
    report: ObjectReport,
}

/// Greatest magnitude of the coordinates of a camera or of what is moved, metres: within it places are exact
/// to a micrometre.
const REACH: f64 = 1e8;
/// Least intersection over union of an object's projection and a detected box at which the detection may mean
/// the object. A lower value loses things before or behind other objects, a higher one creates objects from
/// what was found beside an object instead of it.
const LOOKS_LIKE: f64 = 0.4;
/// Most points of an observation that are looked up in an object's cloud.
const MOST_CHECKED: usize = 64;
/// Most merges per frame; further ones wait for the next frame.
const MAX_MERGES: usize = 16;
/// A tentative object that was detected in less than one of so many frames in view is removed. What frames of
/// one look say is bounded, so a camera at rest removes nothing that was found on the way around it. A lower
/// value removes what detectors seldom find, a higher one keeps their mistakes for longer.
const PATIENCE: f64 = 30.0;
/// Least share of an object's projection that a view must show before it is confirmed, 0..=1: of a couch
/// whose arm looks out behind a table the box is a guess from the label's usual size. A lower value confirms
/// such guesses, a higher one leaves out what is rightly completed.
const LEAST_SHOWN: f64 = 0.1;

impl ObjectMapper {
    /// A mapper with an empty map.
    ///
    /// # Errors
    ///
    /// [`Error::Config`] names the field of the config or of the sensor that is outside its range.
    pub fn new(config: ObjectConfig, sensor: SensorModel) -> Result<Self, Error> {
        config.validate()?;
        sensor.validate()?;
        Ok(Self {
            limits: ObjectLimits {
                voxel_size: config.update.voxel_size,
                max_voxels: config.update.max_voxels,
                sensor,
            },
            parameterizer: Parameterizer::new(config.parameterization.clone(), sensor)?,
            associator: Associator::new(config.association.clone()),
            reparameterizer: Reparameterizer::new(
                config.update.isolation_forest,
                config.parameterization.flat_height(),
            )?,
            map: ObjectMap::new(sensor.max_depth.into()),
            last_timestamp: None,
            held: BTreeMap::new(),
            vertical: Vertical::new(
                config.parameterization.up,
                config.parameterization.max_support_slope.cos(),
            ),
            observations: Vec::new(),
            matches: Vec::new(),
            in_view: Vec::new(),
            observed: Vec::new(),
            changed: BTreeSet::new(),
            near: Vec::new(),
            supports: BTreeSet::new(),
            followed: None,
            report: ObjectReport::default(),
            config,
            sensor,
        })
    }

    /// Inserts a frame; `planes` are the planes on which things may stand. Frames must come in order of time.
    ///
    /// A frame on which the detector did not run changes no object, and may come in any order.
    ///
    /// # Errors
    ///
    /// [`Error::TimeReversed`], [`Error::OutOfReach`]; a refused frame changes nothing.
    #[doc(alias = "observe")]
    pub fn insert(
        &mut self,
        view: &ObjectView<'_>,
        planes: &dyn SupportingPlanes,
    ) -> Result<ObjectReport, Error> {
        self.check(view)?;
        self.follow_planes(planes);
        self.observations.clear();
        if view.has_detections() {
            self.last_timestamp = Some(view.frame.timestamp());
            let Self { map, in_view, sensor, .. } = self;
            let (camera, max_depth) = (view.frame.camera(), sensor.max_depth.into());
            map.index.in_view(map, camera, &view.world_from_camera, max_depth, in_view);
            // What is seen where a carried object has left free space is not that object.
            in_view.retain(|birth| self.held.get(birth) != Some(&true));
            self.parameterize(view, planes);
            self.associate(view);
            self.update(view, planes);
            self.optimize(view, planes);
        }
        Ok(std::mem::take(&mut self.report))
    }

    /// Checks whether the mapper would accept a frame.
    ///
    /// # Errors
    ///
    /// As [`insert`](Self::insert).
    pub fn check(&self, view: &ObjectView<'_>) -> Result<(), Error> {
        let position = view.world_from_camera.translation();
        if !is_in_reach(position) {
            return Err(Error::OutOfReach { position, reach: REACH });
        }
        let timestamp = view.frame.timestamp();
        match self.last_timestamp.filter(|_| view.has_detections()) {
            Some(previous) if timestamp < previous => Err(Error::TimeReversed { previous, timestamp }),
            _ => Ok(()),
        }
    }

    /// From detections to boxes in space.
    fn parameterize(&mut self, view: &ObjectView<'_>, planes: &dyn SupportingPlanes) {
        let Self { parameterizer, map, in_view, held, vertical, config, observations, .. } = self;
        let standing = map.confirmed(in_view).filter(|object| !held.contains_key(&object.birth));
        let mapped: Vec<_> = standing.filter_map(|object| Rival::mapped(object, view)).collect();
        parameterizer.parameterize(view, planes, vertical.direction(), &mapped, &config.sizes, observations);
        self.note_empty_boxes(view);
    }

    /// One optimal assignment of observations to the objects in view.
    fn associate(&mut self, view: &ObjectView<'_>) {
        let matches =
            self.associator.associate(view, &self.observations, &self.map, &self.in_view, &self.config.sizes);
        self.matches.clear();
        self.matches.extend(matches.iter().map(|place| self.in_view.get((*place)?).copied()));
        for (index, (observation, object)) in self.observations.iter().zip(&self.matches).enumerate() {
            let Some(object) = *object else { continue };
            self.report.associated.push(ObjectAssociation {
                detection: observation.detection,
                object: self.map.names.id(object),
                tests: self.associator.tests(index),
            });
        }
    }

    /// Adds observations to their objects and parameterizes these anew; unmatched observations become new
    /// objects.
    fn update(&mut self, view: &ObjectView<'_>, planes: &dyn SupportingPlanes) {
        self.observed.clear();
        let observations = std::mem::take(&mut self.observations);
        // All vote before the first new object asks what is up.
        let votes = self.vote_for_vertical(&observations, view.world_from_camera.translation());
        for (index, observation) in observations.iter().enumerate() {
            match self.matches.get(index).copied().flatten() {
                // Something else is where a carried object stood.
                Some(object) if self.held.contains_key(&object) => {
                    self.reject(observation.detection, RejectionCause::Occupied);
                }
                // A thing that is hardly known is not made of another one's surface.
                Some(object) if self.is_tentative(object) && self.is_occupied(view, observation) => {
                    self.reject(observation.detection, RejectionCause::Occupied);
                }
                Some(object) => self.update_object(view, index, observation, object, planes),
                None => self.create_object(view, index, observation, planes),
            }
        }
        let is_seen = |index: usize| self.observed.iter().any(|(_, observed)| *observed == index);
        for (_, normal) in votes.into_iter().filter(|(index, _)| !is_seen(*index)) {
            self.vertical.withdraw(normal);
        }
        self.observations = observations;
        self.observed.sort_unstable();
        self.note_seen_apart(view);
    }

    /// Votes for the normals of the planes on which observations rest. Those of an object count as long as
    /// its view counts fully: what a robot at rest sees for hours does not outvote what it sees on its way.
    /// Returns the votes, each with the index of its observation.
    fn vote_for_vertical(
        &mut self,
        observations: &[ObjectObservation],
        camera: Vector3,
    ) -> Vec<(usize, Vector3)> {
        let counts = |index: usize| {
            let object = self.matches.get(index).copied().flatten().and_then(|birth| self.map.born(birth));
            object.is_none_or(|object| object.view.would_count_fully(object.oriented_box.center(), camera))
        };
        let normal = |index: usize| self.parameterizer.resting_normal(observations[index].detection);
        let counting = (0..observations.len()).filter(|&index| counts(index));
        let votes: Vec<(usize, Vector3)> =
            counting.filter_map(|index| Some((index, normal(index)?))).collect();
        for (_, normal) in &votes {
            self.vertical.vote(*normal);
        }
        votes
    }

    /// Notes which of the observed objects that touch were detected as two things of one label: neither
    /// observation lies on the other's surface, as what is found of a hidden chair may lie on the chair that
    /// hides it.
    fn note_seen_apart(&mut self, view: &ObjectView<'_>) {
        let observed = std::mem::take(&mut self.observed);
        let mut pairs = Vec::new();
        for &(birth, own) in &observed {
            let Some(object) = self.map.born(birth) else { continue };
            self.map.index.within(bounds(object.oriented_box.corners()), &mut self.near);
            for &neighbour in self.near.iter().filter(|&&neighbour| neighbour > birth) {
                let Ok(place) = observed.binary_search_by_key(&neighbour, |(birth, _)| *birth) else {
                    continue;
                };
                let Some(other) = self.map.born(neighbour) else { continue };
                let [own, its] = [own, observed[place].1].map(|index| &self.observations[index]);
                let touches = may_touch(&object.oriented_box, &other.oriented_box);
                let are_apart = || !holds_most(object, view, its) && !holds_most(other, view, own);
                if other.label == object.label && touches && are_apart() {
                    pairs.push((birth, neighbour));
                }
            }
        }
        for (birth, neighbour) in pairs.into_iter().flat_map(|(a, b)| [(a, b), (b, a)]) {
            if let Some(object) = self.map.born_mut(birth) {
                object.seen_apart.note(neighbour);
            }
        }
        self.observed = observed;
    }

    /// Judges existence, removes ghosts, merges duplicates, and confirms objects or withdraws that.
    fn optimize(&mut self, view: &ObjectView<'_>, planes: &dyn SupportingPlanes) {
        self.judge_existence(view);
        self.remove_ghosts();
        self.merge_duplicates(planes);
        self.confirm_objects();
        let ObjectReport { created, updated, kept_parameters, confirmed, unconfirmed, removed, .. } =
            &mut self.report;
        for ids in [created, updated, kept_parameters, confirmed, unconfirmed, removed] {
            ids.sort_unstable();
            ids.dedup();
        }
    }

    /// Marks an object as carried by somebody: until it is [released](Self::release) or
    /// [moved](Self::move_object), it stays in the map where it stood, and frames do not change it. What is
    /// detected there is something else, and becomes an object once that place is [known](Self::remove_where)
    /// to be free. Any number of objects can be held at once. Returns whether the object was not held before;
    /// `false` when it is not in the map.
    pub fn hold(&mut self, object: ObjectId) -> bool {
        let birth = self.map.object(object).map(|object| object.birth);
        let new = birth.filter(|birth| !self.held.contains_key(birth));
        self.held.extend(new.map(|birth| (birth, false)));
        new.is_some()
    }

    /// Marks an object as no longer carried. Returns whether it was held before.
    pub fn release(&mut self, object: ObjectId) -> bool {
        let birth = self.map.object(object).map(|object| object.birth);
        let released = birth.filter(|birth| self.held.remove(birth).is_some());
        // What was put in its place meanwhile may be the same thing.
        self.changed.extend(released);
        released.is_some()
    }

    /// Forgets which of the caller's map points were sighted on objects. To be called where another run of a
    /// SLAM, or another robot, goes on with the map: its ids mean other points.
    pub fn forget_sighted_points(&mut self) {
        let objects = self.map.objects.iter_mut();
        // Clones go on sharing the objects in which nothing is to be forgotten.
        for object in objects.filter(|object| !object.sighted_points.is_empty()) {
            Arc::make_mut(object).sighted_points.clear();
        }
    }

    /// The objects that are held.
    pub fn held(&self) -> impl Iterator<Item = ObjectId> {
        self.held.keys().map(|&birth| self.map.names.id(birth))
    }

    /// Moves an object with its points and views, and [releases](Self::release) it. Returns its new box;
    /// `None` when the map has no object of this id, or does not reach as far as its new place.
    pub fn move_object(&mut self, object: ObjectId, new_from_old: &Pose) -> Option<OrientedBox> {
        let mapped = self.map.object(object)?;
        if !is_in_reach(new_from_old.transform_point(mapped.oriented_box.center())) {
            return None;
        }
        let birth = mapped.birth;
        let place = self.map.place(birth)?;
        self.held.remove(&birth);
        let moved = self.map.objects.get_mut(place).map(Arc::make_mut)?;
        moved.move_by(new_from_old);
        self.map.index.place(moved);
        self.changed.insert(birth);
        Some(moved.oriented_box)
    }

    /// Removes the objects for which `is_gone` holds and whose box reaches into a region (lowest and highest
    /// corner, metres, world); returns their ids. Carried objects stay, but where `is_gone` holds they no longer
    /// keep others from the place where they stood.
    pub fn remove_where(
        &mut self,
        region: [[f64; 3]; 2],
        is_gone: impl Fn(&MapObject) -> bool,
    ) -> Vec<ObjectId> {
        let reaches_in = |object: &MapObject| boxes_touch(bounds(object.oriented_box.corners()), region);
        let mut gone = Vec::new();
        self.map.index.within(region, &mut gone);
        gone.retain(|birth| {
            self.map.born(*birth).is_some_and(|object| reaches_in(object) && is_gone(object))
        });
        gone.retain(|birth| match self.held.get_mut(birth) {
            Some(is_free) => {
                *is_free = true;
                false
            }
            None => true,
        });
        gone.into_iter().filter_map(|birth| Some(self.map.remove(birth)?.id)).collect()
    }

    /// Forgets the objects whose centre is farther than `radius` metres from a place (world), except carried
    /// ones. An object met again later is a new one.
    pub fn forget_outside(&mut self, center: [f64; 3], radius: f64) {
        let is_far = |object: &&MapObject| {
            let away = norm(difference(object.oriented_box.center(), center));
            // A NaN radius forgets nothing.
            away > radius && !self.held.contains_key(&object.birth)
        };
        let far: Vec<Birth> = self.map.all().filter(is_far).map(|object| object.birth).collect();
        for birth in far {
            self.map.remove(birth);
        }
    }

    /// The current map.
    pub fn map(&self) -> &ObjectMap {
        &self.map
    }

    /// A unit vector that points up in the world, once it is known: the
    /// [given](crate::ParameterizationConfig::up) one, or the normal on which most things rest.
    pub fn vertical(&self) -> Option<[f64; 3]> {
        self.vertical.direction()
    }

    /// The observations of the last frame, by ascending index of their detections.
    pub fn observations(&self) -> &[ObjectObservation] {
        &self.observations
    }

    /// The config.
    pub fn config(&self) -> &ObjectConfig {
        &self.config
    }

    /// Returns the map and drops the mapper.
    pub fn into_map(self) -> ObjectMap {
        self.map
    }

    fn note_empty_boxes(&mut self, view: &ObjectView<'_>) {
        for (index, detection) in view.detections().iter().enumerate() {
            let found = self.observations.iter().any(|observation| observation.detection == index);
            if !found && self.parameterizer.is_asked(view, detection) {
                self.reject(index, RejectionCause::NoPoints);
            }
        }
    }

    fn reject(&mut self, detection: usize, cause: RejectionCause) {
        let place = self.report.rejected.partition_point(|rejected| rejected.detection < detection);
        self.report.rejected.insert(place, RejectedDetection { detection, cause });
    }

    /// Updates the ids of supporting planes that were merged since.
    fn follow_planes(&mut self, planes: &dyn SupportingPlanes) {
        let revision = planes.ids_revision();
        if revision.is_some() && revision == self.followed {
            return;
        }
        if self.supports.iter().any(|&id| planes.current_id(id) != id) {
            self.rename_planes(|id| planes.current_id(id));
        }
        self.followed = revision;
    }

    /// Replaces the ids of supporting planes.
    pub(crate) fn rename_planes(&mut self, mut new_id: impl FnMut(PlaneId) -> PlaneId) {
        self.supports = self.supports.iter().map(|&id| new_id(id)).collect();
        for object in &mut self.map.objects {
            if object.supports.iter().any(|votes| votes.support.id.is_some_and(|id| new_id(id) != id)) {
                Arc::make_mut(object).follow_planes(&mut new_id);
            }
        }
    }

    fn update_object(
        &mut self,
        view: &ObjectView<'_>,
        index: usize,
        observation: &ObjectObservation,
        birth: Birth,
        planes: &dyn SupportingPlanes,
    ) {
        let place = self.map.place(birth);
        let Some(object) = place.and_then(|place| self.map.objects.get_mut(place)) else { return };
        let object = Arc::make_mut(object);
        let patch = object.observe(observation, view, &self.limits, &self.config.sizes);
        // New evidence may have changed the label.
        object.shape = self.config.shapes.of(object.label());
        self.observed.push((birth, index));
        self.report.observed.push((observation.detection, object.id));
        self.changed.insert(birth);
        self.supports.extend(observation.support.and_then(|support| support.id));
        if !Reparameterizer::is_due(object) {
            return;
        }
        match self.reparameterizer.update(
            object,
            self.vertical.direction(),
            &self.config.sizes,
            &self.config.shapes,
            planes,
        ) {
            Proposal::Accepted => {
                self.map.index.place(object);
                self.report.updated.push(object.id);
            }
            Proposal::Rejected => {
                Arc::make_mut(&mut object.cloud).subtract(&patch);
                self.report.kept_parameters.push(object.id);
            }
            Proposal::None => {}
        }
    }

    fn create_object(
        &mut self,
        view: &ObjectView<'_>,
        index: usize,
        observation: &ObjectObservation,
        planes: &dyn SupportingPlanes,
    ) {
        let lengths = observation.fit.oriented_box.lengths();
        let pose = observation.fit.axes.pose();
        if !self.config.sizes.admit_part(&observation.label, lengths, pose, PRIOR_SLACK) {
            return self.reject(observation.detection, RejectionCause::Size);
        }
        if self.is_occupied(view, observation) {
            return self.reject(observation.detection, RejectionCause::Occupied);
        }
        if self.is_explained(view, observation) {
            return self.reject(observation.detection, RejectionCause::Explained);
        }
        let (birth, id) = self.map.names.add();
        let shape = self.config.shapes.of(&observation.label);
        let (limits, sizes) = (&self.limits, &self.config.sizes);
        let mut object = MapObject::new((birth, id), observation, view, shape, limits, sizes);
        self.reparameterizer.update(
            &mut object,
            self.vertical.direction(),
            &self.config.sizes,
            &self.config.shapes,
            planes,
        );
        self.map.index.place(&object);
        self.map.objects.push(Arc::new(object));
        self.report.created.push(id);
        self.observed.push((birth, index));
        self.report.observed.push((observation.detection, id));
        self.in_view.push(birth);
        self.changed.insert(birth);
        self.supports.extend(observation.support.and_then(|support| support.id));
    }

    fn is_tentative(&self, birth: Birth) -> bool {
        self.map.born(birth).is_some_and(|object| object.state == ObjectState::Tentative)
    }

    /// Whether most of an observation's points belong to a confirmed object with the same label or a matching
    /// projection: a cup is not part of the table to which its points were also added.
    fn is_occupied(&self, view: &ObjectView<'_>, observation: &ObjectObservation) -> bool {
        // A thing that lies flat shares the cells of the table under it.
        let comparable = |object: &&MapObject| {
            (observation.relief == Relief::Raised || object.relief() == Relief::Flat)
                && (object.label == observation.label || looks_like(object, view, observation))
        };
        self.map
            .confirmed(&self.in_view)
            .filter(comparable)
            .any(|object| holds_most(object, view, observation))
    }

    /// Whether the detector most likely means a confirmed object that no detection of the frame was
    /// associated with: the object's projection matches the box, and the depths show its surface. The points
    /// found in the box are then of something before or behind it.
    fn is_explained(&self, view: &ObjectView<'_>, observation: &ObjectObservation) -> bool {
        self.map.confirmed(&self.in_view).any(|object| {
            !self.matches.contains(&Some(object.birth))
                && looks_like(object, view, observation)
                && judge_existence(view, object, &self.sensor) == Existence::Present
        })
    }

    fn judge_existence(&mut self, view: &ObjectView<'_>) {
        for &birth in &self.in_view {
            if self.is_observed(birth) || self.held.contains_key(&birth) {
                continue;
            }
            let place = self.map.place(birth);
            let Some(object) = place.and_then(|place| self.map.objects.get_mut(place)) else { continue };
            let existence = judge_existence(view, object, &self.sensor);
            if existence == Existence::Unknown {
                continue;
            }
            let object = Arc::make_mut(object);
            object.frames_in_view = counted(object.frames_in_view, 1);
            let camera = view.world_from_camera.translation();
            object.detected_share.count(object.oriented_box.center(), camera, false);
            let is_absent = existence == Existence::Absent;
            object.looked_through = counted(object.looked_through, u32::from(is_absent));
        }
    }

    /// Whether the frame observed an object.
    fn is_observed(&self, birth: Birth) -> bool {
        self.observed.binary_search_by_key(&birth, |(birth, _)| *birth).is_ok()
    }

    /// Removes objects that frames look through, and tentative ones that are hardly ever detected where they
    /// are in view.
    fn remove_ghosts(&mut self) {
        let least = self.config.update.min_looked_through;
        let held = &self.held;
        let is_ghost = |object: &MapObject| {
            let is_gone = object.looked_through >= least && object.looked_through > object.observations;
            let was_mistaken =
                object.state == ObjectState::Tentative && PATIENCE * object.detected_share.share() < 1.0;
            (is_gone || was_mistaken) && !held.contains_key(&object.birth)
        };
        for &birth in &self.in_view {
            if self.map.born(birth).is_some_and(is_ghost) {
                self.report.removed.extend(self.map.remove(birth).map(|object| object.id));
            }
        }
    }

    fn merge_duplicates(&mut self, planes: &dyn SupportingPlanes) {
        for _ in 0..MAX_MERGES {
            let Some([kept, removed]) = self.find_duplicates() else { return };
            let Some(removed) = self.map.take(removed) else { return };
            for neighbour in removed.seen_apart.neighbours().filter(|&neighbour| neighbour != kept) {
                if let Some(neighbour) = self.map.born_mut(neighbour) {
                    neighbour.seen_apart.rename(removed.birth, kept);
                }
            }
            let place = self.map.place(kept);
            let Some(kept) = place.and_then(|place| self.map.objects.get_mut(place)) else { return };
            let kept = Arc::make_mut(kept);
            self.map.absorbed_by.insert(removed.id, kept.id);
            kept.merge(&removed, &self.limits);
            kept.shape = self.config.shapes.of(kept.label());
            self.reparameterizer.update(
                kept,
                self.vertical.direction(),
                &self.config.sizes,
                &self.config.shapes,
                planes,
            );
            self.map.index.place(kept);
            self.changed.insert(kept.birth);
            self.report.merged.push(ObjectMerge { kept: kept.id, removed: removed.id });
        }
    }

    /// The first pair of duplicates among the changed objects and those near them, carried ones apart: the one
    /// that stays, then the one that goes, which has fewer observations or, if equal, is the younger. `None`
    /// when there is no pair.
    fn find_duplicates(&mut self) -> Option<[Birth; 2]> {
        let update = &self.config.update;
        while let Some(&birth) = self.changed.first() {
            let is_carried = |birth: &Birth| self.held.contains_key(birth);
            if let Some(own) = self.map.born(birth).filter(|_| !is_carried(&birth)) {
                self.map.index.within(bounds(own.oriented_box.corners()), &mut self.near);
                let others = self.near.iter().filter(|other| !is_carried(other));
                let mut others = others.filter_map(|&other| self.map.born(other));
                if let Some(other) =
                    others.find(|other| other.birth != birth && are_duplicates(own, other, update))
                {
                    let (first, last) = if own.birth < other.birth { (own, other) } else { (other, own) };
                    let last_goes = last.observations <= first.observations;
                    let (kept, removed) = if last_goes { (first, last) } else { (last, first) };
                    return Some([kept.birth, removed.birth]);
                }
            }
            self.changed.remove(&birth);
        }
        None
    }

    /// Confirms an object when it was observed often enough, and often enough while in view, its size is
    /// plausible for its label, it looks like what was detected, and a view shows enough of it; otherwise makes
    /// it tentative.
    fn confirm_objects(&mut self) {
        let update = &self.config.update;
        for &birth in &self.in_view {
            let place = self.map.place(birth);
            let Some(object) = place.and_then(|place| self.map.objects.get_mut(place)) else { continue };
            let prior = self.config.sizes.of(&object.label);
            let lengths = object.oriented_box.lengths();
            let is_plausible =
                prior.is_none_or(|prior| prior.admits(lengths, object.axes.pose(), PRIOR_SLACK));
            let shape = object.shape();
            let is_confirmed = object.observations >= update.min_observations
                && is_plausible
                && object.detected_share.share() >= least_share(object, &shape, update.min_detected_share)
                && object.key_views.show(&shape, LEAST_SHOWN);
            match (object.state, is_confirmed) {
                (ObjectState::Tentative, true) => {
                    Arc::make_mut(object).state = ObjectState::Confirmed;
                    self.report.confirmed.push(object.id);
                }
                (ObjectState::Confirmed, false) => {
                    Arc::make_mut(object).state = ObjectState::Tentative;
                    self.report.unconfirmed.push(object.id);
                }
                _ => {}
            }
        }
    }
}

fn is_in_reach(place: [f64; 3]) -> bool {
    place.iter().all(|c| c.abs() <= REACH)
}

/// The share of the frames with an object in view that must have detected it to confirm it. What a detector
/// reports by mistake has boxes that no one shape fits in all views, and what is detected seldom because it is
/// small has boxes that fit: so all of `share` is asked for of a shape that just looks like its detections, less
/// of one that fits better, and no share is enough for one that looks like something else.
fn least_share(object: &MapObject, shape: &ObjectShape, share: f64) -> f64 {
    let fit = object.key_views.mean_iou(shape).unwrap_or(0.0);
    if fit < LOOKS_LIKE { f64::INFINITY } else { share * (1.0 - fit) / (1.0 - LOOKS_LIKE) }
}

/// Whether most of an observation's points lie on an object's surface.
fn holds_most(object: &MapObject, view: &ObjectView<'_>, observation: &ObjectObservation) -> bool {
    let step = observation.points.len().div_ceil(MOST_CHECKED).max(1);
    let places = observation.points.iter().step_by(step);
    let places = places.map(|point| view.world_from_camera.transform_point(point.map(f64::from)));
    let (held, all) =
        places.fold((0, 0), |(held, all), place| (held + usize::from(object.cloud.holds(place)), all + 1));
    2 * held >= all.max(1)
}

/// Whether an object's projection matches an observation's box.
fn looks_like(object: &MapObject, view: &ObjectView<'_>, observation: &ObjectObservation) -> bool {
    let camera = view.frame.camera();
    let projected = object.shape().image_box(camera, &view.world_from_camera);
    projected.is_some_and(|projected| {
        visible_iou(&projected, &observation.bounding_box, observation.completeness, camera) >= LOOKS_LIKE
    })
}
