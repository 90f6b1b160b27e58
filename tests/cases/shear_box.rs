//! Interface shear box: De Gennaro & Frank, Figs 3 and 4, Table I.
//!
//! Goal      MEPI alone follows the paper's text and table on the tests on both sands.
//! Geometry, boundary, law: cases/shear_box/README.md.
//! Asserts   friction against equations (10), (11); contraction; ultimate and residual friction;
//!           order of curves; normal stress against the stiffness that holds it; figures.

use input::Error;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use tests::case::column;
use tests::tolerance::DRIVER;
use tests::words::rows_of;

fn driver(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../cases/shear_box")
        .join(name)
}

/// Tables of all variants of a driver.
struct Tests {
    folder: TempDir,
}

impl Tests {
    fn run(name: &str) -> Self {
        let folder = TempDir::new().unwrap();
        let csv = folder.path().join("test.csv");
        let mut variants = 0;
        tests::driver::run(&driver(name), None, Some(&csv), |report| {
            assert_eq!(report.warnings, Vec::<String>::new());
            variants += 1;
        })
        .unwrap();
        assert!(variants > 1);
        Self { folder }
    }

    fn test(&self, variant: &str) -> Test {
        let path = self.folder.path().join(format!("test_{variant}.csv"));
        let tau = column(&path, "traction_t");
        let sigma: Vec<f64> = column(&path, "traction_n").iter().map(|t| -t).collect();
        Test {
            mu: tau.iter().zip(&sigma).map(|(tau, s)| tau / s).collect(),
            tau,
            sigma,
            slip: column(&path, "jump_t"),
            opening: column(&path, "jump_n"),
            xi: column(&path, "plastic_slip"),
        }
    }
}

/// Columns of a table, kPa and m; normal stress compression positive.
struct Test {
    slip: Vec<f64>,
    opening: Vec<f64>,
    tau: Vec<f64>,
    sigma: Vec<f64>,
    mu: Vec<f64>,
    xi: Vec<f64>,
}

