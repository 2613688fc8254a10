use dymlm_core::{Point, Pose};

use super::Scan;
use crate::direction::Direction;
use crate::{CloudFrameReport, CloudMap, Error};

/// Putting scans in, and taking them out.
impl CloudMap {
    /// Adds the points of a scan, given in the sensor's frame, metres, as [`insert`](Self::insert) adds an
    /// image. A point's distance from the sensor counts as its depth; its weight and the tolerances follow
    /// from the [`SensorModel`](dymlm_core::SensorModel) in the same way. Points that are not finite or out
    /// of the sensor's range are no readings.
    ///
    /// The evidence of free space comes from the rays, one to the centre of each cell of the evidence (4 cm)
    /// in which a point lies. A ray looks through a cell when it passes within half a side of the cell's
    /// centre, and ends beyond it by more than the tolerance; along the normal of what it meets there, which
    /// readings beside the ray tell: what a flat ray passes before it ends on the floor is no free space. A
    /// scan counts for a cell once. O(points + cells that the rays pass).
    ///
    /// # Errors
    ///
    /// [`Error::Core`] when the time is not finite; [`Error::OutOfReach`].
    ///
    /// ```
    /// use dymlm_cloud::{CloudMap, CloudMapConfig, Selection};
    /// use dymlm_core::{DepthNoise, Pose, SensorModel};
    ///
    /// let mut sensor = SensorModel::time_of_flight();
    /// (sensor.noise, sensor.max_depth) = (DepthNoise::constant(0.01), 30.0);
    /// let mut map = CloudMap::new(CloudMapConfig::default(), sensor)?;
    /// for second in 0..3 {
    ///     map.insert_scan(f64::from(second), &[[5.0, 0.0, 1.0], [5.0, 0.1, 1.0]], &Pose::identity())?;
    /// }
    /// assert_eq!(map.point_cloud(Selection::Static).points(), [[5.0, 0.0, 1.0], [5.0, 0.1, 1.0]]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn insert_scan(
        &mut self,
        timestamp: f64,
        points: &[Point],
        world_from_sensor: &Pose,
    ) -> Result<CloudFrameReport, Error> {
        self.check_scan(timestamp, world_from_sensor)?;
        let lattice = self.lattice_around(1.0, world_from_sensor)?;
        Ok(self.apply_scan(Scan { timestamp, points, world_from_sensor }, &lattice, Direction::Insert))
    }

    /// Takes a scan out again, exactly: time, points and pose must be those with which it was inserted.
    ///
    /// # Errors
    ///
    /// As [`CloudMap::insert_scan`]; [`Error::NotInserted`] when a sum would go negative.
    pub fn remove_scan(
        &mut self,
        timestamp: f64,
        points: &[Point],
        world_from_sensor: &Pose,
    ) -> Result<(), Error> {
        self.check_scan(timestamp, world_from_sensor)?;
        let lattice = self.lattice_around(1.0, world_from_sensor)?;
        let scan = Scan { timestamp, points, world_from_sensor };
        self.take_out(timestamp, |map| {
            map.apply_scan(scan, &lattice, Direction::Remove);
        })?;
        self.drop_void_blocks();
        Ok(())
    }

    /// Checks that a scan of this time and from this place can be inserted: an insertion refuses nothing
    /// else.
    ///
    /// # Errors
    ///
    /// As [`CloudMap::insert_scan`].
    pub fn check_scan(&self, timestamp: f64, world_from_sensor: &Pose) -> Result<(), Error> {
        if !timestamp.is_finite() {
            return Err(dymlm_core::Error::Timestamp(timestamp).into());
        }
        self.lattice_around(1.0, world_from_sensor).map(|_| ())
    }
}
