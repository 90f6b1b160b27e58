//! Stress with which interfaces appear in ground that carries loads.
//!
//! The stress at an interface is a mean of its neighbours' points. If that is not linear, its nodal forces differ from
//! those which the tied faces exchanged. So the tractions get the smallest change that restores balance: min Σ w |Δt|²
//! with Bᵀ w Δt = r, for the points' weights w and the residual r of the nodes. Then nothing moves when the interface
//! appears.

use super::Simulation;
use crate::assembly::{Tie, fold};
use crate::equilibrium::norm;
use crate::error::Error;
use crate::group::Group;

/// The iterations end when the gradient has fallen to this fraction.
const FOUND: f64 = 1e-14;
/// Most iterations. Few are needed: the equations are scaled, and each node has its own.
const MOST: usize = 500;

impl Simulation {
    /// Tractions to be added to interfaces that have just appeared, group by group, so that their nodes are in balance.
    /// Nothing if they already are, within the force tolerance.
    pub(super) fn lacking(
        &self,
        number: usize,
        appeared: &[usize],
    ) -> Result<Vec<Vec<f64>>, Error> {
        let appeared: Vec<&Group> = appeared.iter().map(|&group| &self.groups[group]).collect();
        let mut lacking = self.loading[0].forces(&self.problem, &self.groups);
        let mut internal = self.released.clone();
        for group in self.groups.iter().filter(|group| group.is_active) {
            group.kinematics.add_forces(&group.carried(), &mut internal);
        }
        let play = norm(&lacking).max(norm(&internal));
        let both = lacking.iter_mut().zip(&internal);
        both.for_each(|(lacking, internal)| *lacking -= internal);
        // Forces at held degrees of freedom are unknown.
        let held = self.prescribed.keys().map(|&dof| (dof, 0.0, 0.0)).collect();
        let tied = self.tied_in(number, held)?;
        let held: Vec<usize> = tied.prescribed.iter().map(|&(dof, ..)| dof).collect();
        let faces = Faces::new(&appeared, &tied.ties, &held, lacking.len());
        faces.fold(&mut lacking);
        if norm(&lacking) <= self.problem.settings.force_tolerance * play {
            return Ok(Vec::new());
        }
        faces.to_scale(&mut lacking);
        Ok(faces.tractions(lacking))
    }
}

/// Equations of the forces at the faces of some interfaces; tied degrees of freedom pass theirs to their masters.
struct Faces<'a> {
    groups: &'a [&'a Group],
    ties: &'a [Tie],
    /// Factor of the force at every degree of freedom; 0 where something holds it, or without a face.
    scale: Vec<f64>,
    /// Square roots of the weights of the points, by group.
    roots: Vec<Vec<f64>>,
}

