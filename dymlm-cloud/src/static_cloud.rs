use dymlm_core::{Point, PointCloud, Rgb};

use crate::block_store::{BlockStore, CellBits, Neighbor, has, keep_slots, put, without};
use crate::evidence::Evidence;
use crate::thinning::{Candidate, Thinning, Window, limit};
use crate::verdict::{Verdict, VerdictGrid};
use crate::voxel_block::VoxelBlock;

/// What is static in the map, block by block, as of the last reading: ghosts left out, then what is
/// [noise](Thinning).
///
/// Taking in a change costs what has changed: a voxel is judged anew when it has changed itself, or when it
/// was static and a voxel around has become heavier than it bears, or when it was not and a voxel around has
/// become lighter or a ghost.
#[derive(Debug, Clone, Default)]
pub(crate) struct StaticCloud {
    /// By the slots of the voxels.
    blocks: Vec<StaticBlock>,
    /// Slots in the order of their keys.
    order: Vec<u32>,
    /// The newest stamp of a voxel that has been taken in.
    stamp: u32,
    /// The newest change of the verdicts that has been taken in.
    verdicts: u32,
    /// Number of points.
    len: usize,
}

#[derive(Debug, Clone, Default)]
struct StaticBlock {
    /// 1 + the slot of its block of the evidence, or 0 as long as that is not known.
    evidence: u32,
    /// Voxels that are no ghosts.
    firm: CellBits,
    /// The greatest weight of these.
    heaviest: f32,
    /// Those of them that are no noise either.
    statics: CellBits,
    /// Mean places and colours of the static ones, by their place in the block; no colours when none has any.
    points: Vec<Point>,
    colors: Vec<Rgb>,
}

/// The verdicts on the voxels of a block.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Judgement {
    /// Those that are no ghosts.
    firm: CellBits,
    pub(crate) statics: CellBits,
}

/// What is new in a block.
struct Change {
    slot: usize,
    firm: CellBits,
    heaviest: f32,
    /// Voxels that have other readings or another verdict than before.
    voxels: CellBits,
    effect: Effect,
}

/// What a change can mean for voxels around.
#[derive(Debug, Clone, Copy, Default)]
struct Effect {
    /// The greatest weight that is new.
    raised: f32,
    /// The greatest weight that is gone, at most.
    lowered: f32,
}

/// What judging a block needs in between.
#[derive(Debug, Default)]
struct Scratch {
    candidates: Vec<Candidate>,
    /// Steps to the blocks around, and their slots.
    around: Vec<([i32; 3], usize)>,
    window: Window,
}

/// What the static cloud is made of.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) voxels: &'a BlockStore<VoxelBlock>,
    /// The stamp of the newest change of voxels.
    pub(crate) stamp: u32,
    pub(crate) evidence: &'a Evidence,
    pub(crate) verdicts: &'a VerdictGrid,
    pub(crate) thinning: &'a Thinning,
    pub(crate) voxel_size: f64,
}

impl StaticCloud {
    /// Takes in what has changed since the last call.
    pub(crate) fn refresh(&mut self, source: Source<'_>) {
        let (voxels, count) = (source.voxels, source.voxels.blocks().len());
        if self.order.len() < count {
            self.blocks.resize_with(count, StaticBlock::default);
            self.order = voxels.sorted_slots().into_iter().map(|slot| slot as u32).collect();
        }
        for (block, key) in self.blocks.iter_mut().zip(voxels.keys()).filter(|(block, _)| block.evidence == 0)
        {
            block.evidence = source.evidence.slot_of(key.cell(0)).map_or(0, |slot| slot as u32 + 1);
        }
        let changes = self.changes(source);
        (self.stamp, self.verdicts) = (source.stamp, source.verdicts.revision());
        // By slot: 1 + the index of the block's own change, and the effect of all around.
        let mut own = vec![0_u32; count];
        let mut effects = vec![Effect::default(); count];
        for (index, change) in changes.iter().enumerate() {
            let block = &mut self.blocks[change.slot];
            (block.firm, block.heaviest) = (change.firm, change.heaviest);
            own[change.slot] = index as u32 + 1;
            for Neighbor { key, .. } in voxels.keys()[change.slot].neighborhood() {
                if let Some(slot) = voxels.slot(key) {
                    effects[slot] = effects[slot].join(change.effect);
                }
            }
        }
        let is_touched = |slot: &usize| own[*slot] > 0 || effects[*slot].is_any();
        let touched: Vec<usize> = (0..count).filter(is_touched).collect();
        let judged = crate::parallel::map_with(touched, Scratch::default, |scratch, slot| {
            let change_at =
                |slot: usize| (own[slot] as usize).checked_sub(1).and_then(|index| changes.get(index));
            let change = change_at(slot);
            let statics = self.judge(source, slot, change_at, effects[slot], scratch);
            // A voxel that has changed has moved.
            let is_new = change.is_some() || statics != self.blocks[slot].statics;
            is_new.then(|| (slot, StaticBlock::new(source, slot, statics, &self.blocks[slot])))
        });
        for (slot, block) in judged.into_iter().flatten() {
            self.len += block.points.len();
            self.len -= self.blocks[slot].points.len();
            self.blocks[slot] = block;
        }
    }

