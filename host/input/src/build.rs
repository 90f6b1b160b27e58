//! From a case file to a problem in memory and the results that are wanted of it.

mod consolidation;
mod followed;
mod law_shelf;
mod phases;
mod places;
mod unused_laws;

use self::law_shelf::LawShelf;
use self::phases::phase;
use self::unused_laws::Look;
use crate::case::{Case, CaseFile, GroupInput, LawInput};
use crate::expression::Expression;
use crate::ground::{LevelInput, StressInput, level};
use crate::material::LawTables;
use crate::mesh::{self, Built, MeshFile};
use crate::spanned::Given;
use crate::{Error, figures, ineffective_options, pile, probes};
use indexmap::IndexMap;
use law::{BuiltLaw, Pins, SearchPath, hexadecimal_sha256};
use mechanics::Simulation;
use mechanics::check::{Cause, Item};
use mechanics::mesh::{Line, Mesh, Solid};
use mechanics::problem::{ElementGroup, Ground, Material, Phase, Problem, Support, Water};
use mechanics::settings::Control;
use mechanics::simulation::Warning;
use results::{About, OutputRequest};
use std::cell::RefCell;
use std::sync::Arc;
use text::{Source, Spanned};

/// Water stands above the ground where it is higher by this part of the ground's height.
const ABOVE: f64 = 1e-9;

/// Laws by name and hypothesis.
pub type Laws = IndexMap<(String, &'static str), Arc<BuiltLaw>>;

/// A problem that was read from a case file.
#[derive(Clone, Debug)]
pub struct Posed {
    /// The problem.
    pub problem: Problem,
    /// All laws used.
    pub laws: Laws,
    /// The file of its mesh, if it has one.
    pub mesh_file: Option<MeshFile>,
    /// What the user should know of how the problem was read.
    pub notes: Vec<String>,
}

/// The line of this name.
///
/// # Errors
/// [`text::Error::Input`] with the names there are.
pub(crate) fn line<'m>(
    mesh: &'m Mesh,
    source: &Source,
    name: &Spanned<String>,
) -> Result<&'m Line, Error> {
    mesh.lines.get(name.get_ref()).ok_or_else(|| {
        let names = mesh.lines.keys().map(String::as_str);
        source.unknown("line", name, names).into()
    })
}

impl Case {
    /// The problem that the file poses: its mesh, its laws with their parameters, its phases.
    ///
    /// # Errors
    /// [`text::Error::Input`] at the place that does not fit; [`law::Error::Library`].
    pub fn pose(&self) -> Result<Posed, Error> {
        self.posed(Look::Known)
    }

    /// As [`Self::pose`]; laws that nothing takes are opened and built, too, for what would be refused of them.
    ///
    /// # Errors
    /// As [`Self::pose`].
    pub fn pose_closely(&self) -> Result<Posed, Error> {
        self.posed(Look::Close)
    }

    fn posed(&self, look: Look) -> Result<Posed, Error> {
        let Self { source, file, .. } = self;
        let Built {
            mesh,
            file: mesh_file,
        } = mesh::build(source, file)?;
        let water = file.water.as_ref();
        let water = water
            .map(|water| water.get_ref().read(source))
            .transpose()?;
        let mut shelf = self.shelf(&mesh, water.as_ref())?;
        refuse_unknown_groups(source, file)?;
        refuse_mesh_without_accuracy(source, file)?;
        let phases = file.phases.iter().map(|input| phase(source, file, input));
        let mut phases = phases.collect::<Result<Vec<Phase>, Error>>()?;
        let mut groups = Vec::new();
        for (number, (name, group)) in file.groups.iter().enumerate() {
            let input = group.get_ref();
            let material = materials(&mut shelf, (number, name, input), &mut phases)?;
            let ground = shelf.ground[number].clone();
            groups.push(element_group(name, input, ground, material));
        }
        let spare = shelf.spare(look, self.stands_alone())?;
        let water_levels = water_levels(source, file, &mesh, &phases)?;
        let supports = file.supports.iter().map(|support| Support {
            line: support.line.get_ref().clone(),
            fixed: support.fixed.iter().map(|&axis| axis.into()).collect(),
        });
        let laws = shelf.laws;
        Ok(Posed {
            problem: Problem {
                analysis: file.analysis,
                mesh,
                groups,
                water,
                supports: supports.collect(),
                phases,
                settings: *file.solver.get_ref(),
            },
            laws,
            notes: mesh_file
                .iter()
                .flat_map(|file| file.notes.clone())
                .chain(water_levels)
                .chain(self.unused_laws())
                .chain(spare)
                .collect(),
            mesh_file,
        })
    }

