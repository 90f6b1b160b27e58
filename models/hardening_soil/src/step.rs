//! A step in two passes, Eqs. (13) to (15), and the increment divided into such steps, with the derivative of
//! the result.
//!
//! Compression is positive here.

use crate::rate::{Linear, Rate, mean};
use crate::return_mapping::{End, Trial};
use crate::soil::{Slope, Soil};
use crate::spectral::{Principal, Turn};
use crate::system::Rates;
use abi::Failure;
use std::array;

/// Stress, over p_ref, below which errors are relative to it and not to the stress itself.
const SMALL_STRESS: f64 = 0.02;

/// How near the cap, over the stress, a step counts as beginning on it.
const NEARLY: f64 = 1e-4;

/// Residual, over the stress, below which the first pass takes its last correction, and the second.
const PREDICTED: f64 = 1e-6;
const ACCURATE: f64 = 1e-8;

/// Halvings of a step.
const MAX_HALVINGS: u32 = 10;

/// Steps, whole ones and halves, in an increment.
const MAX_ATTEMPTS: u32 = 400;

/// Stress and internal variables on their way through an increment, or their rates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point<const N: usize, T = f64> {
    pub(crate) stress: [T; N],
    pub(crate) p_p: T,
    pub(crate) gamma: T,
}

/// Derivatives of a point by the strain increment.
pub(crate) type Derivative<const N: usize> = Point<N, Rate<N>>;

impl<const N: usize> Derivative<N> {
    const ZERO: Self = Self {
        stress: [Rate::ZERO; N],
        p_p: Rate::ZERO,
        gamma: Rate::ZERO,
    };

    /// ∂stress/∂strain, row by row.
    #[inline]
    pub(crate) fn tangent(&self) -> [[f64; N]; N] {
        self.stress.map(|rate| rate.0)
    }
}

impl<const N: usize> Point<N> {
    /// # Errors
    /// The stress is not finite.
    #[inline]
    pub(crate) fn check(&self) -> Result<(), Failure> {
        if self.stress.iter().sum::<f64>().is_finite() {
            Ok(())
        } else {
            Err(Failure::Numeric("the stress overflows"))
        }
    }
}

impl<const N: usize, T: Linear> Point<N, T> {
    /// This point and `other`, by their weights.
    #[inline]
    fn sum(&self, own: f64, factor: f64, other: &Self) -> Self {
        Self {
            stress: array::from_fn(|i| self.stress[i] * own + other.stress[i] * factor),
            p_p: self.p_p * own + other.p_p * factor,
            gamma: self.gamma * own + other.gamma * factor,
        }
    }
}

/// A strain increment, and by what factor small strains stiffen the soil in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Increment<const N: usize> {
    pub(crate) strain: [f64; N],
    /// Young's modulus over that of unloading, and its derivative by the strain.
    pub(crate) stiffening: f64,
    pub(crate) stiffening_slope: Rate<N>,
    /// What γ_ps grows by over the plastic shear strain, and its derivative.
    pub(crate) slowing: f64,
    pub(crate) slowing_slope: Rate<N>,
}

impl<const N: usize> Increment<N> {
    /// An increment without effects of small strains.
    #[inline]
    pub(crate) fn of(strain: [f64; N]) -> Self {
        Self {
            strain,
            stiffening: 1.0,
            stiffening_slope: Rate::ZERO,
            slowing: 1.0,
            slowing_slope: Rate::ZERO,
        }
    }
}

/// A part of an increment.
#[derive(Clone, Copy)]
struct Part<'a, const N: usize> {
    increment: &'a Increment<N>,
    fraction: f64,
    /// Whether the increment begins with it.
    is_first: bool,
    with_derivative: bool,
}

/// Both passes of a step.
struct Passes<'a, const N: usize> {
    start: Principal<N>,
    /// Young's modulus of unloading at the start and at mid-step, kPa, with its derivatives by the minor stress.
    stiffness: [Slope; 2],
    /// sin φ_m where shear flow begins, with its derivatives by γ_ps and by the minor stress, and at the end of the
    /// first pass, with its derivatives by q and by the minor stress.
    mobilised: [[f64; 3]; 2],
    /// sin ψ_m of the passes, with its derivatives by sin φ_m.
    dilatancy: [[f64; 3]; 2],
    axes: [&'a Principal<N>; 2],
    ends: [&'a End<'a>; 2],
    strain: [f64; N],
    /// Size that the error is relative to, kPa.
    size: f64,
    error: f64,
    excess: f64,
}

