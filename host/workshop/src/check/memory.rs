//! Does a law keep to the memory it is given?

use super::random::Random;
use super::specimen::{create_form, is_finite, is_success};
use super::{Check, Family, Found, Subject, Verdict, skipped};
use abi::raw;
use law::probe::{Fence, Form, Order, process};

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "writes-stay-inside",
        family: Family::Memory,
        description: "Nothing is written outside the outputs, nor between their cells. Forbidden \
                      memory is right after, then right before every output; touching it crashes \
                      the check.",
        needs: &["integrate-works"],
        run: writes_stay_inside,
    },
    Check {
        id: "reads-stay-inside",
        family: Family::Memory,
        description: "Nothing is read outside the inputs; forbidden memory as for the outputs.",
        needs: &["integrate-works"],
        run: reads_stay_inside,
    },
    Check {
        id: "inputs-stay-untouched",
        family: Family::Memory,
        description: "Inputs are in memory that cannot be written; a write crashes the check.",
        needs: &["integrate-works"],
        run: inputs_stay_untouched,
    },
    Check {
        id: "results-are-finite",
        family: Family::Memory,
        description: "With success every requested component is written (NaN before the call) \
                      and finite.",
        needs: &["integrate-works"],
        run: results_are_finite,
    },
    Check {
        id: "memory-is-freed",
        family: Family::Memory,
        description: "Heap and mapped memory do not grow with calls of `integrate` and \
                      `init_state`, good or failing, nor with instances created, destroyed or \
                      refused.",
        needs: &["writes-stay-inside"],
        run: memory_is_freed,
    },
];

const UPDATE: u32 = raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT;
/// What a host may ask for.
const REQUESTS: [u32; 3] = [
    raw::PILUM_REQ_FLUX,
    UPDATE,
    raw::PILUM_REQ_FLUX | raw::PILUM_REQ_ELASTIC,
];

/// Calls of both functions in a form, on points of paths. The number of points.
fn in_form(
    subject: &Subject,
    name: &str,
    change: impl Fn(&mut Form),
) -> Result<usize, super::Verdict> {
    let mut random = Random::new(subject.seed, name);
    let mut n_points = 0;
    for specimen in subject.specimens(2, &mut random)? {
        // An odd number, so that arrays of outcomes do not fill whole words.
        let points = specimen.points(33, &mut random)?;
        for order in [Order::Points, Order::Components, Order::Spread] {
            for request in REQUESTS {
                let mut form = Form {
                    order,
                    ..Form::of(request)
                };
                change(&mut form);
                let answer = specimen.probe.integrate(&points, &form)?;
                if answer.stray {
                    return Err(specimen.fails(format!(
                        "something is written between the cells of an output, {}",
                        order.words()
                    )));
                }
                n_points += points.len();
            }
            let fluxes: Vec<Vec<f64>> = points.iter().map(|p| p.flux0.clone()).collect();
            let mut form = Form {
                order,
                ..Form::of(0)
            };
            change(&mut form);
            if specimen
                .probe
                .init_state(&fluxes, &form)?
                .is_some_and(|answer| answer.stray)
            {
                let why = "`init_state` writes between the cells of `state1`";
                return Err(specimen.fails_to_start(&fluxes, &form, &[], why));
            }
        }
    }
    Ok(n_points)
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
    let mut random = Random::new(subject.seed, "finite");
    let mut n_successes = 0;
    for specimen in subject.specimens(3, &mut random)? {
        let walk = specimen.paths(20, &mut random)?;
        if walk.steps.len() < walk.successes.len() {
            return Err(specimen.fails(format!(
                "{} of {} points that are said to have succeeded have results that are not \
                 finite, or not written",
                walk.successes.len() - walk.steps.len(),
                walk.successes.len()
            )));
        }
        n_successes += walk.successes.len();
        let starts = walk.successes;
        for request in REQUESTS {
            let answer = specimen.call(&starts, request)?;
            let bad = answer
                .points
                .iter()
                .position(|end| is_success(end.status) && !is_finite(end));
            if let Some(i) = bad {
                let why = format!(
                    "with request {request}, the results at {} are not finite, or not written",
                    specimen.at(&starts[i])
                );
                return Err(specimen.fails_at(&starts[i], why));
            }
        }
    }
    Ok(format!("{n_successes} points"))
}

/// Calls between two looks at the heap, and looks.
const CALLS: usize = 400;
const LOOKS: usize = 3;

/// Something that is to leave nothing behind.
type Work<'a> = Box<dyn Fn() -> Result<(), Verdict> + 'a>;

fn memory_is_freed(subject: &Subject) -> Found {
    if process::heap_in_use().is_none() {
        return Err(skipped("the system does not tell what is in use"));
    }
    let mut random = Random::new(subject.seed, "heap");
    for specimen in subject.specimens(1, &mut random)? {
        let point = specimen.points(1, &mut random)?;
        let mut broken = point.clone();
        broken[0].gradient1[0] = f64::NAN;
        let fluxes = vec![point[0].flux0.clone()];
        let mut refused = specimen.values.clone();
        if let Some(first) = refused.first_mut() {
            *first = f64::INFINITY;
        }
        let kinds: [(&str, Work<'_>); 5] = [
            (
                "a call of `integrate`",
                Box::new(|| specimen.call(&point, UPDATE).map(drop)),
            ),
            (
                "a call of `integrate` that fails",
                Box::new(|| specimen.call(&broken, UPDATE).map(drop)),
            ),
            (
                "a call of `init_state`",
                Box::new(|| {
                    specimen.probe.init_state(&fluxes, &Form::of(0))?;
                    Ok(())
                }),
            ),
            (
                "an instance",
                Box::new(|| {
                    let form =
                        create_form(&specimen.formulation, specimen.hypothesis, &specimen.values);
                    specimen.law.probe(&form)?;
                    Ok(())
                }),
            ),
            (
                "`create` that refuses",
                Box::new(|| {
                    let form = create_form(&specimen.formulation, specimen.hypothesis, &refused);
                    specimen.law.probe(&form)?;
                    Ok(())
                }),
            ),
        ];
        for (what, work) in kinds {
            let mut least = [usize::MAX; 2];
            // The first calls may fill what later ones use again.
            for look in 0..=LOOKS {
                let in_use =
                    || [process::heap_in_use(), process::mapped()].map(Option::unwrap_or_default);
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
            let [heap, mapped] = least;
            if heap >= 8 * CALLS {
                return Err(specimen.fails(format!(
                    "{what} leaves {} bytes of the heap in use",
                    heap / CALLS
                )));
            }
            // Less than a page in each of many calls is the allocator's.
            if mapped >= 4096 * CALLS {
                return Err(
                    specimen.fails(format!("{what} leaves {} bytes mapped", mapped / CALLS))
                );
            }
        }
    }
    Ok(format!("{} calls of each kind", (LOOKS + 1) * CALLS))
}
