//! Cases: a block in or on soil, with or without an interface next to or below it, pressed, pushed and
//! pushed back. Reactions balance the loads, what is prescribed is met, nothing runs away in silence.

use crate::seeds::{End, hold};
use input::{Error, Kind};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use tests::case::{Silent, run_text, table};

/// Place of the interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Seam {
    None,
    /// A thin layer next to the block, or below it.
    LayerBeside,
    LayerBelow,
    /// Without thickness.
    JointBeside,
    JointBelow,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Load {
    /// On the surface, parts of the unit of stress.
    Pressure(f64),
    /// Size of the block's head, as parts of the model's size.
    Push(f64),
    /// Back to where it was.
    Back,
}

#[derive(Clone, Debug)]
struct Model {
    is_axisymmetric: bool,
    origin: f64,
    /// Width of the model, m.
    size: f64,
    /// Size of the thin column and row, as parts of the size.
    thin: f64,
    /// Elements: columns of the block, of the soil, rows below and next to the block.
    n: [usize; 4],
    soil: (&'static str, f64, f64, f64, Option<f64>),
    soil_integration: &'static str,
    is_rigid: bool,
    seam: Seam,
    seam_law: &'static str,
    seam_integration: usize,
    is_held: [bool; 2],
    /// Initial pressure, parts of the unit of stress.
    initial: f64,
    /// Unit of stress, kPa; stiffnesses go with it.
    unit: f64,
    loads: Vec<(Load, usize, bool)>,
    method: &'static str,
    equations: &'static str,
    halvings: usize,
}

/// Stiffness of soil and steel, in kPa where the unit is 1 kPa.
const SOIL: f64 = 34e3;
const STEEL: f64 = 210e6;

impl Model {
    fn x(&self) -> [f64; 4] {
        let at = self.origin + 0.4 * self.size;
        [
            self.origin,
            at,
            at + self.thin * self.size,
            self.origin + self.size,
        ]
    }

    fn y(&self) -> [f64; 4] {
        let at = 0.5 * self.size;
        [0.0, at, at + self.thin * self.size, self.size]
    }

    /// Area of the surface that the pressure acts on.
    fn surface(&self) -> f64 {
        let [_, _, from, to] = self.x();
        if self.is_axisymmetric {
            std::f64::consts::PI * (to * to - from * from)
        } else {
            to - from
        }
    }

    /// Height of the foot of the block.
    fn foot(&self) -> f64 {
        // A layer below the block lies in the thin row, one beside it starts above that.
        match self.seam {
            Seam::JointBelow => self.y()[1],
            _ => self.y()[2],
        }
    }

    fn text(&self) -> String {
        let mut text = String::new();
        let mut line = |entry: String| writeln!(text, "{entry}").unwrap();
        self.write_mesh(&mut line);
        self.write_laws(&mut line);
        self.write_groups(&mut line);
        self.write_phases(&mut line);
        write_probes(self.size, &mut line);
        line(format!(
            "[solver]\ntolerated_residual = 0.0\nmethod = '{}'\nequations = '{}'\nmax_halvings = {}",
            self.method, self.equations, self.halvings
        ));
        text
    }

    fn write_mesh(&self, line: &mut dyn FnMut(String)) {
        let ([x0, x1, x2, x3], [y0, y1, y2, y3]) = (self.x(), self.y());
        let foot = self.foot();
        let [block, soil, below, beside] = self.n;
        let analysis = if self.is_axisymmetric {
            "axisymmetric"
        } else {
            "plane_strain"
        };
        line(format!("title = 'random'\nanalysis = '{analysis}'\n[mesh]"));
        line(format!("origin = [{x0}, {y0}]"));
        line(format!(
            "columns = [{{ n = {block}, to = {x1} }}, {{ n = 1, to = {x2} }}, {{ n = {soil}, to = {x3}, ratio = 1.3 }}]"
        ));
        line(format!(
            "rows = [{{ n = {below}, to = {y1} }}, {{ n = 1, to = {y2} }}, {{ n = {beside}, to = {y3} }}]"
        ));
        line(format!(
            "[[mesh.region]]\ngroup = 'a'\n[[mesh.region]]\ngroup = 'b'\nx = [{x0}, {x1}]\ny = [{foot}, {y3}]"
        ));
        match self.seam {
            Seam::LayerBeside => line(format!(
                "[[mesh.region]]\ngroup = 'i'\nx = [{x1}, {x2}]\ny = [{foot}, {y3}]"
            )),
            Seam::LayerBelow => line(format!(
                "[[mesh.region]]\ngroup = 'i'\nx = [{x0}, {x1}]\ny = [{y1}, {y2}]"
            )),
            _ => {}
        }
        line(format!(
            "[mesh.lines]\nleft = {{ x = {x0} }}\nright = {{ x = {x3} }}\nbottom = {{ y = {y0} }}\n\
             surface = {{ y = {y3}, x = [{x2}, {x3}] }}\nhead = {{ y = {y3}, x = [{x0}, {x1}] }}\n\
             beside = {{ x = {x1}, y = [{foot}, {y3}] }}\nbelow = {{ y = {foot}, x = [{x0}, {x1}] }}"
        ));
    }

