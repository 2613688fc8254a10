use dymlm_core::{Point, Rgb};

use super::Source;
use super::fusion::Leaving;
use super::surface::{Moments, Surface};
use crate::block_store::{CellBits, count, for_each_bit, union};
use crate::changes::{Change, Touched};
use crate::paging::record;

/// The static part of a block of voxels.
#[derive(Debug, Clone, Default)]
pub(crate) struct StaticBlock {
    /// Voxels that are no ghosts.
    pub(super) firm: CellBits,
    /// Greatest weight of these voxels.
    pub(super) heaviest: f32,
    /// How far these voxels look for heavier ones around, whole voxels.
    pub(super) reach: u8,
    /// Those of these voxels that are no noise either.
    pub(super) statics: CellBits,
    /// Moments of the voxels that are no ghosts.
    pub(super) moments: Moments,
    /// The surface that these voxels and those of the blocks around are readings of.
    pub(super) surface: Surface,
    /// Points of the block's static voxels that lie in blocks around.
    pub(super) leaving: Vec<Leaving>,
    /// Whether the points are not the means of the static voxels, in their order.
    pub(super) is_moved: bool,
    /// The static points by their voxels, and the colours of the first of them, as many as have one.
    pub(super) points: Vec<Point>,
    pub(super) colors: Vec<Rgb>,
}

/// The voxels of a block that are judged anew, and those that are not.
pub(super) struct Asked {
    /// Those that are static and stay so.
    pub(super) settled: CellBits,
    /// Those that have changed themselves, or that a surface has reached or left.
    pub(super) changed: CellBits,
    /// Those that were static, and those that were noise, which changes around may affect.
    pub(super) kept: CellBits,
    pub(super) noise: CellBits,
}

record!(StaticBlock { firm, heaviest, reach, statics, moments, surface, leaving, is_moved, points, colors });
impl StaticBlock {
    /// The firm voxels that changes in the block and around may affect.
    pub(super) fn asked(&self, change: Option<&Change>, touched: &Touched) -> Asked {
        let changed = change.map_or(CellBits::default(), |change| change.voxels);
        let changed = union(changed, touched.resurfaced);
        let [raised, lowered] = [touched.effect.raised, touched.effect.lowered]
            .map(|effect| if effect > 0.0 { u64::MAX } else { 0 });
        let none = CellBits::default();
        let mut asked = Asked { settled: none, changed: none, kept: none, noise: none };
        for (word, changed) in changed.into_iter().enumerate() {
            let others = self.firm[word] & !changed;
            let [raised, lowered] = [raised, lowered].map(|effect| effect & touched.near[word]);
            asked.changed[word] = self.firm[word] & changed;
            asked.kept[word] = others & self.statics[word] & raised;
            asked.noise[word] = others & !self.statics[word] & lowered;
            asked.settled[word] = others & self.statics[word] & !raised;
        }
        asked
    }

    /// Whether all of its voxels are ghosts.
    pub(super) fn is_empty(&self) -> bool {
        self.firm == CellBits::default()
    }

    /// The block with these points.
    pub(super) fn with_points(&self, (points, colors): (Vec<Point>, Vec<Rgb>)) -> Self {
        Self { is_moved: true, points, colors, ..self.without_points() }
    }

    /// The block with the means of its static voxels as its points; `before`: the voxels that were static
    /// before.
    pub(super) fn with_means(
        &self,
        source: Source<'_>,
        slot: usize,
        change: Option<&Change>,
        before: CellBits,
    ) -> Self {
        let (key, block) = (source.voxels.keys()[slot], &source.voxels.blocks()[slot]);
        let count = count(&self.statics);
        let mut points = Vec::with_capacity(count);
        let mut colors = Vec::new();
        // A voxel that has not changed keeps its point; its colour too, if all readings of the block have
        // one.
        let changed = change.map_or(CellBits::default(), |change| change.voxels);
        let keeps = !self.is_moved && block.is_colored() && self.colors.len() == self.points.len();
        if keeps {
            colors.reserve_exact(count);
        }
        let mut rank = 0;
        for (word, (&statics, before)) in self.statics.iter().zip(before).enumerate() {
            let kept = if keeps { statics & before & !changed[word] } else { 0 };
            let end = rank + before.count_ones() as usize;
            if kept == statics | before && kept > 0 {
                points.extend_from_slice(&self.points[rank..end]);
                colors.extend_from_slice(&self.colors[rank..end]);
                rank = end;
                continue;
            }
            for_each_bit([statics | before], |bit| {
                let is = |word: u64| word >> bit & 1 == 1;
                if is(kept) {
                    points.push(self.points[rank]);
                    colors.push(self.colors[rank]);
                } else if is(statics) {
                    let place = 64 * word + bit;
                    let voxel = block.voxel(block.places().rank(place));
                    if let Some(color) = voxel.mean_color() {
                        colors.resize(points.len(), Rgb::default());
                        colors.push(color);
                    }
                    points.push(voxel.mean_position(key.cell(place), source.voxel_size));
                }
                rank += usize::from(is(before));
            });
        }
        Self { is_moved: false, points, colors, ..self.without_points() }
    }

    fn without_points(&self) -> Self {
        Self { leaving: self.leaving.clone(), points: Vec::new(), colors: Vec::new(), ..*self }
    }

    /// Bytes that the block owns.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.points.capacity() * size_of::<Point>()
            + self.colors.capacity() * size_of::<Rgb>()
            + self.leaving.capacity() * size_of::<Leaving>()
    }
}
