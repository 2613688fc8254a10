use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Message definitions in the form of `ros2msg` schemas: those of ROS 2 Jazzy, `vision_msgs` 4 and
/// `foxglove_msgs` 3, without comments.
const DEFINITIONS: &str = include_str!("definitions.ros2msg");

/// The text between two definitions of a schema.
const SEPARATOR: &str =
    "================================================================================\nMSG: ";

/// The text of a schema: the definition of a message such as `sensor_msgs/Image`, then those of all message
/// types that it contains, each once. `None` when one of them is unknown.
pub(crate) fn schema_text(message: &str) -> Option<String> {
    let mut text = definition(message)?.to_owned();
    let mut listed = BTreeSet::from([message]);
    let mut waiting = messages_in(definition(message)?);
    while let Some(next) = waiting.pop() {
        if listed.insert(next) {
            let body = definition(next)?;
            write!(text, "{SEPARATOR}{next}\n{body}").ok()?;
            waiting.extend(messages_in(body));
        }
    }
    Some(text)
}

fn definition(message: &str) -> Option<&'static str> {
    let mut all = DEFINITIONS.split(SEPARATOR).filter_map(|one| one.split_once('\n'));
    all.find(|(name, _)| *name == message).map(|(_, body)| body)
}

/// The message types among the fields' types, the last field's first.
fn messages_in(body: &'static str) -> Vec<&'static str> {
    let types = body.lines().rev().filter_map(|line| line.split_once(' '));
    let names = types.map(|(kind, _)| kind.split_once('[').map_or(kind, |(element, _)| element));
    names.filter(|name| name.contains('/')).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn a_schema_is_complete_and_lists_each_message_once() {
        let text = schema_text("foxglove_msgs/SceneUpdate").unwrap();
        assert!(text.starts_with("foxglove_msgs/SceneEntityDeletion[] deletions\n"));
        for message in ["foxglove_msgs/Color", "geometry_msgs/Point", "builtin_interfaces/Duration"] {
            assert_eq!(text.matches(&format!("MSG: {message}\n")).count(), 1, "{message}");
        }
        assert_eq!(schema_text("std_msgs/Nonsense"), None);
    }

    #[test]
    fn every_definition_has_all_that_it_needs() {
        let all: Vec<_> = DEFINITIONS.split(SEPARATOR).filter_map(|one| one.split_once('\n')).collect();
        assert!(all.len() > 30);
        for (name, _) in all {
            assert!(schema_text(name).is_some(), "{name}");
        }
    }
}
