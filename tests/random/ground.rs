//! Ground posed in memory: layers at rest under water or above it, loaded, dug away and filled again, with
//! an interface or without. At rest nothing moves; whatever happens then, reactions carry what is on
//! them; in another unit of stress, and in the mirror, the same happens.

mod posed;

use crate::seeds::{End, hold};
use mechanics::check::Cause;
use mechanics::problem::{Analysis, Integration};
use mechanics::{Error, Simulation};
use posed::Posed;
use proptest::prelude::*;

/// Height of the ground, m; it has two layers, in the upper one stands a block.
const HEIGHT: f64 = 4.0;
const LAYER: f64 = 2.0;
const BLOCK: f64 = 1.0;
const WIDTH: f64 = 4.0;
const WATER: f64 = 9.81;
/// Groups.
const LOWER: usize = 0;
const UPPER: usize = 1;
const PILE: usize = 2;
const SKIN: usize = 3;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Change {
    /// kPa on the surface next to the block.
    Pressure(f64),
    /// kN on the block's head, which is rigid from then on.
    Force(f64),
    /// m of the block's head, which is rigid from then on if there are several increments.
    Push(f64),
    /// The water table, parts of the height.
    Water(f64),
    /// All above the lower layer goes, with the interface; or comes back.
    Dig,
    Fill,
    /// The block becomes another material, and heavier.
    Swap,
    /// The interface comes.
    Skin,
    /// The lower layer drains, or does not.
    Drain(bool),
}

#[expect(clippy::struct_excessive_bools, reason = "each is drawn by itself")]
#[derive(Clone, Debug)]
struct Ground {
    is_axisymmetric: bool,
    are_triangles: bool,
    is_skewed: bool,
    /// Columns of the block and next to it, rows of each layer.
    n: [usize; 3],
    integration: Option<Integration>,
    is_plastic: bool,
    /// Unit weights of the layers above and below the water.
    weights: [[f64; 2]; 2],
    at_rest: [usize; 2],
    /// Water table, parts of the height.
    water: Option<f64>,
    has_skin: bool,
    changes: Vec<(Change, usize)>,
}

impl Ground {
    fn analysis(&self) -> Analysis {
        if self.is_axisymmetric {
            Analysis::Axisymmetric
        } else {
            Analysis::PlaneStrain
        }
    }

    /// Area of a piece of a level, m² (plane strain: by 1 m).
    fn area(&self, from: f64, to: f64) -> f64 {
        if self.is_axisymmetric {
            std::f64::consts::PI * (to * to - from * from)
        } else {
            to - from
        }
    }

    /// Load on the bottom at the end of a phase, kN; the first is that of rest. For the pushed head
    /// see the reactions.
    fn on_bottom(&self, phase: usize) -> f64 {
        let (mut pressure, mut force, mut level) = (0.0, 0.0, self.water);
        let (mut is_there, mut pile) = (true, self.weights[1]);
        for (change, _) in &self.changes[..phase] {
            match *change {
                Change::Pressure(value) => pressure = value,
                Change::Force(value) => force = value,
                Change::Water(part) => level = Some(part),
                Change::Dig => is_there = false,
                Change::Fill => is_there = true,
                Change::Swap => pile = [24.0; 2],
                _ => {}
            }
        }
        let table = level.map_or(0.0, |part| part * HEIGHT);
        let weight = |[dry, wet]: [f64; 2], from: f64, to: f64| {
            let under = table.clamp(from, to);
            wet * (under - from) + dry * (to - under)
        };
        let (block, beside) = (self.area(0.0, BLOCK), self.area(BLOCK, WIDTH));
        let top = if is_there { HEIGHT } else { LAYER };
        let lower = weight(self.weights[0], 0.0, LAYER) + WATER * (table - top).max(0.0);
        let mut sum = lower * (block + beside);
        if is_there {
            sum += weight(self.weights[1], LAYER, HEIGHT) * beside;
            sum += weight(pile, LAYER, HEIGHT) * block;
        }
        sum + pressure * beside + force
    }

