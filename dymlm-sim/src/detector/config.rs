use dymlm_core::{ConfigError, check_range};

/// The distribution of a detector's scores.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct DetectionRates {
    /// Share of views of the usual size that are missed (score below 0.25), 0..=1.
    pub missed: f64,
    /// Share of these views that are missed or score below 0.5, `missed`..=1.
    pub below_half: f64,
    /// Share of these views that are missed or score below 0.7, `below_half`..=1.
    pub below_seven_tenths: f64,
    /// The usual size of a view, as a share of the image, 0.000001..=1, default 0.07.
    pub usual_size: f64,
    /// How much the confidence (a standard normal variable) grows with each doubling of the view's size,
    /// 0..=10, default 0: the same at all sizes.
    pub size_gain: f64,
}

impl DetectionRates {
    /// Rates from the three shares, which must not fall from one to the next, the same for views of all
    /// sizes.
    pub fn new(missed: f64, below_half: f64, below_seven_tenths: f64) -> Self {
        Self { missed, below_half, below_seven_tenths, usual_size: 0.07, size_gain: 0.0 }
    }

    fn validate(&self, names: [&'static str; 5]) -> Result<(), ConfigError> {
        check_range(names[0], self.missed, 0.0..=1.0)?;
        check_range(names[1], self.below_half, self.missed..=1.0)?;
        check_range(names[2], self.below_seven_tenths, self.below_half..=1.0)?;
        check_range(names[3], self.usual_size, 1e-6..=1.0)?;
        check_range(names[4], self.size_gain, 0.0..=10.0)
    }
}

/// How a 2D detector errs.
///
/// The defaults follow YOLOX-Nano (score >= 0.25) on 202 views of people with exact masks, 640x480 at 6 Hz,
/// as `DetectorStatistics` of the tests measures it: 92.1 % of the views are found, 87.6 % at score >= 0.5,
/// 77.2 % at 0.7; by size of the view, 25 % are found below 1.6 % of the image (5000 pixels), 93 % up to 5 %,
/// 96 % up to 10 %, 100 % above; misses come in bursts of one to three frames; the quartiles of the score are
/// 0.77, 0.83, 0.88; the `IoU` with the exact box is 0.86 in the median and above 0.67 in nine tenths of the
/// views; 2.6 % of the people's pixels are outside all boxes; 11 boxes are surplus. With the defaults, a
/// [`Sequence`](crate::Sequence) gives about the same figures; only the share of pixels outside is 3.7 %,
/// since its people show fewer thin parts at the sides, and more of its views are slivers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct DetectorConfig {
    /// Scores of people and of what they carry. Default 0.005, 0.024, 0.115 at 7 % of the image and 0.85
    /// sigma for each doubling: fitted to the measured shares at the three scores in the four size classes.
    /// (Views lost to [`merged_overlap`](Self::merged_overlap) come on top.)
    pub movers: DetectionRates,
    /// Scores of all other things. Default 0.3, 0.65, 0.825: the median score of the 918 boxes of other
    /// labels in the same recording is 0.49, a quarter is above 0.7; the misses are an estimate.
    pub objects: DetectionRates,
    /// Number of people, counted from the first, whom the detector never reports, 0..=2, default 0.
    pub overlooked_people: usize,
    /// Smallest view that is detected at all, as a share of the image, 0..=1, default 0.0005 (about 150
    /// pixels of 640x480, the smallest recorded view).
    pub min_area: f64,
    /// Time over which the detector's confidence in a thing persists, seconds, 0.001..=100, default 0.3:
    /// misses come in bursts of this length. (The recorded scores are correlated by 0.6, 0.4, 0.2 after 1, 2,
    /// 3 frames of 1/6 s.)
    pub burst_time: f64,
    /// `IoU` above which a box counts as a duplicate of one with the same label and a higher score, and is
    /// dropped, 0..=1, default 0.45 (the real detector's non-maximum suppression): when two people cross, one
    /// is missed. 1 = never.
    pub merged_overlap: f64,
    /// Standard deviation of each side of a box, relative to the root of the box's area, 0..=1, default
    /// 0.033, drawn anew each frame. Sides at the image border stay there, as in the recording.
    pub box_jitter: f64,
    /// Share of left and right sides that lie too far inwards, 0..=1, in bursts; default 0.1 (9 and 16 % of
    /// the measured sides are more than a tenth of the extent inwards).
    pub cut_rate: f64,
    /// Share of lower sides that lie too far inwards (feet are left out), 0..=1, in bursts; default 0.3 (32 %
    /// of the measured sides are more than a tenth inwards). Upper sides are never cut: 14 of 14 were within
    /// 7 %.
    pub low_cut_rate: f64,
    /// Largest part of the extent that is cut off, 0..=0.45, default 0.3 (the 95 % quantile of the measured
    /// lower sides).
    pub cut_depth: f64,
    /// Surplus boxes (around a part of the view) for each view of a mover, 0..=1, default 0.06 (11 of 202).
    pub surplus_rate: f64,
    /// Invented boxes (around nothing, with other labels) for each frame, 0..=1, default 0.1 (an estimate).
    pub invented_rate: f64,
    /// Share of things, but people and what they carry, that get a wrong label, 0..=1, default 0.05, in
    /// bursts (an estimate). People never do: none of the 16 missed ones was found under another label.
    pub confusion_rate: f64,
}

