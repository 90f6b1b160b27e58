//! Probes: numbers that a case asks for after every increment.

mod section;

use crate::assembly::{Tie, fold};
use crate::case::{Case, Control, Formulation, ProbeInput, Reduce};
use crate::error::{Error, Place, Source, suggestion};
use crate::group::Group;
use crate::input::Named;
use crate::model::Model;
use section::section;
use toml::Spanned;

/// Components of stress and strain by the name they have in quantities.
const COMPONENTS: [&str; 4] = ["11", "22", "33", "12"];

/// Columns of `history.csv` beside the probes, and of `path.csv`, which only arc-length control
/// writes.
const OF_HISTORY: [&str; 4] = ["phase", "increment", "time", "iterations"];
const OF_PATH: [&str; 4] = ["phase", "increment", "load_factor", "iterations"];

/// All probes of a case, in the order of the file.
#[derive(Debug)]
pub struct Probes {
    probes: Vec<(String, Probe)>,
}

#[derive(Debug)]
enum Probe {
    /// A quantity of integration points.
    Points {
        group: usize,
        points: Vec<usize>,
        /// What each point stands for; empty where all count alike.
        weights: Vec<f64>,
        quantity: PointQuantity,
        reduce: Reduce,
        scale: f64,
    },
    /// Displacement component of nodes.
    Displacement {
        nodes: Vec<usize>,
        component: usize,
        reduce: Reduce,
        scale: f64,
    },
    /// Sum of internal forces at nodes: of all elements (the reaction), of one group, or of some of
    /// its elements.
    Force {
        nodes: Vec<usize>,
        component: usize,
        group: Option<usize>,
        elements: Option<Vec<usize>>,
        scale: f64,
    },
    /// What zero-thickness elements along a line hand on from one side to the other.
    HandedOn {
        group: usize,
        elements: Vec<usize>,
        component: usize,
        scale: f64,
    },
    /// Sum of earlier probes with factors.
    Combination(Vec<(usize, f64)>),
}

#[derive(Clone, Debug, PartialEq)]
enum PointQuantity {
    Stress(usize),
    Strain(usize),
    Jump(usize),
    Traction(usize),
    Internal(String),
}

/// What probes look at: a state of equilibrium.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a> {
    /// Groups with their committed state.
    pub groups: &'a [Group],
    /// Degrees of freedom that follow others.
    pub ties: &'a [Tie],
    /// Displacements by degree of freedom.
    pub displacement: &'a [f64],
    /// Internal less external forces by degree of freedom: reactions where displacements are
    /// prescribed.
    pub reaction: &'a [f64],
}

impl Probes {
    /// Resolves the probes of a case.
    ///
    /// # Errors
    /// [`Error::Input`] at the probe that does not fit.
    pub fn new(case: &Case, model: &Model) -> Result<Self, Error> {
        let mut probes: Vec<(String, Probe)> = Vec::new();
        for (name, input) in &case.file.probes {
            refuse_column(case, name)?;
            let resolver = Resolver {
                case,
                model,
                name,
                input: input.get_ref(),
                span: input.span(),
            };
            let probe = match &input.get_ref().combine {
                Some(combine) => resolver.combination(combine, &probes)?,
                None => resolver.measured()?,
            };
            probes.push((name.get_ref().clone(), probe));
        }
        Ok(Self { probes })
    }

