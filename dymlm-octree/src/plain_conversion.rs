use dymlm_core::{PointCloud, Rgb};

use crate::Octree;
use crate::insertion::CellColors;

impl Octree {
    /// Sets each cell that holds points occupied. The second step of [`Octree::from_cloud`].
    pub(crate) fn hit_points(&mut self, cloud: &PointCloud) {
        let mut keys: Vec<_> =
            cloud.points().iter().filter_map(|&point| self.lattice.key_f32(point)).collect();
        keys.sort_unstable();
        keys.dedup();
        let occupied = self.model.clamped(self.model.hit);
        for &key in &keys {
            self.tree.change_cell(key, |_| Some(occupied));
        }
        // Before equal cells become one leaf: it has the mean of their colours.
        if let (Some(colors), true) = (cloud.colors(), self.tree.has_colors()) {
            self.color_points(cloud, colors);
        }
        self.tree.settle();
    }

    fn color_points(&mut self, cloud: &PointCloud, colors: &[Rgb]) {
        let mut sums = CellColors::default();
        for (&point, &color) in cloud.points().iter().zip(colors) {
            if let Some(key) = self.lattice.key_f32(point) {
                sums.add(key, color);
            }
        }
        sums.drain(|key, color| self.tree.blend_color(key, color));
    }
}
