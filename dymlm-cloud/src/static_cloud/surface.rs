use dymlm_core::symmetric_eigen3;
use dymlm_core::vector3::dot;

use super::columns::Columns;
use crate::block_store::{BLOCK_SIDE, CellBits, NEIGHBORS, cell_in_block, for_each_bit, put};
use crate::paging::record;
use crate::thinning::Thinning;
use crate::voxel::{SUBVOXELS, Voxel, to_f64};

/// From the lowest corner of a block to its middle, voxels.
pub(super) const HALF_BLOCK: f64 = BLOCK_SIDE as f64 / 2.0;

/// Greatest variance across a surface, in multiples of the variance of its readings: besides the sensor's
/// noise there are the steps of its depth. With a higher value, the voxels of an edge or of a thing before a
/// wall are taken for the noise of one surface between them; with a lower one, few surfaces of a Kinect are
/// found at all.
const MOST_VARIANCE: f64 = 2.0;
/// How far the means of columns of blocks may be from one plane, by variance, beyond the variance over a
/// voxel: as a share of the readings' noise, which is cut off where the neighbourhood ends. With more, things
/// before a wall are taken for its noise; without, some far inclined walls keep their shells.
const UNEVENNESS: f64 = 0.01;
/// Variance of a uniform distribution over the side of a voxel, square voxels.
const VOXEL_VARIANCE: f64 = 1.0 / 12.0;
/// Least ratio of a surface's width to its thickness, by variance: below it, chance decides the normal.
const LEAST_WIDTH: f64 = 2.0;
/// Least ratio of a surface's width to its length, by variance: an edge or a cable has no normal.
const LEAST_SHAPE: f64 = 0.1;
/// Greatest distance of a static voxel from its surface, in standard deviations of its readings: thinning
/// leaves voxels within 1.4. With a higher value, things close before a surface move onto it, and are missing
/// in the cloud; with a lower one, the shell around a far wall keeps its outer points.
const REACH: f64 = 2.0;
/// Greatest distance of a static voxel from its surface, voxels: into the next block.
const MAX_REACH: f64 = BLOCK_SIDE as f64;
/// Normals and offsets are rounded to multiples of 1 / these, so that a frame without new information moves
/// nothing.
const NORMAL_STEPS: f64 = 1024.0;
const OFFSET_STEPS: f64 = 64.0;
/// Bits of a weight that are left out: three after the leading one stay.
const WEIGHT_BITS: u32 = 20;
/// Change of the logarithm of a weight by one step of these rounded weights.
const LOG_STEP: f64 = std::f64::consts::LN_2 / 8.0;

/// Sums over the voxels of a block that are no ghosts. Lengths in voxels, from the middle of the block.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Moments {
    weight: f32,
    /// Sum of weight times place.
    places: [f32; 3],
    /// Sums of weight times the products xx, xy, xz, yy, yz, zz.
    products: [f32; 6],
    /// Sum of weight times the variance of a reading.
    noise: f32,
}

record!(Moments { weight, places, products, noise });

/// The single surface that the voxels in and around a block are readings of: normal . place = offset, lengths
/// in voxels, from the middle of the block.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Surface {
    /// Nearly of length one.
    normal: [f32; 3],
    offset: f32,
    /// Logarithm of the weight of the block's own voxels, in steps of `LOG_STEP`; 0 for no surface.
    log_weight: u16,
}

record!(Surface { normal, offset, log_weight });

/// The surfaces of a block and of the blocks around it.
#[derive(Debug)]
pub(super) struct SurfacesAround {
    surfaces: Vec<NearSurface>,
    /// Logarithm of the likelihood below which a voxel stays with the block's own voxels, which are readings
    /// of several surfaces.
    least: f64,
}

/// A surface, in the coordinates of a block beside its own.
#[derive(Debug, Clone, Copy)]
struct NearSurface {
    normal: [f64; 3],
    offset: f64,
    squared_length: f64,
    log_weight: f64,
}

/// Moments in the making.
#[derive(Default)]
pub(super) struct MomentSums {
    weight: f64,
    observations: u64,
    places: [f64; 3],
    products: [f64; 6],
}

