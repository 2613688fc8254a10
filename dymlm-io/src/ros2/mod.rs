//! ROS 2 messages in CDR (feature `mcap`): bags are read from them, and sessions are written in them.

pub(crate) mod map_messages;
pub(crate) mod messages;
pub(crate) mod scene;
pub(crate) mod schema;
