//! Warnings about an implausible pile.

use super::compliance::is_transfer;
use super::geometry::{SAME, sides};
use super::{Base, Pile};
use crate::ends;
use mechanics::group::Group;
use mechanics::problem::{Analysis, Axis, Formulation, Phase};
use mechanics::{Problem, Simulation};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Thickness, in diameters, of the layer of ground that is as stiff as an interface: above the first the interface is
/// soft, below the second its jumps are lost in round-off.
const SOFT: f64 = 1.0;
const STIFF: f64 = 1e-8;
/// Stress over a pile's section that no material of piles carries, kPa.
const STRONGEST: f64 = 1e6;

impl Pile {
    /// Warnings about the pile before it is loaded.
    pub fn warnings(&self, simulation: &Simulation) -> Vec<String> {
        let mut said = self.of_head(simulation);
        said.extend(self.of_shaft(simulation));
        said.extend(self.beside_shaft(simulation));
        said.extend(self.half(simulation));
        said.extend(self.narrow(simulation));
        said.extend(self.soft(simulation));
        said.extend(self.loaded_too_early(simulation.problem()));
        said.extend(self.only_pulled(simulation.problem()));
        said.extend(self.crushed(simulation.problem()));
        said
    }

    /// Groups of the interfaces along its shaft and at its base.
    fn joints(&self) -> impl Iterator<Item = usize> {
        let base = match self.parts.base {
            Base::Group(group) => Some(group),
            Base::Line(_) => None,
        };
        self.parts.shaft.iter().copied().chain(base)
    }

    /// A diameter that is less than that of the shaft: a radius, most likely.
    fn narrow(&self, simulation: &Simulation) -> Option<String> {
        let problem = simulation.problem();
        let diameter = self.parts.diameter?;
        let facets = self.geometry.shaft.iter().flat_map(|facet| facet.nodes);
        let radius = facets
            .map(|node| problem.mesh.nodes[node][0])
            .fold(0.0, f64::max);
        (problem.analysis == Analysis::Axisymmetric && diameter < 0.9 * 2.0 * radius).then(|| {
            format!(
                "[pile]: `diameter` is {diameter} m, the shaft in the mesh has {}: is it the radius?",
                2.0 * radius
            )
        })
    }

    /// Constrained and shear modulus of the stiffest ground beside an interface, kPa.
    fn stiffest_beside(&self, groups: &[Group], joint: usize) -> [f64; 2] {
        let joint = &groups[joint].kinematics;
        let own = (0..joint.n_elements()).flat_map(|element| joint.nodes(element));
        let own: BTreeSet<usize> = own.copied().collect();
        let is_beside = |group: &Group| {
            let kinematics = &group.kinematics;
            // A side has three nodes; a corner alone is not beside it.
            (0..kinematics.n_elements()).any(|element| {
                let nodes = kinematics.nodes(element).iter();
                nodes.filter(|node| own.contains(node)).count() >= 3
            })
        };
        let ground = groups.iter().enumerate().filter(|(number, group)| {
            group.formulation == Formulation::Solid
                && !self.parts.groups.contains(number)
                && is_beside(group)
        });
        let operators = ground.filter_map(|(_, group)| group.elastic_operator(0));
        operators.fold([0.0_f64, 0.0_f64], |[m, g], d| {
            [m.max(d[5]), g.max(0.5 * (d[5] - d[4]))]
        })
    }

