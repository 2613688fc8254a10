mod associating;
mod confirmation;
mod dropping;
mod forgetting;
mod merging;
mod moved_body;
mod removal;
mod renaming;
#[cfg(feature = "state")]
mod saved_state;

use std::sync::Arc;

use dymlm_core::paging::{FiledMap, PageFile};
use dymlm_core::vector3::norm;
use dymlm_core::{Birth, DepthView, Frame, FrameId, MergedIds, Names, PlaneId, Pose, SensorModel};

use self::associating::Pairing;
use self::dropping::Dropped;
use self::merging::Seen;
use super::config::PlaneMapConfig;
use super::gap_record::{GapRecord, PlanePair, pair_of};
use super::insertion::Insertion;
use super::key_frame::{KeyFrame, Places, Share};
use super::looks::Look;
use super::map_plane::{MapPlane, ShapeSettings};
use super::placed_share::{PlacedShare, reach_of_planes};
use super::report::PlaneReport;
use crate::association::Criterion;
use crate::detector::DetectedPlane;
use crate::error::Error;
use crate::patches::{PlaneIndex, VoxelBox, VoxelLists};
use crate::shared_map::SharedMap;

/// The map of finite planes (paper III-B).
///
/// A key frame's planes are transformed to the world, associated with the planes of the map, and fused with
/// them; then planes of the map that have become one are merged. The association is the paper's
/// (equations 1 and 2) with corrections; see [`AssociationConfig`](crate::AssociationConfig).
///
/// Coplanar patches that do not adjoin are one surface if something nearer occludes the gap (a wall behind a
/// person, a floor on both sides of a table), and two if the gap can be looked through (two desks of one
/// height). Each key frame that touches one of the two checks what it sees on the shortest ways between them;
/// the two merge when enough key frames saw these ways occluded and hardly any looked through. A merge is not
/// undone when a later key frame looks through after all.
///
/// Parallel surfaces with a step between them that a key frame shows to be larger than the noise, as a book
/// and the table on which it lies, stay two planes, though they are near enough to pass for one; unless ten
/// times as many key frames, from near enough to see such a step, read one surface there.
///
/// All sums are integers, and what each key frame has seen is stored in its camera's frame, as sums and a
/// coded label image: 1 to 2 kB. So [`PlaneMap::remove`] removes a key frame exactly: the planes are as if it
/// had added nothing, and merges that it caused, or for which it was needed as a witness of an occlusion, are
/// undone.
///
/// Errors of a pose are shared by all that a camera at rest sees. So of the key frames from about one place
/// the first 20 count fully in where a plane lies, and all later ones together as much as 20 more. What each
/// of them counts was decided when it came, and stays when those before it are removed.
///
/// The cost of an insertion depends on what the frame sees, not on the size and age of the map and its
/// planes: voxels are stored in blocks, a spatial index finds the planes, and earlier key frames are visited
/// only when planes merge, back to the first one that saw the younger plane.
///
/// A clone shares planes, their blocks and what the key frames have seen; each of these is copied when it
/// changes.
#[derive(Debug, Clone)]
pub struct PlaneMap {
    config: PlaneMapConfig,
    sensor: SensorModel,
    criterion: Criterion,
    pub(super) planes: SharedMap<Birth, MapPlane>,
    index: PlaneIndex,
    pub(super) key_frames: FiledMap<FrameId, KeyFrame>,
    /// The look of the last key frame.
    look: Option<Look>,
    /// For each merged plane, the plane into which it was merged.
    merged: MergedIds<Birth>,
    /// Planes that were never confirmed, and are no longer there.
    dropped: Dropped,
    /// What the key frames saw between the present planes.
    gaps: GapRecord,
    names: Names<PlaneId>,
    /// What the ids of merged planes lead to, including ids of an earlier map that this one replaced. Only
    /// queries by id depend on them.
    merged_ids: MergedIds<PlaneId>,
    next_key_frame: u64,
}

/// Pages of 64 key frames that stay in memory: the newest, of which not all key frames have come yet, and the one
/// before. Planes that merge have mostly been found by one of these.
const PAGES_IN_MEMORY: usize = 2;

