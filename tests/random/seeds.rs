//! One input for each seed. `PILUM_RANDOM` sets the number of seeds of every family;
//! `PILUM_RANDOM_SEED` the first of them.
#![expect(
    clippy::print_stderr,
    reason = "what a random test found is for its reader"
)]

use proptest::prelude::{ProptestConfig, Strategy};
use proptest::test_runner::{RngSeed, TestCaseError, TestError, TestRunner};
use std::cell::RefCell;
use std::fs;
use std::path::Path;
use std::str::FromStr;

/// How an input ended that is no failure of the test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// Exit code 0.
    Done,
    /// Exit code 2, with a message.
    Stopped,
}

fn from_environment<T: FromStr>(name: &str) -> Option<T> {
    std::env::var(name).ok()?.parse().ok()
}

/// Checks `count` inputs of a family from seed `first` on. Failing inputs are written to files; the
/// first is made smaller. At least a quarter have to run: input that is refused shows nothing.
pub(crate) fn hold<S: Strategy>(
    family: &str,
    (first, count): (u64, u64),
    strategy: &S,
    text: impl Fn(&S::Value) -> String,
    check: impl Fn(&S::Value) -> Result<End, String>,
) {
    let count = from_environment("PILUM_RANDOM").unwrap_or(count);
    let first = from_environment("PILUM_RANDOM_SEED").unwrap_or(first);
    let mut failures = Vec::new();
    let mut done = 0;
    for seed in first..first + count {
        let may_shrink = failures.is_empty() && count <= 2000;
        let mut runner = TestRunner::new(ProptestConfig {
            cases: 1,
            rng_seed: RngSeed::Fixed(seed),
            failure_persistence: None,
            max_shrink_iters: if may_shrink { 200 } else { 0 },
            ..ProptestConfig::default()
        });
        let given = RefCell::new(None);
        let end = RefCell::new(None);
        let outcome = runner.run(strategy, |value| {
            given.borrow_mut().get_or_insert_with(|| text(&value));
            let found = check(&value).map_err(TestCaseError::fail)?;
            end.borrow_mut().get_or_insert(found);
            Ok(())
        });
        match outcome {
            Ok(()) => done += u64::from(end.take() == Some(End::Done)),
            Err(TestError::Fail(reason, value)) => {
                let file = |kind: &str, text: &str| {
                    let name = format!("{family}_{seed}{kind}.toml");
                    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
                    fs::write(&path, text).unwrap();
                    path.display().to_string()
                };
                let given = file("", &given.take().unwrap_or_default());
                let small = if may_shrink {
                    format!(", smaller {}", file("_small", &text(&value)))
                } else {
                    String::new()
                };
                eprintln!("{family} {seed}: {reason}\n  {given}{small}");
                failures.push(format!("{seed}: {reason}"));
            }
            Err(TestError::Abort(reason)) => panic!("{family} {seed}: {reason}"),
        }
    }
    eprintln!(
        "{family}: of {count}, {done} done, {} failed",
        failures.len()
    );
    let listed = failures.join("\n  ");
    assert!(
        failures.is_empty(),
        "{family}: {} of {count} fail, by seed:\n  {listed}",
        failures.len()
    );
    assert!(
        4 * done >= count,
        "{family}: only {done} of {count} are done"
    );
}
