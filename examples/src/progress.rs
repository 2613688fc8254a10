use indicatif::{ProgressBar, ProgressStyle};

/// A progress bar over `count` frames, on standard error when that is a terminal.
pub fn progress_bar(count: usize, what: &str) -> ProgressBar {
    let bar = ProgressBar::new(count as u64).with_message(what.to_owned());
    let style = ProgressStyle::with_template("{msg} {bar:40} {pos}/{len} frames, {per_sec}, {eta} left");
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
