//! From the C boundary to the traits of [`law`](crate::law) and back: pointers become arrays,
//! failures become status codes and messages, panics stop here. This file with its modules is one of
//! the two places of the project that hold `unsafe` code; a law's crate forbids it and uses
//! [`export_laws!`](crate::export_laws). The modules export the same laws to other programs, with
//! [`export_foreign!`](crate::export_foreign).
#![expect(
    unsafe_code,
    clippy::multiple_unsafe_ops_per_block,
    reason = "the plugin's side of the C boundary; offset and access are one operation"
)]

pub mod calculix;
pub mod foreign;
pub mod mfront;
pub mod umat;

use crate::descriptor::{
    Description, Hypothesis, InternalVariables, Parameter, Parameters, Variable,
};
use crate::law::{
    ContinuumLaw, Failure, InterfaceLaw, InterfacePoint, SolidPoint, SolidResponse, Tangent,
};
use crate::raw::{self, Batch, Formulation, Host, Instance, Status, View, ViewMut};
use crate::status::most_severe;
use crate::version::BATCH_SIZE_1_0;
use std::any::Any;
use std::cell::Cell;
use std::ffi::{CStr, c_char};
use std::fmt::{self, Write};
use std::marker::PhantomData;
use std::mem::{MaybeUninit, forget, size_of};
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
        #[unsafe(export_name = "pilum_rust_layout")]
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

    /// Where the description stands.
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

mod sealed {
    /// Keeps [`Exported`](super::Exported) to this file: its formulations are pointers.
    pub trait Sealed {}
    impl<L> Sealed for super::Continuum<L> {}
    impl<L> Sealed for super::Interface<L> {}
}

/// What the boundary needs of a law, whichever trait its author chose.
pub trait Exported: sealed::Sealed + Sized + Send + Sync + 'static {
    /// What the law is called.
    const DESCRIPTION: Description;
    /// Parameters.
    type Parameters: Parameters;
    /// Formulations.
    const FORMULATIONS: &'static [Formulation];
    /// Internal variables, the same in all formulations.
    const STATE: &'static [Variable];
    /// Fixes the parameters.
    ///
    /// # Errors
    /// The message, starting with the parameter's id and a colon.
    fn new(parameters: Self::Parameters) -> Result<Self, String>;
    /// Initial internal variables of point `i`.
    ///
    /// # Errors
    /// Why the law cannot start there.
    fn init<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        i: usize,
    ) -> Result<(), Failure>;
    /// Carries point `i` over the increment.
    ///
    /// # Errors
    /// Why it cannot.
    fn update<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        i: usize,
        tangent: Tangent,
    ) -> Result<Option<&'static str>, Failure>;
    /// Carries one point of another program over its increment.
    ///
    /// # Errors
    /// Why it cannot; nothing is written then.
    fn carry(&self, point: &foreign::Point, tangent: Tangent) -> Result<foreign::Answer, Failure>;
}

/// Adapter for laws of solids.
#[derive(Debug)]
pub struct Continuum<L>(L);

/// Adapter for laws of interfaces.
#[derive(Debug)]
pub struct Interface<L>(L);

struct ContinuumFormulations<L>(PhantomData<L>);

impl<L: ContinuumLaw> ContinuumFormulations<L> {
    const FLAGS: u32 = flag(L::SYMMETRIC, raw::PILUM_T_SYMMETRIC)
        | flag(L::LINEAR, raw::PILUM_T_LINEAR)
        | flag(L::LOCAL_AXES, raw::PILUM_T_LOCAL_AXES);
    const TABLE: [Formulation; 3] = {
        assert_solid(L::HYPOTHESES);
        let state = <L::State as InternalVariables>::TABLE;
        let mut table = [Formulation::new(L::HYPOTHESES[0], Self::FLAGS, state); 3];
        let mut i = 1;
        while i < L::HYPOTHESES.len() {
            table[i] = Formulation::new(L::HYPOTHESES[i], Self::FLAGS, state);
            i += 1;
        }
        table
    };
}

