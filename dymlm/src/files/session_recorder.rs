use std::collections::BTreeMap;
use std::path::Path;

use dymlm_cloud::StaticPoints;
use dymlm_core::vector3::{dot, unit};
use dymlm_core::{Detection, Frame, ObjectId, PlaneId, PointCloud, Pose, Rgb};
use dymlm_io::{GridRecord, McapWriter, McapWriterOptions, ObjectRecord, PlaneRecord, outline_cloud};
use dymlm_octree::CellState;

use super::objects::object_record;
use super::outline_tiles::{OutlineTiles, Thing};
use super::planes::plane_record;
use super::topic_tiles::{ChangedTile, TopicTiles};
use crate::{ChangedThings, Error, FloorGrid, FloorGridConfig, MapChanges, MultiLevelMap};

/// Voxels along the side of a block of the cloud.
const BLOCK_VOXELS: f64 = 8.0;
/// Of voxels that no colour was seen of.
const GREY: Rgb = [128; 3];
/// Between points on the lines of planes and objects, metres: a line, seen from where a room is in view.
const LINE_SPACING: f64 = 0.02;
/// The topics of the cloud.
const CLOUD: &str = "/map/cloud";
/// Cosine of the angle between directions up within which a grid is brought up to date, 0.1 degrees: over 30
/// m the floor is at the same height but for a cell.
const SAME_UP: f64 = 0.999_998_5;

/// A plane or an object that is other than before, with its centre; `None` when it is gone.
type ChangedThing = (Thing, Option<[f64; 3]>);

/// Records a session for viewers such as Foxglove and Rerun, as one MCAP file: the frames, and of the maps
/// what has changed since they were recorded last. While the maps are built the file can be opened; after a
/// crash it can, too.
///
/// Beside the topics of [`McapWriter`] there are `/map/cloud/...`, the static cloud by cubes of 4 to 8 m (at
/// most 128 topics; where the world is larger the cubes are twice as large, and those before are emptied), and
/// `/map/outlines/...`, the lines of planes and objects as points, for viewers that draw no scenes, likewise by
/// where their centres are. `/map/grid` is the [grid of the floor](MultiLevelMap::floor_grid) under the camera, once up and that floor are known.
///
/// It holds a clone of the maps that it has recorded last, which shares with them what has not changed since,
/// and which block of the cloud is on which topic.
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("session.mcap");
/// use dymlm::core::{DepthImage, Frame, PinholeCamera, Pose};
/// use dymlm::files::SessionRecorder;
/// use dymlm::{MapBuilder, MapConfig};
/// use dymlm_io::McapWriterOptions;
///
/// let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5)?;
/// let mut builder = MapBuilder::new(MapConfig::default())?;
/// let mut recorder = SessionRecorder::create(&path, &McapWriterOptions::default())?;
/// for step in 0..3 {
///     let depth = DepthImage::new(160, 120, vec![2.0; 160 * 120])?;
///     let frame = Frame::new(f64::from(step) / 5.0, camera, depth, None)?;
///     builder.insert(&frame, &[], &Pose::identity())?;
///     recorder.record_frame(&frame, None, &Pose::identity())?;
///     // Once a second is enough.
///     recorder.record_map(frame.timestamp(), builder.map())?;
/// }
/// recorder.finish()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct SessionRecorder {
    writer: McapWriter,
    up: Option<[f64; 3]>,
    /// Where the last frame was taken from.
    camera: Option<[f64; 3]>,
    /// The maps as they were recorded last.
    recorded: Option<MultiLevelMap>,
    cloud: TopicTiles,
    outlines: OutlineTiles,
    planes: BTreeMap<u64, PlaneRecord>,
    objects: BTreeMap<u64, ObjectRecord>,
    /// The grid that was recorded last, unless it was taken away.
    grid: Option<ShownGrid>,
}

/// A grid that is brought up to date from what changes, and the direction up for which it was made.
#[derive(Debug)]
struct ShownGrid {
    floor: FloorGrid,
    up: [f64; 3],
}

impl SessionRecorder {
    /// Begins a file, in place of one that may be there.
    ///
    /// # Errors
    ///
    /// Those of [`McapWriter::create`].
    pub fn create(path: impl AsRef<Path>, options: &McapWriterOptions) -> Result<Self, Error> {
        Ok(Self {
            writer: McapWriter::create(path, options)?,
            up: None,
            camera: None,
            recorded: None,
            cloud: TopicTiles::new(CLOUD, 1.0),
            outlines: OutlineTiles::new(1.0),
            planes: BTreeMap::new(),
            objects: BTreeMap::new(),
            grid: None,
        })
    }

    /// Says which way is up, for labels and grid: without it that is what the maps have
    /// [learnt](MultiLevelMap::up).
    pub fn set_up(&mut self, up: [f64; 3]) {
        self.up = unit(up);
    }

