use dymlm_core::{ConfigError, check_range};

/// Settings of [`ForegroundFinder`](crate::ForegroundFinder).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct ForegroundConfig {
    /// Distance of the sampled pixels, in pixels of an image 640 wide (other images: in proportion); 1..=64, default
    /// 4: some thousand points for a person that fills the image.
    pub stride: usize,
    /// How far around the box parts of the mover are looked for, in the same pixels; 0..=640, default 50: as far as
    /// the correction of boxes may go.
    pub margin: f32,
    /// Radius of DBSCAN, metres at a depth of 1 m, growing with depth; 1e-3..=1, default 0.025: three strides of a
    /// camera with a field of view of 60 degrees.
    pub eps: f32,
    /// Neighbours that make a core point of DBSCAN, itself counted; 1..=1e6, default 5: less than the seven that
    /// a strip one sample wide has within eps, such as a leg seen through the slats of a chair.
    pub min_points: usize,
    /// Largest change of depth from a pixel to the next one of the same surface, metres at a depth of 1 m, growing
    /// with depth; 1e-3..=0.5, default 0.02: above a Kinect's depth steps, below the gap between a person and most
    /// furniture.
    pub max_step: f32,
    /// Furthest that the mover's surface may reach before and behind its median depth, metres; 0.05..=10, default
    /// 0.6: an outstretched arm.
    pub max_reach: f32,
    /// Furthest that the mean depth of another cluster may lie before the mover's median depth for it to count as a
    /// part of the mover, metres; 0..=10, default 0.35: a forearm before the body.
    pub part_reach_near: f32,
    /// The same behind it; 0..=10, default 0.5: a leg or an arm behind the body, a person leaning. Both tuned on a
    /// recorded kitchen.
    pub part_reach_far: f32,
}

impl Default for ForegroundConfig {
    fn default() -> Self {
        Self {
            stride: 4,
            margin: 50.0,
            eps: 0.025,
            min_points: 5,
            max_step: 0.02,
            max_reach: 0.6,
            part_reach_near: 0.35,
            part_reach_far: 0.5,
        }
    }
}

impl ForegroundConfig {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("foreground.stride", self.stride as f64, 1.0..=64.0)?;
        check_range("foreground.margin", self.margin.into(), 0.0..=640.0)?;
        check_range("foreground.eps", self.eps.into(), 1e-3..=1.0)?;
        check_range("foreground.min_points", self.min_points as f64, 1.0..=1e6)?;
        check_range("foreground.max_step", self.max_step.into(), 1e-3..=0.5)?;
        check_range("foreground.max_reach", self.max_reach.into(), 0.05..=10.0)?;
        check_range("foreground.part_reach_near", self.part_reach_near.into(), 0.0..=10.0)?;
        check_range("foreground.part_reach_far", self.part_reach_far.into(), 0.0..=10.0)
    }
}
