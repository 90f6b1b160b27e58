//! A behaviour's call for one point. Programs with this interface call point by point, so the
//! overhead of a call is kept small. Sizes are constants, only what is read is filled, and failures
//! are reported out of line.

use super::{MOST_STATES, Settings, has_axes, n_properties};
use crate::laws::{Laws, has_default, tell};
use crate::point::{Answer, Carried, Point};
use abi::export::Exported;
use abi::raw::PILUM_T_LINEAR;
use abi::{Failure, Parameters, Tangent};
use std::f64::consts::FRAC_1_SQRT_2;
use std::ffi::{c_char, c_int};
use std::fmt;

/// A point at the start of the increment, as MFront's interface passes it.
#[expect(missing_docs, reason = "the names are MFront's")]
#[repr(C)]
#[derive(Debug)]
pub struct InitialState {
    pub gradients: *const f64,
    pub thermodynamic_forces: *const f64,
    pub mass_density: *const f64,
    pub material_properties: *const f64,
    pub internal_state_variables: *const f64,
    pub stored_energy: *const f64,
    pub dissipated_energy: *const f64,
    pub external_state_variables: *const f64,
}

/// The point at the end of the increment.
#[expect(missing_docs, reason = "the names are MFront's")]
#[repr(C)]
#[derive(Debug)]
pub struct State {
    pub gradients: *const f64,
    pub thermodynamic_forces: *mut f64,
    pub mass_density: *const f64,
    pub material_properties: *const f64,
    pub internal_state_variables: *mut f64,
    pub stored_energy: *mut f64,
    pub dissipated_energy: *mut f64,
    pub external_state_variables: *const f64,
}

/// The argument of a behaviour.
#[repr(C)]
#[derive(Debug)]
pub struct Data {
    /// Null, or room for 512 bytes.
    pub error_message: *mut c_char,
    /// Time increment.
    pub dt: f64,
    /// On entry `K[0]` is the request, on exit the operator, row by row.
    pub k: *mut f64,
    /// On entry the largest step factor that the caller would take, on exit the law's.
    pub rdt: *mut f64,
    /// Not computed.
    pub speed_of_sound: *mut f64,
    /// Start of the increment.
    pub s0: InitialState,
    /// End of the increment.
    pub s1: State,
}

const _: () = assert!(size_of::<Data>() == 168);

/// Purpose of a call.
#[derive(Clone, Copy)]
struct Request {
    /// The operator of the start only, nothing is carried.
    prediction: bool,
    tangent: Tangent,
}

impl Request {
    const NONE: Self = Self {
        prediction: false,
        tangent: Tangent::None,
    };

    /// From `K[0]`; with more than 50, 100 of it ask for the speed of sound too.
    #[inline]
    fn decoded(k: f64) -> Result<Self, &'static str> {
        let k = if k > 50.0 { k - 100.0 } else { k };
        let prediction = k < -0.25;
        let tangent = match k.abs() {
            k if k < 0.5 && !prediction => Tangent::None,
            k if k < 1.5 => Tangent::Elastic,
            k if k < 2.5 => return Err("a secant operator is not offered"),
            k if k.is_finite() => Tangent::Consistent,
            _ => return Err("K[0] is not finite"),
        };
        Ok(Self {
            prediction,
            tangent,
        })
    }
}

