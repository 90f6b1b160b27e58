//! The return of principal stresses to the shear surface, the strength, the cap and the tensile cut-off:
//! which of them are active, Eqs. (15) to (17).
//!
//! Compression is positive here.

use crate::rate::{Rate, mean};
use crate::soil::Soil;
use crate::step::Point;
use crate::system::{Iterate, Rates, System};
use std::mem;

/// What limits the shear stress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shear {
    None,
    /// The shear surface, which hardens.
    Hardening,
    /// The strength.
    Limit,
}

/// Principal stresses that the return makes equal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Merged {
    None,
    First12,
    Last23,
}

/// The active surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "surfaces are active or not")]
pub(crate) struct Zone {
    pub(crate) merged: Merged,
    pub(crate) shear: Shear,
    pub(crate) cap: bool,
    /// Whether the cap is its cylinder along negative p, which does not harden.
    pub(crate) cylinder: bool,
    pub(crate) tension: bool,
    /// All stresses at the apex or at the tensile strength; nothing else then counts.
    pub(crate) corner: bool,
}

impl Zone {
    pub(crate) const ELASTIC: Self = Self {
        merged: Merged::None,
        shear: Shear::None,
        cap: false,
        cylinder: false,
        tension: false,
        corner: false,
    };

    /// The same zone without the cap.
    #[inline]
    fn without_cap(self) -> Self {
        Self {
            cap: false,
            cylinder: false,
            ..self
        }
    }

    /// The zone to try next, where `other` is due, with multipliers to start from; `base` is what the trial stress
    /// merges.
    #[inline]
    fn followed_by(self, mut other: Self, base: Merged, multipliers: &mut [f64; 2]) -> Self {
        let is_active = [other.shear != Shear::None, other.cap];
        for (x, is_active) in multipliers.iter_mut().zip(is_active) {
            *x = if is_active { *x } else { 0.0 };
        }
        // Less flow may not close the gap any more; more flow does.
        let is_less =
            (self.cap && !other.cap) || (self.shear != Shear::None && other.shear == Shear::None);
        if is_less {
            other.merged = base;
        }
        if other.shear == Shear::None && !other.cap {
            other.merged = Merged::None;
        }
        other
    }

    /// Whether a stress in it solves equations.
    #[inline]
    fn has_equations(self) -> bool {
        !self.corner && !self.is_elastic()
    }

    #[inline]
    fn is_elastic(self) -> bool {
        self.shear == Shear::None && !self.cap && !self.tension && !self.corner
    }
}

/// What a return starts from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trial {
    /// Trial stresses, descending, kPa.
    pub(crate) s: [f64; 3],
    /// Principal stresses at the start, descending, kPa.
    pub(crate) start: [f64; 3],
    /// Young's modulus, kPa.
    pub(crate) E: f64,
    /// sin ψ_m of hardening, and of flow at the strength.
    pub(crate) sin_psi: f64,
    pub(crate) sin_psi_limit: f64,
    pub(crate) p_p: f64,
    pub(crate) gamma: f64,
    /// What γ_ps grows by over the plastic shear strain.
    pub(crate) slowing: f64,
    /// Weight of the end in the direction of the cap's flow; the rest is that of the start.
    pub(crate) theta: f64,
    /// Residual, over the stress, from which on a last correction is enough.
    pub(crate) tolerance: f64,
    /// Whether to guess edges and surfaces before a solution shows them.
    pub(crate) guesses: bool,
}

/// Where a trial stress returns to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End<'a> {
    /// The equations and their solution; of an elastic return or one to the corner only the zone, stress and p_p count.
    pub(crate) system: System<'a>,
    pub(crate) solution: Iterate,
    pub(crate) gamma: f64,
}

/// Relative margin of a surface that a stress is on.
pub(crate) const MARGIN: f64 = 1e-11;

/// Attempts to find the active surfaces.
const MAX_ZONES: u32 = 16;

impl Soil {
    /// The size that margins are relative to, kPa.
    #[inline]
    pub(crate) fn size(&self, s: &[f64; 3]) -> f64 {
        let cohesion = self.c_cos_phi;
        s[0].abs().max(s[2].abs()).max(cohesion)
    }

    /// Rate of [`size`](Self::size).
    #[inline]
    pub(crate) fn size_rate<const N: usize>(&self, s: &[f64; 3], rate: &[Rate<N>; 3]) -> Rate<N> {
        let (major, minor) = (s[0].abs(), s[2].abs());
        if major.max(minor) < self.c_cos_phi {
            Rate::ZERO
        } else if major >= minor {
            rate[0] * s[0].signum()
        } else {
            rate[2] * s[2].signum()
        }
    }

