//! Codes symbols as bits, by how often each occurs in its context: asymmetric numeral systems (Duda:
//! "Asymmetric numeral systems", arXiv:1311.2540, 2013), the range variant with a state of 32 bits.

use bytes::{Buf, BufMut};

/// Symbols are smaller than this.
pub(crate) const SYMBOLS: usize = 64;

/// Bits of a frequency: a finer scale gains nothing, a coarser one makes rare symbols expensive.
const SCALE_BITS: u32 = 10;
const SCALE: usize = 1 << SCALE_BITS;
/// Smallest state between two symbols.
const LEAST_STATE: u32 = 1 << 16;

/// A symbol and the context in which it stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Placed {
    pub(crate) context: u8,
    pub(crate) symbol: u8,
}

/// How often each symbol occurs in a context, out of [`SCALE`].
#[derive(Debug, Clone, PartialEq, Eq)]
struct Frequencies {
    of: [u16; SYMBOLS],
}

/// How a symbol is put: from its frequency, so that no symbol waits for a division.
#[derive(Debug, Clone, Copy, Default)]
struct Coding {
    /// The least number that is more than 2^[`RECIPROCAL_BITS`] / frequency.
    reciprocal: u64,
    frequency: u32,
    /// The sum of the frequencies before it.
    before: u32,
}

/// With so many bits a product with a state fits into 64, and the quotient is exact: before a symbol is put,
/// its state is less than 2^22 * frequency, and a frequency is at most 2^10.
const RECIPROCAL_BITS: u32 = 42;

/// Symbols that are collected and then put. Its buffers are kept from plane to plane.
#[derive(Debug, Default)]
pub(crate) struct Symbols {
    placed: Vec<Placed>,
    /// How often each symbol occurs, by context.
    counts: Vec<[u32; SYMBOLS]>,
    codings: Vec<[Coding; SYMBOLS]>,
    words: Vec<u16>,
}

impl Symbols {
    /// Forgets all symbols; those that follow stand in contexts below `contexts`.
    pub(crate) fn begin(&mut self, contexts: usize) {
        self.placed.clear();
        self.counts.clear();
        self.counts.resize(contexts, [0; SYMBOLS]);
    }

    #[expect(
        clippy::manual_inspect,
        reason = "how many symbols `map` gives is known, so that room is made once"
    )]
    pub(crate) fn extend(&mut self, symbols: impl Iterator<Item = Placed>) {
        let Self { placed, counts, .. } = self;
        placed.extend(symbols.map(|placed| {
            counts[usize::from(placed.context)][usize::from(placed.symbol)] += 1;
            placed
        }));
    }

    /// Appends the symbols to `out`.
    pub(crate) fn put(&mut self, out: &mut Vec<u8>) {
        let Self { placed, counts, codings, words } = self;
        codings.clear();
        for counts in counts {
            let frequencies = Frequencies::of_counts(counts);
            frequencies.put(out);
            codings.push(frequencies.codings());
        }
        let coding_of = |placed: &Placed| &codings[usize::from(placed.context)][usize::from(placed.symbol)];
        words.clear();
        // Backwards, since the decoder takes back first what was put last.
        let state =
            placed.iter().rev().fold(LEAST_STATE, |state, placed| coding_of(placed).put(state, words));
        out.put_u32_le(state);
        out.put_u32_le(words.len() as u32);
        out.extend(words.iter().rev().flat_map(|word| word.to_le_bytes()));
    }
}

impl Coding {
    fn new(frequency: u16, before: u16) -> Self {
        let [frequency, before] = [frequency, before].map(u32::from);
        let reciprocal = (1 << RECIPROCAL_BITS) / u64::from(frequency.max(1)) + 1;
        Self { reciprocal, frequency, before }
    }

    /// The state with the symbol put into it; its lower word goes to `words` where it grows too large.
    #[inline]
    fn put(&self, mut state: u32, words: &mut Vec<u16>) -> u32 {
        if state >> (u32::BITS - SCALE_BITS) >= self.frequency {
            words.push(state as u16);
            state >>= 16;
        }
        let quotient = ((u64::from(state) * self.reciprocal) >> RECIPROCAL_BITS) as u32;
        // quotient * SCALE + remainder + before.
        quotient * (SCALE as u32 - self.frequency) + state + self.before
    }
}