/// Carries one point, in Kelvin–Mandel components. 1: done, 0: done but inaccurate, −1: not done,
/// with the step factor in `rdt` and the reason in `error_message`. `N` components, `P` parameters.
///
/// # Safety
/// `data` is null or as MFront's interface says.
#[inline]
pub unsafe fn integrate<L: Carried<N>, const N: usize, const P: usize>(
    laws: &Laws<L>,
    settings: &Settings<P>,
    data: *mut Data,
) -> c_int {
    // SAFETY: see above.
    let Some(data) = (unsafe { data.as_ref() }) else {
        return -1;
    };
    // SAFETY: passed on to the caller.
    match unsafe { prepared::<L, N>(data) } {
        Ok(start) => {
            // SAFETY: passed on to the caller; no array that is needed is null.
            unsafe {
                let given = given::<L, P>(settings, data.s1.material_properties);
                let work = move |law: &L| carry(law, data, start);
                let mut factor = 0.25;
                let answer = laws.carry(&given, work, |trouble| {
                    factor = trouble.factor();
                    say::<L>(data, format_args!("{trouble}"));
                });
                match answer {
                    Some(None) => 1,
                    Some(Some(why)) => {
                        say::<L>(data, format_args!("{why}"));
                        0
                    }
                    None => give_up(data, factor),
                }
            }
        }
        Err(why) => {
            // SAFETY: passed on to the caller.
            unsafe {
                say::<L>(data, format_args!("{why}"));
                give_up(data, 0.25)
            }
        }
    }
}

/// What a call begins with, in Kelvin–Mandel components.
#[derive(Clone, Copy)]
struct Start<const N: usize> {
    request: Request,
    begin: [f64; N],
    end: [f64; N],
    forces: [f64; N],
}

/// The request, and its source.
///
/// # Errors
/// Why the call cannot be answered.
///
/// # Safety
/// As [`integrate`].
#[inline]
unsafe fn prepared<L: Exported, const N: usize>(data: &Data) -> Result<Start<N>, &'static str> {
    const MISSING: &str = "an array that is needed is null";
    let (n_states, s0, s1) = (L::STATE.len(), &data.s0, &data.s1);
    // SAFETY: `K` is null or has one value at least.
    let request = unsafe { data.k.as_ref() }.map_or(Ok(Request::NONE), |k| Request::decoded(*k))?;
    // One pointer after the other: as pairs they would be read before the caller's writing of them is done.
    // SAFETY: null or `N` components.
    let row = |p: *const f64| unsafe { p.cast::<[f64; N]>().as_ref() }.copied();
    let begin = row(s0.gradients).ok_or(MISSING)?;
    let end = row(s1.gradients).ok_or(MISSING)?;
    let forces = row(s0.thermodynamic_forces).ok_or(MISSING)?;
    let missing = s1.thermodynamic_forces.is_null()
        || (n_states > 0 && s0.internal_state_variables.is_null())
        || (n_states > 0 && s1.internal_state_variables.is_null())
        || (n_properties::<L>() > 0 && s1.material_properties.is_null());
    if missing {
        return Err(MISSING);
    }
    // SAFETY: no array that is needed is null.
    if has_axes::<L>() && !unsafe { angle::<L>(data) }.is_finite() {
        return Err("LayerAngle is not finite");
    }
    let end = if request.prediction { begin } else { end };
    Ok(Start {
        request,
        begin,
        end,
        forces,
    })
}

/// The layer's angle.
///
/// # Safety
/// The law is in axes of its layer, and there are material properties.
#[inline]
unsafe fn angle<L: Exported>(data: &Data) -> f64 {
    // SAFETY: as many as there are names, of which the angle is the last.
    unsafe { *data.s1.material_properties.add(n_properties::<L>() - 1) }
}

/// All parameters in declared order. Properties are those of the end of the increment: some
/// programs fill no others.
///
/// # Safety
/// `properties` holds as many values as there are material properties.
#[inline]
unsafe fn given<L: Exported, const P: usize>(
    settings: &Settings<P>,
    properties: *const f64,
) -> [f64; P] {
    let table = <L::Parameters as Parameters>::TABLE;
    let (mut values, mut properties) = ([0.0; P], properties);
    for (v, value) in values.iter_mut().enumerate() {
        *value = if has_default(&table[v]) {
            settings.value(v)
        } else {
            // SAFETY: see above.
            unsafe {
                let property = *properties;
                properties = properties.add(1);
                property
            }
        };
    }
    values
}

