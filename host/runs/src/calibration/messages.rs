//! Notes of a calibration: undetermined parameters and the reasons.

use super::coordinates::Parameter;
use super::least_squares::End;
use super::misfit;
use super::model::{Model, Subject};
use super::profile::Side;
use super::propagation::Errors;
use super::stage::Stage;
use crate::Error;
use crate::experiment::{Rows, digits};
use input::calibration::{Scale, Variance};

/// Correlation beyond which two parameters are reported to be told together only.
const CORRELATED: f64 = 0.95;
/// An interval that is wider than this factor, or than this part of the value, is wide.
const WIDE_FACTOR: f64 = 4.0;
/// Part of a direction below which a parameter is not named.
const PART: f64 = 0.1;

const EXACT: &str = "the residuals are smaller than what computed values are known to, as those of points that the law \
                     itself has made: nothing is told of the scatter of measured values, and intervals are those of \
                     the numbers";
const NO_FREEDOM: &str =
    "there are no more measured points than parameters: nothing is left to tell how exact they are";

/// Notes of a stage, the most important first.
///
/// # Errors
/// Stopped.
pub(super) fn of_stage(
    model: &mut Model,
    stage: &Stage,
    values: &[f64],
    variance: Variance,
) -> Result<Vec<String>, Error> {
    let mut words = Vec::new();
    let own = stage.group.parameters.iter();
    let parameters: Vec<Parameter> = own.map(|&p| model.parameters[p].clone()).collect();
    if stage.is_exact && variance == Variance::Estimated {
        words.push(EXACT.to_owned());
    }
    let is_bad = is_bad(model, stage);
    words.extend(of_end(stage.end).map(str::to_owned));
    for (place, parameter) in parameters.iter().enumerate() {
        if !stage.seen[place] {
            let asked = (parameter, stage.group.parameters[place]);
            words.push(unseen(model, &stage.group.tests, asked, values, is_bad)?);
            continue;
        }
        let ends = ["least", "greatest"].iter().zip(parameter.bounds);
        let is_on = ends.zip(stage.on_bound[place]).find(|(_, is_on)| *is_on);
        words.extend(is_on.map(|((which, bound), _)| at_end(parameter, which, bound)));
    }
    of_directions(stage, &parameters, &mut words);
    for (place, parameter) in parameters.iter().enumerate() {
        if stage.seen[place] {
            of_interval(stage, place, parameter, &mut words);
        }
    }
    of_optima(stage, &parameters, &mut words);
    if stage.failures > 0 {
        let why = model.first_failure.as_deref();
        words.push(format!(
            "{} steps of the search were shortened because a test could not be computed, such as: {}",
            stage.failures,
            why.unwrap_or("a curve ends too early")
        ));
    }
    words.extend(of_noise(model, stage, variance));
    if stage.degrees == 0 {
        words.push(NO_FREEDOM.to_owned());
    }
    Ok(words)
}

/// How the search ended, if not at the best values.
fn of_end(end: End) -> Option<&'static str> {
    match end {
        End::Converged => None,
        End::Exhausted => Some(
            "the search was given up after as many iterations as are allowed: these are not the best values",
        ),
        End::Barred => Some(
            "the search ends at values beyond which a test cannot be computed: the best ones may lie there; another \
             `start`, or `min` and `max` that keep what the law refuses out",
        ),
        End::NoDerivatives => Some(
            "at the values found a small change of a parameter leads to tests that cannot be computed: the search ends \
             there",
        ),
        End::Stalled => Some(
            "the search ends where no step, however short, makes the sum of squares smaller: computed curves have a \
             kink there, or are not exact enough (more increments, tighter tolerances, another `difference`)",
        ),
    }
}