    fn write_laws(&self, line: &mut dyn FnMut(String)) {
        let u = self.unit;
        let (law, cohesion, phi, psi, tensile) = self.soil;
        line(format!(
            "[laws.steel]\nlaw = 'elastic'\nparameters = {{ young_modulus = {:e}, poisson_ratio = 0.28 }}",
            u * if self.is_rigid { STEEL } else { SOIL }
        ));
        let strength = if law == "elastic" {
            String::new()
        } else {
            let tensile = tensile.map(|value| format!(", tensile_strength = {:e}", u * value));
            format!(
                ", cohesion = {:e}, friction_angle = {phi}, dilatancy_angle = {psi}{}",
                u * cohesion,
                tensile.unwrap_or_default()
            )
        };
        line(format!(
            "[laws.soil]\nlaw = '{law}'\nparameters = {{ young_modulus = {:e}, poisson_ratio = 0.3{strength} }}",
            u * SOIL
        ));
        if self.seam != Seam::None {
            let k = u.powf(1.0 - 0.55);
            let mepi = format!(
                "k_n = {:e}, k_t = {:e}, n = 0.55, t = {:e}, p_0 = {:e}, sigma_ni = {:e}",
                k * 86e3,
                k * 37e3,
                if matches!(self.seam, Seam::LayerBeside | Seam::LayerBelow) {
                    self.thin * self.size
                } else {
                    0.002
                },
                100.0 * u,
                100.0 * u
            );
            let parameters = match self.seam_law {
                "mepi" => {
                    format!("{mepi}, mu_0 = 0.27, mu_p = 0.7, mu_c0 = 0.46, a = 0.008, c_0 = 40.0")
                }
                "mepi_softening" => format!(
                    "{mepi}, mu_0 = 0.0, mu_p = 0.78, mu_c0 = 0.67, a = 0.00045, c_0 = 0.05, \
                     mu_r = 0.6, a_0 = 4.0, u_tp = 0.0014"
                ),
                _ => format!(
                    "normal_stiffness = {:e}, shear_stiffness = {:e}, cohesion = 0.0, \
                     friction_angle = 35.0, dilatancy_angle = 5.0",
                    2e6 * u,
                    5e5 * u
                ),
            };
            line(format!(
                "[laws.seam]\nlaw = '{}'\nparameters = {{ {parameters} }}",
                self.seam_law
            ));
        }
    }

    /// Initial pressure.
    fn pressure(&self) -> f64 {
        -self.initial * self.unit * 100.0
    }

    fn write_groups(&self, line: &mut dyn FnMut(String)) {
        let p = self.pressure();
        let initial = format!("initial_stress = {{ 11 = {p:e}, 22 = {p:e}, 33 = {p:e} }}");
        line(format!(
            "[groups.a]\nformulation = 'solid'\nlaw = 'soil'\nintegration = '{}'\n{initial}",
            self.soil_integration
        ));
        line(format!(
            "[groups.b]\nformulation = 'solid'\nlaw = 'steel'\n{initial}"
        ));
        let layer = ["full", "reduced", "mean"][self.seam_integration];
        let joint = ["full", "reduced", "nodes"][self.seam_integration];
        match self.seam {
            Seam::None => {}
            Seam::LayerBeside | Seam::LayerBelow => {
                let normal = if self.seam == Seam::LayerBeside {
                    "x"
                } else {
                    "y"
                };
                line(format!(
                    "[groups.i]\nformulation = 'thin_layer'\nlaw = 'seam'\nnormal = '{normal}'\n\
                     integration = '{layer}'\n{initial}"
                ));
            }
            Seam::JointBeside | Seam::JointBelow => {
                let along = if self.seam == Seam::JointBeside {
                    "beside"
                } else {
                    "below"
                };
                line(format!(
                    "[groups.i]\nformulation = 'zero_thickness'\nlaw = 'seam'\nline = '{along}'\n\
                     integration = '{joint}'"
                ));
            }
        }
    }

