//! Laws with sample parameters, led along random paths.

use super::random::Random;
use super::{Found, Subject, Verdict, failed, refusal, skipped};
use abi::Hypothesis;
use abi::raw;
use law::probe::{Answer, CreateForm, Form, NO_OUTCOME, PointEnd, PointStart, Probe};
use law::{FormulationDescription, LoadedLaw, ParameterDescription};
use text::suggestion;

/// Draws of parameters until a law must have accepted one.
const MOST_DRAWS: usize = 500;
/// Points that walk side by side.
const WALKERS: usize = 16;
/// Increments in one direction.
const STRAIGHT: usize = 6;

/// A law under one hypothesis with one set of parameters.
#[derive(Debug)]
pub(super) struct Specimen {
    pub(super) law: LoadedLaw,
    pub(super) formulation: FormulationDescription,
    pub(super) hypothesis: Hypothesis,
    pub(super) values: Vec<f64>,
    pub(super) probe: Probe,
}

/// One increment of a point that ended well.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub(super) start: PointStart,
    pub(super) end: PointEnd,
    /// Largest entry of the elastic operator at the start of the path.
    pub(super) stiffness: f64,
}

/// Steps of a path, and the outcomes that ended parts of it.
#[derive(Debug, Default)]
pub(super) struct Walk {
    pub(super) steps: Vec<Step>,
    pub(super) refusals: Vec<(raw::Status, String)>,
    /// Starts of the points that are said to have succeeded, finite or not.
    pub(super) successes: Vec<PointStart>,
}

impl Walk {
    /// Why a part of the path ended first; empty if none did.
    pub(super) fn why(&self) -> String {
        let first = self.refusals.first();
        first.map_or(String::new(), |(status, text)| refusal(*status, Some(text)))
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
pub(super) fn create_form<'a>(
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
        n_components: hypothesis.n_components(),
        n_states: formulation.internal_variables.len(),
        lacks_tangent: formulation.tangent == law::Tangent::None,
    }
}

/// Which parameters are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Draw {
    /// The most ordinary ones.
    Ordinary,
    /// Any, but choices stay at their defaults: the other labels may stand for approximations.
    DefaultChoices,
    /// Any.
    Any,
}