    /// By how much stresses lie beyond the shear surface, kPa.
    #[inline]
    pub(crate) fn beyond_shear(&self, s: &[f64; 3], gamma: f64) -> f64 {
        s[0] - s[2] - self.hyperbola(gamma, s[2]).q
    }

    /// By how much stresses lie beyond the strength, kPa.
    #[inline]
    fn beyond_limit(&self, s: &[f64; 3]) -> f64 {
        s[0] - s[2] - self.q_f(s[2]).0
    }

    /// By how much stresses lie beyond the cap, kPa.
    #[inline]
    pub(crate) fn beyond_cap(&self, s: &[f64; 3], p_p: f64) -> f64 {
        self.cap.size(self.cap.q(s), mean(s)) - p_p
    }

    /// Whether stresses lie beyond the cut-off.
    #[inline]
    fn is_beyond_cut_off(&self, s: &[f64; 3], margin: f64) -> bool {
        self.is_cut_off && -self.R_t - s[2] > margin
    }

    /// The surfaces that a trial stress lies beyond.
    #[inline]
    fn violated(&self, trial: &Trial, margin: f64) -> Zone {
        let s = &trial.s;
        // The strength bounds the hardening from outside: its solution is where to begin. Flow along it leaves less
        // to the cap, or nothing.
        let is_limit = self.beyond_limit(s) > margin;
        let cap = !is_limit && self.beyond_cap(s, trial.p_p) > margin;
        Zone {
            shear: if is_limit {
                Shear::Limit
            } else if self.beyond_shear(s, trial.gamma) > margin {
                Shear::Hardening
            } else {
                Shear::None
            },
            cap,
            cylinder: cap && s.iter().sum::<f64>() <= 0.0,
            tension: self.is_beyond_cut_off(s, margin),
            ..Zone::ELASTIC
        }
    }

    /// Whether a trial stress is within all surfaces; those that it most often lies beyond come first.
    #[inline]
    fn is_within(&self, trial: &Trial, margin: f64) -> bool {
        let s = &trial.s;
        self.beyond_cap(s, trial.p_p) <= margin
            && self.beyond_limit(s) <= margin
            && !self.is_beyond_cut_off(s, margin)
            && self.beyond_shear(s, trial.gamma) <= margin
    }

