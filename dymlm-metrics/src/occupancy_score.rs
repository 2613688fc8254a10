use std::ops::RangeInclusive;

use dymlm_core::{ConfigError, DepthImage, Error, Frame, Mask, Point, Pose, check_range};
use dymlm_geometry::PointTree;

use crate::SpaceTruth;
use crate::free_space::FreeSpace;
use crate::nearest::OFF_SURFACE;

/// The state of a point in a map of space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Occupancy {
    /// The point is occupied.
    Occupied,
    /// The point is free.
    Free,
    /// The point was never observed.
    Unknown,
}

/// An occupied cube of a map: a leaf of an octree, a voxel of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OccupiedCell {
    /// Centre in the world, metres.
    pub center: [f64; 3],
    /// Side, metres.
    pub size: f64,
}

/// Scores a map of occupied, free and unknown space, such as an octree, against the exact truth.
///
/// It observes the frames from which the map is made, in order to know what the map can know: space that was
/// never looked through and the inside of bodies are not scored. A map with cells of side r and diagonal D =
/// sqrt(3) r is scored by:
///
/// - **Free space**: points on rays to readings of static surfaces, in front of the exact surface, that at
///   least three frames looked through, and further than 6 cm + D from every static surface: no cell that
///   contains such a point should be occupied. -> [`FreeSpaceScore`]
/// - **Visible surface** ([`SpaceTruth::visible_points`]): a point is covered when an occupied cell is within
///   D / 2 of it. -> [`SurfaceScore`]
/// - **Occupied cells**, by volume: the distance of their centres to the nearest static surface; a cell is
///   off the surface when this is more than 6 cm + D / 2. -> [`OccupiedCellScore`]
///
/// Rays that end on movers are not used: a map that leaves movers out knows nothing of them.
///
/// Observing costs about 6 ms per frame of any size, scoring O(n log n) in the numbers of cells and points,
/// about a second for a room. Frames may be observed in any order, but the order decides which point of a
/// cube is used.
///
/// ```
/// use dymlm_core::{DepthImage, Frame, Mask, PinholeCamera, Pose};
/// use dymlm_metrics::{Occupancy, OccupancyScorer, PointTruth};
///
/// // A wall 2 m away.
/// let camera = PinholeCamera::new(64, 48, 60.0, 60.0, 31.5, 23.5)?;
/// let depth = DepthImage::new(64, 48, vec![2.0; 64 * 48])?;
/// let frame = Frame::new(0.0, camera, depth.clone(), None)?;
/// let mut scorer = OccupancyScorer::new(0.5..=4.0);
/// for _ in 0..3 {
///     scorer.observe(&frame, &depth, &Mask::filled(64, 48, false)?, &Pose::identity())?;
/// }
/// let wall = (0..3072).map(|i| camera.back_project([(i % 64) as f64, (i / 64) as f64], 2.0));
/// // Somebody was half way to it.
/// let truth = PointTruth::new(wall.map(|point| point.map(|c| c as f32)).collect(), &[[0.0, 0.0, 1.0]], 0.1)?;
/// // A map that is free everywhere has no ghosts, and no surface either.
/// let score = scorer.score(&truth, 0.05, &[], |_| Occupancy::Free)?;
/// assert_eq!(score.free_space.map(|s| (s.free, s.ghosts)), Some((1.0, Some(0.0))));
/// assert_eq!(score.surface.map(|s| (s.completeness, s.false_free)), Some((0.0, 1.0)));
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct OccupancyScorer {
    free_space: FreeSpace,
}

/// The result of [`OccupancyScorer::score`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct OccupancyScore {
    /// The map's state in free space; `None` when no free space was looked through.
    pub free_space: Option<FreeSpaceScore>,
    /// The map's state at visible surface; `None` when there is none.
    pub surface: Option<SurfaceScore>,
    /// Distances of occupied cells from surfaces; `None` when there are no occupied cells.
    pub cells: Option<OccupiedCellScore>,
}

/// Shares of the free points by their state in the map: `false_occupied + unknown + free` = 1.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct FreeSpaceScore {
    /// Occupied in the map, 0..=1: `ghosts` of the swept points, and the stray ones.
    pub false_occupied: f64,
    /// Share of the swept points at which the map is occupied, 0..=1: of these alone, so that a large room
    /// has no fewer ghosts than a small one. `None` when no point is in the volume swept by movers.
    pub ghosts: Option<f64>,
    /// Occupied, and outside the volume swept by movers, 0..=1 of all free points.
    pub stray: f64,
    /// Unknown, 0..=1.
    pub unknown: f64,
    /// Free, which is correct, 0..=1.
    pub free: f64,
    /// Number of free points.
    pub points: usize,
    /// Number of free points in the volume swept by movers.
    pub swept_points: usize,
}