/// Where a step ends.
struct Step<const N: usize> {
    at: (Point<N>, Derivative<N>),
    /// How far the error is from half the tolerance to all of it, 0 to 1.
    excess: f64,
    /// Rate of the error.
    error: Rate<N>,
}

impl Soil {
    /// Stress of an elastic strain over Young's modulus, Eq. (2).
    #[inline]
    pub(crate) fn unit_stress<const N: usize>(&self, strain: &[f64; N]) -> [f64; N] {
        let volume = self.lambda * (strain[0] + strain[1] + strain[2]);
        array::from_fn(|i| {
            if i < 3 {
                volume + 2.0 * self.G * strain[i]
            } else {
                self.G * strain[i]
            }
        })
    }

    /// Elastic operator at a stress, Eq. (2), row by row.
    pub(crate) fn operator<const N: usize>(
        &self,
        stress: &[f64; N],
        stiffening: f64,
    ) -> [[f64; N]; N] {
        let E = stiffening * self.stiffness(Principal::of(stress).values[2]).0;
        array::from_fn(|i| {
            let mut strain = [0.0; N];
            strain[i] = E;
            self.unit_stress(&strain)
        })
    }

    /// One step: Eqs. (15) to (19), with the derivative where its error is below the tolerance. None if a return fails.
    #[inline]
    fn step<const N: usize>(
        &self,
        (from, derivative): &(Point<N>, Derivative<N>),
        part: &Part<'_, N>,
    ) -> Option<Step<N>> {
        let strain = part.increment.strain.map(|e| part.fraction * e);
        let unit = self.unit_stress(&strain);
        let start = Principal::of(&from.stress);
        let s_0 = start.values;
        let on = self.hyperbola(from.gamma, s_0[2]);
        let [x_0, by_q, by_minor] = self.mobilised(on.q, s_0[2]);
        let mobilised = [x_0, by_q * on.by_gamma, by_q * on.by_minor + by_minor];
        let axes = |E: f64| {
            let trial: [f64; N] = array::from_fn(|i| from.stress[i] + E * unit[i]);
            Principal::of(&trial)
        };
        let begin = |s: [f64; 3], E: f64, sin_psi: f64, theta: f64, tolerance: f64| Trial {
            s,
            start: s_0,
            E,
            sin_psi,
            sin_psi_limit: self.sin_psi,
            p_p: from.p_p,
            gamma: from.gamma,
            slowing: part.increment.slowing,
            theta,
            tolerance,
            guesses: true,
        };
        let stiffening = part.increment.stiffening;
        let at_start = self.stiffness(s_0[2]);
        let E = stiffening * at_start.0;
        let u_0 = self.dilatancy(x_0, x_0);
        let axes_1 = &axes(E);
        let mut end_1 = End::new(self, begin(axes_1.values, E, u_0[0], 1.0, PREDICTED));
        self.return_stress(&mut end_1, None)?;
        let s_1 = end_1.solution.s;
        let in_middle = self.stiffness(0.5 * (s_0[2] + s_1[2]));
        let E = stiffening * in_middle.0;
        let moved = self.mobilised(s_1[0] - s_1[2], s_1[2]);
        let u = self.dilatancy(x_0, moved[0]);
        let is_on_cap = self.beyond_cap(&s_0, from.p_p) > -NEARLY * self.size(&s_0);
        let theta = if is_on_cap { 0.5 } else { 1.0 };
        let axes_2 = &axes(E);
        let mut end_2 = End::new(self, begin(axes_2.values, E, u[0], theta, ACCURATE));
        self.return_stress(&mut end_2, Some(&end_1))?;
        let off = (0..3)
            .map(|i| (end_2.solution.s[i] - s_1[i]).abs())
            .fold(0.0, f64::max);
        let size = self.size(&s_0).max(SMALL_STRESS * self.p_ref);
        let error = off / size;
        let end = Point {
            stress: axes_2.compose(&end_2.solution.s),
            p_p: end_2.solution.p_p,
            gamma: end_2.gamma,
        };
        let mut step = Step {
            at: (end, Derivative::ZERO),
            excess: (2.0 * error / self.tolerance - 1.0).clamp(0.0, 1.0),
            error: Rate::ZERO,
        };
        if part.with_derivative && step.excess < 1.0 {
            let passes = Passes {
                start,
                stiffness: [at_start, in_middle],
                mobilised: [mobilised, moved],
                dilatancy: [u_0, u],
                axes: [axes_1, axes_2],
                ends: [&end_1, &end_2],
                strain,
                size,
                error,
                excess: step.excess,
            };
            (step.at.1, step.error) = self.differentiate(&passes, derivative, part);
        }
        Some(step)
    }

