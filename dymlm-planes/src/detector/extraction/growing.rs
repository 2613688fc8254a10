use dymlm_core::SensorModel;
use dymlm_core::vector3::dot;
use wide::f32x4;

use super::super::rays::Rays;
use super::super::reading_noise::ReadingNoise;
use super::super::wide_noise::sigmas;
use super::block_grid::BlockGrid;
use super::reached::{PixelBits, keep_reached};
use super::tolerance::Tolerance;
use crate::moments::{Fit, Moments, RowSums};

/// Most planes that compete for one block's pixels.
const MOST_CANDIDATES: usize = 6;

/// Pixels join a plane up to this many root mean square distances of the plane's points. (Feng 2014: 3.)
const GROWING_DISTANCE: f64 = 2.5;
/// Added to the distances of strips, in deviations: more than any reading's distance from a plane that it may join, so
/// that a wide plane takes its pixels as if there were no strips, some of which are steps between surfaces.
const BEHIND_WIDE_PLANES: f32 = 100.0;
/// A plane that grows, in the form that the measurement of distances needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seed {
    pub(super) fit: Fit,
    /// Mean squared distance in depth of the plane's points from the planes of their blocks.
    pub(super) noise_mse: f64,
    normal: [f32; 3],
    d: f32,
    sensor: SensorModel,
    /// Pixels join up to this multiple of the sensor's noise. It is at least 1, so that pixels within their
    /// own noise join however exact the image is (`labels_agree_with_a_rendered_room`).
    limit_per_noise: f32,
}

impl Seed {
    /// The term of the distance that is the same for all pixels of a row.
    #[inline]
    fn of_row(&self, ray_y: f64) -> f32 {
        self.normal[1] * ray_y as f32 + self.normal[2]
    }

    /// Distances of four readings from the plane, metres; infinity where they are too far to join.
    #[inline]
    fn distances_if_near(&self, z: f32x4, ray_x: f32x4, of_row: f32) -> f32x4 {
        let along = f32x4::splat(self.normal[0]) * ray_x + f32x4::splat(of_row);
        let distance = (z * along + f32x4::splat(self.d)).abs();
        let limit = f32x4::splat(self.limit_per_noise) * sigmas(&self.sensor.noise, z);
        let limit = limit & z.simd_gt(f32x4::ZERO);
        distance.simd_lt(limit).select(distance, f32x4::splat(f32::INFINITY))
    }

    pub(super) fn new(fit: &Fit, noise_mse: f64, sensor: SensorModel) -> Self {
        let noise = sensor.sigma(fit.centroid[2] as f32);
        let limit = (GROWING_DISTANCE * fit.mse.sqrt()) as f32;
        Self {
            fit: *fit,
            noise_mse,
            normal: fit.normal.map(|n| n as f32),
            d: -dot(fit.normal, fit.centroid) as f32,
            sensor,
            limit_per_noise: (limit / noise).max(1.0),
        }
    }
}

/// The planes that compete for one block: their labels in order of arrival, and the sides of the block
/// through which each entered.
#[derive(Debug, Clone, Copy, Default)]
struct Candidates {
    labels: [u16; MOST_CANDIDATES],
    sides: [u8; MOST_CANDIDATES],
    count: u8,
    waiting: bool,
}

/// The plane has entered through all sides, or has reached all pixels that it can.
const ALL_SIDES: u8 = 0b1111;

impl Candidates {
    fn labels(&self) -> &[u16] {
        &self.labels[..usize::from(self.count)]
    }

    fn place_of(&self, label: u16) -> Option<usize> {
        self.labels().iter().position(|&other| other == label)
    }

    /// Whether a plane has entered through these sides.
    fn has(&self, label: u16, sides: u8) -> bool {
        self.place_of(label).is_some_and(|place| self.sides[place] & sides == sides)
    }

    /// Lets a plane enter through some sides. Returns whether this is new and there is room for the plane.
    fn add(&mut self, label: u16, sides: u8) -> bool {
        if let Some(place) = self.place_of(label) {
            let is_new = self.sides[place] & sides != sides;
            self.sides[place] |= sides;
            return is_new;
        }
        let count = usize::from(self.count);
        if count == MOST_CANDIDATES {
            return false;
        }
        (self.labels[count], self.sides[count]) = (label, sides);
        self.count += 1;
        true
    }
}

