//! Tests of sequences: determinism, truth that agrees with the images, noise and failures at their rates.
use dymlm_core::{BoundingBox, DepthNoise, Error, Mask, PinholeCamera, Pose};
use dymlm_sim::{
    CameraPath, DetectorConfig, FrameScratch, SensorConfig, Sequence, SequenceConfig, SimulatedFrame,
};

fn small_config() -> SequenceConfig {
    let mut config = SequenceConfig::default();
    config.camera = Some(PinholeCamera::new(160, 120, 131.25, 131.25, 79.5, 59.5).unwrap());
    config
}

fn ideal_config() -> SequenceConfig {
    let mut config = small_config();
    config.sensor = SensorConfig::ideal();
    config.detector = DetectorConfig::ideal();
    config
}

#[test]
fn a_frame_depends_on_config_and_index_alone() {
    let sequence = Sequence::new(&small_config()).unwrap();
    let forwards: Vec<SimulatedFrame> = [3, 40, 77].iter().map(|&i| sequence.frame(i).unwrap()).collect();
    let again = Sequence::new(&small_config()).unwrap();
    let backwards: Vec<SimulatedFrame> = [77, 40, 3].iter().map(|&i| again.frame(i).unwrap()).collect();
    assert!(forwards.iter().eq(backwards.iter().rev()));

    let mut config = small_config();
    config.seed += 1;
    assert_ne!(Sequence::new(&config).unwrap().frame(3).unwrap().frame, forwards[0].frame);
    assert_ne!(forwards[0].frame.depth(), sequence.frame(4).unwrap().frame.depth());
}

#[cfg(feature = "parallel")]
#[test]
fn the_number_of_threads_changes_nothing() {
    let frame = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Sequence::new(&SequenceConfig::default()).unwrap().frame(33).unwrap())
    };
    assert_eq!(frame(1), frame(3));
}

#[test]
fn length_times_and_end() {
    let mut config = ideal_config();
    config.frames = 3;
    config.frame_rate = 5.0;
    let sequence = Sequence::new(&config).unwrap();
    let times: Vec<f64> = sequence.frames().map(|frame| frame.frame.timestamp()).collect();
    assert_eq!(times, [0.0, 0.2, 0.4]);
    assert_eq!(sequence.len(), 3);
    assert_eq!(sequence.frame(3), None);
    assert_eq!(sequence.frame(usize::MAX), None);
}

#[test]
fn refuses_what_is_no_config_by_name() {
    let field = |change: fn(&mut SequenceConfig)| {
        let mut config = SequenceConfig::default();
        change(&mut config);
        match Sequence::new(&config).unwrap_err() {
            Error::Config(error) => error.field,
            other => panic!("{other}"),
        }
    };
    assert_eq!(field(|c| c.frames = 0), "frames");
    assert_eq!(field(|c| c.frame_rate = f64::NAN), "frame_rate");
    assert_eq!(field(|c| c.people = 3), "people");
    assert_eq!(field(|c| c.sensor.min_depth = 7.0), "sensor.min_depth");
    assert_eq!(field(|c| c.sensor.flying_pixels = 0.5), "sensor.flying_pixels");
    assert_eq!(field(|c| c.detector.movers.below_half = 0.0), "detector.movers.below_half");
    assert_eq!(field(|c| c.detector.cut_depth = 0.5), "detector.cut_depth");
}

#[test]
fn masks_and_depth_tell_the_people_from_the_room() {
    let config = ideal_config();
    let mut empty = config.clone();
    empty.people = 0;
    let (with, without) = (Sequence::new(&config).unwrap(), Sequence::new(&empty).unwrap());
    for index in (0..150).step_by(15) {
        let (frame, room) = (with.frame(index).unwrap(), without.frame(index).unwrap());
        assert_eq!(room.mover_mask.count(), 0);
        let depths = frame.true_depth.data().iter().zip(room.true_depth.data());
        for ((&with, &without), mover) in depths.zip(frame.mover_mask.pixels()) {
            assert!(if mover { with < without } else { with == without });
        }
    }
}

#[test]
fn every_pixel_shows_something_within_the_room() {
    for path in
        [CameraPath::Handheld, CameraPath::Static, CameraPath::Xyz, CameraPath::Rpy, CameraPath::HalfSphere]
    {
        let mut config = ideal_config();
        config.path = path;
        let sequence = Sequence::new(&config).unwrap();
        let camera = sequence.camera();
        for index in [0, 31, 62, 93, 124] {
            let frame = sequence.frame(index).unwrap();
            for (pixel, &z) in frame.true_depth.data().iter().enumerate() {
                let point = camera.back_project([(pixel % 160) as f64, (pixel / 160) as f64], z.into());
                let [x, y, up] = frame.world_from_camera.transform_point(point);
                assert!(
                    z > 0.0
                        && x.abs() < 3.001
                        && (-3.351..3.101).contains(&y)
                        && (-0.001..2.601).contains(&up)
                );
            }
        }
    }
}

