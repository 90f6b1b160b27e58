//! Is an update a function of its arguments, and of nothing else?

use super::margins;
use super::random::Random;
use super::specimen::{Function, Specimen, create_form, first_difference, is_same, is_success};
use super::{Check, Family, Found, Subject, Verdict, skipped};
use abi::raw;
use law::probe::{Form, Order, PointEnd, PointStart, Probe, process};
use std::ffi::OsString;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "repeatable",
        family: Family::Purity,
        description: "The same call gives the same bits, also after other calls, as do those below \
                      for `init_state` too.",
        needs: &[
            "results-are-finite",
            "writes-stay-inside",
            "inputs-stay-untouched",
        ],
        run: repeatable,
    },
    Check {
        id: "independent-of-split",
        family: Family::Purity,
        description: "Points give the same bits in one batch, one by one, in batches of random \
                      sizes, and in one of 20 011 points.",
        needs: &["repeatable"],
        run: independent_of_split,
    },
    Check {
        id: "independent-of-order",
        family: Family::Purity,
        description: "Points give the same bits in another order.",
        needs: &["independent-of-split"],
        run: independent_of_order,
    },
    Check {
        id: "independent-of-request",
        family: Family::Purity,
        description: "Flux and internal variables have the same bits whatever operator is asked for, \
                      and whatever number the first point has (warning, where without the consistent \
                      tangent no more than the last bits differ).",
        needs: &["repeatable"],
        run: independent_of_request,
    },
    Check {
        id: "independent-of-time",
        family: Family::Purity,
        description: "Results have the same bits at whatever time an increment begins; and, where no \
                      parameter or internal variable has a unit of time, however long it takes, 0 too (warning, since a \
                      law may age).",
        needs: &["repeatable"],
        run: independent_of_time,
    },
    Check {
        id: "independent-of-layout",
        family: Family::Purity,
        description: "Results have the same bits whether values stand point by point, component \
                      by component, with gaps, or inputs only once for all points.",
        needs: &["independent-of-split"],
        run: independent_of_layout,
    },
    Check {
        id: "independent-of-thread",
        family: Family::Purity,
        description: "Eight threads that use one instance at the same time get the bits that one \
                      gets.",
        needs: &["repeatable"],
        run: independent_of_thread,
    },
    Check {
        id: "instances-are-independent",
        family: Family::Purity,
        description: "An instance gives the same bits while others with other parameters are \
                      created, used and destroyed.",
        needs: &["repeatable"],
        run: instances_are_independent,
    },
    Check {
        id: "independent-of-earlier-calls",
        family: Family::Purity,
        description: "A call gives the same bits after one that differs from it in a single input, \
                      parameter, request or the time increment, by a half or by 10⁻⁹, and in an \
                      instance that stands where another one stood.",
        needs: &["instances-are-independent"],
        run: independent_of_earlier_calls,
    },
    Check {
        id: "environment-is-left-alone",
        family: Family::Purity,
        description: "Rounding, subnormal numbers, traps of arithmetic, locale, working directory, \
                      signal handlers, alarms, limits, the mask of files and variables of the \
                      environment are as before; no process was started, no thread and no open file \
                      is left behind, and none is closed.",
        needs: &["integrate-works"],
        run: environment_is_left_alone,
    },
    Check {
        id: "prints-nothing",
        family: Family::Purity,
        description: "Nothing is written to the standard output or the error stream.",
        needs: &["integrate-works"],
        run: drive,
    },
    Check {
        id: "writes-no-files",
        family: Family::Purity,
        description: "No file is left in the working directory.",
        needs: &["integrate-works"],
        run: drive,
    },
];

const UPDATE: u32 = raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT;

/// One of the functions of a law.
struct Called<'a> {
    specimen: &'a Specimen,
    function: Function,
}

impl Called<'_> {
    fn update(&self, points: &[PointStart]) -> Result<Vec<PointEnd>, Verdict> {
        self.requested(points, UPDATE)
    }

    fn requested(&self, points: &[PointStart], request: u32) -> Result<Vec<PointEnd>, Verdict> {
        let form = self.specimen.form(request);
        self.specimen.ask(self.function, points, &form)
    }
}

