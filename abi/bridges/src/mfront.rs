//! MFront's generic behaviours: the symbols that MGIS, and programs built on it, read, and the
//! call for one point.
//!
//! The behaviour is named as the Rust type. Names of properties and variables are the ids in
//! MFront's spelling: `young_modulus` is `YoungModulus`. Parameters that must be given are
//! *material properties*; those with a default, and optional ones, are MFront's *parameters*, which
//! hold for the whole process and are set with `<behaviour>_setParameter`. Bounds are MFront's physical
//! bounds, usual ranges its bounds.
//!
//! A law in axes of a layer has one more material property, `LayerAngle`: the angle in degrees from the
//! first axis to the layer's tangent, towards the second. So the behaviour takes global axes.
//!
//! Gradients and fluxes are Kelvin–Mandel vectors there: shear strain γ/√2, shear stress √2 τ.

use crate::laws::{Laws, MOST_PARAMETERS, has_default, tell};
use crate::point::{Carried, Point};
use crate::umat::row;
use abi::export::Exported;
use abi::raw::{self, PILUM_T_LINEAR, PILUM_T_LOCAL_AXES};
use abi::{Hypothesis, Parameters, Tangent};
use std::f64::consts::FRAC_1_SQRT_2;
use std::ffi::{CStr, c_char, c_int};
use std::fmt;
use std::ptr::null;
use std::sync::atomic::{AtomicU64, Ordering};

