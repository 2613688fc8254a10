use std::io::Read;

use mcap::records::ChunkHeader;

/// Largest chunk, packed or unpacked, bytes. Writers make chunks of some megabytes, but a damaged length can
/// ask for any amount of memory.
pub(super) const MAX_CHUNK: u64 = 1 << 30;

/// Unpacks a chunk and checks its size and checksum.
pub(super) fn unpack(header: &ChunkHeader, packed: &[u8]) -> Result<Vec<u8>, String> {
    let size = header.uncompressed_size;
    if size > MAX_CHUNK {
        return Err(format!("a chunk of {size} bytes; at most {MAX_CHUNK} are read"));
    }
    let failed = |error: &dyn std::fmt::Display| format!("a {} chunk: {error}", header.compression);
    let mut unpacked = Vec::new();
    // At most the header's size is unpacked, and no memory is allocated before the data for it has been read.
    match header.compression.as_str() {
        "" => unpacked.extend_from_slice(packed),
        "zstd" => {
            let decoder = ruzstd::decoding::StreamingDecoder::new(packed).map_err(|error| failed(&error))?;
            decoder.take(size).read_to_end(&mut unpacked).map_err(|error| failed(&error))?;
        }
        "lz4" => {
            let decoder = lz4_flex::frame::FrameDecoder::new(packed);
            decoder.take(size).read_to_end(&mut unpacked).map_err(|error| failed(&error))?;
        }
        other => return Err(format!("chunks are packed by {other:?}; zstd, lz4 and none are read")),
    }
    if unpacked.len() as u64 != size {
        return Err(format!("a chunk of {} bytes instead of {size}", unpacked.len()));
    }
    let crc = crc32fast::hash(&unpacked);
    if header.uncompressed_crc != 0 && header.uncompressed_crc != crc {
        return Err(format!("a chunk with CRC-32 {crc:08x} instead of {:08x}", header.uncompressed_crc));
    }
    Ok(unpacked)
}
