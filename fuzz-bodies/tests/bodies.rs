//! Runs each body for a moment, or for longer: see `DYMLM_FUZZ_SECONDS` and `DYMLM_FUZZ_SEED`.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use dymlm::MapConfig;
use dymlm_core::{BoundingBox, DepthImage, Detection, PointCloud, SplitMix64};
use dymlm_fuzz_bodies::{
    Body, Effort, carried_object, correct_poses, insert, map_builder, merge, octree_model, read_bt,
    read_config, read_detections, read_image, read_map_file, read_map_folder, read_mcap, read_ot, read_pcd,
    read_ply, read_records, read_saved_folder, read_trajectory, read_tum, read_yolo, run, saved_cloud,
    saved_history, saved_map, saved_objects, saved_octree, saved_planes,
};
use dymlm_io::{
    decode_pcd, decode_ply, encode_detections, encode_pcd, encode_ply, read_color_image, read_objects,
    read_planes, write_depth_png, write_png,
};
use dymlm_octree::{Octree, OctreeConfig};

fn drive(name: &str, body: Body, examples: &[Vec<u8>]) {
    let inputs = run(body, examples, Effort::from_env());
    println!("{name}: {inputs} inputs");
    assert!(inputs > examples.len());
}

fn cloud() -> PointCloud {
    PointCloud::with_colors(vec![[1.0, 2.0, 3.0], [-0.5, 0.25, 1e9]], vec![[1, 2, 3], [4, 5, 6]]).unwrap()
}

/// Random bytes, which structured bodies turn into choices.
fn noise(count: usize, length: usize) -> Vec<Vec<u8>> {
    let mut random = SplitMix64::new(3);
    (0..count).map(|_| (0..length).map(|_| random.below(256) as u8).collect()).collect()
}

#[test]
fn ply() {
    let mut written = Vec::new();
    encode_ply(&mut written, &cloud()).unwrap();
    let ascii = "ply\nformat ascii 1.0\ncomment x\nelement face 1\nproperty list uchar int v\nelement vertex 2\n\
        property float x\nproperty double y\nproperty short z\nproperty uchar red\nproperty uchar green\n\
        property uchar blue\nend_header\n3 0 1 2\n1 2 3 4 5 6\n-1 2e3 3 255 0 1\n";
    let list = b"ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty list uint uchar a\nproperty float x\n\
        property float y\nproperty float z\nend_header\n\0\0\0\x02ab\0\0\0\0\0\0\0\0\0\0\0\0";
    for example in [written.as_slice(), ascii.as_bytes(), list] {
        decode_ply(example, "example").unwrap();
    }
    drive("PLY", read_ply, &[written, ascii.into(), list.to_vec()]);
}

#[test]
fn mcap() {
    let bags = [
        "plain",
        "plain_lz4",
        "plain_unchunked",
        "packed_unchunked",
        "inverse_unchunked",
        "odometry_unchunked",
    ];
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../dymlm-io/tests/bags");
    let examples = bags.map(|name| std::fs::read(folder.join(format!("{name}.mcap"))).unwrap());
    drive("MCAP", read_mcap, &examples);
}

#[test]
fn pcd() {
    let mut written = Vec::new();
    encode_pcd(&mut written, &cloud()).unwrap();
    let ascii = "FIELDS x y _ z rgb n\nSIZE 8 4 1 4 4 2\nTYPE F F U F F I\nCOUNT 1 1 3 1 1 2\nWIDTH 1\nHEIGHT 2\n\
        VIEWPOINT 1 2 3 0 1 0 0\nDATA ascii\n0.5 1 9 9 9 2 4.2108e+06 -1 7\nnan nan 0 0 0 nan 0 0 1\n";
    let packed = b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA binary_compressed\n\x06\0\0\0\x0c\0\0\0\0\0\xe0\0\0\0";
    for example in [written.as_slice(), ascii.as_bytes()] {
        decode_pcd(example, "example").unwrap();
    }
    drive("PCD", read_pcd, &[written, ascii.into(), packed.to_vec()]);
}

#[test]
fn detections() {
    let mut written = Vec::new();
    let found = Detection::new("person", 0.9, BoundingBox::new(1.0, 2.0, 30.0, 40.0).unwrap()).unwrap();
    encode_detections(&mut written, 0.1, &[found]).unwrap();
    written.extend(b"{\"timestamp\": 0.2, \"detections\": []}\n");
    drive("detections", read_detections, &[written]);
}

#[test]
fn yolo() {
    drive(
        "YOLO",
        read_yolo,
        &[b"0 0.5 0.5 0.25 0.5 0.9\n1 0.1 0.2 0.1 0.1\n".to_vec(), b"person\nchair\n".to_vec()],
    );
}

#[test]
fn records() {
    let planes = r#"{"planes": [{"id": 3, "normal": [0.0, 0.0, 1.0], "d": -1.5, "centroid": [0.0, 1.0, 1.5], "area_m2": 2.0,
        "boundary": [[[0.0, 0.0, 1.5], [1.0, 0.0, 1.5], [0.0, 1.0, 1.5]]], "inliers": 100, "observations": 4}]}"#;
    let objects = r#"{"objects": [{"id": 1, "label": "chair", "score": 0.5, "shape": "cuboid", "rotation": [0.0, 0.0, 0.0, 1.0],
        "translation": [0.0, 1.0, 2.0], "dimensions": [0.2, 0.3, 0.4], "observations": 7, "points": 12}]}"#;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("records.json");
    std::fs::write(&path, planes).unwrap();
    read_planes(&path).unwrap();
    std::fs::write(&path, objects).unwrap();
    read_objects(&path).unwrap();
    drive("records", read_records, &[planes.into(), objects.into()]);
}