/// Exports a law as a behaviour of MFront's generic interface; see [`export!`](crate::export).
#[macro_export]
macro_rules! export_mfront {
    (continuum $law:ident $(, $($names:tt)+)?) => {
        $crate::export_mfront!(continuum $law in Tridimensional PlaneStrain Axisymmetrical
            $(, $($names)+)?);
    };
    (continuum $law:ident in $($hypothesis:ident)+ $(, $($names:tt)+)?) => {
        $crate::export_mfront!(@behaviour $law, $crate::abi::export::Continuum<$law>,
            [Strain Stress StandardStrainBased], [$($hypothesis)+]);
        $( $crate::export_mfront!(@bounds $law, $crate::abi::export::Continuum<$law>, $($names)+); )?
    };
    (interface $law:ident $(, $($names:tt)+)?) => {
        $crate::export_mfront!(@behaviour $law, $crate::abi::export::Interface<$law>,
            [OpeningDisplacement CohesiveForce CohesiveZone], [PlaneStrain Axisymmetrical]);
        $( $crate::export_mfront!(@bounds $law, $crate::abi::export::Interface<$law>, $($names)+); )?
    };
    (@bounds $law:ident, $exported:ty,
        properties: [$($property:ident)*], parameters: [$($setting:ident)*]) => {
        const _: () = {
            use $crate::mfront as m;
            type Law = $exported;
            const {
                assert!(
                    m::are_named::<Law>(
                        &[$(stringify!($property)),*],
                        &[$(stringify!($setting)),*],
                    ),
                    "these are not the names of all properties and parameters in their order"
                );
            }
            $crate::export_mfront!(@bound $law [$($property)* $($setting)*]);
            $( const _: () = {
                #[unsafe(export_name = concat!(stringify!($law), "_", stringify!($setting),
                    "_ParameterDefaultValue"))]
                pub static DATUM: f64 = m::declared::<Law>(stringify!($setting)).default_value;
            }; )*
        };
    };
    (@bound $law:ident [$($name:ident)*]) => { $(
        $crate::export_mfront!(@long_doubles $law $name [
            "_LowerPhysicalBound" = lower,
            "_UpperPhysicalBound" = upper,
            "_LowerBound" = usual_lower,
            "_UpperBound" = usual_upper,
        ]);
    )* };
    (@long_doubles $law:ident $name:ident [$($suffix:literal = $field:ident,)+]) => { $(
        // Only there it is known how C stores a `long double`.
        #[cfg(all(target_arch = "x86_64", unix))]
        const _: () = {
            #[unsafe(export_name = concat!(stringify!($law), "_", stringify!($name), $suffix))]
            pub static DATUM: m::LongDouble =
                m::LongDouble::of(m::declared::<Law>(stringify!($name)).$field);
        };
    )+ };
    (@behaviour $law:ident, $exported:ty, [$gradient:ident $flux:ident $kind:ident],
        [$($hypothesis:ident)+]) => {
        const _: () = {
            use $crate::mfront as m;
            type Law = $exported;

            static LAWS: $crate::laws::Laws<Law> =
                $crate::laws::Laws::new();
            static SETTINGS: m::Settings = m::Settings::of::<Law>();

            $crate::export_mfront!(@numbers $law u16 [
                "_mfront_mkt" = 1,
                "_api_version" = 1,
                "_BehaviourType" = m::Kind::$kind.behaviour_type(),
                "_BehaviourKinematic" = m::Kind::$kind.kinematic(),
                "_SymmetryType" = 0,
                "_ElasticSymmetryType" = 0,
                "_nModellingHypotheses" = [$(stringify!($hypothesis)),+].len() as u16,
                "_nGradients" = 1,
                "_nThermodynamicForces" = 1,
                "_nTangentOperatorBlocks" = 2,
                "_nMaterialProperties" = m::n_properties::<Law>() as u16,
                "_nInternalStateVariables" = m::n_states::<Law>() as u16,
                "_nExternalStateVariables" = 0,
                "_TemperatureRemovedFromExternalStateVariables" = 0,
                "_nParameters" = m::n_settings::<Law>() as u16,
                "_requiresStiffnessTensor" = 0,
                "_requiresThermalExpansionCoefficientTensor" = 0,
                "_ComputesInternalEnergy" = 0,
                "_ComputesDissipatedEnergy" = 0,
                "_nInitializeFunctions" = 0,
                "_nPostProcessings" = 0,
                "_UsableInPurelyImplicitResolution" = 1,
            ]);
            $crate::export_mfront!(@texts $law [
                "_mfront_ept" = stringify!($law),
                "_mfront_interface" = "Generic",
                "_unit_system" = "",
                "_src" = "",
            ]);
            $crate::export_mfront!(@words $law [
                "_ModellingHypotheses" = $($hypothesis)+,
                "_Gradients" = $gradient,
                "_ThermodynamicForces" = $flux,
                "_TangentOperatorBlocks" = $flux $gradient,
            ]);
            $crate::export_mfront!(@names $law [
                "_MaterialProperties" = property_names, n_properties,
                "_InternalStateVariables" = state_names, n_states,
                "_Parameters" = setting_names, n_settings,
            ]);
            $crate::export_mfront!(@types $law [
                "_GradientsTypes" = [m::Kind::$kind.variable_type(), 0],
                "_ThermodynamicForcesTypes" = [m::Kind::$kind.variable_type(), 0],
                "_InternalStateVariablesTypes" = [0; m::n_states::<Law>() + 1],
                "_ParametersTypes" = [0; m::n_settings::<Law>() + 1],
            ]);

            #[unsafe(export_name = concat!(stringify!($law), "_setParameter"))]
            pub unsafe extern "C" fn set(
                name: *const ::std::ffi::c_char,
                value: f64,
            ) -> ::std::ffi::c_int {
                // SAFETY: passed on to the caller.
                unsafe { SETTINGS.set::<Law>(name, value) }
            }
            #[unsafe(export_name = concat!(stringify!($law), "_setOutOfBoundsPolicy"))]
            pub extern "C" fn policy(_: ::std::ffi::c_int) {}

            $( const _: () = {
                const HYPOTHESIS: $crate::abi::Hypothesis =
                    m::Kind::$kind.hypothesis(m::Modelling::$hypothesis);
                const {
                    assert!(
                        $crate::laws::offers::<Law>(HYPOTHESIS),
                        "the law does not offer the hypothesis"
                    );
                }
                #[unsafe(export_name = concat!(stringify!($law), "_", stringify!($hypothesis)))]
                pub unsafe extern "C" fn integrate(data: *mut m::Data) -> ::std::ffi::c_int {
                    // SAFETY: passed on to the caller.
                    unsafe { m::integrate::<Law>(&LAWS, &SETTINGS, HYPOTHESIS, data) }
                }
            }; )+
        };
    };
    (@numbers $law:ident $type:ty [$($suffix:literal = $value:expr,)+]) => { $( const _: () = {
        #[unsafe(export_name = concat!(stringify!($law), $suffix))]
        pub static DATUM: $type = $value;
    }; )+ };
    (@texts $law:ident [$($suffix:literal = $text:expr,)+]) => { $( const _: () = {
        #[unsafe(export_name = concat!(stringify!($law), $suffix))]
        pub static DATUM: m::Texts<1> =
            m::Texts::new([$crate::abi::descriptor::c_str(concat!($text, "\0"))]);
    }; )+ };
    (@words $law:ident [$($suffix:literal = $($word:ident)+,)+]) => { $( const _: () = {
        const WORDS: &[&::std::ffi::CStr] =
            &[$($crate::abi::descriptor::c_str(concat!(stringify!($word), "\0"))),+];
        #[unsafe(export_name = concat!(stringify!($law), $suffix))]
        pub static DATUM: m::Texts<{ WORDS.len() }> = m::Texts::of(WORDS);
    }; )+ };
    (@names $law:ident [$($suffix:literal = $names:ident, $n:ident,)+]) => { $( const _: () = {
        static NAMES: [m::Name; m::$n::<Law>()] = m::$names::<Law, { m::$n::<Law>() }>();
        #[unsafe(export_name = concat!(stringify!($law), $suffix))]
        pub static DATUM: m::Texts<{ m::$n::<Law>() + 1 }> = m::Texts::named(&NAMES);
    }; )+ };
    (@types $law:ident [$($suffix:literal = $types:expr,)+]) => { $( const _: () = {
        const TYPES: &[::std::ffi::c_int] = &$types;
        #[unsafe(export_name = concat!(stringify!($law), $suffix))]
        pub static DATUM: [::std::ffi::c_int; TYPES.len()] = $types;
    }; )+ };
}