/// Shares of the visible surface points by the map's state there: `completeness + false_free + unknown` = 1.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SurfaceScore {
    /// Points with an occupied cell within half a cell's diagonal, 0..=1.
    pub completeness: f64,
    /// Points without such a cell and free in the map, 0..=1: a robot would collide there.
    pub false_free: f64,
    /// Points without such a cell and not free, 0..=1.
    pub unknown: f64,
    /// Number of visible surface points.
    pub points: usize,
}

/// Distances of the occupied cells' centres to the nearest static surface. Each cell counts by its volume: a
/// larger cell counts as the number of smallest cells that fill it, as if it had not been pruned.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct OccupiedCellScore {
    /// Median distance, metres. For a perfect map it is about a fifth of the cells' side.
    pub median_distance: f64,
    /// 95 % quantile of the distance, metres.
    pub p95_distance: f64,
    /// Share of the volume that is off every surface and in the volume swept by movers, 0..=1.
    pub residue: f64,
    /// Share of the volume that is off every surface and outside the volume swept by movers, 0..=1.
    pub stray: f64,
    /// Occupied volume, in smallest cells.
    pub cells: u64,
}

/// Largest number of pieces along a side into which a cell is divided.
const MAX_SPLIT: u32 = 16;

impl OccupancyScorer {
    /// A scorer without frames. It will use readings within `depths`, metres: the range that maps use.
    pub fn new(depths: RangeInclusive<f32>) -> Self {
        Self { free_space: FreeSpace::new(depths) }
    }

    /// Notes the space that a frame looks through: along rays to readings of static surface, up to the
    /// reading or the exact depth, whichever is nearer. `movers` is `true` where a pixel shows a mover. Each
    /// frame must be observed only once.
    ///
    /// # Errors
    ///
    /// [`Error::SizeMismatch`] when the images differ in size; nothing is noted.
    pub fn observe(
        &mut self,
        frame: &Frame,
        exact_depth: &DepthImage,
        movers: &Mask,
        world_from_camera: &Pose,
    ) -> Result<(), Error> {
        self.free_space.observe(frame, exact_depth, movers, world_from_camera)
    }

    /// Scores a map whose smallest cells have the side `resolution`, metres, 0.001..=100: by its `occupied`
    /// cells of any sizes, and by the state `occupancy_at` of any point. Cells that are not finite or have no
    /// size are ignored; their order does not matter.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when the resolution is outside its range.
    pub fn score(
        &self,
        truth: &impl SpaceTruth,
        resolution: f64,
        occupied: &[OccupiedCell],
        occupancy_at: impl FnMut(Point) -> Occupancy,
    ) -> Result<OccupancyScore, ConfigError> {
        check_range("resolution", resolution, 1e-3..=100.0)?;
        let mut occupancy_at = occupancy_at;
        let pieces = split(occupied, resolution);
        Ok(OccupancyScore {
            free_space: score_free_space(&self.free_space.points(), truth, resolution, &mut occupancy_at),
            surface: score_surface(&truth.visible_points(), &pieces, resolution, &mut occupancy_at),
            cells: score_cells(&pieces, truth),
        })
    }
}

/// A cube of about the smallest size, with the number of smallest cells that fill it.
#[derive(Debug, Clone, Copy)]
struct Piece {
    center: Point,
    size: f32,
    cells: u64,
}

impl Piece {
    fn half_diagonal(&self) -> f32 {
        0.5 * 3.0_f32.sqrt() * self.size
    }

    /// Distance of a point from the cube; 0 inside.
    fn distance(&self, point: Point) -> f32 {
        let beyond = |axis: usize| ((point[axis] - self.center[axis]).abs() - 0.5 * self.size).max(0.0);
        (0..3).map(|axis| beyond(axis) * beyond(axis)).sum::<f32>().sqrt()
    }
}

/// Divides pruned cells into smallest ones.
fn split(occupied: &[OccupiedCell], resolution: f64) -> Vec<Piece> {
    let mut pieces = Vec::with_capacity(occupied.len());
    for &OccupiedCell { center, size } in occupied {
        // NaN fails every comparison.
        let is_cube = size > 0.0 && size < 1e9 && center.iter().all(|c| c.abs() < 1e9);
        if !is_cube {
            continue;
        }
        // Number of smallest cells along a side. Huge cells are divided into fewer pieces of several smallest
        // cells each.
        let whole = (size / resolution).round().max(1.0) as u64;
        let count = (1..=MAX_SPLIT).rev().find(|&count| whole.is_multiple_of(u64::from(count))).unwrap_or(1);
        let cells = (whole / u64::from(count)).saturating_pow(3);
        let piece = size / f64::from(count);
        let first = center.map(|c| c - 0.5 * size + 0.5 * piece);
        for index in 0..count.pow(3) {
            let place = [index / (count * count), index / count % count, index % count];
            let center = std::array::from_fn(|axis| (first[axis] + f64::from(place[axis]) * piece) as f32);
            pieces.push(Piece { center, size: piece as f32, cells });
        }
    }
    pieces
}

