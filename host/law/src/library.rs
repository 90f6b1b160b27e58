//! Opening libraries and calling them. This file with its modules is one of the two places of the
//! project that hold `unsafe` code; each block names the clause of the contract (`abi/README.md`) it
//! relies on.
//!
//! Libraries are opened with `RTLD_NOW | RTLD_LOCAL`, one at a time, and never unloaded, so that
//! everything a description points to stays valid for the life of the process.
#![expect(
    unsafe_code,
    clippy::multiple_unsafe_ops_per_block,
    reason = "the host's side of the C boundary; offset and access are one operation"
)]

pub(crate) mod abaqus;
#[cfg(unix)]
mod externals;
pub(crate) mod mfront;
pub mod probe;
#[cfg(unix)]
mod shared;
pub(crate) mod udsm;
pub(crate) mod umat;

#[cfg(unix)]
pub use shared::SharedMemory;

use super::description::{
    Bounds, FormulationDescription, InternalVariable, LawDescription, ParameterDescription, Tangent,
};
use super::image::Image;
use super::{Moment, Site};
use abi::Hypothesis;
use abi::raw::{self, Batch, Formulation, Host, Instance, Law, MagicBlock, Parameter, Plugin};
use abi::raw::{Status, Variable, View, ViewMut};
use abi::version::{self, FORMULATION_SIZE_1_0, LAW_SIZE_1_0, PARAMETER_SIZE_1_0};
use abi::version::{PLUGIN_SIZE_1_0, VARIABLE_SIZE_1_0};
use probe::kept::{self, KeptPhase, Phase};
use std::cell::Cell;
use std::ffi::{CStr, c_char};
use std::mem::{MaybeUninit, size_of};
use std::path::Path;
use std::ptr::{null, null_mut};
use std::sync::{Mutex, PoisonError};

/// Longest text that is copied out of a library, in bytes.
const LONGEST_TEXT: usize = 4096;
/// Most bytes of text in a whole description: entries may share one long text.
const MOST_TEXT: usize = 16 << 20;
/// Most entries of any table that is copied out of a library.
const LONGEST_TABLE: u32 = 256;
/// Largest size of one entry of such a table that is plausible, in bytes.
const LONGEST_ENTRY: usize = 4096;
/// Size of the buffer for messages.
const MESSAGE_CAPACITY: usize = 512;

static HOST: HostBlock = HostBlock(Host {
    struct_size: size_of::<Host>() as u32,
    abi_major: raw::PILUM_ABI_MAJOR,
    abi_minor: raw::PILUM_ABI_MINOR,
    name: c"pilum".as_ptr(),
    version: match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
        Ok(version) => version.as_ptr(),
        Err(_) => c"".as_ptr(),
    },
    get_extension: None,
});

struct HostBlock(Host);
// SAFETY: it points to static strings only.
unsafe impl Sync for HostBlock {}

/// The laws of one opened library.
#[derive(Clone, Debug)]
pub(crate) struct OpenLibrary {
    pub(crate) laws: Vec<(LawDescription, LawHandle)>,
}

/// A law in its library's memory, and what this host knows of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LawHandle {
    /// For the law's own eyes.
    at: *const Law,
    known: Law,
}

// SAFETY: descriptions are immutable static data (contract, "Lifetime").
unsafe impl Send for LawHandle {}
// SAFETY: as above.
unsafe impl Sync for LawHandle {}

/// `dlerror` is not safe in threads everywhere, so libraries are opened one at a time.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Libraries that this process has loaded, by SHA-256. Of the whole process by nature: none is ever
/// unloaded, and the same bytes loaded again for each [`Opener`](crate::Opener) would only pile up.
/// Whether a library may be used is its opener's decision, made before it is looked for here.
static LOADED: Mutex<Vec<(String, OpenLibrary)>> = Mutex::new(Vec::new());

/// Opens a library, shakes hands and copies its description. It is opened from the bytes that were
/// hashed where the system allows it.
///
/// # Errors
/// What is wrong with the library, in words.
pub(crate) fn open(path: &Path, image: Image) -> Result<OpenLibrary, String> {
    let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, library)) = loaded.iter().find(|(sha256, _)| *sha256 == image.sha256) {
        return Ok(library.clone());
    }
    let sha256 = image.sha256.clone();
    let library = load_and_describe(path, image)?;
    loaded.push((sha256, library.clone()));
    Ok(library)
}

