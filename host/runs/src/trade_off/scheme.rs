//! Integration schemes of laws, known to the host only as parameters.
//!
//! A law whose parameter `scheme` is a choice is tried with every label. Parameters that steer a
//! scheme have the ids below; one belongs to a scheme if the result changes with it.

use input::material::ParameterValue;
use law::LawDescription;

/// Id of the choice.
const SCHEME: &str = "scheme";
/// Ids of what steers a scheme, and the values tried, coarse to fine.
const CONTROLS: [(&str, [f64; 4]); 2] = [
    ("substeps", [1.0, 5.0, 20.0, 100.0]),
    ("scheme_tolerance", [1e-2, 1e-4, 1e-6, 1e-8]),
];

/// Values of parameters by id.
pub(super) type Values = Vec<(String, ParameterValue)>;

/// A scheme with all that steers it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Scheme {
    /// In words; empty for a law without schemes.
    pub(super) label: String,
    /// Label of the choice alone.
    pub(super) choice: String,
    /// Parameters to set.
    pub(super) values: Values,
    /// It is what the file asks for.
    pub(super) is_default: bool,
    /// Nothing finer of this choice is tried.
    pub(super) is_finest: bool,
}

impl Scheme {
    /// Law, values, and words for them, as settings take them.
    pub(super) fn of(&self, law: &str) -> (String, Values, String) {
        let words = format!("{law}: {}", self.label);
        (law.to_owned(), self.values.clone(), words)
    }
}

impl Scheme {
    /// That of a law without a choice.
    fn only() -> Self {
        Self {
            is_default: true,
            is_finest: true,
            ..Self::default()
        }
    }
}

/// The schemes of a law. `current` gives the value of a parameter in the file, `differ` says
/// whether two sets of values lead to different results.
pub(super) fn schemes(
    law: &LawDescription,
    current: impl Fn(&str) -> Option<f64>,
    mut differ: impl FnMut(&Values, &Values) -> bool,
) -> Vec<Scheme> {
    let declared = |id: &str| law.parameters.iter().find(|p| p.id == id);
    let choices = declared(SCHEME).map_or(&[][..], |p| &p.choices);
    if choices.is_empty() {
        return vec![Scheme::only()];
    }
    let mut schemes = Vec::new();
    for (index, choice) in choices.iter().enumerate() {
        let chosen = (SCHEME.to_owned(), ParameterValue::Label(choice.clone()));
        let is_current = current(SCHEME).is_some_and(|v| v.total_cmp(&(index as f64)).is_eq());
        let with = |id: &str, value: f64| -> Values {
            let control = (id.to_owned(), ParameterValue::Number(value));
            vec![chosen.clone(), control]
        };
        let is_number = |id: &str| declared(id).is_some_and(|p| p.choices.is_empty());
        let control = CONTROLS.iter().find(|(id, [coarse, .., fine])| {
            is_number(id) && differ(&with(id, *coarse), &with(id, *fine))
        });
        let Some((id, values)) = control else {
            schemes.push(Scheme {
                label: choice.clone(),
                choice: choice.clone(),
                values: vec![chosen],
                is_default: is_current,
                is_finest: true,
            });
            continue;
        };
        let in_file = current(id).filter(|_| is_current);
        let mut tried = values.to_vec();
        tried.extend(in_file.filter(|v| values.iter().all(|w| w.total_cmp(v).is_ne())));
        for value in tried {
            schemes.push(Scheme {
                label: format!("{choice}, {id} {}", short(value)),
                choice: choice.clone(),
                values: with(id, value),
                is_default: in_file.is_some_and(|v| v.total_cmp(&value).is_eq()),
                is_finest: value.total_cmp(&values[values.len() - 1]).is_eq(),
            });
        }
    }
    schemes
}

/// A number in few characters.
pub(super) fn short(value: f64) -> String {
    if value == 0.0 || (0.01..1e6).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use law::{Bounds, ParameterDescription};

    fn parameter(id: &str, choices: &[&str]) -> ParameterDescription {
        let any = Bounds {
            lower: f64::NEG_INFINITY,
            open_lower: false,
            upper: f64::INFINITY,
            open_upper: false,
        };
        ParameterDescription {
            id: id.to_owned(),
            symbol: String::new(),
            unit: String::new(),
            doc: String::new(),
            default: None,
            optional: false,
            bounds: any,
            usual: any,
            choices: choices.iter().map(|c| (*c).to_owned()).collect(),
        }
    }

    fn law(parameters: Vec<ParameterDescription>) -> LawDescription {
        LawDescription {
            id: "some".to_owned(),
            name: String::new(),
            version: String::new(),
            author: String::new(),
            licence: String::new(),
            doc: String::new(),
            references: String::new(),
            parameters,
            formulations: Vec::new(),
        }
    }

    #[test]
    fn a_law_without_schemes_is_left_as_it_is() {
        let found = schemes(&law(vec![parameter("k", &[])]), |_| None, |_, _| true);
        assert_eq!(found.len(), 1);
        assert!(found[0].values.is_empty() && found[0].is_default);
    }

    #[test]
    fn a_control_belongs_to_the_scheme_whose_result_it_changes() {
        let law = law(vec![
            parameter("scheme", &["closed", "stepped"]),
            parameter("substeps", &[]),
        ]);
        let stepped = |v: &Values| v[0].1 == ParameterValue::Label("stepped".to_owned());
        let current = |id: &str| Some(if id == "scheme" { 1.0 } else { 7.0 });
        let found = schemes(&law, current, |a, _| stepped(a));
        let labels: Vec<&str> = found.iter().map(|s| s.label.as_str()).collect();
        assert_eq!(
            labels,
            [
                "closed",
                "stepped, substeps 1",
                "stepped, substeps 5",
                "stepped, substeps 20",
                "stepped, substeps 100",
                "stepped, substeps 7",
            ]
        );
        let default: Vec<&str> = found
            .iter()
            .filter(|s| s.is_default)
            .map(|s| s.label.as_str())
            .collect();
        assert_eq!(default, ["stepped, substeps 7"]);
    }
}
