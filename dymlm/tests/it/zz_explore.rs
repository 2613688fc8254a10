use dymlm::{HistoryConfig, MapBuilder, MapConfig};
use dymlm_core::vector3::{along, difference, dot};
use dymlm_sim::{Sequence, SequenceConfig, Room};

#[test]
fn explore() {
    for (seed, room) in [(1, 0), (2, 1), (3, 1), (4, 1), (5, 2)] {
        let mut config = if room == 2 { SequenceConfig::building(7, 2) } else { SequenceConfig::default() };
        if room < 2 { (config.seed, config.frames) = (seed, 300); }
        if room == 1 { config.room = Room::Random; }
        let full = std::env::var("FULL").is_ok();
        if !full { config.camera = dymlm_core::PinholeCamera::new(320, 240, 262.0, 262.0, 159.5, 119.5).ok(); }
        let sequence = Sequence::new(&config).unwrap();
        let mut map = MapConfig::default();
        map.cloud.voxel_size = 0.03;
        map.history = HistoryConfig::Memory;
        let mut builder = MapBuilder::new(map).unwrap();
        for simulated in sequence.frames().step_by(3) {
            builder.insert(&simulated.frame, &simulated.detections, &simulated.world_from_camera).unwrap();
        }
        builder.settle();
        for object in builder.map().objects().objects() {
            let bx = object.oriented_box();
            let rot = bx.world_from_box();
            let center = bx.center();
            for s in object.sightings() {
                let pose = s.world_from_camera;
                let r = pose.rotate(s.direction);
                let half = |d: [f64; 3]| -> f64 { (0..3).map(|k| { let mut e = [0.0; 3]; e[k] = 1.0; 0.5 * bx.lengths()[k] * dot(d, rot.rotate(e)).abs() }).sum() };
                let h = half(r);
                let place = along(pose.translation(), s.nearest + h, r);
                let off = difference(place, center);
                let (a, b) = (pose.rotate(s.across[0]), pose.rotate(s.across[1]));
                let d = s.nearest + h;
                let sides = s.completeness.sides().map(|x| x == dymlm::objects::SideView::Whole);
                println!("R {seed} {} {} {:.2} {:.2} {:.3} {:.3} {:.3} {:.3} {:.3} {:.3} {:.3} {:.3} {} {} {} {}", object.label().replace(' ', "_"), object.id().get(), s.timestamp, d, s.extent[0] * d, s.extent[1] * d, 2.0 * half(a), 2.0 * half(b), h, dot(off, a), dot(off, b), dot(off, r), sides[0] as u8, sides[1] as u8, sides[2] as u8, sides[3] as u8);
            }
        }
    }
}