fn load_and_describe(path: &Path, image: Image) -> Result<OpenLibrary, String> {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let begin =
        |phase| kept::keep_phase(KeptPhase::new(phase, false)).map_err(|error| error.to_string());
    begin(Phase::Load)?;
    // SAFETY: running the library's initialisers is what loading means; the user named it.
    let library: &'static libloading::Library =
        Box::leak(Box::new(unsafe { load_image(path, image) }?));
    // SAFETY: contract, "Handshake": `pilum_magic` is a data symbol of this type for ever.
    let magic = unsafe { library.get::<*const MagicBlock>(b"pilum_magic\0") }
        .map_err(|_| "it has no symbol `pilum_magic`: this is no Pilum law library".to_owned())?;
    begin(Phase::Handshake)?;
    // SAFETY: as above; the block is at least 64 bytes in every version.
    let magic = unsafe { (*magic).read_unaligned() };
    version::check(&magic).map_err(|mismatch| format!("{mismatch}"))?;

    #[cfg(feature = "abi_stable")]
    check_rust_layout(library)?;

    // SAFETY: contract, "Handshake": once the block is accepted, `pilum_entry` has this type.
    let entry = unsafe { library.get::<raw::Entry>(b"pilum_entry\0") }
        .map_err(|_| "it has no symbol `pilum_entry`".to_owned())?;
    begin(Phase::Entry)?;
    // SAFETY: contract, "Entry": may be called with any valid host block, from any thread.
    let plugin = unsafe { entry(&raw const HOST.0) };
    if plugin.is_null() {
        return Err("it refuses this host (`pilum_entry` returned null)".to_owned());
    }
    begin(Phase::Describe)?;
    // SAFETY: contract, "Descriptions": static.
    let plugin = unsafe { known(plugin, PLUGIN_SIZE_1_0) }
        .ok_or_else(|| "`pilum_plugin` is truncated".to_owned())?;
    describe(&plugin)
}

/// Loads the hashed bytes. Where that fails (a library that looks for others beside itself, a
/// system that executes nothing from memory), the file is loaded, if it is still the same: the
/// loader runs nothing of a library it cannot load.
///
/// # Safety
/// The library's initialisers may be run.
unsafe fn load_image(path: &Path, image: Image) -> Result<libloading::Library, String> {
    if let Some(sealed) = image.sealed_path() {
        // SAFETY: passed on to the caller.
        if let Ok(library) = unsafe { load(&sealed) } {
            image.keep();
            return Ok(library);
        }
        if !image.is_current() {
            return Err("it was changed while it was opened".to_owned());
        }
    }
    // SAFETY: passed on to the caller.
    unsafe { load(path) }.map_err(|error| {
        let why = std::error::Error::source(&error).map_or(String::new(), |why| format!(": {why}"));
        format!("it cannot be loaded: {error}{why}")
    })
}

#[cfg(unix)]
unsafe fn load(path: &Path) -> Result<libloading::Library, libloading::Error> {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
    // SAFETY: passed on to the caller.
    unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) }.map(Into::into)
}

#[cfg(not(unix))]
unsafe fn load(path: &Path) -> Result<libloading::Library, libloading::Error> {
    // SAFETY: passed on to the caller.
    unsafe { libloading::Library::new(path) }
}

/// The second check, for libraries written in Rust with the same minor version and `abi_stable`:
/// the symbol carries the minor, so others are not found.
#[cfg(feature = "abi_stable")]
fn check_rust_layout(library: &'static libloading::Library) -> Result<(), String> {
    use abi::layout;
    use abi::raw::RustLayout;
    // SAFETY: contract, "abi_stable": the symbol is a `RustLayout` where it exists.
    let Ok(block) = (unsafe { library.get::<*const RustLayout>(layout::SYMBOL.as_bytes()) }) else {
        return Ok(());
    };
    // SAFETY: as above; the block is static.
    let block = unsafe { known(*block, version::RUST_LAYOUT_SIZE_1_0) };
    let Some(block) = block.filter(|block| !block.layout.is_null()) else {
        return Ok(());
    };
    let allowance = Allowance::default();
    if text(block.abi_stable_version, "abi_stable_version", &allowance)?
        != layout::ABI_STABLE_VERSION.to_string_lossy()
    {
        return Ok(());
    }
    // SAFETY: equal versions of `abi_stable` describe layouts by the same type.
    let theirs = unsafe { &*block.layout.cast::<abi_stable::type_layout::TypeLayout>() };
    layout::check(theirs)
        .map_err(|difference| format!("`abi_stable` finds another layout: {difference}"))
}

