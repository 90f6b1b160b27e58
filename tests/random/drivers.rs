//! Drivers: controls are met in every row, or the row is absent.

mod laws;

use crate::seeds::{End, hold};
use laws::{Law, law};
use proptest::prelude::*;
use std::fmt::Write as _;

/// How a component is led through a segment.
#[derive(Clone, Copy, Debug)]
enum Lead {
    Keep,
    /// In elastic answers to 100 kPa.
    Gradient(f64),
    /// kPa.
    Flux(f64),
    /// Parts of the law's stiffness.
    Stiffness(f64),
}

#[derive(Clone, Debug)]
struct Segment {
    increments: usize,
    leads: [Lead; 6],
}

#[derive(Clone, Debug)]
struct Path {
    law: Law,
    /// kPa; only normal components.
    initial: [f64; 6],
    segments: Vec<Segment>,
}

/// A way to write the same path down.
#[derive(Clone, Copy, Debug)]
struct View {
    /// Stress that is written as 1, kPa.
    unit: f64,
    /// Seen in a mirror: shear components change their sign.
    mirrored: bool,
    /// Components 11 and 22 change places.
    turned: bool,
}

const PLAIN: View = View {
    unit: 1.0,
    mirrored: false,
    turned: false,
};

impl Path {
    fn is_interface(&self) -> bool {
        self.law.hypothesis == "interface_2d"
    }

