//! Probes as files ask for them: names resolved to nodes, points and components; units.

use crate::Error;
use crate::build::{Laws, line};
use crate::case::{Case, ProbeInput};
use mechanics::Problem;
use mechanics::ground::pressure_on;
use mechanics::group::Group;
use mechanics::mesh::{Line, Mesh};
use mechanics::problem::{Analysis, Formulation};
use mechanics::settings::Control;
use mechanics::{Place, Simulation};
use results::output_request::Reduce;
use results::pressures::Pressure;
use results::probe::{PointQuantity, Probe, Probes, section};
use std::collections::HashSet;
use text::{Named, Source, Spanned, suggestion};

/// Components of stress and strain by the name they have in quantities.
const COMPONENTS: [&str; 4] = ["11", "22", "33", "12"];
/// Below this fraction of a load, the part of it in one direction is round-off.
const NOTHING: f64 = 1e-9;
/// Columns of `history.csv` next to the probes, and of `path.csv`, which only arc-length control
/// writes.
const OF_HISTORY: [&str; 4] = ["phase", "increment", "time", "iterations"];
const OF_PATH: [&str; 4] = ["phase", "increment", "load_factor", "iterations"];

/// Resolves the probes of a case.
///
/// # Errors
/// [`text::Error::Input`] at the probe that does not fit.
pub fn resolve(case: &Case, simulation: &Simulation) -> Result<Probes, Error> {
    let mut probes = Probes::default();
    for (name, input) in &case.file.probes {
        refuse_column(case, name)?;
        let resolver = Resolver {
            case,
            simulation,
            name,
            input: input.get_ref(),
            span: input.span(),
        };
        let probe = match &input.get_ref().combine {
            Some(combine) => resolver.combination(combine, &probes)?,
            None => resolver.measured()?,
        };
        probes.push(name.get_ref(), probe);
    }
    Ok(probes)
}

/// The error of a probe whose value is too large for a number.
pub fn overflow(case: &Case, probe: &str, place: &Place) -> Error {
    let mut inputs = case.file.probes.keys();
    let span = inputs.find(|key| key.get_ref() == probe);
    let message = format!(
        "probe `{probe}`: in {place} what it sums and multiplies comes to more than {:.1e}, the \
         largest number there is",
        f64::MAX
    );
    case.source
        .error(span.map_or(0..0, Spanned::span), message)
        .hint("a smaller `scale`, or smaller factors in `combine`; rows before are written")
        .into()
}

/// Refuses a probe that is called as a column of the tables that it would be written to.
fn refuse_column(case: &Case, name: &Spanned<String>) -> Result<(), Error> {
    let has_path = case.file.solver.get_ref().control == Control::ArcLength;
    let mut tables: Vec<(&str, &[&str])> = vec![("history.csv", &OF_HISTORY)];
    tables.extend(has_path.then_some::<(&str, &[&str])>(("path.csv", &OF_PATH)));
    tables.extend(
        case.file
            .pile
            .as_ref()
            .map(|_| ("history.csv", &results::pile::COLUMNS[..])),
    );
    let taken = |(_, columns): &&(&str, &[&str])| columns.contains(&name.get_ref().as_str());
    let Some((table, _)) = tables.iter().find(taken) else {
        return Ok(());
    };
    let mut reserved: Vec<&str> = tables
        .iter()
        .flat_map(|(_, columns)| *columns)
        .copied()
        .collect();
    reserved.sort_unstable();
    reserved.dedup();
    let message = format!(
        "`{}` is a column of {table} already; taken are: {}",
        name.get_ref(),
        reserved.join(", ")
    );
    Err(case.source.error(name.span(), message).into())
}

struct Resolver<'a> {
    case: &'a Case,
    simulation: &'a Simulation,
    name: &'a Spanned<String>,
    input: &'a ProbeInput,
    span: std::ops::Range<usize>,
}

