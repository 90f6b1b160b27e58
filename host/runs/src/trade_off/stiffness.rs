//! Search for the stiffness of a zero-thickness interface.
//!
//! The stiffness acts as a penalty: too small, and the interface gives; too large, and the
//! equations are badly conditioned. The proposal is K_n = f E_oed/h, K_t = f G/h. Here E_oed, G and
//! h are the oedometric modulus, the shear modulus and the size across of the element next to the
//! interface, on the softer side. Stiffness parameters of the law are found by trial: those with
//! the unit of a stiffness that scale the elastic operator.

use super::case_study::refuse_without_probes;
use super::driver_study::in_one_line;
use super::scheme::short;
use super::settings::Settings;
use crate::Error;
use crate::experiment::progress::Pace;
use crate::experiment::{Rows, Scratch, Timing, csv, measure, write};
use crate::run::begin;
use input::Case;
use input::material::ParameterValue;
use law::{BuiltLaw, Law, Operator, Stop};
use mechanics::Simulation;
use mechanics::group::Group;
use mechanics::mesh::Joint;
use mechanics::problem::Formulation;
use results::output_request::{Output, When};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// Factors f.
const FACTORS: [f64; 7] = [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0];
/// Normal stress at which elastic operators are looked at, kPa.
const NORMAL_STRESS: f64 = -100.0;
/// A smaller change of the probes from one factor to the next counts as none.
const PLATEAU: f64 = 0.01;

/// Studies the stiffness of every interface of no thickness.
pub(super) fn run(
    case: &Case,
    name: &str,
    (folder, stop): (&Path, &Stop),
    show: &mut dyn FnMut(&str),
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let (simulation, _) = begin(case)?;
    let groups = simulation.groups().iter().enumerate();
    let interfaces: Vec<(usize, &Group)> = groups
        .filter(|(_, group)| group.formulation == Formulation::ZeroThickness)
        .collect();
    if interfaces.is_empty() {
        let message = "no group has the formulation `zero_thickness`: a thin layer's stiffness \
                       follows from its thickness";
        return Err(Error::usage(message.to_owned()));
    }
    refuse_without_probes(case, "no change of the answer can be measured")?;
    let mut text = String::new();
    let mut rows = Vec::new();
    for (number, group) in interfaces {
        let interface = Interface::new(&simulation, number, group)?;
        let scratch = Scratch::new(folder, stop)?;
        let before = rows.len();
        interface.try_all(case, &scratch, say, |one| {
            rows.push(one);
            write(&folder.join("interface_stiffness.csv"), &csv_of(&rows)?)
        })?;
        text += &interface.table(name, &rows[before..]);
    }
    show(&text);
    show(&format!("results in {}", folder.display()));
    Ok(())
}

/// An interface with its law in force and the elements next to it.
struct Interface<'a> {
    group: &'a Group,
    /// Name of the law in the file.
    law: String,
    id: String,
    /// Parameters that scale normal and tangential stiffness, their values, and what the
    /// stiffnesses are with them, kPa/m.
    parameters: [(String, f64, f64); 2],
    /// E_oed/h and G/h on the softer side, kPa/m.
    unit: [f64; 2],
    /// h on the softer side, m.
    size: f64,
    /// Diagonal entries of the elements next to it, by degree of freedom.
    beside: BTreeMap<usize, f64>,
}

/// What became of one factor.
struct Tried {
    /// Name of the interface.
    group: String,
    factor: f64,
    stiffness: [f64; 2],
    conditioning: f64,
    outcome: Result<Answer, String>,
}

struct Answer {
    /// Largest elastic closure relative to the size of the element next to it.
    penetration: f64,
    iterations: u64,
    /// Largest change of a probe since the factor before.
    change: Option<f64>,
}

impl<'a> Interface<'a> {
    fn new(model: &Simulation, number: usize, group: &'a Group) -> Result<Self, Error> {
        let mut swaps = model.swaps().iter().flatten();
        let law = swaps
            .rfind(|(swapped, _)| *swapped == number)
            .map_or(&group.law, |(_, law)| law);
        let parameters = stiffness_parameters(&law.built)?;
        let joints = model
            .problem()
            .mesh
            .joints
            .iter()
            .filter(|j| j.group == number);
        let mut logarithms = [0.0; 3];
        let mut n = 0.0;
        for joint in joints {
            if let Some(side) = softer_side(model, joint) {
                let sums = logarithms.iter_mut().zip(side);
                sums.for_each(|(sum, value)| *sum += value.ln());
                n += 1.0;
            }
        }
        if n <= 0.0 {
            return Err(Error::usage(format!(
                "group `{}` has no solid element beside it whose moduli could be taken",
                group.name
            )));
        }
        let [unit_n, unit_t, size] = logarithms.map(|sum| f64::exp(sum / n));
        Ok(Self {
            group,
            law: law.name.clone(),
            id: law.built.law.description().id.clone(),
            parameters,
            unit: [unit_n, unit_t],
            size,
            beside: diagonals_beside(model, group),
        })
    }

