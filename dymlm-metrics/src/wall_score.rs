use std::collections::BTreeMap;

use dymlm_core::PointCloud;
use dymlm_core::vector3::bounds;

use crate::nearest::is_finite;
use crate::{SpaceTruth, Spread, TrueFace};

/// Largest distance of a point from a face that it is a reading of, metres: this allows for the drift that
/// doubles walls. [`score_cloud`](crate::score_cloud) counts points farther off as stray.
const REACH: f64 = 0.3;
/// How much farther a point may be from the face than from the nearest surface, metres: this allows for the
/// spacing of measured surfaces ([`PointTruth`](crate::PointTruth) has points some 2 cm apart).
const TIE: f64 = 0.01;
/// Side of a tile, metres: so small that a bent wall is still thin within it.
const TILE: f64 = 0.5;
/// Least share of a tile that the face must fill.
const FILLED: f64 = 0.5;
/// Least number of points of a tile: with fewer, the 5 % quantile is a single point.
const FEWEST: usize = 20;
/// Side of the cubes in which faces are looked up, metres.
const CUBE: f64 = 0.5;

/// Thickness of the walls, floors and table tops of a cloud. A wall that was mapped twice, with a pose that
/// had drifted in between, is as thick as the distance between its two copies.
///
/// Each true face is divided into tiles of 50 cm. A point of the cloud belongs to the nearest face, by the
/// distance along the face's normal, among those whose outline it is above or below by at most 30 cm, unless
/// another surface is nearer (by more than 1 cm). The thickness of a tile is the range from the 5 % to the 95
/// % quantile of the signed distances of its points. Only tiles count of which the face fills at least half,
/// with at least 20 points.
///
/// So a copy shows up when it has 5 % of the points. Points of a copy that are nearer to another surface than
/// to their own belong to the other: with a partition of 10 cm, a displacement of at most 5 cm shows up.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct WallScore {
    /// Thickness over the tiles, metres; for a good cloud, 3.3 standard deviations of its noise.
    pub thickness: Spread,
    /// Number of tiles.
    pub tiles: usize,
}

/// A true face, to which points are assigned.
struct Wall<'a> {
    face: &'a TrueFace,
    tiles: BTreeMap<[usize; 2], Tile>,
}

/// What a face has of a tile.
struct Tile {
    /// The share of the tile that the face fills.
    filled: f64,
    /// Corners of the box around the centres of these cells.
    cells: [[f64; 3]; 2],
}

/// Scores the thickness of the walls of a cloud in the world frame; `None` when no tile has points.
///
/// O(n log n) in the number of points, and one query to the truth per point.
pub fn score_walls(
    cloud: &PointCloud,
    faces: &[TrueFace],
    truth: &(impl SpaceTruth + ?Sized),
) -> Option<WallScore> {
    let walls: Vec<Wall<'_>> = faces.iter().filter_map(Wall::of).collect();
    let near = walls_by_cube(&walls);
    let mut tiles: BTreeMap<(usize, [usize; 2]), Vec<f64>> = BTreeMap::new();
    for &point in cloud.points().iter().filter(|point| is_finite(point)) {
        let place = point.map(f64::from);
        let candidates = near.get(&cube_of(place)).map_or(&[][..], Vec::as_slice);
        let hits = candidates.iter().filter_map(|&index| Some((index, walls[index].hit(place)?)));
        let Some((index, hit)) = hits.min_by(|(_, a), (_, b)| a.height.abs().total_cmp(&b.height.abs()))
        else {
            continue;
        };
        if hit.height.abs() <= f64::from(truth.surface_distance(point)) + TIE {
            tiles.entry((index, hit.tile)).or_default().push(hit.height);
        }
    }
    let thick = tiles.into_iter().filter(|((index, tile), _)| walls[*index].fills(*tile));
    let thick: Vec<f64> = thick.filter_map(|(_, heights)| thickness(heights)).collect();
    let count = thick.len();
    Some(WallScore { thickness: Spread::of(thick)?, tiles: count })
}

/// A point's place relative to a face.
struct Hit {
    /// Metres along the normal.
    height: f64,
    tile: [usize; 2],
}