fn last(values: &[f64]) -> f64 {
    *values.last().unwrap()
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// A sand of Table I at an initial normal stress, p_0 = 1 kPa, μ_0 = 0.
#[derive(Clone, Copy)]
struct Sand {
    mu_p: f64,
    mu_c0: f64,
    c_0: f64,
    mu_r: f64,
    a: f64,
    a_0: f64,
    u_tp: f64,
    t: f64,
    sigma_ni: f64,
}

const FONTAINEBLEAU: Sand = Sand {
    mu_p: 0.78,
    mu_c0: 0.67,
    c_0: 0.05,
    mu_r: 0.7,
    a: 0.00045,
    a_0: 4.0,
    u_tp: 1.4e-3,
    t: 0.002,
    sigma_ni: 100.0,
};

const SILICA: Sand = Sand {
    mu_p: 0.81,
    mu_c0: 0.49,
    c_0: 0.05,
    mu_r: 0.6,
    a: 0.00006,
    a_0: 12.0,
    u_tp: 4.3e-4,
    t: 0.006,
    sigma_ni: 100.0,
};

impl Sand {
    /// Equation (10).
    fn hardening(&self, xi: f64) -> f64 {
        self.mu_p * xi / (self.a * self.sigma_ni * self.t + xi)
    }

    /// Equation (11), from a peak.
    fn softening(&self, xi: f64, peak: f64) -> f64 {
        self.mu_r + (peak - self.mu_r) / (self.a_0 * (xi - self.u_tp) / self.t).cosh()
    }

    /// The most that the sand can dilate under constant normal stress, in increments up to `step` of slip.
    /// Beyond the slip ξ_c of the characteristic state it dilates by (μ − μ_c0)/cosh z per slip, equations
    /// (16), (17), z = C ξ. As (10) is concave, that is at most f(x) = 2 μ'(ξ_c) x exp(−C (ξ_c + x)) at
    /// ξ_c + x. This bound f rises to its maximum at 1/C and falls, so that the sum of its
    /// end-of-increment values exceeds its integral by one increment of the maximum at most.
    fn most_dilation(&self, step: f64) -> f64 {
        let scale = self.a * self.sigma_ni * self.t;
        let characteristic = scale * self.mu_c0 / (self.mu_p - self.mu_c0);
        let slope = self.mu_p * scale / (scale + characteristic).powi(2);
        let c = self.c_0 * self.sigma_ni / self.t;
        let f = 2.0 * slope * (-c * characteristic).exp();
        f / (c * c) + step * f / (c * std::f64::consts::E)
    }

    fn assert_friction(&self, test: &Test, peak: Option<f64>) {
        for (&xi, &mu) in test.xi.iter().zip(&test.mu) {
            let exact = match peak {
                // Between the two frictions of the published peak the response is elastic.
                Some(peak) if (xi - self.u_tp).abs() < 1e-15 => {
                    assert!(mu >= self.hardening(xi) - DRIVER && mu <= peak + DRIVER);
                    continue;
                }
                Some(peak) if xi > self.u_tp => self.softening(xi, peak),
                _ => self.hardening(xi),
            };
            assert!((mu - exact).abs() < DRIVER, "ξ = {xi}: {mu}, {exact}");
        }
    }
}

#[test]
fn friction_follows_equations_10_and_11_on_every_row() {
    let hardening = Tests::run("fontainebleau.toml");
    let softening = Tests::run("fontainebleau_softening.toml");
    for (name, sigma_ni) in [("50_kPa", 50.0), ("100_kPa", 100.0), ("200_kPa", 200.0)] {
        let sand = Sand {
            sigma_ni,
            ..FONTAINEBLEAU
        };
        sand.assert_friction(&hardening.test(name), None);
        let reached = sand.hardening(sand.u_tp);
        sand.assert_friction(&softening.test(name), Some(reached));
        let published = softening.test(&format!("{name}_published"));
        sand.assert_friction(&published, Some(sand.mu_p));
    }
    let silica = Tests::run("silica.toml");
    for name in ["test_1", "test_2", "test_3"] {
        let reached = SILICA.hardening(SILICA.u_tp);
        SILICA.assert_friction(&silica.test(name), Some(reached));
        let published = silica.test(&format!("{name}_published"));
        SILICA.assert_friction(&published, Some(SILICA.mu_p));
    }
}

#[test]
fn loose_sand_contracts_by_about_eight_hundredths_of_a_millimetre_and_then_dilates_a_little() {
    let tests = Tests::run("fontainebleau.toml");
    let opening = tests.test("100_kPa").opening;
    let contraction = -least(&opening);
    assert!((7e-5..8.5e-5).contains(&contraction), "{contraction}");
    let dilation = last(&opening) + contraction;
    assert!((3e-6..1.5e-5).contains(&dilation), "{dilation}");
}

#[test]
fn with_the_normal_stress_contraction_grows_and_dilation_vanishes() {
    let tests = Tests::run("fontainebleau.toml");
    let runs = ["50_kPa", "100_kPa", "200_kPa"].map(|name| tests.test(name));
    let contraction = runs.each_ref().map(|run| -least(&run.opening));
    assert!(contraction[0] < contraction[1] && contraction[1] < contraction[2]);
    let dilation = runs
        .each_ref()
        .map(|run| last(&run.opening) - least(&run.opening));
    assert!(dilation[0] > dilation[1] && dilation[1] > dilation[2]);
    for ((run, dilation), sigma_ni) in runs.iter().zip(dilation).zip([50.0, 100.0, 200.0]) {
        let sand = Sand {
            sigma_ni,
            ..FONTAINEBLEAU
        };
        let step = run.xi.windows(2).map(|pair| pair[1] - pair[0]);
        let most = sand.most_dilation(step.fold(0.0, f64::max));
        assert!(dilation < most, "{sigma_ni} kPa: {dilation} {most}");
    }
}

#[test]
fn shear_stress_rises_with_normal_stress_and_mobilised_friction_falls() {
    let tests = Tests::run("fontainebleau.toml");
    let runs = ["50_kPa", "100_kPa", "200_kPa"].map(|name| tests.test(name));
    for pair in runs.windows(2) {
        for row in 1..pair[0].slip.len() {
            assert!(pair[0].tau[row] < pair[1].tau[row], "row {row}");
            assert!(pair[0].mu[row] > pair[1].mu[row], "row {row}");
        }
    }
    // Hardening takes a slip in proportion to the normal stress: 5 mm leave these parts of it.
    for (run, rest) in runs.iter().zip([0.01, 0.02, 0.04]) {
        assert!(run.tau.windows(2).all(|pair| pair[1] > pair[0]));
        let short = 1.0 - last(&run.mu) / 0.78;
        assert!((0.0..rest).contains(&short), "{short}");
    }
}

#[test]
fn softening_ends_at_the_residual_friction() {
    let fontainebleau = Tests::run("fontainebleau_softening.toml");
    for stress in ["50_kPa", "100_kPa", "200_kPa"] {
        for reading in ["", "_published"] {
            let mu = last(&fontainebleau.test(&format!("{stress}{reading}")).mu);
            assert!((mu / 0.7 - 1.0).abs() < 5e-4, "{stress}{reading}: {mu}");
        }
    }
    let silica = Tests::run("silica.toml");
    for test in ["test_1", "test_2", "test_3"] {
        for reading in ["", "_published"] {
            let mu = last(&silica.test(&format!("{test}{reading}")).mu);
            assert!((mu / 0.6 - 1.0).abs() < 5e-4, "{test}{reading}: {mu}");
        }
    }
}

#[test]
fn the_published_peak_is_a_jump_of_six_and_eight_percent() {
    let fontainebleau = Tests::run("fontainebleau_softening.toml");
    let silica = Tests::run("silica.toml");
    for (tests, name, sand, percent) in [
        (&fontainebleau, "100_kPa", FONTAINEBLEAU, 6.0),
        (&silica, "test_1", SILICA, 8.0),
    ] {
        let jump = 100.0 * (sand.mu_p / sand.hardening(sand.u_tp) - 1.0);
        assert!((jump - percent).abs() < 0.5, "{jump} %");
        let published = tests.test(&format!("{name}_published"));
        // Rows are 10 µm apart; softening within one takes less than a thousandth.
        assert!((largest(&published.mu) / sand.mu_p - 1.0).abs() < 1e-3);
        let continuous = tests.test(name);
        assert!((largest(&continuous.mu) / sand.hardening(sand.u_tp) - 1.0).abs() < 1e-3);
        // Until the peak both readings are the same.
        let rows = continuous
            .xi
            .iter()
            .take_while(|&&xi| xi < sand.u_tp)
            .count();
        for row in 0..rows {
            assert!((continuous.mu[row] - published.mu[row]).abs() < DRIVER);
        }
    }
}

#[test]
fn constant_stiffness_lets_the_normal_stress_fall_rise_and_settle_as_the_interface_dilates() {
    let tests = Tests::run("silica.toml");
    let free = tests.test("test_1");
    let mut before = free.opening.clone();
    let mut rise_before = 0.0;
    for (name, stiffness) in [("test_2", 400e3), ("test_3", 800e3)] {
        let run = tests.test(name);
        // Dilation is held back: σ_n = σ_ni + K u_n.
        for (sigma, opening) in run.sigma.iter().zip(&run.opening) {
            let held = 100.0 + stiffness * opening;
            assert!((sigma / held - 1.0).abs() < DRIVER, "{sigma} {held}");
        }
        let lowest = least(&run.sigma);
        let fall = 100.0 - lowest;
        assert!((2.0..8.0).contains(&fall), "{fall}");
        // One fall, one rise.
        let turn = run.sigma.iter().position(|&s| s <= lowest).unwrap();
        assert!(run.sigma[..=turn].windows(2).all(|pair| pair[1] <= pair[0]));
        assert!(run.sigma[turn..].windows(2).all(|pair| pair[1] >= pair[0]));
        // The stiffer the surroundings, the less it opens and the more the stress rises.
        assert!(last(&run.opening) < last(&before));
        let rise = last(&run.sigma) - 100.0;
        assert!(rise > rise_before);
        // The last fifth of the slip adds less than 3 % of it.
        let fifth = run.sigma.len() - run.sigma.len() / 5;
        assert!(last(&run.sigma) - run.sigma[fifth] < 0.03 * rise);
        (before, rise_before) = (run.opening, rise);
    }
    assert!(free.sigma.iter().all(|s| (s / 100.0 - 1.0).abs() < DRIVER));
}

#[test]
fn with_a_reference_pressure_of_100_kpa_there_is_hardly_any_contraction() {
    let text = std::fs::read_to_string(driver("fontainebleau.toml")).unwrap();
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("driver.toml");
    std::fs::write(
        &file,
        text.replace("\nt = 0.002", "\np_0 = 100.0\nt = 0.002"),
    )
    .unwrap();
    let csv = folder.path().join("test.csv");
    let mut reference = f64::NAN;
    tests::driver::run(&file, Some("100_kPa"), Some(&csv), |report| {
        let contraction = report.last.iter().find(|(name, _)| name == "jump_n");
        reference = contraction.unwrap().1;
    })
    .unwrap();
    assert!(reference.is_finite());
    let contraction = -least(&column(&csv, "jump_n"));
    assert!(contraction < 2e-6, "{contraction}");
}

#[test]
fn figures_stand_beside_the_table() {
    let tests = Tests::run("silica.toml");
    for name in ["silica_tau", "silica_mu", "silica_sigma_n", "silica_u_n"] {
        let path = tests.folder.path().join(format!("{name}.svg"));
        let text = std::fs::read_to_string(path).unwrap();
        assert!(text.starts_with("<svg") && text.contains("test_3_published"));
    }
}

#[test]
fn a_driver_with_variants_needs_a_file_or_the_name_of_one() {
    let no_report = |_: &runs::point::PointReport| panic!("nothing should have run");
    let file = driver("silica.toml");
    let error = tests::driver::run(&file, None, None, no_report).unwrap_err();
    assert!(matches!(error, Error::Text(text::Error::Usage(_))));
    let words = error.to_string();
    assert!(words.contains("--csv") && words.contains("--variant") && words.contains("test_2"));
    let error = tests::driver::run(&file, Some("test_4"), None, no_report).unwrap_err();
    assert!(error.to_string().contains("`test_4`: did you mean `test_"));
}

#[test]
fn figures_of_columns_that_there_are_not_are_refused() {
    let text = std::fs::read_to_string(driver("silica.toml")).unwrap();
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("driver.toml");
    let csv = folder.path().join("test.csv");
    for [from, to, words] in rows_of(
        r#"
y = ["mu"] | y = ["nu"] | there is no column `nu`
y = ["mu"] | y = ["mu"]\nphase = "x" | a driver has no phases
name = "silica_mu" | name = "a/b" | cannot be a file's name
"#,
    ) {
        std::fs::write(&file, text.replace(from, to)).unwrap();
        let error = tests::driver::run(&file, None, Some(&csv), |_| {}).unwrap_err();
        assert!(matches!(error, Error::Text(text::Error::Input(_))));
        assert!(error.to_string().contains(words), "{error}");
    }
}
