//! Code that the examples share: sources of frames, pictures of the maps, reports of a run.

mod build_map;
mod failure;
mod frame_detector;
mod frame_source;
mod interruption;
mod named_sequences;
mod object_pictures;
mod orthographic;
mod people_masks;
mod pictures;
mod pose_argument;
mod progress;
mod report_page;
mod run_observers;
mod run_report;
mod session_file;
mod statistics;

pub use build_map::build_map;
pub use failure::Failure;
pub use frame_detector::{FrameDetector, OpenDetector};
pub use frame_source::{FrameSource, SourceFrame, every};
pub use interruption::{interruption, print_warning};
pub use named_sequences::{NamedSequence, SequenceSet, named_sequence, named_sequences};
pub use object_pictures::{draw_object, objects_from_above, objects_from_camera};
pub use orthographic::Orthographic;
pub use people_masks::PeopleMasks;
use pictures::any_level_direction;
pub use pictures::{
    Picture, cloud_pictures, depth_colors, octree_pictures, plane_pictures, planes_from_camera,
};
pub use pose_argument::read_pose;
pub use progress::progress_bar;
pub use report_page::{ReportPage, Run, RunRecorder};
pub use run_observers::RunObservers;
pub use run_report::{CorrectionCost, RunReport, insertion_time, peak_memory_bytes, step_time, timed};
pub use session_file::SessionFile;
pub use statistics::{Milliseconds, mean_up, up_of_map, up_of_planes};

/// Any error of an example: it is printed and ends the program.
pub type AnyError = Box<dyn std::error::Error + Send + Sync>;