/// Compares the results of another way to call with those of one batch, for both functions.
fn compare(
    subject: &Subject,
    name: &str,
    mut other: impl FnMut(&Called<'_>, &[PointStart], &mut Random) -> Result<Vec<PointEnd>, Verdict>,
) -> Found {
    let mut random = Random::new(subject.seed, name);
    let mut n = 0;
    for specimen in &subject.specimens(3, &mut random)? {
        let points = specimen.points(96, &mut random)?;
        for function in Function::BOTH {
            let called = Called { specimen, function };
            let expected = called.update(&points)?;
            let found = other(&called, &points, &mut random)?;
            if let Some(i) = first_difference(&expected, &found) {
                return Err(differs(&called, &points, i, &expected[i], found.get(i)));
            }
        }
        n += points.len();
    }
    Ok(format!("{n} points"))
}

/// Another result than before.
fn differs(
    called: &Called<'_>,
    points: &[PointStart],
    i: usize,
    expected: &PointEnd,
    found: Option<&PointEnd>,
) -> Verdict {
    let specimen = called.specimen;
    if called.function == Function::InitState {
        let why = format!(
            "`init_state`, point {i} of {}: flux {:?} gave internal variables {:?}, then {:?}",
            points.len(),
            points[i].flux0,
            expected.state,
            found.map(|end| end.state.clone()).unwrap_or_default()
        );
        let fluxes: Vec<Vec<f64>> = points.iter().map(|point| point.flux0.clone()).collect();
        return specimen.fails_to_start(&fluxes, &specimen.form(0), &[], why);
    }
    let why = format!(
        "point {i} of {}: {:?} gave flux {:?}, then {:?}",
        points.len(),
        points[i],
        expected.flux,
        found.map(|end| end.flux.clone()).unwrap_or_default()
    );
    specimen.fails_at(&points[i], why)
}

fn repeatable(subject: &Subject) -> Found {
    compare(subject, "repeatable", |called, points, _| {
        let mut others = points.to_vec();
        for point in &mut others {
            for (c, value) in point.gradient1.iter_mut().enumerate() {
                if called.specimen.is_free(c) {
                    *value = point.gradient0[c] - 3.0 * (*value - point.gradient0[c]);
                }
            }
            for value in &mut point.flux0 {
                *value *= 0.5;
            }
        }
        called.update(&others)?;
        called.requested(points, raw::PILUM_REQ_FLUX)?;
        called.update(points)
    })
}

fn independent_of_split(subject: &Subject) -> Found {
    compare(subject, "split", |called, points, random| {
        let mut singles = Vec::new();
        for point in points {
            singles.extend(called.update(std::slice::from_ref(point))?);
        }
        let mut parts = Vec::new();
        let mut rest = points;
        while !rest.is_empty() {
            let n = (1 + random.below(9)).min(rest.len());
            parts.extend(called.update(&rest[..n])?);
            rest = &rest[n..];
        }
        // Where they differ from each other, one of them differs from the whole.
        let differing = first_difference(&singles, &parts).is_some();
        let whole = called.update(points)?;
        let singles_differ = first_difference(&singles, &whole).is_some();
        if !differing && !singles_differ {
            return in_one_of_many(called, points);
        }
        Ok(if differing && !singles_differ {
            parts
        } else {
            singles
        })
    })
}

/// Points of a batch as large as those of a run: no array of a fixed size, no stack for all of them.
const MANY: usize = 20_011;

/// The points over and over in one batch. Of each the result that differs from its first one, if any
/// does.
fn in_one_of_many(called: &Called<'_>, points: &[PointStart]) -> Result<Vec<PointEnd>, Verdict> {
    let many: Vec<PointStart> = points.iter().cycle().take(MANY).cloned().collect();
    let ends = called.requested(&many, raw::PILUM_REQ_FLUX)?;
    let few = called.requested(points, raw::PILUM_REQ_FLUX)?;
    let mut expected = called.update(points)?;
    for (i, end) in ends.into_iter().enumerate() {
        let k = i % points.len();
        if !is_same(&few[k], &end) {
            let tangent = std::mem::take(&mut expected[k].tangent);
            expected[k] = PointEnd { tangent, ..end };
        }
    }
    Ok(expected)
}

fn independent_of_order(subject: &Subject) -> Found {
    compare(subject, "order", |called, points, random| {
        let mut order: Vec<usize> = (0..points.len()).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, random.below(i + 1));
        }
        let shuffled: Vec<PointStart> = order.iter().map(|&i| points[i].clone()).collect();
        let ends = called.update(&shuffled)?;
        let mut back: Vec<(usize, PointEnd)> = order.into_iter().zip(ends).collect();
        back.sort_by_key(|(i, _)| *i);
        Ok(back.into_iter().map(|(_, end)| end).collect())
    })
}

