//! One law in four languages: `coulomb_joint` in Rust and in `models/foreign`.
//!
//! Goal        laws in C, C++ and Fortran give what the law in Rust gives, tangents included.
//! Set-up      random parameters and paths, through the point driver and call by call.
//! Asserts     every column of every row, and every tangent, to round-off.

use crate::compilers::{library, repository};
use crate::guides::commands;
use crate::program::{pilum, shell};
use abi::Hypothesis;
use law::{End, Law, Operator, SearchPath, Start, Strided};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use tempfile::TempDir;
use tests::needs::compiler;
use tests::tolerance::ROUND_OFF;
use tests::words::words;

/// Suffix of the source, id of the law.
const LAWS: [(&str, &str); 3] = [
    ("c", "coulomb_joint_c"),
    ("cpp", "coulomb_joint_cpp"),
    ("f90", "coulomb_joint_fortran"),
];

/// A linear congruential generator: the same paths everywhere.
struct Random(u64);

impl Random {
    /// Uniform in a range.
    fn between(&mut self, from: f64, to: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        from + (to - from) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }

    fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.between(0.0, choices.len() as f64) as usize]
    }
}

/// Random parameters in declared order.
fn parameters(random: &mut Random) -> [f64; 6] {
    let friction = random.one_of(&[0.0, random_angle(1), random_angle(2), 44.0]);
    let cohesion = random.one_of(&[0.0, 5.0, 40.0]);
    let bound = cohesion / f64::to_radians(friction).tan().max(0.1);
    [
        random.between(1e5, 1e7),
        random.between(1e5, 1e7),
        cohesion,
        friction,
        friction * random.one_of(&[0.0, 0.3, 1.0]),
        bound * random.one_of(&[0.0, 0.5, 1.0]),
    ]
}

fn random_angle(seed: u64) -> f64 {
    Random(seed).between(5.0, 40.0)
}

const NAMES: &str =
    "normal_stiffness shear_stiffness cohesion friction_angle dilatancy_angle tensile_strength";

/// A driver whose law is `@LAW@`: sliding both ways, opening, closing, with and without a spring.
fn driver(random: &mut Random, folder: &Path) -> String {
    let mut text = format!(
        "law = '@LAW@'\nhypothesis = 'interface_2d'\nlaw_path = ['{}']\n[parameters]\n",
        folder.display()
    );
    for (name, value) in words(NAMES).iter().zip(parameters(random)) {
        writeln!(text, "{name} = {value:?}").unwrap();
    }
    let start = random.between(-200.0, -1.0);
    writeln!(text, "[initial]\ntraction = {{ n = {start:?} }}").unwrap();
    for _ in 0..6 {
        let slip = random.between(-2e-3, 2e-3);
        let opening = random.between(-2e-4, 2e-4);
        let spring = random.between(0.0, 1e5);
        let normal = random.one_of(&[
            format!("jump = {opening:?}").leak() as &str,
            format!("stiffness = {spring:?}").leak(),
        ]);
        let n = random.between(5.0, 40.0) as usize;
        writeln!(
            text,
            "[[segment]]\nincrements = {n}\ncontrol = {{ t = {{ jump = {slip:?} }}, n = {{ {normal} }} }}"
        )
        .unwrap();
    }
    text
}

