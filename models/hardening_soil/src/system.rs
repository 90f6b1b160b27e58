//! The equations of a return with known active surfaces, Eq. (17): principal stresses as functions of the
//! two multipliers, the conditions that these satisfy, and the derivatives of the result.
//!
//! Compression is positive here; Λ is the multiplier of shear, μ that of the cap.

use crate::cap::Hardening;
use crate::rate::{Linear, Rate, dot, mean, plus, times};
use crate::return_mapping::{Merged, Shear, Trial, Zone};
use crate::soil::Soil;
use crate::step::Point;
use std::array;

/// Stress, multipliers and the derivatives of the conditions at one iterate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Iterate {
    pub(crate) s: [f64; 3],
    /// Λ and μ.
    pub(crate) multipliers: [f64; 2],
    /// The two conditions, kPa; 0 for a surface that is not active.
    pub(crate) residual: [f64; 2],
    /// p and q̃ that the cap's flow follows.
    pub(crate) middle: [f64; 2],
    /// ∂s/∂Λ and ∂s/∂μ.
    by_multiplier: [[f64; 3]; 2],
    /// Derivatives of the conditions by Λ and μ.
    jacobian: [[f64; 2]; 2],
    /// Derivatives of the first condition by σ₃ and γ_ps; that by σ₁ is 1.
    by_minor: f64,
    by_gamma: f64,
    /// Derivatives of the second condition by p and q̃.
    by_pressure: f64,
    by_shear: f64,
    /// Changes of `middle` by those of p and q̃ that leave the flow of the cap out of account.
    response: [[f64; 2]; 2],
    /// p_p and its derivatives by the cap's volume strain and by p_p at the start.
    pub(crate) p_p: f64,
    by_strain: f64,
    by_start: f64,
}

/// Rates of what a return depends on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rates<const N: usize> {
    /// Principal values of the trial stress.
    pub(crate) s: [Rate<N>; 3],
    /// Principal stresses at the start; none if they are given, and p_p and γ_ps with them.
    pub(crate) start: Option<[Rate<N>; 3]>,
    /// Young's modulus, kPa.
    pub(crate) E: Rate<N>,
    /// sin ψ_m.
    pub(crate) sin_psi: Rate<N>,
    pub(crate) p_p: Rate<N>,
    pub(crate) gamma: Rate<N>,
    pub(crate) slowing: Rate<N>,
}

/// A return to known surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct System<'a> {
    soil: &'a Soil,
    pub(crate) trial: Trial,
    pub(crate) zone: Zone,
    /// Gradient of q̃.
    a: [f64; 3],
    /// Trial stress after merging and cut-off.
    s: [f64; 3],
    /// What stress a unit of Λ takes away, and a unit of μ for each unit of p and q̃.
    by_shear: [f64; 3],
    by_p: [f64; 3],
    by_q: [f64; 3],
    /// p and q̃ of `s`, of what Λ takes away, and of the last two, p first.
    of_s: [f64; 2],
    of_shear: [f64; 2],
    coupling: [[f64; 2]; 2],
    /// p and q̃ at the start, by their weight over that of the end.
    start: [f64; 2],
    hardening: Hardening,
}

impl<'a> System<'a> {
    /// No active surface yet.
    #[inline]
    pub(crate) fn new(soil: &'a Soil, trial: Trial) -> Self {
        Self {
            soil,
            trial,
            zone: Zone::ELASTIC,
            a: [0.0; 3],
            s: trial.s,
            by_shear: [0.0; 3],
            by_p: [0.0; 3],
            by_q: [0.0; 3],
            of_s: [0.0; 2],
            of_shear: [0.0; 2],
            coupling: [[0.0; 2]; 2],
            start: [0.0; 2],
            hardening: Hardening::default(),
        }
    }

    /// Makes the surfaces of a zone active.
    #[inline]
    pub(crate) fn enter(&mut self, zone: Zone) {
        self.zone = zone;
        self.s = self.condensed(&self.trial.s, self.soil.R_t);
        self.by_shear = if zone.shear == Shear::None {
            [0.0; 3]
        } else {
            self.elastic(&self.flow(self.sin_psi()))
        };
        if zone.cap {
            self.add_cap();
        }
    }

