//! Phases, loads and constraints that contradict each other or do nothing.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{Place, refuses};
use tests::words::rows_of;

#[test]
fn refuses_impossible_phases() {
    refuses(
        r#"
the same name twice
  "push" => ^"weight"
  two phases are called `weight`
no name
  "push" => ^""
  a phase needs a name
no increments
  increments = 2 => increments = ^0
  `increments` is 0, expected 1 to 10000000
increments for a lifetime
  increments = 2 => increments = ^10000000000
  `increments` is 10000000000, expected 1 to 10000000
"#,
    );
}

#[test]
fn refuses_pressures_inside_and_twice() {
    refuses(
        r#"
inside
  { line = "top", value = 10.0 } => { line = ^"middle", value = 10.0 }
  a pressure needs a boundary, line `middle` is not
on a point
  { line = "top", value = 10.0 } => { line = ^"corner", value = 10.0 }
  a pressure needs a boundary, line `corner` is not
twice
  { line = "top", value = 10.0 } => { line = "top", value = 1.0 }, { line = ^"top", value = 2.0 }
  line `top` has two pressures in this phase
"#,
    );
}

#[test]
fn refuses_constraints_that_contradict_each_other_or_do_nothing() {
    refuses(
        r#"
a displacement at a support
  displacement = [{ line = "top", x = 1e-5 }] => displacement = [{ line = ^"bottom", x = 1e-5 }]
  the node at (0, 0) of line `bottom` has a support in x
a displacement at the end of a support
  displacement = [{ line = "top", x = 1e-5 }] => displacement = [{ line = ^"left", x = 1e-5 }]
  the node at (0, 0) of line `left` has a support in x
two displacements of one node
  displacement = [{ line = "top", x = 1e-5 }] => displacement = [{ line = "top", x = 0.1 }, { line = ^"top", x = 0.2 }]
  the node at (0, 1) of line `top` gets 0.2 m in x, and 0.1 m by line `top`
a displacement without a value
  displacement = [{ line = "top", x = 1e-5 }] => displacement = [{ line = ^"top" }]
  the displacement of line `top` has no value
  give `x`, `y`, or both
water that weighs less than nothing
  title = "A block beside a layer" => water = { level = 0.0, unit_weight = ^-9.81 }
  the water's `unit_weight` is -9.81, expected a positive number
a force without a value
  displacement = [{ line = "top", x = 1e-5 }] => force = [{ line = ^"top" }]
  the force of line `top` has no value
  give `x`, `y`, or both
a force where a displacement is prescribed
  displacement = [{ line = "top", x = 1e-5 }] => displacement = [{ line = "top", x = 1e-5 }]\nforce = [{ line = ^"top", x = 1.0 }]
  the force on line `top` has no effect in x
  a displacement of this phase must be left out
what nothing holds set free
  displacement = [{ line = "top", x = 1e-5 }] => free = [{ line = ^"top", components = ["x"] }]
  `free` of line `top`: nothing holds it in x
nothing set free
  displacement = [{ line = "top", x = 1e-5 }] => free = [{ line = ^"bottom", components = [] }]
  `free` of line `bottom`: `components` is empty
nothing fixed
  line = "bottom" => line = ^"bottom"
  ["x", "y"] => []
  `fixed` is empty for line `bottom`
"#,
    );
}

#[test]
fn refuses_models_that_nothing_holds() {
    refuses(
        r#"
no support
  [[supports]]\nline = "bottom"\nfixed = ["x", "y"]\n =>
  "weight" => ^"weight"
  phase `weight`: nothing holds the model in x
  [[supports]]
one direction
  ["x", "y"] => ["x"]
  "weight" => ^"weight"
  phase `weight`: nothing holds the model in y
support given up
  "push" => ^"push"\nfree = [{ line = "bottom", components = ["y"] }]
  phase `push`: nothing holds the model in y
along the axis
  "plane_strain" => "axisymmetric"
  [[supports]]\nline = "bottom"\nfixed = ["x", "y"]\n =>
  "weight" => ^"weight"
  phase `weight`: nothing holds the model in z
"#,
    );
}

