//! Distortion, rectification and registration against `OpenCV` 5.0.0 (`cv2.projectPoints`,
//! `cv2.undistortPoints` with 200 steps, `cv2.fisheye`, `cv2.initUndistortRectifyMap`, `cv2.remap`) and by
//! round trips.
use dymlm_core::{
    BoundingBox, ColorImage, DepthImage, DepthRegistration, Distortion, Error, Mask, PinholeCamera, Pose,
    Rectifier,
};
use proptest::prelude::*;

/// The colour camera of TUM's freiburg1.
fn freiburg1() -> (PinholeCamera, Distortion) {
    let camera = PinholeCamera::new(640, 480, 517.3, 516.5, 318.6, 255.3).unwrap();
    (camera, Distortion::brown_conrady(&[0.2624, -0.9531, -0.0054, 0.0026, 1.1633]).unwrap())
}

/// Like an Azure Kinect's colour camera: with the rational model's denominator.
fn rational() -> (PinholeCamera, Distortion) {
    let camera = PinholeCamera::new(1280, 720, 605.6, 605.4, 638.9, 365.7).unwrap();
    let coefficients = [0.5176, -2.0461, 0.000_45, -0.000_22, 1.4331, 0.3955, -1.8661, 1.3551];
    (camera, Distortion::brown_conrady(&coefficients).unwrap())
}

/// Like a T265's: 163 degrees of view.
fn fisheye() -> (PinholeCamera, Distortion) {
    let camera = PinholeCamera::new(848, 800, 285.7, 286.1, 427.1, 399.8).unwrap();
    (camera, Distortion::equidistant([-0.0066, 0.0435, -0.0412, 0.0075]).unwrap())
}

fn assert_near(found: [f64; 2], expected: [f64; 2], tolerance: f64) {
    let off = (found[0] - expected[0]).abs().max((found[1] - expected[1]).abs());
    assert!(off <= tolerance, "{found:?} instead of {expected:?}");
}

#[test]
fn points_in_space_are_seen_where_opencv_sees_them() {
    let narrow = [[0.3, -0.2, 1.0], [-0.5, 0.4, 1.0], [0.05, 0.02, 2.0], [0.9, -0.6, 1.5]];
    let wide = [[0.3, -0.2, 1.0], [-1.5, 0.9, 1.0], [0.05, 0.02, 2.0], [2.9, -1.6, 1.5]];
    let cases = [
        (
            freiburg1(),
            narrow,
            [
                [477.732919587719, 149.12925373566998],
                [55.167124562555045, 465.01732320938004],
                [331.5362134311974, 260.4640715368632],
                [645.117394821632, 36.97358101376],
            ],
        ),
        (
            rational(),
            narrow,
            [
                [822.8154820739231, 243.15404373749772],
                [327.7749546281611, 614.5858474498855],
                [654.0412115430048, 371.7547205934266],
                [1012.4732598676632, 116.82890047435126],
            ],
        ),
        (
            fisheye(),
            wide,
            [
                [509.3417638363869, 344.89539462468724],
                [169.1425371783348, 554.7911727965245],
                [434.24074065720094, 402.6602952775992],
                [712.3388417842218, 242.20651247975889],
            ],
        ),
    ];
    for ((camera, lens), points, expected) in cases {
        for ([x, y, z], expected) in points.into_iter().zip(expected) {
            let [x, y] = lens.distort([x / z, y / z]);
            assert_near(camera.project([x, y, 1.0]).unwrap(), expected, 1e-9);
        }
    }
}

#[test]
fn pixels_are_rectified_to_where_opencv_rectifies_them() {
    let cases = [
        (freiburg1(), [100.0, 50.0], [105.22502324004401, 56.165570524773955]),
        (freiburg1(), [600.0, 440.0], [592.3260722618335, 436.40511736123585]),
        (freiburg1(), [10.0, 470.0], [18.653403921851293, 464.8799008132872]),
        (rational(), [100.0, 50.0], [111.85610637888271, 56.596523688330535]),
        (rational(), [1200.0, 700.0], [1188.8445364007748, 692.9686303917852]),
        (fisheye(), [100.0, 50.0], [1231.9963626124752, 1260.5543492566303]),
        (fisheye(), [700.0, 300.0], [858.2711116963046, 242.1199818714137]),
        (fisheye(), [200.0, 600.0], [46.37541837677452, 735.427746547643]),
    ];
    for ((camera, lens), pixel, expected) in cases {
        let found = Rectifier::new(&camera, &lens, &camera).rectify_point(pixel);
        // Far out OpenCV's fisheye solver finds another angle, on the other side of the axis.
        if expected[0] > 1000.0 && camera.width() == 848 {
            assert!(found.is_none_or(|found| found[0] < 0.0 && found[1] < 0.0), "{found:?}");
        } else {
            assert_near(found.unwrap(), expected, 1e-3);
        }
    }
}

