//! A law with its parameters, as elements call it.

use crate::call::{Outcomes, PointCall, Updated};
use crate::instance::Instance;
use crate::process::current_call::{self, Doing};
use crate::process::process_state;
use crate::{
    BatchFailure, BatchSuccess, End, FormulationDescription, LawDescription, Library, LoadedLaw,
    Moment, Operator, Request, Start, Strided, Tangent,
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
    pub(crate) instance: Box<dyn Instance>,
    /// Its name where calls are watched.
    pub(crate) name: u64,
    /// What it had changed of the process as it was built.
    pub(crate) changes: Vec<String>,
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

/// Why a law cannot be built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CreateFailure {
    /// The parameter to change, if the law names one.
    pub parameter: Option<String>,
    /// Why.
    pub reason: String,
    /// The fault is the library's, not the parameter's.
    pub library_at_fault: bool,
}

impl LoadedLaw {
    /// Fixes the parameters (in declared order; NaN: left out) under a hypothesis.
    ///
    /// # Errors
    /// The law's refusal, or a defect of the library.
    pub fn build(&self, hypothesis: Hypothesis, parameters: &[f64]) -> Result<Law, CreateFailure> {
        let description = self.description();
        let defect = |reason: &str| CreateFailure {
            parameter: None,
            reason: reason.to_owned(),
            library_at_fault: true,
        };
        let formulation = description
            .formulation(hypothesis)
            .ok_or_else(|| defect("the hypothesis is not offered"))?
            .clone();
        let name = current_call::name(&format!(
            "law `{}` of library {}",
            description.id,
            self.library.path.display()
        ));
        current_call::remember_process();
        let source = &self.opened().source;
        let create = || source.create(hypothesis, &formulation, parameters);
        let created = current_call::calling(name, Doing::Create, 0, Moment::default(), create);
        let changes = process_state::restore().map_err(|why| defect(&why))?;
        let instance = created.map_err(|(status, message)| {
            // Contract, "create": a message about one parameter starts with its id.
            let parameter = message
                .split_once(':')
                .map(|(id, _)| id.trim())
                .filter(|id| description.parameters.iter().any(|p| p.id == *id))
                .map(str::to_owned);
            CreateFailure {
                parameter,
                reason: message,
                library_at_fault: status != raw::PILUM_E_PARAMETER && status != raw::PILUM_E_DOMAIN,
            }
        })?;
        Ok(Law {
            loaded: self.clone(),
            hypothesis,
            formulation,
            parameters: parameters.to_vec(),
            instance,
            name,
            changes,
        })
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
        let variables = self.formulation.internal_variables.iter();
        let initial = variables.map(|v| v.initial_value).cycle();
        let mut state: Vec<f64> = initial.take(n_points * n_states).collect();
        let start = Start::of_fluxes(n_points, flux);
        let mut outcomes = Outcomes::of(n_points);
        let mut end = End::of_state(&mut state);
        let batch = (&start, &mut end, &mut outcomes);
        let ask = || self.instance.call(Request::InitialState, batch);
        let answer =
            current_call::calling(self.name, Doing::Start, n_points, Moment::default(), ask);
        let Some((worst, message)) = answer else {
            return Ok(state);
        };
        let outputs = [(&*state, Strided::rows(n_states), n_states)];
        judge(worst, &outcomes, message)
            .and_then(|_| finite(&outputs, n_points))
            .map_err(|failure| self.with_call(failure, Request::InitialState, &start))?;
        Ok(state)
    }

    /// Response of the law at a point with this flux and no history, over an increment without
    /// any gradient: its flux and its operator, row by row (empty if not requested). Some internal
    /// variables, by number, begin with other values than the law's own.
    ///
    /// # Errors
    /// The law cannot start from the flux, or cannot leave it unchanged.
    pub fn at_rest(
        &self,
        flux: &[f64],
        initial: &[(usize, f64)],
        operator: Operator,
    ) -> Result<(Vec<f64>, Vec<f64>), BatchFailure> {
        let n = self.n_components();
        let rows = Strided::rows(n);
        let zero = vec![0.0; n];
        let mut state = self.initial_state(1, (flux, rows))?;
        for &(number, value) in initial {
            state[number] = value;
        }
        let start = Start {
            gradient: (&zero, rows),
            gradient_end: (&zero, rows),
            state: &state,
            ..Start::of_fluxes(1, (flux, rows))
        };
        let (flux, _, written) = self.update(&start, operator)?;
        Ok((flux, written))
    }

