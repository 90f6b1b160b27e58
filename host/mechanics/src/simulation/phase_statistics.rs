//! What a phase took.

use super::Neighbour;
use crate::equilibrium::{Costs, Open};
use crate::settings::Method;
use serde::{Deserialize, Serialize};

/// A phase, for the record.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct PhaseRecord {
    /// Name.
    pub name: String,
    /// Which matrix the iterations used.
    pub method: Method,
    /// Unknowns.
    pub equations: usize,
    /// Forces out of balance at its start, relative to the forces in play.
    pub out_of_balance: f64,
    /// Increments that reached equilibrium.
    pub increments: usize,
    /// Iterations of these, failed attempts included.
    pub iterations: usize,
    /// Steps repeated with a smaller length.
    pub cut_backs: usize,
    /// Where two halves of a step lead in an increment that was cut: of the first one whose halves lead elsewhere, or
    /// the last one tried.
    pub in_halves: Option<Neighbour>,
    /// Steps that were tried in two halves.
    pub halved: usize,
    /// Steps with results that a law calls inaccurate.
    pub unreliable: usize,
    /// Steps that a motion led to equilibrium: viscous relaxation, or viscous control.
    pub relaxed: usize,
    /// Those of them that viscous control did.
    #[serde(default)]
    pub viscous: usize,
    /// Steps that regularised corrections led to equilibrium.
    #[serde(default)]
    pub regularised: usize,
    /// Steps whose residual was tolerated above the tolerance.
    pub tolerated: usize,
    /// The largest of these residuals, relative.
    pub tolerated_residual: f64,
    /// The same as a force: 2-norm over the nodes of a body, in the units of the case.
    pub tolerated_force: f64,
    /// The largest force that a step left out of balance: 2-norm over the nodes of a body, in the units of the case.
    #[serde(default)]
    pub residual_force: f64,
    /// Steps whose last correction is above its tolerance: the residual alone decided.
    pub by_force: usize,
    /// The most that they left open.
    pub open: Open,
    /// Largest relative residual that was taken for round-off in the steps' iterations.
    pub round_off: f64,
    /// Largest last correction, relative to its increment, of steps whose residual is within its tolerance, and
    /// round-off, and whose corrections are above theirs.
    #[serde(default)]
    pub unsettled: f64,
    /// Steps along the path of equilibrium under arc-length control.
    pub arc_length: usize,
    /// The first increment, from 1, in which viscous control led under `auto`, as steps by the load found no
    /// equilibrium.
    pub viscous_from: Option<usize>,
    /// The first increment, from 1, in which viscous control led by single corrections, as nothing else found an
    /// equilibrium.
    #[serde(default)]
    pub singly_from: Option<usize>,
    /// Matrices factorised.
    pub factorisations: u64,
    /// How many of them needed full row exchanges.
    pub fallbacks: u64,
    /// Costs by part.
    pub costs: Costs,
}

impl PhaseRecord {
    /// A phase that begins.
    pub fn new(name: &str, equations: usize, out_of_balance: f64) -> Self {
        Self {
            name: name.to_owned(),
            equations,
            out_of_balance,
            ..Self::default()
        }
    }
}
