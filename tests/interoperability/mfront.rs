//! Behaviours of MFront's generic interface as laws here: those of our own libraries, which any
//! machine has, and those inside OpenGeoSys.

use crate::{BondedPile, OPENGEOSYS, assert_close, installed, is_there, library};
use law::foreign::{Adapter, Foreign};
use law::{Bounds, Opener};
use runs::point::PointReport;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The library with behaviours that comes with OpenGeoSys.
fn behaviours() -> PathBuf {
    let environment = installed(OPENGEOSYS);
    let lib = environment.parent().unwrap().parent().unwrap().join("lib");
    let mut versions = std::fs::read_dir(&lib).unwrap();
    let path = versions.find_map(|version| {
        let folder = version.unwrap().path().join("site-packages/lib64");
        let path = folder.join("libOgsMFrontBehaviour.so");
        path.is_file().then_some(path)
    });
    path.unwrap()
}

/// The last row of a driver, by column.
fn last_row(text: &str) -> BTreeMap<String, f64> {
    rows(text).0.pop().unwrap()
}

/// All rows of a driver, by column, and what it reports.
pub(crate) fn rows(text: &str) -> (Vec<BTreeMap<String, f64>>, PointReport) {
    let driver = tests::driver::of_text(text).unwrap();
    let mut out = Vec::new();
    let report = runs::point::write_csv(&driver, &mut out, Path::new("table")).unwrap();
    let table = String::from_utf8(out).unwrap();
    let mut lines = table.lines().map(|line| line.split(','));
    let names: Vec<&str> = lines.next().unwrap().collect();
    let row = |cells: std::str::Split<'_, char>| {
        let cells = cells.map(|cell| cell.parse().unwrap());
        names
            .iter()
            .map(|name| (*name).to_owned())
            .zip(cells)
            .collect()
    };
    (lines.map(row).collect(), report)
}

/// A driver of a law in a library.
pub(crate) fn driver(library: &Path, law: &str, rest: &str) -> String {
    let library = toml::Value::from(library.to_str().unwrap());
    format!("adapter = \"mfront\"\nin_process = true\nlibrary = {library}\nlaw = \"{law}\"\n{rest}")
}

/// Triaxial compression with a lateral stress of 100 kPa.
const COMPRESSION: &str = r"
[initial]
stress = { 11 = -100.0, 22 = -100.0, 33 = -100.0 }
[[segment]]
increments = 40
control = { 11 = { stress = -100.0 }, 33 = { stress = -100.0 }, 22 = { strain = -0.02 }, 12 = { strain = 0.0 } }
";

#[test]
fn our_own_behaviours_come_back_as_the_native_laws() {
    let shear = "[[segment]]\nincrements = 10\n\
                 control = { 11 = { stress = -100.0 }, 33 = { stress = -100.0 }, \
                 22 = { strain = -0.02 }, 12 = { strain = 0.01 } }";
    let theirs = "hypothesis = \"axisymmetric\"\n[parameters]\nYoungModulus = 34e3\n\
                  PoissonRatio = 0.3\nCohesion = 1.0\nFrictionAngle = 36.5\nDilatancyAngle = 12.0\n\
                  TensileStrength = 0.5";
    let ours = "law = \"mohr_coulomb\"\nhypothesis = \"axisymmetric\"\n[parameters]\n\
                young_modulus = 34e3\npoisson_ratio = 0.3\ncohesion = 1.0\nfriction_angle = 36.5\n\
                dilatancy_angle = 12.0\ntensile_strength = 0.5";
    let there = driver(&library("mohr_coulomb"), "MohrCoulomb", theirs);
    let there = last_row(&format!("{there}{COMPRESSION}{shear}"));
    let here = last_row(&format!("{ours}{COMPRESSION}{shear}"));
    for component in ["11", "22", "33", "12"] {
        let stress = format!("stress_{component}");
        // To the rounding of √2 and the driver's tolerance.
        assert_close(there[&stress], here[&stress], 1e-9, &stress);
    }
    assert_close(there["PlasticStrain"], here["plastic_strain"], 1e-9, "ε_q");
}

