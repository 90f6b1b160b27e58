//! Arrays of a call, whose neighbourhood, layout and protection are chosen.

use super::super::NOTHING;
use super::pages::Pages;
use super::{
    Answer, EndRates, Fence, Form, Function, NO_OUTCOME, Order, PointEnd, PointRates, PointStart,
    Probe, UNWRITTEN,
};
use abi::raw::{self, Batch, Rates, Status, View, ViewMut};
use std::io;
use std::ptr::{null, null_mut};

/// Values of many points in their own pages.
#[derive(Debug)]
pub(super) struct Array {
    pub(super) pages: Pages,
    n_points: usize,
    n_components: usize,
    point: usize,
    component: usize,
}

impl Array {
    pub(super) fn new(
        order: Order,
        is_input: bool,
        n_points: usize,
        n_components: usize,
        fence: Fence,
    ) -> io::Result<Self> {
        let (point, component) = match order {
            Order::Uniform if is_input => (0, 1),
            Order::Points | Order::Uniform => (n_components, 1),
            Order::Components => (1, n_points),
            Order::Spread => (3 * n_components + 5, 3),
        };
        let cells = if n_points == 0 || n_components == 0 {
            0
        } else {
            (n_points - 1) * point + (n_components - 1) * component + 1
        };
        let mut pages = Pages::new(cells * size_of::<f64>(), fence)?;
        doubles_mut(&mut pages).fill(UNWRITTEN);
        Ok(Self {
            pages,
            n_points,
            n_components,
            point,
            component,
        })
    }

    pub(super) fn put(&mut self, i: usize, values: &[f64]) {
        assert!(i < self.n_points && values.len() == self.n_components);
        for (c, &value) in values.iter().enumerate() {
            doubles_mut(&mut self.pages)[i * self.point + c * self.component] = value;
        }
    }

    pub(super) fn row(&self, i: usize) -> Vec<f64> {
        (0..self.n_components)
            .map(|c| doubles(&self.pages)[i * self.point + c * self.component])
            .collect()
    }

    /// Whether anything but the cells was written.
    pub(super) fn stray(&self) -> bool {
        let mut is_cell = vec![false; doubles(&self.pages).len()];
        for i in 0..self.n_points {
            for c in 0..self.n_components {
                is_cell[i * self.point + c * self.component] = true;
            }
        }
        doubles(&self.pages)
            .iter()
            .zip(is_cell)
            .any(|(value, is_cell)| !is_cell && value.to_bits() != UNWRITTEN.to_bits())
    }

    pub(super) fn view(&self) -> View {
        if self.n_points == 0 || self.n_components == 0 {
            return NOTHING;
        }
        View {
            p: self.pages.pointer().cast(),
            point: self.point as isize,
            component: self.component as isize,
        }
    }

    pub(super) fn view_mut(&self) -> ViewMut {
        let view = self.view();
        ViewMut {
            p: view.p.cast_mut(),
            point: view.point,
            component: view.component,
        }
    }
}

fn doubles(pages: &Pages) -> &[f64] {
    // SAFETY: every bit pattern is a double; the bytes are aligned for one, since arrays of
    // doubles are a multiple of eight bytes long and end or start at the end of a page.
    let (before, values, _) = unsafe { pages.bytes().align_to() };
    assert!(before.is_empty());
    values
}

fn doubles_mut(pages: &mut Pages) -> &mut [f64] {
    // SAFETY: as above.
    let (before, values, _) = unsafe { pages.bytes_mut().align_to_mut() };
    assert!(before.is_empty());
    values
}

/// An input of all points.
pub(super) fn inputs(
    (order, fence): (Order, Fence),
    n_components: usize,
    starts: &[PointStart],
    values: fn(&PointStart) -> &[f64],
) -> io::Result<Array> {
    let mut array = Array::new(order, true, starts.len(), n_components, fence)?;
    for (i, start) in starts.iter().enumerate() {
        array.put(i, values(start));
    }
    Ok(array)
}

/// A message buffer as the host hands it over: its first byte is NUL, the rest is not.
pub(super) fn message_buffer(capacity: Option<usize>) -> io::Result<Option<Pages>> {
    let Some(capacity) = capacity else {
        return Ok(None);
    };
    let mut pages = Pages::new(capacity, Fence::After)?;
    pages.bytes_mut().fill(b'#');
    if let Some(first) = pages.bytes_mut().first_mut() {
        *first = 0;
    }
    Ok(Some(pages))
}

/// Values of one point that can only be read.
pub(super) fn locked(values: &[f64]) -> io::Result<Array> {
    let mut array = Array::new(Order::Points, true, 1, values.len(), Fence::After)?;
    array.put(0, values);
    array.pages.lock()?;
    Ok(array)
}

/// The arrays of one call.
pub(super) struct Arrays {
    n_points: usize,
    gradient0: Array,
    gradient1: Array,
    flux0: Array,
    state0: Array,
    flux1: Array,
    state1: Array,
    tangent: Array,
    step_factor: Array,
    status: Pages,
    message: Option<Pages>,
}

