use std::sync::Arc;

use dymlm_core::vector3::{along, difference, norm};
use dymlm_core::{ConfigError, Plane, Point, Pose};
use dymlm_geometry::{IsolationForestConfig, OrientedBox};

use super::completion::{Completion, Stance};
use super::outliers::OutlierFilter;
use crate::object_map::{FULL, counted};
use crate::support::drop_repeated;
use crate::{
    BoxFit, BoxFitter, BoxFitterConfig, MapObject, ObjectShape, Relief, ShapeTable, SizePrior, SizePriors,
    SupportPlane, SupportingPlanes,
};

/// Fits new parameters to all points of an object and decides whether to accept them (paper IV-C).
#[derive(Debug, Clone)]
pub(crate) struct Reparameterizer {
    fitter: BoxFitter,
    outliers: OutlierFilter,
    /// Greatest height of what lies on a plane without showing in depth, metres.
    flat_height: f64,
    points: Vec<Point>,
    found: Vec<SupportPlane>,
    walls: Vec<Plane>,
}

/// What was decided on new parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Proposal {
    /// The object has the new parameters.
    Accepted,
    /// They fit the views worse than the old ones, or are too large for the label.
    Rejected,
    /// There are too few points to fit parameters.
    None,
}

/// An object's points nearer to its supporting plane than this belong to the plane, metres.
const FOOT: f64 = 0.004;
/// Share of the upper quartile of the voxels' observations that a voxel needs to count, 0..=1: what is only
/// now and then seen at the rim is noise.
const VOXEL_SHARE: f64 = 0.12;
/// Share of the points that is left out at each end of each axis when the box is fitted, 0..=0.2.
const TRIM: f64 = 0.01;
/// Factor by which an object may exceed its size prior, 1 or more.
pub(crate) const PRIOR_SLACK: f64 = 1.3;
/// Largest accepted fall of the mean intersection over union of the projections with the key views' boxes,
/// 0..=1: smaller changes are the detector's jitter.
pub(crate) const MAX_IOU_LOSS: f64 = 0.05;
/// After this many refusals in a row new parameters are accepted all the same: parameters that the data give
/// again and again are right, and the old ones were fitted to one view.
const MAX_REFUSALS: u32 = 5;
/// An object is parameterized anew when the weight of its observations has grown by this share since the last
/// time, and by at least one full observation.
const DUE_GROWTH: f64 = 0.2;

impl Reparameterizer {
    /// `flat_height`: of what lies on a plane without showing in depth, metres.
    pub(crate) fn new(forest: IsolationForestConfig, flat_height: f64) -> Result<Self, ConfigError> {
        let fitter = BoxFitterConfig { along_edges: true, trim: TRIM };
        Ok(Self {
            fitter: BoxFitter::new(fitter)?,
            outliers: OutlierFilter::new(forest)?,
            flat_height,
            points: Vec::new(),
            found: Vec::new(),
            walls: Vec::new(),
        })
    }

    /// Whether an object has enough new observations to be parameterized anew.
    pub(crate) fn is_due(object: &MapObject) -> bool {
        let since = object.weight.saturating_sub(object.parameterized_at);
        f64::from(since) >= (DUE_GROWTH * f64::from(object.parameterized_at)).max(FULL.into())
    }

    /// Fits the object anew and adopts the new parameters if they are acceptable. `vertical` is the third
    /// axis of an object without a known supporting plane.
    pub(crate) fn update(
        &mut self,
        object: &mut MapObject,
        vertical: Option<[f64; 3]>,
        priors: &SizePriors,
        shapes: &ShapeTable,
        planes: &dyn SupportingPlanes,
    ) -> Proposal {
        object.parameterized_at = object.weight;
        let Some(fit) = self.fit(object, vertical, priors, planes) else { return Proposal::None };
        let proposed = ObjectShape::new(shapes.of(&object.label), fit.oriented_box);
        let is_plausible = is_plausible(object, &fit, priors);
        let is_persistent = object.refusals >= MAX_REFUSALS;
        if !is_plausible || !(is_persistent || fits_views(object, &proposed)) {
            object.refusals = counted(object.refusals, u32::from(is_plausible));
            return Proposal::Rejected;
        }
        adopt(object, &fit, &proposed);
        Proposal::Accepted
    }

    /// Whether any of an object's points for which `is_free` holds has a say in its parameters.
    pub(crate) fn is_shaped_by(&mut self, object: &MapObject, is_free: impl Fn([f64; 3]) -> bool) -> bool {
        let (cloud, origin) = (&object.cloud, object.cloud.origin());
        // Most objects have no point in free space, and need no quantile of their counts.
        let mut free = cloud.points().filter(|(place, _)| is_free(along(*place, 1.0, origin))).peekable();
        free.peek().is_some() && {
            let least = self.outliers.least_observations(cloud, VOXEL_SHARE);
            free.any(|(_, count)| count >= least)
        }
    }

