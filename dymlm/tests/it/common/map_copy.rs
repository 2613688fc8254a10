//! A consumer of changes.

use std::collections::BTreeMap;

use dymlm::cloud::CloudBlock;
use dymlm::core::{ObjectId, Plane, PlaneId};
use dymlm::geometry::OrientedBox;
use dymlm::octree::{Extent, Leaf};
use dymlm::{MultiLevelMap, Selection};

/// What somebody knows of the maps who is told the changes alone.
#[derive(Default)]
pub(crate) struct MapCopy {
    cloud: BTreeMap<[i32; 3], CloudBlock>,
    /// By first cell and depth.
    leaves: BTreeMap<([u16; 3], u8), Leaf>,
    planes: BTreeMap<PlaneId, Plane>,
    objects: BTreeMap<ObjectId, OrientedBox>,
}

impl MapCopy {
    /// Replaces what has changed from the state that is known to another.
    pub(crate) fn follow(&mut self, known: &MultiLevelMap, now: &MultiLevelMap) {
        let changes = now.changes_since(known);
        assert_eq!((changes.from, changes.to), (known.revision(), now.revision()));
        self.cloud.extend(changes.cloud.into_iter().map(|block| (block.place, block)));
        self.cloud.retain(|_, block| !block.points.is_empty());
        let cubes = Cubes::new(changes.octree);
        self.leaves.retain(|_, leaf| !cubes.hold(leaf));
        for cube in cubes.by_place.values().flatten() {
            let leaves = now.octree().leaves_in_box(cube.min, cube.max).filter(|leaf| is_within(cube, leaf));
            self.leaves.extend(leaves.map(|leaf| ((leaf.key, leaf.depth), leaf)));
        }
        for (gone, into) in &changes.planes.merged {
            assert_eq!(now.planes().current_id(*gone), Some(*into));
        }
        let gone = changes.planes.merged.iter().map(|(gone, _)| gone).chain(&changes.planes.removed);
        self.planes.retain(|id, _| !gone.clone().any(|gone| gone == id));
        for &id in changes.planes.confirmed.iter().chain(&changes.planes.changed) {
            self.planes.extend(now.planes().plane(id).map(|plane| (id, plane.plane())));
        }
        let gone = changes.objects.merged.iter().map(|(gone, _)| gone).chain(&changes.objects.removed);
        self.objects.retain(|id, _| !gone.clone().any(|gone| gone == id));
        for &id in changes.objects.confirmed.iter().chain(&changes.objects.changed) {
            self.objects.extend(now.objects().object(id).map(|object| (id, object.oriented_box())));
        }
    }

    /// In what it is not these maps; `None` when it is, to the bit.
    pub(crate) fn difference(&self, map: &MultiLevelMap) -> Option<&'static str> {
        let mut whole: Vec<_> = map.cloud().point_cloud(Selection::Static).points().to_vec();
        let mut copy: Vec<_> = self.cloud.values().flat_map(|block| block.points.iter().copied()).collect();
        for points in [&mut whole, &mut copy] {
            points.sort_unstable_by_key(|point| point.map(f32::to_bits));
        }
        let leaves = map.octree().leaves().map(|leaf| ((leaf.key, leaf.depth), leaf));
        let planes = map.planes().iter().map(|plane| (plane.id(), plane.plane()));
        let objects = map.objects().objects().map(|object| (object.id(), object.oriented_box()));
        if whole != copy {
            Some("cloud")
        } else if self.leaves != leaves.collect() {
            Some("octree")
        } else if self.planes != planes.collect() {
            Some("planes")
        } else if self.objects != objects.collect() {
            Some("objects")
        } else {
            None
        }
    }
}

/// Cubes of an octree by which of the largest of them they lie in: a map has thousands of them, nearly all of
/// one size, and many more leaves.
struct Cubes {
    by_place: BTreeMap<[i64; 3], Vec<Extent>>,
    /// Side of the largest, metres.
    side: f64,
}

impl Cubes {
    fn new(cubes: Vec<Extent>) -> Self {
        let side = cubes.iter().map(|cube| cube.max[0] - cube.min[0]).fold(0.0, f64::max);
        let mut by_place: BTreeMap<_, Vec<Extent>> = BTreeMap::new();
        for cube in cubes {
            let middle = [0, 1, 2].map(|axis| 0.5 * (cube.min[axis] + cube.max[axis]));
            by_place.entry(place(middle, side)).or_default().push(cube);
        }
        Self { by_place, side }
    }

    fn hold(&self, leaf: &Leaf) -> bool {
        let near = self.by_place.get(&place(leaf.center, self.side));
        near.into_iter().flatten().any(|cube| is_within(cube, leaf))
    }
}

/// Which cube of a grid of cubes with this side a point lies in.
fn place(point: [f64; 3], side: f64) -> [i64; 3] {
    point.map(|c| (c / side).floor() as i64)
}

fn is_within(cube: &Extent, leaf: &Leaf) -> bool {
    (0..3).all(|axis| cube.min[axis] <= leaf.center[axis] && leaf.center[axis] < cube.max[axis])
}
