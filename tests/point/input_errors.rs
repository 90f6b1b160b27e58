//! What the driver refuses.
//!
//! Goal        every slip in a driver file gives one message at its place and exit code 1.
//! Set-up      a driver with one fault each.
//! Law         elastic, coulomb_joint, mepi.
//! Asserts     exit code, key facts of the message, the underlined text.

use crate::driver::{MEPI, attempt};
use input::Error;
use tests::words::{has, rows_of};

const SOLID: &str = "law = 'elastic'\nhypothesis = 'plane_strain'\n[parameters]\n\
    young_modulus = 1e5\npoisson_ratio = 0.25\n";
const JOINT: &str = "law = 'coulomb_joint'\nhypothesis = 'interface_2d'\n[parameters]\n\
    normal_stiffness = 1e6\nshear_stiffness = 4e5\ncohesion = 5\nfriction_angle = 35\n\
    dilatancy_angle = 13.5\n";
const SEGMENT: &str = "[[segment]]\nincrements = 1\ncontrol = {}\n";

/// The driver is refused; its message and hint hold these parts.
fn refuses(text: &str, parts: &[&str]) {
    let error = tests::driver::of_text(text).unwrap_err();
    assert_eq!(error.exit_code(), 1, "{error}\n{text}");
    assert!(
        matches!(error, Error::Text(text::Error::Input(_))),
        "{error:?}"
    );
    let all = format!("{error} {error:?}");
    for part in parts {
        assert!(all.contains(part), "`{part}` is not in {error:?}");
    }
}

fn solid(control: &str) -> String {
    format!("{SOLID}[[segment]]\nincrements = 1\ncontrol = {{ {control} }}")
}

fn joint(control: &str) -> String {
    format!("{JOINT}[[segment]]\nincrements = 1\ncontrol = {{ {control} }}")
}

/// Rows of text behind the parameters of a law, and parts of its refusal between `; `. `SEGMENT` stands for a segment.
fn all_refused(law: &str, rows: &str) {
    for [rest, says] in rows_of(rows) {
        let text = format!("{law}{}", rest.replace("SEGMENT", SEGMENT));
        refuses(&text, &says.split("; ").collect::<Vec<_>>());
    }
}

/// The same of a segment's control.
fn controls_refused(driver: impl Fn(&str) -> String, rows: &str) {
    for [control, says] in rows_of(rows) {
        refuses(&driver(control), &says.split("; ").collect::<Vec<_>>());
    }
}

#[test]
fn keys_that_are_unknown_or_missing() {
    refuses(
        &format!("laws_path = 'x'\n{SOLID}{SEGMENT}"),
        &["laws_path", "law_path"],
    );
    refuses(&solid("22 = { displacement = 1 }"), &["displacement"]);
    refuses("hypothesis = '3d'", &["law"]);
    refuses("law = 'elastic'", &["hypothesis"]);
    refuses(SOLID, &["no [[segment]]"]);
    all_refused(
        SOLID,
        r"
[initials]\nSEGMENT | initials
[initial]\nstrain = {}\nSEGMENT | strain; stress
[[segment]]\nincrement = 1\ncontrol = {} | increment
[[segment]]\ncontrol = {} | increments
[[segment]]\nincrements = 1 | control
",
    );
}

#[test]
fn hypotheses() {
    let text = format!("{SOLID}{SEGMENT}");
    for [to, says] in rows_of("plain_strain | did you mean `plane_strain`\ninterface_2d | elastic")
    {
        refuses(&text.replace("plane_strain", to), &[to, says]);
    }
}

#[test]
fn components_and_kinds_of_control() {
    controls_refused(
        solid,
        "
n = { strain = 1 } | component `n`; 11, 22, 33, 12
13 = { strain = 1 } | component `13` under plane_strain
22 = { jump = 1 } | `22`; `jump`; strain, stress
22 = { traction = 1 } | `traction`; strain, stress
22 = { stiffness = 1 } | `stiffness`; strain, stress
33 = { strain = 1e-9 } | 33; plane strain
33 = { stress = 0 } | 33; plane strain
22 = { strain = 1e999 } | overflow
22 = { strain = 'much' } | number
",
    );
    controls_refused(
        joint,
        "
22 = { jump = 1 } | component `22`; n, t
n = { strain = 1 } | `strain`; jump, traction, stiffness
n = { stress = 1 } | `stress`; jump, traction, stiffness
n = {} | `n`; exactly one
n = { jump = 1, traction = 2 } | `n`; exactly one
n = { stiffness = -2.5 } | stiffness; -2.5; [0, ∞)
",
    );
}

