use std::sync::Arc;

use dymlm_core::{Frame, PinholeCamera, Point, PointCloud, Pose, Rgb, SensorModel};

use crate::block_store::{BLOCK_SIDE, BlockKey, BlockStore, count};
use crate::direction::Direction;
use crate::evidence::Evidence;
use crate::fixed_point::{FixedPointFrame, ray_length};
use crate::frame_scratch::FrameScratch;
use crate::look_through::NEAREST;
use crate::paging::PageFile;
use crate::scan::Scan;
use crate::shared_kept::SharedKept;
use crate::support::Support;
use crate::thinning::Thinning;
use crate::verdict::Verdict;
use crate::voxel::SUBVOXELS;
use crate::voxel_block::VoxelBlock;
use crate::weighting::Weighting;
use crate::{CloudMapConfig, Error, MoverMasks, PlaceHistory};

/// The dense coloured cloud of the static world.
///
/// Each voxel holds the weighted mean of position and colour of the readings in it, weight 1 / sigma(z)^2
/// with the noise of the [`SensorModel`]. Besides the voxels, the map holds the evidence of all frames, which
/// decides on output which voxels are static: **late ghost removal**. Each cell, as large as some voxels,
/// counts the frames that read a surface in it, those that looked through it, before or after, and those that
/// read a [mover](MoverMasks) in it; a reading outweighs [a few looks](CloudMapConfig::looks_per_reading),
/// and a cell votes together with the cells around it, one of which nearly every frame must have read. Newer
/// counts outweigh older ones: what has stood somewhere for some seconds is believed, whatever was there for
/// hours. So movers that no detector has seen vanish too, people who sit do not stay where the detector has
/// missed them, and later frames correct a wrong verdict. Then **thinning** leaves out the noise around far
/// surfaces and what a single frame has seen ([`thinning_radius`](CloudMapConfig::thinning_radius),
/// [`min_observations`](CloudMapConfig::min_observations)), and **fusing** moves the voxels that are readings
/// of one surface onto that surface, as one layer of points
/// ([`fuse_surfaces`](CloudMapConfig::fuse_surfaces)).
///
/// Everything is summed in integers. Therefore the map does not depend on the order of frames,
/// [`CloudMap::remove`] takes a frame out exactly, and two maps [`merge`](CloudMap::merge) to what one map of
/// all frames would be.
///
/// Cost: O(pixels + blocks in view) a frame, independent of the number of frames before.
///
/// ```
/// use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose, SensorModel};
/// use dymlm_cloud::{CloudMap, CloudMapConfig, Selection};
///
/// let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5)?;
/// let wall = Frame::new(0.0, camera, DepthImage::new(64, 48, vec![2.0; 64 * 48])?, None)?;
///
/// let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect())?;
/// // What a single frame has seen may be noise: two are needed.
/// map.insert(&wall, None, &Pose::identity())?;
/// map.insert(&wall, None, &Pose::identity())?;
/// let cloud = map.point_cloud(Selection::Static);
/// assert!(cloud.points().iter().all(|point| (point[2] - 2.0).abs() < 1e-4));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct CloudMap {
    pub(crate) config: CloudMapConfig,
    weighting: Weighting,
    pub(crate) voxels: BlockStore<VoxelBlock>,
    pub(crate) voxel_count: usize,
    pub(crate) evidence: Evidence,
    pub(crate) thinning: Thinning,
    pub(crate) kept: SharedKept,
    /// Where blocks go that have no room in memory, for a map with a budget.
    pub(crate) page_file: Option<Arc<PageFile>>,
    frames: u32,
    /// Number of the last change, for [`VoxelBlock::stamp`].
    pub(crate) stamp: u32,
    /// Whether the current frame has taken more out of any voxel than had been put in.
    is_overdrawn: bool,
    /// For the current frame.
    pub(crate) scratch: FrameScratch,
}

/// What a frame has done to the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct CloudFrameReport {
    /// Static readings in range.
    pub readings: usize,
    /// Voxels that the readings fell into.
    pub voxels: usize,
    /// Those of the voxels that were empty before.
    pub new_voxels: usize,
}