/// Refuses hypotheses whose points a law for solids cannot read: what it is called with has four
/// or six components.
///
/// # Panics
/// At compile time, where a law is exported.
const fn assert_solid(hypotheses: &[Hypothesis]) {
    assert!(!hypotheses.is_empty(), "`HYPOTHESES` is empty");
    assert!(
        hypotheses.len() <= 3,
        "`HYPOTHESES` has more than three entries"
    );
    let mut i = 0;
    while i < hypotheses.len() {
        assert!(
            !matches!(hypotheses[i], Hypothesis::Interface2d),
            "`HYPOTHESES` of a `ContinuumLaw` holds an interface: implement `InterfaceLaw`"
        );
        i += 1;
    }
}

const fn flag(set: bool, bit: u32) -> u32 {
    if set { bit } else { 0 }
}

impl<L: ContinuumLaw> Exported for Continuum<L> {
    const DESCRIPTION: Description = L::DESCRIPTION;
    type Parameters = L::Parameters;
    const FORMULATIONS: &'static [Formulation] = ContinuumFormulations::<L>::TABLE
        .split_at(L::HYPOTHESES.len())
        .0;
    const STATE: &'static [Variable] = <L::State as InternalVariables>::TABLE;

    fn new(parameters: L::Parameters) -> Result<Self, String> {
        L::new(parameters)
            .map(Self)
            .map_err(|refusal| refusal.to_string())
    }

    fn init<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        i: usize,
    ) -> Result<(), Failure> {
        let state = if access.n_components == 6 {
            self.0.initial_state::<6>(&access.flux0(i)?)?
        } else {
            self.0.initial_state::<4>(&access.flux0(i)?)?
        };
        access.put_state(i, &state);
        Ok(())
    }

    #[inline]
    fn update<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        i: usize,
        tangent: Tangent,
    ) -> Result<Option<&'static str>, Failure> {
        if access.n_components == 6 {
            update_solid::<L, 6, PACKED>(&self.0, access, i, tangent)
        } else {
            update_solid::<L, 4, PACKED>(&self.0, access, i, tangent)
        }
    }

    fn carry(&self, point: &foreign::Point, tangent: Tangent) -> Result<foreign::Answer, Failure> {
        if point.n_components == 6 {
            foreign::carry_solid::<L, 6>(&self.0, point, tangent)
        } else {
            foreign::carry_solid::<L, 4>(&self.0, point, tangent)
        }
    }
}

#[inline]
fn update_solid<L: ContinuumLaw, const N: usize, const PACKED: bool>(
    law: &L,
    access: &Access<'_, PACKED>,
    i: usize,
    tangent: Tangent,
) -> Result<Option<&'static str>, Failure> {
    let start = access.start::<N, L::State>(i)?;
    let point = SolidPoint {
        strain: start.gradient,
        strain_increment: start.gradient_increment,
        stress: start.flux,
        state: start.state,
        time: access.batch.time,
        time_increment: access.batch.time_increment,
    };
    let SolidResponse {
        stress,
        state,
        tangent: operator,
        unreliable,
    } = law.update::<N>(&point, tangent)?;
    access.put(
        i,
        &stress,
        &state,
        (tangent != Tangent::None).then_some(&operator),
    )?;
    Ok(unreliable)
}

impl<L: InterfaceLaw> Interface<L> {
    const FLAGS: u32 =
        flag(L::SYMMETRIC, raw::PILUM_T_SYMMETRIC) | flag(L::LINEAR, raw::PILUM_T_LINEAR);
    const TABLE: [Formulation; 1] = [Formulation::new(
        Hypothesis::Interface2d,
        Self::FLAGS,
        <L::State as InternalVariables>::TABLE,
    )];
}

