//! Parameters as the search counts them: by their logarithm or in widths of their range, so that units do
//! not matter.

use crate::sampling::stratified;
use input::calibration::Scale;
use results::random::Random;

/// A parameter that is looked for.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// Name in the calibration.
    pub name: String,
    /// Id of the law's parameter.
    pub id: String,
    /// Tables of laws of cases that it belongs to.
    pub laws: Vec<String>,
    /// Its unit.
    pub unit: String,
    /// Its kind.
    pub doc: String,
    /// Where the search starts.
    pub start: f64,
    /// Least and greatest value.
    pub bounds: [f64; 2],
    /// Range that other starts are spread over.
    pub range: [f64; 2],
    /// How it is counted.
    pub scale: Scale,
    /// It is no law's, but says how a curve was read: numbers of test and curve.
    pub of_curve: Option<(usize, usize)>,
}

impl Parameter {
    fn width(&self) -> f64 {
        self.range[1] - self.range[0]
    }

    /// As the search counts a value.
    pub fn counted(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value / self.width(),
            Scale::Log => value.ln(),
        }
    }

    /// The value that is counted so, within the bounds.
    pub fn value(&self, counted: f64) -> f64 {
        let value = match self.scale {
            Scale::Linear => counted * self.width(),
            Scale::Log => counted.exp(),
        };
        value.clamp(self.bounds[0], self.bounds[1])
    }

    /// The bounds as the search counts.
    pub fn counted_bounds(&self) -> [f64; 2] {
        self.bounds.map(|bound| self.counted(bound))
    }

    /// The range as the search counts.
    pub fn counted_range(&self) -> [f64; 2] {
        self.range.map(|end| self.counted(end))
    }

    /// Derivative of the value by how it is counted.
    pub fn slope(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => self.width(),
            Scale::Log => value,
        }
    }
}

/// Places spread over a box by a Latin hypercube: in every direction one of them in each of `n` slices.
/// The same seed gives the same places.
pub(super) fn spread(ranges: &[[f64; 2]], n: usize, seed: u64) -> Vec<Vec<f64>> {
    let column = |(direction, [low, high]): (usize, &[f64; 2])| {
        let parts = stratified(n, &mut Random::of(seed, direction)).into_iter();
        parts.map(|part| low + part * (high - low)).collect()
    };
    let columns: Vec<Vec<f64>> = ranges.iter().enumerate().map(column).collect();
    let place = |i: usize| columns.iter().map(|column| column[i]).collect();
    (0..n).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameter(scale: Scale) -> Parameter {
        Parameter {
            name: "k".to_owned(),
            id: "k".to_owned(),
            laws: Vec::new(),
            unit: "kPa".to_owned(),
            doc: String::new(),
            start: 10.0,
            bounds: [1e-3, 1e6],
            range: [1.0, 101.0],
            scale,
            of_curve: None,
        }
    }

    #[test]
    fn counting_goes_to_and_fro_within_the_bounds() {
        for scale in [Scale::Linear, Scale::Log] {
            let k = parameter(scale);
            for value in [1e-3, 0.5, 42.0, 1e6] {
                let back = k.value(k.counted(value));
                assert!((back / value - 1.0).abs() < 1e-12, "{back}");
            }
            assert!(k.value(k.counted(1e6) + 10.0) <= 1e6);
            let step = 1e-6;
            let difference = (k.value(k.counted(42.0) + step) - 42.0) / step;
            assert!((k.slope(42.0) / difference - 1.0).abs() < 1e-5);
        }
    }
}
