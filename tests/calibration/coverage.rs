//! Intervals hold the true value as often as they say.
//!
//! Curves are computed by the law itself and scattered by normal noise of a known size, 200 times. The
//! number of 95 % intervals that hold the truth, out of 200, lies within bounds of the binomial
//! distribution. These leave out one repetition of the test in a thousand on either side.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::{computed, holds, run, write_points};
use std::fs;
use tempfile::TempDir;

const REPETITIONS: usize = 200;

/// Normal noise: SplitMix64, and Box and Muller.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        ((z >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    pub(crate) fn normal(&mut self) -> f64 {
        let (radius, angle) = (self.unit(), self.unit());
        (-2.0 * radius.ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
    }
}

/// Hits of this many at this probability that only one repetition in a thousand goes beyond.
pub(crate) fn at_most(n: usize, p: f64) -> usize {
    let mut chance = (1.0 - p).powi(n as i32);
    let mut sum = chance;
    let mut hits = 0;
    while sum < 1.0 - 1e-3 {
        chance *= (n - hits) as f64 / (hits + 1) as f64 * p / (1.0 - p);
        hits += 1;
        sum += chance;
    }
    hits
}

/// Numbers of hits of 200 at 95 % between which all but a thousandth on either side lie.
fn bounds() -> (usize, usize) {
    let (n, p) = (REPETITIONS as f64, 0.95_f64);
    let mut chance = (1.0 - p).powf(n);
    let (mut sum, mut low, mut high) = (0.0, None, None);
    for hits in 0..=REPETITIONS {
        sum += chance;
        if sum > 1e-3 {
            low.get_or_insert(hits);
        }
        if sum > 1.0 - 1e-3 {
            high.get_or_insert(hits);
        }
        let k = hits as f64;
        chance *= (n - k) / (k + 1.0) * p / (1.0 - p);
    }
    (low.unwrap(), high.unwrap())
}

/// Repeats a calibration with fresh noise; counts how often each interval holds the truth.
fn repeat(
    driver: &str,
    calibration: &str,
    truth: &[(&str, f64)],
    curves: &[(&str, Vec<f64>, Vec<f64>, f64)],
) {
    let place = TempDir::new().unwrap();
    fs::write(place.path().join("driver.toml"), driver).unwrap();
    let file = place.path().join("calibration.toml");
    fs::write(&file, calibration).unwrap();
    let mut noise = Noise(20_260_131);
    let mut hits = vec![0; truth.len()];
    for _ in 0..REPETITIONS {
        for (name, x, y, deviation) in curves {
            let points = x
                .iter()
                .zip(y)
                .map(|(x, y)| (*x, y + deviation * noise.normal()));
            write_points(place.path(), name, &points.collect::<Vec<_>>());
        }
        let outcome = run(&file, &[]).unwrap();
        for (hits, (name, value)) in hits.iter_mut().zip(truth) {
            *hits += usize::from(holds(&outcome, name, *value));
        }
    }
    let (low, high) = bounds();
    println!("{hits:?} of {REPETITIONS}, {low} to {high} are in order");
    for (hits, (name, _)) in hits.iter().zip(truth) {
        assert!((low..=high).contains(hits), "{name}: {hits}");
    }
}

#[test]
fn the_bounds_are_those_of_the_binomial_distribution() {
    // Mean 190, standard deviation √(200 · 0.95 · 0.05) = 3.08.
    let (low, high) = bounds();
    assert!(
        (178..=182).contains(&low) && (197..=199).contains(&high),
        "{low} {high}"
    );
}

const MEPI: &str = r#"
law = "mepi"
hypothesis = "interface_2d"
[parameters]
k_n = 0.86e5
k_t = 0.37e5
n = 0.55
mu_0 = 0.0
mu_p = 0.78
mu_c0 = 0.67
a = 0.00045
c_0 = 0.05
t = 0.002
[initial]
traction = { n = -100.0 }
[[segment]]
increments = 30
control = { t = { jump = 3.0e-3 } }
"#;

/// Three parameters of MEPI from shear stress and opening of two tests; the size of the noise is not
/// told. Intervals of the covariance, since the curves are smooth and the noise is small.
#[test]
fn mepi_at_a_point_holds_the_truth_at_the_nominal_rate() {
    let x: Vec<f64> = (1..=15).map(|k| 0.2 * f64::from(k) - 0.03).collect();
    let at = |stress: f64| MEPI.replace("-100.0", &format!("{:?}", -stress));
    let mut curves = Vec::new();
    let mut tests = String::new();
    let mut variants = String::new();
    for stress in [50.0, 200.0] {
        variants += &format!(
            "[[variant]]\nname = \"at_{stress}\"\ninitial.traction.n = {:?}\n",
            -stress
        );
        tests += &format!(
            "[[test]]\nname = \"{stress}\"\ndriver = \"driver.toml\"\nvariant = \"at_{stress}\"\n"
        );
        for (y, deviation) in [("traction_t", 0.01 * stress), ("u_n", 0.004)] {
            let file = format!("{y}_{stress}.csv");
            tests += &format!(
                "[[test.curve]]\nx = \"u_t\"\ny = \"{y}\"\nnoise = {:?}\n\
                 measured = {{ file = \"{file}\", x = \"x\", y = \"y\" }}\n",
                2.0 * deviation
            );
            let values = computed(&at(stress), ["u_t", y], &x);
            curves.push((file, x.clone(), values, deviation));
        }
    }
    let calibration = format!(
        "starts = 1\nprofiles = false\n[free]\nmu_p = {{ start = 0.8 }}\nmu_c0 = {{ start = 0.6 }}\n\
         a = {{ start = 5e-4 }}\n{tests}"
    );
    let curves: Vec<_> = curves
        .iter()
        .map(|(f, x, y, d)| (f.as_str(), x.clone(), y.clone(), *d))
        .collect();
    let truth = [("mu_p", 0.78), ("mu_c0", 0.67), ("a", 0.00045)];
    repeat(&format!("{MEPI}{variants}"), &calibration, &truth, &curves);
}

const HYPERBOLIC: &str = r#"
law = "hyperbolic_joint"
hypothesis = "interface_2d"
[parameters]
normal_stiffness = 1e7
stiffness_number = 2e4
stiffness_exponent = 0.7
failure_ratio = 0.85
adhesion = 0.0
friction_angle = 33.0
[initial]
traction = { n = -100.0 }
[[segment]]
increments = 20
control = { t = { jump = 0.5e-3 } }
"#;

/// Stiffness and strength from few points with much noise, where intervals are not symmetric: those of
/// profiles, with noise of a known size.
#[test]
fn profiles_of_a_hyperbolic_joint_hold_the_truth_at_the_nominal_rate() {
    let x: Vec<f64> = (1..=12).map(|k| 0.04 * f64::from(k)).collect();
    let y = computed(HYPERBOLIC, ["u_t", "traction_t"], &x);
    let calibration = "starts = 1\nvariance = \"given\"\n[free]\nstiffness_number = {}\nfriction_angle = {}\n\
        [[test]]\nname = \"box\"\ndriver = \"driver.toml\"\n[[test.curve]]\nx = \"u_t\"\ny = \"traction_t\"\nnoise = 3.0\n\
        measured = { file = \"box.csv\", x = \"x\", y = \"y\" }\n";
    let truth = [("stiffness_number", 2e4), ("friction_angle", 33.0)];
    repeat(HYPERBOLIC, calibration, &truth, &[("box.csv", x, y, 3.0)]);
}