    /// Whether a water table stands inside elements that are no rectangles, where K_0 σ'_v bends.
    fn bends(&self) -> bool {
        let height = LAYER / self.n[2] as f64;
        let inside = self.water.is_some_and(|part| {
            let rows = part * HEIGHT / height;
            part < 1.0 && (rows - rows.round()).abs() > 1e-9
        });
        inside && (self.is_skewed || self.are_triangles)
    }

    fn check(&self) -> Result<End, String> {
        let plain = Posed {
            unit: 1.0,
            is_mirrored: false,
        };
        let Ok(own) = self.run(plain)? else {
            return Ok(End::Stopped);
        };
        let mut others = vec![Posed {
            unit: 1e-3,
            ..plain
        }];
        // Triangles of the mirror lie along the other diagonal.
        if !self.is_axisymmetric && !self.are_triangles {
            others.push(Posed {
                is_mirrored: true,
                ..plain
            });
        }
        for other in others {
            let found = match self.run(other)? {
                Ok(heads) => heads,
                // What comes to a standstill close to collapse may not in other bits.
                Err(_) if self.is_plastic => continue,
                Err(why) => return Err(format!("in other units or the mirror: {why}")),
            };
            let largest = own.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
            let most = if self.is_plastic { 2e-2 } else { 1e-6 };
            for (a, b) in own.iter().zip(&found) {
                if (a - b).abs() > most * largest + 1e-12 {
                    return Err(format!(
                        "unit {}, mirrored {}: {a:e} becomes {b:e}",
                        other.unit, other.is_mirrored
                    ));
                }
            }
        }
        Ok(End::Done)
    }

    /// Settlements of the head after each phase; or why none exist.
    fn run(&self, posed: Posed) -> Result<Result<Vec<f64>, String>, String> {
        let fails = |error: Error| match &error {
            // Weight tilts a head before it is rigid: that is no reason not to push it.
            Error::Refused(refusal) if matches!(refusal.cause, Cause::MovesAlike(..)) => {
                Err(error.to_string())
            }
            Error::NoEquilibrium(_) | Error::Refused(_) => Ok(Err(error.to_string())),
            _ => Err(format!("{error:?}")),
        };
        let mut simulation = match Simulation::new(self.problem(posed)) {
            Ok(simulation) => simulation,
            Err(error) => return fails(error),
        };
        let mut settlements = Vec::new();
        loop {
            let increment = match simulation.step() {
                Ok(Some(increment)) => increment,
                Ok(None) => return Ok(Ok(settlements)),
                Err(error) => return fails(error),
            };
            let place = format!("{}", increment.place);
            let state = simulation.snapshot();
            let most = state
                .displacement
                .iter()
                .fold(0.0, |m: f64, u| m.max(u.abs()));
            if !most.is_finite() || most > 10.0 * HEIGHT {
                return Err(format!("{place}: {most:e} m"));
            }
            let is_rest = increment.place.phase == "rest";
            // Some millimetres are what the weight would cause.
            if is_rest && !self.bends() && most > 1e-11 {
                return Err(format!("at rest, and moves by {most:e} m"));
            }
            if increment.place.increment < increment.of {
                continue;
            }
            let vertical: f64 = state.reaction.iter().skip(1).step_by(2).sum();
            let carried = posed.unit * self.on_bottom(settlements.len());
            let scale: f64 = state.reaction.iter().map(|force| force.abs()).sum();
            if (vertical - carried).abs() > 1e-5 * scale.max(carried.abs()) {
                return Err(format!("{place}: reactions {vertical:e} carry {carried:e}"));
            }
            let head = simulation.displacement_of("head").map_or(0.0, |u| u[1]);
            let change = settlements.len().checked_sub(1).map(|n| self.changes[n]);
            if let Some((Change::Push(value), n)) = change
                && is_rigid(n)
            {
                let nodes = &simulation.problem().mesh.lines["head"].nodes;
                let is_off = |node: &&usize| {
                    state.displacement[2 * **node + 1].to_bits() != (-value).to_bits()
                };
                if let Some(node) = nodes.iter().find(is_off) {
                    let at = state.displacement[2 * node + 1];
                    return Err(format!(
                        "{place}: the head is pushed by {value:e}, a node is at {at:e}"
                    ));
                }
            }
            settlements.push(head);
        }
    }
}

