//! What residuals and their derivatives say of parameters: covariance, quantiles, correlation along a
//! curve.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};

/// Covariance of some variables where measured values scatter by their noise, as far as the residuals
/// determine them.
///
/// Least squares with weights w take r = √w ρ for ρ, which have unit variance. With J = ∂r/∂u, A = JᵀJ and
/// B = Jᵀ W J the error of û is A⁻¹ Jᵀ √w ε, its covariance A⁻¹ B A⁻¹. Without weights that is A⁻¹. A weight
/// says what matters, not what is known: w for all of them changes nothing.
#[derive(Clone, Debug)]
pub struct Covariance {
    /// The variables, by number.
    pub variables: Vec<usize>,
    /// Directions that the residuals do not see, in the scale of unit columns: one entry for each of
    /// `variables`.
    pub blind: Vec<Vec<f64>>,
    /// A⁻¹ B A⁻¹.
    matrix: DMatrix<f64>,
    /// A⁻¹.
    inverse: DMatrix<f64>,
    /// Trace of A⁻¹ B over its rank.
    mean_growth: f64,
    /// Largest weight.
    most: f64,
}

/// What a matrix A sees of directions.
struct Spectrum {
    /// (AᵀA)⁻¹, of the directions that A sees.
    inverse: DMatrix<f64>,
    /// How many these are.
    rank: usize,
    /// The others.
    blind: Vec<Vec<f64>>,
}

impl Spectrum {
    /// `blind`: the singular value, as a part of the largest, up to which A does not see a direction.
    fn of(a: &DMatrix<f64>, blind: f64) -> Self {
        let n = a.ncols();
        let svd = a.clone().svd(false, true);
        let mut inverse = DMatrix::zeros(n, n);
        let mut directions = Vec::new();
        let largest = svd.singular_values.iter().fold(0.0_f64, |a, b| a.max(*b));
        let v_t = svd.v_t.unwrap_or_else(|| DMatrix::identity(0, n));
        let mut seen = DMatrix::zeros(n, n);
        for (number, &value) in svd.singular_values.iter().enumerate() {
            let v = v_t.row(number).transpose();
            seen += &v * v.transpose();
            if value > blind * largest {
                inverse += &v * v.transpose() / (value * value);
            } else {
                directions.push(v.iter().copied().collect::<Vec<_>>());
            }
        }
        let rank = n.min(a.nrows()) - directions.len();
        // With fewer rows than columns some directions have no singular value.
        for _ in 0..n.saturating_sub(svd.singular_values.len()) {
            let rest = DMatrix::identity(n, n) - &seen;
            let Some(widest) = (0..n).max_by(|&a, &b| rest[(a, a)].total_cmp(&rest[(b, b)])) else {
                break;
            };
            let direction: DVector<f64> = rest.column(widest).into_owned();
            let norm = direction.norm();
            if norm < 1e-9 {
                break;
            }
            let direction = direction / norm;
            seen += &direction * direction.transpose();
            directions.push(direction.iter().copied().collect());
        }
        Self {
            inverse,
            rank,
            blind: directions,
        }
    }
}

/// A variable belongs to a blind direction if it has at least this part of it.
const PART: f64 = 0.1;

impl Covariance {
    /// From derivatives of residuals without weights.
    #[cfg(test)]
    pub(super) fn new(jacobian: &DMatrix<f64>, variables: &[usize], blind: f64) -> Self {
        Self::weighted(jacobian, &vec![1.0; jacobian.nrows()], variables, blind)
    }

    /// From derivatives of residuals, and the weight of each. Columns are brought to unit length; a
    /// direction along which the residuals then change by less than `blind` times the largest change is one
    /// that they do not see.
    pub fn weighted(
        jacobian: &DMatrix<f64>,
        weights: &[f64],
        variables: &[usize],
        blind: f64,
    ) -> Self {
        let n = variables.len();
        let most = weights.iter().fold(0.0_f64, |most, w| most.max(*w));
        if n == 0 || jacobian.nrows() == 0 {
            let blind = |k: usize| (0..n).map(|i| f64::from(u8::from(i == k))).collect();
            return Self {
                variables: variables.to_vec(),
                blind: (0..n).map(blind).collect(),
                matrix: DMatrix::zeros(n, n),
                inverse: DMatrix::zeros(n, n),
                mean_growth: most,
                most,
            };
        }
        let norms = variables.iter().map(|&i| jacobian.column(i).norm());
        let norms: Vec<f64> = norms.map(|c| if c > 0.0 { c } else { 1.0 }).collect();
        let unit = DMatrix::from_fn(jacobian.nrows(), n, |row, k| {
            jacobian[(row, variables[k])] / norms[k]
        });
        let Spectrum {
            inverse,
            rank,
            blind,
        } = Spectrum::of(&unit, blind);
        let weighed = DMatrix::from_fn(unit.nrows(), n, |row, k| weights[row] * unit[(row, k)]);
        let scatter = unit.transpose() * weighed;
        let growth = &inverse * scatter;
        let matrix = &growth * &inverse;
        let scaled = |matrix: &DMatrix<f64>| {
            DMatrix::from_fn(n, n, |a, b| matrix[(a, b)] / (norms[a] * norms[b]))
        };
        Self {
            variables: variables.to_vec(),
            blind,
            matrix: scaled(&matrix),
            inverse: scaled(&inverse),
            mean_growth: growth.trace() / rank.max(1) as f64,
            most,
        }
    }