    fn try_all(
        &self,
        case: &Case,
        scratch: &Scratch,
        say: &mut dyn FnMut(&str),
        mut done: impl FnMut(Tried) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut pace = Pace::new(FACTORS.len() as f64);
        let mut before: Option<Rows> = None;
        for factor in FACTORS {
            say(&pace.line(&format!("interface stiffness, factor {}", short(factor))));
            let stiffness = self.unit.map(|unit| factor * unit);
            let outcome = self
                .run(case, scratch, stiffness)
                .map(|(rows, mut answer)| {
                    let scale = rows.largest();
                    answer.change = before.as_ref().map(|b| b.difference(&rows, &scale));
                    before = Some(rows);
                    answer
                });
            scratch.stop.check("the study")?;
            pace.did(1.0);
            done(Tried {
                group: self.group.name.clone(),
                factor,
                stiffness,
                conditioning: self.conditioning(stiffness),
                outcome: outcome.map_err(|error| in_one_line(&error)),
            })?;
        }
        Ok(())
    }

    fn run(
        &self,
        case: &Case,
        scratch: &Scratch,
        stiffness: [f64; 2],
    ) -> Result<(Rows, Answer), Error> {
        let parameters = self.parameters.iter().zip(stiffness);
        let values = parameters.map(|((id, value, now), wanted)| {
            (id.clone(), ParameterValue::Number(value * wanted / now))
        });
        let settings = Settings {
            law: Some((self.law.clone(), values.collect(), String::new())),
            ..Settings::default()
        };
        let mut case = settings.apply(case)?;
        case.file.output = Output {
            profile: When::Phases,
            ..Output::default()
        };
        let trial = measure(case, scratch, Timing::Once)?;
        let pressure = largest_pressure(&scratch.folder().join("profile.csv"), &self.group.name)?;
        let answer = Answer {
            penetration: pressure / stiffness[0] / self.size,
            iterations: trial.counts.iterations,
            change: None,
        };
        Ok((trial.rows, answer))
    }

    /// Largest over smallest diagonal entry of the elastic stiffness of the interface and the
    /// elements next to it.
    fn conditioning(&self, [k_n, k_t]: [f64; 2]) -> f64 {
        let mut diagonal = self.beside.clone();
        let operator = [k_n, 0.0, 0.0, k_t];
        add_diagonals(self.group, &operator, |_| true, &mut diagonal);
        let largest = diagonal.values().copied().fold(0.0, f64::max);
        let smallest = diagonal.values().copied().fold(f64::INFINITY, f64::min);
        largest / smallest
    }

    fn table(&self, name: &str, tried: &[Tried]) -> String {
        let [(id_n, _, now_n), (id_t, _, now_t)] = &self.parameters;
        let mut text = format!(
            "{name}: stiffness of the interface `{}`, law `{}` ({}), parameters `{id_n}` and \
             `{id_t}`\n\nproposal: K_n = f E_oed/h, K_t = f G/h with E_oed/h = {:.3e}, G/h = \
             {:.3e} kPa/m, h = {} m (softer side)\nfile: K_n = {now_n:.3e}, K_t = {now_t:.3e} \
             kPa/m at {} kPa: f = {:.2} and {:.2}\n\n{:>6} {:>10} {:>10} {:>12} {:>13} {:>11} \
             {:>9}\n",
            self.group.name,
            self.law,
            self.id,
            self.unit[0],
            self.unit[1],
            short((1e6 * self.size).round() / 1e6),
            short(-NORMAL_STRESS),
            now_n / self.unit[0],
            now_t / self.unit[1],
            "f",
            "K_n kPa/m",
            "K_t kPa/m",
            "penetration",
            "conditioning",
            "iterations",
            "change",
        );
        for one in tried {
            let [k_n, k_t] = one.stiffness;
            let start = format!("{:>6} {k_n:>10.2e} {k_t:>10.2e}", short(one.factor));
            let _ = match &one.outcome {
                Ok(answer) => writeln!(
                    text,
                    "{start} {:>12.1e} {:>13.1e} {:>11} {:>9}",
                    answer.penetration,
                    one.conditioning,
                    answer.iterations,
                    answer
                        .change
                        .map_or_else(|| "-".to_owned(), |change| format!("{change:.1e}")),
                ),
                Err(failure) => writeln!(text, "{start}  failed: {failure}"),
            };
        }
        text += "\npenetration: largest compression / (K_n h). conditioning: largest / smallest diagonal entry of the elastic stiffness of\n\
                 the interface and the elements at it. change: largest relative change of a probe since the row above.\n";
        let _ = writeln!(text, "{}", plateau(tried));
        text
    }
}

