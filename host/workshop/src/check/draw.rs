//! Values of parameters: the most ordinary ones, random ones, and those that the user gives.

use super::random::Random;
use super::specimen::{Specimen, create_form, hypotheses};
use super::{Found, Subject, Verdict, failed, refusal_in};
use abi::Hypothesis;
use abi::raw;
use law::{FormulationDescription, LoadedLaw, ParameterDescription};
use text::suggestion;

/// Draws of parameters until a law must have accepted one.
const MOST_DRAWS: usize = 500;

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
        how: Draw,
        n_sets: usize,
        random: &mut Random,
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
                refusal_in(created.status, &created.message)
            };
            last = (created.status, why);
            if created.status != raw::PILUM_E_PARAMETER {
                break;
            }
        }
        Ok(Err(last))
    }
}

/// Whether a setting names one of the parameters, with a value that its bounds and choices admit.
pub(super) fn is_known(
    id: &str,
    value: f64,
    parameters: &[&ParameterDescription],
    nobody: &str,
) -> Result<(), String> {
    let mut declared = parameters.iter().filter(|p| p.id == id).peekable();
    if declared.peek().is_none() {
        let mut ids: Vec<&str> = parameters.iter().map(|p| p.id.as_str()).collect();
        ids.sort_unstable();
        ids.dedup();
        let known = suggestion(id, ids);
        return Err(format!("--set {id}={value}: {nobody} `{id}`: {known}"));
    }
    let admits = |p: &&&ParameterDescription| {
        let is_choice = value.fract() == 0.0 && value < p.choices.len() as f64;
        let is_left_out = p.optional && value.is_nan();
        is_left_out || p.bounds.contain(value) && (p.choices.is_empty() || is_choice)
    };
    let Some(p) = declared.find(|p| !admits(p)) else {
        return Ok(());
    };
    let allowed = if p.choices.is_empty() {
        let unit = p.unit.trim_matches('-');
        format!("{} {unit}", p.bounds)
    } else {
        let numbered = p.choices.iter().enumerate();
        let choices: Vec<String> = numbered.map(|(i, c)| format!("{i} ({c})")).collect();
        format!("the choices {}", choices.join(", "))
    };
    let why = format!("--set {id}={value}: {value} is outside {allowed}");
    Err(why.trim_end().to_owned())
}

/// Whether the subject's settings name parameters of its laws, with values that these accept.
pub(super) fn settings_fit(subject: &Subject) -> Found {
    // What else is wrong with the library is for the checks to say.
    let Ok(laws) = subject.laws() else {
        return Ok(String::new());
    };
    let parameters: Vec<_> = laws
        .iter()
        .flat_map(|law| &law.description().parameters)
        .collect();
    for (id, value) in &subject.settings {
        let nobody = "no law of this library has a parameter";
        is_known(id, *value, &parameters, nobody).map_err(failed)?;
    }
    let free = Subject {
        settings: Vec::new(),
        ..subject.clone()
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
