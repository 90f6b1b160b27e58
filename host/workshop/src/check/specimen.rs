//! Laws with sample parameters, or with those of the author's own driver.

use super::loading_path::Origin;
use super::random::Random;
use super::{Found, Subject, Verdict, failed, refusal};
use abi::Hypothesis;
use abi::raw;
use abi::status::Outcome;
use law::capsule::Capsule;
use law::probe::{Answer, CreateForm, Form, PointEnd, PointStart, Probe, call_log};
use law::{
    BatchFailure, FormulationDescription, LoadedLaw, Moment, Operator, ParameterDescription,
    PointCall, Request, Site,
};
use std::sync::OnceLock;
use std::time::{Duration, Instant};
use text::suggestion;

/// A call of a routine that is longer than this, in the mean of this many, is a slow one.
pub(super) const LONG: Duration = Duration::from_micros(300);
const TIMED: u32 = 8;
/// Series of them that must all be slow.
const SERIES: usize = 8;
/// Draws of parameters until a law must have accepted one.
const MOST_DRAWS: usize = 500;
/// The part of an increment's length in time that is next to none.
pub(super) const INSTANT: f64 = 1e-12;

/// A law under one hypothesis with one set of parameters.
#[derive(Debug)]
pub(super) struct Specimen {
    pub(super) law: LoadedLaw,
    pub(super) formulation: FormulationDescription,
    pub(super) hypothesis: Hypothesis,
    pub(super) values: Vec<f64>,
    pub(super) probe: Probe,
    /// The increments of the author's own path, if it is led along one.
    pub(super) course: Option<Vec<PointStart>>,
    /// Length of its increments in time.
    pub(super) time_increment: f64,
    /// Its paths are short: calls take long, or end the process far away.
    pub(super) is_led_near: bool,
    /// What it said when it first called itself defective: later it may say no more than that.
    pub(super) defect: OnceLock<String>,
}

/// The function of a law that is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Function {
    Integrate,
    InitState,
}

impl Function {
    pub(super) const BOTH: [Self; 2] = [Self::Integrate, Self::InitState];

    /// As the header calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Integrate => "integrate",
            Self::InitState => "init_state",
        }
    }
}

/// Hypotheses a law offers, in the order of its library.
pub(super) fn hypotheses(law: &LoadedLaw) -> Vec<(FormulationDescription, Hypothesis)> {
    let offered = law.description().formulations.iter();
    offered
        .filter_map(|formulation| {
            let known = Hypothesis::ALL
                .into_iter()
                .find(|h| h.name() == formulation.hypothesis)?;
            Some((formulation.clone(), known))
        })
        .collect()
}

/// The form of an ordinary `create`.
pub(crate) fn create_form<'a>(
    formulation: &FormulationDescription,
    hypothesis: Hypothesis,
    values: &'a [f64],
) -> CreateForm<'a> {
    CreateForm {
        formulation: formulation.index,
        values: Some(values),
        n_values: values.len(),
        message: Some(512),
        more_host: 0,
        host_minor: raw::PILUM_ABI_MINOR,
        hypothesis,
        n_states: formulation.internal_variables.len(),
        lacks_tangent: formulation.tangent == law::Tangent::None,
    }
}

/// Parameters that are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Draw {
    /// Defaults and the middle of usual ranges.
    Plausible,
    /// The most ordinary ones.
    Ordinary,
    /// Any, but choices stay at their defaults: the other labels may stand for approximations.
    DefaultChoices,
    /// Any.
    Any,
}

