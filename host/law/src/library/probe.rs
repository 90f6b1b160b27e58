//! Calls of a law as `pilum check` makes them: through arrays whose neighbourhood, layout and
//! protection are chosen, and with arguments that a host in earnest never gives. All that a caller
//! hands over and gets back is safe.

pub mod call_log;
mod pages;
pub mod process;

use super::{Call, HOST, LawHandle, NOTHING, NOWHERE, OwnedInstance, Strided, load};
use crate::adapter::{ForeignInstance, ForeignLaw};
use crate::{Moment, Site};
use abi::Hypothesis;
use abi::raw::{self, Batch, Host, Instance, MagicBlock, Rates, Status, View, ViewMut};
use abi::status::most_severe;
use abi::version;
use call_log::{Function, KeptCall, KeptPhase, Phase};
pub use pages::Fence;
use pages::Pages;
use serde::{Deserialize, Serialize};
use std::ffi::c_char;
use std::io;
use std::mem::size_of;
use std::path::Path;
use std::ptr::{null, null_mut};

/// Content of cells before a law has written them: a NaN that no computation produces.
const UNWRITTEN: f64 = f64::from_bits(0x7ff8_dead_beef_a5a5);
/// The outcome of a point before the law has written one: no version of the contract has it.
pub const NO_OUTCOME: Status = -0x5a5a;
/// Size of this host's batch, in bytes.
pub const BATCH_BYTES: usize = size_of::<Batch>();

/// How the values of several points are in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// Point by point.
    Points,
    /// Component by component.
    Components,
    /// With gaps between components and between points.
    Spread,
    /// Inputs only once, for all points; outputs point by point.
    Uniform,
}

impl Order {
    /// How, for messages.
    pub fn words(self) -> &'static str {
        match self {
            Self::Points => "which stands point by point",
            Self::Components => "which stands component by component",
            Self::Spread => "which stands with gaps",
            Self::Uniform => "whose inputs stand once for all points",
        }
    }
}

/// A point at the start of an increment, and its gradient at the end.
#[derive(Clone, Debug, PartialEq)]
pub struct PointStart {
    /// Gradient at the start.
    pub gradient0: Vec<f64>,
    /// Gradient at the end.
    pub gradient1: Vec<f64>,
    /// Flux at the start.
    pub flux0: Vec<f64>,
    /// Internal variables at the start.
    pub state0: Vec<f64>,
}

/// Results of a law for a point.
#[derive(Clone, Debug)]
pub struct PointEnd {
    /// Outcome; [`NO_OUTCOME`] where none was written or none could be.
    pub status: Status,
    /// Step factor.
    pub step_factor: f64,
    /// Flux.
    pub flux: Vec<f64>,
    /// Internal variables.
    pub state: Vec<f64>,
    /// Operator, row by row; empty if none was requested.
    pub tangent: Vec<f64>,
}

/// All that one call has left behind.
#[derive(Clone, Debug)]
pub struct Answer {
    /// What the call returned.
    pub status: Status,
    /// The whole message buffer.
    pub message: Vec<u8>,
    /// The points.
    pub points: Vec<PointEnd>,
    /// Something was written between the cells of an output.
    pub stray: bool,
}

impl Answer {
    /// The message up to its NUL; `None` without a NUL.
    pub fn text(&self) -> Option<String> {
        terminated(&self.message)
    }
}

fn terminated(buffer: &[u8]) -> Option<String> {
    let end = buffer.iter().position(|&byte| byte == 0)?;
    Some(String::from_utf8_lossy(&buffer[..end]).into_owned())
}

