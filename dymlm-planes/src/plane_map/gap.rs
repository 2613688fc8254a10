use dymlm_core::vector3::{difference, norm};
use dymlm_core::{DepthView, Plane, Pose, Visibility, record_of_cases};

use crate::association::{FinitePlane, Partition};
use crate::linear_algebra::foot_on;
use crate::patches::{CoarseCell, Patch, VoxelBox};

/// Cells of 4 voxels a side are small enough to find where two patches are nearest, ...
const FINEST_LEVEL: u32 = 2;
/// ... and cells are doubled until neither patch has more than this many of them near the other.
const MOST_CELLS: usize = 192;
/// Most ways across a gap that are checked, and places on each.
const MOST_WAYS: usize = 8;
const PLACES: usize = 12;
/// A gap counts as occluded while at most this share of its visible places, and of the key frames that look
/// there, look through it, which is noise at the rims; and a step while more than this share of the key
/// frames that could show it do. With 0 one floor stays two planes (0.2 duplicates per room), with more two
/// desks become one.
pub(super) const MAX_THROUGH: f64 = 0.1;

/// The gap between two patches of one plane: the shortest ways between them, where they are nearest.
#[derive(Debug, Clone)]
pub(super) struct Gap {
    /// The ways from each cell of one patch to the nearest cell of the other. World frame, metres.
    ways: Vec<Way>,
    /// Side of the cells, metres.
    cell: f64,
    /// Places on each patch near the other one. World frame, metres.
    sides: [Vec<[f64; 3]>; 2],
    /// Where a wall that divides the patches stands across some of the shortest ways: the places off the
    /// surface where it would stand across the others if it went on. World frame, metres.
    passages: Vec<[f64; 3]>,
}

/// Start and end of a way.
type Way = [[f64; 3]; 2];

/// What a key frame sees between two patches of one plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) enum GapLook {
    /// Something nearer occludes the gap.
    Occluded,
    /// The key frame looks through the gap: nothing joins the patches.
    LookedThrough,
    /// The key frame reads one surface where both patches are, from so near that a step as high as others
    /// have shown would be larger than the noise.
    Joined,
    /// The key frame shows a step of this height, micrometres, between the patches: they are two surfaces,
    /// one before the other.
    Step(u32),
}

record_of_cases!(GapLook { 0 => Occluded, 1 => LookedThrough, 2 => Step(height), 3 => Joined });

impl Gap {
    /// The gap between two patches within a region; `None` when it is wider than `max_width` metres (to a
    /// cell of the patches).
    ///
    /// O(voxels of either patch in the region within `max_width` of the other's box, sorted), and at most
    /// 192^2 pairs of cells.
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
        let separates = |partition: &Partition, way: Way| {
            let [from, to] = way.map(|place| place.map(|c| c * voxel_size));
            partition.separates(from, to)
        };
        let ways_where = |is_clear: &dyn Fn(Way) -> bool| -> Vec<Way> {
            clear_ways(&of_a, &of_b, max_width / voxel_size, level, is_clear).collect()
        };
        let clear = ways_where(&|way| !partitions.iter().any(|partition| separates(partition, way)));
        let ways: Vec<Way> = clear
            .into_iter()
            .map(|[from, to]| {
                let from = foot_on(&a.plane, from.map(|c| c * voxel_size));
                [from, foot_on(&b.plane, to.map(|c| c * voxel_size))]
            })
            .collect();
        if ways.is_empty() {
            return None;
        }
        // Whether a wall between rooms goes on where it has not been seen, above a cupboard for example, is
        // asked where it parts the patches along their shortest ways.
        let shortest = if partitions.is_empty() { Vec::new() } else { ways_where(&|_| true) };
        let parts = |wall: &&Partition| {
            shortest.iter().any(|way| separates(wall, *way)) && wall.divides([a.patch, b.patch])
        };
        let mut passages = Vec::new();
        for wall in partitions.iter().filter(parts) {
            passages.extend(ways.iter().map(|way| wall.passage(*way, a.plane.normal())));
        }
        let side = |of: &[CoarseCell], plane: &Plane| {
            of.iter().map(|cell| foot_on(plane, cell.center(level).map(|c| c * voxel_size))).collect()
        };
        let sides = [side(&of_a, &a.plane), side(&of_b, &b.plane)];
        let cell = f64::from(1_u32 << level) * voxel_size;
        Some(Self { ways, cell, sides, passages })
    }

    /// Places on the shortest of the ways for which `is_asked` holds: on a selection of those at most a cell
    /// longer than the shortest, spread over all.
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

    /// What a depth image shows of the gap; `None` when it shows nothing of it: it does not look there, has
    /// no readings, sees the plane continue, sees the gap occluded together with most of one side, as by a
    /// wall before the next room, or does not see that a wall that divides the patches ends. Only ways in its
    /// view are checked, because which ways are shortest by less than a cell is chance. O(ways, places and
    /// passages), at most 192, 96 and 192 for each such wall, and 192 places on each side.
    pub(super) fn look(&self, view: &DepthView<'_>, camera_from_world: &Pose) -> Option<GapLook> {
        let look = |place| view.look_at_world(camera_from_world, place, 0.0).visibility;
        // Counts the places that show the plane, that are occluded, and that are looked through.
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
        let is_past_walls = || {
            self.passages.is_empty() || self.passages.iter().any(|place| look(*place) == Visibility::Absent)
        };
        (occluded > 0 && self.sides.iter().all(shows) && is_past_walls()).then_some(GapLook::Occluded)
    }
}

