use std::ops::RangeInclusive;

use dymlm_core::vector3::dot;
use dymlm_core::{Plane, Pose};
use dymlm_metrics::{CellRaster, FaceCells, TrueFace};
use parry3d::math::{Mat3, Pose3, Rot3, Vec3};

use super::flat_side::{FlatSide, SIDES, bounds_of, flat_sides, side_number};
use crate::scene::{Part, Scene, Shape};

/// The flat faces of a scene, and how many frames saw each of their cells.
#[derive(Debug, Clone)]
pub(super) struct FaceTruth {
    faces: Vec<SceneFace>,
    bodies: Vec<Body>,
}

/// A face in the scene's frame: flat sides of bodies that lie on one plane and touch.
#[derive(Debug, Clone)]
struct SceneFace {
    label: Option<&'static str>,
    relief: usize,
    normal: [f64; 3],
    /// Corners of the flat sides.
    pieces: Vec<Vec<[f64; 3]>>,
    raster: CellRaster,
    inside: Vec<bool>,
    views: Vec<CellViews>,
}

#[derive(Debug, Clone, Copy, Default)]
struct CellViews {
    /// Frames that saw the cell well.
    frames: u32,
    last_frame: u32,
    /// Whether any frame has a reading of the cell.
    read: bool,
}

/// A body, and the face that each of its sides belongs to.
#[derive(Debug, Clone)]
struct Body {
    shape: Shape,
    scene_from_part: Pose3,
    faces: [Option<u32>; SIDES],
}

/// One frame, whose pixels are being added to the faces' cells.
#[derive(Debug)]
pub(super) struct FaceView<'a> {
    truth: &'a mut FaceTruth,
    scene_from_camera: Pose,
    /// For each body: the rotation from the camera's frame into the body's, and the camera's position there.
    part_from_camera: Vec<(Mat3, Vec3)>,
    /// Normals of the faces in the camera's frame.
    normals: Vec<[f64; 3]>,
    least_cosine: f64,
    range: RangeInclusive<f64>,
    frame: u32,
}

/// Cosine of the largest angle between a face and the face that it lies on: 3 degrees.
const SAME_ORIENTATION: f64 = 0.998_63;
/// Largest height of a relief that a depth camera can hardly distinguish from the face below, metres: two
/// standard deviations of a Kinect's depth at 3 m.
const RELIEF_HEIGHT: f64 = 0.03;
/// Faces whose bounding boxes are farther apart than this neither touch nor lie on each other, metres.
const REACH: f64 = 0.05;
/// Share of a relief that must be within the outline of the face below.
const RELIEF_SHARE: f64 = 0.8;

impl FaceTruth {
    /// The faces in cells of about `cell` metres.
    pub(super) fn new(scene: &Scene, cell: f64) -> Self {
        let parts = &scene.static_parts;
        let sides: Vec<FlatSide> =
            parts.iter().enumerate().flat_map(|(index, part)| flat_sides(part, index)).collect();
        let mut bodies: Vec<Body> = parts.iter().map(Body::new).collect();
        let mut faces = Vec::new();
        for group in continued_sides(&sides) {
            let Some(face) = SceneFace::new(&sides, &group, scene, faces.len(), cell) else { continue };
            for &side in &group {
                bodies[sides[side].part].faces[sides[side].side] = u32::try_from(faces.len()).ok();
            }
            faces.push(face);
        }
        find_reliefs(&mut faces);
        Self { faces, bodies }
    }

    /// Begins frame number `frame` (from 1). A face is seen well at depths in `range` where the cosine
    /// between ray and normal is at least `least_cosine`.
    pub(super) fn view(
        &mut self,
        scene_from_camera: Pose,
        least_cosine: f64,
        range: RangeInclusive<f64>,
        frame: u32,
    ) -> FaceView<'_> {
        let camera_from_scene = scene_from_camera.inverse();
        let [x, y, z, w] = scene_from_camera.quaternion().map(|q| q as f32);
        let rotation = Rot3::from_xyzw(x, y, z, w);
        let eye = Vec3::from(scene_from_camera.translation().map(|c| c as f32));
        let part_from_camera = self.bodies.iter().map(|body| {
            let part_from_camera = body.scene_from_part.rotation.inverse() * rotation;
            (Mat3::from_quat(part_from_camera), body.scene_from_part.inverse_transform_point(eye))
        });
        FaceView {
            part_from_camera: part_from_camera.collect(),
            normals: self.faces.iter().map(|face| camera_from_scene.rotate(face.normal)).collect(),
            truth: self,
            scene_from_camera,
            least_cosine,
            range,
            frame,
        }
    }

    /// The faces in the world; cells that at least `min_views` frames saw well count as seen.
    pub(super) fn in_world(&self, world_from_scene: &Pose, min_views: u32) -> Vec<TrueFace> {
        let faces = self.faces.iter().enumerate();
        faces.filter_map(|(id, face)| face.in_world(id, world_from_scene, min_views)).collect()
    }
}

