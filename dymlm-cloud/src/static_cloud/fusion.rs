//! Fuses voxels that are readings of one surface into one layer of points on that surface.
//!
//! The readings of a wall scatter along the line of sight, far away over many voxels, and thinning leaves a
//! shell of those that are read most. Around each block, a surface ([`Surface`]) is fitted where the voxels
//! are readings of a single one. A static voxel whose noise reaches other voxels moves to the surface that it
//! is most likely a reading of, to the nearest place; of the points that then lie in one voxel the heaviest
//! stays, with its colour. A voxel that was seen from near is exact and stays where it is.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use dymlm_core::{Point, Rgb};

use super::surface::{HALF_BLOCK, Surface, SurfacesAround};
use super::{Source, StaticCloud};
use crate::block_store::{
    BLOCK_CELLS, BlockStore, CellBits, NEIGHBORS, cell_in_block, count, for_each_bit, has, put, split,
    step_to,
};
use crate::changes::{Changes, Refit};
use crate::paging::record;
use crate::slot_index::KeyHasher;
use crate::thinning::looks_around;
use crate::voxel::Voxel;
use crate::voxel_block::VoxelBlock;

/// A point of the static cloud, in its block.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct SurfacePoint {
    /// The voxel in which it lies.
    place: u16,
    /// Weight of the voxel that it comes from.
    weight: f32,
    /// Metres, world.
    position: Point,
    color: Rgb,
    is_colored: bool,
}

record!(SurfacePoint { place, weight, position, color, is_colored });

/// The point of a static voxel that lies in a block around its own.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Leaving {
    /// The place of that block in the neighbourhood.
    toward: u8,
    point: SurfacePoint,
}

record!(Leaving { toward, point });

/// Where the points of a block's static voxels lie after fusing.
#[derive(Debug, Default)]
pub(super) struct Moved {
    /// Points in the block itself; `None` when each voxel stays where it is.
    pub(super) own: Option<Vec<SurfacePoint>>,
    /// Points in blocks around, by block and voxel, one a voxel.
    leaving: Vec<Leaving>,
}

/// A block whose points must be made anew.
#[derive(Debug)]
pub(super) struct Renewal {
    pub(super) slot: usize,
    /// The voxels that were static before.
    pub(super) before: CellBits,
    /// Where the points of its voxels lie, if that is known.
    pub(super) moved: Option<Moved>,
}

/// The blocks whose points must be made anew, each once.
#[derive(Debug, Default)]
pub(super) struct Renewals {
    tasks: Vec<Renewal>,
    /// By slot, the index of its task.
    indices: HashMap<u64, usize, BuildHasherDefault<KeyHasher>>,
}

/// The points of a block, one a voxel.
#[derive(Debug)]
pub(super) struct Layer {
    taken: CellBits,
    points: Vec<SurfacePoint>,
}

impl StaticCloud {
    /// Moves voxels onto the surfaces around, and notes the blocks whose points this changes. `refits`: the blocks
    /// with another surface than before; `filled`: blocks that now have their first voxels that are no ghosts, or
    /// have none any more.
    pub(super) fn fuse(
        &mut self,
        source: Source<'_>,
        refits: &[Refit],
        filled: &[usize],
        renewals: &mut Renewals,
    ) {
        let concerned =
            around(source.voxels, refits.iter().map(|refit| refit.slot).chain(filled.iter().copied()));
        let mut slots: Vec<usize> = concerned.into_iter().chain(renewals.slots()).collect();
        slots.retain(|&slot| self.blocks[slot].reach > 0 || !self.blocks[slot].leaving.is_empty());
        slots.sort_unstable();
        slots.dedup();
        for (slot, mut moved) in crate::parallel::map(slots, |slot| (slot, self.moved(source, slot))) {
            let Some(block) = self.blocks.get_mut(slot) else { continue };
            let statics = block.statics;
            if block.leaving != moved.leaving {
                let leaving = std::mem::take(&mut moved.leaving);
                let Some(block) = block.to_mut() else { continue };
                let before = std::mem::replace(&mut block.leaving, leaving.clone());
                self.note_targets(source, slot, before.iter().chain(&leaving), renewals);
            }
            renewals.note(slot, statics).moved = Some(moved);
        }
    }

    /// Fits the surfaces of the blocks that have changed and of those around; returns the blocks with another
    /// surface than before.
    pub(super) fn refit(&mut self, source: Source<'_>, changes: &Changes) -> Vec<Refit> {
        let slots = around(source.voxels, changes.iter().map(|change| change.slot));
        let fitted = crate::parallel::map(slots, |slot| (slot, self.fitted(source, slot)));
        let mut refits = Vec::new();
        for (slot, surface) in fitted {
            let Some(block) = self.blocks.get_mut(slot) else { continue };
            if block.surface != surface
                && let Some(block) = block.to_mut()
            {
                let before = std::mem::replace(&mut block.surface, surface);
                refits.push(Refit { slot, resurfaced: surface.resurfaced(&before, &block.firm) });
            }
        }
        refits
    }