/// Two blocks on each other, E = 10⁵ kPa, ν = 0: 100 kPa sink 1 mm into each.
const COLUMN: &str = r#"title = "Column of two blocks"
analysis = "plane_strain"
mesh.columns = [{ n = 1, to = 1.0 }]
mesh.rows = [{ n = 1, to = 1.0 }, { n = 1, to = 2.0 }]
mesh.lines = { bottom = { y = 0.0 }, middle = { y = 1.0 }, top = { y = 2.0 }, left = { x = 0.0 }, right = { x = 1.0 }, corner = { x = 0.0, y = 2.0 } }
mesh.region = [{ group = "lower", y = [0.0, 1.0] }, { group = "upper", y = [1.0, 2.0] }]
[laws]
block = { law = "elastic", parameters = { young_modulus = 1e5, poisson_ratio = 0.0 } }
joint = { law = "coulomb_joint", parameters = { normal_stiffness = 1e6, shear_stiffness = 1e6, cohesion = 10.0, friction_angle = 30.0, dilatancy_angle = 0.0 } }
[groups]
lower = { formulation = "solid", integration = "full", law = "block" }
upper = { formulation = "solid", integration = "full", law = "block" }
#JOINT
[[supports]]
line = "bottom"
fixed = ["x", "y"]
[probes]
u_top = { line = "top", quantity = "displacement_y" }
s_low = { group = "lower", quantity = "stress_22" }
head = { line = "top", quantity = "reaction_y" }
"#;

/// The column with an interface between its blocks, there from the start or not.
fn jointed(is_active: bool) -> String {
    let joint = format!(
        "joint = {{ formulation = \"zero_thickness\", line = \"middle\", law = \"joint\", active = {is_active} }}"
    );
    COLUMN.replace("#JOINT", &joint)
}

/// With phases of one increment each: name and what they do.
fn with_phases(column: &str, phases: &[(&str, &str)]) -> String {
    let phases = phases
        .iter()
        .map(|(name, does)| format!("[[phase]]\nname = \"{name}\"\nincrements = 1\n{does}\n"));
    format!("{column}{}", phases.collect::<String>())
}

/// Warnings of a run, and the values of a probe after each phase.
fn run(text: &str, probe: &str) -> (Vec<String>, Vec<f64>) {
    let place = Place::new();
    place.done_case(text);
    let summary = place.summary();
    let warnings = summary["warnings"].as_array().unwrap().iter();
    let warnings = warnings.map(|warning| warning.as_str().unwrap().to_owned());
    let history = place.read("out/history.csv");
    let mut rows = history
        .lines()
        .map(|row| row.split(',').collect::<Vec<_>>());
    let column = rows
        .next()
        .unwrap()
        .iter()
        .position(|name| *name == probe)
        .unwrap();
    let values = rows.map(|row| row[column].parse().unwrap());
    // What is said of other things than loads is no matter of these.
    let others = [
        "no group takes",
        "probe `",
        "is never active: no phase has it in `activate`",
        "starts out of balance",
    ];
    let warnings = warnings.filter(|said| !others.iter().any(|other| said.contains(other)));
    (warnings.collect(), values.collect())
}

#[track_caller]
fn refused(text: &str, at: &str, says: &[&str]) {
    let place = Place::new();
    let outcome = place.refused_case(text);
    let line = text[..text.find(at).unwrap()].matches('\n').count() + 1;
    for says in says
        .iter()
        .copied()
        .chain([format!("case.toml:{line}:").as_str()])
    {
        outcome.shows(says);
    }
}

#[track_caller]
fn close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    let both = found.iter().zip(expected);
    let most = expected
        .iter()
        .fold(0.0, |most: f64, value| most.max(value.abs()));
    both.for_each(|(a, b)| assert!((a - b).abs() < 1e-9 * most, "{found:?} {expected:?}"));
}

