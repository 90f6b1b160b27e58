//! Displacements that are one in a phase: faces of interfaces that are not there, lines that are rigid.

use super::Simulation;
use super::loads::{Prescribed, part};
use crate::assembly::Tie;
use crate::error::Error;
use crate::problem::{Analysis, Cause, Item, Refusal};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

/// A node is on the axis of symmetry within this fraction of the mesh's longer side.
const ON_AXIS: f64 = 1e-9;
/// Two prescribed increments that differ by less, as a fraction of the larger, are the same.
const SAME: f64 = 1e-12;

/// What follows from what.
pub(super) struct Tied {
    pub(super) ties: Vec<Tie>,
    /// Prescribed displacements, with those that follow from them.
    pub(super) prescribed: Vec<Prescribed>,
    /// Those that follow from them, and from which: what holds one of them holds it for all.
    pub(super) led: Vec<Tie>,
}

impl Simulation {
    /// Nodes whose forces may be counted at some of these in one phase or another: these, those that follow them, the
    /// other faces of interfaces, the rest of rigid lines.
    pub fn gathering(&self, nodes: &[usize]) -> HashSet<usize> {
        let mesh = &self.problem.mesh;
        let faces = mesh.joints.iter().flat_map(|joint| {
            let pairs = joint.minus.iter().zip(&joint.plus);
            pairs.map(|(&minus, &plus)| vec![minus, plus])
        });
        let phases = self.problem.phases.iter();
        let rigid = phases.flat_map(|phase| &phase.rigid);
        let rigid = rigid.filter_map(|line| Some(mesh.lines.get(line)?.nodes.clone()));
        let mut alike: Vec<Vec<usize>> = faces.chain(rigid).collect();
        let mut found: HashSet<usize> = nodes.iter().copied().collect();
        loop {
            let before = found.len();
            for tie in &self.ties {
                let masters = tie.masters.iter();
                if masters.map(|(dof, _)| dof / 2).any(|n| found.contains(&n)) {
                    found.insert(tie.dof / 2);
                }
            }
            alike.retain(|nodes| {
                let is_met = nodes.iter().any(|node| found.contains(node));
                if is_met {
                    found.extend(nodes);
                }
                !is_met
            });
            if found.len() == before {
                return found;
            }
        }
    }

    /// Ties of a phase whose own prescribed displacements these are. Where one of some displacements that
    /// move alike is prescribed, all are.
    ///
    /// # Errors
    /// Two of them are prescribed to move differently.
    pub(super) fn tied_in(
        &self,
        number: usize,
        mut prescribed: Vec<Prescribed>,
    ) -> Result<Tied, Error> {
        let mut alike = Alike::default();
        for joint in &self.problem.mesh.joints {
            if !self.groups[joint.group].is_active {
                for (&minus, &plus) in joint.minus.iter().zip(&joint.plus) {
                    for c in 0..2 {
                        alike.join(2 * minus + c, 2 * plus + c);
                    }
                }
            }
        }
        let mut held = Vec::new();
        for line in self.rigid_in(number) {
            let nodes = self
                .problem
                .mesh
                .lines
                .get(line)
                .map(|line| &line.nodes[..]);
            let nodes = nodes.unwrap_or_default();
            let axis = ON_AXIS * self.problem.mesh.longer_side();
            let is_on_axis = |&node: &usize| self.problem.mesh.nodes[node][0] <= axis;
            let reaches_axis =
                self.problem.analysis == Analysis::Axisymmetric && nodes.iter().any(is_on_axis);
            for pair in nodes.windows(2) {
                alike.join(2 * pair[0], 2 * pair[1]);
                alike.join(2 * pair[0] + 1, 2 * pair[1] + 1);
            }
            if reaches_axis {
                held.extend(nodes.iter().map(|node| 2 * node));
            }
        }
        let own: HashMap<usize, f64> = prescribed
            .iter()
            .map(|&(dof, start, end)| (dof, end - start))
            .collect();
        let layers: HashMap<usize, [(usize, f64); 2]> =
            self.ties.iter().map(|tie| (tie.dof, tie.masters)).collect();
        let (mut ties, mut led) = (Vec::new(), Vec::new());
        let mut follows: HashMap<usize, usize> = HashMap::new();
        for members in alike.classes() {
            let moves = |dof: &usize| {
                let still = held.contains(dof).then_some(0.0);
                own.get(dof).copied().or(still)
            };
            let given: Vec<f64> = members.iter().filter_map(moves).collect();
            if let Some(&increment) = given.first() {
                let differs = |other: &&f64| {
                    (**other - increment).abs() > SAME * increment.abs().max(other.abs())
                };
                if let Some(&other) = given.iter().find(differs) {
                    let at = self.problem.mesh.nodes[members[0] / 2];
                    let cause = Cause::MovesAlike(at, [increment, other]);
                    return Err(Refusal::new(Item::Phase(number), cause).into());
                }
                let leader = members.iter().copied().find(|dof| own.contains_key(dof));
                for &dof in members.iter().filter(|dof| !own.contains_key(dof)) {
                    let start = self.displacement[dof];
                    prescribed.push((dof, start, start + increment));
                    led.extend(leader.map(|leader| Tie::alike(dof, leader)));
                }
                continue;
            }
            // A node in the middle of a layer follows its faces, and the others follow it.
            let root = members.iter().copied().find(|dof| layers.contains_key(dof));
            let root = root.unwrap_or(members[0]);
            for &dof in members.iter().filter(|&&dof| dof != root) {
                follows.insert(dof, root);
                let masters = layers.get(&root).copied();
                ties.push(match masters {
                    Some(masters) => Tie { dof, masters },
                    None => Tie::alike(dof, root),
                });
            }
        }
        // Faces of layers that follow others themselves.
        for tie in &self.ties {
            let masters = tie
                .masters
                .map(|(dof, weight)| (*follows.get(&dof).unwrap_or(&dof), weight));
            if !follows.contains_key(&tie.dof) {
                ties.push(Tie {
                    dof: tie.dof,
                    masters,
                });
            }
        }
        prescribed.sort_unstable_by_key(|(dof, ..)| *dof);
        Ok(Tied {
            ties,
            prescribed,
            led,
        })
    }

