use dymlm_core::{ConfigError, check_range};

use super::coco_sizes::COCO_SIZES;

/// The range of one dimension of a kind of thing, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "[f64; 3]", into = "[f64; 3]"))]
#[non_exhaustive]
pub struct SizeRange {
    /// Smallest plausible length.
    pub min: f64,
    /// Usual length, up to [`LONGEST`](Self::LONGEST).
    pub typical: f64,
    /// Greatest plausible length. Beyond [`LONGEST`](Self::LONGEST) it sets no limit: no object is longer.
    pub max: f64,
}

impl SizeRange {
    /// The longest side of an object, metres. An object is in each cell of the index in space that it may
    /// reach: one of 350 m, as what is 350 mm wide would be by mistake, is in twelve million.
    pub const LONGEST: f64 = 256.0;

    /// Checks that the lengths are positive and in order, and the usual one no longer than any object.
    fn validate(&self, field: &'static str) -> Result<(), ConfigError> {
        check_range(field, self.typical, f64::MIN_POSITIVE..=Self::LONGEST)?;
        check_range(field, self.min, f64::MIN_POSITIVE..=self.typical)?;
        check_range(field, self.max, self.typical..=f64::MAX)
    }
}

impl From<[f64; 3]> for SizeRange {
    /// From least, usual and greatest length, metres.
    fn from([min, typical, max]: [f64; 3]) -> Self {
        Self { min, typical, max }
    }
}

impl From<SizeRange> for [f64; 3] {
    fn from(range: SizeRange) -> Self {
        [range.min, range.typical, range.max]
    }
}

/// The outline of a thing seen from above.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Footprint {
    /// About as wide as long, such as a bottle or a chair: its unseen side is as far away as its visible
    /// sides are from each other.
    Even,
    /// Longer than wide: a keyboard, a book.
    Oblong,
    /// An upright plate on a foot that reaches out before and behind it: a monitor. The foot is mostly
    /// occluded or lost in the noise.
    Plate,
}

/// The plausible sizes of the things of one label.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[non_exhaustive]
pub struct SizePrior {
    /// The label.
    pub label: String,
    /// The longer horizontal dimension.
    pub length: SizeRange,
    /// The shorter horizontal dimension.
    pub width: SizeRange,
    /// The vertical dimension.
    pub height: SizeRange,
    /// The outline seen from above.
    pub footprint: Footprint,
}

impl SizePrior {
    /// The prior of a label.
    pub fn new(
        label: impl Into<String>,
        length: SizeRange,
        width: SizeRange,
        height: SizeRange,
        footprint: Footprint,
    ) -> Self {
        Self { label: label.into(), length, width, height, footprint }
    }

    /// Checks that the dimensions are ranges, and that no thing must be wider than it is long.
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        let width = "objects.sizes.width";
        self.length.validate("objects.sizes.length")?;
        self.width.validate(width)?;
        self.height.validate("objects.sizes.height")?;
        check_range(width, self.width.min, f64::MIN_POSITIVE..=self.length.max)
    }

    /// Whether a thing of these dimensions (metres) may be of this kind. An upright thing's dimensions are
    /// length, width and height; otherwise they may be in any order. No dimension may exceed its greatest
    /// plausible value by more than the factor `slack`, nor fall below its least value by more; the least
    /// width (for an unknown pose: the shortest dimension) is not checked, because it depends on noise and
    /// view.
    pub fn admits(&self, dimensions: [f64; 3], pose: UprightPose, slack: f64) -> bool {
        let least = self.limits(pose, |range| range.min);
        let own = in_order(dimensions, pose);
        let unknown = if pose == UprightPose::Upright { 1 } else { 2 };
        let large_enough = |axis: usize| axis == unknown || own[axis] * slack >= least[axis];
        self.admits_part(dimensions, pose, slack) && (0..3).all(large_enough)
    }

    /// [`Self::admits`] for a thing seen in part: there are no least values.
    pub fn admits_part(&self, dimensions: [f64; 3], pose: UprightPose, slack: f64) -> bool {
        let (own, most) = (in_order(dimensions, pose), self.limits(pose, |range| range.max));
        (0..3).all(|axis| own[axis] <= slack * most[axis])
    }

    fn limits(&self, pose: UprightPose, of: impl Fn(&SizeRange) -> f64) -> [f64; 3] {
        in_order([of(&self.length), of(&self.width), of(&self.height)], pose)
    }
}

/// Whether the third dimension of a box is known to be its height.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum UprightPose {
    /// The third dimension is the height.
    Upright,
    /// Any dimension may be the height.
    Unknown,
}

/// Dimensions in comparable order: the horizontal ones, or all of an unknown pose, are sorted by descending
/// length.
fn in_order([a, b, c]: [f64; 3], pose: UprightPose) -> [f64; 3] {
    match pose {
        UprightPose::Upright => [a.max(b), a.min(b), c],
        UprightPose::Unknown => {
            let mut sorted = [a, b, c];
            sorted.sort_unstable_by(|a, b| b.total_cmp(a));
            sorted
        }
    }
}

