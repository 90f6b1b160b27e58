//! Laws of solids in a shear zone of an interface.
//!
//! Goal      any law of solids is a law of interfaces, with the answers that simple shear has.
//! Geometry, boundary, law: cases/shear_zone/README.md.
//! Asserts   elastic stage τ = G u_t/d up to the yield that the lateral stress gives; limits of
//!           Mohr–Coulomb in simple shear; the oriented criterion; critical state of hypoplasticity.

use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;
use tests::case::column;
use tests::or_skip;
use tests::tolerance::{DRIVER, near};

const THICKNESS: f64 = 5e-3;
const SIGMA: f64 = 100.0;
const G: f64 = 20e3 / 2.6;

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// A driver's tables, one for each variant.
struct Tests(TempDir);

impl Tests {
    fn run(driver: &Path) -> Self {
        let folder = TempDir::new().unwrap();
        let csv = folder.path().join("test.csv");
        tests::driver::run(driver, None, Some(&csv), |report| {
            // Sand that dilates by its angle of friction is for the sake of the closed form.
            let unusual = "dilatancy_angle = 35 deg is outside its usual range";
            let mut warnings = report.warnings.iter();
            assert!(warnings.all(|warning| warning.contains(unusual)));
        })
        .unwrap();
        Self(folder)
    }

    fn column(&self, variant: &str, name: &str) -> Vec<f64> {
        column(&self.0.path().join(format!("test_{variant}.csv")), name)
    }

    fn last(&self, variant: &str, name: &str) -> f64 {
        *self.column(variant, name).last().unwrap()
    }
}

fn mohr_coulomb() -> Tests {
    Tests::run(&repository("cases/shear_zone/mohr_coulomb.toml"))
}

fn assert_near(found: f64, expected: f64, tolerance: f64) {
    near(found, expected, tolerance * expected.abs());
}

#[test]
fn without_dilatancy_the_answer_is_bilinear() {
    let tests = mohr_coulomb();
    // Equal stresses all around at the start: Mohr's circle grows about σ_n to σ_n sin φ, where
    // shear without change of volume goes on. The oriented criterion yields at σ_n tan φ.
    let phi = 35_f64.to_radians();
    for (variant, strength) in [("psi_0", phi.sin()), ("oriented", phi.tan())] {
        let tau = tests.column(variant, "traction_t");
        let normal = tests.column(variant, "traction_n");
        let opening = tests.column(variant, "jump_n");
        for (row, slip) in tests.column(variant, "jump_t").into_iter().enumerate() {
            let expected = (G * slip / THICKNESS).min(SIGMA * strength);
            assert_near(tau[row], expected, DRIVER);
            assert_near(normal[row], -SIGMA, DRIVER);
            assert!(opening[row].abs() < 1e-12, "{}", opening[row]);
        }
    }
}

#[test]
fn with_dilatancy_it_tends_to_davis_limit() {
    let tests = mohr_coulomb();
    let phi = 35_f64.to_radians();
    for (variant, psi, ratio) in [
        ("psi_12", 12_f64, 1.0),
        ("psi_35", 35.0, 1.0),
        ("psi_12_lateral_0_5", 12.0, 0.5_f64),
    ] {
        let psi = psi.to_radians();
        let tau = tests.column(variant, "traction_t");
        let slip = tests.column(variant, "jump_t");
        // First yield: the circle about the mean of σ_n and the lateral stress reaches sin φ times
        // that mean.
        let mean = SIGMA * (1.0 + ratio) / 2.0;
        let difference = SIGMA * (1.0 - ratio) / 2.0;
        let first = ((mean * phi.sin()).powi(2) - difference.powi(2)).sqrt();
        let mut elastic = 0;
        for (tau, slip) in tau.iter().zip(&slip) {
            let line = G * slip / THICKNESS;
            if line <= first {
                assert_near(*tau, line, DRIVER);
                elastic += 1;
            } else {
                assert!(*tau < line * (1.0 - 1e-6), "{tau} at {slip}");
            }
        }
        assert!(elastic > 5 && elastic < tau.len() / 2, "{elastic}");
        // Davis (1968): ε_t = 0 turns the axes until τ/σ_n is this, and u_n' = tan ψ u_t'.
        let limit = SIGMA * phi.sin() * psi.cos() / (1.0 - phi.sin() * psi.sin());
        assert_near(*tau.last().unwrap(), limit, 1e-6);
        let opening = tests.column(variant, "jump_n");
        let last = slip.len() - 1;
        let slope = (opening[last] - opening[last - 1]) / (slip[last] - slip[last - 1]);
        assert_near(slope, psi.tan(), 1e-5);
        assert_near(tests.last(variant, "traction_n"), -SIGMA, DRIVER);
    }
}

