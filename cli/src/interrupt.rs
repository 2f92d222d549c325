//! Ctrl-C handling: asks the running command to stop, and ends the process if it does not.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// The time that a command has to react before the process is ended. Loading meshes and building
/// BVHs do not poll; ending them is safe, since output files appear whole or not at all.
const GRACE_PERIOD: Duration = Duration::from_millis(700);

/// Installs the interrupt handler: from here on an interrupt is a request to stop first.
pub fn listen() {
    let handler = || {
        REQUESTED.store(true, Ordering::Relaxed);
        std::thread::sleep(GRACE_PERIOD);
        eprintln!("error: interrupted");
        std::process::exit(1);
    };
    // If installing fails, an interrupt ends the process at once, which is acceptable too.
    let _ = ctrlc::set_handler(handler);
}

/// Whether the user has interrupted the command.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
