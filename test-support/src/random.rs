use dymlm_core::SplitMix64;

/// A standard normal number (Box, Muller 1958).
pub fn normal(random: &mut SplitMix64) -> f64 {
    // 1 - u is above 0.
    (-2.0 * (1.0 - random.fraction()).ln()).sqrt() * (std::f64::consts::TAU * random.fraction()).cos()
}

/// Puts values into another order, the same for each seed (Fisher, Yates).
pub fn shuffle<T>(values: &mut [T], seed: u64) {
    let mut random = SplitMix64::new(seed);
    for i in (1..values.len()).rev() {
        values.swap(i, random.below(i + 1));
    }
}
