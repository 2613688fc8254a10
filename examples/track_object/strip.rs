use dymlm::ObjectMap;
use dymlm::core::vector3::{cross, difference, unit};
use dymlm::core::{Frame, ObjectId, PinholeCamera, Pose, Rgb};
use dymlm::files::id_color;
use dymlm::geometry::OrientedBox;
use dymlm::objects::{MapObject, ObjectShape};
use dymlm_examples::{Picture, draw_object};

/// One moment: the object map on the left, the camera's image on the right (as in the paper's figure of
/// object tracking).
pub(crate) struct Panel {
    caption: &'static str,
    width: usize,
    height: usize,
    map: Vec<Rgb>,
    view: Vec<Rgb>,
}

/// Panels in two columns.
#[derive(Default)]
pub(crate) struct Strip {
    panels: Vec<Panel>,
}

const WHITE: Rgb = [255; 3];
const TRACE: Rgb = [150, 150, 150];
/// White space around panels, pixels.
const GAP: usize = 12;
/// How far above and behind the camera the map is viewed from, metres.
const ABOVE: f64 = 0.5;
const BEHIND: f64 = 0.25;
/// Objects farther from the camera than this are not drawn, metres.
const FAR: f64 = 4.0;

impl Panel {
    /// `chosen`: the followed object and its pose. `trace`: its past places.
    pub(crate) fn new(
        caption: &'static str,
        frame: &Frame,
        world_from_camera: &Pose,
        objects: &ObjectMap,
        chosen: Option<(ObjectId, OrientedBox)>,
        trace: &[[f64; 3]],
    ) -> Self {
        let camera = frame.camera();
        let (width, height) = (camera.width(), camera.height());
        let mut map = Picture { name: "", width, height, pixels: vec![WHITE; width * height] };
        let mut view = Picture { name: "", width, height, pixels: gray(frame) };
        let eye = world_from_camera.translation();
        let from_above = raised(world_from_camera, chosen.map(|(_, body)| body.center()));
        for &place in trace {
            dot(&mut map, camera, &from_above, place, 1, TRACE);
        }
        let is_chosen = |id: ObjectId| chosen.is_some_and(|(own, _)| own == id);
        let candidates = objects.candidates().filter(|object: &&MapObject| is_chosen(object.id()));
        for object in objects.objects().chain(candidates) {
            let center = object.oriented_box().center();
            if (0..3).map(|i| (center[i] - eye[i]).powi(2)).sum::<f64>() > FAR * FAR {
                continue;
            }
            let color = id_color(object.id().get());
            let at_place = chosen.filter(|(id, _)| *id == object.id()).map(|(_, body)| body);
            let shape = ObjectShape::new(object.shape().kind(), at_place.unwrap_or(object.oriented_box()));
            // The points stay where the map has them until the object comes to rest.
            for place in object.points().step_by(3) {
                dot(&mut map, camera, &from_above, place, 0, color);
            }
            draw_object(&mut map, &shape, camera, &from_above, color);
            draw_object(&mut view, &shape, camera, world_from_camera, color);
        }
        Self { caption, width, height, map: map.pixels, view: view.pixels }
    }
}

impl Strip {
    pub(crate) fn add(&mut self, panels: Vec<Panel>) {
        self.panels.extend(panels);
    }

    /// All panels in one picture, in two columns, at half their size.
    pub(crate) fn into_picture(self) -> Picture {
        let width = self.panels.iter().map(|panel| panel.width).max().unwrap_or(2) / 2;
        let height = self.panels.iter().map(|panel| panel.height).max().unwrap_or(2) / 2;
        let rows = self.panels.len().div_ceil(2).max(1);
        let (total_width, total_height) = (4 * width + 5 * GAP, rows * (height + GAP) + GAP);
        let mut pixels = vec![WHITE; total_width * total_height];
        for (index, panel) in self.panels.iter().enumerate() {
            let (column, row) = (index % 2, index / 2);
            let top = GAP + row * (height + GAP);
            for (part, image) in [&panel.map, &panel.view].into_iter().enumerate() {
                let left = GAP + (2 * column + part) * (width + GAP);
                for (v, u) in (0..panel.height / 2).flat_map(|v| (0..panel.width / 2).map(move |u| (v, u))) {
                    pixels[(top + v) * total_width + left + u] = quarter(image, panel.width, u, v);
                }
            }
        }
        let captions: Vec<&str> = self.panels.iter().map(|panel| panel.caption).collect();
        print_captions(&captions);
        Picture { name: "object_tracking.png", width: total_width, height: total_height, pixels }
    }
}

#[allow(clippy::print_stdout, reason = "a program for the terminal")]
fn print_captions(captions: &[&str]) {
    println!("object_tracking.png, row by row: {}", captions.join(", "));
}

/// The mean of four pixels.
fn quarter(image: &[Rgb], width: usize, u: usize, v: usize) -> Rgb {
    let first = 2 * v * width + 2 * u;
    let four = [first, first + 1, first + width, first + width + 1];
    std::array::from_fn(|channel| {
        let sum: u32 = four.iter().filter_map(|&i| image.get(i)).map(|pixel| u32::from(pixel[channel])).sum();
        (sum / 4) as u8
    })
}

/// The colour image in grey, so that coloured boxes stand out.
fn gray(frame: &Frame) -> Vec<Rgb> {
    let camera = frame.camera();
    match frame.color() {
        Some(color) => color
            .data()
            .iter()
            .map(|&[r, g, b]| [((77 * u32::from(r) + 150 * u32::from(g) + 29 * u32::from(b)) >> 8) as u8; 3])
            .collect(),
        None => vec![[128; 3]; camera.width() * camera.height()],
    }
}

/// The pose of a view of a place from above and behind the camera.
fn raised(world_from_camera: &Pose, at: Option<[f64; 3]>) -> Pose {
    let down = world_from_camera.rotate([0.0, 1.0, 0.0]);
    let forward = world_from_camera.rotate([0.0, 0.0, 1.0]);
    let eye = world_from_camera.translation();
    let raised: [f64; 3] = std::array::from_fn(|i| eye[i] - ABOVE * down[i] - BEHIND * forward[i]);
    let Some(at) = at else { return *world_from_camera };
    let Some(toward) = unit(difference(at, raised)) else { return *world_from_camera };
    let Some(right) = unit(cross(down, toward)) else { return *world_from_camera };
    let below = cross(toward, right);
    let rows = std::array::from_fn(|i| [right[i], below[i], toward[i]]);
    Pose::from_rotation_matrix(rows, raised).unwrap_or(*world_from_camera)
}

fn dot(
    picture: &mut Picture,
    camera: &PinholeCamera,
    world_from_camera: &Pose,
    place: [f64; 3],
    reach: i64,
    color: Rgb,
) {
    let place = world_from_camera.inverse().transform_point(place);
    let Some([u, v]) = camera.project(place).filter(|&pixel| camera.sees(pixel)) else { return };
    for (du, dv) in (-reach..=reach + 1).flat_map(|dv| (-reach..=reach + 1).map(move |du| (du, dv))) {
        picture.set(u.round() as i64 + du, v.round() as i64 + dv, color);
    }
}
