//! Do parameters mean something, and numbers what their units say?

use super::description::SEPARATORS;
use super::draw::Draw;
use super::loading_path::{Step, flux_scale, some};
use super::mathematics::NEEDS;
use super::points::{ELASTIC, ITERATED, UPDATE, apart, increment, is_same, is_success, largest};
use super::specimen::Specimen;
use super::{Check, Found, Subject, Verdict, counted, warned};
use abi::raw;
use law::ParameterDescription;
use law::probe::{Form, PointEnd, PointStart, Probe};
use std::collections::BTreeMap;

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "parameters-matter",
        description: "Every parameter changes some result; none with a unit or a fractional \
                      default is rounded to a whole number (warning, since some count only off \
                      these paths).",
        needs: NEEDS,
        run: parameters_matter,
    },
    Check {
        id: "units-belong-together",
        description: "With units of force, length or time half as large a law gives the same \
                      results: no hidden number has a unit that no parameter has, as a tolerance \
                      in kPa (warning). A parameter with this unit and a default, or a sentence \
                      that names the number, as 1 kPa in a logarithm, makes it pass with a note.",
        needs: NEEDS,
        run: units_belong_together,
    },
];

/// Other values of a parameter: near it, then far, since a limit of iterations counts only if it is low.
fn others(p: &ParameterDescription, value: f64) -> Vec<f64> {
    let usual = [p.usual.lower, p.usual.upper];
    let near = if value == 0.0 {
        [0.5, 0.1, 1e-3]
            .map(|part| part * p.usual.upper.min(p.bounds.upper))
            .to_vec()
    } else {
        [1.1, 0.9, 10.0, 0.1].map(|factor| factor * value).to_vec()
    };
    let all = near.into_iter().chain(usual).chain([1.0]);
    all.filter(|other| other.is_finite()).collect()
}

/// Values of the parameters, and the same with each other label of each choice.
fn with_each_choice(specimen: &Specimen) -> Vec<Vec<f64>> {
    let mut all = vec![specimen.values.clone()];
    for (i, p) in specimen.law.description().parameters.iter().enumerate() {
        for label in 0..p.choices.len() {
            let mut values = specimen.values.clone();
            values[i] = label as f64;
            if values[i].to_bits() != specimen.values[i].to_bits() {
                all.push(values);
            }
        }
    }
    all
}

/// Results that parameters of a law may change.
struct Results<'a> {
    specimen: &'a Specimen,
    points: Vec<PointStart>,
    fluxes: Vec<Vec<f64>>,
}

impl Results<'_> {
    fn of(&self, probe: &Probe) -> Result<Vec<PointEnd>, Verdict> {
        let mut ends = Vec::new();
        for request in [UPDATE, ELASTIC] {
            let form = self.specimen.form(request);
            ends.extend(probe.integrate(&self.points, &form)?.points);
        }
        // Each by itself: a law may refuse one for all.
        for flux in &self.fluxes {
            let started = probe.init_state(std::slice::from_ref(flux), &Form::of(0))?;
            ends.extend(started.into_iter().flat_map(|answer| answer.points));
        }
        Ok(ends)
    }

    /// Those with another value of one parameter, if the law accepts it.
    fn with(&self, base: &[f64], i: usize, value: f64) -> Result<Option<Vec<PointEnd>>, Verdict> {
        let mut values = base.to_vec();
        values[i] = value;
        let probe = self.specimen.with_values(&values)?;
        probe.as_ref().map(|probe| self.of(probe)).transpose()
    }

    /// Tries other values of one parameter until the results differ from these.
    fn vary(
        &self,
        (p, i): (&ParameterDescription, usize),
        base: &[f64],
        before: &[PointEnd],
        tried: &mut Tried,
    ) -> Result<(), Verdict> {
        for other in others(p, base[i]) {
            if other.to_bits() == base[i].to_bits() || !p.bounds.contain(other) {
                continue;
            }
            if let Some(ends) = self.with(base, i, other)? {
                tried.is_tried = true;
                tried.matters |= ends.iter().zip(before).any(|(a, b)| !is_same(a, b));
            }
            if tried.matters {
                break;
            }
        }
        Ok(())
    }
}

