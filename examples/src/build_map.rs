#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Parser;
use dymlm::core::{FrameId, Pose};
use dymlm::files::{Autosave, ConfigFileError, LoadOptions, MapSaver};
use dymlm::{
    FrameReport, HistoryConfig, MapBuilder, MapConfig, MultiLevelMap, RefineConfig, RefinedPoses, Selection,
};
use dymlm_io::{McapOptions, StampedPose, Trajectory, TumOptions, read_class_names};
use dymlm_sim::SequenceConfig;

use crate::{
    AnyError, CorrectionCost, FrameDetector, FrameSource, Milliseconds, OpenDetector, ReportPage, Run,
    RunObservers, RunRecorder, RunReport, SessionFile, SourceFrame, cloud_pictures, every, interruption,
    mean_up, named_sequence, objects_from_above, objects_from_camera, octree_pictures, plane_pictures,
    planes_from_camera, print_warning, progress_bar, read_pose, timed, up_of_planes,
};

/// Longest gap between two poses of the corrections across which poses are interpolated, seconds.
const LONGEST_GAP: f64 = 2.0;

/// Builds the maps of the static world from a recorded RGB-D sequence with people walking through it. Without
/// --dataset it renders a synthetic walking sequence and maps that.
#[derive(Parser)]
struct Arguments {
    /// TUM RGB-D folder, or a ROS 2 bag (FILE.mcap)
    #[arg(long)]
    dataset: Option<PathBuf>,
    #[arg(
        long,
        requires = "dataset",
        value_delimiter = ',',
        value_parser = read_topic,
        help = "Of a bag: depth=TOPIC,color=TOPIC,depth_info=TOPIC,color_info=TOPIC,detections=TOPIC,\nodometry=TOPIC,world=FRAME; default: found by their types"
    )]
    topics: Vec<(String, String)>,
    #[arg(
        long,
        conflicts_with = "dataset",
        help = "Synthetic sequence: walking_xyz, sitting_rpy, ..., two_tables, random_room_0, ..."
    )]
    sequence: Option<String>,
    /// JSON-lines file or YOLO folder (with names.txt); default: the dataset's detections.jsonl
    #[arg(long, requires = "dataset")]
    detections: Option<PathBuf>,
    /// Of a bag whose detections have numbers for classes: their names, one a line, from class 0 on
    #[arg(long, requires = "dataset", conflicts_with = "detector", value_name = "FILE")]
    class_names: Option<PathBuf>,
    /// A YOLOX network that detects things in the images while they are mapped
    #[arg(long, requires = "dataset", conflicts_with = "detections", value_name = "FILE.onnx")]
    detector: Option<PathBuf>,
    /// Names of the network's classes, one a line; default: COCO's
    #[arg(long, requires = "detector", value_name = "FILE")]
    detector_names: Option<PathBuf>,
    /// Poses, camera to world; default: the dataset's groundtruth.txt
    #[arg(long, requires = "dataset")]
    trajectory: Option<PathBuf>,
    /// Poses of a back end, camera to world, at any times: after the last frame, the maps are corrected to
    /// them
    #[arg(long)]
    corrections: Option<PathBuf>,
    /// After the last frame, and any correction, refines the poses by planes and objects; the maps
    /// follow
    #[arg(long)]
    refine: bool,
    /// Settings; fields that the file leaves out have their defaults. Resumed maps keep theirs: [history] and
    /// [memory] alone may be others, for a machine with other folders or another memory
    #[arg(long)]
    config: Option<PathBuf>,
    /// Continues the maps of a folder, with their settings
    #[arg(long)]
    resume: Option<PathBuf>,
    #[arg(
        long,
        requires = "resume",
        value_parser = read_pose,
        allow_hyphen_values = true,
        help = "\"tx ty tz qx qy qz qw\": takes this sequence's world to that of the resumed maps"
    )]
    world_from_session: Option<Pose>,
    /// Seconds between two saves while the maps are built
    #[arg(long, default_value_t = 60.0, value_parser = read_seconds)]
    autosave: f64,
    /// Takes only every N-th frame
    #[arg(long, default_value_t = 1)]
    every: usize,
    /// Also writes report.html: one page with the maps in 3D and the run's times and memory
    #[arg(long)]
    report: bool,
    /// Records the frames, and the maps as they grow, for viewers such as Foxglove and Rerun
    #[arg(long)]
    mcap: Option<PathBuf>,
    /// Folder for the results
    #[arg(long, default_value = "out/map")]
    out: PathBuf,
}