/// One voxel of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct CloudVoxel {
    /// Weighted mean position, metres, world.
    pub position: Point,
    /// Weighted mean colour of the readings that had one.
    pub color: Option<Rgb>,
    /// Sum of weights; one reading with the sensor's least noise weighs 1.
    pub weight: f64,
    /// Number of frames that read it.
    pub observations: u32,
    /// How many frames speak for and against the voxel's cell of the evidence, over all time.
    pub evidence: Support,
    /// The verdict that follows from the evidence there and around.
    pub verdict: Verdict,
}

/// Which voxels of a map are meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Selection {
    /// All voxels that were read.
    All,
    /// Those whose verdict is [`Verdict::Static`].
    Static,
}

/// Number of blocks that are fetched from memory at once: with some 50 voxels each they fit into a
/// processor's nearest cache.
const FETCHED: usize = 16;
/// Most blocks of 8^3 cells of the evidence that may fit between a camera and its readings. A lower value refuses
/// sensors of a long range, a higher one lets a frame whose focal lengths are in millimetres fill the memory.
const MOST_VIEW_BLOCKS: f64 = 2_097_152.0;

impl CloudMap {
    /// An empty map.
    ///
    /// # Errors
    ///
    /// [`Error::Config`] names the field of the config or of the sensor outside its range.
    pub fn new(config: CloudMapConfig, sensor: SensorModel) -> Result<Self, Error> {
        sensor.validate()?;
        config.validate(&sensor)?;
        let evidence = Evidence::new(config.voxel_size, sensor);
        let weighting = Weighting::new(sensor);
        let thinning = Thinning::new(&config, weighting);
        Ok(Self {
            config,
            weighting,
            voxels: BlockStore::default(),
            voxel_count: 0,
            evidence,
            thinning,
            kept: SharedKept::default(),
            page_file: None,
            frames: 0,
            stamp: 0,
            is_overdrawn: false,
            scratch: FrameScratch::default(),
        })
    }

    /// Checks that the map reaches as far as a frame's readings, and can note what the frame looks through: an
    /// insertion refuses a pose for no other reason.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfReach`], [`Error::ViewTooLarge`].
    pub fn check_reach(&self, frame: &Frame, world_from_camera: &Pose) -> Result<(), Error> {
        self.lattice_of(frame, None, world_from_camera).map(|_| ())
    }

    /// Adds the static pixels of a frame (all pixels without masks), and notes where its movers are.
    ///
    /// # Errors
    ///
    /// [`Error::Core`] for a mask of another size than the frame; [`Error::OutOfReach`];
    /// [`Error::ViewTooLarge`].
    pub fn insert(
        &mut self,
        frame: &Frame,
        masks: Option<MoverMasks<'_>>,
        world_from_camera: &Pose,
    ) -> Result<CloudFrameReport, Error> {
        let lattice = self.lattice_of(frame, masks, world_from_camera)?;
        let report = self.apply(frame, masks, world_from_camera, &lattice, Direction::Insert);
        Ok(report)
    }

    /// Takes a frame out again: pose and masks must be those with which it was inserted. All sums and counts
    /// are exactly those without it; what the evidence had joined to one period of time for it stays joined.
    /// Blocks in which nothing is left are dropped, so that memory follows what the map holds; where there
    /// are any, O(blocks held).
    ///
    /// # Errors
    ///
    /// As [`CloudMap::insert`]; [`Error::NotInserted`] when a sum would go negative. (A frame that was never
    /// inserted is not noticed if other frames cover each of its readings as well.)
    pub fn remove(
        &mut self,
        frame: &Frame,
        masks: Option<MoverMasks<'_>>,
        world_from_camera: &Pose,
    ) -> Result<(), Error> {
        self.remove_counts(frame, masks, world_from_camera)?;
        self.drop_void_blocks();
        Ok(())
    }

    /// The same without dropping the blocks in which nothing is left: slots stay as they are.
    pub(crate) fn remove_counts(
        &mut self,
        frame: &Frame,
        masks: Option<MoverMasks<'_>>,
        world_from_camera: &Pose,
    ) -> Result<(), Error> {
        let lattice = self.lattice_of(frame, masks, world_from_camera)?;
        self.take_out(frame.timestamp(), |map| {
            map.apply(frame, masks, world_from_camera, &lattice, Direction::Remove);
        })
    }

