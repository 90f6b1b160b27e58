//! Utility routines of Abaqus that user subroutines call, exported by the program (`build.rs`) so
//! that the loader finds them for a library that leaves them undefined.
//!
//! Names are those of gfortran and of Intel's compilers on Linux. Tensors have NDI direct and NSHR
//! shear components in the order 11 22 33 12 13 23; strains (LSTR = 2) carry γ = 2ε.

use nalgebra::{Matrix3, SymmetricEigen};
use std::ffi::{c_char, c_int};
use std::fmt::Write as _;
use std::hint::black_box;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::OnceLock;

/// The routines, by the names that compilers give them.
pub(crate) const NAMES: [&str; 8] = [
    "getjobname_",
    "getoutdir_",
    "rotsig_",
    "sinv_",
    "sprinc_",
    "sprind_",
    "stdb_abqerr_",
    "xit_",
];

/// Exit code of a process in which a routine called `XIT`.
pub(super) const XIT: i32 = 70;
/// Characters of JOBNAME and OUTDIR.
const N_NAME: usize = 256;
/// Characters of an entry of CHARV.
const N_CHARV: usize = 8;
/// Places of the shear components.
const SHEAR: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// Keeps the routines in the program, of which nothing else calls them.
pub(super) fn keep() {
    black_box((
        xit_ as extern "C" fn(),
        getjobname_ as Name,
        getoutdir_ as Name,
    ));
    black_box(stdb_abqerr_ as unsafe extern "C" fn(_, _, _, _, _, _, _));
    black_box(sinv_ as unsafe extern "C" fn(_, _, _, _, _));
    black_box(sprinc_ as unsafe extern "C" fn(_, _, _, _, _));
    black_box(sprind_ as unsafe extern "C" fn(_, _, _, _, _, _));
    black_box(rotsig_ as unsafe extern "C" fn(_, _, _, _, _, _));
}

type Name = unsafe extern "C" fn(*mut c_char, *mut c_int, usize);

/// `CALL XIT` ends the process: a worker's, unless the routine runs in the program itself.
#[unsafe(no_mangle)]
extern "C" fn xit_() {
    let _ = writeln!(
        std::io::stderr(),
        "the routine called XIT, which ends its process"
    );
    std::process::exit(XIT);
}

/// `CALL STDB_ABQERR(LOP, TEXT, INTV, REALV, CHARV)`: a message, with `%I`, `%R`, `%S` for the next
/// entries of the arrays. LOP = −3 ends the process.
///
/// # Safety
/// As many entries as the text asks for.
#[unsafe(no_mangle)]
unsafe extern "C" fn stdb_abqerr_(
    lop: *const c_int,
    text: *const c_char,
    integers: *const c_int,
    reals: *const f64,
    texts: *const c_char,
    n_text: usize,
    _n_texts: usize,
) {
    // SAFETY: a Fortran text has as many characters as its hidden length says.
    let text = unsafe { characters(text, n_text) };
    let mut pieces = text.split('%');
    let mut message = pieces.next().unwrap_or_default().to_owned();
    let (mut n_integers, mut n_reals, mut n_strings) = (0, 0, 0);
    for piece in pieces {
        let mut rest = piece.chars();
        match rest.next() {
            Some('I' | 'i') => {
                // SAFETY: the text asks for this entry.
                let _ = write!(message, "{}", unsafe { *integers.add(n_integers) });
                n_integers += 1;
            }
            Some('R' | 'r') => {
                // SAFETY: as above.
                let _ = write!(message, "{:e}", unsafe { *reals.add(n_reals) });
                n_reals += 1;
            }
            Some('S' | 's') => {
                // SAFETY: as above; entries have 8 characters.
                let entry = unsafe { characters(texts.add(n_strings * N_CHARV), N_CHARV) };
                message += entry.trim_end();
                n_strings += 1;
            }
            _ => rest = piece.chars(),
        }
        message += rest.as_str();
    }
    // SAFETY: a scalar argument.
    let lop = unsafe { *lop };
    let kind = match lop {
        1 => "note",
        -1 => "warning",
        _ => "error",
    };
    let message = message.trim_end();
    let _ = writeln!(std::io::stderr(), "{kind} of the routine: {message}");
    if lop == -3 {
        xit_();
    }
}

/// # Safety
/// `n` characters are there.
unsafe fn characters(p: *const c_char, n: usize) -> String {
    // SAFETY: passed on to the caller.
    let bytes = unsafe { std::slice::from_raw_parts(p.cast::<u8>(), n) };
    String::from_utf8_lossy(bytes).into_owned()
}

