use std::sync::{Arc, OnceLock};

use dymlm_core::{Pages, Point, PointCloud, Rgb};

use crate::block_store::{
    BLOCK_CELLS, BlockStore, CellBits, block_bytes_beside, has, page_out_like, put, without,
};
use crate::changes::{Change, Changes, Effect, Refit, Touched};
use crate::evidence::Evidence;
use crate::paging::{PageFile, Paged, page_out};
use crate::thinning::{Candidate, Thinning, Window, limit, looks_around};
use crate::verdict::{Verdict, VerdictGrid};
use crate::voxel_block::VoxelBlock;

mod block;
mod columns;
mod fusion;
mod surface;

use block::{Asked, StaticBlock};
use fusion::{Layer, Renewal, Renewals};
pub(crate) use surface::Moments;
use surface::{MomentSums, Surface};

/// Blocks whose changes are taken in at a time. What is noted of a change takes some 2.5 kB, which for all
/// blocks of a map that is read for the first time would be half of the map again. A frame changes fewer blocks,
/// so that its changes are taken in at once: what lies beside a batch is worked out twice.
const BATCH: usize = 1 << 14;
/// The same in a map with a budget of memory: a quarter, so that a batch and the blocks that are read for it
/// take some 30 MB, and a seventh more time.
const SMALL_BATCH: usize = 1 << 12;

/// The static part of the map, block by block, as of the last query: without ghosts, and without
/// [noise](Thinning).
///
/// Taking in changes costs what has changed. A voxel is judged anew when it has changed itself; when the
/// surface of its block has reached or left it; when it was static and a voxel around has become heavier than
/// its limit; or when it was noise and a voxel around has become lighter or a ghost.
#[derive(Debug, Clone, Default)]
pub(crate) struct StaticCloud {
    /// By the slots of the voxels.
    blocks: Pages<Paged<StaticBlock>>,
    /// By slot of the voxels, 1 + the slot of their block of the evidence, or 0 as long as that is not known.
    evidence: Pages<u32>,
    /// Slots in the order of their keys, cached until a block is added, and the order before that.
    order: OnceLock<Arc<[usize]>>,
    earlier_order: Arc<[usize]>,
    /// Lowest and highest block coordinates of all blocks.
    bounds: Option<[[i32; 3]; 2]>,
    /// The newest stamp of a voxel that has been taken in.
    stamp: u32,
    /// The newest change of the verdicts that has been taken in.
    verdicts: u32,
    /// Number of points.
    len: usize,
}

/// The verdicts on the voxels of a block.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Judgement {
    /// Voxels that are no ghosts.
    firm: CellBits,
    pub(crate) statics: CellBits,
}

/// Buffers for judging a block.
#[derive(Debug, Default)]
struct Scratch {
    candidates: Vec<Candidate>,
    window: Window,
}

/// What the static cloud is made from.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) voxels: &'a BlockStore<VoxelBlock>,
    /// The stamp of the newest change of voxels.
    pub(crate) stamp: u32,
    pub(crate) evidence: &'a Evidence,
    pub(crate) verdicts: &'a VerdictGrid,
    pub(crate) thinning: &'a Thinning,
    pub(crate) voxel_size: f64,
    /// Whether voxels that are readings of one surface are fused.
    pub(crate) fuses: bool,
}

impl StaticCloud {
    /// Whether nothing has changed since it was [refreshed](Self::refresh).
    pub(crate) fn is_fresh(&self, source: &Source<'_>) -> bool {
        self.blocks.len() == source.voxels.blocks().len()
            && self.stamp == source.stamp
            && self.verdicts == source.verdicts.revision()
    }

    /// Takes in what has changed since the last call. With a page file, blocks that are there stay there, and
    /// what is worked out of them goes there as well; so does what is worked out of more blocks than a frame
    /// changes.
    pub(crate) fn refresh(&mut self, source: Source<'_>, file: Option<&Arc<PageFile>>) {
        let slots = self.take_in_new(source);
        let is_filed = |slot: &usize| source.voxels.blocks()[*slot].in_memory().is_none();
        match file {
            Some(file) if slots.len() > BATCH => self.refresh_filed(source, &slots, file, |_| true),
            Some(file) if slots.iter().any(is_filed) => {
                self.refresh_filed(source, &slots, file, |slot| is_filed(&slot));
            }
            _ => self.refresh_by(source, &slots, BATCH, |cloud, slots| {
                cloud.take_in_changes(source, &cloud.changes(source, slots));
            }),
        }
    }

