use std::collections::{BTreeMap, BTreeSet};

use super::topic_tiles::TopicTiles;

/// A plane or an object of the map, by its id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Thing {
    Plane(u64),
    Object(u64),
}

/// Which planes and objects have their outlines on which topic: each is where its centre is, so that what changes
/// in one room does not send the outlines of all others again.
#[derive(Debug)]
pub(super) struct OutlineTiles {
    tiles: TopicTiles,
    /// Side of the blocks by which places are told apart, metres.
    block_side: f64,
    places: BTreeMap<Thing, [i32; 3]>,
    things: BTreeMap<[i32; 3], BTreeSet<Thing>>,
}

impl OutlineTiles {
    /// With tiles of blocks of this side, metres.
    pub(super) fn new(block_side: f64) -> Self {
        let tiles = TopicTiles::new("/map/outlines", block_side);
        Self { tiles, block_side, places: BTreeMap::new(), things: BTreeMap::new() }
    }

    /// Takes in which things have changed, with their centres (metres, world), or `None` for those that are gone.
    /// Returns the topics that are other than before, with all that is on them now.
    pub(super) fn update(
        &mut self,
        changed: impl IntoIterator<Item = (Thing, Option<[f64; 3]>)>,
    ) -> Vec<(String, Vec<Thing>)> {
        let mut touched = BTreeSet::new();
        for (thing, center) in changed {
            let before = self.places.remove(&thing);
            let now = center.map(|center| center.map(|c| (c / self.block_side).floor() as i32));
            if let Some(before) = before
                && let Some(things) = self.things.get_mut(&before)
            {
                things.remove(&thing);
            }
            if let Some(now) = now {
                self.places.insert(thing, now);
                self.things.entry(now).or_default().insert(thing);
            }
            touched.extend(before.into_iter().chain(now));
        }
        self.things.retain(|_, things| !things.is_empty());
        let changes = touched.into_iter().map(|place| (place, self.things.contains_key(&place)));
        let changed = self.tiles.update(changes);
        let on = |place: &[i32; 3]| self.things.get(place).into_iter().flatten().copied();
        changed.into_iter().map(|tile| (tile.topic, tile.blocks.iter().flat_map(on).collect())).collect()
    }

    /// Forgets all things; gives the topics that are empty now.
    pub(super) fn clear(&mut self) -> impl Iterator<Item = String> {
        (self.places, self.things) = (BTreeMap::new(), BTreeMap::new());
        self.tiles.clear().into_iter().map(|tile| tile.topic)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_near_a_change_is_sent_again() {
        let mut tiles = OutlineTiles::new(0.08);
        let (wall, cup) = (Thing::Plane(3), Thing::Object(3));
        let far = (0..50).map(|id| (Thing::Plane(100 + id), Some([100.0, 0.0, 0.0])));
        let first = tiles.update(far.chain([(wall, Some([1.0; 3])), (cup, Some([2.0; 3]))]));
        assert_eq!(first.len(), 2);
        assert_eq!(
            tiles.update([(cup, Some([1.5; 3]))]),
            [("/map/outlines/x0_y0_z0".into(), vec![wall, cup])]
        );
        let carried = tiles.update([(cup, Some([-1.0, 1.0, 1.0]))]);
        assert_eq!(
            carried,
            [("/map/outlines/xm1_y0_z0".into(), vec![cup]), (first[0].0.clone(), vec![wall])]
        );
        assert_eq!(tiles.update([(cup, None)]), [("/map/outlines/xm1_y0_z0".into(), vec![])]);
        assert_eq!(tiles.update([]), []);
        assert_eq!(tiles.clear().count(), 3);
        assert_eq!(tiles.update([(cup, None)]), []);
    }
}
