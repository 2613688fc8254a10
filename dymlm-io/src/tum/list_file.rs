use std::fs;
use std::path::{Path, PathBuf};

use crate::Error;
use crate::text_lines::{content_lines, number, quoted};

/// An image named in a list.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ListedFile {
    pub(super) timestamp: f64,
    /// As written in the list: relative to the dataset's folder.
    pub(super) path: PathBuf,
    pub(super) line: usize,
}

/// A line of `associations.txt`, its columns in their order in the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ListedPair {
    pub(super) first: ListedFile,
    pub(super) second: ListedFile,
}

/// The usable lines of a list, and the errors of the others.
#[derive(Debug)]
pub(super) struct List<T> {
    pub(super) entries: Vec<T>,
    pub(super) faults: Vec<Error>,
}

/// Reads `timestamp filename` lines and sorts them by time.
pub(super) fn read_files(path: &Path) -> Result<List<ListedFile>, Error> {
    let mut list = read_list(path, |line, columns| match columns {
        [timestamp, file] => listed(timestamp, file, line),
        _ => Err(format!("{} columns instead of the 2 of timestamp filename", columns.len())),
    })?;
    list.entries.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
    Ok(list)
}

/// Reads `timestamp filename timestamp filename` lines.
pub(super) fn read_pairs(path: &Path) -> Result<List<ListedPair>, Error> {
    read_list(path, |line, columns| match columns {
        [first_time, first, second_time, second] => Ok(ListedPair {
            first: listed(first_time, first, line)?,
            second: listed(second_time, second, line)?,
        }),
        _ => Err(format!(
            "{} columns instead of the 4 of timestamp filename timestamp filename",
            columns.len()
        )),
    })
}

fn read_list<T>(path: &Path, parse: impl Fn(usize, &[&str]) -> Result<T, String>) -> Result<List<T>, Error> {
    let bytes = fs::read(path).map_err(Error::io(path))?;
    let mut list = List { entries: Vec::new(), faults: Vec::new() };
    for (line, content) in content_lines(&bytes) {
        let entry = content.and_then(|content| {
            let columns: Vec<&str> = content.split_ascii_whitespace().collect();
            parse(line, &columns).map_err(|reason| format!("{reason} in {}", quoted(content)))
        });
        match entry {
            Ok(entry) => list.entries.push(entry),
            Err(reason) => list.faults.push(Error::line(path, line, reason)),
        }
    }
    Ok(list)
}

fn listed(timestamp: &str, file: &str, line: usize) -> Result<ListedFile, String> {
    Ok(ListedFile { timestamp: number(timestamp)?, path: file.into(), line })
}