    /// The same in small batches; the results of blocks that go are put into the file.
    fn refresh_filed(
        &mut self,
        source: Source<'_>,
        slots: &[usize],
        file: &Arc<PageFile>,
        goes: impl Fn(usize) -> bool,
    ) {
        let mut is_writable = true;
        self.refresh_by(source, slots, SMALL_BATCH, |cloud, slots| {
            // Taking in a change looks at blocks that are four away at most: at that from which a point arrives
            // in the block of a voxel that has moved to a surface that is another.
            let pages = source.voxels.pages_around(slots);
            let voxels = source.voxels.reading_apart(&pages);
            let source = Source { voxels: &voxels, ..source };
            let changes = cloud.changes(source, slots);
            cloud.take_in_changes(source, &changes);
            // On a full disk they stay in memory, where they are as good.
            is_writable = is_writable && cloud.page_out(&pages, file, &goes).is_ok();
        });
    }

    /// Calls `take_in` for batches of blocks.
    fn refresh_by(
        &mut self,
        source: Source<'_>,
        slots: &[usize],
        batch: usize,
        mut take_in: impl FnMut(&mut Self, &[usize]),
    ) {
        // The points of a block that waits are those of voxels that it still has.
        let batch = if self.has_lost_voxels(source) { slots.len() } else { batch };
        slots.chunks(batch.max(1)).for_each(|slots| take_in(self, slots));
        (self.stamp, self.verdicts) = (source.stamp, source.verdicts.revision());
    }

    /// Puts blocks of some pages into the file that are in memory and shall go.
    fn page_out(
        &mut self,
        pages: &[usize],
        file: &Arc<PageFile>,
        goes: impl Fn(usize) -> bool,
    ) -> std::io::Result<()> {
        const PAGE: usize = Pages::<Paged<StaticBlock>>::PAGE;
        for first in pages.iter().map(|page| page * PAGE) {
            let slots = first..self.blocks.len().min(first + PAGE);
            let leaves = |slot: &usize| self.blocks[*slot].in_memory().is_some() && goes(*slot);
            let slots: Vec<usize> = slots.filter(leaves).collect();
            page_out(&mut self.blocks, &slots, file)?;
        }
        Ok(())
    }

    /// Whether voxels may have gone since the last call.
    fn has_lost_voxels(&self, source: Source<'_>) -> bool {
        let mut changed = source.voxels.stamps().after(self.stamp);
        // As long as nothing was taken in there are no points to keep.
        self.stamp > 0 && changed.any(|slot| source.voxels.blocks()[slot].look().lowered > self.stamp)
    }

    fn take_in_changes(&mut self, source: Source<'_>, changes: &Changes) {
        let filled = self.take_in(source, changes);
        let refits = if source.fuses { self.refit(source, changes) } else { Vec::new() };
        let judged = self.judge_all(source, changes, &refits);
        let mut renewals = Renewals::default();
        for (slot, statics) in judged {
            let Some(block) = self.blocks.get_mut(slot).and_then(Paged::to_mut) else { continue };
            renewals.note(slot, std::mem::replace(&mut block.statics, statics));
        }
        if source.fuses {
            self.fuse(source, &refits, &filled, &mut renewals);
        }
        self.renew_points(source, changes, renewals);
    }

    /// Takes in which voxels are no ghosts; returns the slots of the blocks that have got the first of these,
    /// or lost the last.
    fn take_in(&mut self, source: Source<'_>, changes: &Changes) -> Vec<usize> {
        let mut filled = Vec::new();
        for change in changes.iter() {
            if self.evidence.get(change.slot) != Some(&change.evidence) {
                self.evidence.set(change.slot, change.evidence);
            }
            let Some(block) = self.blocks.get_mut(change.slot).and_then(Paged::to_mut) else { continue };
            let was_empty = block.is_empty();
            block.firm = change.firm;
            block.heaviest = change.heaviest;
            block.reach = change.reach;
            if source.fuses {
                block.moments = change.moments;
            }
            if was_empty != block.is_empty() {
                filled.push(change.slot);
            }
        }
        filled
    }