/// The struct at `p` as far as its writer knew it, see [`known_part`]. `None` if it is shorter than
/// it was in version 1.0.
///
/// # Safety
/// `p` points to a struct of the contract with as many bytes as its `struct_size` says; all-zero is
/// a valid `T`.
unsafe fn known<T: Copy>(p: *const T, size_1_0: usize) -> Option<T> {
    // SAFETY: contract, "Growing structs": every struct starts with its size as `u32`.
    let size = unsafe { p.cast::<u32>().read() } as usize;
    // SAFETY: passed on to the caller.
    (size >= size_1_0).then(|| unsafe { known_part(p, size) })
}

/// The first `size` bytes at `p` as a `T`: the rule of growing structs in one place. No reference
/// to the library's struct is made, since one would promise all of today's fields. A field later
/// than version 1.0 reads as zero (null, none) if its writer did not know it, and what a later
/// writer knows beyond `T` is left alone.
///
/// # Safety
/// `p` is valid for `size` bytes, which cover at least version 1.0; all-zero is a valid `T`.
unsafe fn known_part<T: Copy>(p: *const T, size: usize) -> T {
    let mut copy = MaybeUninit::<T>::zeroed();
    // SAFETY: both sides hold that many bytes, see above.
    unsafe {
        p.cast::<u8>()
            .copy_to_nonoverlapping(copy.as_mut_ptr().cast(), size.min(size_of::<T>()));
        copy.assume_init()
    }
}

/// A table of structs that may be longer than ours, or end sooner where ours have grown since
/// version 1.0: the stride is the first entry's own size.
fn table<T: Copy>(first: *const T, n: u32, size_1_0: usize, what: &str) -> Result<Vec<T>, String> {
    if n == 0 {
        return Ok(Vec::new());
    }
    if n > LONGEST_TABLE {
        return Err(format!(
            "{n} {what} are declared, at most {LONGEST_TABLE} are plausible"
        ));
    }
    if first.is_null() {
        return Err(format!("{n} {what} are declared, but the table is null"));
    }
    // SAFETY: contract, "Growing structs": every struct starts with its size as `u32`.
    let stride = unsafe { first.cast::<u32>().read() } as usize;
    if stride < size_1_0 || !stride.is_multiple_of(align_of::<T>()) {
        return Err(format!(
            "the table of {what} has entries of {stride} bytes, expected at least {size_1_0}"
        ));
    }
    if stride > LONGEST_ENTRY {
        return Err(format!(
            "the table of {what} has entries of {stride} bytes, at most {LONGEST_ENTRY} are \
             plausible"
        ));
    }
    let entries = (0..n as usize).map(|i| {
        // SAFETY: contract, "Descriptions": `n` entries, static, of this stride; they are numbers
        // and pointers, of which zero is one.
        unsafe { known_part(first.byte_add(i * stride), stride) }
    });
    Ok(entries.collect())
}

/// How many bytes of text are still copied out of a library.
#[derive(Debug)]
struct Allowance(Cell<usize>);

impl Default for Allowance {
    fn default() -> Self {
        Self(Cell::new(MOST_TEXT))
    }
}

/// Copies a text; null is an empty one.
fn text(p: *const c_char, what: &str, allowance: &Allowance) -> Result<String, String> {
    if p.is_null() {
        return Ok(String::new());
    }
    let mut bytes = Vec::new();
    for i in 0..LONGEST_TEXT {
        // SAFETY: contract, "Descriptions": texts end in NUL; reading stops there.
        let byte = unsafe { p.add(i).read() } as u8;
        if byte == 0 {
            let left = allowance.0.get().checked_sub(bytes.len());
            allowance.0.set(left.ok_or_else(|| {
                format!("its texts are longer than {} MB together", MOST_TEXT >> 20)
            })?);
            let text = String::from_utf8(bytes)
                .map_err(|_| format!("the text of `{what}` is not UTF-8"))?;
            return Ok(text.trim().to_owned());
        }
        bytes.push(byte);
    }
    Err(format!(
        "the text of `{what}` is longer than {LONGEST_TEXT} bytes"
    ))
}

fn identifier(p: *const c_char, what: &str, allowance: &Allowance) -> Result<String, String> {
    let id = text(p, what, allowance)?;
    let well_formed = id.starts_with(|c: char| c.is_ascii_lowercase())
        && id
            .chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    if well_formed {
        Ok(id)
    } else {
        Err(format!("the id `{id}` of {what} is malformed"))
    }
}

