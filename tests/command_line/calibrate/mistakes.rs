//! Mistakes in files of calibrations.

use super::{FILE, place};
use crate::program::{BAD_INPUT, refuses_file};

/// Edits of the file, and what the message says.
const MISTAKES: &str = r#"
starts = 2 => stars = 2
  joint.toml:2:
  unknown key `stars`
starts = 2 => starts = 0
  joint.toml:2:
  `starts` is 0
starts = 2 => confidence = 1.0
  joint.toml:2:
  `confidence` is 1
starts = 2 => difference = 0.5
  joint.toml:2:
  `difference` is 0.5
friction_angle = {} => friction_angel = {}
  joint.toml:6:
  no law of a test has a parameter `friction_angel`
friction_angle = {} => friction_angle = { parameter = "phi" }
  joint.toml:6:
  a parameter `phi`
friction_angle = {} => friction_angle = { start = 95.0 }
  joint.toml:6:
  `start` is 95
friction_angle = {} => friction_angle = { max = 120.0 }
  joint.toml:6:
  `max` is 120
friction_angle = {} => friction_angle = { min = 25.0 }
  joint.toml:6:
  `start` is 20
min = 1e3, max = 1e7 => min = 1e7, max = 1e3
  joint.toml:5:
  not below `max`
min = 1e3 => scale = "decades"
  joint.toml:5:
  there is no `decades`
friction_angle = {} => cohesion = { scale = "log" }
  joint.toml:6:
  has no logarithm
[[test]]\nname => [fixed]\nstiffness = { value = 1.0 }\n[[test]]\nname
  joint.toml:9:
  a parameter `stiffness`
friction_angle = {} => friction_angle = {}\nphi = { parameter = "friction_angle" }
  joint.toml:7:
  `friction_angle` has two names in test `box`: `friction_angle` of [free] and `phi` of [free]
[[test]]\nname => [fixed]\nfriction_angle = { value = 20.0 }\n[[test]]\nname
  joint.toml:6:
  `friction_angle` of [fixed] and `friction_angle` of [free]
[[test]]\nname => [fixed]\ncohesion = { value = 0.0 }\nc = { parameter = "cohesion", value = 1.0 }\n[[test]]\nname
  joint.toml:10:
  `cohesion` has two names
driver = "driver.toml" =>
  joint.toml:9:
  needs a `driver` or a `case`
driver = "driver.toml" => driver = "driver.toml"\ncase = "c"
  joint.toml:11:
  not both
driver = "driver.toml" => driver = "other.toml"
  joint.toml:10:
  there is no file other.toml
driver = "driver.toml" => driver = "driver.toml"\nvariant = "v"
  joint.toml:11:
  there is no variant `v`
driver = "driver.toml" => driver = "driver.toml"\npredict = true
  joint.toml:1:
  there is no test to fit
driver = "driver.toml" => driver = "driver.toml"\nweight = 0.0
  joint.toml:11:
  `weight` is 0
x = "u_t" => x = "u"
  joint.toml:13:
  there is no column `u`
y = "traction_t" => y = "traction"
  joint.toml:14:
  there is no column `traction`
segment = 1\n => segment = 3\n
  joint.toml:15:
  there is no segment 3: the driver has 2
segment = 1\n => phase = "push"\n
  joint.toml:15:
  a driver has no phases
segment = 1\n =>
  joint.toml:13:
  `u_t` does not only grow or only fall
y = "tau" } => y = "sigma" }
  joint.toml:16:
  has no column `sigma`
y = "tau" } => y = "empty" }
  joint.toml:16:
  has no row with
y = "tau" } => y = "tau", x_scale = 1e3 }
  joint.toml:16:
  no measured point lies where `u_t` is computed
noise = 0.1 => noise = -0.1
  joint.toml:17:
  `noise` is -0.1
noise = 0.1 => noise = 0.0
  joint.toml:17:
  has no noise
noise = 0.1 => noise = 0.1\noffset_x = { min = 1.0, max = 0.0 }
  joint.toml:18:
  `offset_x`: `min` is 1, expected a number below `max`, 0
noise = 0.1 => noise = 0.1\nscale_y = { min = 0.0, max = 2.0 }
  joint.toml:18:
  `scale_y`: `min` is 0, expected a number above 0
noise = 0.1 => noise = 0.1\noffset_y = { min = 1.0, max = 2.0, start = 3.0 }
  joint.toml:18:
  `offset_y`: `start` is 3, expected 1 to 2
noise = 0.1\n => noise = 0.1\n[[stage]]\nname = "one"\nfree = ["stiffness"]
  there is no free parameter `stiffness`
noise = 0.1\n => noise = 0.1\n[[stage]]\nname = "one"\nfree = ["friction_angle"]
  `shear_stiffness` is in no stage
noise = 0.1\n => noise = 0.1\n[[stage]]\nname = "one"\nfree = ["friction_angle"]\ntests = ["bx"]
  there is no test `bx`
noise = 0.1\n => noise = 0.1\n[[stage]]\nname = "one"\nfree = []
  has no free parameter
"#;

#[test]
fn mistakes_are_told_with_file_line_and_key() {
    let place = place();
    let run = ["calibrate", "joint.toml", "--out", "out"];
    refuses_file(&place, ("joint.toml", FILE), &run, BAD_INPUT, MISTAKES);
    let outcome = place.refused(&["calibrate", "driver.toml"]);
    outcome.shows("this is a driver or case file");
}
