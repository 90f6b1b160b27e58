//! A law with its parameters, as elements call it.

use crate::adapter::ForeignInstance;
use crate::current_call::{self, Doing};
#[cfg(unix)]
use crate::isolate;
use crate::library::{Call, OwnedInstance, Strided};
use crate::shear_zone::ZoneInstance;
use crate::{
    BatchFailure, BatchSuccess, End, FormulationDescription, LawDescription, Library, LoadedLaw,
    Moment, Operator, PointCall, Request, Site, Start, Tangent,
};
use abi::Hypothesis;
use abi::raw::{self, Status};
use abi::status::Outcome;
use std::cell::RefCell;

/// A law with its parameters fixed under a hypothesis: what elements call.
#[derive(Debug)]
pub struct Law {
    pub(crate) loaded: LoadedLaw,
    pub(crate) hypothesis: Hypothesis,
    pub(crate) formulation: FormulationDescription,
    pub(crate) parameters: Vec<f64>,
    pub(crate) instance: LawInstance,
    /// Its name where calls are watched.
    pub(crate) name: u64,
    /// What it had changed of the process as it was built.
    pub(crate) changes: Vec<String>,
}

/// What a library made of the parameters, in this process or in workers.
#[derive(Debug)]
pub(crate) enum LawInstance {
    Here(OwnedInstance),
    Foreign(Box<dyn ForeignInstance>),
    #[cfg(unix)]
    Apart(Box<isolate::IsolatedInstance>),
    Zone(ZoneInstance),
}

impl LawInstance {
    /// Asks for initial internal variables. `None` if the law has no `init_state`.
    pub(crate) fn init_state(&self, call: Call<'_>) -> Option<(Status, String)> {
        match self {
            Self::Here(instance) => instance.init_state(call),
            Self::Foreign(instance) => instance.init_state(call),
            #[cfg(unix)]
            Self::Apart(instance) => instance.init_state(call),
            Self::Zone(zone) => Some(zone.init_state(call)),
        }
    }

    /// Carries the points over the increment. Returns the most severe status and a message.
    pub(crate) fn integrate(&self, call: Call<'_>) -> (Status, String) {
        match self {
            Self::Here(instance) => instance.integrate(call),
            Self::Foreign(instance) => instance.integrate(call),
            #[cfg(unix)]
            Self::Apart(instance) => instance.integrate(call),
            Self::Zone(zone) => zone.integrate(call),
        }
    }

    pub(crate) fn take_overwritten(&self) -> Vec<String> {
        match self {
            Self::Here(_) => Vec::new(),
            Self::Foreign(instance) => instance.take_overwritten(),
            #[cfg(unix)]
            Self::Apart(instance) => instance.take_overwritten(),
            Self::Zone(zone) => zone.take_overwritten(),
        }
    }
}

/// Why a law's response depends on how long an increment takes.
#[derive(Clone, Debug, PartialEq)]
pub enum TimeDependence {
    /// The law reports it.
    Declared,
    /// A parameter is a time or a rate: its id, value and unit.
    By(String, f64, String),
}

impl std::fmt::Display for TimeDependence {
    /// Suffix of the law's name: nothing, or the parameter in parentheses.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Declared => Ok(()),
            Self::By(id, value, unit) => write!(f, " (`{id}` is {value} {unit})"),
        }
    }
}

impl Law {
    /// Description of the law.
    pub fn description(&self) -> &LawDescription {
        self.loaded.description()
    }

    /// What it offers under the hypothesis it was built for.
    pub fn formulation(&self) -> &FormulationDescription {
        &self.formulation
    }

    /// Hypothesis it was built for.
    pub fn hypothesis(&self) -> Hypothesis {
        self.hypothesis
    }

    /// Library it comes from.
    pub fn library(&self) -> &Library {
        self.loaded.library()
    }

    /// The law without its parameters.
    pub fn loaded(&self) -> &LoadedLaw {
        &self.loaded
    }

    /// What it had changed of the process as it was built, and what was set back.
    pub fn changes(&self) -> &[String] {
        &self.changes
    }

    /// Values of its parameters, in declared order.
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// Whether its response is known to depend on how long an increment takes, and by what: it reports it, or a
    /// parameter is a time or a rate, by its unit, and is not 0.
    pub fn time_dependence(&self) -> Option<TimeDependence> {
        if self.formulation.time_dependent {
            return Some(TimeDependence::Declared);
        }
        let with_values = self.description().parameters.iter().zip(&self.parameters);
        let mut times = with_values.filter(|(p, value)| {
            let is_time = p
                .unit
                .split(|c: char| !c.is_ascii_alphabetic())
                .any(|part| part == "s");
            // Left to the law, it has no value here.
            is_time && value.abs() > 0.0
        });
        times
            .next()
            .map(|(p, value)| TimeDependence::By(p.id.clone(), *value, p.unit.clone()))
    }

