//! Bad fits: residuals as large as the measured values, and possible reasons.

use super::curve::Curve;
use crate::experiment::digits;

/// A fit is bad if the root mean square of residuals exceeds this part of the largest measured value;
/// `RATHER_BAD` if the computed curve explains less than half of the variation of the measured one.
const BAD: f64 = 0.25;
const RATHER_BAD: f64 = 0.1;
const HALF: f64 = 0.5;
/// Residuals that the noise explains are not bad.
const OF_NOISE: f64 = 3.0;
/// Curves of opposite sign: cosine of the angle between measured and computed values.
const OPPOSED: f64 = -0.5;
/// A factor between measured and computed values that is of units.
const OF_UNITS: f64 = 50.0;

fn mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0, 0.0), |(n, sum), v| (n + 1, sum + v * v));
    sum / f64::from(n.max(1))
}

/// The part of what measured values vary by that computed ones explain, R² = 1 − Σ(y − ŷ)²/Σ(ŷ − ȳ)²; below
/// 0 if their mean would be nearer. `None` of values that do not vary.
pub(super) fn explained(curve: &Curve, computed: &[f64]) -> Option<f64> {
    let points = &curve.points;
    let mean = points.iter().map(|(_, y)| y).sum::<f64>() / points.len().max(1) as f64;
    let whole = mean_square(points.iter().map(|(_, y)| y - mean));
    let left = mean_square(points.iter().zip(computed).map(|((_, y), c)| y - c));
    (whole > (1e-9 * curve.largest()).powi(2)).then(|| 1.0 - left / whole)
}

/// Whether residuals are of the size of what was measured.
pub(super) fn is_bad(curve: &Curve, computed: &[f64]) -> bool {
    let residuals = || curve.points.iter().zip(computed).map(|((_, y), c)| y - c);
    let part = mean_square(residuals()).sqrt() / curve.largest();
    let over_noise = mean_square(residuals().zip(&curve.deviations).map(|(r, d)| r / d)).sqrt();
    let is_flat = explained(curve, computed).is_some_and(|part| part < HALF);
    over_noise > OF_NOISE && (part > BAD || is_flat && part > RATHER_BAD)
}

/// That, in words, with what a look at the curve of the starting values suggests.
pub(super) fn in_words(test: &str, curve: &Curve, computed: &[f64], at_start: &[f64]) -> String {
    let residuals = curve.points.iter().zip(computed).map(|((_, y), c)| y - c);
    let part = mean_square(residuals).sqrt() / curve.largest();
    let varies = explained(curve, computed).map_or_else(String::new, |part| {
        format!(
            ", of how they vary {:.0} % is explained",
            100.0 * part.max(0.0)
        )
    });
    let measured = || curve.points.iter().map(|(_, y)| *y);
    let product: f64 = measured().zip(at_start).map(|(y, s)| y * s).sum();
    let [own, start] = [
        mean_square(measured()).sqrt(),
        mean_square(at_start.iter().copied()).sqrt(),
    ];
    let cosine = product / (own * start * curve.points.len() as f64);
    let factor = own / start;
    let why = if start > 0.0 && cosine < OPPOSED {
        "measured values have the opposite sign of those computed with the starting values: is `y` the right column, \
         with its sign (`y_scale` of `measured`)?"
            .to_owned()
    } else if start > 0.0 && !(1.0 / OF_UNITS..OF_UNITS).contains(&factor) {
        format!(
            "measured values are about {} times those computed with the starting values: are units those of the computed \
             column (`y_scale` of `measured`)?",
            rounded(factor)
        )
    } else {
        "are units and signs those of the computed column, does a bound or a fixed value keep the law from following, can \
         the law follow such a curve at all?"
            .to_owned()
    };
    format!(
        "{test}, {}: the fit is bad: residuals are {:.0} % of the largest measured value{varies}; as long as that is so, \
         values and intervals say nothing. {why}",
        curve.y,
        100.0 * part
    )
}

/// A number with two digits.
fn rounded(factor: f64) -> String {
    digits(format!("{factor:.1e}").parse().unwrap_or(factor))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(y: &[f64], noise: f64) -> Curve {
        Curve {
            x: "u".to_owned(),
            y: "t".to_owned(),
            labels: [String::new(), String::new()],
            stretch: None,
            points: y.iter().enumerate().map(|(i, y)| (i as f64, *y)).collect(),
            deviations: vec![noise; y.len()],
            weight: 1.0,
            is_noise_given: true,
            readings: [None; 4],
        }
    }

    #[test]
    fn what_is_explained_is_that_of_the_textbook() {
        // Residuals 1, −1, 1, −1 of 0, 2, 4, 6, whose mean is 3: 1 − 4/20.
        let four = curve(&[0.0, 2.0, 4.0, 6.0], 0.1);
        let part = explained(&four, &[1.0, 1.0, 5.0, 5.0]).unwrap();
        assert!((part - 0.8).abs() < 1e-12, "{part}");
        assert_eq!(explained(&curve(&[5.0; 4], 0.1), &[5.0; 4]), None);
    }

    #[test]
    fn noise_is_no_bad_fit_and_another_curve_is() {
        let rising: Vec<f64> = (0..20).map(f64::from).collect();
        let nothing = vec![0.0; 20];
        assert!(is_bad(&curve(&rising, 0.5), &nothing));
        assert!(!is_bad(&curve(&rising, 0.5), &rising));
        // Measured is noise about 0, and computed 0.
        let noise: Vec<f64> = (0..20).map(|i| f64::from(i % 3) - 1.0).collect();
        assert!(!is_bad(&curve(&noise, 0.8), &nothing));
        let half: Vec<f64> = rising.iter().map(|y| 0.9 * y).collect();
        assert!(!is_bad(&curve(&rising, 0.5), &half));
    }

    #[test]
    fn signs_and_units_are_suggested_by_the_starting_values() {
        let rising: Vec<f64> = (0..20).map(f64::from).collect();
        let nothing = vec![0.0; 20];
        let of = |factor: f64| {
            let start: Vec<f64> = rising.iter().map(|y| factor * y).collect();
            in_words("box", &curve(&rising, 0.5), &nothing, &start)
        };
        assert!(of(-0.7).contains("opposite sign"));
        assert!(of(0.001).contains("about 1000 times"));
        assert!(of(1.5).contains("are units and signs"));
        // Root of 130, the mean square of 0 to 19 being 123.5, over 19.
        assert!(of(1.5).contains("58 %"), "{}", of(1.5));
    }
}
