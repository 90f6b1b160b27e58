//! Cases exported to other programs, run there, and read back: the table is that of a run here.

use crate::distributed::python;
use crate::{KRATOS, OPENGEOSYS, beside, installed, is_there};
use exchange::{Model, Program};
use input::Case;
use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use tests::needs;
use tests::words::has;
use tests::words::rows_of;
use tests::words::words;

/// The other programs iterate until displacements change by 1e-10 of themselves, Pilum until the residual is 1e-9 of
/// the forces or less.
const ITERATED: f64 = 1e-9;
/// CalculiX prints seven digits. They are those of the largest number where numbers cancel.
const PRINTED: f64 = 1e-6;
/// What is missing where it is.
pub(crate) const CALCULIX: &str = "`ccx` (Debian: calculix-ccx)";
/// The points that elements of Kratos have.
const REDUCED: &str = "groups.soil.integration=\"reduced\"";

fn bonded_pile() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/bonded_pile/case.toml")
}

fn case(file: &Path, variant: Option<&str>, settings: &[&str]) -> Case {
    let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
    let cases = Case::load_with(file, &settings).unwrap();
    let mut cases = cases.into_iter();
    cases
        .find(|case| case.variant.as_deref() == variant)
        .unwrap()
}

/// Runs what was exported, in its folder.
fn run_there(program: Program, folder: &Path) {
    let mut command = match program {
        Program::Ogs => {
            let mut command = Command::new(installed(OPENGEOSYS));
            command.args(["model.prj", "-o", "."]);
            command
        }
        Program::Kratos => {
            let mut command = Command::new(installed(KRATOS));
            command.arg("run_kratos.py");
            command
        }
        Program::Calculix => {
            let mut command = Command::new("ccx");
            command.arg("model");
            command
        }
        Program::Dolfinx => {
            let mut command = Command::new(python().unwrap());
            command.arg("run_dolfinx.py");
            command
        }
    };
    let output = command.current_dir(folder).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{command:?}\n{said}");
}

type Table = Vec<HashMap<String, String>>;

/// Compares all columns of all increments. A column may differ by this part of its largest value.
fn assert_same(program: Program, case: &Case, tolerance: f64) {
    let place = tempfile::tempdir().unwrap();
    let (there, here) = (place.path().join("there"), place.path().join("here"));
    exchange::export(case, program, &there).unwrap();
    run_there(program, &there);
    exchange::import(&there, None).unwrap();
    runs::run::run(case, &here, &mut tests::case::Silent::default()).unwrap();
    let table = |folder: &Path| -> Table {
        let rows = tests::case::table(&folder.join("history.csv"));
        rows.into_iter()
            .map(|row| row.into_iter().collect())
            .collect()
    };
    let (found, expected) = (table(&there), table(&here));
    assert_eq!(found.len(), expected.len());
    let compared = found[0]
        .keys()
        .filter(|name| !["phase", "iterations"].contains(&name.as_str()));
    for name in compared {
        let column = |table: &Table| -> Vec<f64> {
            table.iter().map(|row| row[name].parse().unwrap()).collect()
        };
        let (found, expected) = (column(&found), column(&expected));
        let size = expected
            .iter()
            .fold(0.0_f64, |size, value| size.max(value.abs()));
        for (found, expected) in found.iter().zip(&expected) {
            assert!(
                (found - expected).abs() <= tolerance * size,
                "{program:?}, {name}: {found} there, {expected} here"
            );
        }
    }
}

#[test]
fn opengeosys_gives_our_table() {
    if !is_there(OPENGEOSYS) {
        return;
    }
    let pile = bonded_pile();
    let block = beside("block.toml");
    for variant in ["m200_elastic", "m200"] {
        assert_same(Program::Ogs, &case(&pile, Some(variant), &[]), ITERATED);
    }
    for setting in ["analysis=\"plane_strain\"", "groups.soil.law=\"soil\""] {
        assert_same(Program::Ogs, &case(&block, None, &[setting]), ITERATED);
    }
}

#[test]
fn kratos_gives_our_table() {
    if !is_there(KRATOS) {
        return;
    }
    let (pile, block) = (bonded_pile(), beside("block.toml"));
    let reduced = [REDUCED, "groups.pile.integration=\"reduced\""];
    assert_same(
        Program::Kratos,
        &case(&pile, Some("m200_elastic"), &reduced),
        ITERATED,
    );
    let reduced = [
        REDUCED,
        "groups.block.integration=\"reduced\"",
        "analysis=\"plane_strain\"",
    ];
    assert_same(Program::Kratos, &case(&block, None, &reduced), ITERATED);
    // Its user materials start free of stress: c' = c + σ_0 tan φ stands for the confinement.
    let none = "{ 11 = 0.0, 22 = 0.0, 33 = 0.0, 12 = 0.0 }";
    let stresses = ["soil", "pile"].map(|group| format!("groups.{group}.initial_stress={none}"));
    let plastic = [
        REDUCED,
        "groups.pile.integration=\"reduced\"",
        "laws.soil.parameters.cohesion=75.0",
        &stresses[0],
        &stresses[1],
        "phase.push.pressure=[]",
        "phase.push.increments=2",
        "phase.push.displacement=[{ line = \"pile_head\", z = -0.0001 }]",
    ];
    assert_same(
        Program::Kratos,
        &case(&pile, Some("m200"), &plastic),
        ITERATED,
    );
}

