//! Work in its own thread, while the thread that asked for it, without the interpreter's lock, listens:
//! for Ctrl-C, and for what is to be reported on the way.

use crate::error::exception;
use law::Stop;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How often signals are looked for.
const LOOK: Duration = Duration::from_millis(50);

/// The threads that work, and the process that they belong to.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// The threads of this process: a forked copy lacks the threads of the original. Processes that
/// they start live as long as they do.
///
/// # Errors
/// `RuntimeError` if they cannot be started.
pub(crate) fn threads() -> PyResult<Arc<ThreadPool>> {
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((of, threads)) = &*pool
        && *of == process
    {
        return Ok(Arc::clone(threads));
    }
    let threads = ThreadPoolBuilder::new().build();
    let threads = threads.map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    let threads = Arc::new(threads);
    // Threads that are not there cannot be ended.
    std::mem::forget(pool.replace((process, Arc::clone(&threads))));
    Ok(threads)
}

/// Progress messages of work, and requests to stop it.
pub(crate) struct Caller<E> {
    tell: Sender<E>,
    heard: Receiver<()>,
    stop: Stop,
}

impl<E> Caller<E> {
    /// Says something, and goes on once it was heard.
    pub(crate) fn tell(&self, event: E) {
        // Who does not listen any more has asked to stop.
        let _ = self.tell.send(event).map(|()| self.heard.recv());
    }

    /// Asked once Ctrl-C was pressed, or who listens has raised an exception.
    pub(crate) fn stop(&self) -> Stop {
        self.stop.clone()
    }
}

/// Hears what the work says until it has ended, and looks up now and then: the first error of `take`, which
/// hears no more then.
fn heard_out<E>(
    told: &Receiver<E>,
    hear: &Sender<()>,
    mut take: impl FnMut(Option<E>) -> PyResult<()>,
) -> Option<PyErr> {
    let mut raised = None;
    loop {
        let event = match told.recv_timeout(LOOK) {
            Ok(event) => Some(event),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => return raised,
        };
        let is_event = event.is_some();
        if raised.is_none() {
            raised = take(event).err();
        }
        if is_event {
            let _ = hear.send(());
        }
    }
}

/// Carries out `work` and hands what it says to `listen`. The first exception, or that of a signal, asks the work to
/// stop and is raised when it has.
///
/// # Errors
/// That exception.
pub(crate) fn carry_out<E: Send, T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&Caller<E>) -> T + Send,
    mut listen: impl FnMut(Python<'_>, E) -> PyResult<()> + Send,
) -> PyResult<T> {
    let threads = threads()?;
    let asked = Arc::new(AtomicBool::new(false));
    let (tell, told) = channel();
    let (hear, heard) = channel();
    let caller = Caller {
        tell,
        heard,
        stop: Stop::flag(Arc::clone(&asked)),
    };
    let mut done = None;
    let mut raised = None;
    let ends = (&mut done, &mut raised);
    py.detach(move || {
        let (done, raised) = ends;
        threads.in_place_scope(|scope| {
            scope.spawn(move |_| {
                // The end of `caller` is the end of the work.
                *done = Some(catch_unwind(AssertUnwindSafe(|| work(&caller))));
            });
            *raised = heard_out(&told, &hear, |event| {
                let outcome = Python::attach(|py| {
                    py.check_signals()?;
                    event.map_or(Ok(()), |event| listen(py, event))
                });
                outcome.inspect_err(|_| asked.store(true, Ordering::Relaxed))
            });
        });
    });
    if let Some(error) = raised {
        return Err(error);
    }
    let Some(Ok(outcome)) = done else {
        let defect = input::Error::internal("the program panicked; please report it");
        return Err(exception(py, &defect, None));
    };
    Ok(outcome)
}
