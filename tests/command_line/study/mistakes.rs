//! Mistakes in study files.

use super::{STUDY, place, study};
use crate::program::{BAD_INPUT, refuses_file};

#[test]
fn mistakes_are_named_with_their_place_before_anything_runs() {
    let place = place(STUDY);
    let run = ["study", "study.toml", "--out", "out"];
    refuses_file(
        &place,
        ("study.toml", STUDY),
        &run,
        BAD_INPUT,
        r#"
an unknown key
  title => ^titel
  unknown key `titel`
no case
  "case.toml" => ^"cases.toml"
  `case`: cannot read
no method
  "grid" => ^"gird"
  did you mean `grid`?
runs of a grid
  method = "grid" => method = "grid"\nruns = ^5
  `runs`
a seed of a grid
  method = "grid" => method = "grid"\nseed = ^5
  nothing is random
points without a number
  "grid" => "sobol"
  missing key `runs`
too many base points
  method = "grid" => method = "saltelli"\nruns = ^30000
  30000 base points of 4 runs each, at most 99999
no levels
  uniform = [1e-5, 2e-5]\nlevels = 2 => uniform = ^[1e-5, 2e-5]
  a grid needs `levels`
levels of values
  10.0] => 10.0]\nlevels = ^3
  `levels` is for distributions
the ends exchanged
  [1e-5, 2e-5] => ^[2e-5, 1e-5]
  is not below
two kinds of values
  levels = 2 => levels = 2\nvalues = [1.0]
  a parameter has one of them
no values
  [2.0, 5.0, 10.0] => ^[]
  there is none
a key that leads nowhere
  key = "phase.push. => key = ^"phase.pusch.
  did you mean `push`?
an unknown parameter
  parameters.cohesion" => parameters.cohesian"
  did you mean `cohesion`?
a text for a number
  5.0, 10.0] => 5.0, ^"ten"]
  expected a number
out of the law's range
  5.0, 10.0] => 5.0, ^-10.0]
  -10
an unknown key of the case
  laws.joint.parameters.cohesion => title2
  unknown key `title2`
one key twice
  phase.push.displacement.1.x => laws.joint.parameters.cohesion
  key of two parameters
one name twice
  name = "push" => name = ^"cohesion"
  two parameters are called
a name of the table's
  name = "push" => name = ^"state"
  no name for a parameter
an unknown probe
  probe = "tau", take => probe = ^"tao", take
  did you mean `tau`?
an unknown phase
  phase = "push" => phase = ^"pull"
  did you mean `push`?
two ways to a number
  probe = "tau", at = { => probe = "tau", take = ^"max", at = {
  a number is one of both
a key and a part of it
  key = "phase.push.displacement.1.x" => key = ^"laws.joint.parameters"
  `laws.joint.parameters.cohesion` is a part of `laws.joint.parameters`
a part of a key
  key = "phase.push.displacement.1.x" => key = ^"laws.joint.parameters.cohesion.x"
  is a part of `laws.joint.parameters.cohesion`
one value twice
  5.0, 10.0] => 5.0, ^5]
  5 is there twice
no whole number
  uniform = [1e-5, 2e-5] => whole = true\nuniform = ^[1.2, 1.8]
  no whole number from 1.2 to 1.8
a variant
  method => variant = ^"a"\nmethod
  there is no variant `a`
"#,
    );
    place.write("study.toml", STUDY);
    let outcome = study(&place, &["--run", "7"]).ended(BAD_INPUT);
    outcome.shows("there is no run 7: the study has runs 1 to 6");
}
