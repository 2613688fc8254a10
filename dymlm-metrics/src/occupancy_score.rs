use std::ops::RangeInclusive;

use dymlm_core::{ConfigError, DepthImage, Error, Frame, Mask, Point, Pose, check_range};
use kiddo::{ImmutableKdTree, SquaredEuclidean};

use crate::SpaceTruth;
use crate::free_space::FreeSpace;
use crate::nearest::OFF_SURFACE;

/// What a map of space holds a point to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Occupancy {
    /// Something is there.
    Occupied,
    /// Nothing is there.
    Free,
    /// Never seen.
    Unknown,
}

/// A cube of the world that a map holds occupied: a leaf of an octree, a voxel of a grid.
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
/// It watches the frames that a map is made of, to know what the map can know: space that no reading was seen
/// through and the inside of bodies are not scored. What is asked, for a map of cells of side r with the
/// diagonal D = sqrt(3) r:
///
/// - **Free space**: points along the rays to readings of static surfaces, before the exact surface, that at
///   least three frames looked through, and further than 6 cm + D from every static surface: no cell that
///   holds such a point has a reason to be occupied. -> [`FreeSpaceScore`]
/// - **Visible surface** ([`SpaceTruth::visible_points`]): covered when an occupied cell lies within D / 2 of
///   it. -> [`SurfaceScore`]
/// - **Occupied cells**, by volume: the distance of their centres to the nearest static surface; off it when
///   further than 6 cm + D / 2. -> [`OccupiedCellScore`]
///
/// Rays that end on movers are not looked along: a map that leaves movers out knows nothing of them.
///
/// Observing costs about 6 ms a frame whatever its size, scoring O(n log n) in the numbers of cells and
/// points, about a second for a room. Frames may be observed in any order, but which point of a cube is asked
/// for depends on it.
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
/// let truth = PointTruth::new(wall.map(|point| point.map(|c| c as f32)).collect(), &[], 0.1)?;
/// // A map that holds everything free has no ghosts, and no surface either.
/// let score = scorer.score(&truth, 0.05, &[], |_| Occupancy::Free)?;
/// assert_eq!(score.free_space.map(|s| (s.free, s.ghosts)), Some((1.0, 0.0)));
/// assert_eq!(score.surface.map(|s| (s.completeness, s.false_free)), Some((0.0, 1.0)));
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct OccupancyScorer {
    free_space: FreeSpace,
}

/// What [`OccupancyScorer::score`] finds.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct OccupancyScore {
    /// How the map holds space that is free; `None` when no frame looked through any.
    pub free_space: Option<FreeSpaceScore>,
    /// How the map holds surface that was seen; `None` when none was.
    pub surface: Option<SurfaceScore>,
    /// How far occupied cells are from surfaces; `None` when there are none.
    pub cells: Option<OccupiedCellScore>,
}

/// Shares of the free points by what the map holds them to be: `ghosts + stray + unknown + free` = 1.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct FreeSpaceScore {
    /// Held occupied, 0..=1: `ghosts + stray`.
    pub false_occupied: f64,
    /// Held occupied and in the volume swept by movers, 0..=1.
    pub ghosts: f64,
    /// Held occupied and outside the volume swept by movers, 0..=1.
    pub stray: f64,
    /// Unknown, 0..=1.
    pub unknown: f64,
    /// Held free, as they are, 0..=1.
    pub free: f64,
    /// Number of free points asked for.
    pub points: usize,
    /// Number of them in the volume swept by movers.
    pub swept_points: usize,
}

/// Shares of the visible surface points by what the map holds there: `completeness + false_free + unknown` =
/// 1.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SurfaceScore {
    /// With an occupied cell within half a cell's diagonal, 0..=1.
    pub completeness: f64,
    /// Without one, and held free, 0..=1: where a robot would run into something.
    pub false_free: f64,
    /// Without one, and not held free, 0..=1.
    pub unknown: f64,
    /// Number of visible surface points asked for.
    pub points: usize,
}

