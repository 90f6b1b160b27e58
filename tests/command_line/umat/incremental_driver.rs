//! Input of the IncrementalDriver, with an elastic routine.

use super::{number, place};
use crate::program::{BAD_INPUT, NO_EQUILIBRIUM, Place};
use std::collections::BTreeMap;
use tests::case::table;
use tests::or_skip;
use tests::tolerance::close;
use tests::words::words;

/// Input of the IncrementalDriver for a material with E = 2e4 and ν = 0.3.
fn incremental(place: &Place, test: &str) {
    place.write("test.inp", format!("out.txt # a remark\n{test}"));
    place.write(
        "parameters.inp",
        "elastic  # E, nu\n2\n2.0d4   E\n0.3     nu\n",
    );
    place.write(
        "initialconditions.inp",
        "6\n-100.0d0\n-100.0\n-100.0\n0\n0\n0\n0\n",
    );
}

/// Rows of the test, led by a routine.
fn led(place: &Place, library: &str) -> Vec<BTreeMap<String, String>> {
    place.done(&["point", "test.inp", "--umat", library, "--csv", "out.csv"]);
    table(&place.path("out.csv"))
}

/// What stresses and strains are measured by.
fn scale(column: &str) -> f64 {
    if column.starts_with("stress") {
        100.0
    } else {
        1e-3
    }
}

/// The change of a column between two rows.
#[track_caller]
fn changes(rows: &[BTreeMap<String, String>], from: usize, to: usize, what: &str, expected: f64) {
    let found = number(&rows[to], what) - number(&rows[from], what);
    let name = format!("{what} {from} to {to}");
    close(name, found, expected, 1e-9 * scale(what));
}

#[test]
fn input_of_the_incremental_driver_is_followed() {
    let place = or_skip!(place("elastic"));
    incremental(
        &place,
        "*OedometricE1\n4 100 1.0\n-1.0d-3\n*OedometricS1\n4 100 1.0\n-20.0\n\
         *TriaxialE1\n4 100 2.0 : a remark\n-1e-3\n*TriaxialS1\n4 100 1.0\n-30.\n\
         *TriaxialUq\n4 100 1.0\n24.0\n*TriaxialUEq\n4 100 1.0\n1e-3\n\
         *PureRelaxation\n2 100 1.0\n*PureCreep\n2 100 1.0\n*UndrainedCreep\n2 100 1.0\n\
         *CirculatingLoad\n8 100 1.0\n*Cartesian\n0 0 0 0\n0 0 0 0\n0 0 0 0\n0 1e-3 0 0\n\
         0 0 0 0\n0 0 0 0\n\
         *Repetition\n2 3\n*LinearLoad\n2 100 1.0\n*Rendulic\n1 5.0\n0 0\n0 0\n0 0\n0 0\n0 0\n\
         *PureCreep\n1 1 0.5\n*End\nwhatever follows\n",
    );
    let rows = led(&place, "libelastic.so");
    assert_eq!(rows.len(), 1 + 6 * 4 + 3 * 2 + 8 + 3 * 3);
    let (g, lambda) = (2e4 / 2.6, 2e4 * 0.3 / (1.3 * 0.4));
    let close = |from, to, what, expected| changes(&rows, from, to, what, expected);
    close(0, 4, "stress_11", -(lambda + 2.0 * g) * 1e-3);
    close(0, 4, "stress_33", -lambda * 1e-3);
    close(4, 8, "strain_11", -20.0 / (lambda + 2.0 * g));
    close(4, 8, "strain_22", 0.0);
    close(8, 12, "stress_11", -2e4 * 1e-3);
    close(8, 12, "stress_22", 0.0);
    close(12, 16, "strain_11", -30.0 / 2e4);
    // Undrained: q = −Δσ₁₁ + Δσ₂₂ = 3G ε_q, ε_q = −Δε₁₁.
    close(16, 20, "strain_11", -24.0 / (3.0 * g));
    close(16, 20, "strain_33", 12.0 / (3.0 * g));
    close(20, 24, "strain_11", -1e-3);
    close(20, 24, "stress_11", -2.0 * g * 1e-3);
    for what in words("stress_11 stress_22 stress_12 strain_11 strain_12") {
        close(24, 30, what, 0.0);
        // A whole period.
        close(30, 38, what, 0.0);
    }
    // Its rate in the middle of the first of 8 increments: 2π/8 cos(π/8).
    let first = std::f64::consts::FRAC_PI_4 * std::f64::consts::FRAC_PI_8.cos() * 1e-3;
    close(30, 31, "strain_12", first);
    // Three times −σ₁₁ grows by 5, the radial strain kept.
    close(38, 47, "stress_11", -15.0);
    close(38, 47, "strain_22", 0.0);
    close(38, 47, "strain_11", -15.0 / (lambda + 2.0 * g));
}