    /// The laws that groups take, none of them opened yet.
    fn shelf<'a>(
        &'a self,
        mesh: &'a Mesh,
        water: Option<&'a Water>,
    ) -> Result<LawShelf<'a>, Error> {
        let Self { source, file, .. } = self;
        let pins = file.laws.values().map(Spanned::get_ref);
        let pins = Pins::of(source, pins.map(|law| (&law.law, law.sha256.as_ref())))?;
        let groups = file.groups.values();
        let ground = groups.map(|group| ground(source, group.get_ref()));
        Ok(LawShelf {
            source,
            file,
            search: SearchPath::of(&self.opener, &self.law_folders()?).pinned(pins),
            laws: IndexMap::new(),
            mesh,
            water,
            ground: ground.collect::<Result<_, Error>>()?,
            opened: RefCell::default(),
            grounds: RefCell::default(),
        })
    }

    /// Laws that no group takes, where the file stands alone: those of a base, or of a file with variants,
    /// may be for others.
    fn unused_laws(&self) -> Option<String> {
        let file = &self.file;
        if !self.stands_alone() {
            return None;
        }
        let own = file
            .groups
            .values()
            .map(|group| group.get_ref().law.get_ref());
        let later = file.phases.iter().flat_map(|phase| phase.laws.values());
        let mut used: Vec<&str> = own.map(String::as_str).collect();
        used.extend(later.map(|law| law.get_ref().as_str()));
        let others = referred(file);
        used.extend(others.iter().map(String::as_str));
        let tables = LawTables {
            source: &self.source,
            tables: &file.laws,
        };
        let unused = file
            .laws
            .iter()
            .filter(|(_, entry)| !tables.is_filler(entry.get_ref()))
            .map(|(name, _)| name.get_ref())
            .filter(|name| !used.contains(&name.as_str()));
        let names: Vec<String> = unused.map(|name| format!("`{name}`")).collect();
        (!names.is_empty())
            .then(|| format!("no group takes the laws {} of [laws]", names.join(", ")))
    }

    fn stands_alone(&self) -> bool {
        self.variant.is_none() && self.source.files().count() == 1
    }

    /// The results that the file asks for, of its simulation.
    ///
    /// # Errors
    /// [`text::Error::Input`] at the probe or figure that does not fit.
    pub fn wanted(&self, simulation: &Simulation) -> Result<OutputRequest, Error> {
        let probes = probes::resolve(self, simulation)?;
        let mut wanted = OutputRequest {
            output: self.file.output,
            probes,
            pile: pile::resolve(self, simulation)?,
            title: self.file.title.clone(),
            figures: Vec::new(),
            follows_path: self.file.solver.get_ref().control == Control::ArcLength,
        };
        let columns: Vec<&str> = wanted.columns().collect();
        for until in self
            .file
            .phases
            .iter()
            .filter_map(|phase| phase.until.as_ref())
        {
            let quantity = &until.get_ref().quantity;
            if !columns.contains(&quantity.get_ref().as_str()) {
                let known = columns.iter().copied();
                let error = self
                    .source
                    .unknown("probe or column of a pile", quantity, known);
                return Err(error.into());
            }
        }
        wanted.figures = figures::case_figures(self, &columns)?;
        Ok(wanted)
    }

    /// What the record of a run says of the case.
    pub fn about(&self, laws: &Laws, mesh_file: Option<&MeshFile>) -> About {
        let Self { source, file, .. } = self;
        let files = source.files().map(|range| {
            let path = source.path_at(&range).display().to_string();
            (path, source.text()[range].to_owned())
        });
        let settings = source.settings();
        let settings = settings.map(|range| source.text()[range].to_owned());
        let laws_of = |(name, group): (&Spanned<String>, &Spanned<GroupInput>)| {
            let from_phase = file.phases.iter().filter_map(|phase| {
                let (_, law) = phase.laws.iter().find(|(key, _)| *key == name)?;
                Some((phase.name.get_ref().clone(), law.get_ref().clone()))
            });
            (group.get_ref().law.get_ref().clone(), from_phase.collect())
        };
        About {
            case: self.name(),
            variant: self.variant.clone(),
            title: file.title.clone(),
            sha256: hexadecimal_sha256(source.text_of_files().as_bytes()),
            files: files.collect(),
            settings: settings.collect(),
            mesh_file: mesh_file.map(|file| (file.path.clone(), file.sha256.clone())),
            laws_of_groups: file.groups.iter().map(laws_of).collect(),
            laws: laws.clone(),
            expressions: self.expressions(),
            probe_units: probes::units(self, laws),
            chosen: file.chosen.as_ref().map(|chosen| serde_json::json!(chosen)),
        }
    }

    /// Parameters that follow from others: name of the law, parameter, expression.
    fn expressions(&self) -> Vec<[String; 3]> {
        let tables = LawTables {
            source: &self.source,
            tables: &self.file.laws,
        };
        let of_law = |(name, entry): (&Spanned<String>, &Spanned<LawInput>)| {
            let all = tables.parameters(entry.get_ref());
            let expressions = all.iter().filter_map(|(id, value)| {
                let text = value.get_ref().expression()?;
                Some([
                    name.get_ref().clone(),
                    id.get_ref().clone(),
                    format!("={text}"),
                ])
            });
            expressions.collect::<Vec<_>>()
        };
        self.file.laws.iter().flat_map(of_law).collect()
    }

    /// Warnings about implausible input of the case, besides those of its problem.
    pub fn warnings(&self, simulation: &Simulation) -> Vec<String> {
        let mut warnings = probes::reactions(self, simulation.problem());
        warnings.extend(self.forgetful_swaps(simulation.problem()));
        warnings.extend(self.timeless_phases(simulation.problem()));
        warnings.extend(ineffective_options::choices(self));
        warnings
    }

    /// Phases that say no time while a law that depends on it is called.
    fn timeless_phases(&self, problem: &Problem) -> Vec<String> {
        let groups = &problem.groups;
        let mut active = problem.active_after(0);
        let mut materials: Vec<_> = groups.iter().map(|group| &group.material).collect();
        let mut warnings = Vec::new();
        for (phase, written) in problem.phases.iter().zip(&self.file.phases) {
            phase.switch(&mut active);
            for (group, material) in &phase.materials {
                materials[*group] = material;
            }
            let called = materials.iter().zip(&active).filter(|(_, active)| **active);
            let mut dependent = called.filter_map(|(material, _)| {
                Some((material, material.built.law.time_dependence()?))
            });
            if phase.time.is_none()
                && let Some((material, by)) = dependent.next()
            {
                let warning = Warning::NoTime {
                    phase: phase.name.clone(),
                    law: material.name.clone(),
                    by,
                };
                let place = self.source.place(&written.name.span());
                warnings.push(format!("{place}: {warning}"));
            }
        }
        warnings
    }

    /// Swaps to a law of the same id that cannot go on from the internal variables it finds.
    fn forgetful_swaps(&self, problem: &Problem) -> Vec<String> {
        let mut warnings = Vec::new();
        for (number, group) in problem.groups.iter().enumerate() {
            let mut before = &group.material;
            for (phase, input) in problem.phases.iter().enumerate() {
                let own = input.materials.iter().find(|(of, _)| *of == number);
                let Some((_, material)) = own else { continue };
                let why = material.built.law.cannot_go_on_from(&before.built.law);
                // The laws of the first phase are those that the groups start with.
                if let Some(why) = why.filter(|_| phase > 0) {
                    let item = Item::LawOf {
                        group: number,
                        phase: Some(phase),
                    };
                    let at = self.span(&item, &Cause::NoPhase);
                    warnings.push(format!(
                        "{}: phase `{}`: law `{}` of group `{}` has the id of law `{}`, `{}`, and starts \
                         anew from the stress it finds: {why}",
                        self.source.place(&at),
                        input.name,
                        material.name,
                        group.name,
                        before.name,
                        before.built.law.description().id,
                    ));
                }
                before = material;
            }
        }
        warnings
    }
}

