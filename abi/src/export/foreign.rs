//! What the entries for other programs share: a law is found again by its parameters, one point is
//! carried over its increment, failures become text.
//!
//! Other programs pass the parameters with every call and know no `create`. So each entry keeps
//! the laws it has built, up to [`MOST_LAWS`] sets of parameters, and finds them by the bits of the
//! values, without a lock. Beyond that a law is built in every call.

use super::{Exported, INPUT_NOT_FINITE, Message, defect, panic_text, within_bounds};
use crate::descriptor::{Hypothesis, InternalVariables, Parameter, Parameters};
use crate::law::{
    ContinuumLaw, Failure, InterfaceLaw, InterfacePoint, SolidPoint, SolidResponse, Tangent,
};
use crate::raw;
use std::ffi::CStr;
use std::fmt;
use std::io::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicUsize, Ordering};

/// Exports a law to other programs, beside [`export_laws!`](crate::export_laws):
/// `abi::export_foreign!(continuum Soil);` exports the MFront behaviour `Soil`, and the entries of
/// Abaqus and CalculiX user materials; `abi::export_foreign!(interface Joint);` the behaviour
/// `Joint`. A law that does not offer all of the hypotheses names those it offers, in MFront's
/// words: `abi::export_foreign!(continuum Layer in PlaneStrain Axisymmetrical);`.
///
/// With the names of all material properties and parameters, in MFront's spelling and in their order,
/// defaults and bounds are exported too; a name that does not fit is refused when the law is compiled:
/// `abi::export_foreign!(interface Joint, properties: [NormalStiffness], parameters: [Cohesion]);`.
///
/// A library holds one entry for user materials: with several laws for solids, name the one that
/// it is for with [`export_umat!`](crate::export_umat), and export the behaviours of all of them with
/// [`export_mfront!`](crate::export_mfront).
#[macro_export]
macro_rules! export_foreign {
    (continuum $law:ident $($hypotheses:tt)*) => {
        $crate::export_mfront!(continuum $law $($hypotheses)*);
        $crate::export_umat!($law);
    };
    (interface $law:ident $($names:tt)*) => {
        $crate::export_mfront!(interface $law $($names)*);
    };
}

/// Most parameters of a law that is exported to other programs.
pub const MOST_PARAMETERS: usize = 64;
/// Most sets of parameters that an entry keeps a law for.
pub const MOST_LAWS: usize = 4096;
const N_BUCKETS: usize = 256;

/// One point as another program gives it.
#[derive(Debug)]
pub struct Point {
    /// Number of components of gradient and flux.
    pub(super) n_components: usize,
    /// Gradient at the start.
    pub(super) gradient: [f64; 6],
    /// Its increment.
    pub(super) increment: [f64; 6],
    /// Flux at the start.
    pub(super) flux: [f64; 6],
    /// Internal variables at the start and at the end, which may be one place; valid for as many
    /// values as the law declares.
    pub(super) state0: *const f64,
    pub(super) state1: *mut f64,
    /// Time at the start.
    pub(super) time: f64,
    /// Time increment.
    pub(super) time_increment: f64,
}

/// The point at the end of the increment; the internal variables are written where it says.
#[derive(Debug)]
pub struct Answer {
    pub(super) flux: [f64; 6],
    /// Row by row, n × n values; zero unless requested.
    pub(super) operator: [f64; 36],
    pub(super) unreliable: Option<&'static str>,
}

fn first<const N: usize>(values: &[f64; 6]) -> [f64; N] {
    std::array::from_fn(|i| values[i])
}

/// Internal variables at the start. Other programs start them from zero, so where all of them are,
/// the point has not begun: they are then the law's own for the flux it carries.
fn start<S: InternalVariables>(
    point: &Point,
    initial: impl FnOnce() -> Result<S, Failure>,
) -> Result<S, Failure> {
    let n = S::TABLE.len();
    // SAFETY: `Point::state0` holds as many values as the table.
    let value = |v: usize| unsafe { *point.state0.add(v) };
    let mut defects = 0.0;
    let mut begun = n == 0;
    for v in 0..n {
        defects += 0.0 * value(v);
        begun |= value(v) != 0.0;
    }
    let whole = |values: &[f64; 6]| defect(&values[..point.n_components]);
    if whole(&point.gradient) + whole(&point.increment) + whole(&point.flux) + defects != 0.0 {
        return Err(INPUT_NOT_FINITE);
    }
    if begun {
        let declared = |v: usize| {
            super::assert_declared::<S>(v);
            value(v)
        };
        Ok(S::read(declared))
    } else {
        initial()
    }
}

fn end<const N: usize, S: InternalVariables>(
    point: &Point,
    flux: &[f64; N],
    state: &S,
    tangent: Option<&[[f64; N]; N]>,
    unreliable: Option<&'static str>,
) -> Result<Answer, Failure> {
    let mut defects = defect(flux);
    state.write(|_, value| defects += 0.0 * value);
    let mut answer = Answer {
        flux: [0.0; 6],
        operator: [0.0; 36],
        unreliable,
    };
    answer.flux[..N].copy_from_slice(flux);
    if let Some(tangent) = tangent {
        defects += defect(tangent.as_flattened());
        answer.operator[..N * N].copy_from_slice(tangent.as_flattened());
    }
    if defects != 0.0 {
        return Err(Failure::Numeric("a result is not finite"));
    }
    state.write(|v, value| {
        super::assert_declared::<S>(v);
        // SAFETY: `Point::state1` holds as many values as the table.
        unsafe { *point.state1.add(v) = value };
    });
    Ok(answer)
}

