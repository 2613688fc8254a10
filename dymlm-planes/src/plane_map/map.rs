mod confirmation;
mod merging;
mod moved_body;
mod removal;

use std::collections::BTreeMap;

use dymlm_core::{Frame, FrameId, PlaneId, Pose, SensorModel};

use super::config::PlaneMapConfig;
use super::fixed_moments::FixedMoments;
use super::gap::GapLook;
use super::gap_record::{GapLooks, GapRecord, PlanePair};
use super::map_plane::{MapPlane, ShapeSettings, Sightings};
use super::observation::Observation;
use super::report::{PlaneMerge, PlaneReport};
use crate::association::{Agreement, Criterion};
use crate::detector::DetectedPlane;
use crate::error::Error;
use crate::patch::Patch;

/// The map of finite planes (paper III-B).
///
/// A key frame's planes are brought to the world, associated with the planes of the map, and fused with them;
/// then planes of the map that have become one merge. The association is the paper's (equation 1 and
/// (equation 2 or equation 3)) with corrections; see [`AssociationConfig`](crate::AssociationConfig).
///
/// Patches of one plane that do not adjoin are one surface where something nearer occludes what joins them (a
/// wall behind a person, a floor on both sides of a table), and two where one looks through between them (two
/// desks of one height). Each key frame that touches one of the two is asked what it sees on the shortest
/// ways between them; when enough saw them occluded and hardly any looked through, they merge. What has
/// merged is not parted when a later key frame looks through after all.
///
/// All sums are integers and every key frame's share of them is kept. So [`PlaneMap::remove`] takes a key
/// frame out exactly: the planes are those that they would be if it had added nothing, and merges that it
/// brought about, or that it was needed for as a witness of what is occluded, are undone.
///
/// Cost of an insertion: O(planes in the map + voxels of the planes seen and of those near them on the same
/// plane); no key frame is looked at again.
#[derive(Debug, Clone)]
pub struct PlaneMap {
    config: PlaneMapConfig,
    sensor: SensorModel,
    criterion: Criterion,
    /// In the order of their ids.
    planes: Vec<MapPlane>,
    key_frames: BTreeMap<FrameId, KeyFrame>,
    /// Where planes have gone that were merged into others.
    merged: BTreeMap<PlaneId, PlaneId>,
    /// What the key frames saw between planes, by the ids that these have now.
    gaps: GapRecord,
    next_plane: u64,
    next_key_frame: u64,
}

/// What one key frame has added.
#[derive(Debug, Clone)]
struct KeyFrame {
    timestamp: f64,
    world_from_camera: Pose,
    contributions: Vec<Contribution>,
    /// Merges that it brought about.
    merges: Vec<Merge>,
    /// What it saw between planes, by their ids at that time.
    gap_looks: GapLooks,
}

#[derive(Debug, Clone)]
struct Merge {
    merge: PlaneMerge,
    /// The key frames that saw the gap occluded, when the two planes do not adjoin.
    witnesses: Option<Vec<FrameId>>,
}

#[derive(Debug, Clone)]
struct Contribution {
    /// The plane at that time; it may have merged into another since.
    plane: PlaneId,
    moments: FixedMoments,
    patch: Patch,
}