#[test]
fn calculix_gives_our_table() {
    if Command::new("ccx").arg("-v").output().is_err() {
        needs::missing(CALCULIX);
        return;
    }
    assert_same(
        Program::Calculix,
        &case(&bonded_pile(), Some("m200_elastic"), &[]),
        PRINTED,
    );
    let plane = ["analysis=\"plane_strain\""];
    assert_same(
        Program::Calculix,
        &case(&beside("block.toml"), None, &plane),
        PRINTED,
    );
}

#[test]
fn dolfinx_gives_our_table() {
    if python().is_none() {
        return;
    }
    let (pile, block) = (bonded_pile(), beside("block.toml"));
    for variant in ["m200_elastic", "m200"] {
        assert_same(Program::Dolfinx, &case(&pile, Some(variant), &[]), ITERATED);
    }
    for setting in [
        "analysis=\"plane_strain\"",
        "groups.soil.law=\"soil\"",
        REDUCED,
        "laws.soil.parameters.scheme=\"explicit\"",
    ] {
        assert_same(Program::Dolfinx, &case(&block, None, &[setting]), ITERATED);
    }
}

/// The vertical force of a pressure on a ring, of the whole turn: p π (r_2² − r_1²).
#[test]
fn forces_are_of_the_whole_turn() {
    let case = case(&beside("block.toml"), None, &["phase.loads.force=[]"]);
    let model = Model::of(&case, Program::Ogs).unwrap();
    let load = model
        .loads
        .iter()
        .find(|load| load.name == "loads")
        .unwrap();
    let force = load.forces.iter().map(|force| force[1]).sum::<f64>();
    let expected = -30.0 * std::f64::consts::PI * (2.0 * 2.0 - 0.5 * 0.5);
    assert!((force - expected).abs() < 1e-12 * expected.abs(), "{force}");
    let push = model.held.iter().find(|held| held.line == "head").unwrap();
    // To −20 mm at half of the phase, back to a quarter of it, and there.
    let expected = [0.0, 0.0, -0.01, -0.02, -0.0125, -0.005, -0.005, -0.005];
    let all = push.values.iter().zip(expected);
    assert!(
        all.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-15,
        "{:?}",
        push.values
    );
    assert_eq!(model.steps[2].counted_from, Some(1));
}

#[test]
fn what_cannot_be_carried_is_named() {
    let left = |program: Program| {
        let file = beside("block.toml");
        let model = Model::of(&case(&file, None, &[]), program).unwrap();
        model
            .not_carried
            .into_iter()
            .map(|key| key.key)
            .collect::<Vec<_>>()
    };
    for program in [Program::Ogs, Program::Dolfinx] {
        assert_eq!(left(program), ["solver", "probes.s"]);
    }
    let points = words("groups.soil.integration groups.block.integration solver probes.s");
    assert_eq!(left(Program::Kratos), points);
    assert_eq!(
        left(Program::Calculix),
        ["solver", "probes.h", "probes.s", "phase"]
    );
    for [program, setting, key] in rows_of(
        r#"
calculix | groups.soil.law="soil" | groups.soil.law
ogs | laws.soil.parameters.tensile_strength=1.0 | -
ogs | groups.soil.initial_stress={ k_0 = 0.5 } | groups.soil.initial_stress
kratos | groups.soil.active=false | groups.soil.active
ogs | phase.push.activate=["soil"] | phase.push.activate
ogs | phase.push.displacement=[{ line = "top", y = 0.0 }] | phase.push.displacement
"#,
    ) {
        let program = match program {
            "calculix" => Program::Calculix,
            "ogs" => Program::Ogs,
            _ => Program::Kratos,
        };
        let found = Model::of(&case(&beside("block.toml"), None, &[setting]), program);
        match found {
            Ok(_) => assert!(key == "-", "{setting}"),
            Err(error) => {
                let text = error.to_string();
                has(&text, format!("{key}: "));
                has(&text, "cannot be carried to");
            }
        }
    }
}

#[test]
fn what_is_no_equilibrium_is_not_taken_for_one() {
    let place = tempfile::tempdir().unwrap();
    let there = place.path();
    let case = case(
        &beside("block.toml"),
        None,
        &["groups.soil.law=\"elastic\""],
    );
    exchange::export(&case, Program::Kratos, there).unwrap();
    let model: Model =
        serde_json::from_str(&std::fs::read_to_string(there.join("model.json")).unwrap()).unwrap();
    let free = (0..model.nodes.len())
        .find(|node| !model.held.iter().any(|held| held.nodes.contains(node)))
        .unwrap();
    let mut rows = "step,node,u_0,u_1,r_0,r_1\n".to_owned();
    for step in 0..model.steps.len() {
        for node in 0..model.nodes.len() {
            let force = if node == free && step == 2 { 1e6 } else { 0.0 };
            let _ = writeln!(rows, "{step},{node},0,0,0,{force}");
        }
    }
    std::fs::write(there.join("nodes.csv"), rows).unwrap();
    let error = exchange::import(there, None).unwrap_err().to_string();
    assert!(error.contains("no equilibrium: 1.0e0 of"), "{error}");
    assert_eq!(tests::case::table(&there.join("history.csv")).len(), 2);
    let summary = std::fs::read_to_string(there.join("summary.json")).unwrap();
    assert!(summary.contains("\"status\": \"stopped\""), "{summary}");
    // Results of an earlier export are not read as those of a later one, and nothing else goes.
    std::fs::write(there.join("mine.txt"), "mine").unwrap();
    exchange::export(&case, Program::Calculix, there).unwrap();
    let mut left: Vec<String> = std::fs::read_dir(there)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    let error = exchange::import(there, None).unwrap_err().to_string();
    assert!(error.contains("run `ccx model` there first"), "{error}");
    left.sort();
    assert_eq!(left, ["mine.txt", "model.inp", "model.json"]);
}
