use dymlm_core::vector3::{difference, dot, norm, unit};

use super::Scan;
use super::cell_set::CellSet;
use super::incidence::NearestReadings;
use crate::block_store::{BlockKey, CellBits, for_each_bit, split};
use crate::fixed_point::range;
use crate::look_through::LookThrough;

/// The cells that the rays of a scan look through, each once.
///
/// All readings in one cell share a ray, to its centre: a lidar has many readings in a near cell, and half a
/// cell is within the tolerance.
#[derive(Debug, Clone, Default)]
pub(crate) struct ScanRays {
    ends: CellSet,
    nearest: NearestReadings,
    passed: CellSet,
}

/// A ray, and the part of it that shows free space, metres.
struct Ray {
    origin: [f64; 3],
    direction: [f64; 3],
    from: f64,
    to: f64,
}

impl ScanRays {
    /// Follows all rays of a scan.
    pub(crate) fn follow(&mut self, scan: Scan<'_>, look: &LookThrough) {
        self.find_ends(scan, look);
        self.passed.clear();
        let (side, sensor) = (look.cell_size(), look.sensor());
        let origin = scan.world_from_sensor.translation();
        let Self { ends, nearest, passed } = self;
        for (key, cells) in ends.blocks() {
            for_each_bit(cells, |index| {
                let way = difference(key.cell(index).map(|c| (f64::from(c) + 0.5) * side), origin);
                let Some(direction) = unit(way) else { return };
                let reading = norm(way);
                // The tolerance at the ray's end, which is the greatest on it, counts along the normal of
                // what it meets there.
                let depth = (reading as f32).min(sensor.max_depth);
                // Two readings of one place differ by the noise of both.
                let noise = sensor.tolerance(depth, sensor.sigma(depth).into());
                let sine = nearest.sine_of_incidence(way, noise);
                let to = (reading - f64::from(look.tolerance(depth)) / sine).min(sensor.max_depth.into());
                let ray = Ray { origin, direction, from: sensor.min_depth.into(), to };
                follow_ray(passed, &ray, side);
            });
        }
    }

    /// Finds the cells in which readings lie; for readings beyond the range, cells on their rays just behind
    /// it.
    fn find_ends(&mut self, Scan { points, world_from_sensor, .. }: Scan<'_>, look: &LookThrough) {
        self.ends.clear();
        self.nearest.clear();
        let (sensor, origin) = (look.sensor(), world_from_sensor.translation());
        let far_enough = sensor.max_depth + 2.0 * look.tolerance(sensor.max_depth);
        for &point in points {
            let reading = range(point);
            // A reading of 0 has no direction.
            if reading > 0.0 && reading >= sensor.min_depth && reading.is_finite() {
                let shortened = f64::from(far_enough.min(reading) / reading);
                let place = world_from_sensor.transform_point(point.map(|c| f64::from(c) * shortened));
                let (block, index) = split(place.map(|c| (c / look.cell_size()).floor() as i32));
                let slot = self.ends.slot_or_insert(BlockKey::new(block));
                self.ends.put(slot, index);
                if reading <= sensor.max_depth {
                    self.nearest.note(difference(place, origin));
                }
            }
        }
    }

    /// The cells that were passed, by blocks.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = (BlockKey, CellBits)> {
        self.passed.blocks()
    }
}

/// Notes the cells whose centres lie within half a side of a ray. The ray passes every such cell.
fn follow_ray(passed: &mut CellSet, ray: &Ray, side: f64) {
    let Ray { origin, direction, from, to } = *ray;
    let infinite = [f64::INFINITY; 3];
    let (mut cell, mut next, mut between, mut step) = ([0; 3], infinite, infinite, [0; 3]);
    for axis in 0..3 {
        let along = direction[axis];
        cell[axis] = ((origin[axis] + from * along) / side).floor() as i32;
        if along != 0.0 {
            let is_up = along > 0.0;
            step[axis] = if is_up { 1 } else { -1 };
            next[axis] = (f64::from(cell[axis] + i32::from(is_up)) * side - origin[axis]) / along;
            between[axis] = side / along.abs();
        }
    }
    let mut offset: [f64; 3] = [0, 1, 2].map(|axis| (f64::from(cell[axis]) + 0.5) * side - origin[axis]);
    let mut last: Option<([i32; 3], usize)> = None;
    loop {
        let away = dot(offset, direction);
        let beside = dot(offset, offset) - away * away;
        if from <= away && away < to && beside <= 0.25 * side * side {
            let (block, index) = split(cell);
            let slot = match last {
                Some((last_block, slot)) if last_block == block => slot,
                _ => passed.slot_or_insert(BlockKey::new(block)),
            };
            last = Some((block, slot));
            passed.put(slot, index);
        }
        let axis =
            if next[0] <= next[1] && next[0] <= next[2] { 0 } else { 1 + usize::from(next[2] < next[1]) };
        // The centre of a cell is less than a cell's side from where the ray enters it.
        if next[axis] >= to + side {
            return;
        }
        cell[axis] += step[axis];
        offset[axis] += f64::from(step[axis]) * side;
        next[axis] += between[axis];
    }
}
