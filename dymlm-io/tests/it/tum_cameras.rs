//! Cameras of TUM datasets: the benchmark's own, lenses with distortion, depth cameras beside the colour
//! camera.

use std::fs;

use crate::common::{Dataset, HEIGHT, WIDTH, colors, depth};
use dymlm_core::{
    BoundingBox, ColorImage, DepthImage, DepthRegistration, Detection, Distortion, PinholeCamera, Pose,
    Rectifier,
};
use dymlm_io::{FrameBuffers, TumCamera, TumDataset, TumOptions};

fn open(dataset: &Dataset) -> Result<TumDataset, dymlm_io::Error> {
    TumDataset::open(dataset.folder.path(), &TumOptions::default())
}

fn camera() -> PinholeCamera {
    PinholeCamera::new(WIDTH, HEIGHT, 20.0, 20.0, 7.5, 5.5).unwrap()
}

#[test]
fn a_folder_of_the_benchmark_needs_no_camera_file() {
    let dataset = Dataset::new();
    fs::remove_file(dataset.path("camera.json")).unwrap();
    let error = open(&dataset).unwrap_err().to_string();
    assert!(error.contains("camera.json"), "{error}");

    let folder = dataset.path("rgbd_dataset_freiburg2_desk");
    fs::create_dir(&folder).unwrap();
    for name in ["depth", "rgb", "depth.txt", "rgb.txt", "groundtruth.txt"] {
        fs::rename(dataset.path(name), folder.join(name)).unwrap();
    }
    let tum = TumDataset::open(&folder, &TumOptions::default()).unwrap();
    assert_eq!(*tum.camera(), PinholeCamera::new(640, 480, 520.9, 521.0, 325.1, 249.7).unwrap());
    assert_eq!(tum.depth_scale(), 5000.0);
    assert!(tum.rectifier().is_none());
    #[cfg(unix)]
    {
        // Regression: a link to the folder, or `.` within it, has another name.
        std::os::unix::fs::symlink(&folder, dataset.path("latest")).unwrap();
        let linked = TumDataset::open(dataset.path("latest"), &TumOptions::default()).unwrap();
        assert_eq!(linked.camera(), tum.camera());
    }
    // The options take precedence.
    let mut options = TumOptions::default();
    options.camera = Some(TumCamera::Freiburg1);
    assert_eq!(TumDataset::open(&folder, &options).unwrap().camera().cy(), 255.3);
    // A `camera.json` takes precedence over the folder's name.
    let file =
        r#"{"width": 16, "height": 12, "fx": 20, "fy": 20, "cx": 7.5, "cy": 5.5, "depth_scale": 1000}"#;
    fs::write(folder.join("camera.json"), file).unwrap();
    assert_eq!(*TumDataset::open(&folder, &TumOptions::default()).unwrap().camera(), camera());
}

#[test]
fn images_of_a_lens_with_distortion_are_rectified() {
    let dataset = Dataset::new();
    dataset.write(
        "camera.json",
        r#"{"width": 16, "height": 12, "fx": 20.0, "fy": 20.0, "cx": 7.5, "cy": 5.5, "depth_scale": 5000.0,
            "distortion": {"model": "plumb_bob", "coefficients": [-0.3, 0.1, 0.0, 0.0, 0.0]}}"#,
    );
    let tum = open(&dataset).unwrap();
    let lens = Distortion::brown_conrady(&[-0.3, 0.1, 0.0, 0.0]).unwrap();
    let rectifier = Rectifier::new(&camera(), &lens, &camera());
    let mut buffers = FrameBuffers::default();
    for i in 0..3 {
        let mut expected = DepthImage::empty(WIDTH, HEIGHT).unwrap();
        rectifier.rectify_depth(&depth(i), &mut expected).unwrap();
        let raw = ColorImage::new(WIDTH, HEIGHT, colors(i)).unwrap();
        let mut color = raw.clone();
        rectifier.rectify_color(&raw, &mut color).unwrap();
        let posed = tum.load_into(i, &mut buffers).unwrap();
        assert_eq!(posed.frame.depth(), &expected);
        assert_eq!(posed.frame.color(), Some(&color));
        assert_ne!(color, raw);
        buffers.recycle(posed.frame);
    }
    // A box in the stored image: the lens had drawn its corner inward.
    let area = BoundingBox::new(1.0, 1.0, 8.0, 6.0).unwrap();
    let cup = Detection::new("cup", 0.5, area).unwrap();
    let rectified = tum.rectifier().unwrap().rectify_detection(&cup).unwrap();
    assert!(rectified.bounding_box().x_min() < 0.8 && rectified.bounding_box().y_min() < 0.8);
    assert_eq!(rectified.label(), "cup");
}

#[test]
fn depth_images_of_another_camera_are_registered() {
    let dataset = Dataset::new();
    let write = |depth_camera: &str| {
        dataset.write(
            "camera.json",
            &format!(
                r#"{{"width": 16, "height": 12, "fx": 20.0, "fy": 20.0, "cx": 7.5, "cy": 5.5, "depth_scale": 5000.0,
                     "depth_camera": {depth_camera}}}"#
            ),
        );
        open(&dataset)
    };
    let tum = write(
        r#"{"width": 16, "height": 12, "fx": 18.0, "fy": 18.0, "cx": 7.0, "cy": 5.0,
            "distortion": {"model": "equidistant", "coefficients": [0, 0, 0, 0]},
            "color_from_depth": {"translation": [0.02, 0, 0], "quaternion": [0, 0, 0, 1]}}"#,
    )
    .unwrap();
    let depth_camera = PinholeCamera::new(WIDTH, HEIGHT, 18.0, 18.0, 7.0, 5.0).unwrap();
    let lens = Distortion::equidistant([0.0; 4]).unwrap();
    let [mut rectified, mut expected] = [0, 1].map(|_| DepthImage::empty(WIDTH, HEIGHT).unwrap());
    let mut buffers = FrameBuffers::default();
    for i in 0..3 {
        Rectifier::new(&depth_camera, &lens, &depth_camera).rectify_depth(&depth(i), &mut rectified).unwrap();
        let pose = Pose::new([0.02, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        DepthRegistration::new(&depth_camera, &camera(), &pose).register(&rectified, &mut expected).unwrap();
        let posed = tum.load_into(i, &mut buffers).unwrap();
        assert_eq!(posed.frame.depth(), &expected);
        assert_eq!(posed.frame.color().unwrap().data(), colors(i), "the colour camera has no distortion");
        buffers.recycle(posed.frame);
    }

    for (spoilt, reason) in [
        (r#"{"width": 16}"#, "missing field `height`"),
        (
            r#"{"width": 16, "height": 12, "fx": 18, "fy": 18, "cx": 7, "cy": 5}"#,
            "missing field `color_from_depth`",
        ),
    ] {
        let error = write(spoilt).unwrap_err().to_string();
        assert!(error.contains("depth_camera: ") && error.contains(reason), "{error}");
    }
}
