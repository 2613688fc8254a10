use std::collections::BTreeMap;
use std::io::{self, Write};

use mcap::records::op;

use super::record::{RecordBody, SUMMARY, channel, prefix, schema, summary_offset};
use crate::ros2::schema::schema_text;

/// Bytes of messages in a chunk. A crash loses at most one chunk; larger chunks compress slightly better.
const CHUNK: usize = 1 << 20;

/// An MCAP file that is being written: <https://mcap.dev/spec>.
///
/// Messages are collected in chunks, which are compressed by lz4 where that makes them smaller. (The crate
/// `mcap` compresses only through C libraries.) Written chunks can be read at any time; the index that finds
/// them quickly follows at the end. Memory holds one chunk, and some hundred bytes for each chunk that was
/// written.
#[derive(Debug)]
pub(super) struct Container<W: Write> {
    out: Counted<W>,
    schemas: BTreeMap<&'static str, u16>,
    channels: BTreeMap<String, Channel>,
    chunk: Chunk,
    chunk_indexes: Vec<Vec<u8>>,
    times: Option<[u64; 2]>,
    messages: u64,
}

#[derive(Debug)]
struct Channel {
    id: u16,
    schema: u16,
    messages: u64,
}

/// The records of a chunk, and for each channel the times of its messages and where they begin in the chunk.
#[derive(Debug, Default)]
struct Chunk {
    records: Vec<u8>,
    messages: BTreeMap<u16, Vec<[u64; 2]>>,
    times: Option<[u64; 2]>,
}

impl<W: Write> Container<W> {
    pub(super) fn new(out: W) -> io::Result<Self> {
        let mut out = Counted { out, at: 0, crc: crc32fast::Hasher::new() };
        out.write_all(mcap::MAGIC)?;
        let library = concat!("dymlm-io ", env!("CARGO_PKG_VERSION"));
        out.record(op::HEADER, RecordBody::default().text("ros2").text(library).bytes())?;
        Ok(Self {
            out,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            chunk: Chunk::default(),
            chunk_indexes: Vec::new(),
            times: None,
            messages: 0,
        })
    }

    /// Adds a message of a type such as `sensor_msgs/Image`, in CDR.
    pub(super) fn message(
        &mut self,
        topic: &str,
        kind: &'static str,
        time: u64,
        data: &[u8],
    ) -> io::Result<()> {
        let (channel, sequence) = self.channel(topic, kind)?;
        let header = RecordBody::default().u16(channel).u32(sequence).u64(time).u64(time);
        let start = self.chunk.records.len() as u64;
        self.chunk.messages.entry(channel).or_default().push([time, start]);
        self.chunk.records.extend_from_slice(&prefix(op::MESSAGE, header.bytes().len() + data.len()));
        self.chunk.records.extend_from_slice(header.bytes());
        self.chunk.records.extend_from_slice(data);
        self.chunk.times = Some(spanned(self.chunk.times, time));
        self.times = Some(spanned(self.times, time));
        self.messages += 1;
        if self.chunk.records.len() >= CHUNK { self.flush() } else { Ok(()) }
    }

    /// The channel of a topic, and the sequence number of its next message. Schema and channel are written
    /// before the first message.
    fn channel(&mut self, topic: &str, kind: &'static str) -> io::Result<(u16, u32)> {
        if let Some(channel) = self.channels.get_mut(topic) {
            channel.messages += 1;
            return Ok((channel.id, (channel.messages - 1) as u32));
        }
        let too_many = || io::Error::other("more than 65535 topics");
        let schema = self.schema(kind)?;
        let id = u16::try_from(self.channels.len() + 1).map_err(|_| too_many())?;
        self.chunk.record(op::CHANNEL, channel(id, schema, topic).bytes());
        self.channels.insert(topic.to_owned(), Channel { id, schema, messages: 1 });
        Ok((id, 0))
    }

    fn schema(&mut self, kind: &'static str) -> io::Result<u16> {
        if let Some(id) = self.schemas.get(kind) {
            return Ok(*id);
        }
        // Ids of schemas begin at 1: 0 means no schema.
        let id = self.schemas.len() as u16 + 1;
        self.chunk.record(op::SCHEMA, schema_record(id, kind)?.bytes());
        self.schemas.insert(kind, id);
        Ok(id)
    }

    /// Writes the chunk so far: all messages up to here can be read from now on.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        let Some(times) = self.chunk.times else { return self.out.flush() };
        let chunk = std::mem::take(&mut self.chunk);
        let (compression, packed) = packed(&chunk.records)?;
        let packed = packed.as_deref().unwrap_or(&chunk.records);
        let start = self.out.at;
        let head = RecordBody::default().u64(times[0]).u64(times[1]).u64(chunk.records.len() as u64);
        let head = head.u32(crc32fast::hash(&chunk.records)).text(compression).u64(packed.len() as u64);
        self.out.write_all(&prefix(op::CHUNK, head.bytes().len() + packed.len()))?;
        self.out.write_all(head.bytes())?;
        self.out.write_all(packed)?;
        let end = self.out.at;

