//! Routines whose DDSDDE is not the derivative of their stress: noticed, and made up for.
//!
//! Goal        whatever a routine writes as its tangent, a case comes to the same equilibria by default.
//! Set-up      the chamber, most of it on a coarse mesh: hypoplastic sand that gives L, L + N D/|D| or differences; a
//!             Mohr–Coulomb routine whose DDSDDE is exact, 2 % off at edges, transposed or elastic.
//! Asserts     all increments; the loads of the exact tangent; iterations; one line about it; nothing is reported
//!             of laws with consistent tangents; the same bits after a stop.

use super::{gfortran, number, place, source};
use crate::program::{DONE, Outcome, Place};
use tests::case::table;
use tests::or_skip;
use tests::tolerance::close;
use tests::tolerance::near;
use tests::words::edited;
use tests::words::words;

/// What the solver leaves of a load, next to tolerances of 1e-9 and 1e-7.
const SAME: f64 = 1e-6;
const NOTICED: &str = "are not the derivatives of its stresses";
const REPLACED: &str = "from here on they are made by differences";

const CHAMBER: &str = include_str!("../../../cases/chamber_mesh1/case.toml");

/// The chamber on a mesh of 60 elements.
fn coarse() -> String {
    let edits = [
        "{ n = 2, to = 0.010 } => { n = 1, to = 0.010 }",
        "n = 7, to = 0.262, ratio = 1.6 => n = 4, to = 0.262, ratio = 2.5",
        "n = 8, to = 0.180, ratio = 0.8 => n = 4, to = 0.180, ratio = 0.7",
        "n = 10, to = 0.680 => n = 5, to = 0.680",
    ];
    edited(CHAMBER, &edits)
}

/// A case with a further law.
fn with_law(case: &str, law: &str) -> String {
    case.replacen("# --- groups", &format!("{law}\n# --- groups"), 1)
}

/// Sand of a routine with this tangent.
fn sand(tangent: u32) -> String {
    let keys = format!(
        "[laws.grains]\nlaw = \"umat_sand\"\nadapter = \"umat\"\nlibrary = \"libsand.so\"\nin_process = true\n\
         [laws.grains.parameters]\ncritical_friction_angle = 33.0\ngranular_hardness = 1e6\nn = 0.25\n\
         e_d0 = 0.55\ne_c0 = 0.95\ne_i0 = 1.05\nalpha = 0.25\nbeta = 1.5\ncohesion_stress = 1.0\n\
         tangent = {tangent}.0\n"
    );
    let stress = "initial_stress = { 11 = -100.0, 22 = -100.0, 33 = -100.0 }\n";
    let both = "integration = \"full\"\nlaw = \"sand\"\n";
    let text = with_law(&coarse(), &keys);
    let (before, after) = text.split_once("[groups.plate]").unwrap();
    let sand = both.replace("\"sand\"", "\"grains\"") + stress;
    before.replacen(both, &sand, 1)
        + "[groups.plate]"
        + &after.replacen(both, &format!("{both}{stress}"), 1)
}

/// The chamber with Mohr–Coulomb sand and interface.
fn soil(law: &str, is_coarse: bool) -> String {
    let keys = format!(
        "[laws.soil]\n{law}\n[laws.soil.parameters]\nyoung_modulus = 34e3\npoisson_ratio = 0.3\n\
         cohesion = 0.0\nfriction_angle = 36.5\ndilatancy_angle = 12.0\n"
    );
    let case = if is_coarse {
        coarse()
    } else {
        CHAMBER.to_owned()
    };
    with_law(&case, &keys)
        .replace(
            "integration = \"full\"\nlaw = \"sand\"",
            "integration = \"full\"\nlaw = \"soil\"",
        )
        .replacen(
            "name = \"confinement\"\nincrements = 1",
            "name = \"confinement\"\nincrements = 10",
            1,
        )
}

const ROUTINE: &str = "law = \"umat_mohr_coulomb\"\nadapter = \"umat\"\nlibrary = \"libmohr_coulomb.so\"\n\
    in_process = true";

/// Iterations of all phases and the load on the head at the end; all increments must have been done.
fn done(place: &Place, outcome: &Outcome) -> (u64, f64) {
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
    let found = place.summary();
    let phases = found["phases"].as_array().unwrap();
    assert_eq!(phases.last().unwrap()["increments"], 50);
    let iterations = phases
        .iter()
        .map(|phase| phase["iterations"].as_u64().unwrap());
    let rows = table(&place.path("out/history.csv"));
    (iterations.sum(), number(rows.last().unwrap(), "q_t"))
}

