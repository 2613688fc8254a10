use std::array::from_fn;

use super::cell_box::CellBox;
use super::transform::{Transform, cells_within};
use crate::{Error, Extent, Octree, UnknownCells};

/// Distances to the nearest obstacle in a box of the world, with their gradients: what trajectory optimizers
/// query thousands of times ([`Octree::distance_field`]).
///
/// An obstacle is the centre of an occupied cell; on [request](UnknownCells::Stop) also the centre of a cell
/// never observed. Obstacles outside the box count too. Distances are exact at the centres of cells, up to
/// the greatest distance asked for; between the centres they are interpolated trilinearly, which changes them
/// by less than 0.87 cells. The nearest face of an obstacle's cell is nearer than its centre by half a cell
/// to 0.87 cells.
///
/// The field is a snapshot: it does not follow the octree. [`update`](Self::update) computes it again in the
/// same memory.
#[derive(Debug, Clone)]
pub struct DistanceField {
    region: Extent,
    resolution: f64,
    max_distance: f64,
    /// The cells with a distance: those of the region, and those that interpolation at its border needs.
    cells: CellBox,
    /// Distance of each cell, metres, x fastest.
    distances: Vec<f32>,
    transform: Transform,
}

/// The distance to the nearest obstacle, and its gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Clearance {
    /// Distance to the nearest obstacle, metres, at most the field's `max_distance`.
    pub distance: f64,
    /// Derivative of the distance along x, y, z: it points away from the obstacle and has a length of about
    /// 1; it is 0 where no obstacle is within `max_distance`, and inside an obstacle of several cells.
    pub gradient: [f64; 3],
}

impl Octree {
    /// Distances to the nearest obstacle, up to `max_distance` metres, at all places of a region (world,
    /// metres).
    ///
    /// O(cells within `max_distance` of the region): 8 ms for a region of 4 x 4 x 2 m, a `max_distance` of
    /// 0.5 m and cells of 5 cm.
    ///
    /// # Errors
    ///
    /// [`Error::MaxDistance`] when `max_distance` is not positive; [`Error::Region`] when a corner is not
    /// finite or 1e9 cells away, when `max` is below `min`, and when the region grown by `max_distance` has
    /// more than [`DistanceField::MAX_CELLS`].
    ///
    /// ```
    /// use dymlm_octree::{Extent, Octree, OctreeConfig, UnknownCells};
    ///
    /// let mut map = Octree::new(OctreeConfig::default())?;
    /// map.insert_scan([0.0; 3], &[[2.025, 0.025, 0.025]])?;
    /// let region = Extent { min: [0.0, -1.0, 0.0], max: [2.0, 1.0, 0.5] };
    /// let field = map.distance_field(region, 1.0, UnknownCells::Pass)?;
    ///
    /// let near = field.at([1.525, 0.025, 0.025]).ok_or("in the region")?;
    /// assert!((near.distance - 0.5).abs() < 1e-6 && (near.gradient[0] + 1.0).abs() < 1e-6);
    /// assert_eq!(field.at([0.5, 0.5, 0.1]).map(|far| far.distance), Some(1.0));
    /// assert_eq!(field.at([3.0, 0.0, 0.0]), None);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[doc(alias = "esdf")]
    pub fn distance_field(
        &self,
        region: Extent,
        max_distance: f64,
        unknown: UnknownCells,
    ) -> Result<DistanceField, Error> {
        let mut field = DistanceField {
            region,
            resolution: self.resolution(),
            max_distance,
            cells: CellBox::default(),
            distances: Vec::new(),
            transform: Transform::default(),
        };
        field.update(self, region, max_distance, unknown)?;
        Ok(field)
    }
}

impl DistanceField {
    /// Greatest number of cells of a region grown by `max_distance` on all sides.
    pub const MAX_CELLS: u64 = 1 << 27;

    /// Computes the field again, for any octree and region; it allocates nothing once its buffers have grown.
    /// See [`Octree::distance_field`].
    ///
    /// # Errors
    ///
    /// As [`Octree::distance_field`]; the field stays as it was.
    pub fn update(
        &mut self,
        map: &Octree,
        region: Extent,
        max_distance: f64,
        unknown: UnknownCells,
    ) -> Result<(), Error> {
        if max_distance.is_nan() || max_distance <= 0.0 {
            return Err(Error::MaxDistance { max_distance });
        }
        let resolution = map.resolution();
        let refused = || Error::Region { min: region.min, max: region.max, max_distance };
        let cells = CellBox::around(&region, resolution).ok_or_else(refused)?;
        let reach = cells_within(max_distance, resolution).ok_or_else(refused)?;
        let around =
            cells.grown(reach).filter(|around| around.len() <= Self::MAX_CELLS).ok_or_else(refused)?;
        self.transform.find_obstacles(map, &around, unknown);
        self.transform.measure(&around, [reach; 3], &mut self.distances);
        for distance in &mut self.distances {
            // The root of an infinite square is infinite; `min` bounds it.
            *distance = (f64::from(*distance).sqrt() * resolution).min(max_distance) as f32;
        }
        (self.region, self.resolution, self.max_distance, self.cells) =
            (region, resolution, max_distance, cells);
        Ok(())
    }

    /// The distance at a place of the region; `None` elsewhere. O(1), some 15 ns.
    pub fn at(&self, point: [f64; 3]) -> Option<Clearance> {
        let Extent { min, max } = self.region;
        if !(0..3).all(|axis| (min[axis]..=max[axis]).contains(&point[axis])) {
            return None;
        }
        // In cells, from the centre of the first cell.
        let within: [f64; 3] =
            from_fn(|axis| point[axis] / self.resolution - 0.5 - self.cells.first[axis] as f64);
        let cell: [usize; 3] = from_fn(|axis| (within[axis] as usize).min(self.cells.size[axis] - 2));
        let part: [f64; 3] = from_fn(|axis| (within[axis] - cell[axis] as f64).clamp(0.0, 1.0));
        let weights: [[f64; 2]; 3] = part.map(|part| [1.0 - part, part]);
        let (mut distance, mut gradient) = (0.0, [0.0; 3]);
        for corner in 0..8 {
            let side: [usize; 3] = from_fn(|axis| corner >> axis & 1);
            let value =
                f64::from(*self.distances.get(self.cells.index(from_fn(|axis| cell[axis] + side[axis])))?);
            let [x, y, z] = from_fn(|axis| weights[axis][side[axis]]);
            distance += x * y * z * value;
            for (axis, across) in [y * z, x * z, x * y].into_iter().enumerate() {
                gradient[axis] += if side[axis] == 1 { across * value } else { -across * value };
            }
        }
        // Distances are kept in single precision, which may round the greatest one up.
        let distance = distance.min(self.max_distance);
        Some(Clearance { distance, gradient: gradient.map(|c| c / self.resolution) })
    }

    /// The box in which distances are known, world, metres.
    pub fn region(&self) -> Extent {
        self.region
    }

    /// The greatest distance that the field gives, metres.
    pub fn max_distance(&self) -> f64 {
        self.max_distance
    }

    /// Bytes of memory held, buffers included.
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>() + self.distances.capacity() * size_of::<f32>() + self.transform.memory_bytes()
    }
}