/// `CALL GETJOBNAME(JOBNAME, LENJOBNAME)`: `pilum`.
///
/// # Safety
/// A text of its hidden length, at most 256 characters of it are written.
#[unsafe(no_mangle)]
unsafe extern "C" fn getjobname_(name: *mut c_char, length: *mut c_int, n: usize) {
    // SAFETY: passed on to the caller.
    unsafe { put("pilum", name, length, n) }
}

/// The working directory of the program, where that of the routine is another.
static OUTDIR: OnceLock<PathBuf> = OnceLock::new();

/// `GETOUTDIR` keeps returning this folder; from now on the routine has a separate working
/// directory.
#[cfg(unix)]
pub(crate) fn out_dir_is(folder: PathBuf) {
    let _ = OUTDIR.set(folder);
}

/// `CALL GETOUTDIR(OUTDIR, LENOUTDIR)`: the working directory of the program.
///
/// # Safety
/// As [`getjobname_`].
#[unsafe(no_mangle)]
unsafe extern "C" fn getoutdir_(name: *mut c_char, length: *mut c_int, n: usize) {
    let own = || std::env::current_dir().unwrap_or_default();
    let folder = OUTDIR.get().cloned().unwrap_or_else(own);
    // SAFETY: passed on to the caller.
    unsafe { put(&folder.to_string_lossy(), name, length, n) }
}

/// # Safety
/// `n` characters may be written.
unsafe fn put(text: &str, name: *mut c_char, length: *mut c_int, n: usize) {
    let n = n.min(N_NAME);
    // SAFETY: passed on to the caller.
    let target = unsafe { std::slice::from_raw_parts_mut(name.cast::<u8>(), n) };
    target.fill(b' ');
    let bytes = &text.as_bytes()[..text.len().min(n)];
    target[..bytes.len()].copy_from_slice(bytes);
    // SAFETY: a scalar argument.
    unsafe { *length = bytes.len() as c_int }
}

/// The tensor at `s`; shear components are halved for strains.
///
/// # Safety
/// NDI + NSHR numbers are there, NDI and NSHR are at most 3.
unsafe fn tensor(s: *const f64, n_direct: usize, n_shear: usize, shear: f64) -> Matrix3<f64> {
    let mut matrix = Matrix3::zeros();
    for i in 0..n_direct.min(3) {
        // SAFETY: passed on to the caller.
        matrix[(i, i)] = unsafe { *s.add(i) };
    }
    for (k, (i, j)) in SHEAR.into_iter().take(n_shear).enumerate() {
        // SAFETY: passed on to the caller.
        let value = shear * unsafe { *s.add(n_direct + k) };
        matrix[(i, j)] = value;
        matrix[(j, i)] = value;
    }
    matrix
}

/// Half the shear components of strains.
fn shear_factor(lstr: c_int) -> f64 {
    if lstr == 2 { 0.5 } else { 1.0 }
}

/// `CALL SINV(STRESS, SINV1, SINV2, NDI, NSHR)`: tr σ/3 and √(3/2 s:s).
///
/// # Safety
/// Scalars, and a tensor of NDI + NSHR components.
#[unsafe(no_mangle)]
unsafe extern "C" fn sinv_(
    stress: *const f64,
    first: *mut f64,
    second: *mut f64,
    n_direct: *const c_int,
    n_shear: *const c_int,
) {
    // SAFETY: scalar arguments.
    let (n_direct, n_shear) = unsafe { (*n_direct as usize, *n_shear as usize) };
    // SAFETY: passed on to the caller.
    let stress = unsafe { tensor(stress, n_direct, n_shear, 1.0) };
    let mean = stress.trace() / 3.0;
    let deviator = stress - mean * Matrix3::identity();
    // SAFETY: scalar arguments.
    unsafe {
        *first = mean;
        *second = (1.5 * deviator.norm_squared()).sqrt();
    }
}

/// `CALL SPRINC(S, PS, LSTR, NDI, NSHR)`: principal values, in no order.
///
/// # Safety
/// As [`sinv_`], three values.
#[unsafe(no_mangle)]
unsafe extern "C" fn sprinc_(
    s: *const f64,
    values: *mut f64,
    lstr: *const c_int,
    n_direct: *const c_int,
    n_shear: *const c_int,
) {
    let mut directions = [0.0; 9];
    // SAFETY: passed on to the caller.
    unsafe { sprind_(s, values, directions.as_mut_ptr(), lstr, n_direct, n_shear) }
}

