use std::collections::BTreeMap;
use std::io;

use dymlm_core::{SplitMix64, StateSink};

/// The parts of a saved state, by key.
pub type SavedParts = BTreeMap<u64, Vec<u8>>;

/// Parts to be loaded: in any order, with any keys.
pub type LoadedParts = Vec<(u64, Vec<u8>)>;

/// Applies the parts that `save` writes to those saved before; returns the number of parts that changed.
pub fn save_into(parts: &mut SavedParts, save: impl FnOnce(&mut StateSink<'_>) -> io::Result<()>) -> usize {
    let mut changed = 0;
    let mut sink = |part, bytes: Option<&[u8]>| {
        changed += 1;
        match bytes {
            Some(bytes) => drop(parts.insert(part, bytes.to_vec())),
            None => assert!(parts.remove(&part).is_some(), "part {part:#x} goes that was not there"),
        }
        Ok(())
    };
    save(&mut sink).unwrap();
    changed
}

/// All parts that `save` writes.
pub fn saved_parts(save: impl FnOnce(&mut StateSink<'_>) -> io::Result<()>) -> SavedParts {
    let mut parts = SavedParts::new();
    save_into(&mut parts, save);
    parts
}

/// The parts with one error: a part is missing, doubled, under a wrong key, replaced by another, or has a
/// wrong byte.
pub fn damaged_parts(parts: &SavedParts, random: &mut SplitMix64) -> LoadedParts {
    let mut parts: LoadedParts = parts.clone().into_iter().collect();
    // The part's kind, in the lowest bits of its key, is chosen first, so that kinds with few parts are
    // damaged as often as those with many.
    let kind = random.below(4) as u64;
    let own: Vec<usize> = (0..parts.len()).filter(|&place| parts[place].0 & 3 == kind).collect();
    let place = if own.is_empty() { random.below(parts.len()) } else { own[random.below(own.len())] };
    match random.below(8) {
        0 => drop(parts.remove(place)),
        1 => parts.push(parts[place].clone()),
        2 => parts[place].0 ^= 1 << random.below(64),
        3 => {
            let other = random.below(parts.len());
            let other = parts[other].1.clone();
            parts[place].1 = other;
        }
        _ => {
            let bytes = &mut parts[place].1;
            if !bytes.is_empty() {
                let at = random.below(bytes.len());
                bytes[at] = random.below(256) as u8;
            }
        }
    }
    parts
}

/// For each part, the state without it and the state with it twice.
pub fn incomplete_parts(parts: &SavedParts) -> impl Iterator<Item = (u64, [LoadedParts; 2])> {
    parts.iter().map(|(&part, bytes)| {
        let all = || parts.clone().into_iter();
        let without = all().filter(|(key, _)| *key != part).collect();
        (part, [without, all().chain([(part, bytes.clone())]).collect()])
    })
}
