//! Is what the library says about its laws readable, complete and true?

use super::{Check, Found, Subject, Verdict, skipped, warned};
use law::foreign::Adapter;
use std::collections::BTreeSet;

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "description-is-readable",
        description: "The tables are readable and plausible: counts, sizes, UTF-8, well-formed \
                      unique ids, bounds in order, known gradients and fluxes.",
        needs: &["entry-is-idempotent"],
        run: description_is_readable,
    },
    Check {
        id: "description-is-complete",
        description: "No text is empty, initial values are finite, every law offers a hypothesis \
                      (warning). A sidecar needs no symbols and no text on the law.",
        needs: &["description-is-readable"],
        run: description_is_complete,
    },
    Check {
        id: "units-are-known",
        description: "Units are made of kPa, kN, kJ, m, mm, s, h, d, deg, rad, 1 and - (warning, \
                      with the probable unit).",
        needs: &["description-is-readable"],
        run: units_are_known,
    },
    Check {
        id: "ranges-are-plausible",
        description: "Usual ranges and defaults are within the bounds; angles and their usual \
                      ranges are in degrees (warning).",
        needs: &["description-is-readable"],
        run: ranges_are_plausible,
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

/// Passes over what a UDSM and a behaviour of MFront cannot say.
fn can_be_said(subject: &Subject) -> Result<(), Verdict> {
    match subject.foreign().map(|foreign| foreign.adapter) {
        None | Some(Adapter::Umat) => Ok(()),
        Some(Adapter::Udsm | Adapter::Mfront) => Err(skipped(
            "its program has no units or sentences for such libraries, or not for all that they have",
        )),
    }
}

fn description_is_complete(subject: &Subject) -> Found {
    can_be_said(subject)?;
    // A sidecar says what its numbers are: symbols and a text are for those who want them.
    let is_sidecar = subject.foreign().is_some();
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
            if !(is_sidecar && what == "doc") {
                gaps.extend(empty(what, value));
            }
        }
        let described = |of: String, [symbol, unit, doc]: [&str; 3]| {
            let texts = [("symbol", symbol), ("unit", unit), ("doc", doc)];
            let texts = texts.into_iter().skip(usize::from(is_sidecar));
            let gaps = texts.filter_map(|(what, text)| empty(&format!("the {what} of {of}"), text));
            gaps.collect::<Vec<_>>()
        };
        for p in &d.parameters {
            let of = format!("parameter `{}`", p.id);
            gaps.extend(described(of, [&p.symbol, &p.unit, &p.doc]));
        }
        for v in d.formulations.iter().flat_map(|f| &f.internal_variables) {
            let of = format!("internal variable `{}`", v.id);
            gaps.extend(described(of, [&v.symbol, &v.unit, &v.doc]));
            if !v.initial_value.is_finite() {
                gaps.push(format!("the initial value of `{}` is not finite", v.id));
            }
        }
        if d.formulations.is_empty() {
            gaps.push(format!("`{}` offers no hypothesis of this host", d.id));
        }
    }
    all_well(&gaps)
}

fn units_are_known(subject: &Subject) -> Found {
    can_be_said(subject)?;
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
                let meant = meant(unit).map(|meant| format!(": `{meant}`?"));
                strange.push(format!("`{unit}` of `{id}`{}", meant.unwrap_or_default()));
            }
        }
    }
    all_well(&strange)
}

/// What stands between the factors of a unit.
pub(super) const SEPARATORS: [char; 4] = ['/', '·', '*', ' '];

const KNOWN: [&str; 12] = [
    "kPa", "kN", "kJ", "m", "mm", "s", "h", "d", "deg", "rad", "1", "-",
];

/// Products and quotients of powers of known units.
fn is_unit(text: &str) -> bool {
    text.split(SEPARATORS)
        .all(|factor| KNOWN.contains(&factor.split('^').next().unwrap_or_default()))
}

