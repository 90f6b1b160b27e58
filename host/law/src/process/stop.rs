//! Asking work to stop: a value that whoever may want to stop it shares with whoever does it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use thiserror::Error;

/// How long an increment under way may still take once it was asked to stop: most increments end
/// within it, and a whole increment is what a run can be resumed from.
pub const GRACE: Duration = Duration::from_secs(1);

/// Work was stopped on request: nothing is wrong with it.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{doing}: stopped as asked")]
pub struct Stopped {
    /// What was being done.
    pub doing: String,
}

/// A request to stop that may come at any time, from another thread or another process. Copies
/// share it.
#[derive(Clone, Debug, Default)]
pub struct Stop(Option<Arc<Inner>>);

struct Inner {
    asked: Box<dyn Fn() -> bool + Send + Sync>,
    /// Receives the duration of a piece of work that was not to be interrupted.
    beat: Box<dyn Fn(Duration) + Send + Sync>,
    /// When the request was first seen.
    since: OnceLock<Instant>,
}

impl std::fmt::Debug for Inner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Inner")
            .field("since", &self.since)
            .finish_non_exhaustive()
    }
}

impl Stop {
    /// Nobody will ever ask.
    pub fn never() -> Self {
        Self(None)
    }

    /// Asked as soon as the flag is set.
    pub fn flag(flag: Arc<AtomicBool>) -> Self {
        Self::asked_by(move || flag.load(Ordering::Relaxed), |_| {})
    }

    /// Asked as soon as `asked` reports it, which is called very often. `beat` receives the duration
    /// of every piece of work that was not to be interrupted.
    pub fn asked_by(
        asked: impl Fn() -> bool + Send + Sync + 'static,
        beat: impl Fn(Duration) + Send + Sync + 'static,
    ) -> Self {
        Self(Some(Arc::new(Inner {
            asked: Box::new(asked),
            beat: Box::new(beat),
            since: OnceLock::new(),
        })))
    }

    /// Whether it was asked. Work with a whole piece behind it stops now.
    pub fn is_asked(&self) -> bool {
        let Some(inner) = &self.0 else { return false };
        let asked = (inner.asked)();
        if asked {
            inner.since.get_or_init(Instant::now);
        }
        asked
    }

    /// Whether it was asked so long ago that work stops in the middle of a piece.
    pub fn is_urgent(&self) -> bool {
        let Some(inner) = &self.0 else { return false };
        self.is_asked() && inner.since.get().is_some_and(|at| at.elapsed() >= GRACE)
    }

    /// Reports how long work took that was not to be interrupted.
    pub fn beat(&self, took: Duration) {
        if let Some(inner) = &self.0 {
            (inner.beat)(took);
        }
    }

    /// Goes on unless it was asked to stop.
    ///
    /// # Errors
    /// [`Stopped`] with what was being done.
    pub fn check(&self, doing: &str) -> Result<(), Stopped> {
        if self.is_asked() {
            return Err(Stopped {
                doing: doing.to_owned(),
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_share_the_request_and_others_do_not() {
        let flag = Arc::new(AtomicBool::new(false));
        let stop = Stop::flag(Arc::clone(&flag));
        let copy = stop.clone();
        assert!(!copy.is_asked() && copy.check("a run").is_ok());
        flag.store(true, Ordering::Relaxed);
        assert!(copy.is_asked() && !Stop::never().is_asked());
        assert_eq!(copy.check("a run").unwrap_err().doing, "a run");
        // An increment under way has its time.
        assert!(!stop.is_urgent());
    }
}