/// Parameters that only count together, or nearly so.
fn of_directions(stage: &Stage, parameters: &[Parameter], words: &mut Vec<String>) {
    for direction in &stage.covariance.blind {
        let places = stage.covariance.variables.iter().zip(direction);
        let parts: Vec<(&Parameter, f64)> = places
            .filter(|(place, part)| part.abs() >= PART && stage.answers[**place] > 0.0)
            .map(|(&place, part)| (&parameters[place], part / stage.answers[place]))
            .collect();
        if parts.len() > 1 {
            words.push(together(&parts));
        }
    }
    for a in 0..parameters.len() {
        for b in 0..a {
            let correlation = stage.covariance.correlation(a, b);
            let Some(rho) = correlation.filter(|r| r.abs() > CORRELATED) else {
                continue;
            };
            let how = if rho > 0.0 {
                "rise together"
            } else {
                "one rises as the other falls"
            };
            words.push(format!(
                "`{}` and `{}` are told together rather than each (correlation {rho:.3}): {how} with hardly any \
                 change of the curves; fix one of them, or add a test that parts them",
                parameters[b].name, parameters[a].name
            ));
        }
    }
}

/// An interval of a parameter that is open, or wide.
fn of_interval(stage: &Stage, place: usize, parameter: &Parameter, words: &mut Vec<String>) {
    if let Some(profile) = stage.profiles.get(place).filter(|p| p.points.len() > 1) {
        let sides = profile.sides.into_iter().zip(stage.on_bound[place]);
        let open = sides.enumerate().filter(|(_, (_, on_bound))| !on_bound);
        words.extend(open.filter_map(|(number, (side, _))| open_side(parameter, number, side)));
    }
    let Some(error) = stage.error(place) else {
        return;
    };
    let half = stage.quantile * error;
    let is_wide = match parameter.scale {
        Scale::Log => 2.0 * half > WIDE_FACTOR.ln(),
        // No offset at all is as good an answer as any.
        Scale::Linear if parameter.of_curve.is_some() => false,
        Scale::Linear => {
            let value = parameter.value(stage.best[place]);
            half * parameter.slope(value) > value.abs()
        }
    };
    if is_wide && half.is_finite() {
        let [low, high] = [-half, half].map(|d| digits(parameter.value(stage.best[place] + d)));
        words.push(format!(
            "`{}` is told poorly: {low} to {high}",
            parameter.name
        ));
    }
}

/// Other optima, and starts that led nowhere.
fn of_optima(stage: &Stage, parameters: &[Parameter], words: &mut Vec<String>) {
    let others = stage.optima.iter().skip(1);
    let (as_good, worse): (Vec<_>, Vec<_>) = others.partition(|optimum| optimum.is_as_good);
    for optimum in as_good {
        words.push(format!(
            "another set of values fits as well (sum of squares {} against {}): {}; what parts the two is not in these \
             tests",
            digits(optimum.sum),
            digits(stage.sum),
            list(parameters, &optimum.u)
        ));
    }
    let n = stage.landings.len();
    let landings = stage.landings.iter();
    let nowhere = landings.filter(|landing| landing.to.is_none()).count();
    if let Some(first) = worse.first() {
        words.push(format!(
            "of {} starts {} led to worse optima, such as {} (sum of squares {} against {})",
            n - nowhere,
            worse.iter().map(|optimum| optimum.times).sum::<usize>(),
            list(parameters, &first.u),
            digits(first.sum),
            digits(stage.sum)
        ));
    }
    if 2 * nowhere > n {
        words.push(format!(
            "{nowhere} of {n} places that the search was to start from are values with which a test cannot be computed: \
             `min` and `max` nearer to each other would spare them"
        ));
    }
    if stage.is_renewed {
        words.push(
            "a profile led to a better place than the starts had: more `starts` may find others"
                .to_owned(),
        );
    }
}

/// Residuals of another size than the noise that is given.
fn of_noise(model: &Model, stage: &Stage, variance: Variance) -> Option<String> {
    let tests = stage.group.tests.iter();
    let mut curves = tests.flat_map(|&test| &model.tests[test].curves);
    let is_given = variance == Variance::Given || curves.all(|curve| curve.is_noise_given);
    if !is_given || stage.degrees == 0 {
        return None;
    }
    let ratio = (stage.plain_sum / stage.degrees as f64).sqrt();
    let (least, believed) = match variance {
        Variance::Given => (0.5, "the intervals believe the noise"),
        // Where only proportions are believed, a file may well give too much.
        Variance::Estimated => (0.0, "the intervals take all of them for noise"),
    };
    (!(least..=2.0).contains(&ratio)).then(|| {
        format!(
            "residuals are {ratio:.2} times the noise that is given: either that is not the noise, or the law does \
             not follow the tests; {believed}"
        )
    })
}

