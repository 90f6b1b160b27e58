//! From the C boundary to the traits of [`law`](crate::law) and back: pointers become arrays,
//! failures become status codes and messages, panics stop here. This file and [`access`](crate::access)
//! hold the `unsafe` code of the contract; a law's crate forbids it and uses
//! [`export_laws!`](crate::export_laws).
#![expect(unsafe_code, reason = "the plugin's side of the C boundary")]

mod adapter;

pub use adapter::{Continuum, Exported, Interface};

use crate::access::{Access, Directions, Message, is_packed, known, known_rates, panic_text};
use crate::access::{requested, within_bounds};
use crate::descriptor::{Description, Hypothesis, Parameters};
use crate::law::{Failure, Tangent};
use crate::raw::{self, Batch, Host, Instance, Rates, Status};
use crate::status::most_severe;
use std::cell::Cell;
use std::ffi::c_char;
use std::mem::{forget, offset_of, size_of};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

/// Exports laws from a `cdylib` crate:
/// `abi::export_laws!(interface Joint, continuum Soil);`.
#[macro_export]
macro_rules! export_laws {
    ($($kind:ident $law:ty),+ $(,)?) => {
        #[cfg(not(panic = "unwind"))]
        compile_error!("laws need `panic = \"unwind\"`: a panic must be caught at the boundary");

        const _: () = {
            #[unsafe(export_name = "pilum_magic")]
            pub static MAGIC: $crate::raw::MagicBlock = $crate::version::MAGIC_BLOCK;

            const LAWS: &[*const $crate::raw::Law] = &[ $( {
                static LAW: $crate::export::Shared<$crate::raw::Law> =
                    $crate::export::Shared::new($crate::export_laws!(@law $kind $law));
                LAW.as_ptr()
            } ),+ ];
            static PLUGIN: $crate::export::Shared<$crate::raw::Plugin> =
                $crate::export::Shared::new($crate::export::plugin(LAWS));

            #[unsafe(export_name = "pilum_entry")]
            pub extern "C" fn entry(_: *const $crate::raw::Host) -> *const $crate::raw::Plugin {
                PLUGIN.as_ptr()
            }

            // Which laws are here, readable without running anything.
            #[used]
            #[cfg_attr(target_vendor = "apple", unsafe(link_section = "__DATA,__pilum"))]
            #[cfg_attr(not(target_vendor = "apple"), unsafe(link_section = ".pilum"))]
            static MANIFEST: [u8; $crate::export::MANIFEST_SIZE] =
                $crate::export::manifest(&[ $( <$law>::DESCRIPTION ),+ ]);

            $crate::export_rust_layout!();
            use $crate::law::{ContinuumLaw as _, InterfaceLaw as _};
        };
    };
    (@law continuum $law:ty) => { $crate::export::law::<$crate::export::Continuum<$law>>() };
    (@law interface $law:ty) => { $crate::export::law::<$crate::export::Interface<$law>>() };
}

/// Exports the description for the Rust-to-Rust check.
#[cfg(feature = "abi_stable")]
#[doc(hidden)]
#[macro_export]
macro_rules! export_rust_layout {
    () => {
        #[unsafe(export_name = "pilum_rust_layout_1_1")]
        pub static RUST_LAYOUT: $crate::export::Shared<$crate::raw::RustLayout> =
            $crate::export::Shared::new($crate::layout::RUST_LAYOUT);
    };
}

/// Nothing to export without `abi_stable`.
#[cfg(not(feature = "abi_stable"))]
#[doc(hidden)]
#[macro_export]
macro_rules! export_rust_layout {
    () => {};
}

/// Size of the manifest in the section `.pilum` (`__DATA,__pilum` on Apple systems).
pub const MANIFEST_SIZE: usize = 1024;

/// The manifest: `pilum 1`, then one line `<id> <version>` for each law, padded with NUL.
pub const fn manifest(laws: &[Description]) -> [u8; MANIFEST_SIZE] {
    const fn push(out: &mut [u8; MANIFEST_SIZE], mut at: usize, text: &[u8], end: u8) -> usize {
        let mut i = 0;
        while i < text.len() {
            out[at] = text[i];
            at += 1;
            i += 1;
        }
        out[at] = end;
        at + 1
    }
    let mut out = [0; MANIFEST_SIZE];
    let mut at = push(&mut out, 0, b"pilum 1", b'\n');
    let mut l = 0;
    while l < laws.len() {
        at = push(&mut out, at, laws[l].id.to_bytes(), b' ');
        at = push(&mut out, at, laws[l].version.to_bytes(), b'\n');
        l += 1;
    }
    out
}

