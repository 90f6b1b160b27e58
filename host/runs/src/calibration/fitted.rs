//! Curves computed with the values found, and the measured ones.

use super::curve::Curve;
use super::fit::Wish;
use super::misfit;
use super::model::{Model, Test};
use super::profile::Side;
use super::propagation::{Errors, Known};
use super::stage::{Group, Stage, known_to, last_stage};
use super::statistics::{of_neighbours, two_sided};
use super::systematic::{Limits, Systematic};
use crate::Error;
use crate::experiment::Rows;
use input::calibration::Variance;

/// A test next to its measured points.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Name.
    pub name: String,
    /// It was predicted, not fitted.
    pub is_predicted: bool,
    /// Its derivatives came from the rates of its law, not from differences.
    pub is_by_law: bool,
    /// Its curves.
    pub curves: Vec<FittedCurve>,
}

/// A curve next to its measured points.
#[derive(Clone, Debug)]
pub struct FittedCurve {
    /// What was measured.
    pub curve: Curve,
    /// Computed values at the measured points.
    pub computed: Vec<f64>,
    /// The computed curve.
    pub line: Vec<(f64, f64)>,
    /// Standard deviation of a new measured value at each point: of its noise, and of the computed value
    /// as far as that follows from the parameters' own. `None` if it depends on parameters that the
    /// tests do not determine: it is unbounded.
    pub deviations: Vec<Option<f64>>,
    /// Root of the mean square of computed less measured values, in the unit of the curve.
    pub rms: f64,
    /// The same of residuals over their noise as given.
    pub relative: f64,
    /// Correlation of neighbouring residuals.
    pub neighbours: f64,
    /// How its residuals are no noise; nothing of a curve that is predicted.
    pub systematic: Systematic,
    /// R², the part of what measured values vary by that computed ones explain; `None` where they do not vary.
    pub explained: Option<f64>,
    /// Part of the measured points inside their interval of prediction, of those that have one.
    pub inside: Option<f64>,
}

/// Notes about the tests.
#[derive(Debug, Default)]
pub(super) struct Said {
    /// Bad fits, and residuals that are not noise.
    pub(super) bad: Vec<String>,
    /// All else.
    pub(super) others: Vec<String>,
}

/// How measured values scatter about the computed ones.
#[derive(Clone, Copy, Debug)]
struct Scatter {
    variance: f64,
    quantile: f64,
}

impl Scatter {
    /// Standard deviation of a new measured value at each point of a test.
    fn deviations(&self, test: &Test, known: &[Known]) -> Vec<Option<f64>> {
        let noise = test.curves.iter().flat_map(|curve| &curve.deviations);
        let of_known = |(known, noise): (&Known, &f64)| match known {
            Known::Variance(variance) if self.quantile.is_finite() => {
                Some((self.variance * (variance + noise * noise)).sqrt())
            }
            _ => None,
        };
        known.iter().zip(noise).map(of_known).collect()
    }
}

/// Part of a prediction's deviation from which on a parameter without a limit is named.
const COUNTS: f64 = 0.1;
/// A prediction depends on what is not determined if it changes by more than this part of its noise
/// where that goes once through the range of a parameter.
const LITTLE: f64 = 0.1;
/// Sums of gradients are known to this many times what derivatives of the residuals are.
const CANCEL: f64 = 10.0;

/// All tests with the values found, those that are predicted included, and what is to be reported of them.
///
/// # Errors
/// Stopped; a test that cannot be computed with the values found.
pub(super) fn fitted(
    model: &mut Model,
    stages: &[Stage],
    errors: &Errors,
    counted: &[f64],
    wish: Wish,
) -> Result<(Vec<Fitted>, Said), Error> {
    let scatter = scatter(model, errors, counted, wish)?;
    let of = errors.of_parameters();
    let fitted = model.tests.iter().filter(|test| !test.is_predicted);
    let limits = Limits::of(fitted.flat_map(|test| &test.curves));
    let mut said = Said::default();
    let mut all = Vec::new();
    for number in 0..model.tests.len() {
        let (computed, rows) = computed(model, number, counted)?;
        let gradients = model.gradients(number, counted, &of)?;
        let held = on_bounds(model, stages, number);
        let by_held = model.gradients(number, counted, &held)?;
        let test = &model.tests[number];
        let known = known(model, number, (errors, &of, &gradients), scatter);
        let deviations = scatter.deviations(test, &known);
        let others = &mut said.others;
        others.extend(without_interval(model, test, &known));
        let own = (of.as_slice(), gradients.as_slice());
        others.extend(without_limit(model, stages, test, own, &deviations));
        others.extend(on_a_bound(model, test, (&held, &by_held), &deviations));
        let values_found = model.values(counted);
        let values = test.of_curves(&computed).zip(test.of_curves(&deviations));
        let none = |_| Error::internal(format!("a curve of test `{}` that is none", test.name));
        let mut curves = Vec::new();
        for ((curve, computed), (_, deviations)) in values {
            let line = curve.line(&rows, &values_found).map_err(none)?;
            curves.push(curve_of(curve, computed, line, deviations, scatter));
        }
        if !test.is_predicted {
            judge(test, &mut curves, limits, &mut said.bad);
        }
        all.push(Fitted {
            name: test.name.clone(),
            is_predicted: test.is_predicted,
            is_by_law: test.is_by_law,
            curves,
        });
    }
    Ok((all, said))
}