/// The form of a call.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Form {
    /// Requests.
    pub request: u32,
    /// Layout of all arrays.
    pub order: Order,
    /// What lies next to inputs.
    pub around_inputs: Fence,
    /// What lies next to outputs.
    pub around_outputs: Fence,
    /// Writing to an input ends the process.
    pub inputs_locked: bool,
    /// Hand over `status` and `step_factor`.
    pub outcomes: bool,
    /// Size of the message buffer; none: null.
    pub message: Option<usize>,
    /// Size of the batch struct, in bytes.
    pub batch_bytes: usize,
    /// Number of the first point.
    pub first_point: u64,
    /// Time at which the increment begins, in all and in its step.
    pub time: f64,
    /// Length of the increment in time.
    pub time_increment: f64,
    /// Numbers of step and increment for a routine; by default those of [`Form::when`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moment: Option<Moment>,
    /// Coordinates of the points for a routine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub site: Option<Site>,
    /// Ask for the consistent tangent even of a law that declares none; else its elastic operator
    /// is in, as in a run.
    pub verbatim: bool,
}

/// Rates of what a point's update starts from.
#[derive(Clone, Debug)]
pub struct PointRates {
    /// The gradient at the start.
    pub gradient0: Vec<f64>,
    /// The gradient at the end.
    pub gradient1: Vec<f64>,
    /// The flux at the start.
    pub flux0: Vec<f64>,
    /// The internal variables at the start.
    pub state0: Vec<f64>,
}

/// Rates that a law has written for a point: of its flux, and of its internal variables.
pub type EndRates = (Vec<f64>, Vec<f64>);

impl Form {
    /// An ordinary call with these requests, whose arrays have room to spare around them.
    pub fn of(request: u32) -> Self {
        Self {
            request,
            order: Order::Points,
            around_inputs: Fence::Far,
            around_outputs: Fence::Far,
            inputs_locked: false,
            outcomes: true,
            message: Some(512),
            batch_bytes: BATCH_BYTES,
            first_point: 0,
            time: 0.0,
            time_increment: 1.0,
            moment: None,
            site: None,
            verbatim: false,
        }
    }

    /// At what time an increment begins, and which one it is: as in a run the first one of all for a point whose
    /// gradient is zero, else one like the second.
    pub fn when(&self, start: &PointStart) -> (f64, Moment) {
        if let Some(moment) = self.moment {
            return (self.time, moment);
        }
        if start.gradient0.iter().all(|value| *value == 0.0) {
            return (self.time, Moment::default());
        }
        let second = Moment {
            increment: 2,
            ..Moment::default()
        };
        (self.time + self.time_increment, second)
    }
}

/// Values of many points in their own pages.
#[derive(Debug)]
struct Array {
    pages: Pages,
    n_points: usize,
    n_components: usize,
    point: usize,
    component: usize,
}