    fn components(&self) -> &'static [&'static str] {
        match self.law.hypothesis {
            "interface_2d" => &["n", "t"],
            "3d" => &["11", "22", "33", "12", "13", "23"],
            _ => &["11", "22", "33", "12"],
        }
    }

    /// The lead that applies to a component.
    fn lead(&self, segment: &Segment, i: usize) -> Lead {
        match segment.leads[i] {
            _ if self.law.hypothesis == "plane_strain" && i == 2 => Lead::Gradient(0.0),
            Lead::Stiffness(share) if !self.is_interface() => Lead::Gradient(share - 0.5),
            lead => lead,
        }
    }

    fn gradient(&self, times: f64) -> f64 {
        times * 100.0 / self.law.modulus
    }

    /// Position of a component in a view, and its sign there.
    fn seen(&self, i: usize, view: View) -> (usize, f64) {
        let flips = match self.components()[i] {
            "t" | "12" => view.mirrored,
            // Turned about the axis between 1 and 2, 13 and 23 change places.
            "13" => view.mirrored && !view.turned,
            "23" => view.mirrored && view.turned,
            _ => false,
        };
        let place = match (view.turned, self.components()[i]) {
            (true, "11") => 1,
            (true, "22") => 0,
            (true, "13") => 5,
            (true, "23") => 4,
            _ => i,
        };
        (place, if flips { -1.0 } else { 1.0 })
    }

    fn text(&self, view: View) -> String {
        let (gradient, flux) = if self.is_interface() {
            ("jump", "traction")
        } else {
            ("strain", "stress")
        };
        let names = self.components();
        let mut text = format!(
            "law = '{}'\nhypothesis = '{}'\n[parameters]\n",
            self.law.id, self.law.hypothesis
        );
        for (name, value, power) in &self.law.parameters {
            let value = value * view.unit.powf(-power);
            writeln!(text, "{name} = {value:e}").unwrap();
        }
        let list = |entry: &dyn Fn(usize, &str, f64) -> Option<String>| {
            let entries = (0..names.len()).filter_map(|i| {
                let (place, sign) = self.seen(i, view);
                entry(i, names[place], sign)
            });
            entries.collect::<Vec<_>>().join(", ")
        };
        let initial = list(&|i, name, sign| {
            Some(format!("{name} = {:e}", sign * self.initial[i] / view.unit))
        });
        writeln!(text, "[initial]\n{flux} = {{ {initial} }}").unwrap();
        for segment in &self.segments {
            let controls = list(&|i, name, sign| match self.lead(segment, i) {
                Lead::Keep => None,
                Lead::Gradient(times) => {
                    let value = sign * self.gradient(times);
                    Some(format!("{name} = {{ {gradient} = {value:e} }}"))
                }
                Lead::Flux(value) => {
                    let value = sign * value / view.unit;
                    Some(format!("{name} = {{ {flux} = {value:e} }}"))
                }
                Lead::Stiffness(share) => {
                    let value = share * self.law.modulus / view.unit;
                    Some(format!("{name} = {{ stiffness = {value:e} }}"))
                }
            });
            writeln!(
                text,
                "[[segment]]\nincrements = {}\ncontrol = {{ {controls} }}",
                segment.increments
            )
            .unwrap();
        }
        text
    }

    /// Rows of gradients and fluxes, as seen plainly in kPa, and how it ended.
    fn run(&self, view: View) -> Result<Outcome, String> {
        let text = self.text(view);
        let driver = tests::driver::of_text(&text).map_err(|error| format!("refused: {error}"))?;
        let n = self.components().len();
        let mut rows = Vec::new();
        let result = driver.run(|row| {
            let mut found = Row::default();
            for i in 0..n {
                let (place, sign) = self.seen(i, view);
                found.gradient[i] = sign * row.gradient[place];
                found.flux[i] = sign * row.flux[place] * view.unit;
            }
            found.is_finite = row.internal.iter().all(|value| value.is_finite());
            rows.push(found);
        });
        let (code, words) = match result {
            Ok(course) => {
                let warnings = course.warnings.iter().map(ToString::to_string);
                (0, warnings.collect::<Vec<_>>().join("; "))
            }
            Err(error) => (error.exit_code(), error.to_string()),
        };
        Ok(Outcome { rows, code, words })
    }

    /// Whether every row keeps what was asked.
    fn check(&self, outcome: &Outcome) -> Result<(), String> {
        let n = self.components().len();
        let asked: usize = self.segments.iter().map(|s| s.increments).sum();
        let rows = &outcome.rows;
        match outcome.code {
            0 if rows.len() == asked + 1 => {}
            2 if rows.len() <= asked && outcome.words.contains("no equilibrium") => {}
            code => {
                let found = rows.len();
                return Err(format!(
                    "exit {code} after {found} rows of {asked}: {}",
                    outcome.words
                ));
            }
        }
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |max, v| max.max(v.abs()));
        // What the path was given: fluxes, prescribed gradients.
        let (mut given, mut reach) = (largest(&self.initial), 0.0_f64);
        let mut held = self.initial;
        let mut from = [0.0; 6];
        let mut at = 0;
        let mut seen = given;
        for segment in &self.segments {
            for k in 1..=segment.increments {
                let part = k as f64 / segment.increments as f64;
                let Some(row) = rows.get(at + k) else {
                    return Ok(());
                };
                let leads = (0..n).map(|i| self.lead(segment, i));
                let goals: Vec<f64> = leads
                    .enumerate()
                    .map(|(i, lead)| match lead {
                        Lead::Keep => held[i],
                        Lead::Flux(end) => held[i] + part * (end - held[i]),
                        Lead::Gradient(end) => from[i] + part * (self.gradient(end) - from[i]),
                        Lead::Stiffness(share) => {
                            held[i] - share * self.law.modulus * (row.gradient[i] - from[i])
                        }
                    })
                    .collect();
                for (i, goal) in goals.iter().enumerate() {
                    match self.lead(segment, i) {
                        Lead::Gradient(_) => reach = reach.max(goal.abs()),
                        Lead::Stiffness(_) => {}
                        Lead::Keep | Lead::Flux(_) => given = given.max(goal.abs()),
                    }
                }
                // A flux that ran away explains no distance.
                let explained = 100.0 * (given + self.law.modulus * reach);
                seen = seen.max(largest(&row.flux).min(explained));
                for (i, goal) in goals.iter().enumerate() {
                    let name = self.components()[i];
                    let increment = at + k;
                    let lead = self.lead(segment, i);
                    let (found, bound) = if let Lead::Gradient(_) = lead {
                        (row.gradient[i], 1e-12 * reach)
                    } else {
                        // What is left of prescribed gradients by round-off.
                        let rounded = 1e-13 * self.law.modulus * reach;
                        (row.flux[i], 1e-8 * seen.max(given) + rounded)
                    };
                    // Not met, too, by what is no number.
                    let is_met = (found - goal).abs() <= bound;
                    if !is_met {
                        return Err(format!(
                            "exit {}, row {increment}: `{name}` under {lead:?} is {found:e}, \
                             {goal:e} is asked",
                            outcome.code
                        ));
                    }
                    let farthest = 100.0 * reach + 1e6 * given / self.law.modulus;
                    let strays = row.gradient[i].abs() > farthest;
                    if strays && !outcome.words.contains("has to come to") {
                        let gradient = row.gradient[i];
                        return Err(format!(
                            "row {increment}: `{name}` goes to {gradient:e} without a warning"
                        ));
                    }
                }
                let numbers = row.gradient.iter().chain(&row.flux);
                if !row.is_finite || !numbers.copied().all(f64::is_finite) {
                    return Err(format!("row {}: not a number", at + k));
                }
            }
            at += segment.increments;
            let row = &rows[at];
            for i in 0..n {
                held[i] = match self.lead(segment, i) {
                    Lead::Keep => held[i],
                    Lead::Flux(end) => end,
                    Lead::Gradient(_) | Lead::Stiffness(_) => row.flux[i],
                };
                from[i] = row.gradient[i];
            }
        }
        Ok(())
    }
}