/// A test computed with the values found: values at the measured points, and all rows.
fn computed(model: &mut Model, number: usize, counted: &[f64]) -> Result<(Vec<f64>, Rows), Error> {
    let computed = model.computed(number, counted)?;
    let rows = model.rows(number, counted)?;
    if let (Ok(computed), Ok(rows)) = (computed, rows) {
        return Ok((computed, rows));
    }
    let why = model.first_failure.clone().unwrap_or_default();
    let name = &model.tests[number].name;
    let message = format!("test `{name}` cannot be computed with the values found: {why}");
    Err(Error::usage(message))
}

/// Notes which curves of a test are fitted badly, or have residuals that are not noise.
fn judge(test: &Test, curves: &mut [FittedCurve], limits: Limits, bad: &mut Vec<String>) {
    for (fitted, at_start) in curves.iter_mut().zip(&test.at_start) {
        let (curve, computed) = (&fitted.curve, &fitted.computed);
        if misfit::is_bad(curve, computed) {
            bad.push(misfit::in_words(&test.name, curve, computed, at_start));
        }
        fitted.systematic = Systematic::of(curve, computed, limits);
        bad.extend(fitted.systematic.in_words(&test.name, fitted));
    }
}

/// Uncertainty of the computed values of a test, curve by curve, since their units differ.
fn known(
    model: &Model,
    number: usize,
    (errors, of, gradients): (&Errors, &[usize], &[Option<Vec<f64>>]),
    scatter: Scatter,
) -> Vec<Known> {
    let test = &model.tests[number];
    let blind = model.blind_in(&[number]);
    let mut first = 0;
    let of_curve = |curve: &Curve| {
        let own = first..first + curve.points.len();
        first = own.end;
        let columns = gradients
            .iter()
            .map(|column| Some(&column.as_ref()?[own.clone()]));
        let columns: Vec<Option<&[f64]>> = columns.collect();
        let noise = scatter.variance.sqrt();
        let exact = blind * curve.largest();
        let least = curve
            .deviations
            .iter()
            .map(|d| (LITTLE * noise * d).max(exact));
        errors.of_values(of, &columns, &least.collect::<Vec<_>>(), CANCEL * blind)
    };
    test.curves.iter().flat_map(of_curve).collect()
}

fn curve_of(
    curve: &Curve,
    computed: &[f64],
    line: Vec<(f64, f64)>,
    deviations: &[Option<f64>],
    scatter: Scatter,
) -> FittedCurve {
    let n = curve.points.len();
    let root_mean_square = |values: &mut dyn Iterator<Item = f64>| {
        (values.map(|v| v * v).sum::<f64>() / n.max(1) as f64).sqrt()
    };
    let differences = || curve.points.iter().zip(computed).map(|((_, y), c)| c - y);
    let residuals = curve.residuals(computed);
    let factor = curve.weight.sqrt();
    let with_interval = differences().zip(deviations);
    let with_interval: Vec<bool> = with_interval
        .filter_map(|(d, deviation)| Some(d.abs() <= scatter.quantile * (*deviation)?))
        .collect();
    let inside = with_interval.iter().filter(|inside| **inside).count();
    FittedCurve {
        computed: computed.to_vec(),
        line,
        deviations: deviations.to_vec(),
        rms: root_mean_square(&mut differences()),
        relative: root_mean_square(&mut residuals.iter().map(|r| r / factor)),
        neighbours: of_neighbours(&residuals),
        systematic: Systematic::default(),
        explained: misfit::explained(curve, computed),
        inside: (!with_interval.is_empty()).then(|| inside as f64 / with_interval.len() as f64),
        curve: curve.clone(),
    }
}

