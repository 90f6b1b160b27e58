//! A law as a host sees it: through the four functions of its description.
#![expect(
    clippy::float_cmp,
    unreachable_pub,
    reason = "values pass unchanged; the macros declare what crates export"
)]

use super::adapter::assert_solid;
use super::*;
use crate::law::{InterfaceLaw, InterfacePoint, InterfaceResponse, Refusal};
use crate::raw::{View, ViewMut};
use crate::version::BATCH_SIZE_1_0;
use crate::{InternalVariables, Parameter, Variable, describe};
use std::alloc::{GlobalAlloc, Layout, System};
use std::ffi::CStr;
use std::ptr::{null, null_mut};

/// Counts what each thread allocates.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: everything is handed to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: contract of `alloc`.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        // SAFETY: contract of `dealloc`.
        unsafe { System.dealloc(p, layout) };
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

crate::parameters! {
    /// Action of the probe.
    pub struct Setting {
        /// How the probe behaves.
        deed: Parameter::new(c"-", c"-").one_of(crate::choices!(
            c"carry", c"cut", c"panic", c"panic_in_drop", c"read_astray", c"write_astray",
        )),
        /// Target of the action.
        value: Parameter::new(c"x", c"-").default(0.0).optional(),
    }
}

const CARRY: f64 = 0.0;
const CUT: f64 = 1.0;
const PANIC: f64 = 2.0;
const PANIC_IN_DROP: f64 = 3.0;
const READ_ASTRAY: f64 = 4.0;
const WRITE_ASTRAY: f64 = 5.0;

/// One internal variable, written by hand and against the rules: it goes where its value says.
#[derive(Clone, Copy, Debug)]
struct Astray(f64);

impl InternalVariables for Astray {
    const TABLE: &'static [Variable] =
        &[Variable::scalar(c"a", c"-").called(c"astray", c"Astray.")];
    fn read(value: impl Fn(usize) -> f64) -> Self {
        let first = value(0);
        if first == READ_ASTRAY {
            return Self(value(1));
        }
        Self(first)
    }
    fn write(&self, mut put: impl FnMut(usize, f64)) {
        put(usize::from(self.0 == WRITE_ASTRAY), self.0);
    }
}

/// An interface without stiffness that misbehaves on request.
struct Probe(Setting);

impl InterfaceLaw for Probe {
    const DESCRIPTION: Description = describe! {
        id: "probe", name: "probe", doc: "Misbehaves.", references: "none",
    };
    type Parameters = Setting;
    type State = Astray;

    fn new(parameters: Setting) -> Result<Self, Refusal> {
        Ok(Self(parameters))
    }

    fn update(
        &self,
        point: &InterfacePoint<Astray>,
        _: Tangent,
    ) -> Result<InterfaceResponse<Astray>, Failure> {
        assert!(self.0.deed != PANIC, "told to");
        if self.0.deed == CUT {
            return Err(Failure::CutStep {
                factor: self.0.value,
                reason: "told to",
            });
        }
        Ok(InterfaceResponse {
            traction: point.traction,
            state: Astray(self.0.deed),
            tangent: [[0.0; 2]; 2],
            unreliable: None,
        })
    }
}

impl Drop for Probe {
    fn drop(&mut self) {
        assert!(self.0.deed != PANIC_IN_DROP, "told to");
    }
}

/// A buffer that holds no NUL before a call.
struct Buffer([c_char; 48]);

impl Buffer {
    fn new() -> Self {
        Self([b'#' as c_char; 48])
    }

    fn text(&self) -> String {
        let bytes: Vec<u8> = self.0.iter().map(|&c| c as u8).collect();
        let text = CStr::from_bytes_until_nul(&bytes).expect("the message ends in NUL");
        text.to_str().expect("it is UTF-8").to_owned()
    }
}

fn create_with(
    formulation: u32,
    parameters: *const f64,
    n: u32,
) -> (Status, *mut Instance, String) {
    let mut instance = null_mut();
    let mut message = Buffer::new();
    // SAFETY: contract of `create`; every caller gives `n` values or null.
    let status = unsafe {
        create::<Interface<Probe>>(
            null(),
            null(),
            formulation,
            parameters,
            n,
            &raw mut instance,
            message.0.as_mut_ptr(),
            message.0.len(),
        )
    };
    (status, instance, message.text())
}

fn created(deed: f64, value: f64) -> *mut Instance {
    let (status, instance, message) = create_with(0, [deed, value].as_ptr(), 2);
    assert_eq!((status, message.as_str()), (raw::PILUM_OK, ""));
    instance
}

fn destroyed(instance: *mut Instance) {
    // SAFETY: contract of `destroy`; no caller uses the instance again.
    unsafe { destroy::<Interface<Probe>>(instance) };
}

/// What one call on one point left behind.
struct Called {
    status: Status,
    outcome: Status,
    factor: f64,
    message: String,
    state: [f64; 2],
}