/// Whether a parameter was tried, and mattered.
#[derive(Default)]
struct Tried {
    is_tried: bool,
    matters: bool,
}

fn parameters_matter(subject: &Subject) -> Found {
    let mut found: BTreeMap<(String, String), Tried> = BTreeMap::new();
    subject.each(Draw::DefaultChoices, "parameters", 4, |specimen, random| {
        let steps = specimen.paths(24, random)?.steps;
        let chosen = some(&steps, 400).into_iter();
        let pressures = [1.0, 30.0, 1000.0];
        let results = Results {
            specimen,
            points: chosen.map(|step| step.start.clone()).collect(),
            fluxes: pressures.map(|p| specimen.under_pressure(p)).to_vec(),
        };
        let law = specimen.law.description();
        // Some count with one of the choices alone.
        for base in with_each_choice(specimen) {
            let Some(probe) = specimen.with_values(&base)? else {
                continue;
            };
            let mut expected = None;
            for (i, p) in law.parameters.iter().enumerate() {
                let entry = found.entry((law.id.clone(), p.id.clone())).or_default();
                if entry.matters || !p.choices.is_empty() || base[i].is_nan() {
                    continue;
                }
                let before = match &expected {
                    Some(before) => before,
                    None => &*expected.insert(results.of(&probe)?),
                };
                results.vary((p, i), &base, before, entry)?;
                let among = |value| results.with(&base, i, value);
                if entry.matters && may_be_rounded(p) && is_rounded(p, base[i], among)? {
                    return Err(warned(format!(
                        "`{}` of `{}` is rounded to a whole number: values between two of them give the same bits",
                        p.id, law.id
                    )));
                }
            }
        }
        Ok(0)
    })?;
    let tried = || found.iter().filter(|(_, tried)| tried.is_tried);
    let idle: Vec<String> = tried()
        .filter(|(_, tried)| !tried.matters)
        .map(|((law, id), _)| format!("`{id}` of `{law}`"))
        .collect();
    if !idle.is_empty() {
        return Err(warned(format!("no result depends on {}", idle.join(", "))));
    }
    counted(tried().count(), "parameters", "no parameter can be changed")
}

/// Whether a parameter is no count, which may be a whole number.
fn may_be_rounded(p: &ParameterDescription) -> bool {
    !["-", "1", ""].contains(&p.unit.as_str())
        || p.default.is_some_and(|default| default.fract() != 0.0)
}

/// Whole numbers that are passed: a strength that is met between two of them looks rounded there, and not at others.
const PASSED: usize = 4;

/// Whether results are the same for two values between two whole numbers, and others between the next two, at
/// several of them.
fn is_rounded(
    p: &ParameterDescription,
    value: f64,
    results: impl Fn(f64) -> Result<Option<Vec<PointEnd>>, Verdict>,
) -> Result<bool, Verdict> {
    let is_like = |a: &[PointEnd], b: &[PointEnd]| a.iter().zip(b).all(|(a, b)| is_same(a, b));
    let mut before: Option<Vec<PointEnd>> = None;
    for k in 0..PASSED {
        let [low, high] = [0.25, 0.75].map(|part| value.floor() + k as f64 + part);
        if !(p.bounds.contain(low) && p.bounds.contain(high)) {
            return Ok(false);
        }
        let (Some(first), Some(second)) = (results(low)?, results(high)?) else {
            return Ok(false);
        };
        if !is_like(&first, &second) || before.is_some_and(|before| is_like(&before, &first)) {
            return Ok(false);
        }
        before = Some(second);
    }
    Ok(true)
}

/// How numbers grow where the units of force, length and time become smaller.
#[derive(Clone, Copy)]
struct Smaller {
    /// What becomes smaller.
    what: &'static str,
    /// A mistake with it, and the sentence that says that a number is meant.
    example: &'static str,
    statement: &'static str,
    force: f64,
    length: f64,
    time: f64,
}

