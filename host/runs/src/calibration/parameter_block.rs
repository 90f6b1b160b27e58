//! The set of parameters to paste.

use super::model::{Model, Subject};
use crate::experiment::digits;
use input::calibration::Calibration;
use input::material::ParameterValue;
use std::fmt::Write as _;

/// Parameters of one law: its table in cases, none of drivers; ids with values as they are written.
type Table = (Option<String>, Vec<(String, String)>);

/// The set to paste: into drivers, and into cases.
pub(super) fn block(calibration: &Calibration, model: &Model, values: &[f64]) -> String {
    let mut tables: Vec<Table> = vec![(None, alike(model))];
    let mut add = |table: Option<&String>, id: &str, text: String| {
        let known = tables.iter().position(|(other, _)| other.as_ref() == table);
        let place = known.unwrap_or_else(|| {
            tables.push((table.cloned(), Vec::new()));
            tables.len() - 1
        });
        let entries = &mut tables[place].1;
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
    for (table, entries) in tables.iter().filter(|(_, entries)| !entries.is_empty()) {
        let gap = if text.is_empty() { "" } else { "\n" };
        let _ = match table {
            None => writeln!(text, "{gap}[parameters]"),
            Some(name) => writeln!(text, "{gap}[laws.{name}.parameters]"),
        };
        for (id, value) in entries {
            let _ = writeln!(text, "{id} = {value}");
        }
    }
    text
}

/// Parameters that all drivers give alike, and that are not looked for.
fn alike(model: &Model) -> Vec<(String, String)> {
    let drivers = model.tests.iter().filter_map(|test| match &test.subject {
        Subject::Driver(driver) => driver.parameters(),
        Subject::Case(_) => None,
    });
    let drivers: Vec<_> = drivers.collect();
    let is_looked_for = |id: &str| {
        let mut targets = model.tests.iter().flat_map(|test| &test.targets);
        targets.any(|(_, table, other)| table.is_none() && other == id)
    };
    let mut found = Vec::new();
    for (id, value) in drivers.first().into_iter().flat_map(|table| table.iter()) {
        let is_alike = drivers.iter().all(|table| {
            let mut own = table.iter();
            own.any(|(other, own)| {
                other.get_ref() == id.get_ref() && own.get_ref() == value.get_ref()
            })
        });
        if is_alike && !is_looked_for(id.get_ref()) {
            found.extend(written(value.get_ref()).map(|text| (id.get_ref().clone(), text)));
        }
    }
    found
}

/// As the value of a parameter is written in a file.
fn written(value: &ParameterValue) -> Option<String> {
    match value {
        ParameterValue::Number(value) => Some(number(*value)),
        ParameterValue::Integer(value) => Some(value.to_string()),
        ParameterValue::Label(label) => Some(format!("{label:?}")),
        ParameterValue::Varying(_) => None,
    }
}

fn number(value: f64) -> String {
    let text = digits(value);
    if text.contains(['.', 'e']) {
        text
    } else {
        format!("{text}.0")
    }
}