/// Reads the state of a group as ground before the first phase.
fn ground(source: &Source, input: &GroupInput) -> Result<Ground, Error> {
    let stress = input.initial_stress.as_ref();
    let read = |stress: &Spanned<StressInput>| stress.get_ref().read(source, stress.span());
    let dry = input.unit_weight.value().unwrap_or(0.0);
    Ok(Ground {
        initial_stress: stress.map(read).transpose()?,
        unit_weight: [dry, input.saturated_unit_weight.value().unwrap_or(dry)],
        pore_water: input.pore_water.unwrap_or(true),
        is_active: input.active.unwrap_or(true),
    })
}

fn element_group(
    name: &Spanned<String>,
    input: &GroupInput,
    ground: Ground,
    material: Material,
) -> ElementGroup {
    ElementGroup {
        name: name.get_ref().clone(),
        formulation: input.formulation,
        material,
        integration: input.integration.value(),
        normal: input.normal.value().map(Into::into),
        in_plane: input.in_plane.value(),
        initial_stress: ground.initial_stress,
        unit_weight: ground.unit_weight[0],
        saturated_unit_weight: input.saturated_unit_weight.value(),
        pore_water: ground.pore_water,
        is_active: ground.is_active,
        drainage: input.drainage.value().unwrap_or_default(),
        undrained_poisson_ratio: input.undrained_poisson_ratio.value().unwrap_or(0.495),
    }
}

