//! A caller's memory, read and written in safe terms: the points of a [`Batch`], its buffer for a
//! message, and the checks that stand before any of it is used. [`export`](crate::export) is built on
//! this, and so are crates that offer a law by another program's interface.
#![expect(
    unsafe_code,
    clippy::multiple_unsafe_ops_per_block,
    reason = "the plugin's side of the C boundary; offset and access are one operation"
)]

use crate::descriptor::{InternalVariables, Parameter};
use crate::law::{Failure, Tangent};
use crate::raw::{self, Batch, Rates, Status, View, ViewMut};
use crate::version::{BATCH_SIZE_1_0, RATES_SIZE_1_0};
use std::any::Any;
use std::ffi::{CStr, c_char};
use std::fmt::{self, Write};
use std::mem::MaybeUninit;

/// A checked batch, read and written point by point. `PACKED`: all component strides are 1, which
/// the compiler turns into moves of whole rows.
#[derive(Debug)]
pub struct Access<'a, const PACKED: bool> {
    /// The batch.
    pub(crate) batch: &'a Batch,
    /// Number of components of gradient and flux.
    pub(crate) n_components: usize,
    /// The operator that the host asks for.
    pub(crate) tangent: Tangent,
}

/// A point at the start of its increment.
pub(crate) struct PointStart<const N: usize, S> {
    pub(crate) gradient: [f64; N],
    pub(crate) gradient_increment: [f64; N],
    pub(crate) flux: [f64; N],
    pub(crate) state: S,
}

impl<'a, const PACKED: bool> Access<'a, PACKED> {
    /// A batch that has been checked, of points with this many components.
    pub(crate) fn new(batch: &'a Batch, n_components: usize) -> Self {
        Self {
            batch,
            n_components,
            tangent: requested(batch),
        }
    }

    /// The components of point `i`.
    #[inline]
    fn row<const N: usize>(view: &View, i: usize) -> [f64; N] {
        // SAFETY: contract of `View`: point `i` and all components are within the declared counts.
        unsafe {
            let first = view.p.offset(i as isize * view.point);
            if PACKED {
                first.cast::<[f64; N]>().read()
            } else {
                std::array::from_fn(|c| *first.offset(c as isize * view.component))
            }
        }
    }

    /// Writes the components of point `i`.
    #[inline]
    fn put_row(view: &ViewMut, i: usize, row: &[f64]) {
        let stride = if PACKED { 1 } else { view.component };
        for (c, &value) in row.iter().enumerate() {
            // SAFETY: contract of `ViewMut`: within the declared counts, overlapping nothing.
            unsafe { *view.p.offset(i as isize * view.point + c as isize * stride) = value };
        }
    }

    /// Internal variable `v` of point `i`.
    #[inline]
    fn state_value<S: InternalVariables>(&self, i: usize, v: usize) -> f64 {
        assert_declared::<S>(v);
        let view = &self.batch.state0;
        let stride = if PACKED { 1 } else { view.component };
        // SAFETY: as in `row`; `v` is declared.
        unsafe { *view.p.offset(i as isize * view.point + v as isize * stride) }
    }

    #[inline]
    pub(crate) fn flux0<const N: usize>(&self, i: usize) -> Result<[f64; N], Failure> {
        let flux = Self::row(&self.batch.flux0, i);
        if defect(&flux) == 0.0 {
            Ok(flux)
        } else {
            Err(INPUT_NOT_FINITE)
        }
    }

    /// What a law needs of point `i`, all of it finite.
    #[inline]
    pub(crate) fn start<const N: usize, S: InternalVariables>(
        &self,
        i: usize,
    ) -> Result<PointStart<N, S>, Failure> {
        let gradient: [f64; N] = Self::row(&self.batch.gradient0, i);
        let end: [f64; N] = Self::row(&self.batch.gradient1, i);
        let flux: [f64; N] = Self::row(&self.batch.flux0, i);
        let state = (0..S::TABLE.len()).map(|v| 0.0 * self.state_value::<S>(i, v));
        if defect(&gradient) + defect(&end) + defect(&flux) + state.sum::<f64>() != 0.0 {
            return Err(INPUT_NOT_FINITE);
        }
        Ok(PointStart {
            gradient,
            gradient_increment: std::array::from_fn(|c| end[c] - gradient[c]),
            flux,
            state: S::read(|v| self.state_value::<S>(i, v)),
        })
    }

