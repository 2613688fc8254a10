#![allow(
    missing_docs,
    clippy::all,
    clippy::pedantic,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout
)]
use dymlm_core::*;
use dymlm_tracking::*;
use std::time::Instant;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let name = &args[1];
    let bytes = std::fs::read(format!("/tmp/trk/{name}.rgb")).unwrap();
    let rows: Vec<[f32; 6]> = std::fs::read(format!("/tmp/trk/{name}.targets"))
        .unwrap()
        .chunks_exact(24)
        .map(|c| std::array::from_fn(|i| f32::from_le_bytes(c[4 * i..4 * i + 4].try_into().unwrap())))
        .collect();
    let grays: Vec<GrayImage> = bytes
        .chunks_exact(640 * 480 * 3)
        .map(|c| {
            GrayImage::from_color(
                &ColorImage::new(640, 480, c.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()).unwrap(),
            )
        })
        .collect();
    let mut config = KcfConfig::default();
    for a in &args[2..] {
        let (k, v) = a.split_once('=').unwrap();
        match k {
            "size" => config.template_size = v.parse().unwrap(),
            "pad" => config.padding = v.parse().unwrap(),
            "lr" => config.learning_rate = v.parse().unwrap(),
            "sigma" => config.kernel_sigma = v.parse().unwrap(),
            "osigma" => config.output_sigma = v.parse().unwrap(),
            "scales" => config.scales = v.parse().unwrap(),
            "sw" => config.scale_weight = v.parse().unwrap(),
            "min" => config.min_learning_ratio = v.parse().unwrap(),
            "cell" => config.cell_size = v.parse().unwrap(),
            "feat" => {
                config.features = match v {
                    "hog" => KcfFeatures::Hog,
                    "int" => KcfFeatures::Intensity,
                    _ => KcfFeatures::HogAndIntensity,
                }
            }
            _ => panic!(),
        }
    }
    let mut tracker = None;
    let mut last = -1.0;
    let mut out = vec![];
    let mut iou = vec![];
    let mut psr = vec![];
    let mut per = vec![];
    let mut time = 0.0;
    let mut n = 0;
    for r in &rows {
        let image = &grays[r[1] as usize];
        let truth = BoundingBox::new(r[2], r[3], r[4], r[5]).unwrap();
        if r[0] != last {
            tracker = Some(KcfTracker::new(image, truth, &config).unwrap());
            last = r[0];
            out.push(truth);
            per.push(vec![]);
            continue;
        }
        let t = Instant::now();
        let u = tracker.as_mut().unwrap().update(image);
        time += t.elapsed().as_secs_f64();
        n += 1;
        iou.push(u.bounding_box.iou(&truth));
        per.last_mut().unwrap().push(u.bounding_box.iou(&truth));
        psr.push(u.peak_to_sidelobe);
        out.push(u.bounding_box);
    }
    psr.sort_by(|a, b| a.total_cmp(b));
    println!(
        "{name}: mean iou {:.3} over {n}, {:.2} ms an update, psr 10% {:.1} median {:.1}",
        iou.iter().sum::<f32>() / n as f32,
        time / n as f64 * 1e3,
        psr[psr.len() / 10],
        psr[psr.len() / 2]
    );
    println!("{:.2?}", per.iter().map(|p| p.iter().sum::<f32>() / p.len() as f32).collect::<Vec<_>>());
}