/// The plausible sizes of all known labels; by default the COCO classes that do not move by themselves. In a
/// config file, a list of [`SizePrior`]s extends the default: `[[objects.sizes]]`.
///
/// ```
/// use dymlm_objects::{Footprint, SizePrior, SizePriors};
///
/// let mut priors = SizePriors::default();
/// assert_eq!(priors.of("keyboard").expect("a label of COCO").length.typical, 0.44);
/// let [robot_length, width, height] = [[0.4, 0.5, 0.6], [0.3, 0.35, 0.4], [0.2, 0.3, 1.0]].map(Into::into);
/// priors.insert(SizePrior::new("robot", robot_length, width, height, Footprint::Oblong));
/// assert!(priors.of("robot").is_some() && priors.of("dragon").is_none());
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "Vec<SizePrior>", into = "Vec<SizePrior>"))]
pub struct SizePriors {
    /// By ascending label.
    priors: Vec<SizePrior>,
}

/// How far a part of a thing of unknown size may be from the rest, metres.
const USUAL_REACH: f64 = 0.3;

impl SizePriors {
    /// The prior of a label; `None` for an unknown label.
    pub fn of(&self, label: &str) -> Option<&SizePrior> {
        let place = self.priors.binary_search_by(|prior| prior.label.as_str().cmp(label)).ok()?;
        self.priors.get(place)
    }

    /// How far a part of a thing of a label may usually be from the rest, metres.
    pub(crate) fn reach(&self, label: &str) -> f64 {
        self.of(label).map_or(USUAL_REACH, |prior| prior.width.typical)
    }

    /// Whether a thing of a label, seen in part, may have these dimensions, metres: those that its prior
    /// [admits](SizePrior::admits_part), if it has one, and in any case no longer ones than an object may
    /// have.
    pub(crate) fn admit_part(
        &self,
        label: &str,
        dimensions: [f64; 3],
        pose: UprightPose,
        slack: f64,
    ) -> bool {
        dimensions.iter().all(|&length| length <= SizeRange::LONGEST)
            && self.of(label).is_none_or(|prior| prior.admits_part(dimensions, pose, slack))
    }

    /// Adds a prior; it replaces the one of the same label.
    pub fn insert(&mut self, prior: SizePrior) {
        match self.priors.binary_search_by(|own| own.label.cmp(&prior.label)) {
            Ok(place) => self.priors[place] = prior,
            Err(place) => self.priors.insert(place, prior),
        }
    }

    /// All priors, by ascending label.
    pub fn iter(&self) -> impl Iterator<Item = &SizePrior> {
        self.priors.iter()
    }
}

impl Default for SizePriors {
    fn default() -> Self {
        let mut priors = Self { priors: Vec::new() };
        for (label, length, width, height, footprint) in COCO_SIZES {
            let [length, width, height] = [*length, *width, *height].map(SizeRange::from);
            priors.insert(SizePrior::new(*label, length, width, height, *footprint));
        }
        priors
    }
}

/// The default, extended and overridden by the given priors.
impl From<Vec<SizePrior>> for SizePriors {
    fn from(given: Vec<SizePrior>) -> Self {
        let mut priors = Self::default();
        for prior in given {
            priors.insert(prior);
        }
        priors
    }
}

impl From<SizePriors> for Vec<SizePrior> {
    fn from(priors: SizePriors) -> Self {
        priors.priors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_default_is_a_range() {
        let priors = SizePriors::default();
        assert!(priors.iter().count() > 60);
        for prior in priors.iter() {
            assert_eq!(prior.validate(), Ok(()), "{prior:?}");
            assert!(prior.length.typical >= prior.width.typical, "{prior:?}");
            let typical = [prior.width.typical, prior.length.typical, prior.height.typical];
            assert!(prior.admits(typical, UprightPose::Upright, 1.0), "{prior:?}");
            assert!(
                prior.admits([typical[2], typical[0], typical[1]], UprightPose::Unknown, 1.0),
                "{prior:?}"
            );
        }
    }

    #[test]
    fn no_side_is_longer_than_a_loaded_object_may_be() {
        let usual = SizeRange::from([0.3, 0.5, 0.8]);
        let validate = |height: [f64; 3]| {
            SizePrior::new("chair", usual, usual, height.into(), Footprint::Even).validate()
        };
        assert_eq!(validate([300.0, 350.0, 400.0]).unwrap_err().field, "objects.sizes.height", "millimetres");
        assert_eq!(validate([8.0, 25.0, 400.0]), Ok(()));
        let mut priors = SizePriors::default();
        let long = SizeRange::from([1.0, 2.0, 400.0]);
        priors.insert(SizePrior::new("pipeline", long, long, long, Footprint::Oblong));
        // Whatever the slack, and with a prior or without.
        for label in ["pipeline", "thing"] {
            let admit = |length| priors.admit_part(label, [length, 2.0, 1.0], UprightPose::Upright, 1.3);
            assert!(admit(256.0) && !admit(256.1) && !admit(f64::NAN), "{label}");
        }
    }

    #[test]
    fn sizes_are_compared_as_far_as_they_are_known() {
        let priors = SizePriors::default();
        let (chair, keyboard) = (priors.of("chair").unwrap(), priors.of("keyboard").unwrap());
        assert!(keyboard.admits([0.03, 0.45, 0.15], UprightPose::Unknown, 1.0));
        assert!(!keyboard.admits([0.03, 0.45, 0.15], UprightPose::Upright, 1.0));
        assert!(!keyboard.admits([0.9, 0.15, 0.03], UprightPose::Upright, 1.2));
        // A piece of the floor is not a chair, but a part of a chair may look like it.
        assert!(!chair.admits([0.8, 0.5, 0.1], UprightPose::Upright, 1.2));
        assert!(!chair.admits([0.8, 0.3, 0.31], UprightPose::Upright, 1.2));
        assert!(chair.admits_part([0.8, 0.3, 0.31], UprightPose::Upright, 1.2));
    }
}
