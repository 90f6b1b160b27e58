//! Loads on lines whose ground is removed and brought back, or that ground covers and bares again.

use super::{edges_there, opposite_faces};
use crate::mesh::Mesh;
use crate::problem::Problem;

/// A pressure or a force on a line, from the phase that gave it on.
struct Load<'p> {
    kind: &'static str,
    line: &'p str,
    given: &'p str,
    stands: Stands,
}

/// Ground next to a loaded line.
#[derive(Clone, Copy, PartialEq)]
enum Stands {
    OnGround,
    /// Some of the ground that it acts upon is absent.
    OnNothing,
    /// There is ground on both sides.
    Inside,
}

/// Warnings of loads that go and come back with their ground.
pub(super) fn warnings(problem: &Problem) -> Vec<String> {
    let opposite = opposite_faces(&problem.mesh);
    let mut warnings = Vec::new();
    let mut loads: Vec<Load<'_>> = Vec::new();
    for (number, phase) in problem.phases.iter().enumerate() {
        let there = edges_there(&problem.mesh, &problem.active_after(number + 1));
        let sides = |middle: usize| {
            let other = opposite.get(&middle).and_then(|(face, _)| there.get(face));
            let own = there.get(&middle).copied().unwrap_or(0);
            own + other.copied().unwrap_or(0)
        };
        let pressures = phase.pressure.iter();
        let pressures = pressures.map(|input| ("pressure", &input.line, input.is_none()));
        let forces = phase.force.iter();
        let forces = forces.map(|input| ("force", &input.line, input.is_none()));
        for (kind, line, is_none) in pressures.chain(forces) {
            loads.retain(|load| load.kind != kind || load.line != line);
            if !is_none {
                loads.push(Load {
                    kind,
                    line,
                    given: &phase.name,
                    stands: Stands::OnGround,
                });
            }
        }
        for load in &mut loads {
            let before = load.stands;
            load.stands = load.stands_in(&problem.mesh, sides);
            warnings.extend(load.change(before, &phase.name));
        }
    }
    warnings
}

impl Load<'_> {
    /// Whether its line bounds active elements, lies inside them, or has none. `sides` gives the number of active
    /// elements that have a node in the middle of a side.
    fn stands_in(&self, mesh: &Mesh, sides: impl Fn(usize) -> usize) -> Stands {
        let edges = mesh.lines.get(self.line).into_iter();
        let edges = edges.flat_map(|line| &line.edges);
        let sides: Vec<usize> = edges.map(|&edge| sides(mesh.edge(edge)[2])).collect();
        if sides.contains(&0) {
            Stands::OnNothing
        } else if self.kind == "pressure" && sides.iter().any(|sides| *sides > 1) {
            Stands::Inside
        } else {
            Stands::OnGround
        }
    }

    /// What a phase of this name makes of it.
    fn change(&self, before: Stands, name: &str) -> Option<String> {
        let Load {
            kind, line, given, ..
        } = self;
        Some(match (before, self.stands) {
            (Stands::OnGround, Stands::OnNothing) => format!(
                "phase `{name}` removes ground that the {kind} on line `{line}` acts upon: it goes with it, and \
                     comes back with it unless a phase sets it to 0"
            ),
            (Stands::OnGround, Stands::Inside) => {
                format!("phase `{name}` brings ground upon line `{line}`: the pressure there ends")
            }
            (Stands::OnNothing, Stands::OnGround) => format!(
                "phase `{name}` brings back ground that the {kind} on line `{line}` of phase `{given}` acts upon, \
                     and the {kind} with it: {kind} 0 there, in this phase or before, leaves it out"
            ),
            (Stands::Inside, Stands::OnGround) => format!(
                "phase `{name}` lays line `{line}` bare, and the {kind} there of phase `{given}` is back: {kind} 0 \
                     there, in this phase or before, leaves it out"
            ),
            _ => return None,
        })
    }
}