impl Array {
    fn new(
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

    fn put(&mut self, i: usize, values: &[f64]) {
        assert!(i < self.n_points && values.len() == self.n_components);
        for (c, &value) in values.iter().enumerate() {
            doubles_mut(&mut self.pages)[i * self.point + c * self.component] = value;
        }
    }

    fn row(&self, i: usize) -> Vec<f64> {
        (0..self.n_components)
            .map(|c| doubles(&self.pages)[i * self.point + c * self.component])
            .collect()
    }

    /// Whether anything but the cells was written.
    fn stray(&self) -> bool {
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

    fn is_nothing(&self) -> bool {
        self.n_points == 0 || self.n_components == 0
    }

    fn view(&self) -> View {
        if self.is_nothing() {
            return NOTHING;
        }
        View {
            p: self.pages.pointer().cast(),
            point: self.point as isize,
            component: self.component as isize,
        }
    }

    fn view_mut(&self) -> ViewMut {
        if self.is_nothing() {
            return NOWHERE;
        }
        ViewMut {
            p: self.pages.pointer().cast(),
            point: self.point as isize,
            component: self.component as isize,
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

/// A law whose parameters are fixed, to be probed.
#[derive(Debug)]
pub struct Probe {
    instance: Held,
    id: String,
    hypothesis: Hypothesis,
    values: Vec<f64>,
    n_components: usize,
    n_states: usize,
    lacks_tangent: bool,
}

/// What keeps the parameters.
#[derive(Debug)]
enum Held {
    Own(OwnedInstance),
    Foreign(Box<dyn ForeignInstance>),
}

impl Drop for Probe {
    fn drop(&mut self) {
        if let Held::Own(_) = self.instance {
            // `destroy` is called all the same if that cannot be written.
            let _ = call_log::keep(|| {
                let names = (self.id.as_str(), self.hypothesis.name());
                KeptCall::new(names, Function::Destroy, Form::of(0), &self.values, &[])
            });
        }
    }
}

/// Arguments of `create`.
#[derive(Clone, Copy, Debug)]
pub struct CreateForm<'a> {
    /// Number of the formulation.
    pub formulation: u32,
    /// Values; none: null.
    pub values: Option<&'a [f64]>,
    /// The number of values that is passed.
    pub n_values: usize,
    /// Size of the message buffer; none: null.
    pub message: Option<usize>,
    /// Bytes of the host's description beyond those this version knows.
    pub more_host: usize,
    /// Minor version that the host says it has.
    pub host_minor: u16,
    /// Its hypothesis, for later calls.
    pub hypothesis: Hypothesis,
    /// Internal variables, for later calls.
    pub n_states: usize,
    /// The formulation declares no consistent tangent, for later calls.
    pub lacks_tangent: bool,
}

/// Result of `create`.
#[derive(Debug)]
pub struct Created {
    /// What it returned.
    pub status: Status,
    /// The whole message buffer.
    pub message: Vec<u8>,
    /// The instance, if one was written.
    pub probe: Option<Probe>,
}

impl Created {
    /// The message up to its NUL; `None` without a NUL.
    pub fn text(&self) -> Option<String> {
        terminated(&self.message)
    }
}

/// The host's description with another minor version, or with bytes at its end that this version does
/// not know. It stays for the life of the process.
fn other_host(more: usize, abi_minor: u16) -> io::Result<*const Host> {
    let size = size_of::<Host>() + more;
    let mut pages = Pages::new(size, Fence::After)?;
    pages.bytes_mut().fill(0xa5);
    let (before, hosts, _) = {
        // SAFETY: these bytes may be anything, since only a host is written to them.
        unsafe {
            pages
                .bytes_mut()
                .align_to_mut::<std::mem::MaybeUninit<Host>>()
        }
    };
    let at: *const Host = match (before, hosts) {
        ([], [host, ..]) => host.write(Host {
            struct_size: size as u32,
            abi_minor,
            ..HOST.0
        }),
        _ => {
            return Err(io::Error::other(
                "the description of the host is not aligned",
            ));
        }
    };
    pages.lock()?;
    std::mem::forget(pages);
    Ok(at)
}

/// Calls `create`.
///
/// # Errors
/// There is no memory.
pub(crate) fn create(id: &str, law: LawHandle, form: &CreateForm<'_>) -> io::Result<Created> {
    let Some(create) = law.known.create else {
        return Err(io::Error::other("`create` is null"));
    };
    let host = match (form.more_host, form.host_minor) {
        (0, raw::PILUM_ABI_MINOR) => &raw const HOST.0,
        (more, minor) => other_host(more, minor)?,
    };
    let values = form
        .values
        .map(|values| -> io::Result<Array> {
            let mut array = Array::new(Order::Points, true, 1, values.len(), Fence::After)?;
            array.put(0, values);
            array.pages.lock()?;
            Ok(array)
        })
        .transpose()?;
    let message = message_buffer(form.message)?;
    let mut instance: *mut Instance = null_mut();
    let all = form.values.unwrap_or_default();
    call_log::keep(|| {
        let names = (id, form.hypothesis.name());
        KeptCall::new(names, Function::Create, Form::of(0), all, &[])
    })?;
    // SAFETY: contract, "create": `law.at` is the law itself; values, messages and `out` are as
    // long as told, or null, which the law has to refuse.
    let status = unsafe {
        create(
            law.at,
            host,
            form.formulation,
            values.as_ref().map_or(null(), |array| array.view().p),
            form.n_values as u32,
            &raw mut instance,
            message
                .as_ref()
                .map_or(null_mut(), |m| m.pointer().cast::<c_char>()),
            form.message.unwrap_or(0),
        )
    };
    Ok(Created {
        status,
        message: message.map_or(Vec::new(), |pages| pages.bytes().to_vec()),
        probe: (!instance.is_null()).then(|| Probe {
            instance: Held::Own(OwnedInstance { law, instance }),
            id: id.to_owned(),
            hypothesis: form.hypothesis,
            values: all.to_vec(),
            n_components: form.hypothesis.n_components(),
            n_states: form.n_states,
            lacks_tangent: form.lacks_tangent,
        }),
    })
}

/// Fixes the parameters of a law behind an adapter, which gets those of the form and nothing else of it.
///
/// # Errors
/// The record of the call cannot be written.
pub(crate) fn create_foreign(
    id: &str,
    law: &dyn ForeignLaw,
    form: &CreateForm<'_>,
) -> io::Result<Created> {
    let values = form.values.unwrap_or_default();
    call_log::keep(|| {
        let names = (id, form.hypothesis.name());
        KeptCall::new(names, Function::Create, Form::of(0), values, &[])
    })?;
    Ok(match law.create(form.hypothesis, values) {
        Ok(instance) => Created {
            status: raw::PILUM_OK,
            message: vec![0],
            probe: Some(Probe {
                instance: Held::Foreign(instance),
                id: id.to_owned(),
                hypothesis: form.hypothesis,
                values: values.to_vec(),
                n_components: form.hypothesis.n_components(),
                n_states: form.n_states,
                lacks_tangent: form.lacks_tangent,
            }),
        },
        Err((status, text)) => Created {
            status,
            message: ended(text),
            probe: None,
        },
    })
}

/// A text as a message buffer holds it.
fn ended(text: String) -> Vec<u8> {
    let mut bytes = text.into_bytes();
    bytes.push(0);
    bytes
}

/// Calls `destroy` with null, which the contract allows.
pub(crate) fn destroy_nothing(id: &str, law: LawHandle) {
    if let Some(destroy) = law.known.destroy {
        let law = Some(id.to_owned());
        // It is called all the same if that cannot be written.
        let _ = call_log::keep_phase(KeptPhase {
            law,
            ..KeptPhase::new(Phase::DestroyNull, false)
        });
        // SAFETY: contract, "create": null is allowed.
        unsafe { destroy(null_mut()) };
    }
}

/// A message buffer as the host hands it over: its first byte is NUL, the rest is not.
fn message_buffer(capacity: Option<usize>) -> io::Result<Option<Pages>> {
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

impl Probe {
    /// Number of components of gradient and flux.
    pub fn n_components(&self) -> usize {
        self.n_components
    }

    /// Number of internal variables.
    pub fn n_states(&self) -> usize {
        self.n_states
    }

    /// Address of its instance; 0 for a law behind an adapter.
    pub fn address(&self) -> usize {
        match &self.instance {
            Held::Own(own) => own.instance.addr(),
            Held::Foreign(_) => 0,
        }
    }

    /// Whether the law has `init_state`; one behind an adapter reports it when it is asked.
    fn has_init_state(&self) -> bool {
        match &self.instance {
            Held::Own(own) => own.law.known.init_state.is_some(),
            Held::Foreign(_) => true,
        }
    }

    /// Arguments that the routine behind an adapter has overwritten though it is given them to read,
    /// those that were not told before.
    pub fn take_overwritten(&self) -> Vec<String> {
        match &self.instance {
            Held::Own(_) => Vec::new(),
            Held::Foreign(instance) => instance.take_overwritten(),
        }
    }

    /// Puts a number between the arguments of a routine behind an adapter, in front of that argument or everywhere,
    /// for calls from now on; the usual one if absent: what is read there shows. In words where that is; `None`
    /// if there is no such place.
    pub fn put_beside(&self, gap: Option<usize>, value: Option<f64>) -> Option<String> {
        match &self.instance {
            Held::Own(_) => None,
            Held::Foreign(instance) => instance.put_beside(gap, value),
        }
    }

    /// Asks for the internal variables of points that carry these fluxes. `None` if the law has no
    /// `init_state`.
    ///
    /// # Errors
    /// There is no memory.
    pub fn init_state(&self, fluxes: &[Vec<f64>], form: &Form) -> io::Result<Option<Answer>> {
        if !self.has_init_state() {
            return Ok(None);
        }
        let starts: Vec<PointStart> = fluxes
            .iter()
            .map(|flux| PointStart {
                gradient0: Vec::new(),
                gradient1: Vec::new(),
                flux0: flux.clone(),
                state0: Vec::new(),
            })
            .collect();
        if let Held::Foreign(instance) = &self.instance {
            return self.start_foreign(&**instance, &starts, form);
        }
        let answer = self.call(Function::InitState, &starts, None, form)?;
        Ok(Some(answer.0))
    }

    /// Calls `integrate`.
    ///
    /// # Errors
    /// There is no memory.
    pub fn integrate(&self, starts: &[PointStart], form: &Form) -> io::Result<Answer> {
        Ok(self.call(Function::Integrate, starts, None, form)?.0)
    }

    /// Calls `integrate` for an update with its rates, point by point; `parameter` are those of the
    /// parameters.
    ///
    /// # Errors
    /// There is no memory.
    pub fn rates(
        &self,
        starts: &[PointStart],
        rates: &[PointRates],
        parameter: &[f64],
    ) -> io::Result<(Answer, Vec<EndRates>)> {
        let form = Form::of(raw::PILUM_REQ_FLUX | raw::PILUM_REQ_RATES);
        self.call(Function::Integrate, starts, Some((rates, parameter)), &form)
    }

    /// Calls `init_state` for initial internal variables with their rates; of `rates` only those of the
    /// flux are in use. `None` if the law has no `init_state`.
    ///
    /// # Errors
    /// There is no memory.
    pub fn initial_rates(
        &self,
        starts: &[PointStart],
        rates: &[PointRates],
        parameter: &[f64],
    ) -> io::Result<Option<(Answer, Vec<EndRates>)>> {
        if !matches!(self.instance, Held::Own(_)) || !self.has_init_state() {
            return Ok(None);
        }
        let form = Form::of(raw::PILUM_REQ_RATES);
        self.call(Function::InitState, starts, Some((rates, parameter)), &form)
            .map(Some)
    }

    /// What the call asks for: of a law without a consistent tangent the elastic operator instead.
    fn asked(&self, form: &Form) -> u32 {
        let consistent = raw::PILUM_REQ_TANGENT;
        if self.lacks_tangent && !form.verbatim && form.request & consistent != 0 {
            form.request & !consistent | raw::PILUM_REQ_ELASTIC
        } else {
            form.request
        }
    }

    #[expect(clippy::too_many_lines, reason = "a batch has many arrays")]
    fn call(
        &self,
        function: Function,
        starts: &[PointStart],
        rates: Option<(&[PointRates], &[f64])>,
        form: &Form,
    ) -> io::Result<(Answer, Vec<EndRates>)> {
        let own = match &self.instance {
            Held::Own(own) => own,
            Held::Foreign(instance) => {
                let answer = self.call_foreign(&**instance, function, starts, form)?;
                return Ok((answer, Vec::new()));
            }
        };
        let known = &own.law.known;
        let Some(called) = (match function {
            Function::Create | Function::Destroy => None,
            Function::InitState => known.init_state,
            Function::Integrate => known.integrate,
        }) else {
            return Err(io::Error::other("the function is null"));
        };
        let n = starts.len();
        let integrating = function == Function::Integrate;
        let n_gradient = if integrating { self.n_components } else { 0 };
        let n_tangent = if form.request & (raw::PILUM_REQ_TANGENT | raw::PILUM_REQ_ELASTIC) == 0 {
            0
        } else {
            n_gradient * n_gradient
        };
        let n_state0 = if integrating { self.n_states } else { 0 };
        let input = |n_components, values: fn(&PointStart) -> &[f64]| -> io::Result<Array> {
            let mut array = Array::new(form.order, true, n, n_components, form.around_inputs)?;
            for (i, start) in starts.iter().enumerate() {
                array.put(i, values(start));
            }
            if form.inputs_locked {
                array.pages.lock()?;
            }
            Ok(array)
        };
        let output =
            |n_components| Array::new(form.order, false, n, n_components, form.around_outputs);
        let gradient0 = input(n_gradient, |start| &start.gradient0)?;
        let gradient1 = input(n_gradient, |start| &start.gradient1)?;
        let flux0 = input(self.n_components, |start| &start.flux0)?;
        let state0 = input(n_state0, |start| &start.state0)?;
        let flux1 = output(n_gradient)?;
        let state1 = output(self.n_states)?;
        let tangent = output(n_tangent)?;
        let directions = rates
            .map(|(rates, parameter)| Directions::new(self, rates, parameter))
            .transpose()?;
        let given = directions.as_ref().map(Directions::raw);
        let step_factor = output_of_one(n, form)?;
        let mut status = Pages::new(n * size_of::<Status>(), form.around_outputs)?;
        for four in status.bytes_mut().chunks_exact_mut(size_of::<Status>()) {
            four.copy_from_slice(&NO_OUTCOME.to_ne_bytes());
        }
        let message = message_buffer(form.message)?;
        let batch = Batch {
            struct_size: form.batch_bytes as u32,
            request: self.asked(form),
            n_points: n as u64,
            first_point: form.first_point,
            time: form.time,
            time_increment: form.time_increment,
            gradient0: gradient0.view(),
            gradient1: gradient1.view(),
            flux0: flux0.view(),
            state0: state0.view(),
            flux1: flux1.view_mut(),
            state1: state1.view_mut(),
            tangent: tangent.view_mut(),
            status: if form.outcomes {
                status.pointer().cast()
            } else {
                null_mut()
            },
            step_factor: if form.outcomes {
                step_factor.pages.pointer().cast()
            } else {
                null_mut()
            },
            message: message.as_ref().map_or(null_mut(), |m| m.pointer().cast()),
            message_capacity: form.message.unwrap_or(0),
            step_time: form.time,
            rates: given.as_ref().map_or(null(), std::ptr::from_ref),
        };
        let letter = in_pages(&batch, form.batch_bytes)?;
        call_log::keep(|| {
            let names = (self.id.as_str(), self.hypothesis.name());
            KeptCall::new(names, function, *form, &self.values, starts)
        })?;
        // SAFETY: contract, "Batch": every view lies in pages that live until the end of this
        // function; a batch that tells less than version 1.0 has to be refused unread.
        let returned = unsafe { called(own.instance, letter.pointer().cast()) };
        let statuses = status
            .bytes()
            .chunks_exact(size_of::<Status>())
            .map(|four| Status::from_ne_bytes([four[0], four[1], four[2], four[3]]));
        let points = statuses
            .enumerate()
            .map(|(i, status)| PointEnd {
                status,
                step_factor: step_factor.row(i)[0],
                flux: flux1.row(i),
                state: state1.row(i),
                tangent: tangent.row(i),
            })
            .collect();
        let answer = Answer {
            status: returned,
            message: message.map_or(Vec::new(), |pages| pages.bytes().to_vec()),
            points,
            stray: [flux1, state1, tangent].iter().any(Array::stray),
        };
        Ok((
            answer,
            directions.map_or(Vec::new(), |written| written.rows()),
        ))
    }
}

impl Probe {
    /// Initial internal variables through an adapter. `None` if the description says all there is to say.
    fn start_foreign(
        &self,
        instance: &dyn ForeignInstance,
        starts: &[PointStart],
        form: &Form,
    ) -> io::Result<Option<Answer>> {
        let rows = Strided::rows(self.n_components);
        call_log::keep(|| {
            let names = (self.id.as_str(), self.hypothesis.name());
            KeptCall::new(names, Function::InitState, *form, &self.values, starts)
        })?;
        let mut worst = (raw::PILUM_OK, String::new());
        let mut points = Vec::new();
        for start in starts {
            let mut end = self.nothing_yet(0);
            let begun = instance.init_state(Call {
                request: 0,
                n_points: 1,
                n_components: self.n_components,
                n_states: self.n_states,
                time: form.time,
                time_increment: form.time_increment,
                moment: Moment::default(),
                sites: &[],
                gradient0: None,
                gradient1: None,
                flux0: (&start.flux0, rows),
                state0: &[],
                flux1: None,
                state1: &mut end.state,
                tangent: &mut [],
                status: std::slice::from_mut(&mut end.status),
                step_factor: std::slice::from_mut(&mut end.step_factor),
            });
            let Some((returned, text)) = begun else {
                return Ok(None);
            };
            if most_severe(worst.0, returned) != worst.0 {
                worst = (returned, text);
            }
            points.push(end);
        }
        Ok(Some(Answer {
            status: worst.0,
            message: ended(worst.1),
            points,
            stray: false,
        }))
    }

    /// A point before anything is written, with this many entries of an operator.
    fn nothing_yet(&self, n_operator: usize) -> PointEnd {
        PointEnd {
            status: NO_OUTCOME,
            step_factor: f64::NAN,
            flux: vec![f64::NAN; self.n_components],
            state: vec![f64::NAN; self.n_states],
            tangent: vec![f64::NAN; n_operator],
        }
    }

    /// A call through an adapter, which has separate arrays: requests, times and places are those of the form.
    fn call_foreign(
        &self,
        instance: &dyn ForeignInstance,
        function: Function,
        starts: &[PointStart],
        form: &Form,
    ) -> io::Result<Answer> {
        if function != Function::Integrate {
            return Err(io::Error::other("there is no such function"));
        }
        let c = self.n_components;
        let request = self.asked(form);
        let wants_tangent = request & (raw::PILUM_REQ_TANGENT | raw::PILUM_REQ_ELASTIC) != 0;
        let rows = Strided::rows(c);
        call_log::keep(|| {
            let names = (self.id.as_str(), self.hypothesis.name());
            KeptCall::new(names, function, *form, &self.values, starts)
        })?;
        let mut worst = (raw::PILUM_OK, String::new());
        let mut points = Vec::new();
        for (i, start) in starts.iter().enumerate() {
            let (time, moment) = form.when(start);
            let mut end = self.nothing_yet(if wants_tangent { c * c } else { 0 });
            let (returned, text) = instance.integrate(Call {
                request,
                n_points: 1,
                n_components: c,
                n_states: self.n_states,
                time,
                time_increment: form.time_increment,
                moment,
                sites: &[form.site.unwrap_or_default()],
                gradient0: Some((&start.gradient0, rows)),
                gradient1: Some((&start.gradient1, rows)),
                flux0: (&start.flux0, rows),
                state0: &start.state0,
                flux1: Some((&mut end.flux, rows)),
                state1: &mut end.state,
                tangent: &mut end.tangent,
                status: std::slice::from_mut(&mut end.status),
                step_factor: std::slice::from_mut(&mut end.step_factor),
            });
            let status = most_severe(worst.0, returned);
            if status != worst.0 {
                worst = (status, text.replacen("point 0:", &format!("point {i}:"), 1));
            }
            points.push(end);
        }
        Ok(Answer {
            status: worst.0,
            message: ended(worst.1),
            points,
            stray: false,
        })
    }
}

/// The arrays of rates of one call.
struct Directions {
    parameter: Array,
    gradient0: Array,
    gradient1: Array,
    flux0: Array,
    state0: Array,
    flux1: Array,
    state1: Array,
}

impl Directions {
    fn new(probe: &Probe, rates: &[PointRates], parameter: &[f64]) -> io::Result<Self> {
        let n = rates.len();
        let input = |n_components, values: fn(&PointRates) -> &[f64]| -> io::Result<Array> {
            let mut array = Array::new(Order::Points, true, n, n_components, Fence::Far)?;
            for (i, one) in rates.iter().enumerate() {
                array.put(i, values(one));
            }
            Ok(array)
        };
        let output = |n_components| Array::new(Order::Points, false, n, n_components, Fence::Far);
        let mut of_parameters = Array::new(Order::Points, true, 1, parameter.len(), Fence::After)?;
        of_parameters.put(0, parameter);
        Ok(Self {
            parameter: of_parameters,
            gradient0: input(probe.n_components, |one| &one.gradient0)?,
            gradient1: input(probe.n_components, |one| &one.gradient1)?,
            flux0: input(probe.n_components, |one| &one.flux0)?,
            state0: input(probe.n_states, |one| &one.state0)?,
            flux1: output(probe.n_components)?,
            state1: output(probe.n_states)?,
        })
    }

    /// The output of the law.
    fn rows(&self) -> Vec<EndRates> {
        let n = self.flux1.n_points;
        let row = |i| (self.flux1.row(i), self.state1.row(i));
        (0..n).map(row).collect()
    }

    fn raw(&self) -> Rates {
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

fn output_of_one(n_points: usize, form: &Form) -> io::Result<Array> {
    Array::new(Order::Points, false, n_points, 1, form.around_outputs)
}

/// The first bytes of a batch in read-only pages that end where it says; bytes beyond it are 0xa5.
fn in_pages(batch: &Batch, bytes: usize) -> io::Result<Pages> {
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

/// Opens a library with all its symbols, and no more.
///
/// # Errors
/// What the system says.
pub fn open(path: &Path) -> Result<(), String> {
    symbols(path).map(|_| ())
}

/// Notes what is about to be done with a library that is loaded from its file.
fn begin(phase: Phase) -> Result<(), String> {
    call_log::keep_phase(KeptPhase::new(phase, true)).map_err(|error| error.to_string())
}

/// The library, never unloaded.
fn symbols(path: &Path) -> Result<&'static libloading::Library, String> {
    begin(Phase::Load)?;
    // SAFETY: running the library's initialisers is what loading means; the user named it.
    let library = unsafe { load(path, path) }.map_err(|error| {
        std::error::Error::source(&error).map_or_else(|| error.to_string(), ToString::to_string)
    })?;
    Ok(Box::leak(Box::new(library)))
}

/// Compares the handshake block with this host's.
///
/// # Errors
/// It is missing, or the first field that differs.
pub fn shake_hands(path: &Path) -> Result<(), String> {
    // SAFETY: contract, "Handshake": `pilum_magic` is a data symbol of this type for ever.
    let magic = unsafe { symbols(path)?.get::<*const MagicBlock>(b"pilum_magic\0") }
        .map_err(|_| "there is no symbol `pilum_magic`".to_owned())?;
    begin(Phase::Handshake)?;
    // SAFETY: as above; the block is at least 64 bytes in every version.
    let magic = unsafe { (*magic).read_unaligned() };
    version::check(&magic).map_err(|mismatch| mismatch.to_string())
}

/// Calls `pilum_entry` twice, then from another thread, with a host that is longer than this one.
/// The addresses it returned.
///
/// # Errors
/// There is no such function.
pub fn enter(path: &Path) -> Result<[usize; 3], String> {
    let library = symbols(path)?;
    // SAFETY: contract, "Handshake": once the block is accepted, `pilum_entry` has this type.
    let entry = *unsafe { library.get::<raw::Entry>(b"pilum_entry\0") }
        .map_err(|_| "there is no symbol `pilum_entry`".to_owned())?;
    // SAFETY: contract, "Entry": may be called with any valid host block, from any thread.
    let call = move || unsafe { entry(&raw const HOST.0) }.addr();
    let other = move || -> io::Result<usize> {
        let host = other_host(64, raw::PILUM_ABI_MINOR)?;
        // SAFETY: as above.
        Ok(unsafe { entry(host) }.addr())
    };
    begin(Phase::Entry)?;
    let (first, second) = (call(), call());
    let third = std::thread::spawn(other)
        .join()
        .map_err(|_| "`pilum_entry` panicked".to_owned())?
        .map_err(|error| error.to_string())?;
    Ok([first, second, third])
}