/// What MFront's interface is told of a behaviour by numbers.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// Strain and stress.
    StandardStrainBased,
    /// Opening and traction.
    CohesiveZone,
}

/// MFront's modelling hypotheses that a law may offer.
#[expect(missing_docs, reason = "the names are MFront's")]
#[derive(Clone, Copy, Debug)]
pub enum Modelling {
    Tridimensional,
    PlaneStrain,
    Axisymmetrical,
}

impl Kind {
    /// `BehaviourType`.
    pub const fn behaviour_type(self) -> u16 {
        match self {
            Self::StandardStrainBased => 1,
            Self::CohesiveZone => 3,
        }
    }

    /// `BehaviourKinematic`.
    pub const fn kinematic(self) -> u16 {
        match self {
            Self::StandardStrainBased => 1,
            Self::CohesiveZone => 2,
        }
    }

    /// Type of gradient and flux: symmetric tensor or vector.
    pub const fn variable_type(self) -> c_int {
        match self {
            Self::StandardStrainBased => 1,
            Self::CohesiveZone => 2,
        }
    }

    /// The hypothesis in our words.
    pub const fn hypothesis(self, modelling: Modelling) -> Hypothesis {
        match (self, modelling) {
            (Self::CohesiveZone, _) => Hypothesis::Interface2d,
            (_, Modelling::Tridimensional) => Hypothesis::ThreeD,
            (_, Modelling::PlaneStrain) => Hypothesis::PlaneStrain,
            (_, Modelling::Axisymmetrical) => Hypothesis::Axisymmetric,
        }
    }
}

/// Texts in static storage.
#[repr(transparent)]
#[derive(Debug)]
pub struct Texts<const N: usize>([*const c_char; N]);

// SAFETY: pointers to static texts that nothing changes.
unsafe impl<const N: usize> Sync for Texts<N> {}