/// Whether a head that is pushed in this many increments is rigid.
fn is_rigid(increments: usize) -> bool {
    increments > 1
}

/// The changes that can be made in this order: what carries a load is not dug away.
fn possible(
    changes: Vec<(Change, usize)>,
    has_water: bool,
    has_skin: bool,
) -> Vec<(Change, usize)> {
    let (mut is_there, mut is_loaded, mut comes) = (true, false, has_skin);
    let is_possible = |(change, _): &(Change, usize)| {
        let possible = match change {
            Change::Pressure(_) | Change::Force(_) | Change::Push(_) => is_there,
            Change::Water(_) => has_water,
            Change::Dig => is_there && !is_loaded,
            Change::Fill => !is_there,
            Change::Skin => is_there && comes,
            Change::Swap | Change::Drain(_) => true,
        };
        if possible {
            match change {
                Change::Pressure(_) | Change::Force(_) | Change::Push(_) => is_loaded = true,
                Change::Dig => is_there = false,
                Change::Fill => is_there = true,
                Change::Skin => comes = false,
                _ => {}
            }
        }
        possible
    };
    changes.into_iter().filter(is_possible).collect()
}

fn ground() -> impl Strategy<Value = Ground> {
    let change = prop_oneof![
        2 => (5.0..120.0_f64).prop_map(Change::Pressure),
        2 => (10.0..300.0_f64).prop_map(Change::Force),
        2 => (1e-4..2e-2_f64).prop_map(Change::Push),
        2 => prop::sample::select(vec![0.1, 0.5, 0.65, 1.0, 1.4]).prop_map(Change::Water),
        1 => Just(Change::Dig),
        1 => Just(Change::Fill),
        2 => Just(Change::Swap),
        2 => Just(Change::Skin),
        2 => any::<bool>().prop_map(Change::Drain),
    ];
    let weight = prop::sample::select(vec![[18.0, 20.0], [16.0, 16.0], [17.0, 21.0]]);
    let integration = prop::sample::select(vec![
        None,
        None,
        Some(Integration::Full),
        Some(Integration::BBar),
    ]);
    (
        prop::array::uniform5(any::<bool>()),
        (1..3_usize, 1..4_usize, 1..4_usize),
        integration,
        prop::array::uniform2(weight),
        prop::array::uniform2(0..4_usize),
        prop::option::of(prop::sample::select(vec![
            0.25, 0.37, 0.5, 0.6, 0.75, 0.9, 1.0, 1.5,
        ])),
        prop::collection::vec((change, 1..4_usize), 0..4),
    )
        .prop_map(
            |(flags, n, integration, weights, at_rest, water, changes)| {
                let [
                    is_axisymmetric,
                    are_triangles,
                    is_skewed,
                    is_plastic,
                    has_skin,
                ] = flags;
                let changes = possible(changes, water.is_some(), has_skin);
                Ground {
                    is_axisymmetric,
                    are_triangles,
                    is_skewed,
                    n: [n.0, n.1, n.2],
                    integration,
                    is_plastic,
                    weights,
                    at_rest,
                    water,
                    has_skin,
                    changes,
                }
            },
        )
}

#[test]
fn ground_stays_at_rest_and_balances_what_is_done_to_it() {
    hold(
        "ground",
        (200_001, 120),
        &ground(),
        |ground| format!("{ground:#?}"),
        Ground::check,
    );
}
