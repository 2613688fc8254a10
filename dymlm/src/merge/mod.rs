//! Maps of several sessions or robots that become one: see
//! [`MultiLevelMap::merge`](crate::MultiLevelMap::merge).

mod known_beginning;
mod merge_maps;
mod merged_log;
mod new_ids;
#[cfg(test)]
mod random_merges;
mod report;
mod session_union;

pub use report::{MergeReport, MergedSession, NewIds};
