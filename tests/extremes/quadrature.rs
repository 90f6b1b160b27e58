//! MEPI in the shear box, by the point driver and by its schemes, against the quadrature of its rates.
//!
//! Compression and contraction positive. In monotonic shear with a spring of stiffness K behind the
//! interface everything follows from ξ: `σ_n = σ_ni − K_s I(ξ)`, `I = ∫ β dξ`, `K_s = K K_n/(K + K_n)`,
//! `τ = μ(ξ) σ_n`, `[u_t] = ξ + τ/K_t`.
//!
//! Implicit             is backward Euler: with n and 2n increments the error of the second is no more
//!                      than twice the difference of the two; under constant normal stress there is
//!                      no error in τ and ξ.
//! Error-controlled     within a hundred times its tolerance, in one increment.
//! Explicit             as implicit, with its substeps for the increments.
//!
//! Increments resolve the slips over which hardening and softening happen: where they do not, backward
//! Euler is its own answer ([`mepi_paths`](crate::mepi_paths)) and not the rates'. The error-controlled
//! scheme has to find those slips itself.
//!
//! Left out where the rates have no solution all the way: `[u_t]` has to grow with ξ, σ_n not to
//! vanish.

use crate::matrix::{Family, Verdict};
use crate::mepi_paths::{FONTAINEBLEAU, SILICA, TABLE_4, extremes};
use crate::mepi_step::{Constants, Mepi};
use crate::point::{Point, law, reason};
use abi::Hypothesis;
use input::Error;

/// ξ, σ_n, τ at a slip.
pub(crate) type Shear = [f64; 3];

/// The quadrature, tabulated over ξ.
pub(crate) struct Truth {
    constants: Constants,
    sigma_ni: f64,
    spring: f64,
    /// ξ and I(ξ).
    table: Vec<[f64; 2]>,
}

impl Truth {
    /// None where the rates have no solution up to this slip.
    pub(crate) fn new(p: &Mepi, sigma_ni: f64, stiffness: f64, slip: f64) -> Option<Self> {
        let constants = p.at(sigma_ni);
        let spring = if stiffness.is_infinite() {
            constants.k_n
        } else {
            constants.k_n * stiffness / (constants.k_n + stiffness)
        };
        // In decades of ξ and of the distance from the peak; where μ = μ_c0 there is a kink.
        let mut xi: Vec<f64> = (0..=480)
            .map(|k| slip * 10_f64.powf(f64::from(k) / -24.0))
            .collect();
        xi.push(0.0);
        let rise = (p.mu_c0 - p.mu_0) / (p.mu_p - p.mu_0);
        if rise > 0.0 && rise < 1.0 {
            xi.push(constants.slip_scale * rise / (1.0 - rise));
        }
        if let Some(peak) = p.peak {
            let width = p.t / peak.a_0.max(1e-12);
            xi.extend((0..200).map(|k| peak.u_tp + width * 10_f64.powf(f64::from(k) / 24.0 - 6.0)));
            xi.push(peak.u_tp);
            let top = constants.mu(false, peak.u_tp);
            if (top - p.mu_c0) * (p.mu_c0 - peak.mu_r) > 0.0 {
                xi.push(peak.u_tp + width * ((top - peak.mu_r) / (p.mu_c0 - peak.mu_r)).acosh());
            }
        }
        xi.retain(|x| *x <= slip);
        xi.sort_by(f64::total_cmp);
        let mut table: Vec<[f64; 2]> = vec![[0.0, 0.0]];
        for ends in xi.windows(2) {
            let before = table[table.len() - 1][1];
            table.push([ends[1], before + integral(&constants, ends[0], ends[1])]);
        }
        let truth = Self {
            constants,
            sigma_ni,
            spring,
            table,
        };
        let mut reached = -1.0;
        for [xi, i] in &truth.table {
            let [_, sigma, tau] = truth.stress(*xi, *i);
            let u = xi + tau / constants.k_t;
            if u < reached || sigma <= 1e-3 * sigma_ni {
                return None;
            }
            reached = u;
        }
        Some(truth)
    }

    /// The lowest normal stress on the way.
    pub(crate) fn lowest(&self) -> f64 {
        let sigmas = self.table.iter().map(|[xi, i]| self.stress(*xi, *i)[1]);
        sigmas.fold(f64::INFINITY, f64::min)
    }

    fn stress(&self, xi: f64, contraction: f64) -> Shear {
        let sigma = self.sigma_ni - self.spring * contraction;
        [xi, sigma, self.constants.friction(xi) * sigma]
    }