/// Tells why, in the room that the caller has for it.
///
/// # Safety
/// `error_message` is null or has room for 512 bytes.
#[cold]
#[inline(never)]
unsafe fn say<L: Exported>(data: &Data, text: fmt::Arguments<'_>) {
    let id = L::DESCRIPTION.id.to_string_lossy();
    // SAFETY: see above.
    unsafe { tell(data.error_message, format_args!("{id}: {text}")) };
}

/// Not done; a step by this factor may be.
///
/// # Safety
/// `rdt` is null or valid.
#[cold]
unsafe fn give_up(data: &Data, factor: f64) -> c_int {
    if !data.rdt.is_null() {
        // SAFETY: valid where it is not null.
        unsafe { *data.rdt = factor.min(*data.rdt) };
    }
    -1
}

/// The axes of the layer, of a law that has such.
///
/// # Safety
/// The properties of such a law are not null.
#[inline]
unsafe fn axes<L: Exported>(data: &Data) -> Axes {
    if has_axes::<L>() {
        // SAFETY: see above.
        Axes::at(unsafe { angle::<L>(data) })
    } else {
        Axes(None)
    }
}

/// The reason why the results are inaccurate, if they are.
///
/// # Errors
/// Why none exist.
///
/// # Safety
/// As [`integrate`]; no array that is needed is null.
#[inline]
unsafe fn carry<L: Carried<N>, const N: usize>(
    law: &L,
    data: &Data,
    start: Start<N>,
) -> Result<Option<&'static str>, Failure> {
    // SAFETY: as for this function.
    let axes = unsafe { axes::<L>(data) };
    let request = start.request;
    let d_gradient = std::array::from_fn(|i| start.end[i] - start.begin[i]);
    let mut unused;
    let point = Point {
        gradient: axes.strain(gradient(start.begin)),
        increment: axes.strain(gradient(d_gradient)),
        flux: axes.stress(flux(start.forces)),
        state0: data.s0.internal_state_variables,
        state1: if request.prediction {
            unused = [0.0; MOST_STATES];
            unused.as_mut_ptr()
        } else {
            data.s1.internal_state_variables
        },
        time: 0.0,
        time_increment: data.dt,
        step_time: 0.0,
    };
    // With the request as a constant, what it does not ask for costs nothing.
    let answer = match request.tangent {
        Tangent::None => law.carry(&point, Tangent::None),
        Tangent::Elastic => law.carry(&point, Tangent::Elastic),
        Tangent::Consistent => law.carry(&point, Tangent::Consistent),
    }?;
    if !request.prediction {
        for (i, value) in axes.back(answer.flux).into_iter().enumerate() {
            // SAFETY: `N` components.
            unsafe { *data.s1.thermodynamic_forces.add(i) = value / scale(i) };
        }
    }
    if request.tangent != Tangent::None {
        let rests = rests_on_its_surface::<L, N>(&point, request.tangent);
        let loaded = rests.then(|| loading(law, point)).flatten();
        let operator = loaded.map_or(answer.operator, |loaded| loaded.operator);
        for (i, row) in axes.operator_back(&operator).iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                // SAFETY: where an operator is requested, `K` has `N` × `N` components.
                unsafe { *data.k.add(i * N + j) = value / (scale(i) * scale(j)) };
            }
        }
    }
    Ok(answer.unreliable)
}

/// Whether the tangent may be that for loading: see [`loading`].
#[inline]
fn rests_on_its_surface<L: Exported, const N: usize>(point: &Point<N>, tangent: Tangent) -> bool {
    let linear = L::FORMULATIONS[0].flags & PILUM_T_LINEAR != 0;
    let rests = point.increment.iter().all(|strain| *strain == 0.0);
    !linear && rests && tangent == Tangent::Consistent && N != 2
}

