//! How a caller watches a bake, and stops it.

use std::ops::ControlFlow;

/// How far a bake has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Cells whose directions are all tested, or as much work as that.
    pub done: usize,
    /// Cells in all.
    pub total: usize,
}

/// Called now and then from the baker's threads, not in order of `done`; `Break` cancels the
/// bake, which then returns its cancellation error within a fraction of a second.
pub type Observer<'a> = &'a (dyn Fn(Progress) -> ControlFlow<()> + Sync);

/// For callers who only want the result.
pub const UNOBSERVED: Observer<'static> = &|_| ControlFlow::Continue(());