impl Resolver<'_> {
    fn source(&self) -> &Source {
        &self.case.source
    }

    fn mesh(&self) -> &Mesh {
        &self.simulation.problem().mesh
    }

    fn wrong(&self, message: &str) -> Error {
        let message = format!("probe `{}`: {message}", self.name.get_ref());
        self.source().error(self.span.clone(), message).into()
    }

    fn combination(&self, combine: &Named<f64>, earlier: &Probes) -> Result<Probe, Error> {
        let ProbeInput {
            line,
            group,
            quantity,
            reduce,
            x,
            y,
            ..
        } = self.input;
        if line.is_some()
            || group.is_some()
            || quantity.is_some()
            || reduce.is_some()
            || x.is_some()
            || y.is_some()
        {
            return Err(self.wrong("`combine` stands alone (with `scale`)"));
        }
        if combine.is_empty() {
            return Err(self.wrong("`combine` is empty"));
        }
        let names: Vec<&str> = earlier.names().collect();
        let terms = combine.iter().map(|(name, factor)| {
            let product = self.input.scale * factor.get_ref();
            if !product.is_finite() {
                let message = format!(
                    "`scale` × `{}` = {:e} × {:e} is too large for a number",
                    name.get_ref(),
                    self.input.scale,
                    factor.get_ref()
                );
                return Err(self.source().error(factor.span(), message).into());
            }
            let found = names.iter().position(|n| n == name.get_ref());
            found.map(|i| (i, product)).ok_or_else(|| {
                let message = format!("there is no probe `{}` before this one", name.get_ref());
                let names = names.clone();
                self.source()
                    .error(name.span(), message)
                    .hint(suggestion(name.get_ref(), names))
                    .into()
            })
        });
        terms.collect::<Result<_, Error>>().map(Probe::Combination)
    }

    fn measured(&self) -> Result<Probe, Error> {
        let Some(quantity) = &self.input.quantity else {
            return Err(self.wrong("it needs a `quantity`, or `combine`"));
        };
        match (&self.input.line, &self.input.group) {
            (Some(line), group) => self.on_line(line, group.as_ref(), quantity),
            (None, Some(group)) => self.in_group(group, quantity),
            (None, None) => Err(self.wrong("it needs a `line` or a `group`")),
        }
    }

    fn group_number(&self, name: &Spanned<String>) -> Result<usize, Error> {
        let groups = self.simulation.groups();
        groups
            .iter()
            .position(|g| g.name == *name.get_ref())
            .ok_or_else(|| {
                let names = groups.iter().map(|g| g.name.as_str());
                self.source().unknown("group", name, names).into()
            })
    }

    /// The force of a line, or of a group there, in a direction.
    fn force(
        &self,
        line: &Line,
        nodes: Vec<usize>,
        component: usize,
        group: Option<usize>,
    ) -> Probe {
        let scale = self.input.scale;
        let inside = group.and_then(|number| section(self.mesh(), line, number));
        let is_whole = self.input.x.is_none() && self.input.y.is_none();
        if let (Some(group), Some(part)) = (group, &inside)
            && self.simulation.groups()[group].formulation == Formulation::ZeroThickness
            && is_whole
        {
            return Probe::HandedOn {
                group,
                elements: part.elements.clone(),
                component,
                scale,
            };
        }
        let (nodes, elements) = match inside {
            None => (nodes, None),
            Some(part) => {
                let of_part = nodes.into_iter().filter(|node| part.nodes.contains(node));
                (of_part.collect(), Some(part.elements))
            }
        };
        Probe::Force {
            nodes,
            component,
            group,
            elements,
            scale,
        }
    }

    fn on_line(
        &self,
        of: &Spanned<String>,
        group: Option<&Spanned<String>>,
        quantity: &Spanned<String>,
    ) -> Result<Probe, Error> {
        let of_line = line(self.mesh(), self.source(), of)?;
        let nodes = of_line.nodes.iter().copied();
        let nodes: Vec<usize> = nodes
            .filter(|&n| self.inside(self.mesh().nodes[n]))
            .collect();
        if nodes.is_empty() {
            return Err(self.wrong("no node of the line lies inside the extent"));
        }
        let (what, component) = match quantity.get_ref().rsplit_once('_') {
            Some((what, "x" | "r")) => (what, 0),
            Some((what, "y" | "z")) => (what, 1),
            _ => return Err(self.unknown_line_quantity(quantity)),
        };
        let scale = self.input.scale;
        match (what, group) {
            ("displacement", None) => {
                let reduce = self.input.reduce.unwrap_or(Reduce::Mean);
                if matches!(reduce, Reduce::Average | Reduce::Integral) {
                    return Err(self.wrong(
                        "`average` and `integral` are over the integration points of a group; \
                         over the nodes of a line there is `mean`",
                    ));
                }
                Ok(Probe::Displacement {
                    nodes,
                    component,
                    reduce,
                    scale,
                })
            }
            ("reaction", None) | ("force", Some(_)) => {
                let reduce = self.input.reduce.unwrap_or(Reduce::Sum);
                if reduce != Reduce::Sum {
                    return Err(self.wrong("forces are summed"));
                }
                let group = group.map(|name| self.group_number(name)).transpose()?;
                Ok(self.force(of_line, nodes, component, group))
            }
            ("force", None) => Err(self.wrong("`force` needs the `group` whose forces are meant")),
            (_, Some(_)) => Err(self.wrong("with a line and a group, the quantity is a `force`")),
            _ => Err(self.unknown_line_quantity(quantity)),
        }
    }

    fn unknown_line_quantity(&self, quantity: &Spanned<String>) -> Error {
        let axes = match self.simulation.problem().analysis {
            Analysis::Axisymmetric => ["r", "z"],
            Analysis::PlaneStrain => ["x", "y"],
        };
        let kinds = ["displacement", "reaction", "force"];
        let all = kinds
            .map(|kind| axes.map(|axis| format!("{kind}_{axis}")))
            .concat();
        let message = format!("a line has no quantity `{}`", quantity.get_ref());
        self.source()
            .error(quantity.span(), message)
            .hint(suggestion(
                quantity.get_ref(),
                all.iter().map(String::as_str),
            ))
            .into()
    }

    /// The quantities that points of a group have, by name.
    fn quantities(&self, number: usize) -> Vec<(String, PointQuantity)> {
        let group = &self.simulation.groups()[number];
        let has_stress = group.global_stress(0).is_some();
        let mut known: Vec<(String, PointQuantity)> = Vec::new();
        if has_stress {
            for (c, component) in COMPONENTS.iter().enumerate() {
                known.push((format!("stress_{component}"), PointQuantity::Stress(c)));
                known.push((format!("strain_{component}"), PointQuantity::Strain(c)));
            }
        }
        if group.jump_and_traction(0).is_some() {
            for (c, component) in ["n", "t"].iter().enumerate() {
                known.push((format!("jump_{component}"), PointQuantity::Jump(c)));
                known.push((format!("traction_{component}"), PointQuantity::Traction(c)));
            }
        }
        let problem = self.simulation.problem();
        let pressures = Pressure::ALL.into_iter().filter(|quantity| match quantity {
            Pressure::Pore => problem.has_pore_pressure() && (has_stress || problem.has_water()),
            Pressure::Excess | Pressure::Total(_) => problem.has_pore_pressure() && has_stress,
        });
        known.extend(pressures.map(|q| (q.name().to_owned(), PointQuantity::Pressure(q))));
        let later = self.simulation.swaps().iter().flatten();
        let later = later.filter(|(group, _)| *group == number);
        for law in later.map(|(_, law)| law).chain([&group.law]) {
            for variable in &law.built.law.formulation().internal_variables {
                let id = &variable.id;
                known.push((id.clone(), PointQuantity::Internal(id.clone())));
            }
        }
        known
    }

    fn in_group(&self, name: &Spanned<String>, quantity: &Spanned<String>) -> Result<Probe, Error> {
        let number = self.group_number(name)?;
        let group = &self.simulation.groups()[number];
        let problem = self.simulation.problem();
        let known = self.quantities(number);
        let Some((_, point_quantity)) = known.iter().find(|(id, _)| id == quantity.get_ref())
        else {
            let names: Vec<&str> = known.iter().map(|(id, _)| id.as_str()).collect();
            let [name, asked] = [name, quantity].map(Spanned::get_ref);
            let message = format!("group `{name}` has no quantity `{asked}`");
            let is_dry = !problem.has_pore_pressure();
            let hint = match Pressure::named(asked) {
                Some(_) if is_dry => {
                    "there is no water in the case: no `[water]`, no `drainage = \"undrained\"`"
                        .into()
                }
                _ => suggestion(asked, names),
            };
            let error = self.source().error(quantity.span(), message);
            return Err(error.hint(hint).into());
        };
        let points: Vec<usize> = (0..group.kinematics.n_points())
            .filter(|&point| self.counts(group, point))
            .collect();
        if points.is_empty() {
            let mut extents = [self.input.x, self.input.y].into_iter().flatten();
            let turned = extents.find(|[from, to]| from >= to);
            return Err(turned.map_or_else(
                || self.wrong("no integration point lies inside the extent"),
                |[from, to]| {
                    let why = format!("its extent is [{from}, {to}], expected [smaller, larger]");
                    self.wrong(&why)
                },
            ));
        }
        let reduce = self.input.reduce.unwrap_or(Reduce::Mean);
        let weights = if matches!(reduce, Reduce::Average | Reduce::Integral) {
            points
                .iter()
                .map(|&point| point_quantity.weight(group, point))
                .collect()
        } else {
            Vec::new()
        };
        if reduce == Reduce::Average && weights.iter().sum::<f64>() <= 0.0 {
            return Err(self.wrong("its points stand for no area: they lie on the axis"));
        }
        Ok(Probe::Points {
            group: number,
            points,
            weights,
            quantity: point_quantity.clone(),
            reduce,
            scale: self.input.scale,
        })
    }

    /// Whether a point lies strictly inside the extents. Weighted points on their edge count if the
    /// element lies inside: a point between adjoining extents then counts once.
    fn counts(&self, group: &Group, point: usize) -> bool {
        let position = group.kinematics.position(point);
        if self.inside(position) {
            return true;
        }
        let is_weighted = matches!(self.input.reduce, Some(Reduce::Average | Reduce::Integral));
        let points = group
            .kinematics
            .points_of(group.kinematics.place_of(point).0);
        let middle = [0, 1].map(|c| {
            let of_element = points
                .clone()
                .map(|point| group.kinematics.position(point)[c]);
            of_element.sum::<f64>() / points.len() as f64
        });
        is_weighted && self.touches(position) && self.inside(middle)
    }

    /// Whether a place lies inside the extents or on their edge.
    fn touches(&self, position: [f64; 2]) -> bool {
        [self.input.x, self.input.y]
            .iter()
            .zip(position)
            .all(|(extent, at)| {
                extent.is_none_or(|[from, to]| {
                    let close = 1e-9 * (to - from);
                    at >= from - close && at <= to + close
                })
            })
    }

    fn inside(&self, position: [f64; 2]) -> bool {
        [self.input.x, self.input.y]
            .iter()
            .zip(position)
            .all(|(extent, at)| extent.is_none_or(|[from, to]| at > from && at < to))
    }
}

