//! A future that a callback completes.

use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

/// Completes with `true` when its [`Trigger`] fires, or with `false` when that is dropped.
pub(crate) struct Signal(Arc<Mutex<State>>);

/// The sending end of a [`Signal`].
pub(crate) struct Trigger(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    fired: Option<bool>,
    waker: Option<Waker>,
}

/// Returns both ends of a signal.
pub(crate) fn signal() -> (Trigger, Signal) {
    let state = Arc::<Mutex<State>>::default();
    (Trigger(Arc::clone(&state)), Signal(state))
}

impl Trigger {
    /// Completes the signal; only the first call counts.
    pub(crate) fn fire(&self, success: bool) {
        let mut state = lock(&self.0);
        state.fired.get_or_insert(success);
        let waker = state.waker.take();
        drop(state);
        if let Some(waker) = waker {
            waker.wake();
        }
    }
}

impl Drop for Trigger {
    fn drop(&mut self) {
        self.fire(false);
    }
}

impl Future for Signal {
    type Output = bool;

    fn poll(self: Pin<&mut Self>, task: &mut Context<'_>) -> Poll<bool> {
        let mut state = lock(&self.0);
        match state.fired {
            Some(success) => Poll::Ready(success),
            None => {
                state.waker = Some(task.waker().clone());
                Poll::Pending
            }
        }
    }
}

/// Locks the state, which is valid even where a thread has panicked.
fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}
