//! Whether a law may end an increment like this.

use super::{Constants, Flow, Leg, State, Trial};
use crate::wide::{Wide, wide};

fn near(what: &str, found: f64, expected: f64, tolerance: f64) -> Result<(), String> {
    if (found - expected).abs() <= tolerance {
        return Ok(());
    }
    Err(format!(
        "{what} {found:e}, expected {expected:e} ± {tolerance:.1e}"
    ))
}

/// Relative, of the end of an increment.
const TOLERANCE: f64 = 1e-10;

/// Units of rounding of the trial stress that the reference is moved by.
const UNITS: f64 = 8.0;

/// Whether a law may end an increment (contraction, slip) from `start` like this: as the reference
/// within [`TOLERANCE`] of the end plus what [`UNITS`] of rounding of the trial stress move the
/// reference by.
pub(crate) fn check(
    constants: &Constants,
    start: &State,
    increment: [f64; 2],
    end: &State,
) -> Result<(), String> {
    let unchanged = || {
        near("slip", end.xi, start.xi, 0.0)?;
        near("contraction", end.contraction, start.contraction, 0.0)
    };
    let stress_free = || {
        near("σ_n", end.sigma, 0.0, 0.0)?;
        near("τ", end.tau, 0.0, 0.0)
    };
    let (mut sigma_0, mut tau_0) = (start.sigma, start.tau);
    let [mut contraction, mut slip] = increment;
    if start.gap > 0.0 {
        let gap = start.gap - contraction;
        if gap >= 0.0 {
            stress_free()?;
            unchanged()?;
            return near("gap", end.gap, gap, 4.0 * f64::EPSILON * start.gap);
        }
        slip *= 1.0 - start.gap / contraction;
        contraction -= start.gap;
        (sigma_0, tau_0) = (0.0, 0.0);
    }
    let sigma = wide(sigma_0) + wide(constants.k_n) * wide(contraction);
    let tau = wide(tau_0) + wide(constants.k_t) * wide(slip);
    let sign = 1.0_f64.copysign(tau.0);
    let precise = Trial {
        sigma,
        tau: wide(sign) * tau,
        highest: if sigma.0 > sigma_0 {
            sigma
        } else {
            wide(sigma_0)
        },
        xi: start.xi,
    };
    let moved = |by: [f64; 2]| {
        let sizes = [
            sigma_0.abs().max((constants.k_n * contraction).abs()),
            tau_0.abs().max((constants.k_t * slip).abs()),
        ];
        let shift = [0, 1].map(|i| by[i] * UNITS * f64::EPSILON * sizes[i]);
        precise.moved(shift, sigma_0).flow(constants)
    };
    let flow = precise.flow(constants).rounded();
    let neighbours = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]].map(moved);
    let ends = |flow: &Flow<f64>| precise.end(constants, *flow);
    let open = end.sigma == 0.0 && end.tau == 0.0;
    let may_open = flow == Flow::LosesContact || neighbours.contains(&Flow::LosesContact);
    if open && may_open {
        return lost(
            constants,
            start,
            sigma_0,
            tau_0,
            [contraction, slip],
            &precise,
            end,
        );
    }
    let Some(expected) = ends(&flow).or_else(|| neighbours.iter().find_map(ends)) else {
        return Err(format!(
            "in contact at σ_n = {:e}, expected open",
            end.sigma
        ));
    };
    let others: Vec<[f64; 4]> = neighbours.iter().filter_map(ends).collect();
    let spread = [0, 1, 2, 3].map(|i| {
        let offs = others.iter().map(|other| (other[i] - expected[i]).abs());
        offs.fold(0.0, f64::max)
    });
    let found = [
        end.sigma,
        sign * end.tau,
        end.xi - start.xi,
        end.contraction - start.contraction,
    ];
    let reach = |carried: f64, added: f64| carried.abs().max(added.abs());
    let of_tau = reach(tau_0, constants.k_t * slip);
    let rounding = [
        reach(sigma_0, constants.k_n * contraction),
        // That of μ too, which is a sum.
        reach(of_tau, constants.p.mu_p * end.sigma),
        end.xi,
        reach(end.contraction, start.contraction),
    ]
    .map(|size| UNITS * f64::EPSILON * size);
    let compare = || {
        for (i, name) in ["σ_n", "|τ|", "Δξ", "Δ[u_n^p]"].into_iter().enumerate() {
            let tolerance = TOLERANCE * expected[i].abs() + 4.0 * spread[i] + rounding[i];
            near(name, found[i], expected[i], tolerance)?;
        }
        near("gap", end.gap, 0.0, 0.0)
    };
    compare().or_else(|why| earlier_root(&precise, constants, end, &expected).map_err(|()| why))
}