/// The program `build_map`: maps the recording that the command line names, and writes the maps.
/// `open_detector` opens the network that `--detector` names, if the program is built with a detector.
///
/// # Errors
///
/// The reason why the maps could not be built or written, for the terminal.
pub fn build_map(open_detector: Option<&OpenDetector>) -> Result<(), AnyError> {
    let arguments = Arguments::parse();
    check_inputs_stay(&arguments)?;
    let mut detector = detector_of(&arguments, open_detector)?;
    let corrections = arguments.corrections.as_ref().map(Trajectory::read).transpose()?;
    // The output folder is created first, so that an unwritable one is noticed before the run.
    let (mut builder, mut saver) = make_builder(&arguments, corrections.is_some() || arguments.refine)?;
    let mut source = open_source(&arguments)?;
    if let Some(poses) = &corrections {
        check_corrections(poses, &source)?;
    }
    let world_from_session = arguments.world_from_session.unwrap_or_default();
    let given_poses = (0..source.len()).filter_map(|index| source.pose(index));
    let up_of_images = mean_up(given_poses.map(|pose| world_from_session * pose));
    let is_map = arguments.out.join("manifest.json").exists();
    if !is_map && arguments.mcap.as_ref().is_some_and(|session| lies_in(session, &arguments.out)) {
        // A folder that holds other files becomes no map; but a map may hold other files. One that is there
        // stays until another takes its place.
        saver.save(builder.map())?;
    }
    let interval = Duration::from_secs_f64(arguments.autosave);
    let mut autosave = WatchedAutosave::new(Autosave::start(builder.reader(), saver, interval)?);

    let mut observers = RunObservers {
        report: arguments.report.then(|| RunRecorder::start(&builder, source.len())),
        session: arguments.mcap.as_ref().map(|path| SessionFile::create(path, up_of_images)).transpose()?,
    };
    let detector = detector.as_deref_mut();
    let interrupted = interruption("maps");
    let Insertion { reports, indices, tried, detection } = insert_all(
        &mut builder,
        &mut source,
        detector,
        &world_from_session,
        &mut observers,
        &mut autosave,
        &interrupted,
    );
    if reports.is_empty() {
        return Err("no frame could be mapped".into());
    }
    builder.settle();
    let first = reports[0].id;
    let corrected =
        corrections.map(|poses| correct(&mut builder, &poses, first, &world_from_session, &interrupted));
    let corrected = corrected.transpose()?.flatten();
    let refined = if arguments.refine { Some(refine(&mut builder)?) } else { None };
    if let Some(session) = observers.session
        && let Err(error) = session.finish(builder.map())
    {
        print_warning(&format!("the session file is not complete: {error}"));
    }

    let cloud = builder.map().cloud().point_cloud(Selection::Static);
    let mut report = RunReport::new(source.len(), tried, &reports, &builder);
    (report.corrections, report.refinement) = (corrected, refined);
    report.stages.extend(detection.map(|time| ("detector", time)));
    let up = up_of_planes(builder.map().planes(), builder.map().up().unwrap_or(up_of_images));
    let voxel_size = builder.config().cloud.voxel_size;
    let mut pictures = cloud_pictures(&cloud, up, voxel_size);
    pictures.extend(octree_pictures(builder.map().octree(), up));
    pictures.extend(plane_pictures(builder.map().planes(), up));
    pictures.push(objects_from_above(builder.map().objects(), &cloud, up));
    // The middle of the run is drawn as the camera saw it, from where it was as the maps now have it.
    let middle = reports.len() / 2;
    if let Ok(frame) = source.load(indices[middle]) {
        let given = world_from_session * frame.world_from_camera;
        let pose = mapped_pose(&builder, reports[middle].id).unwrap_or(given);
        let (map, middle) = (builder.map(), frame);
        pictures.push(objects_from_camera(map.objects(), &middle.frame, &pose));
        pictures.push(planes_from_camera(map.planes(), &middle.frame, &pose));
    }

    let trajectory = mapped_trajectory(&builder, &source, first, &indices, &world_from_session)?;
    let page = observers.report.map(|recorder| {
        ReportPage::of(&Run {
            title: &title(&arguments),
            map: builder.map(),
            recorder: &recorder,
            frames: &reports,
            report: &report,
            trajectory: &trajectory,
            up,
        })
    });
    let page = page.transpose()?;
    autosave.saving.finish()?.save_with(builder.map(), |folder| {
        if let Some(page) = &page {
            folder.file("report.html", |out| page.write(out))?;
        }
        for picture in &pictures {
            folder.file(picture.name, |out| picture.encode_png(out))?;
        }
        folder.file("trajectory.txt", |out| trajectory.encode(out))?;
        folder.file("report.json", |out| -> Result<(), AnyError> {
            serde_json::to_writer_pretty(&mut *out, &report)?;
            Ok(writeln!(out)?)
        })
    })?;

    print_summary(&report, &arguments);
    Ok(())
}

