//! Principal axes, hulls, rectangles, boxes and isolation forests.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use dymlm_benches::{SIZES, footprint, thing};
use dymlm_core::symmetric_eigen3;
use dymlm_geometry::{
    BoxFit, ConvexHullScratch, IsolationForest, IsolationForestConfig, IsolationForestScratch,
    IsolationTrees, MinimumAreaRectangleScratch, OrientedBoxScratch, PrincipalAxes, convex_hull_into,
    fit_oriented_box_with, minimum_area_rectangle_with,
};

fn name(n: usize) -> String {
    if n < 1_000_000 { format!("{}k", n / 1000) } else { format!("{}M", n / 1_000_000) }
}

fn eigen(criterion: &mut Criterion) {
    let covariances: Vec<[[f64; 3]; 3]> =
        thing(10_000).chunks(10).filter_map(PrincipalAxes::of).map(|axes| axes.covariance).collect();
    let mut group = criterion.benchmark_group("dymlm-geometry/symmetric_eigen3");
    group.throughput(Throughput::Elements(covariances.len() as u64));
    group.bench_function("1k", |bencher| {
        bencher.iter(|| covariances.iter().filter_map(|matrix| symmetric_eigen3(black_box(*matrix))).count());
    });
}

fn principal_axes(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dymlm-geometry/principal_axes");
    for n in SIZES {
        let points = thing(n);
        group.throughput(Throughput::Elements(n as u64));
        group.bench_with_input(BenchmarkId::from_parameter(name(n)), &points, |bencher, points| {
            bencher.iter(|| PrincipalAxes::of(black_box(points)));
        });
    }
}

fn convex_hull(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dymlm-geometry/convex_hull");
    for n in SIZES {
        let points = footprint(n);
        let (mut scratch, mut hull) = (ConvexHullScratch::default(), Vec::new());
        group.throughput(Throughput::Elements(n as u64));
        group.bench_with_input(BenchmarkId::from_parameter(name(n)), &points, |bencher, points| {
            bencher.iter(|| convex_hull_into(black_box(points), &mut scratch, &mut hull));
        });
    }
}

fn minimum_area_rectangle(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dymlm-geometry/minimum_area_rectangle");
    for n in [1000].into_iter().chain(SIZES) {
        let points = footprint(n);
        let mut scratch = MinimumAreaRectangleScratch::default();
        group.throughput(Throughput::Elements(n as u64));
        group.bench_with_input(BenchmarkId::from_parameter(name(n)), &points, |bencher, points| {
            bencher.iter(|| minimum_area_rectangle_with(black_box(points), &mut scratch));
        });
    }
}

fn fit_oriented_box(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dymlm-geometry/fit_oriented_box");
    let fits = [
        ("principal_axes", BoxFit::PrincipalAxes),
        ("minimum_rectangle", BoxFit::MinimumRectangle),
        ("minimum_volume", BoxFit::MinimumVolume),
        ("upright", BoxFit::Upright { up: [0.0, 0.0, 1.0] }),
    ];
    for (fit_name, fit) in fits {
        for n in [1000].into_iter().chain(SIZES) {
            let points = thing(n);
            let mut scratch = OrientedBoxScratch::default();
            group.throughput(Throughput::Elements(n as u64));
            group.bench_with_input(BenchmarkId::new(fit_name, name(n)), &points, |bencher, points| {
                bencher.iter(|| fit_oriented_box_with(black_box(points), fit, &mut scratch));
            });
        }
    }
}

#[allow(clippy::unwrap_used, reason = "the default config is in range")]
fn isolation_forest(criterion: &mut Criterion) {
    let forest = IsolationForest::new(IsolationForestConfig::default()).unwrap();
    let mut group = criterion.benchmark_group("dymlm-geometry/isolation_forest");
    group.sample_size(10);
    for n in SIZES {
        let points = thing(n);
        let (mut scratch, mut trees) = (IsolationForestScratch::default(), IsolationTrees::default());
        let mut scores = Vec::new();
        group.throughput(Throughput::Elements(n as u64));
        group.bench_with_input(BenchmarkId::new("fit", name(n)), &points, |bencher, points| {
            bencher.iter(|| forest.fit_into(black_box(points), &mut scratch, &mut trees));
        });
        group.bench_with_input(BenchmarkId::new("scores", name(n)), &points, |bencher, points| {
            bencher.iter(|| trees.scores_into(black_box(points), &mut scores));
        });
    }
}

criterion_group!(
    benches,
    eigen,
    principal_axes,
    convex_hull,
    minimum_area_rectangle,
    fit_oriented_box,
    isolation_forest
);
criterion_main!(benches);