    /// The derivative of a step's end, and of its error, from the derivative of its start.
    #[inline]
    fn differentiate<const N: usize>(
        &self,
        step: &Passes<'_, N>,
        from: &Derivative<N>,
        part: &Part<'_, N>,
    ) -> (Derivative<N>, Rate<N>) {
        let ([axes_1, axes_2], [end_1, end_2]) = (step.axes, step.ends);
        let Increment {
            stiffening,
            stiffening_slope,
            ..
        } = part.increment;
        let unit = self.unit_stress(&step.strain);
        let [(E_0, E_0_slope), (E, E_slope)] = step.stiffness;
        let [[_, x_0_by_gamma, x_0_by_minor], [_, x_1_by_q, x_1_by_minor]] = step.mobilised;
        let [at_0, over] = step.dilatancy;
        let (turn_1, turn_2) = (axes_1.turn(), axes_2.turn());
        // Nothing follows a whole increment.
        let is_last = part.fraction >= 1.0;
        let start = (!part.is_first).then(|| step.start.turn().normal(&from.stress));
        let d_s_0 = start.unwrap_or([Rate::ZERO; 3]);
        let d_x_0 = from.gamma * x_0_by_gamma + d_s_0[2] * x_0_by_minor;
        // The trial stress in its axes: that of a strain in them, and what the start and E change.
        let trial = |turn: &Turn<N>, E: f64, d_E: Rate<N>| -> [Rate<N>; N] {
            let unit = turn.stress(&unit);
            let stiffness = part.fraction * E;
            let mut moved = array::from_fn(|i| {
                let mut rate =
                    turn.strain(i) * (if i < 3 { 2.0 } else { 1.0 } * self.G * stiffness);
                if i < 3 {
                    rate.0[..3]
                        .iter_mut()
                        .for_each(|r| *r += self.lambda * stiffness);
                }
                rate + d_E * unit[i]
            });
            if !part.is_first {
                let start = turn.stress(&from.stress);
                moved = array::from_fn(|i| moved[i] + start[i]);
            }
            moved
        };
        let mut of = Rates {
            s: d_s_0,
            start,
            E: d_s_0[2] * (stiffening * E_0_slope) + *stiffening_slope * E_0,
            sin_psi: d_x_0 * (at_0[1] + at_0[2]),
            p_p: from.p_p,
            gamma: from.gamma,
            slowing: part.increment.slowing_slope,
        };
        let moved = trial(&turn_1, stiffening * E_0, of.E);
        of.s = [moved[0], moved[1], moved[2]];
        let d_s_1 = end_1.rates(&of, false).stress;
        let d_middle = (d_s_0[2] + d_s_1[2]) * 0.5;
        of.E = d_middle * (stiffening * E_slope) + *stiffening_slope * E;
        let mut moved = trial(&turn_2, stiffening * E, of.E);
        of.s = [moved[0], moved[1], moved[2]];
        let d_x_1 = (d_s_1[0] - d_s_1[2]) * x_1_by_q + d_s_1[2] * x_1_by_minor;
        of.sin_psi = d_x_0 * over[1] + d_x_1 * over[2];
        let end = end_2.rates(&of, !is_last);
        // Only halves ask for it.
        let error = if step.excess > 0.0 {
            self.error_rate(step, &d_s_0, &d_s_1, &end.stress)
        } else {
            Rate::ZERO
        };
        moved[..3].copy_from_slice(&end.stress);
        for (i, rate) in moved.iter_mut().enumerate().skip(3) {
            *rate = *rate * end_2.kappa(self, &axes_2.values, axes_2.pair(i));
        }
        let derivative = Derivative {
            stress: turn_2.back(&moved),
            p_p: end.p_p,
            gamma: end.gamma,
        };
        (derivative, error)
    }

