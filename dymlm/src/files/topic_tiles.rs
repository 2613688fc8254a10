use std::collections::{BTreeMap, BTreeSet};

/// Least side of a tile at first, metres: about as far as a depth camera sees well, so that a look is in few
/// of them, and what is sent again with it is not much more than it shows.
const MIN_SIDE: f64 = 4.0;
/// Most topics of tiles of one size: about as many as somebody scrolls through.
const MAX_TOPICS: usize = 128;

/// Which block of the world is on which topic.
///
/// What comes on a topic takes the place of what came there before, so that a topic has all points of a tile, a
/// cube of blocks. When there would be more than [`MAX_TOPICS`], tiles of twice the side begin, and
/// those before are emptied: there are never more topics than that for each doubling of the world's extent.
#[derive(Debug)]
pub(super) struct TopicTiles {
    /// Before the names of all topics.
    prefix: &'static str,
    /// A tile has 2^bits blocks a side.
    bits: u32,
    doublings: u32,
    /// The blocks of each tile that hold something.
    held: BTreeMap<[i32; 3], BTreeSet<[i32; 3]>>,
    /// Tiles of this size that there has been a message of.
    opened: BTreeSet<[i32; 3]>,
}

/// A tile in which something has changed, and its blocks; without blocks it is empty now.
#[derive(Debug, PartialEq)]
pub(super) struct ChangedTile {
    pub(super) topic: String,
    pub(super) blocks: Vec<[i32; 3]>,
}

impl TopicTiles {
    /// Of blocks of this side, metres.
    pub(super) fn new(prefix: &'static str, block_side: f64) -> Self {
        let bits = (MIN_SIDE / block_side).log2().ceil().clamp(0.0, 20.0) as u32;
        Self { prefix, bits, doublings: 0, held: BTreeMap::new(), opened: BTreeSet::new() }
    }

    /// Takes in which blocks have changed, and whether they hold anything now.
    pub(super) fn update(&mut self, changes: impl IntoIterator<Item = ([i32; 3], bool)>) -> Vec<ChangedTile> {
        let mut changed = BTreeSet::new();
        for (block, is_filled) in changes {
            let tile = self.tile_of(block);
            let blocks = self.held.entry(tile).or_default();
            if is_filled {
                blocks.insert(block);
            } else {
                blocks.remove(&block);
            }
            changed.insert(tile);
        }
        // What comes and goes between two updates needs no topic.
        changed
            .retain(|tile| self.opened.contains(tile) || self.held.get(tile).is_some_and(|b| !b.is_empty()));
        let mut messages = Vec::new();
        if self.opened.union(&changed).count() > MAX_TOPICS {
            messages = self.cleared();
            while self.opened.union(&changed).count() > MAX_TOPICS {
                self.double();
                changed = self.held.keys().copied().collect();
            }
        }
        messages.extend(changed.iter().map(|&tile| self.message(tile)));
        self.opened.extend(changed);
        self.held.retain(|_, blocks| !blocks.is_empty());
        messages
    }

    /// Forgets all blocks; gives the tiles that are empty now.
    pub(super) fn clear(&mut self) -> Vec<ChangedTile> {
        let messages = self.cleared();
        self.held.clear();
        messages
    }

    fn cleared(&self) -> Vec<ChangedTile> {
        let empty = |&tile: &[i32; 3]| ChangedTile { topic: self.topic(tile), blocks: Vec::new() };
        self.opened.iter().map(empty).collect()
    }

    fn double(&mut self) {
        (self.bits, self.doublings) = (self.bits + 1, self.doublings + 1);
        self.opened.clear();
        let blocks: Vec<_> = std::mem::take(&mut self.held).into_values().flatten().collect();
        for block in blocks {
            self.held.entry(self.tile_of(block)).or_default().insert(block);
        }
    }

    fn tile_of(&self, block: [i32; 3]) -> [i32; 3] {
        block.map(|c| c >> self.bits.min(31))
    }

    fn message(&self, tile: [i32; 3]) -> ChangedTile {
        let blocks = self.held.get(&tile).into_iter().flatten().copied().collect();
        ChangedTile { topic: self.topic(tile), blocks }
    }

    /// ROS 2 has letters, digits and underscores in its names: `m` is minus.
    fn topic(&self, [x, y, z]: [i32; 3]) -> String {
        let sign = |c: i32| if c < 0 { "m" } else { "" };
        let [i, j, k] = [x, y, z].map(i32::unsigned_abs);
        let tile = format!("x{}{i}_y{}{j}_z{}{k}", sign(x), sign(y), sign(z));
        match self.doublings {
            0 => format!("{}/{tile}", self.prefix),
            times => format!("{}/doubled_{times}/{tile}", self.prefix),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn tiles() -> TopicTiles {
        TopicTiles::new("/map/cloud", 0.08)
    }

    /// What somebody sees who keeps the last message of each topic.
    #[derive(Default)]
    struct Viewer(BTreeMap<String, Vec<[i32; 3]>>);

    impl Viewer {
        fn take(&mut self, messages: Vec<ChangedTile>) {
            self.0.extend(messages.into_iter().map(|message| (message.topic, message.blocks)));
        }

        fn blocks(&self) -> Vec<[i32; 3]> {
            let mut blocks: Vec<_> = self.0.values().flatten().copied().collect();
            blocks.sort_unstable();
            blocks
        }
    }

    #[test]
    fn names_are_those_of_ros() {
        let messages = tiles().update([([63, -1, 64], true), ([-64, -65, 0], true)]);
        let topics: Vec<_> = messages.iter().map(|message| message.topic.as_str()).collect();
        assert_eq!(topics, ["/map/cloud/xm1_ym2_z0", "/map/cloud/x0_ym1_z1"]);
    }

    #[test]
    fn what_is_empty_is_sent_empty_once() {
        let (mut tiles, block) = (tiles(), [1, 2, 3]);
        assert_eq!(tiles.update([(block, false)]), []);
        assert_eq!(tiles.update([(block, true)])[0].blocks, [block]);
        assert_eq!(tiles.update([(block, false)])[0].blocks, [[0; 3]; 0]);
        assert_eq!(tiles.update([]), []);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn a_viewer_has_each_block_once_on_a_bounded_number_of_topics(
            steps in proptest::collection::vec(
                proptest::collection::vec((proptest::array::uniform3(-3000_i32..3000), any::<bool>()), 0..120),
                1..8,
            ),
        ) {
            let (mut tiles, mut viewer) = (tiles(), Viewer::default());
            let mut expected = BTreeSet::new();
            for step in steps {
                for &(place, is_full) in &step {
                    if is_full { expected.insert(place); } else { expected.remove(&place); }
                }
                viewer.take(tiles.update(step));
                prop_assert_eq!(viewer.blocks(), expected.iter().copied().collect::<Vec<_>>());
                prop_assert!(tiles.opened.len() <= MAX_TOPICS);
                // 6000 blocks are 94 tiles of 64 a side; half a dozen doublings are enough.
                prop_assert!(viewer.0.len() <= 7 * MAX_TOPICS);
            }
            viewer.take(tiles.clear());
            prop_assert!(viewer.blocks().is_empty());
        }
    }
}
