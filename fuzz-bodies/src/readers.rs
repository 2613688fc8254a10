use std::fs;
use std::path::Path;

use dymlm::files::object_records;
use dymlm::{HistoryConfig, MapBuilder, MapConfig, MultiLevelMap};
use dymlm_io::{
    DetectionFile, FrameBuffers, MapFolder, McapOptions, McapRecording, Trajectory, TumDataset, TumOptions,
    YoloFolder,
};
use dymlm_octree::{MapFile, Octree, OctreeConfig, UnknownCells};
use dymlm_sim::SimulatedFrame;

use crate::choices::Choices;
use crate::damage::damage;
use crate::memory_folder::memory_folder;
use crate::walk::{MAPPED, SAVED_FILES, SAVED_FOLDER, WALK};

/// PLY files: a file that is read is written and read again.
pub fn read_ply(bytes: &[u8]) {
    if let Ok(cloud) = dymlm_io::decode_ply(bytes, "fuzz.ply") {
        let mut file = Vec::new();
        dymlm_io::encode_ply(&mut file, &cloud).unwrap();
        let again = dymlm_io::decode_ply(&file, "again.ply").unwrap();
        assert_eq!((again.len(), again.colors()), (cloud.len(), cloud.colors()));
    }
}

/// PCD files: a file that is read is written and read again.
pub fn read_pcd(bytes: &[u8]) {
    if let Ok(read) = dymlm_io::decode_pcd(bytes, "fuzz.pcd") {
        assert_eq!(read.width * read.height, read.cloud.len());
        let mut file = Vec::new();
        dymlm_io::encode_pcd(&mut file, &read.cloud).unwrap();
        assert_eq!(dymlm_io::decode_pcd(&file, "again.pcd").unwrap().cloud.len(), read.cloud.len());
    }
}

/// Runs a reader in a folder that exists only during the call.
fn in_folder(read: impl FnOnce(&Path)) {
    let folder = memory_folder();
    read(folder.path());
}

/// Trajectories: one that is read is written, and must read back as the same.
pub fn read_trajectory(bytes: &[u8]) {
    in_folder(|folder| {
        let path = folder.join("trajectory.txt");
        fs::write(&path, bytes).unwrap();
        let Ok(trajectory) = Trajectory::read(&path) else { return };
        let _ = trajectory.gaps(0.1).len();
        for time in [-1e300, 0.0, 1.5, f64::NAN] {
            let _ = trajectory.pose_at(time, 0.1);
        }
        trajectory.write(&path).unwrap();
        assert_eq!(Trajectory::read(&path).unwrap().poses().len(), trajectory.poses().len());
    });
}

/// PNG and JPEG files as depth and as colours: an image that is read is written, and must read back as the
/// same.
pub fn read_image(bytes: &[u8]) {
    in_folder(|folder| {
        let path = folder.join("image.png");
        fs::write(&path, with_png_checksums(bytes)).unwrap();
        if let Ok(depth) = dymlm_io::read_depth_png(&path, 5000.0) {
            dymlm_io::write_depth_png(&path, &depth, 5000.0).unwrap();
            assert_eq!(dymlm_io::read_depth_png(&path, 5000.0).unwrap().data(), depth.data());
        }
        if let Ok(colors) = dymlm_io::read_color_image(&path) {
            dymlm_io::write_png(&path, colors.width(), colors.height(), colors.data()).unwrap();
            assert_eq!(dymlm_io::read_color_image(&path).unwrap().data(), colors.data());
        }
    });
}

/// Corrects the checksums of a PNG's chunks, so that the decoder reads their contents.
fn with_png_checksums(bytes: &[u8]) -> Vec<u8> {
    let mut file = bytes.to_vec();
    let mut start = 8;
    while let Some(length) = file.get(start..start + 4) {
        let length = u32::from_be_bytes(length.try_into().unwrap()) as usize;
        let end = start + 8 + length;
        let Some(checked) = file.get(start + 4..end) else { break };
        let checksum = crc32(checked).to_be_bytes();
        let Some(place) = file.get_mut(end..end + 4) else { break };
        place.copy_from_slice(&checksum);
        start = end + 4;
    }
    file
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| sum >> 1 ^ if sum & 1 == 1 { 0xedb8_8320 } else { 0 })
    })
}

