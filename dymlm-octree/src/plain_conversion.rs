use dymlm_core::{PointCloud, Rgb};

use crate::Octree;
use crate::insertion::CellColors;

impl Octree {
    /// One hit for each cell that holds points. The second step of [`Octree::from_cloud`].
    pub(crate) fn hit_points(&mut self, cloud: &PointCloud) {
        let mut keys: Vec<_> =
            cloud.points().iter().filter_map(|&point| self.lattice.key_f32(point)).collect();
        keys.sort_unstable();
        keys.dedup();
        for &key in &keys {
            let model = self.model;
            self.tree.change_cell(key, |old| Some(model.updated(old.unwrap_or(0.0), model.hit)));
        }
        self.tree.settle();
        if let (Some(colors), true) = (cloud.colors(), self.tree.has_colors()) {
            self.color_points(cloud, colors);
        }
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