    /// Forgets blocks of voxels that are gone: by slot, which stayed. Slots of the evidence have changed as well.
    pub(crate) fn forget(&mut self, stays: Option<&[bool]>) {
        if let Some(stays) = stays {
            keep_slots(&mut self.blocks, stays);
            self.order.clear();
            self.len = self.blocks.iter().map(|block| block.points.len()).sum();
        }
        self.blocks.iter_mut().for_each(|block| block.evidence = 0);
    }

    /// What has changed since the last call.
    fn changes(&self, source: Source<'_>) -> Vec<Change> {
        let blocks = source.voxels.blocks();
        let changes = |slot: usize| {
            let evidence = (self.blocks[slot].evidence as usize).checked_sub(1);
            let statics = evidence.and_then(|slot| source.verdicts.statics(slot));
            let has_changed = blocks[slot].stamp > self.stamp
                || statics.is_some_and(|(_, revision)| revision > self.verdicts);
            let cells = statics.map_or(CellBits::default(), |(cells, _)| *cells);
            has_changed.then(|| self.change_of(source, slot, &cells)).flatten()
        };
        crate::parallel::map((0..blocks.len()).collect(), changes).into_iter().flatten().collect()
    }

    fn change_of(&self, source: Source<'_>, slot: usize, cells: &CellBits) -> Option<Change> {
        let (key, block, before) =
            (source.voxels.keys()[slot], &source.voxels.blocks()[slot], &self.blocks[slot]);
        let inside = source.evidence.voxels_in(cells, key);
        let (mut voxels, mut firm) = (CellBits::default(), CellBits::default());
        let (mut heaviest, mut effect) = (0.0_f32, Effect::default());
        let has_readings = block.stamp > self.stamp;
        for word in 0..firm.len() {
            firm[word] = block.places()[word] & inside[word];
            let changed = if has_readings { block.changed[word] & firm[word] } else { 0 };
            voxels[word] = changed | firm[word] ^ before.firm[word];
        }
        let weight = |index| source.thinning.weight(block.weight(index));
        block.for_each(&firm, |place, index| {
            let weight = weight(index);
            heaviest = heaviest.max(weight);
            if has(&voxels, place) {
                effect.raised = effect.raised.max(weight);
            }
        });
        block.for_each(&without(before.firm, firm), |_, index| {
            effect.lowered = effect.lowered.max(weight(index));
        });
        if block.lowered > self.stamp {
            effect.lowered = f32::INFINITY;
        }
        let has_changed = voxels != CellBits::default() || effect.lowered > 0.0;
        has_changed.then_some(Change { slot, firm, heaviest, voxels, effect })
    }

