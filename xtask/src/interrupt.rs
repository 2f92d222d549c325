//! Ctrl-C: ask the bake to stop, and stop anyway where nothing asks back.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// How long a command may take to notice. Loading and building do not look; they are left
/// standing, which is safe: output files appear whole or not at all.
const PATIENCE: Duration = Duration::from_millis(700);

/// From here on an interrupt is a request first.
pub(crate) fn listen() {
    let handler = || {
        REQUESTED.store(true, Ordering::Relaxed);
        std::thread::sleep(PATIENCE);
        eprintln!("error: interrupted");
        std::process::exit(1);
    };
    // Without a handler an interrupt ends the process at once, which is as good.
    let _ = ctrlc::set_handler(handler);
}

/// Whether the user wants the command to end.
pub(crate) fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