#[test]
fn a_tilted_world_shows_the_same_images() {
    let config = small_config();
    let mut tilted = config.clone();
    tilted.world_from_scene = Pose::new([5.0, -2.0, 9.0], [0.1, 0.7, -0.1, 0.7]).unwrap();
    let (upright, tilted_frame) =
        [&config, &tilted].map(|config| Sequence::new(config).unwrap().frame(9).unwrap()).into();
    assert_eq!(upright.frame, tilted_frame.frame);
    assert_eq!(upright.detections, tilted_frame.detections);
    let expected = tilted.world_from_scene * upright.world_from_camera;
    assert!(expected.distance(&tilted_frame.world_from_camera) < 1e-9);
    assert!(expected.angle(&tilted_frame.world_from_camera) < 1e-6);
}

#[test]
fn people_are_in_view_as_in_recordings() {
    let sequence = Sequence::new(&ideal_config()).unwrap();
    let mut in_view = 0;
    let mut cut_by_border = 0;
    let mut distances = Vec::new();
    for frame in sequence.frames() {
        let mask = &frame.mover_mask;
        if mask.count() < 80 {
            continue;
        }
        in_view += 1;
        let touches = (0..120).any(|v| mask.at(0, v) || mask.at(159, v)) || (0..160).any(|u| mask.at(u, 119));
        cut_by_border += usize::from(touches);
        let depths = frame.true_depth.data().iter().zip(mask.pixels());
        distances.extend(depths.filter(|&(_, mover)| mover).map(|(&z, _)| z));
    }
    // The kitchen recording has people in 64 % of its frames.
    assert!((75..=125).contains(&in_view), "people in {in_view} of 150 frames");
    assert!(cut_by_border > 20, "{cut_by_border} cut by the border");
    distances.sort_by(f32::total_cmp);
    let quantile = |share: f64| distances[(distances.len() as f64 * share) as usize];
    let quantiles = [0.02, 0.5, 0.98].map(quantile);
    assert!(quantiles[0] > 0.7 && quantiles[1] < 2.0 && quantiles[2] < 3.5, "{quantiles:?} m away");
}

#[test]
fn an_ideal_sensor_reads_the_exact_depth_within_range() {
    let frame = Sequence::new(&ideal_config()).unwrap().frame(50).unwrap();
    for (&reading, &exact) in frame.frame.depth().data().iter().zip(frame.true_depth.data()) {
        assert_eq!(reading, if (0.5..=6.0).contains(&exact) { exact } else { 0.0 });
    }
}

#[test]
fn axial_noise_is_the_sensors() {
    let stereo = DepthNoise::stereo(425.0, 0.05, 0.08);
    // Steep views add to the axial noise of frontal ones.
    for (noise, steep_noise, most) in [(DepthNoise::kinect(), 1.0, 1.15), (stereo, 0.0, 1.01)] {
        let mut config = SequenceConfig::default();
        config.sensor = SensorConfig::ideal();
        (config.sensor.noise, config.sensor.steep_noise) = (noise, steep_noise);
        config.people = 0;
        let frame = Sequence::new(&config).unwrap().frame(0).unwrap();
        let errors = normalized_errors(&frame, noise);
        let deviation = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        assert!((0.99..most).contains(&deviation) && mean.abs() < 0.01, "{deviation}, mean {mean}");
    }
}

#[test]
fn a_camera_on_its_side_sees_the_same_turned_by_a_quarter() {
    let square = |roll: f64| {
        let mut config = SequenceConfig::default();
        config.sensor = SensorConfig::ideal();
        config.camera = Some(PinholeCamera::new(101, 101, 90.0, 90.0, 50.0, 50.0).unwrap());
        config.camera_roll = roll;
        Sequence::new(&config).unwrap().frame(3).unwrap().true_depth
    };
    let (upright, turned) = (square(0.0), square(std::f64::consts::FRAC_PI_2));
    let pixels = (0..101).flat_map(|v| (0..101).map(move |u| (u, v)));
    // The turned camera's x axis is the upright one's y axis. Rounding decides at silhouettes.
    let alike = pixels.filter(|&(u, v)| (turned.at(v, 100 - u) - upright.at(u, v)).abs() < 1e-3).count();
    assert!(alike > 101 * 101 * 99 / 100, "{alike} pixels");
}

