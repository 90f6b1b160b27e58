//! Results beyond what the theory of small strains, or any material, covers. They are computed all
//! the same, and said.

use crate::check::plausibility::{LARGE, implausible_stiffness};
use crate::element::depth;
use crate::group::Group;
use crate::mesh::Mesh;
use crate::problem::{Analysis, Formulation};
use std::collections::HashSet;

/// Share of the bodies' area that may be strained more than that: at a corner such as a pile's toe
/// strains grow without bound as elements shrink, over an area that vanishes.
const SHARE: f64 = 0.01;

/// An element moves in a mode that its 2 × 2 points do not see if its strain is this many times the
/// strain at the points.
const UNSEEN: f64 = 10.0;
/// And at least this fraction of the largest strain of all.
const WORTH: f64 = 0.1;

/// The worst of a run so far.
#[derive(Debug, Default)]
pub(super) struct Validity {
    /// Share of the bodies' area with large strains, and the largest strain, with group and place.
    strained: Option<(f64, f64, String, [f64; 2])>,
    /// Largest displacement, and the longer side of the mesh.
    moved: Option<[f64; 2]>,
    /// Largest jump by the length of its interface, with both and the group.
    slipped: Option<(f64, [f64; 2], String)>,
    /// Elements that move in a way that no point sees: how many, and group and place of the worst, with
    /// the strain there.
    unseen: Option<(usize, f64, String, [f64; 2])>,
    /// Laws whose stiffness has been looked at.
    known: HashSet<String>,
    /// Warnings about them.
    stiffness: Vec<String>,
}

impl Validity {
    /// Looks at a state of equilibrium.
    pub(super) fn look(
        &mut self,
        mesh: &Mesh,
        analysis: Analysis,
        groups: &[Group],
        displacement: &[f64],
    ) {
        self.strains(analysis, groups);
        self.displacements(mesh, displacement);
        self.mechanisms(mesh, groups, displacement);
        for group in groups {
            if group.formulation != Formulation::Solid {
                self.jumps(analysis, group);
            } else if self.known.insert(group.law.name.clone()) {
                // Linear laws that are there from the start were looked at before it.
                self.stiffness.extend(implausible_stiffness(group));
            }
        }
    }

    /// Laws that are not to be spoken of again.
    pub(super) fn knows(&mut self, groups: &[Group]) {
        let linear = groups.iter().filter(|group| group.is_linear());
        self.known
            .extend(linear.map(|group| group.law.name.clone()));
    }

    fn strains(&mut self, analysis: Analysis, groups: &[Group]) {
        let (mut area, mut strained) = (0.0, 0.0);
        let mut largest = (0.0, "", [0.0; 2]);
        // The largest principal strain, whatever the axes.
        let principal = |e: &[f64]| {
            let (mean, radius) = (
                f64::midpoint(e[0], e[1]),
                f64::hypot((e[0] - e[1]) / 2.0, e[3] / 2.0),
            );
            (mean.abs() + radius).max(e[2].abs())
        };
        let solids = groups
            .iter()
            .filter(|g| g.formulation == Formulation::Solid);
        let of_group = |group: &Group| {
            // No principal strain is larger than one and a half times the largest component.
            let may_be = |e: &[f64]| e.iter().any(|value| value.abs() > LARGE / 2.0);
            let mut strains = group.strain.committed.chunks_exact(4);
            strains.any(|e| may_be(e) && principal(e) > LARGE)
        };
        if !solids.clone().any(of_group) {
            return;
        }
        for group in solids {
            for (point, e) in group.strain.committed.chunks_exact(4).enumerate() {
                let position = group.kinematics.position(point);
                let own = group.kinematics.weight(point) / depth(analysis, position[0]);
                let strain = principal(e);
                area += own;
                if strain > LARGE {
                    strained += own;
                }
                if strain > largest.0 {
                    largest = (strain, group.name.as_str(), position);
                }
            }
        }
        let (strain, group, position) = largest;
        if strained > self.strained.as_ref().map_or(0.0, |worst| worst.0 * area) {
            self.strained = Some((strained / area, strain, group.to_owned(), position));
        }
    }