    /// Before the first phase: follows the phases as far as it is known beforehand where displacements stand, which
    /// is where something prescribes them.
    ///
    /// # Errors
    /// What moves alike is prescribed to move differently.
    pub(super) fn check_alike(&mut self) -> Result<(), Error> {
        let before = self.prescribed.clone();
        let outcome = self.follow_alike();
        self.prescribed = before;
        self.displacement.fill(0.0);
        for (group, input) in self.groups.iter_mut().zip(&self.problem.groups) {
            group.is_active = input.is_active;
        }
        outcome
    }

    fn follow_alike(&mut self) -> Result<(), Error> {
        let mut is_known = vec![true; self.displacement.len()];
        // Directions of rigid lines whose nodes may stand apart.
        let mut apart: BTreeSet<(String, usize)> = BTreeSet::new();
        for number in 0..self.problem.phases.len() {
            let phase = &self.problem.phases[number];
            let factor = phase.course.last().map_or(1.0, |&[_, factor]| factor);
            for (groups, is_active) in [(&phase.activate, true), (&phase.deactivate, false)] {
                for &group in groups {
                    self.groups[group].is_active = is_active;
                }
            }
            if phase.reset_displacements {
                is_known.fill(true);
                apart.clear();
            }
            let standing: Vec<_> = self.displacement.iter().zip(&is_known).collect();
            for (line, c) in phase.rigid.iter().flat_map(|line| [(line, 0), (line, 1)]) {
                let nodes = &self.problem.mesh.lines[line].nodes;
                let mut standing = nodes.iter().map(|node| standing[2 * node + c]);
                let first = standing.next();
                let is_level = |is: (&f64, &bool)| *is.1 && Some(is) == first;
                if !phase.reset_displacements && !standing.all(is_level) {
                    apart.insert((line.clone(), c));
                }
            }
            for (line, c) in &apart {
                let nodes = &self.problem.mesh.lines[line].nodes;
                let given = phase
                    .displacement
                    .iter()
                    .filter(|given| [given.x, given.y][*c].is_some());
                let lines = given.map(|given| &self.problem.mesh.lines[&given.line].nodes);
                let moved: HashSet<&usize> = lines.flatten().collect();
                if nodes.iter().filter(|node| moved.contains(node)).count() > 1 {
                    self.warnings.push(format!(
                        "phase `{}` leads line `{line}` to one displacement, and before that line became rigid its \
                         nodes may have moved apart: the run ends there if they have. `reset_displacements` in this \
                         phase counts from where they stand",
                        phase.name
                    ));
                }
            }
            self.prescribe(number);
            let known = self.prescribed.iter().filter(|(dof, _)| is_known[**dof]);
            let known = known.map(|(&dof, &end)| (dof, self.displacement[dof], end));
            let tied = self.tied_in(number, known.collect())?;
            let mut ends: Vec<(usize, f64)> = tied
                .prescribed
                .iter()
                .filter(|(dof, ..)| is_known[*dof])
                .map(|&(dof, start, end)| (dof, part(factor, start, end)))
                .collect();
            if factor.to_bits() == 1.0_f64.to_bits() {
                ends.extend(self.prescribed.iter().map(|(&dof, &end)| (dof, end)));
            }
            is_known.fill(false);
            for (dof, end) in ends {
                is_known[dof] = true;
                self.displacement[dof] = end;
                if let Some(value) = self.prescribed.get_mut(&dof) {
                    *value = end;
                }
            }
        }
        Ok(())
    }

    /// Lines that are rigid in a phase: those that it or an earlier one names.
    fn rigid_in(&self, number: usize) -> impl Iterator<Item = &String> {
        self.problem.phases[..=number]
            .iter()
            .flat_map(|phase| &phase.rigid)
    }
}

/// Degrees of freedom that move alike.
#[derive(Default)]
struct Alike {
    root: BTreeMap<usize, usize>,
}

impl Alike {
    fn find(&mut self, dof: usize) -> usize {
        let above = *self.root.entry(dof).or_insert(dof);
        if above == dof {
            return dof;
        }
        let top = self.find(above);
        self.root.insert(dof, top);
        top
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.root.insert(a.max(b), a.min(b));
    }

    /// Those of more than one, members ascending.
    fn classes(mut self) -> Vec<Vec<usize>> {
        let dofs: Vec<usize> = self.root.keys().copied().collect();
        let mut classes: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for dof in dofs {
            classes.entry(self.find(dof)).or_default().push(dof);
        }
        classes
            .into_values()
            .filter(|members| members.len() > 1)
            .collect()
    }
}
