//! The threads that a run works with. The one that asks for them is the first, so no other may ask them for
//! anything: alone, it would have nobody who answers. The others begin when there is enough to do, since a small
//! run takes a twentieth longer with them than alone.

use crate::commands::cannot_start;
use input::{Case, Error};
use law::Stop;
use rayon::{ThreadBuilder, ThreadPoolBuilder};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// Grids of this many elements are small: elements are shared in pieces as large.
const SMALL: usize = 256;
/// Work that is not done by then is for all threads, however small it looks.
const LONG: Duration = Duration::from_millis(100);

// Of the whole process by nature: these are its threads.

/// Those that have not begun.
static WAITING: Mutex<Vec<ThreadBuilder>> = Mutex::new(Vec::new());
/// Since when.
static SINCE: OnceLock<Instant> = OnceLock::new();

/// Starts this many threads, or one for each processor; they wait for [`begin`]. Until then the
/// calling thread does everything alone.
pub(crate) fn gather(n: Option<u16>) -> Result<(), Error> {
    SINCE.get_or_init(Instant::now);
    let threads = ThreadPoolBuilder::new()
        .use_current_thread()
        .num_threads(n.map_or(0, usize::from))
        .spawn_handler(|thread| {
            let mut waiting = WAITING.lock().unwrap_or_else(PoisonError::into_inner);
            waiting.push(thread);
            Ok(())
        })
        .build()
        .map_err(|why| cannot_start("the threads of the run", &why))?;
    // They are there as long as the process is.
    std::mem::forget(threads);
    Ok(())
}

/// Has those that wait begin.
pub(crate) fn begin() -> Result<(), Error> {
    let waiting = std::mem::take(&mut *WAITING.lock().unwrap_or_else(PoisonError::into_inner));
    for thread in waiting {
        std::thread::Builder::new()
            .spawn(|| thread.run())
            .map_err(|why| cannot_start("the threads of the run", &why))?;
    }
    Ok(())
}

/// Has them begin at once, or with small cases only if these take long: whenever it is asked whether they are to
/// stop, this is looked at, too.
pub(crate) fn begin_for(cases: &[Case], stop: &Stop) -> Result<Stop, Error> {
    let is_small =
        |case: &Case| case.file.accuracy.is_none() && case.n_elements().is_some_and(|n| n <= SMALL);
    if !cases.iter().all(is_small) {
        begin()?;
        return Ok(stop.clone());
    }
    let (asked, told) = (stop.clone(), stop.clone());
    let look = move || {
        if SINCE.get().is_some_and(|since| since.elapsed() > LONG) {
            // What one thread does, it can go on with alone.
            let _ = begin();
        }
        asked.is_asked()
    };
    Ok(Stop::asked_by(look, move |took| told.beat(took)))
}