/// Reads symbols that were put, one by one.
#[derive(Debug)]
pub(crate) struct Decoder<'a> {
    /// [`SCALE`] entries for each context: the meaning of the state's place on the scale, in one number,
    /// since decoding a symbol waits for it.
    places: Vec<PackedPlace>,
    words: std::slice::ChunksExact<'a, u8>,
    state: u32,
}

/// A place on the scale: the symbol, its frequency, and how far after the symbol's first place it is.
#[derive(Debug, Clone, Copy)]
struct PackedPlace(u32);

impl<'a> Decoder<'a> {
    /// `None` when the bytes hold no symbols in `contexts` contexts.
    pub(crate) fn take(bytes: &mut &'a [u8], contexts: usize) -> Option<Self> {
        let mut places = Vec::with_capacity(contexts * SCALE);
        for context in 1..=contexts {
            let frequencies = Frequencies::take(bytes)?;
            for (symbol, &frequency) in frequencies.of.iter().enumerate() {
                places.extend((0..frequency).map(|offset| PackedPlace::new(symbol, frequency, offset)));
            }
            // A context that does not occur has no places of its own.
            places.resize(context * SCALE, PackedPlace(0));
        }
        let state = bytes.try_get_u32_le().ok()?;
        let length = bytes.try_get_u32_le().ok()? as usize;
        let (words, rest) = bytes.split_at_checked(length.checked_mul(2)?)?;
        *bytes = rest;
        (state >= LEAST_STATE).then_some(Self { places, words: words.chunks_exact(2), state })
    }

    /// The next symbol, given its context; any symbol when the bytes are damaged.
    #[inline]
    pub(crate) fn next(&mut self, context: u8) -> u8 {
        let place = self.places[usize::from(context) * SCALE + self.state as usize % SCALE];
        self.state = place.frequency() * (self.state >> SCALE_BITS) + place.offset();
        if self.state < LEAST_STATE {
            let word = self.words.next().map_or(0, |mut word| word.get_u16_le());
            self.state = self.state << 16 | u32::from(word);
        }
        place.symbol()
    }

    /// Whether all symbols have been taken, and no others.
    pub(crate) fn is_done(&self) -> bool {
        self.state == LEAST_STATE && self.words.len() == 0
    }
}

impl PackedPlace {
    fn new(symbol: usize, frequency: u16, offset: u16) -> Self {
        Self(u32::from(frequency) << 20 | u32::from(offset) << 8 | symbol as u32)
    }

    #[inline]
    fn frequency(self) -> u32 {
        self.0 >> 20
    }

    #[inline]
    fn offset(self) -> u32 {
        self.0 >> 8 & 0xfff
    }

    #[inline]
    fn symbol(self) -> u8 {
        self.0 as u8
    }
}

impl Frequencies {
    /// All frequencies are 0 in a context that does not occur.
    fn of_counts(counts: &[u32; SYMBOLS]) -> Self {
        let total: u64 = counts.iter().map(|&count| u64::from(count)).sum();
        let mut of = [0; SYMBOLS];
        if total > 0 {
            let share = |count: u32| (u64::from(count) * SCALE as u64 / total).max(u64::from(count > 0));
            of = counts.map(|count| share(count) as u16);
            // The most frequent symbol takes what rounding has added or left over: there it matters least.
            loop {
                let sum: usize = of.iter().copied().map(usize::from).sum();
                let Some(most) = of.iter_mut().max() else { break };
                match sum.cmp(&SCALE) {
                    std::cmp::Ordering::Less => *most += (SCALE - sum) as u16,
                    std::cmp::Ordering::Greater => *most -= 1,
                    std::cmp::Ordering::Equal => break,
                }
            }
        }
        Self { of }
    }

    fn codings(&self) -> [Coding; SYMBOLS] {
        let mut before = 0;
        self.of.map(|frequency| {
            let coding = Coding::new(frequency, before);
            before += frequency;
            coding
        })
    }

    /// Appends the number of symbols up to the last that occurs, and their frequencies: those below 128 in
    /// one byte.
    fn put(&self, out: &mut Vec<u8>) {
        let used = self.of.iter().rposition(|&frequency| frequency > 0).map_or(0, |last| last + 1);
        out.put_u8(used as u8);
        for &frequency in &self.of[..used] {
            if frequency >= 128 {
                out.put_u8((frequency >> 7) as u8 | 128);
            }
            out.put_u8(frequency as u8 & 127);
        }
    }