fn unique<'a>(ids: impl Iterator<Item = &'a str>, what: &str) -> Result<(), String> {
    let mut seen = std::collections::HashSet::new();
    for id in ids {
        if !seen.insert(id) {
            return Err(format!("{what} `{id}` is declared twice"));
        }
    }
    Ok(())
}

/// Copies the description of a library that was never loaded, such as one made of random bytes.
///
/// # Errors
/// What is wrong with it, in words.
///
/// # Safety
/// Structs, tables and texts that it points to, directly or not, are as long as they say.
pub unsafe fn describe_memory(plugin: &Plugin) -> Result<Vec<LawDescription>, String> {
    let laws = describe(plugin)?.laws;
    Ok(laws.into_iter().map(|(law, _)| law).collect())
}

fn describe(plugin: &Plugin) -> Result<OpenLibrary, String> {
    if plugin.n_laws == 0 || plugin.n_laws > LONGEST_TABLE || plugin.law.is_null() {
        return Err(format!("it declares {} laws", plugin.n_laws));
    }
    let allowance = Allowance::default();
    let laws = (0..plugin.n_laws as usize)
        .map(|i| {
            // SAFETY: contract, "Descriptions": `n_laws` pointers to static laws.
            let at = unsafe { plugin.law.add(i).read() };
            if at.is_null() {
                return Err(format!("law {i} is null"));
            }
            // SAFETY: as above.
            let law = unsafe { known(at, LAW_SIZE_1_0) }
                .ok_or_else(|| format!("law {i}: `pilum_law` is truncated"))?;
            let described =
                describe_law(&law, &allowance).map_err(|why| format!("law {i}: {why}"))?;
            Ok((described, LawHandle { at, known: law }))
        })
        .collect::<Result<Vec<_>, String>>()?;
    unique(laws.iter().map(|(law, _)| law.id.as_str()), "law")?;
    Ok(OpenLibrary { laws })
}

fn describe_law(law: &Law, allowance: &Allowance) -> Result<LawDescription, String> {
    if law.create.is_none() || law.integrate.is_none() || law.destroy.is_none() {
        return Err("`create`, `integrate` or `destroy` is null".to_owned());
    }
    let parameters = table(
        law.parameter,
        law.n_parameters,
        PARAMETER_SIZE_1_0,
        "parameters",
    )?
    .iter()
    .map(|p| describe_parameter(p, allowance))
    .collect::<Result<Vec<_>, _>>()?;
    unique(parameters.iter().map(|p| p.id.as_str()), "parameter")?;
    let mut formulations = Vec::new();
    let declared = table(
        law.formulation,
        law.n_formulations,
        FORMULATION_SIZE_1_0,
        "formulations",
    )?;
    for (index, formulation) in (0..).zip(&declared) {
        // Hypotheses that came later than this host are passed over.
        if let Some(hypothesis) = Hypothesis::from_code(formulation.hypothesis) {
            formulations.push(describe_formulation(
                formulation,
                hypothesis,
                index,
                allowance,
            )?);
        }
    }
    unique(formulations.iter().map(|f| f.hypothesis), "hypothesis")?;
    Ok(LawDescription {
        id: identifier(law.id, "the law", allowance)?,
        name: text(law.name, "name", allowance)?,
        version: text(law.version, "version", allowance)?,
        author: text(law.author, "author", allowance)?,
        licence: text(law.licence, "licence", allowance)?,
        doc: text(law.doc, "doc", allowance)?,
        references: text(law.references, "references", allowance)?,
        parameters,
        formulations,
    })
}

