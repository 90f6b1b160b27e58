//! What a law may have changed of the process, or keeps of its memory, and only the system tells.

/// What is done on each signal, by its number, from 1.
#[cfg(target_os = "linux")]
pub fn signal_handlers() -> Vec<usize> {
    use nix::libc;
    use std::mem::MaybeUninit;
    use std::ptr::null;
    let handler = |number| {
        let mut now = MaybeUninit::<libc::sigaction>::zeroed();
        // SAFETY: nothing is set; what is done now is written to a struct of that type, for which
        // zeros are a value, should there be no such signal.
        unsafe {
            libc::sigaction(number, null(), now.as_mut_ptr());
            now.assume_init().sa_sigaction
        }
    };
    (1..=64).map(handler).collect()
}

/// Not known.
#[cfg(not(target_os = "linux"))]
pub fn signal_handlers() -> Vec<usize> {
    Vec::new()
}

/// Whether this process has children, or has had any and waited for them.
#[cfg(unix)]
pub fn has_had_children() -> bool {
    use nix::libc;
    use rustix::process::{WaitOptions, wait};
    use std::mem::MaybeUninit;
    // Without children there is an error.
    if wait(WaitOptions::NOHANG).is_ok() {
        return true;
    }
    let mut usage = MaybeUninit::<libc::rusage>::zeroed();
    // SAFETY: the struct is of that type; zeros are a value, should nothing be written.
    let usage = unsafe {
        libc::getrusage(libc::RUSAGE_CHILDREN, usage.as_mut_ptr());
        usage.assume_init()
    };
    usage.ru_minflt > 0 || usage.ru_maxrss > 0
}

/// Not known.
#[cfg(not(unix))]
pub fn has_had_children() -> bool {
    false
}

/// Bytes of the heap that are in use, of all threads; `None` where the system does not tell.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub fn heap_in_use() -> Option<usize> {
    // SAFETY: it reads counters of the allocator, and takes nothing.
    let info = unsafe { nix::libc::mallinfo2() };
    Some(info.uordblks + info.hblkhd)
}

/// Not known.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn heap_in_use() -> Option<usize> {
    None
}