impl<L: InterfaceLaw> Exported for Interface<L> {
    const DESCRIPTION: Description = L::DESCRIPTION;
    type Parameters = L::Parameters;
    const FORMULATIONS: &'static [Formulation] = &Self::TABLE;
    const STATE: &'static [Variable] = <L::State as InternalVariables>::TABLE;

    fn new(parameters: L::Parameters) -> Result<Self, String> {
        L::new(parameters)
            .map(Self)
            .map_err(|refusal| refusal.to_string())
    }

    fn init<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        i: usize,
    ) -> Result<(), Failure> {
        let state = self.0.initial_state(&access.flux0(i)?)?;
        access.put_state(i, &state);
        Ok(())
    }

    #[inline]
    fn update<const PACKED: bool>(
        &self,
        access: &Access<'_, PACKED>,
        i: usize,
        tangent: Tangent,
    ) -> Result<Option<&'static str>, Failure> {
        let start = access.start(i)?;
        let point = InterfacePoint {
            jump: start.gradient,
            jump_increment: start.gradient_increment,
            traction: start.flux,
            state: start.state,
            time: access.batch.time,
            time_increment: access.batch.time_increment,
        };
        let end = self.0.update(&point, tangent)?;
        access.put(
            i,
            &end.traction,
            &end.state,
            (tangent != Tangent::None).then_some(&end.tangent),
        )?;
        Ok(end.unreliable)
    }

    fn carry(&self, point: &foreign::Point, tangent: Tangent) -> Result<foreign::Answer, Failure> {
        foreign::carry_interface(&self.0, point, tangent)
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
    /// A panic was caught: the law is defective and is not called again.
    poisoned: AtomicBool,
}

unsafe extern "C" fn create<L: Exported>(
    _: *const raw::Law,
    _: *const Host,
    formulation: u32,
    parameter: *const f64,
    n_parameters: u32,
    out: *mut *mut Instance,
    message: *mut c_char,
    message_capacity: usize,
) -> Status {
    // SAFETY: contract of `create`: null, or `message_capacity` bytes.
    let mut message = unsafe { Message::new(message, message_capacity) };
    let table = <L::Parameters as Parameters>::TABLE;
    let Some(formulation) = L::FORMULATIONS.get(formulation as usize) else {
        message.write(format_args!("there is no formulation number {formulation}"));
        return raw::PILUM_E_ARGUMENT;
    };
    if n_parameters as usize != table.len() || out.is_null() {
        message.write(format_args!(
            "{n_parameters} parameters given, {} expected",
            table.len()
        ));
        return raw::PILUM_E_ARGUMENT;
    }
    let values: &[f64] = if table.is_empty() {
        &[]
    } else if parameter.is_null() {
        message.write(format_args!("the parameters are null"));
        return raw::PILUM_E_ARGUMENT;
    } else {
        // SAFETY: contract of `create`: `parameter` holds `n_parameters` values.
        unsafe { std::slice::from_raw_parts(parameter, table.len()) }
    };
    if let Err((id, value)) = within_bounds(table, values) {
        message.write(format_args!("{id}: {value} is not admissible"));
        return raw::PILUM_E_PARAMETER;
    }
    match catch_unwind(|| L::new(L::Parameters::read(values))) {
        Ok(Ok(law)) => {
            let boxed = Boxed {
                law,
                n_components: Hypothesis::from_code(formulation.hypothesis)
                    .map_or(0, Hypothesis::n_components),
                n_states: formulation.n_states as usize,
                poisoned: AtomicBool::new(false),
            };
            // SAFETY: contract of `create`: `out` is valid for one pointer.
            unsafe { out.write(Box::into_raw(Box::new(boxed)).cast()) };
            raw::PILUM_OK
        }
        Ok(Err(reason)) => {
            message.write(format_args!("{reason}"));
            raw::PILUM_E_PARAMETER
        }
        Err(payload) => {
            message.write(format_args!("panicked in `new`: {}", panic_text(&*payload)));
            raw::PILUM_E_INTERNAL
        }
    }
}

