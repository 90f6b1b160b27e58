//! A law found again by its parameters, and failures in words.
//!
//! Other programs pass the parameters with every call and know no `create`. So each entry keeps
//! the laws it has built, up to [`MOST_LAWS`] sets of parameters, and finds them by the bits of the
//! values, without a lock. Beyond that a law is built in every call.

use abi::access::{Message, id, panic_text, within_bounds};
use abi::export::Exported;
use abi::{Failure, Hypothesis, Parameter, Parameters, raw};
use std::ffi::CStr;
use std::fmt;
use std::io::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicUsize, Ordering};

/// Most parameters of a law that is exported to other programs.
pub const MOST_PARAMETERS: usize = 64;
/// Most sets of parameters that an entry keeps a law for.
pub const MOST_LAWS: usize = 4096;
const N_BUCKETS: usize = 256;

/// Why a call gave nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Trouble<'a> {
    /// The parameters were refused, for this reason.
    Refused(&'a str),
    /// The law gave up on the point.
    Failed(Failure),
    /// The law panicked now, or before.
    Panicked,
}

impl Trouble<'_> {
    /// The part of the increment that the law believes it can follow; a quarter if it does not say.
    pub(crate) fn factor(self) -> f64 {
        match self {
            Self::Failed(Failure::CutStep { factor, .. }) if factor > 0.0 && factor < 1.0 => factor,
            _ => 0.25,
        }
    }
}

impl fmt::Display for Trouble<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Refused(why) => why,
            Self::Failed(failure) => failure.reason(),
            Self::Panicked => "it panicked, a defect of the law, and is not called again",
        })
    }
}

/// A law built from one set of parameters, or why it cannot be.
struct Built<L> {
    law: Result<L, String>,
    poisoned: AtomicBool,
}

impl<L: Exported> Built<L> {
    /// From the first values in declared order; the rest take their defaults.
    #[cold]
    fn new(given: &[f64]) -> Self {
        let table = <L::Parameters as Parameters>::TABLE;
        let law = complete(table, given).and_then(|values| {
            let values = &values[..table.len()];
            within_bounds(table, values)
                .map_err(|(id, value)| format!("{id}: {value} is not admissible"))?;
            catch_unwind(|| L::new(L::Parameters::read(values))).unwrap_or_else(|payload| {
                Err(format!("panicked in `new`: {}", panic_text(&*payload)))
            })
        });
        Self {
            law,
            poisoned: AtomicBool::new(false),
        }
    }

    /// The same in its own place, as it may be large.
    #[cold]
    #[inline(never)]
    fn boxed(given: &[f64]) -> Box<Self> {
        Box::new(Self::new(given))
    }

    #[inline]
    fn carry<A>(&self, work: impl FnOnce(&L) -> Result<A, Failure>) -> Result<A, Trouble<'_>> {
        let law = self.law.as_ref().map_err(|why| Trouble::Refused(why))?;
        if self.poisoned.load(Ordering::Relaxed) {
            return Err(Trouble::Panicked);
        }
        catch_unwind(AssertUnwindSafe(|| work(law)))
            .map_err(|_| {
                self.poisoned.store(true, Ordering::Relaxed);
                Trouble::Panicked
            })?
            .map_err(Trouble::Failed)
    }
}

/// All values, those that are not given at their defaults; NaN where the law does without.
fn complete(table: &[Parameter], given: &[f64]) -> Result<[f64; MOST_PARAMETERS], String> {
    let mut values = [f64::NAN; MOST_PARAMETERS];
    let needed = n_needed(table);
    if given.len() < needed || given.len() > table.len() {
        let ids: Vec<_> = table.iter().map(id).collect();
        return Err(format!(
            "{} parameters given, expected {needed} to {}: {}",
            given.len(),
            table.len(),
            ids.join(", ")
        ));
    }
    for (v, declared) in table.iter().enumerate() {
        values[v] = given
            .get(v)
            .copied()
            .unwrap_or(declared.raw().default_value);
    }
    Ok(values)
}

/// Number of values up to the last that cannot be left out.
fn n_needed(table: &[Parameter]) -> usize {
    table.len() - table.iter().rev().take_while(|p| has_default(p)).count()
}

/// Whether the parameter may be left out.
pub(crate) const fn has_default(parameter: &Parameter) -> bool {
    !parameter.raw().default_value.is_nan() || parameter.raw().flags & raw::PILUM_P_OPTIONAL != 0
}

/// Whether a law offers a hypothesis.
pub const fn offers<L: Exported>(hypothesis: Hypothesis) -> bool {
    let mut i = 0;
    while i < L::FORMULATIONS.len() {
        if L::FORMULATIONS[i].hypothesis == hypothesis as i32 {
            return true;
        }
        i += 1;
    }
    false
}

/// The laws that an entry has built.
#[derive(Debug)]
pub struct Laws<L> {
    buckets: [AtomicPtr<Kept<L>>; N_BUCKETS],
    n: AtomicUsize,
}

/// A law that is kept for the life of the process, in the list of its bucket.
struct Kept<L> {
    key: Box<[u64]>,
    built: Built<L>,
    next: *mut Self,
}