    #[inline]
    pub(crate) fn put_state<S: InternalVariables>(&self, i: usize, state: &S) {
        put_values(&self.batch.state1, i, PACKED, state);
    }

    #[inline]
    pub(crate) fn put<const N: usize, S: InternalVariables>(
        &self,
        i: usize,
        flux: &[f64; N],
        state: &S,
        tangent: Option<&[[f64; N]; N]>,
    ) -> Result<(), Failure> {
        let mut defects = defect(flux);
        state.write(|_, value| defects += 0.0 * value);
        if let Some(tangent) = tangent {
            defects += defect(tangent.as_flattened());
        }
        if defects != 0.0 {
            return Err(Failure::Numeric("a result is not finite"));
        }
        Self::put_row(&self.batch.flux1, i, flux);
        self.put_state(i, state);
        if let Some(tangent) = tangent {
            Self::put_row(&self.batch.tangent, i, tangent.as_flattened());
        }
        Ok(())
    }

    #[inline]
    pub(crate) fn put_status(&self, i: usize, status: Status) {
        if !self.batch.status.is_null() {
            // SAFETY: contract of `Batch::status`: `n_points` entries.
            unsafe { self.batch.status.add(i).write(status) };
        }
    }

    pub(crate) fn put_step_factor(&self, i: usize, failure: Option<Failure>) {
        if let Some(Failure::CutStep { factor, .. }) = failure
            && !self.batch.step_factor.is_null()
        {
            let factor = if factor > 0.0 && factor < 1.0 {
                factor
            } else {
                f64::NAN
            };
            // SAFETY: contract of `Batch::step_factor`: `n_points` entries.
            unsafe { self.batch.step_factor.add(i).write(factor) };
        }
    }
}

/// The rates of a checked batch.
#[derive(Debug)]
pub struct Directions<'a> {
    rates: &'a Rates,
    parameter: Option<&'a [f64]>,
}

impl<'a> Directions<'a> {
    /// Rates that have been checked, of a law with this many parameters.
    ///
    /// # Safety
    /// `parameter` is null or holds that many values as long as the rates live.
    pub(crate) unsafe fn new(rates: &'a Rates, n_parameters: usize) -> Self {
        let parameter = (!rates.parameter.is_null() && n_parameters > 0).then(|| {
            // SAFETY: passed on to the caller.
            unsafe { std::slice::from_raw_parts(rates.parameter, n_parameters) }
        });
        Self { rates, parameter }
    }

    /// Rates of the parameters; none: all zero.
    pub(crate) fn parameter(&self) -> Option<&'a [f64]> {
        self.parameter
    }

    fn row<const N: usize>(view: &View, i: usize) -> Result<[f64; N], Failure> {
        let row = Access::<false>::row(view, i);
        if defect(&row) == 0.0 {
            Ok(row)
        } else {
            Err(INPUT_NOT_FINITE)
        }
    }

    pub(crate) fn gradient0<const N: usize>(&self, i: usize) -> Result<[f64; N], Failure> {
        Self::row(&self.rates.gradient0, i)
    }

    pub(crate) fn gradient1<const N: usize>(&self, i: usize) -> Result<[f64; N], Failure> {
        Self::row(&self.rates.gradient1, i)
    }

    pub(crate) fn flux0<const N: usize>(&self, i: usize) -> Result<[f64; N], Failure> {
        Self::row(&self.rates.flux0, i)
    }

    pub(crate) fn state0<S: InternalVariables>(&self, i: usize) -> Result<S, Failure> {
        let view = &self.rates.state0;
        let value = |v: usize| {
            assert_declared::<S>(v);
            // SAFETY: contract of `View`; `v` is declared.
            unsafe {
                *view
                    .p
                    .offset(i as isize * view.point + v as isize * view.component)
            }
        };
        if (0..S::TABLE.len()).map(|v| 0.0 * value(v)).sum::<f64>() != 0.0 {
            return Err(INPUT_NOT_FINITE);
        }
        Ok(S::read(value))
    }

    pub(crate) fn put<const N: usize, S: InternalVariables>(
        &self,
        i: usize,
        flux: Option<&[f64; N]>,
        state: &S,
    ) -> Result<(), Failure> {
        let mut defects = flux.map_or(0.0, |flux| defect(flux));
        state.write(|_, value| defects += 0.0 * value);
        if defects != 0.0 {
            return Err(Failure::Numeric("a rate is not finite"));
        }
        if let Some(flux) = flux {
            Access::<false>::put_row(&self.rates.flux1, i, flux);
        }
        put_values(&self.rates.state1, i, false, state);
        Ok(())
    }
}

