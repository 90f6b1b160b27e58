//! The entry of Abaqus user materials (`UMAT`), which many programs call.
//!
//! `PROPS` are the parameters in declared order; those at the end that have a default, or are optional,
//! may be left out. `STATEV` are the internal variables in declared order. With `NTENS` 6 the law is
//! called in three dimensions, with 4 in plane strain or axisymmetry. The call does not tell these two
//! apart. No law needs to, since its update depends only on the number of components. Everything but
//! `STRESS`, `DSTRAN`, `NTENS`, `PROPS` and `NPROPS` may be null; without `STATEV` only a law without
//! internal variables can be called. `STATEV` that are all zero stand for the law's own initial values.
//!
//! If there is no answer, `STRESS` and `DDSDDE` become NaN, `STATEV` stays, and `PNEWDT` is the
//! fraction of the increment that the law believes it can follow. A caller that ignores `PNEWDT`, or
//! passes null, must not take the stress at the start for that at the end.

use crate::laws::{Laws, complain, offers, refused};
use crate::point::{Answer, Carried, Point};
use abi::export::{Continuum, Exported};
use abi::{ContinuumLaw, Hypothesis, InternalVariables, Tangent};
use std::ffi::c_int;

/// Exports a law for solids as the user material of the library: `umat_` (as Fortran names it),
/// `umat` and `UMAT` for Abaqus' convention, `CALCULIX` for CalculiX' own.
#[macro_export]
macro_rules! export_umat {
    ($law:ty) => {
        const _: () = {
            static LAWS: $crate::laws::Laws<$crate::abi::export::Continuum<$law>> =
                $crate::laws::Laws::new();
    $crate::export_umat!(@abaqus "umat_");
    $crate::export_umat!(@abaqus "umat");
    $crate::export_umat!(@abaqus "UMAT");
    $crate::export_umat!(@calculix "CALCULIX");
        };
    };
    (@abaqus $symbol:literal) => {
        const _: () = {
            /// See `bridges::umat`.
            ///
            /// # Safety
            /// The pointers are those of Abaqus' `UMAT`, or null where `bridges::umat` admits it.
            #[unsafe(export_name = $symbol)]
            pub unsafe extern "C" fn entry(
                stress: *mut f64,
                statev: *mut f64,
                ddsdde: *mut f64,
                _: *mut f64,
                _: *mut f64,
                _: *mut f64,
                _: *mut f64,
                _: *mut f64,
                _: *mut f64,
                _: *mut f64,
                stran: *const f64,
                dstran: *const f64,
                time: *const f64,
                dtime: *const f64,
                _: *const f64,
                _: *const f64,
                _: *const f64,
                _: *const f64,
                _: *const ::std::ffi::c_char,
                ndi: *const ::std::ffi::c_int,
                _: *const ::std::ffi::c_int,
                ntens: *const ::std::ffi::c_int,
                nstatv: *const ::std::ffi::c_int,
                props: *const f64,
                nprops: *const ::std::ffi::c_int,
                _: *const f64,
                _: *const f64,
                pnewdt: *mut f64,
            ) {
                let call = $crate::umat::Call {
                    stress,
                    statev,
                    ddsdde,
                    stran,
                    dstran,
                    time,
                    dtime,
                    ndi,
                    ntens,
                    nstatv,
                    props,
                    nprops,
                    pnewdt,
                };
                // SAFETY: passed on to the caller.
                unsafe { $crate::umat::answer(&LAWS, &call) }
            }
        };
    };
    (@calculix $symbol:literal) => {
        const _: () = {
            /// See `bridges::calculix`.
            ///
            /// # Safety
            /// The pointers are those of CalculiX' material routine.
            #[unsafe(export_name = $symbol)]
            pub unsafe extern "C" fn entry(
                _: *const ::std::ffi::c_char,
                iel: *const ::std::ffi::c_int,
                iint: *const ::std::ffi::c_int,
                kode: *const ::std::ffi::c_int,
                elconloc: *const f64,
                emec: *const f64,
                emec0: *const f64,
                _: *const f64,
                _: *const f64,
                _: *const f64,
                _: *const f64,
                _: *const f64,
                _: *const ::std::ffi::c_int,
                _: *const f64,
                dtime: *const f64,
                time: *const f64,
                ttime: *const f64,
                icmd: *const ::std::ffi::c_int,
                ielas: *const ::std::ffi::c_int,
                mi: *const ::std::ffi::c_int,
                nstate: *const ::std::ffi::c_int,
                xstateini: *const f64,
                xstate: *mut f64,
                stre: *mut f64,
                stiff: *mut f64,
                iorien: *const ::std::ffi::c_int,
                _: *const f64,
                _: *const f64,
                pnewdt: *mut f64,
            ) {
                let call = $crate::calculix::Call {
                    iel,
                    iint,
                    kode,
                    elconloc,
                    emec,
                    emec0,
                    dtime,
                    time,
                    ttime,
                    icmd,
                    ielas,
                    mi,
                    nstate,
                    xstateini,
                    xstate,
                    stre,
                    stiff,
                    iorien,
                    pnewdt,
                };
                // SAFETY: passed on to the caller.
                unsafe { $crate::calculix::answer(&LAWS, &call) }
            }
        };
    };
}