impl<L: Exported> Laws<L> {
    /// None yet.
    ///
    /// # Panics
    /// If the law has too many parameters; at compile time, where it is exported.
    pub const fn new() -> Self {
        assert!(
            <L::Parameters as Parameters>::TABLE.len() <= MOST_PARAMETERS,
            "too many parameters for other programs"
        );
        Self {
            buckets: [const { AtomicPtr::new(null_mut()) }; N_BUCKETS],
            n: AtomicUsize::new(0),
        }
    }

    /// Carries a point with the law of these parameters, the first values in declared order.
    /// `tell` hears what is in the way of an answer.
    #[inline]
    pub(crate) fn carry<A>(
        &self,
        given: &[f64],
        work: impl FnOnce(&L) -> Result<A, Failure>,
        tell: impl FnOnce(Trouble<'_>),
    ) -> Option<A> {
        let bucket = &self.buckets[hash(given) % N_BUCKETS];
        let head = bucket.load(Ordering::Acquire);
        let made;
        let built = if let Some(built) = find(head, given) {
            built
        } else if let Some(built) = self.keep(bucket, head, given) {
            built
        } else {
            made = Built::boxed(given);
            &*made
        };
        built.carry(work).map_err(tell).ok()
    }

    /// The same for a program that takes no messages.
    ///
    /// # Errors
    /// The factor of a step that may succeed; the reason is reported.
    #[inline]
    pub(crate) fn carry_or_complain<A>(
        &self,
        id: &CStr,
        given: &[f64],
        work: impl FnOnce(&L) -> Result<A, Failure>,
    ) -> Result<A, f64> {
        let mut factor = STEP_FACTOR;
        let tell = |trouble: Trouble<'_>| {
            factor = trouble.factor();
            complain(id, format_args!("{trouble}"));
        };
        self.carry(given, work, tell).ok_or(factor)
    }

    /// Builds a law and puts it at the head of the list, unless there are too many. Two threads may keep
    /// the same one twice.
    #[cold]
    #[inline(never)]
    fn keep<'a>(
        &self,
        bucket: &AtomicPtr<Kept<L>>,
        mut head: *mut Kept<L>,
        given: &[f64],
    ) -> Option<&'a Built<L>> {
        if self.n.fetch_add(1, Ordering::Relaxed) >= MOST_LAWS {
            self.n.fetch_sub(1, Ordering::Relaxed);
            return None;
        }
        let kept = Box::into_raw(Box::new(Kept {
            key: given.iter().map(|v| v.to_bits()).collect(),
            built: Built::new(given),
            next: head,
        }));
        while let Err(now) =
            bucket.compare_exchange_weak(head, kept, Ordering::AcqRel, Ordering::Acquire)
        {
            head = now;
            // SAFETY: nobody else knows it yet.
            unsafe { (*kept).next = head };
        }
        // SAFETY: made above, never freed.
        Some(unsafe { &(*kept).built })
    }
}

impl<L: Exported> Default for Laws<L> {
    fn default() -> Self {
        Self::new()
    }
}

/// A sum of products that do not wait for one another. Round numbers end in zeros, and so do their
/// products: the leading bits differ.
#[inline]
fn hash(values: &[f64]) -> usize {
    let (mut sum, mut factor) = (0_u64, 1_u64);
    for value in values {
        factor = factor.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        sum = sum.wrapping_add(value.to_bits().wrapping_mul(factor));
    }
    (sum >> 56) as usize
}

#[inline]
fn find<'a, L>(mut at: *const Kept<L>, given: &[f64]) -> Option<&'a Built<L>> {
    // SAFETY: what is in the list is never freed or changed.
    while let Some(kept) = unsafe { at.as_ref() } {
        let key = &kept.key;
        if key.len() == given.len() && key.iter().zip(given).all(|(k, v)| *k == v.to_bits()) {
            return Some(&kept.built);
        }
        at = kept.next;
    }
    None
}

/// The step factor where a call cannot be answered as it is.
const STEP_FACTOR: f64 = 0.25;

/// Says why a call cannot be answered as it is.
///
/// # Errors
/// Its step factor.
pub(crate) fn refused<T>(law: &CStr, text: fmt::Arguments<'_>) -> Result<T, f64> {
    complain(law, text);
    Err(STEP_FACTOR)
}

/// Says something on the standard error stream, the only channel of a program that takes no
/// messages; at most 20 lines from a library.
pub(crate) fn complain(law: &CStr, text: fmt::Arguments<'_>) {
    static SAID: AtomicUsize = AtomicUsize::new(0);
    const MOST_LINES: usize = 20;
    let said = SAID.fetch_add(1, Ordering::Relaxed).min(MOST_LINES);
    if said < MOST_LINES {
        let last = if said + 1 == MOST_LINES {
            " (further messages are not shown)"
        } else {
            ""
        };
        let name = law.to_str().unwrap_or("law");
        // There is nobody to tell that nobody can be told.
        let _ = writeln!(std::io::stderr(), "{name}: {text}{last}");
    }
}

/// Writes a message of MFront's length, 512 bytes.
///
/// # Safety
/// `p` is null or valid for 512 bytes.
pub(crate) unsafe fn tell(p: *mut std::ffi::c_char, text: fmt::Arguments<'_>) {
    // SAFETY: passed on to the caller.
    unsafe { Message::new(p, 512) }.write(text);
}
