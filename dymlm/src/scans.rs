use dymlm_core::vector3::norm;
use dymlm_core::{Point, Pose, SensorModel};
use dymlm_octree::{Error as OctreeError, InsertReport, Octree};

use crate::stages::StageClock;
use crate::{Error, FrameOutcome, FrameReport, MapBuilder, MultiLevelMap, ScanUpdate, Stage};

impl MapBuilder {
    /// Takes in a scan of a lidar or of any other sensor that is no camera: `points` in the sensor's frame,
    /// metres, and the pose that takes them to the world. Each scan is mapped, into the cloud with its
    /// evidence and the octree; planes and objects come from images alone. Movers are not masked in scans:
    /// they vanish when later scans or frames look through where they were.
    ///
    /// Noise and range are those of [`MapConfig::sensor`](crate::MapConfig::sensor), with a point's distance
    /// in place of its depth; the octree's range is its own
    /// ([`max_range`](dymlm_octree::OctreeConfig::max_range)). Points that are not finite or too near are no
    /// readings. Scans and frames come in the order of their time; a scan does not wait for frames that wait
    /// for detections. A [history](dymlm_history::HistoryConfig) keeps the points, some 8 bytes each, and
    /// they follow corrected poses.
    ///
    /// # Errors
    ///
    /// [`Error::Dynamics`] when time runs backwards or is not in seconds; [`Error::Cloud`] when the time is
    /// not finite or the pose lies outside what the cloud can reach; [`Error::Octree`] when its rays would
    /// pass too many cells; [`Error::Paging`]. The builder stays as it was.
    ///
    /// ```
    /// use dymlm::{MapBuilder, MapConfig, Selection};
    /// use dymlm::core::{DepthNoise, Pose};
    /// use dymlm::octree::CellState;
    ///
    /// let mut config = MapConfig::default();
    /// (config.sensor.noise, config.sensor.max_depth) = (DepthNoise::constant(0.01), 30.0);
    /// config.octree.max_range = 30.0;
    /// let mut builder = MapBuilder::new(config)?;
    /// for step in 0..3 {
    ///     let report = builder.insert_scan(0.1 * f64::from(step), &[[9.0, 0.0, 0.5]], &Pose::identity())?;
    ///     assert_eq!(report.scan().map(|scan| scan.octree.hit_cells), Some(1));
    /// }
    /// assert_eq!(builder.map().octree().state([9.0, 0.0, 0.5]), CellState::Occupied);
    /// assert_eq!(builder.map().octree().state([5.0, 0.0, 0.28]), CellState::Free);
    /// assert_eq!(builder.map().cloud().point_cloud(Selection::Static).points(), [[9.0, 0.0, 0.5]]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[doc(alias = "lidar")]
    pub fn insert_scan(
        &mut self,
        timestamp: f64,
        points: &[Point],
        world_from_sensor: &Pose,
    ) -> Result<FrameReport, Error> {
        self.map.cloud.check_scan(timestamp, world_from_sensor)?;
        self.check_time(timestamp)?;
        self.scan_mapper.check(points, world_from_sensor, &self.map.octree, &self.config.sensor)?;
        self.pager.page_out(&mut self.map, &mut self.snapshots)?;
        let (id, mut released) = self.begin_input(timestamp, world_from_sensor)?;
        let mut clock = StageClock::start();
        let Self { map, scan_mapper, config, .. } = self;
        let map_time = map.past.newest;
        let scan = Scan { timestamp: map_time, points, world_from_sensor };
        let update = scan_mapper.map(&scan, map, &config.sensor, &mut clock)?;
        if let Some(log) = &mut self.map.past.log {
            log.add_scan(id, points);
        }
        if let Some(log) = &self.map.past.log {
            self.snapshots.take_when_due(&self.map, &log.events);
        }
        self.map.change();
        self.publisher.publish_when_due(map_time, self.config.publish_interval, &mut self.map);
        let mut report = FrameReport::waiting(id, timestamp);
        (report.outcome, report.stages) = (FrameOutcome::Scanned(update), clock.finish());
        report.released.append(&mut released);
        Ok(report)
    }
}

/// Points that a sensor has read at one time.
pub(crate) struct Scan<'a> {
    pub(crate) timestamp: f64,
    /// Points in the sensor's frame, metres.
    pub(crate) points: &'a [Point],
    pub(crate) world_from_sensor: &'a Pose,
}

/// Maps scans, when they come and in replays.
#[derive(Debug, Default)]
pub(crate) struct ScanMapper {
    /// The readings of a scan, in the world.
    readings: Vec<Point>,
}

impl ScanMapper {
    pub(crate) fn map(
        &mut self,
        scan: &Scan<'_>,
        map: &mut MultiLevelMap,
        sensor: &SensorModel,
        clock: &mut StageClock,
    ) -> Result<ScanUpdate, Error> {
        let &Scan { timestamp, points, world_from_sensor } = scan;
        self.read(points, world_from_sensor, sensor);
        let cloud =
            clock.time(Stage::Cloud, || map.cloud.insert_scan(timestamp, points, world_from_sensor))?;
        let octree = clock.time(Stage::Octree, || self.insert_into(&mut map.octree, world_from_sensor))?;
        let freed = clock.time(Stage::GhostRemoval, || map.remove_ghosts_when_due(timestamp));
        Ok(ScanUpdate { cloud, octree, removed: freed.removed, updated: freed.updated })
    }

    /// Checks that the octree would take a scan.
    pub(crate) fn check(
        &mut self,
        points: &[Point],
        world_from_sensor: &Pose,
        octree: &Octree,
        sensor: &SensorModel,
    ) -> Result<(), Error> {
        self.read(points, world_from_sensor, sensor);
        Ok(octree.check_scan(world_from_sensor.translation(), &self.readings)?)
    }

    /// Transforms a scan's readings to the world.
    fn read(&mut self, points: &[Point], world_from_sensor: &Pose, sensor: &SensorModel) {
        let points = points.iter().map(|point| point.map(f64::from));
        let is_reading = |range: f64| range.is_finite() && range >= sensor.min_depth.into();
        let readings = points.filter(|&point| is_reading(norm(point)));
        let in_world = readings.map(|point| world_from_sensor.transform_point(point).map(|c| c as f32));
        self.readings.clear();
        self.readings.extend(in_world);
    }

    fn insert_into(&self, octree: &mut Octree, world_from_sensor: &Pose) -> Result<InsertReport, Error> {
        match octree.insert_scan(world_from_sensor.translation(), &self.readings) {
            // As with frames: beyond its cells the octree leaves readings out, and the cloud takes them.
            Err(OctreeError::Origin { .. }) => Ok(outside(self.readings.len())),
            inserted => Ok(inserted?),
        }
    }
}

/// The report of a scan of which nothing is in the octree.
fn outside(readings: usize) -> InsertReport {
    let mut report = InsertReport::default();
    (report.readings, report.outside) = (readings, readings);
    report
}
