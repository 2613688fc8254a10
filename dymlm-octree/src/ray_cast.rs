use crate::lattice::Key;
use crate::{Accessor, CellState, Octree};

/// How a ray or a [distance field](crate::DistanceField) treats cells never observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum UnknownCells {
    /// As free: a ray passes.
    Pass,
    /// As occupied: a ray ends there.
    Stop,
}

/// Why a ray ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum RayEnd {
    /// It met an occupied cell.
    Occupied,
    /// It met a cell never observed.
    Unknown,
    /// The next cell's centre is beyond the maximum range.
    MaxRange,
    /// It reached the border of the map.
    Border,
}

/// Where a ray ended.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RayHit {
    /// Why it ended.
    pub end: RayEnd,
    /// Centre of the cell it ended at, metres.
    pub center: [f64; 3],
    /// Distance from the origin to where the ray enters that cell, metres; 0 when the origin lies in it.
    pub distance: f64,
}

impl Octree {
    /// Follows a ray through free cells to the first occupied one. `direction` need not be of unit length;
    /// `max_range` in metres, infinite for no limit. `None` when the origin lies outside the map, or the
    /// direction is zero or not finite.
    ///
    /// Answers are those of OctoMap's `castRay`, to the cell. O(cells passed).
    ///
    /// ```
    /// use dymlm_octree::{Octree, OctreeConfig, RayEnd, UnknownCells};
    ///
    /// let mut map = Octree::new(OctreeConfig::default())?;
    /// map.insert_scan([0.0; 3], &[[2.01, 0.01, 0.01]])?;
    /// let hit = map.cast_ray([0.01; 3], [1.0, 0.0, 0.0], 5.0, UnknownCells::Stop).unwrap();
    /// assert_eq!(hit.end, RayEnd::Occupied);
    /// assert!((hit.distance - 1.99).abs() < 1e-6);
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn cast_ray(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        max_range: f64,
        unknown: UnknownCells,
    ) -> Option<RayHit> {
        self.accessor().cast_ray(origin, direction, max_range, unknown)
    }
}

impl Accessor<'_> {
    /// [`Octree::cast_ray`].
    pub fn cast_ray(
        &mut self,
        origin: [f64; 3],
        direction: [f64; 3],
        max_range: f64,
        unknown: UnknownCells,
    ) -> Option<RayHit> {
        let mut walk = Walk::new(self, origin, direction)?;
        // NaN becomes 0.
        let max_range = max_range.max(0.0);
        let surely_within = 0.999_999 * max_range - 2.0 * self.lattice.resolution;
        let end = loop {
            match (self.cell_state(walk.key), unknown) {
                (CellState::Occupied, _) => break RayEnd::Occupied,
                (CellState::Unknown, UnknownCells::Stop) => break RayEnd::Unknown,
                _ => {}
            }
            if !walk.step() {
                break RayEnd::Border;
            }
            // The centre of a cell is less than two cells from where the ray enters it.
            if walk.entered > surely_within && walk.distance_squared(self) > max_range * max_range {
                break RayEnd::MaxRange;
            }
        };
        let center = walk.key.map(|index| self.lattice.center(index));
        Some(RayHit { end, center, distance: walk.entered })
    }
}

/// The cells along a ray, with the arithmetic of OctoMap's `castRay`. (It differs from `computeRayKeys`,
/// which insertion uses, in where it rounds to single precision.)
struct Walk {
    origin: [f32; 3],
    key: Key,
    /// Distance along the ray at which it entered the cell.
    entered: f64,
    /// Distance along the ray to the next border, for each axis.
    next: [f64; 3],
    between: [f64; 3],
    up: [bool; 3],
}

impl Walk {
    fn new(accessor: &Accessor<'_>, origin: [f64; 3], direction: [f64; 3]) -> Option<Self> {
        let lattice = &accessor.lattice;
        let origin = origin.map(|coordinate| coordinate as f32);
        let key = lattice.key_f32(origin)?;
        let direction = normalized(direction)?;
        let mut walk =
            Self { origin, key, entered: 0.0, next: [f64::MAX; 3], between: [f64::MAX; 3], up: [true; 3] };
        for axis in 0..3 {
            let along = f64::from(direction[axis]);
            if along != 0.0 {
                walk.up[axis] = along > 0.0;
                let border = lattice.center(key[axis]) + along.signum() * lattice.resolution * 0.5;
                walk.next[axis] = (border - f64::from(origin[axis])) / along;
                walk.between[axis] = lattice.resolution / along.abs();
            }
        }
        Some(walk)
    }

    /// Enters the next cell; `false` at the border of the map.
    #[inline]
    fn step(&mut self) -> bool {
        let [x, y, z] = self.next;
        // OctoMap's order of comparisons decides ties.
        let axis = if x < y {
            if x < z { 0 } else { 2 }
        } else if y < z {
            1
        } else {
            2
        };
        match axis {
            0 => self.advance::<0>(),
            1 => self.advance::<1>(),
            _ => self.advance::<2>(),
        }
    }

    #[inline]
    fn advance<const AXIS: usize>(&mut self) -> bool {
        let index = self.key[AXIS];
        let index = if self.up[AXIS] { index.checked_add(1) } else { index.checked_sub(1) };
        let Some(index) = index else { return false };
        self.key[AXIS] = index;
        self.entered = self.next[AXIS];
        self.next[AXIS] += self.between[AXIS];
        true
    }

    /// Squared distance from the origin to the cell's centre.
    #[inline]
    fn distance_squared(&self, accessor: &Accessor<'_>) -> f64 {
        let center = accessor.lattice.center_f32(self.key);
        (0..3)
            .map(|axis| {
                let offset = center[axis] - self.origin[axis];
                f64::from(offset * offset)
            })
            .sum()
    }
}

/// A direction in single precision, of unit length; `None` when it has none.
fn normalized(direction: [f64; 3]) -> Option<[f32; 3]> {
    let largest = direction.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    if !(direction.iter().all(|value| value.is_finite()) && largest > 0.0) {
        return None;
    }
    // Lengths whose square would leave the range of single precision are scaled to about 1 first.
    let scale = if (1e-15..1e15).contains(&largest) { 1.0 } else { largest };
    let direction = direction.map(|value| (value / scale) as f32);
    let length = f64::from(direction.iter().map(|value| value * value).sum::<f32>()).sqrt() as f32;
    Some(direction.map(|value| value / length))
}