    /// Rate of the error, from those of the stresses at the start and after the passes.
    #[cold]
    fn error_rate<const N: usize>(
        &self,
        step: &Passes<'_, N>,
        d_s_0: &[Rate<N>; 3],
        d_s_1: &[Rate<N>; 3],
        d_s_2: &[Rate<N>; 3],
    ) -> Rate<N> {
        let s_0 = step.start.values;
        let [s_1, s_2] = step.ends.map(|end| end.solution.s);
        let off: [f64; 3] = array::from_fn(|i| s_2[i] - s_1[i]);
        let worst = (1..3).fold(0, |worst, i| {
            if off[i].abs() > off[worst].abs() {
                i
            } else {
                worst
            }
        });
        let mut rate = (d_s_2[worst] - d_s_1[worst]) * off[worst].signum();
        if self.size(&s_0) > SMALL_STRESS * self.p_ref {
            rate = rate - self.size_rate(&s_0, d_s_0) * step.error;
        }
        rate * (1.0 / step.size)
    }

    /// Carries a point over an increment.
    ///
    /// # Errors
    /// The steps become too many or too small.
    #[inline]
    pub(crate) fn carry<const N: usize>(
        &self,
        start: Point<N>,
        increment: &Increment<N>,
        with_derivative: bool,
    ) -> Result<(Point<N>, Derivative<N>), Failure> {
        let mut at = (start, Derivative::ZERO);
        let mut part = Part {
            increment,
            fraction: 1.0 / f64::from(self.substeps),
            is_first: true,
            with_derivative,
        };
        let mut attempts = MAX_ATTEMPTS;
        for done in 0..self.substeps {
            at = self
                .advance(&at, &part, MAX_HALVINGS, &mut attempts)
                .ok_or(Failure::CutStep {
                    factor: (f64::from(done) + 0.25) * part.fraction,
                    reason: "the steps that the tolerance asks for are too many or too small",
                })?;
            part.is_first = false;
        }
        Ok(at)
    }

    /// A part of the increment in one step, in two halves, or a mean of both in proportion to the error, so that
    /// the result is continuous. None if the steps become too many or too small.
    fn advance<const N: usize>(
        &self,
        from: &(Point<N>, Derivative<N>),
        part: &Part<'_, N>,
        halvings: u32,
        attempts: &mut u32,
    ) -> Option<(Point<N>, Derivative<N>)> {
        *attempts = attempts.checked_sub(1)?;
        let whole = self.step(from, part);
        if let Some(step) = &whole
            && step.excess <= 0.0
        {
            return Some(step.at);
        }
        let halvings = halvings.checked_sub(1)?;
        let mut half = Part {
            fraction: 0.5 * part.fraction,
            ..*part
        };
        let middle = self.advance(from, &half, halvings, attempts)?;
        half.is_first = false;
        let halves = self.advance(&middle, &half, halvings, attempts)?;
        let Some(Step {
            at: (end, derivative),
            excess,
            error,
        }) = whole.filter(|step| step.excess < 1.0)
        else {
            return Some(halves);
        };
        // Smooth at both ends.
        let weight = excess * excess * (3.0 - 2.0 * excess);
        let slope = 6.0 * excess * (1.0 - excess) * 2.0 / self.tolerance;
        let mut mean = (end.sum(1.0 - weight, weight, &halves.0), Derivative::ZERO);
        if part.with_derivative {
            let change = halves.0.sum(1.0, -1.0, &end);
            let rate = derivative.sum(1.0 - weight, weight, &halves.1);
            mean.1 = Derivative {
                stress: array::from_fn(|i| rate.stress[i] + error * (slope * change.stress[i])),
                p_p: rate.p_p + error * (slope * change.p_p),
                gamma: rate.gamma + error * (slope * change.gamma),
            };
        }
        self.harden(&mut mean.0, &mut mean.1);
        Some(mean)
    }

    /// Brings the surfaces to a mean of stresses, which may lie beyond those of the mean variables.
    #[cold]
    fn harden<const N: usize>(&self, point: &mut Point<N>, derivative: &mut Derivative<N>) {
        let principal = Principal::of(&point.stress);
        let s = principal.values;
        let rate = principal.turn().normal(&derivative.stress);
        if self.beyond_shear(&s, point.gamma) > 0.0 {
            let (gamma, by_q, by_minor) = self.gamma(s[0] - s[2], s[2]);
            point.gamma = gamma;
            derivative.gamma = (rate[0] - rate[2]) * by_q + rate[2] * by_minor;
        }
        if self.beyond_cap(&s, point.p_p) > 0.0 {
            let (q, p) = (self.cap.q(&s), ((s[0] + s[1] + s[2]) / 3.0).max(0.0));
            point.p_p = self.cap.size(q, p);
            let by_q = q / (self.cap.M * self.cap.M * point.p_p);
            derivative.p_p = self.cap.q(&rate) * by_q + mean(&rate) * (p / point.p_p);
        }
    }
}
