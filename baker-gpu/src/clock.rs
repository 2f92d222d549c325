//! The clock that submissions are timed by.

use std::time::Duration;

/// A clock: returns the time since any fixed moment.
pub type Clock = fn() -> Duration;

/// The clock of contexts that are given none. The standard library's panics in a browser.
#[cfg(not(feature = "native"))]
pub(crate) const DEFAULT: Option<Clock> = None;
#[cfg(feature = "native")]
pub(crate) const DEFAULT: Option<Clock> = Some(|| {
    use std::sync::LazyLock;
    use std::time::Instant;
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed()
});