/// Writes the internal variables of point `i`.
#[inline]
fn put_values<S: InternalVariables>(view: &ViewMut, i: usize, is_packed: bool, state: &S) {
    let stride = if is_packed { 1 } else { view.component };
    state.write(|v, value| {
        assert_declared::<S>(v);
        // SAFETY: as in `put_row`; `v` is declared.
        unsafe { *view.p.offset(i as isize * view.point + v as isize * stride) = value };
    });
}

/// Whether the components of each point stand one after the other, in all views that are there.
pub(crate) fn is_packed(batch: &Batch) -> bool {
    let read = [
        &batch.gradient0,
        &batch.gradient1,
        &batch.flux0,
        &batch.state0,
    ];
    let written = [&batch.flux1, &batch.state1, &batch.tangent];
    read.iter().all(|v| v.p.is_null() || v.component == 1)
        && written.iter().all(|v| v.p.is_null() || v.component == 1)
}

/// Which operator the host asks for.
pub(crate) fn requested(batch: &Batch) -> Tangent {
    if batch.request & raw::PILUM_REQ_ELASTIC != 0 {
        Tangent::Elastic
    } else if batch.request & raw::PILUM_REQ_TANGENT != 0 {
        Tangent::Consistent
    } else {
        Tangent::None
    }
}

/// The batch as far as its writer knew it. `None`: null, or shorter than version 1.0.
///
/// # Safety
/// `batch` is null or as [`Batch`] promises, for as many bytes as its `struct_size` says.
pub(crate) unsafe fn known(batch: *const Batch) -> Option<Batch> {
    // SAFETY: passed on to the caller; all-zero is a valid `Batch`.
    unsafe { known_part(batch, BATCH_SIZE_1_0) }
}

/// The rates as far as their writer knew them. `None`: null, or shorter than version 1.0.
///
/// # Safety
/// `rates` is null or as [`Rates`] promises, for as many bytes as its `struct_size` says.
pub(crate) unsafe fn known_rates(rates: *const Rates) -> Option<Rates> {
    // SAFETY: passed on to the caller; all-zero is a valid `Rates`.
    unsafe { known_part(rates, RATES_SIZE_1_0) }
}

/// A struct as far as its writer knew it: the rule of growing structs in one place. `struct_size`
/// is read before anything else, and no reference to the caller's struct is made, since one would
/// promise all of today's fields. A field that the writer did not know reads as zero. `None`: null,
/// or shorter than `least`.
///
/// # Safety
/// `p` is null or valid for as many bytes as the size that it starts with; all-zero is a valid `T`.
unsafe fn known_part<T>(p: *const T, least: usize) -> Option<T> {
    if p.is_null() {
        return None;
    }
    // SAFETY: contract, "Growing structs": every struct starts with its size as `u32`.
    let size = unsafe { p.cast::<u32>().read() } as usize;
    if size < least {
        return None;
    }
    let mut copy = MaybeUninit::<T>::zeroed();
    // SAFETY: both sides hold that many bytes; all-zero is a valid `T`.
    unsafe {
        p.cast::<u8>()
            .copy_to_nonoverlapping(copy.as_mut_ptr().cast(), size.min(size_of::<T>()));
        Some(copy.assume_init())
    }
}

/// The caller's message buffer.
#[derive(Debug)]
pub struct Message {
    p: *mut c_char,
    capacity: usize,
    length: usize,
}

