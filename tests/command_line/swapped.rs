//! Laws that fail in the zero increment, by which a law that starts takes over the stresses it finds. Also
//! laws that cannot go on from the internal variables, or the gap, of the law before.

use crate::program::{DONE, JOINT, Outcome, PLUGIN_TROUBLE, Place, edited};
use crate::troubled;
use tests::case::column;
use tests::or_skip;
use tests::tolerance::near;

/// The case with a joint across it, which takes the law after the weight has pressed it.
fn run(define: &'static str) -> Option<Outcome> {
    let place = troubled::place(define)?;
    let text = edited(&[
        r#"title => law_path = ["laws"]\ntitle"#,
        r#"[[mesh.region]]\ngroup = "layer"\nx = [1.0, 1.01]\n => "#,
        r#"[groups.soil] => [laws.troubled]\nlaw = "troubled"\n\n[groups.soil]"#,
        r#"formulation = "thin_layer" => formulation = "zero_thickness"\nline = "middle""#,
        r#"name = "push"\n => name = "push"\nlaws = { layer = "troubled" }\n"#,
    ]);
    place.write("case.toml", text);
    Some(place.run(&["run", "case.toml", "--out", "out"]))
}

#[test]
fn a_law_that_fails_over_a_nil_increment_starts_with_the_first_one() {
    let outcome = or_skip!(run("NIL_OUTCOME=PILUM_E_DOMAIN"));
    let outcome = outcome.ended(DONE);
    outcome
        .shows("no time passes")
        .shows("called with zero strain")
        .shows("phase `push`");
    // Asked without trouble, it keeps what it finds, and nothing is said.
    let outcome = run("").expect("a compiler").ended(DONE);
    outcome.hides("called with zero strain").hides("takes over");
}

#[test]
fn a_law_that_breaks_down_over_a_nil_increment_ends_the_run() {
    let outcome = or_skip!(run("NIL_OUTCOME=PILUM_E_INTERNAL"));
    let outcome = outcome.ended(PLUGIN_TROUBLE);
    outcome
        .shows("no time passes")
        .shows("phase `push`, increment 1")
        .shows("group `layer`");
}

/// A strong solid law in the layer, and the same law in a zone of the layer's thickness.
fn to_zone(solid: &str, first: &str, then: &str) -> String {
    let strength = "cohesion = 1e3, friction_angle = 30.0, dilatancy_angle = 0.0";
    let elasticity = "young_modulus = 2e4, poisson_ratio = 0.3";
    let own = if solid == "elastic" {
        elasticity.to_owned()
    } else {
        format!("{elasticity}, {strength}")
    };
    let laws = format!(
        "[laws.solid]\nlaw = \"{solid}\"\nparameters = {{ {own} }}\n[laws.zone]\nadapter = \
         \"shear_zone\"\nlaw = \"mohr_coulomb\"\nthickness = 0.01\nparameters = {{ {elasticity}, \
         {strength} }}\n\n[groups.soil]"
    );
    edited(&[])
        .replacen("[groups.soil]", &laws, 1)
        .replacen("law = \"joint\"", &format!("law = \"{first}\""), 1)
        .replacen(
            "name = \"push\"\n",
            &format!("name = \"push\"\nlaws = {{ layer = \"{then}\" }}\n"),
            1,
        )
}

/// Ids are not unique: a zone has that of the law which fills it, and more internal variables.
#[test]
fn internal_variables_of_another_law_with_the_same_id_are_not_read() {
    let place = Place::new();
    let run = |text: String| {
        let outcome = place.done_case(text);
        let end = |name| column(&place.path("out/history.csv"), name).pop();
        let ends = ["settlement", "tau"].map(|name| end(name).expect("a row"));
        (outcome, ends)
    };
    let is_said = "starts anew from the stress it finds: it is made for";
    let (outcome, found) = run(to_zone("mohr_coulomb", "solid", "zone"));
    let text = to_zone("mohr_coulomb", "solid", "zone");
    let line = 1 + text
        .lines()
        .position(|l| l.contains("laws = {"))
        .expect("the swap");
    outcome
        .shows(is_said)
        .shows(format!("case.toml:{line}:"))
        .shows("mohr_coulomb");
    // Far from its strength it is the elastic law, which has another id.
    let (outcome, expected) = run(to_zone("elastic", "solid", "zone"));
    outcome.hides(is_said);
    for (found, expected) in found.iter().zip(&expected) {
        near(*found, *expected, 1e-9 * expected.abs());
    }
    let (outcome, _) = run(to_zone("mohr_coulomb", "zone", "solid"));
    outcome.shows(is_said);
    // The zone itself goes on.
    let (outcome, _) = run(to_zone("mohr_coulomb", "zone", "zone"));
    outcome.hides(is_said);
}

/// A joint that is opened by a millimetre before another law takes over.
fn opened(up: &str) -> String {
    edited(JOINT)
        .replacen(
            "[groups.soil]",
            "[laws.other]\nlaw = \"hyperbolic_joint\"\nparameters = { normal_stiffness = 1e6, \
             stiffness_number = 1e4, stiffness_exponent = 0.5, failure_ratio = 0.9, adhesion = 0.0, \
             friction_angle = 30.0 }\n\n[groups.soil]",
            1,
        )
        .replacen(
            "pressure = [{ line = \"top\", value = 10.0 }]",
            &format!("displacement = [{{ line = \"top\", x = 0.0, y = {up} }}]"),
            1,
        )
        .replacen(
            "increments = 2\ndisplacement = [{ line = \"top\", x = 1e-5 }]",
            "increments = 2\nlaws = { layer = \"other\" }",
            1,
        )
}

#[test]
fn a_gap_that_a_swap_forgets_is_told() {
    let place = Place::new();
    let outcome = place.done_case(opened("1e-3"));
    outcome
        .shows("phase `push`: interface `layer` carries nothing")
        .shows("law `other` takes over from `joint`, open by up to 1.000e-3 m")
        .shows("not told of gaps");
    place.done_case(opened("-1e-5")).hides("carries nothing");
}

#[test]
fn internal_variables_that_a_law_refuses_are_refused_before_the_first_increment() {
    let place = Place::new();
    let text = opened("-1e-5").replacen(
        "[laws.other]\n",
        "[laws.other]\ninitial = { stress_level = 1.5 }\n",
        1,
    );
    let line = 1 + text
        .lines()
        .position(|l| l.contains("initial ="))
        .expect("it");
    let outcome = place.refused_case(text);
    outcome
        .shows("stress_level is outside [0, 1]")
        .shows(format!("case.toml:{line}:"));
}
