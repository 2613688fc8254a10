use dymlm_core::{BitReader, BitWriter};

use super::MOST_FRAMES;
use super::counts::{next_counts, put_counts};
use crate::block_store::BlockKey;
use crate::epochs::{Epochs, Period};
use crate::evidence::Evidence;

/// Bits of the number of a block's periods, of which there are a few dozen at most.
const LENGTH_BITS: u32 = 16;

/// The evidence of a block: its last change, then its periods. `None` where there is no block.
pub(super) fn evidence_of(key: BlockKey, evidence: &Evidence) -> Option<Vec<u8>> {
    let slot = evidence.blocks().slot(key)?;
    let block = evidence.blocks().blocks()[slot].look();
    let periods = block.epochs().periods();
    let mut bits = BitWriter::default();
    bits.put(evidence.blocks().stamps().of(slot), u32::BITS);
    bits.put(periods.len() as u32, LENGTH_BITS);
    for period in periods {
        put_period(period, &mut bits);
    }
    let mut bytes = Vec::new();
    bits.finish(&mut bytes);
    Some(bytes)
}

/// Puts a block where there is none; `None` for a block that no map can hold.
pub(super) fn put_evidence(mut bytes: &[u8], key: BlockKey, evidence: &mut Evidence) -> Option<()> {
    let mut bits = BitReader::take(&mut bytes)?;
    let revision = bits.next(u32::BITS)?;
    let count = bits.next(LENGTH_BITS)?;
    let periods = (0..count).map(|_| next_period(&mut bits)).collect::<Option<Vec<_>>>()?;
    if !bytes.is_empty() || !bits.is_done() {
        return None;
    }
    evidence.put_block(key, Epochs::restored(periods)?, revision);
    Some(())
}

fn put_period(period: &Period, bits: &mut BitWriter) {
    bits.put(period.first.cast_unsigned(), i32::BITS);
    bits.put(period.level, u8::BITS);
    bits.put(period.seen, u32::BITS);
    period.ends.iter().for_each(|end| bits.put(end.cast_unsigned(), i32::BITS));
    bits.put(period.looked_through, u32::BITS);
    put_counts(&period.cells, bits);
}

fn next_period(bits: &mut BitReader<'_>) -> Option<Period> {
    Some(Period {
        first: bits.next(i32::BITS)?.cast_signed(),
        level: bits.next(u8::BITS)?,
        seen: bits.next(u32::BITS)?,
        ends: [bits.next(i32::BITS)?.cast_signed(), bits.next(i32::BITS)?.cast_signed()],
        looked_through: bits.next(u32::BITS).filter(|&frames| frames < MOST_FRAMES)?,
        cells: next_counts(bits)?,
    })
}
