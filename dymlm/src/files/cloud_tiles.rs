use std::collections::{BTreeMap, BTreeSet};

use dymlm_cloud::CloudBlock;

/// Least side of a tile at first, metres: about as far as a depth camera sees well, so that a look is in few
/// of them, and what is sent again with it is not much more than it shows.
const MIN_SIDE: f64 = 4.0;
/// Most topics of tiles of one size: about as many as somebody scrolls through.
const MAX_TOPICS: usize = 128;

/// Which block of the cloud is on which topic.
///
/// What comes on a topic takes the place of what came there before, so that a topic has the whole cloud of a
/// tile, a cube of blocks. When there would be more than [`MAX_TOPICS`], tiles of twice the side begin, and
/// those before are emptied: there are never more topics than that for each doubling of the world's extent.
#[derive(Debug)]
pub(super) struct CloudTiles {
    /// A tile has 2^bits blocks a side.
    bits: u32,
    doublings: u32,
    /// The blocks with points of each tile.
    held: BTreeMap<[i32; 3], BTreeSet<[i32; 3]>>,
    /// Tiles of this size that there has been a message of.
    opened: BTreeSet<[i32; 3]>,
}

/// A tile whose cloud has changed, and its blocks; without blocks it is empty now.
#[derive(Debug, PartialEq)]
pub(super) struct ChangedTile {
    pub(super) topic: String,
    pub(super) blocks: Vec<[i32; 3]>,
}

impl CloudTiles {
    /// Of blocks of this side, metres.
    pub(super) fn new(block_side: f64) -> Self {
        let bits = (MIN_SIDE / block_side).log2().ceil().clamp(0.0, 20.0) as u32;
        Self { bits, doublings: 0, held: BTreeMap::new(), opened: BTreeSet::new() }
    }

    /// Takes in which blocks have changed.
    pub(super) fn update(&mut self, changes: &[CloudBlock]) -> Vec<ChangedTile> {
        let mut changed = BTreeSet::new();
        for block in changes {
            let tile = self.tile_of(block.place);
            let blocks = self.held.entry(tile).or_default();
            if block.points.is_empty() {
                blocks.remove(&block.place);
            } else {
                blocks.insert(block.place);
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
            0 => format!("/map/cloud/{tile}"),
            times => format!("/map/cloud/doubled_{times}/{tile}"),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use dymlm_cloud::{CloudMap, CloudMapConfig};
    use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose, SensorModel};
    use proptest::prelude::*;

    use super::*;

    /// A block as a map gives it, with points or without, at another place.
    fn block(place: [i32; 3], is_full: bool) -> CloudBlock {
        let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).unwrap();
        let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
        let empty = map.clone();
        let depth = DepthImage::new(64, 48, vec![1.0; 64 * 48]).unwrap();
        // One frame alone proves nothing static.
        for time in 0..4 {
            let frame = Frame::new(f64::from(time), camera, depth.clone(), None).unwrap();
            map.insert(&frame, None, &Pose::identity()).unwrap();
        }
        let mut block = map.changes_since(&empty).into_iter().find(|block| !block.points.is_empty()).unwrap();
        block.place = place;
        if !is_full {
            block.points.clear();
        }
        block
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
        let mut tiles = CloudTiles::new(0.08);
        let messages = tiles.update(&[block([63, -1, 64], true), block([-64, -65, 0], true)]);
        let topics: Vec<_> = messages.iter().map(|message| message.topic.as_str()).collect();
        assert_eq!(topics, ["/map/cloud/xm1_ym2_z0", "/map/cloud/x0_ym1_z1"]);
    }

    #[test]
    fn what_is_empty_is_sent_empty_once() {
        let mut tiles = CloudTiles::new(0.08);
        let (full, empty) = (block([1, 2, 3], true), block([1, 2, 3], false));
        assert_eq!(tiles.update(std::slice::from_ref(&empty)), []);
        assert_eq!(tiles.update(&[full])[0].blocks, [[1, 2, 3]]);
        assert_eq!(tiles.update(&[empty])[0].blocks, [[0; 3]; 0]);
        assert_eq!(tiles.update(&[]), []);
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
            let (full, empty) = (block([0; 3], true), block([0; 3], false));
            let (mut tiles, mut viewer) = (CloudTiles::new(0.08), Viewer::default());
            let mut expected = BTreeSet::new();
            for step in steps {
                let changes: Vec<CloudBlock> = step.iter().map(|&(place, is_full)| {
                    let mut block = if is_full { full.clone() } else { empty.clone() };
                    block.place = place;
                    block
                }).collect();
                for (place, is_full) in step {
                    if is_full { expected.insert(place); } else { expected.remove(&place); }
                }
                viewer.take(tiles.update(&changes));
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
