use crate::{Extent, Octree};

impl Octree {
    /// Cubes in which log-odds differ from an earlier map of the same resolution: the earlier map's leaves
    /// outside the cubes and this map's leaves inside them together are this map; a leaf is inside where its
    /// centre is ([`leaves_in_box`](Self::leaves_in_box) also gives those that only touch the box). No leaf
    /// of either map lies partly in a cube. A cube has 8 cells a side, more where a larger pruned leaf was
    /// split, formed or changed as a whole, and where space became known of which nothing was. Cubes do not
    /// overlap. Colours are not compared. The order is fixed.
    ///
    /// O(nodes that the maps do not share): where the earlier map is a clone of this one, the nodes that have
    /// changed.
    pub fn changes_since(&self, earlier: &Self) -> Vec<Extent> {
        let mut changes = Vec::new();
        self.tree.for_each_difference(&earlier.tree, &mut |corner, side| {
            let min = self.lattice.corner(corner);
            let length = f64::from(side) * self.resolution();
            changes.push(Extent { min, max: min.map(|c| c + length) });
        });
        changes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::OctreeConfig;

    #[test]
    fn what_differs_lies_within_the_changes_and_they_are_few() {
        let mut map = Octree::new(OctreeConfig::default()).unwrap();
        let wall = |x: f32| -> Vec<[f32; 3]> {
            (0..400).map(|i| [x, (i % 20) as f32 * 0.05 - 0.5, (i / 20) as f32 * 0.05 - 0.5]).collect()
        };
        assert!(map.changes_since(&map).is_empty());
        let mut earlier = map.clone();
        for step in 0..12 {
            let x = if step % 3 == 0 { 2.0 } else { 3.1 };
            map.insert_scan([0.0, 0.0, 0.0], &wall(x)).unwrap();
            let changes = map.changes_since(&earlier);
            assert_eq!(changes.len(), earlier.changes_since(&map).len());
            let is_within = |place: [f64; 3]| {
                changes.iter().any(|cube| (0..3).all(|a| cube.min[a] <= place[a] && place[a] < cube.max[a]))
            };
            let mut within = 0;
            for leaf in map.leaves().chain(earlier.leaves()) {
                let differs = map.log_odds(leaf.center) != earlier.log_odds(leaf.center);
                assert!(!differs || is_within(leaf.center));
                within += usize::from(is_within(leaf.center));
            }
            assert!(within > 0 && changes.len() < 400, "{within} {}", changes.len());
            earlier = map.clone();
        }
    }
}