    /// As [`Self::integrate`], with results of its own, point by point.
    ///
    /// # Errors
    /// The same.
    pub fn update(&self, start: &Start<'_>, operator: Operator) -> Result<Updated, BatchFailure> {
        let (n, n_points) = (self.n_components(), start.n_points);
        let mut flux = vec![0.0; n_points * n];
        let mut state = vec![0.0; n_points * self.n_states()];
        let mut written = vec![0.0; n_points * operator.n_entries(n)];
        let end = End {
            flux: (&mut flux, Strided::rows(n)),
            state: &mut state,
            operator: &mut written,
        };
        self.integrate(start, operator, end)?;
        Ok((flux, state, written))
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
            .map_err(|failure| self.with_call(failure, Request::Update(operator), start))
    }

    #[inline]
    fn integrate_with(
        &self,
        outcomes: &mut Outcomes,
        start: &Start<'_>,
        operator: Operator,
        mut end: End<'_>,
    ) -> Result<BatchSuccess, BatchFailure> {
        let n_points = start.n_points;
        outcomes.clear(n_points);
        let asked = match operator {
            Operator::Consistent if self.formulation.tangent == Tangent::None => Operator::Elastic,
            operator => operator,
        };
        let batch = (start, &mut end, &mut *outcomes);
        let update = || self.instance.call(Request::Update(asked), batch);
        let answer =
            current_call::calling(self.name, Doing::Update, n_points, start.moment, update);
        // Without an answer the points say that the law broke down.
        let (worst, message) = answer.unwrap_or_default();
        let success = judge(worst, outcomes, message)?;
        let (n, n_states) = (self.n_components(), self.n_states());
        let n_operator = operator.n_entries(n);
        let outputs = [
            (&*end.flux.0, end.flux.1, n),
            (&*end.state, Strided::rows(n_states), n_states),
            (&*end.operator, Strided::rows(n_operator), n_operator),
        ];
        finite(&outputs, n_points)?;
        Ok(success)
    }

    /// A failure with what the law was asked at its point.
    fn with_call(
        &self,
        failure: BatchFailure,
        request: Request,
        start: &Start<'_>,
    ) -> BatchFailure {
        let sizes = (self.n_components(), self.n_states());
        let call = PointCall::of(request, start, failure.point, sizes);
        BatchFailure {
            call: Some(Box::new(call)),
            ..failure
        }
    }
}

thread_local! {
    /// Each thread keeps its own from call to call, so that a call allocates nothing once the largest batch has been
    /// seen.
    static OUTCOMES: RefCell<Outcomes> = RefCell::default();
}

/// Turns status codes into a verdict over the batch.
fn judge(
    worst: Status,
    outcomes: &Outcomes,
    message: String,
) -> Result<BatchSuccess, BatchFailure> {
    let Outcomes { status, factor } = outcomes;
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
    let outcome = match Outcome::from_code(code) {
        Outcome::Ok => return Ok(BatchSuccess::default()),
        Outcome::Unreliable => {
            return Ok(BatchSuccess {
                unreliable: Some((point, message)),
            });
        }
        outcome => outcome,
    };
    let smallest = || {
        let asked = factor.iter().zip(status);
        asked
            .filter(|(f, s)| **s == raw::PILUM_CUT_STEP && **f > 0.0 && **f < 1.0)
            .map(|(f, _)| *f)
            .min_by(f64::total_cmp)
            // A law that leaves the factor alone leaves the choice to the host.
            .unwrap_or(0.25)
    };
    Err(BatchFailure {
        point,
        outcome,
        message,
        factor: (outcome == Outcome::CutStep).then(smallest),
        claims_success: false,
        call: None,
    })
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
            if !(0..*n).all(|c| values[place.at(point, c)].is_finite()) {
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
