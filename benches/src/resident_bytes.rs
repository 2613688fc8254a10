use std::io::{Error, ErrorKind, Result};

/// Resident memory of this process, as Linux reports it.
///
/// # Errors
///
/// When the system has no `/proc`.
pub fn resident_bytes() -> Result<usize> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<usize>().ok());
    kilobytes.map(|kilobytes| kilobytes * 1024).ok_or_else(|| Error::from(ErrorKind::InvalidData))
}