/// A folder with the driver and its routine, compiled. `None`, with a remark, where there is no
/// compiler.
fn hypoplastic() -> Option<TempDir> {
    let folder = TempDir::new().unwrap();
    let mut compiler = Command::new("gfortran");
    compiler
        .args(["-O2", "-shared", "-fPIC", "-o"])
        .arg(folder.path().join("libhypoplastic.so"))
        .arg(repository("cases/shear_zone/hypoplastic.f90"));
    let output = tests::needs::output(&mut compiler)?;
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let sidecar = std::fs::canonicalize(repository("cases/shear_zone/hypoplastic.law.toml"));
    let driver = repository("cases/shear_zone/hypoplastic.toml");
    let text = std::fs::read_to_string(driver).unwrap();
    let text = text.replacen(
        "hypoplastic.law.toml",
        sidecar.unwrap().to_str().unwrap(),
        1,
    );
    // The workers of the program are not there in a test.
    let text = text.replacen("[laws.sand]\n", "[laws.sand]\nin_process = true\n", 1);
    std::fs::write(folder.path().join("hypoplastic.toml"), text).unwrap();
    Some(folder)
}

#[test]
fn hypoplastic_sand_ends_in_its_critical_state() {
    let folder = or_skip!(hypoplastic());
    let tests = Tests::run(&folder.path().join("hypoplastic.toml"));
    // Shear at constant volume ends where the stress is isotropic but for τ: σ_11 = σ_33 = σ_n. The
    // criterion of Matsuoka and Nakai, on which critical states lie, is there
    // (τ/σ_n)² = 4 sin² φ_c/(3 + sin² φ_c); and e = e_c0 exp(−(3 p/h_s)^n) with p = σ_n.
    let sine = 33_f64.to_radians().sin();
    let strength = SIGMA * 2.0 * sine / (3.0 + sine * sine).sqrt();
    let void_ratio = 0.95 * (-(3.0 * SIGMA / 1e6_f64).powf(0.25)).exp();
    for variant in ["dense", "loose"] {
        assert_near(tests.last(variant, "traction_t"), strength, 1e-3);
        assert_near(tests.last(variant, "void_ratio"), void_ratio, 1e-3);
        for component in ["zone_stress_11", "zone_stress_33"] {
            assert_near(tests.last(variant, component), -SIGMA, 1e-2);
        }
        // Volume is that of the zone: ln((1 + e)/(1 + e_0)) = u_n/d, for small strains as well.
        let e = tests.column(variant, "void_ratio");
        let opening = tests.last(variant, "jump_n");
        let volume = ((1.0 + e[e.len() - 1]) / (1.0 + e[0])).ln();
        assert_near(opening / THICKNESS, volume, 1e-5);
    }
    let peak = |variant| {
        let tau = tests.column(variant, "traction_t");
        tau.into_iter().fold(0.0, f64::max)
    };
    assert!(peak("dense") > 1.1 * strength, "{}", peak("dense"));
    assert!(peak("loose") < 1.01 * strength, "{}", peak("loose"));
    // Dense sand contracts a little before it dilates.
    let opening = tests.column("dense", "jump_n");
    assert!(opening.iter().copied().fold(0.0, f64::min) < 0.0);
}