impl PlaneMap {
    /// An empty map.
    ///
    /// # Errors
    ///
    /// [`Error::Config`] names the field outside its range.
    pub fn new(config: PlaneMapConfig, sensor: SensorModel) -> Result<Self, Error> {
        config.validate()?;
        sensor.validate()?;
        Ok(Self {
            criterion: Criterion::new(&config.association, config.voxel_size),
            config,
            sensor,
            planes: SharedMap::default(),
            index: PlaneIndex::default(),
            key_frames: FiledMap::default(),
            look: None,
            merged: MergedIds::default(),
            dropped: Dropped::new(),
            gaps: GapRecord::default(),
            names: Names::default(),
            merged_ids: MergedIds::default(),
            next_key_frame: 0,
        })
    }

    /// Adds the planes of a key frame, given in its camera's frame, and checks in its depth image the gaps
    /// between planes of the map that may be one surface behind something: see
    /// [`max_occluded_gap`](crate::AssociationConfig::max_occluded_gap).
    ///
    /// # Errors
    ///
    /// [`Error::OutOfReach`] when a plane is too far from the world's origin to be summed exactly. The map
    /// stays as it was.
    #[doc(alias = "integrate")]
    pub fn insert(
        &mut self,
        detected: &[DetectedPlane],
        frame: &Frame,
        world_from_camera: &Pose,
    ) -> Result<PlaneReport, Error> {
        let (mut key_frame, labels) = KeyFrame::new(detected, frame.timestamp(), world_from_camera);
        let placed = self.bring_to_world(&key_frame, &Places::of_labels(&labels))?;
        let seen = placed.iter().map(|share| share.patch.bounds());
        let region = seen.fold(VoxelBox::default(), |all, one| all.union(&one));
        let steps = key_frame.steps(&labels, &self.criterion, &self.sensor);
        let parted: Vec<[usize; 2]> = steps.iter().map(|(pair, _)| *pair).collect();
        let pairings = self.associate(&placed, &parted);
        key_frame.look = self.look_at(world_from_camera);
        let (look, lattice) = (key_frame.look, key_frame.lattice);
        let mut insertion = self.fuse(placed, &pairings, key_frame);
        let view = DepthView::new(frame.camera(), frame.depth(), &self.sensor);
        let of_births = |([a, b], height): ([usize; 2], u32)| {
            (pair_of(insertion.associations[a], insertion.associations[b]), height)
        };
        let steps: Vec<(PlanePair, u32)> = steps.into_iter().map(of_births).collect();
        let seen = Seen { labels: &labels, lattice, steps: &steps, view: &view };
        let gap_looks = self.look_between(&insertion, &seen, &region, &world_from_camera.inverse());
        let missed = self.missed_by(&insertion, &view, world_from_camera);
        self.gaps.add(&gap_looks);
        self.key_frames.update(insertion.key_frame, |key_frame| {
            (key_frame.gap_looks, key_frame.missed) = (gap_looks, missed.clone());
        });
        self.count_missed(&missed, look);
        self.merge(&mut insertion, &region);
        self.confirm(insertion.associations.iter().chain(&missed).copied());
        self.drop_refuted(missed);
        Ok(insertion.report(&self.names))
    }

    /// Whether every plane within 100 m of a camera at this pose can be mapped.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfReach`] names the camera's position.
    pub fn check_reach(&self, world_from_camera: &Pose) -> Result<(), Error> {
        let centroid = world_from_camera.translation();
        let reach = reach_of_planes(self.config.voxel_size) - 100.0;
        let within = centroid.iter().all(|c| c.abs() < reach);
        if within { Ok(()) } else { Err(Error::OutOfReach { centroid, reach }) }
    }

    /// The confirmed planes, in the order in which they came into the map. For the conditions see
    /// [`min_observations`](PlaneMapConfig::min_observations) and
    /// [`min_observation_share`](PlaneMapConfig::min_observation_share).
    pub fn iter(&self) -> impl Iterator<Item = &MapPlane> {
        self.planes.values().filter(|plane| plane.is_confirmed)
    }

    /// Whether this map holds the very same plane: a plane of a clone that neither has changed since.
    pub fn holds(&self, plane: &MapPlane) -> bool {
        self.planes.get(&plane.birth).is_some_and(|own| std::ptr::eq(own, plane))
    }

