//! Cases based on others: messages point into the file that holds the mistake.

use crate::program::{BAD_INPUT, CASE, Place};
use tests::words::edited;
use tests::words::rows_of;

/// Runs a case file that is based on another; the message is about `at`.
fn refused(case: &str, base: &str, at: &str, says: &str) {
    let place = Place::new();
    place.write("base.toml", base);
    let outcome = place.refused_case(case);
    for text in [at, says] {
        outcome.shows(text);
    }
    assert_eq!(place.contents(), ["base.toml", "case.toml"]);
}

const BASED: &str = "base = \"base.toml\"\n";

#[test]
fn keys_that_belong_to_the_whole_file_are_among_those_that_are_known() {
    let says = |case: &str, says: &str| {
        let place = Place::new();
        let outcome = place.refused_case(case);
        outcome.shows(says);
        outcome
    };
    let misspelt = |key: &str| CASE.replacen("title =", &format!("{key} = \"a\"\ntitle ="), 1);
    says(&misspelt("bsae"), "did you mean `base`?");
    let variants = format!("{CASE}\n[[varaint]]\nname = \"a\"\n");
    says(&variants, "did you mean `variant`?");
    // Within a variant there is none of them.
    let variants = format!("{CASE}\n[[variant]]\nname = \"a\"\nbase = \"base.toml\"\n");
    says(&variants, "a variant has no `base`");
    let outcome = says(
        &variants.replacen("base =", "bsae =", 1),
        "unknown key `bsae`",
    );
    outcome.hides("did you mean `base`?");
}

#[test]
fn a_key_that_one_variant_lacks_names_the_variant() {
    let case = format!(
        "{CASE}\n[[variant]]\nname = \"whole\"\n\n[[variant]]\nname = \"lacking\"\nlaws.other = {{ parameters = {{}} }}\n"
    );
    let outcome = Place::new().run_case(&case).ended(BAD_INPUT);
    outcome.shows("missing key `law` in variant `lacking`");
}

#[test]
fn finds_mistakes_in_the_base() {
    // The line that begins so, and the column.
    for [edit, line, column, says] in rows_of(
        r#"
rows = => rwos = | rows | 1 | did you mean `rows`?
to = 2.0 => to = nan | { n = 1, to = 2.0 | 17 | `to`: nan
"push" => "push | name = "push" | 13 | invalid basic string
law = "joint" => law = "jiont" | law = "joint" | 7 | `jiont`
"#,
    ) {
        let at = CASE.lines().position(|own| own.trim().starts_with(line));
        let place = format!("base.toml:{}:{column}", at.unwrap() + 1);
        refused(BASED, &edited(CASE, &[edit]), &place, says);
    }
}

#[test]
fn finds_mistakes_in_what_overrides_the_base() {
    let case = format!("{BASED}[groups.soil]\nlaw = \"siol\"\n");
    refused(&case, CASE, "case.toml:3:7", "did you mean `soil`?");
    let case = format!("{BASED}[solver]\nmax_halvings = -1\n");
    refused(
        &case,
        CASE,
        "case.toml:3:16",
        "`max_halvings`: found the number -1",
    );
}

#[test]
fn refuses_bases_that_are_none() {
    refused(
        "base = \"bose.toml\"\n",
        CASE,
        "case.toml:1:8",
        "cannot read bose.toml: ",
    );
    refused(
        "base = 1\n",
        CASE,
        "case.toml:1:8",
        "`base` is the path of a case file",
    );
    refused(
        "base = \"case.toml\"\n",
        CASE,
        "case.toml:1:8",
        "are based on each other",
    );
}

/// A folder of laws is found from the file that names it.
#[test]
fn folders_of_laws_are_relative_to_the_file_that_names_them() {
    let place = Place::new();
    place.write("elsewhere/laws/README", "");
    place.write(
        "elsewhere/base.toml",
        format!("law_path = [\"laws\"]\n{CASE}"),
    );
    place.done_case("base = \"elsewhere/base.toml\"\n");
}