/// Probes of the reaction of a line that is also under pressure: the reaction is what the support
/// adds to it.
pub(crate) fn reactions(case: &Case, problem: &Problem) -> Vec<String> {
    let mesh = &problem.mesh;
    let edges = |line: &str| mesh.lines.get(line).map_or(&[][..], |line| &line.edges);
    // Sides of an interface lie on each other.
    let middle = |&edge: &(usize, usize)| mesh.nodes[mesh.edge(edge)[2]].map(f64::to_bits);
    let unit = case.file.analysis.force_unit();
    let mut warnings = Vec::new();
    for (name, probe) in &case.file.probes {
        let probe = probe.get_ref();
        let (Some(line), Some(quantity)) = (&probe.line, &probe.quantity) else {
            continue;
        };
        let component = match quantity.get_ref().strip_prefix("reaction_") {
            Some("x" | "r") => 0,
            Some("y" | "z") => 1,
            _ => continue,
        };
        let read: HashSet<[u64; 2]> = edges(line.get_ref()).iter().map(middle).collect();
        // The largest share of a pressure, with its phase and line.
        let mut largest: Option<(f64, &str, &str)> = None;
        for phase in &problem.phases {
            for pressure in &phase.pressure {
                let under = pressure.line.as_str();
                let shared = edges(under)
                    .iter()
                    .filter(|edge| read.contains(&middle(edge)));
                let shared: Vec<(usize, usize)> = shared.copied().collect();
                let force = pressure_on(problem.analysis, mesh, &shared, &pressure.value);
                let size: f64 = force.iter().map(|f| f.abs()).sum();
                let share: f64 = force.iter().skip(component).step_by(2).sum();
                let is_more = largest.is_none_or(|(other, _, _)| share.abs() > other.abs());
                if share.abs() > NOTHING * size && is_more {
                    largest = Some((share, &phase.name, under));
                }
            }
        }
        if let Some((share, phase, under)) = largest {
            let force = quantity.get_ref().replacen("reaction", "force", 1);
            warnings.push(format!(
                "probe `{}`: `{}` of line `{}` is what its support adds to the pressure on line \
                 `{under}`: {share:.6e} {unit} of pressure (phase `{phase}`) are not in it. `{force}` with \
                 a `group`, of all groups at the line together, is the whole",
                name.get_ref(),
                quantity.get_ref(),
                line.get_ref(),
            ));
        }
    }
    warnings
}