    #[inline]
    fn add_cap(&mut self) {
        let Soil { cap, .. } = self.soil;
        let theta = self.trial.theta;
        self.hardening = cap.hardening(self.soil, self.trial.p_p);
        self.a = cap.gradient(self.zone.merged);
        let start = [mean(&self.trial.start), cap.q(&self.trial.start)];
        self.start = start.map(|x| x * (1.0 - theta) / theta);
        self.of_s = [mean(&self.s), dot(&self.a, &self.s)];
        self.of_shear = [mean(&self.by_shear), dot(&self.a, &self.by_shear)];
        let factor = 2.0 / (cap.M * cap.M);
        self.by_p = if self.zone.cylinder {
            [0.0; 3]
        } else {
            self.elastic(&[2.0 / 3.0; 3])
        };
        self.by_q = self.elastic(&self.a.map(|a| factor * a));
        self.coupling = [
            [mean(&self.by_p), mean(&self.by_q)],
            [dot(&self.a, &self.by_p), dot(&self.a, &self.by_q)],
        ];
    }

    /// sin ψ_m of the flow: at the strength that of ψ.
    #[inline]
    fn sin_psi(&self) -> f64 {
        if self.zone.shear == Shear::Limit {
            self.trial.sin_psi_limit
        } else {
            self.trial.sin_psi
        }
    }

    /// Direction of shear flow, Eq. (5); on an edge the mean of its sides.
    #[inline]
    fn flow(&self, u: f64) -> [f64; 3] {
        let (major, minor) = (0.5 * (1.0 - u), -0.5 * (1.0 + u));
        match self.zone.merged {
            Merged::None => [major, 0.0, minor],
            Merged::First12 => [0.5 * major, 0.5 * major, minor],
            Merged::Last23 => [major, 0.5 * minor, 0.5 * minor],
        }
    }

    /// What γ_ps grows by, Eq. (5), and its derivatives by Λ, sin ψ_m, and the difference of plastic strains that
    /// an edge of equal major stresses closes.
    #[inline]
    pub(crate) fn growth(&self, Lambda: f64) -> [f64; 4] {
        let h = self.trial.slowing;
        let u = self.sin_psi();
        if self.zone.merged == Merged::First12 {
            let apart = self.apart(self.trial.s[0] - self.trial.s[1]);
            if apart < 0.5 * Lambda * (1.0 - u) {
                let share = 0.5 * h * (1.0 + u);
                return [share * Lambda + h * apart, share, 0.5 * h * Lambda, h];
            }
        }
        [h * Lambda, h, 0.0, 0.0]
    }

    /// Size of the stress that flow along the shear surface takes away, kPa.
    #[inline]
    pub(crate) fn taken_by_shear(&self, Lambda: f64) -> f64 {
        (Lambda * self.soil.G * self.trial.E).abs()
    }

    /// Difference of plastic strains that makes stresses equal.
    #[inline]
    fn apart<T: Linear>(&self, difference: T) -> T {
        difference * (0.5 / (self.soil.G * self.trial.E))
    }

    /// The mean of merged stresses, and what the cut-off makes of them, Eq. (16).
    #[inline]
    fn condensed<T: Linear>(&self, s: &[T; 3], R_t: T) -> [T; 3] {
        let nu = self.soil.nu;
        let [mut s1, mut s2, mut s3] = *s;
        match self.zone.merged {
            Merged::None => {}
            Merged::First12 => {
                s1 = (s1 + s2) * 0.5;
                s2 = s1;
            }
            Merged::Last23 => {
                s2 = (s2 + s3) * 0.5;
                s3 = s2;
            }
        }
        if !self.zone.tension {
            return [s1, s2, s3];
        }
        let least = R_t * -1.0;
        if self.zone.merged == Merged::Last23 {
            return [s1 - (s3 + R_t) * (2.0 * nu), least, least];
        }
        let change = (s3 + R_t) * (nu / (1.0 - nu));
        [s1 - change, s2 - change, least]
    }

    /// Stress of a strain; at the cut-off the stress that it does not take away, Eq. (16).
    #[inline]
    fn elastic(&self, strain: &[f64; 3]) -> [f64; 3] {
        let Soil { lambda, G, .. } = *self.soil;
        let E = self.trial.E;
        if !self.zone.tension {
            let volume = lambda * E * (strain[0] + strain[1] + strain[2]);
            return strain.map(|e| volume + 2.0 * G * E * e);
        }
        if self.zone.merged == Merged::Last23 {
            return [E * strain[0], 0.0, 0.0];
        }
        let plane = 2.0 * G * lambda / (lambda + 2.0 * G) * E * (strain[0] + strain[1]);
        [
            plane + 2.0 * G * E * strain[0],
            plane + 2.0 * G * E * strain[1],
            0.0,
        ]
    }