    /// How much the sum of squares grows, over the variance, where a variable leaves its best value by one
    /// standard error and the others follow: 1 without weights.
    pub(super) fn growth(&self, variable: usize) -> f64 {
        let place = self
            .position(variable)
            .filter(|_| self.determines(variable));
        place.map_or(self.most, |k| self.matrix[(k, k)] / self.inverse[(k, k)])
    }

    /// The mean of that over all directions.
    pub(super) fn mean_growth(&self) -> f64 {
        self.mean_growth
    }

    /// How the variables follow changes of the residuals: −A⁻¹ Jᵀ, a row for each variable, a column for each
    /// residual.
    pub(super) fn answer(&self, jacobian: &DMatrix<f64>) -> DMatrix<f64> {
        let own = jacobian.select_columns(&self.variables);
        -(&self.inverse * own.transpose())
    }

    fn position(&self, variable: usize) -> Option<usize> {
        self.variables.iter().position(|&v| v == variable)
    }

    /// Whether the residuals determine a variable.
    pub fn determines(&self, variable: usize) -> bool {
        let place = self.position(variable);
        place.is_some_and(|k| self.blind.iter().all(|v| v[k].abs() < PART))
    }

    /// Variance of a variable; `None` if it is not determined.
    pub fn variance(&self, variable: usize) -> Option<f64> {
        let k = self.position(variable)?;
        self.determines(variable).then(|| self.matrix[(k, k)])
    }

    /// Correlation of two variables; `None` if one is not determined.
    pub fn correlation(&self, a: usize, b: usize) -> Option<f64> {
        let product = self.variance(a)? * self.variance(b)?;
        let [i, j] = [self.position(a)?, self.position(b)?];
        Some(self.matrix[(i, j)] / product.sqrt())
    }
}

/// The value that a variable of Student's distribution stays below with probability (1 + `level`)/2;
/// of the normal distribution without degrees of freedom.
pub(super) fn two_sided(level: f64, degrees: Option<usize>) -> f64 {
    let p = 0.5 * (1.0 + level);
    let student = degrees.and_then(|n| StudentsT::new(0.0, 1.0, n as f64).ok());
    match (student, degrees) {
        (Some(student), _) => student.inverse_cdf(p),
        (None, Some(_)) => f64::INFINITY,
        (None, None) => Normal::standard().inverse_cdf(p),
    }
}

/// Bound of the joint confidence region of all `n` parameters at this level: the excess of the sum of
/// squares over its minimum, relative to the variance. It is n F(n, ν), with a known variance χ²(n).
pub(super) fn joint(level: f64, n: usize, degrees: Option<usize>) -> f64 {
    let n = n as f64;
    match degrees {
        None => ChiSquared::new(n).map_or(f64::INFINITY, |chi| chi.inverse_cdf(level)),
        Some(degrees) => {
            let distribution = FisherSnedecor::new(n, degrees as f64);
            distribution.map_or(f64::INFINITY, |f| n * f.inverse_cdf(level))
        }
    }
}

