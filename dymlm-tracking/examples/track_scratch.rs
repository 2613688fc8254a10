#![allow(
    missing_docs,
    clippy::all,
    clippy::pedantic,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout
)]
use dymlm_core::*;
use dymlm_sim::*;
use dymlm_tracking::*;
use std::time::Instant;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let only = args.get(1).map(|s| s.as_str()).unwrap_or("all");
    let blind = args.iter().any(|a| a == "nodepth");
    let verbose = args.iter().any(|a| a == "v");
    let save = args.iter().any(|a| a == "save");
    use CarriedKind::*;
    use CarriedMotion::*;
    let list = [
        ("book-x", Book, RotationX),
        ("book-tr", Book, Translation),
        ("kbd-z", Keyboard, RotationZ),
        ("kbd-tr", Keyboard, Translation),
        ("bottle-y", Bottle, RotationY),
        ("bottle-fast", Bottle, Fast),
        ("cup-tr", Cup, Translation),
        ("cup-occ", Cup, Occlusion),
        ("box-z", Box, RotationZ),
        ("box-fast", Box, Fast),
        ("book-occ", Book, Occlusion),
        ("cup-z", Cup, RotationZ),
    ];
    for (name, kind, motion) in list {
        if only != "all" && !name.starts_with(only) {
            continue;
        }
        let mut c = SequenceConfig::default();
        c.people = 0;
        c.frame_rate = 30.0;
        c.frames = 270;
        c.carried = Some(CarriedObject::new(kind, motion));
        c.path = if args.iter().any(|a| a == "static") { CameraPath::Static } else { CameraPath::Handheld };
        let s = Sequence::new(&c).unwrap();
        let mut tracker: Option<ObjectTracker> = None;
        let (mut pe, mut re, mut times) = (vec![], vec![], vec![]);
        let (mut lost, mut missing, mut rests) = (0, 0, 0);
        let mut was = ObjectState::AtRest;
        for f in s.frames() {
            let truth = f.carried.unwrap();
            let mut frame = f.frame.clone();
            if blind {
                frame = Frame::new(
                    frame.timestamp(),
                    *frame.camera(),
                    DepthImage::new(640, 480, vec![0.0; 640 * 480]).unwrap(),
                    frame.color().cloned(),
                )
                .unwrap();
            }
            let Some(t) = tracker.as_mut() else {
                let model = match kind {
                    Bottle | Cup if args.iter().any(|a| a == "ell") => {
                        ObjectModel::ellipsoid(truth.lengths).unwrap()
                    }
                    Bottle | Cup => cyl(truth.lengths),
                    _ => ObjectModel::cuboid(truth.lengths).unwrap(),
                };
                match ObjectTracker::new(
                    &frame,
                    &f.world_from_camera,
                    model,
                    Some(truth.label),
                    &truth.world_from_object,
                    &ObjectTrackerConfig::default(),
                ) {
                    Ok(t) => tracker = Some(t),
                    Err(e) => {
                        println!("{name}: {e}");
                        let mut img = image::RgbImage::new(640, 480);
                        for (p, c) in img.pixels_mut().zip(frame.color().unwrap().data()) {
                            p.0 = *c;
                        }
                        img.save(format!("/tmp/trk/{name}-start.png")).unwrap();
                        break;
                    }
                }
                continue;
            };
            let i = Instant::now();
            let u = t.track(&frame, &f.detections, &f.world_from_camera).unwrap();
            times.push(i.elapsed().as_secs_f64() * 1e3);
            let (d, a) = (
                u.world_from_object.distance(&truth.world_from_object) * 100.0,
                u.world_from_object.angle(&truth.world_from_object).to_degrees(),
            );
            let a = if matches!(kind, Bottle | Cup) {
                let z = |p: &Pose| p.rotate([0.0, 0.0, 1.0]);
                let (x, y) = (z(&u.world_from_object), z(&truth.world_from_object));
                (x[0] * y[0] + x[1] * y[1] + x[2] * y[2]).clamp(-1.0, 1.0).acos().to_degrees()
            } else {
                a
            };
            if u.covariance.is_some() || u.inliers > 0 {
                pe.push(d);
                re.push(a);
            } else {
                missing += 1;
            }
            if u.state == ObjectState::Lost && was != ObjectState::Lost {
                lost += 1;
            }
            if u.came_to_rest.is_some() {
                rests += 1;
            }
            if verbose {
                println!(
                    "{:.2} {:?} d {:.2} cm a {:.2} deg inl {} conf {:.2} views {} {:.1} ms {}",
                    f.frame.timestamp(),
                    u.state,
                    d,
                    a,
                    u.inliers,
                    u.confidence,
                    t.views(),
                    times.last().unwrap(),
                    u.came_to_rest.is_some()
                );
            }
            was = u.state;
            if save && (f.frame.timestamp() * 30.0).round() as usize % 30 == 0 {
                let mut img = image::RgbImage::new(640, 480);
                for (p, c) in img.pixels_mut().zip(frame.color().unwrap().data()) {
                    p.0 = *c;
                }
                let b = u.bounding_box.unwrap();
                for k in 0..640 * 480 {
                    let (x, y) = ((k % 640) as f32, (k / 640) as f32);
                    if ((x - b.x_min()).abs() < 1.0 || (x - b.x_max()).abs() < 1.0)
                        && y > b.y_min()
                        && y < b.y_max()
                        || ((y - b.y_min()).abs() < 1.0 || (y - b.y_max()).abs() < 1.0)
                            && x > b.x_min()
                            && x < b.x_max()
                    {
                        img.put_pixel(x as u32, y as u32, image::Rgb([255, 255, 0]));
                    }
                }
                img.save(format!("/tmp/trk/{name}-{:03}.png", (f.frame.timestamp() * 30.0).round() as usize))
                    .unwrap();
            }
        }
        if pe.is_empty() {
            continue;
        }
        let q = |v: &mut Vec<f64>, p: f64| {
            v.sort_by(|a, b| a.total_cmp(b));
            v[((v.len() - 1) as f64 * p) as usize]
        };
        println!(
            "{name}: pos median {:.2} p95 {:.2} max {:.2} cm, rot median {:.2} p95 {:.2} deg, missing {missing} lost {lost} rests {rests} views {}, ms median {:.1} p95 {:.1}",
            q(&mut pe, 0.5),
            q(&mut pe, 0.95),
            q(&mut pe, 1.0),
            q(&mut re, 0.5),
            q(&mut re, 0.95),
            tracker.unwrap().views(),
            q(&mut times, 0.5),
            q(&mut times, 0.95)
        );
    }
}
fn cyl(l: [f64; 3]) -> ObjectModel {
    let mut p = vec![];
    for i in 0..72 {
        for j in 0..60 {
            let a = i as f64 * std::f64::consts::TAU / 72.0;
            p.push([
                (0.5 * l[0] * a.cos()) as f32,
                (0.5 * l[0] * a.sin()) as f32,
                (l[2] * ((j as f64 + 0.5) / 60.0 - 0.5) * 1.0) as f32,
            ]);
        }
    }
    ObjectModel::from_points(&p).unwrap()
}