/// The first parameter outside its declared bounds. The host checks them too and says it better;
/// this keeps the law sound under any host.
fn within_bounds(table: &[Parameter], values: &[f64]) -> Result<(), (&'static str, f64)> {
    for (declared, &value) in table.iter().map(Parameter::raw).zip(values) {
        let left_out = value.is_nan() && declared.flags & raw::PILUM_P_OPTIONAL != 0;
        let below = if declared.flags & raw::PILUM_P_OPEN_LOWER != 0 {
            value <= declared.lower
        } else {
            value < declared.lower
        };
        let above = if declared.flags & raw::PILUM_P_OPEN_UPPER != 0 {
            value >= declared.upper
        } else {
            value > declared.upper
        };
        let between_labels = !declared.choices.is_null() && value.fract() != 0.0;
        if !left_out && (!value.is_finite() || below || above || between_labels) {
            // SAFETY: a `Parameter` can only be made from static strings.
            let id = unsafe { CStr::from_ptr(declared.id) };
            return Err((id.to_str().unwrap_or("parameter"), value));
        }
    }
    Ok(())
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
    if let Err((status, why)) = check(&batch, boxed.n_states, work) {
        message.write(format_args!("{why}"));
        return status;
    }
    if boxed.poisoned.load(Ordering::Relaxed) {
        message.write(format_args!(
            "the law panicked before and is not called again"
        ));
        return raw::PILUM_E_INTERNAL;
    }
    if is_packed(&batch) {
        run_points(boxed, &Access::<true>::new(&batch, boxed), work, message)
    } else {
        run_points(boxed, &Access::<false>::new(&batch, boxed), work, message)
    }
}

/// The loop over the points, inside one guard against panics.
fn run_points<L: Exported, const PACKED: bool>(
    boxed: &Boxed<L>,
    access: &Access<'_, PACKED>,
    work: Work,
    mut message: Message,
) -> Status {
    let batch = access.batch;
    let current = Cell::new(0);
    let result = catch_unwind(AssertUnwindSafe(|| {
        let mut worst = raw::PILUM_OK;
        for i in 0..batch.n_points as usize {
            current.set(i);
            let outcome = work.at(&boxed.law, access, i);
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
                message.write(format_args!(
                    "point {}: {reason}",
                    batch.first_point.wrapping_add(i as u64)
                ));
            }
        }
        worst
    }));
    result.unwrap_or_else(|payload| {
        boxed.poisoned.store(true, Ordering::Relaxed);
        let point = batch.first_point.wrapping_add(current.get() as u64);
        message.write(format_args!(
            "point {point}: panicked: {}",
            panic_text(&*payload)
        ));
        for i in current.get()..batch.n_points as usize {
            access.put_status(i, raw::PILUM_E_INTERNAL);
        }
        raw::PILUM_E_INTERNAL
    })
}

/// The batch as far as its writer knew it: the rule of growing structs in one place. `struct_size`
/// is read before anything else, and no reference to the caller's struct is made, since one would
/// promise all of today's fields. A field later than version 1.0 reads as zero if the writer did
/// not know it. `None`: null, or shorter than version 1.0.
///
/// # Safety
/// `batch` is null or as [`Batch`] promises, for as many bytes as its `struct_size` says.
unsafe fn known(batch: *const Batch) -> Option<Batch> {
    if batch.is_null() {
        return None;
    }
    // SAFETY: contract, "Growing structs": every struct starts with its size as `u32`.
    let size = unsafe { batch.cast::<u32>().read() } as usize;
    if size < BATCH_SIZE_1_0 {
        return None;
    }
    let mut copy = MaybeUninit::<Batch>::zeroed();
    // SAFETY: both sides hold that many bytes; all-zero is a valid `Batch`.
    unsafe {
        batch
            .cast::<u8>()
            .copy_to_nonoverlapping(copy.as_mut_ptr().cast(), size.min(size_of::<Batch>()));
        Some(copy.assume_init())
    }
}