    /// [`Iterate::response`]: the inverse of two linear equations, since the cap's flow depends on the stress.
    #[inline]
    fn response(&self, mu: f64) -> [[f64; 2]; 2] {
        let theta = self.trial.theta;
        let w = mu * theta;
        let [[pp, pq], [qp, qq]] = self.coupling;
        let (pp, pq, qp, qq) = (1.0 + w * pp, w * pq, w * qp, 1.0 + w * qq);
        let scale = theta / (pp * qq - pq * qp);
        [[qq * scale, -pq * scale], [-qp * scale, pp * scale]]
    }

    /// What the cap's flow along p and q̃ takes away.
    #[inline]
    fn taken(&self, [p, q]: [f64; 2]) -> [f64; 3] {
        array::from_fn(|i| p * self.by_p[i] + q * self.by_q[i])
    }

    /// Stress, conditions and their derivatives.
    #[inline]
    pub(crate) fn evaluate(&self, multipliers: [f64; 2], end: &mut Iterate) {
        end.multipliers = multipliers;
        end.s = plus(&self.s, -multipliers[0], &self.by_shear);
        end.by_multiplier = [self.by_shear.map(|x| -x), [0.0; 3]];
        if self.zone.cap {
            self.flow_along_cap(end);
        }
        if self.zone.shear != Shear::None {
            self.limit_shear(end);
        }
    }

    /// Stress after the cap's flow, and the second condition.
    #[inline]
    fn flow_along_cap(&self, end: &mut Iterate) {
        let ([Lambda, mu], theta, M) = (end.multipliers, self.trial.theta, self.soil.cap.M);
        end.response = self.response(mu);
        let direct = array::from_fn(|i| self.start[i] + self.of_s[i] - Lambda * self.of_shear[i]);
        end.middle = times(&end.response, direct);
        let by_Lambda = times(&end.response, self.of_shear).map(|x| -x);
        let by_mu = times(&end.response, times(&self.coupling, end.middle)).map(|x| -x);
        let flow = self.taken(end.middle);
        end.s = plus(&end.s, -mu, &flow);
        let [by_1, by_2] = &mut end.by_multiplier;
        *by_1 = plus(by_1, -mu, &self.taken(by_Lambda));
        *by_2 = plus(&flow.map(|x| -x), -mu, &self.taken(by_mu));
        let [p, q] = array::from_fn(|i| end.middle[i] / theta - self.start[i]);
        let size = self.soil.cap.size(q, p);
        let mut hardened;
        if self.zone.cylinder {
            hardened = self.hardening.after(0.0);
            hardened.by_strain = 0.0;
        } else {
            hardened = self.hardening.after(2.0 * mu * end.middle[0]);
        }
        (end.p_p, end.by_strain, end.by_start) =
            (hardened.p_p, hardened.by_strain, hardened.by_start);
        end.residual[1] = size - hardened.p_p;
        end.by_pressure = p.max(0.0) / size - hardened.by_strain * 2.0 * mu * theta;
        end.by_shear = q / (M * M * size);
        end.jacobian[1] = [by_Lambda, by_mu]
            .map(|[by_p, by_q]| (end.by_pressure * by_p + end.by_shear * by_q) / theta);
        end.jacobian[1][1] -= hardened.by_strain * 2.0 * end.middle[0];
    }

    /// The first condition.
    #[inline]
    fn limit_shear(&self, end: &mut Iterate) {
        let [growth, weight, ..] = self.growth(end.multipliers[0]);
        let (q, by_minor);
        if self.zone.shear == Shear::Hardening {
            let on = self.soil.hyperbola(self.trial.gamma + growth, end.s[2]);
            (q, by_minor) = (on.q, on.by_minor);
            end.by_gamma = -on.by_gamma;
        } else {
            (q, by_minor) = self.soil.q_f(end.s[2]);
        }
        end.residual[0] = end.s[0] - end.s[2] - q;
        end.by_minor = -1.0 - by_minor;
        end.jacobian[0] = end.by_multiplier.map(|by| by[0] + end.by_minor * by[2]);
        end.jacobian[0][0] += end.by_gamma * weight;
    }

