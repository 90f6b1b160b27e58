//! Files that are no case: syntax, types, missing keys, encodings.

use crate::program::{CASE, Place, refuses};
use tests::words::has;

#[test]
fn refuses_what_is_not_toml() {
    refuses(
        r#"
text without its end
  "weight" => "weight^
  invalid basic string
table without its end
  left = { x = 0.0 }\n => left = { x = 0.0\n^
no equals sign
  analysis = " => analysis ^"
  expected `=`
a key twice
  right = => ^left =
  `left` stands here for the second time
a list of tables with single brackets first
  [[phase]] => [phase]
  [[phase]] => [[^phase]]
  `phase`
  double brackets
nested without end
  title = => title = [[[[[[[[{[[{[[[[
  case.toml:1:
"#,
    );
}

#[test]
fn says_what_was_probably_meant() {
    refuses(
        r#"
decimal comma
  max_iterations = 20 => force_tolerance = 1^,5
  decimal point
  `1.5`, not `1,5`
decimal comma before another key
  young_modulus = 1e4, => young_modulus = 10000,0^,
  `10000.0`, not `10000,0`
decimal comma and a power of ten
  young_modulus = 1e4, => young_modulus = 1,05e4^,
  `1,05e4` has a decimal comma
  is a decimal point meant? `1.05e4`, not `1,05e4`
decimal comma at the end of an inline table
  value = 10.0 } => value = 10,5 ^}
  `10.5`, not `10,5`
single brackets, once
  [[phase]]\nname = "weight"\nincrements = 2\n => ^[phase]\n
  pressure = [{ line = "top", value = 10.0 }]\n\n[[phase]]\n =>
  `phase` is a list of tables
  [[phase]]
no brace at the end
  left = { x = 0.0 }\n => left = { x = 0.0\n^
  the `{` at case.toml:20:8 is still open
  a `}` missing
no bracket at the end
  rows = [{ n = 2, to = 1.0 }]\n\n => rows = [{ n = 2, to = 1.0 }\n\n^
  the `[` at case.toml:10:8 is still open
  a `]` missing
no quotation mark at the end
  "weight" => "weight^
  a quotation mark is missing
"#,
    );
}

#[test]
fn a_law_that_does_not_fit_is_marked_where_the_group_takes_it() {
    refuses(
        r#"
an interface law for a solid
  law = "soil" => law = "joint"
  is made for interface_2d, interface_3d, expected plane_strain
  taken by group `soil`
"#,
    );
}

#[test]
fn refuses_wrong_types() {
    refuses(
        r#"
text for a count
  n = 2 => n = ^"two"
  `n`: found the text "two", expected a whole number
fraction for a count
  n = 2 => n = ^2.5
  `n`: found the number 2.5, expected a whole number
negative count
  n = 2 => n = ^-2
  `n`: found the number -2
text for a number
  to = 2.0 => to = ^"2"
  `to`: found the text "2", expected a number
text for a parameter
  young_modulus = 1e4 => young_modulus = ^"1e4"
  `young_modulus`: found the text "1e4", expected a number
truth value for a parameter
  young_modulus = 1e4 => young_modulus = ^true
  `young_modulus`: expected a number
text for a position
  left = { x = 0.0 } => left = { x = ^"0" }
  `x`: expected a number, or an extent
three ends of an extent
  left = { x = 0.0 } => left = { x = ^[0.0, 1.0, 2.0] }
  `x`: expected a number, or an extent
one end of an extent
  x = [1.0, 1.01] => x = ^[1.0]
  `x`: found a list of 1, expected a list of 2
number for a table
  left = { x = 0.0 } => left = ^0.0
  `left`: found the number 0.0, expected a table
text for a truth value
  max_iterations = 20 => line_search = ^"yes"
  `line_search`: found the text "yes", expected true or false
count beyond all bounds
  increments = 2 => increments = ^99999999999999999999999
  `increments`
  99999999999999999999999
number beyond all bounds
  to = 2.0 => to = ^1e999
  overflow
a direction by two names
  { line = "top", x = 1e-5 } => ^{ line = "top", x = 1e-5, r = 1e-5 }
  `x` is given twice
  `r` is another name of `x`
"#,
    );
}

#[test]
fn lists_the_choices_where_something_else_than_a_text_stands() {
    refuses(
        r#"
a number
  max_iterations = 20 => control = ^3
  `control`: found the number 3, expected a text in quotes
  there is: auto, load, arc_length
a truth value
  "plane_strain" => ^true
  `analysis`: found `true`
  axisymmetric, plane_strain
a list
  max_iterations = 20 => equations = ^["sparse"]
  `equations`: found a list
  auto, condensed, sparse
an empty table
  profile = "phases" => profile = ^{}
  `profile`: found a table
  never, phases, increments
a number in a list
  fixed = ["x", "y"] => fixed = ["x", ^2]
  found the number 2
  there is: r, x, y, z
a date, in a group
  formulation = "solid" => formulation = ^2026-01-01
  `formulation`: found a date
  solid
  zero_thickness
"#,
    );
}

/// TOML has such numbers, and each key that takes a number could be given one.
#[test]
fn refuses_numbers_that_are_not_finite() {
    refuses(
        r#"
end of columns
  to = 2.0 => to = ^nan
  `to`: nan is no finite number
infinite end
  to = 2.0 => to = ^inf
  `to`: inf
origin
  columns => origin = [0.0, ^-inf]\ncolumns
  `origin`: -inf
ratio
  to = 2.0 => ratio = ^nan, to = 2.0
  `ratio`: nan
region
  x = [1.0, 1.01] => x = [1.0, ^nan]
  `x`: nan
line
  left = { x = 0.0 } => left = { x = ^nan }
  `x`: nan
parameter
  young_modulus = 1e4 => young_modulus = ^nan
  `young_modulus`
pressure
  value = 10.0 => value = ^+inf
  `value`: +inf
displacement
  x = 1e-5 => x = ^inf
  `x`: inf
initial stress
  "solid"\n => "solid"\ninitial_stress = { 22 = ^nan }\n
  `22`: nan
scale of a probe
  scale = -1000.0 => scale = ^nan
  `scale`: nan
factor of a probe
  tau = 0.5 => tau = ^nan
  `tau`: nan
solver
  max_iterations = 20 => force_tolerance = ^nan
  `force_tolerance`
"#,
    );
}

#[test]
fn names_missing_keys() {
    refuses(
        r#"
top level
  analysis = "plane_strain"\n =>
  title => ^title
  missing key `analysis`
mesh
  rows = [{ n = 2, to = 1.0 }] =>
  columns = [ => columns = ^[
  missing key `rows`
group
  [groups.layer] => ^[groups.layer]
  law = "joint" =>
  missing key `law`
phase
  [[phase]]\nname = "weight" => ^[[phase]]
  missing key `name`
pressure
  { line = "top", value = 10.0 } => ^{ line = "top" }
  missing key `value`
parameter
  law = "coulomb_joint" => law = ^"coulomb_joint"
  cohesion = 10.0 =>
  law `coulomb_joint` needs parameter `cohesion` [kPa]
  friction_angle [deg]
"#,
    );
}

#[test]
fn refuses_files_without_a_case_in_them() {
    let refused = |bytes: &[u8], says: &str| {
        let place = Place::new();
        place.refused_case(bytes).shows("case.toml").shows(says);
        assert_eq!(place.contents(), ["case.toml"]);
    };
    refused(b"", "missing key `analysis`");
    refused(b"# nothing but a remark\n", "missing key `analysis`");
    refused(
        &(0..=255).collect::<Vec<u8>>(),
        "line 2: the byte 0x80 is not UTF-8",
    );
    let utf_16: Vec<u8> = "\u{feff}title"
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    refused(&utf_16, "looks like UTF-16");
    refused(
        b"# A remark\ntitle = \"Fl\xfcgel\"\n",
        "line 2: the byte 0xfc is not UTF-8",
    );
    refused(format!("{CASE}\0").as_bytes(), "case.toml:");
}

/// Line endings, a byte order mark, and sections instead of inline tables change nothing.
#[test]
fn reads_other_ways_of_writing_the_same() {
    let history = |text: &str| {
        let place = Place::new();
        place.done_case(text);
        place.read("out/history.csv")
    };
    let expected = history(CASE);
    assert_eq!(history(&CASE.replace('\n', "\r\n")), expected);
    assert_eq!(history(&format!("\u{feff}{CASE}")), expected);
    let parameters = "parameters = { young_modulus = 1e4, poisson_ratio = 0.3 }";
    let section = "[laws.soil.parameters]\nyoung_modulus = 1e4\npoisson_ratio = 0.3";
    let pressure = "pressure = [{ line = \"top\", value = 10.0 }]";
    let list = "[[phase.pressure]]\nline = \"top\"\nvalue = 10.0";
    let sections = CASE.replace(parameters, section).replace(pressure, list);
    assert_eq!(history(&sections), expected);
}

/// A byte order mark shifts no place, and a key behind it is named whole.
#[test]
fn places_are_right_behind_a_byte_order_mark() {
    let place = Place::new();
    let outcome = place.refused_case("\u{feff}title = 3\n");
    let expected = "`title`: found the number 3, expected a text";
    assert!(outcome.stderr.contains(expected), "{}", outcome.stderr);
    has(&outcome.stderr, "case.toml:1:9");
    // A base with a mark, and a file on top that has one too.
    place.write("base.toml", format!("\u{feff}{CASE}"));
    let outcome = place.refused_case("\u{feff}base = \"base.toml\"\nnonsense = 1\n");
    has(&outcome.stderr, "unknown key `nonsense`");
    has(&outcome.stderr, "case.toml:2:1");
}

#[test]
fn places_are_right_with_windows_line_endings() {
    let place = Place::new();
    let outcome = place.refused_case(CASE.replace("\"joint\"", "\"jiont\"").replace('\n', "\r\n"));
    let line = CASE
        .lines()
        .position(|line| line == "law = \"joint\"")
        .unwrap()
        + 1;
    outcome.shows(format!("case.toml:{line}:7"));
}