fn independent_of_layout(subject: &Subject) -> Found {
    let in_order = |called: &Called<'_>, points: &[PointStart], order| -> Result<_, Verdict> {
        let form = Form {
            order,
            ..called.specimen.form(UPDATE)
        };
        called.specimen.ask(called.function, points, &form)
    };
    for order in [Order::Components, Order::Spread] {
        compare(subject, "layout", |called, points, _| {
            in_order(called, points, order)
        })?;
    }
    compare(subject, "layout", |called, points, _| {
        let mut ends = Vec::new();
        for point in points {
            let same = vec![point.clone(); 3];
            let three = in_order(called, &same, Order::Uniform)?;
            let Some(first) = three.first() else { break };
            // The one of the three that differs, if any does.
            let odd = three.iter().find(|end| !is_same(first, end));
            ends.push(odd.unwrap_or(first).clone());
        }
        Ok(ends)
    })
}

fn independent_of_request(subject: &Subject) -> Found {
    let forms: [(u32, u64); 4] = [
        (raw::PILUM_REQ_FLUX, 0),
        (raw::PILUM_REQ_FLUX | raw::PILUM_REQ_ELASTIC, 0),
        (UPDATE, 1),
        (UPDATE, 1 << 40),
    ];
    let mut rounded: Option<Verdict> = None;
    for (request, first_point) in forms {
        compare(subject, "request", |called, points, _| {
            let form = Form {
                first_point,
                ..called.specimen.form(request)
            };
            let expected = called.update(points)?;
            let mut ends = called.specimen.ask(called.function, points, &form)?;
            for ((end, expected), point) in ends.iter_mut().zip(expected).zip(points) {
                let last_bits = called.function == Function::Integrate && first_point == 0;
                if let (true, Some(by)) = (last_bits, rounding(point, end, &expected)) {
                    if by > 0.0 {
                        let verdict = Verdict::Warning(format!(
                            "{}: without the consistent tangent the flux {:?} is {:?}, {by:.0} units of \
                             rounding apart: are there two versions of the update? At {point:?}",
                            called.specimen.name(),
                            expected.flux,
                            end.flux
                        ));
                        rounded.get_or_insert_with(|| called.specimen.recorded(point, verdict));
                    }
                    *end = expected;
                } else {
                    end.tangent = expected.tangent;
                }
            }
            Ok(ends)
        })?;
    }
    rounded.map_or(Ok(String::new()), Err)
}

/// The most units of rounding, of the terms in play, that two versions of one update may be apart.
const ROUNDINGS: f64 = 64.0;

/// How many units of rounding two results are apart, if no more than that; none if they succeed not
/// both.
fn rounding(start: &PointStart, a: &PointEnd, b: &PointEnd) -> Option<f64> {
    if !(is_success(a.status) && a.status == b.status) {
        return None;
    }
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let moved = start.gradient1.iter().zip(&start.gradient0);
    let moved = moved.fold(0.0_f64, |most, (end, begin)| most.max((end - begin).abs()));
    // `b` has the tangent.
    let flux = largest(&start.flux0)
        .max(largest(&b.flux))
        .max(largest(&b.tangent) * moved);
    let apart = |a: f64, b: f64, scale: f64| {
        if a.to_bits() == b.to_bits() {
            0.0
        } else {
            (a - b).abs() / (f64::EPSILON * scale)
        }
    };
    let fluxes = a.flux.iter().zip(&b.flux).map(|(a, b)| apart(*a, *b, flux));
    let states = a.state.iter().zip(&b.state).zip(&start.state0);
    let states = states.map(|((a, b), begin)| {
        let scale = a.abs().max(b.abs()).max(begin.abs()).max(moved);
        apart(*a, *b, scale)
    });
    let all: Vec<f64> = fluxes.chain(states).collect();
    let most = all.iter().copied().fold(0.0, f64::max);
    margins::note("rounding", most / ROUNDINGS);
    (all.iter().all(|by| *by <= ROUNDINGS)).then_some(most)
}

