//! Excerpts: elements that results need from groups that they do not need otherwise, such as those at a pile's head and
//! toe. They are brought to the latest state, and taken back to the complete one before their groups follow as a whole.
//!
//! For a complete state residuals are checked against the tolerance and displacements corrected; the state of an
//! excerpt follows from the boundary alone.

use super::probed_part::{Goal, Part};
use super::{CheckedPoints, LinearDomain, Standing};
use crate::element::Kinematics;
use crate::equilibrium::newton::norm;
use crate::group::{Excerpted, Group};
use serde::{Deserialize, Serialize};

/// Completing the state takes as long as updating their groups in this many increments.
const FEW: usize = 10;

/// Some elements of one group.
#[derive(Debug)]
pub(super) struct Excerpt {
    group: usize,
    elements: Vec<usize>,
    kinematics: Box<dyn Kinematics>,
}

/// Elements that are in the latest state.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Ahead {
    /// Increments since the complete state.
    increments: usize,
    /// Numbers of their groups, and theirs there.
    elements: Vec<(usize, Vec<usize>)>,
    /// What they had in the complete state.
    complete: Vec<Excerpted>,
}

impl Excerpt {
    /// `None` if the group can only be had as a whole.
    pub(super) fn new(number: usize, group: &Group, elements: &[usize]) -> Option<Self> {
        let kinematics = group.excerpt(elements)?;
        Some(Self {
            group: number,
            elements: elements.to_vec(),
            kinematics,
        })
    }

    /// Degrees of freedom of its elements; most of them several times.
    pub(super) fn dofs(&self) -> impl Iterator<Item = usize> {
        let elements = 0..self.elements.len();
        let nodes = elements.flat_map(|element| self.kinematics.nodes(element));
        nodes.flat_map(|node| [2 * node, 2 * node + 1])
    }

    fn is_of(&self, (group, elements): &(usize, Vec<usize>)) -> bool {
        self.group == *group && self.elements == *elements
    }
}

impl Part {
    /// Whether its excerpts are those of the latest state.
    pub(super) fn is_ahead(&self, standing: &Standing) -> bool {
        let ahead = standing.excerpt.as_ref();
        let elements = ahead.map_or(&[][..], |ahead| &ahead.elements);
        let mut pairs = self.excerpts.iter().zip(elements);
        self.excerpts.len() == elements.len() && pairs.all(|(excerpt, ahead)| excerpt.is_of(ahead))
    }
}

impl LinearDomain {
    /// Whether excerpts may go further ahead: as long as rounding of the motion since the complete state, in which the
    /// rest of their groups waits, stays below the tolerance. Otherwise the state has to be completed; and where that
    /// would be so again soon, their groups follow as a whole from then on.
    pub(super) fn may_go_ahead(&mut self, looked_at: &CheckedPoints<'_>, goal: &Goal<'_>) -> bool {
        if self.standing.as_groups || looked_at.elements.iter().all(Vec::is_empty) {
            return true;
        }
        let scale = norm(&self.standing.forces).max(goal.loads.scale);
        let rounded = self.rounded() > goal.tolerance * scale;
        let ahead = self.standing.excerpt.as_ref();
        let increments = ahead.map_or(0, |ahead| ahead.increments);
        self.standing.as_groups |= rounded && increments < FEW;
        !rounded
    }

    /// Moves a part's excerpts on by displacement increments since the latest state, by degree of freedom; their
    /// forces are added to the `internal` ones.
    pub(super) fn go_ahead(
        &mut self,
        part: &Part,
        groups: &mut [Group],
        increment: &[f64],
        internal: &mut [f64],
    ) {
        if part.excerpts.is_empty() {
            return;
        }
        if let Some(ahead) = &mut self.standing.excerpt {
            ahead.increments += 1;
        } else {
            let of_excerpt = |excerpt: &Excerpt| {
                let complete = groups[excerpt.group].excerpted(&excerpt.elements);
                ((excerpt.group, excerpt.elements.clone()), complete)
            };
            let (elements, complete) = part.excerpts.iter().map(of_excerpt).unzip();
            self.standing.excerpt = Some(Ahead {
                increments: 1,
                elements,
                complete,
            });
        }
        let mut forces = vec![0.0; internal.len()];
        for excerpt in &part.excerpts {
            let group = &mut groups[excerpt.group];
            let kinematics = excerpt.kinematics.as_ref();
            group.move_excerpt((&excerpt.elements, kinematics), increment, &mut forces);
        }
        self.system.fold(&mut forces);
        for (internal, force) in internal.iter_mut().zip(forces) {
            *internal += force;
        }
    }

    /// Takes all excerpts back to the complete state.
    pub(super) fn go_back(&mut self, groups: &mut [Group]) {
        if let Some(ahead) = self.standing.excerpt.take() {
            for ((group, elements), complete) in ahead.elements.iter().zip(&ahead.complete) {
                groups[*group].put_excerpted(elements, complete);
            }
        }
    }
}