impl<const N: usize> Texts<N> {
    /// These texts.
    pub const fn new(texts: [&'static CStr; N]) -> Self {
        Self::of(&texts)
    }

    /// `N` texts.
    pub const fn of(texts: &[&'static CStr]) -> Self {
        let mut pointers = [null(); N];
        let mut i = 0;
        while i < N {
            pointers[i] = texts[i].as_ptr();
            i += 1;
        }
        Self(pointers)
    }

    /// `N` − 1 names, and null behind them: a symbol is never of size zero.
    pub const fn named(names: &'static [Name]) -> Self {
        let mut pointers = [null(); N];
        let mut i = 0;
        while i < names.len() {
            pointers[i] = names[i].as_ptr().cast();
            i += 1;
        }
        Self(pointers)
    }
}

/// A name in MFront's spelling, padded with NUL.
pub type Name = [u8; LONGEST_NAME];
const LONGEST_NAME: usize = 64;
/// The material property that a law in axes of its layer has besides.
const LAYER_ANGLE: &CStr = c"layer_angle";
/// Most internal variables of a behaviour.
const MOST_STATES: usize = 64;

/// `young_modulus` as `YoungModulus`.
///
/// # Panics
/// If the id is too long; at compile time, where a law is exported.
const fn spelled(id: *const c_char) -> Name {
    // SAFETY: ids of declared parameters and variables are static strings.
    let id = unsafe { CStr::from_ptr(id) }.to_bytes();
    let mut name = [0; LONGEST_NAME];
    let (mut from, mut to, mut begins) = (0, 0, true);
    while from < id.len() {
        if id[from] == b'_' {
            begins = true;
        } else {
            assert!(to + 1 < LONGEST_NAME, "an id is too long");
            name[to] = if begins {
                id[from].to_ascii_uppercase()
            } else {
                id[from]
            };
            to += 1;
            begins = false;
        }
        from += 1;
    }
    name
}

/// The parameters of a law, by whether they may be left out.
const fn n_parameters<L: Exported>(left_out: bool) -> usize {
    let table = <L::Parameters as Parameters>::TABLE;
    let (mut n, mut i) = (0, 0);
    while i < table.len() {
        if has_default(&table[i]) == left_out {
            n += 1;
        }
        i += 1;
    }
    n
}

const fn parameter_names<L: Exported, const N: usize>(left_out: bool) -> [Name; N] {
    let table = <L::Parameters as Parameters>::TABLE;
    let mut names = [[0; LONGEST_NAME]; N];
    let (mut n, mut i) = (0, 0);
    while i < table.len() {
        if has_default(&table[i]) == left_out {
            names[n] = spelled(table[i].raw().id);
            n += 1;
        }
        i += 1;
    }
    names
}

/// Number of material properties: the parameters that must be given, and the layer's angle of a law in
/// its axes.
pub const fn n_properties<L: Exported>() -> usize {
    n_parameters::<L>(false) + has_axes::<L>() as usize
}

/// Whether a law is in axes of its layer.
const fn has_axes<L: Exported>() -> bool {
    L::FORMULATIONS[0].flags & PILUM_T_LOCAL_AXES != 0
}

/// Their names.
pub const fn property_names<L: Exported, const N: usize>() -> [Name; N] {
    let mut names = parameter_names::<L, N>(false);
    if has_axes::<L>() {
        names[N - 1] = spelled(LAYER_ANGLE.as_ptr());
    }
    names
}

/// Number of MFront's parameters.
pub const fn n_settings<L: Exported>() -> usize {
    n_parameters::<L>(true)
}

/// Their names.
pub const fn setting_names<L: Exported, const N: usize>() -> [Name; N] {
    parameter_names::<L, N>(true)
}

/// The description of the parameter that has this name in MFront's spelling.
///
/// # Panics
/// If there is none; at compile time, where a law is exported.
pub const fn declared<L: Exported>(name: &str) -> &'static raw::Parameter {
    let table = <L::Parameters as Parameters>::TABLE;
    let mut i = 0;
    while i < table.len() && !is_spelled(table[i].raw(), name) {
        i += 1;
    }
    assert!(
        i < table.len(),
        "the law has no parameter of this name in MFront's spelling"
    );
    table[i].raw()
}

const fn is_spelled(parameter: &raw::Parameter, name: &str) -> bool {
    let (spelled, name) = (spelled(parameter.id), name.as_bytes());
    let mut i = 0;
    while i < name.len() {
        if i >= LONGEST_NAME || spelled[i] != name[i] {
            return false;
        }
        i += 1;
    }
    spelled[i] == 0
}

/// Whether these are the names of all parameters that must be given, and of all others.
pub const fn are_named<L: Exported>(properties: &[&str], settings: &[&str]) -> bool {
    let table = <L::Parameters as Parameters>::TABLE;
    let (mut n_properties, mut n_settings) = (0, 0);
    let mut i = 0;
    while i < table.len() {
        let (names, n) = if has_default(&table[i]) {
            n_settings += 1;
            (settings, n_settings)
        } else {
            n_properties += 1;
            (properties, n_properties)
        };
        if n > names.len() || !is_spelled(table[i].raw(), names[n - 1]) {
            return false;
        }
        i += 1;
    }
    n_properties == properties.len() && n_settings == settings.len()
}

/// A `long double` of x86-64: 64 bits of mantissa with the leading one, 15 of exponent, a sign.
#[repr(C, align(16))]
#[derive(Debug)]
pub struct LongDouble([u8; 16]);

impl LongDouble {
    /// The same number; those too small to be normal are 0.
    pub const fn of(value: f64) -> Self {
        let bits = value.to_bits();
        let sign = (bits >> 63) as u16;
        let fraction = bits << 12 >> 1;
        let (exponent, mantissa) = match (bits >> 52) & 0x7ff {
            0 => (0, 0),
            0x7ff => (0x7fff, 1 << 63 | fraction),
            exponent => (exponent as u16 + (16383 - 1023), 1 << 63 | fraction),
        };
        let mantissa = mantissa.to_le_bytes();
        let top = (sign << 15 | exponent).to_le_bytes();
        let mut bytes = [0; 16];
        let mut i = 0;
        while i < 8 {
            bytes[i] = mantissa[i];
            i += 1;
        }
        (bytes[8], bytes[9]) = (top[0], top[1]);
        Self(bytes)
    }
}

/// Number of internal variables.
///
/// # Panics
/// If there are too many; at compile time, where a law is exported.
pub const fn n_states<L: Exported>() -> usize {
    assert!(L::STATE.len() <= MOST_STATES, "too many internal variables");
    L::STATE.len()
}

/// Their names.
pub const fn state_names<L: Exported, const N: usize>() -> [Name; N] {
    let mut names = [[0; LONGEST_NAME]; N];
    let mut i = 0;
    while i < N {
        names[i] = spelled(L::STATE[i].raw().id);
        i += 1;
    }
    names
}

/// Values of MFront's parameters, in the places that the law's parameters have.
#[derive(Debug)]
pub struct Settings([AtomicU64; MOST_PARAMETERS]);

impl Settings {
    /// The defaults of a law.
    pub const fn of<L: Exported>() -> Self {
        let table = <L::Parameters as Parameters>::TABLE;
        let mut values = [const { AtomicU64::new(0) }; MOST_PARAMETERS];
        let mut i = 0;
        while i < table.len() {
            values[i] = AtomicU64::new(table[i].raw().default_value.to_bits());
            i += 1;
        }
        Self(values)
    }

