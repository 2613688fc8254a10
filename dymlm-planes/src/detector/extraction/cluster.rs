use std::cmp::Reverse;
use std::collections::BinaryHeap;

use dymlm_core::vector3::dot;

use super::block_grid::BlockGrid;
use super::tolerance::{COS_MERGE_ANGLE, Tolerance};
use crate::moments::{Fit, Moments};

/// No block, no entry.
const NONE: u32 = u32::MAX;

/// A cluster merges with one of every so many neighbours, and at least one, before its neighbours are listed
/// again.
const NEIGHBORS_PER_MERGE: usize = 16;

/// A cluster of blocks that is waiting to grow: the bits of its mean squared distance in single precision,
/// which are in the order of the numbers since none is negative, then its number. Another distance now means
/// that the entry is out of date.
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
/// The flattest cluster of all is taken from a heap and merged with the neighbour that leaves it flattest, as
/// long as the plane of both is flat enough for its depth; a cluster without such a neighbour waits to be
/// taken by another (the paper ends it there, which leaves blocks of unlucky noise behind). Two tests are
/// added to the paper's: normals must agree, and the common plane must lie on each of the two by itself, but
/// for its noise. For a few blocks hardly show in the mean of many (so a large plane eats the step beside
/// it), and far away two surfaces a hand apart are no rougher than the noise of one. Noise is what is left
/// about the planes of single blocks: it does not average out over a block of a hundred pixels, while a
/// misfit does not go away.
///
/// O(n log n) in the number of blocks for heap and clusters, plus the neighbours looked at.
#[derive(Debug, Clone, Default)]
pub(super) struct Clustering {
    heap: BinaryHeap<Reverse<Waiting>>,
    /// Union-find over blocks.
    parent: Vec<u32>,
    moments: Vec<Moments>,
    fits: Vec<Fit>,
    /// Sum of squared distances in depth of each cluster's points from the planes of their own blocks: the
    /// noise.
    noise: Vec<f64>,
    blocks: Vec<u32>,
    /// Neighbours of each cluster: linked lists through `next`, four entries a block; `heads`, `tails`.
    neighbor: Vec<u32>,
    next: Vec<u32>,
    heads: Vec<u32>,
    tails: Vec<u32>,
    /// The last visit that met a cluster.
    visited: Vec<u32>,
    candidates: Vec<Candidate>,
}

#[derive(Debug, Clone, Copy)]
struct Candidate {
    mse: f64,
    cluster: u32,
}

impl Clustering {
    /// Clusters the blocks whose fit is `Some`; neighbours are joined whatever step is between them (Feng's
    /// test for one changes nothing, since the common plane of both must be flat).
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

    /// Merges a cluster with the neighbour that leaves it flattest. A large one, which would soon be back,
    /// takes several of its neighbours: to list a hundred for each merge takes most of the time on large
    /// planes, and their order hardly changes.
    fn grow(&mut self, cluster: u32, tolerance: &Tolerance) {
        let most = (self.candidates.len() / NEIGHBORS_PER_MERGE).max(1);
        let mut grown = None;
        for _ in 0..most {
            let Some((position, fit)) = self.best_candidate(cluster, tolerance) else { break };
            let other = self.candidates.swap_remove(position).cluster;
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

    /// Lists the neighbours of a cluster once each, with the flatness of the plane of both; entries that have
    /// become doubled or part of the cluster itself leave its list.
    fn find_candidates(&mut self, cluster: u32, visit: u32) {
        self.candidates.clear();
        let own = self.moments[cluster as usize];
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
                let mse = own.plus(&self.moments[other]).mse();
                self.candidates.push(Candidate { mse, cluster: other as u32 });
            }
            entry = following;
        }
        if kept != NONE {
            self.next[kept as usize] = NONE;
        }
        self.tails[cluster as usize] = kept;
    }

    /// The neighbour that leaves the plane of both flattest, of those that may merge.
    fn best_candidate(&mut self, cluster: u32, tolerance: &Tolerance) -> Option<(usize, Fit)> {
        let own = self.moments[cluster as usize];
        let own_fit = self.fits[cluster as usize];
        loop {
            let (position, best) = self
                .candidates
                .iter()
                .copied()
                .enumerate()
                .min_by(|(_, a), (_, b)| a.mse.total_cmp(&b.mse).then(a.cluster.cmp(&b.cluster)))?;
            let other = best.cluster as usize;
            let merged = own.plus(&self.moments[other]);
            if best.mse >= tolerance.merge_mse(merged.centroid()[2]) {
                return None;
            }
            let agree = dot(own_fit.normal, self.fits[other].normal) >= COS_MERGE_ANGLE;
            let noise = [self.noise_mse(cluster as usize), self.noise_mse(other)];
            if agree && let Some(fit) = fit_of_both([&own, &self.moments[other]], noise, tolerance) {
                return Some((position, fit));
            }
            self.candidates.swap_remove(position);
        }
    }

    /// Puts two clusters together, and gives the number that both have from now on.
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

/// The plane of two sets of points, when it is flat enough for its depth and lies on each of the two but for
/// its noise; `noise` are their mean squared distances in depth from the planes of their blocks.
pub(super) fn fit_of_both(parts: [&Moments; 2], noise: [f64; 2], tolerance: &Tolerance) -> Option<Fit> {
    let fit = parts[0].plus(parts[1]).fit()?;
    let one_plane = tolerance.holds(&fit)
        && tolerance.is_part(parts[0], noise[0], &fit)
        && tolerance.is_part(parts[1], noise[1], &fit);
    one_plane.then_some(fit)
}