/// Ratio of two standard errors that is worth a word.
const WIDER: f64 = 1.1;

/// Report on held parameters of earlier stages: how much of their errors goes into those of later ones.
pub(super) fn of_stages(
    model: &Model,
    stages: &[Stage],
    places: &[(usize, usize)],
    errors: &Errors,
) -> Vec<String> {
    let mut words = vec![
        "an interval of a parameter holds for the values of the parameters that its stage did not fit; a last stage with all of \
         them gives intervals that hold together. Intervals of prediction have the errors of all stages"
            .to_owned(),
    ];
    for (parameter, &(number, place)) in places.iter().enumerate() {
        let stage = &stages[number];
        let Some(own) = stage.covariance.variance(place) else {
            continue;
        };
        let name = &model.parameters[parameter].name;
        match errors.of_parameter(parameter) {
            None => words.push(format!(
                "stage `{}`: `{name}` follows what an earlier stage does not determine: its interval holds for the values \
                 held there, and no others",
                stage.group.name
            )),
            Some(all) if (all / own).sqrt() > WIDER => words.push(format!(
                "stage `{}`: with the errors of the values that are held, the standard error of `{name}` is {:.1} times that of \
                 its interval",
                stage.group.name,
                (all / own).sqrt()
            )),
            Some(_) => {}
        }
    }
    words
}

/// Whether a curve of the stage is not followed at all.
fn is_bad(model: &Model, stage: &Stage) -> bool {
    let mut residuals = stage.residuals.iter();
    let mut curves = stage
        .group
        .tests
        .iter()
        .flat_map(|&test| &model.tests[test].curves);
    curves.any(|curve| {
        let root = curve.weight.sqrt();
        let points = curve.points.iter().zip(&curve.deviations);
        let computed: Vec<f64> = points
            .zip(residuals.by_ref())
            .map(|(((_, y), deviation), r)| y + r * deviation / root)
            .collect();
        misfit::is_bad(curve, &computed)
    })
}

/// A side of a profile without a limit, and why; `None` if it has one.
fn open_side(parameter: &Parameter, number: usize, side: Side) -> Option<String> {
    let way = ["downwards", "upwards"][number];
    let name = &parameter.name;
    let shown = |u: f64| digits(parameter.value(u));
    let none = |why: String| {
        format!("the tests set `{name}` no limit {way}: the best fit stays as good {why}")
    };
    let not_known = |u: f64, why: &str| {
        format!(
            "how far `{name}` may go {way} is not known: as good up to {}, {why}",
            shown(u)
        )
    };
    match side {
        Side::Limit(_) | Side::Unknown => None,
        Side::Bound => {
            let bound = digits(parameter.bounds[number]);
            Some(none(format!("up to its bound {bound}")))
        }
        Side::Flat(u) => Some(none(format!("as far as it was followed, {}", shown(u)))),
        Side::Barred(u) => Some(not_known(
            u,
            "and beyond a test cannot be computed: other parameters fixed, or `min` and `max` that the law can follow",
        )),
        Side::Unfinished(u) => Some(not_known(
            u,
            "where the profile was left after as many points as are spent on it",
        )),
    }
}

/// Values of parameters, as a list.
fn list(parameters: &[Parameter], u: &[f64]) -> String {
    let pair = |(p, u): (&Parameter, &f64)| format!("{} = {}", p.name, digits(p.value(*u)));
    parameters
        .iter()
        .zip(u)
        .map(pair)
        .collect::<Vec<_>>()
        .join(", ")
}

fn at_end(parameter: &Parameter, which: &str, bound: f64) -> String {
    format!(
        "`{}` ends on its {which} value, {}: there is no interval for it, and those of the others hold for that value",
        parameter.name,
        digits(bound)
    )
}