pub(super) fn carry_solid<L: ContinuumLaw, const N: usize>(
    law: &L,
    point: &Point,
    tangent: Tangent,
) -> Result<Answer, Failure> {
    let stress = first::<N>(&point.flux);
    let solid = SolidPoint {
        strain: first(&point.gradient),
        strain_increment: first(&point.increment),
        stress,
        state: start(point, || law.initial_state::<N>(&stress))?,
        time: point.time,
        time_increment: point.time_increment,
    };
    let SolidResponse {
        stress,
        state,
        tangent: operator,
        unreliable,
    } = law.update::<N>(&solid, tangent)?;
    let operator = (tangent != Tangent::None).then_some(&operator);
    end(point, &stress, &state, operator, unreliable)
}

pub(super) fn carry_interface<L: InterfaceLaw>(
    law: &L,
    point: &Point,
    tangent: Tangent,
) -> Result<Answer, Failure> {
    let traction = first::<2>(&point.flux);
    let interface = InterfacePoint {
        jump: first(&point.gradient),
        jump_increment: first(&point.increment),
        traction,
        state: start(point, || law.initial_state(&traction))?,
        time: point.time,
        time_increment: point.time_increment,
    };
    let response = law.update(&interface, tangent)?;
    let operator = (tangent != Tangent::None).then_some(&response.tangent);
    end(
        point,
        &response.traction,
        &response.state,
        operator,
        response.unreliable,
    )
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

/// Why a call gave nothing.
#[derive(Clone, Copy, Debug)]
pub(super) enum Trouble<'a> {
    /// The parameters were refused, for this reason.
    Refused(&'a str),
    /// The law gave up on the point.
    Failed(Failure),
    /// The law panicked now, or before.
    Panicked,
}

impl Trouble<'_> {
    /// The part of the increment that the law believes it can follow; a quarter if it does not say.
    pub(super) fn factor(self) -> f64 {
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

    fn carry(&self, point: &Point, tangent: Tangent) -> Result<Answer, Trouble<'_>> {
        let law = self.law.as_ref().map_err(|why| Trouble::Refused(why))?;
        if self.poisoned.load(Ordering::Relaxed) {
            return Err(Trouble::Panicked);
        }
        catch_unwind(AssertUnwindSafe(|| law.carry(point, tangent)))
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
pub(super) const fn has_default(parameter: &Parameter) -> bool {
    !parameter.raw().default_value.is_nan() || parameter.raw().flags & raw::PILUM_P_OPTIONAL != 0
}

fn id(parameter: &Parameter) -> &'static str {
    // SAFETY: a `Parameter` can only be made from static strings.
    let id = unsafe { CStr::from_ptr(parameter.raw().id) };
    id.to_str().unwrap_or("parameter")
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
    pub(super) fn carry(
        &self,
        given: &[f64],
        point: &Point,
        tangent: Tangent,
        tell: impl FnOnce(Trouble<'_>),
    ) -> Option<Answer> {
        let bucket = &self.buckets[hash(given) % N_BUCKETS];
        let head = bucket.load(Ordering::Acquire);
        let outcome = if let Some(built) = find(head, given) {
            built.carry(point, tangent)
        } else if self.n.fetch_add(1, Ordering::Relaxed) < MOST_LAWS {
            keep(bucket, head, given).carry(point, tangent)
        } else {
            self.n.fetch_sub(1, Ordering::Relaxed);
            let built = Built::<L>::new(given);
            return built.carry(point, tangent).map_err(tell).ok();
        };
        outcome.map_err(tell).ok()
    }
}

impl<L: Exported> Default for Laws<L> {
    fn default() -> Self {
        Self::new()
    }
}

fn hash(values: &[f64]) -> usize {
    let mixed = values.iter().fold(0u64, |hash, value| {
        (hash ^ value.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15)
    });
    // Round numbers end in zeros, and so do their products: the leading bits differ.
    (mixed >> 56) as usize
}

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

/// Builds a law and puts it at the head of the list. Two threads may keep the same one twice.
fn keep<'a, L: Exported>(
    bucket: &AtomicPtr<Kept<L>>,
    mut head: *mut Kept<L>,
    given: &[f64],
) -> &'a Built<L> {
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
    unsafe { &(*kept).built }
}

/// Says something on the standard error stream, the only channel of a program that takes no
/// messages; at most 20 lines from a library.
pub(super) fn complain(law: &CStr, text: fmt::Arguments<'_>) {
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
pub(super) unsafe fn tell(p: *mut std::ffi::c_char, text: fmt::Arguments<'_>) {
    // SAFETY: passed on to the caller.
    unsafe { Message::new(p, 512) }.write(text);
}