    /// Sets a parameter, for the whole process. 1 if there is one of this name, else 0.
    ///
    /// # Safety
    /// `name` is null or a text that ends in NUL.
    pub unsafe fn set<L: Exported>(&self, name: *const c_char, value: f64) -> c_int {
        if name.is_null() {
            return 0;
        }
        // SAFETY: see above.
        let name = unsafe { CStr::from_ptr(name) };
        for (declared, place) in <L::Parameters as Parameters>::TABLE.iter().zip(&self.0) {
            let known = spelled(declared.raw().id);
            if has_default(declared)
                && CStr::from_bytes_until_nul(&known).is_ok_and(|known| known == name)
            {
                place.store(value.to_bits(), Ordering::Relaxed);
                return 1;
            }
        }
        0
    }
}

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

/// What a call is for.
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
/// with the step factor in `rdt` and the reason in `error_message`.
///
/// # Safety
/// `data` is null or as MFront's interface says.
pub unsafe fn integrate<L: Carried>(
    laws: &Laws<L>,
    settings: &Settings,
    hypothesis: Hypothesis,
    data: *mut Data,
) -> c_int {
    // SAFETY: see above.
    let Some(data) = (unsafe { data.as_ref() }) else {
        return -1;
    };
    let say = |text: fmt::Arguments<'_>| {
        let id = L::DESCRIPTION.id.to_string_lossy();
        // SAFETY: `error_message` is null or has room for 512 bytes.
        unsafe { tell(data.error_message, format_args!("{id}: {text}")) };
    };
    // SAFETY: passed on to the caller.
    match unsafe { carry(laws, settings, hypothesis, data, say) } {
        Ok(None) => 1,
        Ok(Some(why)) => {
            say(format_args!("{why}"));
            0
        }
        Err(factor) => {
            if !data.rdt.is_null() {
                // SAFETY: valid where it is not null.
                unsafe { *data.rdt = factor.min(*data.rdt) };
            }
            -1
        }
    }
}