    /// Names, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.probes.iter().map(|(name, _)| name.as_str())
    }

    /// What the probes look at: of every group whether they do, and the degrees of freedom of
    /// nodes whose displacements they give.
    pub fn looks_at(&self, groups: &[Group]) -> (Vec<bool>, Vec<usize>) {
        let mut looked = vec![false; groups.len()];
        let mut dofs = Vec::new();
        for (_, probe) in &self.probes {
            match probe {
                Probe::Points { group, .. }
                | Probe::HandedOn { group, .. }
                | Probe::Force {
                    group: Some(group), ..
                } => looked[*group] = true,
                Probe::Displacement {
                    nodes, component, ..
                } => dofs.extend(nodes.iter().map(|n| 2 * n + component)),
                // A reaction is that of all elements at the nodes.
                Probe::Force { nodes, .. } => {
                    for (looked, group) in looked.iter_mut().zip(groups) {
                        let kinematics = &group.kinematics;
                        let mut elements = 0..kinematics.n_elements();
                        *looked |=
                            elements.any(|e| kinematics.nodes(e).iter().any(|n| nodes.contains(n)));
                    }
                }
                Probe::Combination(_) => {}
            }
        }
        (looked, dofs)
    }

    /// Refuses values that are too large for a number.
    ///
    /// # Errors
    /// [`Error::Input`] at the first probe with one.
    pub fn check(&self, case: &Case, place: &Place, values: &[Option<f64>]) -> Result<(), Error> {
        let overflows = |value: &Option<f64>| value.is_some_and(|value| !value.is_finite());
        let Some(number) = values.iter().position(overflows) else {
            return Ok(());
        };
        let (name, _) = &self.probes[number];
        let mut inputs = case.file.probes.keys();
        let span = inputs.find(|key| key.get_ref() == name);
        let message = format!(
            "probe `{name}`: in {place} what it sums and multiplies comes to more than {:.1e}, the \
             largest number there is",
            f64::MAX
        );
        Err(case
            .source
            .error(span.map_or(0..0, Spanned::span), message)
            .hint("a smaller `scale`, or smaller factors in `combine`; rows before are written")
            .into())
    }

    /// Values, in order. `None`: the quantity does not exist now (an internal variable of another
    /// law).
    pub fn values(&self, snapshot: &Snapshot<'_>) -> Vec<Option<f64>> {
        let mut values: Vec<Option<f64>> = Vec::new();
        for (_, probe) in &self.probes {
            values.push(probe.value(snapshot, &values));
        }
        values
    }
}

/// Refuses a probe that is called as a column of the tables that it would be written to.
fn refuse_column(case: &Case, name: &Spanned<String>) -> Result<(), Error> {
    let has_path = case.file.solver.control == Control::ArcLength;
    let mut tables = vec![("history.csv", OF_HISTORY)];
    tables.extend(has_path.then_some(("path.csv", OF_PATH)));
    let taken = |(_, columns): &&(&str, [&str; 4])| columns.contains(&name.get_ref().as_str());
    let Some((table, _)) = tables.iter().find(taken) else {
        return Ok(());
    };
    let mut reserved: Vec<&str> = tables.iter().flat_map(|(_, columns)| *columns).collect();
    reserved.sort_unstable();
    reserved.dedup();
    let message = format!(
        "`{}` is a column of {table} already; taken are: {}",
        name.get_ref(),
        reserved.join(", ")
    );
    Err(case.source.error(name.span(), message).into())
}

impl Probe {
    fn value(&self, snapshot: &Snapshot<'_>, earlier: &[Option<f64>]) -> Option<f64> {
        match self {
            Self::Points {
                group,
                points,
                weights,
                quantity,
                reduce,
                scale,
            } => {
                let group = &snapshot.groups[*group];
                let values = points.iter().map(|&point| quantity.at(group, point));
                reduced(*reduce, values, weights).map(|value| scale * value)
            }
            Self::Displacement {
                nodes,
                component,
                reduce,
                scale,
            } => {
                let values = nodes
                    .iter()
                    .map(|&n| Some(snapshot.displacement[2 * n + component]));
                reduced(*reduce, values, &[]).map(|value| scale * value)
            }
            Self::Force {
                nodes,
                component,
                group,
                elements,
                scale,
            } => {
                let of_group;
                let forces = match group {
                    None => snapshot.reaction,
                    Some(group) => {
                        let n_dofs = snapshot.displacement.len();
                        let group = &snapshot.groups[*group];
                        let mut forces = match elements {
                            None => group.forces(n_dofs),
                            Some(elements) => group.forces_of(elements, n_dofs),
                        };
                        fold(snapshot.ties, &mut forces);
                        of_group = forces;
                        &of_group
                    }
                };
                Some(
                    scale
                        * nodes
                            .iter()
                            .map(|&n| forces[2 * n + component])
                            .sum::<f64>(),
                )
            }
            Self::HandedOn {
                group,
                elements,
                component,
                scale,
            } => Some(scale * snapshot.groups[*group].handed_on(elements, *component)),
            Self::Combination(terms) => terms
                .iter()
                .map(|&(i, factor)| earlier[i].map(|v| factor * v))
                .sum(),
        }
    }
}

