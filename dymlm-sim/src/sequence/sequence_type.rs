use crate::{Activity, CameraPath, SequenceConfig};

/// The eight kinds of sequence on which dynamic SLAM is usually measured, after the TUM RGB-D benchmark
/// (Sturm 2012, `freiburg3_sitting_static` and so on): two people sit at a desk or walk past it, and the
/// camera stands, moves along its axes or on a half sphere, or turns.
///
/// ```
/// use dymlm_sim::{Sequence, SequenceType};
///
/// for kind in SequenceType::ALL {
///     let sequence = Sequence::new(&kind.config())?;
///     assert_eq!(sequence.len(), 150, "{} ({})", kind.name(), kind.label());
/// }
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SequenceType {
    /// People sit, the camera stands.
    SittingStatic,
    /// People sit, the camera moves along its three axes.
    SittingXyz,
    /// People sit, the camera moves on a half sphere.
    SittingHalfSphere,
    /// People sit, the camera turns about its three axes.
    SittingRpy,
    /// People walk, the camera stands.
    WalkingStatic,
    /// People walk, the camera moves along its three axes.
    WalkingXyz,
    /// People walk, the camera moves on a half sphere.
    WalkingHalfSphere,
    /// People walk, the camera turns about its three axes.
    WalkingRpy,
}

impl SequenceType {
    /// All of them, in the order of the usual tables.
    pub const ALL: &[Self] = &[
        Self::SittingStatic,
        Self::SittingXyz,
        Self::SittingHalfSphere,
        Self::SittingRpy,
        Self::WalkingStatic,
        Self::WalkingXyz,
        Self::WalkingHalfSphere,
        Self::WalkingRpy,
    ];

    /// Its name in the benchmark, such as `walking_xyz`.
    pub fn name(self) -> &'static str {
        match self {
            Self::SittingStatic => "sitting_static",
            Self::SittingXyz => "sitting_xyz",
            Self::SittingHalfSphere => "sitting_halfsphere",
            Self::SittingRpy => "sitting_rpy",
            Self::WalkingStatic => "walking_static",
            Self::WalkingXyz => "walking_xyz",
            Self::WalkingHalfSphere => "walking_halfsphere",
            Self::WalkingRpy => "walking_rpy",
        }
    }

    /// Its short name for tables, such as `w/xyz`.
    pub fn label(self) -> &'static str {
        match self {
            Self::SittingStatic => "s/static",
            Self::SittingXyz => "s/xyz",
            Self::SittingHalfSphere => "s/half",
            Self::SittingRpy => "s/rpy",
            Self::WalkingStatic => "w/static",
            Self::WalkingXyz => "w/xyz",
            Self::WalkingHalfSphere => "w/half",
            Self::WalkingRpy => "w/rpy",
        }
    }

    /// What the people do.
    pub fn activity(self) -> Activity {
        match self {
            Self::SittingStatic | Self::SittingXyz | Self::SittingHalfSphere | Self::SittingRpy => {
                Activity::Sitting
            }
            Self::WalkingStatic | Self::WalkingXyz | Self::WalkingHalfSphere | Self::WalkingRpy => {
                Activity::Walking
            }
        }
    }

    /// How the camera moves.
    pub fn path(self) -> CameraPath {
        match self {
            Self::SittingStatic | Self::WalkingStatic => CameraPath::Static,
            Self::SittingXyz | Self::WalkingXyz => CameraPath::Xyz,
            Self::SittingHalfSphere | Self::WalkingHalfSphere => CameraPath::HalfSphere,
            Self::SittingRpy | Self::WalkingRpy => CameraPath::Rpy,
        }
    }

    /// The sequence in the office: 150 frames at 10 Hz, two people, a seed of its own, all else by default.
    pub fn config(self) -> SequenceConfig {
        SequenceConfig {
            seed: self.seed(),
            path: self.path(),
            activity: self.activity(),
            ..SequenceConfig::default()
        }
    }

    /// A seed with which the walkers, whose ways meet at their ends, keep more than 0.6 m apart.
    fn seed(self) -> u64 {
        match self {
            Self::SittingStatic => 1,
            Self::SittingXyz => 2,
            Self::SittingHalfSphere => 3,
            Self::SittingRpy => 4,
            Self::WalkingStatic => 31,
            Self::WalkingXyz => 22,
            Self::WalkingHalfSphere => 18,
            Self::WalkingRpy => 28,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn people_keep_apart() {
        for kind in SequenceType::ALL {
            let config = kind.config();
            let scene = Scene::new(&config);
            let mut bodies = Vec::new();
            for index in 0..config.frames {
                scene.moving_parts(index as f64 / config.frame_rate, &mut bodies);
                let trunks: Vec<_> = [1, 19].map(|k| bodies[k].scene_from_part.translation).into();
                assert!(trunks[0].distance(trunks[1]) > 0.6, "{} at frame {index}", kind.name());
            }
        }
    }
}