/// After a colon the numbers of a step say which states are written: every N-th of the step, and its end.
#[test]
fn every_so_many_states_are_written() {
    let place = or_skip!(place("elastic"));
    let run = |every: [&str; 3]| {
        let [first, wave, repeated] = every;
        incremental(
            &place,
            &format!(
                "*TriaxialE1\n10 50 10{first}\n-0.01\n*CirculatingLoad\n8 100 1.0{wave}\n*Cartesian\n\
                 0 0 0 0\n0 0 0 0\n0 0 0 0\n0 1e-3 0 0\n0 0 0 0\n0 0 0 0\n\
                 *Repetition\n1 2\n*TriaxialS1\n7 50 1.0{repeated}\n-5.0\n"
            ),
        );
        led(&place, "libelastic.so")
    };
    let all = run([""; 3]);
    assert_eq!(all.len(), 1 + 10 + 8 + 2 * 7);
    let increments = |every: [&str; 3]| -> Vec<usize> {
        let rows = run(every);
        // Each row is the same as where all are written.
        for row in &rows {
            assert_eq!(row, &all[number(row, "increment") as usize]);
        }
        let numbers = rows.iter().map(|row| number(row, "increment") as usize);
        numbers.collect()
    };
    let expected = [0, 5, 10, 14, 18, 21, 24, 25, 28, 31, 32];
    assert_eq!(increments([": 5", " : 4 # a remark", ":3"]), expected);
    // The numbers of increments are not many enough; all are written; words are a remark.
    let expected: Vec<usize> = [0, 10].into_iter().chain(11..=18).chain(19..=32).collect();
    assert_eq!(increments([": 100", ": 1", " : every state"]), expected);
    assert_eq!(increments([":100", ": 0", " # written: 5"]), expected);
}

#[test]
fn restrictions_between_stress_and_strain_are_obeyed() {
    let place = or_skip!(place("elastic"));
    // Axial strain at a constant mean stress, 22 and 33 alike; a spring against the shear 23.
    incremental(
        &place,
        "*ObeyRestrictions\n4 100 1.0\ned1 = -1.0d-3 ! axial\nsd1 + sd2 + 1.0*sd3 = 0\n\
         -sd2+sd3 = 0 # lateral\nsd4 = 0\n2e1*ed5 - 1e-3*ed5 = 0\nsd6 + 2.0d+4*ed6 = -3\n\
         *TriaxialE1\n4 100 1.0\n-1e-3\n\
         *Repetition\n1 2\n*ObeyRestrictions\n2 100 1.0\nsd1 - 2*sd2 = 0\nsd2 - sd3 = 0\n\
         sd1 = -10\nsd4 = 0\nsd5 = 0\nsd6 = 0\n",
    );
    let rows = led(&place, "libelastic.so");
    assert_eq!(rows.len(), 1 + 4 + 4 + 2 * 2);
    let g = 2e4 / 2.6;
    let close = |from, to, what, expected| changes(&rows, from, to, what, expected);
    // No volume change: p is kept and the law isotropic.
    close(0, 4, "strain_22", 5e-4);
    close(0, 4, "strain_33", 5e-4);
    close(0, 4, "stress_11", -2.0 * g * 1e-3);
    close(0, 4, "stress_33", g * 1e-3);
    // A quarter in each increment.
    close(0, 1, "stress_11", -0.5 * g * 1e-3);
    let gamma = -3.0 / (g + 2e4);
    close(0, 4, "strain_23", gamma);
    close(0, 4, "stress_23", g * gamma);
    // What follows starts from there.
    close(4, 8, "stress_11", -2e4 * 1e-3);
    close(4, 8, "stress_22", 0.0);
    close(4, 8, "stress_23", 0.0);
    close(8, 12, "stress_11", -20.0);
    close(8, 12, "stress_22", -10.0);
    close(8, 12, "strain_22", (-10.0 - 0.3 * -30.0) / 2e4);
}

#[test]
fn restrictions_are_followed_where_a_law_flows() {
    let place = or_skip!(place("drucker_prager"));
    let run = |test: &str| {
        incremental(&place, test);
        place.write(
            "parameters.inp",
            "umat_drucker_prager\n5\n2e4\n0.3\n0.4\n0.1\n10\n",
        );
        place.write(
            "initialconditions.inp",
            "6\n-100\n-100\n-100\n0\n0\n0\n1\n0\n",
        );
        led(&place, "libdrucker_prager.so")
    };
    let restricted = run(
        "*ObeyRestrictions\n40 100 1.0\ned1 = -0.05\nsd2 = 0\nsd2 - sd3 = 0\nsd4 = 0\n\
         sd5 = 0\nsd6 = 0\n",
    );
    let led = run("*TriaxialE1\n40 100 1.0\n-0.05\n");
    assert!(number(led.last().unwrap(), "multiplier") > 1e-2, "it flows");
    for (restricted, led) in restricted.iter().zip(&led) {
        for column in ["stress_11", "stress_22", "strain_11", "strain_22"] {
            let (found, expected) = (number(restricted, column), number(led, column));
            let size = if column.starts_with("stress") {
                100.0
            } else {
                1e-2
            };
            close(column, found, expected, 1e-8 * size);
        }
    }
    // Newton's method with the tangent of the routine.
    let most = restricted[1..].iter().map(|row| number(row, "iterations"));
    assert!(most.fold(0.0, f64::max) <= 12.0);
}