/// Region growing pixel by pixel, only where planes end (Feng 2014, algorithm 4).
///
/// Blocks at the rim of a plane are eroded: they no longer belong to it as a whole. In them, and in blocks of
/// no plane, the planes that grow from the inner blocks compete, one block at a time. Each pixel goes to the
/// nearest of the planes that reached the block, if it is near enough for its noise. A plane continues across
/// a side of the block when two pixels of that side are its own.
///
/// O(pixels of the blocks that planes grow into, times the planes that meet in them).
#[derive(Debug, Clone, Default)]
pub(super) struct Growing {
    /// Whether a block lies inside its plane and belongs to it as a whole.
    core: Vec<bool>,
    candidates: Vec<Candidates>,
    queue: Vec<u32>,
    next_queue: Vec<u32>,
    /// Number of blocks and of core blocks of each label.
    blocks: Vec<[u32; 2]>,
    buffers: BlockBuffers,
}

/// Buffers with one entry per pixel of the present block, row by row.
#[derive(Debug, Clone, Default)]
struct BlockBuffers {
    /// Distance from one plane; infinity where the plane does not reach.
    distances: Vec<f32>,
    /// Distance from the nearest plane so far, in deviations, and that plane's label.
    nearest: Vec<f32>,
    labels: Vec<u32>,
    bits: PixelBits,
}

/// Pixels that are measured at once.
const LANES: usize = 4;

/// The input of the growing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    pub(super) depth: &'a [f32],
    pub(super) grid: &'a BlockGrid,
    pub(super) rays: &'a Rays,
    pub(super) moments: &'a [Moments],
    pub(super) fits: &'a [Option<Fit>],
    pub(super) tolerance: &'a Tolerance,
    pub(super) noise: ReadingNoise,
    /// The planes; label k is `seeds[k - 1]`.
    pub(super) seeds: &'a [Seed],
    /// Label of each block, 0 = no plane.
    pub(super) block_labels: &'a [u16],
    /// Whether each label's plane has a square of two by two blocks; the others are strips.
    pub(super) is_wide: &'a [bool],
}

impl Growing {
    /// Labels the pixels of all blocks that are not core blocks; the labels of core blocks' pixels are not
    /// written.
    pub(super) fn run(&mut self, scene: &Scene<'_>, pixel_labels: &mut [u16]) {
        self.erode(scene);
        self.start(scene);
        while !self.queue.is_empty() {
            let queue = std::mem::take(&mut self.queue);
            for &block in &queue {
                self.grow_into(scene, block as usize, pixel_labels);
            }
            self.queue = std::mem::take(&mut self.next_queue);
            self.next_queue = queue;
            self.next_queue.clear();
        }
    }

    /// Whether a block belongs to its plane as a whole.
    pub(super) fn is_core(&self, block: usize) -> bool {
        self.core[block]
    }

    /// Labels of the planes that meet in a block.
    pub(super) fn meeting_in(&self, block: usize) -> &[u16] {
        self.candidates[block].labels()
    }

    /// Blocks next to a block of another plane, or of none, are no core blocks. But a plane of which fewer
    /// than an eighth would stay core keeps all its blocks. Strips have no core blocks.
    fn erode(&mut self, scene: &Scene<'_>) {
        let (grid, labels) = (scene.grid, scene.block_labels);
        let may_be_core = |label: u16| label != 0 && scene.is_wide[usize::from(label)];
        self.core.clear();
        self.core.extend(labels.iter().enumerate().map(|(block, &label)| {
            may_be_core(label)
                && grid.neighbors(block).into_iter().flatten().all(|other| labels[other] == label)
        }));
        self.blocks.clear();
        self.blocks.resize(scene.seeds.len() + 1, [0; 2]);
        for (&label, &core) in labels.iter().zip(&self.core) {
            let [all, inner] = &mut self.blocks[usize::from(label)];
            *all += 1;
            *inner += u32::from(core);
        }
        for (&label, core) in labels.iter().zip(&mut self.core) {
            let [all, inner] = self.blocks[usize::from(label)];
            *core |= may_be_core(label) && 8 * inner < all;
        }
    }