/// A description in static storage. It holds pointers, all of them to static data.
#[repr(transparent)]
#[derive(Debug)]
pub struct Shared<T>(T);

// SAFETY: plain data that nothing changes; what its pointers lead to is only read in `unsafe`.
unsafe impl Sync for Shared<raw::Law> {}
// SAFETY: as above.
unsafe impl Sync for Shared<raw::Plugin> {}
// SAFETY: as above.
#[cfg(feature = "abi_stable")]
unsafe impl Sync for Shared<raw::RustLayout> {}

impl<T> Shared<T> {
    /// Wraps a description.
    pub const fn new(value: T) -> Self {
        Self(value)
    }

    /// Place of the description.
    pub const fn as_ptr(&self) -> *const T {
        &raw const self.0
    }
}

/// The description of a library with these laws.
pub const fn plugin(laws: &'static [*const raw::Law]) -> raw::Plugin {
    raw::Plugin {
        struct_size: size_of::<raw::Plugin>() as u32,
        n_laws: laws.len() as u32,
        law: laws.as_ptr(),
        get_extension: None,
    }
}

/// A law in C's terms.
pub const fn law<L: Exported>() -> raw::Law {
    let description = L::DESCRIPTION;
    let parameters = <L::Parameters as Parameters>::TABLE;
    raw::Law {
        struct_size: size_of::<raw::Law>() as u32,
        flags: 0,
        n_parameters: parameters.len() as u32,
        n_formulations: L::FORMULATIONS.len() as u32,
        id: description.id.as_ptr(),
        name: description.name.as_ptr(),
        version: description.version.as_ptr(),
        author: description.author.as_ptr(),
        licence: description.licence.as_ptr(),
        doc: description.doc.as_ptr(),
        references: description.references.as_ptr(),
        parameter: parameters.as_ptr().cast(),
        formulation: L::FORMULATIONS.as_ptr(),
        create: Some(create::<L>),
        init_state: Some(init_state::<L>),
        integrate: Some(integrate::<L>),
        destroy: Some(destroy::<L>),
    }
}

/// What hides behind [`raw::Instance`].
struct Boxed<L> {
    law: L,
    n_components: usize,
    n_states: usize,
    /// `PILUM_T_*` flags of the formulation.
    flags: u32,
    /// A panic was caught: the law is defective and is not called again.
    poisoned: AtomicBool,
}

/// A law with these parameters.
///
/// # Errors
/// Why there is none, and as what status.
fn built<L: Exported>(values: &[f64]) -> Result<L, (Status, String)> {
    if let Err((id, value)) = within_bounds(<L::Parameters as Parameters>::TABLE, values) {
        let why = format!("{id}: {value} is not admissible");
        return Err((raw::PILUM_E_PARAMETER, why));
    }
    let law = catch_unwind(|| L::new(L::Parameters::read(values))).map_err(|payload| {
        let why = format!("panicked in `new`: {}", panic_text(&*payload));
        (raw::PILUM_E_INTERNAL, why)
    })?;
    law.map_err(|reason| (raw::PILUM_E_PARAMETER, reason))
}

unsafe extern "C" fn create<L: Exported>(
    _: *const raw::Law,
    _: *const Host,
    formulation: u32,
    parameter: *const f64,
    given: u32,
    out: *mut *mut Instance,
    message: *mut c_char,
    message_capacity: usize,
) -> Status {
    // SAFETY: contract of `create`: null, or `message_capacity` bytes.
    let mut message = unsafe { Message::new(message, message_capacity) };
    let n = <L::Parameters as Parameters>::TABLE.len();
    let Some(formulation) = L::FORMULATIONS.get(formulation as usize) else {
        message.write(format_args!("there is no formulation number {formulation}"));
        return raw::PILUM_E_ARGUMENT;
    };
    if given as usize != n || out.is_null() {
        message.write(format_args!("{given} parameters given, {n} expected"));
        return raw::PILUM_E_ARGUMENT;
    }
    let values: &[f64] = if n == 0 {
        &[]
    } else if parameter.is_null() {
        message.write(format_args!("the parameters are null"));
        return raw::PILUM_E_ARGUMENT;
    } else {
        // SAFETY: contract of `create`: `parameter` holds so many values.
        unsafe { std::slice::from_raw_parts(parameter, n) }
    };
    match built::<L>(values) {
        Ok(law) => {
            let hypothesis = Hypothesis::from_code(formulation.hypothesis);
            let boxed = Boxed {
                law,
                n_components: hypothesis.map_or(0, Hypothesis::n_components),
                n_states: formulation.n_states as usize,
                flags: formulation.flags,
                poisoned: AtomicBool::new(false),
            };
            // SAFETY: contract of `create`: `out` is valid for one pointer.
            unsafe { out.write(Box::into_raw(Box::new(boxed)).cast()) };
            raw::PILUM_OK
        }
        Err((status, why)) => {
            message.write(format_args!("{why}"));
            status
        }
    }
}

