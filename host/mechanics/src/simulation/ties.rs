//! Displacements that are tied in a phase: at faces of absent interfaces and on rigid lines.

use super::Simulation;
use super::loads::{Prescribed, part};
use crate::assembly::Tie;
use crate::check::{Cause, Item, Refusal};
use crate::error::Error;
use crate::problem::tied_dofs::TiedDofs;

use std::collections::{HashMap, HashSet};

/// Two prescribed displacements that differ by less, as a fraction of the larger, are the same.
const SAME: f64 = 1e-12;
/// Nodes that stood further apart, as a fraction of the way to the one place they are led to and of the mesh's longer
/// side, are worth a word.
const APART: [f64; 2] = [1e-2, 1e-6];

/// What follows from what.
pub(super) struct Tied {
    pub(super) ties: Vec<Tie>,
    /// Prescribed displacements, with those that follow from them.
    pub(super) prescribed: Vec<Prescribed>,
    /// Those that follow from them, and from which: what holds one of them holds it for all.
    pub(super) led: Vec<Tie>,
    /// The most by which nodes stand apart that are led to one place, m, and a node where they do, if it is much.
    pub(super) apart: Option<(f64, [f64; 2])>,
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

    /// Ties of a phase whose own prescribed displacements these are. If one of several displacements that move alike is
    /// prescribed, all are. They get the same increment or, if nodes apart are prescribed to one place, move to that
    /// place.
    ///
    /// # Errors
    /// Two of them are prescribed to move differently, and not to one place.
    pub(super) fn tied_in(
        &self,
        number: usize,
        mut prescribed: Vec<Prescribed>,
    ) -> Result<Tied, Error> {
        let alike = TiedDofs::in_phase(&self.problem, number);
        let held = alike.still.clone();
        let own: HashMap<usize, [f64; 2]> = prescribed
            .iter()
            .map(|&(dof, start, end)| (dof, [start, end]))
            .collect();
        let layers: HashMap<usize, [(usize, f64); 2]> =
            self.ties.iter().map(|tie| (tie.dof, tie.masters)).collect();
        let (mut ties, mut led, mut apart) = (Vec::new(), Vec::new(), None);
        let mut follows: HashMap<usize, usize> = HashMap::new();
        for members in alike.classes() {
            let moves = |dof: &usize| {
                let still = held.contains(dof).then(|| [self.displacement[*dof]; 2]);
                own.get(dof).copied().or(still)
            };
            let given: Vec<[f64; 2]> = members.iter().filter_map(moves).collect();
            if let Some(&[start, end]) = given.first() {
                let differs = |a: f64, b: f64| (a - b).abs() > SAME * a.abs().max(b.abs());
                let increment = end - start;
                let others = given.iter().map(|[start, end]| end - start);
                let other = others.clone().find(|&other| differs(increment, other));
                if let Some(other) = other {
                    let at = self.problem.mesh.nodes[members[0] / 2];
                    if given.iter().any(|&[_, to]| differs(end, to)) {
                        let cause = Cause::MovesAlike(at, [increment, other]);
                        return Err(Refusal::new(Item::Phase(number), cause).into());
                    }
                    let most = others.clone().fold(0.0, |most: f64, by| most.max(by.abs()));
                    let off = others.fold(0.0, |off: f64, by| off.max((by - increment).abs()));
                    let least = APART[1] * self.problem.mesh.longer_side();
                    if off > least.max(APART[0] * most) && apart.is_none_or(|(by, _)| off > by) {
                        apart = Some((off, at));
                    }
                }
                let leader = members.iter().copied().find(|dof| own.contains_key(dof));
                for &dof in members.iter().filter(|dof| !own.contains_key(dof)) {
                    let from = self.displacement[dof];
                    // Where they stand apart and are led to one place, all go there.
                    let to = other.map_or(from + increment, |_| end);
                    prescribed.push((dof, from, to));
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
            apart,
        })
    }

    /// Before the first phase: follows the phases as far as it is known beforehand where displacements stand, which
    /// is where something prescribes them.
    ///
    /// # Errors
    /// Tied displacements are prescribed to different values.
    pub(super) fn check_alike(&mut self) -> Result<(), Error> {
        let before = self.prescribed.clone();
        let outcome = self.follow_alike();
        self.prescribed = before;
        self.displacement.fill(0.0);
        outcome
    }

    fn follow_alike(&mut self) -> Result<(), Error> {
        let mut is_known = vec![true; self.displacement.len()];
        for number in 0..self.problem.phases.len() {
            let phase = &self.problem.phases[number];
            let factor = phase.course.last().map_or(1.0, |&[_, factor]| factor);
            if phase.reset_displacements {
                is_known.fill(true);
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
}
