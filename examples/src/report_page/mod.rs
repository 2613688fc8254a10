//! One HTML file with the maps of a run in 3D, what is in them, and what building them took. It asks nothing
//! of a network: what shows it is in `examples/report_page`, bundled into one script.

mod floor_and_ceiling;
mod lattice_places;
mod layers;
mod moved_objects;
mod page;
mod page_data;
mod point_thinning;
mod run_recorder;
mod run_series;
mod section;
mod template;
mod thing_history;
mod things;

pub use page::ReportPage;
pub use page_data::Run;
pub use run_recorder::RunRecorder;
