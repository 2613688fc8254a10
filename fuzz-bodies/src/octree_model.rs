use std::collections::BTreeMap;

use dymlm_octree::{CellState, Octree, OctreeConfig};

use crate::choices::Choices;

/// Side of a cell, 0.25 m, so that indices are exact.
const CELL: f64 = 0.25;
/// Largest distance of the tested cells from the origin along each axis, in cells.
const REACH: i16 = 40;

type Cell = [i16; 3];

/// An octree and the contents that it should have, cell by cell. Rays are compared in the octree's own tests.
struct Pair {
    octree: Octree,
    cells: BTreeMap<Cell, f32>,
}

/// The constants of the octree's model, read from the octree itself.
struct Limits {
    least: f32,
    most: f32,
    hit: f32,
    miss: f32,
}

fn config() -> OctreeConfig {
    let mut config = OctreeConfig::default();
    config.resolution = CELL;
    config.max_range = 100.0;
    config
}

fn center(cell: Cell) -> [f64; 3] {
    cell.map(|index| (f64::from(index) + 0.5) * CELL)
}

fn limits() -> Limits {
    let mut octree = Octree::new(config()).unwrap();
    let mut clamped = |value: f32| {
        octree.set_log_odds([0.1; 3], Some(value));
        octree.log_odds([0.1; 3]).unwrap()
    };
    let (least, most) = (clamped(-1e9), clamped(1e9));
    let mut octree = Octree::new(config()).unwrap();
    octree.insert_scan([0.1; 3], &[[0.6, 0.1, 0.1]]).unwrap();
    let [hit, miss] = [[0.6, 0.1, 0.1], [0.1; 3]].map(|point| octree.log_odds(point).unwrap());
    Limits { least, most, hit, miss }
}

impl Pair {
    fn new() -> Self {
        Self { octree: Octree::new(config()).unwrap(), cells: BTreeMap::new() }
    }

    fn check(&self) {
        for (&cell, &log_odds) in &self.cells {
            assert_eq!(self.octree.log_odds(center(cell)), Some(log_odds), "{cell:?}");
        }
        let known: f64 = self.octree.leaves().map(|leaf| (leaf.size / CELL).round().powi(3)).sum();
        assert_eq!(known as usize, self.cells.len());
        let counts = self.octree.counts();
        assert_eq!(counts.leaves, self.octree.leaves().count());
        let occupied = self.octree.leaves().filter(|leaf| leaf.state == CellState::Occupied).count();
        assert_eq!(counts.occupied_leaves, occupied);
        assert_eq!(self.octree.is_empty(), self.cells.is_empty());
    }

    fn step(&mut self, choices: &mut Choices<'_>, other: &mut Self, limits: &Limits) {
        let mut cell = || -> Cell { [0; 3].map(|_| i16::from(choices.byte() % (2 * REACH as u8)) - REACH) };
        let (a, b) = (cell(), cell());
        match choices.below(9) {
            0 | 1 => {
                let value = (!choices.is_true()).then(|| choices.number() as f32);
                self.octree.set_log_odds(center(a), value);
                match value.filter(|value| !value.is_nan()) {
                    Some(value) => drop(self.cells.insert(a, value.clamp(limits.least, limits.most))),
                    None => drop(self.cells.remove(&a)),
                }
            }
            2 => {
                // A cube, aligned or not, which may give leaves of several cells.
                let side = 1 << choices.below(4);
                let corner = if choices.is_true() { a.map(|i| i.div_euclid(side) * side) } else { a };
                let value = f32::from(choices.below(5)) - 2.0;
                for i in 0..side.pow(3) {
                    let cell = [i % side, i / side % side, i / side / side];
                    let cell = std::array::from_fn(|axis| corner[axis] + cell[axis]);
                    self.octree.set_log_odds(center(cell), Some(value));
                    self.cells.insert(cell, value.clamp(limits.least, limits.most));
                }
            }
            3 => {
                // A reading in the sensor's own cell, and one along an axis.
                let length = i16::from(choices.below(30));
                let end = [a[0] + length, a[1], a[2]];
                let point = center(end).map(|c| c as f32);
                self.octree.insert_scan(center(a), &[point]).unwrap();
                for x in a[0]..=end[0] {
                    let change = if x == end[0] { limits.hit } else { limits.miss };
                    let value = self.cells.entry([x, a[1], a[2]]).or_insert(0.0);
                    *value = (*value + change).clamp(limits.least, limits.most);
                }
            }
            4 => {
                self.octree.merge(&other.octree).unwrap();
                for (&cell, &theirs) in &other.cells {
                    let sum = self.cells.get(&cell).map_or(theirs, |own| own + theirs);
                    self.cells.insert(cell, sum.clamp(limits.least, limits.most));
                }
            }
            5 => std::mem::swap(self, other),
            6 => {
                let mut file = Vec::new();
                self.octree.write_ot(&mut file).unwrap();
                self.octree = Octree::read_ot(file.as_slice(), config()).unwrap();
            }
            7 => {
                let (min, max): (Cell, Cell) =
                    (std::array::from_fn(|i| a[i].min(b[i])), std::array::from_fn(|i| a[i].max(b[i])));
                let around = [min, max].map(center);
                let freed = self.octree.free_cells([around], |_| true);
                let mut count = 0;
                for (cell, value) in &mut self.cells {
                    let is_in = (0..3).all(|i| (min[i]..=max[i]).contains(&cell[i]));
                    if is_in && *value >= 0.0 {
                        *value = limits.miss;
                        count += 1;
                    }
                }
                assert_eq!(freed, count);
            }
            _ => {
                let before = self.octree.clone();
                let far: [f64; 3] = choices.numbers();
                self.octree.set_log_odds(far.map(|c| c + 1e7), Some(1.0));
                let _ = self.octree.insert_scan(far, &[far.map(|c| c as f32)]);
                self.octree = before;
                let [x, y, z] = choices.numbers();
                let _ = self.octree.cast_ray(center(a), [x, y, z], 30.0, dymlm_octree::UnknownCells::Pass);
                if let Ok(grid) = self.octree.project([x, y, z], -3.0, 3.0) {
                    assert_eq!(grid.cells().len(), grid.width() * grid.height());
                }
            }
        }
    }
}

/// Random operations on two octrees, each compared with a map of single cells.
pub fn octree_model(bytes: &[u8]) {
    let limits = limits();
    let mut choices = Choices::new(bytes);
    let (mut pair, mut other) = (Pair::new(), Pair::new());
    for _ in 0..200 {
        if choices.is_over() {
            break;
        }
        pair.step(&mut choices, &mut other, &limits);
    }
    pair.check();
    other.check();
}
