//! A law with its parameters fixed, and calls of it: every view of the host's slices is checked here.

use super::{HOST, LawHandle};
use crate::call::{Batch, Operator, Request, Strided};
use crate::description::FormulationDescription;
use crate::instance::{Answer, Instance, Source};
use abi::Hypothesis;
use abi::raw::{self, View, ViewMut};
use std::ffi::c_char;
use std::mem::size_of;
use std::ptr::{null, null_mut};

/// Size of the buffer for messages.
const MESSAGE_CAPACITY: usize = 512;

/// A law with its parameters fixed, owned by the host.
#[derive(Debug)]
pub(crate) struct OwnedInstance {
    pub(super) law: LawHandle,
    pub(super) instance: *mut raw::Instance,
    pub(super) n_components: usize,
    pub(super) n_states: usize,
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

impl Source for LawHandle {
    fn create(
        &self,
        hypothesis: Hypothesis,
        formulation: &FormulationDescription,
        parameters: &[f64],
    ) -> Result<Box<dyn Instance>, Answer> {
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
                formulation.index,
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
        Ok(Box::new(OwnedInstance {
            law: *self,
            instance,
            n_components: hypothesis.n_components(),
            n_states: formulation.internal_variables.len(),
        }))
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

pub(super) const NOTHING: View = View {
    p: null(),
    point: 0,
    component: 0,
};
const NOWHERE: ViewMut = ViewMut {
    p: null_mut(),
    point: 0,
    component: 0,
};

/// Panics unless `n_points` × `n_components` values lie inside a slice of length `length`:
/// the one check that keeps the pointers below inside their slices.
fn assert_fits(place: Strided, n_points: usize, n_components: usize, length: usize) {
    if n_points > 0 && n_components > 0 {
        assert!(
            place.at(n_points - 1, n_components - 1) < length,
            "a view of {n_points} points leaves its slice"
        );
    }
}

fn view((values, place): (&[f64], Strided), n_points: usize, n_components: usize) -> View {
    assert_fits(place, n_points, n_components, values.len());
    if n_components == 0 || n_points == 0 {
        return NOTHING;
    }
    View {
        p: values[place.offset..].as_ptr(),
        point: place.point as isize,
        component: place.component as isize,
    }
}

fn view_mut(
    (values, place): (&mut [f64], Strided),
    n_points: usize,
    n_components: usize,
) -> ViewMut {
    assert_fits(place, n_points, n_components, values.len());
    if n_components == 0 || n_points == 0 {
        return NOWHERE;
    }
    ViewMut {
        p: values[place.offset..].as_mut_ptr(),
        point: place.point as isize,
        component: place.component as isize,
    }
}

impl Instance for OwnedInstance {
    fn call(&self, request: Request, (start, end, outcomes): Batch<'_, '_>) -> Option<Answer> {
        let known = &self.law.known;
        let (function, operator) = match request {
            Request::InitialState => (known.init_state?, None),
            Request::Update(operator) => (known.integrate?, Some(operator)),
        };
        let (n, c, n_states) = (start.n_points, self.n_components, self.n_states);
        assert!(outcomes.status.len() >= n && outcomes.factor.len() >= n);
        let of_update = |values| operator.map_or(NOTHING, |_| view(values, n, c));
        let states = Strided::rows(n_states);
        let n_entries = operator.map_or(0, |operator| operator.n_entries(c));
        let mut message = [0 as c_char; MESSAGE_CAPACITY];
        let batch = raw::Batch {
            struct_size: size_of::<raw::Batch>() as u32,
            request: operator.map_or(0, Operator::request),
            n_points: n as u64,
            // Always: messages count the points of the batch. Whoever knows the elements puts the
            // place in front, from the number of the point that failed.
            first_point: 0,
            time: start.time,
            time_increment: start.time_increment,
            gradient0: of_update(start.gradient),
            gradient1: of_update(start.gradient_end),
            flux0: view(start.flux, n, c),
            state0: match start.state {
                [] => NOTHING,
                all => view((all, states), n, n_states),
            },
            flux1: match operator {
                Some(_) => view_mut((&mut *end.flux.0, end.flux.1), n, c),
                None => NOWHERE,
            },
            state1: view_mut((&mut *end.state, states), n, n_states),
            tangent: if n_entries > 0 {
                view_mut((&mut *end.operator, Strided::rows(n_entries)), n, n_entries)
            } else {
                NOWHERE
            },
            status: outcomes.status.as_mut_ptr(),
            step_factor: outcomes.factor.as_mut_ptr(),
            message: message.as_mut_ptr(),
            message_capacity: message.len(),
            step_time: start.time - start.moment.step_start,
            rates: null(),
        };
        // SAFETY: contract, "Batch": every view was checked against its slice above, and the
        // slices stay borrowed until the call has returned.
        let status = unsafe { function(self.instance, &raw const batch) };
        Some((status, read_message(&message)))
    }
}
