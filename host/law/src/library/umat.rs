//! Opening a library with an Abaqus user subroutine, and calling it.

use super::super::library_bytes::Image;
use std::ffi::c_void;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Number of arguments of `SUBROUTINE UMAT`.
pub(crate) const N_ARGUMENTS: usize = 37;

type P = *mut c_void;

/// 37 addresses, and by value the hidden length of CMNAME. Widened to a `size_t`, it is also read
/// rightly by compilers that pass lengths as 32-bit integers.
#[rustfmt::skip]
type Function = unsafe extern "C" fn(
    P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P,
    P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, usize,
);

/// The routine in an image of its library that nobody else uses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Routine {
    function: Function,
}

impl Routine {
    /// Opens another image of the library, with separate variables (`SAVE`, `COMMON`), and finds
    /// the routine by the first of `names` that it has. With `traps`, functions that it calls and
    /// nobody supplies become traps.
    ///
    /// # Errors
    /// The defect of the library, in words.
    pub(crate) fn open(
        path: &Path,
        image: Image,
        names: &[&str],
        traps: bool,
    ) -> Result<Self, String> {
        let library = open_private(path, image, traps)?;
        names
            .iter()
            .find_map(|name| {
                // SAFETY: the user says by the adapter that a symbol of this name is a `UMAT`.
                let symbol = unsafe { library.get::<Function>(name.as_bytes()) }.ok()?;
                Some(Self { function: *symbol })
            })
            .ok_or_else(|| format!("it has no routine {}", names.join(", ")))
    }

    /// Calls the routine. Argument `i` starts at word `at[i]`; CMNAME has `n_cmname` characters.
    ///
    /// # Panics
    /// An argument starts outside the words.
    pub(crate) fn call(self, words: &mut [u64], at: &[usize; N_ARGUMENTS], n_cmname: usize) {
        assert!(at.iter().all(|first| *first < words.len()));
        let start = words.as_mut_ptr();
        // SAFETY: every place lies inside `words`, see above.
        let p = at.map(|first| unsafe { start.add(first) }.cast::<c_void>());
        #[rustfmt::skip]
        let call = || {
            // SAFETY: 37 addresses of numbers (and 80 characters) of the sizes that the routine is
            // told by NTENS, NDI, NSHR, NSTATV and NPROPS; the words are borrowed until it has
            // returned. That it stays within them is checked afterwards by the words in between.
            unsafe { (self.function)(
                p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9],
                p[10], p[11], p[12], p[13], p[14], p[15], p[16], p[17], p[18], p[19],
                p[20], p[21], p[22], p[23], p[24], p[25], p[26], p[27], p[28], p[29],
                p[30], p[31], p[32], p[33], p[34], p[35], p[36], n_cmname,
            ); }
        };
        call();
    }
}

/// Opens another image of a library, with separate variables (`SAVE`, `COMMON`). With `traps`,
/// functions that it calls and nobody supplies become traps.
///
/// # Errors
/// The defect of the library, in words.
pub(super) fn open_private(
    path: &Path,
    image: Image,
    traps: bool,
) -> Result<&'static libloading::Library, String> {
    let _guard = super::ONE_AT_A_TIME
        .lock()
        .unwrap_or_else(PoisonError::into_inner);
    let sha256 = image.sha256.clone();
    // SAFETY: running the library's initialisers is what loading means; the user named it.
    let loaded = unsafe { load_private(path, image) };
    let library = loaded.or_else(|why| supply(path, &sha256, traps, why))?;
    Ok(Box::leak(Box::new(library)))
}

/// Tries once more to load a library that could not be, `why`; with traps if those are what it lacks.
#[cfg(unix)]
fn supply(
    path: &Path,
    sha256: &str,
    traps: bool,
    why: String,
) -> Result<libloading::Library, String> {
    let Some(missing) = super::externals::missing(path) else {
        return Err(why);
    };
    if !traps {
        return Err(missing.refusal());
    }
    if !crate::child::is_child() {
        return Err(format!(
            "{}; traps need a worker process, which `in_process` does without",
            missing.refusal()
        ));
    }
    super::externals::trap(&missing)?;
    let image = Image::read(path)?;
    if image.sha256 != sha256 {
        return Err("it was changed while it was opened".to_owned());
    }
    // SAFETY: as the first time.
    unsafe { load_private(path, image) }
}

#[cfg(not(unix))]
fn supply(_: &Path, _: &str, traps: bool, why: String) -> Result<libloading::Library, String> {
    Err(if traps {
        why + "; there are no traps on this system"
    } else {
        why
    })
}

/// Loads the hashed bytes once more. If that fails (no files in memory, a library that looks for
/// others next to itself), the file itself is loaded. That gives the same image every time, so a
/// second one is refused.
///
/// # Safety
/// The library's initialisers may be run.
pub(super) unsafe fn load_private(
    path: &Path,
    image: Image,
) -> Result<libloading::Library, String> {
    static IN_PLACE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
    if let Some(sealed) = image.sealed_path() {
        // SAFETY: passed on to the caller.
        if let Ok(library) = unsafe { load(&sealed, path) } {
            image.keep();
            return Ok(library);
        }
        if !image.is_current() {
            return Err("it was changed while it was opened".to_owned());
        }
    }
    let mut in_place = IN_PLACE.lock().unwrap_or_else(PoisonError::into_inner);
    if in_place.iter().any(|opened| opened == path) {
        return Err(
            "another material uses it already, and this system cannot open it a second time with \
             variables of its own; without `in_process` each material has a process of its own"
                .to_owned(),
        );
    }
    // SAFETY: passed on to the caller.
    let library = unsafe { load(path, path) }.map_err(|error| {
        let why = std::error::Error::source(&error).map_or(String::new(), |why| format!(": {why}"));
        format!("it cannot be loaded: {error}{why}")
    })?;
    in_place.push(path.to_owned());
    Ok(library)
}

/// With its own symbols first: a routine that brings its own `sprind` uses that one.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
unsafe fn load(file: &Path, path: &Path) -> Result<libloading::Library, libloading::Error> {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
    const RTLD_DEEPBIND: std::ffi::c_int = 8;
    super::abaqus::keep();
    // SAFETY: passed on to the caller.
    super::apart(path, || unsafe {
        Library::open(Some(file), RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND)
    })
    .map(Into::into)
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
unsafe fn load(file: &Path, path: &Path) -> Result<libloading::Library, libloading::Error> {
    super::abaqus::keep();
    // SAFETY: passed on to the caller.
    unsafe { super::load(file, path) }
}
