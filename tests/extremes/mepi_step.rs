//! One increment of MEPI by its own scheme, from Eq. (6) to (17) and (A) of its page: the first root
//! by a scan over all scales of Δλ and bisection, in double-double numbers at the end.
//!
//! Compression and contraction positive, as on the law's page.

use crate::point::Values;
use crate::wide::{Wide, wide};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// What the equations need of a number.
pub(crate) trait Real:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    fn of(value: f64) -> Self;
    fn double(self) -> f64;
    fn exp(self) -> Self;
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }
    fn double(self) -> f64 {
        self
    }
    fn exp(self) -> Self {
        f64::exp(self)
    }
}

impl Real for Wide {
    fn of(value: f64) -> Self {
        wide(value)
    }
    fn double(self) -> f64 {
        self.0
    }
    fn exp(self) -> Self {
        Wide::exp(self)
    }
}

/// Parameters, under the names of the page.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mepi {
    pub(crate) k_n: f64,
    pub(crate) k_t: f64,
    pub(crate) n: f64,
    pub(crate) mu_0: f64,
    pub(crate) mu_p: f64,
    pub(crate) mu_c0: f64,
    pub(crate) a: f64,
    pub(crate) c_0: f64,
    pub(crate) t: f64,
    pub(crate) p_0: f64,
    pub(crate) peak: Option<Peak>,
}

/// Parameters of Eq. (11).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peak {
    pub(crate) mu_r: f64,
    pub(crate) a_0: f64,
    pub(crate) u_tp: f64,
    pub(crate) published: bool,
}

/// A point: stress, slip, gap, plastic contraction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State {
    pub(crate) sigma: f64,
    pub(crate) tau: f64,
    pub(crate) xi: f64,
    pub(crate) gap: f64,
    pub(crate) contraction: f64,
}

impl Mepi {
    /// Id of the law.
    pub(crate) fn id(&self) -> &'static str {
        if self.peak.is_some() {
            "mepi_softening"
        } else {
            "mepi"
        }
    }

    /// The values of its parameters.
    pub(crate) fn with_values<R>(&self, more: Values<'_>, f: impl FnOnce(Values<'_>) -> R) -> R {
        let mut values = vec![
            ("k_n", self.k_n),
            ("k_t", self.k_t),
            ("n", self.n),
            ("mu_0", self.mu_0),
            ("mu_p", self.mu_p),
            ("mu_c0", self.mu_c0),
            ("a", self.a),
            ("c_0", self.c_0),
            ("t", self.t),
            ("p_0", self.p_0),
        ];
        if let Some(peak) = &self.peak {
            values.extend([
                ("mu_r", peak.mu_r),
                ("a_0", peak.a_0),
                ("u_tp", peak.u_tp),
                ("peak", f64::from(u8::from(peak.published))),
            ]);
        }
        values.extend_from_slice(more);
        f(&values)
    }

    /// Eq. (7) and the scales of ξ.
    pub(crate) fn at(&self, sigma_ni: f64) -> Constants {
        let power = sigma_ni.powf(self.n);
        let ratio = sigma_ni / self.p_0;
        Constants {
            p: *self,
            k_n: self.k_n * power,
            k_t: self.k_t * power,
            slip_scale: self.a * ratio * self.t,
            stabilisation: self.c_0 * ratio / self.t,
        }
    }
}

/// Constants of one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constants {
    p: Mepi,
    pub(crate) k_n: f64,
    pub(crate) k_t: f64,
    pub(crate) slip_scale: f64,
    stabilisation: f64,
}

fn sech<T: Real>(z: T) -> T {
    let e = (-z).exp();
    T::of(2.0) * e / (T::of(1.0) + e * e)
}

impl Constants {
    /// μ(ξ); `softened`: by Eq. (11).
    pub(crate) fn mu<T: Real>(&self, softened: bool, xi: T) -> T {
        let p = &self.p;
        let hardening = |xi: T| {
            T::of(p.mu_0) + (T::of(p.mu_p) - T::of(p.mu_0)) * (xi / (T::of(self.slip_scale) + xi))
        };
        match p.peak {
            Some(peak) if softened => {
                let top = if peak.published {
                    T::of(p.mu_p)
                } else {
                    hardening(T::of(peak.u_tp))
                };
                let z = T::of(peak.a_0 / p.t) * (xi - T::of(peak.u_tp));
                T::of(peak.mu_r) + (top - T::of(peak.mu_r)) * sech(z)
            }
            _ => hardening(xi),
        }
    }

    /// β = μ_c − μ, Eq. (16), (17).
    pub(crate) fn beta<T: Real>(&self, mu: T, xi: T) -> T {
        let short = T::of(self.p.mu_c0) - mu;
        if short.double() > 0.0 {
            short
        } else {
            short * sech(T::of(self.stabilisation) * xi)
        }
    }

