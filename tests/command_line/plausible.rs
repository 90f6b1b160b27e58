//! Input that is plausible nonsense: refused where it cannot be meant, else said with its number.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{CASE, DONE, JOINT, Place, edited, refuses};

const PUSH: &str = "displacement = [{ line = \"top\", x = 1e-5 }]";

/// The layer as strong as the soil.
const ELASTIC: &str = r#"law = "joint" => law = "soil""#;

/// The warnings of the case after some edits, which must run.
fn warnings(edits: &[&str]) -> Vec<String> {
    let place = Place::new();
    let outcome = place.done_case(edited(edits));
    let summary = place.summary();
    let warnings = summary["warnings"].as_array().unwrap();
    let warnings: Vec<String> = warnings
        .iter()
        .map(|warning| warning.as_str().unwrap().to_owned())
        .collect();
    for warning in &warnings {
        outcome.shows(warning);
    }
    warnings
}

/// One of the warnings says all of this.
#[track_caller]
fn warns(edits: &[&str], says: &[&str]) {
    let warnings = warnings(edits);
    let found = |warning: &String| says.iter().all(|text| warning.contains(text));
    assert!(warnings.iter().any(found), "{says:?}\n{warnings:#?}");
}

/// There is no warning at all.
#[track_caller]
fn runs_quietly(edits: &[&str]) {
    // Edits may leave a law without a group.
    let mut warnings = warnings(edits);
    warnings.retain(|warning| !warning.starts_with("no group takes the laws"));
    assert!(warnings.is_empty(), "{warnings:#?}");
}

#[test]
fn refuses_a_normal_along_the_layer() {
    refuses(
        r#"
the long side across
  formulation = "thin_layer" => formulation = "thin_layer"\nnormal = ^"y"
  group `layer` is 0.010000 by 1.000000 m
  `normal = "x"`, or leave it out
"#,
    );
    // Elements may be shorter than the layer is thick, and a layer a little so.
    let normal = r#"formulation = "thin_layer" => formulation = "thin_layer"\nnormal = "x""#;
    runs_quietly(&[normal]);
    runs_quietly(&[
        normal,
        ELASTIC,
        "{ n = 2, to = 1.0 } => { n = 1, to = 0.99 }, { n = 4, to = 1.0 }",
        "middle = { y = 0.5 }\ncorner = { x = 0.0, y = 0.5 }\n => ",
    ]);
    runs_quietly(&[
        normal,
        ELASTIC,
        "to = 1.01 => to = 1.9",
        "x = [1.0, 1.01] => x = [1.0, 1.9]",
    ]);
}

#[test]
fn refuses_a_model_that_can_turn() {
    refuses(
        r#"
held in one point
  line = "bottom" => line = "corner"
  "weight" => ^"weight"
  phase `weight`: nothing holds the model against turning
"#,
    );
    // Two points on a line hold it.
    runs_quietly(&[
        ELASTIC,
        r#"line = "bottom" => line = "corner""#,
        r#"[[phase]] => [[supports]]\nline = "other"\nfixed = ["y"]\n[[phase]]"#,
        "corner = { x = 0.0, y = 0.5 }\n => corner = { x = 0.0, y = 0.5 }\nother = { x = 2.0, y = 0.5 }\n",
        "young_modulus = 1e4 => young_modulus = 1e6",
    ]);
}

