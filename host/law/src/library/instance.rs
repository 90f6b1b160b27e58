//! A law with its parameters fixed, and calls of it: every view of the host's slices is checked here.

use super::{HOST, LawHandle};
use crate::{Moment, Site};
use abi::raw::{self, Batch, Instance, Status, View, ViewMut};
use std::ffi::c_char;
use std::mem::size_of;
use std::ptr::{null, null_mut};

/// Size of the buffer for messages.
const MESSAGE_CAPACITY: usize = 512;

/// A law with its parameters fixed, owned by the host.
#[derive(Debug)]
pub(crate) struct OwnedInstance {
    pub(super) law: LawHandle,
    pub(super) instance: *mut Instance,
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

/// Values of many points in a slice: component `c` of point `i` is at
/// `offset + i * point + c * component`.
#[derive(Clone, Copy, Debug)]
pub struct Strided {
    /// Position of the first value.
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

    pub(super) fn view(self, values: &[f64], n_points: usize, n_components: usize) -> View {
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

    pub(super) fn view_mut(
        self,
        values: &mut [f64],
        n_points: usize,
        n_components: usize,
    ) -> ViewMut {
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

pub(super) const NOTHING: View = View {
    p: null(),
    point: 0,
    component: 0,
};
pub(super) const NOWHERE: ViewMut = ViewMut {
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
