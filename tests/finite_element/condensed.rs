//! Condensed and assembled equations.
//!
//! Goal        condensing the linear groups changes no answer; what was factorised is used again
//! Geometry    the chamber of `cases/chamber_mesh1`, with its thin layer or a zero-thickness joint
//! Boundary    as there
//! Law         elastic ground; mepi, coulomb_joint
//! Asserts     every probe of every increment within 1e-9 of its largest value; factorisations
//!             from `summary.json`

use host::case::Case;
use host::run::{Options, run_reusing};
use host::solver::Reuse;
use serde_json::Value;
use std::path::Path;
use tests::case::{Silent, table};

/// The chamber's loading over its first fifth, in variants that differ as given.
fn chamber(case: &str, variants: &str) -> Vec<Case> {
    let folder = tempfile::tempdir().unwrap();
    let base = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../cases")
        .join(case);
    let text = format!(
        "base = \"{}\"\n[output]\nprofile = \"never\"\nfields = \"never\"\n[[phase]]\nname = \"loading\"\n\
         increments = 10\ndisplacement = [{{ line = \"pile_head\", z = -0.001 }}]\n{variants}",
        base.join("case.toml").display()
    );
    let file = folder.path().join("case.toml");
    std::fs::write(&file, text).unwrap();
    Case::load(&file).unwrap()
}

/// Factorisations by phase.
fn factorisations(folder: &Path) -> Vec<u64> {
    let text = std::fs::read_to_string(folder.join("summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&text).unwrap();
    let phases = summary["phases"].as_array().unwrap();
    phases
        .iter()
        .map(|p| p["factorisations"].as_u64().unwrap())
        .collect()
}

#[test]
fn condensing_the_ground_changes_no_answer() {
    for case in ["chamber_mesh1", "chamber_joint"] {
        let variants = "[[variant]]\nname = \"condensed\"\nsolver.equations = \"condensed\"\n\
                        [[variant]]\nname = \"sparse\"\nsolver.equations = \"sparse\"\n\
                        [[variant]]\nname = \"auto\"\n";
        let runs: Vec<_> = chamber(case, variants)
            .iter()
            .map(|case| {
                let folder = tempfile::tempdir().unwrap();
                let mut observer = Silent::default();
                run_reusing(
                    case,
                    folder.path(),
                    &mut observer,
                    &mut Reuse::default(),
                    Options::default(),
                )
                .unwrap();
                (
                    table(&folder.path().join("history.csv")),
                    factorisations(folder.path()),
                )
            })
            .collect();
        let [condensed, sparse, auto] = &runs[..] else {
            panic!("three variants")
        };
        if case == "chamber_mesh1" {
            // All is linear in its confinement, and factorised once.
            assert_eq!(condensed.1[0], 1);
        }
        assert_eq!(auto.1, condensed.1, "auto condenses here");
        let probes = condensed.0[0].keys();
        for probe in probes.filter(|name| !["phase", "iterations"].contains(&name.as_str())) {
            let values = |rows: &[std::collections::BTreeMap<String, String>]| -> Vec<f64> {
                rows.iter().map(|row| row[probe].parse().unwrap()).collect()
            };
            let (a, b) = (values(&condensed.0), values(&sparse.0));
            assert_eq!(a.len(), 11);
            let largest = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for (a, b) in a.iter().zip(&b) {
                assert!(
                    (a - b).abs() <= 1e-9 * largest,
                    "{case}, {probe}: {a} and {b}"
                );
            }
        }
    }
}

#[test]
fn variants_on_one_mesh_share_the_factors_of_the_ground() {
    let variants = "[[variant]]\nname = \"rough\"\n\
                    [[variant]]\nname = \"smooth\"\nlaws.mepi.parameters.mu_p = 0.6\n\
                    [[variant]]\nname = \"soft_ground\"\nlaws.sand.parameters.young_modulus = 30e3\n";
    let mut reuse = Reuse::default();
    let cases = chamber("chamber_mesh1", variants);
    let mut factorised = Vec::new();
    let mut alone = Vec::new();
    let mut together = Vec::new();
    for case in &cases {
        for (reuse, rows) in [
            (&mut reuse, &mut together),
            (&mut Reuse::default(), &mut alone),
        ] {
            let folder = tempfile::tempdir().unwrap();
            run_reusing(
                case,
                folder.path(),
                &mut Silent::default(),
                reuse,
                Options::default(),
            )
            .unwrap();
            rows.push(table(&folder.path().join("history.csv")));
            factorised.push(factorisations(folder.path())[1]);
        }
    }
    // Confinement and loading hold different displacements, so each run of its own factorises
    // its ground in both phases; in the loading of the second variant one is saved.
    let [_, _, shared, own, changed, changed_own] = factorised[..] else {
        panic!("six runs")
    };
    assert_eq!(shared + 1, own);
    assert_eq!(changed, changed_own);
    assert!(alone == together, "reuse changes results");
}