/// Config files: a valid config maps a frame, is saved with the maps and read back.
pub fn read_config(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let Ok(mut config) = MapConfig::from_toml(text) else { return };
    // The config must not name files of the machine.
    (config.history, config.memory.path) = (HistoryConfig::None, None);
    let Ok(mut builder) = MapBuilder::new(config) else { return };
    let SimulatedFrame { frame, detections, world_from_camera, .. } = &WALK[0];
    let _ = builder.insert(frame, detections, world_from_camera);
    in_folder(|folder| {
        let path = folder.join("map");
        builder.map().save(&path).unwrap();
        let loaded = MultiLevelMap::load(&path).unwrap();
        assert_eq!((loaded.config(), loaded.counts()), (builder.config(), builder.map().counts()));
    });
}

/// Detections as JSON lines.
pub fn read_detections(bytes: &[u8]) {
    in_folder(|folder| {
        let path = folder.join("detections.jsonl");
        fs::write(&path, bytes).unwrap();
        let Ok(file) = DetectionFile::open(&path, 0.02) else { return };
        assert!(file.faults().len() <= file.len());
        for time in [-1e300, 0.0, 0.1, 1.0, f64::NAN] {
            let _ = file.at(time);
        }
    });
}

/// ROS 2 bags: opened, and every frame loaded.
pub fn read_mcap(bytes: &[u8]) {
    in_folder(|folder| {
        let path = folder.join("bag.mcap");
        fs::write(&path, bytes).unwrap();
        let Ok(mut bag) = McapRecording::open(&path, &McapOptions::default()) else { return };
        let mut buffers = FrameBuffers::default();
        for index in 0..bag.frames().len() {
            if let Ok(loaded) = bag.load(index, &mut buffers) {
                buffers.recycle(loaded.frame);
            }
        }
    });
}

/// YOLO's label files; the first line is the number of names.
pub fn read_yolo(bytes: &[u8]) {
    in_folder(|folder| {
        fs::write(folder.join("frame.txt"), bytes).unwrap();
        fs::write(folder.join("names"), bytes).unwrap();
        let names = dymlm_io::read_class_names(folder.join("names")).unwrap_or_default();
        for names in [names, vec!["person".to_owned(), "chair".to_owned()]] {
            let Ok(labels) = YoloFolder::open(folder, names, 640, 480) else { continue };
            let _ = labels.read("frame.png");
        }
    });
}

/// Planes and objects of a map folder.
pub fn read_records(bytes: &[u8]) {
    in_folder(|folder| {
        let path = folder.join("records.json");
        fs::write(&path, bytes).unwrap();
        if let Ok(planes) = dymlm_io::read_planes(&path) {
            let mut file = Vec::new();
            dymlm_io::encode_planes(&mut file, &planes).unwrap();
        }
        if let Ok(objects) = dymlm_io::read_objects(&path) {
            let mut file = Vec::new();
            dymlm_io::encode_objects(&mut file, &objects).unwrap();
        }
    });
}

/// The lists of a TUM folder, separated by zeros: camera, depth, colour, trajectory, associations.
pub fn read_tum(bytes: &[u8]) {
    in_folder(|folder| {
        let names = ["camera.json", "depth.txt", "rgb.txt", "groundtruth.txt", "associations.txt"];
        for (name, part) in names.into_iter().zip(bytes.split(|&byte| byte == 0)) {
            fs::write(folder.join(name), part).unwrap();
        }
        let Ok(dataset) = TumDataset::open(folder, &TumOptions::default()) else { return };
        let _ = (dataset.gaps(), dataset.faults().len());
        let mut buffers = FrameBuffers::default();
        for index in 0..dataset.frames().len().min(3) {
            // None of the images exists.
            assert!(dataset.load_into(index, &mut buffers).is_err());
        }
    });
}