impl Default for DetectorConfig {
    fn default() -> Self {
        Self {
            movers: DetectionRates { size_gain: 0.85, ..DetectionRates::new(0.005, 0.024, 0.115) },
            objects: DetectionRates::new(0.3, 0.65, 0.825),
            overlooked_people: 0,
            min_area: 0.0005,
            burst_time: 0.3,
            merged_overlap: 0.45,
            box_jitter: 0.033,
            cut_rate: 0.1,
            low_cut_rate: 0.3,
            cut_depth: 0.3,
            surplus_rate: 0.06,
            invented_rate: 0.1,
            confusion_rate: 0.05,
        }
    }
}

impl DetectorConfig {
    /// A detector without errors: an exact box around every visible thing that has a label.
    #[must_use]
    pub fn ideal() -> Self {
        Self {
            movers: DetectionRates::new(0.0, 0.0, 0.0),
            objects: DetectionRates::new(0.0, 0.0, 0.0),
            min_area: 0.0,
            merged_overlap: 1.0,
            box_jitter: 0.0,
            cut_rate: 0.0,
            low_cut_rate: 0.0,
            surplus_rate: 0.0,
            invented_rate: 0.0,
            confusion_rate: 0.0,
            ..Self::default()
        }
    }

    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        self.movers.validate([
            "detector.movers.missed",
            "detector.movers.below_half",
            "detector.movers.below_seven_tenths",
            "detector.movers.usual_size",
            "detector.movers.size_gain",
        ])?;
        self.objects.validate([
            "detector.objects.missed",
            "detector.objects.below_half",
            "detector.objects.below_seven_tenths",
            "detector.objects.usual_size",
            "detector.objects.size_gain",
        ])?;
        check_range("detector.overlooked_people", self.overlooked_people as f64, 0.0..=2.0)?;
        check_range("detector.min_area", self.min_area, 0.0..=1.0)?;
        check_range("detector.burst_time", self.burst_time, 0.001..=100.0)?;
        check_range("detector.merged_overlap", self.merged_overlap, 0.0..=1.0)?;
        check_range("detector.box_jitter", self.box_jitter, 0.0..=1.0)?;
        check_range("detector.cut_rate", self.cut_rate, 0.0..=1.0)?;
        check_range("detector.low_cut_rate", self.low_cut_rate, 0.0..=1.0)?;
        check_range("detector.cut_depth", self.cut_depth, 0.0..=0.45)?;
        check_range("detector.surplus_rate", self.surplus_rate, 0.0..=1.0)?;
        check_range("detector.invented_rate", self.invented_rate, 0.0..=1.0)?;
        check_range("detector.confusion_rate", self.confusion_rate, 0.0..=1.0)
    }
}
