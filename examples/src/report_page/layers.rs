use std::collections::HashSet;

use dymlm::cloud::Verdict;
use dymlm::core::{Point, PointCloud, Rgb};
use dymlm::octree::{Accessor, CellState, Leaf};
use dymlm::{CloudMap, Octree, Selection};
use serde::Serialize;

use super::lattice_places::LatticePlaces;
use super::point_thinning::thinned;
use super::section::section;

/// Most points that a browser draws without stutter and that keep a page below 15 MB.
const MOST_POINTS: usize = 1_000_000;
const MOST_CELLS: usize = 300_000;
const MOST_REMOVED: usize = 150_000;

/// A map as places that are packed into a section of the page.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Layer {
    /// The section's name.
    pub(super) section: &'static str,
    /// Number of places in the section.
    pub(super) count: usize,
    /// Number of places that the map has.
    of: usize,
    /// The place of key 0 0 0 in the world, metres.
    origin: [f64; 3],
    /// Metres from key to key.
    step: f64,
    /// Number of bytes for each place.
    channels: usize,
    /// Side of the voxel that a point represents, metres.
    point_size: f64,
    /// The packed places.
    #[serde(skip)]
    pub(super) packed: String,
}

impl Layer {
    fn new(section_name: &'static str, places: &LatticePlaces, of: usize, point_size: f64) -> Self {
        Self {
            section: section_name,
            count: places.keys.len(),
            of,
            origin: places.origin,
            step: places.step,
            channels: places.channels.len(),
            point_size,
            packed: section(places),
        }
    }
}

/// The points of the static cloud.
pub(super) fn cloud_layer(cloud: &PointCloud, voxel_size: f64) -> Layer {
    points_layer("cloud", cloud.points(), cloud.colors(), voxel_size, MOST_POINTS)
}

/// The voxels that the evidence has found to be ghosts: traces of movers, and flying pixels.
pub(super) fn removed_layer(cloud: &CloudMap) -> Layer {
    let voxels = cloud.voxels(Selection::All);
    let ghosts: Vec<Point> =
        voxels.filter(|voxel| voxel.verdict == Verdict::Ghost).map(|voxel| voxel.position).collect();
    points_layer("removed", &ghosts, None, cloud.config().voxel_size, MOST_REMOVED)
}

fn points_layer(
    name: &'static str,
    points: &[Point],
    colors: Option<&[Rgb]>,
    voxel_size: f64,
    most: usize,
) -> Layer {
    let thin = thinned(points, colors, voxel_size, most);
    let places = LatticePlaces::of_points(&thin.points, thin.colors.as_deref());
    Layer::new(name, &places, points.len(), thin.spacing)
}

/// The visible occupied leaves, by their lowest corners: leaves enclosed by others are left out. The channel
/// is the number of doublings from the smallest cell's side to the leaf's.
pub(super) fn octree_layer(octree: &Octree) -> Layer {
    let mut accessor = octree.accessor();
    let occupied = octree.leaves().filter(|leaf| leaf.state == CellState::Occupied);
    let mut of = 0;
    let mut cells = Vec::new();
    for leaf in occupied {
        of += 1;
        if !is_walled_in(&leaf, octree.resolution(), &mut accessor) {
            cells.push((leaf.key, DEPTH - leaf.depth.min(DEPTH)));
        }
    }
    let cells = at_most(cells, MOST_CELLS);
    let places = LatticePlaces {
        origin: [-octree.resolution() * f64::from(MIDDLE); 3],
        step: octree.resolution(),
        keys: cells.iter().map(|(key, _)| *key).collect(),
        channels: vec![cells.iter().map(|(_, level)| *level).collect()],
    };
    Layer::new("octree", &places, of, octree.resolution())
}

/// Depth of the smallest cells, and their key at the world's origin.
const DEPTH: u8 = 16;
const MIDDLE: u16 = 1 << 15;

/// Leaves of more cells along a side than this are always shown, without testing their surroundings.
const LARGE_SIDE: usize = 8;

/// Whether an occupied cell adjoins the leaf everywhere on its six sides.
fn is_walled_in(leaf: &Leaf, resolution: f64, accessor: &mut Accessor<'_>) -> bool {
    let side = (leaf.size / resolution).round() as usize;
    if side > LARGE_SIDE {
        return false;
    }
    let reach = 0.5 * (leaf.size + resolution);
    let offset = |cell: usize| (cell as f64 + 0.5) * resolution - 0.5 * leaf.size;
    (0..3).all(|axis| {
        [-reach, reach].into_iter().all(|out| {
            (0..side * side).all(|cell| {
                let mut place = leaf.center;
                place[axis] += out;
                place[(axis + 1) % 3] += offset(cell % side);
                place[(axis + 2) % 3] += offset(cell / side);
                accessor.state(place) == CellState::Occupied
            })
        })
    })
}