impl MomentSums {
    /// Adds the voxel at a place.
    #[inline]
    pub(super) fn add(&mut self, place: usize, voxel: &Voxel, weight: f32) {
        let weight = f64::from(weight);
        let share = weight / (to_f64(voxel.sums.weight.max(1)) * f64::from(SUBVOXELS));
        let cell = cell_in_block(place);
        // Weight times place.
        let [x, y, z] = [0, 1, 2].map(|axis| {
            share * to_f64(voxel.sums.position[axis]) + weight * (f64::from(cell[axis]) - HALF_BLOCK)
        });
        self.weight += weight;
        self.observations += u64::from(voxel.observations);
        for (sum, c) in self.places.iter_mut().zip([x, y, z]) {
            *sum += c;
        }
        let inverse = 1.0 / weight;
        for (sum, product) in self.products.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += inverse * product;
        }
    }

    pub(super) fn moments(&self, thinning: &Thinning) -> Moments {
        Moments {
            weight: self.weight as f32,
            places: self.places.map(|sum| sum as f32),
            products: self.products.map(|sum| sum as f32),
            noise: thinning.noise(self.observations) as f32,
        }
    }
}

impl Moments {
    /// The sum of weight times place, from the middle of the block from which `step` (voxels) leads here.
    fn places_from(&self, step: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| f64::from(self.places[axis]) + f64::from(self.weight) * step[axis])
    }

    fn rounded_log_weight(&self) -> u16 {
        (self.weight.to_bits() >> WEIGHT_BITS) as u16
    }

    /// Logarithm of the weight, up to a constant.
    fn log_weight(&self) -> f64 {
        LOG_STEP * f64::from(self.rounded_log_weight())
    }
}

impl Surface {
    /// The surface of a block with the moments `own`; `around`: the moments of the blocks around, itself
    /// among them, with the steps to them. No surface where the voxels are readings of more than one.
    pub(crate) fn fit<'a>(own: &Moments, around: impl Iterator<Item = ([i32; 3], &'a Moments)>) -> Self {
        Self::least_squares(own, around).unwrap_or_default()
    }

    fn least_squares<'a>(
        own: &Moments,
        around: impl Iterator<Item = ([i32; 3], &'a Moments)>,
    ) -> Option<Self> {
        let log_weight = own.rounded_log_weight();
        if log_weight == 0 {
            return None;
        }
        let (mut filled, mut count) = ([([0; 3], own); NEIGHBORS], 0);
        for (place, near) in filled.iter_mut().zip(around.filter(|(_, moments)| moments.weight > 0.0)) {
            *place = near;
            count += 1;
        }
        let around = &filled[..count];
        let (mut weight, mut places, mut products, mut noise) = (0.0, [0.0; 3], [[0.0; 3]; 3], 0.0);
        for &(step, moments) in around {
            let (own_weight, sums) = (f64::from(moments.weight), moments.places.map(f64::from));
            let step = in_voxels(step);
            let moved = moments.places_from(step);
            let [xx, xy, xz, yy, yz, zz] = moments.products.map(f64::from);
            let own = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
            weight += own_weight;
            noise += f64::from(moments.noise);
            for row in 0..3 {
                places[row] += moved[row];
                for column in row..3 {
                    products[row][column] += own[row][column]
                        + step[row] * sums[column]
                        + step[column] * sums[row]
                        + own_weight * step[row] * step[column];
                }
            }
        }
        let mean = places.map(|sum| sum / weight);
        let entry = |row: usize, column: usize| products[row][column] / weight - mean[row] * mean[column];
        let eigen = symmetric_eigen3([0, 1, 2].map(|row| [0, 1, 2].map(|column| entry(row, column))))?;
        let ([length, width, thickness], [_, _, normal]) = (eigen.values, eigen.vectors);
        let noise = noise / weight;
        let is_one = thickness <= MOST_VARIANCE * (noise + VOXEL_VARIANCE);
        let has_normal = width > LEAST_WIDTH * thickness && width > LEAST_SHAPE * length;
        let is_even = || unevenness(around, normal) <= UNEVENNESS * noise + VOXEL_VARIANCE;
        (is_one && has_normal && is_even()).then(|| Self {
            normal: normal.map(|c| ((c * NORMAL_STEPS).round() / NORMAL_STEPS) as f32),
            offset: ((dot(normal, mean) * OFFSET_STEPS).round() / OFFSET_STEPS) as f32,
            log_weight,
        })
    }

    /// Whether the surface passes through a voxel of its block.
    pub(super) fn passes_through(&self, place: usize) -> bool {
        let middle = cell_in_block(place).map(|c| f64::from(c) + 0.5 - HALF_BLOCK);
        let normal = self.normal.map(f64::from);
        // From the voxel's middle to its corner that is farthest along the normal.
        let half_width = 0.5 * normal.map(f64::abs).iter().sum::<f64>();
        self.is_some() && (dot(normal, middle) - f64::from(self.offset)).abs() <= half_width
    }

    /// Of some voxels of the block, those that one of two surfaces passes through, but not both.
    pub(super) fn resurfaced(&self, other: &Self, voxels: &CellBits) -> CellBits {
        let mut resurfaced = CellBits::default();
        for_each_bit(*voxels, |place| {
            if self.passes_through(place) != other.passes_through(place) {
                put(&mut resurfaced, place);
            }
        });
        resurfaced
    }

    /// Whether there is a surface.
    fn is_some(&self) -> bool {
        self.log_weight > 0
    }

    /// The surface in the coordinates of the block from which `step` leads to its own block.
    fn seen_from(&self, step: [i32; 3]) -> Option<NearSurface> {
        let normal = self.normal.map(f64::from);
        let center = step.map(|c| f64::from(c) * BLOCK_SIDE as f64);
        self.is_some().then(|| NearSurface {
            normal,
            offset: f64::from(self.offset) + dot(normal, center),
            squared_length: dot(normal, normal),
            log_weight: LOG_STEP * f64::from(self.log_weight),
        })
    }
}