/// A value for a parameter.
fn draw(p: &ParameterDescription, random: &mut Random, how: Draw) -> f64 {
    if how == Draw::Plausible {
        return law::trial::plausible(p);
    }
    let is_first = how == Draw::Ordinary;
    if let Some(default) = p.default {
        let unlimited = !p.usual.lower.is_finite() || !p.usual.upper.is_finite();
        let fixed = if p.choices.is_empty() {
            unlimited
        } else {
            how != Draw::Any
        };
        if is_first || fixed || random.once_in(2) {
            return default;
        }
    }
    if !p.choices.is_empty() {
        return random.below(p.choices.len()) as f64;
    }
    if p.optional && (is_first || random.once_in(2)) {
        return f64::NAN;
    }
    let finite = |a: f64, b: f64| if a.is_finite() { a } else { b };
    let lower = p.bounds.lower.max(p.usual.lower);
    let upper = p.bounds.upper.min(p.usual.upper);
    let lower = finite(lower, f64::min(0.0, upper - 1.0));
    let upper = finite(upper, f64::max(1000.0, lower + 1.0));
    let value = if is_first {
        match (lower > 0.0, lower < 0.0 && upper > 0.0) {
            (true, _) if upper > 100.0 * lower => (lower * upper).sqrt(),
            (_, true) => 0.5 * upper,
            _ => f64::midpoint(lower, upper),
        }
    } else if lower >= 0.0 && upper > 100.0 * lower && random.once_in(2) {
        random.logarithmic(lower.max(1e-5 * upper), upper)
    } else {
        random.between(lower, upper)
    };
    if p.bounds.contain(value) {
        value
    } else {
        upper
    }
}

/// Parameters of a law that keep the subject's settings.
pub(super) fn draw_all(
    subject: &Subject,
    law: &LoadedLaw,
    random: &mut Random,
    how: Draw,
) -> Vec<f64> {
    let parameters = law.description().parameters.iter();
    parameters
        .map(|p| {
            let given = subject.settings.iter().find(|(id, _)| *id == p.id);
            given.map_or_else(|| draw(p, random, how), |(_, value)| *value)
        })
        .collect()
}

impl Subject {
    /// Every law under every hypothesis with this many sets of parameters. The first set is the
    /// most ordinary one that the law accepts.
    pub(super) fn specimens(
        &self,
        n_sets: usize,
        random: &mut Random,
    ) -> Result<Vec<Specimen>, Verdict> {
        self.specimens_drawn(n_sets, random, Draw::Any)
    }

    /// The same with the choices of parameters at their defaults.
    pub(super) fn specimens_by_default(
        &self,
        n_sets: usize,
        random: &mut Random,
    ) -> Result<Vec<Specimen>, Verdict> {
        self.specimens_drawn(n_sets, random, Draw::DefaultChoices)
    }

    fn specimens_drawn(
        &self,
        n_sets: usize,
        random: &mut Random,
        how: Draw,
    ) -> Result<Vec<Specimen>, Verdict> {
        if let Some(capsule) = &self.at {
            return Ok(vec![self.specimen_of(capsule)?]);
        }
        if self.driver.is_some() {
            return self.led_specimens();
        }
        let mut specimens = Vec::new();
        for law in self.laws()? {
            for (formulation, hypothesis) in hypotheses(&law) {
                if law.library().foreign().is_some() {
                    // A routine refuses no parameters, so that random ones would say little.
                    let draws = [Draw::Plausible].into_iter();
                    let mut one = self.specimen(&law, &formulation, hypothesis, draws, random)?;
                    one.is_led_near =
                        self.near || one.takes_long(&mut Random::new(self.seed, "speed"))?;
                    specimens.push(one);
                    continue;
                }
                for set in 0..n_sets {
                    let first = if set == 0 { Draw::Ordinary } else { how };
                    let draws = [first].into_iter().chain(std::iter::repeat(how));
                    specimens.push(self.specimen(&law, &formulation, hypothesis, draws, random)?);
                }
            }
        }
        Ok(specimens)
    }

    fn specimen(
        &self,
        law: &LoadedLaw,
        formulation: &FormulationDescription,
        hypothesis: Hypothesis,
        draws: impl Iterator<Item = Draw>,
        random: &mut Random,
    ) -> Result<Specimen, Verdict> {
        self.accepted(law, formulation, hypothesis, draws, random)?
            .map_err(|(_, why)| {
                let hint = if self.settings.is_empty() {
                    "; `--set ID=VALUE` fixes some"
                } else {
                    ""
                };
                failed(format!(
                    "`{}` under {}: `create` accepted no parameters: {why}{hint}",
                    law.description().id,
                    hypothesis.name()
                ))
            })
    }