    fn start(&mut self, scene: &Scene<'_>) {
        let (grid, labels) = (scene.grid, scene.block_labels);
        self.candidates.clear();
        self.candidates.resize(grid.len(), Candidates::default());
        self.queue.clear();
        self.next_queue.clear();
        for block in 0..grid.len() {
            if self.core[block] {
                self.candidates[block].add(labels[block], ALL_SIDES);
                continue;
            }
            for (side, other) in grid.neighbors(block).into_iter().enumerate() {
                let Some(other) = other else { continue };
                if self.core[other] && may_enter(scene, block, labels[other]) {
                    self.candidates[block].add(labels[other], 1 << side);
                }
            }
            if labels[block] != 0 {
                self.candidates[block].add(labels[block], ALL_SIDES);
            }
            if self.candidates[block].count > 0 {
                self.candidates[block].waiting = true;
                self.queue.push(block as u32);
            }
        }
    }

    fn grow_into(&mut self, scene: &Scene<'_>, block: usize, pixel_labels: &mut [u16]) {
        self.candidates[block].waiting = false;
        label_pixels(scene, block, &mut self.candidates[block], &mut self.buffers, pixel_labels);
        let candidates = self.candidates[block];
        for (side, other) in scene.grid.neighbors(block).into_iter().enumerate() {
            let Some(other) = other else { continue };
            if self.core[other] {
                continue;
            }
            let from = 1 << (side ^ 1);
            for &label in candidates.labels() {
                if self.candidates[other].has(label, from)
                    || !crosses(scene.grid, block, side, label, pixel_labels)
                    || !may_enter(scene, other, label)
                {
                    continue;
                }
                let place = &mut self.candidates[other];
                if place.add(label, from) && !place.waiting {
                    place.waiting = true;
                    self.next_queue.push(other as u32);
                }
            }
        }
    }
}

/// Whether a plane may grow into a block: a block that is flat by itself but does not lie on the plane is
/// another surface, even where the plane cuts through it.
fn may_enter(scene: &Scene<'_>, block: usize, label: u16) -> bool {
    let Some(fit) = &scene.fits[block] else { return true };
    let plane = &scene.seeds[usize::from(label) - 1].fit;
    scene.tolerance.is_part(&scene.moments[block], fit.depth_mse, plane)
}

/// Assigns each reading of a block to the nearest of the planes that have a connection to it, in deviations of the
/// noise: on a table seen at a grazing angle the noise hardly moves readings off the table, but several centimetres
/// off the wall behind it. A plane that reaches all pixels near it need not enter through another side.
fn label_pixels(
    scene: &Scene<'_>,
    block: usize,
    candidates: &mut Candidates,
    buffers: &mut BlockBuffers,
    pixel_labels: &mut [u16],
) {
    let (columns, rows) = (scene.grid.pixel_columns(block), scene.grid.pixel_rows(block));
    let BlockBuffers { distances, nearest, labels, bits } = buffers;
    nearest.clear();
    nearest.resize(scene.grid.area(block), f32::INFINITY);
    labels.clear();
    labels.resize(nearest.len(), 0);
    let middle = [scene.rays.x[columns.start + columns.len() / 2], scene.rays.y[rows.start + rows.len() / 2]];
    for (place, &label) in candidates.labels[..usize::from(candidates.count)].iter().enumerate() {
        let sides = &mut candidates.sides[place];
        let seed = &scene.seeds[usize::from(label) - 1];
        let per_deviation = 1.0 / scene.noise.deviation_across(&seed.fit, middle) as f32;
        find_near(scene, block, seed, distances);
        if *sides != ALL_SIDES && keep_reached(distances, columns.len(), *sides, bits) {
            *sides = ALL_SIDES;
        }
        let behind = if scene.is_wide[usize::from(label)] { 0.0 } else { BEHIND_WIDE_PLANES };
        for ((mine, nearest), &distance) in labels.iter_mut().zip(nearest.iter_mut()).zip(distances.iter()) {
            let distance = distance * per_deviation + behind;
            let is_nearer = distance < *nearest;
            *mine = if is_nearer { u32::from(label) } else { *mine };
            *nearest = if is_nearer { distance } else { *nearest };
        }
    }
    for (v, own) in rows.zip(labels.chunks_exact(columns.len())) {
        let row = v * scene.grid.width;
        for (label, own) in pixel_labels[row + columns.start..row + columns.end].iter_mut().zip(own) {
            *label = *own as u16;
        }
    }
}

