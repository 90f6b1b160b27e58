//! The types that cross the boundary, exactly as C sees them: `include/pilum_law.h` is generated
//! from this file. Nothing here allocates, owns or computes.
//!
//! Every struct but the two views starts with `struct_size`, the size its writer knows. Structs
//! only ever grow at the end, so a reader tests `struct_size` before it touches a field that came
//! later, and walks an array of such structs with the stride of its first element's `struct_size`.
//! The views never change.
//!
//! Strings are UTF-8, NUL-terminated, static and never null unless a field reports it.

use std::ffi::{c_char, c_void};

/// `MagicBlock::magic`: the letters `PILM`. A byte-swapped value means the other endianness.
pub const PILUM_MAGIC: u32 = 0x5049_4C4D;
/// Major version of the contract. Different majors never work together.
pub const PILUM_ABI_MAJOR: u16 = 1;
/// Minor version of the contract. Minors only append; any two of one major work together.
pub const PILUM_ABI_MINOR: u16 = 0;

/// Outcome of a call, one of the `PILUM_OK` … `PILUM_E_INTERNAL` values.
pub type Status = i32;
/// Outputs are valid.
pub const PILUM_OK: Status = 0;
/// Outputs are valid but inaccurate; the host should take smaller steps.
pub const PILUM_OK_UNRELIABLE: Status = 1;
/// No outputs; the host should repeat with a smaller step, see [`Batch::step_factor`].
pub const PILUM_CUT_STEP: Status = 2;
/// The host broke the contract.
pub const PILUM_E_ARGUMENT: Status = -1;
/// A parameter is refused.
pub const PILUM_E_PARAMETER: Status = -2;
/// The law does not offer what was requested.
pub const PILUM_E_UNSUPPORTED: Status = -3;
/// The state or the gradient is outside the law's domain; a smaller step does not help.
pub const PILUM_E_DOMAIN: Status = -4;
/// The local computation broke down; a smaller step does not help.
pub const PILUM_E_NUMERIC: Status = -5;
/// A defect of the law (a caught panic or exception). The instance is unusable from now on.
pub const PILUM_E_INTERNAL: Status = -6;

/// Kinematic hypothesis, one of the `PILUM_H_*` values.
pub type HypothesisCode = i32;
/// Plane strain: components 11 22 33 12, 33 out of plane, strain 33 given as zero.
pub const PILUM_H_PLANE_STRAIN: HypothesisCode = 1;
/// Axisymmetry: components 11 (radial) 22 (axial) 33 (hoop) 12.
pub const PILUM_H_AXISYMMETRIC: HypothesisCode = 2;
/// Three dimensions: components 11 22 33 12 13 23.
pub const PILUM_H_3D: HypothesisCode = 3;
/// Interface in two dimensions, plane or axisymmetric: components normal, tangential.
pub const PILUM_H_INTERFACE_2D: HypothesisCode = 10;
/// Interface in three dimensions: components normal, tangential 1, tangential 2.
pub const PILUM_H_INTERFACE_3D: HypothesisCode = 11;

/// Shape of a variable, one of the `PILUM_SCALAR` … values.
pub type Shape = i32;
/// One number.
pub const PILUM_SCALAR: Shape = 0;
/// Components in the frame of the interface: normal first.
pub const PILUM_VECTOR: Shape = 1;
/// Symmetric tensor in Voigt order 11 22 33 12 \[13 23\]; strains carry γ = 2ε.
pub const PILUM_SYMMETRIC_TENSOR: Shape = 2;

/// Handshake block, the data symbol `pilum_magic`. Its shape never changes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "abi_stable", derive(abi_stable::StableAbi))]
pub struct MagicBlock {
    /// Size of this struct, 64.
    pub struct_size: u32,
    /// [`PILUM_MAGIC`].
    pub magic: u32,
    /// [`PILUM_ABI_MAJOR`] the library was built against.
    pub abi_major: u16,
    /// [`PILUM_ABI_MINOR`] the library was built against.
    pub abi_minor: u16,
    /// Size of a pointer, 8.
    pub pointer_bytes: u8,
    /// Size of a real number, 8.
    pub real_bytes: u8,
    /// Zero.
    pub reserved: [u8; 2],
    /// `PILUM_LAYOUT_HASH` of the header the library was built with: the offsets and sizes of all
    /// public fields. A difference within one version means a compiler flag or an edited header.
    pub layout_hash: u64,
    /// What the library was built with, such as `pilum-rs 0.1.0`; NUL-padded.
    pub sdk: [c_char; 40],
}

