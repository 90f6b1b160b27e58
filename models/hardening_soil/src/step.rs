//! A step in two passes, Eqs. (13) to (15), and the increment divided into such steps, with the derivative of
//! the result.
//!
//! Compression is positive here.

use crate::return_mapping::{End, MARGIN, Trial};
use crate::soil::Soil;
use crate::spectral::Principal;
use crate::system::Rates;
use abi::Failure;
use std::array;

/// Stress, over p_ref, below which errors are relative to it and not to the stress itself.
const SMALL_STRESS: f64 = 0.02;

/// Stress and internal variables on their way through an increment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point<const N: usize> {
    pub(crate) stress: [f64; N],
    pub(crate) p_p: f64,
    pub(crate) gamma: f64,
}

/// Derivatives of a point by the strain increment, a column for each component.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Derivative<const N: usize> {
    columns: [Point<N>; N],
}

impl<const N: usize> Derivative<N> {
    const ZERO: Self = Self {
        columns: [Point { stress: [0.0; N], p_p: 0.0, gamma: 0.0 }; N],
    };

    /// ∂stress/∂strain, row by row.
    pub(crate) fn tangent(&self) -> [[f64; N]; N] {
        array::from_fn(|i| array::from_fn(|j| self.columns[j].stress[i]))
    }
}

/// A strain increment, and by what factor small strains stiffen the soil in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Increment<const N: usize> {
    pub(crate) strain: [f64; N],
    /// Young's modulus over that of unloading, and its derivative by the strain.
    pub(crate) stiffening: f64,
    pub(crate) stiffening_slope: [f64; N],
}

/// Both passes of a step.
struct Step<const N: usize> {
    start: Principal<N>,
    /// Minor stress at mid-step.
    middle: f64,
    passes: [(Principal<N>, Trial, End); 2],
    /// Whether the shear surface was active at the start.
    is_hardening: bool,
    strain: [f64; N],
    end: Point<N>,
    error: f64,
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

    /// One step: Eqs. (13) to (15). None if a return fails.
    #[inline]
    fn step<const N: usize>(
        &self,
        from: &Point<N>,
        increment: &Increment<N>,
        fraction: f64,
    ) -> Option<Step<N>> {
        let strain = increment.strain.map(|e| fraction * e);
        let unit = self.unit_stress(&strain);
        let start = Principal::of(&from.stress);
        let s_0 = start.values;
        let margin = 100.0 * MARGIN * self.size(&s_0);
        let [shear, limit, cap, _] = self.excess(&s_0, from.p_p, from.gamma);
        let is_hardening = shear > -margin || limit > -margin;
        let pass = |E: f64, sin_psi: Option<f64>, theta: f64, guess: Option<&End>| {
            let trial: [f64; N] = array::from_fn(|i| from.stress[i] + E * unit[i]);
            let principal = Principal::of(&trial);
            let s = principal.values;
            let trial = Trial {
                s,
                start: s_0,
                E,
                sin_psi: sin_psi.unwrap_or_else(|| self.dilatancy(s[0], s[2])[0]),
                sin_psi_limit: self.sin_psi,
                p_p: from.p_p,
                gamma: from.gamma,
                theta,
            };
            let end = self.return_stress(&trial, guess)?;
            Some((principal, trial, end))
        };
        let [u_0, ..] = self.dilatancy(s_0[0], s_0[2]);
        let stiffness = |minor| increment.stiffening * self.stiffness(minor).0;
        let first = pass(stiffness(s_0[2]), is_hardening.then_some(u_0), 1.0, None)?;
        let s_1 = first.2.s;
        let middle = 0.5 * (s_0[2] + s_1[2]);
        let [u_1, ..] = self.dilatancy(s_1[0], s_1[2]);
        let u = if is_hardening { 0.5 * (u_0 + u_1) } else { u_1 };
        let theta = if cap > -margin { 0.5 } else { 1.0 };
        let second = pass(stiffness(middle), Some(u), theta, Some(&first.2))?;
        let s_2 = second.2.s;
        let off = (0..3).map(|i| (s_2[i] - s_1[i]).abs()).fold(0.0, f64::max);
        let end = Point {
            stress: second.0.compose(&s_2),
            p_p: second.2.p_p,
            gamma: second.2.gamma,
        };
        let size = self.size(&s_2).max(self.size(&s_0)).max(SMALL_STRESS * self.p_ref);
        Some(Step {
            start,
            middle,
            passes: [first, second],
            is_hardening,
            strain,
            end,
            error: off / size,
        })
    }