/// (reading - exact) / sigma(exact).
fn normalized_errors(frame: &SimulatedFrame, noise: DepthNoise) -> Vec<f64> {
    let pairs = frame.frame.depth().data().iter().zip(frame.true_depth.data());
    pairs.filter(|&(&z, _)| z > 0.0).map(|(&z, &exact)| f64::from((z - exact) / noise.sigma(exact))).collect()
}

#[test]
fn disparities_come_in_whole_steps() {
    let mut config = ideal_config();
    config.sensor.quantization = 0.002_85;
    let frame = Sequence::new(&config).unwrap().frame(0).unwrap();
    let mut worst = 0.0_f32;
    for (&z, &exact) in frame.frame.depth().data().iter().zip(frame.true_depth.data()) {
        if z > 0.0 {
            let disparity = 1.0 / (0.002_85 * z);
            assert!((disparity - disparity.round()).abs() < 0.01);
            worst = worst.max((z - exact).abs() / (0.002_85 * exact * exact));
        }
    }
    assert!((0.4..0.52).contains(&worst), "off by {worst} steps");
}

/// Regression: they overflowed, and every reading was the same.
#[test]
fn steps_too_fine_to_count_change_nothing() {
    let mut config = ideal_config();
    let depth =
        |config: &SequenceConfig| Sequence::new(config).unwrap().frame(0).unwrap().frame.depth().clone();
    let exact = depth(&config);
    config.sensor.quantization = 1e-10;
    assert!(depth(&config) == exact);
}

#[test]
fn lost_and_flying_pixels_may_be_all_there_are() {
    let mut config = ideal_config();
    (config.sensor.edge_dropout, config.sensor.flying_pixels) = (0.9, 0.1);
    assert!(Sequence::new(&config).is_ok());
    config.sensor.flying_pixels = 0.2;
    assert!(Sequence::new(&config).is_err());
}

#[test]
fn the_shadow_falls_on_the_side_away_from_the_projector() {
    let lost = |baseline: f64| {
        let mut config = ideal_config();
        config.sensor.baseline = baseline;
        let sequence = Sequence::new(&config).unwrap();
        // Number of lost background pixels to the left and to the right of people.
        let mut sides = [0, 0];
        for frame in (0..150).step_by(5).filter_map(|i| sequence.frame(i)) {
            let is_mover = |pixel: usize| frame.mover_mask.at(pixel % 160, pixel / 160);
            for pixel in 4..160 * 120 - 4 {
                let lost = frame.frame.depth().data()[pixel] == 0.0 && !is_mover(pixel);
                sides[0] += usize::from(lost && is_mover(pixel + 2));
                sides[1] += usize::from(lost && is_mover(pixel - 2));
            }
        }
        sides
    };
    let [left, right] = lost(0.075);
    assert!(left > 200 && left > 10 * right, "{left} left, {right} right");
    let [left, right] = lost(-0.075);
    assert!(right > 200 && right > 10 * left, "{left} left, {right} right");
    assert_eq!(lost(0.0), [0, 0]);
}

#[test]
fn readings_get_lost_at_edges_more_than_elsewhere() {
    let frame = Sequence::new(&SequenceConfig::default()).unwrap().frame(60).unwrap();
    let (depth, exact) = (frame.frame.depth(), &frame.true_depth);
    let mut counts = [[0_usize; 2]; 2];
    for v in 4..476 {
        for u in 4..636 {
            let z = exact.at(u, v);
            if !(0.6..5.5).contains(&z) {
                continue;
            }
            let jump = |u: usize, v: usize| (exact.at(u, v) - z).abs() > 0.03 + 0.04 * z.min(exact.at(u, v));
            let edge = jump(u + 1, v) || jump(u - 1, v) || jump(u, v + 1) || jump(u, v - 1);
            counts[usize::from(edge)][usize::from(depth.at(u, v) == 0.0)] += 1;
        }
    }
    let share = |[kept, lost]: [usize; 2]| lost as f64 / (kept + lost) as f64;
    let (elsewhere, edges) = (share(counts[0]), share(counts[1]));
    assert!((0.45..0.85).contains(&edges) && elsewhere < 0.08, "{edges} at edges, {elsewhere} elsewhere");
}