    /// The static voxels of the blocks that have changed, and of the blocks whose static voxels have become
    /// others through changes around them or another surface.
    fn judge_all(&self, source: Source<'_>, changes: &Changes, refits: &[Refit]) -> Vec<(usize, CellBits)> {
        let touched = changes.touched(source.voxels, refits, |slot| self.blocks[slot].reach);
        let judged = crate::parallel::map_with(touched, Scratch::default, |scratch, mut touched| {
            let (slot, before) = (touched.slot, &self.blocks[touched.slot]);
            let statics = self.judge(source, changes, &mut touched, scratch);
            // A voxel that has changed has moved, so the block's points are made anew.
            (changes.of(slot).is_some() || statics != before.statics).then_some((slot, statics))
        });
        judged.into_iter().flatten().collect()
    }

    /// Makes the points of blocks anew.
    fn renew_points(&mut self, source: Source<'_>, changes: &Changes, renewals: Renewals) {
        let renewed = crate::parallel::map_with(renewals.into_tasks(), Layer::default, |layer, renewal| {
            let slot = renewal.slot;
            (slot, self.renewed(source, changes, renewal, layer))
        });
        for (slot, block) in renewed {
            let Some(before) = self.blocks.get_mut(slot) else { continue };
            self.len += block.points.len();
            self.len -= before.points.len();
            *before = Paged::new(block);
        }
    }

    fn renewed(
        &self,
        source: Source<'_>,
        changes: &Changes,
        renewal: Renewal,
        layer: &mut Layer,
    ) -> StaticBlock {
        let Renewal { slot, before, moved } = renewal;
        let block = &self.blocks[slot];
        let means = || block.with_means(source, slot, changes.of(slot), before);
        if !source.fuses {
            return means();
        }
        let (own, arriving) =
            (moved.unwrap_or_else(|| self.moved(source, slot)).own, self.arriving(source, slot));
        if own.is_none() && arriving.is_empty() {
            return means();
        }
        let own = own.unwrap_or_else(|| fusion::means(source, slot, &block.statics));
        block.with_points(layer.fill(own.into_iter().chain(arriving)))
    }

    /// Makes room for blocks that were added since the last call; returns those that may have changed.
    fn take_in_new(&mut self, source: Source<'_>) -> Vec<usize> {
        self.make_room(source.voxels);
        self.changed_slots(source)
    }

    fn make_room(&mut self, voxels: &BlockStore<VoxelBlock>) {
        let known = self.blocks.len();
        if voxels.keys().len() == known {
            return;
        }
        self.bounds = voxels.keys().iter_from(known).fold(self.bounds, |bounds, key| {
            let block = key.block();
            let [low, high] = bounds.unwrap_or([block; 2]);
            let join = |bound: [i32; 3], farther: fn(i32, i32) -> i32| {
                [0, 1, 2].map(|axis| farther(bound[axis], block[axis]))
            };
            Some([join(low, i32::min), join(high, i32::max)])
        });
        self.blocks.grow(voxels.keys().len(), Paged::default);
        self.evidence.grow(voxels.keys().len(), || 0);
        if let Some(order) = self.order.take() {
            self.earlier_order = order;
        }
    }

    /// Forgets blocks of voxels that are gone. `stays`: by slot, which stayed; `bounds`: the box around
    /// those. Slots of the evidence have changed as well.
    pub(crate) fn forget(&mut self, stays: Option<&[bool]>, bounds: Option<[[i32; 3]; 2]>) {
        if let Some(stays) = stays {
            let gone = self.blocks.iter().zip(stays).filter(|(_, stays)| !**stays);
            self.len -= gone.map(|(block, _)| block.look().points.len()).sum::<usize>();
            self.blocks.keep(stays);
            (self.order, self.earlier_order) = (OnceLock::new(), Arc::default());
            self.bounds = bounds;
        }
        self.evidence = Pages::default();
        self.evidence.grow(self.blocks.len(), || 0);
    }

    /// The blocks that may have changed since the last call.
    fn changed_slots(&self, source: Source<'_>) -> Vec<usize> {
        let mut slots: Vec<usize> = source.voxels.stamps().after(self.stamp).collect();
        for judged in source.verdicts.stamps().after(self.verdicts) {
            if let Some(&cells) = source.evidence.blocks().keys().get(judged) {
                let (first, side) = source.evidence.voxel_blocks_over(cells);
                source.voxels.slots_within(first, side, |slot| slots.push(slot));
            }
        }
        slots.sort_unstable();
        slots.dedup();
        slots
    }

