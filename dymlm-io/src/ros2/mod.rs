//! ROS 2 messages in CDR (feature `mcap`): what bags are read from, and what sessions are written in.

pub(crate) mod map_messages;
pub(crate) mod messages;
pub(crate) mod scene;
pub(crate) mod schema;
