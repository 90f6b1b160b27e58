//! Does a result depend on other instances, or on earlier calls?

use super::{Called, UPDATE, compare};
use crate::check::random::Random;
use crate::check::specimen::{Function, create_form, first_difference};
use crate::check::{Found, Subject, Verdict};
use abi::raw;
use law::probe::{Form, PointEnd, PointStart, Probe};

pub(super) fn instances_are_independent(subject: &Subject) -> Found {
    let others = subject.specimens(3, &mut Random::new(subject.seed, "others"))?;
    compare(subject, "instances", |called, points, _| {
        let specimen = called.specimen;
        for other in &others {
            let form = create_form(&other.formulation, other.hypothesis, &other.values);
            let created = other.law.probe(&form)?;
            if other.hypothesis == specimen.hypothesis
                && other.law.description().id == specimen.law.description().id
                && let Some(probe) = &created.probe
            {
                on(probe, called.function, points, UPDATE)?;
            }
        }
        called.update(points)
    })
}

/// What another instance makes of the points.
fn on(
    probe: &Probe,
    function: Function,
    points: &[PointStart],
    request: u32,
) -> Result<Vec<PointEnd>, Verdict> {
    let answer = match function {
        Function::Integrate => Some(probe.integrate(points, &Form::of(request))?),
        Function::InitState => {
            let fluxes: Vec<Vec<f64>> = points.iter().map(|point| point.flux0.clone()).collect();
            probe.init_state(&fluxes, &Form::of(0))?
        }
    };
    Ok(answer.map_or(Vec::new(), |answer| answer.points))
}

/// A change of one input of a call; other inputs stay.
type Change = fn(&mut PointStart, f64);

const CHANGES: [(&str, Change); 4] = [
    ("gradient0", |point, part| {
        let ends = point.gradient1.iter();
        for (start, end) in point.gradient0.iter_mut().zip(ends) {
            *start += part * (end - *start);
        }
    }),
    ("gradient1", |point, part| {
        let starts = point.gradient0.iter();
        for (end, start) in point.gradient1.iter_mut().zip(starts) {
            *end -= part * (*end - start);
        }
    }),
    ("flux0", |point, part| {
        point.flux0.iter_mut().for_each(|flux| *flux *= 1.0 - part);
    }),
    ("state0", |point, part| {
        let states = point.state0.iter_mut();
        states.for_each(|state| *state *= 1.0 - part);
    }),
];

/// Parts by which inputs are changed: far more than any tolerance, and less than most.
const PARTS: [f64; 2] = [0.5, 1e-9];

pub(super) fn independent_of_earlier_calls(subject: &Subject) -> Found {
    const N: usize = 8;
    let mut random = Random::new(subject.seed, "earlier calls");
    let mut n = 0;
    for specimen in &subject.specimens(2, &mut random)? {
        let points = specimen.points(2 * N, &mut random)?;
        for (i, point) in points.iter().enumerate().take(N) {
            let unlike = &points[(i + points.len() / 2) % points.len()];
            for function in Function::BOTH {
                n += after_alike(&Called { specimen, function }, point, unlike)?;
                after_other_instances(subject, &Called { specimen, function }, point, unlike)?;
            }
        }
    }
    Ok(format!("{n} calls"))
}

/// Compares calls after an unlike one with the same after one that differs in a single thing.
fn after_alike(
    called: &Called<'_>,
    point: &PointStart,
    unlike: &PointStart,
) -> Result<usize, Verdict> {
    let Called { specimen, function } = called;
    let one = |start: &PointStart, form: &Form| {
        specimen.ask(*function, std::slice::from_ref(start), form)
    };
    let form = specimen.form(UPDATE);
    let mut calls = Vec::new();
    for part in PARTS {
        for (what, change) in CHANGES {
            let mut changed = point.clone();
            change(&mut changed, part);
            calls.push((format!("`{what}`"), changed, form));
        }
        let slower = Form {
            time_increment: form.time_increment * (1.0 - part),
            ..form
        };
        calls.push(("the time increment".to_owned(), point.clone(), slower));
    }
    for request in [
        raw::PILUM_REQ_FLUX,
        raw::PILUM_REQ_FLUX | raw::PILUM_REQ_ELASTIC,
    ] {
        let other = Form { request, ..form };
        calls.push(("the request".to_owned(), point.clone(), other));
    }
    for (what, start, form_of_it) in &calls {
        one(unlike, &form)?;
        let expected = one(start, form_of_it)?;
        one(unlike, &form)?;
        one(point, &form)?;
        let found = one(start, form_of_it)?;
        if first_difference(&expected, &found).is_some() {
            let why = format!(
                "`{}` gives another result after a call that differs in {what} alone: \
                 flux {:?} and internal variables {:?}, else {:?} and {:?}, at {}",
                function.name(),
                found[0].flux,
                found[0].state,
                expected[0].flux,
                expected[0].state,
                specimen.at(start)
            );
            return Err(if *function == Function::InitState {
                let before = [point.flux0.clone()];
                specimen.fails_to_start(
                    std::slice::from_ref(&start.flux0),
                    form_of_it,
                    &before,
                    why,
                )
            } else {
                specimen.fails_at(start, why)
            });
        }
    }
    Ok(calls.len())
}

