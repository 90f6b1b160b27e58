//! Is what the library says about its laws readable, complete and true?

use super::{Check, Family, Found, Subject, Verdict};

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "description-is-readable",
        family: Family::Description,
        description: "The tables can be read and make sense: plausible counts and sizes, UTF-8, \
                      ids well-formed and unique, bounds in order, known gradients and fluxes.",
        needs: &["entry-is-idempotent"],
        run: description_is_readable,
    },
    Check {
        id: "description-is-complete",
        family: Family::Description,
        description: "No text is empty, initial values are finite, and every law offers a \
                      hypothesis (warning).",
        needs: &["description-is-readable"],
        run: description_is_complete,
    },
    Check {
        id: "units-are-known",
        family: Family::Description,
        description: "Units are made of kPa, kN, kJ, m, mm, s, h, d, deg, rad, 1 and - (warning).",
        needs: &["description-is-readable"],
        run: units_are_known,
    },
];

fn description_is_readable(subject: &Subject) -> Found {
    let laws = subject.laws()?;
    let names: Vec<String> = laws
        .iter()
        .map(|law| {
            let description = law.description();
            format!(
                "{} {} ({})",
                description.id,
                description.version,
                description.hypotheses()
            )
        })
        .collect();
    Ok(names.join(", "))
}

fn description_is_complete(subject: &Subject) -> Found {
    let mut gaps = Vec::new();
    for law in subject.laws()? {
        let d = law.description();
        let empty = |what: &str, text: &str| {
            text.is_empty()
                .then(|| format!("{what} of `{}` is empty", d.id))
        };
        for (what, value) in [
            ("name", &d.name),
            ("version", &d.version),
            ("author", &d.author),
            ("licence", &d.licence),
            ("doc", &d.doc),
            ("references", &d.references),
        ] {
            gaps.extend(empty(what, value));
        }
        for p in &d.parameters {
            for (what, value) in [("symbol", &p.symbol), ("unit", &p.unit), ("doc", &p.doc)] {
                gaps.extend(empty(&format!("the {what} of parameter `{}`", p.id), value));
            }
        }
        for formulation in &d.formulations {
            for v in &formulation.internal_variables {
                for (what, value) in [("symbol", &v.symbol), ("unit", &v.unit), ("doc", &v.doc)] {
                    gaps.extend(empty(
                        &format!("the {what} of internal variable `{}`", v.id),
                        value,
                    ));
                }
                if !v.initial_value.is_finite() {
                    gaps.push(format!("the initial value of `{}` is not finite", v.id));
                }
            }
        }
        if d.formulations.is_empty() {
            gaps.push(format!("`{}` offers no hypothesis of this host", d.id));
        }
    }
    all_well(&gaps)
}

fn units_are_known(subject: &Subject) -> Found {
    let mut strange = Vec::new();
    for law in subject.laws()? {
        let d = law.description();
        let parameters = d.parameters.iter().map(|p| (&p.id, &p.unit));
        let variables = d
            .formulations
            .iter()
            .flat_map(|f| f.internal_variables.iter().map(|v| (&v.id, &v.unit)));
        for (id, unit) in parameters.chain(variables) {
            if !is_unit(unit) {
                strange.push(format!("`{unit}` of `{id}`"));
            }
        }
    }
    strange.dedup();
    all_well(&strange)
}

/// Products and quotients of powers of known units.
fn is_unit(text: &str) -> bool {
    const KNOWN: [&str; 12] = [
        "kPa", "kN", "kJ", "m", "mm", "s", "h", "d", "deg", "rad", "1", "-",
    ];
    text.split(['/', '·', '*', ' '])
        .all(|factor| KNOWN.contains(&factor.split('^').next().unwrap_or_default()))
}

fn all_well(gaps: &[String]) -> Found {
    if gaps.is_empty() {
        Ok(String::new())
    } else {
        Err(Verdict::Warning(gaps.join("; ")))
    }
}