impl Message {
    /// An empty message, so that the buffer ends in NUL whatever happens.
    ///
    /// # Safety
    /// `p` is null or valid for `capacity` bytes as long as the message lives.
    pub unsafe fn new(p: *mut c_char, capacity: usize) -> Self {
        let mut message = Self {
            p,
            capacity,
            length: 0,
        };
        message.write(format_args!(""));
        message
    }

    /// Replaces the message.
    pub fn write(&mut self, text: fmt::Arguments<'_>) {
        if !self.p.is_null() && self.capacity > 0 {
            self.length = 0;
            // A message that does not fit is cut short.
            let _ = Rest(self).write_fmt(text);
            // SAFETY: `length < capacity` bytes of the caller's buffer are in use.
            unsafe { self.p.add(self.length).write(0) };
        }
    }
}

/// The rest of a buffer with room for one byte at least.
struct Rest<'a>(&'a mut Message);

impl Write for Rest<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let Message {
            p,
            capacity,
            ref mut length,
        } = *self.0;
        let mut fits = text.len().min(capacity - 1 - *length);
        while !text.is_char_boundary(fits) {
            fits -= 1;
        }
        for &byte in &text.as_bytes()[..fits] {
            // SAFETY: `length + 1 < capacity` holds before each byte.
            unsafe { p.add(*length).write(byte as c_char) };
            *length += 1;
        }
        if fits < text.len() {
            return Err(fmt::Error);
        }
        Ok(())
    }
}

/// The first parameter outside its declared bounds. The host checks them too and says it better;
/// this keeps the law sound under any host.
///
/// # Errors
/// Its id and its value.
pub fn within_bounds(table: &[Parameter], values: &[f64]) -> Result<(), (&'static str, f64)> {
    for (parameter, &value) in table.iter().zip(values) {
        let declared = parameter.raw();
        let left_out = value.is_nan() && declared.flags & raw::PILUM_P_OPTIONAL != 0;
        let below = if declared.flags & raw::PILUM_P_OPEN_LOWER != 0 {
            value <= declared.lower
        } else {
            value < declared.lower
        };
        let above = if declared.flags & raw::PILUM_P_OPEN_UPPER != 0 {
            value >= declared.upper
        } else {
            value > declared.upper
        };
        let between_labels = !declared.choices.is_null() && value.fract() != 0.0;
        if !left_out && (!value.is_finite() || below || above || between_labels) {
            return Err((id(parameter), value));
        }
    }
    Ok(())
}

/// The id of a parameter.
pub fn id(parameter: &Parameter) -> &'static str {
    // SAFETY: a `Parameter` can only be made from static strings.
    let id = unsafe { CStr::from_ptr(parameter.raw().id) };
    id.to_str().unwrap_or("parameter")
}

/// What a caught panic says.
pub fn panic_text(payload: &(dyn Any + Send)) -> &str {
    payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
}

/// The failure of a point whose inputs have a [`defect`].
pub const INPUT_NOT_FINITE: Failure = Failure::Numeric("an input is not finite");

/// 0 if all values are finite, else NaN: 0 times a finite number is 0. Two sums at a time and no
/// branch, so that it costs a fraction of reading the values one by one.
#[inline]
pub fn defect(values: &[f64]) -> f64 {
    let (pairs, rest) = values.as_chunks::<2>();
    let mut sums = [0.0; 2];
    for pair in pairs {
        sums[0] += 0.0 * pair[0];
        sums[1] += 0.0 * pair[1];
    }
    rest.iter().fold(sums[0] + sums[1], |sum, v| sum + 0.0 * v)
}

/// Keeps the views of internal variables within their bounds, for hand-written
/// [`InternalVariables`] too. The caller sizes them by the same table, and the numbers that
/// [`internal_variables!`](crate::internal_variables) uses are constants, so for those nothing is
/// left of it.
///
/// # Panics
/// The law declares no internal variable of this number.
#[inline]
pub fn assert_declared<S: InternalVariables>(v: usize) {
    assert!(v < S::TABLE.len(), "internal variable {v} is not declared");
}