/// The same with instances that differ in one parameter, and with one that stands where another
/// one stood.
fn after_other_instances(
    subject: &Subject,
    called: &Called<'_>,
    point: &PointStart,
    unlike: &PointStart,
) -> Result<(), Verdict> {
    let Called { specimen, function } = called;
    let one = |probe: &Probe, start: &PointStart| {
        on(probe, *function, std::slice::from_ref(start), UPDATE)
    };
    let create = |values: &[f64]| {
        let form = create_form(&specimen.formulation, specimen.hypothesis, values);
        Ok::<_, Verdict>(specimen.law.probe(&form)?.probe)
    };
    // One whose parameters all differ makes a law forget what it kept of the others.
    let parameters = specimen.law.description().parameters.iter().enumerate();
    let varied: Vec<usize> = parameters
        .filter(|(i, p)| {
            let is_fixed = subject.settings.iter().any(|(id, _)| *id == p.id);
            !is_fixed && p.choices.is_empty() && specimen.values[*i].is_finite()
        })
        .map(|(i, _)| i)
        .collect();
    let with = |some: &[usize]| -> Vec<f64> {
        let mut values = specimen.values.clone();
        for &i in some {
            values[i] *= 1.0 - 1e-3;
        }
        values
    };
    let unlike_all = create(&with(&varied))?;
    let forget = || one(unlike_all.as_ref().unwrap_or(&specimen.probe), unlike);
    for &i in &varied {
        let parameter = &specimen.law.description().parameters[i];
        let Some(other) = create(&with(&[i]))? else {
            continue;
        };
        forget()?;
        let expected = one(&other, point)?;
        forget()?;
        one(&specimen.probe, point)?;
        let found = one(&other, point)?;
        // Where the first one stood.
        forget()?;
        one(&other, point)?;
        let again = in_place_of(other, || create(&specimen.values))?;
        let there = again.map(|again| one(&again, point)).transpose()?;
        forget()?;
        let own = one(&specimen.probe, point)?;
        let what = if first_difference(&expected, &found).is_some() {
            format!(
                "after the same call of an instance that differs in `{}` alone",
                parameter.id
            )
        } else if there.is_some_and(|there| first_difference(&own, &there).is_some()) {
            "in an instance that stands where another one stood".to_owned()
        } else {
            continue;
        };
        let why = format!(
            "`{}` gives another result {what}, at {}",
            function.name(),
            specimen.at(point)
        );
        return Err(if *function == Function::InitState {
            let fluxes = std::slice::from_ref(&point.flux0);
            specimen.fails_to_start(fluxes, &specimen.form(0), &[], why)
        } else {
            specimen.fails_at(point, why)
        });
    }
    Ok(())
}

/// Instances that are made until one stands where another one stood.
const PLACES: usize = 256;

/// An instance that stands where this one stands, which is destroyed; nothing if none comes to be there.
fn in_place_of(
    other: Probe,
    create: impl Fn() -> Result<Option<Probe>, Verdict>,
) -> Result<Option<Probe>, Verdict> {
    let address = other.address();
    drop(other);
    // Each takes a free place, and keeps it while the right one is looked for.
    let mut elsewhere = Vec::new();
    while elsewhere.len() < PLACES {
        match create()? {
            Some(again) if again.address() == address => return Ok(Some(again)),
            Some(again) => elsewhere.push(again),
            None => break,
        }
    }
    Ok(None)
}
