use dymlm_core::vector3::{difference, norm};
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
/// A gap is occluded while at most this share of its places that are seen, and of the key frames that look
/// there, look through it: noise at the rims. With 0 one floor stays two planes (0.2 duplicates a room), with
/// more two desks become one.
pub(super) const MAX_THROUGH: f64 = 0.1;

/// What lies between two patches of one plane: the shortest ways from the one to the other, where they are
/// nearest.
#[derive(Debug, Clone)]
pub(super) struct Gap {
    /// The ways from each cell of the one to the nearest of the other. World frame.
    ways: Vec<Way>,
    /// Side of the cells, metres.
    cell: f64,
    /// Places of the one patch near the other, and of the other near the one.
    sides: [Vec<[f64; 3]>; 2],
}

/// From here to there.
type Way = [[f64; 3]; 2];

/// What a key frame sees between two patches of one plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
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
        let ways = clear_ways(&of_a, &of_b, max_width / voxel_size, level, is_clear);
        let ways: Vec<Way> = ways
            .map(|[from, to]| {
                let from = foot_on(&a.plane, from.map(|c| c * voxel_size));
                [from, foot_on(&b.plane, to.map(|c| c * voxel_size))]
            })
            .collect();
        let side = |of: &[CoarseCell], plane: &Plane| {
            of.iter().map(|cell| foot_on(plane, cell.center(level).map(|c| c * voxel_size))).collect()
        };
        let sides = [side(&of_a, &a.plane), side(&of_b, &b.plane)];
        let cell = f64::from(1_u32 << level) * voxel_size;
        (!ways.is_empty()).then_some(Self { ways, cell, sides })
    }

    /// Places on the shortest of the ways that are asked for: on some of those that are at most a cell longer
    /// than the shortest, spread over all.
    fn places_on_shortest(&self, is_asked: impl Fn(&&Way) -> bool) -> Vec<[f64; 3]> {
        let length = |[from, to]: &Way| norm(difference(*to, *from));
        let asked: Vec<&Way> = self.ways.iter().filter(is_asked).collect();
        let least = asked.iter().map(|way| length(way)).fold(f64::INFINITY, f64::min);
        let short: Vec<&Way> = asked.into_iter().filter(|way| length(way) <= least + self.cell).collect();
        let stride = short.len().div_ceil(MOST_WAYS).max(1);
        let parts = (1..=PLACES).map(|k| k as f64 / (PLACES + 1) as f64);
        let on_way = |way: &&Way| parts.clone().map(|part| between(way, part)).collect::<Vec<_>>();
        short.iter().step_by(stride).flat_map(on_way).collect()
    }

    /// What a depth image shows of it; `None` when it tells nothing: it does not look there, has no readings,
    /// sees the plane go on, or sees the gap occluded together with most of what is on one side of it, as by
    /// a wall before the next room. It is asked for the ways in its view alone: which of all are shortest by
    /// less than a cell is chance. O(ways and places), at most 192 and 96, and 192 places on each side.
    pub(super) fn look(&self, view: &DepthView<'_>, camera_from_world: &Pose) -> Option<GapLook> {
        let look = |place| view.look_at_world(camera_from_world, place, 0.0).visibility;
        // How many of the places show the plane, are occluded and are looked through.
        let count = |places: &[[f64; 3]]| {
            let kinds = [Visibility::Present, Visibility::Occluded, Visibility::Absent];
            places.iter().fold([0; 3], |mut counts: [usize; 3], place| {
                let visibility = look(*place);
                counts
                    .iter_mut()
                    .zip(kinds)
                    .for_each(|(count, kind)| *count += usize::from(visibility == kind));
                counts
            })
        };
        let places = self.places_on_shortest(|way| look(between(way, 0.5)) != Visibility::OutOfView);
        let [_, occluded, through] = count(&places);
        if through as f64 > MAX_THROUGH * (occluded + through) as f64 {
            return Some(GapLook::LookedThrough);
        }
        let shows = |side: &Vec<[f64; 3]>| {
            let [present, occluded, _] = count(side);
            present > 0 || 2 * occluded <= side.len()
        };
        (occluded > 0 && self.sides.iter().all(shows)).then_some(GapLook::Occluded)
    }
}

/// From each cell of the one patch to the nearest of the other that the way is clear to. In voxels.
fn clear_ways(
    of_a: &[CoarseCell],
    of_b: &[CoarseCell],
    max_length: f64,
    level: u32,
    is_clear: impl Fn(Way) -> bool,
) -> impl Iterator<Item = Way> {
    let most = (max_length / f64::from(1_u32 << level)).powi(2).floor() as i64;
    of_a.iter().filter_map(move |a| {
        let mut nearest = None;
        for b in of_b {
            let (distance, way) = (a.square_distance(*b), [a.center(level), b.center(level)]);
            if distance <= most && nearest.is_none_or(|(least, _)| distance < least) && is_clear(way) {
                nearest = Some((distance, way));
            }
        }
        nearest.map(|(_, way)| way)
    })
}

/// The place that is a part of the way from here to there.
fn between([from, to]: &Way, part: f64) -> [f64; 3] {
    std::array::from_fn(|axis| from[axis] + part * (to[axis] - from[axis]))
}