#[test]
fn a_cohesive_zone_comes_back_as_the_native_joint() {
    let path = "[initial]\ntraction = { n = -100.0 }\n[[segment]]\nincrements = 20\n\
                control = { n = { traction = -100.0 }, t = { jump = 1e-3 } }";
    let theirs = "hypothesis = \"interface_2d\"\n[parameters]\nNormalStiffness = 1e6\n\
                  ShearStiffness = 4e5\nCohesion = 1.0\nFrictionAngle = 30.0\nDilatancyAngle = 5.0\n";
    let ours = "law = \"coulomb_joint\"\nhypothesis = \"interface_2d\"\n[parameters]\n\
                normal_stiffness = 1e6\nshear_stiffness = 4e5\ncohesion = 1.0\n\
                friction_angle = 30.0\ndilatancy_angle = 5.0\n";
    let there = driver(&library("coulomb_joint"), "CoulombJoint", theirs);
    let there = last_row(&format!("{there}{path}"));
    let here = last_row(&format!("{ours}{path}"));
    for column in ["traction_n", "traction_t", "jump_n"] {
        assert_close(there[column], here[column], 1e-9, column);
    }
}

/// Strain and stress, 11 22 33 12 with γ = 2ε, in axes at this angle in degrees.
fn turned([a, b, c, d]: [f64; 4], angle: f64, shear: f64) -> [f64; 4] {
    let (sin, cos) = angle.to_radians().sin_cos();
    let d = d / shear;
    [
        cos * cos * a + sin * sin * b + 2.0 * cos * sin * d,
        sin * sin * a + cos * cos * b - 2.0 * cos * sin * d,
        c,
        shear * (cos * sin * (b - a) + (cos * cos - sin * sin) * d),
    ]
}

#[test]
fn a_layer_at_an_angle_is_the_oriented_law_in_its_axes() {
    let parameters = [
        ("young_modulus", 34e3),
        ("poisson_ratio", 0.3),
        ("cohesion", 1.0),
        ("friction_angle", 30.0),
        ("dilatancy_angle", 8.0),
    ];
    let path = |strain: [f64; 4], stress: [f64; 4]| {
        let named = |values: [f64; 4], word: &str| {
            let entries = ["11", "22", "33", "12"].into_iter().zip(values);
            let entries = entries.map(|(name, value)| match word {
                "" => format!("{name} = {value:?}"),
                word => format!("{name} = {{ {word} = {value:?} }}"),
            });
            entries.collect::<Vec<_>>().join(", ")
        };
        format!(
            "[initial]\nstress = {{ {} }}\n[[segment]]\nincrements = 20\ncontrol = {{ {} }}\n",
            named(stress, ""),
            named(strain, "strain")
        )
    };
    // In the layer: pressed together, and sheared until it slides.
    let (strain, stress) = ([1e-3, -2e-3, 0.0, 2e-2], [-60.0, -100.0, -80.0, 5.0]);
    let mut ours = "law = \"oriented_mohr_coulomb\"\nhypothesis = \"axisymmetric\"\n\
                    [parameters]\n"
        .to_owned();
    let mut theirs = "hypothesis = \"axisymmetric\"\n[parameters]\n".to_owned();
    for (name, value) in parameters {
        let _ = writeln!(ours, "{name} = {value:?}");
        let _ = writeln!(theirs, "{} = {value:?}", spelled(name));
    }
    let here = last_row(&(ours + &path(strain, stress)));
    assert!(here["plastic_strain"] > 1e-3, "it slides");
    for angle in [0.0, 30.0, 90.0, -135.0] {
        let (strain, stress) = (turned(strain, -angle, 2.0), turned(stress, -angle, 1.0));
        let text = format!("{theirs}LayerAngle = {angle:?}\n{}", path(strain, stress));
        let text = driver(
            &library("oriented_mohr_coulomb"),
            "OrientedMohrCoulomb",
            &text,
        );
        let there = last_row(&text);
        let stress = ["11", "22", "33", "12"].map(|c| there[&format!("stress_{c}")]);
        for (component, found) in ["11", "22", "33", "12"]
            .iter()
            .zip(turned(stress, angle, 1.0))
        {
            let expected = here[&format!("stress_{component}")];
            // Of 100 kPa; what the strains lose in being written and turned.
            assert!(
                (found - expected).abs() < 1e-10 * 100.0,
                "{component} at {angle}: {found} {expected}"
            );
        }
        assert_close(there["PlasticStrain"], here["plastic_strain"], 1e-10, "γ_p");
    }
}