/// Times at which an increment may begin, and lengths of it.
const TIMES: [f64; 2] = [0.125, 1e5];
const LENGTHS: [f64; 3] = [0.0, 1e-3, 1e4];

fn independent_of_time(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "time");
    let mut n = 0;
    for specimen in &subject.specimens(3, &mut random)? {
        let points = specimen.points(48, &mut random)?;
        let parameters = specimen.law.description().parameters.iter();
        let variables = specimen.formulation.internal_variables.iter();
        let mut units = parameters
            .map(|p| &p.unit)
            .chain(variables.map(|v| &v.unit));
        let may_depend = units.any(|unit| has_time(unit));
        for function in Function::BOTH {
            let called = Called { specimen, function };
            let ordinary = specimen.form(UPDATE);
            let expected = called.update(&points)?;
            let began = TIMES.map(|time| (format!("at time {time}"), Form { time, ..ordinary }));
            let lengths = LENGTHS.map(|time_increment| {
                let form = Form {
                    time_increment,
                    ..ordinary
                };
                (format!("over a time of {time_increment}"), form)
            });
            let lengths = lengths.into_iter().filter(|_| !may_depend);
            for (when, form) in began.into_iter().chain(lengths) {
                let found = specimen.ask(function, &points, &form)?;
                n += found.len();
                let Some(i) = first_difference(&expected, &found) else {
                    continue;
                };
                let why = format!(
                    "{}: `{}` gives flux {:?} and internal variables {:?}, {when} {:?} and {:?}, \
                     at {:?}; a law that depends on how long an increment takes has a parameter with \
                     a unit of time",
                    specimen.name(),
                    function.name(),
                    expected[i].flux,
                    expected[i].state,
                    found[i].flux,
                    found[i].state,
                    points[i]
                );
                return Err(specimen.recorded(&points[i], Verdict::Warning(why)));
            }
        }
    }
    Ok(format!("{n} points"))
}

/// Whether a unit has one of time in it.
fn has_time(unit: &str) -> bool {
    unit.split(['/', '·', '*', ' '])
        .filter_map(|factor| factor.split('^').next())
        .any(|name| ["s", "h", "d"].contains(&name))
}

fn independent_of_thread(subject: &Subject) -> Found {
    compare(subject, "thread", |called, points, _| {
        // Slow laws meet each other in fewer calls.
        let start = Instant::now();
        called.update(points)?;
        let n_calls = (0.02 / start.elapsed().as_secs_f64()).clamp(3.0, 20.0) as usize;
        let work = || -> Result<Vec<PointEnd>, Verdict> {
            let mut last = Vec::new();
            for _ in 0..n_calls {
                last = called.update(points)?;
            }
            Ok(last)
        };
        let all = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..8).map(|_| scope.spawn(work)).collect();
            let results = threads.into_iter().map(|thread| {
                thread
                    .join()
                    .map_err(|_| skipped("a thread of the check panicked"))?
            });
            results.collect::<Result<Vec<_>, Verdict>>()
        })?;
        let odd = (1..all.len()).find(|&i| first_difference(&all[0], &all[i]).is_some());
        let alone = called.update(points)?;
        let first_differs = first_difference(&all[0], &alone).is_some();
        let chosen = if first_differs { 0 } else { odd.unwrap_or(0) };
        Ok(all.into_iter().nth(chosen).unwrap_or_default())
    })
}

