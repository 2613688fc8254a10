use mcap::records::op;

/// The body of an MCAP record: little-endian numbers; strings and lists after their lengths in bytes.
#[derive(Debug, Default)]
pub(super) struct RecordBody(Vec<u8>);

impl RecordBody {
    pub(super) fn u8(mut self, value: u8) -> Self {
        self.0.push(value);
        self
    }

    pub(super) fn u16(self, value: u16) -> Self {
        self.raw(&value.to_le_bytes())
    }

    pub(super) fn u32(self, value: u32) -> Self {
        self.raw(&value.to_le_bytes())
    }

    pub(super) fn u64(self, value: u64) -> Self {
        self.raw(&value.to_le_bytes())
    }

    pub(super) fn text(self, text: &str) -> Self {
        self.list(text.as_bytes())
    }

    /// Appends bytes after their length.
    pub(super) fn list(self, bytes: &[u8]) -> Self {
        self.u32(bytes.len() as u32).raw(bytes)
    }

    /// Appends pairs of a channel and a number, after their length in bytes.
    pub(super) fn channels(self, numbers: impl ExactSizeIterator<Item = (u16, u64)>) -> Self {
        let length = 10 * numbers.len() as u32;
        numbers.fold(self.u32(length), |body, (channel, number)| body.u16(channel).u64(number))
    }

    pub(super) fn raw(mut self, bytes: &[u8]) -> Self {
        self.0.extend_from_slice(bytes);
        self
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.0
    }
}

/// The bytes before a record's body: opcode and length.
pub(super) fn prefix(opcode: u8, length: usize) -> [u8; 9] {
    let [a, b, c, d, e, f, g, h] = (length as u64).to_le_bytes();
    [opcode, a, b, c, d, e, f, g, h]
}

/// A schema record: a message type.
pub(super) fn schema(id: u16, name: &str, text: &str) -> RecordBody {
    RecordBody::default().u16(id).text(name).text("ros2msg").list(text.as_bytes())
}

/// A channel record: a topic with its schema.
pub(super) fn channel(id: u16, schema: u16, topic: &str) -> RecordBody {
    RecordBody::default().u16(id).u16(schema).text(topic).text("cdr").u32(0)
}

/// A summary offset record: opcode, start and length of a group of records in the summary.
pub(super) fn summary_offset(opcode: u8, start: u64, length: u64) -> RecordBody {
    RecordBody::default().u8(opcode).u64(start).u64(length)
}

/// The opcodes of a summary's records, in their order in the file.
pub(super) const SUMMARY: [u8; 4] = [op::SCHEMA, op::CHANNEL, op::STATISTICS, op::CHUNK_INDEX];