/// Units of the probes, where factors leave no doubt.
pub(crate) fn units(case: &Case, laws: &Laws) -> Vec<(String, Option<String>)> {
    let mut units: Vec<(String, Option<String>)> = Vec::new();
    for (name, input) in &case.file.probes {
        let input = input.get_ref();
        let unit = match &input.combine {
            None => measured_unit(case, laws, input),
            Some(terms) => {
                let of = |name: &Spanned<String>| {
                    let (_, unit) = units.iter().find(|(known, _)| known == name.get_ref())?;
                    unit.as_deref()
                };
                let first = terms.keys().next().and_then(of);
                let alike = terms
                    .iter()
                    .all(|(name, factor)| of(name) == first && is(factor.get_ref().abs(), 1.0));
                first.filter(|_| alike).map(str::to_owned)
            }
        };
        let unit = unit.and_then(|unit| scaled_unit(unit, input.scale.abs()));
        units.push((name.get_ref().clone(), unit));
    }
    units
}

fn measured_unit(case: &Case, laws: &Laws, input: &ProbeInput) -> Option<String> {
    let quantity = input.quantity.as_ref()?.get_ref().as_str();
    let kind = quantity.split('_').next().unwrap_or_default();
    let of_points = input.line.is_none();
    if of_points && input.reduce == Some(Reduce::Integral) {
        // Over an interface's area a traction is a force.
        return (kind == "traction").then(|| case.file.analysis.force_unit().to_owned());
    }
    if of_points && input.reduce == Some(Reduce::Sum) {
        return None;
    }
    let mut variables = laws
        .values()
        .flat_map(|built| &built.law.formulation().internal_variables);
    let variable = variables.find(|variable| of_points && variable.id == quantity);
    let unit = match (kind, variable) {
        (_, Some(variable)) => &variable.unit,
        _ if of_points && Pressure::named(quantity).is_some() => "kPa",
        ("stress" | "traction", None) => "kPa",
        ("strain", None) => "-",
        ("jump" | "displacement", None) => "m",
        ("reaction" | "force", None) => case.file.analysis.force_unit(),
        _ => return None,
    };
    Some(unit.to_owned())
}

/// The unit of a quantity times a factor.
fn scaled_unit(unit: String, factor: f64) -> Option<String> {
    if is(factor, 1.0) {
        return Some(unit);
    }
    let scaled = [
        ("m", 1e3, "mm"),
        ("m", 1e2, "cm"),
        ("kPa", 1e-3, "MPa"),
        ("kPa", 1e3, "Pa"),
        ("kN", 1e-3, "MN"),
        ("kN", 1e3, "N"),
        ("-", 1e2, "%"),
    ];
    scaled
        .iter()
        .find(|(of, by, _)| *of == unit && is(factor, *by))
        .map(|(_, _, scaled)| (*scaled).to_owned())
}

/// Equal but for rounding.
fn is(value: f64, expected: f64) -> bool {
    (value - expected).abs() <= 1e-12 * expected
}
