use super::builder::Builder;
use super::carried::{Carried, CarriedObject, CarriedSet, TARGET};
use super::{Instance, Motion, Part, Person, Viewpoint};

/// A room in its own frame: z up, the floor at z = 0, metres.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    /// The bodies that stay where they are.
    pub(crate) static_parts: Vec<Part>,
    /// The things that parts belong to.
    pub(crate) instances: Vec<Instance>,
    pub(crate) people: Vec<Person>,
    /// The thing that a hand carries, if there is one.
    pub(crate) carried: Option<Carried>,
    /// Where the camera finds its place.
    pub(crate) viewpoint: Viewpoint,
}

impl Scene {
    /// What was built, seen from a viewpoint.
    pub(super) fn of(built: Builder, viewpoint: Viewpoint) -> Self {
        let Builder { parts, instances, people, .. } = built;
        Self { static_parts: parts, instances, people, carried: None, viewpoint }
    }

    /// In the office: adds a thing that a hand carries, and the camera looks at it.
    pub(crate) fn carry(&mut self, what: CarriedObject) {
        let CarriedSet { carried, table, instances } = CarriedSet::new(what, self.instances.len());
        self.static_parts.extend(table);
        self.instances.extend(instances);
        self.viewpoint.target = TARGET;
        self.carried = Some(carried);
    }

    /// Puts the bodies of all people and of the carried thing at `time` seconds into `parts`.
    pub(crate) fn moving_parts(&self, time: f64, parts: &mut Vec<Part>) {
        parts.clear();
        self.people.iter().for_each(|person| person.pose(time, parts));
        self.carried.iter().for_each(|carried| carried.pose(time, parts));
    }

    /// Whether a thing moves.
    pub(crate) fn moves(&self, instance: usize) -> bool {
        self.instances.get(instance).is_some_and(|thing| thing.motion == Motion::Moves)
    }
}