/// An earlier root than the scan's, if the law has found one: it solves (A) to rounding.
fn earlier_root(
    trial: &Trial<Wide>,
    constants: &Constants,
    end: &State,
    expected: &[f64; 4],
) -> Result<(), ()> {
    let d_lambda = end.xi - trial.xi;
    let leg = Leg {
        softened: constants.is_softened(end.xi),
        origin: wide(0.0),
        contraction: wide(0.0),
    };
    let (g, c) = trial.sample(constants, &leg, wide(d_lambda));
    let scale = trial
        .tau
        .0
        .max(trial.highest.0)
        .max(constants.k_n * c.0.abs());
    let on_surface =
        (end.tau.abs() - constants.friction(end.xi) * end.sigma).abs() <= 1e-12 * end.tau.abs();
    let solves = g.0.abs() <= 1e-13 * scale && on_surface;
    (d_lambda > 0.0 && d_lambda < expected[2] && solves)
        .then_some(())
        .ok_or(())
}

/// Loss of contact: without stress, with a slip at which the page's conditions hold.
fn lost(
    constants: &Constants,
    start: &State,
    sigma_0: f64,
    tau_0: f64,
    [contraction, slip]: [f64; 2],
    trial: &Trial<Wide>,
    end: &State,
) -> Result<(), String> {
    let (k_n, k_t) = (constants.k_n, constants.k_t);
    let d_lambda = end.xi - start.xi;
    let ulp = 1e-12;
    let limit = tau_0.abs().max(trial.tau.0) / k_t;
    if d_lambda < 0.0 || d_lambda > limit * (1.0 + ulp) + 4.0 * f64::EPSILON * end.xi {
        return Err(format!("Δξ {d_lambda:e} beyond {limit:e}"));
    }
    let mut leg = Leg {
        softened: constants.is_softened(start.xi),
        origin: wide(0.0),
        contraction: wide(0.0),
    };
    if let Some(peak) = constants.peak_ahead(start.xi).filter(|p| end.xi > p.u_tp) {
        let at = wide(peak.u_tp - start.xi);
        let (_, c) = trial.sample(constants, &leg, at);
        if peak.published {
            (leg.origin, leg.contraction) = (at, c);
        }
        leg.softened = true;
    }
    let (_, c) = trial.sample(constants, &leg, wide(d_lambda));
    let c = c.0;
    // Δξ is known to the rounding of ξ only.
    let blurred = 4.0 * f64::EPSILON * end.xi;
    let rounding = 1e-9 * c.abs() + blurred + 8.0 * f64::EPSILON * end.contraction.abs();
    near("Δ[u_n^p]", end.contraction - start.contraction, c, rounding)?;
    let gap = if contraction < 0.0 {
        (c - trial.sigma.0 / k_n).max(0.0)
    } else {
        0.0
    };
    let scale = sigma_0.abs().max(k_n * contraction.abs());
    near("gap", end.gap, gap, rounding + ulp * scale / k_n)?;
    if contraction < 0.0 && sigma_0 > 0.0 && gap > ulp * scale / k_n {
        // σ_n = 0 at one of the fractions at which the slip is |τ|/K_t.
        let fractions = [1.0, -1.0].map(|sign| (sign * k_t * d_lambda - tau_0) / (k_t * slip));
        let holds = fractions.iter().chain(&[0.0, 1.0]).any(|s| {
            let sigma = sigma_0 + s * k_n * contraction - k_n * c;
            sigma.abs() <= 1e-7 * scale + k_n * blurred
        });
        if !holds && slip != 0.0 {
            return Err(format!("Δξ {d_lambda:e} where σ_n does not vanish"));
        }
    }
    Ok(())
}
