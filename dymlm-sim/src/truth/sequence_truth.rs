use dymlm_core::{ConfigError, Point, Pose, check_range};
use dymlm_metrics::{SeenPoints, SpaceTruth, TrueFace, TrueObject};

use super::face_truth::FaceTruth;
use super::object_truth::ObjectTruth;
use super::surfaces::Surfaces;
use super::swept_volume::SweptVolume;
use super::thin_parts::thin_parts;
use crate::{Sequence, SimulatedFrame};

/// How the truth about a sequence is gathered.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TruthConfig {
    /// Nearest depth that counts as seen, metres, 0..=100 and at most `max_depth`, default 0.5.
    pub min_depth: f64,
    /// Farthest depth that counts as seen, metres, 0..=1000, default 4: as far as maps use a Kinect.
    pub max_depth: f64,
    /// Frames that must see a surface point before a map is expected to have it, 1..=1000000, default 3.
    pub min_views: u32,
    /// Largest angle between ray and normal at which a flat face counts as seen, degrees, 10..=90, default
    /// 80: beyond, a Kinect has few readings (Nguyen 2012), and no plane is fitted to them.
    pub max_incidence_deg: f64,
}

/// Side of the cubes in which visible surface is sampled, and of the cells of flat faces, metres.
const SAMPLE_DISTANCE: f64 = 0.02;
/// How far around the movers' bodies a point counts as swept by them, metres: three sigma of a Kinect's noise
/// at 3.5 m plus the grid's rounding.
const SWEPT_MARGIN: f32 = 0.1;
/// How close to a thin part's surface a point counts as on it, metres: visible points are exact.
const ON_SURFACE: f32 = 1e-3;
/// How far around a person a point counts as near people, metres.
const NEAR: f32 = 0.5;
/// A labelled thing is visible in a frame of 640x480 if at least this many of its pixels have a reading
/// within range; at other sizes, the number scales with the image's area.
const MIN_OBJECT_PIXELS: f64 = 100.0;

impl Default for TruthConfig {
    fn default() -> Self {
        Self { min_depth: 0.5, max_depth: 4.0, min_views: 3, max_incidence_deg: 80.0 }
    }
}

impl TruthConfig {
    fn validate(&self) -> Result<(), ConfigError> {
        check_range("truth.max_depth", self.max_depth, 0.0..=1000.0)?;
        check_range("truth.min_depth", self.min_depth, 0.0..=self.max_depth.min(100.0))?;
        check_range("truth.min_views", self.min_views.into(), 1.0..=1e6)?;
        check_range("truth.max_incidence_deg", self.max_incidence_deg, 10.0..=90.0)
    }
}

/// The exact truth about a sequence, in its world frame: static surfaces, the volume that movers swept, the
/// surface points that were seen, where that volume was looked through, flat faces, and labelled objects.
///
/// Distances are exact to the analytic bodies (f32), the swept volume is kept in cells of 5 cm. Gathering
/// costs about as much as rendering one or two frames, observing a frame O(pixels).
#[derive(Debug, Clone)]
pub struct Truth {
    config: TruthConfig,
    scene_from_world: Pose,
    surfaces: Surfaces,
    swept: SweptVolume,
    swept_undetected: SweptVolume,
    near_people: SweptVolume,
    thin_things: Surfaces,
    seen: SeenPoints,
    faces: FaceTruth,
    objects: ObjectTruth,
}

