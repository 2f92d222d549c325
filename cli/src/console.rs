//! Console output: results on stdout, everything else on stderr.

use std::io::{self, IsTerminal, Write};
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use aogrid_bake_core::Progress;
use aogrid_scene::shade::StageObserver;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::interrupt;

/// The interval between progress lines where stderr is no terminal and no bar can be drawn.
const PLAIN_INTERVAL: Duration = Duration::from_secs(5);

/// Prints results, notes, warnings, errors and progress.
pub struct Console {
    quiet: bool,
}

impl Console {
    pub fn new(quiet: bool) -> Self {
        Self { quiet }
    }

    /// Prints a line of the command's result.
    pub fn result(&self, line: &str) {
        print(&mut io::stdout().lock(), &printable(line));
    }

    /// Prints the command's result for a machine: one JSON object.
    pub fn json(&self, value: &impl Serialize) -> anyhow::Result<()> {
        // JSON escapes control characters itself.
        print(
            &mut io::stdout().lock(),
            &serde_json::to_string_pretty(value)?,
        );
        Ok(())
    }

    /// Prints a note that scripts need not read; nothing with `--quiet`.
    pub fn note(&self, line: &str) {
        if !self.quiet {
            print(&mut io::stderr().lock(), &printable(line));
        }
    }

    /// Prints a problem in spite of which the command goes on.
    pub fn warning(&self, line: &str) {
        let line = printable(&format!("warning: {line}"));
        print(&mut io::stderr().lock(), &line);
    }

    /// Prints why the command failed: the whole chain of causes, in one line.
    pub fn error(&self, error: &anyhow::Error) {
        let line = printable(&format!("error: {error:#}"));
        print(&mut io::stderr().lock(), &line);
    }

    /// Returns the observer of a stage of work on `name`, which shows its progress.
    pub fn stage(&self, name: &str) -> StageObserver {
        let bar = self.progress(name);
        Box::new(move |progress| bar.observe(progress))
    }

    /// Returns a progress display for work on `name`.
    pub fn progress(&self, name: &str) -> Bar {
        if self.quiet {
            return Bar::Silent;
        }
        if !io::stderr().is_terminal() {
            return Bar::Plain {
                name: name.to_owned(),
                start: Instant::now(),
                last: Mutex::new(Instant::now()),
            };
        }
        let style = ProgressStyle::with_template("{msg} [{bar:32}] {percent}% {eta} left");
        let bar = ProgressBar::new(1).with_style(style.expect("the template is well formed"));
        bar.set_message(printable(name));
        Bar::Drawn(bar)
    }
}

/// The progress display of one long operation.
pub enum Bar {
    Silent,
    Plain {
        name: String,
        start: Instant,
        last: Mutex<Instant>,
    },
    Drawn(ProgressBar),
}

impl Bar {
    /// Shows `progress`; breaks if the user interrupted. Serves as the observer of a bake.
    pub fn observe(&self, progress: Progress) -> ControlFlow<()> {
        match self {
            Self::Silent => {}
            Self::Plain { name, start, last } => print_plain(name, *start, last, progress),
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

/// Prints a progress line with the time left, at most one every [`PLAIN_INTERVAL`].
fn print_plain(
    name: &str,
    start: Instant,
    last: &Mutex<Instant>,
    Progress { done, total }: Progress,
) {
    // Another thread is printing progress already: this one need not.
    let Ok(mut last) = last.try_lock() else {
        return;
    };
    if last.elapsed() >= PLAIN_INTERVAL {
        *last = Instant::now();
        let left = total.saturating_sub(done) as f64 / done.max(1) as f64;
        let left = left * start.elapsed().as_secs_f64();
        let percent = 100 * done / total;
        let line = printable(&format!("{name}: {percent} %, about {left:.0} s left"));
        print(&mut io::stderr().lock(), &line);
    }
}

/// Replaces control characters, which names of files and of their parts may contain.
fn printable(line: &str) -> String {
    line.replace(char::is_control, "\u{FFFD}")
}

/// Prints a line, and exits without a panic if the reader has closed the pipe (`| head`).
fn print(to: &mut impl Write, line: &str) {
    if writeln!(to, "{line}").is_err() {
        std::process::exit(1);
    }
}
