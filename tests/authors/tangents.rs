//! Laws without a consistent tangent, and with one by differences.
//!
//! Goal        a law may declare its tangent approximate or missing, and is solved all the same;
//!             differences are as good as the derivative.
//! Set-up      the joint of `models/foreign` in C, with what it writes as its tangent changed
//!             (derivative, differences, elastic operator, none), between two blocks, pressed and pushed
//!             into slip with dilatancy.
//! Asserts     the same shear traction to the tolerance of the solver in at most 1.5 times the iterations
//!             with the derivative; reports on what a law declares; `pilum check` passes.

use crate::compilers::{library, repository};
use crate::program::pilum;
use abi::Hypothesis;
use law::{End, Moment, Operator, SearchPath, Start, Strided};
use serde_json::Value;
use std::path::Path;
use tempfile::TempDir;
use tests::or_skip;
use tests::tolerance::close;

const CASE: &str = r#"
law_path = ["."]
analysis = "plane_strain"
supports = [{ line = "bottom", fixed = ["x", "y"] }]
[mesh]
columns = [{ n = 4, to = 1.0 }]
rows = [{ n = 2, to = 0.5 }, { n = 2, to = 1.0 }]
lines = { bottom = { y = 0.0 }, joint = { y = 0.5 }, top = { y = 1.0 } }
region = [{ group = "blocks" }]
[laws.block]
law = "elastic"
parameters = { young_modulus = 1e5, poisson_ratio = 0.2 }
[laws.joint]
law = "coulomb_joint_c"
parameters = { normal_stiffness = 1e6, shear_stiffness = 4e5, cohesion = 2.0, friction_angle = 30.0, dilatancy_angle = 10.0 }
[groups.blocks]
formulation = "solid"
law = "block"
[groups.joint]
formulation = "zero_thickness"
line = "joint"
law = "joint"
[probes]
shear = { group = "joint", quantity = "traction_t" }
[solver]
force_tolerance = 1e-9
displacement_tolerance = 1e-9
[[phase]]
name = "press"
increments = 2
displacement = [{ line = "top", x = 0.0, y = -1e-3 }]
[[phase]]
name = "push"
increments = 10
displacement = [{ line = "top", x = 6e-3, y = -1e-3 }]
"#;

/// What the law writes as its tangent: a change of its source, and of its flags.
struct Variant {
    name: &'static str,
    flags: &'static str,
    tangent: &'static str,
}

const VARIANTS: [Variant; 4] = [
    Variant {
        name: "derivative",
        flags: "0",
        tangent: "",
    },
    Variant {
        name: "differences",
        flags: "0",
        tangent: "if (tangent == PILUM_TANGENT_CONSISTENT) {\n\
                  carry(joint, point, end);\n\
                  double size = (fabs(point->flux[0]) + 1.0) / fmax(joint->k_n, joint->k_t);\n\
                  return pilum_differentiate(joint, point, update, size, end);\n}\n",
    },
    Variant {
        name: "approximate",
        flags: "PILUM_T_TANGENT_APPROXIMATE",
        tangent: "if (tangent == PILUM_TANGENT_CONSISTENT) { tangent = PILUM_TANGENT_ELASTIC; }\n",
    },
    Variant {
        name: "none",
        flags: "PILUM_T_NO_TANGENT",
        tangent: "if (tangent == PILUM_TANGENT_CONSISTENT) { return PILUM_E_UNSUPPORTED; }\n",
    },
];

/// Builds a variant as `coulomb_joint_c` in a folder. `None`: there is no compiler.
fn built(variant: &Variant, folder: &Path) -> Option<std::path::PathBuf> {
    let text = std::fs::read_to_string(repository("models/foreign/coulomb_joint.c")).unwrap();
    let hypothesis = "    .hypothesis = PILUM_H_INTERFACE_2D,\n";
    let begin = "pilum_tangent tangent, pilum_response *end) {\n    carry(";
    assert!(text.contains(hypothesis) && text.contains(begin));
    let changed = text
        .replace(
            hypothesis,
            &format!("{hypothesis}    .flags = {},\n", variant.flags),
        )
        .replace(
            begin,
            &begin.replace("    carry(", &format!("{}    carry(", variant.tangent)),
        );
    let source = folder.join("coulomb_joint.c");
    std::fs::write(&source, changed).unwrap();
    library(&source, "coulomb_joint_c", folder)
}