/// A value for a parameter.
fn draw(p: &ParameterDescription, random: &mut Random, how: Draw) -> f64 {
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
    /// Every law under every hypothesis with so many sets of parameters. The first set is the
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
        let mut specimens = Vec::new();
        for law in self.laws()? {
            for (formulation, hypothesis) in hypotheses(&law) {
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
                return Ok(Ok(Specimen {
                    law: law.clone(),
                    formulation: formulation.clone(),
                    hypothesis,
                    values,
                    probe,
                }));
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
    /// Law, hypothesis and parameters, for messages.
    pub(super) fn name(&self) -> String {
        let parameters = self.law.description().parameters.iter().zip(&self.values);
        let values: Vec<String> = parameters
            .filter(|(p, value)| !value.is_nan() && p.default != Some(**value))
            .map(|(p, value)| format!("{} = {value}", p.id))
            .collect();
        format!(
            "`{}` under {} with {}",
            self.law.description().id,
            self.hypothesis.name(),
            values.join(", ")
        )
    }

    /// A failure of this specimen.
    pub(super) fn fails(&self, why: impl std::fmt::Display) -> Verdict {
        failed(format!("{}: {why}", self.name()))
    }

    /// An ordinary call.
    pub(super) fn call(&self, starts: &[PointStart], request: u32) -> Result<Answer, Verdict> {
        Ok(self.probe.integrate(starts, &Form::of(request))?)
    }

    /// Components of the gradient that a path may move: under plane strain, 33 stays zero.
    pub(super) fn is_free(&self, component: usize) -> bool {
        self.hypothesis != Hypothesis::PlaneStrain || component != 2
    }

    /// Internal variables of a point with this flux; in words why the law cannot start there.
    fn initial_state(&self, flux: &[f64]) -> Result<Result<Vec<f64>, String>, Verdict> {
        let answer = self.probe.init_state(&[flux.to_vec()], &Form::of(0))?;
        Ok(match answer {
            None => {
                let variables = self.formulation.internal_variables.iter();
                Ok(variables.map(|v| v.initial_value).collect())
            }
            Some(answer) => {
                let why = refusal(answer.status, answer.text().as_deref());
                let state = answer.points.into_iter().next().map(|point| point.state);
                state
                    .filter(|_| answer.status == raw::PILUM_OK)
                    .ok_or_else(|| format!("`init_state` gave {why}"))
            }
        })
    }

    /// A compressed or unstressed point before anything has happened, and the largest entry of its
    /// elastic operator.
    fn origin(&self, random: &mut Random) -> Result<(PointStart, f64, f64), Verdict> {
        let n = self.probe.n_components();
        let mut why = None;
        for attempt in 0..20 {
            let pressure = if attempt % 4 == 3 {
                0.0
            } else {
                random.logarithmic(1.0, 1000.0)
            };
            let n_normal = if self.hypothesis.is_interface() { 1 } else { 3 };
            let flux: Vec<f64> = (0..n)
                .map(|c| if c < n_normal { -pressure } else { 0.0 })
                .collect();
            let state0 = match self.initial_state(&flux)? {
                Ok(state0) => state0,
                Err(refused) => {
                    why = why.or(Some(refused));
                    continue;
                }
            };
            let start = PointStart {
                gradient0: vec![0.0; n],
                gradient1: vec![0.0; n],
                flux0: flux,
                state0,
            };
            let answer = self.call(
                std::slice::from_ref(&start),
                raw::PILUM_REQ_FLUX | raw::PILUM_REQ_ELASTIC,
            )?;
            let stiffness = answer.points[0]
                .tangent
                .iter()
                .fold(0.0, |most: f64, k| most.max(k.abs()));
            let status = answer.points[0].status;
            if is_success(status) && stiffness > 0.0 && stiffness.is_finite() {
                return Ok((start, stiffness, pressure.max(10.0) / stiffness));
            }
            // The first reason, since a law that has panicked says no more why.
            why = why.or_else(|| {
                Some(if is_success(status) {
                    format!("the largest entry of the elastic operator is {stiffness}")
                } else {
                    // Where a call is refused as a whole, no outcomes are written.
                    let status = if status == NO_OUTCOME {
                        answer.status
                    } else {
                        status
                    };
                    refusal(status, answer.text().as_deref())
                })
            });
        }
        Err(skipped(format!(
            "{}: no initial stress was accepted: {}",
            self.name(),
            why.unwrap_or_default()
        )))
    }

    /// Leads points along paths of random straight pieces, with tangents.
    pub(super) fn walk(&self, n_increments: usize, random: &mut Random) -> Result<Walk, Verdict> {
        let n = self.probe.n_components();
        let mut walk = Walk::default();
        let mut walkers = (0..WALKERS)
            .map(|_| self.origin(random))
            .collect::<Result<Vec<_>, _>>()?;
        let mut moves = vec![vec![0.0; n]; WALKERS];
        for increment in 0..n_increments {
            if increment % STRAIGHT == 0 {
                for (one, (_, _, size)) in moves.iter_mut().zip(&walkers) {
                    let length = size * random.logarithmic(0.03, 10.0);
                    for (c, value) in one.iter_mut().enumerate() {
                        let free = self.is_free(c);
                        *value = if free {
                            length * random.between(-1.0, 1.0)
                        } else {
                            0.0
                        };
                    }
                }
            }
            for ((start, ..), step) in walkers.iter_mut().zip(&moves) {
                start.gradient1 = start
                    .gradient0
                    .iter()
                    .zip(step)
                    .map(|(g, d)| g + d)
                    .collect();
            }
            let starts: Vec<PointStart> = walkers.iter().map(|(start, ..)| start.clone()).collect();
            let answer = self.call(&starts, raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT)?;
            let text = answer.text().unwrap_or_default();
            for ((start, stiffness, size), end) in walkers.iter_mut().zip(answer.points) {
                let success = is_success(end.status);
                if success {
                    walk.successes.push(start.clone());
                } else {
                    walk.refusals.push((end.status, text.clone()));
                }
                if success && is_finite(&end) {
                    let next = PointStart {
                        gradient0: start.gradient1.clone(),
                        gradient1: start.gradient1.clone(),
                        flux0: end.flux.clone(),
                        state0: end.state.clone(),
                    };
                    let start = std::mem::replace(start, next);
                    let stiffness = *stiffness;
                    walk.steps.push(Step {
                        start,
                        end,
                        stiffness,
                    });
                } else {
                    (*start, *stiffness, *size) = self.origin(random)?;
                }
            }
        }
        Ok(walk)
    }

    /// Starts of steps that succeed together, at most so many.
    pub(super) fn points(&self, n: usize, random: &mut Random) -> Result<Vec<PointStart>, Verdict> {
        let walk = self.walk(n.div_ceil(WALKERS) + STRAIGHT, random)?;
        let why = walk.why();
        let mut starts = walk.successes;
        // The last ones are the farthest from the elastic beginning.
        starts.reverse();
        starts.truncate(n);
        if starts.is_empty() {
            return Err(skipped(format!(
                "{}: no increment succeeded: {why}",
                self.name()
            )));
        }
        Ok(starts)
    }
}

/// Whether outputs are claimed to be valid.
pub(super) fn is_success(status: raw::Status) -> bool {
    status == raw::PILUM_OK || status == raw::PILUM_OK_UNRELIABLE
}

/// Whether all results are finite.
pub(super) fn is_finite(end: &PointEnd) -> bool {
    let mut all = end.flux.iter().chain(&end.state).chain(&end.tangent);
    all.all(|value| value.is_finite())
}

/// Whether two results have the same bits.
pub(super) fn is_same(a: &PointEnd, b: &PointEnd) -> bool {
    let bits = |end: &PointEnd| -> Vec<u64> {
        let all = end.flux.iter().chain(&end.state).chain(&end.tangent);
        all.map(|value| value.to_bits()).collect()
    };
    a.status == b.status && (!is_success(a.status) || bits(a) == bits(b))
}

/// The first point whose results differ.
pub(super) fn first_difference(a: &[PointEnd], b: &[PointEnd]) -> Option<usize> {
    (0..a.len().max(b.len())).find(|&i| match (a.get(i), b.get(i)) {
        (Some(a), Some(b)) => !is_same(a, b),
        _ => true,
    })
}