    /// What has changed in these blocks since the last call.
    fn changes(&self, source: Source<'_>, slots: &[usize]) -> Changes {
        let changes = crate::parallel::map(slots.to_vec(), |slot| self.change_of(source, slot));
        Changes::new(changes.into_iter().flatten().collect())
    }

    fn change_of(&self, source: Source<'_>, slot: usize) -> Option<Change> {
        let Source { voxels: all, thinning, evidence, .. } = source;
        // Most blocks over a changed one of the evidence have not changed: those that are paged out stay so.
        let (key, looks) = (all.keys()[slot], (all.blocks()[slot].look(), self.blocks[slot].look()));
        let (block, before) = (&*looks.0, &*looks.1);
        let around = match self.evidence[slot] {
            0 => evidence.slot_of(key.cell(0)).map_or(0, |slot| slot as u32 + 1),
            known => known,
        };
        let cells = (around as usize).checked_sub(1).and_then(|slot| source.verdicts.statics(slot));
        let inside = cells.map_or(CellBits::default(), |cells| evidence.voxels_in(&cells, key));
        let (mut voxels, mut firm) = (CellBits::default(), CellBits::default());
        let has_readings = block.stamp > self.stamp;
        for word in 0..firm.len() {
            firm[word] = block.places().cells()[word] & inside[word];
            let changed = if has_readings { block.changed[word] & firm[word] } else { 0 };
            voxels[word] = changed | firm[word] ^ before.firm[word];
        }
        let is_lowered = block.lowered > self.stamp;
        if voxels == CellBits::default() && !is_lowered {
            return None;
        }

        let mut effect = Effect { raised: 0.0, lowered: if is_lowered { f32::INFINITY } else { 0.0 } };
        block.places().for_each(&without(before.firm, firm), |_, index| {
            effect.lowered = effect.lowered.max(thinning.weight(block.weight(index)));
        });
        let mut change = Change {
            slot,
            evidence: around,
            firm,
            weights: Box::new([0.0; BLOCK_CELLS]),
            heaviest: 0.0,
            reach: 0,
            voxels,
            effect,
            moments: Moments::default(),
        };
        let (mut moments, mut least) = (MomentSums::default(), f64::INFINITY);
        block.places().for_each(&firm, |place, index| {
            let voxel = block.voxel(index);
            let weight = thinning.weight(voxel.sums.weight);
            // What too few frames have read is not static, and takes nothing away that is.
            if thinning.is_seen(voxel.observations) {
                change.weights[place] = weight;
                change.heaviest = change.heaviest.max(weight);
                if has(&voxels, place) {
                    change.effect.raised = change.effect.raised.max(weight);
                }
            }
            least = least.min(thinning.weight_per_frame(voxel.sums.weight, voxel.observations));
            if source.fuses {
                moments.add(place, &voxel, weight);
            }
        });
        // The farthest is that of the lightest readings; infinitely heavy ones reach nothing.
        change.reach = thinning.radius_of(least) as u8;
        if source.fuses {
            change.moments = moments.moments(thinning);
        }
        Some(change)
    }

    /// The static voxels of a block.
    fn judge(
        &self,
        source: Source<'_>,
        changes: &Changes,
        touched: &mut Touched,
        Scratch { candidates, window }: &mut Scratch,
    ) -> CellBits {
        let change = changes.of(touched.slot);
        let block = &self.blocks[touched.slot];
        let asked = block.asked(change, touched);
        let mut statics = asked.settled;
        find_candidates(source, (touched, change), &asked, &block.surface, &mut statics, candidates);
        if candidates.is_empty() {
            return statics;
        }
        // Voxels that were static before are compared only with what is new.
        let only_new = change.is_none() && [asked.changed, asked.noise] == [CellBits::default(); 2];
        if change.is_none() && !only_new {
            touched.find_around(source.voxels);
        }
        window.reset(candidates);
        self.fill_with_changes(changes, touched, only_new, window);
        window.find_heaviest();
        candidates.retain(|candidate| !window.is_noise(candidate));
        candidates.retain(|candidate| {
            let is_static = only_new || has(&asked.kept, candidate.place);
            if is_static {
                put(&mut statics, candidate.place);
            }
            !is_static
        });
        if candidates.is_empty() {
            return statics;
        }
        let has_others = self.fill_with_others(source, changes, touched, window);
        if has_others {
            window.find_heaviest();
        }
        for candidate in candidates.iter().filter(|candidate| !(has_others && window.is_noise(candidate))) {
            put(&mut statics, candidate.place);
        }
        statics
    }

