use crate::Error;

/// What the .yaml file of a map says.
#[derive(Debug, PartialEq)]
pub(super) struct MapDescription {
    /// Path of the image, relative to the folder of the file.
    pub(super) image: String,
    pub(super) resolution: f64,
    /// x, y and yaw of the lower left corner.
    pub(super) origin: [f64; 3],
    pub(super) negate: bool,
    pub(super) occupied_thresh: f64,
    pub(super) free_thresh: f64,
}

impl MapDescription {
    /// Reads the part of YAML that `map_server` and its savers write: keys with a value each, a number, a word in
    /// quotes or without, or a list.
    pub(super) fn read(text: &str) -> Result<Self, Error> {
        let entries = entries(text)?;
        let mode = entries.iter().find(|(key, _)| key == "mode").map_or("trinary", |(_, value)| value);
        if unquoted(mode) != "trinary" {
            return malformed(format!("the mode {mode:?} is not supported, only trinary"));
        }
        let value = |key: &str| {
            let entry = entries.iter().find(|(name, _)| name == key);
            entry.map(|(_, value)| value.as_str()).ok_or_else(|| Error::MapFile(format!("there is no {key}")))
        };
        let number = |key: &str| {
            let text = value(key)?;
            let number = text.parse().ok().filter(|number: &f64| number.is_finite());
            number.ok_or_else(|| Error::MapFile(format!("{key} is {text:?}, which is no number")))
        };
        let read = Self {
            image: unquoted(value("image")?),
            resolution: number("resolution")?,
            origin: origin(value("origin")?)?,
            negate: match value("negate")? {
                "0" | "false" | "False" => false,
                "1" | "true" | "True" => true,
                other => return malformed(format!("negate is {other:?}, not 0 or 1")),
            },
            occupied_thresh: number("occupied_thresh")?,
            free_thresh: number("free_thresh")?,
        };
        if read.image.is_empty() {
            return malformed("image names no file".to_owned());
        }
        if read.resolution <= 0.0 {
            return malformed(format!("resolution is {} m, which is not positive", read.resolution));
        }
        let (low, high) = (read.free_thresh, read.occupied_thresh);
        if !(0.0 <= low && low <= high && high <= 1.0) {
            return malformed(format!(
                "0 <= free_thresh <= occupied_thresh <= 1 does not hold for {low} and {high}"
            ));
        }
        Ok(read)
    }
}

fn malformed<T>(what: String) -> Result<T, Error> {
    Err(Error::MapFile(what))
}

/// Keys and values; the items of a list below its key become a list in brackets.
fn entries(text: &str) -> Result<Vec<(String, String)>, Error> {
    let mut entries: Vec<(String, String)> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = without_comment(line).trim();
        if line.is_empty() || line == "---" || line == "..." || line.starts_with('%') {
            continue;
        }
        if let (Some(item), Some((_, value))) = (line.strip_prefix("- "), entries.last_mut()) {
            let before = value.strip_prefix('[').and_then(|list| list.strip_suffix(']'));
            *value = match before {
                Some(before) => format!("[{before}, {}]", item.trim()),
                None if value.is_empty() => format!("[{}]", item.trim()),
                None => return malformed(format!("line {} is an item of no list", index + 1)),
            };
            continue;
        }
        let Some((key, value)) = line.split_once(':') else {
            return malformed(format!("line {} is no key with a value: {line:?}", index + 1));
        };
        let (key, value) = (unquoted(key.trim()), value.trim().to_owned());
        if entries.iter().any(|(other, _)| *other == key) {
            return malformed(format!("there are two {key}"));
        }
        entries.push((key, value));
    }
    Ok(entries)
}

/// A line up to a # that begins it or follows a white space outside quotes. An apostrophe within a word opens no
/// quotes, but one behind another does: two of them in single quotes are one.
fn without_comment(line: &str) -> &str {
    let (mut quote, mut before) = (None, ' ');
    for (at, c) in line.char_indices() {
        match quote {
            Some('"') if before == '\\' => {}
            Some(open) if c == open => quote = None,
            None if c == '#' && before.is_whitespace() => return &line[..at],
            None if c == '"' || c == '\'' => {
                let opens = before.is_whitespace() || ":[,'".contains(before);
                quote = opens.then_some(c);
            }
            _ => {}
        }
        // A backslash behind a backslash is a character like others.
        before = if before == '\\' && c == '\\' { ' ' } else { c };
    }
    line
}

/// A word without its quotes.
fn unquoted(word: &str) -> String {
    let within = |quote: char| word.strip_prefix(quote)?.strip_suffix(quote);
    if let Some(word) = within('"') {
        let mut plain = String::new();
        let mut characters = word.chars();
        while let Some(c) = characters.next() {
            plain.extend(if c == '\\' { characters.next() } else { Some(c) });
        }
        plain
    } else if let Some(word) = within('\'') {
        word.replace("''", "'")
    } else {
        word.to_owned()
    }
}

fn origin(text: &str) -> Result<[f64; 3], Error> {
    let list = text.strip_prefix('[').and_then(|list| list.strip_suffix(']'));
    let numbers = list.unwrap_or_default().split(',').map(|item| item.trim().parse::<f64>());
    match numbers.collect::<Result<Vec<f64>, _>>().as_deref() {
        Ok(&[x, y, yaw]) if [x, y, yaw].iter().all(|number| number.is_finite()) => Ok([x, y, yaw]),
        _ => malformed(format!("origin is {text:?}, not a list of x, y and yaw")),
    }
}