    /// Why internal variables of another law with the same id mean nothing to this one; `None` if they
    /// are the same ones, of the same library, and where the ids differ.
    pub fn cannot_go_on_from(&self, other: &Self) -> Option<String> {
        if self.description().id != other.description().id {
            return None;
        }
        if self.hypothesis != other.hypothesis {
            let [to, from] = [self, other].map(|law| law.hypothesis.name());
            return Some(format!("it is made for {to}, the law before for {from}"));
        }
        let names = |law: &Self| {
            let variables = law.formulation.internal_variables.iter();
            variables.map(|v| v.id.clone()).collect::<Vec<_>>()
        };
        let (own, others) = (names(self), names(other));
        if own != others {
            let said = |names: &[String]| match names {
                [] => "none".to_owned(),
                names => format!("`{}`", names.join("`, `")),
            };
            return Some(format!(
                "its internal variables are {}, those found are {}",
                said(&own),
                said(&others)
            ));
        }
        let (to, from) = (self.library(), other.library());
        let is_same = to.sha256 == from.sha256 || to.path == from.path;
        let adapter = |library: &Library| library.foreign().map(|foreign| foreign.adapter);
        let is_same = is_same && adapter(to) == adapter(from);
        (!is_same && !own.is_empty()).then(|| {
            let (to, from) = (to.path.display(), from.path.display());
            format!("it is one of library {to}, the law before is one of {from}")
        })
    }

    /// Whether a failure that no smaller step helps is a fault of the library, not a limit of what
    /// the law can follow: values that are not finite although success is claimed. Every numeric
    /// failure of a routine made for another program is of this kind.
    pub fn breaks_down(&self, failure: &BatchFailure) -> bool {
        let is_foreign = self.library().foreign().is_some();
        failure.outcome == Outcome::Numeric && (is_foreign || failure.claims_success)
    }

    /// Whether the law receives the coordinates of its points.
    pub fn asks_for_sites(&self) -> bool {
        self.library().foreign().is_some()
    }

    /// What the user should know of the calls since the last time that this was asked.
    pub fn take_notes(&self) -> Vec<String> {
        let names = self.instance.take_overwritten();
        let note = || {
            format!(
                "law `{}`: the routine overwrites {}, which it is given to read; here that is a \
                 copy, and what is left there is not used",
                self.description().id,
                names.join(", ")
            )
        };
        (!names.is_empty()).then(note).into_iter().collect()
    }

    /// Number of components of gradient and flux.
    pub fn n_components(&self) -> usize {
        self.hypothesis.n_components()
    }

    /// Number of internal variables.
    pub fn n_states(&self) -> usize {
        self.formulation.internal_variables.len()
    }

    /// Internal variables of points that carry these fluxes before anything has happened.
    ///
    /// # Errors
    /// The law cannot start from one of the fluxes.
    pub fn initial_state(
        &self,
        n_points: usize,
        flux: (&[f64], Strided),
    ) -> Result<Vec<f64>, BatchFailure> {
        let n_states = self.n_states();
        let initial = self
            .formulation
            .internal_variables
            .iter()
            .map(|v| v.initial_value);
        let mut state: Vec<f64> = initial.cycle().take(n_points * n_states).collect();
        let mut status = vec![raw::PILUM_E_INTERNAL; n_points];
        let mut factor = vec![0.0; n_points];
        let call = Call {
            request: 0,
            n_points,
            n_components: self.n_components(),
            n_states,
            time: 0.0,
            time_increment: 0.0,
            moment: Moment::default(),
            sites: &[],
            gradient0: None,
            gradient1: None,
            flux0: flux,
            state0: &[],
            flux1: None,
            state1: &mut state,
            tangent: &mut [],
            status: &mut status,
            step_factor: &mut factor,
        };
        let result =
            current_call::calling(self.name, Doing::Start, n_points, Moment::default(), || {
                self.instance.init_state(call)
            });
        match result {
            None => Ok(state),
            Some((worst, message)) => {
                let outputs = [(&*state, Strided::rows(n_states), n_states)];
                judge(worst, &status, &factor, message)
                    .and_then(|_| finite(&outputs, n_points))
                    .map_err(|failure| {
                        let call = PointCall {
                            request: Request::InitialState,
                            time: 0.0,
                            time_increment: 0.0,
                            gradient: Vec::new(),
                            gradient_end: Vec::new(),
                            flux: flux.1.of_point(flux.0, failure.point, self.n_components()),
                            state: Vec::new(),
                            moment: Moment::default(),
                            site: Site::default(),
                        };
                        failure.of_call(call)
                    })?;
                Ok(state)
            }
        }
    }