    /// At a slip, by bisection.
    pub(crate) fn at(&self, slip: f64) -> Shear {
        let slip_at = |[xi, _, tau]: Shear| xi + tau / self.constants.k_t;
        let rows = &self.table;
        let i = rows
            .partition_point(|[xi, i]| slip_at(self.stress(*xi, *i)) <= slip)
            .max(1)
            - 1;
        let [from, before] = rows[i];
        let (mut low, mut high) = (from, rows.get(i + 1).map_or(slip, |row| row[0]));
        let at = |xi: f64| self.stress(xi, before + integral(&self.constants, from, xi));
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if slip_at(at(middle)) <= slip {
                low = middle;
            } else {
                high = middle;
            }
        }
        if i == 0 && slip_at(self.stress(0.0, 0.0)) > slip {
            return [0.0, self.sigma_ni, self.constants.k_t * slip];
        }
        at(low)
    }
}

/// ∫ β dξ over an interval without kinks, by Gauss' rule with five points.
fn integral(constants: &Constants, from: f64, to: f64) -> f64 {
    const NODES: [(f64, f64); 3] = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let beta = |x: f64| {
        let xi = middle + half * x;
        constants.beta(constants.friction(xi), xi)
    };
    let sum = NODES[1..]
        .iter()
        .map(|(x, w)| w * (beta(*x) + beta(-x)))
        .sum::<f64>();
    half * (sum + NODES[0].1 * beta(0.0))
}

/// The ends of two runs of the point driver.
fn drive(
    p: &Mepi,
    sigma: f64,
    stiffness: f64,
    slip: f64,
    increments: [usize; 2],
) -> Result<[Shear; 2], Verdict> {
    let parameters = p.with_values(&[], |values| {
        let value = |(id, value): &(&str, f64)| {
            if *id == "peak" {
                "peak = 'continuous'\n".to_owned()
            } else {
                format!("{id} = {value:?}\n")
            }
        };
        values.iter().map(value).collect::<String>()
    });
    let normal = if stiffness.is_infinite() {
        "{ jump = 0.0 }".to_owned()
    } else {
        format!("{{ stiffness = {stiffness:?} }}")
    };
    let text = format!(
        "law = '{}'\nhypothesis = 'interface_2d'\n[parameters]\n{parameters}[initial]\n\
         traction = {{ n = {:?} }}\n[[segment]]\nincrements = 1\n\
         control = {{ n = {normal}, t = {{ jump = {slip:?} }} }}\n",
        p.id(),
        -sigma
    );
    let refused = |why: Error| Verdict::Refused(why.to_string());
    let mut driver = tests::driver::of_text(&text).map_err(refused)?;
    let mut ends = [[0.0; 3]; 2];
    for (end, n) in ends.iter_mut().zip(increments) {
        driver.point_mut().set_increments(&[n]);
        let keep = |row: &point::Row<'_>| {
            *end = [row.internal[0], -row.flux[0], row.flux[1]];
        };
        driver.run(keep).map_err(refused)?;
    }
    Ok(ends)
}

/// The end of equal increments at constant volume.
pub(crate) fn calls(p: &Mepi, sigma: f64, slip: f64, n: u32) -> Result<Shear, Verdict> {
    let built = p.with_values(&[], |values| law(p.id(), Hypothesis::Interface2d, values));
    let mut point = Point::new(built.map_err(Verdict::Refused)?, &[-sigma, 0.0])
        .map_err(|why| Verdict::Refused(reason(&why)))?;
    let increment = [0.0, slip / f64::from(n)];
    for _ in 0..n {
        let verdict = point.advance(&increment, |_, _, _, _| Ok(()));
        if verdict != Verdict::Agrees {
            return Err(verdict);
        }
    }
    Ok([point.state[0], -point.flux[0], point.flux[1]])
}

/// The end of one call at constant volume.
pub(crate) fn call(
    p: &Mepi,
    sigma: f64,
    slip: f64,
    scheme: &[(&str, f64)],
) -> Result<Shear, Verdict> {
    let built = p.with_values(scheme, |values| {
        law(p.id(), Hypothesis::Interface2d, values)
    });
    let mut point = Point::new(built.map_err(Verdict::Refused)?, &[-sigma, 0.0])
        .map_err(|why| Verdict::Refused(reason(&why)))?;
    match point.advance(&[0.0, slip], |_, _, _, _| Ok(())) {
        Verdict::Agrees => Ok([point.state[0], -point.flux[0], point.flux[1]]),
        other => Err(other),
    }
}

