use std::cmp::Reverse;
use std::collections::BinaryHeap;

use dymlm_core::vector3::dot;

use super::block_grid::BlockGrid;
use super::tolerance::{COS_MERGE_ANGLE, Tolerance};
use crate::moments::{Fit, Moments};

/// Marks a missing block or list entry.
const NONE: u32 = u32::MAX;

/// A cluster merges with one of this many of its neighbours, and at least with one, before its neighbours are
/// listed again.
const NEIGHBORS_PER_MERGE: usize = 16;

/// A cluster of blocks in the heap: the bits of its mean squared distance in single precision, which sort
/// like the numbers because none is negative, then the cluster's number. An entry whose distance differs from
/// the cluster's present one is out of date.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Waiting(u64);

impl Waiting {
    fn new(cluster: u32, mse: f64) -> Self {
        Self(u64::from((mse as f32).to_bits()) << 32 | u64::from(cluster))
    }

    fn cluster(self) -> u32 {
        self.0 as u32
    }
}

/// Agglomerative hierarchical clustering of blocks (Feng 2014, algorithm 1).
///
/// The flattest of all clusters is taken from a heap and merged with the neighbour with which it stays
/// flattest, as long as their common plane is flat enough for its depth. A cluster without such a neighbour
/// waits until another cluster takes it (the paper ends it there, which leaves blocks with unlucky noise
/// behind). Two tests are added to the paper's: the normals must agree, and the common plane must fit each of
/// the two by itself, apart from its noise. The reason is that a few blocks hardly show in the mean of many,
/// so a large plane would take in the step beside it; and far away two surfaces a hand apart are no rougher
/// than the noise of one. The noise is measured as the residual about the planes of single blocks: it does
/// not average out over a block of a hundred pixels, and a misfit of the common plane is not part of it.
///
/// O(n log n) in the number of blocks for heap and clusters, plus the neighbours visited.
#[derive(Debug, Clone, Default)]
pub(super) struct Clustering {
    heap: BinaryHeap<Reverse<Waiting>>,
    /// Union-find over blocks.
    parent: Vec<u32>,
    moments: Vec<Moments>,
    fits: Vec<Fit>,
    /// The noise of each cluster: the sum of squared distances in depth of its points from the planes of
    /// their own blocks.
    noise: Vec<f64>,
    blocks: Vec<u32>,
    /// Neighbours of each cluster as linked lists through `next`, at most four entries per block; `heads` and
    /// `tails` are the lists' ends.
    neighbor: Vec<u32>,
    next: Vec<u32>,
    heads: Vec<u32>,
    tails: Vec<u32>,
    /// For each cluster, the last visit that listed it.
    visited: Vec<u32>,
    /// The present cluster's neighbours, as they are listed, and by flatness.
    listed: Vec<u32>,
    candidates: BinaryHeap<Reverse<Ranked>>,
}

/// A neighbour in the order of flatness: the bits of the common plane's mean squared distance, which sort
/// like the numbers because none is negative, then the cluster's number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Ranked(u128);

impl Ranked {
    fn new(mse: f64, cluster: u32) -> Self {
        // A negative zero becomes a positive one.
        Self(u128::from((mse + 0.0).to_bits()) << 32 | u128::from(cluster))
    }

    fn mse(self) -> f64 {
        f64::from_bits((self.0 >> 32) as u64)
    }

    fn cluster(self) -> u32 {
        self.0 as u32
    }
}

impl Clustering {
    /// Clusters the blocks whose fit is `Some`. Neighbours are linked whatever step is between them (Feng's
    /// test of the step changes nothing, because the common plane of both must be flat anyway).
    pub(super) fn run(
        &mut self,
        grid: &BlockGrid,
        moments: &[Moments],
        fits: &[Option<Fit>],
        tolerance: &Tolerance,
    ) {
        self.begin(grid, moments, fits);
        let mut visit = 0;
        while let Some(Reverse(waiting)) = self.heap.pop() {
            let cluster = waiting.cluster();
            let index = cluster as usize;
            if self.parent[index] != cluster || waiting != Waiting::new(cluster, self.fits[index].mse) {
                continue;
            }
            visit += 1;
            self.find_candidates(cluster, visit);
            self.grow(cluster, tolerance);
        }
    }

