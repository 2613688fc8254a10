use dymlm_geometry::OrientedBox;

use parry3d::math::Pose3;

use super::builder::Builder;
use super::carried::{Carried, CarriedObject, CarriedSet, TARGET};
use super::event::Happening;
use super::tour::Tour;
use super::walk::Walk;
use super::{Instance, Motion, Part, Person, Shape, Viewpoint};
use crate::CameraPath;
use crate::to_pose::to_pose;
use crate::truth::box_around;

/// A room in its own frame: z up, the floor at z = 0, metres.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    /// The bodies as they stand at the end of the sequence; most of them stand there all the time.
    pub(crate) static_parts: Vec<Part>,
    /// The things that the parts belong to.
    pub(crate) instances: Vec<Instance>,
    pub(crate) people: Vec<Person>,
    /// The thing that a hand carries, if there is one.
    pub(crate) carried: Option<Carried>,
    /// Where the camera is and looks.
    pub(crate) viewpoint: Viewpoint,
    /// The events.
    pub(crate) happenings: Vec<Happening>,
    /// The door on the wall.
    pub(super) door: Option<usize>,
    /// Where a trolley can roll.
    pub(super) way: Walk,
    /// Where the camera goes in a building.
    pub(super) tour: Option<Tour>,
}

impl Scene {
    /// A scene from the things built, the viewpoint and the trolley's way.
    pub(super) fn of(built: Builder, viewpoint: Viewpoint, way: Walk) -> Self {
        let Builder { parts, instances, people, door, .. } = built;
        let (carried, happenings) = (None, Vec::new());
        let tour = None;
        Self { static_parts: parts, instances, people, carried, viewpoint, happenings, door, way, tour }
    }

    /// The camera's pose at `time` seconds.
    pub(crate) fn scene_from_camera(&self, path: CameraPath, time: f64) -> Pose3 {
        match &self.tour {
            Some(tour) => path.scene_from_camera_on(tour, time),
            None => path.scene_from_camera(&self.viewpoint, time),
        }
    }

    /// In the office: adds a thing that a hand carries, and turns the camera towards it.
    pub(crate) fn carry(&mut self, what: CarriedObject) {
        let CarriedSet { carried, table, instances } = CarriedSet::new(what, self.instances.len());
        self.static_parts.extend(table);
        self.instances.extend(instances);
        self.viewpoint.target = TARGET;
        self.carried = Some(carried);
    }

    /// Puts all bodies at `time` seconds into `parts`, always in the same order; the bodies that stand at the
    /// end come first.
    pub(crate) fn parts_at(&self, time: f64, parts: &mut Vec<Part>, moving: &mut Vec<Part>) {
        self.moving_parts(time, moving);
        parts.clear();
        parts.extend_from_slice(&self.static_parts);
        for happening in &self.happenings {
            for part in parts.iter_mut().filter(|part| part.instance == happening.instance) {
                match happening.displaced(part, time) {
                    Some(displaced) => *part = displaced,
                    None => part.shape = Shape::ABSENT,
                }
            }
        }
        parts.append(moving);
    }

    /// Puts the bodies of all people, of the carried thing and of things that are gone at the end into
    /// `parts`, at `time` seconds.
    pub(crate) fn moving_parts(&self, time: f64, parts: &mut Vec<Part>) {
        parts.clear();
        self.people.iter().for_each(|person| person.pose(time, parts));
        self.carried.iter().for_each(|carried| carried.pose(time, parts));
        self.happenings.iter().for_each(|happening| happening.pose_passing(time, parts));
    }

    /// [`moving_parts`](Self::moving_parts), and the bodies that are not yet where they stand at the end: all
    /// bodies that can leave a ghost.
    pub(crate) fn passing_parts(&self, time: f64, parts: &mut Vec<Part>) {
        self.moving_parts(time, parts);
        for happening in self.happenings.iter().filter(|happening| happening.is_away(time)) {
            let own = self.static_parts.iter().filter(|part| part.instance == happening.instance);
            parts.extend(own.filter_map(|part| happening.displaced(part, time)));
        }
    }

    /// The [`passing_parts`](Self::passing_parts) that no detector reports: the first `overlooked` people,
    /// and the things of events.
    pub(crate) fn undetected_parts(&self, time: f64, overlooked: usize, parts: &mut Vec<Part>) {
        self.passing_parts(time, parts);
        let is_event = |part: &Part| self.happening_to(part.instance).next().is_some();
        let is_overlooked =
            |part: &Part| self.people.iter().take(overlooked).any(|person| person.instance == part.instance);
        parts.retain(|part| is_event(part) || is_overlooked(part));
    }

    /// Puts the bodies of all people at `time` seconds into `parts`.
    pub(crate) fn people_parts(&self, time: f64, parts: &mut Vec<Part>) {
        parts.clear();
        self.people.iter().for_each(|person| person.pose(time, parts));
    }

    /// The boxes of a thing before and after its event; `None` while the thing is not there.
    pub(crate) fn places_of(&self, happening: &Happening) -> [Option<OrientedBox>; 2] {
        [f64::NEG_INFINITY, f64::INFINITY].map(|time| {
            let mut parts = Vec::new();
            happening.pose_passing(time, &mut parts);
            let own = self.static_parts.iter().filter(|part| part.instance == happening.instance);
            parts.extend(own.filter_map(|part| happening.displaced(part, time)));
            let parts: Vec<&Part> = parts.iter().collect();
            let scene_from_thing = happening.scene_from_thing(time, &self.instances[happening.instance]);
            box_around(&to_pose(&scene_from_thing), &parts)
        })
    }

    /// Whether a thing is a mover, moving or not.
    pub(crate) fn is_mover(&self, instance: usize) -> bool {
        self.instances.get(instance).is_some_and(|thing| thing.motion == Motion::Moves)
    }

    /// Whether a thing is a mover, or is moved by an event at `time`.
    pub(crate) fn moves(&self, instance: usize, time: f64) -> bool {
        self.is_mover(instance) || self.happening_to(instance).any(|happening| happening.moves(time))
    }

    /// Whether a thing is a mover, or at `time` is not where it stands at the end.
    pub(crate) fn is_away(&self, instance: usize, time: f64) -> bool {
        self.is_mover(instance) || self.happening_to(instance).any(|happening| happening.is_away(time))
    }

    pub(super) fn happening_to(&self, instance: usize) -> impl Iterator<Item = &Happening> {
        self.happenings.iter().filter(move |happening| happening.instance == instance)
    }
}