/// Names of laws that expressions take values from.
fn referred(file: &CaseFile) -> Vec<String> {
    let laws = file.laws.values().map(Spanned::get_ref);
    let values = laws.flat_map(|law| law.parameters.values());
    let texts = values.filter_map(|value| value.get_ref().expression());
    let expressions = texts.filter_map(|text| Expression::parse(text).ok());
    let names = expressions.flat_map(|expression| {
        let references = expression.references().into_iter();
        references.map(|of| of.law().to_owned()).collect::<Vec<_>>()
    });
    names.collect()
}

/// Refuses the error of the mesh as a part of nothing.
fn refuse_mesh_without_accuracy(source: &Source, file: &CaseFile) -> Result<(), Error> {
    match &file.accuracy_with_mesh {
        Some(with) if file.accuracy.is_none() && *with.get_ref() => {
            let message = "`accuracy_with_mesh` counts the error of the mesh as part of `accuracy`, and there is none";
            let hint = "say how large the error may be, `accuracy = 0.02`";
            Err(source.error(with.span(), message).hint(hint).into())
        }
        _ => Ok(()),
    }
}

/// Groups that phases name must be there.
fn refuse_unknown_groups(source: &Source, file: &CaseFile) -> Result<(), Error> {
    let names = || file.groups.keys().map(|key| key.get_ref().as_str());
    let named = file.phases.iter().flat_map(|phase| {
        let lists = phase.activate.iter().chain(&phase.deactivate);
        let tables = phase.laws.keys().chain(phase.unit_weight.keys());
        let tables = tables.chain(phase.drainage.keys());
        lists.chain(tables).chain(phase.strain.keys())
    });
    for group in named {
        if !names().any(|name| name == group.get_ref()) {
            return Err(source.unknown("group", group, names()).into());
        }
    }
    Ok(())
}

