//! Opening a library as a check does, and entering it with hosts of other minor versions.

use super::super::{HOST, load};
use super::call_log::{self, KeptPhase, Phase};
use super::pages::{Fence, Pages};
use abi::raw::{self, Host, MagicBlock};
use abi::version;
use std::io;
use std::path::Path;

/// The host's description with another minor version, or with bytes at its end that this version does
/// not know. It stays for the life of the process.
pub(super) fn other_host(more: usize, abi_minor: u16) -> io::Result<*const Host> {
    let size = size_of::<Host>() + more;
    let mut pages = Pages::new(size, Fence::After)?;
    pages.bytes_mut().fill(0xa5);
    let (before, hosts, _) = {
        // SAFETY: these bytes may be anything, since only a host is written to them.
        unsafe {
            pages
                .bytes_mut()
                .align_to_mut::<std::mem::MaybeUninit<Host>>()
        }
    };
    let at: *const Host = match (before, hosts) {
        ([], [host, ..]) => host.write(Host {
            struct_size: size as u32,
            abi_minor,
            ..HOST.0
        }),
        _ => {
            return Err(io::Error::other(
                "the description of the host is not aligned",
            ));
        }
    };
    pages.lock()?;
    std::mem::forget(pages);
    Ok(at)
}

/// Opens a library with all its symbols, and no more.
///
/// # Errors
/// What the system says.
pub fn open(path: &Path) -> Result<(), String> {
    symbols(path).map(|_| ())
}

/// Notes what is about to be done with a library that is loaded from its file.
fn begin(phase: Phase) -> Result<(), String> {
    call_log::keep_phase(KeptPhase::new(phase, true)).map_err(|error| error.to_string())
}

/// The library, never unloaded.
fn symbols(path: &Path) -> Result<&'static libloading::Library, String> {
    begin(Phase::Load)?;
    // SAFETY: running the library's initialisers is what loading means; the user named it.
    let library = unsafe { load(path, path, false) }.map_err(|error| {
        std::error::Error::source(&error).map_or_else(|| error.to_string(), ToString::to_string)
    })?;
    Ok(Box::leak(Box::new(library)))
}

/// Compares the handshake block with this host's.
///
/// # Errors
/// It is missing, or the first field that differs.
pub fn shake_hands(path: &Path) -> Result<(), String> {
    // SAFETY: contract, "Handshake": `pilum_magic` is a data symbol of this type for ever.
    let magic = unsafe { symbols(path)?.get::<*const MagicBlock>(b"pilum_magic\0") }
        .map_err(|_| "there is no symbol `pilum_magic`".to_owned())?;
    begin(Phase::Handshake)?;
    // SAFETY: as above; the block is at least 64 bytes in every version.
    let magic = unsafe { (*magic).read_unaligned() };
    version::check(&magic).map_err(|mismatch| mismatch.to_string())
}

/// Calls `pilum_entry` twice, then from another thread, with a host that is longer than this one.
/// The addresses it returned.
///
/// # Errors
/// There is no such function.
pub fn enter(path: &Path) -> Result<[usize; 3], String> {
    let library = symbols(path)?;
    // SAFETY: contract, "Handshake": once the block is accepted, `pilum_entry` has this type.
    let entry = *unsafe { library.get::<raw::Entry>(b"pilum_entry\0") }
        .map_err(|_| "there is no symbol `pilum_entry`".to_owned())?;
    // SAFETY: contract, "Entry": may be called with any valid host block, from any thread.
    let call = move || unsafe { entry(&raw const HOST.0) }.addr();
    let other = move || -> io::Result<usize> {
        let host = other_host(64, raw::PILUM_ABI_MINOR)?;
        // SAFETY: as above.
        Ok(unsafe { entry(host) }.addr())
    };
    begin(Phase::Entry)?;
    let (first, second) = (call(), call());
    let third = std::thread::spawn(other)
        .join()
        .map_err(|_| "`pilum_entry` panicked".to_owned())?
        .map_err(|error| error.to_string())?;
    Ok([first, second, third])
}
