//! What `pilum laws` prints: the laws found, and a page about one of them.

use crate::error::Error;
use crate::plugin::{InternalVariable, LoadedLaw, ParameterDescription, SearchPath};
use std::fmt::Write;

/// One line for every law found.
///
/// # Errors
/// A library that claims a law cannot be used.
pub fn list(search: &SearchPath) -> Result<String, Error> {
    let mut text = String::new();
    for id in search.installed().keys() {
        let law = search.law(id)?;
        let description = law.description();
        let _ = writeln!(
            text,
            "{id:24}{:80}{}",
            description.name,
            description.hypotheses()
        );
    }
    if text.is_empty() {
        text.push_str("no law library is installed\n");
    }
    Ok(text)
}

/// Everything a user needs to know of a law.
pub fn page(law: &LoadedLaw) -> String {
    let description = law.description();
    let mut text = format!(
        "{}: {}\n\n{}\n\nfor         {}\nversion     {} ({})\nauthors     {}\nsource      {}\n\
         library     {}\nsha256      {}\n",
        description.id,
        description.name,
        description.doc,
        description.hypotheses(),
        description.version,
        description.licence,
        description.author,
        description.references,
        law.library().path().display(),
        law.library().sha256(),
    );
    text.push_str("\nparameters\n");
    for parameter in &description.parameters {
        text.push_str(&parameter_lines(parameter));
    }
    for formulation in &description.formulations {
        let _ = write!(text, "\ninternal variables, {}", formulation.hypothesis);
        text.push_str(if formulation.internal_variables.is_empty() {
            ": none\n"
        } else {
            "\n"
        });
        for variable in &formulation.internal_variables {
            text.push_str(&variable_line(variable));
        }
    }
    text.push_str(
        "\nSigns: tension and opening positive; shear strain γ = 2ε; angles in degrees.\n",
    );
    text
}

fn parameter_lines(p: &ParameterDescription) -> String {
    let default = match (p.default, p.optional) {
        (Some(value), _) if !p.choices.is_empty() => {
            let label = p.choices.get(value as usize).map_or("", String::as_str);
            format!("default {label}")
        }
        (Some(value), _) => format!("default {value}"),
        (None, true) => "may be left out".to_owned(),
        (None, false) => "required".to_owned(),
    };
    let range = if p.choices.is_empty() {
        format!("in {}", p.bounds)
    } else {
        format!("one of {}", p.choices.join(", "))
    };
    let unlimited = p.usual.lower == f64::NEG_INFINITY && p.usual.upper == f64::INFINITY;
    let usual = if unlimited {
        String::new()
    } else {
        format!(", usually {}", p.usual)
    };
    format!(
        "  {:18}{:8}{:14}{default}; {range}{usual}\n  {:18}{}\n",
        p.id, p.symbol, p.unit, "", p.doc
    )
}

fn variable_line(v: &InternalVariable) -> String {
    format!("  {:22}{:10}{:8}{}\n", v.id, v.symbol, v.unit, v.doc)
}