    /// Records a frame with its pose, and its detections unless no detector has looked.
    ///
    /// # Errors
    ///
    /// Those of [`McapWriter::write_frame`].
    pub fn record_frame(
        &mut self,
        frame: &Frame,
        detections: Option<&[Detection]>,
        world_from_camera: &Pose,
    ) -> Result<(), Error> {
        self.camera = Some(world_from_camera.translation());
        Ok(self.writer.write_frame(frame, detections, world_from_camera)?)
    }

    /// Records what has changed in the maps since they were recorded last, as of a time in seconds, and
    /// leaves nothing to lose. Maps that were made otherwise take the place of those before.
    ///
    /// Costs what has changed, the tiles of cloud and outlines that this is in, and the grid.
    ///
    /// # Errors
    ///
    /// Those of [`McapWriter`].
    pub fn record_map(&mut self, time: f64, map: &MultiLevelMap) -> Result<(), Error> {
        let up = self.up.or_else(|| map.up());
        if self.recorded.as_ref().is_some_and(|recorded| recorded.config() != map.config()) {
            self.forget(time)?;
        }
        let is_first = self.recorded.is_none();
        if is_first {
            let block_side = BLOCK_VOXELS * map.config().cloud.voxel_size;
            (self.cloud, self.outlines) = (TopicTiles::new(CLOUD, block_side), OutlineTiles::new(block_side));
        }
        let empty = MultiLevelMap::new(&map.config)?;
        let changes = map.changes_since(self.recorded.as_ref().unwrap_or(&empty));
        self.record_cloud(time, map, &changes)?;
        let mut changed = self.record_planes(time, map, &changes.planes)?;
        changed.extend(self.record_objects(time, map, &changes.objects, up)?);
        self.record_outlines(time, changed)?;
        // As long as no grid was written, it may have lacked the camera, or a floor under it.
        match up {
            Some(up) if self.grid.is_none() || !changes.octree.is_empty() => {
                self.record_grid(time, map, up)?;
            }
            Some(_) => {}
            // It would not follow what changes meanwhile.
            None => self.clear_grid(time)?,
        }
        self.writer.flush()?;
        self.recorded = Some(map.without_past());
        Ok(())
    }

    /// Completes the file.
    ///
    /// # Errors
    ///
    /// Those of [`McapWriter::finish`].
    pub fn finish(self) -> Result<(), Error> {
        Ok(self.writer.finish()?)
    }

    /// Takes away what was recorded of maps.
    fn forget(&mut self, time: f64) -> Result<(), Error> {
        let topics = self.cloud.clear().into_iter().map(|tile| tile.topic).chain(self.outlines.clear());
        for topic in topics {
            self.writer.write_cloud(&topic, time, &PointCloud::default())?;
        }
        let planes: Vec<u64> = std::mem::take(&mut self.planes).into_keys().collect();
        let objects: Vec<u64> = std::mem::take(&mut self.objects).into_keys().collect();
        self.writer.write_planes(time, &[], &planes)?;
        self.writer.write_objects(time, &[], &objects, [0.0, 0.0, 1.0])?;
        self.clear_grid(time)?;
        self.recorded = None;
        Ok(())
    }

    fn record_cloud(&mut self, time: f64, map: &MultiLevelMap, changes: &MapChanges) -> Result<(), Error> {
        let points = map.cloud().static_points();
        let blocks = changes.cloud.iter().map(|block| (block.place, !block.points.is_empty()));
        for ChangedTile { topic, blocks } in self.cloud.update(blocks) {
            self.writer.write_cloud(&topic, time, &cloud_of(&points, &blocks))?;
        }
        Ok(())
    }

    /// Returns which planes are other than before, with their centres.
    fn record_planes(
        &mut self,
        time: f64,
        map: &MultiLevelMap,
        changes: &ChangedThings<PlaneId>,
    ) -> Result<Vec<ChangedThing>, Error> {
        let changed = changes.confirmed.iter().chain(&changes.changed);
        let planes: Vec<_> = changed.filter_map(|&id| map.planes().plane(id)).map(plane_record).collect();
        let gone: Vec<u64> = gone(changes).map(PlaneId::get).collect();
        if planes.is_empty() && gone.is_empty() {
            return Ok(Vec::new());
        }
        self.writer.write_planes(time, &planes, &gone)?;
        let centers = planes.iter().map(|plane| (Thing::Plane(plane.id), Some(plane.centroid)));
        let changed = gone.iter().map(|&id| (Thing::Plane(id), None)).chain(centers).collect();
        self.planes.retain(|id, _| !gone.contains(id));
        self.planes.extend(planes.into_iter().map(|plane| (plane.id, plane)));
        Ok(changed)
    }