/// Refuses corrections none of whose poses concerns a frame, before hours of mapping.
fn check_corrections(poses: &Trajectory, source: &FrameSource) -> Result<(), AnyError> {
    let mut times = (0..source.len()).filter_map(|index| source.timestamp(index));
    if times.any(|time| poses.pose_at(time, LONGEST_GAP).is_ok()) {
        Ok(())
    } else {
        Err("no frame lies within the times of the corrections".into())
    }
}

/// Refuses a session file that is one of the files that are read: writing would empty it before, or while,
/// it is read.
fn check_inputs_stay(arguments: &Arguments) -> Result<(), AnyError> {
    let Some(session) = &arguments.mcap else { return Ok(()) };
    let Arguments { dataset, detections, class_names, trajectory, corrections, config, .. } = arguments;
    let Arguments { detector, detector_names, .. } = arguments;
    let read = [dataset, detections, class_names, trajectory, corrections, config, detector, detector_names];
    match read.into_iter().flatten().find(|path| is_same(path, session)) {
        None => Ok(()),
        Some(path) => Err(format!(
            "--mcap {} would destroy {}, which is read: name another file",
            session.display(),
            path.display()
        )
        .into()),
    }
}

fn detector_of(
    arguments: &Arguments,
    open_detector: Option<&OpenDetector>,
) -> Result<Option<Box<dyn FrameDetector>>, AnyError> {
    match (&arguments.detector, open_detector) {
        (None, _) => Ok(None),
        (Some(network), Some(open)) => open(network, arguments.detector_names.as_deref()).map(Some),
        (Some(_), None) => Err("this build_map has been built without a detector; one that has --detector, and takes \
            all other arguments, is run by cargo run --release --manifest-path examples/detect/Cargo.toml --bin build_map -- ..."
            .into()),
    }
}

/// A short name of the recording.
fn title(arguments: &Arguments) -> String {
    let name = arguments.dataset.as_ref().and_then(|dataset| dataset.file_stem());
    let name = name.map(|name| name.to_string_lossy().into_owned());
    name.or_else(|| arguments.sequence.clone()).unwrap_or_else(|| "synthetic sequence".to_owned())
}

/// A builder of new maps or of the resumed ones, and the saver of its maps.
fn make_builder(arguments: &Arguments, is_corrected: bool) -> Result<(MapBuilder, MapSaver), AnyError> {
    if let Some(folder) = &arguments.resume {
        let options = read_config(arguments, LoadOptions::from_toml)?;
        let (saver, map) = if is_same(folder, &arguments.out) {
            MapSaver::load(folder, &options)?
        } else {
            (MapSaver::create(&arguments.out)?, MultiLevelMap::load_with(folder, &options)?)
        };
        if is_corrected && map.config().history == HistoryConfig::None {
            return Err(format!(
                "{}: the maps have no history, so their poses cannot be corrected",
                folder.display()
            )
            .into());
        }
        return Ok((MapBuilder::resume(map)?, saver));
    }
    let mut config = read_config(arguments, MapConfig::from_toml)?;
    if is_corrected && config.history == HistoryConfig::None {
        config.history = HistoryConfig::Memory;
    }
    Ok((MapBuilder::new(config)?, MapSaver::create(&arguments.out)?))
}