    /// Puts the changed blocks around into the window, or only what has changed in them.
    fn fill_with_changes(&self, changes: &Changes, touched: &Touched, only_new: bool, window: &mut Window) {
        for (step, slot) in touched.around() {
            let Some(change) = changes.of(slot) else { continue };
            let heaviest = if only_new { change.effect.raised } else { self.blocks[slot].heaviest };
            if heaviest > window.least_limit() {
                let voxels = if only_new { &change.voxels } else { &change.firm };
                window.fill(step, voxels, &change.weights);
            }
        }
    }

    /// Puts the blocks around that have not changed into the window; returns whether any of them concerns a
    /// candidate.
    fn fill_with_others(
        &self,
        source: Source<'_>,
        changes: &Changes,
        touched: &Touched,
        window: &mut Window,
    ) -> bool {
        let mut has_others = false;
        for (step, slot) in touched.around().filter(|&(_, slot)| changes.of(slot).is_none()) {
            let (voxels, block) = (&source.voxels.blocks()[slot], &self.blocks[slot]);
            if block.heaviest > window.least_limit() {
                let (thinning, least_limit) = (source.thinning, window.least_limit());
                window.fill_by_rank(step, voxels.places(), &block.firm, |rank| {
                    let weight = thinning.weight(voxels.weight(rank));
                    let counts = weight > least_limit && thinning.is_seen(voxels.observations(rank));
                    if counts { weight } else { 0.0 }
                });
                has_others = true;
            }
        }
        has_others
    }

    /// The newest stamp of a voxel that has been taken in.
    pub(crate) fn stamp(&self) -> u32 {
        self.stamp
    }

    /// Slots of all blocks of voxels, in the order of their keys.
    pub(crate) fn order(&self, voxels: &BlockStore<VoxelBlock>) -> impl Iterator<Item = usize> {
        let order = self.order.get_or_init(|| voxels.sorted_slots_after(&self.earlier_order).into());
        order.iter().copied()
    }

    /// The lowest and the highest block coordinates of all blocks.
    pub(crate) fn bounds(&self) -> Option<[[i32; 3]; 2]> {
        self.bounds
    }

    /// The static points of a block, by the voxels in which they lie.
    #[inline]
    pub(crate) fn points(&self, slot: usize) -> &[Point] {
        self.blocks.get(slot).map_or(&[], |block| &block.points)
    }

    /// The colours of the first of these points, as many as have one.
    #[inline]
    pub(crate) fn colors(&self, slot: usize) -> &[Rgb] {
        self.blocks.get(slot).map_or(&[], |block| &block.colors)
    }

    /// Copies of a block's points and their colours, without bringing it back to memory.
    pub(crate) fn copied(&self, slot: usize) -> (Vec<Point>, Vec<Rgb>) {
        let block = self.blocks.get(slot).map(|block| block.look());
        block.map_or_else(Default::default, |block| (block.points.clone(), block.colors.clone()))
    }

    /// Whether a block has points, without bringing it back to memory.
    pub(crate) fn has_points(&self, slot: usize) -> bool {
        self.blocks.get(slot).is_some_and(|block| !block.look().points.is_empty())
    }

