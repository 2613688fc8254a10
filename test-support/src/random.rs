use dymlm_core::SplitMix64;

/// A standard normal number (Box, Muller 1958).
pub fn normal(random: &mut SplitMix64) -> f64 {
    // 1 - u is above 0.
    (-2.0 * (1.0 - random.fraction()).ln()).sqrt() * (std::f64::consts::TAU * random.fraction()).cos()
}

/// Shuffles values; the order depends on the seed alone (Fisher, Yates).
pub fn shuffle<T>(values: &mut [T], seed: u64) {
    let mut random = SplitMix64::new(seed);
    for i in (1..values.len()).rev() {
        values.swap(i, random.below(i + 1));
    }
}

/// Whole numbers of 0..1000 without a pattern, which never change: committed checksums are made from them.
pub fn whole_numbers() -> impl Iterator<Item = u32> {
    (0_u32..).map(|n| (n.wrapping_mul(2_654_435_761) ^ (n >> 3).wrapping_mul(40_503)) >> 7).map(|n| n % 1000)
}

/// FNV-1a of bytes.
pub fn checksum(bytes: impl IntoIterator<Item = u8>) -> u64 {
    let bytes = bytes.into_iter();
    bytes.fold(0xCBF2_9CE4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3))
}
