//! What the user sees: results on stdout, everything else on stderr.

use std::io::{self, IsTerminal, Write};
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use aogrid_bake_core::Progress;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::interrupt;

/// How often a long bake says how far it is where there is no terminal to draw a bar on.
const PLAIN_INTERVAL: Duration = Duration::from_secs(5);

pub(crate) struct Console {
    quiet: bool,
}

impl Console {
    pub(crate) fn new(quiet: bool) -> Self {
        Self { quiet }
    }

    /// A line of the command's result.
    pub(crate) fn result(&self, line: &str) {
        print(&mut io::stdout().lock(), &printable(line));
    }

    /// The command's result for a machine: one JSON object.
    pub(crate) fn json(&self, value: &impl Serialize) -> anyhow::Result<()> {
        // JSON escapes what is not printable itself.
        print(
            &mut io::stdout().lock(),
            &serde_json::to_string_pretty(value)?,
        );
        Ok(())
    }

    /// Something that happened and that scripts need not read.
    pub(crate) fn note(&self, line: &str) {
        if !self.quiet {
            print(&mut io::stderr().lock(), &printable(line));
        }
    }

    /// Something the user should know although the command goes on.
    pub(crate) fn warning(&self, line: &str) {
        let line = printable(&format!("warning: {line}"));
        print(&mut io::stderr().lock(), &line);
    }

    /// Why the command failed: the whole chain of causes, in one line.
    pub(crate) fn error(&self, error: &anyhow::Error) {
        let line = printable(&format!("error: {error:#}"));
        print(&mut io::stderr().lock(), &line);
    }

    /// A bar for work on `name`.
    pub(crate) fn progress(&self, name: &str) -> Bar {
        if self.quiet {
            return Bar::Silent;
        }
        if !io::stderr().is_terminal() {
            return Bar::Plain {
                name: name.to_owned(),
                last: Mutex::new(Instant::now()),
            };
        }
        let style = ProgressStyle::with_template("{msg} [{bar:32}] {percent}% {eta} left");
        let bar = ProgressBar::new(1).with_style(style.expect("the template is well formed"));
        bar.set_message(printable(name));
        Bar::Drawn(bar)
    }
}

/// Progress of one bake.
pub(crate) enum Bar {
    Silent,
    Plain { name: String, last: Mutex<Instant> },
    Drawn(ProgressBar),
}

impl Bar {
    /// Shows `progress`; breaks if the user interrupted. An observer of a bake.
    pub(crate) fn observe(&self, progress: Progress) -> ControlFlow<()> {
        match self {
            Self::Silent => {}
            Self::Plain { name, last } => plain(name, last, progress),
            Self::Drawn(bar) => {
                bar.set_length(progress.total as u64);
                bar.set_position(progress.done as u64);
            }
        }
        match interrupt::requested() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Self::Drawn(bar) = self {
            bar.finish_and_clear();
        }
    }
}

fn plain(name: &str, last: &Mutex<Instant>, Progress { done, total }: Progress) {
    // A thread that finds another one busy here has nothing to add.
    let Ok(mut last) = last.try_lock() else {
        return;
    };
    if last.elapsed() >= PLAIN_INTERVAL {
        *last = Instant::now();
        let line = printable(&format!("{name}: {} %", 100 * done / total));
        print(&mut io::stderr().lock(), &line);
    }
}

/// One line without control characters: names of files and of their parts may hold any.
fn printable(line: &str) -> String {
    line.replace(char::is_control, "\u{FFFD}")
}

/// A reader that has gone away (`| head`) is no reason to panic, and none to go on.
fn print(to: &mut impl Write, line: &str) {
    if writeln!(to, "{line}").is_err() {
        std::process::exit(1);
    }
}
