//! Changes that a law makes to the process or its memory, as the system reports them.

/// Action on each signal, by its number, from 1.
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

/// Bytes of the heap that are in use, of all threads, below 4 GiB; `None` where the system does not tell.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub fn heap_in_use() -> Option<usize> {
    // SAFETY: it reads counters of the allocator, and takes nothing. `mallinfo2` needs glibc 2.33.
    let info = unsafe { nix::libc::mallinfo() };
    Some(info.uordblks.wrapping_add(info.hblkhd).cast_unsigned() as usize)
}

/// Not known.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn heap_in_use() -> Option<usize> {
    None
}

/// Bytes of memory that the process has mapped; `None` where the system does not tell.
pub fn mapped() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmSize:"))?;
    let kibibytes: usize = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes << 10)
}

/// The name of the locale, of each of its parts if they differ.
#[cfg(unix)]
pub fn locale() -> String {
    use nix::libc;
    use std::ffi::CStr;
    // SAFETY: nothing is set; the name stands until the locale is set, which only the library would
    // do, and it does not run now.
    unsafe {
        let name = libc::setlocale(libc::LC_ALL, std::ptr::null());
        if name.is_null() {
            String::new()
        } else {
            CStr::from_ptr(name).to_string_lossy().into_owned()
        }
    }
}

/// Not known.
#[cfg(not(unix))]
pub fn locale() -> String {
    String::new()
}

/// How the processor treats exceptions of arithmetic, rounding and subnormal numbers, without what has
/// happened.
#[cfg(target_arch = "x86_64")]
pub fn arithmetic() -> u32 {
    let mut control = 0_u32;
    // SAFETY: it stores a register of the processor into these four bytes.
    unsafe {
        std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut control, options(nostack, preserves_flags));
    }
    control & !0x3f
}

/// Not known.
#[cfg(not(target_arch = "x86_64"))]
pub fn arithmetic() -> u32 {
    0
}

/// Whether an alarm is set.
#[cfg(unix)]
pub fn alarm() -> bool {
    use nix::libc;
    let mut timer = std::mem::MaybeUninit::<libc::itimerval>::zeroed();
    // SAFETY: nothing is set; what is left is written to a struct of that type, for which zeros are a
    // value.
    let left = unsafe {
        libc::getitimer(libc::ITIMER_REAL, timer.as_mut_ptr());
        timer.assume_init()
    };
    left.it_value.tv_sec > 0 || left.it_value.tv_usec > 0
}

/// Not known.
#[cfg(not(unix))]
pub fn alarm() -> bool {
    false
}
