use dymlm_core::vector3::{difference, dot};

use crate::{Error, Extent, Leaf};

/// A rectangle in the axes of a grid, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GridRegion {
    /// Lower corner, x and y.
    pub min: [f64; 2],
    /// Upper corner.
    pub max: [f64; 2],
}

impl GridRegion {
    /// The smallest region that holds both.
    #[must_use]
    pub fn united(&self, other: &Self) -> Self {
        Self {
            min: [0, 1].map(|axis| self.min[axis].min(other.min[axis])),
            max: [0, 1].map(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        let Self { min, max } = *self;
        let is_region = (0..2).all(|axis| min[axis] <= max[axis] && (max[axis] - min[axis]).is_finite());
        if is_region { Ok(()) } else { Err(Error::GridRegion { min, max }) }
    }
}

/// The cells of a grid that a region needs: their indices along x and y, 0 for the cell whose lower corner is
/// the origin of the grid's axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct GridCells {
    pub(super) first: [i64; 2],
    /// One past the last cell.
    pub(super) end: [i64; 2],
}

impl GridCells {
    pub(super) fn of(region: &GridRegion, resolution: f64) -> Self {
        // Shrunk by 1e-6 cells, so that rounding adds no row.
        let first = region.min.map(|c| (c / resolution + 1e-6).floor() as i64);
        let end = region.max.map(|c| (c / resolution - 1e-6).ceil() as i64);
        let cells = Self { first, end };
        if cells.size().contains(&0) { Self::default() } else { cells }
    }

    pub(super) fn size(&self) -> [u64; 2] {
        [0, 1].map(|axis| self.end[axis].saturating_sub(self.first[axis]).max(0) as u64)
    }

    pub(super) fn united(&self, other: &Self) -> Self {
        match (self.size(), other.size()) {
            ([0, _], _) => *other,
            (_, [0, _]) => *self,
            _ => Self {
                first: [0, 1].map(|axis| self.first[axis].min(other.first[axis])),
                end: [0, 1].map(|axis| self.end[axis].max(other.end[axis])),
            },
        }
    }
}

/// A box of the world in the grid's axes: its centre and half its extent along x, y and up.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shadow {
    center: [f64; 3],
    half: [f64; 3],
}

impl Shadow {
    fn of(center: [f64; 3], sides: [f64; 3], axes: [[f64; 3]; 3]) -> Self {
        Self {
            center: axes.map(|axis| dot(axis, center)),
            half: axes.map(|axis| 0.5 * dot(axis.map(f64::abs), sides)),
        }
    }

    pub(super) fn of_leaf(leaf: &Leaf, axes: [[f64; 3]; 3]) -> Self {
        Self::of(leaf.center, [leaf.size; 3], axes)
    }

    pub(super) fn of_box(region: &Extent, axes: [[f64; 3]; 3]) -> Self {
        let Extent { min, max } = region;
        let center = std::array::from_fn(|axis| 0.5 * (min[axis] + max[axis]));
        Self::of(center, difference(*max, *min), axes)
    }

    pub(super) fn is_between(&self, [lowest, highest]: [f64; 2]) -> bool {
        self.center[2] + self.half[2] > lowest && self.center[2] - self.half[2] < highest
    }

    pub(super) fn region(&self) -> GridRegion {
        GridRegion {
            min: [0, 1].map(|axis| self.center[axis] - self.half[axis]),
            max: [0, 1].map(|axis| self.center[axis] + self.half[axis]),
        }
    }
}