    /// The planes that are not confirmed, or no longer, in the same order. Those with too few sightings to be
    /// confirmed are dropped when they have been looked at in vain so often that another whole look that sees
    /// them would not bring them to [`min_observation_share`](PlaneMapConfig::min_observation_share), or when
    /// they stand in free space and the camera has left.
    pub fn candidates(&self) -> impl Iterator<Item = &MapPlane> {
        self.planes.values().filter(|plane| !plane.is_confirmed)
    }

    /// The confirmed planes that may have inliers in a box, in the order of their births.
    pub(crate) fn confirmed_near(&self, region: VoxelBox) -> impl Iterator<Item = &MapPlane> {
        self.near(region).filter(|plane| plane.is_confirmed)
    }

    /// Whether a plane is the upper side of something flat that lies on another, larger plane: key frames have
    /// shown the step between them, and it is so low that without that they would pass for one.
    pub(crate) fn lies_flat_on(&self, plane: &MapPlane, other: &MapPlane) -> bool {
        let step = other.plane().signed_distance(plane.centroid());
        self.gaps.is_step(pair_of(plane.birth, other.birth))
            && (0.0..self.config.association.max_distance).contains(&step)
            && other.patch.len() > plane.patch.len()
    }

    /// The planes, confirmed or not, that may have inliers in a box, in the order of their births.
    fn near(&self, region: VoxelBox) -> impl Iterator<Item = &MapPlane> {
        self.index.near(&region).into_iter().filter_map(|birth| self.planes.get(&birth))
    }

    /// The box (lowest and highest corner, metres) in which a place may hold an inlier or have one a voxel away,
    /// and a voxel more for rounding. `None` before any plane has come.
    pub(crate) fn region(&self) -> Option<[[f64; 3]; 2]> {
        let bounds = self.index.bounds().grown(2);
        let corner = |voxel: [i32; 3], end: f64| voxel.map(|c| (f64::from(c) + end) * self.config.voxel_size);
        (!bounds.is_empty()).then(|| [corner(bounds.min, 0.0), corner(bounds.max, 1.0)])
    }

    /// A distance from a point, metres, beyond which there is no inlier.
    pub(crate) fn farthest_from(&self, point: [f64; 3]) -> f64 {
        let bounds = self.index.bounds();
        let side = |axis: usize| {
            let ends = [bounds.min[axis], bounds.max[axis]].map(f64::from);
            let away = ends.map(|c| (c * self.config.voxel_size - point[axis]).abs());
            away[0].max(away[1]) + self.config.voxel_size
        };
        if bounds.is_empty() { 0.0 } else { norm(std::array::from_fn(side)) }
    }

    /// The plane with an id, confirmed or not; for an id that was merged away, the plane that it became.
    pub fn plane(&self, id: PlaneId) -> Option<&MapPlane> {
        self.planes.get(&self.names.birth(self.merged_ids.current(id))?)
    }

    /// The present id of a plane, after merges; `None` when it is not in the map.
    pub fn current_id(&self, id: PlaneId) -> Option<PlaneId> {
        self.plane(id).map(MapPlane::id)
    }

    /// A number that grows whenever [`Self::current_id`] of a plane may have changed by a merge, or by one
    /// that was undone. Planes that come and go leave it as it is. It is not saved.
    pub fn ids_revision(&self) -> u64 {
        self.merged_ids.revision()
    }

    /// Number of confirmed planes. O(planes).
    pub fn len(&self) -> usize {
        self.iter().count()
    }

    /// Whether no plane is confirmed.
    pub fn is_empty(&self) -> bool {
        self.iter().next().is_none()
    }

    /// The config.
    pub fn config(&self) -> &PlaneMapConfig {
        &self.config
    }

    /// Approximate size in bytes of all that grows: planes with their voxels and the spatial index; what each
    /// key frame has seen, looked at and merged; ids that were merged away. It includes what clones share,
    /// but not the allocator's overhead. O(key frames + blocks of voxels).
    pub fn memory_bytes(&self) -> usize {
        self.own_bytes(None)
    }

    /// What [`memory_bytes`](Self::memory_bytes) counts, but for planes and key frames that another state of
    /// the map shares. O(key frames + blocks of voxels that they do not share).
    pub fn memory_bytes_beside(&self, other: &Self) -> usize {
        self.own_bytes(Some(other))
    }