/// A load that comes back with its ground is reported where it does, unless it was set to 0 meanwhile.
#[test]
fn a_load_comes_back_with_its_ground_and_is_told_of() {
    const DIG: (&str, &str) = ("dig", "deactivate = [\"upper\"]");
    const FILL: (&str, &str) = ("fill", "activate = [\"upper\"]");
    for [kind, load, none] in rows_of(
        r#"
pressure | { line = "top", value = 100.0 } | { line = "top", value = 0.0 }
force | { line = "top", y = -100.0 } | { line = "top", y = 0.0 }
"#,
    ) {
        let give = |load: &str| format!("{kind} = [{load}]");
        let (load, none) = (give(load), give(none));
        let press = ("press", load.as_str());
        let (said, stress) = run(&with_phases(COLUMN, &[press, DIG, FILL]), "s_low");
        let goes = format!("phase `dig` removes ground that the {kind} on line `top` acts upon");
        let comes = format!(
            "phase `fill` brings back ground that the {kind} on line `top` of phase `press` acts upon, and the {kind} with it"
        );
        assert!(said.iter().any(|said| said.contains(&goes)), "{said:?}");
        assert!(said.iter().any(|said| said.contains(&comes)), "{said:?}");
        close(&stress, &[-100.0, 0.0, -100.0]);
        // Taken off while it is away, or by the phase that fills.
        let off = ("off", none.as_str());
        let fill_without = format!("{}\n{none}", FILL.1);
        for (phases, expected) in [
            (vec![press, DIG, off, FILL], vec![-100.0, 0.0, 0.0, 0.0]),
            (
                vec![press, DIG, ("fill", fill_without.as_str())],
                vec![-100.0, 0.0, 0.0],
            ),
        ] {
            let (said, stress) = run(&with_phases(COLUMN, &phases), "s_low");
            assert!(
                !said.iter().any(|said| said.contains("brings back")),
                "{said:?}"
            );
            close(&stress, &expected);
        }
        // Another one than 0 is refused there, as before; and nothing is told of 0 that goes.
        refused(
            &with_phases(COLUMN, &[DIG, press]),
            &load,
            &["line `top` lies on elements that are not active in this phase"],
        );
        let (said, _) = run(&with_phases(COLUMN, &[press, off, DIG, FILL]), "s_low");
        assert_eq!(said, Vec::<String>::new());
    }
}

/// A pressure on what is covered ends, with an interface as without, and is back where that is dug away.
#[test]
fn a_pressure_that_ground_covers_ends_and_comes_back() {
    let press = (
        "press",
        "deactivate = [\"upper\"]\npressure = [{ line = \"middle\", value = 100.0 }]",
    );
    let joint = jointed(false);
    for (column, group) in [
        (COLUMN, "\"upper\""),
        (joint.as_str(), "\"upper\", \"joint\""),
    ] {
        let fill = format!("activate = [{group}]");
        let dig = format!("deactivate = [{group}]");
        let off = "pressure = [{ line = \"middle\", value = 0.0 }]";
        let (fill, dig) = (("fill", fill.as_str()), ("dig", dig.as_str()));
        let (said, stress) = run(&with_phases(column, &[press, fill, dig]), "s_low");
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(
            said[0]
                .contains("phase `fill` brings ground upon line `middle`: the pressure there ends")
        );
        assert!(said[1].contains(
            "phase `dig` lays line `middle` bare, and the pressure there of phase `press` is back"
        ));
        close(&stress, &[-100.0, 0.0, -100.0]);
        let (said, stress) = run(
            &with_phases(column, &[press, fill, ("off", off), dig]),
            "s_low",
        );
        assert_eq!(said.len(), 1, "{said:?}");
        close(&stress, &[-100.0, 0.0, 0.0, 0.0]);
    }
}

