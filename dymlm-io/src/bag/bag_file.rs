use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Record, op};

use super::chunk::{MAX_CHUNK, unpack};
use crate::Error;

/// Bytes of unpacked chunks that are kept: one frame's colour, depth and detections may lie in several
/// chunks.
const KEPT: usize = 64 << 20;
/// Bytes before a record's content: its opcode and its length.
const PREFIX: u64 = 9;

/// An MCAP file. Records are read one by one, and only a few unpacked chunks are held in memory.
#[derive(Debug)]
pub(super) struct BagFile {
    path: PathBuf,
    file: File,
    length: u64,
    /// Unpacked chunks with their stretches of the file; the most recently used is at the end.
    chunks: VecDeque<(Stretch, Vec<u8>)>,
    message: Vec<u8>,
}

/// A range of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stretch {
    start: u64,
    length: u64,
}

/// Where the body of a message lies: in the file, or in an unpacked chunk of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    chunk: Option<Stretch>,
    body: Stretch,
}

/// What a reader of the whole bag is told: a channel or a message.
pub(super) enum BagEvent<'a> {
    Channel { id: u16, topic: &'a str, schema: &'a str, schema_text: &'a [u8], encoding: &'a str },
    Message { header: MessageHeader, data: &'a [u8], place: Place },
}

impl BagFile {
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let mut file = File::open(path).map_err(Error::io(path))?;
        let length = file.metadata().map_err(Error::io(path))?.len();
        let mut magic = Vec::new();
        let mut start = Read::by_ref(&mut file).take(mcap::MAGIC.len() as u64);
        start.read_to_end(&mut magic).map_err(Error::io(path))?;
        if magic != mcap::MAGIC {
            return Err(Error::malformed(path, "no MCAP file: it does not begin with MCAP's magic bytes"));
        }
        Ok(Self { path: path.to_path_buf(), file, length, chunks: VecDeque::new(), message: Vec::new() })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Reads the whole data section. Damaged records are reported to `fault`; a truncated file ends the
    /// reading.
    pub(super) fn read_through(
        &mut self,
        on_event: &mut dyn FnMut(BagEvent<'_>),
        fault: &mut dyn FnMut(String),
    ) -> Result<(), Error> {
        let mut schemas = Schemas::default();
        let mut at = mcap::MAGIC.len() as u64;
        let mut body = Vec::new();
        loop {
            let Some((opcode, length)) = self.record_at(at)? else {
                fault(format!("breaks off after {at} bytes: everything before is read"));
                return Ok(());
            };
            let place = Stretch { start: at + PREFIX, length };
            let end = place.start.checked_add(length).filter(|&end| end <= self.length);
            let Some(end) = end else {
                fault(format!("breaks off in a record at byte {at}: everything before is read"));
                return Ok(());
            };
            match opcode {
                op::DATA_END | op::FOOTER => return Ok(()),
                op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK => {
                    let outcome = match self.read_stretch(place, &mut body) {
                        Ok(()) => schemas.enter_record(opcode, &body, place, on_event),
                        Err(error @ Error::Io { .. }) => return Err(error),
                        Err(error) => Err(error.to_string()),
                    };
                    if let Err(reason) = outcome {
                        fault(format!("record at byte {at}: {reason}"));
                    }
                }
                _ => {}
            }
            at = end;
        }
    }

    /// The body of a message, without its header.
    pub(super) fn message(&mut self, place: Place) -> Result<&[u8], Error> {
        let body = match place.chunk {
            None => {
                let mut message = std::mem::take(&mut self.message);
                let read = self.read_stretch(place.body, &mut message);
                self.message = message;
                read?;
                self.message.as_slice()
            }
            Some(chunk) => {
                self.keep(chunk)?;
                let kept = self.chunks.back().map_or(&[][..], |(_, kept)| kept);
                let start = place.body.start as usize;
                kept.get(start..start + place.body.length as usize).unwrap_or_default()
            }
        };
        match mcap::parse_record(op::MESSAGE, body) {
            Ok(Record::Message { .. }) => Ok(body.get(MESSAGE_HEADER..).unwrap_or_default()),
            _ => Err(Error::malformed(&self.path, "the file changed while it was being read")),
        }
    }

    /// Unpacks a chunk unless it is already kept, and moves it to the end of `chunks`.
    fn keep(&mut self, chunk: Stretch) -> Result<(), Error> {
        if let Some(index) = self.chunks.iter().position(|(place, _)| *place == chunk) {
            if let Some(kept) = self.chunks.remove(index) {
                self.chunks.push_back(kept);
            }
            return Ok(());
        }
        let mut body = Vec::new();
        self.read_stretch(chunk, &mut body)?;
        let unpacked = chunk_of(&body).map_err(|reason| Error::malformed(&self.path, reason))?;
        while !self.chunks.is_empty()
            && self.chunks.iter().map(|(_, kept)| kept.len()).sum::<usize>() + unpacked.len() > KEPT
        {
            self.chunks.pop_front();
        }
        self.chunks.push_back((chunk, unpacked));
        Ok(())
    }

    /// Opcode and length of the record at byte `at`; `None` where the file ends.
    fn record_at(&mut self, at: u64) -> Result<Option<(u8, u64)>, Error> {
        if at.checked_add(PREFIX).is_none_or(|end| end > self.length) {
            return Ok(None);
        }
        let mut prefix = [0; PREFIX as usize];
        let read = self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.read_exact(&mut prefix));
        read.map_err(Error::io(&self.path))?;
        let [opcode, length @ ..] = prefix;
        Ok(Some((opcode, u64::from_le_bytes(length))))
    }

