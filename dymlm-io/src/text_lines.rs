//! Lines and numbers of the text files.

/// The lines of a file that hold something, with their numbers from 1. Blank lines and comments (`#`) are
/// skipped; line ends of any system and a byte order mark are removed. A line that is not UTF-8 is an error
/// of its own.
pub(crate) fn content_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Result<&str, String>)> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    bytes.split(|&byte| byte == b'\n').enumerate().filter_map(|(index, line)| {
        let line = line.trim_ascii();
        let holds_something = !line.is_empty() && !line.starts_with(b"#");
        holds_something.then(|| (index + 1, std::str::from_utf8(line).map_err(|_| "no UTF-8".to_owned())))
    })
}

/// Parses a finite number.
pub(crate) fn number(field: &str) -> Result<f64, String> {
    match field.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("{} is no finite number", quoted(field))),
    }
}

/// A piece of a file as it is quoted in messages: escaped and shortened.
pub(crate) fn quoted(piece: &str) -> String {
    const LONGEST: usize = 60;
    let start: String = piece.chars().take(LONGEST).collect();
    if start.len() < piece.len() { format!("{start:?}...") } else { format!("{start:?}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_lines_and_passes_over_comments() {
        let lines: Vec<_> = content_lines(b"\xef\xbb\xbf# x\r\n\r\n 1 2 \r\n\xff\n#\n3").collect();
        assert_eq!(lines, [(3, Ok("1 2")), (4, Err("no UTF-8".to_owned())), (6, Ok("3"))]);
    }

    #[test]
    fn refuses_what_is_no_finite_number() {
        for field in ["", "nan", "inf", "1e999", "1,5", "0x10"] {
            assert!(number(field).is_err(), "{field}");
        }
        assert_eq!(number("-1e-3"), Ok(-1e-3));
        assert!(quoted(&"x".repeat(1000)).len() < 80);
    }
}