    /// Quads with 2 × 2 points have a motion without strain at any of them: along the element's own axes
    /// ξ, η, u_ξ = α ξ (3η² − 1), u_η = −α η (3ξ² − 1). Neighbours hold it, unless they join in.
    fn mechanisms(&mut self, mesh: &Mesh, groups: &[Group], displacement: &[f64]) {
        let (mut largest, mut found) = (0.0, Vec::new());
        let solids = groups
            .iter()
            .filter(|g| g.formulation == Formulation::Solid);
        for group in solids.filter(|group| group.is_active) {
            let kinematics = &group.kinematics;
            for element in 0..kinematics.n_elements() {
                let (nodes, points) = (kinematics.nodes(element), kinematics.points_of(element));
                let strains = &group.strain.committed[4 * points.start..4 * points.end];
                let seen = strains.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
                largest = f64::max(largest, seen);
                if nodes.len() != 8 || points.len() != 4 {
                    continue;
                }
                let at = |i: usize| mesh.nodes[nodes[i]];
                let direction = |from: usize, to: usize| {
                    let step = [at(to)[0] - at(from)[0], at(to)[1] - at(from)[1]];
                    let length = step[0].hypot(step[1]);
                    (step.map(|part| part / length), length)
                };
                let ((xi, width), (eta, height)) = (direction(7, 5), direction(4, 6));
                let along = |axis: [f64; 2], i: usize| {
                    axis[0] * displacement[2 * nodes[i]] + axis[1] * displacement[2 * nodes[i] + 1]
                };
                // Of u_ξ the term ξη², a third of whose factor is α; of u_η the term ξ²η, likewise −α.
                let alpha = [(xi, [1, 2, 0, 3], [5, 7]), (eta, [2, 3, 1, 0], [6, 4])];
                let bends = alpha.map(|(axis, corners, middles)| {
                    let u = |i: usize| along(axis, i);
                    let ends = u(corners[0]) + u(corners[1]) - u(corners[2]) - u(corners[3]);
                    ends / 12.0 - (u(middles[0]) - u(middles[1])) / 6.0
                });
                let alpha = 0.5 * (bends[0] - bends[1]);
                let unseen = 4.0 * alpha.abs() / width.min(height);
                if unseen > UNSEEN * seen {
                    found.push((unseen, &group.name, kinematics.position(points.start)));
                }
            }
        }
        found.retain(|(unseen, ..)| *unseen > WORTH * largest);
        let worst = found.iter().max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(&(strain, name, at)) = worst
            && self
                .unseen
                .as_ref()
                .is_none_or(|known| found.len() > known.0)
        {
            self.unseen = Some((found.len(), strain, name.clone(), at));
        }
    }

    fn displacements(&mut self, mesh: &Mesh, displacement: &[f64]) {
        let side = mesh.longer_side();
        let largest = displacement.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
        if largest > LARGE * side && self.moved.is_none_or(|[worst, _]| largest > worst) {
            self.moved = Some([largest, side]);
        }
    }

    fn jumps(&mut self, analysis: Analysis, group: &Group) {
        let (mut length, mut largest) = (0.0, 0.0_f64);
        for point in 0..group.kinematics.n_points() {
            let Some((jump, _)) = group.jump_and_traction(point) else {
                return;
            };
            let [r, _] = group.kinematics.position(point);
            let thickness = group.thickness(point).unwrap_or(1.0);
            let around = depth(analysis, r);
            if around > 0.0 {
                length += group.kinematics.weight(point) / around / thickness;
            }
            largest = jump.iter().fold(largest, |m, j| m.max(j.abs()));
        }
        let ratio = largest / length;
        if ratio > LARGE && self.slipped.as_ref().is_none_or(|worst| ratio > worst.0) {
            self.slipped = Some((ratio, [largest, length], group.name.clone()));
        }
    }

    /// All there is to say.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut bodies = Vec::new();
        if let Some((share, strain, group, [x, y])) = &self.strained
            && *share > SHARE
        {
            bodies.push(format!(
                "{:.1} % of the bodies are strained by more than {LARGE}, group `{group}` at \
                 ({x:.4}, {y:.4}) by {strain:.3}",
                100.0 * share
            ));
        }
        if let Some([largest, side]) = self.moved {
            bodies.push(format!(
                "a node moves by {largest:.4} m, the model is {side:.4} m long"
            ));
        }
        let mut warnings = self.stiffness.clone();
        if let Some((count, strain, group, [x, y])) = &self.unseen {
            warnings.push(format!(
                "{count} quads with 2 × 2 points move in a way that no point sees, the worst in group \
                 `{group}` at ({x:.4}, {y:.4}) by strains of {strain:.1e}: a mechanism without stiffness. \
                 `integration = \"b_bar\"` or `\"full\"` resists it"
            ));
        }
        let bodies = bodies.into_iter();
        warnings.extend(bodies.map(|why| format!("beyond the theory of small strains: {why}")));
        if let Some((_, [jump, length], group)) = &self.slipped {
            warnings.push(format!(
                "beyond the theory of small displacements: the two sides of group `{group}` move \
                 against each other by {jump:.4} m, it is {length:.4} m long"
            ));
        }
        warnings
    }
}