    /// The derivative of a step's end, from that of its start.
    #[inline]
    fn differentiate<const N: usize>(
        &self,
        step: &Step<N>,
        from: &Derivative<N>,
        increment: &Increment<N>,
        fraction: f64,
        is_first: bool,
    ) -> Derivative<N> {
        let [(axes_1, trial_1, end_1), (axes_2, trial_2, end_2)] = &step.passes;
        let unit = self.unit_stress(&step.strain);
        let s_0 = step.start.values;
        let (E_0, E_0_slope) = self.stiffness(s_0[2]);
        let (E, E_slope) = self.stiffness(step.middle);
        let u_0 = self.dilatancy(s_0[0], s_0[2]);
        let u_1 = self.dilatancy(end_1.s[0], end_1.s[2]);
        let u_trial = self.dilatancy(trial_1.s[0], trial_1.s[2]);
        let along = |u: &[f64; 3], s: &[f64; 3]| u[1] * s[0] + u[2] * s[2];
        let (start, turn_1, turn_2) = (step.start.turn(), axes_1.turn(), axes_2.turn());
        let columns = array::from_fn(|j| {
            let column = &from.columns[j];
            let d_s_0 = if is_first { [0.0; 3] } else { start.normal(&column.stress) };
            let mut of = Rates {
                start: d_s_0,
                p_p: column.p_p,
                gamma: column.gamma,
                ..Rates::default()
            };
            let mut strain = [0.0; N];
            strain[j] = fraction;
            let d_unit = self.unit_stress(&strain);
            let stiffening = increment.stiffening_slope[j];
            let trial = |E: f64, d_E: f64| -> [f64; N] {
                array::from_fn(|i| column.stress[i] + E * d_unit[i] + d_E * unit[i])
            };
            of.E = increment.stiffening * E_0_slope * d_s_0[2] + stiffening * E_0;
            of.s = turn_1.normal(&trial(trial_1.E, of.E));
            of.sin_psi = if step.is_hardening {
                along(&u_0, &d_s_0)
            } else {
                along(&u_trial, &of.s)
            };
            let d_s_1 = self.end_rates(trial_1, end_1, &of).s;
            let d_middle = 0.5 * (d_s_0[2] + d_s_1[2]);
            of.E = increment.stiffening * E_slope * d_middle + stiffening * E;
            let moved = turn_2.stress(&trial(trial_2.E, of.E));
            of.s = [moved[0], moved[1], moved[2]];
            of.sin_psi = if step.is_hardening {
                0.5 * (along(&u_0, &d_s_0) + along(&u_1, &d_s_1))
            } else {
                along(&u_1, &d_s_1)
            };
            let end = self.end_rates(trial_2, end_2, &of);
            let kept: [f64; N] = array::from_fn(|i| {
                if i < 3 {
                    end.s[i]
                } else {
                    end_2.kappa(self, trial_2, axes_2.pair(i)) * moved[i]
                }
            });
            Point {
                stress: turn_2.back(&kept),
                p_p: end.p_p,
                gamma: end.gamma,
            }
        });
        Derivative { columns }
    }

    /// Carries a point over an increment in steps, each as large as the tolerance permits: the
    /// increment's `substeps`-th part, halved as often as need be.
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
        /// Halvings of a step.
        const MAX_HALVINGS: u32 = 16;
        /// Steps and attempts beyond those asked for.
        const MAX_ATTEMPTS: u32 = 1000;
        /// A step may double where its error is below this part of the tolerance.
        const SMALL: f64 = 0.125;
        let (mut point, mut derivative) = (start, Derivative::ZERO);
        let each = 1.0 / f64::from(self.substeps);
        let mut is_first = true;
        let mut attempts = 0;
        for part in 0..self.substeps {
            // Place in the part and size of the next step, in units of the smallest step.
            let (mut done, mut halvings) = (0_u32, 0_u32);
            while done < 1 << MAX_HALVINGS {
                let length = 1_u32 << (MAX_HALVINGS - halvings);
                let fraction = each / f64::from(1_u32 << halvings);
                let step = self.step(&point, increment, fraction);
                let Some(step) = step.filter(|s| s.error <= self.tolerance) else {
                    halvings += 1;
                    attempts += 1;
                    if halvings > MAX_HALVINGS || attempts > MAX_ATTEMPTS + self.substeps {
                        let before = f64::from(done) / f64::from(1_u32 << MAX_HALVINGS);
                        return Err(Failure::CutStep {
                            factor: (f64::from(part) + before) * each,
                            reason: "the steps that the tolerance asks for are too many or too small",
                        });
                    }
                    continue;
                };
                if with_derivative {
                    derivative =
                        self.differentiate(&step, &derivative, increment, fraction, is_first);
                }
                point = step.end;
                done += length;
                attempts += 1;
                is_first = false;
                if step.error <= SMALL * self.tolerance && halvings > 0 && done % (2 * length) == 0 {
                    halvings -= 1;
                }
            }
        }
        Ok((point, derivative))
    }
}
