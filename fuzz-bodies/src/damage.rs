use crate::choices::Choices;
use crate::walk::Parts;

/// Extreme numbers as they are saved: huge counts and indices, NaN, an infinity, the largest f64, negative
/// zero.
const EXTREMES: [&[u8]; 8] = [
    b"\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01",
    b"\xff\xff\xff\xff\x0f",
    b"\xff\xff\x03",
    b"\0\0\0\0\0\0\xf8\x7f",
    b"\0\0\0\0\0\0\xf0\xff",
    b"\xff\xff\xff\xff\xff\xff\xef\x7f",
    b"\0\0\0\0\0\0\0\x80",
    b"\0\0\xc0\x7f",
];

/// Changes some of the parts of a state, or some of their bytes.
pub(crate) fn damage(parts: &mut Parts, choices: &mut Choices<'_>) {
    for _ in 0..=choices.below(4) {
        if parts.is_empty() {
            return;
        }
        // The first parts, which hold data that exists once, are damaged as often as all others.
        let place =
            if choices.is_true() { choices.below(4).into() } else { choices.number_below(parts.len()) };
        let place = place.min(parts.len() - 1);
        let other = parts[choices.number_below(parts.len())].1.clone();
        let (key, bytes) = &mut parts[place];
        let at = choices.number_below(bytes.len() + 1);
        match choices.below(24) {
            0 => drop(parts.remove(place)),
            1 => parts.push(parts[place].clone()),
            2 => *key ^= 1 << choices.below(64),
            3 => *bytes = other,
            4 => bytes.truncate(at),
            5 => drop(bytes.splice(at.., other.get(at..).unwrap_or_default().iter().copied())),
            6 | 7 => {
                drop(bytes.splice(at..at, (0..choices.below(8)).map(|_| choices.byte()).collect::<Vec<_>>()));
            }
            8..=11 => {
                let extreme = EXTREMES[usize::from(choices.below(8))];
                let end = (at + extreme.len() * usize::from(choices.below(2))).min(bytes.len());
                bytes.splice(at..end, extreme.iter().copied());
            }
            12..=14 => {
                // Replaces a number by another.
                let number = choices.number();
                let number: &[u8] =
                    if choices.is_true() { &number.to_le_bytes() } else { &(number as f32).to_le_bytes() };
                let end = (at + number.len()).min(bytes.len());
                bytes.splice(at..end, number.iter().copied());
            }
            15..=17 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << choices.below(8);
                }
            }
            _ => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = choices.byte();
                }
            }
        }
    }
}