    /// The slots of blocks that this cloud does not share with another of the same map.
    pub(crate) fn unshared<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = usize> + 'a {
        self.blocks.unshared(&other.blocks)
    }

    /// Whether a block has the same points as a block of another cloud. Brings neither back to memory.
    pub(crate) fn has_same_points(&self, slot: usize, other: &Self, other_slot: usize) -> bool {
        match (self.blocks.get(slot), other.blocks.get(other_slot)) {
            (Some(own), Some(other)) => {
                own.is_same(other) || {
                    let (own, other) = (own.look(), other.look());
                    (&own.points, &own.colors) == (&other.points, &other.colors)
                }
            }
            (own, other) => own.or(other).is_none_or(|block| block.look().points.is_empty()),
        }
    }

    /// Number of static points.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Whether any static point has a colour.
    pub(crate) fn has_colors(&self) -> bool {
        self.blocks.iter().any(|block| !block.look().colors.is_empty())
    }

    /// Calls `visit` with the static points of each block that has some, in the order of blocks, and with the
    /// colours of the first of them, as many as have one. Ends with the first error.
    pub(crate) fn try_for_each_block<E>(
        &self,
        voxels: &BlockStore<VoxelBlock>,
        mut visit: impl FnMut(&[Point], &[Rgb]) -> Result<(), E>,
    ) -> Result<(), E> {
        for block in self.order(voxels).filter_map(|slot| self.blocks.get(slot)) {
            let block = block.look();
            if !block.points.is_empty() {
                visit(&block.points, &block.colors)?;
            }
        }
        Ok(())
    }

    /// All static points, in the order of blocks; with colours when any point has one, black for points
    /// without.
    pub(crate) fn to_point_cloud(&self, voxels: &BlockStore<VoxelBlock>) -> PointCloud {
        let (mut points, mut colors) = (Vec::with_capacity(self.len), Vec::new());
        let Ok(()) = self.try_for_each_block(voxels, |own, own_colors| {
            if !own_colors.is_empty() {
                colors.reserve(self.len - colors.len());
                colors.resize(points.len(), Rgb::default());
                colors.extend_from_slice(own_colors);
            }
            points.extend_from_slice(own);
            Ok::<(), std::convert::Infallible>(())
        });
        if colors.is_empty() {
            return PointCloud::new(points);
        }
        colors.resize(points.len(), Rgb::default());
        PointCloud::with_colors(points, colors).unwrap_or_default()
    }

    /// Frees the memory of blocks that a clone has paged out.
    pub(crate) fn page_out_like(&mut self, other: &Self) {
        page_out_like(&mut self.blocks, &other.blocks);
    }

    /// The points of a block, to page them out.
    pub(crate) fn paged_mut(&mut self, slot: usize) -> Option<&mut Paged<StaticBlock>> {
        self.blocks.get_mut(slot)
    }

    /// The verdicts on the voxels of a block.
    pub(crate) fn judgement(&self, slot: usize) -> Judgement {
        let block = self.blocks.get(slot).map(Paged::look);
        block.map_or_else(Judgement::default, |block| Judgement { firm: block.firm, statics: block.statics })
    }

    /// Bytes that another static cloud does not share.
    pub(crate) fn memory_bytes_beside(&self, other: &Self) -> usize {
        self.list_bytes_beside(other)
            + block_bytes_beside(&self.blocks, &other.blocks, |block, _| block.memory_bytes())
    }

    /// The same without the blocks.
    pub(crate) fn list_bytes_beside(&self, other: &Self) -> usize {
        let is_shared = |own: &Arc<[usize]>| other.orders().any(|it| Arc::ptr_eq(own, it));
        let orders = self.orders().filter(|own| !is_shared(own)).map(|own| size_of_val(&**own));
        self.blocks.memory_bytes_beside(&other.blocks)
            + self.evidence.memory_bytes_beside(&other.evidence)
            + orders.sum::<usize>()
    }

    fn orders(&self) -> impl Iterator<Item = &Arc<[usize]>> {
        self.order.get().into_iter().chain([&self.earlier_order])
    }

    /// Bytes of memory of a block.
    pub(crate) fn block_bytes(&self, slot: usize) -> usize {
        let block = self.blocks.get(slot);
        block.map_or(0, |block| block.memory_bytes_beside(None, |block, _| block.memory_bytes()))
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

/// Finds those of the asked voxels that may be noise, since their own readings do not decide.
fn find_candidates(
    source: Source<'_>,
    (touched, change): (&Touched, Option<&Change>),
    asked: &Asked,
    surface: &Surface,
    statics: &mut CellBits,
    candidates: &mut Vec<Candidate>,
) {
    candidates.clear();
    let (block, thinning) = (&source.voxels.blocks()[touched.slot], source.thinning);
    let all = std::array::from_fn(|word| asked.changed[word] | asked.kept[word] | asked.noise[word]);
    block.places().for_each(&all, |place, index| {
        let weight =
            change.map_or_else(|| thinning.weight(block.weight(index)), |change| change.weights[place]);
        let (limit, was_static) = (limit(weight), has(&asked.kept, place));
        let heaviest = if was_static { touched.effect.raised } else { touched.effect.lowered };
        let is_concerned = has(&asked.changed, place) || limit < heaviest;
        let observations = block.observations(index);
        if !is_concerned || !thinning.is_seen(observations) {
            if was_static {
                put(statics, place);
            }
            return;
        }
        let radius = thinning.radius(block.weight(index), observations);
        if looks_around(radius) && !surface.passes_through(place) {
            candidates.push(Candidate { place, limit, radius });
        } else {
            put(statics, place);
        }
    });
}

#[cfg(test)]
mod tests {
    use dymlm_core::{ColorImage, DepthImage, Frame, PinholeCamera, Pose, SensorModel, SplitMix64};

    use super::*;
    use crate::{CloudMap, CloudMapConfig};

    /// What a noisy camera sees of an inclined wall, from a place that moves on, with a mover in some frames.
    fn frame(step: i32, are_colored: bool, random: &mut SplitMix64) -> (Frame, Pose) {
        let (width, height) = (48, 36);
        let camera = PinholeCamera::new(width, height, 39.0, 39.0, 23.5, 17.5).unwrap();
        let depths = (0..width * height).map(|pixel| {
            let is_mover = step % 3 == 1 && pixel % width < 9;
            let depth = if is_mover { 1.2 } else { 1.5 + (pixel / width) as f64 * 0.05 };
            (depth + 0.03 * (random.fraction() - 0.5)) as f32
        });
        let depth = DepthImage::new(width, height, depths.collect()).unwrap();
        let pose = Pose::new([0.02 * f64::from(step), 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let colors = (0..width * height).map(|pixel| [(pixel % 251) as u8, 7 * step as u8, 90]);
        let color = are_colored.then(|| ColorImage::new(width, height, colors.collect()).unwrap());
        (Frame::new(f64::from(step), camera, depth, color).unwrap(), pose)
    }

    fn refresh(cloud: &mut StaticCloud, source: Source<'_>, batch: usize) {
        let slots = cloud.take_in_new(source);
        cloud.refresh_by(source, &slots, batch, |cloud, slots| {
            cloud.take_in_changes(source, &cloud.changes(source, slots));
        });
    }

    #[test]
    fn what_is_taken_in_by_batches_is_what_a_look_at_all_finds() {
        taken_in_by_batches([1, 50], |_| false);
    }

    /// Points that stay are copied only where all readings have a colour, as those of the first frames have
    /// here.
    #[test]
    fn what_is_taken_in_has_the_same_colors_too() {
        taken_in_by_batches([7, usize::MAX], |step| step < 10);
    }

    fn taken_in_by_batches<const N: usize>(batches: [usize; N], are_colored: impl Fn(i32) -> bool) {
        let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
        let mut random = SplitMix64::new(3);
        let (mut kept, mut verdicts) = (batches.map(|_| StaticCloud::default()), VerdictGrid::default());
        let (mut frames, mut has_leaving) = (Vec::new(), false);
        for step in 0..14 {
            if step % 5 == 4 {
                let (frame, pose): (Frame, Pose) = frames.swap_remove(step as usize % frames.len());
                map.remove_counts(&frame, None, &pose).unwrap();
            } else {
                let (frame, pose) = frame(step, are_colored(step), &mut random);
                map.insert(&frame, None, &pose).unwrap();
                frames.push((frame, pose));
            }
            verdicts.refresh(&map.evidence, map.config.looks_per_reading as f32);
            let source = Source {
                voxels: &map.voxels,
                stamp: map.stamp,
                evidence: &map.evidence,
                verdicts: &verdicts,
                thinning: &map.thinning,
                voxel_size: map.config.voxel_size,
                fuses: true,
            };
            let mut whole = StaticCloud::default();
            refresh(&mut whole, source, usize::MAX);
            has_leaving |= whole.blocks.iter().any(|block| !block.leaving.is_empty());
            // Some read each frame, others only some, which leaves more to take in.
            for (turn, (cloud, batch)) in kept.iter_mut().zip(batches).enumerate() {
                if !(step as usize + turn).is_multiple_of(turn + 1) {
                    continue;
                }
                refresh(cloud, source, batch);
                assert!(cloud.is_fresh(&source));
                assert_eq!(cloud.len(), whole.len(), "step {step}, batches of {batch}");
                for slot in 0..whole.blocks.len() {
                    assert!(
                        cloud.has_same_points(slot, &whole, slot),
                        "step {step}, batches of {batch}, {slot}"
                    );
                    assert_eq!(cloud.judgement(slot).statics, whole.judgement(slot).statics);
                }
            }
        }
        assert!(has_leaving, "some points leave their block");
    }
}