/// The reason why the results are inaccurate, if they are.
///
/// # Errors
/// The step factor; the reason is said.
///
/// # Safety
/// As [`integrate`].
unsafe fn carry<L: Carried>(
    laws: &Laws<L>,
    settings: &Settings,
    hypothesis: Hypothesis,
    data: &Data,
    say: impl Fn(fmt::Arguments<'_>),
) -> Result<Option<&'static str>, f64> {
    let refuse = |why: &str| {
        say(format_args!("{why}"));
        0.25
    };
    let (n, n_states) = (hypothesis.n_components(), L::STATE.len());
    let (s0, s1) = (&data.s0, &data.s1);
    // SAFETY: `K` is null or has one value at least.
    let request = unsafe { data.k.as_ref() }.map_or(Ok(Request::NONE), |k| Request::decoded(*k));
    let request = request.map_err(refuse)?;
    let missing = s0.gradients.is_null()
        || s1.gradients.is_null()
        || s0.thermodynamic_forces.is_null()
        || s1.thermodynamic_forces.is_null()
        || (n_states > 0 && s0.internal_state_variables.is_null())
        || (n_states > 0 && s1.internal_state_variables.is_null())
        || (n_properties::<L>() > 0 && s1.material_properties.is_null());
    if missing {
        return Err(refuse("an array that is needed is null"));
    }
    let mut given = [0.0; MOST_PARAMETERS];
    let mut properties = 0..;
    let table = <L::Parameters as Parameters>::TABLE;
    for (v, declared) in table.iter().enumerate() {
        given[v] = if has_default(declared) {
            f64::from_bits(settings.0[v].load(Ordering::Relaxed))
        } else {
            // Some programs fill the properties of the end of the increment only.
            // SAFETY: as many as there are names.
            unsafe {
                *s1.material_properties
                    .add(properties.next().unwrap_or_default())
            }
        };
    }
    let scale = Scale::of(hypothesis);
    let axes = if has_axes::<L>() {
        // SAFETY: as many as there are names, of which the angle is the last.
        let angle = unsafe { *s1.material_properties.add(n_properties::<L>() - 1) };
        if !angle.is_finite() {
            return Err(refuse("LayerAngle is not finite"));
        }
        Axes::at(angle)
    } else {
        Axes(None)
    };
    let mut unused = [0.0; MOST_STATES];
    // SAFETY: `n` components.
    let point = unsafe {
        let begin = row(s0.gradients, n);
        let end = if request.prediction {
            begin
        } else {
            row(s1.gradients, n)
        };
        Point {
            n_components: n,
            gradient: axes.strain(scale.gradient(begin)),
            increment: axes.strain(scale.gradient(std::array::from_fn(|i| end[i] - begin[i]))),
            flux: axes.stress(scale.flux(row(s0.thermodynamic_forces, n))),
            state0: s0.internal_state_variables,
            state1: if request.prediction {
                unused.as_mut_ptr()
            } else {
                s1.internal_state_variables
            },
            time: 0.0,
            time_increment: data.dt,
            step_time: 0.0,
        }
    };
    let mut factor = 0.25;
    let answer = laws.carry(&given[..table.len()], &point, request.tangent, |trouble| {
        factor = trouble.factor();
        say(format_args!("{trouble}"));
    });
    let answer = answer.ok_or(factor)?;
    let operator =
        loading(laws, &given[..table.len()], &point, request.tangent).unwrap_or(answer.operator);
    let (flux, operator) = (axes.back(answer.flux), axes.operator_back(&operator));
    for i in 0..n {
        if !request.prediction {
            // SAFETY: `n` components.
            unsafe { *s1.thermodynamic_forces.add(i) = flux[i] / scale.0[i] };
        }
        for j in 0..n {
            if request.tangent != Tangent::None {
                let value = operator[i * n + j] / (scale.0[i] * scale.0[j]);
                // SAFETY: where an operator is requested, `K` has `n` × `n` components.
                unsafe { *data.k.add(i * n + j) = value };
            }
        }
    }
    Ok(answer.unreliable)
}

