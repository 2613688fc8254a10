//! A tree of boxes around points, whose searches stay short for any cloud: [`BoxTree`].

mod counting;
mod least_label;
mod nearest;
mod pairs;
mod tree;
mod within;

pub(crate) use least_label::LeastLabels;
pub(crate) use nearest::Nearest;
pub(crate) use tree::BoxTree;