impl PointQuantity {
    fn at(&self, group: &Group, point: usize) -> Option<f64> {
        match self {
            Self::Stress(c) => group.global_stress(point).map(|s| s[*c]),
            Self::Strain(c) => group.global_strain(point).map(|e| e[*c]),
            Self::Jump(c) => group.jump_and_traction(point).map(|(jump, _)| jump[*c]),
            Self::Traction(c) => group
                .jump_and_traction(point)
                .map(|(_, traction)| traction[*c]),
            Self::Internal(id) => group.internal_variable(point, id),
        }
    }

    /// What a point stands for: its volume; of tractions, jumps and internal variables of a layer
    /// or interface its area (in axisymmetry of the whole turn).
    fn weight(&self, group: &Group, point: usize) -> f64 {
        let weight = group.kinematics.weight(point);
        match (self, group.thickness(point)) {
            (Self::Jump(_) | Self::Traction(_) | Self::Internal(_), Some(thickness)) => {
                weight / thickness
            }
            _ => weight,
        }
    }
}

/// `None` if there is no value or one of them is missing.
fn reduced(
    reduce: Reduce,
    values: impl Iterator<Item = Option<f64>>,
    weights: &[f64],
) -> Option<f64> {
    let values: Option<Vec<f64>> = values.collect();
    let values = values.filter(|v| !v.is_empty())?;
    let sum: f64 = values.iter().sum();
    let integral = || values.iter().zip(weights).map(|(v, w)| v * w).sum::<f64>();
    Some(match reduce {
        Reduce::Average => integral() / weights.iter().sum::<f64>(),
        Reduce::Integral => integral(),
        Reduce::Sum => sum,
        Reduce::Mean => sum / values.len() as f64,
        Reduce::Min => values.iter().copied().fold(f64::INFINITY, f64::min),
        Reduce::Max => values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    })
}

struct Resolver<'a> {
    case: &'a Case,
    model: &'a Model,
    name: &'a Spanned<String>,
    input: &'a ProbeInput,
    span: std::ops::Range<usize>,
}