/// The tangent of a point on its yield surface that has not moved: the one for loading. Programs of
/// this interface begin an increment where it starts, with no strain; there the update has two
/// tangents, and with the elastic one a full Newton iteration may cycle for ever. A point inside
/// the surface stays elastic under the small strain along its deviatoric stress that tells the
/// two apart.
fn loading<L: Carried>(
    laws: &Laws<L>,
    given: &[f64],
    point: &Point,
    tangent: Tangent,
) -> Option<[f64; 36]> {
    const SMALL_STRAIN: f64 = 1e-9;
    let rests = point.increment.iter().all(|strain| *strain == 0.0);
    let linear = L::FORMULATIONS[0].flags & PILUM_T_LINEAR != 0;
    if linear || !rests || tangent != Tangent::Consistent || point.n_components == 2 {
        return None;
    }
    let mean = (point.flux[0] + point.flux[1] + point.flux[2]) / 3.0;
    let deviator: [f64; 6] = std::array::from_fn(|i| {
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
        ..*point
    };
    laws.carry(given, &probe, tangent, |_| ())
        .map(|answer| answer.operator)
}

/// From Kelvin–Mandel components to ours: σ = s σ_M, ε = ε_M / s, C = s C_M s.
struct Scale([f64; 6]);

impl Scale {
    fn of(hypothesis: Hypothesis) -> Self {
        Self(std::array::from_fn(|i| {
            if i < 3 || hypothesis.is_interface() {
                1.0
            } else {
                FRAC_1_SQRT_2
            }
        }))
    }

    fn gradient(&self, mandel: [f64; 6]) -> [f64; 6] {
        std::array::from_fn(|i| mandel[i] / self.0[i])
    }

    fn flux(&self, mandel: [f64; 6]) -> [f64; 6] {
        std::array::from_fn(|i| mandel[i] * self.0[i])
    }
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
    fn strain(&self, global: [f64; 6]) -> [f64; 6] {
        self.times(global, |t, i, j| t[i][j])
    }

    /// Stresses in these axes.
    fn stress(&self, global: [f64; 6]) -> [f64; 6] {
        // A shear stress stands for half a shear strain.
        let halved = |i: usize| if i == 3 { 0.5 } else { 1.0 };
        self.times(global, |t, i, j| t[i][j] * halved(i) / halved(j))
    }

    /// Stresses in these axes to global ones.
    fn back(&self, local: [f64; 6]) -> [f64; 6] {
        self.times(local, |t, i, j| t[j][i])
    }

    fn times(
        &self,
        vector: [f64; 6],
        entry: impl Fn(&[[f64; 4]; 4], usize, usize) -> f64,
    ) -> [f64; 6] {
        let Some(turn) = &self.0 else {
            return vector;
        };
        let mut turned = [0.0; 6];
        for (i, to) in turned.iter_mut().take(4).enumerate() {
            *to = (0..4).map(|j| entry(turn, i, j) * vector[j]).sum();
        }
        turned
    }

    /// Tᵀ C T of a tangent C in these axes, row by row, four components.
    fn operator_back(&self, operator: &[f64; 36]) -> [f64; 36] {
        let Some(t) = &self.0 else {
            return *operator;
        };
        let mut turned = [0.0; 36];
        for i in 0..4 {
            for j in 0..4 {
                let sum = (0..4).flat_map(|k| (0..4).map(move |l| (k, l)));
                turned[4 * i + j] = sum
                    .map(|(k, l)| t[k][i] * operator[4 * k + l] * t[l][j])
                    .sum();
            }
        }
        turned
    }
}