/// From which factor on the answer stays. A change is that since the run before that has an answer.
fn plateau(tried: &[Tried]) -> String {
    let answers = tried
        .iter()
        .filter_map(|one| Some((one, one.outcome.as_ref().ok()?)));
    let answers: Vec<(&Tried, &Answer)> = answers.collect();
    // The last change counts first: a plateau reaches to the stiffest run that succeeded.
    let Some((last, Some(change))) = answers.last().map(|(one, answer)| (one, answer.change))
    else {
        return "no two factors have an answer".to_owned();
    };
    let is_flat = |answer: &Answer| answer.change.is_some_and(|change| change < PLATEAU);
    let steps = answers.iter().rev();
    let steps = steps.take_while(|(_, answer)| is_flat(answer)).count();
    if steps == 0 {
        return format!(
            "no plateau: the last step still changes a probe by {:.1} %",
            100.0 * change
        );
    }
    let (first, Answer { penetration, .. }) = answers[answers.len() - 1 - steps];
    format!(
        "plateau: from f = {} to {} no probe changes by 1 % from row to row; at f = {}: K_n = {:.2e}, K_t = {:.2e} kPa/m, \
         penetration {penetration:.1e}",
        short(first.factor),
        short(last.factor),
        short(first.factor),
        first.stiffness[0],
        first.stiffness[1],
    )
}

const COLUMNS: &str = "group,factor,k_n,k_t,penetration,conditioning,iterations,change,failure";

fn csv_of(rows: &[Tried]) -> Result<String, Error> {
    let cells = |one: &Tried| {
        let mut cells = vec![one.group.clone(), one.factor.to_string()];
        cells.extend(one.stiffness.map(|k| format!("{k:e}")));
        match &one.outcome {
            Ok(answer) => cells.extend([
                format!("{:e}", answer.penetration),
                format!("{:e}", one.conditioning),
                answer.iterations.to_string(),
                answer.change.map(|c| format!("{c:e}")).unwrap_or_default(),
                String::new(),
            ]),
            Err(failure) => {
                cells.extend([const { String::new() }; 4]);
                cells.push(failure.replace(['"', ',', '\n'], " "));
            }
        }
        cells
    };
    csv(COLUMNS.split(','), rows.iter().map(cells))
}

/// The elastic operator under an isotropic compression (an interface: a normal one), row-major.
fn elastic_operator(law: &Law) -> Option<Vec<f64>> {
    let n = law.n_components();
    let normal = if n == 2 { 1 } else { 3 };
    let flux: Vec<f64> = (0..n)
        .map(|i| if i < normal { NORMAL_STRESS } else { 0.0 })
        .collect();
    let (_, operator) = law.at_rest(&flux, &[], Operator::Elastic).ok()?;
    Some(operator)
}

/// The parameters with the unit of a stiffness that scale the normal and the tangential entry of
/// the elastic operator: id, value, entry.
fn stiffness_parameters(built: &BuiltLaw) -> Result<[(String, f64, f64); 2], Error> {
    let description = built.law.description();
    let none = || {
        Error::usage(format!(
            "law `{}` has no parameters in kPa/m that scale its elastic operator",
            description.id
        ))
    };
    let loaded = built.law.loaded();
    let values: Vec<f64> = built.parameters.iter().map(|p| p.value).collect();
    let now = elastic_operator(&built.law).ok_or_else(none)?;
    let mut found = [None, None];
    for (number, declared) in description.parameters.iter().enumerate() {
        let is_stiffness = declared.unit.starts_with("kPa") && declared.unit.ends_with("/m");
        if !is_stiffness {
            continue;
        }
        let mut doubled = values.clone();
        doubled[number] *= 2.0;
        let Ok(law) = loaded.build(built.law.hypothesis(), &doubled) else {
            continue;
        };
        let Some(then) = elastic_operator(&law) else {
            continue;
        };
        for (slot, entry) in [0, 3].into_iter().enumerate() {
            let scales = (then[entry] / now[entry] - 2.0).abs() < 1e-6;
            if scales && found[slot].is_none() {
                found[slot] = Some((declared.id.clone(), values[number], now[entry]));
            }
        }
    }
    match found {
        [Some(normal), Some(shear)] => Ok([normal, shear]),
        _ => Err(none()),
    }
}