/// Whether a file lies in a folder or in one of its folders; neither need be there yet.
fn lies_in(file: &Path, folder: &Path) -> bool {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let folder = real(folder);
    file.ancestors().skip(1).any(|ancestor| !ancestor.as_os_str().is_empty() && real(ancestor) == folder)
}

/// Whether two paths lead to one file or folder.
fn is_same(one: &Path, other: &Path) -> bool {
    matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
}

fn read_seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number of seconds".to_owned())?;
    if (0.1..=1e6).contains(&seconds) { Ok(seconds) } else { Err("0.1 to 1000000 seconds".to_owned()) }
}

/// What the config file says, if one is named.
fn read_config<T: Default>(
    arguments: &Arguments,
    parse: impl Fn(&str) -> Result<T, ConfigFileError>,
) -> Result<T, AnyError> {
    let Some(path) = &arguments.config else { return Ok(T::default()) };
    let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    parse(&text).map_err(|error| format!("{}: {error}", path.display()).into())
}

fn open_source(arguments: &Arguments) -> Result<FrameSource, AnyError> {
    let mut options = TumOptions::default();
    options.trajectory.clone_from(&arguments.trajectory);
    options.every = arguments.every;
    if let Some(bag) = arguments.dataset.as_ref().filter(|path| path.is_file()) {
        if arguments.detections.is_some() {
            return Err(
                "a bag contains its own detections: --detections is only for folders (--class-names names \
                classes that the bag has as numbers)"
                    .into(),
            );
        }
        return FrameSource::bag(bag, &bag_options(arguments)?);
    }
    if !arguments.topics.is_empty() {
        return Err("--topics is only for bags: the dataset is not a file".into());
    }
    if arguments.class_names.is_some() {
        return Err("--class-names is only for bags: a YOLO folder has its names in names.txt".into());
    }
    if let Some(folder) = arguments.dataset.as_ref().filter(|_| arguments.detector.is_some()) {
        return FrameSource::without_detections(folder, &options);
    }
    if let Some(folder) = &arguments.dataset {
        return FrameSource::recorded(folder, arguments.detections.as_deref(), &options);
    }
    let config = match &arguments.sequence {
        Some(name) => named_sequence(name)?.config,
        None => SequenceConfig::default(),
    };
    FrameSource::synthetic(&every(config, arguments.every))
}

fn bag_options(arguments: &Arguments) -> Result<McapOptions, AnyError> {
    let mut options = McapOptions::default();
    options.trajectory.clone_from(&arguments.trajectory);
    options.every = arguments.every;
    options.without_detections = arguments.detector.is_some();
    if let Some(path) = &arguments.class_names {
        options.class_names = read_class_names(path)?;
    }
    for (what, name) in &arguments.topics {
        let option = match what.as_str() {
            "depth" => &mut options.depth,
            "color" => &mut options.color,
            "depth_info" => &mut options.depth_info,
            "color_info" => &mut options.color_info,
            "detections" => &mut options.detections,
            "odometry" => &mut options.odometry,
            "world" => &mut options.world_frame,
            other => return Err(format!("--topics {other}=: see --help for what can be named").into()),
        };
        *option = Some(name.clone());
    }
    Ok(options)
}

fn read_topic(text: &str) -> Result<(String, String), String> {
    let (what, name) = text.split_once('=').ok_or("not of the form depth=/topic")?;
    Ok((what.to_owned(), name.to_owned()))
}

/// Saving of the maps while they are built, which tells once when it begins to fail.
struct WatchedAutosave {
    saving: Autosave,
    has_failed: bool,
}

impl WatchedAutosave {
    fn new(saving: Autosave) -> Self {
        Self { saving, has_failed: false }
    }

    /// Warns if the last save is the first that has failed.
    fn watch(&mut self, warn: impl Fn(String)) {
        let failure = self.saving.failure();
        if let Some(error) = failure.as_ref().filter(|_| !self.has_failed) {
            warn(format!(
                "the maps could not be saved; another save is tried after the next interval: {error}"
            ));
        }
        self.has_failed = failure.is_some();
    }
}