    /// Takes out what `apply` does, or nothing when it was never put in. A copy of the map is the way back: what a
    /// time at which nothing was inserted makes of the evidence's periods cannot be undone.
    pub(crate) fn take_out(&mut self, timestamp: f64, apply: impl FnOnce(&mut Self)) -> Result<(), Error> {
        let before = self.clone();
        apply(self);
        if self.is_overdrawn() {
            *self = before;
            return Err(Error::NotInserted { timestamp });
        }
        self.drop_empty_voxels();
        // The newest frame is still the newest, unless it was this one.
        self.evidence.set_newest(before.evidence.newest());
        Ok(())
    }

    /// Adds another map in the same world frame, as if its frames had been inserted here.
    ///
    /// # Errors
    ///
    /// [`Error::DifferentConfigs`].
    pub fn merge(&mut self, other: &Self) -> Result<(), Error> {
        if self.config != other.config || self.weighting != other.weighting {
            return Err(Error::DifferentConfigs);
        }
        let (stamp, seen) = (self.next_stamp(), self.kept.stamp());
        for (key, theirs) in other.voxels.keys().iter().zip(other.voxels.blocks().iter()) {
            let slot = self.voxels.slot_or_insert(*key);
            let Some(block) = self.voxels.begin_change(slot, stamp, seen) else { continue };
            let (count, theirs) = (block.len(), theirs.look());
            theirs.iter().for_each(|(place, voxel)| block.merge(place, &voxel));
            self.voxel_count += block.len() - count;
        }
        self.evidence.merge(&other.evidence);
        self.frames = self.frames.wrapping_add(other.frames);
        Ok(())
    }

