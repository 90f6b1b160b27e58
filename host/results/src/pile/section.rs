//! The ground beside a pile, for pictures: layers and water level along a vertical next to its shaft.

use super::Pile;
use super::geometry::sides;
use crate::ends;
use crate::summary::{Layer, Section};
use mechanics::Simulation;
use mechanics::ground::Loading;
use mechanics::problem::{Formulation, Problem};

/// The vertical lies beside the shaft by this share of its radius.
const BESIDE: f64 = 1e-4;

impl Pile {
    /// Outline, layers and water level.
    pub(crate) fn section(&self, simulation: &Simulation) -> Section {
        let problem = simulation.problem();
        let nodes = &problem.mesh.nodes;
        let own = self.geometry.shaft.iter().flat_map(|facet| facet.nodes);
        let radius = own.map(|node| nodes[node][0]).fold(0.0, f64::max);
        let x = radius + BESIDE * radius.abs().max(self.diameter());
        let spans = &self.geometry.spans;
        let resets = problem.phases.iter();
        let resets = resets.filter(|phase| phase.reset_displacements);
        Section {
            top: spans.first().map_or(0.0, |span| span.z[0]),
            bottom: spans.last().map_or(0.0, |span| span.z[1]),
            width: self.geometry.width,
            layers: self.layers(simulation, x),
            resets: resets.map(|phase| phase.name.clone()).collect(),
            water: water(problem, x),
        }
    }

    /// Groups along a vertical, from above.
    fn layers(&self, simulation: &Simulation, x: f64) -> Vec<Layer> {
        let nodes = &simulation.problem().mesh.nodes;
        let mut layers: Vec<Layer> = Vec::new();
        for (number, group) in simulation.groups().iter().enumerate() {
            if group.formulation != Formulation::Solid || self.parts.groups.contains(&number) {
                continue;
            }
            let kinematics = &group.kinematics;
            let mut pieces: Vec<[f64; 2]> = Vec::new();
            for element in 0..kinematics.n_elements() {
                let crossed = sides(kinematics.nodes(element), false)
                    .into_iter()
                    .filter_map(|[a, b, _]| {
                        let [a, b] = [nodes[a], nodes[b]];
                        let is_crossed = (a[0] <= x) != (b[0] <= x);
                        is_crossed.then(|| a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1]))
                    });
                let [low, high] = ends(crossed);
                if high > low {
                    pieces.push([high, low]);
                }
            }
            pieces.sort_by(|a, b| b[0].total_cmp(&a[0]));
            let close = 1e-6 * self.length();
            for [top, bottom] in pieces {
                match layers.last_mut() {
                    Some(last) if last.group == group.name && top >= last.bottom - close => {
                        last.bottom = last.bottom.min(bottom);
                    }
                    _ => layers.push(Layer {
                        group: group.name.clone(),
                        top,
                        bottom,
                    }),
                }
            }
        }
        layers.sort_by(|a, b| b.top.total_cmp(&a.top));
        layers
    }
}

/// Height of the water by phase, at its end.
fn water(problem: &Problem, x: f64) -> Vec<(String, f64)> {
    let mut now = Loading::before(problem);
    let mut levels = Vec::new();
    for phase in &problem.phases {
        now = now.changed_by(phase);
        let level = now.water_level.as_ref().map(|level| level.at(x));
        levels.extend(level.map(|level| (phase.name.clone(), level)));
    }
    levels
}
