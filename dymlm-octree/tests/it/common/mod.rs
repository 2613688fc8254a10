//! What the tests share: a generator of scans, and an octree written as naively as possible.

#![allow(dead_code, reason = "each test file uses a part")]

pub(crate) mod changes;

use std::collections::{BTreeMap, BTreeSet};

use dymlm_octree::{Leaf, Octree, OctreeConfig};

pub(crate) type Key = [u16; 3];

/// Knuth's MMIX generator, the same as in `data/generate.cpp`.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Multiples of 1 / 1024 within +-2, exact in single precision.
    pub(crate) fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 52) as i32 - 2048) as f32 / 1024.0
    }

    pub(crate) fn point(&mut self, scale: f32) -> [f32; 3] {
        [self.next() * scale, self.next() * scale, self.next() * scale]
    }
}

pub(crate) fn config(resolution: f64, max_range: f64) -> OctreeConfig {
    let mut config = OctreeConfig::default();
    config.resolution = resolution;
    config.max_range = max_range;
    config
}

/// A map of one leaf, given by its lowest cell: the file of such a map is one node for each depth.
pub(crate) fn one_leaf(resolution: f64, key: Key, depth: u8, log_odds: f32) -> Octree {
    let mut file =
        format!("# Octomap OcTree file\nid OcTree\nsize {}\nres {resolution}\ndata\n", u32::from(depth) + 1)
            .into_bytes();
    for level in 0..=depth {
        file.extend_from_slice(&log_odds.to_le_bytes());
        let bit = |axis: usize| (key[axis] >> (15 - level) & 1) << axis;
        file.push(if level == depth { 0 } else { 1 << (bit(0) | bit(1) | bit(2)) });
    }
    Octree::read_ot(file.as_slice(), OctreeConfig::default()).unwrap()
}

pub(crate) fn double(point: [f32; 3]) -> [f64; 3] {
    point.map(f64::from)
}

/// A map of cells, changed one by one as OctoMap's sources say, without a thought for speed.
pub(crate) struct Naive {
    pub(crate) resolution: f64,
    pub(crate) max_range: f64,
    pub(crate) per_cell: bool,
    pub(crate) cells: BTreeMap<Key, f32>,
}

pub(crate) const HIT: f32 = 0.847_297_85;
pub(crate) const MISS: f32 = -0.405_465_1;
pub(crate) const MIN: f32 = -2.000_028;
pub(crate) const MAX: f32 = 3.511_030_7;

impl Naive {
    pub(crate) fn new(resolution: f64, max_range: f64, per_cell: bool) -> Self {
        Self { resolution, max_range, per_cell, cells: BTreeMap::new() }
    }

    pub(crate) fn key(&self, point: [f32; 3]) -> Option<Key> {
        let mut key = [0; 3];
        for axis in 0..3 {
            let index = ((1.0 / self.resolution) * f64::from(point[axis])).floor() + 32768.0;
            if !(0.0..65536.0).contains(&index) {
                return None;
            }
            key[axis] = index as u16;
        }
        Some(key)
    }

    pub(crate) fn center(&self, key: Key) -> [f32; 3] {
        key.map(|index| ((f64::from(i32::from(index) - 32768) + 0.5) * self.resolution) as f32)
    }

    pub(crate) fn insert_scan(&mut self, origin: [f32; 3], points: &[[f32; 3]]) {
        let mut free = BTreeSet::new();
        let mut hit = BTreeSet::new();
        for &point in points {
            let Some(key) = self.key(point) else { continue };
            let end = if self.per_cell { self.center(key) } else { point };
            if norm(sub(end, origin)) <= self.max_range {
                free.extend(self.ray_keys(origin, end));
                hit.insert(key);
            } else {
                let offset = sub(end, origin);
                let length = norm(offset) as f32;
                let cut = [0, 1, 2].map(|i| origin[i] + offset[i] / length * self.max_range as f32);
                free.extend(self.ray_keys(origin, cut));
            }
        }
        for key in free.difference(&hit) {
            self.update(*key, MISS);
        }
        for key in hit {
            self.update(key, HIT);
        }
    }