    /// The first set of parameters that a law accepts; otherwise the last answer of `create`, in
    /// words too.
    fn accepted(
        &self,
        law: &LoadedLaw,
        formulation: &FormulationDescription,
        hypothesis: Hypothesis,
        draws: impl Iterator<Item = Draw>,
        random: &mut Random,
    ) -> Result<Result<Specimen, (raw::Status, String)>, Verdict> {
        let mut last = (raw::PILUM_E_PARAMETER, String::new());
        for how in draws.take(MOST_DRAWS) {
            let values = draw_all(self, law, random, how);
            let created = law.probe(&create_form(formulation, hypothesis, &values))?;
            if let (raw::PILUM_OK, Some(probe)) = (created.status, created.probe) {
                let formulation = (formulation.clone(), hypothesis);
                return Ok(Ok(Specimen::of(law.clone(), formulation, values, probe)));
            }
            let why = if created.status == raw::PILUM_OK {
                "PILUM_OK (0), but no instance is written".to_owned()
            } else {
                let text = created.message.split(|&b| b == 0).next();
                let text = text.map(String::from_utf8_lossy);
                refusal(created.status, text.as_deref())
            };
            last = (created.status, why);
            if created.status != raw::PILUM_E_PARAMETER {
                break;
            }
        }
        Ok(Err(last))
    }
}

/// Whether the subject's settings name parameters of its laws, with values that these accept.
pub(super) fn settings_fit(subject: &Subject) -> Found {
    // What else is wrong with the library is for the checks to say.
    let Ok(laws) = subject.laws() else {
        return Ok(String::new());
    };
    for (id, value) in &subject.settings {
        let parameters = laws.iter().flat_map(|law| &law.description().parameters);
        let declared: Vec<_> = parameters.clone().filter(|p| p.id == *id).collect();
        if declared.is_empty() {
            let mut ids: Vec<&str> = parameters.map(|p| p.id.as_str()).collect();
            ids.sort_unstable();
            ids.dedup();
            return Err(failed(format!(
                "--set {id}={value}: no law of this library has a parameter `{id}`: {}",
                suggestion(id, ids)
            )));
        }
        let admits = |p: &&ParameterDescription| {
            let is_choice = value.fract() == 0.0 && *value < p.choices.len() as f64;
            let is_left_out = p.optional && value.is_nan();
            is_left_out || p.bounds.contain(*value) && (p.choices.is_empty() || is_choice)
        };
        if let Some(p) = declared.into_iter().find(|p| !admits(p)) {
            let allowed = if p.choices.is_empty() {
                let unit = p.unit.trim_matches('-');
                format!("{} {unit}", p.bounds)
            } else {
                let numbered = p.choices.iter().enumerate();
                let choices: Vec<String> = numbered.map(|(i, c)| format!("{i} ({c})")).collect();
                format!("the choices {}", choices.join(", "))
            };
            let why = format!("--set {id}={value}: {value} is outside {allowed}");
            return Err(failed(why.trim_end()));
        }
    }
    let free = Subject {
        path: subject.path.clone(),
        seed: subject.seed,
        settings: Vec::new(),
        opener: subject.opener.clone(),
        driver: None,
        near: false,
        at: None,
    };
    for law in laws {
        for (formulation, hypothesis) in hypotheses(&law) {
            let create = |subject: &Subject| {
                let mut random = Random::new(subject.seed, "settings");
                let draws = std::iter::once(Draw::Ordinary).chain(std::iter::repeat(Draw::Any));
                subject.accepted(&law, &formulation, hypothesis, draws, &mut random)
            };
            if let Err((raw::PILUM_E_PARAMETER, why)) = create(subject)?
                && create(&free)?.is_ok()
            {
                return Err(failed(format!(
                    "--set: `{}` under {} accepts no parameters with these values: {why}",
                    law.description().id,
                    hypothesis.name()
                )));
            }
        }
    }
    Ok(String::new())
}

impl Specimen {
    /// A law with these parameters, led along random paths.
    pub(super) fn of(
        law: LoadedLaw,
        (formulation, hypothesis): (FormulationDescription, Hypothesis),
        values: Vec<f64>,
        probe: Probe,
    ) -> Self {
        Self {
            law,
            formulation,
            hypothesis,
            values,
            probe,
            course: None,
            time_increment: 1.0,
            is_led_near: false,
            defect: OnceLock::new(),
        }
    }