/// For each cell of one patch, the way to the nearest cell of the other to which the way is clear. In voxels.
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

/// The place at a fraction `part` of a way.
fn between([from, to]: &Way, part: f64) -> [f64; 3] {
    std::array::from_fn(|axis| from[axis] + part * (to[axis] - from[axis]))
}

#[cfg(test)]
mod tests {
    use dymlm_core::SensorModel;
    use dymlm_test_support::{Rectangle, World, look_at, small_camera};

    use super::*;
    use crate::PlaneMapConfig;
    use crate::association::Criterion;
    use crate::patches::VoxelLists;

    const VOXEL: f64 = 0.025;
    /// Half the thickness of the wall between the rooms.
    const HALF: f64 = 0.06;

    /// The voxels of a rectangle parallel to two of the axes, between two corners.
    fn rectangle([low, high]: [[f64; 3]; 2]) -> Patch {
        let steps = [0, 1, 2].map(|axis| ((high[axis] - low[axis]) / VOXEL).round() as usize);
        let at = |axis: usize, step: usize| low[axis] + VOXEL * step as f64;
        let places = (0..=steps[0]).flat_map(|i| (0..=steps[1]).map(move |j| [i, j]));
        let places = places.flat_map(|[i, j]| (0..=steps[2]).map(move |k| [at(0, i), at(1, j), at(2, k)]));
        Patch::of_points(places, VOXEL, &mut VoxelLists::default())
    }

    /// A plane across an axis, which faces low coordinates.
    fn finite(patch: &Patch, axis: usize, centroid: [f64; 3]) -> FinitePlane<'_> {
        let normal = [0, 1, 2].map(|own| -f64::from(u8::from(own == axis)));
        let plane = Plane::new(normal, centroid[axis]).unwrap();
        FinitePlane { plane, centroid, spread: [0.0; 6], patch }
    }

    /// What a camera in one of two rooms along x sees between their end walls, when the wall between the
    /// rooms is known up to a height. The end wall of the other room strays into the wall between them,
    /// almost to its near side, as readings in a corner do.
    fn look_between_rooms(known_height: f64, world: &World) -> Option<GapLook> {
        let ends =
            [rectangle([[-2.0, 3.0, 0.0], [0.05, 3.0, 2.3]]), rectangle([[0.07, 3.0, 0.0], [2.0, 3.0, 2.6]])];
        let [a, b] = [finite(&ends[0], 1, [-1.0, 3.0, 1.2]), finite(&ends[1], 1, [1.0, 3.0, 1.3])];
        let sides = [-HALF, HALF].map(|x| (x, rectangle([[x, 1.0, 0.0], [x, 2.95, known_height]])));
        let walls = sides.iter().map(|(x, patch)| finite(patch, 0, [*x, 2.0, 1.0]));
        let config = PlaneMapConfig::default();
        let (criterion, bounds) =
            (Criterion::new(&config.association, VOXEL), [&a, &b].map(|it| it.patch.bounds()));
        let region = criterion.near(&bounds[0]).intersection(&criterion.near(&bounds[1]));
        let partitions = criterion.partitions([&a, &b], &region, walls);
        let region = bounds[0].union(&bounds[1]);
        let width = config.association.max_occluded_gap;
        let gap = Gap::between(&a, &b, VOXEL, width, &region, &partitions)?;
        let (camera, view) = (small_camera(), look_at([1.2, 0.5, 1.4], [0.0, 3.0, 1.4]));
        let (depth, sensor) = (world.depth(&camera, &view), SensorModel::kinect());
        gap.look(&DepthView::new(&camera, &depth, &sensor), &view.inverse())
    }

    #[test]
    fn a_wall_known_in_part_parts_rooms_until_its_end_is_seen() {
        let end = Rectangle::upright([0.0, 3.0, 1.3], 2.0, 1.3);
        let wall = |height: f64| {
            let half_sides = [[0.0, 1.0, 0.0], [0.0, 0.0, 0.5 * height]];
            Rectangle { center: [HALF, 2.0, 0.5 * height], half_sides }
        };
        // Hides a part of the gap, above the low wall.
        let board = Rectangle::upright([0.0, 2.7, 1.9], 0.1, 0.3);
        let (high, low) = (World::of(&[end, wall(2.6), board]), World::of(&[end, wall(0.8), board]));
        assert_eq!(look_between_rooms(0.8, &high), None, "the wall goes on");
        assert_eq!(look_between_rooms(0.8, &low), Some(GapLook::Occluded), "the wall ends");
        assert_eq!(look_between_rooms(2.6, &high), None, "no clear way");
    }
}