/// E_oed/h, G/h and h of the element next to a joint on the side where E_oed/h is smaller.
fn softer_side(model: &Simulation, joint: &Joint) -> Option<[f64; 3]> {
    let ends = [0, 1].map(|i| model.problem().mesh.nodes[joint.minus[i]]);
    let along_x = (ends[1][0] - ends[0][0]).abs() > (ends[1][1] - ends[0][1]).abs();
    let across = usize::from(along_x);
    let side = |middle: usize| {
        let mut solids = model.problem().mesh.solids.iter();
        let quad = solids.find(|solid| solid.nodes().contains(&middle))?;
        let operator = elastic_operator(&model.groups()[quad.group].law.built.law)?;
        if operator.len() != 16 {
            return None;
        }
        let [from, to] =
            [0, 2].map(|corner| model.problem().mesh.nodes[quad.corners()[corner]][across]);
        let size = (to - from).abs();
        Some([operator[5 * across] / size, operator[15] / size, size])
    };
    let sides = [side(joint.minus[2]), side(joint.plus[2])];
    let sides = sides.into_iter().flatten();
    sides.min_by(|a, b| a[0].total_cmp(&b[0]))
}

/// Diagonal entries of the solid elements that share a node with an interface.
fn diagonals_beside(model: &Simulation, interface: &Group) -> BTreeMap<usize, f64> {
    let of_interface: Vec<usize> = (0..interface.kinematics.n_elements())
        .flat_map(|e| interface.kinematics.nodes(e).to_vec())
        .collect();
    let mut diagonal = BTreeMap::new();
    for group in model.groups() {
        let operator = elastic_operator(&group.law.built.law);
        let Some(operator) = operator.filter(|o| o.len() == 16) else {
            continue;
        };
        if group.formulation == Formulation::Solid {
            let shares = |nodes: &[usize]| nodes.iter().any(|n| of_interface.contains(n));
            add_diagonals(group, &operator, shares, &mut diagonal);
        }
    }
    diagonal
}

fn add_diagonals(
    group: &Group,
    operator: &[f64],
    wanted: impl Fn(&[usize]) -> bool,
    diagonal: &mut BTreeMap<usize, f64>,
) {
    let elements = &group.kinematics;
    for element in 0..elements.n_elements() {
        let tangent = operator.repeat(elements.points_of(element).len());
        let nodes = elements.nodes(element);
        if !wanted(nodes) {
            continue;
        }
        let n = 2 * nodes.len();
        let mut stiffness = vec![0.0; n * n];
        elements.stiffness(element, &tangent, &mut stiffness);
        for (i, node) in nodes.iter().enumerate() {
            for c in 0..2 {
                let entry = stiffness[(2 * i + c) * (n + 1)];
                *diagonal.entry(2 * node + c).or_default() += entry;
            }
        }
    }
}

/// A row of a profile.
#[derive(Deserialize)]
struct OfProfile {
    group: String,
    traction_n: Option<f64>,
}

/// The largest compression of a group in a profile, kPa.
fn largest_pressure(path: &Path, group: &str) -> Result<f64, Error> {
    let broken = |error: csv::Error| Error::internal(format!("{}: {error}", path.display()));
    let mut largest = 0.0;
    for row in csv::Reader::from_path(path).map_err(broken)?.deserialize() {
        let row: OfProfile = row.map_err(broken)?;
        if row.group == group {
            largest = f64::max(largest, -row.traction_n.unwrap_or(0.0));
        }
    }
    Ok(largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tried(factor: f64, change: Result<Option<f64>, &str>) -> Tried {
        let answer = |change| Answer {
            penetration: 0.01 / factor,
            iterations: 10,
            change,
        };
        Tried {
            group: "joint".to_owned(),
            factor,
            stiffness: [factor, factor],
            conditioning: 1.0,
            outcome: change.map(answer).map_err(str::to_owned),
        }
    }

    #[test]
    fn a_plateau_begins_and_ends_at_runs_that_have_an_answer() {
        let runs = [
            tried(1.0, Ok(None)),
            tried(3.0, Ok(Some(0.05))),
            tried(10.0, Err("no equilibrium")),
            tried(30.0, Ok(Some(0.004))),
            tried(100.0, Ok(Some(0.001))),
            tried(300.0, Err("no equilibrium")),
        ];
        let said = plateau(&runs);
        assert!(said.starts_with("plateau: from f = 3 to 100 "), "{said}");
        assert!(said.contains("penetration 3.3e-3"), "{said}");
        assert!(
            plateau(&runs[..2]).starts_with("no plateau"),
            "{}",
            plateau(&runs[..2])
        );
        assert_eq!(plateau(&runs[..1]), "no two factors have an answer");
    }
}