fn score_free_space(
    seen_through: &[Point],
    truth: &impl SpaceTruth,
    resolution: f64,
    occupancy_at: &mut impl FnMut(Point) -> Occupancy,
) -> Option<FreeSpaceScore> {
    let clearance = OFF_SURFACE + (3.0_f64.sqrt() * resolution) as f32;
    let (mut points, mut swept_points) = (0, 0);
    let (mut ghosts, mut stray, mut unknown, mut free) = (0, 0, 0, 0);
    for &point in seen_through.iter().filter(|&&point| truth.surface_distance(point) > clearance) {
        let swept = truth.swept_by_movers(point);
        points += 1;
        swept_points += usize::from(swept);
        match occupancy_at(point) {
            Occupancy::Occupied if swept => ghosts += 1,
            Occupancy::Occupied => stray += 1,
            Occupancy::Unknown => unknown += 1,
            Occupancy::Free => free += 1,
        }
    }
    let share = |count: usize| count as f64 / points as f64;
    (points > 0).then(|| FreeSpaceScore {
        false_occupied: share(ghosts + stray),
        ghosts: (swept_points > 0).then(|| ghosts as f64 / swept_points as f64),
        stray: share(stray),
        unknown: share(unknown),
        free: share(free),
        points,
        swept_points,
    })
}

fn score_surface(
    visible: &[Point],
    pieces: &[Piece],
    resolution: f64,
    occupancy_at: &mut impl FnMut(Point) -> Occupancy,
) -> Option<SurfaceScore> {
    let covered = covered(visible, pieces, (0.5 * 3.0_f64.sqrt() * resolution) as f32);
    let mut bare = visible.iter().zip(&covered).filter(|&(_, &covered)| !covered).peekable();
    let (mut false_free, mut unknown) = (0, 0);
    for (&point, _) in &mut bare {
        match occupancy_at(point) {
            Occupancy::Free => false_free += 1,
            Occupancy::Occupied | Occupancy::Unknown => unknown += 1,
        }
    }
    let share = |count: usize| count as f64 / visible.len() as f64;
    (!visible.is_empty()).then(|| SurfaceScore {
        completeness: share(visible.len() - false_free - unknown),
        false_free: share(false_free),
        unknown: share(unknown),
        points: visible.len(),
    })
}

/// For each point, whether one of the cubes is within `reach`.
fn covered(points: &[Point], pieces: &[Piece], reach: f32) -> Vec<bool> {
    let mut covered = vec![false; points.len()];
    let mut pieces = pieces.to_vec();
    pieces.sort_unstable_by(|a, b| a.size.total_cmp(&b.size));
    // One tree for each size, so that a few large cubes do not widen every search.
    for of_size in pieces.chunk_by(|a, b| a.size == b.size) {
        let centers: Vec<Point> = of_size.iter().map(|piece| piece.center).collect();
        let tree = PointTree::new(&centers);
        let radius = of_size[0].half_diagonal() + reach;
        for (point, covered) in points.iter().zip(&mut covered).filter(|(_, covered)| !**covered) {
            let mut near = tree.within(*point, radius);
            *covered = near.any(|index| of_size[index].distance(*point) <= reach);
        }
    }
    covered
}

fn score_cells(pieces: &[Piece], truth: &impl SpaceTruth) -> Option<OccupiedCellScore> {
    let mut distances: Vec<(f32, u64)> =
        pieces.iter().map(|piece| (truth.surface_distance(piece.center), piece.cells)).collect();
    let (mut residue, mut stray, mut total) = (0_u64, 0_u64, 0_u64);
    for (piece, &(distance, cells)) in pieces.iter().zip(&distances) {
        total = total.saturating_add(cells);
        if distance <= OFF_SURFACE + piece.half_diagonal() {
            continue;
        }
        let class = if truth.swept_by_movers(piece.center) { &mut residue } else { &mut stray };
        *class = class.saturating_add(cells);
    }
    distances.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let share = |cells: u64| cells as f64 / total as f64;
    Some(OccupiedCellScore {
        median_distance: quantile(&distances, total, 0.50)?,
        p95_distance: quantile(&distances, total, 0.95)?,
        residue: share(residue),
        stray: share(stray),
        cells: total,
    })
}

/// The smallest value that `share` of the cells does not exceed. The values are ascending, each with its
/// number of cells.
fn quantile(ascending: &[(f32, u64)], total: u64, share: f64) -> Option<f64> {
    let wanted = (total as f64 * share).ceil() as u64;
    let mut passed = 0_u64;
    let reached = ascending.iter().find(|&&(_, cells)| {
        passed = passed.saturating_add(cells);
        passed >= wanted
    });
    reached.or(ascending.last()).map(|&(value, _)| value.into())
}
