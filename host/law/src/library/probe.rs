//! Calls of a law as `pilum check` makes them: through arrays whose neighbourhood, layout and
//! protection are chosen, and with arguments that a host in earnest never gives. All that a caller
//! hands over and gets back is safe.

mod arrays;
pub mod call_log;
mod entry;
mod form;
mod pages;
pub mod process;

use super::{HOST, LawHandle, OwnedInstance};
pub use crate::call::PointStart;
use crate::call::{End, Moment, Operator, Outcomes, PointCall, Request, Strided};
use crate::description::FormulationDescription;
use crate::instance::{Answer as Answered, Instance, Source};
use abi::Hypothesis;
use abi::raw::{self, Batch, Status};
use abi::status::most_severe;
use arrays::{Arrays, Directions, in_pages, locked, message_buffer};
use call_log::{Function, KeptCall, KeptPhase, Phase};
use entry::other_host;
pub use entry::{enter, open, shake_hands};
use form::terminated;
pub use form::{Answer, Form, Order, PointEnd};
pub use pages::Fence;
use std::ffi::c_char;
use std::io;
use std::mem::size_of;
use std::ptr::{null, null_mut};

/// Content of cells before a law has written them: a NaN that no computation produces.
const UNWRITTEN: f64 = f64::from_bits(0x7ff8_dead_beef_a5a5);
/// The outcome of a point before the law has written one: no version of the contract has it.
pub const NO_OUTCOME: Status = -0x5a5a;
/// Size of this host's batch, in bytes.
pub const BATCH_BYTES: usize = size_of::<Batch>();

/// Rates of what a point's update starts from.
pub type PointRates = PointStart;

/// Rates that a law has written for a point: of its flux, and of its internal variables.
pub type EndRates = (Vec<f64>, Vec<f64>);

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
    Foreign(Box<dyn Instance>),
}

impl Drop for Probe {
    fn drop(&mut self) {
        if let Held::Own(_) = self.instance {
            // `destroy` is called all the same if that cannot be written.
            let _ = keep(self.whose(), Function::Destroy, Form::of(0), &[]);
        }
    }
}

/// Writes down a call that is about to be made, of this law under this hypothesis with these parameters.
fn keep(
    (id, hypothesis, values): (&str, Hypothesis, &[f64]),
    function: Function,
    form: Form,
    starts: &[PointStart],
) -> io::Result<()> {
    call_log::keep(|| KeptCall {
        law: id.to_owned(),
        hypothesis: hypothesis.name().to_owned(),
        function,
        form,
        parameters: values.to_vec(),
        points: starts.to_vec(),
    })
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
    let values = form.values.map(locked).transpose()?;
    let message = message_buffer(form.message)?;
    let mut instance: *mut raw::Instance = null_mut();
    let all = form.values.unwrap_or_default();
    keep(
        (id, form.hypothesis, all),
        Function::Create,
        Form::of(0),
        &[],
    )?;
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
        probe: (!instance.is_null()).then(|| {
            let own = OwnedInstance {
                law,
                instance,
                n_components: form.hypothesis.n_components(),
                n_states: form.n_states,
            };
            Probe::new(Held::Own(own), id, form)
        }),
    })
}