/// What came of the frames of a recording.
struct Insertion {
    /// The reports of the frames that were taken in.
    reports: Vec<FrameReport>,
    /// Their indices in the recording.
    indices: Vec<usize>,
    /// Number of frames until the end, or until the user interrupted: taken in or skipped.
    tried: usize,
    /// How long the detector took, if there is one.
    detection: Option<Milliseconds>,
}

/// Inserts every frame into the builder until the user interrupts. A frame that cannot be loaded or is
/// refused is skipped with a warning.
fn insert_all(
    builder: &mut MapBuilder,
    source: &mut FrameSource,
    mut detector: Option<&mut (dyn FrameDetector + 'static)>,
    world_from_session: &Pose,
    observers: &mut RunObservers,
    autosave: &mut WatchedAutosave,
    interrupted: &AtomicBool,
) -> Insertion {
    let bar = progress_bar(source.len(), "mapping");
    let warn = |text: String| bar.suspend(|| print_warning(&text));
    source.faults().into_iter().for_each(&warn);
    let (mut reports, mut indices, mut tried) = (Vec::new(), Vec::new(), 0);
    let mut detection_ms = Vec::new();
    for index in 0..source.len() {
        if interrupted.load(Ordering::Relaxed) {
            warn(format!("interrupted after {index} of {} frames", source.len()));
            break;
        }
        match load(source, detector.as_deref_mut(), index, &mut detection_ms) {
            Ok(next) => {
                let pose = *world_from_session * next.world_from_camera;
                match builder.insert(&next.frame, next.detections.as_deref(), &pose) {
                    Ok(mut report) => {
                        if let Err(error) = observers.record(&next, &report, &pose, builder) {
                            warn(format!("recording of the session has stopped: {error}"));
                        }
                        // Of hours of recording: nobody asks for them any more.
                        report.movers = Vec::new();
                        reports.push(report);
                        indices.push(index);
                    }
                    Err(error) => warn(format!("frame {index} skipped: {error}")),
                }
                source.recycle(next);
            }
            Err(error) => warn(format!("frame {index} skipped: {error}")),
        }
        autosave.watch(warn);
        tried += 1;
        bar.inc(1);
    }
    bar.finish();
    Insertion { reports, indices, tried, detection: detector.map(|_| Milliseconds::of(detection_ms)) }
}

/// Loads a frame; the results of a detector, if there is one, replace the recording's own detections.
fn load(
    source: &mut FrameSource,
    detector: Option<&mut (dyn FrameDetector + 'static)>,
    index: usize,
    detection_ms: &mut Vec<f64>,
) -> Result<SourceFrame, AnyError> {
    let mut next = source.load(index)?;
    if let Some(detector) = detector {
        let (found, cost) = timed(|| source.detect(index, &next.frame, detector));
        next.detections = found?;
        detection_ms.push(cost.wall_ms);
    }
    Ok(next)
}

/// Corrects the maps to the poses of a back end; frames without a new pose move with their neighbours. `None`
/// when the user interrupts it: then the maps stay as they were.
fn correct(
    builder: &mut MapBuilder,
    poses: &Trajectory,
    first: FrameId,
    world_from_session: &Pose,
    interrupted: &AtomicBool,
) -> Result<Option<CorrectionCost>, AnyError> {
    let new_pose = |(id, time, _)| Some((id, *world_from_session * poses.pose_at(time, LONGEST_GAP).ok()?));
    let given: Vec<_> = builder.trajectory().filter(|(id, ..)| *id >= first).filter_map(new_pose).collect();
    if given.is_empty() {
        print_warning("no frame that was mapped lies within the times of the corrections");
        return Ok(None);
    }
    let bar = progress_bar(0, "correcting");
    // Who has ended the mapping early still wants what was mapped corrected.
    let was_interrupted = interrupted.load(Ordering::Relaxed);
    let (report, cost) = timed(|| {
        builder.correct_poses_watched(&given, &mut |progress| {
            bar.set_length(progress.total as u64);
            bar.set_position(progress.done as u64);
            was_interrupted || !interrupted.load(Ordering::Relaxed)
        })
    });
    bar.finish();
    match report {
        Err(dymlm::Error::Cancelled) => {
            print_warning(
                "the correction was interrupted: the maps have the poses that they were built with",
            );
            Ok(None)
        }
        report => Ok(Some(CorrectionCost { key_frames: report?.moved_key_frames, ..cost })),
    }
}

fn refine(builder: &mut MapBuilder) -> Result<CorrectionCost, AnyError> {
    let bar = progress_bar(1, "refining");
    let (report, cost) = timed(|| builder.refine_poses(&RefineConfig::default()));
    bar.finish();
    let report = report?;
    let RefinedPoses { planes, views, views_left_out, met_again, parted, unheld, .. } = &report.found;
    println!(
        "refined in {} rounds by {planes} planes: {views_left_out} of {views} views left out, {met_again} pairs met again, \
         {parted} parted, {} motions held by odometry alone",
        report.costs.len(),
        unheld.len()
    );
    Ok(CorrectionCost { key_frames: report.correction.key_frames, ..cost })
}

/// The pose of a frame as it is mapped now, after any correction; `None` without a history, where poses stay
/// as they were given.
fn mapped_pose(builder: &MapBuilder, frame: FrameId) -> Option<Pose> {
    builder.trajectory().find(|(id, ..)| *id == frame).map(|(.., pose)| pose)
}

/// The poses of this session's frames, those at `indices`, as they are mapped.
fn mapped_trajectory(
    builder: &MapBuilder,
    source: &FrameSource,
    first: FrameId,
    indices: &[usize],
    world_from_session: &Pose,
) -> Result<Trajectory, AnyError> {
    let own = builder.trajectory().filter(|(id, ..)| *id >= first);
    let mut poses: Vec<_> = own.map(|(_, time, pose)| (time, pose)).collect();
    if poses.is_empty() {
        // Without a history, these are the given poses of the frames that were taken in.
        let given =
            |&index: &usize| Some((source.timestamp(index)?, *world_from_session * source.pose(index)?));
        poses.extend(indices.iter().filter_map(given));
    }
    let stamped = |(timestamp, world_from_camera)| StampedPose { timestamp, world_from_camera };
    Ok(Trajectory::new(poses.into_iter().map(stamped).collect())?)
}

fn print_summary(report: &RunReport, arguments: &Arguments) {
    println!(
        "{} of {} frames taken in ({} skipped), {} key frames mapped",
        report.frames - report.frames_skipped - report.frames_not_reached,
        report.frames,
        report.frames_skipped,
        report.key_frames
    );
    println!("{:>13}  median    p95    max ms", "step");
    for (name, time) in &report.stages {
        println!("{name:>13}  {:6.2} {:6.2} {:6.2}", time.median_ms, time.p95_ms, time.max_ms);
    }
    let counts = &report.counts;
    println!("cloud: {} points ({} voxels before late removal)", counts.cloud_points, counts.cloud_voxels);
    println!("octree: {} leaves, {} occupied", counts.octree_leaves, counts.octree_occupied_leaves);
    println!("planes: {}", counts.planes);
    println!("objects: {}", counts.objects);
    let megabytes = |bytes: f64| bytes / 1e6;
    let memory = report.memory_bytes;
    let memory =
        [memory.cloud, memory.octree, memory.planes, memory.objects, memory.history + memory.snapshots];
    let [cloud, octree, planes, objects, history] = memory.map(|bytes| megabytes(bytes as f64));
    println!(
        "memory: cloud {cloud:.1}, octree {octree:.1}, planes {planes:.1}, objects {objects:.1}, history {history:.1} MB"
    );
    if let Some(cost) = &report.corrections {
        let CorrectionCost { key_frames, wall_ms, cpu_ms } = cost;
        println!("corrected: {key_frames} key frames moved, {wall_ms:.0} ms, processor {cpu_ms:.0} ms");
    }
    if let Some(cost) = &report.refinement {
        let CorrectionCost { key_frames, wall_ms, cpu_ms } = cost;
        println!("refined: {key_frames} key frames, {wall_ms:.0} ms, processor {cpu_ms:.0} ms");
    }
    if let Some(bytes) = report.peak_memory_bytes {
        println!("peak memory: {:.0} MB", megabytes(bytes as f64));
    }
    println!("written to {}", arguments.out.display());
}