#[test]
fn restrictions_that_contradict_each_other_are_not_met() {
    let place = or_skip!(place("elastic"));
    incremental(
        &place,
        "*ObeyRestrictions\n1 100 1.0\nsd1 = -1\n2*sd1 = -4\nsd3 = 0\nsd4 = 0\nsd5 = 0\nsd6 = 0\n",
    );
    let outcome = place
        .run(&["point", "test.inp", "--umat", "libelastic.so"])
        .ended(NO_EQUILIBRIUM);
    outcome.shows("cannot be met");
}

/// Runs the elastic routine through tests that must be refused: rows of the test, with `\n` for the end of a line, and
/// what is reported.
fn refused(tests: &str) {
    let place = or_skip!(place("elastic"));
    for row in tests.lines().skip(1) {
        let mut parts = row.split(" | ");
        incremental(&place, &parts.next().unwrap().replace("\\n", "\n"));
        let outcome = place
            .run(&["point", "test.inp", "--umat", "libelastic.so"])
            .ended(BAD_INPUT);
        for text in parts {
            outcome.shows(text);
        }
    }
}

#[test]
fn restrictions_without_sense_are_refused() {
    refused(
        r"
*PureCreep\n1 1 1\n*ObeyRestrictions\n1 1 1\nsd1 = 0\n | a restriction, of which there are six
*ObeyRestrictions\n1 1 1\nsd1 + 2\n | test.inp:4:1 | a restriction has a `=`
*ObeyRestrictions\n1 1 1\nsd1 + 2*s2 = 1\n | test.inp:4:1 | `2*s2` is no change | ed1 to ed6
*ObeyRestrictions\n1 1 1\nsd7 = 1\n | test.inp:4:1 | `sd7` is no change
*ObeyRestrictions\n1 1 1\nx*sd1 = 1\n | test.inp:4:1 | `x*sd1` is no change
*ObeyRestrictions\n1 1 1\nsd1 = sd2\n | test.inp:4:1 | `sd2` is no number
*ObeyRestrictions\n1 1 1\nsd1 - sd1 = 1\n | test.inp:4:1 | restricts nothing
",
    );
}

#[test]
fn what_is_not_read_of_the_incremental_driver_is_said() {
    refused(
        r"
*DeformationGradient\n1 1 1\n | test.inp:2:1 | small strains
*TriaxialE1\n10 1 0\n1\n | test.inp:3:1 | a time above 0, not 0
*TriaxialE1\n10 1 -1\n1\n | test.inp:3:1 | a time above 0, not -1
*TriaxialE1\n10 1 1 0.5\n1\n | test.inp:3:1 | `0.5` is a number too many
*TriaxialE1\n10 1 1\n1 2\n | test.inp:4:1 | `2` is a number too many
*TriaxialE1\n10 1 1: 2.5\n1\n | test.inp:3:1 | 2.5 is no number for every how many
*TriaxialE1\n10 1 1: -2\n1\n | test.inp:3:1 | -2 is no number for every how many
*TriaxialE1\n10 1 1: 5 T 20.0\n1\n | test.inp:3:1 | a change of temperature
*Repetition\n1 0\n*PureCreep\n1 1 1\n | test.inp:3:1 | at least once
*Repetition\n0 2\n*PureCreep\n1 1 1\n | test.inp:3:1 | at least one step
*OedometricE1 ? s1 > 3\n1 1 1\n1\n | test.inp:2:1 | ends a step early
*Oedometric\n1 1 1\n1\n | test.inp:2:1 | no keyword | *OedometricE1
*LinearLoad\n1 1 1\n*Haigh\n | test.inp:4:1 | *Roscoe
*LinearLoad\n1 1 1\n*Roscoe\n2 1.0\n | test.inp:5:1 | expected 0 (strain) or 1 (stress)
*TriaxialE1\n10 x\n | test.inp:3:1 | number of increments
*TriaxialE1\n10 1 1\n | the file ends where the change over the step is expected
 | the test has no step
",
    );
}

#[test]
fn parameters_are_those_of_the_sidecar() {
    let place = or_skip!(place("elastic"));
    incremental(&place, "*PureCreep\n1 1 1\n");
    place.write("parameters.inp", "elastic\n3\n1\n1\n1\n");
    let outcome = place.refused(&["point", "test.inp", "--umat", "libelastic.so"]);
    outcome
        .shows("parameters.inp:2:1")
        .shows("3 parameters")
        .shows("young_modulus, poisson_ratio");
}
