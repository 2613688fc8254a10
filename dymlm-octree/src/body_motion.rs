use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::Point;

use crate::Octree;
use crate::lattice::Key;

/// What [`Octree::move_body`] has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct OctreeMotion {
    /// Smallest cells that are free now where the body stood.
    pub emptied: usize,
    /// Smallest cells that are occupied where it stands now.
    pub occupied: usize,
}

impl Octree {
    /// A body was moved: its surface points went from `from` to `to` (metres, world; in pairs). Cells that
    /// held it are free now, as after one look through them, unless they also hold one of the points that
    /// `stayed`; cells that it came to are as surely occupied as those that it left, and no less than after
    /// one hit. Points outside the map and those with NaN are passed over. O(points log points).
    pub fn move_body(&mut self, from: &[Point], to: &[Point], stayed: &[Point]) -> OctreeMotion {
        let key_of = |point: &Point| self.lattice.key(point.map(f64::from));
        let stayed: BTreeSet<Key> = stayed.iter().filter_map(key_of).collect();
        let left: BTreeSet<Key> =
            from.iter().filter_map(key_of).filter(|key| !stayed.contains(key)).collect();
        let mut reached = BTreeMap::<Key, f32>::new();
        for (from, to) in from.iter().zip(to) {
            let Some(key) = key_of(to) else { continue };
            let before = self.log_odds(from.map(f64::from)).unwrap_or(self.model.hit);
            let sure = reached.entry(key).or_insert(self.model.hit);
            *sure = sure.max(before);
        }
        let (model, mut motion) = (self.model, OctreeMotion::default());
        for key in left.into_iter().filter(|key| !reached.contains_key(key)) {
            motion.emptied += 1;
            self.tree.change_cell(key, |_| Some(model.clamped(model.miss)));
        }
        for (key, sure) in reached {
            motion.occupied += 1;
            self.tree.change_cell(key, |now| Some(model.clamped(now.unwrap_or(sure).max(sure))));
        }
        self.tree.settle();
        motion
    }
}
