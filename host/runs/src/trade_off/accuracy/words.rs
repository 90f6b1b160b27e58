//! What a study for an accuracy says.

use super::STUDY;
use input::chosen::{Chosen, FailedTrial, Verdict};

/// A trial came to no end.
pub(super) fn failed(run: usize, failed: &FailedTrial) -> String {
    format!("{STUDY}: run {run} failed: {}", failed.reason)
}

/// How an error was estimated from the two finest of at least three runs.
pub(super) fn estimate([next, finest]: [f64; 2], order: f64) -> String {
    format!(
        "the difference of two runs with increments × {next} and × {finest} of the file, extrapolated \
         with an order of at most {order}, plus the difference of the chosen run to the finest, plus the effect \
         of the tolerance; largest over probes and common rows, relative to the largest value of the probe. \
         The error of the mesh is not included"
    )
}

/// Why no error could be estimated.
pub(super) fn no_estimate(runs: usize) -> String {
    format!("none: it takes three runs of different increments, and {runs} came to the end")
}

/// Whether what was asked for is reached, and with what settings: of a result that is short of it a
/// warning.
pub(super) fn outcome(chosen: &Chosen) -> Result<String, String> {
    let settings = settings(chosen);
    match chosen.verdict {
        Verdict::Reached => Ok(format!("{STUDY}: {settings}")),
        Verdict::NotReached => Err(format!("the accuracy is not reached: {settings}")),
        Verdict::NotKnown => Err(format!(
            "it is not known whether the accuracy is reached: {settings}"
        )),
    }
}

/// What was chosen, the error that it has, and what failed on the way.
fn settings(chosen: &Chosen) -> String {
    let asked = format!("{:.1e} asked for", chosen.asked);
    let error = match (chosen.reached, chosen.difference) {
        (Some(error), _) => format!("error {error:.1e} estimated, {asked}"),
        (None, Some(difference)) => format!(
            "{asked}; the two finest runs that came to their end differ by {difference:.1e}, and it takes a third \
             one to tell the error"
        ),
        (None, None) => format!("{asked}; a single run came to its end"),
    };
    let increments: Vec<String> = chosen
        .increments
        .iter()
        .map(|(phase, n)| format!("{phase} {n}"))
        .collect();
    let mut text = format!(
        "{error}; increments {}, force tolerance {:e} {}",
        increments.join(", "),
        chosen.force_tolerance,
        chosen.parameters.join(" ")
    );
    text.truncate(text.trim_end().len());
    if !chosen.failed.is_empty() {
        let failed: Vec<&str> = chosen.failed.iter().map(|f| f.setting.as_str()).collect();
        text += &format!("; failed ({STUDY}.csv has why): {}", failed.join("; "));
    }
    text
}