/// Parameters that only count together.
fn together(parts: &[(&Parameter, f64)]) -> String {
    let names: Vec<String> = parts.iter().map(|(p, _)| format!("`{}`", p.name)).collect();
    let largest = parts
        .iter()
        .fold(0.0_f64, |largest, (_, part)| largest.max(part.abs()));
    let are_logarithms = parts.iter().all(|(p, _)| p.scale == Scale::Log);
    let how = if let ([a, b], true) = (parts, are_logarithms) {
        // ln a and ln b go together as s : t; a^t/b^s stays.
        let ratio = -a.1 / b.1;
        if (ratio - 1.0).abs() < 0.02 {
            format!(": only their product {} {}", a.0.name, b.0.name)
        } else if (ratio + 1.0).abs() < 0.02 {
            format!(": only their ratio {}/{}", a.0.name, b.0.name)
        } else {
            format!(": only {} {}^{:.2}", a.0.name, b.0.name, ratio)
        }
    } else {
        let part = |(p, part): &(&Parameter, f64)| format!("{} {:+.2}", p.name, part / largest);
        format!(
            ": along {} (as the search counts them) no curve changes",
            parts.iter().map(part).collect::<Vec<_>>().join(", ")
        )
    };
    format!(
        "{} cannot be told apart by these tests{how}{}; fix all but one of them",
        names.join(" and "),
        if are_logarithms && parts.len() == 2 {
            " is determined"
        } else {
            ""
        }
    )
}

/// Part by which a value is changed to see what it moves.
const TRIED: f64 = 0.1;
/// Shares of a parameter's range where curves are looked at, whether they answer there.
const ELSEWHERE: [f64; 4] = [0.0, 0.25, 0.75, 1.0];
/// Relative change of a column that counts as one.
const MOVES: f64 = 1e-5;

/// Why no curve answers to a parameter at the values found.
fn unseen(
    model: &mut Model,
    tests: &[usize],
    (parameter, number): (&Parameter, usize),
    values: &[f64],
    is_bad: bool,
) -> Result<String, Error> {
    let name = &parameter.name;
    if is_bad {
        return Ok(format!(
            "nothing can be said of `{name}`: no measured curve changes with it at the values found, but these are far from \
             following the curves"
        ));
    }
    if let Some(value) = elsewhere(model, tests, (parameter, number), values)? {
        return Ok(format!(
            "`{name}` is not told: at {}, where the search ended, no measured curve changes with it, while with {} they do: \
             the tests set it a limit at most, unless another `start` leads to a better place",
            digits(parameter.value(values[number])),
            digits(value)
        ));
    }
    let (all, moved) = moved(model, tests, number, values)?;
    let head = format!("`{name}` cannot be identified: no measured curve changes with it");
    if !moved.is_empty() {
        let names: Vec<String> = moved.iter().map(|name| format!("`{name}`")).collect();
        let it = if moved.len() == 1 {
            "it"
        } else {
            "one of them"
        };
        return Ok(format!(
            "{head}; it moves {} alone: measure {it}, or fix `{name}`",
            names.join(", ")
        ));
    }
    let facts = facts(model, &all);
    let why = if facts.is_empty() {
        String::new()
    } else {
        format!(": {}", facts.join(", "))
    };
    Ok(format!(
        "{head}, nor does anything else in these tests{why}; fix it, or add a test of another kind"
    ))
}

/// Rows of tests, each with its number.
type AllRows = Vec<(usize, Rows)>;

