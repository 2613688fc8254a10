use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that becomes true when the user interrupts the program (Ctrl-C). A second Ctrl-C ends the program
/// at once. `what` names the output that is lost if no handler can be set, for the warning.
pub fn interruption(what: &str) -> Arc<AtomicBool> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    let handler = move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        print_warning(&format!("an interruption will lose the {what}: {error}"));
    }
    interrupted
}

/// Prints a warning on standard error.
#[allow(clippy::print_stderr, reason = "warnings of a program for the terminal")]
pub fn print_warning(text: &str) {
    eprintln!("warning: {text}");
}