    /// Takes the points for which `is_free` holds out of an object that somebody has pushed along, and fits it
    /// anew where it stands now. It was pushed when its last observation fits the new parameters clearly better
    /// than the old ones: views that say otherwise are of its old place, as are points beyond its outline,
    /// which are too near to where it stands now for the evidence to tell them apart. An object that stands
    /// where it stood stays whole: a pose off by some centimetres puts its rim into free space, too.
    ///
    /// Returns whether the object has changed.
    pub(crate) fn follow(
        &mut self,
        object: &mut MapObject,
        is_free: impl Fn([f64; 3]) -> bool,
        vertical: Option<[f64; 3]>,
        priors: &SizePriors,
        shapes: &ShapeTable,
        planes: &dyn SupportingPlanes,
    ) -> bool {
        let (old, shape) = (object.shape(), shapes.of(&object.label));
        // Fits the object without some of its points; where it has not moved there, it keeps them.
        let mut fit_without = |object: &mut MapObject, is_outdated: &dyn Fn([f64; 3]) -> bool| {
            let whole = Arc::clone(&object.cloud);
            let has_lost = Arc::make_mut(&mut object.cloud).take_out(is_outdated);
            let fit = self.fit(object, vertical, priors, planes).filter(|_| has_lost);
            let moved = fit.map(|fit| (fit, ObjectShape::new(shape, fit.oriented_box)));
            let has_moved = |(fit, proposed): &(BoxFit, ObjectShape)| {
                is_plausible(object, fit, priors) && object.key_views.have_moved_on(&old, proposed)
            };
            let moved = moved.filter(has_moved);
            if moved.is_none() {
                object.cloud = whole;
            }
            moved
        };
        let Some(moved) = fit_without(object, &is_free) else { return false };
        let is_excluded = object.key_views.newest_excludes();
        let (fit, proposed) = fit_without(object, &is_excluded).unwrap_or(moved);
        object.parameterized_at = object.weight;
        adopt(object, &fit, &proposed);
        if object.key_views.drop_outdated(&old, &proposed) {
            object.forget_old_place();
        }
        true
    }

    fn fit(
        &mut self,
        object: &MapObject,
        vertical: Option<[f64; 3]>,
        priors: &SizePriors,
        planes: &dyn SupportingPlanes,
    ) -> Option<BoxFit> {
        let local_from_world = Pose::new(object.cloud.origin().map(|c| -c), [0.0, 0.0, 0.0, 1.0]).ok()?;
        let plane = object.support().map(|support| support.plane.transformed(&local_from_world));
        self.choose_points(object, plane.as_ref());
        let vertical = plane.map(|plane| plane.normal()).or(vertical);
        let fit = self.fitter.fit(&self.points, vertical)?;
        let prior = priors.of(&object.label);
        let is_flat = object.relief() == Relief::Flat;
        let least_height = prior.filter(|_| is_flat).map_or(0.0, |prior| prior.height.min);
        let fit = plane.map_or(fit, |plane| fit.standing_on(&plane, least_height));
        let mut oriented_box = fit.oriented_box.transformed(&local_from_world.inverse());
        if let Some(prior) = prior {
            self.find_walls(&oriented_box, prior, planes);
            let stance = match (plane, vertical) {
                (Some(_), _) => Stance::OnPlane,
                (None, Some(_)) => Stance::Upright,
                (None, None) => Stance::Unknown,
            };
            let (views, walls) = (&object.key_views, &self.walls);
            let has_flat_parts = stance == Stance::OnPlane && prior.height.min <= self.flat_height;
            let completion = Completion { prior, views, stance, has_flat_parts, walls };
            // Colours show all sides of a flat thing, but not what rises from it without readings.
            oriented_box = match (is_flat, stance) {
                (true, Stance::Unknown) => oriented_box,
                (true, _) => completion.complete_height(&oriented_box),
                (false, _) => completion.complete(&oriented_box),
            };
        }
        Some(BoxFit { oriented_box, ..fit })
    }

    /// Finds the planes near a box that a thing of its kind may reach.
    fn find_walls(&mut self, own: &OrientedBox, prior: &SizePrior, planes: &dyn SupportingPlanes) {
        let reach = 0.5 * norm(own.lengths()) + prior.length.typical;
        self.found.clear();
        // Searched from points beside the box, because the wall right behind it was never seen.
        for corner in own.corners() {
            planes.near(along(corner, 0.5, difference(corner, own.center())), reach, &mut self.found);
        }
        drop_repeated(&mut self.found);
        self.walls.clear();
        self.walls.extend(self.found.iter().map(|found| found.plane));
    }

    fn choose_points(&mut self, object: &MapObject, plane: Option<&Plane>) {
        let Self { outliers, points, .. } = self;
        // A flat thing is at its plane's height, and the parts of the plane that were taken for it differ
        // from view to view.
        let plane = plane.filter(|_| object.relief() == Relief::Raised);
        outliers.choose(&object.cloud, plane, FOOT, VOXEL_SHARE, object.key_views.most_exclude(), points);
    }
}

/// Whether an object of its label may be as large.
fn is_plausible(object: &MapObject, fit: &BoxFit, priors: &SizePriors) -> bool {
    priors.admit_part(&object.label, fit.oriented_box.lengths(), fit.axes.pose(), PRIOR_SLACK)
}

/// Gives an object new parameters.
fn adopt(object: &mut MapObject, fit: &BoxFit, proposed: &ObjectShape) {
    object.refusals = 0;
    object.oriented_box = fit.oriented_box;
    object.axes = fit.axes;
    object.shape = proposed.kind();
}

/// Whether the new shape's projections fit the key views about as well as the old one's.
fn fits_views(object: &MapObject, proposed: &ObjectShape) -> bool {
    let (old, new) = (object.key_views.mean_iou(&object.shape()), object.key_views.mean_iou(proposed));
    old.zip(new).is_none_or(|(old, new)| new >= old - MAX_IOU_LOSS)
}