        let offsets = self.message_indexes(&chunk)?;
        let index = RecordBody::default().u64(times[0]).u64(times[1]).u64(start).u64(end - start);
        let index = index.channels(offsets.into_iter()).u64(self.out.at - end).text(compression);
        let index = index.u64(packed.len() as u64).u64(chunk.records.len() as u64);
        self.chunk_indexes.push(index.bytes().to_vec());
        // The next chunk reuses the memory.
        let mut records = chunk.records;
        records.clear();
        records.shrink_to(2 * CHUNK);
        self.chunk.records = records;
        self.out.flush()
    }

    /// Writes the message index of each channel of a chunk; returns where each index begins.
    fn message_indexes(&mut self, chunk: &Chunk) -> io::Result<Vec<(u16, u64)>> {
        let mut offsets = Vec::with_capacity(chunk.messages.len());
        for (&channel, messages) in &chunk.messages {
            offsets.push((channel, self.out.at));
            let head = RecordBody::default().u16(channel).u32(16 * messages.len() as u32);
            let index = messages.iter().fold(head, |body, [time, start]| body.u64(*time).u64(*start));
            self.out.record(op::MESSAGE_INDEX, index.bytes())?;
        }
        Ok(offsets)
    }

    /// Writes the last chunk and the summary, which complete the file.
    pub(super) fn finish(&mut self) -> io::Result<()> {
        self.flush()?;
        let crc = self.out.crc.clone().finalize();
        self.out.record(op::DATA_END, RecordBody::default().u32(crc).bytes())?;

        self.out.crc = crc32fast::Hasher::new();
        let summary_start = self.out.at;
        let mut groups = Vec::new();
        for opcode in SUMMARY {
            let start = self.out.at;
            for record in self.summary(opcode)? {
                self.out.record(opcode, &record)?;
            }
            if self.out.at > start {
                groups.push(summary_offset(opcode, start, self.out.at - start));
            }
        }
        let offsets_start = self.out.at;
        for group in groups {
            self.out.record(op::SUMMARY_OFFSET, group.bytes())?;
        }
        // The checksum covers the footer up to the checksum itself.
        let footer = RecordBody::default().u64(summary_start).u64(offsets_start);
        self.out.write_all(&prefix(op::FOOTER, footer.bytes().len() + size_of::<u32>()))?;
        self.out.write_all(footer.bytes())?;
        let crc = self.out.crc.clone().finalize();
        self.out.write_all(&crc.to_le_bytes())?;
        self.out.write_all(mcap::MAGIC)?;
        self.out.flush()
    }

    /// The records of one kind in the summary.
    fn summary(&self, opcode: u8) -> io::Result<Vec<Vec<u8>>> {
        Ok(match opcode {
            op::SCHEMA => {
                let records = self.schemas.iter().map(|(kind, id)| schema_record(*id, kind));
                records.map(|record| Ok(record?.bytes().to_vec())).collect::<io::Result<_>>()?
            }
            op::CHANNEL => {
                let channels = self.channels.iter();
                channels.map(|(topic, of)| channel(of.id, of.schema, topic).bytes().to_vec()).collect()
            }
            op::STATISTICS => vec![self.statistics().bytes().to_vec()],
            _ => self.chunk_indexes.clone(),
        })
    }

    fn statistics(&self) -> RecordBody {
        let [start, end] = self.times.unwrap_or_default();
        let body = RecordBody::default().u64(self.messages).u16(self.schemas.len() as u16);
        // The two zeros: no attachments, no metadata.
        let body = body.u32(self.channels.len() as u32).u32(0).u32(0).u32(self.chunk_indexes.len() as u32);
        let counts = self.channels.values().map(|channel| (channel.id, channel.messages));
        body.u64(start).u64(end).channels(counts)
    }
}

impl Chunk {
    fn record(&mut self, opcode: u8, body: &[u8]) {
        self.records.extend_from_slice(&prefix(opcode, body.len()));
        self.records.extend_from_slice(body);
    }
}

fn schema_record(id: u16, kind: &str) -> io::Result<RecordBody> {
    let text = schema_text(kind).ok_or_else(|| io::Error::other(format!("no schema of {kind}")))?;
    // In the names of schemas, though not inside definitions, ROS 2 writes the kind of interface: `/msg/`.
    Ok(schema(id, &kind.replacen('/', "/msg/", 1), &text))
}

fn spanned(times: Option<[u64; 2]>, time: u64) -> [u64; 2] {
    times.map_or([time; 2], |[first, last]| [first.min(time), last.max(time)])
}

/// The records compressed by lz4 where that makes them smaller, and the name of the compression.
fn packed(records: &[u8]) -> io::Result<(&'static str, Option<Vec<u8>>)> {
    let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::with_capacity(records.len() / 2));
    encoder.write_all(records)?;
    let packed = encoder.finish().map_err(io::Error::other)?;
    Ok(if packed.len() < records.len() { ("lz4", Some(packed)) } else { ("", None) })
}

/// A stream that counts its bytes and computes their checksum.
#[derive(Debug)]
struct Counted<W: Write> {
    out: W,
    at: u64,
    crc: crc32fast::Hasher,
}

impl<W: Write> Counted<W> {
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.crc.update(bytes);
        self.at += bytes.len() as u64;
        self.out.write_all(bytes)
    }

    fn record(&mut self, opcode: u8, body: &[u8]) -> io::Result<()> {
        self.write_all(&prefix(opcode, body.len()))?;
        self.write_all(body)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