impl FaceView<'_> {
    /// Notes that a pixel shows `point` (in the camera's frame) on the static body `part`.
    #[inline]
    pub(super) fn see(&mut self, part: u16, point: [f64; 3]) {
        let part = usize::from(part);
        let (Some(body), Some((rotation, eye))) =
            (self.truth.bodies.get(part), self.part_from_camera.get(part))
        else {
            return;
        };
        let local = *rotation * Vec3::from(point.map(|c| c as f32)) + *eye;
        let Some(face) = side_number(&body.shape, body.shape.normal(local)).and_then(|side| body.faces[side])
        else {
            return;
        };
        let towards_camera = -dot(self.normals[face as usize], point);
        let steep = towards_camera < self.least_cosine * dot(point, point).sqrt();
        let well = !steep && self.range.contains(&point[2]);
        let face = &mut self.truth.faces[face as usize];
        let at = face.raster.coordinates(self.scene_from_camera.transform_point(point));
        if let Some(cell) = face.raster.cell_at(at) {
            let views = &mut face.views[cell];
            views.read = true;
            if well && views.last_frame != self.frame {
                views.frames += 1;
                views.last_frame = self.frame;
            }
        }
    }
}

impl Body {
    fn new(part: &Part) -> Self {
        Self { shape: part.shape, scene_from_part: part.scene_from_part, faces: [None; SIDES] }
    }
}

/// Groups of sides that continue each other, directly or through others, in the order of their first sides.
fn continued_sides(sides: &[FlatSide]) -> Vec<Vec<usize>> {
    let mut first: Vec<usize> = (0..sides.len()).collect();
    for (a, b) in near_pairs(&sides.iter().map(FlatSide::bounds).collect::<Vec<_>>()) {
        if first[a] != first[b] && sides[a].continues(&sides[b]) {
            let (kept, joined) = (first[a].min(first[b]), first[a].max(first[b]));
            first.iter_mut().filter(|group| **group == joined).for_each(|group| *group = kept);
        }
    }
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); sides.len()];
    first.iter().enumerate().for_each(|(side, &group)| groups[group].push(side));
    groups.retain(|group| !group.is_empty());
    groups
}

/// The pairs of boxes (lowest and highest corner) that are within [`REACH`] of each other, the lower index
/// first. The boxes are swept along x, so that only pairs that overlap along x are compared.
fn near_pairs(bounds: &[[[f64; 3]; 2]]) -> Vec<(usize, usize)> {
    let mut order: Vec<usize> = (0..bounds.len()).collect();
    order.sort_by(|&a, &b| bounds[a][0][0].total_cmp(&bounds[b][0][0]));
    let mut pairs = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    for b in order {
        let [low, high] = bounds[b];
        open.retain(|&a| bounds[a][1][0] + REACH >= low[0]);
        let meets = |&&a: &&usize| {
            (1..3).all(|axis| {
                bounds[a][0][axis] <= high[axis] + REACH && low[axis] <= bounds[a][1][axis] + REACH
            })
        };
        pairs.extend(open.iter().filter(meets).map(|&a| (a.min(b), a.max(b))));
        open.push(b);
    }
    pairs
}

/// Assigns each face to the largest face that it lies on. Large faces come first, and a face that lies on
/// another has no relief of its own: reliefs do not chain.
fn find_reliefs(faces: &mut [SceneFace]) {
    let area = |face: &SceneFace| {
        face.inside.iter().filter(|&&inside| inside).count() as f64 * face.raster.cell_area()
    };
    let areas: Vec<f64> = faces.iter().map(area).collect();
    let mut order: Vec<usize> = (0..faces.len()).collect();
    order.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]));
    let mut rank = vec![0; faces.len()];
    order.iter().enumerate().for_each(|(place, &face)| rank[face] = place);
    let mut larger: Vec<Vec<usize>> = vec![Vec::new(); faces.len()];
    for (a, b) in near_pairs(&faces.iter().map(SceneFace::bounds).collect::<Vec<_>>()) {
        let (large, small) = if rank[a] < rank[b] { (a, b) } else { (b, a) };
        larger[small].push(large);
    }
    for small in order {
        larger[small].sort_by_key(|&large| rank[large]);
        let is_base = |&large: &usize| faces[large].relief == large && faces[small].lies_on(&faces[large]);
        if let Some(large) = larger[small].iter().copied().find(is_base) {
            faces[small].relief = large;
        }
    }
}