    /// Merges a cluster with the neighbour with which it stays flattest. A large cluster, which would soon be
    /// the flattest again, takes several neighbours at once: listing a hundred neighbours for each merge
    /// would take most of the time on large planes, and their order hardly changes.
    fn grow(&mut self, cluster: u32, tolerance: &Tolerance) {
        let most = (self.candidates.len() / NEIGHBORS_PER_MERGE).max(1);
        let mut grown = None;
        for _ in 0..most {
            let Some((other, fit)) = self.take_best_candidate(cluster, tolerance) else { break };
            let into = self.merge(cluster, other, fit);
            grown = Some((into, fit.mse));
            if into != cluster {
                break;
            }
        }
        if let Some((cluster, mse)) = grown {
            self.heap.push(Reverse(Waiting::new(cluster, mse)));
        }
    }

    /// The cluster of a block: the same number for all blocks of a cluster.
    pub(super) fn find(&mut self, block: usize) -> usize {
        let mut node = block as u32;
        while self.parent[node as usize] != node {
            let grandparent = self.parent[self.parent[node as usize] as usize];
            self.parent[node as usize] = grandparent;
            node = grandparent;
        }
        node as usize
    }

    pub(super) fn moments(&self, cluster: usize) -> &Moments {
        &self.moments[cluster]
    }

    pub(super) fn fit(&self, cluster: usize) -> &Fit {
        &self.fits[cluster]
    }

    /// Mean squared distance in depth of a cluster's points from the planes of their own blocks.
    pub(super) fn noise_mse(&self, cluster: usize) -> f64 {
        self.noise[cluster] / self.moments[cluster].weight
    }

    fn begin(&mut self, grid: &BlockGrid, moments: &[Moments], fits: &[Option<Fit>]) {
        let count = grid.len();
        self.heap.clear();
        self.parent.clear();
        self.parent.extend(0..count as u32);
        self.moments.clear();
        self.moments.extend_from_slice(moments);
        self.fits.clear();
        self.fits.extend(fits.iter().map(|fit| fit.unwrap_or_default()));
        self.noise.clear();
        self.noise.extend(self.fits.iter().zip(moments).map(|(fit, moments)| fit.depth_mse * moments.weight));
        for (buffer, value) in
            [(&mut self.blocks, 1), (&mut self.visited, 0), (&mut self.heads, NONE), (&mut self.tails, NONE)]
        {
            buffer.clear();
            buffer.resize(count, value);
        }
        self.neighbor.clear();
        self.next.clear();
        for block in 0..count {
            let [_, right, _, below] = grid.neighbors(block);
            for other in [right, below].into_iter().flatten() {
                if fits[block].is_some() && fits[other].is_some() {
                    self.link(block, other);
                    self.link(other, block);
                }
            }
        }
        let waiting = fits.iter().enumerate();
        let waiting =
            waiting.filter_map(|(block, fit)| Some(Reverse(Waiting::new(block as u32, fit.as_ref()?.mse))));
        self.heap.extend(waiting);
    }

    fn link(&mut self, block: usize, neighbor: usize) {
        let entry = self.neighbor.len() as u32;
        self.neighbor.push(neighbor as u32);
        self.next.push(NONE);
        match self.tails[block] {
            NONE => self.heads[block] = entry,
            tail => self.next[tail as usize] = entry,
        }
        self.tails[block] = entry;
    }