/// The [unevenness](Columns::unevenness) of the blocks around, on a surface with this normal.
fn unevenness(around: &[([i32; 3], &Moments)], normal: [f64; 3]) -> f64 {
    let mut columns = Columns::along(normal);
    for &(step, moments) in around {
        columns.add(step, f64::from(moments.weight), moments.places_from(in_voxels(step)));
    }
    columns.unevenness()
}

/// A step from block to block, voxels.
fn in_voxels(step: [i32; 3]) -> [f64; 3] {
    step.map(|c| f64::from(c) * BLOCK_SIDE as f64)
}

impl SurfacesAround {
    /// `around`: the surfaces of blocks, with the steps to them; `own`: the block that sees them.
    pub(super) fn new<'a>(
        own: (&Moments, &Surface),
        around: impl Iterator<Item = ([i32; 3], &'a Surface)>,
    ) -> Self {
        let surfaces = around.filter_map(|(step, surface)| surface.seen_from(step)).collect();
        let (moments, surface) = own;
        let least =
            if surface.is_some() { f64::NEG_INFINITY } else { moments.log_weight() - 0.5 * REACH * REACH };
        Self { surfaces, least }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.surfaces.is_empty()
    }

    /// The nearest place on the surface that a reading most likely belongs to: the surface with the greatest
    /// product of the weight of its block and the probability of the distance. `None` where no surface is
    /// within reach, or where the block has readings of several surfaces, with more weight than would make a
    /// surface around likely. Place from the middle of the block, standard deviation of the reading, voxels.
    pub(super) fn foot(&self, place: [f64; 3], deviation: f64) -> Option<[f64; 3]> {
        let reach = (REACH * deviation).min(MAX_REACH);
        let mut best = (self.least, None);
        for surface in &self.surfaces {
            let distance = dot(surface.normal, place) - surface.offset;
            let squared = distance * distance / surface.squared_length;
            let likelihood = surface.log_weight - 0.5 * squared / (deviation * deviation);
            if squared <= reach * reach && likelihood > best.0 {
                let share = distance / surface.squared_length;
                best = (likelihood, Some((share, surface.normal)));
            }
        }
        let (share, normal) = best.1?;
        Some([0, 1, 2].map(|axis| place[axis] - share * normal[axis]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings in the nine blocks of a layer, which a wall at z = 0 passes through: all over their blocks,
    /// and with a noise of three voxels.
    fn wall_with(height: impl Fn([i32; 3]) -> f64) -> Surface {
        let (weight, noise, within) = (5.0, 9.0, BLOCK_SIDE as f64 * BLOCK_SIDE as f64 / 12.0);
        let steps: Vec<[i32; 3]> = (-1..=1).flat_map(|y| (-1..=1).map(move |x| [x, y, 0])).collect();
        let moments: Vec<Moments> = steps
            .iter()
            .map(|&step| {
                let z = height(step);
                let variances = [within, 0.0, 0.0, within, 0.0, noise + z * z];
                Moments {
                    weight: weight as f32,
                    places: [0.0, 0.0, (weight * z) as f32],
                    products: variances.map(|variance| (weight * variance) as f32),
                    noise: (weight * noise) as f32,
                }
            })
            .collect();
        Surface::fit(&moments[4], steps.into_iter().zip(&moments))
    }

    #[test]
    fn the_noise_of_a_wall_is_one_surface_also_where_it_is_bent_a_little() {
        assert!(wall_with(|_| 0.3).is_some());
        assert!(wall_with(|[x, _, _]| 0.4 * f64::from(x * x)).is_some());
    }

    #[test]
    fn a_thing_before_a_wall_is_another_surface_although_it_is_nearer_than_the_noise_is_wide() {
        assert!(!wall_with(|step| if step == [0; 3] { 2.5 } else { 0.0 }).is_some());
        assert!(!wall_with(|[x, _, _]| if x == 0 { 2.0 } else { 0.0 }).is_some());
    }
}
