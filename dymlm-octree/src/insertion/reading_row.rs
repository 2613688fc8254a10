use dymlm_core::{Mask, PinholeCamera, Point, Pose, SensorModel};

use crate::lattice::{Lattice, OUTSIDE};

/// Index along x of a pixel without a reading; [`Lattice::indices`] gives it to no point, inside the map or
/// outside.
pub(super) const NO_READING: u32 = 1 << 31;

/// Consecutive readings: a row of a depth image, or a stretch of a cloud. x, y and z have an array each, so
/// that the compiler vectorizes the loops over them.
#[derive(Debug, Default)]
pub(crate) struct Row {
    /// Direction, in the world, of each column's pixel in the row of the principal point. (Depth images
    /// only.)
    rays: [Vec<f32>; 3],
    /// Points in the world, metres.
    pub(super) world: [Vec<f32>; 3],
    /// Cells of the points; x is [`NO_READING`] where there is no reading.
    pub(super) indices: [Vec<u32>; 3],
    /// Not 0 where a reading's cell differs from the one before, or `is_cut` does.
    changes: Vec<u32>,
    /// The columns of these readings, in order.
    pub(super) changed: Vec<u32>,
    /// 1 where the reading is beyond the sensor's range, and the point was set to the end of the range on its
    /// ray; else 0.
    pub(super) is_cut: Vec<u32>,
}

/// Whether a pixel has a depth that is not too near. It may be too far: then its ray is cut.
#[inline]
pub(super) fn is_reading(depth: f32, sensor: &SensorModel) -> bool {
    depth > 0.0 && depth >= sensor.min_depth && depth < f32::INFINITY
}

/// What a row holds.
pub(super) struct RowSummary {
    pub(super) readings: usize,
    /// Whether some readings lie outside the map or are not finite.
    pub(super) some_outside: bool,
}

impl Row {
    #[inline]
    pub(super) fn cell(&self, i: usize) -> [u32; 3] {
        [self.indices[0][i], self.indices[1][i], self.indices[2][i]]
    }

    #[inline]
    pub(super) fn point(&self, i: usize) -> Point {
        [self.world[0][i], self.world[1][i], self.world[2][i]]
    }

    fn resize(&mut self, count: usize) {
        self.world.iter_mut().for_each(|world| world.resize(count, 0.0));
        self.indices.iter_mut().for_each(|indices| indices.resize(count, 0));
        self.changes.resize(count, 0);
        self.is_cut.clear();
        self.is_cut.resize(count, 0);
    }

    pub(super) fn copy_points(&mut self, points: &[Point]) {
        self.resize(points.len());
        for (axis, world) in self.world.iter_mut().enumerate() {
            for (world, point) in world.iter_mut().zip(points) {
                *world = point[axis];
            }
        }
    }

    /// Rotates the rays of a camera's columns into the world.
    pub(super) fn prepare(&mut self, camera: &PinholeCamera, world_from_camera: &Pose) {
        let rotation = world_from_camera.rotation_matrix();
        for (rays, [x, _, z]) in self.rays.iter_mut().zip(rotation) {
            rays.clear();
            rays.extend((0..camera.width()).map(|u| ((u as f64 - camera.cx()) / camera.fx() * x + z) as f32));
        }
        self.resize(camera.width());
    }

    /// Row v of a depth image: (ray of the column + what the row adds) * depth + camera centre.
    pub(super) fn back_project(
        &mut self,
        camera: &PinholeCamera,
        sensor: &SensorModel,
        world_from_camera: &Pose,
        v: usize,
        depths: &[f32],
    ) {
        let farthest = sensor.max_depth;
        for (is_cut, &depth) in self.is_cut.iter_mut().zip(depths) {
            *is_cut = u32::from(depth > farthest);
        }
        let rotation = world_from_camera.rotation_matrix();
        let translation = world_from_camera.translation();
        let ray_y = (v as f64 - camera.cy()) / camera.fy();
        for axis in 0..3 {
            let (row, center) = ((ray_y * rotation[axis][1]) as f32, translation[axis] as f32);
            for ((world, &ray), &depth) in self.world[axis].iter_mut().zip(&self.rays[axis]).zip(depths) {
                *world = (ray + row) * if depth > farthest { farthest } else { depth } + center;
            }
        }
    }

    pub(super) fn find_indices(&mut self, lattice: &Lattice) {
        for (indices, world) in self.indices.iter_mut().zip(&self.world) {
            lattice.indices(world, indices);
        }
    }

    /// Marks pixels without a depth, too near or outside the mask as no readings.
    pub(super) fn drop_pixels(
        &mut self,
        sensor: &SensorModel,
        depths: &[f32],
        v: usize,
        mask: Option<&Mask>,
    ) {
        for (index, &depth) in self.indices[0].iter_mut().zip(depths) {
            *index = if is_reading(depth, sensor) { *index } else { NO_READING };
        }
        if let Some(mask) = mask {
            mask.overwrite_outside(v, &mut self.indices[0], NO_READING);
        }
    }

    /// Fills `changes`.
    pub(super) fn compare_neighbors(&mut self) -> RowSummary {
        let count = self.changes.len();
        let [x, y, z] = self.indices.each_ref().map(|indices| &indices[..count]);
        let (is_cut, changes) = (&self.is_cut[..count], &mut self.changes[..count]);
        let (mut readings, mut outside) = (0, 0);
        for ((&x, &y), &z) in x.iter().zip(y).zip(z) {
            let reading = u32::from(x != NO_READING);
            readings += reading;
            outside |= reading & u32::from((x | y | z) >= OUTSIDE);
        }
        for i in 1..count {
            let differences =
                (x[i] ^ x[i - 1]) | (y[i] ^ y[i - 1]) | (z[i] ^ z[i - 1]) | (is_cut[i] ^ is_cut[i - 1]);
            changes[i] = if x[i] == NO_READING { 0 } else { differences };
        }
        if let Some(first) = changes.first_mut() {
            *first = u32::from(x[0] != NO_READING);
        }
        RowSummary { readings: readings as usize, some_outside: outside != 0 }
    }

    /// Fills `changed`.
    pub(super) fn list_changed(&mut self) {
        let mut count = 0;
        self.changed.resize(self.changes.len(), 0);
        // Changes come irregularly: the processor would often guess a branch wrongly. So every column is
        // noted, and the next one overwrites it where nothing changes.
        for (column, &change) in self.changes.iter().enumerate() {
            self.changed[count] = column as u32;
            count += usize::from(change != 0);
        }
        self.changed.truncate(count);
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of::<f32>() * (3 * self.rays[0].capacity() + 9 * self.changes.capacity())
    }
}
