use dymlm_core::{ConfigError, check_range};

/// How sure a detector is of the things that it sees whole: the distribution of its score.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct DetectionRates {
    /// Share of views that are missed (score below 0.25), 0..=1.
    pub missed: f64,
    /// Share of views missed or of a score below 0.5, `missed`..=1.
    pub below_half: f64,
    /// Share of views missed or of a score below 0.7, `below_half`..=1.
    pub below_seven_tenths: f64,
}

impl DetectionRates {
    /// The three shares, in rising order.
    pub fn new(missed: f64, below_half: f64, below_seven_tenths: f64) -> Self {
        Self { missed, below_half, below_seven_tenths }
    }

    fn validate(&self, names: [&'static str; 3]) -> Result<(), ConfigError> {
        check_range(names[0], self.missed, 0.0..=1.0)?;
        check_range(names[1], self.below_half, self.missed..=1.0)?;
        check_range(names[2], self.below_seven_tenths, self.below_half..=1.0)
    }
}

/// How a 2D detector errs. The defaults follow YOLOX-Nano (score >= 0.25) on 202 views of people with exact
/// masks: 94.6 % found, 90.6 % at score >= 0.5, 80.7 % at 0.7; 98.4 % of those with at least 5000 pixels at
/// 640x480; misses come in bursts of one to three frames at 6 Hz; 12 of 197 boxes are surplus.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct DetectorConfig {
    /// Scores of people, when not slivers. Default 0.016, 0.047, 0.145: with the slivers they give the measured
    /// figures above.
    pub movers: DetectionRates,
    /// Scores of all other things. Default 0.3, 0.65, 0.825: the median score of the 918 boxes of other labels
    /// in the same recording is 0.49, a quarter is above 0.7; the misses are an estimate.
    pub objects: DetectionRates,
    /// Share of the image below which a view is a sliver, 0..=1, default 0.016 (5000 pixels of 640x480).
    pub sliver_area: f64,
    /// Share of people's slivers that are missed, 0..=1, default 0.67 (8 of 12).
    pub sliver_missed: f64,
    /// Share of the image that a view needs to be seen at all, 0..=1, default 0.0005 (about 150 pixels of 640x480).
    pub min_area: f64,
    /// Time over which the detector's confidence in a thing persists, seconds, 0.001..=100, default 0.3: misses
    /// come in bursts of this length.
    pub burst_time: f64,
    /// Standard deviation of each side of a box, relative to the box's extent, 0..=1, default 0.015. (Half of
    /// the measured left and right sides are within 0.028 of the mask's, but what they miss is mostly thin.)
    pub box_jitter: f64,
    /// Share of a box's sides that are cut short, 0..=1, default 0.015, also in bursts: with the jitter and the
    /// misses it leaves about 3 % of the people's pixels outside all boxes; 2.3 % were measured.
    pub cut_rate: f64,
    /// Largest part of the extent that is cut off, 0..=0.45, default 0.3 (99 % of the measured left and right
    /// sides).
    pub cut_depth: f64,
    /// Surplus boxes (doubled or of a part only) a view of a mover, 0..=1, default 0.06 (12 of 197).
    pub surplus_rate: f64,
    /// Invented boxes of other labels a frame, 0..=1, default 0.1 (an estimate).
    pub invented_rate: f64,
    /// Share of other things that are given another label, 0..=1, default 0.05, in bursts (an estimate). People
    /// are not: the recording has no person under another name.
    pub confusion_rate: f64,
}

impl Default for DetectorConfig {
    fn default() -> Self {
        Self {
            movers: DetectionRates::new(0.016, 0.047, 0.145),
            objects: DetectionRates::new(0.3, 0.65, 0.825),
            sliver_area: 0.016,
            sliver_missed: 0.67,
            min_area: 0.0005,
            burst_time: 0.3,
            box_jitter: 0.015,
            cut_rate: 0.015,
            cut_depth: 0.3,
            surplus_rate: 0.06,
            invented_rate: 0.1,
            confusion_rate: 0.05,
        }
    }
}

impl DetectorConfig {
    /// A detector that errs in nothing: a box around every visible thing that has a label.
    #[must_use]
    pub fn ideal() -> Self {
        Self {
            movers: DetectionRates::new(0.0, 0.0, 0.0),
            objects: DetectionRates::new(0.0, 0.0, 0.0),
            sliver_missed: 0.0,
            min_area: 0.0,
            box_jitter: 0.0,
            cut_rate: 0.0,
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
        ])?;
        self.objects.validate([
            "detector.objects.missed",
            "detector.objects.below_half",
            "detector.objects.below_seven_tenths",
        ])?;
        check_range("detector.sliver_area", self.sliver_area, 0.0..=1.0)?;
        check_range("detector.sliver_missed", self.sliver_missed, 0.0..=1.0)?;
        check_range("detector.min_area", self.min_area, 0.0..=1.0)?;
        check_range("detector.burst_time", self.burst_time, 0.001..=100.0)?;
        check_range("detector.box_jitter", self.box_jitter, 0.0..=1.0)?;
        check_range("detector.cut_rate", self.cut_rate, 0.0..=1.0)?;
        check_range("detector.cut_depth", self.cut_depth, 0.0..=0.45)?;
        check_range("detector.surplus_rate", self.surplus_rate, 0.0..=1.0)?;
        check_range("detector.invented_rate", self.invented_rate, 0.0..=1.0)?;
        check_range("detector.confusion_rate", self.confusion_rate, 0.0..=1.0)
    }
}