/// The tangent of a point on its yield surface that has not moved: the one for loading. Programs of
/// this interface begin an increment where it starts, with no strain; there the update has two
/// tangents, and with the elastic one a full Newton iteration may cycle for ever. A point inside
/// the surface stays elastic under the small strain along its deviatoric stress that tells the
/// two apart.
#[cold]
#[inline(never)]
fn loading<L: Carried<N>, const N: usize>(law: &L, point: Point<N>) -> Option<Answer<N>> {
    const SMALL_STRAIN: f64 = 1e-9;
    let mean = (point.flux[0] + point.flux[1] + point.flux[2]) / 3.0;
    let deviator: [f64; N] = std::array::from_fn(|i| {
        if i < 3 {
            point.flux[i] - mean
        } else {
            2.0 * point.flux[i]
        }
    });
    let size = deviator.iter().map(|s| s * s).sum::<f64>().sqrt();
    let mut unused = [0.0; MOST_STATES];
    let probe = Point {
        increment: deviator.map(|s| SMALL_STRAIN * s / size),
        state1: unused.as_mut_ptr(),
        ..point
    };
    law.carry(&probe, Tangent::Consistent).ok()
}

/// From Kelvin–Mandel components to ours: σ = s σ_M, ε = ε_M / s, C = s C_M s. Vectors of interfaces
/// have at most three components.
#[inline]
const fn scale(i: usize) -> f64 {
    if i < 3 { 1.0 } else { FRAC_1_SQRT_2 }
}

#[inline]
fn gradient<const N: usize>(mandel: [f64; N]) -> [f64; N] {
    std::array::from_fn(|i| mandel[i] / scale(i))
}

#[inline]
fn flux<const N: usize>(mandel: [f64; N]) -> [f64; N] {
    std::array::from_fn(|i| mandel[i] * scale(i))
}

/// Axes of a layer in a plane problem: the matrix that takes strains 11 22 33 12 to them. Stresses come
/// back by its transpose.
struct Axes(Option<[[f64; 4]; 4]>);

impl Axes {
    /// Their tangent lies at this angle in degrees.
    fn at(angle: f64) -> Self {
        let (s, c) = angle.to_radians().sin_cos();
        Self(Some([
            [c * c, s * s, 0.0, c * s],
            [s * s, c * c, 0.0, -c * s],
            [0.0, 0.0, 1.0, 0.0],
            [-2.0 * c * s, 2.0 * c * s, 0.0, (c - s) * (c + s)],
        ]))
    }

    /// Strains in these axes.
    #[inline]
    fn strain<const N: usize>(&self, global: [f64; N]) -> [f64; N] {
        self.times(global, |t, i, j| t[i][j])
    }

    /// Stresses in these axes.
    #[inline]
    fn stress<const N: usize>(&self, global: [f64; N]) -> [f64; N] {
        // A shear stress stands for half a shear strain.
        let halved = |i: usize| if i == 3 { 0.5 } else { 1.0 };
        self.times(global, |t, i, j| t[i][j] * halved(i) / halved(j))
    }

    /// Stresses in these axes to global ones.
    #[inline]
    fn back<const N: usize>(&self, local: [f64; N]) -> [f64; N] {
        self.times(local, |t, i, j| t[j][i])
    }

    #[inline]
    fn times<const N: usize>(
        &self,
        vector: [f64; N],
        entry: impl Fn(&[[f64; 4]; 4], usize, usize) -> f64,
    ) -> [f64; N] {
        let Some(turn) = &self.0 else {
            return vector;
        };
        let mut turned = [0.0; N];
        for (i, to) in turned.iter_mut().take(4).enumerate() {
            *to = (0..4).map(|j| entry(turn, i, j) * vector[j]).sum();
        }
        turned
    }

    /// Tᵀ C T of a tangent C in these axes, four components.
    #[inline]
    fn operator_back<const N: usize>(&self, operator: &[[f64; N]; N]) -> [[f64; N]; N] {
        let Some(t) = &self.0 else {
            return *operator;
        };
        let mut turned = [[0.0; N]; N];
        for (i, row) in turned.iter_mut().take(4).enumerate() {
            for (j, to) in row.iter_mut().take(4).enumerate() {
                let sum = (0..4).flat_map(|k| (0..4).map(move |l| (k, l)));
                *to = sum.map(|(k, l)| t[k][i] * operator[k][l] * t[l][j]).sum();
            }
        }
        turned
    }
}