/// A material parameter: declared once; input checks, documentation and messages derive from it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "abi_stable", derive(abi_stable::StableAbi))]
pub struct Parameter {
    /// Size of this struct.
    pub struct_size: u32,
    /// `PILUM_P_*` flags.
    pub flags: u32,
    /// Identifier `[a-z][a-z0-9_]*`, public interface, never changes.
    pub id: *const c_char,
    /// Symbol in the literature.
    pub symbol: *const c_char,
    /// Unit; `-` where absent, `deg` for angles.
    pub unit: *const c_char,
    /// One sentence.
    pub doc: *const c_char,
    /// Default value; NaN: none.
    pub default_value: f64,
    /// Smallest admissible value; may be −∞.
    pub lower: f64,
    /// Largest admissible value; may be +∞.
    pub upper: f64,
    /// Start of the usual range; outside it the host only warns.
    pub usual_lower: f64,
    /// End of the usual range.
    pub usual_upper: f64,
    /// Null, or a null-terminated list of labels; the value is then the index of the label.
    pub choices: *const *const c_char,
}
/// The lower bound itself is not admissible.
pub const PILUM_P_OPEN_LOWER: u32 = 1 << 0;
/// The upper bound itself is not admissible.
pub const PILUM_P_OPEN_UPPER: u32 = 1 << 1;
/// May be left out: the law then receives NaN and does what `doc` says.
pub const PILUM_P_OPTIONAL: u32 = 1 << 2;

/// A gradient, a flux or an internal variable.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "abi_stable", derive(abi_stable::StableAbi))]
pub struct Variable {
    /// Size of this struct.
    pub struct_size: u32,
    /// `PILUM_V_*` flags.
    pub flags: u32,
    /// Identifier `[a-z][a-z0-9_]*`: `strain`, `jump`, `plastic_slip`.
    pub id: *const c_char,
    /// Symbol in the literature.
    pub symbol: *const c_char,
    /// Unit.
    pub unit: *const c_char,
    /// One sentence.
    pub doc: *const c_char,
    /// Shape.
    pub shape: Shape,
    /// Number of components.
    pub n_components: u32,
    /// `n_components` names, or null for a scalar.
    pub component_names: *const *const c_char,
    /// Initial value where the law has no `init_state`.
    pub initial_value: f64,
}
/// A result to look at; it carries no history.
pub const PILUM_V_OUTPUT_ONLY: u32 = 1 << 0;

/// What a law offers under one hypothesis. `gradient[i]` is work-conjugate to `flux[i]`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "abi_stable", derive(abi_stable::StableAbi))]
pub struct Formulation {
    /// Size of this struct.
    pub struct_size: u32,
    /// Hypothesis.
    pub hypothesis: HypothesisCode,
    /// `PILUM_T_*` flags.
    pub flags: u32,
    /// Number of gradients.
    pub n_gradients: u32,
    /// Number of fluxes, equal to the number of gradients.
    pub n_fluxes: u32,
    /// Number of internal variables.
    pub n_states: u32,
    /// Gradients.
    pub gradient: *const Variable,
    /// Fluxes.
    pub flux: *const Variable,
    /// Internal variables; may be null if absent.
    pub state: *const Variable,
}
/// The tangent is symmetric in every state.
pub const PILUM_T_SYMMETRIC: u32 = 1 << 0;
/// The response is linear: one constant tangent, no internal variables.
pub const PILUM_T_LINEAR: u32 = 1 << 1;
/// Components are in axes of the material (1 along the layer, 2 normal to it, 3 out of plane), so
/// the law only makes sense in an element that has such axes.
pub const PILUM_T_LOCAL_AXES: u32 = 1 << 2;
/// Offers rates, [`PILUM_REQ_RATES`].
pub const PILUM_T_RATES: u32 = 1 << 3;
/// Its consistent tangent is close to the derivative of the update, but not equal to it.
pub const PILUM_T_TANGENT_APPROXIMATE: u32 = 1 << 4;
/// Offers the elastic operator only; asked for the consistent tangent, it answers
/// [`PILUM_E_UNSUPPORTED`].
pub const PILUM_T_NO_TANGENT: u32 = 1 << 5;

