//! Generates rooms from a seed.

mod floor_plan;
mod furnishing;
mod in_building;
mod station;
mod table_setting;
mod ways;

use self::furnishing::Furnished;
pub(super) use self::in_building::{Site, SiteTable, furnish};
use self::station::{Station, choose_station};
use self::ways::{CLEARANCE, are_seen, choose_ways, walks};
use super::person::Action;
use super::walk::Walk;
use super::{Activity, Cast, Scene};
use crate::noise::{Use, stream};

/// Random rooms that are tried for a seed before the designed room is taken.
pub(super) const ATTEMPTS: u64 = 10_000;

/// A furnished room with the camera's station and the people's walks.
struct Plan {
    furnished: Furnished,
    station: Station,
    walks: [Walk; 2],
}

impl Scene {
    /// A random room. Tables and seats are placed at random until they fit, things are put on the tables, a
    /// station that sees them is chosen, ways are sought over the free floor, and more furniture is put on
    /// the rest of the floor. When a step fails, or the station sees too little, the next room is tried. The
    /// room is the same whether its people walk or sit; for people at desks it is another.
    pub(super) fn random_room(cast: &Cast, seed: u64) -> Self {
        match (0..ATTEMPTS).find_map(|attempt| plan(cast, seed, attempt)) {
            Some(plan) => plan.with_people(cast),
            None => Self::two_tables(cast),
        }
    }
}

fn plan(cast: &Cast, seed: u64, attempt: u64) -> Option<Plan> {
    let mut rng = stream(seed, Use::Scene, 2, attempt);
    let mut furnished = Furnished::with_tables(cast, &mut rng)?;
    let station = choose_station(&furnished, &mut rng)?;
    let ways = choose_ways(&furnished, &station, &mut rng)?;
    let samples = ways.iter().flat_map(|way| &way.samples).copied();
    furnished.floor.keep_free(samples, CLEARANCE);
    furnished.floor.reserve(station.floor());
    furnished.fill(&mut rng);
    // The furniture added last may occlude what was seen before.
    let good = station.sees_enough(&furnished) && are_seen(&ways, &furnished, &station);
    let walks = walks(&ways, &mut rng)?;
    good.then_some(Plan { furnished, station, walks })
}

impl Plan {
    fn with_people(self, cast: &Cast) -> Scene {
        let way = self.walks[1].ahead();
        let actions = match (cast.activity, &self.furnished.seats[..]) {
            (Activity::Sitting | Activity::AtDesks, &[first, second]) => {
                let [phases, _] = cast.choice;
                [(first, phases[0]), (second, phases[1])]
                    .map(|(chair, phase)| cast.sits((chair.place, chair.yaw), phase))
            }
            _ => self.walks.map(Action::Walks),
        };
        let mut b = self.furnished.builder;
        cast.enter(&mut b, actions);
        Scene::of(b, self.station.viewpoint(), way)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rooms_are_full_and_differ() {
        let rooms: Vec<Scene> =
            (0..4).map(|seed| Scene::random_room(&Cast::usual(Activity::Walking, 2), seed)).collect();
        for room in &rooms {
            let labelled = room.instances.iter().filter(|thing| thing.label.is_some()).count();
            assert!(room.static_parts.len() > 60 && labelled > 14, "{labelled} labelled things");
        }
        let sizes: Vec<_> = rooms.iter().map(|room| room.static_parts[0].shape.half_extents()).collect();
        assert!((0..4).all(|i| (0..i).all(|j| sizes[i].distance(sizes[j]) > 0.01)), "{sizes:?}");
    }

    #[test]
    fn the_room_is_the_same_whatever_people_do() {
        let places = |activity, people| -> Vec<_> {
            let room = Scene::random_room(&Cast::usual(activity, people), 5);
            room.static_parts.iter().map(|part| part.scene_from_part).collect()
        };
        assert_eq!(places(Activity::Walking, 2), places(Activity::Sitting, 1));
    }
}
