//! Routines that are called with bare addresses: an Abaqus user subroutine `UMAT`, and a user-defined soil model of PLAXIS,
//! `User_Mod`.

use super::load_image;
use crate::process::library_bytes::Image;
use std::ffi::{c_char, c_int, c_void};
use std::path::Path;
use std::sync::PoisonError;

/// Number of arguments of `SUBROUTINE UMAT`.
pub(crate) const N_UMAT: usize = 37;
/// Number of arguments of `User_Mod`.
pub(crate) const N_UDSM: usize = 31;
/// Length of a name, `CHARACTER*255`.
const N_NAME: usize = 255;

type P = *mut c_void;

/// 37 addresses, and by value the hidden length of CMNAME. Widened to a `size_t`, it is also read
/// rightly by compilers that pass lengths as 32-bit integers.
#[rustfmt::skip]
type UmatFunction = unsafe extern "C" fn(
    P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P,
    P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, usize,
);
#[rustfmt::skip]
type UdsmFunction = unsafe extern "C" fn(
    P, P, P, P, P, P, P, P, P, P, P, P, P, P, P, P,
    P, P, P, P, P, P, P, P, P, P, P, P, P, P, P,
);
/// What counts models, or parameters and state variables of one.
type CountAll = unsafe extern "C" fn(*mut c_int);
type CountOf = unsafe extern "C" fn(*const c_int, *mut c_int);
/// What names a model, or one of its parameters and variables. The hidden length of the text comes
/// last; C leaves it alone.
type NameOf = unsafe extern "C" fn(*const c_int, *mut c_char, usize);
type NameIn = unsafe extern "C" fn(*const c_int, *const c_int, *mut c_char, usize);

/// The addresses of arguments, of which number `i` starts at word `at[i]`.
///
/// # Panics
/// An argument starts outside the words.
fn addresses<const N: usize>(words: &mut [u64], at: &[usize; N]) -> [P; N] {
    assert!(at.iter().all(|first| *first < words.len()));
    let start = words.as_mut_ptr();
    // SAFETY: every place lies inside `words`, see above.
    at.map(|first| unsafe { start.add(first) }.cast::<c_void>())
}

/// A `UMAT` in an image of its library that nobody else uses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Umat {
    function: UmatFunction,
}

impl Umat {
    /// Opens another image of the library, and finds the routine by the first of `names` that it has; as
    /// [`open_private`].
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
        let found = names.iter().find_map(|name| {
            // SAFETY: the user says by the adapter that a symbol of this name is a `UMAT`.
            let symbol = unsafe { library.get::<UmatFunction>(name.as_bytes()) }.ok()?;
            Some(Self { function: *symbol })
        });
        found.ok_or_else(|| format!("it has no routine {}", names.join(", ")))
    }

    /// Calls the routine. Argument `i` starts at word `at[i]`; CMNAME has `n_cmname` characters.
    ///
    /// # Panics
    /// An argument starts outside the words.
    pub(crate) fn call(self, words: &mut [u64], at: &[usize; N_UMAT], n_cmname: usize) {
        let p = addresses(words, at);
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

/// A `User_Mod` in an image of its library that nobody else uses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Udsm {
    function: UdsmFunction,
    library: &'static libloading::Library,
}

/// A Fortran routine by the names that compilers give it.
fn spellings(name: &str) -> [String; 6] {
    let (lower, upper) = (name.to_lowercase(), name.to_uppercase());
    let with = |name: &str| format!("{name}_");
    [
        with(&lower),
        name.to_owned(),
        lower.clone(),
        upper.clone(),
        with(name),
        with(&upper),
    ]
}

impl Udsm {
    /// Opens another image of the library; as [`open_private`].
    ///
    /// # Errors
    /// The defect of the library, in words.
    pub(crate) fn open(path: &Path, image: Image, traps: bool) -> Result<Self, String> {
        let library = open_private(path, image, traps)?;
        // SAFETY: the user says by the adapter that a symbol of this name is a `User_Mod`.
        let function = unsafe { find::<UdsmFunction>(library, "User_Mod") }.ok_or_else(|| {
            let names = spellings("User_Mod").join(", ");
            format!("it has no routine User_Mod: it exports none of {names}")
        })?;
        Ok(Self { function, library })
    }