/// The material that a group begins with. Those that phases swap in go into the phases.
fn materials(
    shelf: &mut LawShelf<'_>,
    (number, name, input): (usize, &Spanned<String>, &GroupInput),
    phases: &mut [Phase],
) -> Result<Material, Error> {
    shelf.entry(input.law.get_ref(), input.law.span())?;
    // A law that the first phase replaces is never used, and not loaded.
    let mut own = None;
    for (phase, into) in shelf.file.phases.iter().zip(phases) {
        let mut laws = phase.laws.iter();
        let swap = laws.find(|(key, _)| key.get_ref() == name.get_ref());
        if let Some((_, law)) = swap {
            let material = shelf.material(number, name, input, law)?;
            own.get_or_insert_with(|| material.clone());
            into.materials.push((number, material));
        } else if own.is_none() {
            own = Some(shelf.material(number, name, input, &input.law)?);
        }
    }
    match own {
        Some(material) => Ok(material),
        None => shelf.material(number, name, input, &input.law),
    }
}

/// A water table below the mesh, or above the ground.
fn water_level(
    source: &Source,
    written: &Spanned<LevelInput>,
    mesh: &Mesh,
    is_ground: impl Fn(usize) -> bool,
    is_cover: impl Fn(usize) -> bool,
) -> Result<Option<String>, Error> {
    let level = level(source, written)?;
    let highest = level.values().fold(f64::NEG_INFINITY, f64::max);
    let (mut lowest, mut top) = (f64::INFINITY, f64::NEG_INFINITY);
    for solid in &mesh.solids {
        let is_ground = is_ground(solid.group);
        for &node in solid.nodes() {
            let at = mesh.nodes[node][1];
            lowest = lowest.min(at);
            top = if is_ground { top.max(at) } else { top };
        }
    }
    let close = ABOVE * (top - lowest);
    // A body without pores keeps the water off what it covers.
    let is_covered = |x: f64| {
        let covers = |solid: &Solid| {
            let nodes = solid.nodes().iter().map(|&node| mesh.nodes[node]);
            let ends = nodes.fold(
                [f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY],
                |e, at| [e[0].min(at[0]), e[1].max(at[0]), e[2].max(at[1])],
            );
            ends[0] <= x && x <= ends[1] && ends[2] >= level.at(x) - close
        };
        let mut cover = mesh.solids.iter().filter(|solid| is_cover(solid.group));
        cover.any(covers)
    };
    let own = mesh.solids.iter().filter(|solid| is_ground(solid.group));
    let is_free = || {
        let mut nodes = own.flat_map(Solid::nodes).map(|&node| mesh.nodes[node]);
        nodes.any(|[x, y]| y >= top - close && !is_covered(x))
    };
    let place = source.place(&written.span());
    Ok(if highest < lowest {
        Some(format!(
            "{place}: the water table, {highest} m at its highest, lies below the lowest point of the mesh at {lowest} m: \
             the ground is dry"
        ))
    } else if top.is_finite() && highest > top + close && is_free() {
        Some(format!(
            "{place}: the water table, {highest} m at its highest, lies above the highest ground at {top} m: free water \
             loads its surface"
        ))
    } else {
        None
    })
}

/// Water tables below the mesh, and above the ground.
fn water_levels(
    source: &Source,
    file: &CaseFile,
    mesh: &Mesh,
    phases: &[Phase],
) -> Result<Vec<String>, Error> {
    let groups = || file.groups.values().map(Spanned::get_ref);
    let mut active: Vec<bool> = groups().map(|group| group.active.unwrap_or(true)).collect();
    let is_wet: Vec<bool> = groups()
        .map(|group| group.pore_water.unwrap_or(true))
        .collect();
    let first = phases.first();
    let mut notes = Vec::new();
    let mut note = |written: &Spanned<LevelInput>, active: &[bool]| -> Result<(), Error> {
        let is_ground = |group: usize| active[group] && is_wet[group];
        let is_cover = |group: usize| active[group] && !is_wet[group];
        notes.extend(water_level(source, written, mesh, is_ground, is_cover)?);
        Ok(())
    };
    if let Some(water) = &file.water {
        // What the first phase changes is there from its start on.
        let mut active = active.clone();
        if let Some(phase) = first {
            phase.activate.iter().for_each(|&of| active[of] = true);
        }
        note(&water.get_ref().level, &active)?;
    }
    for (input, phase) in file.phases.iter().zip(phases) {
        phase.switch(&mut active);
        if let Some(water) = &input.water {
            note(&water.get_ref().level, &active)?;
        }
    }
    Ok(notes)
}