    /// Returns which objects are other than before, with their centres.
    fn record_objects(
        &mut self,
        time: f64,
        map: &MultiLevelMap,
        changes: &ChangedThings<ObjectId>,
        up: Option<[f64; 3]>,
    ) -> Result<Vec<ChangedThing>, Error> {
        let changed = changes.confirmed.iter().chain(&changes.changed);
        let objects: Vec<_> = changed.filter_map(|&id| map.objects().object(id)).map(object_record).collect();
        let gone: Vec<u64> = gone(changes).map(ObjectId::get).collect();
        if objects.is_empty() && gone.is_empty() {
            return Ok(Vec::new());
        }
        self.writer.write_objects(time, &objects, &gone, up.unwrap_or([0.0, 0.0, 1.0]))?;
        let centers = objects.iter().map(|object| (Thing::Object(object.id), Some(object.translation)));
        let changed = gone.iter().map(|&id| (Thing::Object(id), None)).chain(centers).collect();
        self.objects.retain(|id, _| !gone.contains(id));
        self.objects.extend(objects.into_iter().map(|object| (object.id, object)));
        Ok(changed)
    }

    fn record_outlines(&mut self, time: f64, changed: Vec<ChangedThing>) -> Result<(), Error> {
        for (topic, things) in self.outlines.update(changed) {
            let (mut planes, mut objects) = (Vec::new(), Vec::new());
            for thing in things {
                match thing {
                    Thing::Plane(id) => planes.extend(self.planes.get(&id).cloned()),
                    Thing::Object(id) => objects.extend(self.objects.get(&id).cloned()),
                }
            }
            let lines = outline_cloud(&planes, &objects, LINE_SPACING);
            self.writer.write_cloud(&topic, time, &lines)?;
        }
        Ok(())
    }

    /// Puts a grid of a single unknown cell in the place of the one that is shown.
    fn clear_grid(&mut self, time: f64) -> Result<(), Error> {
        if self.grid.take().is_some() {
            let (resolution, world_from_grid) = (0.05, Pose::identity());
            let nothing = GridRecord { width: 1, height: 1, resolution, world_from_grid, cells: vec![-1] };
            self.writer.write_grid(time, &nothing)?;
        }
        Ok(())
    }

    /// Makes the grid that of the floor under a place: brings it up to date, or makes another where the
    /// camera has come to another floor.
    fn follow_floor(&mut self, at: [f64; 3], map: &MultiLevelMap, up: [f64; 3]) -> Result<(), Error> {
        let config = FloorGridConfig::default();
        // What is up is learnt more and more exactly.
        let is_same_up = |shown: &&mut ShownGrid| dot(shown.up, up) >= SAME_UP;
        let shown = self.grid.as_mut().filter(is_same_up).zip(self.recorded.as_ref());
        if let Some((shown, recorded)) = shown
            && shown.floor.update(recorded, map).is_ok()
            && map
                .start_of_floor(at, shown.up, &config)
                .is_ok_and(|plane| shown.floor.planes().contains(&plane))
        {
            return Ok(());
        }
        let floor = map.floor_grid(at, up, &config)?;
        self.grid = Some(ShownGrid { floor, up });
        Ok(())
    }

    /// Without a floor under the camera there is no grid, nor where it would have too many cells.
    fn record_grid(&mut self, time: f64, map: &MultiLevelMap, up: [f64; 3]) -> Result<(), Error> {
        let Some(at) = self.camera else { return Ok(()) };
        match self.follow_floor(at, map, up) {
            Ok(()) => {
                if let Some(shown) = &self.grid {
                    self.writer.write_grid(time, &grid_record(&shown.floor, at)?)?;
                }
                Ok(())
            }
            Err(Error::NoFloor { .. } | Error::Octree(dymlm_octree::Error::GridSize { .. })) => {
                self.clear_grid(time)
            }
            Err(error) => Err(error),
        }
    }
}

fn gone<Id: Copy>(changes: &ChangedThings<Id>) -> impl Iterator<Item = Id> + '_ {
    changes.merged.iter().map(|(gone, _)| *gone).chain(changes.removed.iter().copied())
}

/// The points of blocks, with a colour each.
fn cloud_of(points: &StaticPoints<'_>, blocks: &[[i32; 3]]) -> PointCloud {
    let (mut places, mut colors) = (Vec::new(), Vec::new());
    for &place in blocks {
        let block = points.block(place);
        places.extend(block.points);
        colors.extend(block.colors);
        colors.resize(places.len(), GREY);
    }
    PointCloud::with_colors(places, colors).unwrap_or_default()
}

