use std::io::{self, Write};

/// Writes a template with each `{{name}}` replaced by the value of that name. Values are written unchanged; a
/// name without a value stays.
pub(super) fn write_filled(out: &mut dyn Write, template: &str, values: &[(&str, &str)]) -> io::Result<()> {
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        out.write_all(before.as_bytes())?;
        let filled = after.split_once("}}").and_then(|(name, behind)| {
            let (_, value) = values.iter().find(|(known, _)| *known == name)?;
            Some((*value, behind))
        });
        let (value, behind) = filled.unwrap_or(("{{", after));
        out.write_all(value.as_bytes())?;
        rest = behind;
    }
    out.write_all(rest.as_bytes())
}

/// Text escaped for HTML.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// JSON escaped for a `<script>`, so that nothing in it ends the element. `<` occurs only in strings.
pub(super) fn script_json(value: &impl serde::Serialize) -> serde_json::Result<String> {
    Ok(serde_json::to_string(value)?.replace('<', "\\u003c"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(template: &str, values: &[(&str, &str)]) -> String {
        let mut out = Vec::new();
        write_filled(&mut out, template, values).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn names_are_replaced_and_values_are_left_alone() {
        let values = [("a", "{{b}}"), ("b", "2")];
        assert_eq!(filled("<{{a}}|{{b}}|{{c}}>{{", &values), "<{{b}}|2|{{c}}>{{");
        assert_eq!(filled("", &values), "");
    }

    #[test]
    fn labels_cannot_become_markup() {
        let label = "</script><b a=\"&\">";
        assert_eq!(escaped(label), "&lt;/script&gt;&lt;b a=&quot;&amp;&quot;&gt;");
        let json = script_json(&[label]).unwrap();
        assert!(!json.contains('<'));
        assert_eq!(serde_json::from_str::<Vec<String>>(&json).unwrap(), [label]);
    }
}
