use dymlm_core::vector3::boxes_touch;
use dymlm_core::{Point, Pose};

/// Bits of a voxel coordinate in a key.
const BITS: u32 = 21;
const HALF: i64 = 1 << (BITS - 1);

/// The voxels of a plane's inliers with the number of samples in each, in the order of their keys. Counts add
/// up and can be taken out again.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Patch {
    voxels: Vec<PatchVoxel>,
}

/// An axis-aligned box of voxels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    min: [i32; 3],
    max: [i32; 3],
    voxel_size: f64,
}

impl Bounds {
    /// Whether the box shares something with that from `min` to `max`, metres.
    pub(crate) fn overlaps(&self, other: [[f64; 3]; 2]) -> bool {
        let corner = |voxel: [i32; 3]| voxel.map(|c| f64::from(c) * self.voxel_size);
        boxes_touch([corner(self.min), corner(self.max)], other)
    }

    /// Distance between two boxes, metres; vast when one is empty.
    pub(crate) fn distance(&self, other: &Self) -> f64 {
        let mut squares = 0.0;
        for axis in 0..3 {
            let gap = (i64::from(self.min[axis]) - i64::from(other.max[axis]))
                .max(i64::from(other.min[axis]) - i64::from(self.max[axis]));
            let gap = (gap - 1).max(0) as f64 * self.voxel_size;
            squares += gap * gap;
        }
        squares.sqrt()
    }
}

/// A cube of 2^level voxels a side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct CoarseCell([i32; 3]);

impl CoarseCell {
    /// The cells of twice the size that hold some cells.
    pub(crate) fn double(cells: &mut Vec<Self>) {
        for cell in cells.iter_mut() {
            cell.0 = cell.0.map(|c| c >> 1);
        }
        cells.sort_unstable();
        cells.dedup();
    }

    /// Centre, in voxels.
    pub(crate) fn center(self, level: u32) -> [f64; 3] {
        self.0.map(|c| (f64::from(c) + 0.5) * f64::from(1_u32 << level))
    }

