//! Does a law keep to the memory it is given?

use super::draw::Draw;
use super::points::{ELASTIC, UPDATE, fluxes, is_finite, is_success};
use super::specimen::create_form;
use super::{Check, Found, Subject, Verdict, skipped};
use abi::raw;
use law::probe::{Fence, Form, Order, process};

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "writes-stay-inside",
        description: "Nothing is written outside the outputs, nor between their cells. Forbidden \
                      memory is right after, then right before every output; touching it crashes \
                      the check.",
        needs: &["integrate-works"],
        run: writes_stay_inside,
    },
    Check {
        id: "reads-stay-inside",
        description: "Nothing is read outside the inputs; forbidden memory as for the outputs.",
        needs: &["integrate-works"],
        run: reads_stay_inside,
    },
    Check {
        id: "inputs-stay-untouched",
        description: "Inputs are in memory that cannot be written; a write crashes the check.",
        needs: &["integrate-works"],
        run: inputs_stay_untouched,
    },
    Check {
        id: "results-are-finite",
        description: "With success every requested component is written (NaN before the call) \
                      and finite.",
        needs: &["integrate-works"],
        run: results_are_finite,
    },
    Check {
        id: "memory-is-freed",
        description: "Heap and mapped memory do not grow with calls of `integrate` and \
                      `init_state`, good or failing, nor with instances created, destroyed or \
                      refused.",
        needs: &["writes-stay-inside"],
        run: memory_is_freed,
    },
];

/// What a host may ask for.
const REQUESTS: [u32; 3] = [raw::PILUM_REQ_FLUX, UPDATE, ELASTIC];

/// Calls of both functions in a form, on points of paths. The number of points.
fn in_form(subject: &Subject, name: &str, change: impl Fn(&mut Form)) -> Result<usize, Verdict> {
    subject.each(Draw::Any, name, 2, |specimen, random| {
        // An odd number, so that arrays of outcomes do not fill whole words.
        let points = specimen.points(33, random)?;
        let mut n_points = 0;
        for order in [Order::Points, Order::Components, Order::Spread] {
            let form = |request| {
                let mut form = Form {
                    order,
                    ..Form::of(request)
                };
                change(&mut form);
                form
            };
            for request in REQUESTS {
                if specimen.probe.integrate(&points, &form(request))?.stray {
                    return Err(specimen.fails(format_args!(
                        "something is written between the cells of an output, {}",
                        order.words()
                    )));
                }
                n_points += points.len();
            }
            let (fluxes, form) = (fluxes(&points), form(0));
            let answer = specimen.probe.init_state(&fluxes, &form)?;
            if answer.is_some_and(|answer| answer.stray) {
                let why = "`init_state` writes between the cells of `state1`";
                return Err(specimen.fails_to_start(&fluxes, &form, &[], why));
            }
        }
        Ok(n_points)
    })
}

fn writes_stay_inside(subject: &Subject) -> Found {
    let mut n = 0;
    for around_outputs in [Fence::After, Fence::Before] {
        n += in_form(subject, "writes", |form| {
            form.around_outputs = around_outputs;
        })?;
    }
    Ok(format!("{n} points"))
}

fn reads_stay_inside(subject: &Subject) -> Found {
    let mut n = 0;
    for around_inputs in [Fence::After, Fence::Before] {
        n += in_form(subject, "reads", |form| form.around_inputs = around_inputs)?;
    }
    Ok(format!("{n} points"))
}

fn inputs_stay_untouched(subject: &Subject) -> Found {
    let n = in_form(subject, "inputs", |form| form.inputs_locked = true)?;
    Ok(format!("{n} points"))
}

fn results_are_finite(subject: &Subject) -> Found {
    let n = subject.each(Draw::Any, "finite", 3, |specimen, random| {
        let walk = specimen.paths(20, random)?;
        let (starts, n) = (walk.successes, walk.steps.len());
        if n < starts.len() {
            return Err(specimen.fails(format_args!(
                "{} of {} points that are said to have succeeded have results that are not \
                 finite, or not written",
                starts.len() - n,
                starts.len()
            )));
        }
        for request in REQUESTS {
            let ends = specimen.call(&starts, request)?.points;
            let mut pairs = starts.iter().zip(&ends);
            let bad = pairs.find(|(_, end)| is_success(end.status) && !is_finite(end));
            if let Some((start, _)) = bad {
                let why = format!(
                    "with request {request}, the results at {} are not finite, or not written",
                    specimen.at(start)
                );
                return Err(specimen.fails_for(start, why));
            }
        }
        Ok(starts.len())
    })?;
    Ok(format!("{n} points"))
}

/// Calls between two looks at the heap, and looks.
const CALLS: usize = 400;
const LOOKS: usize = 3;

/// Something that is to leave nothing behind.
type Work<'a> = &'a dyn Fn() -> Result<(), Verdict>;

fn memory_is_freed(subject: &Subject) -> Found {
    if process::heap_in_use().is_none() {
        return Err(skipped("the system does not tell what is in use"));
    }
    subject.each(Draw::Any, "heap", 1, |specimen, random| {
        let point = specimen.points(1, random)?;
        let mut broken = point.clone();
        broken[0].gradient1[0] = f64::NAN;
        let fluxes = fluxes(&point);
        let mut refused = specimen.values.clone();
        if let Some(first) = refused.first_mut() {
            *first = f64::INFINITY;
        }
        let create = |values: &[f64]| -> Result<(), Verdict> {
            let form = create_form(&specimen.formulation, specimen.hypothesis, values);
            specimen.law.probe(&form)?;
            Ok(())
        };
        let kinds: [(&str, Work<'_>); 5] = [
            ("a call of `integrate`", &|| {
                specimen.call(&point, UPDATE).map(drop)
            }),
            ("a call of `integrate` that fails", &|| {
                specimen.call(&broken, UPDATE).map(drop)
            }),
            ("a call of `init_state`", &|| {
                specimen.probe.init_state(&fluxes, &Form::of(0))?;
                Ok(())
            }),
            ("an instance", &|| create(&specimen.values)),
            ("`create` that refuses", &|| create(&refused)),
        ];
        for (what, work) in kinds {
            let [heap, mapped] = left_behind(work)?;
            if heap >= 8 * CALLS {
                return Err(specimen.fails(format_args!(
                    "{what} leaves {} bytes of the heap in use",
                    heap / CALLS
                )));
            }
            // Less than a page in each of many calls is the allocator's.
            if mapped >= 4096 * CALLS {
                let bytes = mapped / CALLS;
                return Err(specimen.fails(format_args!("{what} leaves {bytes} bytes mapped")));
            }
        }
        Ok(0)
    })?;
    Ok(format!("{} calls of each kind", (LOOKS + 1) * CALLS))
}

/// The least growth of the heap and of the mapped memory in a series of calls, in bytes.
fn left_behind(work: Work<'_>) -> Result<[usize; 2], Verdict> {
    let in_use = || [process::heap_in_use(), process::mapped()].map(Option::unwrap_or_default);
    let mut least = [usize::MAX; 2];
    // The first calls may fill what later ones use again.
    for look in 0..=LOOKS {
        let before = in_use();
        for _ in 0..CALLS {
            work()?;
        }
        let after = in_use();
        if look > 0 {
            for k in 0..2 {
                least[k] = least[k].min(after[k].saturating_sub(before[k]));
            }
        }
    }
    Ok(least)
}