    fn update(&mut self, key: Key, change: f32) {
        let value = self.cells.entry(key).or_insert(0.0);
        *value = (*value + change).clamp(MIN, MAX);
    }

    /// `computeRayKeys`.
    fn ray_keys(&self, origin: [f32; 3], end: [f32; 3]) -> Vec<Key> {
        let (Some(mut key), Some(last)) = (self.key(origin), self.key(end)) else { return Vec::new() };
        if key == last {
            return Vec::new();
        }
        let mut keys = vec![key];
        let offset = sub(end, origin);
        let length = norm(offset) as f32;
        let direction = offset.map(|value| value / length);
        let mut step = [0_i32; 3];
        let mut t_max = [f64::MAX; 3];
        let mut t_delta = [f64::MAX; 3];
        for i in 0..3 {
            step[i] = i32::from(direction[i] > 0.0) - i32::from(direction[i] < 0.0);
            if step[i] != 0 {
                let mut border = (f64::from(i32::from(key[i]) - 32768) + 0.5) * self.resolution;
                border += f64::from((f64::from(step[i]) * self.resolution * 0.5) as f32);
                t_max[i] = (border - f64::from(origin[i])) / f64::from(direction[i]);
                t_delta[i] = self.resolution / f64::from(direction[i].abs());
            }
        }
        loop {
            let dim = if t_max[0] < t_max[1] {
                if t_max[0] < t_max[2] { 0 } else { 2 }
            } else if t_max[1] < t_max[2] {
                1
            } else {
                2
            };
            key[dim] = (i32::from(key[dim]) + step[dim]) as u16;
            t_max[dim] += t_delta[dim];
            if key == last || t_max[0].min(t_max[1]).min(t_max[2]) > f64::from(length) {
                return keys;
            }
            keys.push(key);
        }
    }

    /// Equal neighbours joined, eight at a time, up to the root: (corner, depth, log-odds).
    pub(crate) fn leaves(&self) -> Vec<(Key, u8, f32)> {
        let mut leaves = Vec::new();
        let mut level: BTreeMap<Key, f32> = self.cells.clone();
        for depth in (1..=16_u8).rev() {
            let side = 1_u32 << (16 - depth);
            let mut parents: BTreeMap<Key, Vec<(Key, f32)>> = BTreeMap::new();
            for (key, value) in level {
                let parent = key.map(|index| (u32::from(index) / (2 * side) * 2 * side) as u16);
                parents.entry(parent).or_default().push((key, value));
            }
            level = BTreeMap::new();
            for (parent, children) in parents {
                if children.len() == 8 && children.iter().all(|child| child.1 == children[0].1) {
                    level.insert(parent, children[0].1);
                } else {
                    leaves.extend(children.into_iter().map(|(key, value)| (key, depth, value)));
                }
            }
        }
        leaves.sort_by_key(|leaf| leaf.0);
        leaves
    }

    /// Nodes of the octree with these leaves.
    pub(crate) fn nodes(&self) -> usize {
        let mut nodes = BTreeSet::new();
        for (key, depth, _) in self.leaves() {
            for depth in 0..=depth {
                let side = 1_u32 << (16 - depth);
                nodes.insert((depth, key.map(|index| u32::from(index) / side)));
            }
        }
        nodes.len()
    }
}

/// The leaves of a map as [`Naive::leaves`] has them.
pub(crate) fn leaves_of(map: &Octree) -> Vec<(Key, u8, f32)> {
    let mut leaves: Vec<_> = map.leaves().map(|leaf: Leaf| (leaf.key, leaf.depth, leaf.log_odds)).collect();
    leaves.sort_by_key(|leaf| leaf.0);
    leaves
}

pub(crate) fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn norm(v: [f32; 3]) -> f64 {
    f64::from(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}