/// A grid, laid at the height that the floor has under a place, or at the nearest place in the grid: a camera
/// that looks ahead need not stand over what it has seen.
fn grid_record(floor: &FloorGrid, at: [f64; 3]) -> Result<GridRecord, Error> {
    let grid = floor.grid();
    let [x, y, _] = grid.world_from_grid().inverse().transform_point(at);
    let origin = grid.origin();
    let nearest = |place: f64, origin: f64, cells: usize| {
        let half_cell = 0.5 * grid.resolution();
        place.clamp(origin + half_cell, origin + (cells.max(1) as f64 - 0.5) * grid.resolution())
    };
    let beside = [nearest(x, origin[0], grid.width()), nearest(y, origin[1], grid.height())];
    let height = floor.floor_height(beside).unwrap_or(0.0);
    let corner = Pose::new([origin[0], origin[1], height], [0.0, 0.0, 0.0, 1.0])?;
    let value = |cell: &CellState| match cell {
        CellState::Occupied => 100,
        CellState::Free => 0,
        CellState::Unknown => -1,
    };
    Ok(GridRecord {
        width: grid.width(),
        height: grid.height(),
        resolution: grid.resolution(),
        world_from_grid: grid.world_from_grid() * corner,
        cells: grid.cells().iter().map(value).collect(),
    })
}

#[cfg(test)]
mod tests {
    use dymlm_core::{Frame, PinholeCamera};
    use dymlm_test_support::{Rectangle, World, look_at};

    use super::*;
    use crate::{MapBuilder, MapConfig};

    /// A camera 1.7 m over a floor, in whose place the world begins, has seen the floor ahead.
    fn seen_ahead() -> (MapBuilder, Frame, Pose) {
        let world = World::of(&[Rectangle::level([0.0, 3.0, -1.7], 3.0, 3.0)]);
        let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).unwrap();
        let eye = look_at([0.0; 3], [0.0, 3.0, -1.7]);
        let mut builder = MapBuilder::new(MapConfig::offline()).unwrap();
        let frame = |time: f64| Frame::new(time, camera, world.depth(&camera, &eye), None).unwrap();
        for time in 0..4 {
            builder.insert(&frame(time.into()), &[], &eye).unwrap();
        }
        (builder, frame(4.0), eye)
    }

    #[test]
    fn the_grid_follows_the_maps() {
        let (mut builder, mut frame, eye) = seen_ahead();
        let (folder, up) = (tempfile::tempdir().unwrap(), [0.0, 0.0, 1.0]);
        let path = folder.path().join("session.mcap");
        let mut recorder = SessionRecorder::create(&path, &McapWriterOptions::default()).unwrap();
        let mut sizes = Vec::new();
        for step in 0..3 {
            // The floor goes on ahead.
            let eye = Pose::new([0.0, 1.5 * f64::from(step), 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap() * eye;
            for _ in 0..4 {
                frame.set_timestamp(frame.timestamp() + 1.0).unwrap();
                builder.insert(&frame, &[], &eye).unwrap();
            }
            // What is up is learnt more and more exactly.
            recorder.set_up([1e-4 * f64::from(step), 0.0, 1.0]);
            recorder.record_frame(&frame, None, &eye).unwrap();
            recorder.record_map(frame.timestamp(), builder.map()).unwrap();
            let anew = builder.map().floor_grid(eye.translation(), up, &FloorGridConfig::default()).unwrap();
            let shown = recorder.grid.as_ref().unwrap();
            assert_eq!(shown.up, up);
            assert!(shown.floor.grid().cells() == anew.grid().cells(), "step {step}");
            sizes.push(anew.grid().cells().len());
        }
        assert!(sizes.is_sorted_by(|a, b| a < b), "{sizes:?}");
    }

    /// Regression: it was drawn at the height of the camera.
    #[test]
    fn the_grid_lies_on_the_floor_also_where_the_camera_stands_beside_it() {
        let (builder, _, eye) = seen_ahead();
        let at = eye.translation();
        let floor = builder.map().floor_grid(at, [0.0, 0.0, 1.0], &FloorGridConfig::default()).unwrap();
        assert!(floor.floor_height([0.0; 2]).is_none());
        let [.., height] = grid_record(&floor, at).unwrap().world_from_grid.translation();
        assert!((height + 1.7).abs() < 0.02, "{height}");
    }

    /// Regression: maps that had come before the first pose were taken for recorded with their grid.
    #[test]
    fn the_grid_comes_as_soon_as_it_is_known_where_the_camera_is() {
        let (builder, frame, eye) = seen_ahead();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("session.mcap");
        let mut recorder = SessionRecorder::create(&path, &McapWriterOptions::default()).unwrap();
        recorder.set_up([0.0, 0.0, 1.0]);
        recorder.record_map(3.0, builder.map()).unwrap();
        assert!(recorder.grid.is_none());
        recorder.record_frame(&frame, None, &eye).unwrap();
        recorder.record_map(4.0, builder.map()).unwrap();
        assert!(recorder.grid.is_some());
    }
}