    /// Law, hypothesis and parameters that are not the defaults, for messages.
    pub(super) fn name(&self) -> String {
        let parameters = self.law.description().parameters.iter().zip(&self.values);
        let values: Vec<String> = parameters
            .filter(|(p, value)| !value.is_nan() && p.default != Some(**value))
            .map(|(p, value)| format!("{} = {value}", p.id))
            .collect();
        let with = if values.is_empty() { "" } else { " with " };
        format!(
            "`{}` under {}{with}{}",
            self.law.description().id,
            self.hypothesis.name(),
            values.join(", ")
        )
    }

    /// A failure of this specimen.
    pub(super) fn fails(&self, why: impl std::fmt::Display) -> Verdict {
        failed(format!("{}: {why}", self.name()))
    }

    /// A failure of this specimen in a call that can be repeated.
    pub(super) fn fails_at(&self, start: &PointStart, why: impl std::fmt::Display) -> Verdict {
        self.recorded(start, self.fails(why))
    }

    /// A warning of this specimen in a call that can be repeated.
    pub(super) fn warns_at(&self, start: &PointStart, why: impl std::fmt::Display) -> Verdict {
        self.recorded(start, Verdict::Warning(format!("{}: {why}", self.name())))
    }

    /// A verdict with the call that it is about.
    pub(super) fn recorded(&self, start: &PointStart, verdict: Verdict) -> Verdict {
        // Without a capsule the words remain.
        match self.capsule(start, verdict.words()) {
            Some(capsule) => Verdict::At(Box::new(verdict), Box::new(capsule)),
            None => verdict,
        }
    }

    /// A failure of this specimen in a call of `init_state` for points that carry these fluxes, after
    /// one for others.
    pub(super) fn fails_to_start(
        &self,
        fluxes: &[Vec<f64>],
        form: &Form,
        before: &[Vec<f64>],
        why: impl std::fmt::Display,
    ) -> Verdict {
        let verdict = self.fails(why);
        let points = |fluxes: &[Vec<f64>]| -> Vec<PointStart> {
            let fluxes = fluxes.iter().cloned();
            let of_flux = |flux0| PointStart {
                gradient0: Vec::new(),
                gradient1: Vec::new(),
                flux0,
                state0: Vec::new(),
            };
            fluxes.map(of_flux).collect()
        };
        let capsule = Capsule::of_probe(
            &self.law,
            &self.formulation,
            (self.hypothesis, &self.values),
            (
                call_log::Function::InitState,
                Form {
                    request: 0,
                    ..*form
                },
            ),
            &points(fluxes),
            &points(before),
        );
        // Without a capsule the words remain.
        let Some(mut capsule) = capsule else {
            return verdict;
        };
        verdict.words().clone_into(&mut capsule.outcome.message);
        Verdict::At(Box::new(verdict), Box::new(capsule))
    }

    fn capsule(&self, start: &PointStart, why: &str) -> Option<Capsule> {
        let law = self.law.build(self.hypothesis, &self.values).ok()?;
        let form = self.form(0);
        // Laws of the contract are called at the time of the form, routines as in a run.
        let (time, moment) = match self.law.library().foreign() {
            Some(_) => form.when(start),
            None => (form.time, Moment::default()),
        };
        let call = PointCall {
            request: Request::Update(Operator::Consistent),
            time,
            time_increment: self.time_increment,
            gradient: start.gradient0.clone(),
            gradient_end: start.gradient1.clone(),
            flux: start.flux0.clone(),
            state: start.state0.clone(),
            moment,
            site: Site::default(),
        };
        let failure = BatchFailure {
            point: 0,
            outcome: Outcome::Ok,
            message: why.to_owned(),
            factor: None,
            claims_success: false,
            call: Some(Box::new(call)),
        };
        Capsule::of(&law, &failure, Vec::new())
    }

    /// The form of an ordinary call.
    pub(super) fn form(&self, request: u32) -> Form {
        Form {
            time_increment: self.time_increment,
            ..Form::of(request)
        }
    }

    /// An ordinary call.
    pub(super) fn call(&self, starts: &[PointStart], request: u32) -> Result<Answer, Verdict> {
        let answer = self.probe.integrate(starts, &self.form(request))?;
        if answer.status == raw::PILUM_E_INTERNAL {
            self.defect
                .get_or_init(|| answer.text().unwrap_or_default());
        }
        Ok(answer)
    }