unsafe extern "C" fn destroy<L: Exported>(instance: *mut Instance) {
    if !instance.is_null() {
        // SAFETY: contract of `destroy`: the pointer came from `create` and is not used again.
        let boxed = unsafe { Box::from_raw(instance.cast::<Boxed<L>>()) };
        // There is nobody to tell. Dropping the payload could panic again.
        if let Err(payload) = catch_unwind(AssertUnwindSafe(|| drop(boxed))) {
            forget(payload);
        }
    }
}

unsafe extern "C" fn init_state<L: Exported>(
    instance: *const Instance,
    batch: *const Batch,
) -> Status {
    // SAFETY: contract of `init_state`: both pointers are valid for this call.
    unsafe { run::<L>(instance, batch, Work::Init) }
}

unsafe extern "C" fn integrate<L: Exported>(
    instance: *const Instance,
    batch: *const Batch,
) -> Status {
    // SAFETY: contract of `integrate`: both pointers are valid for this call.
    unsafe { run::<L>(instance, batch, Work::Integrate) }
}

#[derive(Clone, Copy, PartialEq)]
enum Work {
    Init,
    Integrate,
}

impl Work {
    /// Computes rates at one point.
    fn rates_at<L: Exported, const PACKED: bool>(
        self,
        law: &L,
        access: &Access<'_, PACKED>,
        rates: &Directions<'_>,
        i: usize,
    ) -> Result<(), Failure> {
        match self {
            Self::Init => law.initial_rates(access, rates, i),
            Self::Integrate => law.rates(access, rates, i),
        }
    }

    /// Does the work at one point. With the request as a constant, what it does not ask for costs
    /// nothing.
    #[inline]
    fn at<L: Exported, const PACKED: bool>(
        self,
        law: &L,
        access: &Access<'_, PACKED>,
        i: usize,
    ) -> Result<Option<&'static str>, Failure> {
        match (self, access.tangent) {
            (Self::Init, _) => law.init(access, i).map(|()| None),
            (_, Tangent::None) => law.update(access, i, Tangent::None),
            (_, Tangent::Elastic) => law.update(access, i, Tangent::Elastic),
            (_, Tangent::Consistent) => law.update(access, i, Tangent::Consistent),
        }
    }
}

/// Does the work on every point of the batch and writes outcomes and one message.
///
/// # Safety
/// `instance` is null or came from `create::<L>`; `batch` is null or as [`Batch`] promises.
unsafe fn run<L: Exported>(instance: *const Instance, batch: *const Batch, work: Work) -> Status {
    // SAFETY: null or valid, see above.
    let Some(batch) = (unsafe { known(batch) }) else {
        // A batch too short for version 1.0 does not tell where its message is.
        return raw::PILUM_E_ARGUMENT;
    };
    // SAFETY: contract of `Batch::message`: null, or `message_capacity` bytes.
    let mut message = unsafe { Message::new(batch.message, batch.message_capacity) };
    // SAFETY: null or valid, see above.
    let Some(boxed) = (unsafe { instance.cast::<Boxed<L>>().as_ref() }) else {
        message.write(format_args!("the instance is null"));
        return raw::PILUM_E_ARGUMENT;
    };
    let rates = if batch.request & raw::PILUM_REQ_RATES == 0 {
        None
    } else {
        // SAFETY: contract of `Batch::rates`: null or valid.
        unsafe { known_rates(batch.rates) }
    };
    if let Err((status, why)) = check(&batch, rates.as_ref(), boxed, work) {
        message.write(format_args!("{why}"));
        return status;
    }
    let n_parameters = <L::Parameters as Parameters>::TABLE.len();
    // SAFETY: contract of `Rates::parameter`: null, or as many values as parameters are declared.
    let rates = rates
        .as_ref()
        .map(|rates| unsafe { Directions::new(rates, n_parameters) });
    let rates = rates.as_ref();
    if boxed.poisoned.load(Ordering::Relaxed) {
        message.write(format_args!(
            "the law panicked before and is not called again"
        ));
        return raw::PILUM_E_INTERNAL;
    }
    let n = boxed.n_components;
    if is_packed(&batch) {
        run_points(boxed, &Access::<true>::new(&batch, n), rates, work, message)
    } else {
        run_points(
            boxed,
            &Access::<false>::new(&batch, n),
            rates,
            work,
            message,
        )
    }
}

