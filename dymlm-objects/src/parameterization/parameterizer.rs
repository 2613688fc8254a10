use dymlm_core::{BoundingBox, ConfigError, Detection, Point, Pose, SensorModel};
use dymlm_geometry::{BoxView, GridSample as Sample, SampleGrid as Window};

use super::box_fitter::BoxFitter;
use super::completeness::Surroundings;
use super::flat_thing::FlatThing;
use super::ground::Ground;
use super::object_cluster::{ClusterSearch, ObjectCluster};
use super::{Completeness, ObjectObservation, ParameterizationConfig, Relief, Rival, SideView};
use crate::{BoxFitterConfig, ObjectView, SizePriors, SupportPlane, SupportingPlanes};

/// From detections to boxes in space: the paper's object parameterization (section IV-A).
///
/// Steps for each detection: static readings are sampled on a grid over the box and a margin, each the mean
/// of the readings around it; points on supporting planes are dropped; the rest is clustered (DBSCAN), and
/// the object's cluster chosen; then come the plane under it, how much of it is seen, and the box around it
/// ([`BoxFitter`]). Constant time per detection, half a millisecond or less, because the number of samples is
/// bounded.
#[derive(Debug, Clone)]
pub(crate) struct Parameterizer {
    config: ParameterizationConfig,
    sensor: SensorModel,
    window: Window,
    ground: Ground,
    cluster: ObjectCluster,
    flat: FlatThing,
    fitter: BoxFitter,
    local: Vec<Point>,
    /// Normals, in the world, of the planes on which the things of the last frame rest, by detection.
    resting_normals: Vec<(usize, [f64; 3])>,
}

/// Least samples of an object.
const MIN_SAMPLES: usize = 12;
/// Least share of the box's grid cells, with or without a reading, that must be the object, 0..=1: less is a
/// remainder of something else.
const MIN_FILL: f32 = 0.04;
/// Intersection over union of the found samples with the detector's box from which on the box is explained.
const FILLED: f64 = 0.5;

/// What was found in a detection's box.
#[derive(Debug, Clone, Copy)]
struct Finding {
    completeness: Completeness,
    support: Option<SupportPlane>,
    /// The least height of such things when it lies flat on its support, metres; `None` when it does not.
    flat_height: Option<f64>,
}

impl Parameterizer {
    /// Checks the config.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] names the field outside its range.
    pub(crate) fn new(config: ParameterizationConfig, sensor: SensorModel) -> Result<Self, ConfigError> {
        Ok(Self {
            window: Window::default(),
            ground: Ground::new(&config, sensor),
            cluster: ObjectCluster::new()?,
            flat: FlatThing::default(),
            fitter: BoxFitter::new(BoxFitterConfig::default())?,
            local: Vec::new(),
            resting_normals: Vec::new(),
            config,
            sensor,
        })
    }