    /// Returns the trial stress of `end`, Eq. (15), at last with the cap's flow of the end alone. None if the
    /// iterations fail: then a smaller step may not.
    /// `guess` is a return from nearby, whose zone and multipliers are where to begin.
    #[inline]
    pub(crate) fn return_stress<'a>(
        &'a self,
        end: &mut End<'a>,
        guess: Option<&End<'a>>,
    ) -> Option<()> {
        let theta = end.system.trial.theta;
        [
            (true, theta, guess),
            (false, theta, guess),
            (false, 1.0, None),
        ]
        .into_iter()
        .find_map(|(guesses, theta, guess)| {
            end.system.trial.guesses = guesses;
            end.system.trial.theta = theta;
            self.try_return(end, guess)
        })
    }

    fn try_return<'a>(&'a self, end: &mut End<'a>, guess: Option<&End<'a>>) -> Option<()> {
        let End {
            system,
            solution,
            gamma,
        } = end;
        let s = system.trial.s;
        let size = self.size(&s);
        let margin = MARGIN * size;
        let guess = guess.filter(|end| end.system.zone.has_equations());
        let mut zone = match guess {
            Some(end) if !self.is_within(&system.trial, margin) => end.system.zone,
            _ => self.violated(&system.trial, margin),
        };
        if zone.is_elastic() {
            *end = End::new(self, system.trial);
            return Some(());
        }
        let equal = |x: f64, y: f64| x - y <= margin;
        let base = if equal(s[1], s[2]) {
            Merged::Last23
        } else if equal(s[0], s[1]) {
            Merged::First12
        } else {
            Merged::None
        };
        let mut multipliers = [0.0; 2];
        if let Some(end) = guess {
            multipliers = end.solution.multipliers;
        } else if zone.shear != Shear::None || zone.cap {
            zone.merged = base;
            if system.trial.guesses && base == Merged::None {
                // What was on an edge mostly stays there.
                zone.merged = self.edge(&system.trial.start);
            }
        }
        let mut is_guess = zone.merged != base;
        let (mut may_harden, mut failures) = (true, 0);
        for _ in 0..MAX_ZONES {
            system.enter(zone);
            if solve(system, solution, multipliers, size).is_none() {
                if multipliers[0] + multipliers[1] > 0.0 {
                    multipliers = [0.0; 2];
                    continue;
                }
                if !zone.cap || zone.shear == Shear::None {
                    return None;
                }
                // Either of them may be the way to both, or enough.
                failures += 1;
                match failures {
                    1 => zone = zone.without_cap(),
                    2 => zone.shear = Shear::None,
                    _ => return None,
                }
                continue;
            }
            multipliers = solution.multipliers.map(|x| x.max(0.0));
            if mem::take(&mut is_guess) && !system.merges(solution) {
                zone.merged = base;
                continue;
            }
            match self.judge(system, solution, margin, may_harden) {
                Verdict::Ends(_) if zone.merged != base && !system.merges(solution) => {
                    zone.merged = base;
                }
                Verdict::Ends(reached) => {
                    *gamma = reached;
                    return Some(());
                }
                Verdict::Corner => {
                    *end = End::new(self, system.trial);
                    end.system.zone.corner = true;
                    end.solution.s = [-self.R_t; 3];
                    return Some(());
                }
                Verdict::None => return None,
                Verdict::Merge(merged) => zone.merged = merged,
                Verdict::Other(other) => {
                    if zone.shear == Shear::Limit && other.shear == Shear::Hardening {
                        may_harden = false;
                    }
                    zone = zone.followed_by(other, base, &mut multipliers);
                    if zone.is_elastic() {
                        return None;
                    }
                }
            }
        }
        None
    }

    /// The edge that stresses are on.
    #[inline]
    fn edge(&self, s: &[f64; 3]) -> Merged {
        const NEAR: f64 = 1e-9;
        let near = NEAR * self.size(s);
        match (s[0] - s[1] <= near, s[1] - s[2] <= near) {
            (true, false) => Merged::First12,
            (false, true) => Merged::Last23,
            _ => Merged::None,
        }
    }

    /// Whether a solution with these active surfaces is the return.
    #[inline]
    fn judge(&self, system: &System<'_>, end: &Iterate, margin: f64, may_harden: bool) -> Verdict {
        let (zone, trial) = (system.zone, &system.trial);
        let s = &end.s;
        let [Lambda, mu] = end.multipliers;
        // Stress that the multipliers take away, kPa.
        let stiffness = self.G * trial.E;
        let along_cap = end.middle[0].abs().max(end.middle[1].abs());
        if zone.shear != Shear::None && Lambda * stiffness < -margin {
            return Verdict::Other(Zone {
                shear: Shear::None,
                ..zone
            });
        }
        if zone.cap && zone.cylinder == (end.middle[0] > 0.0) {
            return Verdict::Other(Zone {
                cylinder: !zone.cylinder,
                ..zone
            });
        }
        if zone.cap && mu * stiffness * along_cap < -margin {
            return Verdict::Other(zone.without_cap());
        }
        let (over_12, over_23) = (s[1] - s[0], s[2] - s[1]);
        if zone.merged == Merged::None && over_12.max(over_23) > 0.0 {
            let first = over_12 > over_23;
            return Verdict::Merge(if first {
                Merged::First12
            } else {
                Merged::Last23
            });
        }
        if s[0] < s[2] - margin {
            // Flow at the strength dilates: it leads to the corner from beyond it.
            let is_beyond = trial.s.iter().sum::<f64>() <= 3.0 * (margin - self.R_t);
            let is_strength = zone.shear == Shear::Limit || zone.tension;
            return if is_strength && is_beyond {
                Verdict::Corner
            } else {
                Verdict::None
            };
        }
        if zone.tension && !system.needs_cut_off(end, margin) {
            return Verdict::Other(Zone {
                tension: false,
                ..zone
            });
        }
        let gamma = trial.gamma + system.growth(Lambda)[0];
        let gamma = match zone.shear {
            Shear::None => trial.gamma,
            Shear::Hardening => gamma,
            Shear::Limit => {
                let (reached, ..) = self.gamma(s[0] - s[2], s[2]);
                if may_harden && reached > gamma * (1.0 + MARGIN) {
                    let cap = zone.cap || (trial.guesses && self.beyond_cap(s, end.p_p) > margin);
                    return Verdict::Other(Zone {
                        shear: Shear::Hardening,
                        cap,
                        cylinder: cap && s.iter().sum::<f64>() <= 0.0,
                        ..zone
                    });
                }
                reached.max(trial.gamma)
            }
        };
        let mut other = zone;
        if zone.shear != Shear::Limit && self.beyond_limit(s) > margin {
            other.shear = Shear::Limit;
        } else if zone.shear == Shear::None && self.beyond_shear(s, gamma) > margin {
            other.shear = Shear::Hardening;
        }
        if !zone.cap && self.beyond_cap(s, end.p_p) > margin {
            other.cap = true;
            other.cylinder = s.iter().sum::<f64>() <= 0.0;
        }
        other.tension |= self.is_beyond_cut_off(s, margin);
        if other == zone {
            Verdict::Ends(gamma)
        } else {
            Verdict::Other(other)
        }
    }
}

