use std::io::{BufRead, Read, Write};

use crate::Error;

/// Longest header that is read: comments may be long, a file without a header may be endless.
const MAX_BYTES: u64 = 1 << 16;

/// The text in front of the nodes: a first line that names the format, comments, and one keyword a line.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    pub(super) id: String,
    /// Nodes of the tree.
    pub(super) size: u64,
    /// Side of the smallest cell, metres.
    pub(super) resolution: f64,
}

impl Header {
    /// Reads a header to the end of its line `data`.
    pub(super) fn read(reader: &mut impl BufRead, first_line: &str) -> Result<Self, Error> {
        let mut reader = reader.take(MAX_BYTES);
        let line = next_line(&mut reader)?;
        if !line.starts_with(first_line) {
            return Err(Error::Malformed(format!("its first line is not {first_line:?}")));
        }
        let (mut id, mut size, mut resolution) = (None, None, None);
        loop {
            let line = next_line(&mut reader)?;
            let mut words = line.split_ascii_whitespace();
            // OctoMap reads words rather than lines: several keywords may share a line.
            while let Some(word) = words.next() {
                match word {
                    "data" => return Self::new(id, size, resolution),
                    "id" => id = words.next().map(str::to_owned),
                    "size" => size = words.next().and_then(|value| value.parse().ok()),
                    "res" => resolution = words.next().and_then(|value| value.parse().ok()),
                    // A comment, or a keyword of another version: the line is passed over.
                    _ => break,
                }
            }
        }
    }

    fn new(id: Option<String>, size: Option<u64>, resolution: Option<f64>) -> Result<Self, Error> {
        let missing = |what: &str| Error::Malformed(format!("its header has no valid {what}"));
        let id = id.ok_or_else(|| missing("id"))?;
        if id != "OcTree" && id != "ColorOcTree" {
            return Err(Error::UnsupportedTree(id));
        }
        let size = size.ok_or_else(|| missing("size"))?;
        let resolution = resolution.ok_or_else(|| missing("res"))?;
        Ok(Self { id, size, resolution })
    }

    pub(super) fn write(&self, writer: &mut impl Write, first_line: &str) -> Result<(), Error> {
        let Self { id, size, resolution } = self;
        write!(
            writer,
            "{first_line}\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n\
             id {id}\nsize {size}\nres {resolution}\ndata\n"
        )?;
        Ok(())
    }
}

/// One line, without its end.
fn next_line(reader: &mut impl BufRead) -> Result<String, Error> {
    let mut line = Vec::new();
    reader.read_until(b'\n', &mut line)?;
    if line.pop() != Some(b'\n') {
        return Err(Error::Malformed("its header ends without the line \"data\"".to_owned()));
    }
    // Comments may be in any encoding.
    Ok(String::from_utf8_lossy(&line).into_owned())
}
