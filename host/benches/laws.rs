//! One law call through the plugin, law by law: elastic and plastic step, with and without the
//! consistent tangent, in batches of 1 to 512 points, and the floor that copying the same values
//! sets. Wall-clock time; `points` measures CPU time.
#![allow(clippy::expect_used, reason = "a bench stops at the first fault")]

mod scenario;

use divan::Bencher;
use divan::counter::ItemsCount;
use law::Operator;
use scenario::{NAMES, Scenario};

const BATCHES: [usize; 4] = [1, 8, 64, 512];

fn main() {
    divan::main();
}

fn step<const BATCH: usize>(bencher: Bencher<'_, '_>, name: &str, operator: Operator) {
    let mut scenario = Scenario::new(name, BATCH);
    bencher
        .counter(ItemsCount::new(BATCH))
        .bench_local(|| scenario.step(BATCH, operator));
}

/// Flux and internal variables only.
#[divan::bench(args = NAMES, consts = BATCHES)]
fn without_tangent<const BATCH: usize>(bencher: Bencher<'_, '_>, name: &str) {
    step::<BATCH>(bencher, name, Operator::None);
}

/// With the consistent tangent.
#[divan::bench(args = NAMES, consts = BATCHES)]
fn with_tangent<const BATCH: usize>(bencher: Bencher<'_, '_>, name: &str) {
    step::<BATCH>(bencher, name, Operator::Consistent);
}

/// Copies of the values that the call with tangent reads and writes.
#[divan::bench(args = NAMES, consts = BATCHES)]
fn copy<const BATCH: usize>(bencher: Bencher<'_, '_>, name: &str) {
    let mut scenario = Scenario::new(name, BATCH);
    let mut copies = Vec::new();
    bencher
        .counter(ItemsCount::new(BATCH))
        .bench_local(|| scenario.copy(BATCH, Operator::Consistent, &mut copies));
}