impl Arrays {
    pub(super) fn new(
        probe: &Probe,
        function: Function,
        starts: &[PointStart],
        form: &Form,
    ) -> io::Result<Self> {
        let n = starts.len();
        let (n_gradient, n_state0) = match function {
            Function::Integrate => (probe.n_components, probe.n_states),
            _ => (0, 0),
        };
        let has_operator = form.request & (raw::PILUM_REQ_TANGENT | raw::PILUM_REQ_ELASTIC) != 0;
        let n_tangent = usize::from(has_operator) * n_gradient * n_gradient;
        let input = |n_components, values| {
            let place = (form.order, form.around_inputs);
            let mut array = inputs(place, n_components, starts, values)?;
            if form.inputs_locked {
                array.pages.lock()?;
            }
            io::Result::Ok(array)
        };
        let output =
            |n_components| Array::new(form.order, false, n, n_components, form.around_outputs);
        let mut status = Pages::new(n * size_of::<Status>(), form.around_outputs)?;
        for four in status.bytes_mut().chunks_exact_mut(size_of::<Status>()) {
            four.copy_from_slice(&NO_OUTCOME.to_ne_bytes());
        }
        Ok(Self {
            n_points: n,
            gradient0: input(n_gradient, |start| &start.gradient0)?,
            gradient1: input(n_gradient, |start| &start.gradient1)?,
            flux0: input(probe.n_components, |start| &start.flux0)?,
            state0: input(n_state0, |start| &start.state0)?,
            flux1: output(n_gradient)?,
            state1: output(probe.n_states)?,
            tangent: output(n_tangent)?,
            step_factor: Array::new(Order::Points, false, n, 1, form.around_outputs)?,
            status,
            message: message_buffer(form.message)?,
        })
    }

    /// The batch, without rates.
    pub(super) fn batch(&self, form: &Form) -> Batch {
        let (mut status, mut step_factor) = (null_mut(), null_mut());
        if form.outcomes {
            status = self.status.pointer().cast();
            step_factor = self.step_factor.pages.pointer().cast();
        }
        let message = self.message.as_ref();
        Batch {
            struct_size: form.batch_bytes as u32,
            request: form.request,
            n_points: self.n_points as u64,
            first_point: form.first_point,
            time: form.time,
            time_increment: form.time_increment,
            gradient0: self.gradient0.view(),
            gradient1: self.gradient1.view(),
            flux0: self.flux0.view(),
            state0: self.state0.view(),
            flux1: self.flux1.view_mut(),
            state1: self.state1.view_mut(),
            tangent: self.tangent.view_mut(),
            status,
            step_factor,
            message: message.map_or(null_mut(), |m| m.pointer().cast()),
            message_capacity: form.message.unwrap_or(0),
            step_time: form.time,
            rates: null(),
        }
    }

    /// The output of the law.
    pub(super) fn answer(self, returned: Status) -> Answer {
        let statuses = self.status.bytes().as_chunks().0.iter();
        let points = statuses
            .enumerate()
            .map(|(i, status)| PointEnd {
                status: Status::from_ne_bytes(*status),
                step_factor: self.step_factor.row(i)[0],
                flux: self.flux1.row(i),
                state: self.state1.row(i),
                tangent: self.tangent.row(i),
            })
            .collect();
        let message = self.message.as_ref();
        let outputs = [&self.flux1, &self.state1, &self.tangent];
        Answer {
            status: returned,
            message: message.map_or(Vec::new(), |pages| pages.bytes().to_vec()),
            points,
            stray: outputs.into_iter().any(Array::stray),
        }
    }
}

/// The arrays of rates of one call.
pub(super) struct Directions {
    parameter: Array,
    gradient0: Array,
    gradient1: Array,
    flux0: Array,
    state0: Array,
    flux1: Array,
    state1: Array,
}

impl Directions {
    pub(super) fn new(probe: &Probe, rates: &[PointRates], parameter: &[f64]) -> io::Result<Self> {
        let n = rates.len();
        let place = (Order::Points, Fence::Far);
        let input = |n_components, values| inputs(place, n_components, rates, values);
        let output = |n_components| Array::new(Order::Points, false, n, n_components, Fence::Far);
        let mut of_parameters = Array::new(Order::Points, true, 1, parameter.len(), Fence::After)?;
        of_parameters.put(0, parameter);
        Ok(Self {
            parameter: of_parameters,
            gradient0: input(probe.n_components, |one: &PointRates| &one.gradient0)?,
            gradient1: input(probe.n_components, |one: &PointRates| &one.gradient1)?,
            flux0: input(probe.n_components, |one: &PointRates| &one.flux0)?,
            state0: input(probe.n_states, |one: &PointRates| &one.state0)?,
            flux1: output(probe.n_components)?,
            state1: output(probe.n_states)?,
        })
    }

    /// The output of the law.
    pub(super) fn rows(&self) -> Vec<EndRates> {
        let n = self.flux1.n_points;
        let row = |i| (self.flux1.row(i), self.state1.row(i));
        (0..n).map(row).collect()
    }

    pub(super) fn raw(&self) -> Rates {
        Rates {
            struct_size: size_of::<Rates>() as u32,
            reserved: 0,
            parameter: self.parameter.view().p,
            gradient0: self.gradient0.view(),
            gradient1: self.gradient1.view(),
            flux0: self.flux0.view(),
            state0: self.state0.view(),
            flux1: self.flux1.view_mut(),
            state1: self.state1.view_mut(),
        }
    }
}

/// The first bytes of a batch in read-only pages that end where it says; bytes beyond it are 0xa5.
pub(super) fn in_pages(batch: &Batch, bytes: usize) -> io::Result<Pages> {
    let mut pages = Pages::new(bytes, Fence::After)?;
    pages.bytes_mut().fill(0xa5);
    // SAFETY: a batch consists of numbers and pointers without padding.
    let known = unsafe {
        std::slice::from_raw_parts(std::ptr::from_ref(batch).cast::<u8>(), size_of::<Batch>())
    };
    let n = bytes.min(known.len());
    pages.bytes_mut()[..n].copy_from_slice(&known[..n]);
    pages.lock()?;
    Ok(pages)
}
