//! Stiffness at small strains, Eqs. (23) to (27): from the history of strain and the increment alone.
//!
//! Compression is positive here.

use crate::soil::Soil;
use crate::spectral::Principal;
use abi::Refusal;
use std::array;

/// a of Eq. (23): the secant stiffness at γ_0.7 is 1/1.385 = 0.722 of the initial one.
const A: f64 = 0.385;

/// Decay of the stiffness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SmallStrain {
    /// Initial shear modulus over that of unloading.
    pub(crate) initial: f64,
    gamma_07: f64,
    /// Exponent and factor of Eq. (27).
    exponent: f64,
    factor: f64,
}

/// The memory of strain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Memory<const N: usize> {
    /// Deviatoric strain since the last reversals, engineering shear.
    pub(crate) strain: [f64; N],
    /// 1 before the first reversal, 2 after it.
    pub(crate) branch: f64,
    /// Least shear modulus so far over that of unloading.
    pub(crate) least: f64,
}

/// What an increment makes of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Remembered<const N: usize> {
    pub(crate) memory: Memory<N>,
    /// Mean shear modulus over that of unloading, and that at the end.
    pub(crate) mean: f64,
    pub(crate) end: f64,
    /// Mean of Eq. (27).
    pub(crate) slowing: f64,
}

impl SmallStrain {
    /// # Errors
    /// The initial modulus is below that of unloading.
    pub(crate) fn new(soil: &Soil, G_0: f64, gamma_07: f64) -> Result<Self, Refusal> {
        let G_ur = soil.E_ur * soil.G;
        if G_0 < G_ur {
            let reason = format!("{G_0} kPa is below G_ur = e_ur_ref/(2 (1 + nu_ur)) = {G_ur} kPa");
            return Err(Refusal::new("g_0_ref", reason));
        }
        let mut small = Self {
            initial: G_0 / G_ur,
            gamma_07,
            // 1 + E_ur/(2 E_i), from 2/E_i and 2/E_ur.
            exponent: 1.0 + 0.5 * soil.a_i / soil.a_ur,
            factor: 1.0,
        };
        small.keep_secant(soil);
        Ok(small)
    }

    /// The factor of Eq. (27), by bisection: with it the axial strain at half the strength is as without small
    /// strains.
    fn keep_secant(&mut self, soil: &Soil) {
        const HALVINGS: u32 = 40;
        let unchanged = Self {
            initial: 1.0,
            ..*self
        };
        let expected = unchanged.axial_strain(soil);
        let (mut low, mut high) = (0.1, 1.0);
        for _ in 0..HALVINGS {
            self.factor = 0.5 * (low + high);
            if self.axial_strain(soil) > expected {
                low = self.factor;
            } else {
                high = self.factor;
            }
        }
    }

    /// Axial strain at half the strength in drained triaxial compression under p_ref, by Heun's method.
    fn axial_strain(&self, soil: &Soil) -> f64 {
        const STEPS: u32 = 200;
        let s3 = soil.p_ref;
        let E_ur = soil.stiffness(s3).0;
        let step = 0.5 * soil.q_f(s3).0 / f64::from(STEPS);
        // Rates of ε_a − ε_r and of ε_a by q.
        let rates = |q: f64, gamma: f64| {
            let ratio = self.tangent(gamma, 1.0);
            let [x, ..] = soil.mobilised(q, s3);
            let [u, ..] = soil.dilatancy(x, x);
            let plastic = soil.gamma(q, s3).1 / self.slowing(ratio);
            [
                (1.0 + soil.nu) / (ratio * E_ur) + 0.25 * (3.0 - u) * plastic,
                1.0 / (ratio * E_ur) + 0.5 * (1.0 - u) * plastic,
            ]
        };
        let (mut gamma, mut axial) = (0.0, 0.0);
        for i in 0..STEPS {
            let q = f64::from(i) * step;
            let first = rates(q, gamma);
            let second = rates(q + step, gamma + step * first[0]);
            gamma += 0.5 * step * (first[0] + second[0]);
            axial += 0.5 * step * (first[1] + second[1]);
        }
        axial
    }