/// The table of a driver: names, rows. It may end early, without equilibrium.
fn table(text: &str, law: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = text.replace("@LAW@", law);
    let mut out = Vec::new();
    let driver = tests::driver::of_text(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let _ = runs::point::write_csv(&driver, &mut out, Path::new("table"));
    let out = String::from_utf8(out).unwrap();
    let mut lines = out.lines();
    let names = lines
        .next()
        .unwrap()
        .split(',')
        .map(str::to_owned)
        .collect();
    let row = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
    (names, lines.map(row).collect())
}

#[test]
fn all_languages_follow_random_paths_alike() {
    let folder = TempDir::new().unwrap();
    let built: Vec<&str> = LAWS
        .into_iter()
        .filter(|(suffix, id)| {
            let source = repository(&format!("models/foreign/coulomb_joint.{suffix}"));
            library(&source, id, folder.path()).is_some()
        })
        .map(|(_, id)| id)
        .collect();
    let mut random = Random(20);
    let (mut opened, mut slid, mut rows_seen) = (false, false, 0);
    for path in 0..60 {
        let text = driver(&mut random, folder.path());
        let (names, expected) = table(&text, "coulomb_joint");
        rows_seen += expected.len();
        for law in &built {
            let (found_names, found) = table(&text, law);
            assert_eq!(found_names, names);
            assert_eq!(found.len(), expected.len(), "path {path}, {law}\n{text}");
            for (column, name) in names.iter().enumerate().filter(|(_, n)| *n != "iterations") {
                let scale = expected
                    .iter()
                    .map(|row| row[column].abs())
                    .fold(0.0, f64::max);
                for (k, (a, b)) in found.iter().zip(&expected).enumerate() {
                    assert!(
                        (a[column] - b[column]).abs() <= ROUND_OFF * scale,
                        "path {path}, {law}, row {k}, {name}: {} instead of {}\n{text}",
                        a[column],
                        b[column]
                    );
                }
            }
        }
        let at = |name: &str| names.iter().position(|n| n == name).unwrap();
        opened |= expected.iter().any(|row| row[at("gap")] > 0.0);
        slid |= expected.iter().any(|row| row[at("plastic_slip")] > 0.0);
    }
    assert!(opened && slid && rows_seen > 3000, "{rows_seen}");
    tangents_agree(&built, folder.path());
}

/// Random points, call by call: fluxes, states and both operators.
fn tangents_agree(laws: &[&str], folder: &Path) {
    const N: usize = 200;
    let search = SearchPath::new(&[folder.to_owned()]);
    let mut random = Random(7);
    for _ in 0..20 {
        let parameters = parameters(&mut random);
        let build = |id: &str| -> Law {
            let law = search.law(id).unwrap();
            law.build(Hypothesis::Interface2d, &parameters).unwrap()
        };
        let reference = build("coulomb_joint");
        let mut values = |from: f64, to: f64, n: usize| -> Vec<f64> {
            (0..n * N).map(|_| random.between(from, to)).collect()
        };
        let gradient = values(-1e-4, 1e-4, 2);
        let gradient_end = values(-1e-4, 1e-4, 2);
        let mut flux = values(-200.0, 0.0, 2);
        let mut state = values(0.0, 1e-4, 4);
        // A third open, and then without traction; broken only where they have been open.
        for i in 0..N {
            let open = i % 3 == 0;
            state[4 * i + 2] *= f64::from(u8::from(open));
            state[4 * i + 3] = f64::from(u8::from(open || i % 3 == 1));
            if open {
                flux[2 * i..2 * i + 2].fill(0.0);
            }
        }
        for operator in [Operator::Consistent, Operator::Elastic, Operator::None] {
            let call = |law: &Law| {
                let (mut end, mut states, mut matrix) =
                    (vec![0.0; 2 * N], vec![0.0; 4 * N], vec![0.0; 4 * N]);
                let start = Start {
                    n_points: N,
                    gradient: (&gradient, Strided::rows(2)),
                    gradient_end: (&gradient_end, Strided::rows(2)),
                    flux: (&flux, Strided::rows(2)),
                    state: &state,
                    time: 0.0,
                    time_increment: 1.0,
                    moment: law::Moment::default(),
                    sites: &[],
                };
                let to = End {
                    flux: (&mut end, Strided::rows(2)),
                    state: &mut states,
                    operator: &mut matrix,
                };
                law.integrate(&start, operator, to).unwrap();
                [end, states, matrix]
            };
            let expected = call(&reference);
            for id in laws {
                let found = call(&build(id));
                for (what, (a, b)) in ["flux", "state", "tangent"]
                    .iter()
                    .zip(found.iter().zip(&expected))
                {
                    let scale = b.iter().map(|x| x.abs()).fold(0.0, f64::max);
                    for (k, (a, b)) in a.iter().zip(b).enumerate() {
                        let close = (a - b).abs() <= ROUND_OFF * scale;
                        assert!(close, "{id}, {operator:?}: {what}[{k}]: {a} instead of {b}");
                    }
                }
            }
        }
    }
}

/// Runs the commands of `models/foreign/README.md`; ids of the laws that could be built.
fn built_as_the_guide_says(folder: &Path) -> Vec<&'static str> {
    for name in ["abi", "models"] {
        std::os::unix::fs::symlink(repository(name), folder.join(name)).unwrap();
    }
    let guide = repository("models/foreign/README.md");
    let built = commands(&guide).into_iter().zip(LAWS).filter(|(line, _)| {
        let (variable, default) = match line.split_whitespace().next() {
            Some("cc") => ("CC", "cc"),
            Some("c++") => ("CXX", "c++"),
            _ => ("FC", "gfortran"),
        };
        if compiler(variable, default).is_none() {
            return false;
        }
        shell(folder, line).ended(0);
        true
    });
    built.map(|(_, (_, id))| id).collect()
}

