use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;

use miniz_oxide::deflate::compress_to_vec;
use miniz_oxide::inflate::decompress_to_vec_with_limit;

use super::index::Part;

/// Compression level of deflate. Numbers of one kind hardly repeat, so the next level takes four times as
/// long for half a percent less.
const LEVEL: u8 = 1;

/// The first bytes of a part decide whether it is deflated: deflating these `SAMPLE` bytes must save at least
/// one byte in `LEAST_SAVED`.
const SAMPLE: usize = 4096;
const LEAST_SAVED: usize = 16;

/// A segment that is being written.
#[derive(Debug)]
pub(super) struct SegmentWriter {
    number: u32,
    file: BufWriter<File>,
    end: u64,
}

impl SegmentWriter {
    pub(super) fn create(path: &Path, number: u32) -> io::Result<Self> {
        Ok(Self { number, file: BufWriter::with_capacity(1 << 16, File::create_new(path)?), end: 0 })
    }

    pub(super) fn number(&self) -> u32 {
        self.number
    }

    /// Bytes written so far.
    pub(super) fn end(&self) -> u64 {
        self.end
    }

    /// Writes a part as it is.
    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<Part> {
        self.write_packed(bytes, bytes.len())
    }

    /// Writes a part, deflated where that makes it smaller.
    pub(super) fn deflate(&mut self, bytes: &[u8]) -> io::Result<Part> {
        let sample = bytes.get(..SAMPLE).unwrap_or_default();
        // Most of a state is compressed already, such as images, and is not worth deflating again.
        let is_packed = compress_to_vec(sample, LEVEL).len() + sample.len() / LEAST_SAVED > sample.len();
        let is_tried = sample.is_empty() || !is_packed;
        let deflated = if is_tried { compress_to_vec(bytes, LEVEL) } else { Vec::new() };
        let packed = if is_tried && deflated.len() < bytes.len() { &deflated } else { bytes };
        self.write_packed(packed, bytes.len())
    }

    /// Writes a part of this many bytes as these, which are fewer when it is deflated.
    fn write_packed(&mut self, packed: &[u8], bytes: usize) -> io::Result<Part> {
        let (offset, crc32) = (self.append(packed)?, crc32fast::hash(packed));
        let (packed, bytes) = (packed.len() as u64, bytes as u64);
        Ok(Part { segment: self.number, offset, packed, bytes, crc32 })
    }

    /// Writes a part with the packed bytes that it had in another segment.
    pub(super) fn copy(&mut self, part: &Part, packed: &[u8]) -> io::Result<Part> {
        Ok(Part { segment: self.number, offset: self.append(packed)?, ..*part })
    }

    fn append(&mut self, packed: &[u8]) -> io::Result<u64> {
        let offset = self.end;
        self.file.write_all(packed)?;
        self.end += packed.len() as u64;
        Ok(offset)
    }

    /// Flushes the file to the disk; returns its size.
    pub(super) fn finish(self) -> io::Result<u64> {
        self.file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
        Ok(self.end)
    }
}

/// A segment that is read.
#[derive(Debug)]
pub(super) struct SegmentReader {
    file: BufReader<File>,
    bytes: u64,
    /// Where the next bytes are read, if that is known: parts mostly follow each other, with gaps where parts
    /// have been replaced.
    at: Option<u64>,
}

impl SegmentReader {
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let file = File::open(path)?;
        let bytes = file.metadata()?.len();
        Ok(Self { bytes, file: BufReader::with_capacity(1 << 16, file), at: Some(0) })
    }

    /// A part's bytes as stored in the file; `InvalidData` when the checksum differs.
    pub(super) fn packed(&mut self, part: &Part) -> io::Result<Vec<u8>> {
        // A damaged index may claim any length: memory is allocated only for bytes that the file has.
        if part.offset.checked_add(part.packed).is_none_or(|end| self.bytes < end) {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let mut packed = vec![0; part.packed as usize];
        // Nowhere, if reading fails, so that the next part is looked for.
        match self.at.take() {
            // What is in the buffer stays there.
            Some(at) => self.file.seek_relative(part.offset.wrapping_sub(at).cast_signed())?,
            None => drop(self.file.seek(SeekFrom::Start(part.offset))?),
        }
        self.file.read_exact(&mut packed)?;
        self.at = Some(part.offset + part.packed);
        if crc32fast::hash(&packed) == part.crc32 { Ok(packed) } else { Err(invalid("another checksum")) }
    }

    /// A part's bytes, inflated.
    pub(super) fn read(&mut self, part: &Part) -> io::Result<Vec<u8>> {
        let packed = self.packed(part)?;
        if part.packed == part.bytes {
            return Ok(packed);
        }
        let bytes = decompress_to_vec_with_limit(&packed, part.bytes as usize)
            .map_err(|error| invalid(&format!("it cannot be inflated: {error}")))?;
        if bytes.len() as u64 == part.bytes { Ok(bytes) } else { Err(invalid("another length")) }
    }
}

fn invalid(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}