    /// Adds to `observations` the detections of a frame in whose box a thing is found. `vertical`, a unit
    /// vector of the world, is the third axis of things without a known supporting plane; without it,
    /// principal axes are used. `mapped` are the confirmed objects that the frame may show.
    pub(crate) fn parameterize(
        &mut self,
        view: &ObjectView<'_>,
        planes: &dyn SupportingPlanes,
        vertical: Option<[f64; 3]>,
        mapped: &[Rival<'_>],
        priors: &SizePriors,
        observations: &mut Vec<ObjectObservation>,
    ) {
        self.resting_normals.clear();
        for (index, detection) in view.detections().iter().enumerate() {
            if self.is_asked(view, detection) {
                let search = ClusterSearch {
                    bounding_box: detection.bounding_box(),
                    is_seat: self.config.seats.iter().any(|seat| seat == detection.label()),
                    prior: priors.of(detection.label()),
                    reach: priors.reach(detection.label()) as f32,
                    rivals: self.rivals(view, detection, mapped),
                };
                observations.extend(self.observe(view, index, detection, planes, vertical, &search));
            }
        }
    }

    /// Whether a detection is of a thing that is mapped.
    pub(crate) fn is_asked(&self, view: &ObjectView<'_>, detection: &Detection) -> bool {
        detection.score() >= self.config.min_score && !view.is_mover(detection)
    }

    /// The things of other labels in the box of a detection. Of two things of one label, the box of the one
    /// that is behind may fit parts of the one before it.
    fn rivals<'a>(&self, view: &ObjectView<'a>, own: &Detection, mapped: &[Rival<'a>]) -> Vec<Rival<'a>> {
        let detected = view.detections().iter().filter(|other| self.is_asked(view, other));
        let detected = detected.map(Rival::detected);
        let others = detected.chain(mapped.iter().copied()).filter(|rival| rival.label != own.label());
        others.filter_map(|rival| rival.within(&own.bounding_box())).collect()
    }

    /// The normal, in the world, of the plane on which what a detection of the last frame shows rests, level
    /// or not.
    pub(crate) fn resting_normal(&self, detection: usize) -> Option<[f64; 3]> {
        let of_detection = self.resting_normals.iter().find(|(own, _)| *own == detection);
        of_detection.map(|(_, normal)| *normal)
    }

    fn observe(
        &mut self,
        view: &ObjectView<'_>,
        index: usize,
        detection: &Detection,
        planes: &dyn SupportingPlanes,
        vertical: Option<[f64; 3]>,
        search: &ClusterSearch<'_>,
    ) -> Option<ObjectObservation> {
        let box_view = BoxView::new(view.frame, &self.sensor, detection.bounding_box())
            .with_static_mask(view.static_mask)
            .with_instance_mask(detection.mask());
        self.cluster.sample(&box_view, &mut self.window);
        self.ground.find(&self.window, planes, vertical, &view.world_from_camera);
        let mut finding = self.find_raised(view, search, vertical);
        let resting_normal = self.ground.resting_normal(&members(&self.window, &self.cluster));
        self.resting_normals.extend(resting_normal.map(|normal| (index, normal)));
        if let (None, Some(vertical)) = (finding.support, vertical)
            && self.ground.find_level_patches(&self.window, vertical, &view.world_from_camera) > 0
        {
            finding = self.find_raised(view, search, Some(vertical));
        }
        if let Some(flat) = self.find_flat(view, search) {
            finding = flat;
        }
        self.describe(view, index, detection, &finding, vertical)
    }

    /// Finds what stands out from the ground in depth.
    fn find_raised(
        &mut self,
        view: &ObjectView<'_>,
        search: &ClusterSearch<'_>,
        vertical: Option<[f64; 3]>,
    ) -> Finding {
        self.cluster.find(&self.window, self.ground.is_ground(), search);
        let completeness = completeness(view, &self.window, &self.cluster, &self.sensor);
        // The gap to the plane is limited as usual, or by the label's usual height when the lower end is
        // occluded.
        let down = vertical.map(|up| view.world_from_camera.inverse().rotate(up.map(|c| -c)));
        let foot = down.and_then(|down| completeness.toward(down, view.frame.camera()));
        let hidden_foot = search.prior.filter(|_| foot.is_some_and(|foot| foot != SideView::Whole));
        let hidden_height = hidden_foot.map_or(0.0, |prior| prior.height.typical);
        let max_gap = self.config.max_support_gap.max(hidden_height);
        let support = self.ground.under(&members(&self.window, &self.cluster), max_gap);
        Finding { completeness, support, flat_height: None }
    }

    /// Finds what lies flat on a plane, if things of the label may be so flat and nothing raised fills the
    /// box.
    fn find_flat(&mut self, view: &ObjectView<'_>, search: &ClusterSearch<'_>) -> Option<Finding> {
        let most = self.config.flat_height();
        let prior = search.prior.filter(|prior| prior.height.min <= most)?;
        if self.cluster.fill(&self.window, &search.bounding_box) >= FILLED {
            return None;
        }
        let under = self.ground.flattest()?;
        let is_ground = self.ground.is_ground();
        if !self.flat.mark(view, &self.window, &under.plane, is_ground, prior.height.typical) {
            return None;
        }
        self.cluster.find(&self.window, self.flat.is_other(), search);
        let completeness = completeness(view, &self.window, &self.cluster, &self.sensor);
        Some(Finding { completeness, support: Some(under.support), flat_height: Some(prior.height.min) })
    }

    /// The observation of what was found; `None` when that is too little.
    fn describe(
        &mut self,
        view: &ObjectView<'_>,
        index: usize,
        detection: &Detection,
        finding: &Finding,
        vertical: Option<[f64; 3]>,
    ) -> Option<ObjectObservation> {
        let least = (MIN_FILL * self.window.box_cells as f32) as usize;
        if self.cluster.members.len() < MIN_SAMPLES.max(least) {
            return None;
        }
        let mut points = Vec::with_capacity(self.cluster.members.len());
        points.extend(members(&self.window, &self.cluster).map(|sample| sample.point));
        let (centroid, fit) = self.fit(&points, finding, vertical, &view.world_from_camera)?;
        Some(ObjectObservation {
            detection: index,
            label: detection.label().to_owned(),
            score: detection.score(),
            bounding_box: detection.bounding_box(),
            points,
            centroid,
            fit,
            support: finding.support,
            relief: if finding.flat_height.is_some() { Relief::Flat } else { Relief::Raised },
            completeness: finding.completeness,
            sighted_points: sighted_in(view, &detection.bounding_box()),
        })
    }

    /// The mean of the points and the box around them, in the world.
    fn fit(
        &mut self,
        points: &[Point],
        finding: &Finding,
        vertical: Option<[f64; 3]>,
        world_from_camera: &Pose,
    ) -> Option<([f64; 3], super::BoxFit)> {
        let mean = mean(points)?;
        let centroid = world_from_camera.transform_point(mean);
        // Relative to the centroid, so that f32 keeps its precision far from the world's origin.
        self.local.clear();
        self.local.extend(points.iter().map(|point| {
            let offset = [0, 1, 2].map(|axis| f64::from(point[axis]) - mean[axis]);
            world_from_camera.rotate(offset).map(|c| c as f32)
        }));
        let local_from_world = Pose::new(centroid.map(|c| -c), [0.0, 0.0, 0.0, 1.0]).ok()?;
        let plane = finding.support.map(|support| support.plane.transformed(&local_from_world));
        let fit = self.fitter.fit(&self.local, plane.map(|plane| plane.normal()).or(vertical))?;
        let least_height = finding.flat_height.unwrap_or(0.0);
        let fit = plane.map_or(fit, |plane| fit.standing_on(&plane, least_height));
        let oriented_box = fit.oriented_box.transformed(&local_from_world.inverse());
        Some((centroid, super::BoxFit { oriented_box, ..fit }))
    }
}

/// The samples of the object.
fn members<'a>(window: &'a Window, cluster: &'a ObjectCluster) -> impl Iterator<Item = &'a Sample> + Clone {
    cluster.members.iter().filter_map(|&index| window.samples.get(index as usize))
}

fn completeness(
    view: &ObjectView<'_>,
    window: &Window,
    cluster: &ObjectCluster,
    sensor: &SensorModel,
) -> Completeness {
    Surroundings { view, window, cluster, sensor }.completeness()
}

fn mean(points: &[Point]) -> Option<[f64; 3]> {
    let mut sum = [0.0; 3];
    for point in points {
        for axis in 0..3 {
            sum[axis] += f64::from(point[axis]);
        }
    }
    (!points.is_empty()).then(|| sum.map(|s| s / points.len() as f64))
}

/// Ids of the caller's points that appear in a box, ascending.
fn sighted_in(view: &ObjectView<'_>, bounding_box: &BoundingBox) -> Vec<u64> {
    let mut ids: Vec<u64> = view
        .sighted_points
        .iter()
        .filter(|sighted| bounding_box.contains(sighted.pixel))
        .map(|sighted| sighted.id)
        .collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}