impl SceneFace {
    fn new(sides: &[FlatSide], group: &[usize], scene: &Scene, id: usize, cell: f64) -> Option<Self> {
        let mut group: Vec<&FlatSide> = group.iter().map(|&side| &sides[side]).collect();
        group.sort_by(|a, b| b.doubled_area().total_cmp(&a.doubled_area()));
        let largest = *group.first()?;
        let pieces: Vec<Vec<[f64; 3]>> = group.iter().map(|side| side.corners.clone()).collect();
        // The raster's plane goes through its first point, which is a corner of the largest side.
        let corners = pieces.iter().flatten().copied();
        let raster = CellRaster::around(corners, largest.normal, largest.along_u, cell)?;
        let instance = scene.static_parts[largest.part].instance;
        Some(Self {
            label: scene.instances.get(instance).and_then(|thing| thing.label),
            relief: id,
            normal: largest.normal,
            inside: raster.fill_any(&pieces),
            views: vec![CellViews::default(); raster.len()],
            pieces,
            raster,
        })
    }

    fn bounds(&self) -> [[f64; 3]; 2] {
        bounds_of(self.pieces.iter().flatten())
    }

    /// Whether most of the face is within the other's outline, close to it and facing the same way.
    fn lies_on(&self, other: &Self) -> bool {
        let (other_corner, _) = other.raster.frame();
        let level = dot(other.normal, other_corner);
        if dot(self.normal, other.normal) < SAME_ORIENTATION
            || self
                .pieces
                .iter()
                .flatten()
                .any(|&c| (dot(other.normal, c) - level).abs() > RELIEF_HEIGHT + 1e-6)
        {
            return false;
        }
        let cells = || (0..self.raster.len()).filter(|&cell| self.inside[cell]);
        let is_over = |&cell: &usize| {
            let at = other.raster.coordinates(self.raster.center(cell));
            other.raster.cell_at(at).is_some_and(|cell| other.inside[cell])
        };
        cells().filter(is_over).count() as f64 >= RELIEF_SHARE * cells().count() as f64
    }

    fn in_world(&self, id: usize, world_from_scene: &Pose, min_views: u32) -> Option<TrueFace> {
        let raster = self.raster.moved(
            |point| world_from_scene.transform_point(point),
            |direction| world_from_scene.rotate(direction),
        );
        let normal = world_from_scene.rotate(self.normal);
        let plane = Plane::new(normal, -dot(normal, raster.frame().0)).ok()?;
        let cells = || self.inside.iter().zip(&self.views);
        let seen = cells().map(|(&inside, views)| inside && views.frames >= min_views).collect();
        let read = cells().map(|(&inside, views)| inside && views.read).collect();
        let cells = FaceCells { raster, inside: self.inside.clone(), seen, read };
        let place = |corner: &[f64; 3]| world_from_scene.transform_point(*corner);
        let outline = self.pieces.iter().map(|piece| piece.iter().map(place).collect()).collect();
        let mut face = TrueFace::from_cells(id, plane, outline, cells)?;
        face.relief = self.relief;
        face.label = self.label.map(str::to_owned);
        Some(face)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Activity, Cast, Instance, Material, Motion};

    /// A scene of still cuboids of full lengths `sizes` about `centers`.
    fn cuboids(bodies: &[([f32; 3], [f32; 3])]) -> Scene {
        let mut scene = Scene::office(&Cast::usual(Activity::Walking, 0));
        let material: Material = scene.static_parts[0].material;
        scene.instances =
            vec![Instance { label: None, motion: Motion::Still, scene_from_thing: Pose3::IDENTITY }];
        scene.static_parts = bodies
            .iter()
            .map(|&(center, size)| Part {
                shape: Shape::cuboid(0.5 * Vec3::from(size)),
                scene_from_part: Pose3::from_translation(center.into()),
                material,
                instance: 0,
            })
            .collect();
        scene
    }

    /// The faces that look up, by descending area.
    fn upper(scene: &Scene) -> Vec<TrueFace> {
        let faces = FaceTruth::new(scene, 0.02).in_world(&Pose::identity(), 1);
        let mut upper: Vec<TrueFace> =
            faces.into_iter().filter(|face| face.plane.normal()[2] > 0.9).collect();
        upper.sort_by(|a, b| b.area.total_cmp(&a.area));
        upper
    }