fn slope(width: usize, height: usize) -> DepthImage {
    let data = (0..width * height).map(|i| 1.0 + (i % width) as f32 * 0.001 + (i / width) as f32 * 0.002);
    DepthImage::new(width, height, data.collect()).unwrap()
}

#[test]
fn depth_images_are_those_of_opencv() {
    let (camera, lens) = freiburg1();
    let mut depth = DepthImage::empty(1, 1).unwrap();
    Rectifier::new(&camera, &lens, &camera).rectify_depth(&slope(640, 480), &mut depth).unwrap();
    for ([u, v], expected) in [([320, 240], 1.8), ([100, 100], 1.285), ([500, 350], 2.208), ([610, 30], 1.66)]
    {
        assert!((depth.at(u, v) - expected).abs() < 1e-6, "{} at {u}, {v}", depth.at(u, v));
    }
    // OpenCV leaves out 17,319 pixels; the sum of the others is 522,112.945. It rounds places to 1/32 pixel
    // first.
    let empty = depth.data().iter().filter(|&&z| z == 0.0).count();
    assert!(empty.abs_diff(17_319) < 60, "{empty} empty");
    let sum: f64 = depth.data().iter().map(|&z| f64::from(z)).sum();
    assert!((sum - 522_112.945).abs() < 80.0, "{sum}");

    let (camera, lens) = fisheye();
    let narrow = PinholeCamera::new(640, 480, 250.0, 250.0, 319.5, 239.5).unwrap();
    Rectifier::new(&camera, &lens, &narrow).rectify_depth(&slope(848, 800), &mut depth).unwrap();
    for ([u, v], expected) in [([0, 0], 1.647), ([320, 240], 2.228), ([639, 479], 2.807), ([17, 400], 2.241)]
    {
        assert!((depth.at(u, v) - expected).abs() < 1e-6, "{} at {u}, {v}", depth.at(u, v));
    }
}

#[test]
fn colours_are_those_of_opencv() {
    let (camera, lens) = freiburg1();
    let pixel = |i: usize| {
        let (u, v) = (i % 640, i / 640);
        let wave = 128.0 + 100.0 * (u as f64 * 0.02).sin() * (v as f64 * 0.03).cos();
        [((u * 3 + v) % 256) as u8, wave as u8, (v / 2) as u8]
    };
    let raw = ColorImage::new(640, 480, (0..640 * 480).map(pixel).collect()).unwrap();
    let mut color = ColorImage::new(1, 1, vec![[0; 3]]).unwrap();
    Rectifier::new(&camera, &lens, &camera).rectify_color(&raw, &mut color).unwrap();
    let expected = [
        ([320, 240], [176, 135, 120]),
        ([100, 100], [124, 37, 47]),
        ([500, 350], [72, 154, 176]),
        ([610, 30], [99, 121, 9]),
    ];
    for ([u, v], expected) in expected {
        let found = color.at(u, v).unwrap();
        // Places are rounded to 1/32 pixel there, to 1/256 here.
        assert!(
            found.iter().zip(expected).all(|(&a, b): (&u8, u8)| a.abs_diff(b) <= 1),
            "{found:?} at {u}, {v}"
        );
    }
    assert_eq!(color.at(0, 0), Some([0; 3]), "the lens shows nothing there");
}

#[test]
fn without_distortion_images_stay_as_they_are() {
    let camera = PinholeCamera::new(64, 48, 50.0, 51.0, 31.0, 24.0).unwrap();
    let none = Distortion::brown_conrady(&[0.0; 4]).unwrap();
    let rectifier = Rectifier::new(&camera, &none, &camera);
    let raw = slope(64, 48);
    let mut depth = DepthImage::empty(64, 48).unwrap();
    rectifier.rectify_depth(&raw, &mut depth).unwrap();
    assert_eq!(depth, raw);
    let raw = ColorImage::new(64, 48, (0..64 * 48).map(|i| [i as u8, (i / 7) as u8, 3]).collect()).unwrap();
    let mut color = raw.clone();
    rectifier.rectify_color(&raw, &mut color).unwrap();
    assert_eq!(color, raw);
    let raw = Mask::from_fn(64, 48, |u, v| u * v % 3 == 1).unwrap();
    let mut mask = Mask::filled(2, 2, true).unwrap();
    rectifier.rectify_mask(&raw, &mut mask).unwrap();
    assert_eq!(mask, raw);
    let error = rectifier.rectify_depth(&slope(63, 48), &mut depth).unwrap_err();
    assert_eq!(error.to_string(), "the raw depth image has 63x48 pixels, the camera 64x48");
}