/// Measures the distance of each reading of a block from a plane, row by row; infinity where it is too far to
/// join.
fn find_near(scene: &Scene<'_>, block: usize, seed: &Seed, distances: &mut Vec<f32>) {
    let columns = scene.grid.pixel_columns(block);
    let (ray_x, last_ray_x) = scene.rays.x_single[columns.clone()].as_chunks::<LANES>();
    distances.resize(scene.grid.area(block), 0.0);
    for (v, distances) in scene.grid.pixel_rows(block).zip(distances.chunks_exact_mut(columns.len())) {
        let row = v * scene.grid.width;
        let (depths, last_depths) = scene.depth[row + columns.start..row + columns.end].as_chunks::<LANES>();
        let (distances, last_distances) = distances.as_chunks_mut::<LANES>();
        let of_row = seed.of_row(scene.rays.y[v]);
        for ((distances, z), a) in distances.iter_mut().zip(depths).zip(ray_x) {
            *distances = seed.distances_if_near(f32x4::from(*z), f32x4::from(*a), of_row).to_array();
        }
        for ((distance, &z), &a) in last_distances.iter_mut().zip(last_depths).zip(last_ray_x) {
            [*distance, ..] = seed.distances_if_near(f32x4::splat(z), f32x4::splat(a), of_row).to_array();
        }
    }
}

/// Whether at least two pixels along a side (0 left, 1 right, 2 above, 3 below) of a block have a label.
fn crosses(grid: &BlockGrid, block: usize, side: usize, label: u16, pixel_labels: &[u16]) -> bool {
    let (columns, rows) = (grid.pixel_columns(block), grid.pixel_rows(block));
    let (columns, rows) = match side {
        0 => (columns.start..columns.start + 1, rows),
        1 => (columns.end - 1..columns.end, rows),
        2 => (columns, rows.start..rows.start + 1),
        _ => (columns, rows.end - 1..rows.end),
    };
    let own: usize = rows
        .map(|v| pixel_labels[v * grid.width + columns.start..v * grid.width + columns.end].iter())
        .map(|row| row.filter(|&&other| other == label).count())
        .sum();
    own >= 2
}

/// Sums the points of the pixels of a block by their labels.
pub(super) fn sum_pixels(
    depth: &[f32],
    grid: &BlockGrid,
    rays: &Rays,
    block: usize,
    pixel_labels: &[u16],
    sums: &mut [Moments],
) {
    let columns = grid.pixel_columns(block);
    for v in grid.pixel_rows(block) {
        let row = v * grid.width;
        let labels = &pixel_labels[row + columns.start..row + columns.end];
        let mut u = columns.start;
        for run in labels.chunk_by(|a, b| a == b) {
            let end = u + run.len();
            if run[0] > 0 {
                sum_run(
                    &depth[row + u..row + end],
                    &rays.x[u..end],
                    rays.y[v],
                    &mut sums[usize::from(run[0]) - 1],
                );
            }
            u = end;
        }
    }
}

/// Adds the points of adjacent pixels of a row. `b` is the row's ray height, which is multiplied in once.
fn sum_run(depths: &[f32], ray_x: &[f64], b: f64, sums: &mut Moments) {
    let [mut z, mut az, mut zz, mut azz, mut aazz] = [0.0; 5];
    for (&reading, a) in depths.iter().zip(ray_x) {
        let reading = f64::from(reading);
        let (square, along) = (reading * reading, a * reading);
        z += reading;
        az += along;
        zz += square;
        azz += along * reading;
        aazz += along * along;
    }
    sums.add(&Moments::of_row(b, RowSums { weight: depths.len() as f64, z, az, zz, azz, aazz }));
}