fn code(failure: Failure) -> Status {
    match failure {
        Failure::CutStep { .. } => raw::PILUM_CUT_STEP,
        Failure::Domain(_) => raw::PILUM_E_DOMAIN,
        Failure::Numeric(_) => raw::PILUM_E_NUMERIC,
    }
}

fn panic_text(payload: &(dyn Any + Send)) -> &str {
    payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
}

/// The caller's message buffer.
struct Message {
    p: *mut c_char,
    capacity: usize,
    length: usize,
}

impl Message {
    /// An empty message, so that the buffer ends in NUL whatever happens.
    ///
    /// # Safety
    /// `p` is null or valid for `capacity` bytes as long as the message lives.
    unsafe fn new(p: *mut c_char, capacity: usize) -> Self {
        let mut message = Self {
            p,
            capacity,
            length: 0,
        };
        message.write(format_args!(""));
        message
    }

    /// Replaces the message.
    fn write(&mut self, text: fmt::Arguments<'_>) {
        if !self.p.is_null() && self.capacity > 0 {
            self.length = 0;
            // A message that does not fit is cut short.
            let _ = self.write_fmt(text);
            // SAFETY: `length < capacity` bytes of the caller's buffer are in use.
            unsafe { self.p.add(self.length).write(0) };
        }
    }
}

impl Write for Message {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut fits = text.len().min(self.capacity - 1 - self.length);
        while !text.is_char_boundary(fits) {
            fits -= 1;
        }
        for &byte in &text.as_bytes()[..fits] {
            // SAFETY: `length + 1 < capacity` holds before each byte.
            unsafe { self.p.add(self.length).write(byte as c_char) };
            self.length += 1;
        }
        if fits < text.len() {
            return Err(fmt::Error);
        }
        Ok(())
    }
}

/// Refuses a batch that cannot be worked on.
fn check(batch: &Batch, n_states: usize, work: Work) -> Result<(), (Status, &'static str)> {
    const KNOWN: u32 = raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT | raw::PILUM_REQ_ELASTIC;
    if batch.request & !KNOWN != 0 {
        return Err((raw::PILUM_E_UNSUPPORTED, "an unknown request"));
    }
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
    if null {
        return Err((raw::PILUM_E_ARGUMENT, "a view that is needed is null"));
    }
    Ok(())
}

/// Which operator the host asks for.
fn requested(batch: &Batch) -> Tangent {
    if batch.request & raw::PILUM_REQ_ELASTIC != 0 {
        Tangent::Elastic
    } else if batch.request & raw::PILUM_REQ_TANGENT != 0 {
        Tangent::Consistent
    } else {
        Tangent::None
    }
}

/// Whether the components of each point stand one after the other, in all views that are there.
fn is_packed(batch: &Batch) -> bool {
    let read = [
        &batch.gradient0,
        &batch.gradient1,
        &batch.flux0,
        &batch.state0,
    ];
    let written = [&batch.flux1, &batch.state1, &batch.tangent];
    read.iter().all(|v| v.p.is_null() || v.component == 1)
        && written.iter().all(|v| v.p.is_null() || v.component == 1)
}

/// A checked batch, read and written point by point. `PACKED`: all component strides are 1, which
/// the compiler turns into moves of whole rows.
#[derive(Debug)]
pub struct Access<'a, const PACKED: bool> {
    batch: &'a Batch,
    n_components: usize,
    tangent: Tangent,
}

/// A point at the start of its increment.
struct PointStart<const N: usize, S> {
    gradient: [f64; N],
    gradient_increment: [f64; N],
    flux: [f64; N],
    state: S,
}

impl<'a, const PACKED: bool> Access<'a, PACKED> {
    fn new<L>(batch: &'a Batch, boxed: &Boxed<L>) -> Self {
        Self {
            batch,
            n_components: boxed.n_components,
            tangent: requested(batch),
        }
    }