    fn take(bytes: &mut &[u8]) -> Option<Self> {
        let used = usize::from(bytes.try_get_u8().ok()?);
        let mut of = [0; SYMBOLS];
        for frequency in of.get_mut(..used)? {
            let first = bytes.try_get_u8().ok()?;
            let upper = u16::from(first & 127);
            *frequency =
                if first < 128 { upper } else { upper << 7 | u16::from(bytes.try_get_u8().ok()? & 127) };
        }
        let sum: usize = of.iter().copied().map(usize::from).sum();
        (sum == if used == 0 { 0 } else { SCALE }).then_some(Self { of })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn put_symbols(symbols: &[Placed], contexts: usize, out: &mut Vec<u8>) {
        let mut collected = Symbols::default();
        // What was collected before is gone.
        collected.begin(contexts + 1);
        collected.extend(symbols.iter().copied());
        collected.begin(contexts);
        collected.extend(symbols.iter().copied());
        collected.put(out);
    }

    fn taken(bytes: &[u8], contexts: usize, like: &[Placed]) -> Option<Vec<u8>> {
        let mut rest = bytes;
        let mut decoder = Decoder::take(&mut rest, contexts)?;
        let symbols = like.iter().map(|placed| decoder.next(placed.context)).collect();
        (decoder.is_done() && rest.is_empty()).then_some(symbols)
    }

    #[test]
    fn what_never_varies_takes_no_bytes() {
        let same = vec![Placed { context: 0, symbol: 7 }; 100_000];
        let mut bytes = Vec::new();
        put_symbols(&same, 1, &mut bytes);
        assert_eq!(bytes.len(), 1 + 7 + 2 + 8);
        assert_eq!(taken(&bytes, 1, &same), Some(vec![7; 100_000]));
    }

    #[test]
    fn the_length_is_the_entropy() {
        // Three quarters of one symbol, a quarter of another: 0.8113 bits per symbol.
        let symbols: Vec<Placed> =
            (0..80_000_u32).map(|i| Placed { context: 0, symbol: u8::from(i % 4 == 0) }).collect();
        let mut bytes = Vec::new();
        put_symbols(&symbols, 1, &mut bytes);
        assert!((8113..8150).contains(&bytes.len()), "{}", bytes.len());
    }

    /// The largest and smallest states before a symbol of each frequency, and those around multiples of it.
    #[test]
    fn a_product_with_the_reciprocal_is_the_quotient() {
        for frequency in 1..=SCALE as u64 {
            let coding = Coding::new(frequency as u16, 0);
            let most = (frequency << (u32::BITS - SCALE_BITS)) - 1;
            let multiples = (0..1000).map(|i| most / 1000 * i / frequency * frequency);
            let states = multiples.flat_map(|state| [state, state + frequency - 1, state + 1]).chain([most]);
            for state in states.filter(|state| (1 << 16..=most).contains(state)) {
                let put = u64::from(coding.put(state as u32, &mut Vec::new()));
                assert_eq!(put, state / frequency * SCALE as u64 + state % frequency, "{state} {frequency}");
            }
        }
    }

    proptest! {
        #[test]
        fn symbols_come_back(
            symbols in prop::collection::vec((0_u8..5, 0..SYMBOLS as u8, 0_u8..4), 0..3000),
        ) {
            // Contexts with different frequencies; the fourth does not occur.
            let placed = |&(context, symbol, rarely): &(u8, u8, u8)| {
                let context = if context == 3 { 0 } else { context };
                Placed { context, symbol: if rarely > 0 { context } else { symbol } }
            };
            let symbols: Vec<Placed> = symbols.iter().map(placed).collect();
            let mut bytes = Vec::new();
            put_symbols(&symbols, 5, &mut bytes);
            let expected: Vec<u8> = symbols.iter().map(|placed| placed.symbol).collect();
            prop_assert_eq!(taken(&bytes, 5, &symbols), Some(expected));
        }

        #[test]
        fn any_bytes_are_refused_or_give_symbols(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            if let Some(mut decoder) = Decoder::take(&mut bytes.as_slice(), 2) {
                for i in 0..100 {
                    prop_assert!(usize::from(decoder.next(i % 2)) < SYMBOLS);
                }
            }
        }
    }
}
