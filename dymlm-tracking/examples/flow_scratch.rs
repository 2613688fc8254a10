#![allow(
    missing_docs,
    clippy::all,
    clippy::pedantic,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout
)]
use dymlm_tracking::*;
use std::time::Instant;
fn main() {
    let bytes = std::fs::read("/tmp/trk/flow.gray").unwrap();
    let pts: Vec<[f32; 4]> = std::fs::read("/tmp/trk/flow.points")
        .unwrap()
        .chunks_exact(16)
        .map(|c| std::array::from_fn(|i| f32::from_le_bytes(c[4 * i..4 * i + 4].try_into().unwrap())))
        .collect();
    let imgs: Vec<GrayImage> = bytes
        .chunks_exact(640 * 480)
        .map(|c| GrayImage::new(640, 480, c.iter().map(|&b| b as f32 / 255.0).collect()).unwrap())
        .collect();
    for fb in [None, Some(0.7)] {
        for light in [Lighting::Constant, Lighting::Affine] {
            let mut c = FlowConfig::default();
            c.max_forward_backward = fb;
            c.lighting = light;
            let mut flow = OpticalFlow::new(&c).unwrap();
            let (mut pa, mut pb) = (ImagePyramid::empty(3), ImagePyramid::empty(3));
            for k in 0..6 {
                let p = &pts[200 * k..200 * (k + 1)];
                let start: Vec<[f32; 2]> = p.iter().map(|p| [p[0], p[1]]).collect();
                let mut best = (f64::MAX, 0.0, 0.0);
                let mut out = vec![];
                for _ in 0..5 {
                    let t = Instant::now();
                    pa.build(&imgs[2 * k]);
                    pb.build(&imgs[2 * k + 1]);
                    let tp = t.elapsed().as_secs_f64();
                    flow.track_into(&pa, &pb, &start, &start, &mut out);
                    let tt = t.elapsed().as_secs_f64();
                    if tt < best.0 {
                        best = (tt, tp, tt - tp);
                    }
                }
                let mut e: Vec<f32> = out
                    .iter()
                    .zip(p)
                    .filter(|(o, _)| o.status == FlowStatus::Tracked)
                    .map(|(o, p)| ((o.point[0] - p[2]).powi(2) + (o.point[1] - p[3]).powi(2)).sqrt())
                    .collect();
                e.sort_by(|a, b| a.total_cmp(b));
                println!(
                    "fb {fb:?} {light:?} pair {k}: tracked {} median {:.4} p90 {:.3} mean {:.3}; {:.2} ms (pyramids {:.2})",
                    e.len(),
                    e[e.len() / 2],
                    e[e.len() * 9 / 10],
                    e.iter().sum::<f32>() / e.len() as f32,
                    best.0 * 1e3,
                    best.1 * 1e3
                );
            }
        }
    }
}