/// All by powers of two, so that no number is rounded. A smaller unit of length leaves stresses as they
/// are if that of force goes along.
const SMALLER: [Smaller; 3] = [
    Smaller {
        what: "force",
        example: "in kPa",
        statement: "at 1 kPa",
        force: 2.0,
        length: 1.0,
        time: 1.0,
    },
    Smaller {
        what: "length",
        example: "in m",
        statement: "at 1 m",
        force: 4.0,
        length: 2.0,
        time: 1.0,
    },
    Smaller {
        what: "time",
        example: "in s",
        statement: "at 1 s",
        force: 1.0,
        length: 1.0,
        time: 2.0,
    },
];

impl Smaller {
    /// By what a number with this unit is multiplied; `None` where the unit is not known.
    fn of(&self, unit: &str) -> Option<f64> {
        let mut factor = 1.0;
        let mut divides = false;
        let mut rest = unit;
        loop {
            let end = rest.find(SEPARATORS).unwrap_or(rest.len());
            let (name, power) = match rest[..end].split_once('^') {
                Some((name, power)) => (name, power.parse::<f64>().ok()?),
                None => (&rest[..end], 1.0),
            };
            let one = match name {
                "kPa" => self.force / (self.length * self.length),
                "kN" => self.force,
                "kJ" => self.force * self.length,
                "m" | "mm" => self.length,
                "s" | "h" | "d" => self.time,
                "deg" | "rad" | "1" | "-" => 1.0,
                _ => return None,
            };
            factor *= one.powf(if divides { -power } else { power });
            let Some(separator) = rest[end..].chars().next() else {
                return Some(factor);
            };
            // Of a/b/c both are below; of a/b·c the last is not.
            divides = separator == '/';
            rest = &rest[end + separator.len_utf8()..];
        }
    }
}

fn units_belong_together(subject: &Subject) -> Found {
    let mut unknown = 0;
    let mut meant: Vec<String> = Vec::new();
    let n = subject.each(Draw::DefaultChoices, "units", 3, |specimen, random| {
        let steps = specimen.paths(24, random)?.steps;
        let mut n = 0;
        for smaller in SMALLER {
            match in_smaller_units(specimen, &steps, smaller) {
                Ok(Some(compared)) => n += compared,
                Ok(None) => unknown += 1,
                Err(verdict) => {
                    let stated = stated(specimen, smaller).ok_or(verdict)?;
                    if !meant.contains(&stated) {
                        meant.push(stated);
                    }
                }
            }
        }
        Ok(n)
    })?;
    if !meant.is_empty() {
        return Ok(format!(
            "{n} increments; another result in other units, as is said of {}",
            meant.join("; ")
        ));
    }
    let none = if unknown > 0 {
        "there are units that are not known, or none of force, length and time"
    } else {
        "no parameters in smaller units are accepted"
    };
    counted(n, "increments", none)
}

/// The sentence of the description that names a number one with a unit that becomes smaller, as "at 1 kPa":
/// whose it is, and the number. It is meant then.
fn stated(specimen: &Specimen, smaller: Smaller) -> Option<String> {
    let law = specimen.law.description();
    let of_law = [(&law.id, &law.doc)].into_iter();
    let parameters = law.parameters.iter().map(|p| (&p.id, &p.doc));
    let variables = specimen.formulation.internal_variables.iter();
    let all = of_law
        .chain(parameters)
        .chain(variables.map(|v| (&v.id, &v.doc)));
    let mut named = all.filter_map(|(id, doc)| Some((id, unit_number(doc, smaller)?)));
    named.next().map(|(id, number)| format!("`{id}`: {number}"))
}

/// The first number one with a unit that becomes smaller.
fn unit_number(sentence: &str, smaller: Smaller) -> Option<String> {
    let words: Vec<&str> = sentence.split_whitespace().collect();
    words.windows(2).find_map(|pair| {
        let number = pair[0].trim_start_matches(['(', '/', '=', '[']);
        let unit = pair[1].trim_end_matches(['.', ',', ';', ':', ')', ']', '!', '?']);
        // `p/1 kPa` too, but no other number.
        let is_one = number.strip_suffix('1').is_some_and(|before| {
            let last = before.chars().next_back();
            last.is_none_or(|c| !c.is_ascii_digit() && !['.', '-', ','].contains(&c))
        });
        let counts = smaller
            .of(unit)
            .is_some_and(|factor| factor.log2().abs() > 0.1);
        (is_one && counts).then(|| format!("1 {unit}"))
    })
}