    /// The surface of a block; none, too, where no voxel around would move to it.
    fn fitted(&self, source: Source<'_>, slot: usize) -> Surface {
        let slots = source.voxels.neighborhood(slot);
        let around = slots.iter().enumerate().filter(|(_, slot)| **slot > 0);
        let around = around.map(|(place, &slot)| (step_to(place), &self.blocks[slot as usize - 1]));
        if !around.clone().any(|(_, block)| block.reach > 0) {
            return Surface::default();
        }
        Surface::fit(&self.blocks[slot].moments, around.map(|(step, block)| (step, &block.moments)))
    }

    /// Notes the blocks in which points of a block's voxels lie.
    fn note_targets<'a>(
        &self,
        source: Source<'_>,
        slot: usize,
        leaving: impl Iterator<Item = &'a Leaving>,
        renewals: &mut Renewals,
    ) {
        let mut is_target = [false; NEIGHBORS];
        leaving.for_each(|leaving| is_target[usize::from(leaving.toward)] = true);
        for (_, target) in neighborhood(source.voxels, slot).filter(|&(place, _)| is_target[place]) {
            renewals.note(target, self.blocks[target].statics);
        }
    }

    /// Where the points of a block's static voxels lie after fusing.
    pub(super) fn moved(&self, source: Source<'_>, slot: usize) -> Moved {
        let block = &self.blocks[slot];
        if block.reach == 0 {
            return Moved::default();
        }
        let around = || neighborhood(source.voxels, slot).map(|(place, slot)| (place, &self.blocks[slot]));
        let near = around().map(|(place, block)| (step_to(place), &block.surface));
        let surfaces = SurfacesAround::new((&block.moments, &block.surface), near);
        if surfaces.is_empty() {
            return Moved::default();
        }
        let mut is_target = [false; NEIGHBORS];
        around().for_each(|(place, block)| is_target[place] = !block.is_empty());
        let (voxels, thinning) = (&source.voxels.blocks()[slot], source.thinning);
        let (mut own, mut leaving, mut moves) = (Vec::new(), Vec::new(), false);
        voxels.places().for_each(&block.statics, |place, index| {
            let voxel = voxels.voxel(index);
            let (weight, observations) = (voxel.sums.weight, voxel.observations);
            let reaches_others = looks_around(thinning.radius(weight, observations));
            let deviation = thinning.deviation(weight, observations);
            let foot = reaches_others.then(|| surfaces.foot(from_middle(&voxel, place), deviation)).flatten();
            let foot = foot.and_then(|foot| {
                let (step, cell) = split(foot.map(|c| (c + HALF_BLOCK).floor() as i32));
                let toward = neighbor_at(step).filter(|&toward| is_target[toward])?;
                Some((toward, cell, foot))
            });
            let mut point = mean(source, slot, place, &voxel);
            let Some((toward, cell, foot)) = foot else { return own.push(point) };
            moves = true;
            (point.place, point.position) = (cell as u16, world(source, slot, foot));
            if toward == NEIGHBORS / 2 {
                own.push(point);
            } else {
                leaving.push(Leaving { toward: toward as u8, point });
            }
        });
        Moved { own: moves.then_some(own), leaving: heaviest(leaving) }
    }

    /// The points of voxels of the blocks around that lie in a block.
    pub(super) fn arriving(&self, source: Source<'_>, slot: usize) -> Vec<SurfacePoint> {
        let mut arriving = Vec::new();
        for (place, neighbor) in neighborhood(source.voxels, slot) {
            let back = NEIGHBORS - 1 - place;
            let leaving = self.blocks[neighbor].leaving.iter();
            let here = leaving.filter(|leaving| usize::from(leaving.toward) == back);
            arriving.extend(here.map(|leaving| leaving.point));
        }
        arriving
    }
}

impl Renewals {
    /// The task of a block, made when there is none; `before`: the voxels that were static before.
    pub(super) fn note(&mut self, slot: usize, before: CellBits) -> &mut Renewal {
        let index = *self.indices.entry(slot as u64).or_insert_with(|| {
            self.tasks.push(Renewal { slot, before, moved: None });
            self.tasks.len() - 1
        });
        &mut self.tasks[index]
    }

    fn slots(&self) -> impl Iterator<Item = usize> {
        self.tasks.iter().map(|task| task.slot)
    }

    pub(super) fn into_tasks(self) -> Vec<Renewal> {
        self.tasks
    }
}

