//! Decompression of LZF, the compression of `binary_compressed` PCD files (liblzf by M. Lehmann).
//!
//! The stream is a series of runs. A control byte c below 32 is followed by c + 1 literal bytes. In any
//! other, the upper three bits n mean n + 2 bytes of earlier output (n = 7: add the next byte); the lower
//! five bits and the byte after them mean how many bytes back these begin, less one.
//!
//! Own code, because the crates for it are unmaintained, use `unsafe` and trust the size that a file claims.

/// What is wrong with a compressed stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum LzfError {
    #[error("the compressed data break off within a run")]
    Truncated,
    #[error("the compressed data repeat what lies before their beginning")]
    BadReference,
    #[error("the compressed data are for more than {0} bytes")]
    TooLong(usize),
    #[error("the compressed data are for {actual} bytes instead of {expected}")]
    TooShort { expected: usize, actual: usize },
}

const LONGEST_LITERALS: usize = 32;

/// Decompresses exactly `expected` bytes. Memory grows with the actual input, not with the claimed size.
pub(super) fn decompress(mut input: &[u8], expected: usize) -> Result<Vec<u8>, LzfError> {
    // Three bytes of input make at most 264 bytes of output.
    let mut out: Vec<u8> = Vec::with_capacity(expected.min(input.len().saturating_mul(88)));
    while let Some((&control, rest)) = input.split_first() {
        input = rest;
        if usize::from(control) < LONGEST_LITERALS {
            let (literals, rest) =
                input.split_at_checked(usize::from(control) + 1).ok_or(LzfError::Truncated)?;
            check_room(&out, literals.len(), expected)?;
            out.extend_from_slice(literals);
            input = rest;
        } else {
            let mut length = usize::from(control >> 5) + 2;
            if length == 9 {
                let (&more, rest) = input.split_first().ok_or(LzfError::Truncated)?;
                length += usize::from(more);
                input = rest;
            }
            let (&low, rest) = input.split_first().ok_or(LzfError::Truncated)?;
            input = rest;
            let back = (usize::from(control & 0x1f) << 8 | usize::from(low)) + 1;
            check_room(&out, length, expected)?;
            repeat(&mut out, back, length)?;
        }
    }
    if out.len() == expected { Ok(out) } else { Err(LzfError::TooShort { expected, actual: out.len() }) }
}

fn check_room(out: &[u8], more: usize, expected: usize) -> Result<(), LzfError> {
    if more <= expected - out.len() { Ok(()) } else { Err(LzfError::TooLong(expected)) }
}

/// Appends `length` bytes of the output from `back` bytes before its end; they may overlap the appended ones.
fn repeat(out: &mut Vec<u8>, back: usize, mut length: usize) -> Result<(), LzfError> {
    let start = out.len().checked_sub(back).ok_or(LzfError::BadReference)?;
    while length > 0 {
        // As much of the pattern as there is: it doubles each time.
        let piece = length.min(out.len() - start);
        out.extend_from_within(start..start + piece);
        length -= piece;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn decodes_runs_of_each_kind() {
        // Three literals; 57 = 0x30 + 9 bytes, repeated from 3 = 2 + 1 bytes back; three literals.
        let stream = b"\x02abc\xe0\x30\x02\x02xyz";
        let expected = [b"abc".repeat(20), b"xyz".to_vec()].concat();
        assert_eq!(decompress(stream, expected.len()), Ok(expected));
    }

    #[test]
    fn refuses_bad_streams() {
        assert_eq!(decompress(b"\x05ab", 6), Err(LzfError::Truncated));
        assert_eq!(decompress(b"\xe0", 600), Err(LzfError::Truncated));
        assert_eq!(decompress(b"\xe0\x01", 600), Err(LzfError::Truncated));
        assert_eq!(decompress(b"\x20\x00", 3), Err(LzfError::BadReference));
        assert_eq!(decompress(b"\x02abc", 2), Err(LzfError::TooLong(2)));
        assert_eq!(decompress(b"\x00a\xe0\xff\x00", 10), Err(LzfError::TooLong(10)));
        assert_eq!(decompress(b"\x02abc", 1 << 40), Err(LzfError::TooShort { expected: 1 << 40, actual: 3 }));
        assert_eq!(decompress(b"", 0), Ok(Vec::new()));
    }

    proptest! {
        #[test]
        fn never_panics(stream in prop::collection::vec(any::<u8>(), 0..300), expected in 0..100_000_usize) {
            if let Ok(out) = decompress(&stream, expected) {
                prop_assert_eq!(out.len(), expected);
            }
        }
    }
}