#[derive(Clone, Debug, Default)]
struct Row {
    gradient: [f64; 6],
    flux: [f64; 6],
    is_finite: bool,
}

#[derive(Clone, Debug)]
struct Outcome {
    rows: Vec<Row>,
    code: u8,
    words: String,
}

/// Where two views of a path end differently.
fn differ(path: &Path, plain: &Outcome, other: &Outcome) -> Option<String> {
    if plain.code != other.code {
        return Some(format!(
            "exit {} ({}) and {} ({})",
            plain.code, plain.words, other.code, other.words
        ));
    }
    let size = plain.rows.iter().flat_map(|row| row.flux);
    let size = size.fold(1.0_f64, |max, v| max.max(v.abs()));
    let pairs = plain.rows.iter().zip(&other.rows).enumerate();
    for (k, (a, b)) in pairs {
        for (i, name) in path.components().iter().enumerate() {
            let off = (a.flux[i] - b.flux[i]).abs();
            if off > 1e-6 * size {
                return Some(format!(
                    "row {k}: flux `{name}` {:e} and {:e}",
                    a.flux[i], b.flux[i]
                ));
            }
        }
    }
    None
}

fn lead() -> impl Strategy<Value = Lead> {
    // From a part of the elastic range to far beyond it.
    let gradient = (-1.0..1.0_f64, -1.0..2.5_f64).prop_map(|(by, power)| by * 10_f64.powf(power));
    prop_oneof![
        4 => Just(Lead::Keep),
        6 => gradient.prop_map(Lead::Gradient),
        3 => (-160.0..20.0_f64).prop_map(Lead::Flux),
        1 => Just(Lead::Flux(0.0)),
        1 => (-3.0..1.0_f64).prop_map(|power| Lead::Stiffness(10_f64.powf(power))),
    ]
}

fn path() -> impl Strategy<Value = Path> {
    let segment = (1..13_usize, prop::array::uniform6(lead()));
    let segment = segment.prop_map(|(increments, leads)| Segment { increments, leads });
    let initial = prop_oneof![
        3 => Just(-100.0),
        1 => Just(0.0),
        2 => -300.0..-5.0_f64,
    ];
    let segments = prop::collection::vec(segment, 1..4);
    (law(), initial, 0.5..1.0_f64, segments).prop_map(|(law, stress, k_0, segments)| {
        let mut initial = [stress, stress, stress, 0.0, 0.0, 0.0];
        if law.hypothesis == "interface_2d" {
            initial[1] = 0.0;
            initial[2] = 0.0;
        } else {
            initial[0] *= k_0;
            initial[2] *= k_0;
        }
        Path {
            law,
            initial,
            segments,
        }
    })
}

fn end(outcome: &Outcome) -> End {
    if outcome.code == 0 {
        End::Done
    } else {
        End::Stopped
    }
}

#[test]
fn drivers_meet_their_controls_or_say_why_not() {
    hold(
        "drivers",
        (1, 600),
        &path(),
        |path| path.text(PLAIN),
        |path| {
            let outcome = path.run(PLAIN)?;
            path.check(&outcome)?;
            Ok(end(&outcome))
        },
    );
}

#[test]
fn drivers_end_the_same_in_a_mirror_and_in_other_units() {
    hold(
        "views",
        (100_001, 150),
        &path(),
        |path| path.text(PLAIN),
        |path| {
            let plain = path.run(PLAIN)?;
            path.check(&plain)?;
            let is_isotropic = ["elastic", "mohr_coulomb"].contains(&path.law.id);
            let view = |mirrored, unit, turned| View {
                unit,
                mirrored,
                turned,
            };
            let views = [
                (view(true, 1.0, false), true),
                (view(false, 1e-3, false), true),
                (view(false, 1.0, true), is_isotropic),
            ];
            for (view, _) in views.into_iter().filter(|(_, permitted)| *permitted) {
                let other = path.run(view)?;
                path.check(&other)?;
                if let Some(why) = differ(path, &plain, &other) {
                    return Err(format!("{view:?}: {why}"));
                }
            }
            Ok(end(&plain))
        },
    );
}