/// Compares steps with the same in smaller units; nothing where no parameter and no internal variable has
/// such a unit.
fn in_smaller_units(
    specimen: &Specimen,
    steps: &[Step],
    smaller: Smaller,
) -> Result<Option<usize>, Verdict> {
    let parameters = &specimen.law.description().parameters;
    let factors: Option<Vec<f64>> = parameters.iter().map(|p| smaller.of(&p.unit)).collect();
    let variables = specimen.formulation.internal_variables.iter();
    let of_states: Option<Vec<f64>> = variables.map(|v| smaller.of(&v.unit)).collect();
    let (Some(factors), Some(of_states)) = (factors, of_states) else {
        return Ok(None);
    };
    // Powers of two are exact.
    let has_unit = |factor: &f64| factor.log2().abs() > 0.1;
    let given = factors.iter().zip(&specimen.values);
    let mut counting = given.filter(|(_, value)| value.abs() > 0.0);
    if !counting.any(|(factor, _)| has_unit(factor)) && !of_states.iter().any(has_unit) {
        return Ok(None);
    }
    let scaled = times(&specimen.values, &factors);
    let Some(probe) = specimen.with_values(&scaled)? else {
        return Ok(Some(0));
    };
    let n = specimen.probe.n_components();
    let is_interface = specimen.hypothesis.is_interface();
    let scaled = Scaled {
        specimen,
        smaller,
        probe,
        of_states,
        of_gradient: vec![if is_interface { smaller.length } else { 1.0 }; n],
        of_flux: vec![smaller.force / (smaller.length * smaller.length); n],
    };
    let chosen = some(steps, 300);
    scaled.begins_alike(&chosen)?;
    scaled.goes_on_alike(&chosen).map(Some)
}

fn times(values: &[f64], factors: &[f64]) -> Vec<f64> {
    let pairs = values.iter().zip(factors);
    pairs.map(|(value, factor)| value * factor).collect()
}

/// A law in smaller units, and by what each kind of number grows there.
struct Scaled<'a> {
    specimen: &'a Specimen,
    smaller: Smaller,
    probe: Probe,
    of_states: Vec<f64>,
    of_gradient: Vec<f64>,
    of_flux: Vec<f64>,
}

