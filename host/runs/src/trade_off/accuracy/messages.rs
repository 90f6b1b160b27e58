//! What a study for an accuracy says.

use super::STUDY;
use crate::experiment::progress::in_words;
use input::accuracy_settings::{AccuracySettings, ChosenMesh, FailedTrial, Verdict};
use std::fmt::Write;

/// A trial came to no end.
pub(super) fn failed(run: usize, failed: &FailedTrial) -> String {
    format!("{STUDY}: run {run} failed: {}", failed.reason)
}

/// Schemes are not looked for: a run takes this many seconds.
pub(super) fn no_schemes(seconds: f64) -> String {
    let takes = in_words(seconds);
    format!("{STUDY}: a run takes {takes}, so the schemes of the laws are left as they are")
}

/// How an error was estimated from the two finest of at least three runs.
pub(super) fn estimate([next, finest]: [f64; 2], order: f64) -> String {
    format!(
        "the difference of two runs with increments × {next} and × {finest} of the file, extrapolated \
         with an order of at most {order}, plus the difference of the chosen run to the finest, plus the effect \
         of the tolerance; largest over probes and common rows, relative to the largest value of the probe"
    )
}

/// Why no error could be estimated.
pub(super) fn no_estimate(runs: usize) -> String {
    format!(
        "none: it takes three runs with different increments in every phase that is not linear, and {runs} came to the \
         end"
    )
}

/// A finer mesh was not tried: it takes so long, and so much is left.
pub(super) fn too_long(division: usize, [takes, left]: [String; 2]) -> String {
    format!("mesh / {division} would take about {takes} of CPU time, and {left} are left for it")
}

/// A finer mesh was tried in vain.
pub(super) fn mesh_failed(division: usize) -> String {
    format!("mesh / {division} failed")
}

/// How the error of this many meshes was estimated, and why there is no finer one.
pub(super) fn mesh_estimate(n: usize, [least, order]: [f64; 2], why: Option<String>) -> String {
    let mut text = match n {
        1 => "none, there is no finer mesh to tell it".to_owned(),
        2 => format!(
            "the difference of two meshes, as if it fell with order {order}: it takes a third one to see the order"
        ),
        _ => format!(
            "the difference of the two finest of {n} meshes, extrapolated with the order they show, at most {order} and \
             at least {least}"
        ),
    };
    text.extend(why.map(|why| format!("; {why}")));
    text
}

/// Why the error of this many meshes is not estimated: the difference of the two finest is not smaller than the one
/// before.
pub(super) fn mesh_diverges(n: usize, [coarse, fine]: [f64; 2], why: Option<String>) -> String {
    let mut text = format!(
        "none, the results do not converge under refinement: of {n} meshes the two finest differ by {fine:.1e}, those \
         before by {coarse:.1e}"
    );
    text.extend(why.map(|why| format!("; {why}")));
    text
}

/// Whether what was asked for is reached, and with what settings: of a result that is short of it a
/// warning.
pub(super) fn outcome(chosen: &AccuracySettings) -> Result<String, String> {
    let settings = settings(chosen);
    match chosen.verdict {
        Verdict::Reached if chosen.cut_back > 0 => Err(format!(
            "the accuracy is reached as far as increments tell: {settings}"
        )),
        Verdict::Reached => Ok(format!("{STUDY}: {settings}")),
        Verdict::NotReached => Err(format!("the accuracy is not reached: {settings}")),
        Verdict::NotKnown => Err(format!(
            "it is not known whether the accuracy is reached: {settings}"
        )),
    }
}

/// Note about columns that do not count.
pub(in super::super) fn zero(names: &[String]) -> String {
    let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    let (is, counts) = match names.len() {
        1 => ("is", "does not count"),
        _ => ("are", "do not count"),
    };
    format!(
        "{} {is} zero within round-off and {counts}",
        names.join(", ")
    )
}

/// The mesh that is chosen, and its error.
fn of_mesh(mesh: &ChosenMesh) -> String {
    let estimate = &mesh.estimate;
    match (mesh.error, mesh.divided_by) {
        (Some(error), 1) => format!("; the file's mesh, its error {error:.1e} ({estimate})"),
        (Some(error), by) => format!("; mesh / {by}, its error {error:.1e} ({estimate})"),
        (None, _) => format!("; error of the mesh: {estimate}"),
    }
}

/// The choice, its error, and the failed trials.
fn settings(chosen: &AccuracySettings) -> String {
    let asked = format!("{:.1e} asked for", chosen.asked);
    let error = match (chosen.reached, chosen.without_mesh, chosen.difference) {
        (Some(error), ..) => format!("error {error:.1e} estimated, {asked}"),
        (None, Some(error), _) => format!("{asked}; increments and tolerance have {error:.1e}"),
        (None, None, Some(difference)) => format!(
            "{asked}; the two finest runs that came to their end differ by {difference:.1e}, and it takes three with \
             different increments in every phase to tell the error"
        ),
        (None, None, None) => format!("{asked}; a single run came to its end"),
    };
    let mesh = chosen.mesh.as_ref().map(of_mesh);
    let increments = chosen.increments.iter();
    let increments: Vec<String> = increments
        .map(|(phase, n)| format!("{phase} {n}"))
        .collect();
    let mut text = format!(
        "{error}{}; increments {}, force tolerance {:e} {}",
        mesh.unwrap_or_default(),
        increments.join(", "),
        chosen.force_tolerance,
        chosen.parameters.join(" ")
    );
    text.truncate(text.trim_end().len());
    let rest = chosen.without_mesh.unwrap_or_default();
    let is_mesh_worse = |mesh: &&ChosenMesh| mesh.difference.is_some_and(|d| d > rest);
    let worse_mesh = chosen.mesh.as_ref().filter(is_mesh_worse);
    let worst = worse_mesh.map_or(&chosen.worst, |mesh| &mesh.worst);
    if let (Some(probe), Verdict::NotReached | Verdict::NotKnown) = (worst, chosen.verdict) {
        let _ = write!(text, "; the runs differ most in `{probe}`");
    }
    if chosen.cut_back > 0 && chosen.without_mesh.is_some() {
        let _ = write!(
            text,
            "; of the three runs that tell the error of increments {} cut steps back: their steps differ by less than \
             their increments, and the error may be larger",
            chosen.cut_back
        );
    }
    if !chosen.zero.is_empty() {
        let _ = write!(text, "; {}", zero(&chosen.zero));
    }
    if !chosen.failed.is_empty() {
        let failed: Vec<&str> = chosen.failed.iter().map(|f| f.setting.as_str()).collect();
        let failed = failed.join("; ");
        let _ = write!(text, "; failed ({STUDY}.csv has why): {failed}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_reached_by_runs_that_cut_steps_back_is_a_warning() {
        let mut chosen = AccuracySettings {
            asked: 0.01,
            reached: Some(0.004),
            without_mesh: Some(0.004),
            mesh: None,
            is_reached: true,
            verdict: Verdict::Reached,
            difference: Some(0.002),
            worst: None,
            estimate: String::new(),
            cut_back: 0,
            increments: vec![("push".to_owned(), 8)],
            force_tolerance: 1e-9,
            displacement_tolerance: 1e-7,
            parameters: Vec::new(),
            zero: Vec::new(),
            runs: 3,
            failed: Vec::new(),
        };
        let plain = outcome(&chosen).unwrap();
        assert!(!plain.contains("cut steps back"), "{plain}");
        chosen.cut_back = 2;
        let warned = outcome(&chosen).unwrap_err();
        assert!(warned.contains("increments 2 cut steps back"), "{warned}");
    }
}
