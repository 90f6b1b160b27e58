//! CPU time.

/// CPU time of the process so far, all threads together, s; wall-clock time if the system does not
/// report it.
#[cfg(unix)]
pub(crate) fn cpu_seconds() -> f64 {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// CPU time of the process so far, all threads together, s; wall-clock time if the system does not
/// report it.
#[cfg(not(unix))]
pub(crate) fn cpu_seconds() -> f64 {
    use std::sync::OnceLock;
    use std::time::Instant;
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// A batch of repetitions takes at least this long, s.
const LEAST_BATCH: f64 = 0.02;
/// Batches; the fastest counts, since other work only ever adds to it.
const BATCHES: usize = 3;
/// A call that takes longer is not repeated, s.
const LONG: f64 = 0.2;
/// Most repetitions of a batch.
const MOST_REPETITIONS: f64 = 1e4;

/// CPU time of one call, s: the least mean over batches of repeated calls.
pub(crate) fn seconds_of_a_call<E>(mut call: impl FnMut() -> Result<(), E>) -> Result<f64, E> {
    let mut timed = |times: usize| {
        let start = cpu_seconds();
        for _ in 0..times {
            call()?;
        }
        Ok((cpu_seconds() - start) / times as f64)
    };
    let first = timed(1)?;
    if first > LONG {
        return Ok(first);
    }
    let times = (LEAST_BATCH / first.max(1e-9)).ceil().min(MOST_REPETITIONS);
    let mut least = f64::INFINITY;
    for _ in 0..BATCHES {
        least = f64::min(least, timed(times as usize)?);
    }
    Ok(least)
}
