//! Progress reports and cancellation of a bake.

use std::ops::ControlFlow;

/// The progress of a bake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Number of finished cells, or the equivalent amount of work.
    pub done: usize,
    /// Number of cells in total.
    pub total: usize,
}

/// A callback that a baker's threads call from time to time, not in order of `done`. `Break`
/// cancels the bake, which then returns its cancellation error within a fraction of a second.
pub type Observer<'a> = &'a (dyn Fn(Progress) -> ControlFlow<()> + Sync);

/// An observer that ignores progress and never cancels.
pub const UNOBSERVED: Observer<'static> = &|_| ControlFlow::Continue(());