#[test]
fn a_rectified_box_holds_what_the_raw_one_holds() {
    let (camera, lens) = freiburg1();
    let rectifier = Rectifier::new(&camera, &lens, &camera);
    let raw = BoundingBox::new(20.0, 30.0, 200.0, 300.0).unwrap();
    let area = rectifier.rectify_box(&raw).unwrap();
    let mut mask = Mask::filled(640, 480, false).unwrap();
    mask.fill_box(&raw, true);
    let mut rectified = mask.clone();
    rectifier.rectify_mask(&mask, &mut rectified).unwrap();
    let inside = (0..480).flat_map(|v| rectified.columns_of_row(v).map(move |u| [u as f32, v as f32]));
    let grown = [area.x_min() - 1.0, area.y_min() - 1.0, area.x_max() + 1.0, area.y_max() + 1.0];
    assert!(rectified.count() > 40_000);
    assert!(inside.into_iter().all(|[u, v]| u >= grown[0] && v >= grown[1] && u < grown[2] && v < grown[3]));
}

/// A lens model that ends within the image: what lies beyond has no place in the rectified one.
#[test]
fn a_box_whose_border_the_lens_model_does_not_describe_keeps_its_middle() {
    let camera = PinholeCamera::new(640, 480, 300.0, 300.0, 319.5, 239.5).unwrap();
    let lens = Distortion::brown_conrady(&[-0.3, 0.0, 0.0, 0.0]).unwrap();
    let rectifier = Rectifier::new(&camera, &lens, &camera);
    let middle = BoundingBox::new(300.0, 220.0, 340.0, 260.0).unwrap();
    let inner = rectifier.rectify_box(&middle).unwrap();
    // All of the border, or some of it.
    for [x_min, y_min, x_max, y_max] in [[100.0, 0.0, 540.0, 480.0], [100.0, 210.0, 350.0, 270.0]] {
        let raw = BoundingBox::new(x_min, y_min, x_max, y_max).unwrap();
        let area = rectifier.rectify_box(&raw).unwrap();
        assert!(
            area.x_min() < 60.0 && area.y_min() < inner.y_min() && area.y_max() > inner.y_max(),
            "{area:?}"
        );
        assert!(area.x_min() >= 0.0 && area.x_max() >= inner.x_max() && area.x_max() <= 640.0, "{area:?}");
    }
    let corner = BoundingBox::new(0.0, 0.0, 60.0, 60.0).unwrap();
    assert_eq!(rectifier.rectify_box(&corner), None);
}

#[test]
fn coefficients_that_are_no_lens_are_refused() {
    assert_eq!(
        Distortion::brown_conrady(&[0.0; 3]).unwrap_err().to_string(),
        "distortion.coefficients (their number) = 3 is outside its range 4..=8"
    );
    assert!(Distortion::brown_conrady(&[f64::NAN; 4]).is_err());
    assert!(Distortion::equidistant([1e9; 4]).is_err());
}

proptest! {
    #[test]
    fn what_is_distorted_is_undistorted(radius in 0.0..1.2_f64, angle in 0.0..6.2_f64, lens in 0..3_usize) {
        let (_, lens) = [freiburg1, rational, fisheye][lens]();
        let place = [radius * angle.cos(), radius * angle.sin()];
        let seen = lens.distort(place);
        if let Some(back) = lens.undistort(seen) {
            let again = lens.distort(back);
            prop_assert!((again[0] - seen[0]).abs() < 1e-9 && (again[1] - seen[1]).abs() < 1e-9);
        }
        // The view of these lenses; beyond it the models may fold.
        if radius < 0.75 {
            let back = lens.undistort(seen).unwrap();
            prop_assert!((back[0] - place[0]).abs() < 1e-8 && (back[1] - place[1]).abs() < 1e-8);
        }
    }
}

fn cameras() -> (PinholeCamera, PinholeCamera, Pose) {
    let depth = PinholeCamera::new(320, 240, 262.0, 261.0, 158.0, 121.0).unwrap();
    let color = PinholeCamera::new(640, 480, 520.0, 521.0, 319.5, 238.0).unwrap();
    let rotation = [
        [0.9995000583306112, -0.010297631831627843, -0.029893012156105903],
        [0.00969770182836127, 0.9997500291653056, -0.020145316160805754],
        [0.030092988823861425, 0.01984535115917247, 0.9993500758297945],
    ];
    (depth, color, Pose::from_rotation_matrix(rotation, [0.05, -0.01, 0.004]).unwrap())
}