impl Default for Layer {
    fn default() -> Self {
        Self { taken: CellBits::default(), points: vec![SurfacePoint::default(); BLOCK_CELLS] }
    }
}

impl Layer {
    /// Keeps, of the points that lie in one voxel, the heaviest, and of equals the first. Returns them by
    /// voxels, with the colours of the first of them, as many as have one.
    pub(super) fn fill(&mut self, points: impl Iterator<Item = SurfacePoint>) -> (Vec<Point>, Vec<Rgb>) {
        self.taken = CellBits::default();
        for point in points {
            let place = usize::from(point.place);
            let Some(there) = self.points.get_mut(place) else { continue };
            if !has(&self.taken, place) || there.weight < point.weight {
                *there = point;
                put(&mut self.taken, place);
            }
        }
        self.points()
    }

    fn points(&self) -> (Vec<Point>, Vec<Rgb>) {
        let count = count(&self.taken);
        let (mut points, mut colors) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for_each_bit(self.taken, |place| {
            let point = self.points[place];
            if point.is_colored {
                colors.resize(points.len(), Rgb::default());
                colors.push(point.color);
            }
            points.push(point.position);
        });
        colors.shrink_to_fit();
        (points, colors)
    }
}

/// The static voxels of a block, as points at their means.
pub(super) fn means(source: Source<'_>, slot: usize, statics: &CellBits) -> Vec<SurfacePoint> {
    let block = &source.voxels.blocks()[slot];
    let mut points = Vec::with_capacity(block.len());
    block.places().for_each(statics, |place, index| {
        points.push(mean(source, slot, place, &block.voxel(index)));
    });
    points
}

/// The mean position of a voxel's readings, voxels, from the middle of its block.
fn from_middle(voxel: &Voxel, place: usize) -> [f64; 3] {
    let (within, cell) = (voxel.mean_within(), cell_in_block(place));
    [0, 1, 2].map(|axis| f64::from(cell[axis]) + within[axis] - HALF_BLOCK)
}

/// A voxel, as a point at its mean.
fn mean(source: Source<'_>, slot: usize, place: usize, voxel: &Voxel) -> SurfacePoint {
    let cell = source.voxels.keys()[slot].cell(place);
    let color = voxel.mean_color();
    SurfacePoint {
        place: place as u16,
        weight: source.thinning.weight(voxel.sums.weight),
        position: voxel.mean_position(cell, source.voxel_size),
        color: color.unwrap_or_default(),
        is_colored: color.is_some(),
    }
}

/// World coordinates, metres, of a place that is given in voxels from the middle of a block.
fn world(source: Source<'_>, slot: usize, place: [f64; 3]) -> Point {
    let first = source.voxels.keys()[slot].cell(0);
    [0, 1, 2].map(|axis| ((f64::from(first[axis]) + HALF_BLOCK + place[axis]) * source.voxel_size) as f32)
}

/// Keeps, of the points that lie in one voxel, the heaviest, and of equals the first.
fn heaviest(mut leaving: Vec<Leaving>) -> Vec<Leaving> {
    let voxel = |leaving: &Leaving| (leaving.toward, leaving.point.place);
    leaving.sort_by(|a, b| voxel(a).cmp(&voxel(b)).then(b.point.weight.total_cmp(&a.point.weight)));
    leaving.dedup_by_key(|leaving| voxel(leaving));
    leaving.shrink_to_fit();
    leaving
}

/// The place in a neighbourhood of the block at a step.
fn neighbor_at(step: [i32; 3]) -> Option<usize> {
    let is_around = step.iter().all(|c| (-1..=1).contains(c));
    is_around.then(|| (9 * (step[2] + 1) + 3 * (step[1] + 1) + step[0] + 1) as usize)
}

/// The blocks in the neighbourhood of a block, itself among them, with their places in it.
fn neighborhood(voxels: &BlockStore<VoxelBlock>, slot: usize) -> impl Iterator<Item = (usize, usize)> {
    let around = voxels.neighborhood(slot).into_iter().enumerate();
    around.filter_map(|(place, slot)| Some((place, (slot as usize).checked_sub(1)?)))
}

/// The blocks in the neighbourhoods of some, each once, in order.
fn around(voxels: &BlockStore<VoxelBlock>, slots: impl Iterator<Item = usize>) -> Vec<usize> {
    // A bit a block of the map: sorting the slots would cost many times as much.
    let mut around = vec![0_u64; voxels.keys().len().div_ceil(64)];
    for slot in slots {
        for (_, slot) in neighborhood(voxels, slot) {
            around[slot / 64] |= 1 << (slot % 64);
        }
    }
    let mut found = Vec::new();
    for_each_bit(around, |slot| found.push(slot));
    found
}
