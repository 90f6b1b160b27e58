//! How a law describes itself: parameters and internal variables are declared once, with
//! [`parameters!`](crate::parameters) and [`internal_variables!`](crate::internal_variables), and
//! everything else derives from the declaration.

mod formulation;

use crate::raw;
use std::ffi::{CStr, c_char};
use std::mem::size_of;
use std::ptr::null;

/// A kinematic hypothesis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum Hypothesis {
    /// Components 11 22 33 12, 33 out of plane.
    PlaneStrain = raw::PILUM_H_PLANE_STRAIN,
    /// Components 11 (radial) 22 (axial) 33 (hoop) 12.
    Axisymmetric = raw::PILUM_H_AXISYMMETRIC,
    /// Components 11 22 33 12 13 23.
    ThreeD = raw::PILUM_H_3D,
    /// Components normal, tangential.
    Interface2d = raw::PILUM_H_INTERFACE_2D,
    /// Components normal, first tangential, second tangential.
    Interface3d = raw::PILUM_H_INTERFACE_3D,
}

impl Hypothesis {
    /// All hypotheses this version of the host can use.
    pub const ALL: [Self; 5] = [
        Self::PlaneStrain,
        Self::Axisymmetric,
        Self::ThreeD,
        Self::Interface2d,
        Self::Interface3d,
    ];

    /// The hypothesis with this code.
    pub fn from_code(code: raw::HypothesisCode) -> Option<Self> {
        Self::ALL.into_iter().find(|h| *h as i32 == code)
    }

    /// Name in files: `plane_strain`, `axisymmetric`, `3d`, `interface_2d`,
    /// `interface_3d`.
    pub fn name(self) -> &'static str {
        match self {
            Self::PlaneStrain => "plane_strain",
            Self::Axisymmetric => "axisymmetric",
            Self::ThreeD => "3d",
            Self::Interface2d => "interface_2d",
            Self::Interface3d => "interface_3d",
        }
    }

    /// Names of the components of gradient and flux, in order.
    pub fn components(self) -> &'static [&'static str] {
        match self {
            Self::PlaneStrain | Self::Axisymmetric => &["11", "22", "33", "12"],
            Self::ThreeD => &["11", "22", "33", "12", "13", "23"],
            Self::Interface2d => &["n", "t"],
            Self::Interface3d => &["n", "t", "s"],
        }
    }

    /// Number of components of gradient and flux.
    pub const fn n_components(self) -> usize {
        match self {
            Self::PlaneStrain | Self::Axisymmetric => 4,
            Self::ThreeD => 6,
            Self::Interface2d => 2,
            Self::Interface3d => 3,
        }
    }

    /// Whether it is one of interfaces, with jumps and tractions.
    pub const fn is_interface(self) -> bool {
        matches!(self, Self::Interface2d | Self::Interface3d)
    }
}

/// Name and origin of a law. Made by [`describe!`](crate::describe).
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Identifier `[a-z][a-z0-9_]*`, public interface.
    pub id: &'static CStr,
    /// Name in words.
    pub name: &'static CStr,
    /// Version of the law's crate.
    pub version: &'static CStr,
    /// Authors of the law's crate.
    pub author: &'static CStr,
    /// Licence of the law's crate.
    pub licence: &'static CStr,
    /// A sentence or two.
    pub doc: &'static CStr,
    /// Sources.
    pub references: &'static CStr,
}

/// Describes a law; version, authors and licence come from the crate that uses the macro.
#[macro_export]
macro_rules! describe {
    (id: $id:literal, name: $name:literal, doc: $doc:literal, references: $references:literal $(,)?) => {
        $crate::Description {
            id: $crate::descriptor::c_str(concat!($id, "\0")),
            name: $crate::descriptor::c_str(concat!($name, "\0")),
            version: $crate::descriptor::c_str(concat!(env!("CARGO_PKG_VERSION"), "\0")),
            author: $crate::descriptor::c_str(concat!(env!("CARGO_PKG_AUTHORS"), "\0")),
            licence: $crate::descriptor::c_str(concat!(env!("CARGO_PKG_LICENSE"), "\0")),
            doc: $crate::descriptor::c_str(concat!($doc, "\0")),
            references: $crate::descriptor::c_str(concat!($references, "\0")),
        }
    };
}