    /// The iterate after a small change of the multipliers; its derivatives stay.
    #[inline]
    pub(crate) fn correct(&self, end: &mut Iterate, step: [f64; 2]) {
        let [by_Lambda, by_mu] = end.by_multiplier;
        end.s = array::from_fn(|i| end.s[i] + step[0] * by_Lambda[i] + step[1] * by_mu[i]);
        end.multipliers = [end.multipliers[0] + step[0], end.multipliers[1] + step[1]];
        if self.zone.cap {
            end.middle = self.middle(&end.s);
            if !self.zone.cylinder {
                let volume = 2.0 * end.multipliers[1] * end.middle[0];
                end.p_p = self.hardening.after(volume).p_p;
            }
        }
    }

    /// p and q̃ that the cap's flow follows.
    #[inline]
    fn middle(&self, s: &[f64; 3]) -> [f64; 2] {
        let of_s = [mean(s), dot(&self.a, s)];
        array::from_fn(|i| self.trial.theta * (self.start[i] + of_s[i]))
    }

    /// What the minor stress, with that merged into it, lacks of the cut-off without flow along its normal, kPa.
    #[inline]
    fn beyond_cut_off(&self, end: &Iterate) -> f64 {
        let Soil { lambda, G, cap, .. } = self.soil;
        let [Lambda, mu] = end.multipliers;
        let shear = self.flow(self.sin_psi());
        let [p, q] = end.middle;
        let p = if self.zone.cylinder { 0.0 } else { p };
        let flow: [f64; 3] = array::from_fn(|i| {
            Lambda * shear[i] + mu * (2.0 / 3.0 * p + 2.0 * q / (cap.M * cap.M) * self.a[i])
        });
        let trial = match self.zone.merged {
            Merged::Last23 => 0.5 * (self.trial.s[1] + self.trial.s[2]),
            _ => self.trial.s[2],
        };
        let E = self.trial.E;
        let free = trial - E * (lambda * (flow[0] + flow[1] + flow[2]) + 2.0 * G * flow[2]);
        -self.soil.R_t - free
    }

    /// Whether the cut-off has to hold the stress back at this end.
    #[inline]
    pub(crate) fn needs_cut_off(&self, end: &Iterate, margin: f64) -> bool {
        self.beyond_cut_off(end) >= -margin
    }

    /// Whether flow on one side of the edge would carry the merged stresses past each other.
    #[inline]
    pub(crate) fn merges(&self, end: &Iterate) -> bool {
        let Soil { lambda, G, cap, .. } = self.soil;
        let [Lambda, mu] = end.multipliers;
        let t = &self.trial.s;
        let u = self.sin_psi();
        let side = cap.gradient(Merged::None);
        let along_q = mu * 2.0 * end.middle[1] / (cap.M * cap.M);
        let (gap, closing) = match self.zone.merged {
            Merged::None => return true,
            Merged::First12 => (
                t[0] - t[1],
                0.5 * Lambda * (1.0 - u) + along_q * (side[0] - side[1]),
            ),
            Merged::Last23 => (
                t[1] - t[2],
                0.5 * Lambda * (1.0 + u) + along_q * (side[1] - side[2]),
            ),
        };
        let mut closed = 2.0 * G * self.trial.E * closing;
        if self.zone.tension && self.zone.merged == Merged::Last23 {
            closed += 2.0 * G / (lambda + G) * self.beyond_cut_off(end);
        }
        gap <= closed
    }

