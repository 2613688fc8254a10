use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use dymlm_core::SplitMix64;

use crate::Body;

/// How long a body is run, and with which random numbers.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Total time.
    pub duration: Duration,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl Effort {
    /// Each body runs for `DYMLM_FUZZ_SECONDS`, else a fifth of one, which shows that each takes its examples
    /// and mutations of them; `.ci/nightly` runs them for an hour. The seed is `DYMLM_FUZZ_SEED`, else 1.
    pub fn from_env() -> Self {
        let number = |name: &str| std::env::var(name).ok()?.parse::<u64>().ok();
        Self {
            duration: number("DYMLM_FUZZ_SECONDS").map_or(Duration::from_millis(200), Duration::from_secs),
            seed: number("DYMLM_FUZZ_SEED").unwrap_or(1),
        }
    }
}

/// Longest time for one input: a hang takes minutes, and a busy machine does not turn milliseconds into this.
const LONGEST: Duration = Duration::from_secs(20);

/// Fewest inputs in addition to the examples, however slow the machine is.
const FEWEST: usize = 8;

/// Runs a body on its examples and on random mutations of them. Returns the number of inputs.
///
/// # Panics
///
/// When the body panics or takes too long; the message has the input as a Rust literal.
pub fn run(body: Body, examples: &[Vec<u8>], effort: Effort) -> usize {
    let mut random = SplitMix64::new(effort.seed);
    let mut inputs = 0;
    let start = Instant::now();
    let mut check = |input: &[u8]| {
        let start = Instant::now();
        let outcome = catch_unwind(AssertUnwindSafe(|| body(input)));
        let took = start.elapsed();
        assert!(outcome.is_ok(), "fails on b\"{}\"", input.escape_ascii());
        assert!(took < LONGEST, "takes {took:?} on b\"{}\"", input.escape_ascii());
        inputs += 1;
    };
    for example in examples {
        check(example);
    }
    for mutated in 0.. {
        if mutated >= FEWEST && start.elapsed() >= effort.duration {
            break;
        }
        let mut input = examples.get(random.below(examples.len().max(1))).cloned().unwrap_or_default();
        for _ in 0..=random.below(6) {
            mutate(&mut input, examples, &mut random);
        }
        check(&input);
    }
    inputs
}

/// Words that the readers know, and numbers at their limits.
const WORDS: [&[u8]; 20] = [
    b"nan",
    b"inf",
    b"-1",
    b"0",
    b"1e308",
    b"-1e-320",
    b"18446744073709551615",
    b"4294967295",
    b"99999999999999999999",
    b"\n",
    b" ",
    b"\0",
    b"\xff\xff\xff\xff",
    b"\0\0\0\0\0\0\0\0",
    b"\xff\xff\xff\xff\xff\xff\xff\x7f",
    b"{",
    b"]",
    b"null",
    b"[[[[",
    b"\xef\xbb\xbf",
];

fn mutate(input: &mut Vec<u8>, examples: &[Vec<u8>], random: &mut SplitMix64) {
    const MOST: usize = 1 << 16;
    let at = random.below(input.len() + 1);
    let end = (at + random.below(16)).min(input.len());
    match random.below(9) {
        0 => input.truncate(at),
        1 => drop(input.drain(at..end)),
        2 => {
            let copied = input[at..end].to_vec();
            input.splice(at..at, copied);
        }
        3 => {
            let word = WORDS[random.below(WORDS.len())];
            input.splice(at..end, word.iter().copied());
        }
        4 => {
            if let Some(byte) = input.get_mut(at) {
                *byte ^= 1 << random.below(8);
            }
        }
        5 | 6 => {
            if let Some(byte) = input.get_mut(at) {
                *byte = random.below(256) as u8;
            }
        }
        7 => {
            // Appends the rest of another example.
            if let Some(other) = examples.get(random.below(examples.len().max(1))) {
                let from = random.below(other.len() + 1);
                input.truncate(at);
                input.extend_from_slice(&other[from..]);
            }
        }
        _ => input.extend((0..random.below(32)).map(|_| random.below(256) as u8)),
    }
    input.truncate(MOST);
}