impl Resolver<'_> {
    fn source(&self) -> &Source {
        &self.case.source
    }

    fn wrong(&self, message: &str) -> Error {
        let message = format!("probe `{}`: {message}", self.name.get_ref());
        self.source().error(self.span.clone(), message).into()
    }

    fn combination(
        &self,
        combine: &Named<f64>,
        earlier: &[(String, Probe)],
    ) -> Result<Probe, Error> {
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
        let names: Vec<&str> = earlier.iter().map(|(name, _)| name.as_str()).collect();
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
        let groups = &self.model.groups;
        groups
            .iter()
            .position(|g| g.name == *name.get_ref())
            .ok_or_else(|| {
                let names: Vec<&str> = groups.iter().map(|g| g.name.as_str()).collect();
                self.source()
                    .error(
                        name.span(),
                        format!("there is no group `{}`", name.get_ref()),
                    )
                    .hint(suggestion(name.get_ref(), names))
                    .into()
            })
    }

    fn on_line(
        &self,
        line: &Spanned<String>,
        group: Option<&Spanned<String>>,
        quantity: &Spanned<String>,
    ) -> Result<Probe, Error> {
        let of_line = self.model.mesh.line(self.source(), line)?;
        let nodes: Vec<usize> = of_line
            .nodes
            .iter()
            .copied()
            .filter(|&n| self.inside(self.model.mesh.nodes[n]))
            .collect();
        if nodes.is_empty() {
            return Err(self.wrong("no node of the line lies inside the extent"));
        }
        let Some((what, axis)) = quantity.get_ref().rsplit_once('_') else {
            return Err(self.unknown_line_quantity(quantity));
        };
        let component = match axis {
            "x" | "r" => 0,
            "y" | "z" => 1,
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
                if self
                    .input
                    .reduce
                    .is_some_and(|reduce| reduce != Reduce::Sum)
                {
                    return Err(self.wrong("forces are summed"));
                }
                let group = group.map(|name| self.group_number(name)).transpose()?;
                let inside = group.and_then(|number| section(&self.model.mesh, of_line, number));
                let is_whole = self.input.x.is_none() && self.input.y.is_none();
                if let (Some(group), Some(part)) = (group, &inside)
                    && self.model.groups[group].formulation == Formulation::ZeroThickness
                    && is_whole
                {
                    return Ok(Probe::HandedOn {
                        group,
                        elements: part.elements.clone(),
                        component,
                        scale,
                    });
                }
                let (nodes, elements) = match inside {
                    None => (nodes, None),
                    Some(part) => {
                        let of_part = nodes.into_iter().filter(|node| part.nodes.contains(node));
                        (of_part.collect(), Some(part.elements))
                    }
                };
                Ok(Probe::Force {
                    nodes,
                    component,
                    group,
                    elements,
                    scale,
                })
            }
            ("force", None) => Err(self.wrong("`force` needs the `group` whose forces are meant")),
            (_, Some(_)) => Err(self.wrong("with a line and a group, the quantity is a `force`")),
            _ => Err(self.unknown_line_quantity(quantity)),
        }
    }

    fn unknown_line_quantity(&self, quantity: &Spanned<String>) -> Error {
        let all = [
            "displacement_x",
            "displacement_y",
            "reaction_x",
            "reaction_y",
            "force_x",
            "force_y",
        ];
        let message = format!("a line has no quantity `{}`", quantity.get_ref());
        self.source()
            .error(quantity.span(), message)
            .hint(suggestion(quantity.get_ref(), all))
            .into()
    }

    fn in_group(&self, name: &Spanned<String>, quantity: &Spanned<String>) -> Result<Probe, Error> {
        let number = self.group_number(name)?;
        let group = &self.model.groups[number];
        let is_interface = group.jump_and_traction(0).is_some();
        let has_stress = group.global_stress(0).is_some();
        let mut known: Vec<(String, PointQuantity)> = Vec::new();
        if has_stress {
            for (c, component) in COMPONENTS.iter().enumerate() {
                known.push((format!("stress_{component}"), PointQuantity::Stress(c)));
                known.push((format!("strain_{component}"), PointQuantity::Strain(c)));
            }
        }
        if is_interface {
            for (c, component) in ["n", "t"].iter().enumerate() {
                known.push((format!("jump_{component}"), PointQuantity::Jump(c)));
                known.push((format!("traction_{component}"), PointQuantity::Traction(c)));
            }
        }
        let later = self
            .model
            .swaps
            .iter()
            .flatten()
            .filter(|(g, _)| *g == number);
        for law in later.map(|(_, law)| law).chain([&group.law]) {
            for variable in &law.built.law.formulation().internal_variables {
                known.push((
                    variable.id.clone(),
                    PointQuantity::Internal(variable.id.clone()),
                ));
            }
        }
        let Some((_, point_quantity)) = known.iter().find(|(id, _)| id == quantity.get_ref())
        else {
            let names: Vec<&str> = known.iter().map(|(id, _)| id.as_str()).collect();
            let message = format!(
                "group `{}` has no quantity `{}`",
                name.get_ref(),
                quantity.get_ref()
            );
            return Err(self
                .source()
                .error(quantity.span(), message)
                .hint(suggestion(quantity.get_ref(), names))
                .into());
        };
        let points: Vec<usize> = (0..group.kinematics.n_points())
            .filter(|&point| self.counts(group, point))
            .collect();
        if points.is_empty() {
            return Err(self.wrong("no integration point lies inside the extent"));
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

    /// Whether a point lies strictly inside the extents. What is weighted counts, on their edge, if its
    /// element lies inside: points of adjoining extents then count once.
    fn counts(&self, group: &Group, point: usize) -> bool {
        let position = group.kinematics.position(point);
        if self.inside(position) {
            return true;
        }
        let is_weighted = matches!(self.input.reduce, Some(Reduce::Average | Reduce::Integral));
        let n = group.kinematics.points_per_element();
        let first = point - point % n;
        let middle = [0, 1].map(|c| {
            let of_element = (first..first + n).map(|point| group.kinematics.position(point)[c]);
            of_element.sum::<f64>() / n as f64
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