/// A force neither releases nor pushes a line that an earlier phase pushed by `displacement`.
#[test]
fn loads_on_what_a_displacement_holds_are_refused_with_free_as_the_hint() {
    let push = ("push", "displacement = [{ line = \"top\", y = -1e-3 }]");
    let has_no_effect = ["the force on line `top` has no effect in y"];
    for force in ["y = 0.0", "y = -50.0", "x = 3.0, y = -50.0"] {
        let release = format!("force = [{{ line = \"top\", {force} }}]");
        refused(
            &with_phases(COLUMN, &[push, ("release", release.as_str())]),
            &release,
            &[
                &has_no_effect[..],
                &["`free = [{ line = \"top\", components = [\"y\"] }]`"],
            ]
            .concat(),
        );
        // Given up, it acts.
        let freed = format!("{release}\nfree = [{{ line = \"top\", components = [\"y\"] }}]");
        let (said, head) = run(
            &with_phases(COLUMN, &[push, ("release", freed.as_str())]),
            "head",
        );
        assert_eq!(said, Vec::<String>::new());
        close(&head, &[-50.0, 0.0]);
    }
    let release = "pressure = [{ line = \"top\", value = 0.0 }]";
    refused(
        &with_phases(COLUMN, &[push, ("release", release)]),
        release,
        &["the pressure on line `top` has no effect", "`free`"],
    );
    // A point of a rigid line holds all of it.
    let rigid = (
        "push",
        "rigid = [\"top\"]\ndisplacement = [{ line = \"corner\", y = -1e-3 }]",
    );
    for force in ["y = 0.0", "y = -50.0"] {
        let release = format!("force = [{{ line = \"top\", {force} }}]");
        refused(
            &with_phases(COLUMN, &[rigid, ("release", release.as_str())]),
            &release,
            &has_no_effect,
        );
    }
    // What stood before it was held is taken off; what acts once it is free, and along what is held, acts.
    let load = ("load", "force = [{ line = \"top\", y = -50.0 }]");
    let take_over =
        "displacement = [{ line = \"top\", y = -1e-3 }]\nforce = [{ line = \"top\", y = 0.0 }]";
    let (said, head) = run(&with_phases(COLUMN, &[load, ("push", take_over)]), "head");
    assert_eq!(said, Vec::<String>::new());
    close(&head, &[0.0, -50.0]);
    let along = ("shear", "force = [{ line = \"top\", x = 1.0 }]");
    let (said, _) = run(&with_phases(COLUMN, &[push, along]), "head");
    assert_eq!(said, Vec::<String>::new());
    let free = ("free", "free = [{ line = \"top\", components = [\"y\"] }]");
    let (_, head) = run(&with_phases(COLUMN, &[push, load, free]), "u_top");
    close(&head[2..], &[-1e-3]);
}

/// Half of the line is held.
#[test]
fn says_how_much_of_a_force_is_lost() {
    let column = COLUMN
        .replace(
            "[{ n = 1, to = 1.0 }]\nmesh.rows",
            "[{ n = 4, to = 1.0 }]\nmesh.rows",
        )
        .replace(
            "corner = {",
            "half = { x = [0.0, 0.5], y = 2.0 }, corner = {",
        );
    let push = (
        "push",
        "displacement = [{ line = \"half\", y = -1e-3 }]\nforce = [{ line = \"top\", y = -8.0 }]",
    );
    let (said, _) = run(&with_phases(&column, &[push]), "head");
    let share = "phase `push`: 50.000 % of the force in y on line `top` (4.0000e0 kN/m) has no effect but on reactions";
    assert!(said.iter().any(|said| said.contains(share)), "{said:?}");
}