    fn read_stretch(&mut self, stretch: Stretch, body: &mut Vec<u8>) -> Result<(), Error> {
        body.clear();
        if stretch.length > MAX_CHUNK {
            let reason = format!("a record of {} bytes; at most {MAX_CHUNK} are read", stretch.length);
            return Err(Error::malformed(&self.path, reason));
        }
        self.file.seek(SeekFrom::Start(stretch.start)).map_err(Error::io(&self.path))?;
        let mut part = Read::by_ref(&mut self.file).take(stretch.length);
        part.read_to_end(body).map_err(Error::io(&self.path))?;
        Ok(())
    }
}

/// Bytes of a message's header: channel, sequence number, two times.
const MESSAGE_HEADER: usize = 2 + 4 + 8 + 8;

fn chunk_of(body: &[u8]) -> Result<Vec<u8>, String> {
    match mcap::parse_record(op::CHUNK, body) {
        Ok(Record::Chunk { header, data }) => unpack(&header, &data),
        Ok(_) => Err("not a chunk".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

/// A bag's schemas, name and text, by id.
#[derive(Default)]
struct Schemas {
    by_id: BTreeMap<u16, (String, Vec<u8>)>,
}

impl Schemas {
    /// Enters one record of the file; a chunk is unpacked and its records are entered.
    fn enter_record(
        &mut self,
        opcode: u8,
        body: &[u8],
        place: Stretch,
        on_event: &mut dyn FnMut(BagEvent<'_>),
    ) -> Result<(), String> {
        if opcode != op::CHUNK {
            return self.enter(opcode, body, Place { chunk: None, body: place }, on_event);
        }
        let unpacked = chunk_of(body)?;
        let mut rest = unpacked.as_slice();
        // One bad record takes none of the others with it.
        let mut entered = Ok(());
        while let Some((&[opcode, ref length @ ..], after)) = rest.split_first_chunk::<{ PREFIX as usize }>()
        {
            let length = u64::from_le_bytes(*length);
            let inside = usize::try_from(length).ok().and_then(|length| after.split_at_checked(length));
            let Some((record, next)) = inside else {
                return Err("a chunk ends in the middle of a record".to_owned());
            };
            let start = (unpacked.len() - after.len()) as u64;
            let inside = Place { chunk: Some(place), body: Stretch { start, length } };
            entered = entered.and(self.enter(opcode, record, inside, on_event));
            rest = next;
        }
        entered
    }
    fn enter(
        &mut self,
        opcode: u8,
        body: &[u8],
        place: Place,
        on_event: &mut dyn FnMut(BagEvent<'_>),
    ) -> Result<(), String> {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return Ok(());
        }
        match mcap::parse_record(opcode, body).map_err(|error| error.to_string())? {
            Record::Schema { header, data } => {
                self.by_id.insert(header.id, (header.name, data.into_owned()));
            }
            Record::Channel(channel) => {
                let (schema, text) =
                    self.by_id.get(&channel.schema_id).map_or(("", &[][..]), |(name, text)| (name, text));
                on_event(BagEvent::Channel {
                    id: channel.id,
                    topic: &channel.topic,
                    schema,
                    schema_text: text,
                    encoding: &channel.message_encoding,
                });
            }
            Record::Message { header, data } => on_event(BagEvent::Message { header, data: &data, place }),
            _ => {}
        }
        Ok(())
    }
}
