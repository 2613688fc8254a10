//! LZF, the compression of `binary_compressed` PCD files (liblzf by M. Lehmann).
//!
//! The stream is a series of runs. A byte below 32 says how many bytes, less one, follow as they are. Any
//! other says in its upper three bits how many bytes, less two, repeat earlier output (7: more, the rest in
//! the next byte), and in its lower five and the byte after how far back, less one, they begin.
//!
//! Own code, because the crates for it are unmaintained, use `unsafe` and believe the size a file claims.

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
const LONGEST_REPEAT: usize = 264;
const SHORTEST_REPEAT: usize = 3;
const FARTHEST: usize = 1 << 13;
const HASH_BITS: u32 = 14;
const NOWHERE: u32 = u32::MAX;

/// Decompresses exactly `expected` bytes. Memory grows with what is there, not with what is claimed.
pub(super) fn decompress(mut input: &[u8], expected: usize) -> Result<Vec<u8>, LzfError> {
    // Three bytes make at most 264.
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

/// Appends `length` bytes that begin `back` bytes before the end; they may run into what they append.
fn repeat(out: &mut Vec<u8>, back: usize, mut length: usize) -> Result<(), LzfError> {
    let start = out.len().checked_sub(back).ok_or(LzfError::BadReference)?;
    while length > 0 {
        // All that is there of the pattern, which doubles each time.
        let piece = length.min(out.len() - start);
        out.extend_from_within(start..start + piece);
        length -= piece;
    }
    Ok(())
}

/// Compresses; data that do not compress grow by a 32nd.
pub(super) fn compress(input: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(input.len() / 2 + 16);
    // The last place at which three bytes with this hash began.
    let mut last = vec![NOWHERE; 1 << HASH_BITS];
    let mut literals_from = 0;
    let mut at = 0;
    while let Some(&[a, b, c]) = input.get(at..at + SHORTEST_REPEAT) {
        let slot = &mut last[hash(a, b, c)];
        let earlier = std::mem::replace(slot, at as u32) as usize;
        let back = at.wrapping_sub(earlier);
        let length = if (1..=FARTHEST).contains(&back) { common_length(input, earlier, at) } else { 0 };
        if length < SHORTEST_REPEAT {
            at += 1;
            continue;
        }
        push_literals(&mut out, &input[literals_from..at]);
        push_repeat(&mut out, back, length);
        at += length;
        literals_from = at;
    }
    push_literals(&mut out, &input[literals_from..]);
    out
}

fn hash(a: u8, b: u8, c: u8) -> usize {
    (u32::from_le_bytes([a, b, c, 0]).wrapping_mul(0x9e37_79b1) >> (32 - HASH_BITS)) as usize
}

/// How many bytes from `earlier` on equal those from `at` on, as far as one run can say.
fn common_length(input: &[u8], earlier: usize, at: usize) -> usize {
    let (before, here) = (input.get(earlier..).unwrap_or_default(), input.get(at..).unwrap_or_default());
    before.iter().zip(here).take(LONGEST_REPEAT).take_while(|(x, y)| x == y).count()
}

fn push_literals(out: &mut Vec<u8>, literals: &[u8]) {
    for run in literals.chunks(LONGEST_LITERALS) {
        out.push(run.len() as u8 - 1);
        out.extend_from_slice(run);
    }
}

fn push_repeat(out: &mut Vec<u8>, back: usize, length: usize) {
    let (high, low) = (((back - 1) >> 8) as u8, (back - 1) as u8);
    if length < 9 {
        out.extend([((length - 2) as u8) << 5 | high, low]);
    } else {
        out.extend([7 << 5 | high, (length - 9) as u8, low]);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn decodes_runs_of_each_kind() {
        // By hand: three literals; 57 = 0x30 + 9 bytes from 3 = 2 + 1 back; three literals.
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

    #[test]
    fn compresses_what_repeats() {
        let input = b"0123456789".repeat(1000);
        let compressed = compress(&input);
        assert!(compressed.len() < 150, "{} bytes", compressed.len());
        assert_eq!(decompress(&compressed, input.len()), Ok(input));
    }

    #[test]
    fn repeats_from_as_far_back_as_can_be_said() {
        // Two copies of bytes that do not repeat, just within reach and just beyond it.
        for distance in [FARTHEST - 1, FARTHEST, FARTHEST + 1] {
            let mut state = 1_u32;
            let mut input: Vec<u8> = Vec::new();
            while input.len() < distance {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                input.push((state >> 24) as u8);
            }
            input.extend_from_within(..1000);
            let compressed = compress(&input);
            assert_eq!(compressed.len() < distance + distance / 32 + 100, distance <= FARTHEST);
            assert_eq!(decompress(&compressed, input.len()), Ok(input));
        }
    }

    proptest! {
        #[test]
        fn gives_back_what_it_took(
            input in prop::collection::vec(prop_oneof![Just(0_u8), 0..4_u8, any::<u8>()], 0..2000),
        ) {
            let compressed = compress(&input);
            prop_assert!(compressed.len() <= input.len() + input.len() / 32 + 1);
            prop_assert_eq!(decompress(&compressed, input.len()), Ok(input));
        }

        #[test]
        fn never_panics(stream in prop::collection::vec(any::<u8>(), 0..300), expected in 0..100_000_usize) {
            if let Ok(out) = decompress(&stream, expected) {
                prop_assert_eq!(out.len(), expected);
            }
        }
    }
}
