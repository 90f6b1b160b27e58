//! Laws that cannot be led through the nil increment in which a law that starts is asked what it makes of the
//! stresses it finds.

use crate::program::{DONE, Outcome, PLUGIN_TROUBLE, edited};
use crate::troubled;

/// The case with a joint across it, which takes the law after the weight has pressed it.
fn run(define: &'static str) -> Option<Outcome> {
    let place = troubled::place(define)?;
    let text = edited(&[
        ("title", "law_path = [\"laws\"]\ntitle"),
        ("[[mesh.region]]\ngroup = \"layer\"\nx = [1.0, 1.01]\n", ""),
        (
            "[groups.soil]",
            "[laws.troubled]\nlaw = \"troubled\"\n\n[groups.soil]",
        ),
        (
            "formulation = \"thin_layer\"",
            "formulation = \"zero_thickness\"\nline = \"middle\"",
        ),
        (
            "name = \"push\"\n",
            "name = \"push\"\nlaws = { layer = \"troubled\" }\n",
        ),
    ]);
    place.write("case.toml", text);
    Some(place.run(&["run", "case.toml", "--out", "out"]))
}

#[test]
fn a_law_that_fails_over_a_nil_increment_starts_with_the_first_one() {
    let Some(outcome) = run("NIL_OUTCOME=PILUM_E_DOMAIN") else {
        return;
    };
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
    for words in ["no time passes", "over a nil increment", "phase `push`"] {
        assert!(outcome.says(words), "{words}: {}", outcome.stderr);
    }
    // Asked without trouble, it keeps what it finds, and nothing is said.
    let outcome = run("").expect("a compiler");
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
    assert!(!outcome.says("nil increment"), "{}", outcome.stderr);
    assert!(!outcome.says("takes over"), "{}", outcome.stderr);
}

#[test]
fn a_law_that_breaks_down_over_a_nil_increment_ends_the_run() {
    let Some(outcome) = run("NIL_OUTCOME=PILUM_E_INTERNAL") else {
        return;
    };
    assert_eq!(outcome.code, Some(PLUGIN_TROUBLE), "{}", outcome.stderr);
    for words in [
        "no time passes",
        "phase `push`, increment 1",
        "group `layer`",
    ] {
        assert!(outcome.says(words), "{words}: {}", outcome.stderr);
    }
}
