//! Does a result depend on other instances, or on earlier calls?

use super::{Called, compare};
use crate::check::draw::Draw;
use crate::check::points::{ELASTIC, UPDATE, first_difference};
use crate::check::random::Random;
use crate::check::specimen::{BOTH, Specimen, asked, name};
use crate::check::{Found, Subject, Verdict};
use abi::raw;
use law::probe::{Form, PointStart, Probe};
use std::slice::from_ref;

pub(super) fn instances_are_independent(subject: &Subject) -> Found {
    let others = subject.specimens(Draw::Any, 3, &mut Random::new(subject.seed, "others"))?;
    compare(subject, "instances", |called, points, _| {
        let specimen = called.specimen;
        for other in &others {
            let created = other.with_values(&other.values)?;
            if other.hypothesis == specimen.hypothesis
                && other.law.description().id == specimen.law.description().id
                && let Some(probe) = &created
            {
                asked(probe, called.function, points, &Form::of(UPDATE))?;
            }
        }
        called.update(points)
    })
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
    let n = subject.each(Draw::Any, "earlier calls", 2, |specimen, random| {
        let points = specimen.points(2 * N, random)?;
        let mut n = 0;
        for (i, point) in points.iter().enumerate().take(N) {
            let unlike = &points[(i + points.len() / 2) % points.len()];
            for function in BOTH {
                let called = Called { specimen, function };
                n += after_alike(called, point, unlike)?;
                after_other_instances(subject, called, point, unlike)?;
            }
        }
        Ok(n)
    })?;
    Ok(format!("{n} calls"))
}

/// Calls that differ from one for this point in a single thing, in words.
fn alike(point: &PointStart, form: Form) -> Vec<(String, PointStart, Form)> {
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
    for request in [raw::PILUM_REQ_FLUX, ELASTIC] {
        let other = Form { request, ..form };
        calls.push(("the request".to_owned(), point.clone(), other));
    }
    calls
}

/// Compares calls after an unlike one with the same after one that differs in a single thing.
fn after_alike(
    called: Called<'_>,
    point: &PointStart,
    unlike: &PointStart,
) -> Result<usize, Verdict> {
    let one = |start: &PointStart, form: &Form| called.ask(from_ref(start), form);
    let Called { specimen, function } = called;
    let form = specimen.form(UPDATE);
    let calls = alike(point, form);
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
                name(function),
                found[0].flux,
                found[0].state,
                expected[0].flux,
                expected[0].state,
                specimen.at(start)
            );
            let starts = from_ref(start);
            let before = from_ref(point);
            return Err(specimen.fails_in(function, (starts, 0), (form_of_it, before), why));
        }
    }
    Ok(calls.len())
}

/// Parameters with a range of values that nobody has set.
fn continuous(subject: &Subject, specimen: &Specimen) -> Vec<usize> {
    let parameters = &specimen.law.description().parameters;
    let varies = |i: &usize| {
        let p = &parameters[*i];
        let is_fixed = subject.settings.iter().any(|(id, _)| *id == p.id);
        !is_fixed && p.choices.is_empty() && specimen.values[*i].is_finite()
    };
    (0..parameters.len()).filter(varies).collect()
}

/// The same with instances that differ in one parameter, and with one that stands where another
/// one stood.
fn after_other_instances(
    subject: &Subject,
    Called { specimen, function }: Called<'_>,
    point: &PointStart,
    unlike: &PointStart,
) -> Result<(), Verdict> {
    let form = Form::of(UPDATE);
    let one = |probe: &Probe, start: &PointStart| asked(probe, function, from_ref(start), &form);
    let varied = continuous(subject, specimen);
    let varying = |some: &[usize]| {
        let mut values = specimen.values.clone();
        for &i in some {
            values[i] *= 1.0 - 1e-3;
        }
        specimen.with_values(&values)
    };
    // One whose parameters all differ makes a law forget what it kept of the others.
    let unlike_all = varying(&varied)?;
    let forget = || one(unlike_all.as_ref().unwrap_or(&specimen.probe), unlike);
    for &i in &varied {
        let Some(other) = varying(&[i])? else {
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
        let again = in_place_of(other, || specimen.with_values(&specimen.values))?;
        let there = again.map(|again| one(&again, point)).transpose()?;
        forget()?;
        let own = one(&specimen.probe, point)?;
        let what = if first_difference(&expected, &found).is_some() {
            let id = &specimen.law.description().parameters[i].id;
            format!("after the same call of an instance that differs in `{id}` alone")
        } else if there.is_some_and(|there| first_difference(&own, &there).is_some()) {
            "in an instance that stands where another one stood".to_owned()
        } else {
            continue;
        };
        let (called, at) = (name(function), specimen.at(point));
        let why = format!("`{called}` gives another result {what}, at {at}");
        let form = (&specimen.form(0), &[][..]);
        return Err(specimen.fails_in(function, (from_ref(point), 0), form, why));
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
