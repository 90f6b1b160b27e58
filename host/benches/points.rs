//! Cost of one integration point, law by law, in nanoseconds of CPU time; what `peers.py` and
//! `instructions.sh` run.
//!
//!     points time [BATCH [NAME…]]      a table: scenario, operator, ns per point (median, least)
//!     points call NAME OPERATOR TIMES  calls a scenario that often and prints nothing
//!     points names                     the scenarios
#![allow(
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a bench stops at the first fault and prints its table"
)]

mod scenario;

use law::Operator;
use rustix::time::{ClockId, clock_gettime};
use scenario::{NAMES, Scenario};

/// Points of a scenario that is timed.
const N_POINTS: usize = 20_000;
/// Points of a scenario whose instructions are counted.
const N_COUNTED: usize = 1024;
const RUNS: usize = 15;
/// CPU time that one run takes at least, s.
const LEAST_RUN: f64 = 0.02;

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["names"] => println!("{}", NAMES.join("\n")),
        ["call", name, operator, times] => {
            let mut scenario = Scenario::new(name, N_COUNTED);
            for _ in 0..times.parse().expect("a number of times") {
                scenario.step(N_COUNTED, operator_named(operator));
            }
        }
        ["time", batch, ref names @ ..] => table(batch.parse().expect("a batch size"), names),
        _ => table(512, &[]),
    }
}

fn operator_named(name: &str) -> Operator {
    if name == "consistent" {
        Operator::Consistent
    } else {
        Operator::None
    }
}

/// Prints the table of the named scenarios, or of all.
fn table(batch: usize, names: &[&str]) {
    let names = if names.is_empty() { NAMES } else { names };
    for name in names {
        // A batch as large as is asked for.
        let n_points = N_POINTS.max(batch);
        let mut scenario = Scenario::new(name, n_points);
        let n_points = n_points as f64;
        for operator in ["none", "consistent"] {
            let wanted = operator_named(operator);
            let [median, least] = cpu_seconds(|| scenario.step(batch, wanted));
            let (median, least) = (median / n_points * 1e9, least / n_points * 1e9);
            println!("{name}\t{operator}\t{median:.2}\t{least:.2}");
            let mut copies = Vec::new();
            let [median, least] = cpu_seconds(|| scenario.copy(batch, wanted, &mut copies));
            let (median, least) = (median / n_points * 1e9, least / n_points * 1e9);
            println!("copy {name}\t{operator}\t{median:.2}\t{least:.2}");
        }
    }
}

/// Median and least CPU time of the process over one call, s.
fn cpu_seconds(mut call: impl FnMut()) -> [f64; 2] {
    let now = || {
        let t = clock_gettime(ClockId::ProcessCPUTime);
        t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
    };
    let mut timed = |times: usize| {
        let start = now();
        (0..times).for_each(|_| call());
        now() - start
    };
    timed(1);
    let times = (LEAST_RUN / timed(1).max(1e-9)).ceil() as usize;
    let mut seconds: Vec<f64> = (0..RUNS).map(|_| timed(times) / times as f64).collect();
    seconds.sort_by(f64::total_cmp);
    [seconds[RUNS / 2], seconds[0]]
}