    /// The static voxels, or all, in a fixed order: by blocks of 8^3, z first, then y, then x, and in the
    /// same order within each block. They are as they were read: [fusing](CloudMapConfig::fuse_surfaces)
    /// moves the points of [`CloudMap::point_cloud`] and [`CloudMap::static_points`], which are fewer.
    pub fn voxels(&self, selection: Selection) -> impl Iterator<Item = CloudVoxel> + '_ {
        let cloud = self.kept_cloud();
        let slots = self.voxels.sorted_slots().into_iter().map(|slot| (slot, cloud.judgement(slot)));
        // The lock ends here, so that the map can be queried during the iteration.
        slots.collect::<Vec<_>>().into_iter().flat_map(move |(slot, judgement)| {
            let (key, block) = (self.voxels.keys()[slot], self.voxels.blocks()[slot].look());
            let chosen = match selection {
                Selection::All => *block.places().cells(),
                Selection::Static => judgement.statics,
            };
            let evidence = self.evidence.look_over(key.cell(0));
            block.voxels(&chosen).into_iter().map(move |(place, voxel)| {
                let cell = key.cell(place);
                CloudVoxel {
                    position: voxel.mean_position(cell, self.config.voxel_size),
                    color: voxel.mean_color(),
                    weight: self.weighting.total(voxel.sums.weight),
                    observations: voxel.observations,
                    evidence: self.evidence.of_voxel_in(evidence.as_deref(), cell),
                    verdict: judgement.of(place),
                }
            })
        })
    }

    /// The cloud, metres, world. [`Selection::All`] has a point for each voxel. [`Selection::Static`] has a
    /// point for each voxel in which points of static voxels lie after
    /// [fusing](CloudMapConfig::fuse_surfaces): that of the heaviest of these. By blocks in the order of
    /// [`CloudMap::voxels`], and so within each block. It has colours when any of its voxels has one; points
    /// without colour are black.
    ///
    /// The static cloud is kept from call to call, some 23 bytes a point: reading it again costs what has
    /// changed, and the copy.
    pub fn point_cloud(&self, selection: Selection) -> PointCloud {
        if selection == Selection::Static {
            return self.kept_cloud().to_point_cloud(&self.voxels);
        }
        let slots = self.voxels.sorted_slots().into_iter();
        let voxels = slots.flat_map(|slot| {
            let (key, block) = (self.voxels.keys()[slot], self.voxels.blocks()[slot].look());
            block.iter().map(move |(place, voxel)| {
                (voxel.mean_position(key.cell(place), self.config.voxel_size), voxel.mean_color())
            })
        });
        let (points, colors): (Vec<Point>, Vec<Option<Rgb>>) = voxels.unzip();
        if colors.iter().all(Option::is_none) {
            return PointCloud::new(points);
        }
        let colors = colors.into_iter().map(Option::unwrap_or_default).collect();
        PointCloud::with_colors(points, colors).unwrap_or_default()
    }

    /// What was seen of a place (metres, world) over time: since when something has stood there, or until
    /// when it did. Empty for a place that was never seen or that lies beyond the map's reach. O(periods).
    pub fn history(&self, place: [f64; 3]) -> PlaceHistory {
        let voxel = self.voxel_at(place);
        let history = |voxel| self.evidence.history(voxel, self.config.looks_per_reading as f32);
        voxel.map_or_else(PlaceHistory::default, history)
    }

    /// The voxel of a place, metres, world; `None` beyond the map's reach.
    pub(crate) fn voxel_at(&self, place: [f64; 3]) -> Option<[i32; 3]> {
        let voxel = place.map(|c| (c / self.config.voxel_size).floor());
        let is_in_reach = voxel.iter().all(|c| c.abs() < f64::from(BlockKey::LIMIT));
        is_in_reach.then(|| voxel.map(|c| c as i32))
    }

    /// Number of points of the static cloud ([`Selection::Static`]). Like every query of the static cloud, it
    /// costs what has changed since the last query.
    pub fn len(&self) -> usize {
        self.kept_cloud().len()
    }

    /// Whether the static cloud is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of voxels, static or not: the points of [`Selection::All`]. O(1).
    pub fn held_voxels(&self) -> usize {
        self.voxel_count
    }

    /// Number of frames in the map.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// The sensor whose frames are inserted.
    pub fn sensor(&self) -> &SensorModel {
        self.weighting.sensor()
    }

    /// The config.
    pub fn config(&self) -> &CloudMapConfig {
        &self.config
    }

    /// Approximate bytes that the map holds.
    pub fn memory_bytes(&self) -> usize {
        self.own_bytes(None)
    }

    /// Approximate bytes that the map does not share with another state of it. O(blocks that they do not
    /// share + blocks / 64).
    pub fn memory_bytes_beside(&self, other: &Self) -> usize {
        self.own_bytes(Some(other))
    }

    fn own_bytes(&self, other: Option<&Self>) -> usize {
        let none = BlockStore::default();
        let voxels = other.map_or(&none, |other| &other.voxels);
        self.voxels.memory_bytes_beside(voxels, |block, _| block.memory_bytes())
            + self.evidence.memory_bytes_beside(other.map(|other| &other.evidence))
            + self.kept.memory_bytes_beside(other.map(|other| &other.kept))
            + self.scratch.memory_bytes()
    }

    /// Checks everything that can be wrong with a frame, before anything changes.
    fn lattice_of(
        &self,
        frame: &Frame,
        masks: Option<MoverMasks<'_>>,
        world_from_camera: &Pose,
    ) -> Result<FixedPointFrame, Error> {
        if let Some(masks) = masks {
            masks.check(frame.camera())?;
        }
        self.check_view(frame)?;
        self.lattice_around(ray_length(frame.camera()), world_from_camera)
    }

    /// Checks that what a frame looks through is not too much to be noted. O(1), but O(pixels) for a frame that
    /// might look through too much.
    fn check_view(&self, frame: &Frame) -> Result<(), Error> {
        if self.maps_every_view(frame.camera()) {
            return Ok(());
        }
        let (most, max_depth) = (self.most_volume(), f64::from(self.weighting.sensor().max_depth));
        // Blocks that reach nearer than this are looked into whatever was read, or was not.
        let diagonal = 3.0_f64.sqrt() * self.evidence.cell_size() * BLOCK_SIDE as f64;
        let nearest = f64::from(self.weighting.sensor().min_depth.max(NEAREST)) + diagonal;
        let depths = frame.depth().data().iter().map(|&z| f64::from(z).max(nearest).min(max_depth));
        let volume: f64 = depths.map(|z| volume_before(frame.camera(), z)).sum();
        if volume <= most {
            return Ok(());
        }
        Err(Error::ViewTooLarge { volume, most, voxel_size: self.config.voxel_size })
    }

    /// Whether no image of a camera looks through more than can be noted, whatever it shows.
    pub fn maps_every_view(&self, camera: &PinholeCamera) -> bool {
        let farthest = volume_before(camera, f64::from(self.weighting.sensor().max_depth));
        (camera.width() * camera.height()) as f64 * farthest <= self.most_volume()
    }

    /// Most that a frame may look through, cubic metres.
    fn most_volume(&self) -> f64 {
        MOST_VIEW_BLOCKS * (self.evidence.cell_size() * BLOCK_SIDE as f64).powi(3)
    }

    /// The lattice for readings up to the sensor's greatest depth times `longest_ray` away.
    pub(crate) fn lattice_around(
        &self,
        longest_ray: f64,
        world_from_sensor: &Pose,
    ) -> Result<FixedPointFrame, Error> {
        let voxel_size = self.config.voxel_size;
        let limit = BlockKey::LIMIT.min(i32::MAX / SUBVOXELS) * SUBVOXELS;
        let farthest = longest_ray * f64::from(self.weighting.sensor().max_depth);
        FixedPointFrame::new(farthest, world_from_sensor, voxel_size, self.weighting, limit).ok_or_else(
            || Error::OutOfReach {
                translation: world_from_sensor.translation(),
                farthest,
                voxel_size,
                reach: f64::from(limit / SUBVOXELS) * voxel_size,
            },
        )
    }

    fn apply(
        &mut self,
        frame: &Frame,
        masks: Option<MoverMasks<'_>>,
        world_from_camera: &Pose,
        lattice: &FixedPointFrame,
        direction: Direction,
    ) -> CloudFrameReport {
        self.begin_frame(frame.timestamp(), direction);
        let camera: &PinholeCamera = frame.camera();
        let ray_x = &mut self.scratch.ray_x;
        ray_x.clear();
        ray_x.extend((0..camera.width()).map(|u| ((u as f64 - camera.cx()) / camera.fx()) as f32));
        let report = self.add_readings(frame, masks, lattice, direction);
        self.evidence.count_frame(frame.camera(), frame.depth(), world_from_camera, direction);
        report
    }

    fn begin_frame(&mut self, timestamp: f64, direction: Direction) {
        self.evidence.begin_frame(timestamp);
        self.frames = self.frames.wrapping_add(direction.unit());
        self.scratch.readings.clear();
        self.is_overdrawn = false;
        self.next_stamp();
    }

    /// Puts a scan in, or takes it out.
    pub(crate) fn apply_scan(
        &mut self,
        scan: Scan<'_>,
        lattice: &FixedPointFrame,
        direction: Direction,
    ) -> CloudFrameReport {
        self.begin_frame(scan.timestamp, direction);
        lattice.fill_points(&mut self.scratch.row, scan.points);
        self.sort_row();
        let report = self.add_blocks(false, direction);
        self.evidence.count_scan(scan, direction);
        report
    }

    /// Puts a block of voxels where there is none.
    #[cfg(feature = "state")]
    pub(crate) fn put_block(&mut self, key: BlockKey, block: VoxelBlock) {
        self.voxel_count += block.len();
        let stamp = block.stamp;
        let slot = self.voxels.put(key, block);
        self.voxels.stamps_mut().note(slot, stamp);
    }

    /// Goes on from where a saved map was. All blocks count as changed, since the static cloud is not saved.
    #[cfg(feature = "state")]
    pub(crate) fn restore(&mut self, frames: u32, epoch: i32, revision: u32) {
        (self.frames, self.stamp) = (frames, 1);
        self.evidence.restore(epoch, revision);
    }

    /// A new stamp, for what changes from now on.
    pub(crate) fn next_stamp(&mut self) -> u32 {
        self.stamp = self.stamp.wrapping_add(1);
        if self.stamp == 0 {
            // The stamps overflow once in 2^32 frames: no block may carry a stamp that comes again.
            self.voxels.blocks_mut().for_each(|block| (block.stamp, block.lowered) = (1, 0));
            self.voxels.stamps_mut().set_all(1);
            self.kept.clear();
            self.stamp = 2;
        }
        self.stamp
    }

    fn add_readings(
        &mut self,
        frame: &Frame,
        masks: Option<MoverMasks<'_>>,
        lattice: &FixedPointFrame,
        direction: Direction,
    ) -> CloudFrameReport {
        let (width, inverse_fy) = (frame.camera().width(), 1.0 / frame.camera().fy());
        for (v, depths) in frame.depth().data().chunks_exact(width).enumerate() {
            let pixels = v * width..(v + 1) * width;
            let colors = frame.color().and_then(|color| color.data().get(pixels));
            let ray_y = ((v as f64 - frame.camera().cy()) * inverse_fy) as f32;
            lattice.fill(
                &mut self.scratch.row,
                v,
                ray_y,
                &self.scratch.ray_x,
                depths,
                colors,
                masks.map(|masks| masks.static_mask()),
            );
            self.sort_row();
            if let Some(masks) = masks {
                self.note_unmapped(&masks, v, depths);
            }
        }
        self.add_blocks(frame.color().is_some(), direction)
    }

    /// Sorts the readings of the row by the blocks of voxels that they lie in.
    fn sort_row(&mut self) {
        let (voxels, FrameScratch { row, readings, .. }) = (&mut self.voxels, &mut self.scratch);
        readings.extend(row.readings(), |key| voxels.slot_or_insert(key));
    }

    /// Adds the frame's readings to the voxels, block by block, and notes in the evidence what was read.
    fn add_blocks(&mut self, are_colored: bool, direction: Direction) -> CloudFrameReport {
        let FrameScratch { readings, sums, .. } = &mut self.scratch;
        let mut report = CloudFrameReport { readings: readings.len(), ..CloudFrameReport::default() };
        let (stamp, seen) = (self.stamp, self.kept.stamp());
        for (number, &slot) in readings.slots().iter().enumerate() {
            if number % FETCHED == 0 {
                self.voxels.fetch(&readings.slots()[number..readings.slots().len().min(number + FETCHED)]);
            }
            readings.for_each_in(number, |reading| sums.add(reading));
            if direction == Direction::Remove {
                sums.negate();
            }
            report.voxels += count(sums.read());
            self.evidence.read_voxels(self.voxels.keys()[slot], sums.read());
            let Some(block) = self.voxels.begin_change(slot, stamp, seen) else {
                sums.clear();
                continue;
            };
            let read = *sums.read();
            report.new_voxels += block.add_frame(sums, are_colored);
            self.is_overdrawn |= direction == Direction::Remove && block.is_overdrawn(&read);
        }
        self.voxel_count += report.new_voxels;
        report
    }

    /// Notes the cells of the evidence that were read without being mapped: as a mover, or as something new.
    fn note_unmapped(&mut self, masks: &MoverMasks<'_>, v: usize, depths: &[f32]) {
        let sensor = *self.weighting.sensor();
        let is_used = |u: &usize| depths.get(*u).is_some_and(|&z| sensor.is_used(z));
        for u in masks.mover_columns(v).filter(is_used) {
            self.evidence.read_mover(self.scratch.row.cell(u));
        }
        for u in masks.unproven_columns(v).filter(is_used) {
            self.evidence.read(self.scratch.row.cell(u));
        }
    }

    /// Whether the frame that was just taken out had not been in the map.
    pub(crate) fn is_overdrawn(&self) -> bool {
        self.frames > u32::MAX / 2 || self.evidence.is_overdrawn() || self.is_overdrawn
    }

    /// Drops the voxels that the last removal has emptied.
    pub(crate) fn drop_empty_voxels(&mut self) {
        for &slot in self.scratch.readings.slots() {
            if let Some(block) = self.voxels.block_mut(slot) {
                block.lowered = self.stamp;
                self.voxel_count -= block.drop_empty();
            }
        }
    }
}

/// Volume of the pyramid between a camera and a pixel of depth z, cubic metres.
fn volume_before(camera: &PinholeCamera, z: f64) -> f64 {
    z.powi(3) / (3.0 * (camera.fx() * camera.fy()).abs())
}