/// The manifest of a map folder and, after a zero, one of its files; read as maps and as files.
pub fn read_map_folder(bytes: &[u8]) {
    in_folder(|folder| {
        let mut parts = bytes.splitn(2, |&byte| byte == 0);
        fs::write(folder.join("manifest.json"), parts.next().unwrap_or_default()).unwrap();
        fs::write(folder.join("objects.json"), parts.next().unwrap_or_default()).unwrap();
        if let Ok(map) = MapFolder::open_unverified(folder) {
            for name in map.files().map(str::to_owned).collect::<Vec<_>>() {
                let _ = map.reader(&name);
            }
        }
        let _ = MapFolder::open(folder);
        if let Ok((map, missing)) = MultiLevelMap::load_partial(folder) {
            let _ = (object_records(map.objects()), missing.len());
        }
    });
}

/// A saved folder with damaged files, whose checksums are left as they are.
pub fn read_saved_folder(bytes: &[u8]) {
    let mut choices = Choices::new(bytes);
    let mut files = SAVED_FOLDER.clone();
    damage(&mut files, &mut choices);
    in_folder(|folder| {
        for ((number, content), name) in files.iter().zip(SAVED_FILES) {
            // Here, a part in another's place, or under another key, means the content of another file.
            let name = SAVED_FILES.get(*number as usize).copied().unwrap_or(name);
            fs::write(folder.join(name), content).unwrap();
        }
        let _ = MapFolder::open(folder).map(|map| map.files().count());
        let _ = MultiLevelMap::load(folder);
        let Ok((map, _)) = MultiLevelMap::load_partial(folder) else { return };
        let Ok(mut builder) = MapBuilder::resume(map) else { return };
        let SimulatedFrame { frame, detections, world_from_camera, .. } = &WALK[MAPPED];
        let _ = builder.insert(frame, detections, world_from_camera);
    });
}

/// Queries of a map that was read.
fn ask(map: &Octree) {
    let counts = map.counts();
    assert_eq!(map.leaves().count(), counts.leaves);
    assert_eq!(map.is_empty(), counts.leaves == 0);
    let _ = map.cast_ray([0.0; 3], [1.0, 0.3, 0.2], 100.0, UnknownCells::Pass);
    let _ = map.nearest_obstacle([0.0; 3], 0.5);
    if let Some(extent) = map.extent() {
        // Large maps are skipped: a face of 2^28 cells takes seconds.
        let face: f64 = (0..2).map(|axis| (extent.max[axis] - extent.min[axis]) / map.resolution()).product();
        if face < 1e5 {
            let _ = map.project([0.0, 0.0, 1.0], f64::NEG_INFINITY, f64::INFINITY);
            let _ = map.project([0.1, 0.0, 1.0], -1.0, 1.0);
        }
    }
}

/// Octrees in the compact format: one that is read is written, and must read back as the same.
pub fn read_bt(bytes: &[u8]) {
    if let Ok(map) = Octree::read_bt(bytes, OctreeConfig::default()) {
        ask(&map);
        let mut file = Vec::new();
        map.write_bt(&mut file).unwrap();
        let again = Octree::read_bt(file.as_slice(), OctreeConfig::default()).unwrap();
        assert!(again.leaves().eq(map.leaves()));
    }
}

/// Octrees in the full format: one that is read is written, and must read back as the same.
pub fn read_ot(bytes: &[u8]) {
    for has_color in [false, true] {
        let mut config = OctreeConfig::default();
        config.color = has_color;
        if let Ok(map) = Octree::read_ot(bytes, config.clone()) {
            ask(&map);
            let mut file = Vec::new();
            map.write_ot(&mut file).unwrap();
            let again = Octree::read_ot(file.as_slice(), config).unwrap();
            assert!(again.leaves().eq(map.leaves()));
        }
    }
}

/// Maps of `map_server`: the description ends at the first zero, and the image follows.
pub fn read_map_file(bytes: &[u8]) {
    let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
    let description = String::from_utf8_lossy(&bytes[..end]);
    if let Ok(map) = MapFile::read(&description, bytes.get(end + 1..).unwrap_or_default()) {
        assert_eq!(map.cells.len(), map.width * map.height);
        assert!(map.resolution > 0.0);
    }
}