#[test]
fn initial_states() {
    all_refused(
        SOLID,
        r"
[initial]\nstress = { 21 = 1 }\nSEGMENT | component `21`
[initial]\ntraction = { n = 1 }\nSEGMENT | plane_strain; stress
",
    );
    all_refused(
        JOINT,
        r"
[initial]\nstress = { 11 = 1 }\nSEGMENT | interface_2d; traction
[initial]\ninternal = { plastic_slipp = 1 }\nSEGMENT | plastic_slipp; did you mean `plastic_slip`
",
    );
}

#[test]
fn counts_of_increments() {
    for count in ["0", "-3", "100000001", "9223372036854775807"] {
        let text = format!("{SOLID}[[segment]]\nincrements = {count}\ncontrol = {{}}");
        refuses(&text, &["increments", count]);
    }
    let part = format!("{SOLID}[[segment]]\nincrements = 2.5\ncontrol = {{}}");
    refuses(&part, &["2.5"]);
    let many = "[[segment]]\nincrements = 60000000\ncontrol = {}\n";
    refuses(&format!("{SOLID}{many}{many}"), &["increments", "60000000"]);
}

#[test]
fn numbers_that_are_not_finite() {
    for number in ["nan", "inf", "-inf"] {
        refuses(
            &solid(&format!("22 = {{ strain = {number} }}")),
            &["strain"],
        );
        refuses(
            &joint(&format!("n = {{ stiffness = {number} }}")),
            &["stiffness"],
        );
        let stress = format!("{SOLID}[initial]\nstress = {{ 11 = {number} }}\n{SEGMENT}");
        refuses(&stress, &["11"]);
        let internal = format!("{JOINT}[initial]\ninternal = {{ gap = {number} }}\n{SEGMENT}");
        refuses(&internal, &["gap"]);
    }
}

#[test]
fn parameters() {
    let text = format!("{SOLID}{SEGMENT}");
    refuses(
        &text.replace("young_modulus", "youngs_modulus"),
        &["youngs_modulus", "did you mean `young_modulus`"],
    );
    refuses(&text.replace("0.25", "0.5"), &["poisson_ratio", "0.5"]);
    refuses(
        &text.replace("poisson_ratio = 0.25\n", ""),
        &["needs parameter `poisson_ratio`"],
    );
}

#[test]
fn initial_states_that_the_law_refuses() {
    let mepi = |traction: &str| {
        format!("law = 'mepi'\nhypothesis = 'interface_2d'\n{MEPI}[initial]\n{traction}\n{SEGMENT}")
    };
    refuses(
        &mepi("traction = { n = 100 }"),
        &["mepi", "initial", "compressive", "tension is positive"],
    );
    refuses(&mepi(""), &["mepi", "compressive"]);
    let halved = mepi("traction = { n = -100 }").replacen(
        "t = 0.002",
        "t = 0.002\nscheme = 'explicit'\nsubsteps = 2.5",
        1,
    );
    refuses(&halved, &["substeps", "2.5"]);
    // The law refuses this one in its first update.
    let run = attempt(&mepi(
        "traction = { n = -100 }\ninternal = { plastic_slip = -1 }",
    ));
    assert_eq!(run.error().exit_code(), 1);
    has(run.error().to_string(), "plastic_slip");
}

#[test]
fn laws_that_are_not_there() {
    let text = format!("{SOLID}{SEGMENT}").replace("'elastic'", "'elastik'");
    let error = tests::driver::of_text(&text).unwrap_err();
    assert_eq!(error.exit_code(), 3);
    let all = format!("{error:?}");
    has(&all, "elastik");
    has(&all, "driver.toml:1:7");
}

#[test]
fn messages_point_to_the_place() {
    let text = solid("22 = { jump = 77 }");
    let Error::Text(text::Error::Input(error)) = tests::driver::of_text(&text).unwrap_err() else {
        panic!("an input error");
    };
    assert_eq!(error.span().start, text.find("77").unwrap());
    assert_eq!(error.line().text, "control = { 22 = { jump = 77 } }");
}