/// Calls `integrate` on one point with this internal variable; `shape` may spoil the batch.
fn integrated(instance: *mut Instance, state: f64, shape: impl FnOnce(&mut Batch)) -> Called {
    let (zeros, state0) = ([0.0; 2], [state, -7.0]);
    let (mut flux, mut state1, mut tangent) = ([0.0; 2], [-7.0; 2], [0.0; 4]);
    let (mut outcome, mut factor) = (raw::PILUM_OK, -7.0);
    let mut message = Buffer::new();
    let row = |p: *const f64| View {
        p,
        point: 2,
        component: 1,
    };
    let row_mut = |p: *mut f64| ViewMut {
        p,
        point: 2,
        component: 1,
    };
    let mut batch = Batch {
        struct_size: size_of::<Batch>() as u32,
        request: raw::PILUM_REQ_FLUX,
        n_points: 1,
        first_point: 0,
        time: 0.0,
        time_increment: 0.0,
        gradient0: row(zeros.as_ptr()),
        gradient1: row(zeros.as_ptr()),
        flux0: row(zeros.as_ptr()),
        state0: row(state0.as_ptr()),
        flux1: row_mut(flux.as_mut_ptr()),
        state1: row_mut(state1.as_mut_ptr()),
        tangent: row_mut(tangent.as_mut_ptr()),
        status: &raw mut outcome,
        step_factor: &raw mut factor,
        message: message.0.as_mut_ptr(),
        message_capacity: message.0.len(),
        step_time: 0.0,
        rates: null(),
    };
    shape(&mut batch);
    // SAFETY: contract of `integrate`: the views are one point long, the instance is alive.
    let status = unsafe { integrate::<Interface<Probe>>(instance, &raw const batch) };
    if batch.struct_size < BATCH_SIZE_1_0 as u32 {
        assert!(message.0.iter().all(|&c| c == b'#' as c_char));
        message.0[0] = 0;
    }
    Called {
        status,
        outcome,
        factor,
        message: message.text(),
        state: state1,
    }
}

#[test]
fn solid_hypotheses_are_accepted() {
    assert_solid(&[Hypothesis::ThreeD]);
    assert_solid(&[
        Hypothesis::PlaneStrain,
        Hypothesis::Axisymmetric,
        Hypothesis::ThreeD,
    ]);
}

#[test]
#[should_panic(expected = "is empty")]
fn no_hypothesis_is_refused() {
    assert_solid(&[]);
}

#[test]
#[should_panic(expected = "more than three")]
fn four_hypotheses_are_refused() {
    assert_solid(&[Hypothesis::ThreeD; 4]);
}

#[test]
#[should_panic(expected = "implement `InterfaceLaw`")]
fn a_solid_at_an_interface_is_refused() {
    assert_solid(&[Hypothesis::ThreeD, Hypothesis::Interface2d]);
}

#[test]
fn internal_variables_stay_within_their_views() {
    let read = created(CARRY, 0.0);
    let called = integrated(read, READ_ASTRAY, |_| ());
    assert_eq!(called.status, raw::PILUM_E_INTERNAL);
    assert_eq!(called.outcome, raw::PILUM_E_INTERNAL);
    assert_eq!(
        called.message,
        "point 0: panicked: internal variable 1 is not d"
    );
    destroyed(read);

    let write = created(WRITE_ASTRAY, 0.0);
    let called = integrated(write, 0.0, |_| ());
    assert_eq!(called.status, raw::PILUM_E_INTERNAL);
    assert_eq!(called.state, [-7.0; 2]);
    destroyed(write);
}

#[test]
fn broken_arguments_of_create_are_refused() {
    let values = [CARRY, 0.0];
    for (formulation, parameters, n) in [
        (0, null(), 2),
        (0, values.as_ptr(), 1),
        (1, values.as_ptr(), 2),
    ] {
        let (status, instance, message) = create_with(formulation, parameters, n);
        assert_eq!(status, raw::PILUM_E_ARGUMENT);
        assert!(instance.is_null() && !message.is_empty());
    }
}

#[test]
fn a_choice_is_the_number_of_a_label() {
    for refused in [0.5, -1.0, 6.0, f64::NAN] {
        let (status, _, message) = create_with(0, [refused, 0.0].as_ptr(), 2);
        assert_eq!(status, raw::PILUM_E_PARAMETER, "{refused}");
        assert_eq!(message, format!("deed: {refused} is not admissible"));
    }
    for label in [CARRY, WRITE_ASTRAY] {
        destroyed(created(label, f64::NAN));
    }
}

#[test]
fn labels_end_with_null() {
    let [deed, _] = Setting::TABLE else {
        panic!("two parameters are declared")
    };
    // SAFETY: `choices!` was given six labels.
    let labels = unsafe { std::slice::from_raw_parts(deed.raw().choices, 7) };
    assert!(labels[..6].iter().all(|label| !label.is_null()) && labels[6].is_null());
}