fn instances_are_independent(subject: &Subject) -> Found {
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

fn independent_of_earlier_calls(subject: &Subject) -> Found {
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
                 flux {:?} and internal variables {:?}, else {:?} and {:?}, at {start:?}",
                function.name(),
                found[0].flux,
                found[0].state,
                expected[0].flux,
                expected[0].state
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
            "`{}` gives another result {what}, at {point:?}",
            function.name()
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

/// An instance that stands where this one stands, which is destroyed; nothing if none comes to stand there.
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

/// What a law could change about numbers and the process.
#[derive(PartialEq, Debug)]
struct Environment {
    rounded: [u64; 4],
    subnormal: u64,
    folder: Option<PathBuf>,
    signals: Vec<usize>,
    arithmetic: u32,
    locale: String,
    has_alarm: bool,
    /// Limits, and of the status what masks signals and files, where the system tells.
    limits: Option<String>,
    masks: Vec<String>,
    variables: Vec<(OsString, OsString)>,
    process: u32,
    had_children: bool,
    /// Where the system tells.
    threads: Option<usize>,
    files: Option<usize>,
}

impl Environment {
    fn now() -> Self {
        let one = black_box(1.0_f64);
        let little = black_box(0.75 * f64::EPSILON);
        let less = black_box(0.25 * f64::EPSILON);
        let entries = |folder: &str| Some(std::fs::read_dir(folder).ok()?.count());
        Self {
            // Each direction of rounding gives another four numbers.
            rounded: [one + little, one + less, -one - little, -one - less].map(f64::to_bits),
            subnormal: (black_box(f64::MIN_POSITIVE) * black_box(0.5)).to_bits(),
            folder: std::env::current_dir().ok(),
            signals: process::signal_handlers(),
            arithmetic: process::arithmetic(),
            locale: process::locale(),
            has_alarm: process::alarm(),
            limits: std::fs::read_to_string("/proc/self/limits").ok(),
            masks: std::fs::read_to_string("/proc/thread-self/status")
                .unwrap_or_default()
                .lines()
                .filter(|line| line.starts_with("Umask:") || line.starts_with("SigBlk:"))
                .map(str::to_owned)
                .collect(),
            variables: std::env::vars_os().collect(),
            process: std::process::id(),
            had_children: process::has_had_children(),
            threads: entries("/proc/self/task"),
            files: entries("/proc/self/fd"),
        }
    }

    /// What is not as it was.
    fn changed(&self, after: &Self) -> Option<String> {
        let more = |before: Option<usize>, after: Option<usize>| {
            let more = after?.checked_sub(before?)?;
            (more > 0).then_some(more)
        };
        let what = if self.folder != after.folder {
            "the working directory has changed"
        } else if self.subnormal != after.subnormal {
            "the treatment of subnormal numbers has changed"
        } else if self.rounded != after.rounded {
            "the rounding mode has changed"
        } else if self.arithmetic != after.arithmetic {
            "what the processor does on exceptions of arithmetic has changed"
        } else if self.locale != after.locale {
            return Some(format!("the locale is {} now", after.locale));
        } else if self.has_alarm != after.has_alarm {
            "an alarm is set"
        } else if self.limits != after.limits {
            "the limits of the process have changed"
        } else if self.masks != after.masks {
            "the mask of signals or of new files has changed"
        } else if self.process != after.process || self.had_children != after.had_children {
            "a process was started"
        } else if let Some(number) = (1..)
            .zip(self.signals.iter().zip(&after.signals))
            .find_map(|(number, (before, after))| (before != after).then_some(number))
        {
            return Some(format!("the handler of signal {number} has changed"));
        } else if self.variables != after.variables {
            "the variables of the environment have changed"
        } else if let Some(n) = more(self.threads, after.threads) {
            return Some(format!("threads are left behind: {n}"));
        } else if let Some(n) = more(self.files, after.files) {
            return Some(format!("open files are left behind: {n}"));
        } else if let Some(n) = more(after.files, self.files) {
            return Some(format!("files that it has not opened are closed: {n}"));
        } else {
            return None;
        };
        Some(what.to_owned())
    }
}

fn environment_is_left_alone(subject: &Subject) -> Found {
    let mut before = Environment::now();
    // The program itself may keep the file of a library that it has opened.
    subject.laws()?;
    before.files = Environment::now().files;
    drive(subject)?;
    match before.changed(&Environment::now()) {
        None => Ok(String::new()),
        Some(what) => Err(super::failed(what)),
    }
}

/// Uses all functions, with failures too.
fn drive(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "drive");
    for specimen in subject.specimens(2, &mut random)? {
        specimen.paths(20, &mut random)?;
        let mut points = specimen.points(3, &mut random)?;
        points[0].gradient1[0] = f64::NAN;
        specimen.call(&points, UPDATE)?;
    }
    Ok(String::new())
}
