use dymlm_core::vector3::{dot, unit};

use crate::plane_map::{MapPlane, PlaneMap};

/// The kind of a plane in a room, by its orientation and height.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum SurfaceKind {
    /// Level, facing up, at about the height of the lowest such plane that is large.
    Floor,
    /// Level, facing up, higher than the floor: tables, seats, shelves.
    Table,
    /// Upright.
    Wall,
    /// Level, facing down.
    Ceiling,
    /// Anything else.
    Slanted,
}

/// Settings of [`PlaneMap::surfaces`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct SurfaceConfig {
    /// Largest angle of a level or upright plane from exactly level or upright, degrees. Default 10.
    pub max_tilt_deg: f64,
    /// The floor is the lowest level plane facing up of at least this area, square metres. Default 0.5.
    pub min_floor_area: f64,
    /// Level planes at most this much higher than the floor count as floor, metres. Default 0.1: a carpet, a
    /// threshold.
    pub floor_height: f64,
}

impl Default for SurfaceConfig {
    fn default() -> Self {
        Self { max_tilt_deg: 10.0, min_floor_area: 0.5, floor_height: 0.1 }
    }
}

/// A plane and its kind.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// The plane.
    pub plane: &'a MapPlane,
    /// Its kind.
    pub kind: SurfaceKind,
    /// Height of its centroid along the up vector from the world's origin, metres.
    pub height: f64,
}

impl PlaneMap {
    /// The kind of each confirmed plane, given a vector that points up in the world; in the order in which
    /// the planes came into the map. Empty for a vector without length.
    ///
    /// ```
    /// use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose, SensorModel};
    /// use dymlm_planes::{PlaneConfig, PlaneMapper, SurfaceConfig, SurfaceKind};
    ///
    /// // A camera that looks down on a floor; its z axis is the world's.
    /// let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5)?;
    /// let depth = DepthImage::new(160, 120, vec![1.5; 160 * 120])?;
    /// let mut mapper = PlaneMapper::new(PlaneConfig::default(), SensorModel::kinect())?;
    /// for time in [0.0, 1.0] {
    ///     let floor = Frame::new(time, camera, depth.clone(), None)?;
    ///     mapper.insert(&floor, None, &[], &Pose::identity())?;
    /// }
    ///
    /// let surfaces = mapper.map().surfaces([0.0, 0.0, -1.0], &SurfaceConfig::default());
    /// assert_eq!(surfaces[0].kind, SurfaceKind::Floor);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn surfaces(&self, up: [f64; 3], config: &SurfaceConfig) -> Vec<Surface<'_>> {
        let Some(up) = unit(up) else { return Vec::new() };
        let (sin, cos) = config.max_tilt_deg.to_radians().sin_cos();
        let mut surfaces: Vec<Surface<'_>> = self
            .iter()
            .map(|plane| {
                let cosine = dot(plane.plane().normal(), up);
                let kind = if cosine >= cos {
                    SurfaceKind::Table
                } else if cosine <= -cos {
                    SurfaceKind::Ceiling
                } else if cosine.abs() <= sin {
                    SurfaceKind::Wall
                } else {
                    SurfaceKind::Slanted
                };
                Surface { plane, kind, height: dot(plane.centroid(), up) }
            })
            .collect();
        let floor = surfaces
            .iter()
            .filter(|surface| {
                surface.kind == SurfaceKind::Table && surface.plane.area() >= config.min_floor_area
            })
            .map(|surface| surface.height)
            .min_by(f64::total_cmp);
        if let Some(floor) = floor {
            for surface in &mut surfaces {
                let low = surface.height <= floor + config.floor_height;
                if surface.kind == SurfaceKind::Table && low {
                    surface.kind = SurfaceKind::Floor;
                }
            }
        }
        surfaces
    }
}