/// The scatter of all measured values that were fitted, about what is computed with the values found.
fn scatter(
    model: &mut Model,
    errors: &Errors,
    counted: &[f64],
    wish: Wish,
) -> Result<Scatter, Error> {
    if wish.variance == Variance::Given {
        return Ok(Scatter {
            variance: 1.0,
            quantile: two_sided(wish.confidence, None),
        });
    }
    let fitted = (0..model.tests.len()).filter(|&test| !model.tests[test].is_predicted);
    let all = Group {
        name: String::new(),
        parameters: Vec::new(),
        tests: fitted.collect(),
    };
    let (mut sum, mut n) = (0.0, 0);
    for &test in &all.tests {
        if let Ok(computed) = model.computed(test, counted)? {
            for (curve, own) in model.tests[test].of_curves(&computed) {
                sum += curve
                    .residuals(own)
                    .iter()
                    .map(|r| r * r / curve.weight)
                    .sum::<f64>();
                n += own.len();
            }
        }
    }
    let degrees = n.saturating_sub(errors.n_determined());
    let floor = known_to(model, &all).floor;
    Ok(Scatter {
        variance: (sum / degrees.max(1) as f64).max(floor),
        quantile: two_sided(wish.confidence, Some(degrees)),
    })
}

/// Names of parameters.
fn names(model: &Model, parameters: &[usize]) -> String {
    let names = parameters
        .iter()
        .map(|&p| format!("`{}`", model.parameters[p].name));
    names.collect::<Vec<_>>().join(" and ")
}

/// Whether a prediction changes by more than a part of its deviation where a parameter changes by so much.
fn counts(gradient: Option<&Vec<f64>>, change: f64, deviations: &[Option<f64>]) -> bool {
    let mut pairs = gradient.into_iter().flatten().zip(deviations);
    pairs.any(|(g, d)| d.is_some_and(|d| (g * change).abs() > COUNTS * d))
}

/// Curves with points whose prediction depends on what is not determined.
fn without_interval(model: &Model, test: &Test, known: &[Known]) -> Vec<String> {
    let word = |(curve, known): (&Curve, &[Known])| {
        let mut parameters: Vec<usize> = Vec::new();
        let open = known.iter().filter_map(|known| match known {
            Known::Open(of) => Some(of),
            Known::Variance(_) => None,
        });
        let n = open.inspect(|of| parameters.extend(*of)).count();
        parameters.sort_unstable();
        parameters.dedup();
        (n > 0).then(|| {
            format!(
                "{}, {}: {n} of {} points have no interval of prediction: what is computed there depends on {}, which \
                 the tests do not determine, and may be anything",
                test.name,
                curve.y,
                known.len(),
                names(model, &parameters)
            )
        })
    };
    test.of_curves(known).filter_map(word).collect()
}

/// Parameters that a prediction depends on and whose profile has a side without a limit: the covariance
/// knows nothing of that.
fn without_limit(
    model: &Model,
    stages: &[Stage],
    test: &Test,
    (of, gradients): (&[usize], &[Option<Vec<f64>>]),
    deviations: &[Option<f64>],
) -> Option<String> {
    let error = |parameter: usize| {
        let (stage, place) = last_stage(stages, parameter)?;
        let profile = stages[stage].profiles.get(place)?;
        let mut sides = profile.sides.iter();
        let is_open = sides.any(|side| !matches!(side, Side::Limit(_)));
        let error = stages[stage].error(place)?;
        (profile.points.len() > 1 && is_open).then_some(error)
    };
    let named = of.iter().zip(gradients).filter(|(parameter, gradient)| {
        let error = error(**parameter);
        error.is_some_and(|error| counts(gradient.as_ref(), error, deviations))
    });
    let named: Vec<usize> = named.map(|(parameter, _)| *parameter).collect();
    (test.is_predicted && !named.is_empty()).then(|| {
        format!(
            "{}: what is computed depends on {}, which has an interval without an end: the interval of prediction, from \
             the covariance alone, is too narrow",
            test.name,
            names(model, &named)
        )
    })
}

/// Parameters that ended on a bound, where a test is predicted.
fn on_bounds(model: &Model, stages: &[Stage], test: usize) -> Vec<usize> {
    let is_on_bound = |parameter: &usize| {
        let last = last_stage(stages, *parameter);
        last.is_some_and(|(stage, place)| stages[stage].on_bound[place] != [false, false])
    };
    let all = (0..model.parameters.len()).filter(|_| model.tests[test].is_predicted);
    all.filter(is_on_bound).collect()
}

/// Parameters on a bound that a prediction depends on: they have no error, and are taken as known.
fn on_a_bound(
    model: &Model,
    test: &Test,
    (held, gradients): (&[usize], &[Option<Vec<f64>>]),
    deviations: &[Option<f64>],
) -> Option<String> {
    let named = held.iter().zip(gradients).filter(|(parameter, gradient)| {
        let [low, high] = model.parameters[**parameter].counted_range();
        counts(gradient.as_ref(), high - low, deviations)
    });
    let named: Vec<usize> = named.map(|(parameter, _)| *parameter).collect();
    (!named.is_empty()).then(|| {
        format!(
            "{}: what is computed depends on {}, which ended on a bound: the interval of prediction takes the bound for a \
             value that is known, and may be too narrow",
            test.name,
            names(model, &named)
        )
    })
}