/// Differences relative to the largest stress, and to the slip.
pub(crate) fn distance(a: &Shear, b: &Shear, slip: f64) -> f64 {
    let size = a[1].abs().max(a[2].abs());
    let slips = (a[0] - b[0]).abs() / slip;
    slips
        .max((a[1] - b[1]).abs() / size)
        .max((a[2] - b[2]).abs() / size)
}

/// Errors of n and 2n steps of a method of first order.
fn first_order(truth: &Shear, one: &Shear, two: &Shear, slip: f64) -> Verdict {
    let (error, step) = (distance(truth, two, slip), distance(one, two, slip));
    if error <= 2.0 * step + QUADRATURE && error <= ROUGH {
        Verdict::Agrees
    } else {
        Verdict::Silent(format!(
            "off by {error:e}, differing by {step:e}, from {truth:?}"
        ))
    }
}

/// Relative: what quadrature and driver leave.
const QUADRATURE: f64 = 1e-8;
/// Relative: no answer of these numbers of increments is farther off.
const ROUGH: f64 = 0.2;

/// A slip that n increments resolve.
pub(crate) fn resolved(constants: &Constants, n: f64) -> f64 {
    0.2 * n * constants.slip_scale.min(constants.softening_length())
}

pub(crate) fn families() -> Vec<Family> {
    let held = "quadrature of the rates";
    let mut driver = Family::new("MEPI in the shear box, point driver", held);
    let mut fine = Family::new("the same, 10⁵ increments", held);
    let mut led = Family::new("MEPI, many increments at constant volume", held);
    let mut controlled = Family::new("MEPI, error-controlled", held);
    let mut explicit = Family::new("MEPI, explicit", held);
    let bases = [
        ("Table IV", TABLE_4),
        ("Fontainebleau", FONTAINEBLEAU),
        ("silica", SILICA),
    ];
    for (base, p) in bases {
        for (number, (what, p, sigma)) in extremes(p).into_iter().enumerate() {
            let constants = p.at(sigma);
            let unit = 5.0 * (constants.slip_scale + p.mu_p * sigma / constants.k_t)
                + p.peak.map_or(0.0, |peak| 1.5 * peak.u_tp);
            for (k, stiffness) in [0.0, 0.1 * constants.k_n, f64::INFINITY]
                .into_iter()
                .enumerate()
            {
                let name = format!("{base}, {what}: spring {stiffness:e}");
                let n = [50, 200, 800][(number + k) % 3];
                let whole = unit;
                let unit = whole.min(resolved(&constants, n as f64));
                let Some(truth) = Truth::new(&p, sigma, stiffness, unit) else {
                    continue;
                };
                let end = truth.at(unit);
                let run = |n| drive(&p, sigma, stiffness, unit, [n, 2 * n]);
                let judge = |ends: Result<[Shear; 2], Verdict>| match ends {
                    Ok([one, two]) => first_order(&end, &one, &two, unit),
                    Err(verdict) => verdict,
                };
                // A driver opens its library anew: one spring for each set of parameters.
                if number % 3 == k {
                    driver.add(format!("{name}, {n}"), judge(run(n)));
                }
                if what == "as published" {
                    fine.add(name.clone(), judge(run(50_000)));
                }
                if stiffness.is_finite() {
                    continue;
                }
                let ends = calls(&p, sigma, unit, n as u32)
                    .and_then(|one| Ok([one, calls(&p, sigma, unit, 2 * n as u32)?]));
                led.add(format!("{name}, {n}"), judge(ends));
                let steps = |n: f64| call(&p, sigma, unit, &[("scheme", 1.0), ("substeps", n)]);
                let n = n as f64;
                let ends = steps(n).and_then(|one| Ok([one, steps(2.0 * n)?]));
                explicit.add(name.clone(), judge(ends));
                let unit = whole;
                let Some(truth) = Truth::new(&p, sigma, stiffness, unit) else {
                    continue;
                };
                let end = truth.at(unit);
                for tolerance in [1e-2, 1e-4, 1e-6] {
                    let scheme = [("scheme", 2.0), ("scheme_tolerance", tolerance)];
                    let verdict = match call(&p, sigma, unit, &scheme) {
                        Ok(found) if distance(&end, &found, unit) <= 100.0 * tolerance => {
                            Verdict::Agrees
                        }
                        Ok(found) => Verdict::Silent(format!("{found:?}, expected {end:?}")),
                        Err(verdict) => verdict,
                    };
                    controlled.add(format!("{name}, {tolerance:e}"), verdict);
                }
            }
        }
    }
    vec![driver, fine, led, controlled, explicit]
}
