//! Input of CalculiX, for linear elastic laws. The initial stress is carried as the nodal forces that balance it:
//! displacements and forces are the same, printed stresses are the changes.

use crate::model::{Element, Model};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Results are of a sector of 2° of the whole turn.
pub(crate) const SECTORS: f64 = 180.0;

pub(crate) fn files(model: &Model) -> Vec<(String, String)> {
    vec![("model.inp".to_owned(), input(model))]
}

fn input(model: &Model) -> String {
    let mut text = String::from(
        "** Units: kN, m, kPa. Forces are of the whole turn, or kN/m.\n*NODE, NSET=NALL\n",
    );
    for (number, [x, y]) in model.nodes.iter().enumerate() {
        let _ = writeln!(text, "{}, {x:.12e}, {y:.12e}", number + 1);
    }
    for (number, group) in model.groups.iter().enumerate() {
        let _ = writeln!(text, "** {}", group.name);
        let mut last = "";
        let own = model
            .elements
            .iter()
            .enumerate()
            .filter(|(_, e)| e.group == number);
        let own: Vec<(usize, &Element)> = own.collect();
        for kind in [6, 8] {
            for (element, Element { nodes, .. }) in
                own.iter().filter(|(_, e)| e.nodes.len() == kind)
            {
                let kind = kind_of(nodes.len(), model.axisymmetric, group.reduced);
                if kind != last {
                    let _ = writeln!(text, "*ELEMENT, TYPE={kind}, ELSET=G{number}");
                    last = kind;
                }
                let nodes: Vec<String> = nodes.iter().map(|node| (node + 1).to_string()).collect();
                let _ = writeln!(text, "{}, {}", element + 1, nodes.join(", "));
            }
        }
        let [young, poisson] = group.elastic().unwrap_or_default();
        let _ = writeln!(
            text,
            "*MATERIAL, NAME=M{number}\n*ELASTIC\n{young:?}, {poisson:?}"
        );
        let _ = writeln!(text, "*SOLID SECTION, ELSET=G{number}, MATERIAL=M{number}");
        if !model.axisymmetric {
            text += "1.\n";
        }
    }
    for step in 0..model.steps.len() {
        add_step(model, step, &mut text);
    }
    text
}

fn kind_of(n_nodes: usize, axisymmetric: bool, reduced: bool) -> &'static str {
    match (n_nodes, axisymmetric, reduced) {
        (6, true, _) => "CAX6",
        (6, false, _) => "CPE6",
        (_, true, false) => "CAX8",
        (_, true, true) => "CAX8R",
        (_, false, false) => "CPE8",
        (_, false, true) => "CPE8R",
    }
}

fn add_step(model: &Model, step: usize, text: &mut String) {
    let of = &model.steps[step];
    let _ = writeln!(
        text,
        "** {}, increment {}\n*STEP\n*STATIC\n1., 1.\n*BOUNDARY",
        of.phase, of.increment
    );
    for held in &model.held {
        for node in &held.nodes {
            let c = held.component + 1;
            let _ = writeln!(text, "{}, {c}, {c}, {:.12e}", node + 1, held.values[step]);
        }
    }
    let mut sums: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    for load in &model.loads {
        for (node, force) in load.nodes.iter().zip(&load.forces) {
            for (c, force) in force.iter().enumerate().filter(|(_, force)| **force != 0.0) {
                *sums.entry((*node, c)).or_default() += load.factors[step + 1] * force;
            }
        }
    }
    if !sums.is_empty() {
        text.push_str("*CLOAD, OP=NEW\n");
    }
    for ((node, c), force) in sums {
        let _ = writeln!(text, "{}, {}, {force:.12e}", node + 1, c + 1);
    }
    text.push_str("*NODE PRINT, NSET=NALL\nU, RF\n*END STEP\n");
}

/// Displacements, and forces of a sector, of every step, from the text of `model.dat`.
pub(crate) fn printed(text: &str, n_nodes: usize) -> [Vec<Vec<[f64; 2]>>; 2] {
    let mut found: [Vec<Vec<[f64; 2]>>; 2] = [Vec::new(), Vec::new()];
    let mut now = None;
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        now = match words.first() {
            Some(&"displacements") => Some(0),
            Some(&"forces") => Some(1),
            _ => {
                let numbers = words.iter().map(|word| word.parse::<f64>().ok());
                let numbers: Option<Vec<f64>> = numbers.collect();
                if let (Some(kind), Some(&[node, x, y, ..])) = (now, numbers.as_deref())
                    && let Some(all) = found[kind].last_mut()
                    && let Some(own) = all.get_mut((node as usize).wrapping_sub(1))
                {
                    *own = [x, y];
                }
                continue;
            }
        };
        if let Some(kind) = now {
            found[kind].push(vec![[0.0; 2]; n_nodes]);
        }
    }
    found
}