#[test]
fn tum() {
    let lists = "{\"width\": 16, \"height\": 12, \"fx\": 20.0, \"fy\": 20.0, \"cx\": 7.5, \"cy\": 5.5, \"depth_scale\": 5000.0}\0\
        # depth\n1.0 depth/0.png\n1.1 depth/1.png\n\x001.0 rgb/0.png\n1.1 rgb/1.png\n\
        \x001.0 0 0 0 0 0 0 1\n1.1 1 0 0 0 0 0 1\n2.0 2 0 0 0 0 1 0\n\
        \x001.0 rgb/0.png 1.0 depth/0.png\n";
    drive("TUM", read_tum, &[lists.into(), lists.rsplit_once('\0').unwrap().0.into()]);
}

#[test]
fn trajectory() {
    drive(
        "trajectory",
        read_trajectory,
        &[b"# t x y z qx qy qz qw\n1.0 0 0 0 0 0 0 1\n1.5 1 0 -2e-1 0 0 1 0\n".into()],
    );
}

/// A grey picture of 16 x 8 pixels.
const JPEG: &[u8] = include_bytes!("tiny.jpg");

#[test]
fn images() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.png");
    let depth = DepthImage::new(5, 4, (0..20).map(|i| i as f32 / 10.0).collect()).unwrap();
    write_depth_png(&path, &depth, 5000.0).unwrap();
    let depth = std::fs::read(&path).unwrap();
    let colors: Vec<[u8; 3]> = (0..20).map(|i| [i, 2 * i, 255 - i]).collect();
    write_png(&path, 5, 4, &colors).unwrap();
    let colors = std::fs::read(&path).unwrap();
    std::fs::write(&path, JPEG).unwrap();
    read_color_image(&path).unwrap();
    drive("images", read_image, &[depth, colors, JPEG.to_vec()]);
}

#[test]
fn config() {
    let whole = "preset = \"robot\"\nmax_detection_delay = 0.2\npublish_interval = 1\n[sensor]\npreset = \"time_of_flight\"\n\
        stride = 2\nmax_depth = 5.5\n[cloud]\nvoxel_size = 0.1\n[octree]\nresolution = 0.4\nmax_range = 4\ncolor = true\n\
        [key_frames]\nmin_translation = 0.1\n[memory]\nbudget = 1000000\n";
    MapConfig::from_toml(whole).unwrap();
    let short = "[cloud]\nvoxel_size = 0.05\n[octree]\nresolution = 0.3\n";
    drive("config", read_config, &[whole.into(), short.into()]);
}

#[test]
fn saved_folder() {
    drive("saved folder", read_saved_folder, &noise(16, 40));
}

#[test]
fn map_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map");
    let map = dymlm::MapBuilder::new(dymlm::MapConfig::default()).unwrap().into_map();
    map.save(&path).unwrap();
    let mut written = std::fs::read(path.join("manifest.json")).unwrap();
    written.push(0);
    written.extend(std::fs::read(path.join("objects.json")).unwrap());
    drive("map folder", read_map_folder, &[written]);
}

fn octree(has_color: bool) -> Octree {
    let mut config = OctreeConfig::default();
    config.color = has_color;
    let mut map = Octree::new(config).unwrap();
    map.insert_scan_colored([0.0; 3], &[[1.0, 0.2, 0.1], [0.3, -0.7, 0.4]], &[[9; 3], [70; 3]]).unwrap();
    map
}

/// A leaf near the root.
const LARGE_LEAF: &[u8] = b"# Octomap OcTree binary file\nid OcTree\nsize 2\nres 0.05\ndata\n\x01\0";

#[test]
fn bt() {
    let mut written = Vec::new();
    octree(false).write_bt(&mut written).unwrap();
    Octree::read_bt(LARGE_LEAF, OctreeConfig::default()).unwrap();
    drive(".bt", read_bt, &[written, LARGE_LEAF.to_vec()]);
}

#[test]
fn ot() {
    let [plain, colored] = [false, true].map(|has_color| {
        let mut written = Vec::new();
        octree(has_color).write_ot(&mut written).unwrap();
        written
    });
    drive(".ot", read_ot, &[plain, colored]);
}

#[test]
fn map_file() {
    let written =
        b"image: a.pgm\nresolution: 0.05\norigin: [-1.5, 2.0, 0.1]\nnegate: 0\noccupied_thresh: 0.65\n\
        free_thresh: 0.196\n\0P5 3 2 255\n\x00\xcd\xfe\xff\x59\x5a";
    drive("map file", read_map_file, &[written.to_vec()]);
}

#[test]
fn octree_beside_a_model() {
    drive("octree", octree_model, &noise(8, 600));
}

#[test]
fn frames_inserted() {
    drive("insert", insert, &noise(8, 3000));
}

#[test]
fn poses_corrected() {
    drive("correct poses", correct_poses, &noise(8, 60));
}

#[test]
fn maps_merged() {
    drive("merge", merge, &noise(8, 450));
}

#[test]
fn builder() {
    drive("map builder", map_builder, &noise(8, 400));
}

#[test]
fn objects_carried_about() {
    drive("carried object", carried_object, &noise(4, 200));
}

#[test]
fn a_saved_cloud() {
    drive("saved cloud", saved_cloud, &noise(16, 40));
}

#[test]
fn a_saved_octree() {
    drive("saved octree", saved_octree, &noise(16, 40));
}

#[test]
fn planes_saved() {
    drive("saved planes", saved_planes, &noise(16, 40));
}

#[test]
fn objects_saved() {
    drive("saved objects", saved_objects, &noise(16, 40));
}

#[test]
fn a_saved_history() {
    drive("saved history", saved_history, &noise(16, 40));
}

#[test]
fn a_saved_map() {
    drive("saved map", saved_map, &noise(4, 60));
}