/// A line along which an interface stands has two faces.
#[test]
fn loads_and_displacements_on_an_interface_are_refused() {
    let there = jointed(true);
    for [does, says] in rows_of(
        r#"
force = [{ line = "middle", x = 1.0 }] | a force on line `middle`, which carries interface elements
pressure = [{ line = "middle", value = 1.0 }] | a pressure on line `middle`, which carries interface elements
displacement = [{ line = "middle", x = 1e-3 }] | a displacement on line `middle`, which carries interface elements
"#,
    ) {
        let text = with_phases(&there, &[("rest", ""), ("do", does)]);
        refused(
            &text,
            does,
            &[says, "belongs to the pile or to the ground alone"],
        );
    }
    let held =
        with_phases(&there, &[("rest", "")]).replace("line = \"bottom\"", "line = \"middle\"");
    refused(
        &held,
        "line = \"middle\"\nfixed",
        &["a support on line `middle`, which carries interface elements"],
    );
    // Before the interface comes its faces are one; where it comes they are two.
    let force = ("load", "force = [{ line = \"middle\", y = -100.0 }]");
    let (said, stress) = run(&with_phases(&jointed(false), &[force]), "s_low");
    assert_eq!(said, Vec::<String>::new());
    close(&stress, &[-100.0]);
    let comes = ("comes", "activate = [\"joint\"]");
    let text = with_phases(&jointed(false), &[force, comes]);
    refused(
        &text,
        "activate = [\"joint\"]",
        &["a force on line `middle`, which carries interface elements"],
    );
    let off = (
        "comes",
        "activate = [\"joint\"]\nforce = [{ line = \"middle\", y = 0.0 }]",
    );
    run(&with_phases(&jointed(false), &[force, off]), "s_low");
}

/// A water table below the mesh makes a dry site. One above the ground is reported, with both heights and the line.
#[test]
fn water_below_the_mesh_and_above_the_ground_is_said() {
    let heavy = COLUMN.replace(
        "law = \"block\" }",
        "law = \"block\", unit_weight = 18.0, saturated_unit_weight = 20.0, initial_stress = { k_0 = 0.5 } }",
    );
    let at =
        |level: &str| heavy.replace("[laws]", &format!("water = {{ level = {level} }}\n[laws]"));
    let sides =
        ["left", "right"].map(|line| format!("[[supports]]\nline = \"{line}\"\nfixed = [\"x\"]\n"));
    let sides = sides.concat();
    let text = |level: &str| with_phases(&format!("{}{sides}", at(level)), &[("rest", "")]);
    let line = at("0")
        .lines()
        .position(|line| line.starts_with("water"))
        .unwrap()
        + 1;
    let says = |level: &str, words: &[&str]| {
        let (said, stress) = run(&text(level), "s_low");
        let place = format!("case.toml:{line}:");
        let is_it =
            |said: &&String| said.contains(&place) && words.iter().all(|word| said.contains(word));
        assert_eq!(
            said.iter().filter(is_it).count(),
            usize::from(!words.is_empty()),
            "{said:?}"
        );
        assert_eq!(said.len(), usize::from(!words.is_empty()), "{said:?}");
        stress
    };
    // The middle of the lower block has 1.5 m of dry ground above it.
    close(
        &says(
            "-7.5",
            &["-7.5 m", "below the lowest point of the mesh", "0 m", "dry"],
        ),
        &[-27.0],
    );
    close(&says("0.0", &[]), &[-27.0]);
    // 20 − 9.81 kN/m³ under a lake.
    close(
        &says("2.5", &["2.5 m", "above the highest ground", "2 m"]),
        &[-1.5 * (20.0 - 9.81)],
    );
    close(&says("2.0", &[]), &[-1.5 * (20.0 - 9.81)]);
    // A phase that changes it.
    let rise = with_phases(
        &format!("{}{sides}", at("-3.0")),
        &[("rest", ""), ("rise", "water = { level = 4.0 }")],
    );
    let (said, _) = run(&rise, "s_low");
    assert!(
        said.iter()
            .any(|said| said.contains("lies above the highest ground at 2 m")),
        "{said:?}"
    );
    // One unit weight on both sides of the table.
    let one = text("1.5").replace("saturated_unit_weight = 20.0, ", "");
    let (said, _) = run(&one, "s_low");
    for group in ["`lower` lies below", "`upper` crosses"] {
        let says = |said: &String| said.contains(group) && said.contains("`unit_weight` 18");
        assert!(said.iter().any(says), "{group}: {said:?}");
    }
}
