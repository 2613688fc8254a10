mod fit;
mod minimal;
mod overlap;
mod polyhedron;

pub use fit::{BoxFit, OrientedBoxScratch, fit_oriented_box, fit_oriented_box_with};

use dymlm_core::Pose;

/// A box in space: the pose of its own frame, whose origin is the box's centre, and its lengths along that
/// frame's axes.
///
/// Boxes may be flat (a length of zero): they have corners and contain points, and volume zero.
///
/// ```
/// use dymlm_core::Pose;
/// use dymlm_geometry::OrientedBox;
///
/// let table = OrientedBox::new(Pose::identity(), [2.0, 1.0, 0.5])?;
/// let moved = OrientedBox::new(Pose::new([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])?, [2.0, 1.0, 0.5])?;
/// assert_eq!(table.volume(), 1.0);
/// assert_eq!(table.intersection_volume(&moved), 0.5);
/// assert_eq!(table.iou(&moved), 0.5 / 1.5);
/// assert!(table.contains([0.9, -0.4, 0.2]) && !table.contains([1.1, 0.0, 0.0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawBox", into = "RawBox"))]
pub struct OrientedBox {
    world_from_box: Pose,
    lengths: [f64; 3],
}

/// Full lengths that no box can have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("no box: full lengths {lengths:?} m, each must be within 0..={}", OrientedBox::MAX_LENGTH)]
#[non_exhaustive]
pub struct OrientedBoxError {
    /// The lengths given, metres.
    pub lengths: [f64; 3],
}

impl OrientedBox {
    /// Longest side of a box, metres: the volumes of all boxes are far from the limits of f64.
    pub const MAX_LENGTH: f64 = 1e15;

    /// A box centred on the origin of its frame, with its full lengths along that frame's axes, metres.
    ///
    /// # Errors
    ///
    /// [`OrientedBoxError`] when a length is negative, not finite or above [`MAX_LENGTH`](Self::MAX_LENGTH).
    pub fn new(world_from_box: Pose, lengths: [f64; 3]) -> Result<Self, OrientedBoxError> {
        if lengths.iter().all(|length| (0.0..=Self::MAX_LENGTH).contains(length)) {
            Ok(Self { world_from_box, lengths })
        } else {
            Err(OrientedBoxError { lengths })
        }
    }

    /// The box along the axes from one corner to the opposite one, metres.
    ///
    /// # Errors
    ///
    /// [`OrientedBoxError`] when `high` is below `low` on an axis, or the length there is not finite or above
    /// [`MAX_LENGTH`](Self::MAX_LENGTH).
    pub fn between(low: [f64; 3], high: [f64; 3]) -> Result<Self, OrientedBoxError> {
        let lengths = [0, 1, 2].map(|axis| high[axis] - low[axis]);
        let center = [0, 1, 2].map(|axis| f64::midpoint(low[axis], high[axis]));
        let frame = Pose::new(center, [0.0, 0.0, 0.0, 1.0]).map_err(|_| OrientedBoxError { lengths })?;
        Self::new(frame, lengths)
    }

    /// The smallest box along the axes around some boxes; `None` when there are none, or when they are too
    /// far apart.
    ///
    /// ```
    /// use dymlm_geometry::OrientedBox;
    ///
    /// let (near, far) = (OrientedBox::between([0.0; 3], [1.0; 3])?, OrientedBox::between([2.0; 3], [3.0; 3])?);
    /// assert_eq!(OrientedBox::around(&[near, far]), Some(OrientedBox::between([0.0; 3], [3.0; 3])?));
    /// # Ok::<(), dymlm_geometry::OrientedBoxError>(())
    /// ```
    pub fn around(boxes: &[Self]) -> Option<Self> {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in boxes.iter().flat_map(Self::corners) {
            for axis in 0..3 {
                low[axis] = low[axis].min(corner[axis]);
                high[axis] = high[axis].max(corner[axis]);
            }
        }
        Self::between(low, high).ok()
    }

    /// The box's frame: its origin is the centre, its axes run along the sides.
    #[inline]
    pub fn world_from_box(&self) -> Pose {
        self.world_from_box
    }

    /// Full lengths along the box's axes, metres.
    #[inline]
    pub fn lengths(&self) -> [f64; 3] {
        self.lengths
    }

    /// Centre, metres.
    #[inline]
    pub fn center(&self) -> [f64; 3] {
        self.world_from_box.translation()
    }

    /// Volume, cubic metres.
    #[inline]
    pub fn volume(&self) -> f64 {
        self.lengths.iter().product()
    }

    /// The eight corners; corner k lies on the positive side of axis i where bit i of k is set.
    pub fn corners(&self) -> [[f64; 3]; 8] {
        std::array::from_fn(|k| {
            let corner = std::array::from_fn(|axis| {
                if k >> axis & 1 == 1 { 0.5 * self.lengths[axis] } else { -0.5 * self.lengths[axis] }
            });
            self.world_from_box.transform_point(corner)
        })
    }

    /// Whether a point lies in the box or, to rounding, on its surface; a point that is not finite is
    /// outside.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        let local = self.world_from_box.inverse().transform_point(point);
        (0..3).all(|axis| local[axis].abs() <= 0.5 * self.lengths[axis])
    }

    /// The same box in the frame `a`, given in frame `b`.
    #[must_use]
    pub fn transformed(&self, a_from_b: &Pose) -> Self {
        Self { world_from_box: *a_from_b * self.world_from_box, lengths: self.lengths }
    }

    /// The box enlarged by a rim on every side, metres; a negative rim makes it smaller.
    ///
    /// ```
    /// use dymlm_core::Pose;
    /// use dymlm_geometry::OrientedBox;
    ///
    /// let table = OrientedBox::new(Pose::identity(), [1.5, 1.0, 0.25])?;
    /// assert_eq!(table.with_rim(0.5)?.lengths(), [2.5, 2.0, 1.25]);
    /// assert!(table.with_rim(-0.25).is_err());
    /// # Ok::<(), dymlm_geometry::OrientedBoxError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`OrientedBoxError`] when a length becomes negative, not finite or above
    /// [`MAX_LENGTH`](Self::MAX_LENGTH).
    pub fn with_rim(&self, rim: f64) -> Result<Self, OrientedBoxError> {
        Self::new(self.world_from_box, self.lengths.map(|length| length + 2.0 * rim))
    }
}

#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct RawBox {
    world_from_box: Pose,
    lengths: [f64; 3],
}

#[cfg(feature = "serde")]
impl TryFrom<RawBox> for OrientedBox {
    type Error = OrientedBoxError;

    fn try_from(raw: RawBox) -> Result<Self, OrientedBoxError> {
        Self::new(raw.world_from_box, raw.lengths)
    }
}

#[cfg(feature = "serde")]
impl From<OrientedBox> for RawBox {
    fn from(own: OrientedBox) -> Self {
        Self { world_from_box: own.world_from_box, lengths: own.lengths }
    }
}
