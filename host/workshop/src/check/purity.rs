//! Is an update a function of its arguments, and of nothing else?

mod arguments;
mod earlier_calls;
mod environment;

use super::draw::Draw;
use super::points::{UPDATE, first_difference, increment, is_same};
use super::random::Random;
use super::specimen::{BOTH, Specimen, name};
use super::{Check, Found, Subject, Verdict, fresh_process, skipped};
use abi::raw;
use law::probe::call_log::Function;
use law::probe::{Form, Order, PointEnd, PointStart};
use std::time::Instant;

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "repeatable",
        description: "The same call gives the same bits, also after other calls. This and the \
                      checks below include `init_state`.",
        needs: &[
            "results-are-finite",
            "writes-stay-inside",
            "inputs-stay-untouched",
        ],
        run: |subject| compare(subject, "repeatable", after_others),
    },
    Check {
        id: "independent-of-split",
        description: "Points give the same bits in one batch, one by one, in batches of random \
                      sizes, and in one of 20 011 points.",
        needs: &["repeatable"],
        run: |subject| compare(subject, "split", split),
    },
    Check {
        id: "independent-of-order",
        description: "Points give the same bits in another order.",
        needs: &["independent-of-split"],
        run: |subject| compare(subject, "order", shuffled),
    },
    Check {
        id: "independent-of-request",
        description: "Flux and internal variables have the same bits for every requested \
                      operator, and for every number of the first point (warning, if only last \
                      bits differ without the consistent tangent).",
        needs: &["repeatable"],
        run: arguments::independent_of_request,
    },
    Check {
        id: "independent-of-time",
        description: "Results have the same bits at any time; without a parameter or variable in \
                      a unit of time also for any duration, 0 too (warning, since a law may \
                      age).",
        needs: &["repeatable"],
        run: arguments::independent_of_time,
    },
    Check {
        id: "independent-of-layout",
        description: "Results have the same bits with values by points, by components, with \
                      gaps, or with inputs once for all points.",
        needs: &["independent-of-split"],
        run: independent_of_layout,
    },
    Check {
        id: "independent-of-thread",
        description: "Eight threads that use one instance at the same time get the same bits as \
                      one.",
        needs: &["repeatable"],
        run: |subject| compare(subject, "thread", by_many_threads),
    },
    Check {
        id: "instances-are-independent",
        description: "An instance gives the same bits while others are created, used and \
                      destroyed.",
        needs: &["repeatable"],
        run: earlier_calls::instances_are_independent,
    },
    Check {
        id: "independent-of-earlier-calls",
        description: "A call gives the same bits after one that differs in a single input, \
                      parameter, request or the time increment, by a half or by 10⁻⁹, and in an \
                      instance at the address of another one.",
        needs: &["instances-are-independent"],
        run: earlier_calls::independent_of_earlier_calls,
    },
    Check {
        id: "independent-of-first-instance",
        description: "An instance gives the same bits as the first one of a process and after \
                      one with other parameters: no `static` keeps the first values.",
        needs: &["independent-of-order", "independent-of-earlier-calls"],
        run: fresh_process::independent_of_first_instance,
    },
    Check {
        id: "independent-of-environment",
        description: "A process with other HOME, LANG, LC_ALL, TZ, USER and LOGNAME gives the \
                      same bits.",
        needs: &["independent-of-first-instance"],
        run: fresh_process::independent_of_environment,
    },
    Check {
        id: "environment-is-left-alone",
        description: "Rounding, subnormal numbers, arithmetic traps, locale, working directory, \
                      signal handlers, alarms, limits, umask and environment stay; no process is \
                      started, no thread or open file left behind, none closed.",
        needs: &["integrate-works"],
        run: environment::environment_is_left_alone,
    },
    Check {
        id: "prints-nothing",
        description: "Nothing is written to the standard output or the error stream.",
        needs: &["integrate-works"],
        run: |subject| environment::drive(subject).map(|()| String::new()),
    },
    Check {
        id: "writes-no-files",
        description: "No file is left in the working directory.",
        needs: &["integrate-works"],
        run: |subject| environment::drive(subject).map(|()| String::new()),
    },
];

/// One of the functions of a law.
#[derive(Clone, Copy)]
struct Called<'a> {
    specimen: &'a Specimen,
    function: Function,
}

impl Called<'_> {
    fn update(&self, points: &[PointStart]) -> Result<Vec<PointEnd>, Verdict> {
        self.ask(points, &self.specimen.form(UPDATE))
    }

    fn fluxes(&self, points: &[PointStart]) -> Result<Vec<PointEnd>, Verdict> {
        self.ask(points, &self.specimen.form(raw::PILUM_REQ_FLUX))
    }

    fn in_order(&self, points: &[PointStart], order: Order) -> Result<Vec<PointEnd>, Verdict> {
        let form = Form {
            order,
            ..self.specimen.form(UPDATE)
        };
        self.ask(points, &form)
    }

    fn ask(&self, points: &[PointStart], form: &Form) -> Result<Vec<PointEnd>, Verdict> {
        self.specimen.ask(self.function, points, form)
    }
}