    fn own_bytes(&self, other: Option<&Self>) -> usize {
        let key_frames = other.map(|other| &other.key_frames);
        self.planes.memory_bytes_beside(other.map(|other| &other.planes), MapPlane::memory_bytes_beside)
            + self.key_frames.memory_bytes_beside(key_frames, KeyFrame::memory_bytes)
            + self.index.memory_bytes_beside(other.map(|other| &other.index))
            + self.merged.memory_bytes()
            + self.merged_ids.memory_bytes()
            + self.names.memory_bytes()
            + self.gaps.memory_bytes()
            + self.dropped.len() * size_of::<(Birth, Option<FrameId>)>()
    }

    /// Puts what older key frames have seen into a file, for the clones that share it as well: it is read again
    /// when planes merge that have long been known, and for everything that goes through all key frames. The
    /// newest 64 key frames, at least, stay in memory. O(key frames / 64).
    ///
    /// # Errors
    ///
    /// Those of writing; then the rest stays in memory. When the file cannot be read later,
    /// [`PageFile::failure`] says so, and what key frames have seen is lost.
    pub fn page_out(&self, file: &Arc<PageFile>) -> std::io::Result<()> {
        self.key_frames.page_out(PAGES_IN_MEMORY, file)
    }

    fn bring_to_world(&self, key_frame: &KeyFrame, places: &Places) -> Result<Vec<PlacedShare>, Error> {
        let mut lists = VoxelLists::default();
        let place = |share| key_frame.placed(share, places, self.config.voxel_size, &mut lists);
        key_frame.shares.iter().map(place).collect()
    }

    /// The look of the next key frame, given by its first: the last look, unless the camera has moved.
    fn look_at(&mut self, world_from_camera: &Pose) -> FrameId {
        let last = self.look.filter(|look| look.includes(world_from_camera));
        let next = || Look::begun_by(FrameId::new(self.next_key_frame), world_from_camera);
        self.look.insert(last.unwrap_or_else(next)).first
    }

    fn fuse(
        &mut self,
        placed: Vec<PlacedShare>,
        pairings: &[Option<Pairing>],
        mut key_frame: KeyFrame,
    ) -> Insertion {
        let (mut insertion, shape) = (Insertion::of(FrameId::new(self.next_key_frame)), self.shape());
        self.next_key_frame += 1;
        let (look, pose) = (key_frame.look, key_frame.world_from_camera);
        let shares = placed.into_iter().zip(&mut key_frame.shares);
        for ((placed, share), pairing) in shares.zip(pairings) {
            share.plane = if let Some(pairing) = pairing {
                share.is_flipped = pairing.agreement.flipped;
                insertion.updated.push(pairing.plane);
                pairing.plane
            } else {
                let (birth, _) = self.names.add();
                insertion.created.push(birth);
                birth
            };
            let birth = share.plane;
            let new = || MapPlane::new((birth, self.names.id(birth)), placed.plane, shape);
            let into = self.planes.get_or_insert_with(birth, new);
            share.counted = into.sightings.looks.next_weight(look);
            let own = |share: &Share| share.moments_at(&pose, &placed.plane).unwrap_or_default();
            let mut moments = own(share);
            if !into.moments.has_room_for(&moments) {
                share.counted = f32::MIN_POSITIVE;
                moments = own(share);
            }
            into.moments.add(&moments);
            into.patch.add(&placed.patch, |block| self.index.add(block, birth));
            insertion.associations.push(birth);
        }
        insertion.updated.sort_unstable();
        insertion.updated.dedup();
        for birth in insertion.touched() {
            if let Some(plane) = self.planes.get_mut(&birth) {
                plane.sightings.add(insertion.key_frame, &key_frame);
                plane.refit();
            }
        }
        self.key_frames.insert(insertion.key_frame, key_frame);
        insertion
    }

    fn shape(&self) -> ShapeSettings {
        let PlaneMapConfig { voxel_size, max_hole_area, boundary_tolerance, .. } = self.config;
        ShapeSettings { voxel_size, max_hole_area, boundary_tolerance }
    }

    /// The plane that a plane has become by merges; itself if it was not merged.
    pub(super) fn resolve(&self, plane: Birth) -> Birth {
        self.merged.current(plane)
    }
}
