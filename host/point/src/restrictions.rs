//! Linear restrictions between the changes of stress and strain over a segment, in place of
//! components that are controlled: A Δσ + B Δε = b, one for each component.

use crate::state::{N_MAX, Point, Vector};

/// A square matrix, row by row.
pub type Rows = [Vector; N_MAX];

/// Restrictions in three dimensions; γ = 2ε.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Restrictions {
    /// A, row by row.
    pub stress: Rows,
    /// B, row by row.
    pub strain: Rows,
    /// b, reached at the end of the segment.
    pub change: Vector,
}

impl Restrictions {
    /// The same, every row multiplied so that it compares with stresses: its largest factor of a
    /// stress is 1, or of a strain a modulus.
    pub(crate) fn scaled(&self, modulus: f64) -> Self {
        let mut scaled = self.clone();
        for i in 0..N_MAX {
            let stress = self.stress[i].iter().map(|a| a.abs());
            let strain = self.strain[i].iter().map(|b| b.abs() / modulus);
            let largest = stress.chain(strain).fold(0.0, f64::max);
            let times = |row: Vector| row.map(|value| value / largest);
            scaled.stress[i] = times(self.stress[i]);
            scaled.strain[i] = times(self.strain[i]);
            scaled.change[i] = self.change[i] / largest;
        }
        scaled
    }

    /// A Δσ + B Δε between two states.
    pub(crate) fn answer(&self, from: &Point, to: &Point) -> Vector {
        std::array::from_fn(|i| {
            (0..N_MAX)
                .map(|j| {
                    self.stress[i][j] * (to.flux[j] - from.flux[j])
                        + self.strain[i][j] * (to.gradient[j] - from.gradient[j])
                })
                .sum()
        })
    }

    /// A C + B in place of a tangent C, row by row.
    pub(crate) fn operator(&self, operator: &mut [f64]) {
        let tangent = operator.to_vec();
        for i in 0..N_MAX {
            for j in 0..N_MAX {
                let column = (0..N_MAX).map(|k| self.stress[i][k] * tangent[k * N_MAX + j]);
                operator[i * N_MAX + j] = column.sum::<f64>() + self.strain[i][j];
            }
        }
    }
}