    /// Tangent modulus over that of unloading, Eq. (23).
    fn tangent(&self, gamma: f64, branch: f64) -> f64 {
        let decay = 1.0 + A * gamma / (branch * self.gamma_07);
        (self.initial / (decay * decay)).max(1.0)
    }

    /// Its mean between two strains, by the integral.
    fn mean(&self, from: f64, to: f64, branch: f64) -> f64 {
        if (to - from).abs() <= 1e-6 * self.gamma_07 {
            return self.tangent(0.5 * (from + to), branch);
        }
        let threshold = branch * self.gamma_07;
        let end = threshold / A * (self.initial.sqrt() - 1.0);
        let stress = |gamma: f64| {
            let x = gamma.min(end);
            self.initial * x / (1.0 + A * x / threshold) + (gamma - x)
        };
        (stress(to) - stress(from)) / (to - from)
    }

    /// h of Eq. (27); with `MOST` hardly any plastic shear strain is left.
    fn slowing(&self, least: f64) -> f64 {
        const MOST: f64 = 1e6;
        (self.factor * least.powf(self.exponent)).min(MOST)
    }

    /// The memory after a strain increment, Eqs. (24) to (26).
    pub(crate) fn remember<const N: usize>(
        &self,
        memory: &Memory<N>,
        increment: &[f64; N],
    ) -> Remembered<N> {
        // As components of tensors.
        let halved = |e: &[f64; N]| -> [f64; N] {
            array::from_fn(|i| if i < 3 { e[i] } else { 0.5 * e[i] })
        };
        let mut deviator = halved(increment);
        let mean = (deviator[0] + deviator[1] + deviator[2]) / 3.0;
        deviator[..3].iter_mut().for_each(|e| *e -= mean);
        let history = halved(&memory.strain);
        let moves = deviator.iter().any(|e| *e != 0.0);
        let seen = Principal::of(if moves { &deviator } else { &history });
        let turn = seen.turn();
        let e = seen.values;
        let norm = e.iter().map(|e| e * e).sum::<f64>().sqrt();
        let mut old = turn.stress(&history);
        let mut branch = memory.branch;
        if moves {
            let turned = array::from_fn::<_, 3, _>(|k| old[k] * e[k] < 0.0);
            let major = if e[0] >= -e[2] { 0 } else { 2 };
            if turned[major] {
                branch = 2.0;
            }
            for row in 0..N {
                let [p, q] = if row < 3 { [row, row] } else { seen.pair(row) };
                if turned[p] || turned[q] {
                    old[row] = 0.0;
                }
            }
        }
        let new: [f64; N] = array::from_fn(|i| old[i] + if i < 3 && moves { e[i] } else { 0.0 });
        // √3 ‖H e‖/‖e‖.
        let size = |h: &[f64; N]| {
            let square = (0..N).map(|row| {
                if row < 3 {
                    (h[row] * e[row]).powi(2)
                } else {
                    let [p, q] = seen.pair(row);
                    h[row] * h[row] * (e[p] * e[p] + e[q] * e[q])
                }
            });
            if norm > 0.0 {
                (3.0 * square.sum::<f64>()).sqrt() / norm
            } else {
                0.0
            }
        };
        let (from, to) = (size(&old), size(&new));
        let end = self.tangent(to, branch);
        let least = memory.least.min(end);
        let back = turn.back(&new);
        Remembered {
            memory: if moves {
                Memory {
                    strain: array::from_fn(|i| if i < 3 { back[i] } else { 2.0 * back[i] }),
                    branch,
                    least,
                }
            } else {
                *memory
            },
            mean: self.mean(from, to, branch),
            end,
            slowing: 0.5 * (self.slowing(memory.least) + self.slowing(least)),
        }
    }
}