    /// t/A_0, over which μ falls; infinite without a peak.
    pub(crate) fn softening_length(&self) -> f64 {
        self.p
            .peak
            .map_or(f64::INFINITY, |peak| self.p.t / peak.a_0)
    }

    pub(crate) fn is_softened(&self, xi: f64) -> bool {
        self.p.peak.is_some_and(|peak| xi >= peak.u_tp)
    }

    /// μ at the surface that holds at ξ.
    pub(crate) fn friction(&self, xi: f64) -> f64 {
        self.mu(self.is_softened(xi), xi)
    }

    /// The lower of the two values where μ jumps.
    fn peak_ahead(&self, xi: f64) -> Option<Peak> {
        self.p.peak.filter(|peak| xi < peak.u_tp)
    }
}

/// Trial stress of the part of an increment in contact.
#[derive(Clone, Copy, Debug)]
struct Trial<T> {
    sigma: T,
    tau: T,
    highest: T,
    xi: f64,
}

/// From where β counts, and the contraction until there.
#[derive(Clone, Copy, Debug)]
struct Leg<T> {
    softened: bool,
    origin: T,
    contraction: T,
}

/// How the flow ends.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Flow<T> {
    Elastic,
    Slides {
        d_lambda: T,
        sigma: T,
        contraction: T,
    },
    StopsAtPeak {
        d_lambda: T,
        sigma: T,
        contraction: T,
    },
    LosesContact,
}

impl<T: Real> Trial<T> {
    /// g and c of Eq. (A).
    fn sample(&self, constants: &Constants, leg: &Leg<T>, d_lambda: T) -> (T, T) {
        let xi = T::of(self.xi) + d_lambda;
        let mu = constants.mu(leg.softened, xi);
        let c = leg.contraction + (d_lambda - leg.origin) * constants.beta(mu, xi);
        let sigma = self.sigma - T::of(constants.k_n) * c;
        (self.tau - T::of(constants.k_t) * d_lambda - mu * sigma, c)
    }

    /// The end of the flow.
    fn flow(&self, constants: &Constants) -> Flow<T> {
        let zero = T::of(0.0);
        let mu = constants.mu(constants.is_softened(self.xi), T::of(self.xi));
        if self.sigma >= zero && self.tau <= mu * self.sigma {
            return Flow::Elastic;
        }
        let k_n = T::of(constants.k_n);
        let limit = (self.tau / T::of(constants.k_t)).double();
        let mut leg = Leg {
            softened: constants.is_softened(self.xi),
            origin: zero,
            contraction: zero,
        };
        let ahead = constants.peak_ahead(self.xi);
        let at_peak = ahead.map(|peak| peak.u_tp - self.xi).filter(|x| *x < limit);
        let mut before = 0.0;
        for (next, is_peak) in grid(constants, self.xi, limit, at_peak) {
            let (g, c) = self.sample(constants, &leg, T::of(next));
            if g <= zero && !(is_peak && g >= zero) {
                let d_lambda = self.root(constants, &leg, before, next);
                let (_, c) = self.sample(constants, &leg, d_lambda);
                if k_n * c > self.highest {
                    return Flow::LosesContact;
                }
                return Flow::Slides {
                    d_lambda,
                    sigma: self.sigma - k_n * c,
                    contraction: c,
                };
            }
            if k_n * c > self.highest {
                return Flow::LosesContact;
            }
            before = next;
            if is_peak {
                if ahead.is_some_and(|peak| peak.published) {
                    leg.origin = T::of(next);
                    leg.contraction = c;
                }
                leg.softened = true;
                let (g, c) = self.sample(constants, &leg, T::of(next));
                if g <= zero {
                    return Flow::StopsAtPeak {
                        d_lambda: T::of(next),
                        sigma: self.sigma - k_n * c,
                        contraction: c,
                    };
                }
            }
        }
        Flow::LosesContact
    }