/// `young_modulus` as `YoungModulus`.
fn spelled(id: &str) -> String {
    let capital = |word: &str| word[..1].to_ascii_uppercase() + &word[1..];
    id.split('_').map(capital).collect()
}

#[test]
fn bounds_and_defaults_of_our_laws_are_exported() {
    for (file, hypothesis) in [
        ("elastic", "3d"),
        ("mohr_coulomb", "3d"),
        ("oriented_mohr_coulomb", "axisymmetric"),
        ("coulomb_joint", "interface_2d"),
        ("critical_state_joint", "interface_2d"),
        ("cyclic_joint", "interface_2d"),
        ("hyperbolic_joint", "interface_2d"),
        ("mepi", "interface_2d"),
        ("tz_curve", "interface_2d"),
    ] {
        let native = Opener::default().open(&library(file)).unwrap();
        let foreign = Foreign {
            adapter: Adapter::Mfront,
            library: library(file),
            sidecar: None,
            in_process: true,
            record: None,
            records_once: false,
            externals: None,
            scratch: None,
            tangent_order: None,
        };
        let foreign = Opener::default()
            .open_foreign(&foreign, |_| Ok(()))
            .unwrap();
        let mut n = 0;
        for law in native.laws() {
            let behaviour = foreign.law(&spelled(&law.id)).unwrap();
            let behaviour = behaviour.description();
            assert!(
                behaviour
                    .formulations
                    .iter()
                    .any(|f| f.hypothesis == hypothesis)
            );
            for ours in &law.parameters {
                let name = spelled(&ours.id);
                let theirs = behaviour.parameters.iter().find(|p| p.id == name);
                let theirs = theirs.unwrap_or_else(|| panic!("{name} is missing"));
                assert_eq!(theirs.default, ours.default, "{name}");
                assert_eq!(theirs.optional, ours.optional, "{name}");
                // A `long double` is read on this processor only.
                if cfg!(target_arch = "x86_64") {
                    let ends = |b: &Bounds| (b.lower, b.upper);
                    assert_eq!(ends(&theirs.bounds), ends(&ours.bounds), "{name}");
                    assert_eq!(ends(&theirs.usual), ends(&ours.usual), "{name}");
                }
                n += 1;
            }
        }
        assert!(n >= 2);
    }
}

/// Rounding of the surface of Abbo and Sloan: transition angle and bound on tension.
const ROUNDING: (f64, f64) = (29.0, 0.1);

fn abbo_sloan((angle, bound): (f64, f64)) -> String {
    format!(
        "[parameters]\nYoungModulus = 34e3\nPoissonRatio = 0.3\nCohesion = 1.0\n\
         FrictionAngle = 36.5\nDilatancyAngle = 12.0\nTransitionAngle = {angle:?}\n\
         TensionCutOffParameter = {bound:?}\n"
    )
}