/// The cells (lowest corner, level), or if there are too many, the larger cells that contain them.
fn at_most(mut cells: Vec<([u16; 3], u8)>, most: usize) -> Vec<([u16; 3], u8)> {
    let mut level = 0;
    while cells.len() > most && level < DEPTH {
        level += 1;
        // The set only answers whether it holds a cell: its order does not affect the result.
        let mut taken = HashSet::with_capacity(cells.len());
        cells.retain_mut(|(key, own)| {
            if *own < level {
                *own = level;
                *key = key.map(|k| if level < DEPTH { k >> level << level } else { 0 });
            }
            taken.insert((*key, *own))
        });
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report_page::section::tests::unpacked;
    use dymlm::octree::OctreeConfig;

    /// A cube of occupied cells that begins at one index along each axis.
    fn block(first: usize, side: usize) -> Octree {
        let mut octree = Octree::new(OctreeConfig::default()).unwrap();
        let resolution = octree.resolution();
        for cell in 0..side * side * side {
            let place = [cell % side, cell / side % side, cell / side / side];
            octree.set_log_odds(place.map(|c| ((first + c) as f64 + 0.5) * resolution), Some(2.0));
        }
        octree
    }

    /// The lowest corner of the cells and their sides, as the page places them.
    fn cubes(layer: &Layer) -> Vec<([f64; 3], f64)> {
        let (keys, channels) = unpacked(&layer.packed, layer.count, 1);
        let corner =
            |key: &[u16; 3]| [0, 1, 2].map(|axis| layer.origin[axis] + f64::from(key[axis]) * layer.step);
        keys.iter()
            .zip(&channels[0])
            .map(|(key, &level)| (corner(key), layer.step * f64::from(1_u32 << level)))
            .collect()
    }

    #[test]
    fn cells_stand_where_the_octree_has_them() {
        let octree = block(0, 3);
        let layer = octree_layer(&octree);
        let mut shown: Vec<_> = cubes(&layer);
        let mut leaves: Vec<_> = octree
            .leaves()
            .filter(|leaf| leaf.state == CellState::Occupied)
            .map(|leaf| (leaf.center.map(|c| c - 0.5 * leaf.size), leaf.size))
            .collect();
        // A block of 3^3 cells: one visible leaf of 2^3 and single cells around it.
        assert_eq!((layer.of, leaves.len()), (20, 20));
        assert_eq!(shown.len(), 20);
        let order = |a: &([f64; 3], f64), b: &([f64; 3], f64)| a.0.partial_cmp(&b.0).unwrap();
        shown.sort_by(order);
        leaves.sort_by(order);
        for (shown, leaf) in shown.iter().zip(leaves) {
            assert!((shown.1 - leaf.1).abs() < 1e-9);
            assert!((0..3).all(|axis| (shown.0[axis] - leaf.0[axis]).abs() < 1e-9), "{shown:?} {leaf:?}");
        }
    }

    #[test]
    fn what_is_walled_in_is_left_out() {
        // Indices 3 to 8: a leaf of 4^3 cells, with single cells around it.
        let layer = octree_layer(&block(3, 6));
        assert_eq!((layer.of, layer.count), (153, 152));
        // With one cell removed, the leaf is visible.
        let mut opened = block(3, 6);
        let resolution = opened.resolution();
        opened.set_log_odds([5.5, 6.5, 3.5].map(|c| c * resolution), Some(-1.0));
        let layer = octree_layer(&opened);
        assert_eq!((layer.of, layer.count), (152, 152));
        assert_eq!(octree_layer(&Octree::new(OctreeConfig::default()).unwrap()).count, 0);
    }

    #[test]
    fn too_many_cells_become_larger_ones() {
        let cells: Vec<_> = (0..4096_u16).map(|c| ([c % 16, c / 16 % 16, c / 256], 0)).collect();
        assert_eq!(at_most(cells.clone(), 4096), cells);
        let larger = at_most(cells.clone(), 600);
        assert_eq!(larger.len(), 512);
        assert!(larger.iter().all(|(key, level)| *level == 1 && key.iter().all(|k| k % 2 == 0)));
        assert_eq!(at_most(cells, 0), [([0; 3], DEPTH)]);
    }

    #[test]
    fn an_empty_cloud_is_an_empty_layer() {
        let layer = cloud_layer(&PointCloud::default(), 0.01);
        assert_eq!((layer.count, layer.of), (0, 0));
        assert_eq!(unpacked(&layer.packed, 0, 0).0.len(), 0);
    }
}