/// The mean shear traction at the end, iterations of all phases, and what was said.
fn solved(folder: &Path) -> (f64, u64, String) {
    std::fs::write(folder.join("case.toml"), CASE).unwrap();
    let outcome = pilum(folder, &["run", "case.toml", "--out", "results"]).ended(0);
    let history = std::fs::read_to_string(folder.join("results/history.csv")).unwrap();
    let mut lines = history.lines();
    let column = lines
        .next()
        .unwrap()
        .split(',')
        .position(|name| name == "shear");
    let last = lines
        .last()
        .unwrap()
        .split(',')
        .nth(column.unwrap())
        .unwrap();
    let summary = std::fs::read_to_string(folder.join("results/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    let phases = summary["phases"].as_array().unwrap();
    let iterations = phases
        .iter()
        .map(|phase| phase["iterations"].as_u64().unwrap())
        .sum();
    (last.parse().unwrap(), iterations, outcome.stderr)
}

#[test]
fn every_kind_of_tangent_is_solved() {
    let mut expected: Option<(f64, u64)> = None;
    for variant in &VARIANTS {
        let name = variant.name;
        let folder = TempDir::new().unwrap();
        let file = or_skip!(built(variant, folder.path()));
        let (shear, iterations, said) = solved(folder.path());
        println!("{name}: shear traction {shear:.9e}, {iterations} iterations");
        let (of_derivative, few) = *expected.get_or_insert((shear, iterations));
        close(name, shear, of_derivative, 1e-6 * of_derivative.abs());
        let is_exact = variant.flags == "0";
        assert_eq!(
            said.contains("its tangents approximate"),
            !is_exact,
            "{name}: {said}"
        );
        assert!(!said.contains("differs"), "{name}: {said}");
        // At the kink where slip begins differences lie between both sides.
        assert!(2 * iterations <= 3 * few, "{name}: {iterations}, {few}");
        let path = file.to_str().unwrap();
        pilum(folder.path(), &["check", path]).ended(0);
        let page = pilum(
            folder.path(),
            &["laws", "coulomb_joint_c", "--law-path", "."],
        );
        let says = match variant.flags {
            "0" => "tangent unsymmetric",
            "PILUM_T_NO_TANGENT" => "no tangent but the elastic operator",
            _ => "tangent unsymmetric, approximate",
        };
        assert!(page.stdout.contains(says), "{}{}", page.stdout, page.stderr);
    }
}

/// Texts, and what is there instead.
type Edits = &'static [(&'static str, &'static str)];

/// A joint of 1e5 kPa/m that calls every update unreliable, its tangent by differences.
const UNRELIABLE: [(&str, &str, Edits); 3] = [
    (
        "models/foreign/coulomb_joint.c",
        "coulomb_joint_c",
        &[(
            "pilum_tangent tangent, pilum_response *end) {\n    carry(",
            "pilum_tangent tangent, pilum_response *end) {\n    end->reason = \"coarse\";\n    for (int i = 0; \
             i < 2; i++) { end->flux[i] = point->flux[i] + 1e5 * point->increment[i]; }\n    if (tangent == \
             PILUM_TANGENT_CONSISTENT) { return pilum_differentiate(joint, point, update, 1e-3, end); }\n    \
             if (tangent == PILUM_TANGENT_NONE) { return PILUM_OK_UNRELIABLE; }\n    carry(",
        )],
    ),
    (
        "tests/authors/two_laws.cpp",
        "counter_cpp",
        &[
            (
                "explicit Counter(",
                "double difference_size() const { return 1e-3; }\n    explicit Counter(",
            ),
            (
                "            end.tangent[3 * i] = 1e5;\n",
                "            end.reason = \"coarse\";\n",
            ),
            (
                "        return PILUM_OK;\n    }\n};\n\nPILUM",
                "        return PILUM_OK_UNRELIABLE;\n    }\n};\n\nPILUM",
            ),
        ],
    ),
    (
        "tests/authors/two_laws.f90",
        "counter_fortran",
        &[
            ("  subroutine counter(", "  recursive subroutine counter("),
            (
                "    call elastic(1e5_dp, point, end)\n",
                "    end%flux = point%flux + 1e5_dp*point%increment\n    end%reason = 'coarse'\n    \
                 if (tangent == TANGENT_NONE) status = PILUM_OK_UNRELIABLE\n    \
                 if (tangent == TANGENT_CONSISTENT) call differentiate(p, point, counter, 1e-3_dp, end, status)\n",
            ),
        ],
    ),
];

#[test]
fn a_tangent_by_differences_of_unreliable_updates_is_there_and_called_unreliable() {
    for (source, id, edits) in UNRELIABLE {
        let mut text = std::fs::read_to_string(repository(source)).unwrap();
        for (from, to) in edits {
            assert!(text.contains(from), "{source}: {from}");
            text = text.replacen(from, to, 1);
        }
        let folder = TempDir::new().unwrap();
        let changed = folder.path().join(Path::new(source).file_name().unwrap());
        std::fs::write(&changed, text).unwrap();
        if library(&changed, id, folder.path()).is_none() {
            continue;
        }
        let law = SearchPath::new(&[folder.path().to_owned()])
            .law(id)
            .unwrap();
        let parameters: &[f64] = match law.description().parameters.len() {
            0 => &[],
            _ => &[1e5, 1e5, 0.0, 30.0, 0.0, 0.0],
        };
        let built = law.build(Hypothesis::Interface2d, parameters).unwrap();
        let rows = Strided::rows(2);
        let state = built.initial_state(1, (&[0.0; 2], rows)).unwrap();
        let (mut flux, mut state_end, mut operator) = ([0.0; 2], state.clone(), [0.0; 4]);
        let success = built
            .integrate(
                &Start {
                    n_points: 1,
                    gradient: (&[0.0; 2], rows),
                    gradient_end: (&[-1e-3, 0.0], rows),
                    flux: (&[0.0; 2], rows),
                    state: &state,
                    time: 0.0,
                    time_increment: 1.0,
                    moment: Moment::default(),
                    sites: &[],
                },
                Operator::Consistent,
                End {
                    flux: (&mut flux, rows),
                    state: &mut state_end,
                    operator: &mut operator,
                },
            )
            .unwrap();
        let (_, why) = success.unreliable.expect(id);
        assert!(why.contains("coarse"), "{id}: {why}");
        for (found, expected) in operator.iter().zip([1e5, 0.0, 0.0, 1e5]) {
            assert!((found - expected).abs() < 1e-3, "{id}: {operator:?}");
        }
    }
}