    /// Rates of principal stresses, p_p and γ_ps at the end; the last two only if they are asked for.
    #[inline]
    pub(crate) fn rates<const N: usize>(
        &self,
        end: &Iterate,
        of: &Rates<N>,
        with_variables: bool,
    ) -> Point<3, Rate<N>> {
        let [Lambda, mu] = end.multipliers;
        let theta = self.trial.theta;
        let old = 1.0 - theta;
        // All stress that flow takes away grows with E.
        let flow = self.taken(end.middle);
        let by_E = array::from_fn(|i| -(Lambda * self.by_shear[i] + mu * flow[i]) / self.trial.E);
        let mut fixed = plus(&self.condensed(&of.s, Rate::ZERO), of.E, &by_E);
        let mut gamma = of.gamma;
        let [growth, weight, by_u, by_apart] = self.growth(Lambda);
        if self.zone.shear == Shear::Hardening {
            let (zero, one) = (self.flow(0.0), self.flow(1.0));
            let turned = self.elastic(&array::from_fn(|i| -Lambda * (one[i] - zero[i])));
            fixed = plus(&fixed, of.sin_psi, &turned);
            gamma = gamma + of.slowing * (growth / self.trial.slowing);
            if by_apart != 0.0 {
                let difference = (self.trial.s[0] - self.trial.s[1]) / self.trial.E;
                let apart = self.apart(of.s[0] - of.s[1] - of.E * difference);
                gamma = gamma + of.sin_psi * by_u + apart * by_apart;
            }
        }
        let before = of.start.map(|s| [mean(&s), self.soil.cap.q(&s)]);
        if self.zone.cap {
            let along = |s: &[Rate<N>; 3], [p, q]: [Rate<N>; 2]| -> [Rate<N>; 3] {
                plus(&plus(s, p, &self.by_p), q, &self.by_q)
            };
            if let Some(before) = before {
                fixed = along(&fixed, before.map(|x| x * (-mu * old)));
            }
            let response = end.response.map(|row| row.map(|x| -mu * x));
            fixed = along(
                &fixed,
                times(&response, [mean(&fixed), dot(&self.a, &fixed)]),
            );
        }
        let mut change = [Rate::ZERO; 2];
        if self.zone.shear != Shear::None {
            change[0] = fixed[0] + fixed[2] * end.by_minor + gamma * end.by_gamma;
        }
        if self.zone.cap {
            let normal = self.a.map(|a| end.by_pressure / 3.0 + a * end.by_shear);
            change[1] = dot(&normal, &fixed);
            if let Some([p_0, _]) = before {
                let volume = p_0 * (end.by_strain * 2.0 * mu * old);
                change[1] = change[1] - of.p_p * end.by_start - volume;
            }
        }
        let [d_Lambda, d_mu] = end.correction(&change);
        let [by_Lambda, by_mu] = &end.by_multiplier;
        let mut s = plus(&fixed, d_Lambda, by_Lambda);
        if self.zone.cap {
            s = plus(&s, d_mu, by_mu);
        }
        let mut rates = Point {
            stress: s,
            p_p: of.p_p,
            gamma: of.gamma,
        };
        if !with_variables {
            return rates;
        }
        if self.zone.cap {
            let mut p = mean(&s) * theta;
            if let Some([p_0, _]) = before {
                p = p + p_0 * old;
            }
            let volume = d_mu * end.middle[0] + p * mu;
            rates.p_p = of.p_p * end.by_start + volume * (2.0 * end.by_strain);
        }
        match self.zone.shear {
            Shear::None => {}
            Shear::Hardening => rates.gamma = gamma + d_Lambda * weight,
            Shear::Limit => {
                let (reached, by_q, by_minor) = self.soil.gamma(end.s[0] - end.s[2], end.s[2]);
                if reached > self.trial.gamma {
                    rates.gamma = (s[0] - s[2]) * by_q + s[2] * by_minor;
                }
            }
        }
        rates
    }
}

impl Iterate {
    /// Without active surfaces.
    #[inline]
    pub(crate) fn new(s: [f64; 3], p_p: f64) -> Self {
        Self {
            s,
            multipliers: [0.0; 2],
            residual: [0.0; 2],
            middle: [0.0; 2],
            by_multiplier: [[0.0; 3]; 2],
            jacobian: [[1.0, 0.0], [0.0, 1.0]],
            by_minor: 0.0,
            by_gamma: 0.0,
            by_pressure: 0.0,
            by_shear: 0.0,
            response: [[0.0; 2]; 2],
            p_p,
            by_strain: 0.0,
            by_start: 1.0,
        }
    }

    /// −J⁻¹ x.
    #[inline]
    pub(crate) fn correction<T: Linear>(&self, x: &[T; 2]) -> [T; 2] {
        let [[a, b], [c, d]] = self.jacobian;
        let scale = -1.0 / (a * d - b * c);
        [
            x[0] * (d * scale) - x[1] * (b * scale),
            x[1] * (a * scale) - x[0] * (c * scale),
        ]
    }
}
