//! A law on the page: its parameters with their values.

use super::number_format::display;
use crate::summary::{Law, Range};
use minijinja::value::Serde;
use minijinja::{Value as Template, context};

/// A law as the page's template takes it.
pub(super) fn law((name, law): (&String, &Law)) -> Template {
    let number = |id: &str, value: Option<f64>| match law.varying.get(id) {
        Some(Range { smallest, largest }) => {
            format!("{} to {}", display(*smallest), display(*largest))
        }
        None => value.map(display).unwrap_or_default(),
    };
    let described = law.described_parameters.iter().map(|p| {
        context! {
            value => p.choice.clone().unwrap_or_else(|| number(&p.id, p.value)),
            ..Template::from(Serde(p))
        }
    });
    let mut parameters: Vec<Template> = described.collect();
    if parameters.is_empty() {
        let plain =
            |(id, value): (&String, &Option<f64>)| context! { id, value => number(id, *value) };
        parameters = law.parameters.iter().map(plain).collect();
    }
    context! {
        name,
        parameters,
        variables => Template::from(Serde(&law.internal_variables)),
        id => law.law.as_str(),
        called => law.name.as_str(),
        doc => law.doc.as_str(),
        references => law.references.as_str(),
        version => law.version.as_str(),
        sha256 => law.sha256.as_str(),
    }
}