/// Read access to values of many points: component `c` of point `i` is
/// `p[i * point + c * component]`. A `point` stride of 0 gives all points the same values.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "abi_stable", derive(abi_stable::StableAbi))]
pub struct View {
    /// First value; null if there are no components.
    pub p: *const f64,
    /// Stride from point to point, in doubles.
    pub point: isize,
    /// Stride from component to component, in doubles.
    pub component: isize,
}

/// Write access to values of many points; entries never overlap each other nor any input.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "abi_stable", derive(abi_stable::StableAbi))]
pub struct ViewMut {
    /// First value; null if there are no components or nothing is requested.
    pub p: *mut f64,
    /// Stride from point to point, in doubles.
    pub point: isize,
    /// Stride from component to component, in doubles.
    pub component: isize,
}

/// Rates of what an update depends on, and of what it gives: the derivative of the update in one
/// direction.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "abi_stable", derive(abi_stable::StableAbi))]
pub struct Rates {
    /// Size of this struct.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// Rates of the parameters, one for each in declared order, the same for all points; null: all
    /// zero.
    pub parameter: *const f64,
    /// Rates of the gradients at the start of the increment.
    pub gradient0: View,
    /// Rates of the gradients at the end of the increment.
    pub gradient1: View,
    /// Rates of the fluxes at the start.
    pub flux0: View,
    /// Rates of the internal variables at the start.
    pub state0: View,
    /// Rates of the fluxes at the end (written).
    pub flux1: ViewMut,
    /// Rates of the internal variables at the end (written).
    pub state1: ViewMut,
}

/// One call: a batch of integration points over one increment. All pointers are valid until the
/// call returns, and none may be kept.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "abi_stable", derive(abi_stable::StableAbi))]
pub struct Batch {
    /// Size of this struct.
    pub struct_size: u32,
    /// `PILUM_REQ_*` flags.
    pub request: u32,
    /// Number of points.
    pub n_points: u64,
    /// Number of the first point in the host's numbering; for messages only.
    pub first_point: u64,
    /// Time at the start of the increment.
    pub time: f64,
    /// Length of the increment in time.
    pub time_increment: f64,
    /// Gradients at the start of the increment.
    pub gradient0: View,
    /// Gradients at the end of the increment.
    pub gradient1: View,
    /// Fluxes at the start.
    pub flux0: View,
    /// Internal variables at the start.
    pub state0: View,
    /// Fluxes at the end (written).
    pub flux1: ViewMut,
    /// Internal variables at the end (written).
    pub state1: ViewMut,
    /// ∂flux1/∂gradient1, row-major over all components (written if requested).
    pub tangent: ViewMut,
    /// `n_points` outcomes (written), or null.
    pub status: *mut Status,
    /// `n_points` factors (written where the outcome is `PILUM_CUT_STEP`), or null: the fraction
    /// of the increment, in (0, 1), that the law believes it can follow; NaN: the host decides.
    pub step_factor: *mut f64,
    /// Buffer for one message, NUL-terminated on return; may be null.
    pub message: *mut c_char,
    /// Size of the buffer in bytes.
    pub message_capacity: usize,
    /// Time at the start of the increment, counted from the start of the phase or segment that it
    /// belongs to.
    pub step_time: f64,
    /// Rates; null unless [`PILUM_REQ_RATES`] is set.
    pub rates: *const Rates,
}
/// Compute fluxes and internal variables at the end of the increment.
pub const PILUM_REQ_FLUX: u32 = 1 << 0;
/// Compute the tangent consistent with the update.
pub const PILUM_REQ_TANGENT: u32 = 1 << 1;
/// Compute the elastic operator instead of the consistent tangent.
pub const PILUM_REQ_ELASTIC: u32 = 1 << 2;
/// Compute rates too, see [`Batch::rates`].
pub const PILUM_REQ_RATES: u32 = 1 << 3;