#[test]
fn frames_that_are_left_out_do_not_shift_the_others() {
    let mut config = ideal_config();
    config.frames = 12;
    let sequence = Sequence::new(&config).unwrap();
    let times = |frames: &mut dyn Iterator<Item = SimulatedFrame>| -> Vec<f64> {
        frames.map(|frame| frame.frame.timestamp()).collect()
    };
    let all = times(&mut sequence.frames());
    assert_eq!((all.len(), sequence.frames().len()), (12, 12));
    assert_eq!(times(&mut sequence.frames().step_by(5)), [all[0], all[5], all[10]]);
    assert_eq!(times(&mut sequence.frames().skip(9)), all[9..]);
    let mut frames = sequence.frames();
    assert!(frames.nth(12).is_none() && frames.next().is_none());
}

#[test]
fn an_ideal_detector_frames_people_exactly() {
    let mut config = ideal_config();
    config.people = 1;
    let sequence = Sequence::new(&config).unwrap();
    let mut seen = 0;
    for frame in sequence.frames().step_by(3) {
        let persons: Vec<_> = frame.detections.iter().filter(|d| d.label() == "person").collect();
        let bounds = bounds(&frame.mover_mask);
        assert_eq!(persons.first().map(|d| d.bounding_box()), bounds);
        assert_eq!(persons.len(), usize::from(bounds.is_some()));
        seen += persons.len();
        assert!(frame.detections.is_sorted_by(|a, b| a.score() >= b.score()));
        assert!(frame.detections.iter().any(|d| d.label() == "tv" || d.label() == "chair"));
    }
    assert!(seen > 10);
}

fn bounds(mask: &Mask) -> Option<BoundingBox> {
    let (width, height) = (mask.width(), mask.height());
    let columns: Vec<usize> = (0..width).filter(|&u| (0..height).any(|v| mask.at(u, v))).collect();
    let rows: Vec<usize> = (0..height).filter(|&v| (0..width).any(|u| mask.at(u, v))).collect();
    let (left, right) = (columns.first()?, columns.last()? + 1);
    let (top, bottom) = (rows.first()?, rows.last()? + 1);
    BoundingBox::new(*left as f32, *top as f32, right as f32, bottom as f32).ok()
}

#[test]
fn recycled_buffers_change_nothing() {
    let sequence = Sequence::new(&small_config()).unwrap();
    let mut scratch = FrameScratch::default();
    // First, the buffers hold a frame of another size.
    let mut tiny = small_config();
    tiny.camera = Some(PinholeCamera::new(31, 17, 30.0, 30.0, 15.0, 8.0).unwrap());
    scratch.recycle(Sequence::new(&tiny).unwrap().frame(9).unwrap());
    for index in [5, 60, 61, 149] {
        let frame = sequence.frame_with(index, &mut scratch).unwrap();
        assert_eq!(frame, sequence.frame(index).unwrap());
        scratch.recycle(frame);
    }
    assert_eq!(sequence.frame_with(150, &mut scratch), None);
}

#[test]
fn shiny_surfaces_swallow_readings_and_others_do_not() {
    let mut config = ideal_config();
    config.people = 0;
    config.sensor.absorption = 1.0;
    let sequence = Sequence::new(&config).unwrap();
    let (mut in_screens, mut lost_in_screens, mut lost_elsewhere) = (0, 0, 0);
    for frame in (0..150).step_by(30).filter_map(|index| sequence.frame(index)) {
        let shiny = frame.visible_things.iter().filter(|thing| ["tv", "bottle"].contains(&thing.label));
        let boxes: Vec<(BoundingBox, bool)> = shiny.map(|t| (t.bounding_box, t.label == "tv")).collect();
        for pixel in 0..160 * 120 {
            let covers = |area: &BoundingBox| {
                area.columns(160).contains(&(pixel % 160)) && area.rows(120).contains(&(pixel / 160))
            };
            let lost = frame.frame.depth().data()[pixel] == 0.0 && frame.true_depth.data()[pixel] < 6.0;
            match boxes.iter().find(|(area, _)| covers(area)) {
                Some((_, true)) => {
                    in_screens += 1;
                    lost_in_screens += usize::from(lost);
                }
                Some((_, false)) => {}
                None => lost_elsewhere += usize::from(lost),
            }
        }
    }
    // The screen is most of a monitor's box, and 35 % of its readings are lost.
    let share = lost_in_screens as f64 / f64::from(in_screens);
    assert!((0.1..0.36).contains(&share), "{share} of the screens' readings lost");
    assert_eq!(lost_elsewhere, 0);
}