    /// Bisection, to the last bit of a double, then of twice as many.
    fn root(&self, constants: &Constants, leg: &Leg<T>, low: f64, high: f64) -> T {
        let (mut low, mut high) = (T::of(low), T::of(high));
        for _ in 0..120 {
            let middle = low + (high - low) * T::of(0.5);
            if middle <= low || middle >= high {
                break;
            }
            if self.sample(constants, leg, middle).0.double() > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }
}

/// Values of Δλ from 0 to the limit, the one at the peak marked: even, in decades of Δλ, and in
/// decades of the distance from the peak.
fn grid(
    constants: &Constants,
    xi: f64,
    limit: f64,
    at_peak: Option<f64>,
) -> impl Iterator<Item = (f64, bool)> {
    const N: usize = 1 + 59 + 239 + 100;
    let mut points = [limit; N];
    for (k, point) in points[1..60].iter_mut().enumerate() {
        *point = limit * (k + 1) as f64 / 60.0;
    }
    for (k, point) in points[60..299].iter_mut().enumerate() {
        *point = limit * 10_f64.powf((k + 1) as f64 / -14.0);
    }
    if let Some(peak) = constants.p.peak {
        let width = constants.p.t / peak.a_0.max(1e-12);
        let from = (peak.u_tp - xi).max(0.0);
        for (k, point) in points[299..].iter_mut().enumerate() {
            *point = (from + width * 10_f64.powf((k as f64 - 50.0) / 14.0)).min(limit);
        }
    }
    if let Some(peak) = at_peak {
        // In the place of a limit that is there already.
        points[N - 1] = peak;
    }
    points.sort_unstable_by(f64::total_cmp);
    let mut before = 0.0;
    points.into_iter().filter_map(move |x| {
        let is_new = x > before;
        before = before.max(x);
        is_new.then_some((x, Some(x) == at_peak))
    })
}

fn near(what: &str, found: f64, expected: f64, tolerance: f64) -> Result<(), String> {
    if (found - expected).abs() <= tolerance {
        return Ok(());
    }
    Err(format!(
        "{what} {found:e}, expected {expected:e} ± {tolerance:.1e}"
    ))
}

/// Relative, of the end of an increment.
pub(crate) const TOLERANCE: f64 = 1e-10;
/// Units of rounding of the trial stress that the reference is moved by.
const UNITS: f64 = 8.0;

/// Whether a law may end an increment (contraction, slip) from `start` like this: as the reference
/// within [`TOLERANCE`] of the end plus what [`UNITS`] of rounding of the trial stress move the
/// reference by.
#[expect(clippy::too_many_lines, reason = "one increment, case by case")]
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
    let mut sigma_0 = start.sigma;
    let mut tau_0 = start.tau;
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
        let shift = |i: usize| by[i] * UNITS * f64::EPSILON * sizes[i];
        let sigma = precise.sigma.0 + shift(0);
        Trial {
            sigma,
            tau: (precise.tau.0 + shift(1)).abs(),
            highest: sigma.max(sigma_0),
            xi: start.xi,
        }
        .flow(constants)
    };
    let flow = match precise.flow(constants) {
        Flow::Elastic => Flow::Elastic,
        Flow::LosesContact => Flow::LosesContact,
        Flow::Slides {
            d_lambda,
            sigma,
            contraction,
        } => Flow::Slides {
            d_lambda: d_lambda.0,
            sigma: sigma.0,
            contraction: contraction.0,
        },
        Flow::StopsAtPeak {
            d_lambda,
            sigma,
            contraction,
        } => Flow::StopsAtPeak {
            d_lambda: d_lambda.0,
            sigma: sigma.0,
            contraction: contraction.0,
        },
    };
    let neighbours = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]].map(moved);
    let ends = |flow: &Flow<f64>| -> Option<[f64; 4]> {
        // σ_n, |τ|, Δλ, contraction.
        Some(match *flow {
            Flow::Elastic => [precise.sigma.0, precise.tau.0, 0.0, 0.0],
            Flow::Slides {
                d_lambda,
                sigma,
                contraction,
            } => [
                sigma,
                (precise.tau.0 - constants.k_t * d_lambda)
                    .min(sigma * constants.friction(start.xi + d_lambda)),
                d_lambda,
                contraction,
            ],
            Flow::StopsAtPeak {
                d_lambda,
                sigma,
                contraction,
            } => [
                sigma,
                precise.tau.0 - constants.k_t * d_lambda,
                d_lambda,
                contraction,
            ],
            Flow::LosesContact => return None,
        })
    };
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
    let mut spread = [0.0_f64; 4];
    for other in neighbours.iter().filter_map(ends) {
        for i in 0..4 {
            spread[i] = spread[i].max((other[i] - expected[i]).abs());
        }
    }
    let found = [
        end.sigma,
        sign * end.tau,
        end.xi - start.xi,
        end.contraction - start.contraction,
    ];
    let reach = |carried: f64, added: f64| carried.abs().max(added.abs());
    let rounding = [
        UNITS * f64::EPSILON * reach(sigma_0, constants.k_n * contraction),
        // That of μ too, which is a sum.
        UNITS
            * f64::EPSILON
            * reach(
                reach(tau_0, constants.k_t * slip),
                constants.p.mu_p * end.sigma,
            ),
        UNITS * f64::EPSILON * end.xi,
        UNITS * f64::EPSILON * end.contraction.abs().max(start.contraction.abs()),
    ];
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
