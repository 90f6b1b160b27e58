//! Faults of routines, and the check that names each.

use super::super::{DONE, PLUGIN_TROUBLE, place};
use super::{bare, checked};

/// The routine, a change of its sidecar, the check that finds it, its outcome, and what is said.
const FAULTS: [(&str, [&str; 2], &str, &str, &str); 18] = [
    (
        "doubtful",
        ["default = 0.0\n", "default = 5.0\n"],
        "routine-is-repeatable",
        "warning",
        "with another NPT: STRESS [",
    ),
    (
        "doubtful",
        ["default = 0.0\n", "default = 6.0\n"],
        "routine-is-repeatable",
        "warning",
        "with another COORDS: STRESS [",
    ),
    (
        "doubtful",
        ["default = 0.0\n", "default = 7.0\n"],
        "routine-is-repeatable",
        "warning",
        "with another CELENT: STRESS [",
    ),
    (
        "doubtful",
        ["default = 0.0\n", "default = 1.0\n"],
        "states-are-carried-on",
        "warning",
        "`plastic_slip` is",
    ),
    (
        "doubtful",
        ["default = 0.0\n", "default = 2.0\n"],
        "ddsdde-matches-differences",
        "warning",
        "DDSDDE(2, 2), t by t, is 5.000000e2, differences give 0.000000e0",
    ),
    (
        "doubtful",
        ["default = 0.0\n", "default = 3.0\n"],
        "response-is-continuous",
        "warning",
        "the flux jumps from",
    ),
    (
        "doubtful",
        ["default = 0.0\n", "default = 4.0\n"],
        "compression-is-negative",
        "warning",
        "compression is negative here",
    ),
    (
        "rows",
        ["", ""],
        "response-is-isotropic",
        "warning",
        "a law that is meant to have directions says so in its `doc`",
    ),
    (
        "saves",
        ["", ""],
        "routine-is-repeatable",
        "failed",
        "the same call gives another result",
    ),
    (
        "six",
        ["ntens = [6]\nexpand = true\n", "ntens = [4, 6]\n"],
        "routine-answers",
        "failed",
        "writes beyond the end of STRESS",
    ),
    (
        "elastic_tangent",
        ["tangent = \"approximate\"\n", ""],
        "ddsdde-matches-differences",
        "warning",
        "`tangent = \"approximate\"`",
    ),
    (
        "rows",
        ["tangent_order = \"rows\"\n", ""],
        "ddsdde-matches-differences",
        "failed",
        "its transpose fits: `tangent_order`",
    ),
    (
        "rows",
        ["tangent_order = \"rows\"\n", "tangent = \"approximate\"\n"],
        "ddsdde-matches-differences",
        "failed",
        "the transpose of DDSDDE is the derivative of STRESS",
    ),
    (
        "rows",
        ["ntens = [4, 6]\n", "ntens = [4, 6]\nsymmetric = true\n"],
        "ddsdde-matches-differences",
        "failed",
        "`symmetric = true`, and DDSDDE is off",
    ),
    (
        "maxwell",
        ["time_dependent = true\n", ""],
        "time-as-declared",
        "warning",
        "say `time_dependent = true` in the sidecar",
    ),
    (
        "elastic",
        [
            "thread_safe = true\n",
            "thread_safe = true\ntime_dependent = true\n",
        ],
        "time-as-declared",
        "warning",
        "(DTIME) nor its time changes anything",
    ),
    (
        "elastic",
        ["ntens = [4, 6]\n", "ntens = [4, 5]\n"],
        "sidecar-is-read",
        "failed",
        "3d has NTENS = 6, which `ntens` lacks",
    ),
    (
        "externals",
        ["", ""],
        "routine-answers",
        "failed",
        "`getvrm_`",
    ),
];

#[test]
fn faults_of_routines_are_found_by_name() {
    for (name, [from, to], id, expected, said) in FAULTS {
        let Some(place) = place(name) else {
            return;
        };
        let file = format!("{name}.law.toml");
        let sidecar = std::fs::read_to_string(place.path(&file)).unwrap();
        assert!(sidecar.contains(from), "{name}: {from}");
        place.write(&file, sidecar.replacen(from, to, 1));
        let alpha = ["--set", "alpha=0.3", "--set", "beta=0.05", "--set", "k=4"];
        let more = if name == "elastic_tangent" {
            &alpha[..]
        } else {
            &[]
        };
        let (checks, outcome) = checked(&place, name, more);
        let [found, details] = &checks[id];
        assert_eq!(found, expected, "{name}: {id}: {details}\n{checks:?}");
        assert!(details.contains(said), "{name}: {id}: {details}");
        let fails = checks.values().any(|[outcome, _]| outcome == "failed");
        let code = if fails { PLUGIN_TROUBLE } else { DONE };
        assert_eq!(outcome.code, Some(code), "{name}: {}", outcome.stderr);
        if expected == "failed" {
            let verdict = if id == "sidecar-is-read" {
                "cannot be checked"
            } else {
                "is not what its sidecar says"
            };
            assert!(outcome.says(verdict), "{name}: {}", outcome.stderr);
            assert!(outcome.says(id), "{name}: {}", outcome.stderr);
        }
    }
    // Without a sidecar the way to one is told.
    let Some(place) = bare("elastic") else {
        return;
    };
    let (checks, outcome) = checked(&place, "elastic", &[]);
    assert_eq!(outcome.code, Some(PLUGIN_TROUBLE), "{}", outcome.stderr);
    let [found, details] = &checks["sidecar-is-read"];
    assert_eq!(found, "failed");
    assert!(details.contains("has no sidecar"), "{details}");
}