    /// The static voxels of a block.
    fn judge<'c>(
        &self,
        source: Source<'_>,
        slot: usize,
        change_at: impl Fn(usize) -> Option<&'c Change>,
        effect: Effect,
        scratch: &mut Scratch,
    ) -> CellBits {
        let changed = change_at(slot).map_or(CellBits::default(), |change| change.voxels);
        let Source { voxels, thinning, .. } = source;
        let before = &self.blocks[slot];
        let mut statics = CellBits::default();
        scratch.candidates.clear();
        let block = &voxels.blocks()[slot];
        let mut asked = CellBits::default();
        for word in 0..asked.len() {
            let [changed, kept] = [changed[word], before.statics[word]].map(|bits| bits & before.firm[word]);
            let raised = if effect.raised > 0.0 { kept } else { 0 };
            let lowered = if effect.lowered > 0.0 { before.firm[word] & !kept } else { 0 };
            asked[word] = changed | raised | lowered;
            statics[word] = kept & !asked[word];
        }
        block.for_each(&asked, |place, index| {
            let (weight, observations) = (block.weight(index), block.observations(index));
            let limit = limit(thinning.weight(weight));
            if !has(&changed, place) {
                let was_static = has(&before.statics, place);
                if limit >= if was_static { effect.raised } else { effect.lowered } {
                    if was_static {
                        put(&mut statics, place);
                    }
                    return;
                }
            }
            if !thinning.is_seen(observations) {
                return;
            }
            match thinning.candidate(place, weight, observations) {
                Some(candidate) => scratch.candidates.push(candidate),
                None => put(&mut statics, place),
            }
        });
        if scratch.candidates.is_empty() {
            return statics;
        }
        let Scratch { candidates, around, window } = scratch;
        let neighbor = |Neighbor { step, key }: Neighbor| voxels.slot(key).map(|slot| (step, slot));
        around.clear();
        around.extend(voxels.keys()[slot].neighborhood().filter_map(neighbor));
        let heaviest = around.iter().map(|&(_, slot)| self.blocks[slot].heaviest).fold(0.0, f32::max);
        candidates.retain(|candidate| {
            let may_be_noise = candidate.limit < heaviest;
            if !may_be_noise {
                put(&mut statics, candidate.place);
            }
            may_be_noise
        });
        if candidates.is_empty() {
            return statics;
        }
        window.reset(candidates);
        // What stood the test before is asked only about what is new.
        let only_new = changed == CellBits::default() && effect.lowered == 0.0;
        for &(step, slot) in &*around {
            let (heaviest, weighty) = if only_new {
                let Some(change) = change_at(slot) else { continue };
                (change.effect.raised, &change.voxels)
            } else {
                (self.blocks[slot].heaviest, &self.blocks[slot].firm)
            };
            if heaviest > window.least_limit() {
                window.fill(step, &voxels.blocks()[slot], weighty, thinning);
            }
        }
        for candidate in candidates.iter().filter(|candidate| !thinning.is_noise(window, candidate)) {
            put(&mut statics, candidate.place);
        }
        statics
    }

    /// The newest stamp of a voxel that has been taken in.
    pub(crate) fn stamp(&self) -> u32 {
        self.stamp
    }

    /// Number of static voxels.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// All static points, by the order of blocks; with colours when any has one, black where there is none.
    pub(crate) fn to_point_cloud(&self) -> PointCloud {
        let mut points = Vec::with_capacity(self.len);
        let is_colored = self.blocks.iter().any(|block| !block.colors.is_empty());
        let mut colors = Vec::with_capacity(if is_colored { self.len } else { 0 });
        for block in self.order.iter().filter_map(|&slot| self.blocks.get(slot as usize)) {
            points.extend_from_slice(&block.points);
            if is_colored {
                colors.extend_from_slice(&block.colors);
                colors.resize(points.len(), Rgb::default());
            }
        }
        if is_colored {
            PointCloud::with_colors(points, colors).unwrap_or_default()
        } else {
            PointCloud::new(points)
        }
    }

    /// The verdicts on the voxels of a block.
    pub(crate) fn judgement(&self, slot: usize) -> Judgement {
        let block = self.blocks.get(slot);
        block.map_or_else(Judgement::default, |block| Judgement { firm: block.firm, statics: block.statics })
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let points: usize = self.blocks.iter().map(StaticBlock::memory_bytes).sum();
        self.blocks.capacity() * size_of::<StaticBlock>() + self.order.capacity() * size_of::<u32>() + points
    }
}

impl Judgement {
    /// The verdict on the voxel at a place.
    pub(crate) fn of(&self, place: usize) -> Verdict {
        if has(&self.statics, place) {
            Verdict::Static
        } else if has(&self.firm, place) {
            Verdict::Noise
        } else {
            Verdict::Ghost
        }
    }
}

impl Effect {
    fn join(self, other: Self) -> Self {
        Self { raised: self.raised.max(other.raised), lowered: self.lowered.max(other.lowered) }
    }

    fn is_any(self) -> bool {
        self.raised > 0.0 || self.lowered > 0.0
    }
}

impl StaticBlock {
    fn new(source: Source<'_>, slot: usize, statics: CellBits, before: &Self) -> Self {
        let (key, block) = (source.voxels.keys()[slot], &source.voxels.blocks()[slot]);
        let count: u32 = statics.iter().map(|bits| bits.count_ones()).sum();
        let mut points = Vec::with_capacity(count as usize);
        let mut colors = Vec::new();
        block.for_each(&statics, |place, index| {
            let voxel = block.voxel(index);
            points.push(voxel.mean_position(key.cell(place), source.voxel_size));
            if let Some(color) = voxel.mean_color() {
                if colors.is_empty() {
                    colors.reserve_exact(count as usize);
                }
                colors.resize(points.len() - 1, Rgb::default());
                colors.push(color);
            }
        });
        Self {
            evidence: before.evidence,
            firm: before.firm,
            heaviest: before.heaviest,
            statics,
            points,
            colors,
        }
    }

    fn memory_bytes(&self) -> usize {
        self.points.capacity() * size_of::<Point>() + self.colors.capacity() * size_of::<Rgb>()
    }
}
