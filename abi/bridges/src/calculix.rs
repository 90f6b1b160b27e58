//! The entry of CalculiX' own material routines, which it looks up in a library for a material
//! named `@LIBRARY_CALCULIX`. (A material named `@ABAQUS_LIBRARY_UMAT` is called as in
//! [`umat`](crate::umat).)
//!
//! Always three dimensions. Strains are tensor components. Internal variables are in an array of
//! the whole model. CalculiX gets the symmetric part of an unsymmetric tangent, as its own
//! interface to Abaqus' routines makes it. That slows the iteration of laws with non-associated
//! flow and does not change the stress.

use crate::laws::{Laws, offers, refused};
use crate::point::{Answer, Carried, Point};
use crate::umat::{or, row};
use abi::export::Continuum;
use abi::{ContinuumLaw, Hypothesis, InternalVariables, Tangent};
use std::ffi::c_int;

/// The arguments of CalculiX' material routine that a law needs; none is null.
#[expect(missing_docs, reason = "the names are CalculiX'")]
#[derive(Debug)]
pub struct Call {
    pub iel: *const c_int,
    pub iint: *const c_int,
    pub kode: *const c_int,
    pub elconloc: *const f64,
    pub emec: *const f64,
    pub emec0: *const f64,
    pub dtime: *const f64,
    pub time: *const f64,
    pub ttime: *const f64,
    pub icmd: *const c_int,
    pub ielas: *const c_int,
    pub mi: *const c_int,
    pub nstate: *const c_int,
    pub xstateini: *const f64,
    pub xstate: *mut f64,
    pub stre: *mut f64,
    pub stiff: *mut f64,
    pub iorien: *const c_int,
    pub pnewdt: *mut f64,
}

/// Answers a call. Without an answer the stress becomes NaN and `pnewdt` the step factor; with one,
/// `pnewdt` stays, since another point may have set it.
///
/// # Safety
/// The pointers are as CalculiX passes them.
pub unsafe fn answer<L: ContinuumLaw>(laws: &Laws<Continuum<L>>, call: &Call) {
    // SAFETY: `CalculiX`' interface: `stre` has 6 components, `stiff` 21.
    unsafe {
        match carried(laws, call) {
            Ok(Answer { flux, operator, .. }) => {
                for (i, value) in flux.into_iter().enumerate() {
                    *call.stre.add(i) = value;
                }
                if or(call.icmd, 0) != ONLY_STRESS {
                    // The upper triangle, column by column.
                    let triangle = (0..6).flat_map(|j| (0..=j).map(move |i| (i, j)));
                    for (place, (i, j)) in triangle.enumerate() {
                        let mean = 0.5 * (operator[i][j] + operator[j][i]);
                        *call.stiff.add(place) = mean;
                    }
                }
            }
            Err(factor) => {
                for i in 0..6 {
                    *call.stre.add(i) = f64::NAN;
                }
                if !call.pnewdt.is_null() {
                    *call.pnewdt = factor;
                }
            }
        }
    }
}

/// `icmd` of a call that wants no stiffness.
const ONLY_STRESS: c_int = 3;

/// The point that a call is about.
///
/// # Safety
/// As [`answer`]; `nstate` is its value.
unsafe fn point(call: &Call, nstate: c_int) -> Point<6> {
    // SAFETY: see above.
    unsafe {
        let (element, point) = (or(call.iel, 1) - 1, or(call.iint, 1) - 1);
        let block = point as isize + or(call.mi, 1) as isize * element as isize;
        let place = nstate as isize * block;
        let (begin, end) = (row::<6>(call.emec0), row::<6>(call.emec));
        let gamma = |i: usize, value: f64| if i < 3 { value } else { 2.0 * value };
        let dtime = or(call.dtime, 0.0);
        Point {
            gradient: std::array::from_fn(|i| gamma(i, begin[i])),
            increment: std::array::from_fn(|i| gamma(i, end[i] - begin[i])),
            flux: row(call.stre),
            state0: call.xstateini.offset(place),
            state1: call.xstate.offset(place),
            time: or(call.ttime, 0.0) + or(call.time, 0.0) - dtime,
            time_increment: dtime,
            step_time: or(call.time, 0.0) - dtime,
        }
    }
}

/// # Safety
/// As [`answer`].
unsafe fn carried<L: ContinuumLaw>(
    laws: &Laws<Continuum<L>>,
    call: &Call,
) -> Result<Answer<6>, f64> {
    let id = L::DESCRIPTION.id;
    if !offers::<Continuum<L>>(Hypothesis::ThreeD) {
        return refused(
            id,
            format_args!("CalculiX needs three dimensions, which it does not offer"),
        );
    }
    let n_states = <L::State as InternalVariables>::TABLE.len();
    // SAFETY: null or valid, as `CalculiX`' interface says; so are those below.
    let (n_state, iorien) = unsafe { (or(call.nstate, 0), or(call.iorien, 0)) };
    if iorien != 0 {
        return refused(id, format_args!("it takes no *ORIENTATION by this entry"));
    }
    if (n_state.max(0) as usize) < n_states {
        return refused(
            id,
            format_args!("*DEPVAR {n_state}, the law has {n_states} internal variables"),
        );
    }
    // SAFETY: there are −kode − 100 constants, and one block of `nstate` variables for each of the
    // `mi(1)` points of each element; elements and points count from 1.
    let (given, point) = unsafe {
        let given = match -or(call.kode, -100) - 100 {
            n if n > 0 => std::slice::from_raw_parts(call.elconloc, n as usize),
            _ => &[],
        };
        (given, point(call, n_state))
    };
    // SAFETY: as above.
    let tangent = match unsafe { (or(call.icmd, 0), or(call.ielas, 0)) } {
        (ONLY_STRESS, _) => Tangent::None,
        (_, 1) => Tangent::Elastic,
        _ => Tangent::Consistent,
    };
    laws.carry_or_complain(id, given, |law| law.carry(&point, tangent))
}