/// What the tests that can be computed give, and the columns without a measured curve that a parameter moves.
fn moved(
    model: &mut Model,
    tests: &[usize],
    number: usize,
    values: &[f64],
) -> Result<(AllRows, Vec<String>), Error> {
    let mut moved: Vec<String> = Vec::new();
    let mut all = Vec::new();
    for &test in tests {
        let Ok(here) = model.rows(test, values)? else {
            continue;
        };
        for sign in [1.0, -1.0] {
            let mut other = values.to_vec();
            other[number] += sign * TRIED;
            if let Ok(there) = model.rows(test, &other)? {
                for name in changes(&here, &there) {
                    if !moved.contains(&name) {
                        moved.push(name);
                    }
                }
                break;
            }
        }
        all.push((test, here));
    }
    let curves = || tests.iter().flat_map(|&test| &model.tests[test].curves);
    moved.retain(|name| !curves().any(|curve| curve.x == *name || curve.y == *name));
    Ok((all, moved))
}

/// Another value of a parameter with which measured curves are others.
fn elsewhere(
    model: &mut Model,
    tests: &[usize],
    (parameter, number): (&Parameter, usize),
    values: &[f64],
) -> Result<Option<f64>, Error> {
    let [low, high] = parameter.counted_range();
    for share in ELSEWHERE {
        let mut other = values.to_vec();
        other[number] = low + share * (high - low);
        for &test in tests {
            let (Ok(here), Ok(there)) =
                (model.computed(test, values)?, model.computed(test, &other)?)
            else {
                continue;
            };
            let of_test = &model.tests[test];
            let mut curves = of_test.of_curves(&here).zip(of_test.of_curves(&there));
            let is_other = curves.any(|((curve, a), (_, b))| {
                let most = a
                    .iter()
                    .zip(b)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                most > MOVES * curve.largest()
            });
            if is_other {
                return Ok(Some(parameter.value(other[number])));
            }
        }
    }
    Ok(None)
}

/// Columns that differ between two computations.
fn changes(here: &Rows, there: &Rows) -> Vec<String> {
    let pairs = here
        .stretches
        .iter()
        .flatten()
        .zip(there.stretches.iter().flatten());
    let pairs: Vec<_> = pairs.collect();
    let differs = |column: usize| {
        let scale = pairs
            .iter()
            .map(|(a, _)| a[column].abs())
            .fold(0.0, f64::max);
        let change = pairs
            .iter()
            .map(|(a, b)| (a[column] - b[column]).abs())
            .fold(0.0, f64::max);
        change > MOVES * scale.max(1e-12)
    };
    (0..here.names.len())
        .filter(|&c| differs(c))
        .map(|c| here.names[c].clone())
        .collect()
}

/// Common features of the paths of all tests that may explain why no curve responds.
fn facts(model: &Model, tests: &[(usize, Rows)]) -> Vec<String> {
    let mut facts = Vec::new();
    let drivers: Vec<&Rows> = tests
        .iter()
        .filter(|(test, _)| matches!(model.tests[*test].subject, Subject::Driver(_)))
        .map(|(_, rows)| rows)
        .collect();
    let Some(first) = drivers.first().filter(|_| drivers.len() == tests.len()) else {
        return facts;
    };
    let range = |rows: &Rows, name: &str| {
        let column = rows.names.iter().position(|other| other == name)?;
        let values = || rows.stretches.iter().flatten().map(|row| row[column]);
        Some([
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        ])
    };
    let all = if drivers.len() == 1 {
        "in the only test"
    } else {
        "in all tests"
    };
    let of_path = |name: &&String| {
        ["traction_", "stress_", "jump_", "strain_"]
            .iter()
            .any(|start| name.starts_with(start))
    };
    for name in first.names.iter().filter(of_path) {
        let is_constant = |rows: &&Rows| {
            range(rows, name)
                .is_some_and(|[low, high]| high - low <= 1e-6 * low.abs().max(high.abs()).max(1e-9))
        };
        if drivers.iter().all(is_constant) {
            facts.push(format!("{all} `{name}` stays constant"));
        }
    }
    facts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_move_are_named() {
        let rows = |t: f64| Rows {
            names: vec!["u".to_owned(), "t".to_owned()],
            stretches: vec![vec![vec![0.0, 0.0], vec![1.0, t]]],
            ..Rows::default()
        };
        assert_eq!(changes(&rows(2.0), &rows(2.1)), ["t"]);
        assert!(changes(&rows(2.0), &rows(2.0)).is_empty());
    }
}
