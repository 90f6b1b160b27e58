//! Faults of routines, and the check that names each.

use super::super::{DONE, PLUGIN_TROUBLE, place};
use super::{bare, checked};
use tests::or_skip;

/// The routine, the check that finds its fault, the outcome, and what is said; a change of its sidecar, with `\n` for
/// the end of a line.
const FAULTS: &str = r#"
doubtful routine-is-repeatable warning with another NPT: STRESS [
  default = 0.0\n => default = 5.0\n
doubtful routine-is-repeatable warning with another COORDS: STRESS [
  default = 0.0\n => default = 6.0\n
doubtful routine-is-repeatable warning with another CELENT: STRESS [
  default = 0.0\n => default = 7.0\n
doubtful states-are-carried-on warning `plastic_slip` is
  default = 0.0\n => default = 1.0\n
doubtful ddsdde-matches-differences warning DDSDDE(2, 2), t by t, is 5.000000e2, differences give 0.000000e0
  default = 0.0\n => default = 2.0\n
doubtful response-is-continuous warning the flux jumps from
  default = 0.0\n => default = 3.0\n
doubtful compression-is-negative warning compression is negative here
  default = 0.0\n => default = 4.0\n
rows response-is-isotropic warning a law that is meant to have directions says so in its `doc`
  =>
saves routine-is-repeatable failed the same call gives another result
  =>
six routine-answers failed writes beyond the end of STRESS
  ntens = [6]\nexpand = true\n => ntens = [4, 6]\n
elastic_tangent ddsdde-matches-differences warning `tangent = "approximate"`
  tangent = "approximate"\n =>
rows ddsdde-matches-differences failed its transpose fits: `tangent_order`
  tangent_order = "rows"\n =>
rows ddsdde-matches-differences failed the transpose of DDSDDE is the derivative of STRESS
  tangent_order = "rows"\n => tangent = "approximate"\n
rows ddsdde-matches-differences failed `symmetric = true`, and DDSDDE is off
  ntens = [4, 6]\n => ntens = [4, 6]\nsymmetric = true\n
maxwell time-as-declared warning say `time_dependent = true` in the sidecar
  time_dependent = true\n =>
elastic time-as-declared warning (DTIME) nor its time changes anything
  thread_safe = true\n => thread_safe = true\ntime_dependent = true\n
elastic sidecar-is-read failed 3d has NTENS = 6, which `ntens` lacks
  ntens = [4, 6]\n => ntens = [4, 5]\n
externals routine-answers failed `getvrm_`
  =>
"#;

#[test]
fn faults_of_routines_are_found_by_name() {
    let rows: Vec<&str> = FAULTS.lines().skip(1).collect();
    for row in rows.chunks(2) {
        let found: Vec<&str> = row[0].splitn(4, ' ').collect();
        let [name, id, expected, said] = found[..] else {
            panic!("{row:?}")
        };
        let edit = row[1].replace("\\n", "\n");
        let (from, to) = edit.split_once("=>").unwrap();
        let (from, to) = (from.trim_matches(' '), to.trim_matches(' '));
        let place = or_skip!(place(name));
        let file = format!("{name}.law.toml");
        let sidecar = place.read(&file);
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
            outcome.shows(verdict);
            outcome.shows(id);
        }
    }
    // Without a sidecar the way to one is told.
    let place = or_skip!(bare("elastic"));
    let (checks, outcome) = checked(&place, "elastic", &[]);
    outcome.ended(PLUGIN_TROUBLE);
    let [found, details] = &checks["sidecar-is-read"];
    assert_eq!(found, "failed");
    assert!(details.contains("has no sidecar"), "{details}");
}
