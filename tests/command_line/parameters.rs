//! Parameters of laws, laws in elements they are not made for, settings of the solver.

use crate::program::{Place, edited, refuses};

#[test]
fn refuses_values_out_of_range() {
    refuses(
        "
negative stiffness
  young_modulus = 1e4 => young_modulus = ^-1e4
  `young_modulus`: -10000 kPa is outside (0, ∞)
  Young's modulus
no stiffness
  normal_stiffness = 1e6 => normal_stiffness = ^0.0
  `normal_stiffness`: 0 kPa/m is outside (0, ∞)
incompressible
  poisson_ratio = 0.3 => poisson_ratio = ^0.5
  `poisson_ratio`: 0.5 is outside (-1, 0.5)
vertical friction
  friction_angle = 30.0 => friction_angle = ^90.0
  `friction_angle`: 90 deg is outside [0, 90)
negative strength
  cohesion = 10.0 => cohesion = ^-1.0
  `cohesion`: -1 kPa is outside [0, ∞)
angles in radians
  friction_angle = 30.0 => friction_angle = ^0.5236
  dilatancy_angle = 5.0 => dilatancy_angle = 0.0873
  `friction_angle`: 0.5236 deg looks like an angle in radians
  degrees: 30.0?
",
    );
}

#[test]
fn refuses_values_that_do_not_fit_each_other() {
    refuses(
        r#"
dilatancy above friction
  dilatancy_angle = 5.0 => dilatancy_angle = ^35.0
  `coulomb_joint`
  dilatancy_angle: 35 deg is above friction_angle = 30 deg
tension beyond the apex: 10 / tan 30° = 17.32
  cohesion = 10.0 => cohesion = 10.0\ntensile_strength = ^17.4
  `coulomb_joint`
  tensile_strength: 17.4 kPa is above
  17.32
a layer softer across than along: 4/3 · 4e5 = 5.33e5
  normal_stiffness = 1e6 => normal_stiffness = 5.3e5
  law = "joint" => law = ^"joint"
  K_n > 4/3 K_t
  K_n = 5.3
  K_t = 4.0
  in_plane = "none"
"#,
    );
}

/// Without elasticity along the layer its two stiffnesses are free.
#[test]
fn takes_the_hint_about_layers() {
    let text = edited(&[
        "normal_stiffness = 1e6 => normal_stiffness = 5.3e5",
        r#"law = "joint" => law = "joint"\nin_plane = "none""#,
    ]);
    Place::new().run_case(text).ended(0);
}

#[test]
fn refuses_laws_in_elements_they_are_not_made_for() {
    refuses(
        r#"
interface law in a solid
  law = "coulomb_joint" => law = ^"coulomb_joint"
  law = "soil" => law = "joint"
  made for interface_2d, interface_3d, expected plane_strain
  group `soil`
  `solid`
interface law in a solid, from a later phase on
  name = "push" => name = "push"\nlaws = { soil = ^"joint" }
  made for interface_2d, interface_3d, expected plane_strain
  group `soil`
continuum law without thickness
  law = "elastic" => law = ^"elastic"
  [[mesh.region]]\ngroup = "layer"\nx = [1.0, 1.01]\n =>
  formulation = "thin_layer"\nlaw = "joint" => formulation = "zero_thickness"\nline = "middle"\nlaw = "soil"
  expected interface_2d
  group `layer`
  `zero_thickness`
law in axes of a layer in a solid
  law = "elastic"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3 } => law = "oriented_mohr_coulomb"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3, cohesion = 10.0, friction_angle = 30.0, dilatancy_angle = 5.0 }
  law = "soil" => law = ^"soil"
  `oriented_mohr_coulomb` works in axes of a layer
  `thin_layer`
"#,
    );
}

#[test]
fn refuses_settings_of_the_solver_out_of_range() {
    refuses(
        "
negative tolerance
  max_iterations = 20 => force_tolerance = ^-1e-6
  `force_tolerance`: -1e-6 is outside [1e-14, 1.0]
no tolerance
  max_iterations = 20 => force_tolerance = ^0.0
  `force_tolerance`: 0.0
out of reach
  max_iterations = 20 => displacement_tolerance = ^1e-30
  `displacement_tolerance`: 1e-30 is outside [1e-14, 1.0]
all tolerated
  max_iterations = 20 => force_tolerance = ^2.0
  `force_tolerance`: 2.0
no iterations
  max_iterations = 20 => max_iterations = ^0
  `max_iterations`: 0 is outside [1, 10000]
endless halving
  max_iterations = 20 => max_halvings = ^4000000000
  `max_halvings`: 4000000000 is outside [0, 40]
",
    );
}