impl<'a> Wall<'a> {
    /// `None` for a face that fills no tile.
    fn of(face: &'a TrueFace) -> Option<Self> {
        let (raster, mut tiles) = (&face.cells.raster, BTreeMap::new());
        let inside = face.cells.inside.iter().enumerate().filter(|(_, inside)| **inside);
        for (cell, _) in inside {
            let center = raster.center(cell);
            let tile = tiles.entry(tile_of(raster.coordinates(center)));
            let tile = tile.or_insert(Tile { filled: 0.0, cells: [center; 2] });
            tile.filled += raster.cell_area() / (TILE * TILE);
            tile.cells = bounds(tile.cells.into_iter().chain([center]));
        }
        tiles.values().any(|tile| tile.filled >= FILLED).then_some(Self { face, tiles })
    }

    /// The cubes of space that hold points which may belong to the face, some of them several times.
    fn cubes(&self) -> impl Iterator<Item = [i64; 3]> {
        // From the centres of cells to their corners, and up and down; only tiles with a centre count.
        let beyond = REACH + self.face.cells.raster.cell_area().sqrt().min(TILE);
        self.tiles.values().flat_map(move |tile| {
            let [low, high] = tile.cells;
            let [low, high] = [low.map(|c| c - beyond), high.map(|c| c + beyond)].map(cube_of);
            let range = move |axis: usize| low[axis]..=high[axis];
            range(0).flat_map(move |x| range(1).flat_map(move |y| range(2).map(move |z| [x, y, z])))
        })
    }

    /// The place above or below the face; `None` when it is not above or below it, or too far away.
    fn hit(&self, place: [f64; 3]) -> Option<Hit> {
        let height = self.face.plane.signed_distance(place);
        if height.abs() > REACH {
            return None;
        }
        let raster = &self.face.cells.raster;
        let coordinates = raster.coordinates(place);
        let is_inside = self.face.cells.inside.get(raster.cell_at(coordinates)?).copied()?;
        is_inside.then(|| Hit { height, tile: tile_of(coordinates) })
    }

    fn fills(&self, tile: [usize; 2]) -> bool {
        self.tiles.get(&tile).is_some_and(|tile| tile.filled >= FILLED)
    }
}

/// The tile at coordinates on a face, metres, not negative.
fn tile_of(coordinates: [f64; 2]) -> [usize; 2] {
    coordinates.map(|c| (c / TILE) as usize)
}

fn cube_of(place: [f64; 3]) -> [i64; 3] {
    place.map(|c| (c / CUBE).floor() as i64)
}

