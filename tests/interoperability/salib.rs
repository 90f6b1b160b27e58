//! Indices of sensitivity of `pilum study`, held against those of SALib.

use crate::{beside, installed, is_there, last_line};
use results::study::indices;
use serde_json::Value;
use std::process::Command;
use tests::tolerance::close;

const SALIB: &str = "salib/bin/python";

fn column(of: &Value, key: &str) -> Vec<f64> {
    let values = of[key].as_array().unwrap().iter();
    values.map(|value| value.as_f64().unwrap()).collect()
}

/// Its estimators are the same: the numbers agree but for rounding. Its intervals are 1.96 deviations of drawn indices,
/// ours quantiles of them: half their widths agree to a fifth.
#[test]
fn indices_of_the_ishigami_function_are_those_of_salib() {
    if !is_there(SALIB) {
        return;
    }
    let mut command = Command::new(installed(SALIB));
    command.arg(beside("salib.py")).args(["ishigami", "1024"]);
    let theirs: Value = serde_json::from_str(&last_line(&mut command)).unwrap();
    let numbers: Vec<Option<f64>> = column(&theirs, "numbers").into_iter().map(Some).collect();
    let ours = indices(&numbers, 3);
    for (i, of) in ours.iter().enumerate() {
        for (estimate, key) in [(of.first, "S1"), (of.total, "ST")] {
            let expected = column(&theirs, key)[i];
            close(format_args!("{key} {i}"), estimate.value, expected, 1e-12);
            let [low, high] = estimate.interval.unwrap();
            let half = column(&theirs, &format!("{key}_conf"))[i];
            assert!(
                (0.5 * (high - low) / half - 1.0).abs() < 0.2,
                "{key} {i}: {estimate:?} {half}"
            );
        }
    }
}