    fn write_phases(&self, line: &mut dyn FnMut(String)) {
        let p = self.pressure();
        let [sideways, right] = self.is_held;
        let fixed = if sideways { "'x', 'y'" } else { "'y'" };
        line(format!(
            "[[supports]]\nline = 'bottom'\nfixed = [{fixed}]\n[[supports]]\nline = 'left'\nfixed = ['x']"
        ));
        if right {
            line("[[supports]]\nline = 'right'\nfixed = ['x']".to_owned());
        }
        // What the initial stress stands against, from the start to the end.
        line(format!(
            "[[phase]]\nname = 'zero'\nincrements = 1\npressure = [{{ line = 'surface', value = {:e} }}]",
            -p
        ));
        for (number, (load, increments, resets)) in self.loads.iter().enumerate() {
            let what = match load {
                Load::Pressure(times) => format!(
                    "pressure = [{{ line = 'surface', value = {:e} }}]",
                    -p + times * self.unit * 100.0
                ),
                Load::Push(times) => {
                    let y = times * self.size;
                    format!("displacement = [{{ line = 'head', y = {y:e} }}]")
                }
                Load::Back => "displacement = [{ line = 'head', y = 0.0 }]".to_owned(),
            };
            line(format!(
                "[[phase]]\nname = 'p{number}'\nincrements = {increments}\n\
                 reset_displacements = {resets}\n{what}"
            ));
        }
    }

    /// Whether nothing moves so far that there has to be a warning.
    fn moves_little(&self, values: &BTreeMap<&str, f64>, place: &str) -> Result<(), String> {
        for (column, value) in values {
            let is_strain = column.starts_with("strain");
            let moves = column.ends_with("_min") || column.ends_with("_max");
            let most = if is_strain { 10.0 } else { 10.0 * self.size };
            if moves && value.abs() > most {
                return Err(format!("{place}: {column} is {value:e} without a warning"));
            }
        }
        Ok(())
    }

