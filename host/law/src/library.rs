//! Opening libraries: the hand shake. This file with its modules is one of the places of the
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
mod describe;
#[cfg(unix)]
mod externals;
mod instance;
pub(crate) mod mfront;
pub mod probe;
pub(crate) mod routine;
#[cfg(unix)]
mod shared;

pub use describe::describe_memory;
#[cfg(unix)]
pub use shared::SharedMemory;

use crate::description::LawDescription;
use crate::process::library_bytes::Image;
use crate::process::process_state;
use abi::raw::{self, Host, Law, MagicBlock};
use abi::version::{self, PLUGIN_SIZE_1_0};
use describe::{describe, known};
use instance::{NOTHING, OwnedInstance};
use probe::call_log::{self, KeptPhase, Phase};
use std::ffi::CStr;
use std::hint::black_box;
use std::mem::size_of;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

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
type Laws = Vec<(LawDescription, LawHandle)>;

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

/// Libraries that this process has loaded, by SHA-256. One list for the whole process: libraries
/// are never unloaded, and the same bytes loaded again for each [`Opener`](crate::Opener) would
/// only pile up.
/// Whether a library may be used is its opener's decision, made before it is looked for here.
static LOADED: Mutex<Vec<(String, Laws)>> = Mutex::new(Vec::new());

/// Opens a library, shakes hands and copies its description. It is opened from the bytes that were
/// hashed where the system allows it.
///
/// # Errors
/// The defect of the library, in words.
pub(crate) fn open(path: &Path, image: Image) -> Result<Laws, String> {
    let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, laws)) = loaded.iter().find(|(sha256, _)| *sha256 == image.sha256) {
        return Ok(laws.clone());
    }
    let sha256 = image.sha256.clone();
    let laws = load_and_describe(path, image)?;
    loaded.push((sha256, laws.clone()));
    Ok(laws)
}

fn load_and_describe(path: &Path, image: Image) -> Result<Laws, String> {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let begin = |phase| {
        call_log::keep_phase(KeptPhase::new(phase, false)).map_err(|error| error.to_string())
    };
    begin(Phase::Load)?;
    // SAFETY: running the library's initialisers is what loading means; the user named it.
    let library: &'static libloading::Library =
        Box::leak(Box::new(unsafe { load_image(path, image, false) }?));
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

/// Loads the hashed bytes. If that fails (a library that looks for others next to itself, a system
/// that executes nothing from memory), the file is loaded, provided it is unchanged. The loader
/// runs nothing of a library it cannot load. An image that `is_private` shares no variables with another
/// one: the file itself gives the same image every time, so that a second one of it is refused.
///
/// # Safety
/// The library's initialisers may be run.
unsafe fn load_image(
    path: &Path,
    image: Image,
    is_private: bool,
) -> Result<libloading::Library, String> {
    static IN_PLACE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
    if let Some(sealed) = image.sealed_path() {
        // SAFETY: passed on to the caller.
        if let Ok(library) = unsafe { load(&sealed, path, is_private) } {
            image.keep();
            return Ok(library);
        }
        if !image.is_current() {
            return Err("it was changed while it was opened".to_owned());
        }
    }
    let mut in_place = IN_PLACE.lock().unwrap_or_else(PoisonError::into_inner);
    if is_private && in_place.iter().any(|opened| opened == path) {
        return Err(
            "another material uses it already, and this system cannot open it a second time with \
             variables of its own; without `in_process` each material has a process of its own"
                .to_owned(),
        );
    }
    // SAFETY: passed on to the caller.
    let library = unsafe { load(path, path, is_private) }.map_err(|error| {
        let why = std::error::Error::source(&error).map_or(String::new(), |why| format!(": {why}"));
        format!("it cannot be loaded: {error}{why}")
    })?;
    if is_private {
        in_place.push(path.to_owned());
    }
    Ok(library)
}

/// Loads a file of the library at `path`. It finds its own symbols first: a law with a function `gamma` or `y0` means
/// that one, not libm's, and a routine that brings its own `sprind` not the program's.
#[cfg(unix)]
unsafe fn load(
    file: &Path,
    path: &Path,
    is_private: bool,
) -> Result<libloading::Library, libloading::Error> {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
    let mut flags = RTLD_NOW | RTLD_LOCAL;
    if is_private {
        abaqus::keep();
    }
    if cfg!(all(target_os = "linux", target_env = "gnu")) {
        const RTLD_DEEPBIND: std::ffi::c_int = 8;
        flags |= RTLD_DEEPBIND;
    }
    // SAFETY: passed on to the caller.
    apart(path, || unsafe { Library::open(Some(file), flags) }).map(Into::into)
}

#[cfg(not(unix))]
unsafe fn load(
    file: &Path,
    path: &Path,
    is_private: bool,
) -> Result<libloading::Library, libloading::Error> {
    if is_private {
        abaqus::keep();
    }
    // SAFETY: passed on to the caller.
    apart(path, || unsafe { libloading::Library::new(file) })
}

/// Stack of the thread in which initialisers run: as large as that of a main thread.
const STACK: usize = 8 << 20;

/// Opens the library at `path` in its own thread. Changes that its initialisers make to the arithmetic of their
/// thread, as those of `-Ofast` do, end with that thread. If no thread can be started, it is opened in this one.
fn apart<T: Send>(path: &Path, open: impl Fn() -> T + Sync) -> T {
    let watched = || {
        let did_flush = flushes();
        let opened = open();
        if flushes() && !did_flush {
            process_state::remark(format!(
                "library {} has the thread that opens it take numbers below 2.2e-308 for zero, as `-Ofast` and \
                 `-ffast-math` link it; it was opened in a thread of its own, so that the program still computes with \
                 them",
                path.display()
            ));
        }
        opened
    };
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK);
        match thread.spawn_scoped(scope, watched) {
            Ok(thread) => thread.join().unwrap_or_else(|panic| resume_unwind(panic)),
            Err(_) => watched(),
        }
    })
}

/// Whether this thread takes numbers below the least normal one for zero.
fn flushes() -> bool {
    // The product is formed here, and not where it is needed later. Such a thread takes it for zero in comparisons, too.
    black_box(black_box(f64::MIN_POSITIVE) * black_box(0.5)).to_bits() == 0
}

/// The second check, for libraries written in Rust with the same minor version and `abi_stable`:
/// the symbol carries the minor, so others are not found.
#[cfg(feature = "abi_stable")]
fn check_rust_layout(library: &'static libloading::Library) -> Result<(), String> {
    use abi::layout;
    use abi::raw::RustLayout;
    use describe::{Allowance, text};
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