/// A string that ends in NUL, as C sees it.
///
/// # Panics
/// If it does not end in NUL or holds another one; at compile time, where it is used.
#[expect(clippy::panic, reason = "evaluated at compile time")]
pub const fn c_str(text: &'static str) -> &'static CStr {
    match CStr::from_bytes_with_nul(text.as_bytes()) {
        Ok(text) => text,
        Err(_) => panic!("the text must end in NUL and hold no other"),
    }
}

/// The parameters of a law, as its `new` receives them.
pub trait Parameters: Sized {
    /// Declarations, in the order of the values.
    const TABLE: &'static [Parameter];
    /// Takes the values, in declared order. Optional ones that were left out are NaN.
    fn read(values: &[f64]) -> Self;
}

/// The internal variables of a law; all scalars.
pub trait InternalVariables: Copy + Send + Sync {
    /// Declarations, in the order of the values.
    const TABLE: &'static [Variable];
    /// Collects the values, number by number. Asking for one that [`TABLE`](Self::TABLE) does not
    /// declare panics.
    fn read(value: impl Fn(usize) -> f64) -> Self;
    /// Hands out the values, number by number, each declared one once. Handing out one that
    /// [`TABLE`](Self::TABLE) does not declare panics.
    fn write(&self, put: impl FnMut(usize, f64));
    /// The declared initial values.
    fn initial() -> Self {
        Self::read(|i| Self::TABLE[i].0.initial_value)
    }
}

impl InternalVariables for () {
    const TABLE: &'static [Variable] = &[];
    fn read(_: impl Fn(usize) -> f64) -> Self {}
    fn write(&self, _: impl FnMut(usize, f64)) {}
}

/// Declares the parameters of a law: a struct of numbers whose doc comments, units and bounds are
/// also what the host checks and prints. A table may include another, whose parameters then are in
/// its place.
///
/// ```
/// use abi::{Parameter, Parameters as _};
/// abi::parameters! {
///     /// Parameters of a spring.
///     pub struct Spring {
///         /// Stiffness.
///         stiffness: Parameter::new(c"k", c"kN/m").above(0.0),
///         /// Strength; unlimited if left out.
///         strength: Parameter::new(c"F", c"kN").at_least(0.0).optional(),
///     }
/// }
/// abi::parameters! {
///     /// Parameters of a spring with a dashpot.
///     pub struct Damped {
///         ..spring: Spring,
///         /// Viscosity.
///         viscosity: Parameter::new(c"c", c"kN s/m").at_least(0.0),
///     }
/// }
/// assert_eq!(Damped::TABLE.len(), 3);
/// let damped = Damped::read(&[1.0, 2.0, 3.0]);
/// assert_eq!((damped.spring.strength, damped.viscosity), (2.0, 3.0));
/// ```
#[macro_export]
macro_rules! parameters {
    ($(#[$meta:meta])* pub struct $name:ident<T> {
        $( $(#[doc = $doc:literal])+ $field:ident : $spec:expr ),* $(,)?
    }) => {
        $crate::numbers!($(#[$meta])* $name { $( [$($doc)+] $field )* });
        impl $crate::Parameters for $name<f64> {
            const TABLE: &'static [$crate::Parameter] = &[ $(
                $spec.called(
                    $crate::descriptor::c_str(concat!(stringify!($field), "\0")),
                    $crate::descriptor::c_str(concat!($($doc),+, "\0")),
                ),
            )* ];
            fn read(values: &[f64]) -> Self {
                <Self as $crate::dual::Values<f64>>::collect(|i| {
                    values.get(i).copied().unwrap_or(f64::NAN)
                })
            }
        }
    };
    ($(#[$meta:meta])* pub struct $name:ident { $($items:tt)* }) => {
        $crate::parameters!(@sorted [$(#[$meta])* $name] [] $($items)*);
    };
    (@sorted $struct:tt [$($items:tt)*]
        ..$inner:ident : $table:ident $(, $($rest:tt)*)?) => {
        $crate::parameters!(@sorted $struct [$($items)* { table $inner $table }] $($($rest)*)?);
    };
    (@sorted $struct:tt [$($items:tt)*]
        $(#[doc = $doc:literal])+ $field:ident : $spec:expr $(, $($rest:tt)*)?) => {
        $crate::parameters!(@sorted $struct
            [$($items)* { number $field [$spec] [$($doc)+] }] $($($rest)*)?);
    };
    (@sorted [$(#[$meta:meta])* $name:ident] [$({
        $( table $inner:ident $table:ident )?
        $( number $field:ident [$spec:expr] [$($doc:literal)+] )?
    })*]) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name { $(
            $(
                #[doc = concat!("[`", stringify!($table), "`].")]
                pub $inner: $table,
            )?
            $( $(#[doc = $doc])+ pub $field: f64, )?
        )* }
        impl $crate::Parameters for $name {
            const TABLE: &'static [$crate::Parameter] = {
                const PARTS: &[&[$crate::Parameter]] = &[ $(
                    $( <$table as $crate::Parameters>::TABLE, )?
                    $( &[$spec.called(
                        $crate::descriptor::c_str(concat!(stringify!($field), "\0")),
                        $crate::descriptor::c_str(concat!($($doc),+, "\0")),
                    )], )?
                )* ];
                &$crate::descriptor::joined::<{ $crate::descriptor::total(PARTS) }>(PARTS)
            };
            fn read(values: &[f64]) -> Self {
                let mut rest = values;
                Self { $(
                    $( $inner: $crate::descriptor::read_table(&mut rest), )?
                    $( $field: rest.split_off_first().copied().unwrap_or(f64::NAN), )?
                )* }
            }
        }
    };
}

/// A struct of numbers of any kind.
#[doc(hidden)]
#[macro_export]
macro_rules! numbers {
    ($(#[$meta:meta])* $name:ident { $( [$($doc:literal)+] $field:ident )* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name<T = f64> { $( $(#[doc = $doc])+ pub $field: T, )* }
        impl<T: Copy + Send + Sync> $crate::dual::Values<T> for $name<T> {
            fn collect(value: impl Fn(usize) -> T) -> Self {
                let mut numbers = 0usize..;
                Self { $( $field: value(numbers.next().unwrap_or_default()), )* }
            }
            fn hand_out(&self, mut put: impl FnMut(usize, T)) {
                for (i, value) in [$( self.$field ),*].into_iter().enumerate() {
                    put(i, value);
                }
            }
        }
    };
}

/// Number of parameters in all of these tables.
#[doc(hidden)]
pub const fn total(tables: &[&[Parameter]]) -> usize {
    let (mut n, mut i) = (0, 0);
    while i < tables.len() {
        n += tables[i].len();
        i += 1;
    }
    n
}

/// The parameters of all of these tables, one after the other.
#[doc(hidden)]
pub const fn joined<const N: usize>(tables: &[&[Parameter]]) -> [Parameter; N] {
    let mut all = [Parameter::new(c"", c""); N];
    let (mut n, mut i) = (0, 0);
    while i < tables.len() {
        let mut j = 0;
        while j < tables[i].len() {
            all[n] = tables[i][j];
            n += 1;
            j += 1;
        }
        i += 1;
    }
    all
}

/// The values of one table among others, which are taken off `rest`.
#[doc(hidden)]
pub fn read_table<T: Parameters>(rest: &mut &[f64]) -> T {
    let (own, after) = rest.split_at(T::TABLE.len().min(rest.len()));
    *rest = after;
    T::read(own)
}

/// Declares the internal variables of a law: a struct of numbers whose doc comments and units
/// are also what the host prints.
///
/// ```
/// use abi::Variable;
/// abi::internal_variables! {
///     /// Internal variables of a spring.
///     pub struct State {
///         /// Accumulated plastic elongation.
///         elongation: Variable::scalar(c"x", c"m"),
///     }
/// }
/// ```
#[macro_export]
macro_rules! internal_variables {
    ($(#[$meta:meta])* pub struct $name:ident<T> {
        $( $(#[doc = $doc:literal])+ $field:ident : $spec:expr ),* $(,)?
    }) => {
        $crate::numbers!($(#[$meta])* $name { $( [$($doc)+] $field )* });
        impl $crate::InternalVariables for $name<f64> {
            const TABLE: &'static [$crate::Variable] = &[ $(
                $spec.called(
                    $crate::descriptor::c_str(concat!(stringify!($field), "\0")),
                    $crate::descriptor::c_str(concat!($($doc),+, "\0")),
                ),
            )* ];
            fn read(value: impl Fn(usize) -> f64) -> Self {
                <Self as $crate::dual::Values<f64>>::collect(value)
            }
            fn write(&self, put: impl FnMut(usize, f64)) {
                <Self as $crate::dual::Values<f64>>::hand_out(self, put);
            }
        }
    };
    ($(#[$meta:meta])* pub struct $name:ident {
        $( $(#[doc = $doc:literal])+ $field:ident : $spec:expr ),* $(,)?
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name { $( $(#[doc = $doc])+ pub $field: f64, )* }
        impl $crate::InternalVariables for $name {
            const TABLE: &'static [$crate::Variable] = &[ $(
                $spec.called(
                    $crate::descriptor::c_str(concat!(stringify!($field), "\0")),
                    $crate::descriptor::c_str(concat!($($doc),+, "\0")),
                ),
            )* ];
            fn read(value: impl Fn(usize) -> f64) -> Self {
                let mut numbers = 0usize..;
                Self { $( $field: value(numbers.next().unwrap_or_default()), )* }
            }
            fn write(&self, mut put: impl FnMut(usize, f64)) {
                for (i, value) in [$( self.$field ),*].into_iter().enumerate() {
                    put(i, value);
                }
            }
        }
    };
}

/// The declaration of a parameter, as [`parameters!`](crate::parameters) takes it: a
/// [`raw::Parameter`] whose pointers all lead to static data.
#[repr(transparent)]
#[derive(Clone, Copy, Debug)]
pub struct Parameter(raw::Parameter);

impl Parameter {
    /// A parameter without bounds or default.
    pub const fn new(symbol: &'static CStr, unit: &'static CStr) -> Self {
        Self(raw::Parameter {
            struct_size: size_of::<raw::Parameter>() as u32,
            flags: 0,
            id: c"".as_ptr(),
            symbol: symbol.as_ptr(),
            unit: unit.as_ptr(),
            doc: c"".as_ptr(),
            default_value: f64::NAN,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            usual_lower: f64::NEG_INFINITY,
            usual_upper: f64::INFINITY,
            choices: null(),
        })
    }

    /// Admits values ≥ `lower`.
    #[must_use]
    pub const fn at_least(mut self, lower: f64) -> Self {
        self.0.lower = lower;
        self
    }

    /// Admits values > `lower`.
    #[must_use]
    pub const fn above(mut self, lower: f64) -> Self {
        self.0.lower = lower;
        self.0.flags |= raw::PILUM_P_OPEN_LOWER;
        self
    }

    /// Admits values ≤ `upper`.
    #[must_use]
    pub const fn at_most(mut self, upper: f64) -> Self {
        self.0.upper = upper;
        self
    }

    /// Admits values < `upper`.
    #[must_use]
    pub const fn below(mut self, upper: f64) -> Self {
        self.0.upper = upper;
        self.0.flags |= raw::PILUM_P_OPEN_UPPER;
        self
    }

    /// Values outside `lower..=upper` draw a warning.
    #[must_use]
    pub const fn usual(mut self, lower: f64, upper: f64) -> Self {
        self.0.usual_lower = lower;
        self.0.usual_upper = upper;
        self
    }

    /// Value if left out.
    #[must_use]
    pub const fn default(mut self, default_value: f64) -> Self {
        self.0.default_value = default_value;
        self
    }

    /// May be left out; the law then receives NaN.
    #[must_use]
    pub const fn optional(mut self) -> Self {
        self.0.flags |= raw::PILUM_P_OPTIONAL;
        self
    }

    /// One of several labels, made by [`choices!`](crate::choices); the value is the index of the
    /// label.
    #[must_use]
    pub const fn one_of<const N: usize>(mut self, labels: &'static Choices<N>) -> Self {
        self.0.lower = 0.0;
        self.0.upper = N as f64 - 2.0;
        self.0.choices = labels.0.as_ptr();
        self
    }

    /// Gives the parameter its identifier and sentence.
    #[must_use]
    pub const fn called(mut self, id: &'static CStr, doc: &'static CStr) -> Self {
        self.0.id = id.as_ptr();
        self.0.doc = doc.as_ptr();
        self
    }

    /// The declaration as it crosses the boundary.
    pub const fn raw(&self) -> &raw::Parameter {
        &self.0
    }
}

/// Labels of a parameter, ended by null: the one or more that [`choices!`](crate::choices) names.
#[derive(Debug)]
pub struct Choices<const N: usize>([*const c_char; N]);

impl<const N: usize> Choices<N> {
    /// Ends the labels with null.
    ///
    /// # Panics
    /// If `N` is not the number of labels and one more; at compile time, where it is used.
    pub const fn new(labels: &[&'static CStr]) -> Self {
        assert!(
            !labels.is_empty() && N == labels.len() + 1,
            "a choice needs labels, and room for the null behind them"
        );
        let mut pointers = [null(); N];
        let mut i = 0;
        while i < labels.len() {
            pointers[i] = labels[i].as_ptr();
            i += 1;
        }
        Self(pointers)
    }
}

/// The labels of [`Parameter::one_of`]: `abi::choices!(c"drained", c"undrained")`.
#[macro_export]
macro_rules! choices {
    ($($label:literal),+ $(,)?) => {
        const {
            const LABELS: &[&::std::ffi::CStr] = &[ $($label),+ ];
            &$crate::descriptor::Choices::<{ LABELS.len() + 1 }>::new(LABELS)
        }
    };
}

/// The declaration of an internal variable, as [`internal_variables!`](crate::internal_variables)
/// takes it: a [`raw::Variable`] whose pointers all lead to static data.
#[repr(transparent)]
#[derive(Clone, Copy, Debug)]
pub struct Variable(raw::Variable);

impl Variable {
    const fn new(symbol: &'static CStr, unit: &'static CStr) -> Self {
        Self(raw::Variable {
            struct_size: size_of::<raw::Variable>() as u32,
            flags: 0,
            id: c"".as_ptr(),
            symbol: symbol.as_ptr(),
            unit: unit.as_ptr(),
            doc: c"".as_ptr(),
            shape: raw::PILUM_SCALAR,
            n_components: 1,
            component_names: null(),
            initial_value: 0.0,
        })
    }

    /// A scalar that starts from zero.
    pub const fn scalar(symbol: &'static CStr, unit: &'static CStr) -> Self {
        Self::new(symbol, unit)
    }

    /// Initial value where the law does not compute one.
    #[must_use]
    pub const fn initially(mut self, initial_value: f64) -> Self {
        self.0.initial_value = initial_value;
        self
    }

    /// A result to look at that carries no history.
    #[must_use]
    pub const fn output_only(mut self) -> Self {
        self.0.flags |= raw::PILUM_V_OUTPUT_ONLY;
        self
    }

    /// Gives the variable its identifier and sentence.
    #[must_use]
    pub const fn called(mut self, id: &'static CStr, doc: &'static CStr) -> Self {
        self.0.id = id.as_ptr();
        self.0.doc = doc.as_ptr();
        self
    }

    /// The declaration as it crosses the boundary.
    pub const fn raw(&self) -> &raw::Variable {
        &self.0
    }
}