fn describe_parameter(
    p: &Parameter,
    allowance: &Allowance,
) -> Result<ParameterDescription, String> {
    let id = identifier(p.id, "a parameter", allowance)?;
    let mut choices = Vec::new();
    if !p.choices.is_null() {
        for i in 0..LONGEST_TABLE as usize {
            // SAFETY: contract, "Parameters": the list of labels ends with null.
            let label = unsafe { p.choices.add(i).read() };
            if label.is_null() {
                break;
            }
            choices.push(text(label, &id, allowance)?);
        }
    }
    let bounds = Bounds {
        lower: p.lower,
        open_lower: p.flags & raw::PILUM_P_OPEN_LOWER != 0,
        upper: p.upper,
        open_upper: p.flags & raw::PILUM_P_OPEN_UPPER != 0,
    };
    // Comparisons with NaN are false, so a NaN bound fails too.
    if !(p.lower <= p.upper && p.usual_lower <= p.usual_upper) {
        return Err(format!("parameter `{id}`: its bounds are not in order"));
    }
    let default = (!p.default_value.is_nan()).then_some(p.default_value);
    if default.is_some_and(|value| !bounds.contain(value)) {
        return Err(format!(
            "parameter `{id}`: the default is outside its bounds {bounds}"
        ));
    }
    Ok(ParameterDescription {
        symbol: text(p.symbol, &id, allowance)?,
        unit: text(p.unit, &id, allowance)?,
        doc: text(p.doc, &id, allowance)?,
        id,
        default,
        optional: p.flags & raw::PILUM_P_OPTIONAL != 0,
        bounds,
        usual: Bounds {
            lower: p.usual_lower,
            open_lower: false,
            upper: p.usual_upper,
            open_upper: false,
        },
        choices,
    })
}

fn describe_formulation(
    formulation: &Formulation,
    hypothesis: Hypothesis,
    index: u32,
    allowance: &Allowance,
) -> Result<FormulationDescription, String> {
    let name = hypothesis.name();
    let (gradient_id, flux_id) = super::words(hypothesis);
    let pair = [
        (gradient_id, formulation.gradient, formulation.n_gradients),
        (flux_id, formulation.flux, formulation.n_fluxes),
    ];
    for (expected, variables, n) in pair {
        let found = table(variables, n, VARIABLE_SIZE_1_0, "gradients or fluxes")?;
        let [variable] = found.as_slice() else {
            return Err(format!(
                "{name}: {n} gradients or fluxes, this host uses one pair"
            ));
        };
        let id = identifier(variable.id, "a gradient or flux", allowance)?;
        let components = hypothesis.n_components();
        if id != expected || variable.n_components as usize != components {
            return Err(format!(
                "{name}: found `{id}` with {} components, expected `{expected}` with {components}",
                variable.n_components
            ));
        }
    }
    // A tangent is one thing: all of the response, near the derivative of the update, or none.
    let flags = [
        (raw::PILUM_T_LINEAR, "PILUM_T_LINEAR"),
        (
            raw::PILUM_T_TANGENT_APPROXIMATE,
            "PILUM_T_TANGENT_APPROXIMATE",
        ),
        (raw::PILUM_T_NO_TANGENT, "PILUM_T_NO_TANGENT"),
    ];
    let mut set = flags
        .iter()
        .filter(|(flag, _)| formulation.flags & flag != 0);
    if let (Some((_, one)), Some((_, other))) = (set.next(), set.next()) {
        return Err(format!("{name}: {one} and {other} contradict each other"));
    }
    let mut internal_variables = Vec::new();
    for variable in table(
        formulation.state,
        formulation.n_states,
        VARIABLE_SIZE_1_0,
        "internal variables",
    )? {
        internal_variables.extend(describe_variable(&variable, allowance)?);
    }
    unique(
        internal_variables.iter().map(|v| v.id.as_str()),
        "internal variable",
    )?;
    Ok(FormulationDescription {
        hypothesis: name,
        index,
        symmetric: formulation.flags & raw::PILUM_T_SYMMETRIC != 0,
        tangent: if formulation.flags & raw::PILUM_T_NO_TANGENT != 0 {
            Tangent::None
        } else if formulation.flags & raw::PILUM_T_TANGENT_APPROXIMATE != 0 {
            Tangent::Approximate
        } else {
            Tangent::Consistent
        },
        rates: formulation.flags & raw::PILUM_T_RATES != 0,
        linear: formulation.flags & raw::PILUM_T_LINEAR != 0 && internal_variables.is_empty(),
        time_dependent: false,
        local_axes: formulation.flags & raw::PILUM_T_LOCAL_AXES != 0,
        internal_variables,
    })
}

fn describe_variable(v: &Variable, allowance: &Allowance) -> Result<Vec<InternalVariable>, String> {
    let id = identifier(v.id, "an internal variable", allowance)?;
    if v.n_components == 0 || v.n_components > LONGEST_TABLE {
        return Err(format!(
            "internal variable `{id}` has {} components",
            v.n_components
        ));
    }
    (0..v.n_components as usize)
        .map(|c| {
            let id = if v.n_components == 1 {
                id.clone()
            } else if v.component_names.is_null() {
                format!("{id}_{}", c + 1)
            } else {
                // SAFETY: contract, "Variables": `n_components` names where the list is not null.
                let name = unsafe { v.component_names.add(c).read() };
                format!("{id}_{}", text(name, &id, allowance)?)
            };
            Ok(InternalVariable {
                symbol: text(v.symbol, &id, allowance)?,
                unit: text(v.unit, &id, allowance)?,
                doc: text(v.doc, &id, allowance)?,
                id,
                initial_value: v.initial_value,
                output_only: v.flags & raw::PILUM_V_OUTPUT_ONLY != 0,
            })
        })
        .collect()
}

