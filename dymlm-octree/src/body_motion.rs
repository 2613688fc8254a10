use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::Point;

use crate::Octree;
use crate::insertion::CellColors;
use crate::lattice::Key;

/// What [`Octree::move_body`] has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct OctreeMotion {
    /// Number of smallest cells that the body left and that are free now.
    pub emptied: usize,
    /// Number of smallest cells that the body reached and that are occupied now.
    pub occupied: usize,
}

impl Octree {
    /// Moves a body whose surface points went from `from` to `to` (metres, world; in pairs). The cells that
    /// it left become free, as after one miss, unless they also hold one of the points that `stayed`; the
    /// cells that it reached become as surely occupied as those that it left, and at least as surely as after
    /// one hit. Colours go with the body. Points outside the map and points with NaN are skipped.
    /// O(points log points).
    pub fn move_body(&mut self, from: &[Point], to: &[Point], stayed: &[Point]) -> OctreeMotion {
        let key_of = |point: &Point| self.lattice.key(point.map(f64::from));
        let stayed: BTreeSet<Key> = stayed.iter().filter_map(key_of).collect();
        let left: BTreeSet<Key> =
            from.iter().filter_map(key_of).filter(|key| !stayed.contains(key)).collect();
        let (mut reached, mut colors) = (BTreeMap::<Key, f32>::new(), CellColors::default());
        for (from, to) in from.iter().zip(to) {
            let Some(key) = key_of(to) else { continue };
            let from = from.map(f64::from);
            let before = self.log_odds(from).unwrap_or(self.model.hit);
            let sure = reached.entry(key).or_insert(self.model.hit);
            *sure = sure.max(before);
            if let Some(color) = self.color(from) {
                colors.add(key, color);
            }
        }
        let (model, mut motion) = (self.model, OctreeMotion::default());
        for key in left.into_iter().filter(|key| !reached.contains_key(key)) {
            motion.emptied += 1;
            // A cell that is forgotten loses its colour.
            self.tree.change_cell(key, |_| None);
            self.tree.change_cell(key, |_| Some(model.clamped(model.miss)));
        }
        for (key, sure) in reached {
            motion.occupied += 1;
            self.tree.change_cell(key, |now| Some(model.clamped(now.unwrap_or(sure).max(sure))));
        }
        colors.drain(|key, color| self.tree.blend_color(key, color));
        self.tree.settle();
        motion
    }
}