#[test]
fn readings_are_registered_where_opencv_projects_them() {
    let (depth_camera, color_camera, color_from_depth) = cameras();
    let registration = DepthRegistration::new(&depth_camera, &color_camera, &color_from_depth);
    let expected = [
        ([160, 120], 2.0, [320.9414635693886, 222.96479870063024], 2.0030075149470727),
        ([40, 200], 1.5, [84.28611142814313, 380.1996301255143], 1.4917053631194235),
        ([300, 30], 3.2, [592.9072384257086, 48.897884214153635], 3.231970419108934),
        ([100, 100], 0.9, [217.7642604457459, 178.42188786584327], 0.895982365076331),
    ];
    for ([u, v], z, pixel, depth) in expected {
        let mut readings = vec![0.0; 320 * 240];
        readings[v * 320 + u] = z;
        let mut registered = DepthImage::empty(640, 480).unwrap();
        registration.register(&DepthImage::new(320, 240, readings).unwrap(), &mut registered).unwrap();
        let nearest = pixel.map(|c: f64| c.round() as usize);
        assert!((f64::from(registered.at(nearest[0], nearest[1])) - depth).abs() < 1e-6);
        // A pixel of the depth camera covers two by two of the colour camera's, or a bit more.
        let covered = registered.data().iter().filter(|&&z| z > 0.0).count();
        assert!((4..=9).contains(&covered), "{covered} pixels");
    }
}

#[test]
fn one_camera_registered_to_itself_changes_nothing() {
    let (_, camera, _) = cameras();
    let raw = slope(640, 480);
    let mut registered = DepthImage::empty(1, 1).unwrap();
    DepthRegistration::new(&camera, &camera, &Pose::identity()).register(&raw, &mut registered).unwrap();
    assert_eq!(registered, raw);
}

#[test]
fn a_slope_has_no_holes() {
    let depth_camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    // The colour camera is on either side; its pixels are of the same size.
    for side in [-0.1, 0.1] {
        let color_from_depth = Pose::new([side, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let registration = DepthRegistration::new(&depth_camera, &depth_camera, &color_from_depth);
        let mut registered = DepthImage::empty(640, 480).unwrap();
        // A wall seen aslant: 1/z grows evenly over the image, from 1 m to 4 m.
        let data = (0..640 * 480).map(|i| 1.0 / (1.0 - 0.75 * (i % 640) as f32 / 639.0)).collect();
        registration.register(&DepthImage::new(640, 480, data).unwrap(), &mut registered).unwrap();
        let inner = registered.data().iter().enumerate().filter(|(i, _)| (80..560).contains(&(i % 640)));
        assert_eq!(inner.filter(|(_, z)| **z == 0.0).count(), 0, "the camera at {side} m");
    }
}

#[test]
fn the_nearer_of_two_readings_counts_and_what_it_hides_has_none() {
    let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    let color_from_depth = Pose::new([0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let registration = DepthRegistration::new(&camera, &camera, &color_from_depth);
    let near = |u: usize| (300..340).contains(&u);
    let data = (0..640 * 480).map(|i| if near(i % 640) { 1.0 } else { 3.0 }).collect();
    let mut registered = DepthImage::empty(640, 480).unwrap();
    registration.register(&DepthImage::new(640, 480, data).unwrap(), &mut registered).unwrap();
    // 52.5 pixels to the right at 1 m, 17.5 at 3 m; between the two the depth camera saw nothing.
    let row = registered.row(240);
    assert!((354..391).all(|u| row[u] == 1.0), "what is near");
    assert!(row[350] == 0.0 && row[330] == 0.0, "the wall that it hides from the depth camera");
    assert!(row[310] == 3.0 && row[400] == 3.0);
    assert!(matches!(
        registration.register(&slope(3, 3), &mut registered),
        Err(Error::SizeMismatch { actual_width: 3, .. })
    ));
}

/// Regression: readings near the greatest number, as some drivers mark what was not read, became infinite.
#[test]
fn a_registered_image_has_no_infinite_reading() {
    let camera = PinholeCamera::new(8, 8, 4.0, 4.0, 3.5, 3.5).unwrap();
    let turned = Pose::new([0.0; 3], [0.0, 0.3_f64.sin(), 0.0, 0.3_f64.cos()]).unwrap();
    let registration = DepthRegistration::new(&camera, &camera, &turned);
    let mut registered = DepthImage::empty(8, 8).unwrap();
    registration.register(&DepthImage::new(8, 8, vec![f32::MAX; 64]).unwrap(), &mut registered).unwrap();
    assert!(registered.data().iter().all(|z| z.is_finite()), "{:?}", registered.data());
}