/// The arguments of a `UMAT` that a law needs.
#[expect(missing_docs, reason = "the names are Abaqus'")]
#[derive(Debug)]
pub struct Call {
    pub stress: *mut f64,
    pub statev: *mut f64,
    pub ddsdde: *mut f64,
    pub stran: *const f64,
    pub dstran: *const f64,
    pub time: *const f64,
    pub dtime: *const f64,
    pub ndi: *const c_int,
    pub ntens: *const c_int,
    pub nstatv: *const c_int,
    pub props: *const f64,
    pub nprops: *const c_int,
    pub pnewdt: *mut f64,
}

/// The value at `p`, or another one if it is null.
///
/// # Safety
/// `p` is null or valid.
pub(crate) unsafe fn or<T: Copy>(p: *const T, other: T) -> T {
    // SAFETY: passed on to the caller.
    unsafe { p.as_ref() }.copied().unwrap_or(other)
}

/// The first `N` values at `p`; all zero if it is null.
///
/// # Safety
/// `p` is null or valid for `N` values.
pub(crate) unsafe fn row<const N: usize>(p: *const f64) -> [f64; N] {
    // SAFETY: passed on to the caller.
    unsafe { or(p.cast(), [0.0; N]) }
}

/// Answers a call.
///
/// # Safety
/// The pointers are as the module says.
pub unsafe fn answer<L: ContinuumLaw>(laws: &Laws<Continuum<L>>, call: &Call) {
    let id = L::DESCRIPTION.id;
    // SAFETY: null or valid, as Abaqus' interface says; so are those below.
    let (ntens, ndi) = unsafe { (or(call.ntens, 0), or(call.ndi, 3)) };
    if call.stress.is_null() || call.dstran.is_null() {
        complain(id, format_args!("STRESS or DSTRAN is null"));
        return;
    }
    let n = ntens.clamp(0, 6) as usize;
    let done = match unusable::<Continuum<L>>(ntens, ndi) {
        // SAFETY: as above.
        None if n == 6 => unsafe { carry::<L, 6>(laws, call) },
        // SAFETY: as above.
        None => unsafe { carry::<L, 4>(laws, call) },
        Some(why) => refused(id, format_args!("NTENS = {ntens} with NDI = {ndi}: {why}")),
    };
    let Err(factor) = done else {
        return;
    };
    // SAFETY: `STRESS` has `NTENS` components, `DDSDDE` their square; `DDSDDE` and `PNEWDT` may be
    // null.
    unsafe {
        for i in 0..n {
            *call.stress.add(i) = f64::NAN;
        }
        for i in 0..if call.ddsdde.is_null() { 0 } else { n * n } {
            *call.ddsdde.add(i) = f64::NAN;
        }
        if !call.pnewdt.is_null() {
            *call.pnewdt = factor;
        }
    }
}

/// Why the law cannot be called with this many components.
fn unusable<L: Exported>(ntens: c_int, ndi: c_int) -> Option<&'static str> {
    match (ntens, ndi) {
        (6, 3) if offers::<L>(Hypothesis::ThreeD) => None,
        (6, 3) => Some("the law is for plane strain and axisymmetry, NTENS = 4"),
        (4, 3) => None,
        _ => Some("expected three direct components, and one or three of shear"),
    }
}

/// Carries a point with `N` components and writes its end.
///
/// # Errors
/// The step factor; the reason is reported.
///
/// # Safety
/// As [`answer`].
unsafe fn carry<L: ContinuumLaw, const N: usize>(
    laws: &Laws<Continuum<L>>,
    call: &Call,
) -> Result<(), f64> {
    let id = L::DESCRIPTION.id;
    let needed = <L::State as InternalVariables>::TABLE.len();
    // SAFETY: as in `answer`.
    let (n_statev, n_props) = unsafe {
        let all = if call.statev.is_null() { 0 } else { needed };
        (or(call.nstatv, all as c_int), or(call.nprops, 0))
    };
    if needed > 0 && (call.statev.is_null() || (n_statev.max(0) as usize) < needed) {
        return refused(
            id,
            format_args!("NSTATV = {n_statev}, the law has {needed} internal variables"),
        );
    }
    let given: &[f64] = if call.props.is_null() || n_props <= 0 {
        &[]
    } else {
        // SAFETY: `PROPS` has `NPROPS` values.
        unsafe { std::slice::from_raw_parts(call.props, n_props as usize) }
    };
    // SAFETY: as in `answer`; `TIME` has two entries.
    let point = unsafe {
        Point {
            gradient: row::<N>(call.stran),
            increment: row(call.dstran),
            flux: row(call.stress),
            state0: call.statev,
            state1: call.statev,
            time: if call.time.is_null() {
                0.0
            } else {
                *call.time.add(1)
            },
            time_increment: or(call.dtime, 0.0),
            step_time: or(call.time, 0.0),
        }
    };
    let tangent = if call.ddsdde.is_null() {
        Tangent::None
    } else {
        Tangent::Consistent
    };
    let answer = laws.carry_or_complain(id, given, |law| law.carry(&point, tangent))?;
    // SAFETY: as in `answer`.
    unsafe { put(call, &answer) };
    Ok(())
}

/// Writes stress and tangent, column by column.
///
/// # Safety
/// As [`answer`].
unsafe fn put<const N: usize>(call: &Call, answer: &Answer<N>) {
    for i in 0..N {
        // SAFETY: `NTENS` components.
        unsafe { *call.stress.add(i) = answer.flux[i] };
    }
    if !call.ddsdde.is_null() {
        for i in 0..N {
            for j in 0..N {
                // SAFETY: `NTENS` × `NTENS` components.
                unsafe { *call.ddsdde.add(j * N + i) = answer.operator[i][j] };
            }
        }
    }
}
