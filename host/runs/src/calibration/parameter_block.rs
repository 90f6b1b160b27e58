//! The set of parameters to paste.

use super::messages::digits;
use super::model::{Model, Subject};
use input::calibration::Calibration;
use input::material::ParameterValue;
use std::fmt::Write as _;

/// The set to paste: into drivers, and into cases.
pub(super) fn block(calibration: &Calibration, model: &Model, values: &[f64]) -> String {
    let mut of_driver: Vec<(String, String)> = Vec::new();
    let mut of_cases: Vec<(String, Vec<(String, String)>)> = Vec::new();
    let number = |value: f64| {
        let text = digits(value);
        if text.contains(['.', 'e']) {
            text
        } else {
            format!("{text}.0")
        }
    };
    let written = |value: &ParameterValue| match value {
        ParameterValue::Number(value) => Some(number(*value)),
        ParameterValue::Integer(value) => Some(value.to_string()),
        ParameterValue::Label(label) => Some(format!("{label:?}")),
        ParameterValue::Varying(_) => None,
    };
    // What all drivers give alike belongs to the set.
    let drivers: Vec<_> = model
        .tests
        .iter()
        .filter_map(|test| match &test.subject {
            Subject::Driver(driver) => driver.parameters(),
            Subject::Case(_) => None,
        })
        .collect();
    let is_looked_for = |id: &str| {
        let mut targets = model.tests.iter().flat_map(|test| &test.targets);
        targets.any(|(_, table, other)| table.is_none() && other == id)
    };
    for (id, value) in drivers.first().into_iter().flat_map(|table| table.iter()) {
        let is_alike = drivers.iter().all(|table| {
            let mut others = table
                .iter()
                .filter(|(other, _)| other.get_ref() == id.get_ref());
            others.any(|(_, other)| other.get_ref() == value.get_ref())
        });
        if is_alike && !is_looked_for(id.get_ref()) {
            let text = written(value.get_ref());
            of_driver.extend(text.map(|text| (id.get_ref().clone(), text)));
        }
    }
    let mut add = |table: Option<&String>, id: &str, text: String| {
        let entries = match table {
            None => &mut of_driver,
            Some(name) => {
                let known = of_cases.iter().position(|(other, _)| other == name);
                if known.is_none() {
                    of_cases.push((name.clone(), Vec::new()));
                }
                let place = known.unwrap_or(of_cases.len() - 1);
                &mut of_cases[place].1
            }
        };
        if !entries.iter().any(|(other, _)| other == id) {
            entries.push((id.to_owned(), text));
        }
    };
    for (name, input) in &calibration.file.fixed {
        let input = input.get_ref();
        let id = input.parameter.as_ref().unwrap_or(name).get_ref();
        for law in &input.laws {
            if let Some(text) = written(input.value.get_ref()) {
                add(Some(law.get_ref()), id, text);
            }
        }
    }
    for (parameter, table, id) in model.tests.iter().flat_map(|test| &test.targets) {
        add(table.as_ref(), id, number(values[*parameter]));
    }
    let mut text = String::new();
    let mut table = |heading: &str, entries: &[(String, String)]| {
        if !entries.is_empty() {
            let lines: Vec<String> = entries
                .iter()
                .map(|(id, v)| format!("{id} = {v}\n"))
                .collect();
            let gap = if text.is_empty() { "" } else { "\n" };
            let _ = write!(text, "{gap}[{heading}]\n{}", lines.concat());
        }
    };
    table("parameters", &of_driver);
    for (name, entries) in &of_cases {
        table(&format!("laws.{name}.parameters"), entries);
    }
    text
}
