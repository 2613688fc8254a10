//! Benches of the queries of planners and localizers, on the map of a rendered office.

#![allow(missing_docs, clippy::unwrap_used, reason = "a bench")]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dymlm::core::vector3::bounds;
use dymlm::geometry::OrientedBox;
use dymlm::octree::{Extent, UnknownCells};
use dymlm::{MapBuilder, MapConfig, MultiLevelMap, Selection};
use dymlm_benches::SEED;
use dymlm_sim::{Sequence, SequenceConfig};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const COUNT: usize = 1000;

struct Office {
    map: MultiLevelMap,
    /// Points of the static cloud, and random places in the box around them, most of them in free space.
    on_surfaces: Vec<[f64; 3]>,
    in_room: Vec<[f64; 3]>,
}

impl Office {
    fn new() -> Self {
        let mut config = SequenceConfig::default();
        config.frames = 60;
        let mut builder = MapBuilder::new(MapConfig::default()).unwrap();
        for frame in Sequence::new(&config).unwrap().frames() {
            builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
        }
        let map = builder.into_map();
        let cloud = map.cloud().point_cloud(Selection::Static);
        let stride = cloud.len() / COUNT;
        let points = cloud.points().iter().step_by(stride).take(COUNT);
        let on_surfaces: Vec<[f64; 3]> = points.map(|point| point.map(f64::from)).collect();
        let [low, high] = bounds(on_surfaces.iter().copied());
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let mut place = || [0, 1, 2].map(|axis| rng.random_range(low[axis]..high[axis]));
        let in_room = (0..COUNT).map(|_| place()).collect();
        Self { map, on_surfaces, in_room }
    }
}

/// Measures `ask` for each of some places.
fn each<R>(c: &mut Criterion, name: &str, places: &[[f64; 3]], mut ask: impl FnMut([f64; 3]) -> R) {
    let mut group = c.benchmark_group("queries");
    group.throughput(Throughput::Elements(places.len() as u64)).sample_size(20);
    group.bench_function(name, |b| {
        b.iter(|| {
            for &place in places {
                black_box(ask(place));
            }
        });
    });
    group.finish();
}

fn cloud(c: &mut Criterion, office: &Office) {
    let Office { map, on_surfaces, in_room } = office;
    each(c, "cloud/hold", &in_room[..10], |_| map.cloud().static_points());
    let points = map.cloud().static_points();
    let beside: Vec<[f64; 3]> = on_surfaces.iter().map(|place| place.map(|c| c + 0.01)).collect();
    each(c, "cloud/nearest beside a surface", &beside, |place| points.nearest(place, 0.1));
    each(c, "cloud/nearest in the room", in_room, |place| points.nearest(place, 0.5));
    for radius in [0.04, 0.08] {
        each(c, &format!("cloud/normal of {radius} m"), on_surfaces, |place| {
            points.normal_at(place.map(|c| c as f32), radius)
        });
    }
    let mut found = Vec::new();
    each(c, "cloud/box of 30 cm", on_surfaces, |place| {
        let region = OrientedBox::between(place.map(|c| c - 0.15), place.map(|c| c + 0.15)).unwrap();
        points.in_box(&region, &mut found);
        found.len()
    });
    let eye = in_room[0];
    each(c, "cloud/ray", on_surfaces, |place| {
        points.cast_ray(eye, [0, 1, 2].map(|axis| place[axis] - eye[axis]), 5.0, 0.02)
    });
}

fn octree(c: &mut Criterion, office: &Office) {
    let (octree, in_room) = (office.map.octree(), &office.in_room);
    let [low, high] = bounds(in_room.iter().copied());
    let around = |half: [f64; 3]| {
        let center = [0, 1, 2].map(|axis| f64::midpoint(low[axis], high[axis]));
        let side = |sign: f64| [0, 1, 2].map(|axis| center[axis] + sign * half[axis]);
        Extent { min: side(-1.0), max: side(1.0) }
    };
    let (small, large) = (around([1.0; 3]), around([2.0, 2.0, 1.0]));
    let mut field = octree.distance_field(large, 0.5, UnknownCells::Pass).unwrap();
    for (name, region, unknown) in [
        ("2 x 2 x 2 m", small, UnknownCells::Pass),
        ("4 x 4 x 2 m", large, UnknownCells::Pass),
        ("4 x 4 x 2 m, unknown is occupied", large, UnknownCells::Stop),
    ] {
        each(c, &format!("octree/distance field of {name}"), &in_room[..1], |_| {
            field.update(octree, region, 0.5, unknown).unwrap();
        });
    }
    each(c, "octree/distance and gradient", in_room, |place| field.at(place));
    each(c, "octree/nearest obstacle", in_room, |place| octree.nearest_obstacle(place, 0.5));
}

fn planes(c: &mut Criterion, office: &Office) {
    let (map, up) = (&office.map, [0.0, 0.0, 1.0]);
    each(c, "planes/read under", &office.in_room, |place| map.planes().plane_under(place, up, 3.0));
    each(c, "objects/near", &office.in_room, |place| map.objects().near(place, 0.5));
    each(c, "map/floor under", &office.in_room, |place| map.floor_under(place, up, 3.0, 3.0));
}

fn queries(c: &mut Criterion) {
    let office = Office::new();
    cloud(c, &office);
    octree(c, &office);
    planes(c, &office);
}

criterion_group!(benches, queries);
criterion_main!(benches);