    /// Whether rows keep what was asked, and how the run ended.
    fn check(&self, result: &Result<Silent, Error>, folder: &Path) -> Result<End, String> {
        let end = match result {
            Ok(_) => End::Done,
            Err(error)
                if error.kind() == Kind::NoEquilibrium
                    && error.to_string().contains("no equilibrium") =>
            {
                End::Stopped
            }
            Err(error) => return Err(format!("exit {}: {error}", error.exit_code())),
        };
        let rows = table(&folder.join("history.csv"));
        let mut asked = vec![("zero".to_owned(), Load::Pressure(0.0), 1, false)];
        for (number, (load, increments, resets)) in self.loads.iter().enumerate() {
            asked.push((format!("p{number}"), *load, *increments, *resets));
        }
        let n: usize = asked.iter().map(|phase| phase.2).sum();
        if end == End::Done && rows.len() != n {
            return Err(format!("{} rows of {n}", rows.len()));
        }
        let summary = std::fs::read_to_string(folder.join("summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
        let warnings = summary["warnings"].as_array().map_or(0, Vec::len);
        // What has been given by force, over all phases so far.
        let unit = 100.0 * self.unit;
        let mut forces = unit * self.initial * self.surface();
        let (mut pressure, mut prescribed) = ([unit * self.initial; 2], [0.0; 2]);
        let mut pushed = false;
        let mut rows = rows.iter();
        for (name, load, increments, resets) in &asked {
            pressure[0] = pressure[1];
            prescribed[0] = if *resets { 0.0 } else { prescribed[1] };
            prescribed[1] = prescribed[0];
            match load {
                Load::Pressure(times) => pressure[1] = unit * (self.initial + times),
                Load::Push(times) => prescribed[1] = times * self.size,
                Load::Back => prescribed[1] = 0.0,
            }
            // The first push starts from wherever the nodes are.
            let was_pushed = pushed || *resets;
            pushed |= !matches!(load, Load::Pressure(_));
            for k in 1..=*increments {
                let Some(row) = rows.next() else {
                    return Ok(end);
                };
                let place = format!("{name} {k}");
                let values = numbers(row, &place)?;
                let part = k as f64 / *increments as f64;
                let at = |ends: [f64; 2]| ends[0] + part * (ends[1] - ends[0]);
                // In the first phase the initial stress is there, and its load comes.
                let load = if name == "zero" {
                    pressure[1]
                } else {
                    at(pressure)
                } * self.surface();
                let head = if pushed { values["head_y"] } else { 0.0 };
                let of_lines = ["head_y", "bottom_y", "bottom_x", "left_x", "right_x"];
                let most = of_lines.map(|name| values[name].abs());
                // A force counts as far as it is balanced: a balance is compared with loads, the
                // reactions before, and the smaller of what stands against each other.
                let now = most[0].min(most[1]).max(most[3].min(most[2].max(most[4])));
                forces = forces.max(load.abs()).max(now);
                let tiny = 1e-9 * unit * self.surface();
                let vertical = head + values["bottom_y"] - load;
                let bound = 1e-6 * forces + tiny;
                if vertical.abs() > bound {
                    return Err(format!(
                        "exit {end:?}, {place}: reactions {head:e} and {:e} against a load of {load:e} \
                         leave {vertical:e}",
                        values["bottom_y"]
                    ));
                }
                if !self.is_axisymmetric {
                    // Nodes that are free give nothing.
                    let sideways = values["bottom_x"] + values["right_x"] + values["left_x"];
                    if sideways.abs() > bound {
                        return Err(format!(
                            "exit {end:?}, {place}: reactions sideways leave {sideways:e} of {:e}",
                            values["left_x"]
                        ));
                    }
                }
                if pushed && (was_pushed || k == *increments) {
                    for reduce in ["head_y_min", "head_y_max"] {
                        let (found, goal) = (values[reduce], at(prescribed));
                        let bound = 1e-11 * (prescribed[0].abs() + prescribed[1].abs());
                        if (found - goal).abs() > bound {
                            return Err(format!("{place}: head at {found:e} instead of {goal:e}"));
                        }
                    }
                }
                if warnings == 0 {
                    self.moves_little(&values, &place)?;
                }
            }
        }
        Ok(end)
    }
}

fn write_probes(size: f64, line: &mut dyn FnMut(String)) {
    line("[probes]".to_owned());
    // Nodes at corners belong to two lines and count once.
    let inner = format!("y = [{:e}, {:e}]", 1e-9 * size, 2.0 * size);
    for (name, of, quantity, more) in [
        ("head_y", "head", "reaction_y", ""),
        ("bottom_y", "bottom", "reaction_y", ""),
        ("bottom_x", "bottom", "reaction_x", ""),
        ("left_x", "left", "reaction_x", inner.as_str()),
        ("right_x", "right", "reaction_x", inner.as_str()),
    ] {
        let comma = if more.is_empty() { "" } else { ", " };
        line(format!(
            "{name} = {{ line = '{of}', quantity = '{quantity}'{comma}{more} }}"
        ));
    }
    for of in ["head", "surface", "right", "beside", "below", "left"] {
        for axis in ["x", "y"] {
            for reduce in ["min", "max"] {
                line(format!(
                    "{of}_{axis}_{reduce} = {{ line = '{of}', quantity = 'displacement_{axis}', reduce = '{reduce}' }}"
                ));
            }
        }
    }
    for component in ["11", "22", "12"] {
        for reduce in ["min", "max"] {
            line(format!(
                "strain_{component}_{reduce} = {{ group = 'a', quantity = 'strain_{component}', reduce = '{reduce}' }}"
            ));
        }
    }
}

/// The numbers of a row; all of them have to be finite.
fn numbers<'r>(
    row: &'r BTreeMap<String, String>,
    place: &str,
) -> Result<BTreeMap<&'r str, f64>, String> {
    let mut values = BTreeMap::new();
    for (column, cell) in row {
        let value: f64 = match (column.as_str(), cell.as_str()) {
            ("phase", _) | (_, "") => continue,
            (_, cell) => cell.parse().map_err(|_| format!("{place}: {cell}"))?,
        };
        if !value.is_finite() {
            return Err(format!("{place}: {column} is {cell}"));
        }
        values.insert(column.as_str(), value);
    }
    Ok(values)
}

fn model(is_axisymmetric: bool) -> impl Strategy<Value = Model> {
    let origins = if is_axisymmetric {
        vec![0.0, 1.0, 5.0]
    } else {
        vec![0.0, -1.0, 5.0]
    };
    let sizes = prop::sample::select(vec![0.034, 0.1, 1.0, 4.0, 15.0]);
    let geometry = (
        prop::sample::select(origins),
        sizes,
        prop::sample::select(vec![1e-3, 1e-2, 0.05]),
        (1..3_usize, 1..4_usize, 1..5_usize, 1..5_usize),
    );
    let soil = prop_oneof![
        1 => Just(("elastic", 0.0, 0.0, 0.0, None)),
        2 => Just(("mohr_coulomb", 1.0, 36.5, 12.0, None)),
        3 => Just(("mohr_coulomb", 1.0, 36.5, 12.0, Some(0.0))),
        1 => Just(("mohr_coulomb", 10.0, 30.0, 0.0, None)),
        1 => Just(("mohr_coulomb", 40.0, 0.0, 0.0, None)),
    ];
    let soil = (
        soil,
        prop::sample::select(vec!["reduced", "full"]),
        any::<bool>(),
    );
    let seam = prop::sample::select(vec![
        Seam::None,
        Seam::LayerBeside,
        Seam::LayerBelow,
        Seam::JointBeside,
        Seam::JointBelow,
    ]);
    let laws = prop::sample::select(vec!["coulomb_joint", "mepi", "mepi_softening"]);
    let seam = (seam, laws, 0..3_usize);
    let push = (prop_oneof![Just(1.0), Just(-1.0)], -4.5..-1.3_f64);
    let load = prop_oneof![
        1 => (0.0..0.4_f64).prop_map(Load::Pressure),
        3 => push.prop_map(|(sign, power)| Load::Push(sign * 10_f64.powf(power))),
        1 => Just(Load::Back),
    ];
    let loads = prop::collection::vec((load, 1..5_usize, prop::bool::weighted(0.15)), 1..4);
    let initial = prop_oneof![8 => Just(0.0), 1 => Just(1.0), 1 => 0.05..3.0_f64];
    let units = prop::sample::select(vec![1.0, 1.0, 1e-3, 1e3]);
    let methods = prop::sample::select(vec![
        "auto",
        "auto",
        "newton",
        "modified_newton",
        "initial_stress",
        "quasi_newton",
    ]);
    let equations = prop::sample::select(vec!["auto", "sparse", "condensed"]);
    let held = prop::array::uniform2(prop::bool::weighted(0.7));
    (
        geometry,
        soil,
        seam,
        (held, initial, units, loads),
        (methods, equations, 2..6_usize),
    )
        .prop_map(move |(geometry, soil, seam, given, solver)| {
            let (origin, size, thin, (block, columns, below, beside)) = geometry;
            let (is_held, initial, unit, loads) = given;
            Model {
                is_axisymmetric,
                origin,
                size,
                thin,
                n: [block, columns, below, beside],
                soil: soil.0,
                soil_integration: soil.1,
                is_rigid: soil.2,
                seam: seam.0,
                seam_law: seam.1,
                seam_integration: seam.2,
                is_held,
                initial,
                unit,
                loads,
                method: solver.0,
                equations: solver.1,
                halvings: solver.2,
            }
        })
}

fn balanced(family: &str, is_axisymmetric: bool, seeds: (u64, u64)) {
    hold(
        family,
        seeds,
        &model(is_axisymmetric),
        Model::text,
        |model| {
            let folder = tempfile::tempdir().unwrap();
            let result = run_text(&model.text(), folder.path());
            model.check(&result, folder.path())
        },
    );
}

#[test]
fn cases_in_plane_strain_balance_or_say_why_not() {
    balanced("plane", false, (1, 100));
}

#[test]
fn cases_about_an_axis_balance_or_say_why_not() {
    balanced("axis", true, (100_001, 100));
}