    /// The components of point `i`.
    #[inline]
    fn row<const N: usize>(view: &View, i: usize) -> [f64; N] {
        // SAFETY: contract of `View`: point `i` and all components are within the declared counts.
        unsafe {
            let first = view.p.offset(i as isize * view.point);
            if PACKED {
                first.cast::<[f64; N]>().read()
            } else {
                std::array::from_fn(|c| *first.offset(c as isize * view.component))
            }
        }
    }

    /// Writes the components of point `i`.
    #[inline]
    fn put_row(view: &ViewMut, i: usize, row: &[f64]) {
        let stride = if PACKED { 1 } else { view.component };
        for (c, &value) in row.iter().enumerate() {
            // SAFETY: contract of `ViewMut`: within the declared counts, overlapping nothing.
            unsafe { *view.p.offset(i as isize * view.point + c as isize * stride) = value };
        }
    }

    /// Internal variable `v` of point `i`.
    #[inline]
    fn state_value<S: InternalVariables>(&self, i: usize, v: usize) -> f64 {
        assert_declared::<S>(v);
        let view = &self.batch.state0;
        let stride = if PACKED { 1 } else { view.component };
        // SAFETY: as in `row`; `v` is declared.
        unsafe { *view.p.offset(i as isize * view.point + v as isize * stride) }
    }

    #[inline]
    fn flux0<const N: usize>(&self, i: usize) -> Result<[f64; N], Failure> {
        let flux = Self::row(&self.batch.flux0, i);
        if defect(&flux) == 0.0 {
            Ok(flux)
        } else {
            Err(INPUT_NOT_FINITE)
        }
    }

    /// What a law needs of point `i`, all of it finite.
    #[inline]
    fn start<const N: usize, S: InternalVariables>(
        &self,
        i: usize,
    ) -> Result<PointStart<N, S>, Failure> {
        let gradient: [f64; N] = Self::row(&self.batch.gradient0, i);
        let end: [f64; N] = Self::row(&self.batch.gradient1, i);
        let flux: [f64; N] = Self::row(&self.batch.flux0, i);
        let state = (0..S::TABLE.len()).map(|v| 0.0 * self.state_value::<S>(i, v));
        if defect(&gradient) + defect(&end) + defect(&flux) + state.sum::<f64>() != 0.0 {
            return Err(INPUT_NOT_FINITE);
        }
        Ok(PointStart {
            gradient,
            gradient_increment: std::array::from_fn(|c| end[c] - gradient[c]),
            flux,
            state: S::read(|v| self.state_value::<S>(i, v)),
        })
    }

    #[inline]
    fn put_state<S: InternalVariables>(&self, i: usize, state: &S) {
        let view = &self.batch.state1;
        let stride = if PACKED { 1 } else { view.component };
        state.write(|v, value| {
            assert_declared::<S>(v);
            // SAFETY: as in `put_row`; `v` is declared.
            unsafe { *view.p.offset(i as isize * view.point + v as isize * stride) = value };
        });
    }

    #[inline]
    fn put<const N: usize, S: InternalVariables>(
        &self,
        i: usize,
        flux: &[f64; N],
        state: &S,
        tangent: Option<&[[f64; N]; N]>,
    ) -> Result<(), Failure> {
        let mut defects = defect(flux);
        state.write(|_, value| defects += 0.0 * value);
        if let Some(tangent) = tangent {
            defects += defect(tangent.as_flattened());
        }
        if defects != 0.0 {
            return Err(Failure::Numeric("a result is not finite"));
        }
        Self::put_row(&self.batch.flux1, i, flux);
        self.put_state(i, state);
        if let Some(tangent) = tangent {
            Self::put_row(&self.batch.tangent, i, tangent.as_flattened());
        }
        Ok(())
    }

