//! Results of another program as a table like that of a run.

use crate::model::{AtNodes, Model, Quantity, Step};
use crate::{Error, MODEL, Program, calculix, kratos, opengeosys, vtu};
use results::comma_separated;
use serde_json::{Map, Value, json};
use std::io;
use std::path::{Path, PathBuf};
use text::digits::number;
use text::write::replace;

/// What a program found at the end of a step, by node.
struct Found {
    /// Since the start, m.
    displacement: Vec<[f64; 2]>,
    /// Internal less external forces.
    reaction: Reaction,
}

/// Forces on nodes.
enum Reaction {
    /// Internal forces: external ones are still in them.
    Internal(Vec<[f64; 2]>),
    /// Internal less external ones.
    Less(Vec<[f64; 2]>),
}

/// Forces out of balance of an equilibrium, relative to the largest nodal force: those that iterate until displacements
/// change by 1e-10 leave far less.
const BALANCED: f64 = 1e-4;

/// Reads what the program that a folder was written for has left there, and writes `history.csv` and `summary.json`
/// next to it or into another folder, which is returned.
///
/// # Errors
/// [`text::Error::Unreadable`] without `model.json`; [`text::Error::Unwritable`]; no results; an increment that is missing
/// or no equilibrium, when the rows before it are written.
pub fn import(folder: &Path, out: Option<&Path>) -> Result<PathBuf, Error> {
    let path = folder.join(MODEL);
    let model: Model = serde_json::from_str(&read(&path)?)
        .map_err(|error| unreadable(&path, error.to_string()))?;
    let found = match model.program {
        Program::Ogs => of_opengeosys(folder, &model),
        Program::Kratos | Program::Dolfinx => of_kratos(folder, &model),
        Program::Calculix => of_calculix(folder, &model),
    }?;
    if found.is_empty() {
        return Err(Error::usage(format!(
            "no results in {}: run `{}` there first",
            folder.display(),
            model.program.command()
        )));
    }
    let open = (0..found.len()).find_map(|step| {
        let share = out_of_balance(&model, &found[step], step);
        (share.is_nan() || share > BALANCED).then_some((step, share))
    });
    let n_rows = open.map_or(found.len(), |(step, _)| step);
    let rows: Vec<Vec<f64>> = (0..n_rows).map(|step| row(&model, &found, step)).collect();
    let out = out.unwrap_or(folder);
    std::fs::create_dir_all(out).map_err(|error| text::Error::unwritable(out, error))?;
    replace(&out.join("history.csv"), table(&model, &rows)?)?;
    let last = rows.last().into_iter().flatten();
    let probes = model.probes.iter().zip(last);
    let probes: Map<String, Value> = probes.map(|(p, v)| (p.name.clone(), json!(v))).collect();
    let summary = json!({
        "program": model.program.name(),
        "status": if open.is_none() && n_rows == model.steps.len() { "done" } else { "stopped" },
        "case": model.case,
        "variant": model.variant,
        "title": model.title,
        "analysis": if model.axisymmetric { "axisymmetric" } else { "plane_strain" },
        "probes": probes,
    });
    replace(&out.join("summary.json"), format!("{summary:#}\n"))?;
    let Some(step) = model.steps.get(n_rows) else {
        return Ok(out.to_owned());
    };
    let why = open.map_or_else(
        || "there are no results".to_owned(),
        |(_, share)| {
            format!("no equilibrium: {share:.1e} of the largest nodal force is out of balance")
        },
    );
    Err(Error::usage(format!(
        "phase `{}`, increment {}: {why}; the {n_rows} of {} increments before it are in {}",
        step.phase,
        step.increment,
        model.steps.len(),
        out.join("history.csv").display()
    )))
}

/// Largest force out of balance on nodes that are free to move, relative to the largest nodal force.
fn out_of_balance(model: &Model, found: &Found, step: usize) -> f64 {
    let mut external = vec![[0.0; 2]; model.nodes.len()];
    for load in &model.loads {
        for (node, force) in load.nodes.iter().zip(&load.forces) {
            for (sum, force) in external[*node].iter_mut().zip(force) {
                *sum += load.factors[step + 1] * force;
            }
        }
    }
    let mut is_held = vec![[false; 2]; model.nodes.len()];
    for held in &model.held {
        for &node in &held.nodes {
            is_held[node][held.component] = true;
        }
    }
    // Radial forces of CalculiX contain those on the sides of its sector.
    let of_sector = model.program == Program::Calculix && model.axisymmetric;
    let (mut open, mut largest) = (0.0_f64, 0.0_f64);
    for node in 0..model.nodes.len() {
        for c in usize::from(of_sector)..2 {
            let left = match &found.reaction {
                Reaction::Less(forces) => forces[node][c],
                Reaction::Internal(forces) => forces[node][c] - external[node][c],
            };
            if !left.is_finite() {
                return f64::NAN;
            }
            largest = largest.max(left.abs()).max(external[node][c].abs());
            if !is_held[node][c] {
                open = open.max(left.abs());
            }
        }
    }
    if largest > 0.0 { open / largest } else { 0.0 }
}

