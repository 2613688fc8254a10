use super::partition::Partition;
use crate::patches::{Patch, PatchVoxel, VoxelBox};
use crate::plane_frame::PlaneFrame;

/// Voxels in contact from which on patches adjoin, 20 cm of a rim at 2.5 cm, ...
const MOST_CONTACT: usize = 8;
/// ... or, for small patches, one out of this many of their voxels. In a long recording a few voxels stray
/// from any patch, for example over the gap between two screens.
const CONTACT_SHARE: usize = 10;

/// The conditions under which two patches touch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact<'a> {
    pub(super) voxel_size: f64,
    /// The plane onto which their voxels are projected.
    pub(super) frame: PlaneFrame,
    /// Largest gap between them, metres.
    pub(super) max_gap: f64,
    /// `max_gap` plus the distance of their voxels from the plane, in voxels.
    pub(super) reach: i32,
    /// The voxels that are compared.
    pub(super) region: &'a VoxelBox,
    /// The walls that stand between them.
    pub(super) partitions: &'a [Partition],
}

impl Contact<'_> {
    /// Whether two patches overlap on the plane or are separated by at most the gap (to a voxel): enough
    /// voxels of the one must be that near to the other. O(voxels in the region).
    pub(super) fn holds(&self, a: &Patch, b: &Patch) -> bool {
        let smaller = a.len().min(b.len());
        let contact = MOST_CONTACT.min(smaller.div_ceil(CONTACT_SHARE));
        let common = a.common_voxels(b, self.region).filter(|voxel| !self.is_beside_partition(*voxel));
        if contact > 0 && common.take(contact).count() == contact {
            return true;
        }
        let near = |patch: &Patch, other: &Patch| -> Vec<[i64; 2]> {
            let region = other.bounds().grown(self.reach).intersection(self.region);
            let voxels = patch.voxels_in(&region).filter(|voxel| !self.is_beside_partition(*voxel));
            voxels.map(|voxel| self.cell_of(voxel)).collect()
        };
        let (of_a, mut of_b) = (near(a, b), near(b, a));
        of_b.sort_unstable();
        of_b.dedup();
        contact > 0 && of_a.iter().filter(|cell| self.is_near(&of_b, **cell)).take(contact).count() == contact
    }

    /// Whether a voxel is beside a wall that stands between the patches.
    fn is_beside_partition(&self, voxel: PatchVoxel) -> bool {
        let center = voxel.center(self.voxel_size);
        self.partitions.iter().any(|partition| partition.separates(center, center))
    }

    /// The square cell of the plane, as large as a voxel, into which a voxel's centre falls.
    fn cell_of(&self, voxel: PatchVoxel) -> [i64; 2] {
        let at = self.frame.to_plane(voxel.center(self.voxel_size));
        at.map(|x| (x / self.voxel_size).floor() as i64)
    }

    /// Whether one of the sorted `cells` lies within the gap of a cell.
    fn is_near(&self, cells: &[[i64; 2]], [u, v]: [i64; 2]) -> bool {
        let reach = (self.max_gap / self.voxel_size).floor() as i64 + 1;
        let between = |a: i64| (a.abs() - 1).max(0) as f64 * self.voxel_size;
        (-reach..=reach).any(|du| {
            let from = cells.partition_point(|cell| *cell < [u + du, v - reach]);
            let column = cells[from..].iter().take_while(|cell| cell[0] == u + du && cell[1] <= v + reach);
            column.into_iter().any(|cell| between(du).hypot(between(cell[1] - v)) <= self.max_gap)
        })
    }
}
