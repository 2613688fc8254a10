use dymlm::MapConfig;
use dymlm::dynamics::MaskMode;
use serde::Serialize;

/// In which frames the 2D detector runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Detector {
    /// In every frame.
    EveryFrame,
    /// In the first of every this many frames.
    EveryNth(usize),
}

impl Detector {
    /// Whether it runs in frame `index`.
    pub(crate) fn runs(self, index: usize) -> bool {
        match self {
            Self::EveryFrame => true,
            Self::EveryNth(n) => index.is_multiple_of(n.max(1)),
        }
    }
}

/// How movers are treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Treatment {
    /// Without detections: movers are found as new readings in free space, and by late removal.
    NoDetections,
    /// Everything inside the detector's boxes is removed.
    RawBoxes,
    /// Boxes that the detector missed are predicted.
    Compensation,
    /// Boxes cut short are extended as well (the paper's full preprocessing).
    Correction,
    /// Within the boxes, only pixels that are connected in depth are removed (our default).
    Silhouettes,
}

impl Treatment {
    /// From least to most.
    pub(crate) const ALL: &[Self] =
        &[Self::NoDetections, Self::RawBoxes, Self::Compensation, Self::Correction, Self::Silhouettes];

    /// Name in tables.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::NoDetections => "no detections",
            Self::RawBoxes => "raw boxes",
            Self::Compensation => "boxes, compensation",
            Self::Correction => "boxes, + correction",
            Self::Silhouettes => "silhouettes",
        }
    }

    /// The config for this treatment.
    pub(crate) fn config(self) -> MapConfig {
        let mut config = MapConfig::default();
        if !matches!(self, Self::NoDetections | Self::Silhouettes) {
            config.dynamics.mask.mode = MaskMode::Box;
        }
        if matches!(self, Self::RawBoxes | Self::Compensation) {
            config.dynamics.max_extension = 0.0;
        }
        if self == Self::RawBoxes {
            config.dynamics.tracker.max_coast = 0.0;
        }
        config
    }
}