/// A law with its parameters fixed, owned by the host.
#[derive(Debug)]
pub(crate) struct OwnedInstance {
    law: LawHandle,
    instance: *mut Instance,
}

// SAFETY: contract, "Threads": an instance is immutable after `create` and may be used and freed
// from any thread.
unsafe impl Send for OwnedInstance {}
// SAFETY: as above; concurrent `integrate` on one instance is allowed.
unsafe impl Sync for OwnedInstance {}

impl Drop for OwnedInstance {
    fn drop(&mut self) {
        if let Some(destroy) = self.law.known.destroy {
            // SAFETY: contract, "create": the pointer came from `create` and is not used again.
            unsafe { destroy(self.instance) };
        }
    }
}

/// Status and message of a call that failed.
pub(crate) type CallFailure = (Status, String);

impl LawHandle {
    /// Fixes the parameters.
    ///
    /// # Errors
    /// The law's status and message.
    pub(crate) fn create(
        self,
        formulation: u32,
        parameters: &[f64],
    ) -> Result<OwnedInstance, CallFailure> {
        let Some(create) = self.known.create else {
            return Err((raw::PILUM_E_INTERNAL, "`create` is null".to_owned()));
        };
        let mut instance = null_mut();
        let mut message = [0 as c_char; MESSAGE_CAPACITY];
        // SAFETY: contract, "create": all pointers are valid for the call, counts are true.
        let status = unsafe {
            create(
                self.at,
                &raw const HOST.0,
                formulation,
                parameters.as_ptr(),
                parameters.len() as u32,
                &raw mut instance,
                message.as_mut_ptr(),
                message.len(),
            )
        };
        if status != raw::PILUM_OK {
            return Err((status, read_message(&message)));
        }
        if instance.is_null() {
            return Err((
                raw::PILUM_E_INTERNAL,
                "`create` gave no instance".to_owned(),
            ));
        }
        Ok(OwnedInstance {
            law: self,
            instance,
        })
    }
}

fn read_message(buffer: &[c_char; MESSAGE_CAPACITY]) -> String {
    let bytes: Vec<u8> = buffer
        .iter()
        .map(|&c| c as u8)
        .take_while(|&b| b != 0)
        .collect();
    String::from_utf8_lossy(&bytes).trim().to_owned()
}

/// Values of many points in a slice: component `c` of point `i` stands at
/// `offset + i * point + c * component`.
#[derive(Clone, Copy, Debug)]
pub struct Strided {
    /// Where the first value stands.
    pub offset: usize,
    /// Stride from point to point.
    pub point: usize,
    /// Stride from component to component.
    pub component: usize,
}

impl Strided {
    /// Points one after the other, `n` components each.
    pub fn rows(n: usize) -> Self {
        Self {
            offset: 0,
            point: n,
            component: 1,
        }
    }

    /// The components of one point; as many as the slice holds of them.
    pub fn of_point(self, values: &[f64], point: usize, n_components: usize) -> Vec<f64> {
        let first = self.offset + point * self.point;
        let at = (0..n_components).map(|c| values.get(first + c * self.component));
        at.map_while(Option::<&f64>::copied).collect()
    }

    /// Panics unless `n_points` × `n_components` values lie inside a slice of length `length`:
    /// the one check that keeps the pointers below inside their slices.
    fn assert_fits(self, n_points: usize, n_components: usize, length: usize) {
        if n_points > 0 && n_components > 0 {
            let last =
                self.offset + (n_points - 1) * self.point + (n_components - 1) * self.component;
            assert!(
                last < length,
                "a view of {n_points} points leaves its slice"
            );
        }
    }

    fn view(self, values: &[f64], n_points: usize, n_components: usize) -> View {
        self.assert_fits(n_points, n_components, values.len());
        let p = if n_components == 0 || n_points == 0 {
            null()
        } else {
            values[self.offset..].as_ptr()
        };
        View {
            p,
            point: self.point as isize,
            component: self.component as isize,
        }
    }