/// The loop over the points, inside one guard against panics.
fn run_points<L: Exported, const PACKED: bool>(
    boxed: &Boxed<L>,
    access: &Access<'_, PACKED>,
    rates: Option<&Directions<'_>>,
    work: Work,
    mut message: Message,
) -> Status {
    let batch = access.batch;
    let number = |i: usize| batch.first_point.wrapping_add(i as u64);
    let current = Cell::new(0);
    let result = catch_unwind(AssertUnwindSafe(|| {
        let mut worst = raw::PILUM_OK;
        for i in 0..batch.n_points as usize {
            current.set(i);
            let mut outcome = work.at(&boxed.law, access, i);
            if let (Ok(_), Some(rates)) = (outcome, rates)
                && let Err(failure) = work.rates_at(&boxed.law, access, rates, i)
            {
                outcome = Err(failure);
            }
            if let Ok(None) = outcome {
                access.put_status(i, raw::PILUM_OK);
                continue;
            }
            let (status, reason) = match outcome {
                Ok(reason) => (raw::PILUM_OK_UNRELIABLE, reason.unwrap_or_default()),
                Err(failure) => (code(failure), failure.reason()),
            };
            access.put_status(i, status);
            access.put_step_factor(i, outcome.err());
            if most_severe(worst, status) != worst {
                worst = status;
                message.write(format_args!("point {}: {reason}", number(i)));
            }
        }
        worst
    }));
    result.unwrap_or_else(|payload| {
        boxed.poisoned.store(true, Ordering::Relaxed);
        let (point, text) = (number(current.get()), panic_text(&*payload));
        message.write(format_args!("point {point}: panicked: {text}"));
        for i in current.get()..batch.n_points as usize {
            access.put_status(i, raw::PILUM_E_INTERNAL);
        }
        raw::PILUM_E_INTERNAL
    })
}

fn code(failure: Failure) -> Status {
    match failure {
        Failure::CutStep { .. } => raw::PILUM_CUT_STEP,
        Failure::Domain(_) => raw::PILUM_E_DOMAIN,
        Failure::Numeric(_) => raw::PILUM_E_NUMERIC,
    }
}

/// Refuses a batch that cannot be worked on.
fn check<L>(
    batch: &Batch,
    rates: Option<&Rates>,
    boxed: &Boxed<L>,
    work: Work,
) -> Result<(), (Status, &'static str)> {
    const KNOWN: u32 = raw::PILUM_REQ_FLUX
        | raw::PILUM_REQ_TANGENT
        | raw::PILUM_REQ_ELASTIC
        | raw::PILUM_REQ_RATES;
    if batch.request & !KNOWN != 0 {
        return Err((raw::PILUM_E_UNSUPPORTED, "an unknown request"));
    }
    let wants_rates = batch.request & raw::PILUM_REQ_RATES != 0;
    let knows_rates = batch.struct_size as usize >= offset_of!(Batch, rates) + size_of::<usize>();
    if wants_rates && (boxed.flags & raw::PILUM_T_RATES == 0 || !knows_rates) {
        return Err((raw::PILUM_E_UNSUPPORTED, "rates are not offered"));
    }
    let has_tangent = boxed.flags & raw::PILUM_T_NO_TANGENT == 0;
    if requested(batch) == Tangent::Consistent && !has_tangent {
        let why = "the law has the elastic operator only";
        return Err((raw::PILUM_E_UNSUPPORTED, why));
    }
    let n_states = boxed.n_states;
    let integrating = work == Work::Integrate;
    let null = batch.n_points > 0
        && (batch.flux0.p.is_null()
            || (n_states > 0 && batch.state1.p.is_null())
            || (integrating
                && (batch.gradient0.p.is_null()
                    || batch.gradient1.p.is_null()
                    || batch.flux1.p.is_null()
                    || (n_states > 0 && batch.state0.p.is_null())
                    || (requested(batch) != Tangent::None && batch.tangent.p.is_null()))));
    let no_rates = wants_rates
        && rates.is_none_or(|rates| {
            batch.n_points > 0
                && (rates.flux0.p.is_null()
                    || (n_states > 0 && rates.state1.p.is_null())
                    || (integrating
                        && (rates.gradient0.p.is_null()
                            || rates.gradient1.p.is_null()
                            || rates.flux1.p.is_null()
                            || (n_states > 0 && rates.state0.p.is_null()))))
        });
    if null || no_rates {
        return Err((raw::PILUM_E_ARGUMENT, "a view that is needed is null"));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