    #[inline]
    fn put_status(&self, i: usize, status: Status) {
        if !self.batch.status.is_null() {
            // SAFETY: contract of `Batch::status`: `n_points` entries.
            unsafe { self.batch.status.add(i).write(status) };
        }
    }

    fn put_step_factor(&self, i: usize, failure: Option<Failure>) {
        if let Some(Failure::CutStep { factor, .. }) = failure
            && !self.batch.step_factor.is_null()
        {
            let factor = if factor > 0.0 && factor < 1.0 {
                factor
            } else {
                f64::NAN
            };
            // SAFETY: contract of `Batch::step_factor`: `n_points` entries.
            unsafe { self.batch.step_factor.add(i).write(factor) };
        }
    }
}

const INPUT_NOT_FINITE: Failure = Failure::Numeric("an input is not finite");

/// 0 if all values are finite, else NaN: 0 times a finite number is 0. Two sums at a time and no
/// branch, so that it costs a fraction of reading the values one by one.
#[inline]
fn defect(values: &[f64]) -> f64 {
    let (pairs, rest) = values.as_chunks::<2>();
    let mut sums = [0.0; 2];
    for pair in pairs {
        sums[0] += 0.0 * pair[0];
        sums[1] += 0.0 * pair[1];
    }
    rest.iter().fold(sums[0] + sums[1], |sum, v| sum + 0.0 * v)
}

/// Keeps the views of internal variables within their bounds, for hand-written
/// [`InternalVariables`] too. The host sizes them by the same table, and the numbers that
/// [`internal_variables!`](crate::internal_variables) uses are constants, so for those nothing is
/// left of it.
#[inline]
fn assert_declared<S: InternalVariables>(v: usize) {
    assert!(v < S::TABLE.len(), "internal variable {v} is not declared");
}

#[cfg(test)]
mod tests;

/// What a law for solids may not declare stops the compiler; the same law with a solid's
/// hypothesis compiles.
///
/// ```compile_fail
/// use abi::{ContinuumLaw, Description, Failure, Hypothesis, Refusal};
/// use abi::{SolidPoint, SolidResponse, Tangent};
/// abi::parameters! { pub struct Nothing {} }
/// struct Astray;
/// impl ContinuumLaw for Astray {
///     const DESCRIPTION: Description =
///         abi::describe! { id: "astray", name: "", doc: "", references: "" };
///     const HYPOTHESES: &'static [Hypothesis] = &[Hypothesis::Interface2d];
///     type Parameters = Nothing;
///     type State = ();
///     fn new(_: Nothing) -> Result<Self, Refusal> { Ok(Self) }
///     fn update<const N: usize>(&self, _: &SolidPoint<N, ()>, _: Tangent)
///         -> Result<SolidResponse<N, ()>, Failure> { Err(Failure::Domain("")) }
/// }
/// const _: abi::raw::Law = abi::export::law::<abi::export::Continuum<Astray>>();
/// ```
///
/// ```
/// use abi::{ContinuumLaw, Description, Failure, Hypothesis, Refusal};
/// use abi::{SolidPoint, SolidResponse, Tangent};
/// abi::parameters! { pub struct Nothing {} }
/// struct Astray;
/// impl ContinuumLaw for Astray {
///     const DESCRIPTION: Description =
///         abi::describe! { id: "astray", name: "", doc: "", references: "" };
///     const HYPOTHESES: &'static [Hypothesis] = &[Hypothesis::PlaneStrain];
///     type Parameters = Nothing;
///     type State = ();
///     fn new(_: Nothing) -> Result<Self, Refusal> { Ok(Self) }
///     fn update<const N: usize>(&self, _: &SolidPoint<N, ()>, _: Tangent)
///         -> Result<SolidResponse<N, ()>, Failure> { Err(Failure::Domain("")) }
/// }
/// const _: abi::raw::Law = abi::export::law::<abi::export::Continuum<Astray>>();
/// ```
#[cfg(doctest)]
struct HypothesesOfSolids;