    /// Lists each neighbour of a cluster once, with the flatness of the common plane. Entries that have
    /// become duplicates or part of the cluster itself are removed from its list.
    fn find_candidates(&mut self, cluster: u32, visit: u32) {
        self.listed.clear();
        let mut kept = NONE;
        let mut entry = self.heads[cluster as usize];
        self.heads[cluster as usize] = NONE;
        while entry != NONE {
            let following = self.next[entry as usize];
            let other = self.find(self.neighbor[entry as usize] as usize);
            if other != cluster as usize && self.visited[other] != visit {
                self.visited[other] = visit;
                self.neighbor[entry as usize] = other as u32;
                match kept {
                    NONE => self.heads[cluster as usize] = entry,
                    last => self.next[last as usize] = entry,
                }
                kept = entry;
                self.listed.push(other as u32);
            }
            entry = following;
        }
        if kept != NONE {
            self.next[kept as usize] = NONE;
        }
        self.tails[cluster as usize] = kept;
        self.rank_candidates(cluster);
    }

    /// Orders the listed neighbours by the flatness of the common plane, which is computed for two at a time.
    fn rank_candidates(&mut self, cluster: u32) {
        let own = self.moments[cluster as usize];
        let moments = |cluster: u32| &self.moments[cluster as usize];
        let mut ranked = std::mem::take(&mut self.candidates).into_vec();
        ranked.resize(self.listed.len(), Reverse(Ranked(0)));
        let ((pairs, last), (ranked_pairs, ranked_last)) =
            (self.listed.as_chunks::<2>(), ranked.as_chunks_mut::<2>());
        for (ranked, &[a, b]) in ranked_pairs.iter_mut().zip(pairs) {
            let [mse_a, mse_b] = own.mse_with_each([moments(a), moments(b)]);
            *ranked = [Ranked::new(mse_a, a), Ranked::new(mse_b, b)].map(Reverse);
        }
        for (ranked, &other) in ranked_last.iter_mut().zip(last) {
            *ranked = Reverse(Ranked::new(own.mse_with(moments(other)), other));
        }
        self.candidates = BinaryHeap::from(ranked);
    }

    /// Takes from the neighbours the one with the flattest common plane that may merge, and those before it
    /// that may not.
    fn take_best_candidate(&mut self, cluster: u32, tolerance: &Tolerance) -> Option<(u32, Fit)> {
        let own = self.moments[cluster as usize];
        let own_fit = self.fits[cluster as usize];
        while let Some(Reverse(best)) = self.candidates.pop() {
            let other = best.cluster() as usize;
            let merged = own.plus(&self.moments[other]);
            if best.mse() >= tolerance.merge_mse(merged.centroid()[2]) {
                return None;
            }
            let agree = dot(own_fit.normal, self.fits[other].normal) >= COS_MERGE_ANGLE;
            let noise = [self.noise_mse(cluster as usize), self.noise_mse(other)];
            if agree && let Some(fit) = fit_of_both([&own, &self.moments[other]], noise, tolerance) {
                return Some((best.cluster(), fit));
            }
        }
        None
    }

    /// Merges two clusters and returns their common number.
    fn merge(&mut self, cluster: u32, other: u32, fit: Fit) -> u32 {
        let (a, b) = (cluster as usize, other as usize);
        let (into, from) = if self.blocks[a] >= self.blocks[b] { (a, b) } else { (b, a) };
        self.parent[from] = into as u32;
        self.moments[into] = self.moments[a].plus(&self.moments[b]);
        self.fits[into] = fit;
        self.blocks[into] += self.blocks[from];
        self.noise[into] += self.noise[from];
        match self.tails[into] {
            NONE => self.heads[into] = self.heads[from],
            tail => self.next[tail as usize] = self.heads[from],
        }
        if self.tails[from] != NONE {
            self.tails[into] = self.tails[from];
        }
        into as u32
    }
}

/// The common plane of two sets of points; `None` unless it is flat enough for its depth and fits each of the
/// two apart from its noise. `noise` are the sets' mean squared distances in depth from the planes of their
/// blocks.
pub(super) fn fit_of_both(parts: [&Moments; 2], noise: [f64; 2], tolerance: &Tolerance) -> Option<Fit> {
    let fit = parts[0].plus(parts[1]).fit()?;
    let one_plane = tolerance.holds(&fit)
        && tolerance.is_part(parts[0], noise[0], &fit)
        && tolerance.is_part(parts[1], noise[1], &fit);
    one_plane.then_some(fit)
}