/// What the host tells a library.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "abi_stable", derive(abi_stable::StableAbi))]
pub struct Host {
    /// Size of this struct.
    pub struct_size: u32,
    /// [`PILUM_ABI_MAJOR`] of the host.
    pub abi_major: u16,
    /// [`PILUM_ABI_MINOR`] of the host.
    pub abi_minor: u16,
    /// Name of the program.
    pub name: *const c_char,
    /// Version of the program.
    pub version: *const c_char,
    /// Looks up an optional service by id (`pilum.<name>/<revision>`); null: unknown. May be null.
    pub get_extension: Option<unsafe extern "C" fn(id: *const c_char) -> *const c_void>,
}

/// A law with its parameters fixed; opaque, owned by the library, immutable after `create`.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(feature = "abi_stable", derive(abi_stable::StableAbi))]
pub struct Instance {
    _opaque: [u8; 0],
}

/// A constitutive law: description and functions.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "abi_stable", derive(abi_stable::StableAbi))]
pub struct Law {
    /// Size of this struct.
    pub struct_size: u32,
    /// Zero.
    pub flags: u32,
    /// Number of parameters.
    pub n_parameters: u32,
    /// Number of formulations.
    pub n_formulations: u32,
    /// Identifier `[a-z][a-z0-9_]*`, public interface, never changes.
    pub id: *const c_char,
    /// Name in words.
    pub name: *const c_char,
    /// Version of the law.
    pub version: *const c_char,
    /// Authors.
    pub author: *const c_char,
    /// Licence, as an SPDX expression.
    pub licence: *const c_char,
    /// A sentence or two.
    pub doc: *const c_char,
    /// Sources.
    pub references: *const c_char,
    /// Parameters; may be null if absent.
    pub parameter: *const Parameter,
    /// Formulations.
    pub formulation: *const Formulation,
    /// Fixes the parameters (`n_parameters` values in declared order) under formulation number
    /// `formulation`, checks them, and is the only function that may allocate. On failure it
    /// writes a message and leaves `out` alone; a message about one parameter starts with its id
    /// and a colon. \[one thread at a time\]
    pub create: Option<
        unsafe extern "C" fn(
            law: *const Law,
            host: *const Host,
            formulation: u32,
            parameter: *const f64,
            n_parameters: u32,
            out: *mut *mut Instance,
            message: *mut c_char,
            message_capacity: usize,
        ) -> Status,
    >,
    /// Writes `state1` for points that carry `flux0`; null: every variable starts from its
    /// `initial_value`. \[any thread, concurrent, no allocation\]
    pub init_state:
        Option<unsafe extern "C" fn(instance: *const Instance, batch: *const Batch) -> Status>,
    /// Carries every point of the batch over the increment. A pure function of its arguments: the
    /// same inputs give the same bits, in any order, split and thread. A failing point does not
    /// stop the others; the result is the most severe outcome. \[any thread, concurrent, no
    /// allocation, lock or output\]
    pub integrate:
        Option<unsafe extern "C" fn(instance: *const Instance, batch: *const Batch) -> Status>,
    /// Frees the instance. \[one thread at a time\]
    pub destroy: Option<unsafe extern "C" fn(instance: *mut Instance)>,
}

/// What a library holds.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "abi_stable", derive(abi_stable::StableAbi))]
pub struct Plugin {
    /// Size of this struct.
    pub struct_size: u32,
    /// Number of laws.
    pub n_laws: u32,
    /// `n_laws` pointers to laws.
    pub law: *const *const Law,
    /// Looks up an optional service by id; null: unknown. May be null.
    pub get_extension: Option<unsafe extern "C" fn(id: *const c_char) -> *const c_void>,
}

/// The function symbol `pilum_entry`: idempotent, may be called from any thread, returns the same
/// static description every time; null refuses the host.
pub type Entry = unsafe extern "C" fn(host: *const Host) -> *const Plugin;

/// Optional data symbol `pilum_rust_layout_1_1` of libraries written in Rust: the description that
/// `abi_stable` derives from these types, to be compared with the host's own.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct RustLayout {
    /// Size of this struct.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// Version of `abi_stable`; only equal versions are compared.
    pub abi_stable_version: *const c_char,
    /// `&'static abi_stable::type_layout::TypeLayout` of [`Plugin`].
    pub layout: *const c_void,
}
