//! Keys and names that do not exist, at every level of the file.

use crate::program::refuses;

#[test]
fn suggests_keys() {
    refuses(
        r#"
top level
  title = => ^titel =
  `titel`
  did you mean `title`?
mesh
  rows = => ^rwos =
  `rwos`
  did you mean `rows`?
columns
  n = 2 => ^m = 2
  `m`
  n, to, ratio
region
  x = [1.0, 1.01] => ^xx = [1.0, 1.01]
  `xx`
  did you mean `x`?
line
  left = { x => left = { ^w
  `w`
  r, x, y, z
group
  formulation = => ^formulaton =
  did you mean `formulation`?
law
  law = "elastic" => ^lwa = "elastic"
  did you mean `law`?
parameter
  young_modulus => ^youngs_modulus
  law `elastic` has no parameter `youngs_modulus`
  `young_modulus`?
internal variable
  [laws.joint.parameters] => initial = { ^gapp = 0.1 }\n[laws.joint.parameters]
  law `coulomb_joint` has no internal variable `gapp`
  did you mean `gap`?
support
  fixed = => ^fix =
  `fix`
  line, fixed
phase
  increments = => ^increment =
  did you mean `increments`?
pressure
  value = => ^vlaue =
  did you mean `value`?
displacement
  x = 1e-5 => ^u = 1e-5
  unknown key `u`
  line, r, x, y, z
probe
  scale = => ^scal =
  did you mean `scale`?
solver
  max_iterations => ^max_iteration
  `max_iterations`?
output
  profile = => ^profil =
  did you mean `profile`?
"#,
    );
}

#[test]
fn suggests_values() {
    refuses(
        r#"
analysis
  "plane_strain" => ^"plane_stress"
  `analysis`: there is no `plane_stress`
  did you mean `plane_strain`?
formulation
  "thin_layer" => ^"thin_layr"
  `formulation`: there is no `thin_layr`
  did you mean `thin_layer`?
direction
  fixed = ["x", "y"] => fixed = ["x", ^"w"]
  there is no `w`
output
  "phases" => ^"phase"
  `profile`
  did you mean `phases`?
"#,
    );
}

#[test]
fn suggests_names_that_the_file_gives() {
    refuses(
        r#"
group of a region
  group = "soil" => group = ^"soli"
  there is no group `soli`
  did you mean `soil`?
law of a group
  law = "joint" => law = ^"jiont"
  there is no law `jiont` under [laws]
  did you mean `joint`?
law of a group that the first phase replaces
  law = "soil" => law = ^"snail"
  name = "weight" => name = "weight"\nlaws = { soil = "soil" }
  there is no law `snail` under [laws]
law of a phase
  name = "push" => name = "push"\nlaws = { soil = ^"soli" }
  there is no law `soli` under [laws]
  did you mean `soil`?
group of a phase
  name = "push" => name = "push"\nlaws = { ^soli = "soil" }
  there is no group `soli`
  did you mean `soil`?
line of a support
  line = "bottom" => line = ^"bottm"
  there is no line `bottm`
  did you mean `bottom`?
line of a pressure
  line = "top", value => line = ^"tpo", value
  there is no line `tpo`
  did you mean `top`?
line of a displacement
  line = "top", x => line = ^"tap", x
  there is no line `tap`
folder of laws
  title => law_path = [^"nowhere"]\ntitle
  there is no folder
  nowhere
"#,
    );
}

#[test]
fn suggests_what_probes_can_show() {
    refuses(
        r#"
quantity of a group
  "traction_t" => ^"traction_s"
  group `layer` has no quantity `traction_s`
  traction_t
  plastic_slip
quantity of a line
  "displacement_y" => ^"settlement"
  a line has no quantity `settlement`
  displacement_y
group
  tau = { group = "layer" => tau = { group = ^"lyer"
  there is no group `lyer`
  did you mean `layer`?
line
  settlement = { line = "top" => settlement = { line = ^"tip"
  there is no line `tip`
  did you mean `top`?
other probe
  { tau = 0.5 } => { ^tua = 0.5 }
  there is no probe `tua`
  did you mean `tau`?
itself
  { tau = 0.5 } => { ^half = 0.5 }
  there is no probe `half` before this one
a loop of two
  half = { combine = { tau = 0.5 } } => half = { combine = { ^other = 0.5 } }\nother = { combine = { half = 2.0 } }
  there is no probe `other` before this one
nothing combined
  { combine = { tau = 0.5 } } => ^{ combine = {} }
  probe `half`: `combine` is empty
combined and measured
  { combine = { tau = 0.5 } } => ^{ combine = { tau = 0.5 }, line = "top" }
  probe `half`: `combine` stands alone
neither line nor group
  { group = "layer", quantity => ^{ quantity
  probe `tau`: it needs a `line` or a `group`
no quantity
  { group = "layer", quantity = "traction_t" } => ^{ group = "layer" }
  probe `tau`: it needs a `quantity`
an extent that holds nothing
  { group = "layer", quantity => ^{ y = [2.0, 3.0], group = "layer", quantity
  probe `tau`: no integration point lies inside the extent
an extent the wrong way round
  { group = "layer", quantity => ^{ y = [1.0, 0.0], group = "layer", quantity
  probe `tau`: its extent is [1, 0], expected [smaller, larger]
the mean of a force
  { line = "top", quantity = "displacement_y" => ^{ line = "top", reduce = "mean", quantity = "reaction_y"
  probe `settlement`: forces are summed
"#,
    );
}

#[test]
fn says_which_names_are_taken() {
    refuses(
        r#"
the name of another column
  half = => ^iterations =
  `iterations` is a column of history.csv already
the name of a column of the path, where it is followed
  [solver]\n => [solver]\ncontrol = "arc_length"\n
  half = => ^load_factor =
  `load_factor` is a column of path.csv already
  taken are: increment, iterations, load_factor, phase, time
"#,
    );
}