impl Scaled<'_> {
    fn form(&self, request: u32) -> Form {
        Form {
            time_increment: self.smaller.time * self.specimen.time_increment,
            ..self.specimen.form(request)
        }
    }

    fn words(&self, what: &str) -> String {
        format!(
            "with all numbers in half the unit of {}, {what}: is there a number in the law whose unit \
             no parameter has? A tolerance {} is a mistake: let it be a part of what is compared. A reference as in \
             ln(p/1 kPa) is best a parameter with a unit and a default; or a sentence of the description names it \
             (`{}`).",
            self.smaller.what, self.smaller.example, self.smaller.statement
        )
    }

    fn id(&self, k: usize) -> &str {
        &self.specimen.formulation.internal_variables[k].id
    }

    /// Compares internal variables at first.
    fn begins_alike(&self, steps: &[&Step]) -> Result<(), Verdict> {
        for step in steps {
            let flux = &step.start.flux0;
            let scaled = [times(flux, &self.of_flux)];
            let (Ok(before), Some(after)) = (
                self.specimen.initial_state(flux)?,
                self.probe.init_state(&scaled, &self.form(0))?,
            ) else {
                continue;
            };
            let Some(after) = after.points.first().filter(|end| is_success(end.status)) else {
                continue;
            };
            let expected = times(&before, &self.of_states);
            let off = (0..expected.len()).find(|&k| {
                let (a, b) = (after.state[k], expected[k]);
                (a - b).abs() > ITERATED * a.abs().max(b.abs())
            });
            if let Some(k) = off {
                let what = format!(
                    "`init_state` gives `{}` = {:e}, expected {:e}",
                    self.id(k),
                    after.state[k],
                    expected[k]
                );
                let why = format!("{} Compared with flux {flux:?}", self.words(&what));
                return Err(self.specimen.warns(why));
            }
        }
        Ok(())
    }

    /// Compares what becomes of increments: how many.
    fn goes_on_alike(&self, steps: &[&Step]) -> Result<usize, Verdict> {
        let scaled: Vec<PointStart> = steps
            .iter()
            .map(|step| PointStart {
                gradient0: times(&step.start.gradient0, &self.of_gradient),
                gradient1: times(&step.start.gradient1, &self.of_gradient),
                flux0: times(&step.start.flux0, &self.of_flux),
                state0: times(&step.start.state0, &self.of_states),
            })
            .collect();
        let form = self.form(raw::PILUM_REQ_FLUX);
        let ends = self.probe.integrate(&scaled, &form)?.points;
        let mut compared = 0;
        for ((step, start), end) in steps.iter().zip(&scaled).zip(&ends) {
            if !is_success(end.status) {
                continue;
            }
            compared += 1;
            if let Some(what) = self.difference(step, start, end) {
                let why = format!(
                    "{} Compared with {}",
                    self.words(&what),
                    self.specimen.at(&step.start)
                );
                return Err(self.specimen.warns_for(&step.start, why));
            }
        }
        Ok(compared)
    }

    fn difference(&self, step: &Step, start: &PointStart, end: &PointEnd) -> Option<String> {
        let expected = times(&step.end.flux, &self.of_flux);
        let bound = ITERATED * flux_scale(step) * self.of_flux[0];
        if apart(&end.flux, &expected) > bound {
            return Some(format!("the flux is {:?}, expected {expected:?}", end.flux));
        }
        let expected = times(&step.end.state, &self.of_states);
        let k = (0..expected.len()).find(|&k| {
            let (a, b) = (end.state[k], expected[k]);
            let unit = self.specimen.formulation.internal_variables[k]
                .unit
                .as_str();
            let is_interface = self.specimen.hypothesis.is_interface();
            let is_gradient = unit == if is_interface { "m" } else { "-" };
            // What is a small part of an increment is as exact as that.
            let least = if is_gradient {
                largest(&increment(start))
            } else {
                0.0
            };
            let scale = a.abs().max(b.abs()).max(start.state0[k].abs()).max(least);
            (a - b).abs() > STATE * scale
        })?;
        Some(format!(
            "`{}` is {:e}, expected {:e}",
            self.id(k),
            end.state[k],
            expected[k]
        ))
    }
}

/// Differences of internal variables, relative to what they are.
const STATE: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::{SMALLER, unit_number};

    #[test]
    fn a_number_one_with_a_unit_is_found_in_a_sentence() {
        let [force, length, time] = SMALLER;
        for (sentence, counts) in [
            ("Specific volume at 1 kPa.", [true, false, false]),
            ("v = N − λ ln(p/1 kPa).", [true, false, false]),
            (
                "Slip, in parts of 1 m, of rates (1 m/s).",
                [false, true, true],
            ),
            ("Rate of 1 1/s.", [false, false, true]),
            ("Pressure up to 21 kPa, 0.1 kPa or -1 kPa.", [false; 3]),
            ("One kPa, or 1 of them.", [false; 3]),
            ("An angle of 1 deg.", [false; 3]),
        ] {
            let found = [force, length, time].map(|s| unit_number(sentence, s).is_some());
            assert_eq!(found, counts, "{sentence}");
        }
    }

    #[test]
    fn units_scale_as_they_are_written() {
        let [force, length, time] = SMALLER;
        for (unit, factors) in [
            ("kPa", [2.0, 1.0, 1.0]),
            ("kPa/m", [2.0, 0.5, 1.0]),
            ("kN/m^3", [2.0, 0.5, 1.0]),
            ("kPa·s", [2.0, 1.0, 2.0]),
            ("1/s", [1.0, 1.0, 0.5]),
            ("m/s^2", [1.0, 2.0, 0.25]),
            ("m^-1", [1.0, 0.5, 1.0]),
            ("kJ", [2.0, 8.0, 1.0]),
            ("deg", [1.0; 3]),
            ("-", [1.0; 3]),
        ] {
            let found = [force, length, time].map(|smaller| smaller.of(unit));
            assert_eq!(found, factors.map(Some), "{unit}");
        }
        assert_eq!(force.of("MPa"), None);
        assert_eq!(force.of("kPa^x"), None);
    }
}