/// The plane of the map that a detected one may be.
#[derive(Debug, Clone, Copy)]
struct Pairing {
    cost: f64,
    /// Place in `planes`.
    mapped: usize,
    agreement: Agreement,
}

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
            planes: Vec::new(),
            key_frames: BTreeMap::new(),
            merged: BTreeMap::new(),
            gaps: GapRecord::default(),
            next_plane: 0,
            next_key_frame: 0,
        })
    }

    /// Adds the planes of a key frame, given in its camera's frame, and looks in its depth image at what lies
    /// between planes of the map that may be one surface behind something: see
    /// [`max_occluded_gap`](crate::AssociationConfig::max_occluded_gap).
    ///
    /// # Errors
    ///
    /// [`Error::OutOfReach`] when a plane lies so far out that it cannot be summed exactly. The map stays as
    /// it was.
    #[doc(alias = "integrate")]
    pub fn insert(
        &mut self,
        detected: &[DetectedPlane],
        frame: &Frame,
        world_from_camera: &Pose,
    ) -> Result<PlaneReport, Error> {
        let observations = self.bring_to_world(detected, world_from_camera)?;
        let pairings = self.associate(&observations);
        let mut report = self.fuse(observations, &pairings, world_from_camera, frame.timestamp());
        self.look_between(&report, frame, world_from_camera);
        self.merge(&mut report);
        self.confirm_after(world_from_camera, |plane| report.associations.contains(&plane.id));
        Ok(report)
    }

    /// Whether every plane within 100 m of a camera at this pose can be mapped.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfReach`] names the camera's place.
    pub fn check_reach(&self, world_from_camera: &Pose) -> Result<(), Error> {
        let centroid = world_from_camera.translation();
        let reach = Observation::reach(self.config.voxel_size) - 100.0;
        let within = centroid.iter().all(|c| c.abs() < reach);
        if within { Ok(()) } else { Err(Error::OutOfReach { centroid, reach }) }
    }

    /// The confirmed planes, which enough key frames have seen, in the order of their ids: see
    /// [`min_observations`](PlaneMapConfig::min_observations) and the field after it.
    pub fn iter(&self) -> impl Iterator<Item = &MapPlane> {
        self.planes.iter().filter(|plane| plane.is_confirmed)
    }

    /// The planes that are not confirmed yet, in the order of their ids.
    pub fn candidates(&self) -> impl Iterator<Item = &MapPlane> {
        self.planes.iter().filter(|plane| !plane.is_confirmed)
    }

    /// The plane with an id, confirmed or not; of an id that was merged away, what it became.
    pub fn plane(&self, id: PlaneId) -> Option<&MapPlane> {
        self.place(self.resolve(id)).map(|place| &self.planes[place])
    }

    /// The id that a plane has now, after merges; `None` when it is not in the map.
    pub fn current_id(&self, id: PlaneId) -> Option<PlaneId> {
        self.plane(id).map(MapPlane::id)
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

    /// Bytes that the map holds, about.
    pub fn memory_bytes(&self) -> usize {
        let planes: usize =
            self.planes.iter().map(|plane| size_of::<MapPlane>() + plane.patch.memory_bytes()).sum();
        let shares = self.key_frames.values().flat_map(|key_frame| &key_frame.contributions);
        let gap_looks: usize = self.key_frames.values().map(|key_frame| key_frame.gap_looks.len()).sum();
        let gap_looks = gap_looks * size_of::<(PlanePair, GapLook)>();
        planes
            + gap_looks
            + shares.map(|share| size_of::<Contribution>() + share.patch.memory_bytes()).sum::<usize>()
    }

    fn bring_to_world(
        &self,
        detected: &[DetectedPlane],
        world_from_camera: &Pose,
    ) -> Result<Vec<Observation>, Error> {
        detected
            .iter()
            .map(|plane| Observation::new(plane, world_from_camera, self.config.voxel_size))
            .collect()
    }

    /// The best plane of the map for each detected one. Several detected ones may share it: parts of one
    /// surface.
    fn associate(&self, observations: &[Observation]) -> Vec<Option<Pairing>> {
        let best = |observation: &Observation| {
            let candidates = self.planes.iter().enumerate().filter_map(|(mapped, plane)| {
                let agreement = self.criterion.test(&observation.finite(), &plane.finite())?;
                Some(Pairing { cost: self.criterion.cost(&agreement), mapped, agreement })
            });
            // The first of equals: the oldest.
            candidates.min_by(|a, b| a.cost.total_cmp(&b.cost))
        };
        observations.iter().map(best).collect()
    }

    fn fuse(
        &mut self,
        observations: Vec<Observation>,
        pairings: &[Option<Pairing>],
        world_from_camera: &Pose,
        timestamp: f64,
    ) -> PlaneReport {
        let mut report = PlaneReport::of(FrameId::new(self.next_key_frame));
        self.next_key_frame += 1;
        let mut contributions = Vec::with_capacity(observations.len());
        for (observation, pairing) in observations.into_iter().zip(pairings) {
            let Observation { plane, mut moments, patch, .. } = observation;
            let place = if let Some(pairing) = pairing {
                if pairing.agreement.flipped {
                    moments = moments.flipped();
                }
                report.updated.push(self.planes[pairing.mapped].id);
                pairing.mapped
            } else {
                let id = PlaneId::new(self.next_plane);
                self.next_plane += 1;
                report.created.push(id);
                self.planes.push(MapPlane::new(id, plane, self.shape()));
                self.planes.len() - 1
            };
            let into = &mut self.planes[place];
            into.moments.add(&moments);
            into.patch.add(&patch);
            report.associations.push(into.id);
            contributions.push(Contribution { plane: into.id, moments, patch });
        }
        report.updated.sort_unstable();
        report.updated.dedup();
        for id in report.touched() {
            if let Some(place) = self.place(id) {
                let plane = &mut self.planes[place];
                plane.sightings.add(timestamp);
                plane.refit();
            }
        }
        let (merges, gap_looks, world_from_camera) = (Vec::new(), GapLooks::new(), *world_from_camera);
        self.key_frames.insert(
            report.key_frame,
            KeyFrame { timestamp, world_from_camera, contributions, merges, gap_looks },
        );
        report
    }

    /// The key frames that saw a plane.
    fn sightings(&self, id: PlaneId) -> Sightings {
        let mut sightings = Sightings::default();
        for key_frame in self.key_frames.values() {
            if key_frame.contributions.iter().any(|share| self.resolve(share.plane) == id) {
                sightings.add(key_frame.timestamp);
            }
        }
        sightings
    }

    fn shape(&self) -> ShapeSettings {
        let PlaneMapConfig { voxel_size, max_hole_area, boundary_tolerance, .. } = self.config;
        ShapeSettings { voxel_size, max_hole_area, boundary_tolerance }
    }

    /// The plane that an id stands for now.
    fn resolve(&self, id: PlaneId) -> PlaneId {
        resolve(&self.merged, id)
    }

    fn place(&self, id: PlaneId) -> Option<usize> {
        self.planes.binary_search_by_key(&id, |plane| plane.id).ok()
    }
}

/// The plane that an id stands for, after merges.
fn resolve(merged: &BTreeMap<PlaneId, PlaneId>, mut id: PlaneId) -> PlaneId {
    while let Some(&into) = merged.get(&id) {
        id = into;
    }
    id
}
