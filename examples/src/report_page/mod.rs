//! One HTML file with the maps of a run in 3D, their contents, and the cost of building them. It needs no
//! network: its script is bundled from `examples/report_page`.

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