/// What the law in Rust refuses, the others refuse, at the same key of the file.
#[test]
fn all_languages_refuse_alike() {
    let folder = TempDir::new().unwrap();
    for id in ["coulomb_joint"]
        .into_iter()
        .chain(built_as_the_guide_says(folder.path()))
    {
        let text = |dilatancy: f64, tensile: f64| {
            format!(
                "law = '{id}'\nhypothesis = 'interface_2d'\nlaw_path = ['.']\n[parameters]\n\
                 normal_stiffness = 1e6\nshear_stiffness = 1e6\ncohesion = 5\nfriction_angle = 30\n\
                 dilatancy_angle = {dilatancy}\ntensile_strength = {tensile}\n[[segment]]\n\
                 increments = 1\ncontrol = {{ t = {{ jump = 1e-3 }} }}\n"
            )
        };
        for (dilatancy, tensile, says) in [
            (31.0, 0.0, "driver.toml:9:19"),
            (0.0, 9.0, "driver.toml:10:20"),
            (-1.0, 0.0, "≥"),
        ] {
            let place = folder.path();
            fs::write(place.join("driver.toml"), text(dilatancy, tensile)).unwrap();
            let outcome = pilum(place, &["point", "driver.toml"]).ended(1);
            let says = if says == "≥" {
                "is outside [0, 90)"
            } else {
                says
            };
            outcome.shows(says);
        }
    }
}

/// Exceptions stop at the boundary, are reported to be the law's, and the law is not called again.
#[test]
fn an_exception_is_a_defect_of_the_law() {
    let folder = TempDir::new().unwrap();
    let source = repository("tests/authors/throws.cpp");
    if library(&source, "throws", folder.path()).is_none() {
        return;
    }
    let search = SearchPath::new(&[folder.path().to_owned()]);
    let law = search.law("throws").unwrap();
    let build = |value: f64| law.build(Hypothesis::Interface2d, &[value]);
    let refused = build(1.0).unwrap_err();
    assert!(
        !refused.library_at_fault && refused.reason.contains("strange: it is 1"),
        "{refused:?}"
    );
    let defect = build(2.0).unwrap_err();
    assert!(
        defect.library_at_fault && defect.reason.contains("no memory"),
        "{defect:?}"
    );
    let built = build(3.0).unwrap();
    let update = |says: &str| {
        let start = Start {
            n_points: 1,
            gradient: (&[0.0; 2], Strided::rows(2)),
            gradient_end: (&[0.0; 2], Strided::rows(2)),
            flux: (&[0.0; 2], Strided::rows(2)),
            state: &[0.0],
            time: 0.0,
            time_increment: 1.0,
            moment: law::Moment::default(),
            sites: &[],
        };
        let to = End {
            flux: (&mut [0.0; 2], Strided::rows(2)),
            state: &mut [0.0],
            operator: &mut [],
        };
        let failure = built.integrate(&start, Operator::None, to).unwrap_err();
        assert_eq!(failure.outcome, abi::status::Outcome::Internal);
        assert!(failure.message.contains(says), "{}", failure.message);
    };
    update("point 0: threw: out of range");
    update("not called again");
}
