/// The number of random cases that a slow property is tried on: `count`, or `DYMLM_TIMES_CASES` times as
/// many. The gate tries few, the same ones each time; `.ci/nightly sessions` many times as many, drawn anew.
pub fn cases(count: u32) -> u32 {
    let times = std::env::var("DYMLM_TIMES_CASES").ok().and_then(|times| times.parse().ok());
    count.saturating_mul(times.unwrap_or(1))
}