    /// Response of the law at a point with this flux and no history, over an increment without
    /// any gradient: its flux and its operator, row by row (empty if not requested).
    ///
    /// # Errors
    /// The law cannot start from the flux, or cannot leave it unchanged.
    pub fn at_rest(
        &self,
        flux: &[f64],
        operator: Operator,
    ) -> Result<(Vec<f64>, Vec<f64>), BatchFailure> {
        let n = self.n_components();
        let rows = Strided::rows(n);
        let zero = vec![0.0; n];
        let state = self.initial_state(1, (flux, rows))?;
        let (mut flux_end, mut state_end) = (flux.to_vec(), state.clone());
        let wanted = if operator == Operator::None { 0 } else { n * n };
        let mut written = vec![0.0; wanted];
        let start = Start {
            n_points: 1,
            gradient: (&zero, rows),
            gradient_end: (&zero, rows),
            flux: (flux, rows),
            state: &state,
            time: 0.0,
            time_increment: 0.0,
            moment: Moment::default(),
            sites: &[],
        };
        let end = End {
            flux: (&mut flux_end, rows),
            state: &mut state_end,
            operator: &mut written,
        };
        self.integrate(&start, operator, end)?;
        Ok((flux_end, written))
    }

    /// Carries points over an increment. A law without a consistent tangent gives the elastic
    /// operator instead.
    ///
    /// # Errors
    /// A point asks for a smaller step, or fails; also if it claims success with a result that
    /// is not finite, or if its outcome contradicts that of the batch.
    #[inline]
    pub fn integrate(
        &self,
        start: &Start<'_>,
        operator: Operator,
        end: End<'_>,
    ) -> Result<BatchSuccess, BatchFailure> {
        OUTCOMES
            .with_borrow_mut(|outcomes| self.integrate_with(outcomes, start, operator, end))
            .map_err(|failure| {
                let (point, n) = (failure.point, self.n_components());
                let of_point =
                    |(values, place): (&[f64], Strided)| place.of_point(values, point, n);
                let rows = Strided::rows(self.n_states());
                let call = PointCall {
                    request: Request::Update(operator),
                    time: start.time,
                    time_increment: start.time_increment,
                    gradient: of_point(start.gradient),
                    gradient_end: of_point(start.gradient_end),
                    flux: of_point(start.flux),
                    state: rows.of_point(start.state, point, self.n_states()),
                    moment: start.moment,
                    site: start.sites.get(point).copied().unwrap_or_default(),
                };
                failure.of_call(call)
            })
    }

    #[inline]
    fn integrate_with(
        &self,
        outcomes: &mut Outcomes,
        start: &Start<'_>,
        operator: Operator,
        end: End<'_>,
    ) -> Result<BatchSuccess, BatchFailure> {
        let n = self.n_components();
        let (status, factor) = outcomes.unwritten(start.n_points);
        let (flux, flux_place) = end.flux;
        let call = Call {
            request: raw::PILUM_REQ_FLUX
                | match operator {
                    Operator::None => 0,
                    Operator::Consistent if self.formulation.tangent == Tangent::None => {
                        raw::PILUM_REQ_ELASTIC
                    }
                    Operator::Consistent => raw::PILUM_REQ_TANGENT,
                    Operator::Elastic => raw::PILUM_REQ_ELASTIC,
                },
            n_points: start.n_points,
            n_components: n,
            n_states: self.n_states(),
            time: start.time,
            time_increment: start.time_increment,
            moment: start.moment,
            sites: start.sites,
            gradient0: Some(start.gradient),
            gradient1: Some(start.gradient_end),
            flux0: start.flux,
            state0: start.state,
            flux1: Some((&mut *flux, flux_place)),
            state1: &mut *end.state,
            tangent: &mut *end.operator,
            status: &mut *status,
            step_factor: &mut *factor,
        };
        let update = || self.instance.integrate(call);
        let (worst, message) = current_call::calling(
            self.name,
            Doing::Update,
            start.n_points,
            start.moment,
            update,
        );
        let success = judge(worst, status, factor, message)?;
        let n_states = self.n_states();
        let n_operator = if operator == Operator::None { 0 } else { n * n };
        let outputs = [
            (&*flux, flux_place, n),
            (&*end.state, Strided::rows(n_states), n_states),
            (&*end.operator, Strided::rows(n_operator), n_operator),
        ];
        finite(&outputs, start.n_points)?;
        Ok(success)
    }
}

