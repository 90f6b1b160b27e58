//! Traps at the entries of the C library's allocator: whoever calls it, in whatever language, ends
//! the process. Nothing of it is seen from outside a call, so a pair of `malloc` and `free` is
//! caught as well as a leak. What does not go through the C library is not: an allocator linked
//! into the law's library, which gets its memory from the system by itself.

/// Whether this machine has traps: Linux on x86-64.
pub const CAN_TRAP: bool = cfg!(all(target_os = "linux", target_arch = "x86_64"));

#[cfg(not(all(target_os = "linux", target_arch = "x86_64")))]
#[derive(Debug)]
pub(super) struct Traps;

#[cfg(not(all(target_os = "linux", target_arch = "x86_64")))]
#[expect(clippy::unused_self, clippy::unnecessary_wraps, reason = "as on Linux")]
impl Traps {
    pub(super) fn new(_: bool) -> std::io::Result<Self> {
        Ok(Self)
    }

    pub(super) fn set(&self) {}

    pub(super) fn remove(&self) {}
}

#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
mod of_linux {
    use rustix::mm::{MprotectFlags, mprotect};
    use std::ffi::c_void;
    use std::io;

    unsafe extern "C" {
        safe fn malloc();
        safe fn calloc();
        safe fn realloc();
        safe fn free();
        safe fn posix_memalign();
        safe fn aligned_alloc();
        safe fn mmap();
    }

    /// The instruction `int3`.
    const TRAP: u8 = 0xcc;

    /// Entries of the allocator, with what stands there without a trap.
    #[derive(Debug)]
    pub(crate) struct Traps(Vec<(*mut u8, u8)>);

    impl Traps {
        /// Traps, not set yet; none at all unless they are `wanted`.
        pub(crate) fn new(wanted: bool) -> io::Result<Self> {
            if !wanted {
                return Ok(Self(Vec::new()));
            }
            let page = rustix::param::page_size();
            let entries = [
                malloc as *const c_void,
                calloc as *const c_void,
                realloc as *const c_void,
                free as *const c_void,
                posix_memalign as *const c_void,
                aligned_alloc as *const c_void,
                mmap as *const c_void,
            ];
            entries
                .into_iter()
                .map(|entry| {
                    let at = entry.cast::<u8>().cast_mut();
                    let start = at.wrapping_sub(at.addr() % page).cast::<c_void>();
                    let access = MprotectFlags::READ | MprotectFlags::WRITE | MprotectFlags::EXEC;
                    // SAFETY: the page holds the function, so it is mapped; more access than
                    // before takes nothing from anybody.
                    unsafe { mprotect(start, page, access)? };
                    // SAFETY: the first byte of a function.
                    Ok((at, unsafe { at.read() }))
                })
                .collect::<io::Result<_>>()
                .map(Self)
        }

        /// From now on nobody may allocate, this program included.
        pub(crate) fn set(&self) {
            for (at, _) in &self.0 {
                // SAFETY: made writable in `new`. x86-64 keeps code and data coherent, and a
                // child with traps has no other threads.
                unsafe { at.write_volatile(TRAP) };
            }
        }

        pub(crate) fn remove(&self) {
            for (at, before) in &self.0 {
                // SAFETY: as above.
                unsafe { at.write_volatile(*before) };
            }
        }
    }
}

#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
pub(super) use of_linux::Traps;