/// Fixes the parameters of a law behind an adapter, which gets those of the form and nothing else of it.
///
/// # Errors
/// The record of the call cannot be written.
pub(crate) fn create_foreign(
    id: &str,
    law: &dyn Source,
    formulation: &FormulationDescription,
    form: &CreateForm<'_>,
) -> io::Result<Created> {
    let values = form.values.unwrap_or_default();
    keep(
        (id, form.hypothesis, values),
        Function::Create,
        Form::of(0),
        &[],
    )?;
    Ok(match law.create(form.hypothesis, formulation, values) {
        Ok(instance) => Created {
            status: raw::PILUM_OK,
            message: vec![0],
            probe: Some(Probe::new(Held::Foreign(instance), id, form)),
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

impl Probe {
    fn new(instance: Held, id: &str, form: &CreateForm<'_>) -> Self {
        Self {
            instance,
            id: id.to_owned(),
            hypothesis: form.hypothesis,
            values: form.values.unwrap_or_default().to_vec(),
            n_components: form.hypothesis.n_components(),
            n_states: form.n_states,
            lacks_tangent: form.lacks_tangent,
        }
    }

    fn whose(&self) -> (&str, Hypothesis, &[f64]) {
        (&self.id, self.hypothesis, &self.values)
    }

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
            return self.call_foreign(&**instance, Function::InitState, &starts, form);
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
                let answer = answer.ok_or_else(|| io::Error::other("there is no such function"))?;
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
        let arrays = Arrays::new(self, function, starts, form)?;
        let directions = rates
            .map(|(rates, parameter)| Directions::new(self, rates, parameter))
            .transpose()?;
        let given = directions.as_ref().map(Directions::raw);
        let batch = Batch {
            request: self.asked(form),
            rates: given.as_ref().map_or(null(), std::ptr::from_ref),
            ..arrays.batch(form)
        };
        let letter = in_pages(&batch, form.batch_bytes)?;
        keep(self.whose(), function, *form, starts)?;
        // SAFETY: contract, "Batch": every view lies in pages that live until the end of this
        // function; a batch that tells less than version 1.0 has to be refused unread.
        let returned = unsafe { called(own.instance, letter.pointer().cast()) };
        let rates = directions.map_or(Vec::new(), |written| written.rows());
        Ok((arrays.answer(returned), rates))
    }
}

impl Probe {
    /// A call through an adapter, which has separate arrays: requests, times and places are those of the form. `None` if
    /// it is one for initial internal variables, and the description says all there is to say of them.
    fn call_foreign(
        &self,
        instance: &dyn Instance,
        function: Function,
        starts: &[PointStart],
        form: &Form,
    ) -> io::Result<Option<Answer>> {
        keep(self.whose(), function, *form, starts)?;
        let request = match function {
            Function::InitState => Request::InitialState,
            _ => Request::Update(Operator::of_request(self.asked(form))),
        };
        let mut worst = (raw::PILUM_OK, String::new());
        let mut points = Vec::new();
        for (i, start) in starts.iter().enumerate() {
            let Some(((returned, text), end)) = self.call_of_point(instance, request, start, form)
            else {
                return Ok(None);
            };
            let status = most_severe(worst.0, returned);
            if status != worst.0 {
                worst = (status, text.replacen("point 0:", &format!("point {i}:"), 1));
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

    /// What an adapter makes of one point.
    fn call_of_point(
        &self,
        instance: &dyn Instance,
        request: Request,
        start: &PointStart,
        form: &Form,
    ) -> Option<(Answered, PointEnd)> {
        let is_update = request != Request::InitialState;
        let first = (form.time, Moment::default());
        let (time, moment) = if is_update { form.when(start) } else { first };
        let call = PointCall {
            request,
            start: start.clone(),
            time,
            time_increment: form.time_increment,
            moment,
            site: form.site.filter(|_| is_update).unwrap_or_default(),
        };
        let mut outcomes = Outcomes {
            status: vec![NO_OUTCOME],
            factor: vec![f64::NAN],
        };
        let mut point = PointEnd {
            status: NO_OUTCOME,
            step_factor: f64::NAN,
            flux: vec![f64::NAN; self.n_components],
            state: vec![f64::NAN; self.n_states],
            tangent: Vec::new(),
        };
        let mut end = End::of_state(&mut point.state);
        if let Request::Update(operator) = request {
            point.tangent = vec![f64::NAN; operator.n_entries(self.n_components)];
            end.flux = (&mut point.flux, Strided::rows(self.n_components));
            end.operator = &mut point.tangent;
        }
        let answer = instance.call(request, (&call.as_start(), &mut end, &mut outcomes))?;
        point.status = outcomes.status[0];
        point.step_factor = outcomes.factor[0];
        Some((answer, point))
    }
}