/// Compares the results of another way to call with those of one batch, for both functions.
fn compare(
    subject: &Subject,
    name: &str,
    mut other: impl FnMut(&Called<'_>, &[PointStart], &mut Random) -> Result<Vec<PointEnd>, Verdict>,
) -> Found {
    let n = subject.each(Draw::Any, name, 3, |specimen, random| {
        let points = specimen.points(96, random)?;
        for function in BOTH {
            let called = Called { specimen, function };
            let expected = called.update(&points)?;
            let found = other(&called, &points, random)?;
            if let Some(i) = first_difference(&expected, &found) {
                return Err(differs(called, &points, i, &expected[i], found.get(i)));
            }
        }
        Ok(points.len())
    })?;
    Ok(format!("{n} points"))
}

/// Another result than before.
fn differs(
    Called { specimen, function }: Called<'_>,
    points: &[PointStart],
    i: usize,
    expected: &PointEnd,
    found: Option<&PointEnd>,
) -> Verdict {
    let n = points.len();
    let found = |values: fn(&PointEnd) -> &Vec<f64>| found.map(values).cloned().unwrap_or_default();
    let why = if function == Function::InitState {
        format!(
            "`{}`, point {i} of {n}: flux {:?} gave internal variables {:?}, then {:?}",
            name(function),
            points[i].flux0,
            expected.state,
            found(|end| &end.state)
        )
    } else {
        format!(
            "point {i} of {n}: {} gave flux {:?}, then {:?}",
            specimen.at(&points[i]),
            expected.flux,
            found(|end| &end.flux)
        )
    };
    specimen.fails_in(function, (points, i), (&specimen.form(0), &[]), why)
}

/// After calls for other points, and for other operators.
fn after_others(
    called: &Called<'_>,
    points: &[PointStart],
    _: &mut Random,
) -> Result<Vec<PointEnd>, Verdict> {
    let mut others = points.to_vec();
    for point in &mut others {
        let moved = increment(point);
        for c in called.specimen.free() {
            point.gradient1[c] = point.gradient0[c] - 3.0 * moved[c];
        }
        for value in &mut point.flux0 {
            *value *= 0.5;
        }
    }
    called.update(&others)?;
    called.fluxes(points)?;
    called.update(points)
}

/// One by one, and in batches of random sizes.
fn split(
    called: &Called<'_>,
    points: &[PointStart],
    random: &mut Random,
) -> Result<Vec<PointEnd>, Verdict> {
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
}

/// Points of a batch as large as those of a run: no array of a fixed size, no stack for all of them.
const MANY: usize = 20_011;

/// The points over and over in one batch. For each the result that differs from its first one, if any
/// does.
fn in_one_of_many(called: &Called<'_>, points: &[PointStart]) -> Result<Vec<PointEnd>, Verdict> {
    let many: Vec<PointStart> = points.iter().cycle().take(MANY).cloned().collect();
    let ends = called.fluxes(&many)?;
    let few = called.fluxes(points)?;
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

/// In another order.
fn shuffled(
    called: &Called<'_>,
    points: &[PointStart],
    random: &mut Random,
) -> Result<Vec<PointEnd>, Verdict> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    for i in (1..order.len()).rev() {
        order.swap(i, random.below(i + 1));
    }
    let shuffled: Vec<PointStart> = order.iter().map(|&i| points[i].clone()).collect();
    let ends = called.update(&shuffled)?;
    let mut back: Vec<(usize, PointEnd)> = order.into_iter().zip(ends).collect();
    back.sort_by_key(|(i, _)| *i);
    Ok(back.into_iter().map(|(_, end)| end).collect())
}

fn independent_of_layout(subject: &Subject) -> Found {
    for order in [Order::Components, Order::Spread] {
        compare(subject, "layout", |called, points, _| {
            called.in_order(points, order)
        })?;
    }
    compare(subject, "layout", |called, points, _| {
        let mut ends = Vec::new();
        for point in points {
            let three = called.in_order(&vec![point.clone(); 3], Order::Uniform)?;
            let Some(first) = three.first() else { break };
            // The one of the three that differs, if any does.
            let odd = three.iter().find(|end| !is_same(first, end));
            ends.push(odd.unwrap_or(first).clone());
        }
        Ok(ends)
    })
}

/// By eight threads at the same time: of the first one that differs, if any does.
fn by_many_threads(
    called: &Called<'_>,
    points: &[PointStart],
    _: &mut Random,
) -> Result<Vec<PointEnd>, Verdict> {
    // Slow laws meet each other in fewer calls.
    let start = Instant::now();
    let alone = called.update(points)?;
    let n_calls = (0.02 / start.elapsed().as_secs_f64()).clamp(3.0, 20.0) as usize;
    let work = || -> Result<Option<Vec<PointEnd>>, Verdict> {
        // Of all calls, since few of them may meet another thread's on a busy machine.
        for _ in 0..n_calls {
            let ends = called.update(points)?;
            if first_difference(&alone, &ends).is_some() {
                return Ok(Some(ends));
            }
        }
        Ok(None)
    };
    let odd = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(work)).collect();
        let results = threads.into_iter().map(|thread| {
            thread
                .join()
                .map_err(|_| skipped("a thread of the check panicked"))?
        });
        results.collect::<Result<Vec<_>, Verdict>>()
    })?;
    Ok(odd.into_iter().flatten().next().unwrap_or(alone))
}