    #[test]
    fn boards_that_touch_on_one_plane_are_one_face() {
        let boards = |gap: f32, step: f32| {
            upper(&cuboids(&[
                ([0.0, 0.0, 0.5], [1.0, 0.6, 0.02]),
                ([1.0 + gap, 0.0, 0.5 + step], [1.0, 0.6, 0.02]),
            ]))
        };
        for (gap, step) in [(0.0, 0.0), (0.014, 0.0), (0.0, 0.0015), (-0.1, 0.0)] {
            let faces = boards(gap, step);
            assert_eq!((faces.len(), faces[0].outline.len()), (1, 2), "gap {gap}, step {step}");
            assert!((faces[0].area - 1.2).abs() < 0.07, "{}", faces[0].area);
        }
        for (gap, step) in [(0.016, 0.0), (0.0, 0.0025)] {
            let faces = boards(gap, step);
            assert_eq!(faces.len(), 2, "gap {gap}, step {step}");
            assert!(faces.iter().all(|face| (face.area - 0.6).abs() < 1e-6 && face.relief == face.id));
        }
    }

    #[test]
    fn what_lies_flat_on_a_face_is_its_relief() {
        // A desk, a keyboard, a block of 4 cm, a sheet that sticks out by a half, and a stack: a sheet on the
        // keyboard.
        let faces = upper(&cuboids(&[
            ([0.0, 0.0, 0.5], [1.6, 0.8, 0.04]),
            ([0.0, 0.0, 0.532], [0.4, 0.14, 0.024]),
            ([0.5, 0.2, 0.54], [0.3, 0.2, 0.04]),
            ([-0.8, 0.0, 0.523], [0.3, 0.2, 0.006]),
            ([0.0, 0.0, 0.546], [0.2, 0.1, 0.004]),
        ]));
        let desk = faces[0].id;
        let relief_of = |area: f64| faces.iter().find(|face| (face.area - area).abs() < 1e-6).unwrap();
        assert_eq!(relief_of(0.056).relief, desk);
        assert_eq!(relief_of(0.02).relief, desk, "28 mm above the desk: no chain");
        assert_eq!(relief_of(0.06).relief, relief_of(0.06).id);
        assert!(faces.iter().filter(|face| face.relief == desk).count() == 3);
    }

    #[test]
    fn a_pixel_falls_to_the_cell_of_the_side_that_it_shows() {
        // A camera 1 m above a cube of 1 m, looking down; z forward, y towards -y of the scene.
        let scene = cuboids(&[([0.0, 0.0, 0.5], [1.0, 1.0, 1.0])]);
        let mut truth = FaceTruth::new(&scene, 0.02);
        let down = Pose::new([0.0, 0.0, 2.0], [1.0, 0.0, 0.0, 0.0]).unwrap();
        for frame in 1..=3 {
            let mut view = truth.view(down, 0.17, 0.5..=2.0, frame);
            view.see(0, [0.111, 0.0, 1.0]);
            view.see(0, [0.112, 0.0, 1.0]);
            // The side at x = 0.5 from above: it has readings along its plane, but is too steep to be seen.
            view.see(0, [0.5, 0.0, 1.5]);
            view.see(9, [0.0, 0.0, 1.0]);
        }
        let seen: Vec<TrueFace> =
            truth.in_world(&Pose::identity(), 3).into_iter().filter(|face| face.visible_area > 0.0).collect();
        assert_eq!(seen.len(), 1);
        let read = truth
            .in_world(&Pose::identity(), 3)
            .iter()
            .filter(|face| face.cells().read.contains(&true))
            .count();
        assert_eq!(read, 2);
        assert_eq!(seen[0].plane.normal(), [0.0, 0.0, 1.0]);
        assert!((seen[0].visible_area - 0.0004).abs() < 1e-9);
        let ring = &seen[0].visible_boundary()[0];
        assert!((ring[0][0] - 0.10).abs() < 1e-6 && ring[0][1].abs() < 0.021, "{ring:?}");
        assert!(truth.in_world(&Pose::identity(), 4).iter().all(|face| face.visible_area == 0.0));
    }

    #[test]
    fn the_walls_of_a_room_look_inwards() {
        let scene = Scene::office(&Cast::usual(Activity::Walking, 0));
        let interior =
            scene.static_parts.iter().position(|part| matches!(part.shape, Shape::Interior(_))).unwrap();
        let center = scene.static_parts[interior].scene_from_part.translation.to_array().map(f64::from);
        let truth = FaceTruth::new(&scene, 0.05);
        let faces = truth.in_world(&Pose::identity(), 1);
        for face in truth.bodies[interior].faces.iter().flatten() {
            assert!(faces[*face as usize].plane.signed_distance(center) > 1.0);
        }
        assert!(truth.bodies[interior].faces.iter().all(Option::is_some));
    }
}