/// Distances of the occupied cells' centres to the nearest static surface. Each cell counts by its volume; a
/// cell larger than the smallest counts as so many of the smallest, as if it had not been pruned.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct OccupiedCellScore {
    /// Median of the distance, metres. That of a perfect map is about a fifth of the cells' side.
    pub median_distance: f64,
    /// 95 % quantile of the distance, metres.
    pub p95_distance: f64,
    /// Share of the volume off every surface and within the volume swept by movers, 0..=1.
    pub residue: f64,
    /// Share of the volume off every surface and outside the volume swept by movers, 0..=1.
    pub stray: f64,
    /// Occupied volume in smallest cells.
    pub cells: u64,
}

/// Most pieces along a side that a cell is taken apart into.
const MAX_SPLIT: u32 = 16;

impl OccupancyScorer {
    /// A scorer that has seen nothing, for readings within `depths`, metres: as far as maps use the sensor.
    pub fn new(depths: RangeInclusive<f32>) -> Self {
        Self { free_space: FreeSpace::new(depths) }
    }

    /// Notes which space a frame looks through: along rays to readings of static surface, as far as the
    /// reading or the exact depth, whichever is nearer. `movers` is `true` where a pixel shows a mover. Each
    /// frame is to be shown once.
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

    /// Scores a map whose smallest cells have the side `resolution`, metres, 0.001..=100: its `occupied`
    /// cells of any sizes, and what it holds the points of the world to be. Cells that are not finite or have
    /// no size are passed over; their order does not matter.
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

/// A cube of about the smallest size, and how many of the smallest fill it.
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

    /// Distance of a point to the cube; 0 within.
    fn distance(&self, point: Point) -> f32 {
        let beyond = |axis: usize| ((point[axis] - self.center[axis]).abs() - 0.5 * self.size).max(0.0);
        (0..3).map(|axis| beyond(axis) * beyond(axis)).sum::<f32>().sqrt()
    }
}

/// Takes pruned cells apart into smallest ones.
fn split(occupied: &[OccupiedCell], resolution: f64) -> Vec<Piece> {
    let mut pieces = Vec::with_capacity(occupied.len());
    for &OccupiedCell { center, size } in occupied {
        // A NaN fails every comparison.
        let is_cube = size > 0.0 && size < 1e9 && center.iter().all(|c| c.abs() < 1e9);
        if !is_cube {
            continue;
        }
        // Smallest cells along a side; huge cells into fewer pieces, of as many smallest cells each.
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
        ghosts: share(ghosts),
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

/// Which points have one of the cubes within `reach`.
fn covered(points: &[Point], pieces: &[Piece], reach: f32) -> Vec<bool> {
    let mut covered = vec![false; points.len()];
    let mut pieces = pieces.to_vec();
    pieces.sort_unstable_by(|a, b| a.size.total_cmp(&b.size));
    // A tree for each size, so that a few large cubes do not make every search wide.
    for of_size in pieces.chunk_by(|a, b| a.size == b.size) {
        let centers: Vec<Point> = of_size.iter().map(|piece| piece.center).collect();
        let Ok(tree) = ImmutableKdTree::<f32, 3>::new_from_slice(&centers) else { continue };
        let radius = of_size[0].half_diagonal() + reach;
        for (point, covered) in points.iter().zip(&mut covered).filter(|(_, covered)| !**covered) {
            let near =
                tree.query(point).within::<SquaredEuclidean<f32>>(radius * radius).unsorted().execute();
            *covered = near.iter().any(|found| of_size[found.item as usize].distance(*point) <= reach);
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

/// The smallest value that is not exceeded by `share` of the cells; the values ascend, each with its number
/// of cells.
fn quantile(ascending: &[(f32, u64)], total: u64, share: f64) -> Option<f64> {
    let wanted = (total as f64 * share).ceil() as u64;
    let mut passed = 0_u64;
    let reached = ascending.iter().find(|&&(_, cells)| {
        passed = passed.saturating_add(cells);
        passed >= wanted
    });
    reached.or(ascending.last()).map(|&(value, _)| value.into())
}