impl<'a> End<'a> {
    /// An elastic one.
    #[inline]
    pub(crate) fn new(soil: &'a Soil, trial: Trial) -> Self {
        Self {
            system: System::new(soil, trial),
            solution: Iterate::new(trial.s, trial.p_p),
            gamma: trial.gamma,
        }
    }

    /// Rates of an end, from the rates of what it depends on; those of p_p and γ_ps if they are asked for.
    #[inline]
    pub(crate) fn rates<const N: usize>(
        &self,
        of: &Rates<N>,
        with_variables: bool,
    ) -> Point<3, Rate<N>> {
        if self.system.zone.has_equations() {
            return self.system.rates(&self.solution, of, with_variables);
        }
        Point {
            stress: if self.system.zone.corner {
                [Rate::ZERO; 3]
            } else {
                of.s
            },
            p_p: of.p_p,
            gamma: of.gamma,
        }
    }

    /// What the return of a trial stress leaves of a shear stress between two principal axes, Eq. (20).
    #[inline]
    pub(crate) fn kappa(&self, soil: &Soil, trial: &[f64; 3], [i, j]: [usize; 2]) -> f64 {
        let System {
            zone,
            trial: Trial { theta, E, .. },
            ..
        } = self.system;
        if zone.corner {
            return 0.0;
        }
        let gap = trial[i] - trial[j];
        let margin = MARGIN * soil.size(trial);
        if gap > margin {
            return (self.solution.s[i] - self.solution.s[j]) / gap;
        }
        // Of equal stresses those merge that flow would separate.
        if zone.shear == Shear::None && !zone.cap {
            1.0
        } else if trial[0] - trial[2] <= margin && zone.cap {
            let (M, mu) = (soil.cap.M, self.solution.multipliers[1]);
            1.0 / (1.0 + 6.0 * mu * theta * soil.G * E / (M * M))
        } else {
            0.0
        }
    }
}

/// What to make of a solution.
enum Verdict {
    /// It is the return, with this γ_ps.
    Ends(f64),
    /// Nothing but the corner is left.
    Corner,
    /// There is none.
    None,
    /// Principal stresses have overtaken each other.
    Merge(Merged),
    /// Other surfaces are active.
    Other(Zone),
}

/// Newton's method for the multipliers. It ends with the last change of stress where what that leaves out is below
/// round-off by the rate of convergence so far.
/// The first pass bears on the end through E and u alone: a hundred times more may be left out of it.
#[inline]
fn solve(
    system: &System<'_>,
    end: &mut Iterate,
    mut multipliers: [f64; 2],
    size: f64,
) -> Option<()> {
    const MAX_ITERATIONS: u32 = 30;
    /// Stress over that of the trial, beyond which the method diverges.
    const FARTHEST: f64 = 1e3;
    /// Residual, over the stress, that one more correction leaves nothing of.
    const NEGLIGIBLE: f64 = 1e-12;
    let tolerance = system.trial.tolerance;
    let mut before = 0.0;
    *end = Iterate::new(system.trial.s, system.trial.p_p);
    for _ in 0..MAX_ITERATIONS {
        system.evaluate(multipliers, end);
        // A sum: the larger of two numbers would hide one that is none.
        let residual = (end.residual[0].abs() + end.residual[1].abs()) / size;
        let stress = end.s[0].abs() + end.s[1].abs() + end.s[2].abs();
        let reach = (stress + system.taken_by_shear(multipliers[0])) / size + residual;
        if reach.is_nan() || reach >= FARTHEST {
            return None;
        }
        if residual <= 1e-15 {
            return Some(());
        }
        let step = end.correction(&end.residual);
        let left_out = residual * residual * residual;
        if residual <= NEGLIGIBLE
            || (residual <= tolerance && left_out <= 1e-7 * tolerance * before * before)
        {
            system.correct(end, step);
            return Some(());
        }
        before = residual;
        multipliers = [multipliers[0] + step[0], multipliers[1] + step[1]];
    }
    None
}
