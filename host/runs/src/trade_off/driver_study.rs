//! The study of a driver: increments per segment × integration scheme of the law.

use super::scheme::{Scheme, Values, schemes};
use super::study::{Done, Measurement, ROWS, Reference, Row, Study};
use crate::Error;
use crate::experiment::Rows;
use crate::experiment::clock::seconds_of_a_call;
use crate::experiment::progress::Pace;
use input::Driver;
use law::Stop;

/// Increments per segment.
const INCREMENTS: [usize; 10] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
/// The reference has this many times the largest number of increments.
const FINER: usize = 16;
/// Increments per segment at which schemes are compared.
const FEW: usize = 10;
/// The quantity that is counted.
pub(super) const COUNTS: &[&str] = &[ROWS, "law_calls", "cut_backs"];

/// Runs the matrix. `most` bounds the increments per segment, `done` takes the study after every row.
pub(super) fn study(
    driver: &Driver,
    study: &mut Study,
    most: usize,
    stop: &Stop,
    (done, say): (&mut Done<'_>, &mut dyn FnMut(&str)),
) -> Result<(), Error> {
    let n_segments = driver.point().segment_increments().len();
    // The file's own setting has to run, whatever becomes of the others.
    follow(driver)?;
    let mut drivers = schemes_of(driver)
        .into_iter()
        .map(|scheme| Ok((driver.with_parameters(&scheme.values)?, scheme)))
        .collect::<Result<Vec<_>, Error>>()?;
    let finest = INCREMENTS.into_iter().rfind(|n| *n <= most).unwrap_or(1) * FINER;
    stop.check("the study")?;
    say("the reference");
    let found = find_reference(&drivers, n_segments, finest)?;
    study.columns.clone_from(&found.rows.names);
    study.references.push(found.reference);
    study.notes = found.notes;
    let own = driver.point().segment_increments();
    let plan = matrix(&drivers, &own, most);
    // What does not depend on the increments is as long as some of them.
    let weight = |increments: &[usize]| 100.0 + increments.iter().sum::<usize>() as f64;
    let mut pace = Pace::new(plan.iter().map(|(_, increments)| weight(increments)).sum());
    for (number, increments) in plan {
        let (driver, scheme) = &mut drivers[number];
        say(&pace.line(&label(scheme, &increments)));
        driver.point_mut().set_increments(&increments);
        let outcome = measure(driver, &found.rows, &found.scale);
        stop.check("the study")?;
        pace.did(weight(&increments));
        let row = Row {
            family: family(scheme),
            label: label(scheme, &increments),
            is_default: scheme.is_default && increments == own,
            reference: 0,
            outcome: outcome.map_err(|error| in_one_line(&error)),
        };
        study.show(row, done)?;
    }
    Ok(())
}

/// Schemes of the driver's law.
fn schemes_of(driver: &Driver) -> Vec<Scheme> {
    let n_segments = driver.point().segment_increments().len();
    let run = |values: &Values| {
        let mut driver = driver.with_parameters(values).ok()?;
        driver.point_mut().set_increments(&vec![FEW; n_segments]);
        follow(&driver).ok().map(|(rows, _)| rows)
    };
    schemes(
        driver.point().law().description(),
        |id| driver.point().parameter(id),
        |a, b| run(a) != run(b),
    )
}

/// All to be measured: a scheme by its number, and increments by segment. The file's own, `own`, are among those of its
/// scheme.
fn matrix(drivers: &[(Driver, Scheme)], own: &[usize], most: usize) -> Vec<(usize, Vec<usize>)> {
    let mut all = Vec::new();
    for (number, (_, scheme)) in drivers.iter().enumerate() {
        let counts = INCREMENTS.into_iter().filter(|n| *n <= most);
        let counts = counts.map(|n| vec![n; own.len()]);
        let has_own = counts.clone().any(|increments| increments == own);
        let added = (scheme.is_default && !has_own).then(|| own.to_vec());
        all.extend(counts.chain(added).map(|increments| (number, increments)));
    }
    all
}

struct Found {
    rows: Rows,
    scale: Vec<f64>,
    reference: Reference,
    notes: Vec<String>,
}

/// The finest run of the scheme that is converged furthest; the others, as far as they come, are
/// notes.
fn find_reference(
    drivers: &[(Driver, Scheme)],
    n_segments: usize,
    finest: usize,
) -> Result<Found, Error> {
    let mut candidates = Vec::new();
    let mut failure = None;
    for (driver, scheme) in drivers.iter().filter(|(_, scheme)| scheme.is_finest) {
        let run = |n: usize| {
            let mut driver = driver.with_parameters(&scheme.values)?;
            driver.point_mut().set_increments(&vec![n; n_segments]);
            follow(&driver).map(|(rows, _)| rows)
        };
        match (run(finest / 4), run(finest / 2), run(finest)) {
            (Ok(coarse), Ok(middle), Ok(fine)) => {
                let scale = scale(&fine);
                let labels = [finest / 2, finest].map(|n| label(scheme, &vec![n; n_segments]));
                let reference = Reference::new(labels, [&coarse, &middle, &fine], &scale);
                candidates.push((reference, fine, scale));
            }
            (Err(error), _, _) | (_, Err(error), _) | (_, _, Err(error)) => failure = Some(error),
        }
    }
    candidates.sort_by(|(a, ..), (b, ..)| {
        let [a, b] = [a, b].map(|reference| reference.convergence.uncertainty);
        a.total_cmp(&b)
    });
    let mut candidates = candidates.into_iter();
    let Some((reference, rows, scale)) = candidates.next() else {
        return Err(failure.unwrap_or_else(|| Error::internal("no scheme to try".to_owned())));
    };
    let other = |(other, its_rows, _): (Reference, Rows, Vec<f64>)| {
        format!(
            "{}: {:.1e} from the reference, own estimate {:.1e}",
            other.label,
            its_rows.difference(&rows, &scale),
            other.convergence.uncertainty
        )
    };
    let notes = candidates.map(other).collect();
    Ok(Found {
        rows,
        scale,
        reference,
        notes,
    })
}

/// Fluxes are compared relative to the largest of all of them.
fn scale(rows: &Rows) -> Vec<f64> {
    let largest = rows.largest();
    let most = largest.iter().copied().fold(0.0, f64::max);
    vec![most; largest.len()]
}

fn family(scheme: &Scheme) -> String {
    if scheme.label.is_empty() {
        "increments".to_owned()
    } else {
        scheme.label.clone()
    }
}

fn label(scheme: &Scheme, increments: &[usize]) -> String {
    let uniform = increments.windows(2).all(|pair| pair[0] == pair[1]);
    let numbers: Vec<String> = increments.iter().map(usize::to_string).collect();
    let increments = match numbers.first() {
        Some(one) if uniform && one == "1" => "1 increment".to_owned(),
        Some(one) if uniform => format!("{one} increments"),
        _ => format!("{} increments", numbers.join(" + ")),
    };
    if scheme.label.is_empty() {
        increments
    } else {
        format!("{}, {increments}", scheme.label)
    }
}

/// An error's message in one line.
pub(super) fn in_one_line(error: &Error) -> String {
    let message = error.to_string();
    let lines: Vec<&str> = message.lines().map(str::trim).collect();
    lines.join("; ")
}

/// Tractions or stresses along the path, and the counts.
fn follow(driver: &Driver) -> Result<(Rows, Vec<u64>), Error> {
    let lengths = driver.point().segment_increments();
    let n = driver.point().law().n_components();
    let names = driver.point().columns()[n..2 * n].to_vec();
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let report = driver.point().run(|row| {
        if row.increment > 0 {
            rows.push(row.flux.to_vec());
        }
        Ok::<_, point::Error>(())
    })?;
    let mut rows = rows.into_iter();
    let stretches = lengths.iter().map(|&n| rows.by_ref().take(n).collect());
    let sampled = Rows {
        names,
        stretches: stretches.collect(),
        zeros: Vec::new(),
    };
    let counts = [report.increments, report.calls, report.cut_backs];
    Ok((sampled, counts.map(|n| n as u64).to_vec()))
}

fn measure(driver: &Driver, reference: &Rows, scale: &[f64]) -> Result<Measurement, Error> {
    let (rows, counts) = follow(driver)?;
    let errors = rows.differences(reference, scale);
    let seconds = seconds_of_a_call(|| {
        let run = driver.point().run(|_| Ok::<_, point::Error>(()));
        run.map(|_| ())
    })?;
    Ok(Measurement::new(seconds, counts, errors))
}
