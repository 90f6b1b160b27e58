//! Runs side by side: settings and final values.

use super::number_format::display;
use super::results::Run;
use crate::summary::{self, RunSetting};
use serde::Serialize;
use serde_json::Value;

/// A setting of every run.
#[derive(Debug, Serialize)]
pub(super) struct Setting {
    section: String,
    name: String,
    /// By run; empty where there is no such setting.
    values: Vec<String>,
    /// The same, where they are numbers.
    #[serde(skip)]
    numbers: Vec<Option<f64>>,
    #[serde(skip)]
    is_of_law: bool,
    pub(super) differs: bool,
}

impl Setting {
    /// Values for colouring curves: numbers if all are numbers, else texts.
    fn by_run(&self) -> Varied<'_> {
        let numbers: Option<Vec<f64>> = self.numbers.iter().copied().collect();
        Varied {
            name: format!("{}: {}", self.section, self.name),
            texts: numbers.is_none().then_some(&self.values),
            numbers,
            is_first_choice: self.is_of_law,
        }
    }
}

/// A setting that differs, for the script.
#[derive(Debug, Serialize)]
pub(super) struct Varied<'s> {
    name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    numbers: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    texts: Option<&'s Vec<String>>,
    /// It is rather what was varied than what followed from it.
    #[serde(skip)]
    is_first_choice: bool,
}

/// The settings that differ, those first that curves are best coloured by: parameters of laws, and
/// of these and the others the numbers.
pub(super) fn varied(settings: &[Setting]) -> Vec<Varied<'_>> {
    let differing = settings.iter().filter(|setting| setting.differs);
    let mut varied: Vec<Varied<'_>> = differing.map(Setting::by_run).collect();
    varied.sort_by_key(|varied| (!varied.is_first_choice, varied.numbers.is_none()));
    varied
}

/// Common title of many runs: their shared title, else their cases.
pub(super) fn subject(runs: &[Run]) -> String {
    let distinct = |of: fn(&Run) -> &str| {
        let mut found: Vec<&str> = Vec::new();
        for name in runs.iter().map(of) {
            if !found.contains(&name) {
                found.push(name);
            }
        }
        found
    };
    let titles = distinct(|run| run.summary.head.title.as_str());
    let cases = distinct(|run| run.summary.head.case.as_str());
    let n = runs.len();
    match (titles.as_slice(), cases.as_slice()) {
        ([title], _) if !title.is_empty() => format!("{n} runs of {title}"),
        (_, [case]) if !case.is_empty() => format!("{n} runs of {case}"),
        (_, [_, _, _, _, ..]) => format!("{n} runs of {} cases", cases.len()),
        (_, cases) if cases.iter().all(|case| !case.is_empty()) => {
            format!("{n} runs of {}", cases.join(", "))
        }
        _ => format!("{n} runs"),
    }
}

/// Final values of a probe.
#[derive(Debug, Serialize)]
pub(super) struct FinalValue {
    name: String,
    unit: String,
    /// By run: value, and difference from the first.
    values: Vec<(String, String)>,
}

/// Settings of all runs, in the order in which they first appear.
pub(super) fn settings(runs: &[Run]) -> Vec<Setting> {
    let of_runs = runs.iter().map(|run| summary::settings(&run.summary));
    let all: Vec<Vec<RunSetting>> = of_runs.collect();
    let mut settings: Vec<Setting> = Vec::new();
    for (number, of_run) in all.into_iter().enumerate() {
        let mut after = None;
        for of_run in of_run {
            let (value, number_of_run) = (shown(&of_run), of_run.value.as_f64());
            let RunSetting {
                section,
                is_of_law,
                name,
                ..
            } = of_run;
            let found = settings
                .iter()
                .position(|s| s.section == section && s.name == name);
            let at = found.unwrap_or_else(|| {
                // Behind its neighbour or at the end of its section.
                let end = settings.iter().rposition(|s| s.section == section);
                let at = after.max(end).map_or(settings.len(), |i: usize| i + 1);
                settings.insert(
                    at,
                    Setting {
                        section,
                        name,
                        values: vec![String::new(); runs.len()],
                        numbers: vec![None; runs.len()],
                        is_of_law,
                        differs: false,
                    },
                );
                at
            });
            settings[at].values[number] = value;
            settings[at].numbers[number] = number_of_run;
            after = Some(at);
        }
    }
    for setting in &mut settings {
        setting.differs = setting.values.windows(2).any(|pair| pair[0] != pair[1]);
    }
    settings
}

/// A setting of a run as the page shows it.
fn shown(setting: &RunSetting) -> String {
    let RunSetting { value, unit, .. } = setting;
    let value = match value {
        Value::String(text) => text.clone(),
        Value::Number(number) => number.as_f64().map(display).unwrap_or_default(),
        other => other.to_string(),
    };
    match unit.as_str() {
        "" | "-" => value,
        unit => format!("{value} {unit}"),
    }
}

/// Final values of all probes of all runs.
pub(super) fn final_values(runs: &[Run]) -> Vec<FinalValue> {
    let mut names: Vec<&str> = Vec::new();
    for name in runs.iter().flat_map(|run| run.history.probes()) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let first = |name: &str| runs.first().and_then(|run| run.history.last(name));
    let values = |name: &str| {
        let of_run = |(number, run): (usize, &Run)| {
            let value = run.history.last(name);
            let difference = match (number, first(name), value) {
                (1.., Some(first), Some(value)) => difference(first, value),
                _ => String::new(),
            };
            (value.map(display).unwrap_or_default(), difference)
        };
        runs.iter().enumerate().map(of_run).collect()
    };
    let unit = |name: &str| runs.iter().find_map(|run| run.units().get(name).copied());
    let final_value = |name: &str| FinalValue {
        name: name.to_owned(),
        unit: unit(name).unwrap_or_default().to_owned(),
        values: values(name),
    };
    names.into_iter().map(final_value).collect()
}

/// By how much a value differs from the first, in per cent of it.
fn difference(first: f64, value: f64) -> String {
    if (value - first).abs() <= 1e-12 * first.abs() {
        return "±0".to_owned();
    }
    if first == 0.0 {
        return format!("{:+.3e}", value - first);
    }
    let percent = 100.0 * (value - first) / first.abs();
    match percent.abs() {
        1000.0.. => format!("×{:.3e}", value / first),
        10.0..1000.0 => format!("{percent:+.1} %"),
        0.01..10.0 => format!("{percent:+.2} %"),
        _ => format!("{percent:+.1e} %"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_in_per_cent_of_the_first() {
        assert_eq!(difference(100.0, 101.5), "+1.50 %");
        assert_eq!(difference(-2.0, -1.0), "+50.0 %");
        assert_eq!(difference(3.0, 3.0), "±0");
        assert_eq!(difference(0.0, 1.0), "+1.000e0");
        assert_eq!(difference(1e-13, 1.0), "×1.000e13");
        assert_eq!(difference(1.0, 1.000_001), "+1.0e-4 %");
    }
}
