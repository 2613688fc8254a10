//! Some datasets (ICL-NUIM) flip an axis of their images, which changes the sign of a focal length. The maps
//! are those of the images as they were.

use dymlm::core::vector3::{difference, norm};
use dymlm::core::{BoundingBox, ColorImage, DepthImage, Detection, Frame, PinholeCamera};
use dymlm::{MapBuilder, MapConfig, MultiLevelMap, Selection};
use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame};

const WIDTH: usize = 320;
const HEIGHT: usize = 240;

fn frames() -> Vec<SimulatedFrame> {
    let mut config = SequenceConfig::default();
    config.camera = PinholeCamera::new(WIDTH, HEIGHT, 262.5, 262.5, 159.5, 119.5).ok();
    Sequence::new(&config).unwrap().frames().step_by(10).collect()
}

/// Turns an image's rows or columns round.
#[derive(Clone, Copy)]
struct Flips {
    columns: bool,
    rows: bool,
}

impl Flips {
    fn camera(self, camera: &PinholeCamera) -> PinholeCamera {
        let flipped = |is_flipped: bool, f: f64, c: f64, side: usize| {
            if is_flipped { (-f, side as f64 - 1.0 - c) } else { (f, c) }
        };
        let (fx, cx) = flipped(self.columns, camera.fx(), camera.cx(), WIDTH);
        let (fy, cy) = flipped(self.rows, camera.fy(), camera.cy(), HEIGHT);
        PinholeCamera::new(WIDTH, HEIGHT, fx, fy, cx, cy).unwrap()
    }

    fn pixels<T: Copy>(self, pixels: &[T]) -> Vec<T> {
        let mut rows: Vec<Vec<T>> = pixels.chunks(WIDTH).map(<[T]>::to_vec).collect();
        if self.columns {
            for row in &mut rows {
                row.reverse();
            }
        }
        if self.rows {
            rows.reverse();
        }
        rows.concat()
    }

    fn bounding_box(self, own: BoundingBox) -> BoundingBox {
        let flipped = |is_flipped: bool, [low, high]: [f32; 2], side: usize| {
            if is_flipped { [side as f32 - high, side as f32 - low] } else { [low, high] }
        };
        let [x_min, x_max] = flipped(self.columns, [own.x_min(), own.x_max()], WIDTH);
        let [y_min, y_max] = flipped(self.rows, [own.y_min(), own.y_max()], HEIGHT);
        BoundingBox::new(x_min, y_min, x_max, y_max).unwrap()
    }

    fn frame(self, frame: &Frame) -> Frame {
        let depth = DepthImage::new(WIDTH, HEIGHT, self.pixels(frame.depth().data())).unwrap();
        let color =
            frame.color().map(|color| ColorImage::new(WIDTH, HEIGHT, self.pixels(color.data())).unwrap());
        Frame::new(frame.timestamp(), self.camera(frame.camera()), depth, color).unwrap()
    }

    fn map(self, frames: &[SimulatedFrame]) -> MultiLevelMap {
        let mut builder = MapBuilder::new(MapConfig::default()).unwrap();
        for simulated in frames {
            let flip = |found: &Detection| {
                Detection::new(found.label(), found.score(), self.bounding_box(found.bounding_box())).unwrap()
            };
            let found: Vec<Detection> = simulated.detections.iter().map(flip).collect();
            builder.insert(&self.frame(&simulated.frame), &found, &simulated.world_from_camera).unwrap();
        }
        builder.into_map()
    }
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn maps_of_flipped_images_are_the_same() {
    let frames = frames();
    let upright = Flips { columns: false, rows: false }.map(&frames);
    let all = upright.counts();
    let points = |map: &MultiLevelMap| map.cloud().point_cloud(Selection::Static).len();
    for (columns, rows) in [(true, false), (false, true), (true, true)] {
        let map = Flips { columns, rows }.map(&frames);
        let name = format!("columns {columns}, rows {rows}");
        for object in upright.objects().objects() {
            // Other pixels are sampled, of which some hold the ends of things that the image cuts.
            let own = object.oriented_box();
            let reach = 0.05 + 0.15 * own.lengths().into_iter().fold(0.0, f64::max);
            let is_same = |other: &&dymlm::objects::MapObject| {
                let apart = difference(other.oriented_box().center(), own.center());
                other.label() == object.label() && norm(apart) < reach
            };
            assert!(map.objects().objects().any(|other| is_same(&other)), "{name}: {}", object.label());
        }
        assert_eq!(map.counts().objects, all.objects, "{name}");
        assert!(map.counts().planes.abs_diff(all.planes) <= 2, "{name}: {} planes", map.counts().planes);
        let [own, other] = [points(&map), points(&upright)];
        assert!(own.abs_diff(other) * 50 < other, "{name}: {own} of {other} points");
    }
}