impl Truth {
    /// The static surfaces and the swept volume of a sequence. No frame is rendered: pass the frames to
    /// [`observe`](Self::observe) as they are used, or take [`of`](Self::of).
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when a field is outside its range.
    pub fn new(sequence: &Sequence, config: &TruthConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        let scene = sequence.scene();
        let overlooked = sequence.config().detector.overlooked_people;
        // Within half a second, people hardly leave the neighbourhood of where they were.
        let moments =
            (0..=(2.0 * sequence.timestamp(sequence.len())) as u32).map(|half| 0.5 * f64::from(half));
        let times = (0..sequence.len()).map(|index| sequence.timestamp(index));
        Ok(Self {
            config: *config,
            scene_from_world: sequence.config().world_from_scene.inverse(),
            surfaces: Surfaces::new(&sequence.scene().static_parts),
            swept: SweptVolume::new(times.clone(), SWEPT_MARGIN, |time, bodies| {
                scene.passing_parts(time, bodies);
            }),
            swept_undetected: SweptVolume::new(times, SWEPT_MARGIN, |time, bodies| {
                scene.undetected_parts(time, overlooked, bodies);
            }),
            near_people: SweptVolume::new(moments, NEAR, |time, bodies| scene.people_parts(time, bodies)),
            thin_things: Surfaces::new(&thin_parts(&scene.static_parts)),
            seen: SeenPoints::new(SAMPLE_DISTANCE),
            faces: FaceTruth::new(sequence.scene(), SAMPLE_DISTANCE),
            objects: ObjectTruth::new(sequence.scene(), SAMPLE_DISTANCE),
        })
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

    /// Notes which surface points, faces and objects a frame sees: pixels where the sensor has a reading, the
    /// exact depth is within range, and the surface still stands there at the end; and where it looks through
    /// the volume that movers swept. Each frame must be observed once.
    pub fn observe(&mut self, frame: &SimulatedFrame) {
        let number = self.seen.next_frame();
        let camera = frame.frame.camera();
        let range = self.config.min_depth as f32..=self.config.max_depth as f32;
        let scene_from_camera = self.scene_from_world * frame.world_from_camera;
        let least_cosine = self.config.max_incidence_deg.to_radians().cos();
        let near_enough = self.config.min_depth..=self.config.max_depth;
        let mut faces = self.faces.view(scene_from_camera, least_cosine, near_enough, number);
        let pixels =
            frame.true_depth.data().iter().zip(frame.frame.depth().data()).zip(frame.transient_mask.pixels());
        for (pixel, (((&z, &reading), is_transient), &part)) in pixels.zip(&frame.parts).enumerate() {
            if is_transient || reading <= 0.0 {
                continue;
            }
            let (u, v) = (pixel % camera.width(), pixel / camera.width());
            let in_camera = camera.back_project([u as f64, v as f64], z.into());
            faces.see(part, in_camera);
            if !range.contains(&z) {
                continue;
            }
            self.objects.see(part, scene_from_camera.transform_point(in_camera), number);
            self.seen.see(frame.world_from_camera.transform_point(in_camera).map(|c| c as f32));
        }
        self.swept.look(
            frame,
            &scene_from_camera.inverse(),
            &(self.config.min_depth..=self.config.max_depth),
        );
        let image_share = (camera.width() * camera.height()) as f64 / (640.0 * 480.0);
        self.objects.end_frame(MIN_OBJECT_PIXELS * image_share);
    }

    /// All flat faces of the static scene, seen or not, in a fixed order: sides of cuboids, caps of
    /// cylinders, the inner sides of the room. Sides of one or several things that are on one plane (within 2
    /// mm), face the same way and touch (within 1.5 cm) form one face. A cell of a face (2 cm) is seen when
    /// at least `min_views` frames have a reading of it that is within range and not too steep.
    pub fn faces(&self) -> Vec<TrueFace> {
        self.faces.in_world(&self.scene_from_world.inverse(), self.config.min_views)
    }

    /// All labelled things that stay, seen or not, by ascending id.
    pub fn objects(&self) -> Vec<TrueObject> {
        self.objects.in_world(&self.scene_from_world.inverse(), self.config.min_views)
    }

    /// Whether a point is in the volume swept by movers that no detector reports: overlooked people, and
    /// things that events move, until they stand at their last place. Margin and cells are those of
    /// [`swept_by_movers`](SpaceTruth::swept_by_movers).
    pub fn swept_by_undetected(&self, point: Point) -> bool {
        self.in_scene(point).is_some_and(|point| self.swept_undetected.contains(point))
    }

    /// A world point in the scene's frame; `None` when the point is not finite.
    fn in_scene(&self, point: Point) -> Option<Point> {
        let point = self.scene_from_world.transform_point(point.map(f64::from)).map(|c| c as f32);
        point.iter().all(|c| c.is_finite()).then_some(point)
    }
}

impl SpaceTruth for Truth {
    /// Exact to the analytic bodies (f32).
    fn surface_distance(&self, point: Point) -> f32 {
        self.in_scene(point).map_or(f32::INFINITY, |point| self.surfaces.distance(point))
    }

    /// The volume is grown by 10 cm and kept in cells of 5 cm, whose centres decide.
    fn swept_by_movers(&self, point: Point) -> bool {
        self.in_scene(point).is_some_and(|point| self.swept.contains(point))
    }

    /// At least `min_views` frames have looked through the cell of 5 cm around the point, when nothing was
    /// there.
    fn was_looked_through(&self, point: Point) -> bool {
        self.in_scene(point).is_some_and(|point| self.swept.is_looked_through(point, self.config.min_views))
    }

    /// Within half a metre of somebody's body, in cells of 5 cm.
    fn near_people(&self, point: Point) -> bool {
        self.in_scene(point).is_some_and(|point| self.near_people.contains(point))
    }

    /// On the surface of a part that has free space on both sides, at most 6 cm apart: a table top, a screen, a
    /// leg, a slat; no floor or carpet, nor what is flat on a wall.
    fn on_thin_things(&self, point: Point) -> bool {
        self.in_scene(point).is_some_and(|point| self.thin_things.distance(point) <= ON_SURFACE)
    }

    /// Points that at least `min_views` frames saw, one for each cube of 2 cm, in the order of the cubes.
    fn visible_points(&self) -> Vec<Point> {
        self.seen.points(self.config.min_views)
    }
}
