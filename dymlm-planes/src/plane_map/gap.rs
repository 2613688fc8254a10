use dymlm_core::{DepthView, Plane, Pose, Visibility};

use crate::association::{FinitePlane, Partition};
use crate::linear_algebra::foot_on;
use crate::patches::{CoarseCell, Patch, VoxelBox};

/// Cells of 4 voxels a side are small enough to tell where two patches are nearest, ...
const FINEST_LEVEL: u32 = 2;
/// ... larger ones are taken until no patch has more of them near the other.
const MOST_CELLS: usize = 192;
/// Ways across a gap that are looked along, and places on each.
const MOST_WAYS: usize = 8;
const PLACES: usize = 12;
/// A gap is occluded while at most this share of its places, and of the key frames that look there, look
/// through it: noise at the rims. With 0 one floor stays two planes (0.2 duplicates a room), with more two
/// desks become one.
pub(super) const MAX_THROUGH: f64 = 0.1;

/// What lies between two patches of one plane: the shortest ways from the one to the other, where they are
/// nearest.
#[derive(Debug, Clone)]
pub(super) struct Gap {
    /// Places on the ways. World frame.
    places: Vec<[f64; 3]>,
    /// Places of the one patch near the other, and of the other near the one.
    sides: [Vec<[f64; 3]>; 2],
}

/// What a key frame sees between two patches of one plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum GapLook {
    /// Something nearer occludes what would join them.
    Occluded,
    /// One looks through between them.
    LookedThrough,
}

impl Gap {
    /// The gap between two patches in a region, if it is no wider than `max_width` metres (to a cell of the
    /// patches).
    ///
    /// O(voxels of either in the region within `max_width` of the other's box, sorted), and at most 192^2
    /// pairs of cells.
    pub(super) fn between(
        a: &FinitePlane<'_>,
        b: &FinitePlane<'_>,
        voxel_size: f64,
        max_width: f64,
        region: &VoxelBox,
        partitions: &[Partition],
    ) -> Option<Self> {
        let (reach, mut level) = ((max_width / voxel_size).ceil() as i32, FINEST_LEVEL);
        let near = |patch: &Patch, other: &Patch| {
            patch.coarse_cells_in(&other.bounds().grown(reach).intersection(region), FINEST_LEVEL)
        };
        let (mut of_a, mut of_b) = (near(a.patch, b.patch), near(b.patch, a.patch));
        while of_a.len().max(of_b.len()) > MOST_CELLS {
            CoarseCell::double(&mut of_a);
            CoarseCell::double(&mut of_b);
            level += 1;
        }
        let is_clear = |[from, to]: [[f64; 3]; 2]| {
            let [from, to] = [from, to].map(|place| place.map(|c| c * voxel_size));
            !partitions.iter().any(|partition| partition.parts(from, to))
        };
        let places = shortest_ways(&of_a, &of_b, max_width / voxel_size, level, is_clear)
            .flat_map(|[from, to]| {
                let from = foot_on(&a.plane, from.map(|c| c * voxel_size));
                let to = foot_on(&b.plane, to.map(|c| c * voxel_size));
                (1..=PLACES).map(move |k| {
                    let part = k as f64 / (PLACES + 1) as f64;
                    std::array::from_fn(|axis| from[axis] + part * (to[axis] - from[axis]))
                })
            })
            .collect::<Vec<_>>();
        let side = |of: &[CoarseCell], plane: &Plane| {
            of.iter().map(|cell| foot_on(plane, cell.center(level).map(|c| c * voxel_size))).collect()
        };
        let sides = [side(&of_a, &a.plane), side(&of_b, &b.plane)];
        (!places.is_empty()).then_some(Self { places, sides })
    }

    /// What a depth image shows of it; `None` when it tells nothing: it does not look there, has no readings,
    /// sees the plane go on, or sees the gap occluded together with all that is on one side of it, as a wall
    /// does with the next room. O(places), at most 96 and 192 on each side.
    pub(super) fn look(&self, view: &DepthView<'_>, camera_from_world: &Pose) -> Option<GapLook> {
        let (mut occluded, mut through, mut all) = (0.0, 0.0, self.places.len() as f64);
        for place in &self.places {
            match view.look_at_world(camera_from_world, *place, 0.0).visibility {
                Visibility::Occluded => occluded += 1.0,
                Visibility::Absent => through += 1.0,
                // The plane itself: one of the patches reaches here, or will.
                Visibility::Present => all -= 1.0,
                Visibility::OutOfView | Visibility::NoReading => {}
            }
        }
        if through > MAX_THROUGH * all {
            Some(GapLook::LookedThrough)
        } else {
            let shows = |side: &Vec<[f64; 3]>| {
                let look = |place: &[f64; 3]| view.look_at_world(camera_from_world, *place, 0.0).visibility;
                let count = |what| side.iter().map(look).filter(|at| *at == what).count() as f64;
                count(Visibility::Present) > 0.0
                    || count(Visibility::Occluded) <= MAX_THROUGH * side.len() as f64
            };
            (occluded > 0.0 && self.sides.iter().all(shows)).then_some(GapLook::Occluded)
        }
    }
}

/// From each cell of the one patch to the nearest of the other that the way is clear to: the ways that are at
/// most a cell longer than the shortest, some of them, spread over all. In voxels.
fn shortest_ways(
    of_a: &[CoarseCell],
    of_b: &[CoarseCell],
    max_length: f64,
    level: u32,
    is_clear: impl Fn([[f64; 3]; 2]) -> bool,
) -> impl Iterator<Item = [[f64; 3]; 2]> {
    let side = f64::from(1_u32 << level);
    let most = (max_length / side).powi(2).floor() as i64;
    let ways: Vec<(f64, [[f64; 3]; 2])> = of_a
        .iter()
        .filter_map(|a| {
            let mut nearest = None;
            for b in of_b {
                let (distance, way) = (a.square_distance(*b), [a.center(level), b.center(level)]);
                if distance <= most && nearest.is_none_or(|(least, _)| distance < least) && is_clear(way) {
                    nearest = Some((distance, way));
                }
            }
            nearest.map(|(distance, way)| ((distance as f64).sqrt() * side, way))
        })
        .collect();
    let least = ways.iter().map(|(length, _)| *length).fold(f64::INFINITY, f64::min);
    let short: Vec<_> = ways.into_iter().filter(|(length, _)| *length <= least + side).collect();
    let stride = short.len().div_ceil(MOST_WAYS).max(1);
    short.into_iter().step_by(stride).map(|(_, way)| way)
}
