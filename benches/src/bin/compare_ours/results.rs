//! Result files, which the script compares with those of the other libraries.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use dymlm_core::Point;
use dymlm_geometry::Clusters;
use dymlm_octree::{CellState, Octree, RayEnd, RayHit};

use crate::Failure;

/// Labels: i32 each, -1 for noise.
pub(crate) fn write_labels(path: &Path, clusters: &Clusters) -> Result<(), Failure> {
    write(path, clusters.labels(), |label| label.map_or(-1, |label| label as i32).to_le_bytes())
}

/// Points: 3 f32 each.
pub(crate) fn write_points(path: &Path, points: &[Point]) -> Result<(), Failure> {
    write(path, points.as_flattened(), |coordinate| coordinate.to_le_bytes())
}

/// An octree: the number of its nodes and the bytes that it holds as u64, then for each leaf the key of its
/// lowest cell as 3 u16, its depth as u16 and its log-odds as f32.
pub(crate) fn write_leaves(path: &Path, map: &Octree) -> Result<(), Failure> {
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(&(map.counts().nodes as u64).to_le_bytes())?;
    file.write_all(&(map.memory_bytes() as u64).to_le_bytes())?;
    for leaf in map.leaves() {
        for number in [leaf.key[0], leaf.key[1], leaf.key[2], leaf.depth.into()] {
            file.write_all(&number.to_le_bytes())?;
        }
        file.write_all(&leaf.log_odds.to_le_bytes())?;
    }
    Ok(file.flush()?)
}

/// Ray casts: the centre of the occupied cell that was hit as 3 f32, NaN when none was hit.
pub(crate) fn write_hits(path: &Path, hits: &[Option<RayHit>]) -> Result<(), Failure> {
    let centers: Vec<Point> = hits
        .iter()
        .map(|hit| match hit {
            Some(hit) if hit.end == RayEnd::Occupied => hit.center.map(|coordinate| coordinate as f32),
            _ => [f32::NAN; 3],
        })
        .collect();
    write_points(path, &centers)
}

/// States of cells: u8 each, 0 unknown, 1 free, 2 occupied.
pub(crate) fn write_states(path: &Path, states: &[CellState]) -> Result<(), Failure> {
    write(path, states, |state| match state {
        CellState::Unknown => [0],
        CellState::Free => [1],
        CellState::Occupied => [2],
    })
}

/// Numbers: f64 each. A rectangle has its four corners; a box its centre, rotation by rows and full lengths;
/// a plane the number of its image, normal, offset, centroid and number of pixels; a solved pose graph the
/// number of steps, then for each pose its translation and quaternion x y z w.
pub(crate) fn write_numbers(path: &Path, numbers: &[f64]) -> Result<(), Failure> {
    write(path, numbers, |number| number.to_le_bytes())
}

fn write<T, const N: usize>(path: &Path, items: &[T], encode: impl Fn(&T) -> [u8; N]) -> Result<(), Failure> {
    let mut file = BufWriter::new(File::create(path)?);
    for item in items {
        file.write_all(&encode(item))?;
    }
    Ok(file.flush()?)
}
