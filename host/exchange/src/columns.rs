//! Probes that other programs can give: displacements and reactions of lines.

use crate::Error;
use crate::limits::{self, NotCarried};
use crate::model::{AtNodes, Probe, Quantity};
use input::{Case, probes};
use mechanics::Simulation;
use results::output_request::Reduce;
use results::probe;

/// Why a probe is not read back.
const ELSEWHERE: &str = "only displacements and reactions of lines are read back";

/// Probes at nodes, and those that are not carried. `of_sector`: forces come from a sector of the whole turn.
pub(crate) fn of(
    case: &Case,
    simulation: &Simulation,
    of_sector: bool,
) -> Result<(Vec<Probe>, Vec<NotCarried>), Error> {
    let resolved = probes::resolve(case, simulation)?;
    let (mut carried, mut left): (Vec<Probe>, Vec<NotCarried>) = (Vec::new(), Vec::new());
    let names: Vec<&str> = resolved.names().collect();
    for (name, probe) in resolved.iter() {
        let column = match probe {
            probe::Probe::Combination(terms) => {
                let named = terms
                    .iter()
                    .map(|&(i, factor)| (names[i].to_owned(), factor));
                let named: Vec<(String, f64)> = named.collect();
                let is_there = |(name, _): &(String, f64)| carried.iter().any(|p| p.name == *name);
                let all = named.iter().all(is_there);
                all.then_some(Quantity::Combination(named)).ok_or(ELSEWHERE)
            }
            other => at_nodes(other, of_sector),
        };
        match column {
            Ok(quantity) => carried.push(Probe {
                name: name.to_owned(),
                quantity,
            }),
            Err(why) => left.push(limits::probe(case, name, why)),
        }
    }
    Ok((carried, left))
}

/// A displacement or a reaction; or why it is not read back.
fn at_nodes(probe: &probe::Probe, of_sector: bool) -> Result<Quantity, &'static str> {
    let (quantity, nodes, component, reduce, scale): (fn(AtNodes) -> Quantity, _, _, _, _) =
        match probe {
            probe::Probe::Displacement {
                nodes,
                component,
                reduce,
                scale,
            } => (
                Quantity::Displacement,
                nodes,
                *component,
                word(*reduce),
                *scale,
            ),
            probe::Probe::Force { component: 0, .. } if of_sector => return Err(limits::RADIAL),
            probe::Probe::Force {
                nodes,
                component,
                group: None,
                scale,
                ..
            } => (Quantity::Reaction, nodes, *component, "sum", *scale),
            _ => return Err(ELSEWHERE),
        };
    Ok(quantity(AtNodes {
        nodes: nodes.clone(),
        component,
        reduce: reduce.to_owned(),
        scale,
    }))
}

fn word(reduce: Reduce) -> &'static str {
    match reduce {
        Reduce::Min => "min",
        Reduce::Max => "max",
        Reduce::Sum => "sum",
        Reduce::Mean | Reduce::Average | Reduce::Integral => "mean",
    }
}