impl<'a> Faces<'a> {
    fn new(groups: &'a [&'a Group], ties: &'a [Tie], held: &[usize], n_dofs: usize) -> Self {
        let mut area = vec![0.0; n_dofs];
        for group in groups {
            let kinematics = &group.kinematics;
            for element in 0..kinematics.n_elements() {
                let points = kinematics.points_of(element);
                let weight: f64 = points.map(|point| kinematics.weight(point)).sum();
                for node in kinematics.nodes(element) {
                    area[2 * node] += weight;
                    area[2 * node + 1] += weight;
                }
            }
        }
        fold(ties, &mut area);
        for &dof in held {
            area[dof] = 0.0;
        }
        let scale = area.into_iter();
        let scale = scale.map(|area| if area > 0.0 { 1.0 / area.sqrt() } else { 0.0 });
        let roots = groups.iter().map(|group| {
            let points = 0..group.kinematics.n_points();
            points
                .map(|point| group.kinematics.weight(point).sqrt())
                .collect()
        });
        Self {
            groups,
            ties,
            scale: scale.collect(),
            roots: roots.collect(),
        }
    }

    /// Leaves the forces that the faces have to carry.
    fn fold(&self, force: &mut [f64]) {
        fold(self.ties, force);
        let both = force.iter_mut().zip(&self.scale);
        both.filter(|(_, scale)| **scale == 0.0)
            .for_each(|(force, _)| *force = 0.0);
    }

    /// Scales forces to right-hand sides of the equations.
    fn to_scale(&self, force: &mut [f64]) {
        let both = force.iter_mut().zip(&self.scale);
        both.for_each(|(force, scale)| *force *= scale);
    }

    /// Tractions times or over the roots of their points' weights.
    fn weighted(&self, tractions: &mut [Vec<f64>], by: impl Fn(f64) -> f64) {
        for (tractions, roots) in tractions.iter_mut().zip(&self.roots) {
            for (traction, &root) in tractions.chunks_exact_mut(2).zip(roots) {
                let factor = by(root);
                for t in traction {
                    *t *= factor;
                }
            }
        }
    }

    /// Left-hand sides: forces of weighted tractions.
    fn forces_of(&self, weighted: &[Vec<f64>]) -> Vec<f64> {
        let mut tractions = weighted.to_vec();
        self.weighted(&mut tractions, f64::recip);
        let mut force = vec![0.0; self.scale.len()];
        for (group, tractions) in self.groups.iter().zip(&tractions) {
            group.kinematics.add_forces(tractions, &mut force);
        }
        self.fold(&mut force);
        self.to_scale(&mut force);
        force
    }

    /// The transpose of [`Self::forces_of`].
    fn jumps_of(&self, equations: &[f64]) -> Vec<Vec<f64>> {
        let both = equations.iter().zip(&self.scale);
        let mut displacement: Vec<f64> = both.map(|(value, scale)| value * scale).collect();
        for tie in self.ties {
            let masters = tie.masters.iter();
            displacement[tie.dof] = masters.map(|&(dof, w)| w * displacement[dof]).sum();
        }
        let jumps = self.groups.iter().map(|group| {
            let mut jumps = vec![0.0; 2 * group.kinematics.n_points()];
            group.kinematics.add_gradients(&displacement, &mut jumps);
            jumps
        });
        let mut jumps: Vec<Vec<f64>> = jumps.collect();
        self.weighted(&mut jumps, |root| root);
        jumps
    }

    /// The least tractions with these forces, or with those nearest to them: conjugate gradients on the normal
    /// equations (Hestenes & Stiefel 1952, Björck's CGLS).
    fn tractions(&self, mut rest: Vec<f64>) -> Vec<Vec<f64>> {
        let mut found: Vec<Vec<f64>> = self.roots.iter().map(|r| vec![0.0; 2 * r.len()]).collect();
        let mut gradient = self.jumps_of(&rest);
        let mut direction = gradient.clone();
        let mut size = square(&gradient);
        let enough = size * FOUND * FOUND;
        for _ in 0..MOST {
            if size <= enough || size == 0.0 {
                break;
            }
            let forces = self.forces_of(&direction);
            let step = size / forces.iter().map(|force| force * force).sum::<f64>();
            add(&mut found, step, &direction);
            let both = rest.iter_mut().zip(&forces);
            both.for_each(|(rest, force)| *rest -= step * force);
            gradient = self.jumps_of(&rest);
            let next = square(&gradient);
            let kept = next / size;
            size = next;
            let mut turned = gradient.clone();
            add(&mut turned, kept, &direction);
            direction = turned;
        }
        self.weighted(&mut found, f64::recip);
        found
    }
}

fn square(values: &[Vec<f64>]) -> f64 {
    values.iter().flatten().map(|value| value * value).sum()
}

fn add(to: &mut [Vec<f64>], factor: f64, values: &[Vec<f64>]) {
    let both = to.iter_mut().flatten().zip(values.iter().flatten());
    both.for_each(|(to, value)| *to += factor * value);
}