#[test]
fn refuses_pressures_without_effect() {
    refuses(
        r#"
on a support
  pressure = [{ line = "top", value = 10.0 }] => pressure = [{ line = ^"bottom", value = 10.0 }]
  the pressure on line `bottom` has no effect
  held or prescribed
on a line that is moved
  displacement = [{ line = "top", x = 1e-5 }] => displacement = [{ line = "top", y = -1e-5 }]\npressure = [{ line = ^"top", value = 20.0 }]
  the pressure on line `top` has no effect
"#,
    );
    // A pressure that acted before its line was held, one that acts once it is free, one whose
    // line only ends on a support, and one along the support.
    runs_quietly(&[
        r#"displacement = [{ line = "top", x = 1e-5 }] => displacement = [{ line = "top", y = -1e-3 }]"#,
    ]);
    Place::new()
        .run_case(edited(&[
            "displacement = [{ line = \"top\", x = 1e-5 }] => displacement = [{ line = \"top\", \
            y = -1e-3 }]\npressure = [{ line = \"top\", value = 20.0 }]\n[[phase]]\n\
            name = \"free\"\nincrements = 1\nfree = [{ line = \"top\", components = [\"y\"] }]",
        ]))
        .ended(DONE);
    runs_quietly(&[
        r#"pressure = [{ line = "top", value = 10.0 }] => pressure = [{ line = "left", value = 1.0 }]"#,
    ]);
    runs_quietly(&[
        ELASTIC,
        r#"["x", "y"] => ["x"]"#,
        r#"line = "bottom" => line = "left""#,
        r#"[[phase]] => [[supports]]\nline = "bottom"\nfixed = ["y"]\n[[phase]]"#,
        r#"displacement = [{ line = "top", x = 1e-5 }] => "#,
    ]);
}

#[test]
fn says_how_much_of_a_pressure_is_lost() {
    // 1.0 of 2.0 m are held.
    warns(
        &[
            ELASTIC,
            "corner = { x = 0.0, y = 0.5 }\n => corner = { x = 0.0, y = 0.5 }\nhead = { y = 1.0, x = [0.0, 1.0] }\n",
            r#"pressure = [{ line = "top", value = 10.0 }] => pressure = [{ line = "top", value = 1.0 }]\ndisplacement = [{ line = "head", y = 0.0 }]"#,
            r#"displacement = [{ line = "top", x = 1e-5 }] => "#,
        ],
        &["phase `weight`: 50.000 % of the pressure on line `top` (1.0000e0 kN/m)"],
    );
}