/// Axial stress at failure in triaxial compression on the surface of Abbo, Lyamin, Sloan and Hambleton
/// (2011), c = 1 kPa, φ = 36.5°, lateral stress 100 kPa: p sin φ + √(J₂ K² + a² sin² φ) = c cos φ.
/// Beyond the transition angle K = A + B sin 3θ + C sin² 3θ, which continues that of Mohr–Coulomb,
/// cos θ − sin θ sin φ / √3, with its first two derivatives; here θ = 30° (compression negative).
fn strength((angle, bound): (f64, f64)) -> f64 {
    let (sin, cos) = 36.5_f64.to_radians().sin_cos();
    let t = angle.to_radians();
    let ratio = sin / 3.0_f64.sqrt();
    let (x, w) = (3.0 * t).sin_cos();
    let edge = t.cos() - ratio * t.sin();
    let slope = -t.sin() - ratio * t.cos();
    let by_x = slope / (3.0 * w);
    let c = (9.0 * by_x * x - edge) / (18.0 * w * w);
    let b = by_x - 2.0 * c * x;
    let k = edge - b * x - c * x * x + b + c;
    let surface = |axial: f64| {
        let mean = (axial - 200.0) / 3.0;
        let j2 = (axial + 100.0).powi(2) / 3.0;
        mean * sin + (j2 * k * k + (bound * sin).powi(2)).sqrt() - cos
    };
    let (mut inside, mut outside) = (-100.0, -1000.0);
    for _ in 0..200 {
        let middle = 0.5 * (inside + outside);
        if surface(middle) < 0.0 {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

#[test]
fn the_rounded_mohr_coulomb_of_opengeosys_fails_where_its_surface_says() {
    if !is_there(OPENGEOSYS) {
        return;
    }
    // Closed form of the exact pyramid: σ₁ = N σ₃ + 2 c √N.
    let n = (45.0_f64 + 0.5 * 36.5).to_radians().tan().powi(2);
    let exact = -(100.0 * n + 2.0 * n.sqrt());
    let mut before = f64::INFINITY;
    for rounding in [ROUNDING, (29.9, 0.1), (29.99, 0.01)] {
        let text = format!("hypothesis = \"axisymmetric\"\n{}", abbo_sloan(rounding));
        let text = driver(&behaviours(), "MohrCoulombAbboSloan", &text);
        let found = last_row(&format!("{text}{COMPRESSION}"))["stress_22"];
        // The driver's tolerance.
        assert_close(found, strength(rounding), 1e-8, "axial stress at failure");
        let distance = found - exact;
        assert!(0.0 < distance && distance < before, "{distance}");
        before = distance;
    }
    // Of 398 kPa.
    assert!(before < 0.05, "{before}");
}

#[test]
fn the_same_behaviour_gives_the_same_head_force_in_both_programs() {
    if !is_there(OPENGEOSYS) {
        return;
    }
    let library = toml::Value::from(behaviours().to_str().unwrap());
    let parameters = abbo_sloan(ROUNDING).replace("[parameters]", "[laws.theirs.parameters]");
    let here = BondedPile::run(&format!(
        "[laws.theirs]\nadapter = \"mfront\"\nin_process = true\nlibrary = {library}\n\
         law = \"MohrCoulombAbboSloan\"\n{parameters}[groups.soil]\nlaw = \"theirs\"\n"
    ));
    let there = crate::opengeosys::run("axisymmetric", "1e-12", "mohr_coulomb", None);
    assert_close(here.head_force, there.head_force, 1e-9, "head force");
}

#[test]
fn other_behaviours_of_opengeosys_run() {
    if !is_there(OPENGEOSYS) {
        return;
    }
    let elastic = "YoungModulus = 34e3\nPoissonRatio = 0.3\n";
    let pressed = "Cohesion = 1.0\nFrictionParameter = 0.5\nDilatancyParameter = 0.2\n";
    let clay = "CriticalStateLineSlope = 1.2\nSwellingLineSlope = 6.6e-3\n\
                VirginConsolidationLineSlope = 7.7e-2\n\
                CharacteristicPreConsolidationPressure = 200.0\n\
                AmbientPressure = 0.0\n";
    // Where the behaviour has no initial values of its own, the file gives them.
    let volume = "internal = { VolumeRatio = 1.8, PreConsolidationPressure = 200.0 }\n";
    for (law, parameters, internal) in [
        ("StandardElasticityBrick", elastic.to_owned(), ""),
        ("DruckerPrager", format!("{elastic}{pressed}"), ""),
        (
            "ModCamClay_semiExpl_constE",
            format!("{elastic}{clay}"),
            volume,
        ),
    ] {
        for hypothesis in ["axisymmetric", "plane_strain", "3d"] {
            let end = "[initial]\nstress = { 11 = -100.0, 22 = -100.0, 33 = -100.0 }\n\
                       [[segment]]\nincrements = 10\n\
                       control = { 11 = { stress = -100.0 }, 22 = { strain = -0.001 } }\n";
            let end = end.replacen("[initial]\n", &format!("[initial]\n{internal}"), 1);
            let text = format!("hypothesis = \"{hypothesis}\"\n[parameters]\n{parameters}{end}");
            let row = last_row(&driver(&behaviours(), law, &text));
            assert!(row["stress_22"] < -110.0, "{law}: {}", row["stress_22"]);
        }
    }
}