#[test]
fn hypoplastic_sand_goes_through_the_chamber_whatever_its_tangent() {
    let place = or_skip!(place("sand"));
    let run = |tangent: u32, keys: &str| {
        let outcome = place.run_case(sand(tangent) + keys);
        let (iterations, load) = done(&place, &outcome);
        println!("tangent {tangent}{keys}: {iterations} iterations, {load:.9} kN");
        (iterations, load, outcome.stderr)
    };
    let (few, expected, said) = run(2, "");
    assert!(!said.contains(NOTICED), "{said}");
    // L: differences take over.
    let (iterations, load, said) = run(0, "");
    near(load, expected, SAME * expected);
    assert_eq!(said.matches(NOTICED).count(), 1, "{said}");
    assert!(said.contains(REPLACED), "{said}");
    assert!(place.summary()["warnings"].to_string().contains(REPLACED));
    assert!(2 * iterations <= 3 * few, "{iterations} {few}");
    // L + N D/|D| is near enough to be kept.
    let (_, load, said) = run(1, "");
    near(load, expected, SAME * expected);
    assert!(!said.contains(REPLACED), "{said}");
    // Whoever wants L gets it, and pays.
    let outcome = place.run_case(sand(0) + "\n[solver]\ntangents = \"law\"\n");
    outcome.hides(NOTICED);
    let phases = place.summary()["phases"].as_array().unwrap().clone();
    let own: u64 = phases
        .iter()
        .map(|phase| phase["iterations"].as_u64().unwrap())
        .sum();
    println!("L alone: {own} iterations");
    assert!(own > 2 * iterations, "{own} {iterations}");
}

/// DDSDDE of the Mohr–Coulomb routine changed: what is replaced in its source.
const WRONG: [(&str, &str, &str); 3] = [
    (
        "2 % off at edges",
        "C           Equal to the last bit, as the zone says.\n",
        "            DO I=1,3\n              DO J=1,3\n                DM(I,J)=1.02D0*DM(I,J)\n              END DO\n            \
         END DO\n",
    ),
    (
        "transposed",
        "          DDSDDE(I,J)=T(1,I)*R(1,J)",
        "          DDSDDE(J,I)=T(1,I)*R(1,J)",
    ),
    (
        "elastic",
        " 100  CONTINUE\n",
        " 100  CONTINUE\n      AK=1.D0\n      DO I=1,3\n        DO J=1,3\n          DM(I,J)=ALAM\n          \
         IF(I.EQ.J) DM(I,J)=ALAM+2.D0*G\n        END DO\n      END DO\n",
    ),
];

#[test]
fn a_mohr_coulomb_routine_with_a_wrong_tangent_is_noticed_and_gives_the_same_load() {
    let place = or_skip!(place("mohr_coulomb"));
    let exact = [true, false].map(|is_coarse| {
        let outcome = place.run_case(soil(ROUTINE, is_coarse));
        outcome.hides(NOTICED);
        done(&place, &outcome)
    });
    println!("exact: {exact:?}");
    let text = std::fs::read_to_string(source("mohr_coulomb.f")).unwrap();
    let include = format!("-I{}", source("").display());
    for (what, from, to) in WRONG {
        assert!(text.contains(from), "{what}");
        place.write("wrong.f", text.replacen(from, to, 1));
        let arguments = ["-shared", "-fPIC", &include];
        let library = place.path("libmohr_coulomb.so");
        std::fs::remove_file(&library).unwrap();
        gfortran(&arguments, &[place.path("wrong.f")], &library).unwrap();
        // On the coarse mesh edges cost no iterations.
        let is_coarse = !what.ends_with("edges");
        let (few, expected) = exact[usize::from(!is_coarse)];
        let outcome = place.run_case(soil(ROUTINE, is_coarse));
        let (iterations, load) = done(&place, &outcome);
        println!("{what}: {iterations} iterations, {load:.9} kN");
        outcome.shows(NOTICED);
        close(what, load, expected, SAME * expected);
        assert!(2 * iterations < 3 * few, "{what}: {iterations} {few}");
    }
}

#[test]
fn consistent_tangents_are_never_called_wrong() {
    let place = Place::new();
    let outcome = place.run_case(soil("law = \"mohr_coulomb\"", false));
    done(&place, &outcome);
    outcome.hides("derivative");
    let cases = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases");
    for name in words("chamber_instability chamber_extremes chamber_joint textbook_pile") {
        let case = cases.join(name);
        let outcome = place.run(&["run", case.to_str().unwrap(), "--out", name]);
        outcome.hides("derivative");
    }
}

#[test]
fn a_run_that_is_stopped_before_or_after_the_notice_goes_on_to_the_same_bits() {
    let place = or_skip!(place("sand"));
    let outcome = place.run_case(sand(0));
    outcome.shows(REPLACED);
    let read = |name: &str| std::fs::read(place.path(name)).unwrap();
    let expected = read("out/history.csv");
    for seconds in ["0.05", "0.15", "0.4"] {
        let _ = std::fs::remove_dir_all(place.path("stopped"));
        let run = words("run case.toml --out stopped --checkpoint 0 --resume");
        let mut child = place.start(&run);
        std::thread::sleep(std::time::Duration::from_secs_f64(seconds.parse().unwrap()));
        child.kill().unwrap();
        child.wait().unwrap();
        place.done(&run);
        assert!(
            read("stopped/history.csv") == expected,
            "stopped after {seconds} s"
        );
    }
}