    /// Square of the distance between two centres, in cells.
    pub(crate) fn square_distance(self, other: Self) -> i64 {
        (0..3).map(|axis| i64::from(self.0[axis] - other.0[axis]).pow(2)).sum()
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PatchVoxel {
    key: u64,
    count: u32,
}

impl PatchVoxel {
    /// Lattice coordinates.
    pub(crate) fn cell(self) -> [i32; 3] {
        let mask = (1_u64 << BITS) - 1;
        [self.key >> (2 * BITS), self.key >> BITS, self.key].map(|part| ((part & mask) as i64 - HALF) as i32)
    }

    /// Centre, metres.
    pub(crate) fn center(self, voxel_size: f64) -> [f64; 3] {
        self.cell().map(|c| (f64::from(c) + 0.5) * voxel_size)
    }

    /// Samples in it.
    pub(crate) fn count(self) -> u32 {
        self.count
    }
}

/// How far voxels reach from the origin, metres.
pub(crate) fn reach(voxel_size: f64) -> f64 {
    (HALF - 1) as f64 * voxel_size
}

fn key(cell: [i64; 3]) -> u64 {
    cell.iter().fold(0, |key, c| key << BITS | (c + HALF).clamp(0, 2 * HALF - 1) as u64)
}

impl Patch {
    /// The voxels of some samples; not finite ones are passed over.
    pub(crate) fn of_samples(samples: &[Point], world_from_camera: &Pose, voxel_size: f64) -> Self {
        let scale = 1.0 / voxel_size;
        let rotation = world_from_camera.rotation_matrix();
        let translation = world_from_camera.translation();
        let mut keys: Vec<u64> = samples
            .iter()
            .map(|sample| sample.map(f64::from))
            .filter(|sample| sample.iter().all(|x| x.is_finite()))
            .map(|[x, y, z]| {
                key(std::array::from_fn(|axis| {
                    let [a, b, c] = rotation[axis];
                    ((a * x + b * y + c * z + translation[axis]) * scale).floor() as i64
                }))
            })
            .collect();
        keys.sort_unstable();
        let voxels = keys
            .chunk_by(|a, b| a == b)
            .map(|run| PatchVoxel { key: run[0], count: run.len() as u32 })
            .collect();
        Self { voxels }
    }

    pub(crate) fn voxels(&self) -> &[PatchVoxel] {
        &self.voxels
    }

    /// Adds the counts of another patch. O(n).
    pub(crate) fn add(&mut self, other: &Self) {
        if other.voxels.is_empty() {
            return;
        }
        let mut sum = Vec::with_capacity(self.voxels.len() + other.voxels.len());
        let (mut ours, mut theirs) = (self.voxels.iter().peekable(), other.voxels.iter().peekable());
        loop {
            match (ours.peek(), theirs.peek()) {
                (Some(a), Some(b)) if a.key == b.key => {
                    sum.push(PatchVoxel { key: a.key, count: a.count.saturating_add(b.count) });
                    ours.next();
                    theirs.next();
                }
                (Some(a), Some(b)) if a.key > b.key => sum.extend(theirs.next()),
                (Some(_), _) => sum.extend(ours.next()),
                (None, Some(_)) => sum.extend(theirs.next()),
                (None, None) => break,
            }
        }
        self.voxels = sum;
    }

    /// Takes the counts of a patch out that was added before. O(n).
    pub(crate) fn subtract(&mut self, other: &Self) {
        let mut theirs = other.voxels.iter().peekable();
        self.voxels.retain_mut(|voxel| {
            while theirs.next_if(|other| other.key < voxel.key).is_some() {}
            if let Some(other) = theirs.next_if(|other| other.key == voxel.key) {
                voxel.count = voxel.count.saturating_sub(other.count);
            }
            voxel.count > 0
        });
    }

    /// The same samples, moved. Voxels are moved by their centres.
    pub(crate) fn moved(&self, new_from_old: &Pose, voxel_size: f64) -> Self {
        let mut moved: Vec<PatchVoxel> = self
            .voxels
            .iter()
            .map(|voxel| {
                let center = new_from_old.transform_point(voxel.center(voxel_size));
                PatchVoxel { key: key(center.map(|c| (c / voxel_size).floor() as i64)), count: voxel.count }
            })
            .collect();
        moved.sort_unstable_by_key(|voxel| voxel.key);
        let voxels = moved
            .chunk_by(|a, b| a.key == b.key)
            .map(|run| {
                let count = run.iter().fold(0_u32, |sum, voxel| sum.saturating_add(voxel.count));
                PatchVoxel { key: run[0].key, count }
            })
            .collect();
        Self { voxels }
    }

    /// The cells of 2^level voxels a side that hold voxels within `reach` voxels of a box, each once, in a
    /// fixed order. O(n) and sorting what is found.
    pub(crate) fn coarse_cells_near(&self, bounds: &Bounds, reach: i32, level: u32) -> Vec<CoarseCell> {
        let mut cells: Vec<CoarseCell> = Vec::new();
        let min = bounds.min.map(|c| c.saturating_sub(reach));
        let max = bounds.max.map(|c| c.saturating_add(reach));
        let from = self.voxels.partition_point(|voxel| voxel.cell()[0] < min[0]);
        for voxel in self.voxels[from..].iter().map(|voxel| voxel.cell()).take_while(|cell| cell[0] <= max[0])
        {
            if (1..3).all(|axis| (min[axis]..=max[axis]).contains(&voxel[axis])) {
                let cell = CoarseCell(voxel.map(|c| c >> level));
                if cells.last() != Some(&cell) {
                    cells.push(cell);
                }
            }
        }
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// Keeps the voxels that are wanted.
    pub(crate) fn retain(&mut self, is_wanted: impl Fn(&PatchVoxel) -> bool) {
        self.voxels.retain(is_wanted);
    }

    /// Number of voxels that two patches have in common, counted up to `most`. O(n).
    pub(crate) fn common_voxels(&self, other: &Self, most: usize) -> usize {
        let mut common = 0;
        let (mut ours, mut theirs) = (self.voxels.iter().peekable(), other.voxels.iter().peekable());
        while let (Some(a), Some(b)) = (ours.peek(), theirs.peek()) {
            match a.key.cmp(&b.key) {
                std::cmp::Ordering::Equal => {
                    common += 1;
                    if common >= most {
                        break;
                    }
                    ours.next()
                }
                std::cmp::Ordering::Less => ours.next(),
                std::cmp::Ordering::Greater => theirs.next(),
            };
        }
        common
    }

    /// Whether there is a voxel at a point or beside it.
    pub(crate) fn is_near(&self, point: [f64; 3], voxel_size: f64) -> bool {
        let [x, y, z] = point.map(|x| ((x / voxel_size).floor() as i64).clamp(-HALF, HALF));
        (-1..=1).any(|dx| {
            (-1..=1).any(|dy| {
                let [first, last] = [-1, 1].map(|dz| key([x + dx, y + dy, z + dz]));
                let from = self.voxels.partition_point(|voxel| voxel.key < first);
                self.voxels.get(from).is_some_and(|voxel| voxel.key <= last)
            })
        })
    }

    /// The box around the voxels. O(n).
    pub(crate) fn bounds(&self, voxel_size: f64) -> Bounds {
        let mut bounds = Bounds { min: [i32::MAX; 3], max: [i32::MIN; 3], voxel_size };
        for voxel in &self.voxels {
            for (axis, c) in voxel.cell().into_iter().enumerate() {
                bounds.min[axis] = bounds.min[axis].min(c);
                bounds.max[axis] = bounds.max[axis].max(c);
            }
        }
        bounds
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.voxels.capacity() * size_of::<PatchVoxel>()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn patch(points: &[[f32; 3]]) -> Patch {
        Patch::of_samples(points, &Pose::identity(), 0.1)
    }

    #[test]
    fn keys_keep_cells() {
        let patch = patch(&[[-0.05, 0.25, 1000.0], [f32::NAN, 0.0, 0.0]]);
        assert_eq!(patch.voxels().len(), 1);
        assert_eq!(patch.voxels()[0].cell(), [-1, 2, 10000]);
        let center = patch.voxels()[0].center(0.1);
        assert!((center[0] + 0.05).abs() < 1e-12 && (center[2] - 1000.05).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn what_was_added_can_be_taken_out(
            a in prop::collection::vec(prop::array::uniform3(-0.5..0.5_f32), 0..60),
            b in prop::collection::vec(prop::array::uniform3(-0.5..0.5_f32), 0..60),
        ) {
            let (a, b) = (patch(&a), patch(&b));
            let mut sum = a.clone();
            sum.add(&b);
            let mut other_way = b.clone();
            other_way.add(&a);
            prop_assert_eq!(&sum, &other_way);
            prop_assert!(sum.voxels().is_sorted_by_key(|voxel| voxel.key));
            sum.subtract(&b);
            prop_assert_eq!(&sum, &a);
            let shared = a.voxels().iter().filter(|v| b.voxels().iter().any(|w| w.key == v.key)).count();
            prop_assert_eq!(a.common_voxels(&b, usize::MAX), shared);
            prop_assert_eq!(a.common_voxels(&b, 2), shared.min(2));
        }
    }
}