/// Room for the outcomes of one call. Each thread keeps its own from call to call, so that a call
/// allocates nothing once the largest batch has been seen.
#[derive(Debug, Default)]
struct Outcomes {
    status: Vec<Status>,
    factor: Vec<f64>,
}

thread_local! {
    static OUTCOMES: RefCell<Outcomes> = RefCell::default();
}

impl Outcomes {
    /// Outcomes of this many points as they are before a law has written them.
    fn unwritten(&mut self, n_points: usize) -> (&mut [Status], &mut [f64]) {
        self.status.clear();
        self.status.resize(n_points, raw::PILUM_E_INTERNAL);
        self.factor.clear();
        self.factor.resize(n_points, f64::NAN);
        (&mut self.status, &mut self.factor)
    }
}

/// Turns status codes into a verdict over the batch.
fn judge(
    worst: Status,
    status: &[Status],
    factor: &[f64],
    message: String,
) -> Result<BatchSuccess, BatchFailure> {
    // `PILUM_OK` is 0.
    if status.iter().fold(worst, |all, s| all | s) == raw::PILUM_OK {
        return Ok(BatchSuccess::default());
    }
    let severity = |s: Status| if s < 0 { 100 - s } else { s };
    let point = (0..status.len())
        .rev()
        .max_by_key(|&i| severity(status[i]))
        .unwrap_or(0);
    let at_point = status.get(point).copied().unwrap_or(worst);
    let code = abi::status::most_severe(worst, at_point);
    match Outcome::from_code(code) {
        Outcome::Ok => Ok(BatchSuccess::default()),
        Outcome::Unreliable => Ok(BatchSuccess {
            unreliable: Some((point, message)),
        }),
        Outcome::CutStep => {
            // A law that leaves the factor alone leaves the choice to the host.
            let smallest = factor
                .iter()
                .zip(status)
                .filter(|(f, s)| **s == raw::PILUM_CUT_STEP && **f > 0.0 && **f < 1.0)
                .map(|(f, _)| *f)
                .fold(f64::INFINITY, f64::min);
            let factor = if smallest.is_finite() { smallest } else { 0.25 };
            Err(BatchFailure {
                point,
                outcome: Outcome::CutStep,
                message,
                factor: Some(factor),
                claims_success: false,
                call: None,
            })
        }
        outcome => Err(BatchFailure {
            point,
            outcome,
            message,
            factor: None,
            claims_success: false,
            call: None,
        }),
    }
}

/// The error of a call that reports success wrongly.
const NOT_FINITE: &str = "the law claims success with a result that is not finite";

/// Distrusts success: every output must be finite. Compiled where batches are called, with what
/// computes: this crate is optimised little.
#[inline]
fn finite(outputs: &[(&[f64], Strided, usize)], n_points: usize) -> Result<(), BatchFailure> {
    let whole = |(values, place, n): &(&[f64], Strided, usize)| {
        let packed = place.component == 1 && place.point == *n;
        packed && all_finite(&values[place.offset..place.offset + n_points * n])
    };
    if outputs.iter().all(whole) {
        return Ok(());
    }
    for point in 0..n_points {
        for (values, place, n) in outputs {
            let first = place.offset + point * place.point;
            if !(0..*n).all(|c| values[first + c * place.component].is_finite()) {
                return Err(BatchFailure {
                    point,
                    outcome: Outcome::Numeric,
                    message: NOT_FINITE.to_owned(),
                    factor: None,
                    claims_success: true,
                    call: None,
                });
            }
        }
    }
    Ok(())
}

/// Whether all values are finite: 0 times a finite number is 0. Eight sums at a time and no branch,
/// so that it costs little more than reading the values.
#[inline]
fn all_finite(values: &[f64]) -> bool {
    let (chunks, rest) = values.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for chunk in chunks {
        for (sum, value) in sums.iter_mut().zip(chunk) {
            *sum += 0.0 * value;
        }
    }
    sums.iter().sum::<f64>() == 0.0 && rest.iter().all(|v| v.is_finite())
}