    fn view_mut(self, values: &mut [f64], n_points: usize, n_components: usize) -> ViewMut {
        self.assert_fits(n_points, n_components, values.len());
        let p = if n_components == 0 || n_points == 0 {
            null_mut()
        } else {
            values[self.offset..].as_mut_ptr()
        };
        ViewMut {
            p,
            point: self.point as isize,
            component: self.component as isize,
        }
    }
}

const NOTHING: View = View {
    p: null(),
    point: 0,
    component: 0,
};
const NOWHERE: ViewMut = ViewMut {
    p: null_mut(),
    point: 0,
    component: 0,
};

/// What one call works on, in the host's slices.
#[derive(Debug)]
pub(crate) struct Call<'a> {
    pub(crate) request: u32,
    pub(crate) n_points: usize,
    pub(crate) n_components: usize,
    pub(crate) n_states: usize,
    pub(crate) time: f64,
    pub(crate) time_increment: f64,
    pub(crate) moment: Moment,
    pub(crate) sites: &'a [Site],
    pub(crate) gradient0: Option<(&'a [f64], Strided)>,
    pub(crate) gradient1: Option<(&'a [f64], Strided)>,
    pub(crate) flux0: (&'a [f64], Strided),
    pub(crate) state0: &'a [f64],
    pub(crate) flux1: Option<(&'a mut [f64], Strided)>,
    pub(crate) state1: &'a mut [f64],
    pub(crate) tangent: &'a mut [f64],
    pub(crate) status: &'a mut [Status],
    pub(crate) step_factor: &'a mut [f64],
}

impl OwnedInstance {
    /// Asks for initial internal variables. `None` if the law has no `init_state`.
    pub(crate) fn init_state(&self, call: Call<'_>) -> Option<(Status, String)> {
        let init = self.law.known.init_state?;
        Some(self.call(init, call))
    }

    /// Carries the points over the increment. Returns the most severe status and a message.
    pub(crate) fn integrate(&self, call: Call<'_>) -> (Status, String) {
        match self.law.known.integrate {
            Some(integrate) => self.call(integrate, call),
            None => (raw::PILUM_E_INTERNAL, "`integrate` is null".to_owned()),
        }
    }

    fn call(
        &self,
        function: unsafe extern "C" fn(*const Instance, *const Batch) -> Status,
        call: Call<'_>,
    ) -> (Status, String) {
        let n = call.n_points;
        let c = call.n_components;
        let wants_tangent = call.request & (raw::PILUM_REQ_TANGENT | raw::PILUM_REQ_ELASTIC) != 0;
        assert!(call.status.len() >= n && call.step_factor.len() >= n);
        let mut message = [0 as c_char; MESSAGE_CAPACITY];
        let read = |values: Option<(&[f64], Strided)>| {
            values.map_or(NOTHING, |(values, strides)| strides.view(values, n, c))
        };
        let batch = Batch {
            struct_size: size_of::<Batch>() as u32,
            request: call.request,
            n_points: n as u64,
            // Always: messages count the points of the batch. Whoever knows the elements puts the
            // place in front, from the number of the point that failed.
            first_point: 0,
            time: call.time,
            time_increment: call.time_increment,
            gradient0: read(call.gradient0),
            gradient1: read(call.gradient1),
            flux0: read(Some(call.flux0)),
            state0: if call.state0.is_empty() {
                NOTHING
            } else {
                Strided::rows(call.n_states).view(call.state0, n, call.n_states)
            },
            flux1: call
                .flux1
                .map_or(NOWHERE, |(values, strides)| strides.view_mut(values, n, c)),
            state1: Strided::rows(call.n_states).view_mut(call.state1, n, call.n_states),
            tangent: if wants_tangent {
                Strided::rows(c * c).view_mut(call.tangent, n, c * c)
            } else {
                NOWHERE
            },
            status: call.status.as_mut_ptr(),
            step_factor: call.step_factor.as_mut_ptr(),
            message: message.as_mut_ptr(),
            message_capacity: message.len(),
            step_time: call.time - call.moment.step_start,
            rates: null(),
        };
        // SAFETY: contract, "Batch": every view was checked against its slice above, and the
        // borrows of `call` last until the call has returned.
        let status = unsafe { function(self.instance, &raw const batch) };
        (status, read_message(&message))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A struct that is 16 bytes long in version 1.0.
    #[repr(C)]
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct First {
        struct_size: u32,
        flags: u32,
        value: u64,
    }

    /// The same two minors later.
    #[repr(C)]
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Grown {
        first: First,
        added: u64,
        last: u64,
    }

    fn first(struct_size: u32, value: u64) -> First {
        First {
            struct_size,
            flags: 0,
            value,
        }
    }

    fn grown(struct_size: u32, value: u64) -> Grown {
        Grown {
            first: first(struct_size, value),
            added: 1,
            last: 2,
        }
    }

    #[test]
    fn an_earlier_table_is_read_as_far_as_it_goes() {
        let entries = [first(16, 5), first(16, 6)];
        let read = table(entries.as_ptr().cast::<Grown>(), 2, 16, "entries").unwrap();
        let zeros = |first| Grown {
            first,
            added: 0,
            last: 0,
        };
        assert_eq!(read, entries.map(zeros));
    }

    #[test]
    fn a_later_table_is_walked_with_its_own_stride() {
        let entries = [grown(32, 5), grown(32, 6)];
        let read = table(entries.as_ptr().cast::<First>(), 2, 16, "entries").unwrap();
        assert_eq!(read, entries.map(|entry| entry.first));
    }

    #[test]
    fn a_table_shorter_than_version_1_0_is_refused() {
        for stride in [0, 8, 15, 17] {
            let entries = [first(stride, 5)];
            let why = table(entries.as_ptr(), 1, 16, "entries").unwrap_err();
            assert!(why.contains("expected at least 16"), "{why}");
        }
    }

    /// A text of this many bytes that starts with `start`, and what lies behind it.
    fn long_text(start: &str, length: usize) -> Vec<u8> {
        let mut bytes = format!("{start:x<length$}\0behind").into_bytes();
        bytes.push(0);
        bytes
    }

    fn copied(bytes: &[u8], allowance: &Allowance) -> Result<String, String> {
        text(bytes.as_ptr().cast(), "doc", allowance)
    }

    // Hosts may refuse what no author writes. This one takes a page of memory, 4 KiB with its NUL,
    // for one text, and 16 MiB, a thousandth of a workstation's memory, for all of a library. The
    // numbers stand here once more, so that a slip in the constants is seen.

    #[test]
    fn a_text_is_copied_up_to_a_page() {
        let longest = long_text("doc ", 4095);
        let copy = copied(&longest, &Allowance::default()).unwrap();
        assert_eq!(copy.as_bytes(), &longest[..4095]);
        let why = copied(&long_text("doc ", 4096), &Allowance::default()).unwrap_err();
        assert!(why.contains("longer than 4096 bytes"), "{why}");
    }

    #[test]
    fn texts_are_copied_up_to_a_total() {
        // 16 777 216 = 4097 * 4095 + 1: after so many of the longest texts one byte is left.
        let allowance = Allowance::default();
        for number in 0..4097 {
            let long = long_text(&format!("text {number} "), 4095);
            let copy = copied(&long, &allowance).unwrap();
            assert_eq!(copy.as_bytes(), &long[..4095]);
        }
        let refused = |bytes: &[u8]| {
            let why = copied(bytes, &allowance).unwrap_err();
            assert!(why.contains("longer than 16 MB together"), "{why}");
        };
        // One byte more than there is room for; what is refused takes no room.
        refused(b"ab\0");
        // Just below, then at the limit.
        assert_eq!(copied(b"\0", &allowance).unwrap(), "");
        assert_eq!(copied(b"z\0", &allowance).unwrap(), "z");
        // Above it. A text without bytes needs no room.
        refused(b"z\0");
        refused(b" \0");
        assert_eq!(copied(b"\0", &allowance).unwrap(), "");
    }

    #[test]
    fn a_struct_is_read_as_far_as_it_says() {
        let read = |said| {
            let entry = grown(said, 5);
            // SAFETY: 32 bytes are there, whatever less is said.
            unsafe { known(&raw const entry, 16) }
        };
        assert_eq!(read(15), None);
        assert_eq!(read(16).map(|s| (s.added, s.last)), Some((0, 0)));
        assert_eq!(read(24).map(|s| (s.added, s.last)), Some((1, 0)));
        assert_eq!(read(32).map(|s| (s.added, s.last)), Some((1, 2)));
        let later = grown(32, 5);
        // SAFETY: as above.
        let read = unsafe { known((&raw const later).cast::<First>(), 16) };
        assert_eq!(read, Some(later.first));
    }
}