/// Other names of units.
const NAMES: [(&str, &str); 13] = [
    ("°", "deg"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("radian", "rad"),
    ("radians", "rad"),
    ("%", "-"),
    ("sec", "s"),
    ("hr", "h"),
    ("day", "d"),
    ("days", "d"),
    ("meter", "m"),
    ("metre", "m"),
    ("none", "-"),
];

/// Units of another scale, and those that go with the rest.
const OTHER_SCALE: [(&str, &str); 6] = [
    ("Pa", "kPa"),
    ("MPa", "kPa"),
    ("GPa", "kPa"),
    ("N", "kN"),
    ("MN", "kN"),
    ("cm", "m"),
];

/// A factor in the spelling of the contract.
fn spelled(factor: &str) -> Option<String> {
    let plain = factor.replace('²', "2").replace('³', "3");
    let digits = plain.find(|c: char| c.is_ascii_digit() || c == '^' || c == '-');
    let (name, power) = plain.split_at(digits.filter(|&at| at > 0).unwrap_or(plain.len()));
    let power = power.trim_start_matches('^');
    let is_alike = |known: &str| known.eq_ignore_ascii_case(name);
    let mut names = NAMES.into_iter();
    let mut scales = OTHER_SCALE.into_iter();
    let known = (KNOWN.into_iter().find(|known| *known == name))
        .or_else(|| Some(names.find(|(known, _)| is_alike(known))?.1))
        .or_else(|| Some(scales.find(|(known, _)| *known == name)?.1))
        .or_else(|| KNOWN.into_iter().find(|known| is_alike(known)))?;
    Some(if power.is_empty() {
        known.to_owned()
    } else {
        format!("{known}^{power}")
    })
}

/// The unit that was probably meant, in the spelling of the contract.
fn meant(text: &str) -> Option<String> {
    let right = text.trim().split_inclusive(SEPARATORS).map(|piece| {
        let factor = piece.trim_end_matches(SEPARATORS);
        Some(spelled(factor)? + &piece[factor.len()..])
    });
    let right: Option<String> = right.collect();
    right.filter(|right| is_unit(right))
}

/// The largest of a usual range of angles that looks like radians: a little more than π/2.
const RADIANS: f64 = 1.6;

fn ranges_are_plausible(subject: &Subject) -> Found {
    let mut odd = Vec::new();
    for law in subject.laws()? {
        for p in &law.description().parameters {
            let mut say = |why: String| odd.push(format!("`{}`: {why}", p.id));
            let (usual, bounds) = (&p.usual, &p.bounds);
            let range = format!("the usual range {usual} {}", p.unit);
            let below = usual.lower.is_finite() && usual.lower < bounds.lower;
            let above = usual.upper.is_finite() && usual.upper > bounds.upper;
            if usual.upper < bounds.lower || usual.lower > bounds.upper {
                say(format!("{range} lies outside the bounds {bounds}"));
            } else if below || above {
                say(format!("{range} reaches outside the bounds {bounds}"));
            }
            if let Some(default) = p.default
                && p.choices.is_empty()
                && !bounds.contain(default)
            {
                say(format!(
                    "the default {default} is outside the bounds {bounds}"
                ));
            }
            if p.unit == "rad" {
                say("angles are in degrees, `deg`".to_owned());
            } else if p.unit == "deg" && usual.upper > 0.0 && usual.upper <= RADIANS {
                say(format!("{range} looks like radians"));
            }
        }
    }
    all_well(&odd)
}

fn all_well(gaps: &[String]) -> Found {
    if gaps.is_empty() {
        Ok(String::new())
    } else {
        // Internal variables are described once more under every hypothesis.
        let mut rest: BTreeSet<&String> = gaps.iter().collect();
        let told: Vec<&str> = gaps
            .iter()
            .filter(|gap| rest.remove(gap))
            .map(String::as_str)
            .collect();
        Err(warned(told.join("; ")))
    }
}

#[cfg(test)]
mod tests {
    use super::meant;

    #[test]
    fn units_are_spelled_as_in_the_contract() {
        for (written, right) in [
            ("kN/m3", Some("kN/m^3")),
            ("kN/m³", Some("kN/m^3")),
            ("kPa/M", Some("kPa/m")),
            ("°", Some("deg")),
            ("degrees", Some("deg")),
            ("MPa", Some("kPa")),
            ("m2", Some("m^2")),
            ("furlong", None),
        ] {
            assert_eq!(meant(written).as_deref(), right, "{written}");
        }
    }
}
