//! Is an update a function of its arguments, and of nothing else?

use super::random::Random;
use super::specimen::{Specimen, create_form, first_difference};
use super::{Check, Family, Found, Subject, Verdict, skipped};
use abi::raw;
use law::probe::{Form, Order, PointEnd, PointStart};
use std::hint::black_box;

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "repeatable",
        family: Family::Purity,
        description: "The same call gives the same bits, also after other calls.",
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
        description: "Points give the same bits in one batch, one by one, and in batches of \
                      random sizes.",
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
        id: "environment-is-left-alone",
        family: Family::Purity,
        description: "Rounding, subnormal numbers and working directory are as before.",
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

/// Compares the results of another way to call with those of one batch.
fn compare(
    subject: &Subject,
    name: &str,
    mut other: impl FnMut(&Specimen, &[PointStart], &mut Random) -> Result<Vec<PointEnd>, Verdict>,
) -> Found {
    let mut random = Random::new(subject.seed, name);
    let mut n = 0;
    for specimen in subject.specimens(3, &mut random)? {
        let points = specimen.points(96, &mut random)?;
        let expected = specimen.call(&points, UPDATE)?.points;
        let found = other(&specimen, &points, &mut random)?;
        if let Some(i) = first_difference(&expected, &found) {
            return Err(specimen.fails(format!(
                "point {i} of {}: {:?} gave flux {:?}, then {:?}",
                points.len(),
                points[i],
                expected[i].flux,
                found.get(i).map(|end| end.flux.clone()).unwrap_or_default()
            )));
        }
        n += points.len();
    }
    Ok(format!("{n} points"))
}

fn repeatable(subject: &Subject) -> Found {
    compare(subject, "repeatable", |specimen, points, _| {
        let mut others = points.to_vec();
        for point in &mut others {
            for (c, value) in point.gradient1.iter_mut().enumerate() {
                if specimen.is_free(c) {
                    *value = point.gradient0[c] - 3.0 * (*value - point.gradient0[c]);
                }
            }
        }
        specimen.call(&others, UPDATE)?;
        specimen.call(points, raw::PILUM_REQ_FLUX)?;
        Ok(specimen.call(points, UPDATE)?.points)
    })
}

fn independent_of_split(subject: &Subject) -> Found {
    compare(subject, "split", |specimen, points, random| {
        let mut singles = Vec::new();
        for point in points {
            singles.extend(specimen.call(std::slice::from_ref(point), UPDATE)?.points);
        }
        let mut parts = Vec::new();
        while parts.len() < points.len() {
            let rest = &points[parts.len()..];
            let n = (1 + random.below(9)).min(rest.len());
            parts.extend(specimen.call(&rest[..n], UPDATE)?.points);
        }
        // Where they differ from each other, one of them differs from the whole.
        let differing = first_difference(&singles, &parts).is_some();
        let whole = specimen.call(points, UPDATE)?.points;
        let singles_differ = first_difference(&singles, &whole).is_some();
        Ok(if differing && !singles_differ {
            parts
        } else {
            singles
        })
    })
}

fn independent_of_order(subject: &Subject) -> Found {
    compare(subject, "order", |specimen, points, random| {
        let mut order: Vec<usize> = (0..points.len()).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, random.below(i + 1));
        }
        let shuffled: Vec<PointStart> = order.iter().map(|&i| points[i].clone()).collect();
        let ends = specimen.call(&shuffled, UPDATE)?.points;
        let mut back: Vec<(usize, PointEnd)> = order.into_iter().zip(ends).collect();
        back.sort_by_key(|(i, _)| *i);
        Ok(back.into_iter().map(|(_, end)| end).collect())
    })
}

fn independent_of_layout(subject: &Subject) -> Found {
    let in_order = |specimen: &Specimen, points: &[PointStart], order| -> Result<_, Verdict> {
        let form = Form {
            order,
            ..Form::of(UPDATE)
        };
        Ok(specimen.probe.integrate(points, &form)?.points)
    };
    for order in [Order::Components, Order::Spread] {
        compare(subject, "layout", |specimen, points, _| {
            in_order(specimen, points, order)
        })?;
    }
    compare(subject, "layout", |specimen, points, _| {
        let mut ends = Vec::new();
        for point in points {
            let same = vec![point.clone(); 3];
            let three = in_order(specimen, &same, Order::Uniform)?;
            // The one of the three that differs, if any does.
            let odd = (1..3).find(|&i| first_difference(&three[..1], &three[i..=i]).is_some());
            ends.push(three[odd.unwrap_or(0)].clone());
        }
        Ok(ends)
    })
}

fn independent_of_thread(subject: &Subject) -> Found {
    compare(subject, "thread", |specimen, points, _| {
        let work = || -> Result<Vec<PointEnd>, Verdict> {
            let mut last = Vec::new();
            for _ in 0..20 {
                last = specimen.call(points, UPDATE)?.points;
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
        let alone = specimen.call(points, UPDATE)?.points;
        let first_differs = first_difference(&all[0], &alone).is_some();
        let chosen = if first_differs { 0 } else { odd.unwrap_or(0) };
        Ok(all.into_iter().nth(chosen).unwrap_or_default())
    })
}

fn instances_are_independent(subject: &Subject) -> Found {
    let others = subject.specimens(3, &mut Random::new(subject.seed, "others"))?;
    compare(subject, "instances", |specimen, points, _| {
        for other in &others {
            let form = create_form(&other.formulation, other.hypothesis, &other.values);
            let created = other.law.probe(&form)?;
            if other.hypothesis == specimen.hypothesis
                && other.law.description().id == specimen.law.description().id
                && let Some(probe) = &created.probe
            {
                probe.integrate(points, &Form::of(UPDATE))?;
            }
        }
        Ok(specimen.call(points, UPDATE)?.points)
    })
}

/// What a law could change about numbers and the process.
#[derive(PartialEq, Debug)]
struct Environment {
    rounded: [u64; 4],
    subnormal: u64,
    folder: Option<std::path::PathBuf>,
}

impl Environment {
    fn now() -> Self {
        let one = black_box(1.0_f64);
        let little = black_box(0.75 * f64::EPSILON);
        let less = black_box(0.25 * f64::EPSILON);
        Self {
            // Each direction of rounding gives another four numbers.
            rounded: [one + little, one + less, -one - little, -one - less].map(f64::to_bits),
            subnormal: (black_box(f64::MIN_POSITIVE) * black_box(0.5)).to_bits(),
            folder: std::env::current_dir().ok(),
        }
    }
}

fn environment_is_left_alone(subject: &Subject) -> Found {
    let before = Environment::now();
    drive(subject)?;
    let after = Environment::now();
    if before == after {
        return Ok(String::new());
    }
    let what = if before.folder != after.folder {
        "the working directory"
    } else if before.subnormal != after.subnormal {
        "the treatment of subnormal numbers"
    } else {
        "the rounding mode"
    };
    Err(super::failed(format!("{what} has changed")))
}

/// Uses all functions, with failures too.
fn drive(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "drive");
    for specimen in subject.specimens(2, &mut random)? {
        specimen.walk(20, &mut random)?;
        let mut points = specimen.points(3, &mut random)?;
        points[0].gradient1[0] = f64::NAN;
        specimen.call(&points, UPDATE)?;
    }
    Ok(String::new())
}
