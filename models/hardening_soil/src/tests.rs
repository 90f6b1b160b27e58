//! Unit tests: `hallmarks` by closed forms, `reference` against an independent integration, `tangent` against
//! differences, `sweep` over random paths.

mod hallmarks;
mod reference;
mod small;
mod sweep;
mod tangent;

use crate::HardeningSoil;
use crate::soil::SoilParameters;
use abi::{ContinuumLaw, Failure, SolidPoint, SolidResponse, Tangent};

/// A dense sand.
const DENSE: SoilParameters = SoilParameters {
    e_50_ref: 30e3,
    e_oed_ref: 30e3,
    e_ur_ref: 90e3,
    m: 0.55,
    nu_ur: 0.25,
    cohesion: 0.0,
    friction_angle: 42.0,
    dilatancy_angle: 16.0,
    p_ref: 100.0,
    k_0_nc: 0.4,
    r_f: 0.9,
    tensile_strength: f64::NAN,
    ocr: 1.0,
    pop: 0.0,
    substeps: 1.0,
    scheme_tolerance: 0.05,
};

/// A soft clay with some cohesion.
const CLAY: SoilParameters = SoilParameters {
    e_50_ref: 6e3,
    e_oed_ref: 4e3,
    e_ur_ref: 20e3,
    m: 0.9,
    nu_ur: 0.2,
    cohesion: 5.0,
    friction_angle: 25.0,
    dilatancy_angle: 0.0,
    k_0_nc: 0.6,
    ..DENSE
};

fn law(p: SoilParameters) -> HardeningSoil {
    HardeningSoil::new(p).unwrap()
}

/// How a normal component is led: to a change of strain, or at a change of stress, compression positive.
#[derive(Clone, Copy, Debug)]
enum Lead {
    Strain(f64),
    Stress(f64),
}

impl Lead {
    fn times(self, factor: f64) -> Self {
        match self {
            Self::Strain(e) => Self::Strain(factor * e),
            Self::Stress(s) => Self::Stress(factor * s),
        }
    }
}

/// A point on its way, compression positive; 3D.
struct Path<'a, L: ContinuumLaw> {
    law: &'a L,
    stress: [f64; 6],
    strain: [f64; 6],
    state: L::State,
}

impl<L: ContinuumLaw> Clone for Path<'_, L> {
    fn clone(&self) -> Self {
        Self { ..*self }
    }
}

impl<'a, L: ContinuumLaw> Path<'a, L> {
    fn new(law: &'a L, s: [f64; 3]) -> Self {
        let stress = [s[0], s[1], s[2], 0.0, 0.0, 0.0];
        let state = law.initial_state(&stress.map(|s| -s)).unwrap();
        Self {
            law,
            stress,
            strain: [0.0; 6],
            state,
        }
    }

    fn try_update(
        &self,
        increment: &[f64; 6],
        tangent: Tangent,
    ) -> Result<SolidResponse<6, L::State>, Failure> {
        let point = SolidPoint {
            strain: self.strain.map(|e| -e),
            strain_increment: increment.map(|e| -e),
            stress: self.stress.map(|s| -s),
            state: self.state,
            time: 0.0,
            time_increment: 1.0,
            step_time: 0.0,
        };
        self.law.update(&point, tangent)
    }

    fn accept(&mut self, increment: &[f64; 6], end: &SolidResponse<6, L::State>) {
        for i in 0..6 {
            self.strain[i] += increment[i];
            self.stress[i] = -end.stress[i];
        }
        self.state = end.state;
    }

    /// One increment of the normal components; Newton's method with a line search finds the strains of led
    /// stresses.
    fn step(&mut self, lead: [Lead; 3]) {
        let size = self.stress.iter().fold(10.0_f64, |x, y| x.max(y.abs()));
        let mut increment = [0.0; 6];
        for i in 0..3 {
            if let Lead::Strain(e) = lead[i] {
                increment[i] = e;
            }
        }
        let rest = |increment: &[f64; 6]| {
            let end = self.try_update(increment, Tangent::Consistent).ok()?;
            let rest = std::array::from_fn(|i| match lead[i] {
                Lead::Stress(change) => self.stress[i] + change + end.stress[i],
                Lead::Strain(_) => 0.0,
            });
            Some((end, rest))
        };
        let norm = |rest: &[f64; 3]| rest.iter().map(|x| x.abs()).fold(0.0, f64::max);
        let (mut end, mut off) = rest(&increment).unwrap();
        for _ in 0..100 {
            if norm(&off) <= 1e-10 * size {
                self.accept(&increment, &end);
                return;
            }
            let matrix = std::array::from_fn(|i| {
                // Equal stresses stay equal, whatever strains differ: the tangent alone is singular.
                let little = 1e-9 * size_of(&end.tangent);
                std::array::from_fn(|j| match (lead[i], lead[j]) {
                    (Lead::Stress(_), Lead::Stress(_)) => {
                        end.tangent[i][j] + if i == j { little } else { 0.0 }
                    }
                    _ => f64::from(u8::from(i == j)),
                })
            });
            let change = solve(matrix, off);
            let mut share = 1.0;
            loop {
                let mut next = increment;
                for i in 0..3 {
                    next[i] += share * change[i];
                }
                let found = rest(&next).filter(|(_, r)| norm(r) < norm(&off));
                if let Some(found) = found {
                    ((end, off), increment) = (found, next);
                    break;
                }
                share *= 0.5;
                assert!(
                    share > 1e-6,
                    "no equilibrium at {:?}, {off:?}, {increment:?} {:?}",
                    self.stress,
                    rest(&next).map(|x| x.1)
                );
            }
        }
        panic!("no equilibrium at {:?}", self.stress);
    }

    fn go(&mut self, lead: [Lead; 3], steps: u32) {
        let each = lead.map(|lead| lead.times(1.0 / f64::from(steps)));
        for _ in 0..steps {
            self.step(each);
        }
    }
}

/// The largest entry.
fn size_of<const N: usize>(matrix: &[[f64; N]; N]) -> f64 {
    matrix
        .as_flattened()
        .iter()
        .fold(0.0, |x, y| x.max(y.abs()))
}

/// Cramer's rule.
fn solve(m: [[f64; 3]; 3], x: [f64; 3]) -> [f64; 3] {
    let det = |m: [[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
            - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let all = det(m);
    std::array::from_fn(|column| {
        let mut other = m;
        for row in 0..3 {
            other[row][column] = x[row];
        }
        det(other) / all
    })
}