/// `CALL SPRIND(S, PS, AN, LSTR, NDI, NSHR)`: principal values, and in row K of AN the direction
/// cosines of value K.
///
/// # Safety
/// As [`sprinc_`], nine direction cosines.
#[unsafe(no_mangle)]
unsafe extern "C" fn sprind_(
    s: *const f64,
    values: *mut f64,
    directions: *mut f64,
    lstr: *const c_int,
    n_direct: *const c_int,
    n_shear: *const c_int,
) {
    // SAFETY: scalar arguments.
    let (lstr, n_direct, n_shear) = unsafe { (*lstr, *n_direct as usize, *n_shear as usize) };
    // SAFETY: passed on to the caller.
    let s = unsafe { tensor(s, n_direct, n_shear, shear_factor(lstr)) };
    let eigen = SymmetricEigen::new(s);
    for k in 0..3 {
        // SAFETY: three values.
        unsafe { *values.add(k) = eigen.eigenvalues[k] };
        for i in 0..3 {
            // SAFETY: a 3 × 3 matrix, column by column.
            unsafe { *directions.add(k + 3 * i) = eigen.eigenvectors[(i, k)] };
        }
    }
}

/// `CALL ROTSIG(S, R, SPRIME, LSTR, NDI, NSHR)`: R S Rᵀ.
///
/// # Safety
/// As [`sinv_`]; R is 3 × 3, SPRIME like S.
#[unsafe(no_mangle)]
unsafe extern "C" fn rotsig_(
    s: *const f64,
    r: *const f64,
    rotated: *mut f64,
    lstr: *const c_int,
    n_direct: *const c_int,
    n_shear: *const c_int,
) {
    // SAFETY: scalar arguments.
    let (lstr, n_direct, n_shear) = unsafe { (*lstr, *n_direct as usize, *n_shear as usize) };
    let factor = shear_factor(lstr);
    // SAFETY: passed on to the caller.
    let s = unsafe { tensor(s, n_direct, n_shear, factor) };
    // SAFETY: a 3 × 3 matrix, column by column.
    let r = Matrix3::from_column_slice(unsafe { std::slice::from_raw_parts(r, 9) });
    let result = r * s * r.transpose();
    for i in 0..n_direct.min(3) {
        // SAFETY: NDI + NSHR numbers.
        unsafe { *rotated.add(i) = result[(i, i)] };
    }
    for (k, (i, j)) in SHEAR.into_iter().take(n_shear).enumerate() {
        // SAFETY: as above.
        unsafe { *rotated.add(n_direct + k) = result[(i, j)] / factor };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn strains_rotate_with_half_their_shear() {
        let strain = [1.0, 2.0, 3.0, 0.8];
        let turn = [0.6, 0.8, 0.0, -0.8, 0.6, 0.0, 0.0, 0.0, 1.0];
        let mut rotated = [0.0; 4];
        // SAFETY: sizes as declared.
        unsafe {
            rotsig_(
                strain.as_ptr(),
                turn.as_ptr(),
                rotated.as_mut_ptr(),
                &2,
                &3,
                &1,
            );
        }
        // cos 0.6, sin 0.8: ε₁₁ c² + ε₂₂ s² − 2 ε₁₂ c s, and so on.
        assert_relative_eq!(rotated[0], 0.36 + 1.28 - 0.384, epsilon = 1e-14);
        assert_relative_eq!(rotated[1], 0.64 + 0.72 + 0.384, epsilon = 1e-14);
        assert_relative_eq!(
            rotated[3],
            2.0 * (-0.48 + 0.4 * (0.36 - 0.64)),
            epsilon = 1e-14
        );
    }

    #[test]
    fn rows_are_principal_directions() {
        let stress = [-100.0, -50.0, -20.0, 30.0, 0.0, 10.0];
        let (mut values, mut rows) = ([0.0; 3], [0.0; 9]);
        // SAFETY: sizes as declared.
        unsafe {
            sprind_(
                stress.as_ptr(),
                values.as_mut_ptr(),
                rows.as_mut_ptr(),
                &1,
                &3,
                &3,
            );
        }
        // SAFETY: as above.
        let s = unsafe { tensor(stress.as_ptr(), 3, 3, 1.0) };
        let rows = Matrix3::from_column_slice(&rows);
        let again = rows.transpose() * Matrix3::from_diagonal(&values.into()) * rows;
        assert!((again - s).norm() < 1e-11, "{again} {s}");
    }
}