    /// Interfaces that are as soft as a thick layer of the ground, or so stiff that their jumps are lost in round-off.
    fn soft(&self, simulation: &Simulation) -> Vec<String> {
        let groups = simulation.groups();
        let diameter = self.diameter();
        let mut said = Vec::new();
        let is_joint = |joint: &usize| {
            let group = &groups[*joint];
            group.formulation == Formulation::ZeroThickness && !is_transfer(group)
        };
        for joint in self.joints().filter(is_joint) {
            let [constrained, shear] = self.stiffest_beside(groups, joint);
            let Some(stiffness) = groups[joint]
                .elastic_operator(0)
                .filter(|_| constrained > 0.0)
            else {
                continue;
            };
            for (name, modulus, stiffness) in [
                ("normal", constrained, stiffness[0]),
                ("shear", shear, stiffness[3]),
            ] {
                if stiffness <= 0.0 {
                    // It grows with the normal stress, and there is none yet.
                    continue;
                }
                let layer = modulus / stiffness;
                let (law, group) = (&groups[joint].law.name, &groups[joint].name);
                let of = format!(
                    "[pile]: interface `{group}`, law `{law}`: its {name} stiffness of {stiffness:.1e} kPa/m "
                );
                if layer > SOFT * diameter {
                    said.push(format!(
                        "{of}is low: it deforms as much as {layer:.2} m of the stiffest ground beside it. This adds to the \
                         settlement; {} kPa/m are as stiff as a layer of a twentieth of the diameter",
                        rounded(20.0 * modulus / diameter)
                    ));
                } else if layer < STIFF * diameter {
                    said.push(format!(
                        "{of}is so high that jumps of displacement are lost in round-off. {} kPa/m, as stiff as a layer of a \
                         thousandth of the diameter, is enough",
                        rounded(1000.0 * modulus / diameter)
                    ));
                }
            }
        }
        said
    }

    /// Why the pile is not in place in a phase: an interface of its shaft or base is inactive, or the pile still has the
    /// law of the ground. `None` if it is in place.
    pub(crate) fn not_in_place(&self, problem: &Problem, phase: usize) -> Option<String> {
        let phases = &problem.phases[..=phase];
        let is_active = |group: usize| {
            let start = problem.groups[group].is_active;
            phases.iter().fold(start, |active, phase| {
                (active || phase.activate.contains(&group)) && !phase.deactivate.contains(&group)
            })
        };
        let swap = |group: usize| {
            let mut swaps = phases.iter().flat_map(|phase| &phase.materials).rev();
            swaps.find_map(|(of, law)| (*of == group).then_some(law))
        };
        let law = |group: usize| {
            let own = &problem.groups[group].material;
            &swap(group).unwrap_or(own).name
        };
        if let Some(absent) = self.joints().find(|&group| !is_active(group)) {
            return Some(format!(
                "interface `{}` is not active yet. Activate it earlier, or load the head later",
                problem.groups[absent].name
            ));
        }
        let own = self.parts.groups.iter().filter(|&&group| is_active(group));
        // A cap or raft beside the pile was ground too, until its law was swapped.
        let ground = problem.groups.iter().enumerate().filter(|(number, group)| {
            group.initial_stress.is_some()
                && is_active(*number)
                && swap(*number).is_none()
                && !self.parts.groups.contains(number)
        });
        let ground: Vec<(usize, &String)> = ground.map(|(n, group)| (n, &group.name)).collect();
        own.copied().find_map(|pile| {
            let (_, name) = ground.iter().find(|(group, _)| law(*group) == law(pile))?;
            Some(format!(
                "group `{}` still has law `{}` of the ground (group `{name}`). Swap it with `laws` in an earlier phase",
                problem.groups[pile].name,
                law(pile)
            ))
        })
    }

    /// Names of the phases in which the pile is not in place.
    pub(crate) fn phases_too_early(&self, problem: &Problem) -> Vec<String> {
        let phases = problem.phases.iter().enumerate();
        let early = phases.filter(|(number, _)| self.not_in_place(problem, *number).is_some());
        early.map(|(_, phase)| phase.name.clone()).collect()
    }

    /// Names of the phases that prescribe the head's vertical displacement.
    pub(crate) fn phases_that_move_the_head(&self, problem: &Problem) -> Vec<String> {
        let head = &self.parts.head;
        let moves = |phase: &&Phase| {
            let mut inputs = phase.displacement.iter();
            inputs.any(|input| input.line == *head && input.y.is_some())
        };
        let phases = problem.phases.iter().filter(moves);
        phases.map(|phase| phase.name.clone()).collect()
    }

