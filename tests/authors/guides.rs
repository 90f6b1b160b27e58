//! `pilum new-law` in every language and kind: the commands of the README that a project carries are
//! run as they are there, and all languages give the same, which is the closed form.

use crate::compilers::repository;
use crate::program::{pilum, shell};
use approx::assert_relative_eq;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use tempfile::TempDir;
use tests::case::column;
use tests::needs::compiler;

/// Languages, with the compilers they need.
const LANGUAGES: [(&str, &[(&str, &str)]); 4] = [
    ("rust", &[]),
    ("c", &[("CC", "cc")]),
    ("cpp", &[("CXX", "c++")]),
    ("fortran", &[("FC", "gfortran"), ("CC", "cc")]),
];

/// Lines of the `sh` blocks of a guide.
pub(crate) fn commands(guide: &Path) -> Vec<String> {
    let text = fs::read_to_string(guide).unwrap();
    let blocks = text.split("```sh\n").skip(1);
    blocks
        .flat_map(|block| block.split("```").next().unwrap().lines())
        .map(str::to_owned)
        .collect()
}

/// Follows the guide of a project of each language, and looks at what it leaves.
fn follow(kind: &str, look: impl Fn(&Path)) {
    for (language, needed) in LANGUAGES {
        if needed
            .iter()
            .any(|(variable, name)| compiler(variable, name).is_none())
        {
            continue;
        }
        let place = TempDir::new().unwrap();
        let arguments = [
            "new-law",
            "clay_or_joint",
            "--language",
            language,
            "--kind",
            kind,
        ];
        pilum(place.path(), &arguments).ended(0);
        let project = place.path().join("clay_or_joint");
        let commands = commands(&project.join("README.md"));
        assert_eq!(commands.len(), 6, "{commands:?}");
        for command in commands {
            // `pilum check` is judged by its own tests where the program has it.
            if command.starts_with("pilum check") && !has_check(place.path()) {
                continue;
            }
            let outcome = shell(&project, &command).ended(0);
            let warned = outcome.stderr.contains("warning");
            assert!(!warned, "{language}, {kind}: {command}\n{}", outcome.stderr);
        }
        look(&project);
    }
}

fn has_check(place: &Path) -> bool {
    pilum(place, &["check", "--help"]).code == Some(0)
}

#[test]
fn an_interface_law_in_every_language() {
    let (k_n, k_t, friction) = (1e6, 5e5, 30_f64.to_radians().tan());
    follow("interface", |project| {
        let point = project.join("point.csv");
        let tau = column(&point, "traction_t");
        let slip = column(&point, "plastic_slip");
        // Sliding at 100 tan φ after an elastic part, to and fro; then lifted off its contact.
        let (tau_max, elastic) = (100.0 * friction, 100.0 * friction / k_t);
        assert_relative_eq!(tau[20], tau_max, max_relative = 1e-12);
        assert_relative_eq!(tau[40], -tau_max, max_relative = 1e-12);
        assert_relative_eq!(slip[20], 2e-3 - elastic, max_relative = 1e-12);
        assert_relative_eq!(slip[40], 4e-3 - 3.0 * elastic, max_relative = 1e-12);
        let gap = column(&point, "gap");
        assert_relative_eq!(gap[50], 1e-3 - 100.0 / k_n, max_relative = 1e-12);
        assert_eq!(tau[50].to_bits() & i64::MAX as u64, 0);
        let history = project.join("results/clay_or_joint/history.csv");
        let force = column(&history, "shear_force");
        assert_relative_eq!(*force.last().unwrap(), tau_max, max_relative = 1e-8);
    });
}

#[test]
fn a_continuum_law_in_every_language() {
    let (e, strength, squeezed) = (1e4, 80.0, 0.02);
    follow("continuum", |project| {
        let point = project.join("point.csv");
        let axial = column(&point, "stress_22");
        let plastic = column(&point, "plastic_strain");
        assert_relative_eq!(axial[20], -100.0 - strength, max_relative = 1e-9);
        assert_relative_eq!(plastic[20], squeezed - strength / e, max_relative = 1e-9);
        // Back: 80 kPa down, 80 kPa up, elastically, then yielding in extension.
        assert_relative_eq!(axial[40], -100.0 + strength, max_relative = 1e-9);
        let back = 2.0 * squeezed - 3.0 * strength / e;
        assert_relative_eq!(plastic[40], back, max_relative = 1e-9);
        let history = project.join("results/clay_or_joint/history.csv");
        let load = column(&history, "load");
        let expected = std::f64::consts::PI * strength;
        assert_relative_eq!(*load.last().unwrap(), expected, max_relative = 1e-8);
    });
}

/// Files of a folder below another.
fn below(folder: &Path, prefix: &str, names: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            below(&entry.path(), &format!("{name}/"), names);
        } else {
            names.insert(name);
        }
    }
}

#[test]
fn a_project_in_rust_carries_the_whole_contract() {
    let place = TempDir::new().unwrap();
    pilum(place.path(), &["new-law", "slider", "--language", "rust"]).ended(0);
    for folder in ["abi/src", "abi/bridges/src"] {
        let (theirs, ours) = (place.path().join("slider").join(folder), repository(folder));
        let (mut carried, mut here) = (BTreeSet::new(), BTreeSet::new());
        below(&theirs, "", &mut carried);
        below(&ours, "", &mut here);
        // Optional features, and the crate's own tests.
        let left_out = ["layout.rs", "sources.rs", "export/tests.rs"];
        here.retain(|name| !left_out.contains(&name.as_str()));
        assert_eq!(carried, here);
        for name in carried {
            let copy = fs::read_to_string(theirs.join(&name)).unwrap();
            let original = fs::read_to_string(ours.join(&name)).unwrap();
            assert_eq!(copy, original, "{name}");
        }
    }
}

#[test]
fn no_project_names_this_machine() {
    for (language, _) in LANGUAGES {
        for kind in ["interface", "continuum"] {
            let place = TempDir::new().unwrap();
            let arguments = ["new-law", "slider", "--language", language, "--kind", kind];
            pilum(place.path(), &arguments).ended(0);
            let mut names = BTreeSet::new();
            below(&place.path().join("slider"), "", &mut names);
            for name in names {
                let text = fs::read_to_string(place.path().join("slider").join(&name)).unwrap();
                for mark in ["my_law", "@", env!("CARGO_MANIFEST_DIR")] {
                    let is_contract = name.starts_with("abi/")
                        || name.starts_with("include/")
                        || name == "CONTRACT.md";
                    let found =
                        text.contains(mark) && !(is_contract && mark != env!("CARGO_MANIFEST_DIR"));
                    assert!(!found, "{language}, {kind}: {name} contains {mark}");
                }
            }
        }
    }
}