/// For each cube of space, the walls whose points may be in it.
fn walls_by_cube(walls: &[Wall<'_>]) -> BTreeMap<[i64; 3], Vec<usize>> {
    let mut near: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for (index, wall) in walls.iter().enumerate() {
        for cube in wall.cubes() {
            let walls = near.entry(cube).or_default();
            if walls.last() != Some(&index) {
                walls.push(index);
            }
        }
    }
    near
}

/// The range from the 5 % to the 95 % quantile; `None` with too few points.
fn thickness(mut heights: Vec<f64>) -> Option<f64> {
    if heights.len() < FEWEST {
        return None;
    }
    heights.sort_unstable_by(f64::total_cmp);
    let rank = (heights.len() / 20).min(heights.len() - 1);
    Some(heights[heights.len() - 1 - rank] - heights[rank])
}

#[cfg(test)]
mod tests {
    use dymlm_core::{Plane, Point, SplitMix64};

    use super::*;
    use crate::PointTruth;

    /// A wall of 3 x 2 m at x = `x`, seen from greater x.
    fn wall(id: usize, x: f64) -> TrueFace {
        let outline = vec![[x, 0.0, 0.0], [x, 3.0, 0.0], [x, 3.0, 2.0], [x, 0.0, 2.0]];
        TrueFace::new(id, Plane::new([1.0, 0.0, 0.0], -x).unwrap(), vec![outline], 0.02).unwrap()
    }

    /// Points of a wall at x = `x`, with a noise of 5 mm.
    fn readings(x: f64, seed: u64) -> Vec<Point> {
        let mut random = SplitMix64::new(seed);
        let mut normal = || (0..12).map(|_| random.fraction()).sum::<f64>() - 6.0;
        let points = (0..150).flat_map(|i| (0..100).map(move |j| [0.02 * f64::from(i), 0.02 * f64::from(j)]));
        points.map(|[y, z]| [x + 0.005 * normal(), y, z].map(|c| c as f32)).collect()
    }

    fn truth(walls: &[f64]) -> PointTruth {
        let surface = walls.iter().flat_map(|&x| {
            (0..300).flat_map(move |i| (0..200).map(move |j| [x as f32, 0.01 * i as f32, 0.01 * j as f32]))
        });
        PointTruth::new(surface.collect(), &[], 0.1).unwrap()
    }

    fn score(points: Vec<Point>, walls: &[f64]) -> Option<WallScore> {
        let faces: Vec<TrueFace> = walls.iter().enumerate().map(|(id, &x)| wall(id, x)).collect();
        score_walls(&PointCloud::new(points), &faces, &truth(walls))
    }

    #[test]
    fn a_wall_is_as_thick_as_its_noise() {
        let score = score(readings(1.0, 1), &[1.0]).unwrap();
        assert_eq!(score.tiles, 24);
        // 2 * 1.645 standard deviations of 5 mm.
        assert!((score.thickness.median - 0.0164).abs() < 0.001, "{score:?}");
        assert!(score.thickness.p95 < 0.018, "{score:?}");
    }

    #[test]
    fn a_doubled_wall_is_as_thick_as_its_copies_are_apart() {
        for apart in [0.1, -0.1] {
            let doubled = [readings(1.0, 1), readings(1.0 + apart, 2)].concat();
            let score = score(doubled, &[1.0]).unwrap();
            // The distance of the copies, and the outer tenths of each copy.
            assert!((score.thickness.median - (0.1 + 2.0 * 1.28 * 0.005)).abs() < 0.003, "{score:?}");
        }
    }

    #[test]
    fn half_a_wall_that_is_doubled_shows_in_the_quantile() {
        let copy = readings(1.0 + 0.1, 2).into_iter().filter(|point| point[1] < 1.5);
        let score = score(readings(1.0, 1).into_iter().chain(copy).collect(), &[1.0]).unwrap();
        assert!(score.thickness.median < 0.02 && score.thickness.p95 > 0.1, "{score:?}");
    }

    #[test]
    fn points_are_of_the_nearest_surface() {
        // Two walls 20 cm apart; then only the first, with the other as a surface that is not a wall.
        let both = [readings(1.0, 1), readings(1.2, 2)].concat();
        let two = score(both.clone(), &[1.0, 1.2]).unwrap();
        assert!(two.thickness.p95 < 0.02 && two.tiles == 48, "{two:?}");
        let faces = [wall(0, 1.0)];
        let one = score_walls(&PointCloud::new(both), &faces, &truth(&[1.0, 1.2])).unwrap();
        assert!(one.thickness.p95 < 0.02 && one.tiles == 24, "{one:?}");
    }

    /// A face of a thousand kilometres with coarse cells: its box is not walked through cube by cube.
    #[test]
    fn a_face_costs_what_its_tiles_do() {
        let far = 1e6;
        let outline = vec![[1.0, 0.0, 0.0], [1.0, far, 0.0], [1.0, far, far], [1.0, 0.0, far]];
        let plane = Plane::new([1.0, 0.0, 0.0], -1.0).unwrap();
        let face = TrueFace::new(0, plane, vec![outline], 1e-2 * far).unwrap();
        assert_eq!(score_walls(&PointCloud::new(readings(1.0, 1)), &[face], &truth(&[1.0])), None);
    }

    #[test]
    fn without_points_or_faces_there_is_no_thickness() {
        assert_eq!(score(Vec::new(), &[1.0]), None);
        assert_eq!(score(readings(5.0, 1), &[1.0]), None);
        assert_eq!(score(vec![[f32::NAN; 3]; 100], &[1.0]), None);
        assert_eq!(score_walls(&PointCloud::new(readings(1.0, 1)), &[], &truth(&[1.0])), None);
    }
}
