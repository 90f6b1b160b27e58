//! One interface element of varying aspect ratio: De Gennaro & Frank, Fig. 5, Table II.
//!
//! Goal      the curves of the paper without its oscillation, and where its shortcomings come from.
//! Geometry, boundary, law: cases/aspect_ratio/README.md.
//! Asserts   ultimate shear stress, monotony, plateaus; the zero-thickness element against a closed
//!           form; the layer with mean strains against the law at one point; the causes one by one.

use input::Case;
use input::case::CaseFile;
use mechanics::problem::Integration;
use runs::run::run;
use std::path::Path;
use tempfile::TempDir;
use tests::case::{Silent, column};
use tests::tolerance::close;
use tests::tolerance::{EQUILIBRIUM, near};
use tests::words::words;

/// Aspect ratios L/t; L = 10 mm.
const RATIOS: [u32; 9] = [1, 5, 10, 25, 50, 100, 1000, 10_000, 1_000_000];
/// Those that the paper recommends.
const RECOMMENDED: [u32; 3] = [25, 50, 100];
/// Ultimate shear stress μ_p σ_n at constant normal stress, kPa.
const ULTIMATE: f64 = 70.0;

/// Curves of the shear phase, kPa and mm.
struct Curves {
    tau: Vec<f64>,
    sigma_n: Vec<f64>,
    sigma_n_min: Vec<f64>,
    u_n: Vec<f64>,
    slip_min: Vec<f64>,
    slip_max: Vec<f64>,
    cut_backs: usize,
}

/// Runs an aspect ratio of a case file, changed before if need be.
fn changed(file: &str, ratio: u32, change: impl FnOnce(&mut CaseFile)) -> Curves {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../cases/aspect_ratio")
        .join(file);
    let name = format!("lt_{ratio}");
    let mut cases = Case::load(&path).unwrap();
    assert_eq!(cases.len(), RATIOS.len());
    cases.retain(|case| case.variant.as_ref() == Some(&name));
    let case = &mut cases[0];
    change(&mut case.file);
    let folder = TempDir::new().unwrap();
    let mut observer = Silent::default();
    run(case, folder.path(), &mut observer).unwrap();
    // Stiffnesses and thicknesses of the extreme ratios lie outside what is usual, and slips are of
    // the size of the smallest models.
    let unusual = |warning: &String| {
        warning.contains("outside its usual range")
            || warning.contains("beyond the theory of small")
    };
    assert!(
        observer.warnings.iter().all(unusual),
        "{:?}",
        observer.warnings
    );
    // The first row is the phase that applies the pressures.
    let curve = |name| column(&folder.path().join("history.csv"), name).split_off(1);
    Curves {
        tau: curve("tau"),
        sigma_n: curve("sigma_n"),
        sigma_n_min: curve("sigma_n_min"),
        u_n: curve("u_n"),
        slip_min: curve("slip_min"),
        slip_max: curve("slip_max"),
        cut_backs: observer.cut_backs,
    }
}

fn curves(file: &str, ratio: u32) -> Curves {
    changed(file, ratio, |_| {})
}

fn increments(file: &mut CaseFile, n: usize) {
    *file.phases[1].increments.get_mut() = n;
}

fn parameter(file: &mut CaseFile, name: &str, value: f64) {
    let law = file.laws.get_mut("mepi").unwrap().get_mut();
    let parameter = law.parameters.get_mut(name).unwrap();
    *parameter.get_mut() = input::material::ParameterValue::Number(value);
}