    /// Vertical loads and displacements that a phase gives the head: greatest of either sign, upward positive.
    fn head_moves(&self, phase: &Phase) -> [f64; 2] {
        let head = &self.parts.head;
        let forces = phase.force.iter().filter(|input| input.line == *head);
        let displacements = phase
            .displacement
            .iter()
            .filter(|input| input.line == *head);
        let pressures = phase.pressure.iter().filter(|input| input.line == *head);
        let upward = forces.filter_map(|input| input.y);
        let upward = upward.chain(displacements.filter_map(|input| input.y));
        let upward =
            upward.chain(pressures.flat_map(|input| input.value.values().map(|value| -value)));
        upward.fold([0.0, 0.0], |[down, up], value| {
            [value.min(down), value.max(up)]
        })
    }

    /// A phase that loads the head before the pile is in place.
    fn loaded_too_early(&self, problem: &Problem) -> Option<String> {
        let mut phases = problem.phases.iter().enumerate();
        phases.find_map(|(number, phase)| {
            let why = self.not_in_place(problem, number)?;
            (self.head_moves(phase) != [0.0, 0.0]).then(|| {
                format!(
                    "[pile]: phase `{}` loads the head, but {why}; no resistance is reported from this phase",
                    phase.name
                )
            })
        })
    }

    /// A force on the head that no material of a pile could carry.
    fn crushed(&self, problem: &Problem) -> Option<String> {
        let sides = self.geometry.head_sides.iter();
        let area: f64 = sides.map(|(area, ..)| area).sum();
        problem.phases.iter().find_map(|phase| {
            let force = self.force_on_head(phase)?.abs();
            let stress = force / area;
            let unit = self.geometry.analysis.force_unit();
            (stress > STRONGEST).then(|| {
                format!(
                    "[pile]: phase `{}` puts a force of {force} {unit} on the head, {stress:.1e} kPa over its section; concrete \
                     carries 3e4, steel 4e5: was it typed in N?",
                    phase.name
                )
            })
        })
    }

    /// Phases pull the head up, and none pushes it down.
    fn only_pulled(&self, problem: &Problem) -> Option<String> {
        let moves = problem
            .phases
            .iter()
            .map(|phase| (phase, self.head_moves(phase)));
        let moves: Vec<_> = moves.collect();
        if moves.iter().any(|(_, [down, _])| *down < 0.0) {
            return None;
        }
        let (phase, [_, up]) = moves.iter().find(|(_, [_, up])| *up > 0.0)?;
        Some(format!(
            "[pile]: phase `{}` pulls the head upward ({up}), and no phase pushes it down: an uplift test. Forces and \
             displacements that push a pile down are negative in z",
            phase.name
        ))
    }

    /// Corners and middles of the sides of its elements, each once.
    fn sides(&self, simulation: &Simulation) -> Vec<[usize; 3]> {
        let mut found: BTreeMap<usize, [usize; 3]> = BTreeMap::new();
        for &group in &self.parts.groups {
            let kinematics = &simulation.groups()[group].kinematics;
            for element in 0..kinematics.n_elements() {
                let own = sides(kinematics.nodes(element), false);
                found.extend(own.into_iter().map(|side| (side[2], side)));
            }
        }
        found.into_values().collect()
    }

    /// A head that is not level, below the pile's top, or not all of it.
    fn of_head(&self, simulation: &Simulation) -> Vec<String> {
        let nodes = &simulation.problem().mesh.nodes;
        let close = SAME * self.length();
        let head: BTreeSet<usize> = self.geometry.head.iter().copied().collect();
        let name = &self.parts.head;
        let [low, high] = ends(head.iter().map(|&node| nodes[node][1]));
        if high - low > close {
            return vec![format!(
                "[pile]: head line `{name}` is not level, it reaches from z = {low:.4} to {high:.4} m: the pile's \
                 length counts from the highest"
            )];
        }
        let sides = self.sides(simulation);
        let own = || sides.iter().flatten().copied();
        let [_, top] = ends(own().map(|node| nodes[node][1]));
        if top > high + close {
            return vec![format!(
                "[pile]: the pile's groups reach up to z = {top:.4} m, above its head line `{name}` at {high:.4} m: \
                 what acts above the head counts as shaft"
            )];
        }
        let left_out = own().filter(|node| nodes[*node][1] > top - close && !head.contains(node));
        let x: Vec<f64> = left_out.map(|node| nodes[node][0]).collect();
        if x.is_empty() {
            return Vec::new();
        }
        let [from, to] = ends(x.into_iter());
        vec![format!(
            "[pile]: head line `{name}` leaves out part of the pile's top, from x = {from:.4} to {to:.4} m: what acts \
             there counts as shaft"
        )]
    }

