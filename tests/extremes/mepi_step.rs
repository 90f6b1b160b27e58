//! One increment of MEPI by its own scheme, from Eq. (6) to (17) and (A) of its page: the first root
//! by a scan over all scales of Δλ and bisection, in double-double numbers at the end.
//!
//! Compression and contraction positive, as on the law's page.

mod ends;

pub(crate) use ends::check;

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

impl Flow<Wide> {
    /// In doubles.
    fn rounded(self) -> Flow<f64> {
        match self {
            Self::Elastic => Flow::Elastic,
            Self::LosesContact => Flow::LosesContact,
            Self::Slides {
                d_lambda,
                sigma,
                contraction,
            } => Flow::Slides {
                d_lambda: d_lambda.0,
                sigma: sigma.0,
                contraction: contraction.0,
            },
            Self::StopsAtPeak {
                d_lambda,
                sigma,
                contraction,
            } => Flow::StopsAtPeak {
                d_lambda: d_lambda.0,
                sigma: sigma.0,
                contraction: contraction.0,
            },
        }
    }
}

impl Trial<Wide> {
    /// In doubles, with another trial stress; `sigma_0`: σ_n at the start.
    fn moved(&self, [normal, shear]: [f64; 2], sigma_0: f64) -> Trial<f64> {
        let sigma = self.sigma.0 + normal;
        Trial {
            sigma,
            tau: (self.tau.0 + shear).abs(),
            highest: sigma.max(sigma_0),
            xi: self.xi,
        }
    }

    /// σ_n, |τ|, Δλ and contraction at the end of a flow.
    fn end(&self, constants: &Constants, flow: Flow<f64>) -> Option<[f64; 4]> {
        let sticks = |d_lambda: f64| self.tau.0 - constants.k_t * d_lambda;
        match flow {
            Flow::Elastic => Some([self.sigma.0, self.tau.0, 0.0, 0.0]),
            Flow::Slides {
                d_lambda,
                sigma,
                contraction,
            } => {
                let slides = sigma * constants.friction(self.xi + d_lambda);
                Some([sigma, sticks(d_lambda).min(slides), d_lambda, contraction])
            }
            Flow::StopsAtPeak {
                d_lambda,
                sigma,
                contraction,
            } => Some([sigma, sticks(d_lambda), d_lambda, contraction]),
            Flow::LosesContact => None,
        }
    }
}