#[test]
fn refuses_a_line_that_is_freed_and_prescribed_at_once() {
    refuses(
        r#"
the same line
  [[phase]]\nname = "push"\nincrements = 2\ndisplacement = [{ => [[phase]]\nname = "hold"\nincrements = 1\ndisplacement = [{ line = "middle", x = 1e-6 }]\n\n[[phase]]\nname = "push"\nincrements = 2\nfree = [{ line = ^"middle", components = ["x"] }]\ndisplacement = [{ line = "middle", x = 2e-6 }, {
  `free` of line `middle` has no effect in x
  `displacement` of line `middle`
"#,
    );
    // Freed in one direction and moved in the other; and a support that is given up to be moved.
    let place = Place::new();
    let text = edited(&[
        "[[phase]]\nname = \"push\"\n => [[phase]]\nname = \"hold\"\nincrements = 1\n\
            displacement = [{ line = \"middle\", x = 1e-6 }]\n\n[[phase]]\n\
            name = \"push\"\n",
        r#"displacement = [{ line = "top", x = 1e-5 }] => free = [{ line = "middle", components = ["x"] }]\ndisplacement = [{ line = "middle", y = -1e-6 }]"#,
    ]);
    place.done_case(text);
    let text = edited(&[
        r#"displacement = [{ line = "top", x = 1e-5 }] => free = [{ line = "bottom", components = ["x"] }]\ndisplacement = [{ line = "bottom", x = 1e-6 }]"#,
    ]);
    place.done_case(text);
}

#[test]
fn refuses_compression_typed_as_positive_where_the_law_cannot_stand_it() {
    const STRESS: &str = r#"law = "soil"\n\n[groups.layer] => law = "soil"\ninitial_stress = ^{ 11 = 50.0, 22 = 100.0, 33 = 50.0 }\n\n[groups.layer]"#;
    refuses(
        r#"
pressure as positive
  law = "elastic"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3 } => law = "mohr_coulomb"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3, cohesion = 1.0, friction_angle = 30.0, dilatancy_angle = 0.0 }
  law = "soil"\n\n[groups.layer] => law = "soil"\ninitial_stress = ^{ 11 = 50.0, 22 = 100.0, 33 = 50.0 }\n\n[groups.layer]
  `initial_stress` of group `soil`: law `soil` cannot stand it
  tension is positive
"#,
    );
    // An elastic body stands tension.
    let place = Place::new();
    place.done_case(edited(&[ELASTIC, STRESS]).replace('^', ""));
}

#[test]
fn says_what_a_reaction_leaves_out() {
    // 10 kPa on 2 m.
    warns(
        &[r#"tau = { => head = { line = "top", quantity = "reaction_y" }\ntau = {"#],
        &[
            "probe `head`",
            "-2.000000e1 kN/m of pressure",
            "`force_y` with a `group`",
        ],
    );
    runs_quietly(&[r#"tau = { => head = { line = "top", quantity = "reaction_x" }\ntau = {"#]);
    runs_quietly(&[r#"tau = { => foot = { line = "bottom", quantity = "reaction_y" }\ntau = {"#]);
}

#[test]
fn warns_of_stiffness_that_no_material_has() {
    warns(
        &["young_modulus = 1e4 => young_modulus = 210e9"],
        &["law `soil`: its stiffness is 2.827e11 kPa", "typed in Pa"],
    );
    warns(
        &[
            "young_modulus = 1e4 => young_modulus = 0.5",
            r#"pressure = [{ line = "top", value = 10.0 }] => "#,
            r#"displacement = [{ line = "top", x = 1e-5 }] => "#,
        ],
        &["law `soil`: its stiffness is 6.731e-1 kPa", "typed in MPa"],
    );
    // A law that is not linear is looked at once it has been called.
    warns(
        &[
            "law = \"elastic\"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3 } => \
            law = \"mohr_coulomb\"\nparameters = { young_modulus = 210e9, poisson_ratio = 0.3, \
            cohesion = 100.0, friction_angle = 30.0, dilatancy_angle = 0.0 }",
        ],
        &["law `soil`: its stiffness is 2.827e11 kPa"],
    );
}

#[test]
fn warns_of_results_beyond_small_strains() {
    // Half of the modulus as a pressure.
    warns(
        &[
            "value = 10.0 => value = 5000.0",
            r#"displacement = [{ line = "top", x = 1e-5 }] => "#,
        ],
        &[
            "beyond the theory of small strains",
            "of the bodies are strained by more than 0.2",
        ],
    );
    warns(
        &[
            r#"displacement = [{ line = "top", x = 1e-5 }] => displacement = [{ line = "top", x = 0.5 }]"#,
        ],
        &["a node moves by 0.5000 m, the model is 2.0000 m long"],
    );
    let opened = [
        JOINT,
        &[
            r#"pressure = [{ line = "top", value = 10.0 }] => "#,
            r#"displacement = [{ line = "top", x = 1e-5 }] => displacement = [{ line = "above", y = 0.9 }]"#,
            "corner = { x = 0.0, y = 0.5 }\n => corner = { x = 0.0, y = 0.5 }\nabove = { y = 1.0 }\n",
        ],
    ]
    .concat();
    warns(
        &opened,
        &[
            "the two sides of group `layer` move against each other by 0.9",
            "2.0000 m long",
        ],
    );
}

#[test]
fn warns_of_a_layer_that_is_no_layer() {
    warns(
        &["{ n = 1, to = 1.01 } => { n = 2, to = 1.01 }"],
        &["group `layer`: the thin layer is more than one element thick: 2 elements"],
    );
    warns(
        &[
            "{ n = 2, to = 1.0 } => { n = 1, to = 0.99 }, { n = 4, to = 1.0 }",
            "middle = { y = 0.5 }\ncorner = { x = 0.0, y = 0.5 }\n => ",
        ],
        &[
            "group `layer`: 1 of the thin layer's elements stand across their neighbours",
            "`normal = …`",
        ],
    );
}

const MEPI: &str = "law = \"mepi\"\n[laws.joint.parameters]\nk_n = 1e6\nk_t = 4e5\nn = 0.5\n\
                    mu_0 = 0.3\nmu_p = 0.7\nmu_c0 = 0.5\na = 0.01\nc_0 = 20.0\np_0 = 100.0\n";

#[test]
fn warns_of_a_thickness_that_differs_from_the_layers() {
    const JOINT_LAW: &str = "law = \"coulomb_joint\"\n[laws.joint.parameters]\n\
        normal_stiffness = 1e6\nshear_stiffness = 4e5\ncohesion = 10.0\nfriction_angle = 30.0\n\
        dilatancy_angle = 5.0\n";
    let with = |t: &str| {
        let text = edited(&[
            r#"formulation = "thin_layer"\n => formulation = "thin_layer"\ninitial_stress = { 11 = -100.0, 22 = -50.0, 33 = -50.0 }\n"#,
        ]);
        let place = Place::new();
        let outcome = place.run_case(text.replace(JOINT_LAW, &format!("{MEPI}t = {t}\n")));
        outcome.shows("phase weight");
        outcome.says("the layer of elements is 0.010000 m thick")
    };
    assert!(with("0.02"));
    assert!(!with("0.01"));
}

#[test]
fn warns_of_an_interface_that_ends_at_a_corner() {
    const BLOCK: &str = r#"[[mesh.region]]\ngroup = "layer"\nx = [1.0, 1.01]\n => [[mesh.region]]\ngroup = "block"\nx = [0.0, 1.0]\ny = [0.5, 1.0]\n"#;
    const INTERFACE: &str =
        r#"formulation = "thin_layer"\n => formulation = "zero_thickness"\nline = "base"\n"#;
    const BASE: &str = "corner = { x = 0.0, y = 0.5 }\n => corner = { x = 0.0, y = 0.5 }\nbase = { y = 0.5, x = [0.0, 1.0] }\n";
    let group = |law: &'static str| {
        let text = edited(&[BLOCK, INTERFACE, BASE]);
        text.replace(
            "[groups.soil]",
            &format!("[groups.block]\nformulation = \"solid\"\nintegration = \"full\"\nlaw = \"{law}\"\n\n[groups.soil]"),
        )
        .replace(
            "[laws.joint]",
            "[laws.concrete]\nlaw = \"elastic\"\nparameters = { young_modulus = 3e7, poisson_ratio \
             = 0.2 }\n\n[laws.joint]",
        )
    };
    let place = Place::new();
    let said = "group `layer` ends inside the mesh at (1.000000, 0.500000), at a corner of group \
                `block`";
    place.done_case(group("concrete")).shows(said);
    // Groups of one law are one body: the interface ends inside it.
    place.done_case(group("soil")).hides("ends inside the mesh");
}

#[test]
fn warns_of_an_axis_that_is_free() {
    let about = r#""plane_strain" => "axisymmetric""#;
    warns(
        &[about],
        &["phase `weight`: 4 of 5 nodes on the axis r = 0 are free in r, the first at z = 0.25"],
    );
    runs_quietly(&[
        about,
        r#"[[phase]] => [[supports]]\nline = "left"\nfixed = ["x"]\n\n[[phase]]"#,
        r#"displacement = [{ line = "top", x = 1e-5 }] => "#,
    ]);
}

/// Without the probes of the traction in the layer.
const NO_TRACTION: &str = "tau = { group = \"layer\", quantity = \"traction_t\" }\nhalf = { combine = { tau = 0.5 } } => ";

#[test]
fn warns_of_peaks_between_increments() {
    let course = |n: usize, course: &str| {
        let from = "increments = 2\ndisplacement = [{ line = \"top\", x = 1e-5 }]";
        warnings(&[&format!(
            "{from} => increments = {n}\ncourse = {course}\n{PUSH}"
        )])
    };
    let peaks = "[[0, 0], [0.25, 1], [0.5, 0.2], [0.75, 1], [1, 0.2]]";
    let said = "phase `push`: `course` turns at 0.25, 0.5 and 0.75 of its time, between the ends of its 7 increments: no \
                row of the results has what is reached there; `increments = 8` meets all";
    assert_eq!(course(7, peaks), [said]);
    assert!(course(8, peaks).is_empty());
    // It stays at its peak until an increment ends; and it does not turn.
    assert!(course(2, "[[0, 0], [0.3, 1], [0.6, 1], [1, 0]]").is_empty());
    assert!(course(2, "[[0, 0], [0.3, 0.1], [1, 1]]").is_empty());
    assert_eq!(course(2, "[[0, 0], [0.3, 1], [0.4, 1], [1, 0]]").len(), 1);
}

#[test]
fn warns_of_a_strain_of_what_is_not_there() {
    let with = |strain: &str| {
        warnings(&[
            ELASTIC,
            "formulation = \"thin_layer\" => formulation = \"solid\"\nactive = false",
            &format!("increments = 2\npressure = [{{ line = \"top\", value = 10.0 }}] => {strain}"),
            "name = \"push\" => name = \"push\"\nactivate = [\"layer\"]",
            &format!("{PUSH} => strain = {{ layer = 1e-6 }}"),
            NO_TRACTION,
        ])
    };
    let said = "phase `weight`: `strain` of group `layer` has no effect, since the group is not active. It counts as given: \
                of a later value only the difference acts";
    let is_said = |warnings: &[String]| warnings.iter().any(|warning| warning == said);
    assert!(is_said(&with("increments = 2\nstrain = { layer = 1e-6 }")));
    assert!(!is_said(&with("increments = 2\nstrain = { soil = 1e-6 }")));
}

#[test]
fn water_above_ground_may_stand_on_a_cap() {
    let level = |level: f64, cap: &str| {
        let text = edited(&[
            ELASTIC,
            &format!("title => water = {{ level = {level}, unit_weight = 1.0 }}\ntitle"),
            "formulation = \"thin_layer\" => formulation = \"solid\"\npore_water = false",
            &format!("group = \"layer\"\nx = [1.0, 1.01] => group = \"layer\"\n{cap}"),
            NO_TRACTION,
        ]);
        Place::new()
            .done_case(text)
            .says("lies above the highest ground")
    };
    assert!(!level(1.0, "y = [0.5, 1.0]"));
    assert!(level(1.2, "y = [0.5, 1.0]"));
    assert!(level(1.2, "x = [1.0, 1.01]"));
}

#[test]
fn tells_drivers_from_cases() {
    let place = Place::new();
    place.write("case.toml", CASE);
    place.write(
        "driver.toml",
        "law = \"coulomb_joint\"\nhypothesis = \"interface_2d\"\n[[segment]]\nincrements = 1\n",
    );
    place.write("other.toml", "base = \"driver.toml\"\n");
    let says = |arguments: &[&str], texts: &[&str]| {
        let outcome = place.refused(arguments);
        for text in texts {
            outcome.shows(text);
        }
    };
    let driver = ["driver.toml:2:1", "`hypothesis`: this is a driver file"];
    says(&["run", "driver.toml"], &driver);
    says(
        &["run", "driver.toml"],
        &["`pilum point driver.toml` takes it"],
    );
    says(&["run", "other.toml"], &driver);
    let case = [
        "case.toml:2:1",
        "`analysis`: this is a case file",
        "`pilum run case.toml`",
    ];
    says(&["point", "case.toml"], &case);
    // A case with a mistake of its own is still a case.
    place.write("case.toml", CASE.replace("fixed =", "fixt ="));
    says(&["run", "case.toml"], &["unknown key `fixt`"]);
}

const SOIL: &str = "law = \"elastic\"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3 }";

/// A law that relaxes: the descriptor does not say that it depends on the time, its parameter does.
#[test]
fn a_phase_without_a_time_is_told_of_where_a_parameter_is_one() {
    let viscous = |time: &str| {
        format!(
            "law = \"mohr_coulomb\"\nparameters = {{ young_modulus = 1e4, poisson_ratio = 0.3, cohesion = 100.0, \
             friction_angle = 30.0, dilatancy_angle = 0.0, relaxation_time = {time} }}"
        )
    };
    let told = |text: &str, dry: bool| {
        let place = Place::new();
        place.write("case.toml", text);
        let arguments = ["run", "case.toml", "--out", "out", "--dry-run"];
        let outcome = place.done(if dry { &arguments } else { &arguments[..4] });
        let lines = outcome
            .stderr
            .lines()
            .filter(|line| line.contains("has no `time`"));
        lines.map(str::to_owned).collect::<Vec<_>>()
    };
    let text = CASE.replacen(SOIL, &viscous("2.0"), 1);
    let line = |text: &str, name: &str| {
        let at = text.find(&format!("name = \"{name}\"")).unwrap();
        text[..at].matches('\n').count() + 1
    };
    for dry in [true, false] {
        let lines = told(&text, dry);
        assert_eq!(lines.len(), 2, "{lines:?}");
        for (said, phase) in lines.iter().zip(["weight", "push"]) {
            let place = format!("case.toml:{}:", line(&text, phase));
            let words = format!(
                "phase `{phase}` has no `time`, and law `soil` (`relaxation_time` is 2 s) depends on time: the phase takes 1 unit of time"
            );
            assert!(said.contains(&place) && said.contains(&words), "{said}");
        }
        let with_time = text.replace("name = \"push\"\n", "name = \"push\"\ntime = 10.0\n");
        assert_eq!(told(&with_time, dry).len(), 1);
        // Without viscosity time is nothing.
        assert_eq!(told(&CASE.replacen(SOIL, &viscous("0.0"), 1), dry).len(), 0);
    }
    // A law alone.
    let place = Place::new();
    let driver = format!(
        "{}\nhypothesis = \"plane_strain\"\n[[segment]]\nincrements = 2\ncontrol = {{ 12 = {{ strain = 1e-3 }} }}\n",
        viscous("2.0")
    );
    place.write("driver.toml", driver);
    let outcome = place.done(&["point", "driver.toml"]);
    let words = "law `mohr_coulomb` (`relaxation_time` is 2 s) depends on the time, and segment 1 says none";
    outcome.shows(words);
}

#[test]
fn choices_of_the_solver_without_effect_are_said_with_their_line() {
    let text = edited(&[]);
    let at = text.find("[solver]").unwrap();
    let place = format!("case.toml:{}:", text[..at].matches('\n').count() + 1);
    for method in ["modified_newton", "initial_stress"] {
        let says = format!("`control = \"viscous\"` has no effect with `method = \"{method}\"`");
        let viscous = format!("[solver] => [solver]\nmethod = \"{method}\"\ncontrol = \"viscous\"");
        warns(&[&viscous], &[&place, &says]);
    }
    let says = "`tangents = \"differences\"` has no effect with `method = \"initial_stress\"`";
    let differences =
        r#"[solver] => [solver]\nmethod = "initial_stress"\ntangents = "differences""#;
    warns(&[differences], &[&place, says]);
    let newton =
        r#"[solver] => [solver]\nmethod = "newton"\ncontrol = "viscous"\ntangents = "differences""#;
    let said = warnings(&[newton]);
    assert!(!said.iter().any(|w| w.contains("no effect")), "{said:?}");
}

#[test]
fn weights_that_a_phase_gives_to_ground_are_told() {
    const GROUND: &str =
        r#"law = "soil" => law = "soil"\nunit_weight = 18.0\ninitial_stress = { k_0 = 0.5 }"#;
    for (given, value) in [
        ("unit_weight = { soil = 40.0 }", "40"),
        ("unit_weight = { soil = 3.0 }", "3"),
    ] {
        let told = format!("phase `push`: `unit_weight` of group `soil` is {value} kN/m³");
        warns(
            &[GROUND, &format!("{PUSH} => {given}")],
            &[&told, "ground has 5 to 30"],
        );
    }
}