    /// Elements of the shaft's groups that do not touch the pile.
    fn of_shaft(&self, simulation: &Simulation) -> Vec<String> {
        let mut said = Vec::new();
        for &number in &self.parts.shaft {
            let group = &simulation.groups()[number];
            let facets = &self.geometry.shaft;
            let touch = facets.iter().filter(|facet| facet.group == number).count();
            let all = group.kinematics.n_elements();
            if touch < all {
                said.push(format!(
                    "[pile]: {} of {all} elements of shaft `{}` do not touch the pile: they are no part of its shaft",
                    all - touch,
                    group.name
                ));
            }
        }
        said
    }

    /// Groups next to the pile that are neither its shaft nor below its base.
    fn beside_shaft(&self, simulation: &Simulation) -> Vec<String> {
        let (problem, groups) = (simulation.problem(), simulation.groups());
        let nodes = &problem.mesh.nodes;
        let ends_there: BTreeSet<usize> = self
            .geometry
            .head
            .iter()
            .chain(&self.geometry.base)
            .copied()
            .collect();
        let own: HashMap<usize, [usize; 3]> = self
            .sides(simulation)
            .into_iter()
            .filter(|side| !side.iter().all(|node| ends_there.contains(node)))
            .map(|side| (side[2], side))
            .collect();
        let mut said = Vec::new();
        for (number, group) in groups.iter().enumerate() {
            let is_named = self.parts.groups.contains(&number)
                || self.parts.shaft.contains(&number)
                || matches!(self.parts.base, Base::Group(base) if base == number);
            if is_named {
                continue;
            }
            let kinematics = &group.kinematics;
            let is_joint = group.formulation == Formulation::ZeroThickness;
            let touching = (0..kinematics.n_elements()).flat_map(|element| {
                let middles = sides(kinematics.nodes(element), is_joint);
                middles
                    .into_iter()
                    .filter_map(|[_, _, middle]| own.get(&middle))
            });
            let z: Vec<f64> = touching.flatten().map(|&node| nodes[node][1]).collect();
            if z.is_empty() {
                continue;
            }
            let [low, high] = ends(z.into_iter());
            said.push(format!(
                "[pile]: group `{}` touches the pile between z = {low:.4} and {high:.4} m and is not listed in `shaft`. Its force counts in the shaft load, and pile.csv has no friction there: \
                 add it to `shaft`",
                group.name
            ));
        }
        said
    }

    /// In plane strain a pile that is held sideways along its own line, as one half of a pile is on its
    /// plane of symmetry.
    fn half(&self, simulation: &Simulation) -> Option<String> {
        let problem = simulation.problem();
        if problem.analysis != Analysis::PlaneStrain || self.parts.diameter.is_some() {
            return None;
        }
        let held = problem
            .supports
            .iter()
            .filter(|s| s.fixed.contains(&Axis::X));
        let lines = held.filter_map(|support| problem.mesh.lines.get(&support.line));
        let held: BTreeSet<usize> = lines.flat_map(|line| line.nodes.iter().copied()).collect();
        let nodes = &problem.mesh.nodes;
        let upright = |[a, b, middle]: &[usize; 3]| {
            [a, b, middle].iter().all(|node| held.contains(*node))
                && (nodes[*a][0] - nodes[*b][0]).abs() < SAME * self.length()
        };
        let width = self.geometry.width;
        self.sides(simulation).iter().any(upright).then(|| {
            format!(
                "[pile]: in plane strain the pile is held in x along its own line, as half of a wall on its plane of \
                 symmetry. Loads are those of the half, and criteria use its width of {width} m; `diameter = {}` is \
                 the full width. A round pile needs `analysis = \"axisymmetric\"`",
                2.0 * width
            )
        })
    }
}

/// With one digit.
fn rounded(value: f64) -> String {
    let unit = 10_f64.powf(value.log10().floor());
    format!("{:.0e}", (value / unit).round() * unit)
}