fn read(path: &Path) -> Result<String, Error> {
    // Binary parts of a file are no text, but are not looked at.
    let bytes = std::fs::read(path).map_err(|why| text::Error::unreadable(path, why))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn unreadable(path: &Path, why: impl Into<String>) -> Error {
    let source = io::Error::new(io::ErrorKind::InvalidData, why.into());
    text::Error::unreadable(path, source).into()
}

fn of_opengeosys(folder: &Path, model: &Model) -> Result<Vec<Found>, Error> {
    let path_of =
        |number: usize| folder.join(format!("{}_{}.vtu", opengeosys::RESULTS, number + 1));
    let step = |number: usize| {
        let path = path_of(number);
        let text = read(&path)?;
        let pairs = |name: &str| {
            let values = vtu::array(&text, name).filter(|all| all.len() == 2 * model.nodes.len());
            let values = values
                .ok_or_else(|| unreadable(&path, format!("no array `{name}` of every node")))?;
            Ok::<_, Error>(
                values
                    .chunks_exact(2)
                    .map(|pair| [pair[0], pair[1]])
                    .collect(),
            )
        };
        Ok(Found {
            displacement: pairs("displacement")?,
            reaction: Reaction::Internal(pairs("NodalForces")?),
        })
    };
    let is_there = |number: &usize| path_of(*number).is_file();
    let steps = (0..model.steps.len()).take_while(is_there);
    steps.map(step).collect()
}

fn of_kratos(folder: &Path, model: &Model) -> Result<Vec<Found>, Error> {
    let path = folder.join(kratos::RESULTS);
    let n = model.nodes.len();
    let mut all = vec![[vec![[0.0; 2]; n], vec![[0.0; 2]; n]]; model.steps.len()];
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = read(&path)?;
    let mut counts = vec![0; model.steps.len()];
    for line in text.lines().skip(1) {
        let numbers: Option<Vec<f64>> = line.split(',').map(|word| word.parse().ok()).collect();
        let Some(&[step, node, u, v, r, s]) = numbers.as_deref() else {
            return Err(unreadable(&path, format!("no six numbers in `{line}`")));
        };
        let place = all.get_mut(step as usize).filter(|_| (node as usize) < n);
        let [displacement, reaction] = place.ok_or_else(|| unreadable(&path, "another model's"))?;
        displacement[node as usize] = [u, v];
        reaction[node as usize] = [r, s];
        counts[step as usize] += 1;
    }
    let whole = counts.iter().take_while(|count| **count == n).count();
    all.truncate(whole);
    let found = |[displacement, reaction]: [Vec<[f64; 2]>; 2]| Found {
        displacement,
        reaction: Reaction::Less(reaction),
    };
    Ok(all.into_iter().map(found).collect())
}

fn of_calculix(folder: &Path, model: &Model) -> Result<Vec<Found>, Error> {
    let path = folder.join("model.dat");
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let [displacements, forces] = calculix::printed(&read(&path)?, model.nodes.len());
    let n = displacements.len();
    if n > model.steps.len() || forces.len() > n {
        return Err(unreadable(&path, "more increments than the case has"));
    }
    let factor = if model.axisymmetric {
        calculix::SECTORS
    } else {
        1.0
    };
    let found = |(displacement, mut forces): (Vec<[f64; 2]>, Vec<[f64; 2]>)| {
        forces
            .iter_mut()
            .flatten()
            .for_each(|force| *force *= factor);
        Found {
            displacement,
            reaction: Reaction::Internal(forces),
        }
    };
    Ok(displacements.into_iter().zip(forces).map(found).collect())
}

/// Values of the probes at the end of a step.
fn row(model: &Model, found: &[Found], step: usize) -> Vec<f64> {
    let mut row: Vec<f64> = Vec::new();
    for probe in &model.probes {
        let value = match &probe.quantity {
            Quantity::Displacement(at) => displacement(model, found, step, at),
            Quantity::Reaction(at) => reaction(model, found, step, at),
            Quantity::Combination(terms) => {
                let value = |(name, factor): &(String, f64)| {
                    let place = model.probes.iter().position(|probe| probe.name == *name);
                    place.and_then(|i| row.get(i)).map(|value| factor * value)
                };
                terms.iter().filter_map(value).sum()
            }
        };
        row.push(value);
    }
    row
}

fn displacement(model: &Model, found: &[Found], step: usize, at: &AtNodes) -> f64 {
    let from = model.steps[step].counted_from;
    let value = |&node: &usize| {
        let origin = from.map_or(0.0, |from| found[from].displacement[node][at.component]);
        found[step].displacement[node][at.component] - origin
    };
    let values: Vec<f64> = at.nodes.iter().map(value).collect();
    let sum: f64 = values.iter().sum();
    at.scale
        * match at.reduce.as_str() {
            "min" => values.iter().copied().fold(f64::INFINITY, f64::min),
            "max" => values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            "sum" => sum,
            _ => sum / values.len() as f64,
        }
}

fn reaction(model: &Model, found: &[Found], step: usize, at: &AtNodes) -> f64 {
    let sum = |forces: &[[f64; 2]]| {
        at.nodes
            .iter()
            .map(|&node| forces[node][at.component])
            .sum::<f64>()
    };
    at.scale
        * match &found[step].reaction {
            Reaction::Less(forces) => sum(forces),
            Reaction::Internal(forces) => sum(forces) - model.external(step, at),
        }
}

fn table(model: &Model, rows: &[Vec<f64>]) -> Result<String, Error> {
    let columns = ["phase", "increment", "time"].into_iter();
    let columns = columns.chain(model.probes.iter().map(|p| p.name.as_str()));
    let cells = |(step, row): (&Step, &Vec<f64>)| {
        let mut cells = vec![step.phase.clone(), step.increment.to_string()];
        cells.push(number(step.time));
        cells.extend(row.iter().map(|value| number(*value)));
        cells.push(String::new());
        cells
    };
    let rows = model.steps.iter().zip(rows).map(cells);
    Ok(comma_separated(columns.chain(["iterations"]), rows)?)
}