fn last(values: &[f64]) -> f64 {
    *values.last().unwrap()
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Largest fall from one increment to the next.
fn largest_fall(values: &[f64]) -> f64 {
    let falls = values.windows(2).map(|pair| pair[0] - pair[1]);
    falls.fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn the_shear_stress_never_falls_and_no_step_is_cut() {
    for file in words(
        "case.toml mean.toml joint.toml constant_volume.toml constant_volume_mean.toml constant_volume_joint.toml constant_modulus.toml",
    ) {
        for ratio in RATIOS {
            let curves = curves(file, ratio);
            assert_eq!(curves.cut_backs, 0, "{file}, L/t = {ratio}");
            // On the plateau what the solver's tolerance leaves.
            let fall = largest_fall(&curves.tau);
            assert!(
                fall <= EQUILIBRIUM * ULTIMATE,
                "{file}, L/t = {ratio}: {fall}"
            );
        }
    }
}

#[test]
fn seventy_kpa_are_reached_from_an_aspect_ratio_of_25() {
    for (file, tolerances) in [
        ("case.toml", [0.012, 0.008, 0.005, 5e-4, 5e-5, 1e-6]),
        ("mean.toml", [0.004, 0.002, 0.001, 1e-4, 1e-5, 1e-6]),
        ("joint.toml", [0.004, 0.002, 0.001, 1e-4, 1e-5, 1e-6]),
    ] {
        let mut before = 0.0;
        for ratio in RATIOS {
            let tau = last(&curves(file, ratio).tau);
            assert!(
                tau > before && tau < ULTIMATE,
                "{file}, L/t = {ratio}: {tau}"
            );
            before = tau;
            let number = RATIOS[3..].iter().position(|&r| r == ratio);
            if let Some(number) = number {
                let short = 1.0 - tau / ULTIMATE;
                assert!(short < tolerances[number], "{file}, L/t = {ratio}: {short}");
            }
        }
    }
}

/// Shear stress at constant normal stress: τ = σ_n μ(ξ), u = ξ + τ/K_t.
fn closed_form(u: f64, t: f64) -> f64 {
    let tau = |xi: f64| 100.0 * 0.7 * xi / (0.008 * t + xi);
    let (mut low, mut high) = (0.0, u);
    for _ in 0..200 {
        let xi = 0.5 * (low + high);
        if xi + tau(xi) / 0.5e6 < u {
            low = xi;
        } else {
            high = xi;
        }
    }
    tau(low)
}

#[test]
fn the_element_without_thickness_gives_the_closed_form_at_every_ratio() {
    for ratio in RATIOS {
        let curves = curves("joint.toml", ratio);
        for (row, tau) in (1..).zip(&curves.tau) {
            let exact = closed_form(1e-3 * f64::from(row) / 200.0, 0.01 / f64::from(ratio));
            // The plates are 0.01 mm high: σ_n varies by 0.4 % along the element, at the knee.
            close(format_args!("{ratio}, {row}"), *tau, exact, 1e-3 * ULTIMATE);
        }
    }
}

#[test]
fn a_square_element_topples_before_its_friction_is_mobilised() {
    let square = curves("case.toml", 1);
    // Its base cannot pull: the force on the top, with the lever arm t, is at most N L / 2.
    let bound = 100.0 / 2.0;
    assert!(last(&square.tau) < bound && last(&square.tau) > 0.95 * bound);
    assert!(
        last(&square.sigma_n_min).abs() < f64::EPSILON,
        "a point has lost contact"
    );
    // Tied mid-thickness nodes do not help.
    assert!(last(&curves("mean.toml", 1).tau) < bound);
    // Without a lever arm the law itself comes to 64 kPa at 1 mm; the rest takes more slip.
    let free = last(&curves("joint.toml", 1).tau);
    assert!((free - closed_form(1e-3, 0.01)).abs() < 1e-3 * ULTIMATE);
    assert!((64.0..64.5).contains(&free), "{free}");
    // Where the top cannot turn, the element mobilises the friction that the slip of 0.8 mm allows.
    let held = curves("constant_volume_mean.toml", 1);
    let mu = last(&held.tau) / last(&held.sigma_n);
    let xi = 1e-3 * last(&held.slip_max);
    assert!((mu - 0.7 * xi / (0.008 * 0.01 + xi)).abs() < EQUILIBRIUM);
}

/// Shear and normal stress of the law alone at constant volume.
fn at_one_point(ratio: u32) -> Vec<[f64; 2]> {
    let text = format!(
        r#"
law = "mepi"
hypothesis = "interface_2d"
parameters = {{ k_n = 1e6, k_t = 0.5e6, n = 0.0, mu_0 = 0.0, mu_p = 0.7, mu_c0 = 0.4, a = 0.008, c_0 = 19.0, t = {:?}, p_0 = 100.0, sigma_ni = 100.0 }}
initial = {{ traction = {{ n = -100.0 }} }}
[[segment]]
increments = 200
control = {{ t = {{ jump = 1e-3 }}, n = {{ jump = 0.0 }} }}
"#,
        0.01 / f64::from(ratio)
    );
    let driver = tests::driver::of_text(&text).unwrap();
    let mut rows = Vec::new();
    driver
        .run(|row| {
            rows.push([row.flux[1], -row.flux[0]]);
        })
        .unwrap();
    rows.split_off(1)
}

#[test]
fn at_constant_volume_the_layer_is_the_law_at_every_ratio() {
    for ratio in RATIOS {
        let exact = at_one_point(ratio);
        // The steel plates are 2e7 times as stiff as the interface, and their round-off is larger
        // by as much.
        for (file, tolerance) in [
            ("constant_volume_mean.toml", EQUILIBRIUM),
            ("constant_volume_joint.toml", 1e-5),
        ] {
            let curves = curves(file, ratio);
            for (row, [tau, sigma_n]) in exact.iter().enumerate() {
                let difference = (curves.tau[row] - tau)
                    .abs()
                    .max((curves.sigma_n[row] - sigma_n).abs());
                assert!(
                    difference < tolerance * 100.0,
                    "{file} {ratio}: {difference:e}"
                );
            }
        }
        // The paper's element differs by its mid-thickness modes.
        let full = curves("constant_volume.toml", ratio);
        let difference = last(&full.sigma_n) / exact[199][1] - 1.0;
        let allowed = if ratio == 1 { 0.06 } else { 0.003 };
        assert!(difference.abs() < allowed, "{ratio}: {difference}");
    }
}

#[test]
fn at_constant_volume_the_normal_stress_falls_rises_and_settles() {
    for ratio in [5, 10, 25, 50, 100] {
        let curves = curves("constant_volume.toml", ratio);
        let lowest = least(&curves.sigma_n);
        let turn = curves.sigma_n.iter().position(|&s| s <= lowest).unwrap();
        let rise = last(&curves.sigma_n) - 100.0;
        assert!(lowest < 100.0 - 0.1 * rise, "{ratio}: {lowest}");
        assert!(rise > 1.0, "{ratio}: {rise}");
        assert!(largest_fall(&curves.sigma_n[turn..]) < EQUILIBRIUM * 100.0);
        // The last tenth of the displacement adds less than 2 % of the rise.
        assert!(
            last(&curves.sigma_n) - curves.sigma_n[179] < 0.02 * rise,
            "{ratio}"
        );
        assert!(
            curves.u_n.iter().all(|u| u.abs() < 1e-15),
            "the top is held"
        );
    }
    // At L/t = 1 the slip is still too small against t: no plateau within 1 mm.
    let square = curves("constant_volume.toml", 1);
    assert!(last(&square.sigma_n) - square.sigma_n[179] > 0.1 * (last(&square.sigma_n) - 100.0));
}

#[test]
fn with_the_stiffness_of_table_ii_the_plateau_is_in_proportion_to_the_thickness() {
    let plateau = |ratio| {
        let curves = changed("constant_volume_mean.toml", ratio, |file| {
            increments(file, 2000);
        });
        last(&curves.sigma_n)
    };
    let plateaus = RECOMMENDED.map(plateau);
    // 104.9, 102.5, 101.2 kPa: the same in a figure whose axis has to hold L/t = 1.
    for pair in plateaus.windows(2) {
        assert!((pair[0] / pair[1] - 1.0).abs() < 0.03, "{pair:?}");
        near((pair[0] - 100.0) / (pair[1] - 100.0) / 2.0, 1.0, 0.02);
    }
}

#[test]
fn with_constant_moduli_the_plateaus_are_equal_and_only_the_rate_differs() {
    let runs = RECOMMENDED.map(|ratio| {
        changed("constant_modulus.toml", ratio, |file| {
            increments(file, 1000);
        })
    });
    for pair in runs.windows(2) {
        let plateaus = [last(&pair[0].sigma_n), last(&pair[1].sigma_n)];
        assert!((plateaus[0] - plateaus[1]).abs() < 0.15, "{plateaus:?}");
        // The thinner layer gets there after a smaller displacement.
        let half = |run: &Curves| run.sigma_n.iter().position(|&s| s > 102.4).unwrap();
        assert!(half(&pair[0]) > half(&pair[1]));
    }
    // Thick layers have not slipped enough after 1 mm.
    for ratio in [1, 5] {
        let plateau = last(&curves("constant_modulus.toml", ratio).sigma_n);
        assert!(plateau < last(&runs[0].sigma_n) - 1.0, "{ratio}: {plateau}");
    }
}

#[test]
fn at_a_ratio_of_1000_increments_longer_than_the_thickness_miss_the_dilation() {
    // Dilation is over after a slip of about t/6 = 1.7 µm; increments of 20, 5, 0.5 µm.
    let plateaus = [50, 200, 2000].map(|n| {
        let curves = changed("constant_modulus.toml", 1000, |file| increments(file, n));
        last(&curves.sigma_n)
    });
    assert!((plateaus[0] - 100.0).abs() < 0.05, "{plateaus:?}");
    assert!((101.0..102.5).contains(&plateaus[1]), "{plateaus:?}");
    assert!((104.0..105.0).contains(&plateaus[2]), "{plateaus:?}");
    // Under constant normal stress the shear stress does not depend on the increments.
    let [coarse, fine] = [50, 2000].map(|n| {
        let curves = changed("mean.toml", 1000, |file| increments(file, n));
        last(&curves.tau)
    });
    assert!((coarse - fine).abs() < 1e-3, "{coarse} {fine}");
}

#[test]
fn mid_thickness_nodes_let_the_slip_gather_in_one_half_of_the_layer() {
    let spread = |integration| {
        let curves = changed("case.toml", 1000, |file| {
            let group = file.groups.get_mut("interface").unwrap().get_mut();
            *group.integration.as_mut().unwrap().get_mut() = integration;
        });
        (
            last(&curves.slip_min),
            last(&curves.slip_max),
            largest_fall(&curves.tau),
        )
    };
    // Means over the layer slip by 0.86 mm.
    let (least, most, _) = spread(Integration::Mean);
    assert!(least > 0.859 && most < 0.861, "{least} {most}");
    let (least, most, fall) = spread(Integration::Full);
    assert!(least < 0.04 && most > 1.6, "{least} {most}");
    assert!(fall <= EQUILIBRIUM * ULTIMATE);
    // With 2 × 2 points more than the whole displacement, on one side; and still no oscillation.
    let (least, most, fall) = spread(Integration::Reduced);
    assert!(least < 0.03 && most > 3.0, "{least} {most}");
    assert!(fall <= EQUILIBRIUM * ULTIMATE);
}

#[test]
fn a_tolerance_of_a_tenth_of_a_percent_gives_no_visible_oscillation() {
    for file in ["case.toml", "constant_volume.toml"] {
        for ratio in [1000, 10_000] {
            for integration in [Integration::Full, Integration::Reduced] {
                let loose = changed(file, ratio, |file| {
                    file.solver.get_mut().force_tolerance = 1e-3;
                    file.solver.get_mut().displacement_tolerance = 1e-3;
                    let group = file.groups.get_mut("interface").unwrap().get_mut();
                    *group.integration.as_mut().unwrap().get_mut() = integration;
                });
                // Measured: 0.004 kPa at most.
                let fall = largest_fall(&loose.tau);
                assert!(fall < 0.01, "{file} {ratio} {integration:?}: {fall}");
            }
        }
    }
}

#[test]
fn with_a_reference_pressure_of_1_kpa_neither_figure_comes_out() {
    let at_1_kpa = |file, ratio| changed(file, ratio, |file| parameter(file, "p_0", 1.0));
    // Friction takes a hundred times the slip: far from 70 kPa at L/t = 25.
    let tau = last(&at_1_kpa("case.toml", 25).tau);
    assert!((45.0..55.0).contains(&tau), "{tau}");
    // And the interface only contracts.
    let curves = at_1_kpa("constant_volume.toml", 25);
    assert!(
        curves
            .sigma_n
            .windows(2)
            .all(|pair| pair[1] <= pair[0] + EQUILIBRIUM * 100.0)
    );
    assert!(last(&curves.sigma_n) < 50.0);
}