/// Correlation of neighbours along a curve; 0 of fewer than four values, or of equal ones.
pub(super) fn of_neighbours(values: &[f64]) -> f64 {
    let n = values.len();
    let squares: f64 = values.iter().map(|v| v * v).sum();
    if n < 4 || squares <= 0.0 {
        return 0.0;
    }
    values.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / squares
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Tables of Student's t and of F at 95 %, to their digits.
    #[test]
    fn quantiles_are_those_of_tables() {
        for (degrees, t) in [(1, 12.706), (2, 4.303), (10, 2.228), (30, 2.042)] {
            assert_relative_eq!(two_sided(0.95, Some(degrees)), t, epsilon = 5e-4);
        }
        assert_relative_eq!(two_sided(0.95, None), 1.959_964, epsilon = 5e-7);
        assert_relative_eq!(two_sided(0.99, Some(10)), 3.169, epsilon = 5e-4);
        assert_relative_eq!(joint(0.95, 3, Some(10)), 3.0 * 3.708, epsilon = 2e-3);
        assert_relative_eq!(joint(0.95, 2, None), 5.991, epsilon = 1e-3);
        assert_relative_eq!(
            two_sided(0.95, Some(20)).powi(2),
            joint(0.95, 1, Some(20)),
            epsilon = 1e-6
        );
    }

    #[test]
    fn a_straight_line_has_its_textbook_covariance() {
        // y = a + b x at x = 0, 1, 2, 3: var b = 1/Σ(x − x̄)² = 1/5, var a = Σx²/(4·5) = 14/20.
        let x = [0.0, 1.0, 2.0, 3.0];
        let jacobian = DMatrix::from_fn(4, 2, |i, k| if k == 0 { 1.0 } else { x[i] });
        let covariance = Covariance::new(&jacobian, &[0, 1], 1e-12);
        assert_relative_eq!(covariance.variance(1).unwrap(), 0.2, epsilon = 1e-12);
        assert_relative_eq!(covariance.variance(0).unwrap(), 0.7, epsilon = 1e-12);
        // cov(a, b) = −x̄/5.
        let expected = -0.3 / (0.7_f64 * 0.2).sqrt();
        assert_relative_eq!(
            covariance.correlation(0, 1).unwrap(),
            expected,
            epsilon = 1e-12
        );
        let alone = Covariance::new(&jacobian, &[1], 1e-12);
        assert_relative_eq!(alone.variance(1).unwrap(), 1.0 / 14.0, epsilon = 1e-12);
        assert_eq!(alone.variance(0), None);
    }

    #[test]
    fn weights_are_no_information() {
        // A mean of y with weights w: û = Σ w y/Σ w, so that its variance is Σ w²/(Σ w)².
        let weights = [4.0, 1.0, 1.0];
        let jacobian = DMatrix::from_fn(3, 1, |i, _| f64::sqrt(weights[i]));
        let covariance = Covariance::weighted(&jacobian, &weights, &[0], 1e-12);
        assert_relative_eq!(
            covariance.variance(0).unwrap(),
            18.0 / 36.0,
            epsilon = 1e-12
        );
        // S − Ŝ = Σ w (u − û)², 6 times 1/2 at one standard error.
        assert_relative_eq!(covariance.growth(0), 3.0, epsilon = 1e-12);
        assert_relative_eq!(covariance.mean_growth(), 3.0, epsilon = 1e-12);
        // The same weight for all: that of three values, 1/3.
        let all = [9.0; 3];
        let covariance = Covariance::weighted(&DMatrix::from_element(3, 1, 3.0), &all, &[0], 1e-12);
        assert_relative_eq!(covariance.variance(0).unwrap(), 1.0 / 3.0, epsilon = 1e-12);
        assert_relative_eq!(covariance.growth(0), 9.0, epsilon = 1e-12);
        // A variable answers to a residual that grows by sinking.
        let answer = covariance.answer(&DMatrix::from_element(3, 1, 3.0));
        assert_relative_eq!(answer[(0, 1)], -1.0 / 9.0, epsilon = 1e-12);
    }

    #[test]
    fn directions_that_nothing_sees_are_named() {
        // Two equal columns in other units, and one of its own.
        let jacobian = DMatrix::from_fn(5, 3, |i, k| match k {
            0 => i as f64,
            1 => 1e6 * i as f64,
            _ => (i as f64 - 2.0).powi(2),
        });
        let covariance = Covariance::new(&jacobian, &[0, 1, 2], 1e-8);
        assert_eq!(covariance.blind.len(), 1);
        assert!(!covariance.determines(0) && !covariance.determines(1));
        assert!(covariance.determines(2));
        // More variables than residuals.
        let covariance = Covariance::new(&jacobian.rows(1, 1).into_owned(), &[0, 1, 2], 1e-8);
        assert_eq!(covariance.blind.len(), 2);
        // Nothing to determine.
        assert!(Covariance::new(&jacobian, &[], 1e-8).blind.is_empty());
        // A column of nothing.
        let covariance = Covariance::new(&DMatrix::zeros(4, 1), &[0], 1e-8);
        assert!(!covariance.determines(0));
    }

    #[test]
    fn neighbours_of_a_wave_are_correlated_and_of_signs_opposed() {
        let wave: Vec<f64> = (0..100).map(|i| (f64::from(i) / 10.0).sin()).collect();
        assert!(of_neighbours(&wave) > 0.9);
        let signs: Vec<f64> = (0..100)
            .map(|i| if i % 2 == 0 { 1.0 } else { -1.0 })
            .collect();
        assert!(of_neighbours(&signs) < -0.9);
        assert_relative_eq!(of_neighbours(&[1.0, 2.0]), 0.0);
    }
}
