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

mod call;

pub use call::{Data, InitialState, State, integrate};

use crate::laws::has_default;
use abi::export::Exported;
use abi::raw::{self, PILUM_T_LOCAL_AXES};
use abi::{Hypothesis, Parameters};
use std::ffi::{CStr, c_char, c_int};
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
            static SETTINGS: m::Settings<{ m::n_parameters::<Law>() }> =
                m::Settings::of::<Law>();

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
                    unsafe {
                        m::integrate::<Law, { HYPOTHESIS.n_components() }, _>(&LAWS, &SETTINGS, data)
                    }
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

/// Numbers that describe a behaviour to MFront's interface.
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

/// Number of all parameters of a law.
pub const fn n_parameters<L: Exported>() -> usize {
    <L::Parameters as Parameters>::TABLE.len()
}

/// The parameters of a law, by whether they may be left out.
const fn n_declared<L: Exported>(left_out: bool) -> usize {
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
    n_declared::<L>(false) + has_axes::<L>() as usize
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
    n_declared::<L>(true)
}

/// Their names.
pub const fn setting_names<L: Exported, const N: usize>() -> [Name; N] {
    parameter_names::<L, N>(true)
}

/// The description of the parameter that has this name in MFront's spelling.
///
/// # Panics
/// If none exists; at compile time, where a law is exported.
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
pub struct Settings<const P: usize>([AtomicU64; P]);

impl<const P: usize> Settings<P> {
    /// The defaults of a law with `P` parameters.
    pub const fn of<L: Exported>() -> Self {
        let table = <L::Parameters as Parameters>::TABLE;
        let mut values = [const { AtomicU64::new(0) }; P];
        let mut i = 0;
        while i < P {
            values[i] = AtomicU64::new(table[i].raw().default_value.to_bits());
            i += 1;
        }
        Self(values)
    }

    /// The value of the parameter in this place.
    fn value(&self, place: usize) -> f64 {
        f64::from_bits(self.0[place].load(Ordering::Relaxed))
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