    /// Calls the routine. Argument `i` starts at word `at[i]`.
    ///
    /// # Panics
    /// An argument starts outside the words.
    pub(crate) fn call(self, words: &mut [u64], at: &[usize; N_UDSM]) {
        let p = addresses(words, at);
        #[rustfmt::skip]
        let call = || {
            // SAFETY: 31 addresses of numbers, of the sizes that PLAXIS gives them; the words are
            // borrowed until it has returned. That it stays within them is checked afterwards by
            // the words in between.
            unsafe { (self.function)(
                p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10],
                p[11], p[12], p[13], p[14], p[15], p[16], p[17], p[18], p[19], p[20],
                p[21], p[22], p[23], p[24], p[25], p[26], p[27], p[28], p[29], p[30],
            ); }
        };
        call();
    }

    /// How many models there are, if the library reports it.
    pub(crate) fn n_models(self) -> Option<i32> {
        // SAFETY: the user says by the adapter what a symbol of this name is.
        let count = unsafe { find::<CountAll>(self.library, "GetModelCount") }?;
        let mut n = 0;
        // SAFETY: one integer.
        unsafe { count(&raw mut n) };
        Some(n)
    }

    /// What `function`, `GetParamCount` or `GetStateVarCount`, says of a model.
    pub(crate) fn count(self, function: &str, model: i32) -> Option<i32> {
        // SAFETY: the user says by the adapter what a symbol of this name is.
        let count = unsafe { find::<CountOf>(self.library, function) }?;
        let mut n = 0;
        // SAFETY: two integers.
        unsafe { count(&raw const model, &raw mut n) };
        Some(n)
    }

    /// The name of a model, as it is written.
    pub(crate) fn model_name(self, model: i32) -> Option<Vec<u8>> {
        // SAFETY: the user says by the adapter what a symbol of this name is.
        let name = unsafe { find::<NameOf>(self.library, "GetModelName") }?;
        let mut text = blank();
        // SAFETY: an integer, and a text of this length with room behind it.
        unsafe { name(&raw const model, text.as_mut_ptr().cast(), N_NAME) };
        Some(text)
    }

    /// What `function`, such as `GetParamName` or `GetStateVarUnit`, says of the parameter or
    /// variable with this number, from 1.
    pub(crate) fn name(self, function: &str, model: i32, number: i32) -> Option<Vec<u8>> {
        // SAFETY: the user says by the adapter what a symbol of this name is.
        let name = unsafe { find::<NameIn>(self.library, function) }?;
        let mut text = blank();
        // SAFETY: two integers, and a text of this length with room behind it.
        unsafe {
            name(
                &raw const model,
                &raw const number,
                text.as_mut_ptr().cast(),
                N_NAME,
            );
        }
        Some(text)
    }
}

/// Room for a name, and for the end that C writes.
fn blank() -> Vec<u8> {
    let mut text = vec![b' '; N_NAME];
    text.push(0);
    text
}

/// A function by the first of the spellings of its name that is there.
///
/// # Safety
/// A symbol of this name has this type.
unsafe fn find<T: Copy>(library: &'static libloading::Library, name: &str) -> Option<T> {
    spellings(name).iter().find_map(|name| {
        // SAFETY: passed on to the caller.
        let symbol = unsafe { library.get::<T>(name.as_bytes()) }.ok()?;
        Some(*symbol)
    })
}

/// Opens another image of a library, with separate variables (`SAVE`, `COMMON`). With `traps`,
/// functions that it calls and nobody supplies become traps.
///
/// # Errors
/// The defect of the library, in words.
fn open_private(
    path: &Path,
    image: Image,
    traps: bool,
) -> Result<&'static libloading::Library, String> {
    let _guard = super::ONE_AT_A_TIME
        .lock()
        .unwrap_or_else(PoisonError::into_inner);
    let sha256 = image.sha256.clone();
    // SAFETY: running the library's initialisers is what loading means; the user named it.
    let loaded = unsafe { load_image(path, image, true) };
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
    if !crate::process::child::is_child() {
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
    unsafe { load_image(path, image, true) }
}

#[cfg(not(unix))]
fn supply(_: &Path, _: &str, traps: bool, why: String) -> Result<libloading::Library, String> {
    Err(if traps {
        why + "; there are no traps on this system"
    } else {
        why
    })
}