    /// A failure of a law that calls itself defective, with what it said when it did so first.
    pub(super) fn fails_as_defective(&self, why: String) -> Verdict {
        match self.defect.get().filter(|said| !why.contains(*said)) {
            Some(said) => self.fails(format!("{why}; at first it said: {said}")),
            None => self.fails(why),
        }
    }

    /// Whether updates that double the flux take longer than they may.
    fn takes_long(&self, random: &mut Random) -> Result<bool, Verdict> {
        let Ok(Origin { start, size, .. }) = self.origin(random) else {
            return Ok(false);
        };
        let starts: Vec<PointStart> = (0..TIMED)
            .map(|_| PointStart {
                gradient1: self.direction(size, random),
                ..start.clone()
            })
            .collect();
        // Other work on the machine may hold up one series, hardly all of them.
        for _ in 0..SERIES {
            let began = Instant::now();
            self.call(&starts, raw::PILUM_REQ_FLUX)?;
            if began.elapsed() <= LONG * TIMED {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// A call over increments that take so much longer.
    pub(super) fn lasting(
        &self,
        factor: f64,
        starts: &[PointStart],
        request: u32,
    ) -> Result<Vec<PointEnd>, Verdict> {
        let form = Form {
            time_increment: factor * self.time_increment,
            ..self.form(request)
        };
        Ok(self.probe.integrate(starts, &form)?.points)
    }

    /// What one of the functions makes of the points; nothing if the law lacks it.
    pub(super) fn ask(
        &self,
        function: Function,
        starts: &[PointStart],
        form: &Form,
    ) -> Result<Vec<PointEnd>, Verdict> {
        let answer = match function {
            Function::Integrate => Some(self.probe.integrate(starts, form)?),
            Function::InitState => {
                let fluxes: Vec<Vec<f64>> = starts.iter().map(|s| s.flux0.clone()).collect();
                let form = Form {
                    request: 0,
                    ..*form
                };
                self.probe.init_state(&fluxes, &form)?
            }
        };
        Ok(answer.map_or(Vec::new(), |answer| answer.points))
    }

    /// Components of the gradient that a path may move: under plane strain, 33 stays zero.
    pub(super) fn is_free(&self, component: usize) -> bool {
        self.hypothesis != Hypothesis::PlaneStrain || component != 2
    }
}

/// Whether outputs are claimed to be valid.
pub(crate) fn is_success(status: raw::Status) -> bool {
    status == raw::PILUM_OK || status == raw::PILUM_OK_UNRELIABLE
}

/// Components of a smaller hypothesis as those of one with this many: the others are nought.
pub(super) fn longer(values: &[f64], n: usize) -> Vec<f64> {
    let mut longer = values.to_vec();
    longer.resize(n, 0.0);
    longer
}

/// The same start under that hypothesis.
pub(super) fn enlarged(start: &PointStart, n: usize) -> PointStart {
    PointStart {
        gradient0: longer(&start.gradient0, n),
        gradient1: longer(&start.gradient1, n),
        flux0: longer(&start.flux0, n),
        state0: start.state0.clone(),
    }
}

/// Whether all results are finite.
pub(crate) fn is_finite(end: &PointEnd) -> bool {
    let mut all = end.flux.iter().chain(&end.state).chain(&end.tangent);
    all.all(|value| value.is_finite())
}

/// Whether two results have the same bits.
pub(crate) fn is_same(a: &PointEnd, b: &PointEnd) -> bool {
    let bits = |end: &PointEnd| -> Vec<u64> {
        let all = end.flux.iter().chain(&end.state).chain(&end.tangent);
        all.map(|value| value.to_bits()).collect()
    };
    a.status == b.status && (!is_success(a.status) || bits(a) == bits(b))
}

/// The first point whose results differ.
pub(crate) fn first_difference(a: &[PointEnd], b: &[PointEnd]) -> Option<usize> {
    (0..a.len().max(b.len())).find(|&i| match (a.get(i), b.get(i)) {
        (Some(a), Some(b)) => !is_same(a, b),
        _ => true,
    })
}