#[test]
fn the_message_ends_in_nul_in_every_case() {
    let instance = created(CARRY, 0.0);
    let panicking = created(PANIC, 0.0);
    let (ok, argument, internal) = (raw::PILUM_OK, raw::PILUM_E_ARGUMENT, raw::PILUM_E_INTERNAL);
    let call = |instance, shape: fn(&mut Batch)| {
        let called = integrated(instance, 0.0, shape);
        (called.status, called.message)
    };
    let says = |status: Status, text: &str| (status, text.to_owned());
    assert_eq!(call(instance, |_| ()), says(ok, ""));
    assert_eq!(call(instance, |b| b.n_points = 0), says(ok, ""));
    assert_eq!(
        call(null_mut(), |_| ()),
        says(argument, "the instance is null")
    );
    assert_eq!(
        call(instance, |b| b.flux0.p = null()),
        says(argument, "a view that is needed is null")
    );
    assert_eq!(
        call(instance, |b| b.request = 1 << 30),
        says(raw::PILUM_E_UNSUPPORTED, "an unknown request")
    );
    assert_eq!(
        call(panicking, |b| b.first_point = u64::MAX),
        says(internal, "point 18446744073709551615: panicked: told to")
    );
    assert_eq!(
        call(panicking, |b| b.message_capacity = 8),
        says(internal, "the law")
    );
    assert_eq!(
        call(panicking, |b| b.message_capacity = 1),
        says(internal, "")
    );
    destroyed(instance);
    destroyed(panicking);
}

#[test]
fn a_batch_is_as_long_as_it_says() {
    let instance = created(CARRY, 0.0);
    let of_size =
        |size: usize| integrated(instance, 0.0, |batch| batch.struct_size = size as u32).status;
    assert_eq!(of_size(BATCH_SIZE_1_0 - 8), raw::PILUM_E_ARGUMENT);
    assert_eq!(of_size(0), raw::PILUM_E_ARGUMENT);
    assert_eq!(of_size(BATCH_SIZE_1_0), raw::PILUM_OK);
    assert_eq!(of_size(4096), raw::PILUM_OK);
    // SAFETY: contract of `integrate`; null is refused.
    let without = unsafe { integrate::<Interface<Probe>>(instance, null()) };
    assert_eq!(without, raw::PILUM_E_ARGUMENT);
    destroyed(instance);
}

#[test]
fn only_fractions_are_passed_on_as_step_factors() {
    for factor in [f64::NAN, 0.0, -0.5, 1.0, 2.0, 0.25] {
        let instance = created(CUT, factor);
        let called = integrated(instance, 0.0, |_| ());
        assert_eq!(called.outcome, raw::PILUM_CUT_STEP);
        if factor == 0.25 {
            assert_eq!(called.factor, factor);
        } else {
            assert!(called.factor.is_nan(), "{factor}");
        }
        destroyed(instance);
    }
}

#[test]
fn a_panic_in_drop_is_contained() {
    destroyed(created(PANIC_IN_DROP, 0.0));
    destroyed(null_mut());
}

/// The boundary itself allocates nothing, whether a point succeeds, asks for a cut or is refused.
#[test]
fn a_call_does_not_allocate() {
    for (deed, value) in [(CARRY, 0.0), (CUT, 0.5)] {
        let instance = created(deed, value);
        for state in [0.0, f64::NAN] {
            let (zeros, state0) = ([0.0; 2], [state]);
            let (mut flux, mut state1, mut tangent) = ([0.0; 2], [0.0; 1], [0.0; 4]);
            let (mut outcome, mut factor) = (raw::PILUM_OK, 0.0);
            let mut message = Buffer::new();
            let view = |p: *const f64| View {
                p,
                point: 0,
                component: 1,
            };
            let view_mut = |p: *mut f64| ViewMut {
                p,
                point: 0,
                component: 1,
            };
            let batch = Batch {
                struct_size: size_of::<Batch>() as u32,
                request: raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT,
                n_points: 1,
                first_point: 0,
                time: 0.0,
                time_increment: 1.0,
                gradient0: view(zeros.as_ptr()),
                gradient1: view(zeros.as_ptr()),
                flux0: view(zeros.as_ptr()),
                state0: view(state0.as_ptr()),
                flux1: view_mut(flux.as_mut_ptr()),
                state1: view_mut(state1.as_mut_ptr()),
                tangent: view_mut(tangent.as_mut_ptr()),
                status: &raw mut outcome,
                step_factor: &raw mut factor,
                message: message.0.as_mut_ptr(),
                message_capacity: message.0.len(),
                step_time: 0.0,
                rates: null(),
            };
            let before = ALLOCATIONS.get();
            // SAFETY: contract of `integrate`: the instance lives, the batch is true.
            unsafe { integrate::<Interface<Probe>>(instance, &raw const batch) };
            assert_eq!(ALLOCATIONS.get(), before);
        }
        destroyed(instance);
    }
}
