//! From a case file to a problem in memory and the results that are wanted of it; and back: which place
//! of the file an error of the problem is about.

mod unused_laws;

use self::unused_laws::Look;
use crate::case::{Case, CaseFile, GroupInput, LawInput, PhaseInput};
use crate::ground::{LevelInput, ProfileInput, level};
use crate::material::{
    LawTables, ParameterValue, ZONE, is_solid_at_interface, place_failure, try_law,
};
use crate::mesh::{self, Built, MeshFile};
use crate::{Error, figures, ineffective_options, pile, probes};
use abi::Hypothesis;
use abi::status::Outcome;
use indexmap::IndexMap;
use law::{BuildCause, BuiltLaw, LoadedLaw, Pins, SearchPath, hexadecimal_sha256};
use mechanics::group::PointFailure;
use mechanics::mesh::{Line, Mesh};
use mechanics::problem::Profile;
use mechanics::problem::{
    Axis, Cause, Displacement, ElementGroup, Force, Formulation, Free, Item, Key, Material, Phase,
    Pressure, Problem, Refusal, Support,
};
use mechanics::settings::Control;
use mechanics::simulation::Warning;
use mechanics::{Simulation, model};
use results::{About, OutputRequest};
use std::ops::Range;
use std::sync::Arc;
use text::{Source, suggestion};
use toml::Spanned;

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
        let names: Vec<&str> = mesh.lines.keys().map(String::as_str).collect();
        let message = format!("there is no line `{}`", name.get_ref());
        let error = source.error(name.span(), message);
        error.hint(suggestion(name.get_ref(), names)).into()
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
        let pins = file.laws.values().map(Spanned::get_ref);
        let pins = Pins::of(source, pins.map(|law| (&law.law, law.sha256.as_ref())))?;
        let search = SearchPath::of(&self.opener, &self.law_folders()?).pinned(pins);
        let mut shelf = LawShelf {
            source,
            file,
            search,
            laws: IndexMap::new(),
        };
        refuse_unknown_groups(source, file)?;
        refuse_mesh_without_accuracy(source, file)?;
        let phases = file.phases.iter().map(|input| phase(source, file, input));
        let mut phases = phases.collect::<Result<Vec<Phase>, Error>>()?;
        let mut groups = Vec::new();
        for (number, (name, group)) in file.groups.iter().enumerate() {
            let input = group.get_ref();
            shelf.entry(&input.law)?;
            // A law that the first phase replaces is never used, and not loaded.
            let mut own = None;
            for (phase, into) in file.phases.iter().zip(&mut phases) {
                let mut laws = phase.laws.iter();
                let swap = laws.find(|(key, _)| key.get_ref() == name.get_ref());
                if let Some((_, law)) = swap {
                    let material = shelf.material(name, input, law)?;
                    own.get_or_insert_with(|| material.clone());
                    into.materials.push((number, material));
                } else if own.is_none() {
                    own = Some(shelf.material(name, input, &input.law)?);
                }
            }
            let material = match own {
                Some(material) => material,
                None => shelf.material(name, input, &input.law)?,
            };
            groups.push(ElementGroup {
                name: name.get_ref().clone(),
                formulation: input.formulation,
                material,
                integration: input.integration.as_ref().map(|i| *i.get_ref()),
                normal: input.normal.as_ref().map(|n| (*n.get_ref()).into()),
                in_plane: input.in_plane.as_ref().map(|i| *i.get_ref()),
                initial_stress: match &input.initial_stress {
                    Some(stress) => Some(stress.get_ref().read(source, stress.span())?),
                    None => None,
                },
                unit_weight: input
                    .unit_weight
                    .as_ref()
                    .map_or(0.0, |weight| *weight.get_ref()),
                saturated_unit_weight: input.saturated_unit_weight.as_ref().map(|w| *w.get_ref()),
                pore_water: input.pore_water.unwrap_or(true),
                is_active: input.active.unwrap_or(true),
                drainage: input
                    .drainage
                    .as_ref()
                    .map_or_else(Default::default, |d| *d.get_ref()),
                undrained_poisson_ratio: input
                    .undrained_poisson_ratio
                    .as_ref()
                    .map_or(0.495, |ratio| *ratio.get_ref()),
            });
        }
        let spare = shelf.spare(look, self.stands_alone())?;
        let water_levels = water_levels(source, file, &mesh, &phases)?;
        let supports = file.supports.iter().map(|support| Support {
            line: support.line.get_ref().clone(),
            fixed: support.fixed.iter().map(|&axis| axis.into()).collect(),
        });
        Ok(Posed {
            problem: Problem {
                analysis: file.analysis,
                mesh,
                groups,
                water: file
                    .water
                    .as_ref()
                    .map(|water| water.get_ref().read(source))
                    .transpose()?,
                supports: supports.collect(),
                phases,
                settings: *file.solver.get_ref(),
            },
            laws: shelf.laws,
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
        let used: Vec<&String> = own.chain(later.map(Spanned::get_ref)).collect();
        let tables = LawTables {
            source: &self.source,
            tables: &file.laws,
        };
        let unused = file
            .laws
            .iter()
            .filter(|(_, entry)| !tables.is_filler(entry.get_ref()))
            .map(|(name, _)| name.get_ref())
            .filter(|name| !used.contains(name));
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
            probe_units: probes::units(self, laws),
            chosen: file.chosen.as_ref().map(|chosen| serde_json::json!(chosen)),
        }
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
        let mut active: Vec<bool> = groups.iter().map(|group| group.is_active).collect();
        let mut materials: Vec<_> = groups.iter().map(|group| &group.material).collect();
        let mut warnings = Vec::new();
        for (phase, written) in problem.phases.iter().zip(&self.file.phases) {
            phase
                .activate
                .iter()
                .for_each(|&group| active[group] = true);
            phase
                .deactivate
                .iter()
                .for_each(|&group| active[group] = false);
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

    /// An error of the case's problem or simulation, at its place in the file where it has one.
    pub fn place(&self, error: mechanics::Error) -> Error {
        match error {
            mechanics::Error::Refused(refusal) => self.place_refusal(&refusal),
            mechanics::Error::CannotStart(failure) => self.cannot_start(failure),
            other => other.into(),
        }
    }

    fn place_refusal(&self, refusal: &Refusal) -> Error {
        let error = self.source.error(
            self.span(&refusal.item, &refusal.cause),
            refusal.to_string(),
        );
        let hint = match &refusal.cause {
            Cause::NoLine { name, known } => {
                let known = known.iter().map(String::as_str).collect::<Vec<_>>();
                Some(suggestion(name, known))
            }
            cause => cause.hint(),
        };
        match hint {
            Some(hint) => error.hint(hint).into(),
            None => error.into(),
        }
    }

    /// Place of a part of the problem in the file.
    fn span(&self, item: &Item, cause: &Cause) -> Range<usize> {
        let file = &self.file;
        let group = |number: usize| file.groups.get_index(number);
        let phase = |number: &usize| file.phases.get(*number);
        let found = match item {
            Item::Problem => None,
            Item::Group(number) => group(*number).map(|(name, _)| name.span()),
            Item::GroupKey(number, key) => group(*number).and_then(|(name, group)| {
                let group = group.get_ref();
                let span = match key {
                    Key::Integration => group.integration.as_ref().map(Spanned::span),
                    Key::Normal => group.normal.as_ref().map(Spanned::span),
                    Key::InPlane => group.in_plane.as_ref().map(Spanned::span),
                    Key::InitialStress => {
                        let path = format!("groups.{}.initial_stress", name.get_ref());
                        let setting = self.source.setting_of(&path);
                        setting.or_else(|| group.initial_stress.as_ref().map(Spanned::span))
                    }
                    Key::UnitWeight => group.unit_weight.as_ref().map(Spanned::span),
                    Key::Drainage => group.drainage.as_ref().map(Spanned::span),
                    Key::UndrainedPoissonRatio => {
                        group.undrained_poisson_ratio.as_ref().map(Spanned::span)
                    }
                };
                span.or_else(|| Some(name.span()))
            }),
            Item::LawOf { group: of, phase } => group(*of).map(|(name, group)| {
                let swap = || {
                    let laws = &file.phases.get((*phase)?)?.laws;
                    laws.iter().find(|(key, _)| *key == name)
                };
                let own = || group.get_ref().law.span();
                swap().map_or_else(own, |(_, law)| law.span())
            }),
            Item::Material(name) => {
                let mut laws = file.laws.keys();
                laws.find(|key| key.get_ref() == name).map(Spanned::span)
            }
            Item::Support(number) => file.supports.get(*number).map(|s| s.line.span()),
            Item::Phase(number) => file.phases.get(*number).map(|phase| match cause {
                Cause::Increments(_) => phase.increments.span(),
                _ => phase.name.span(),
            }),
            Item::Displacement(phase, number) => file.phases.get(*phase).and_then(|phase| {
                let input = phase.displacement.get(*number)?;
                Some(input.line.span())
            }),
            Item::Free(phase, number) => file.phases.get(*phase).and_then(|phase| {
                let input = phase.free.get(*number)?;
                Some(input.line.span())
            }),
            Item::Pressure(phase, number) => file.phases.get(*phase).and_then(|phase| {
                let input = phase.pressure.get(*number)?;
                Some(input.line.span())
            }),
            Item::Force(phase, number) => file.phases.get(*phase).and_then(|phase| {
                let input = phase.force.get(*number)?;
                Some(input.line.span())
            }),
            Item::Rigid(phase, number) => file
                .phases
                .get(*phase)
                .and_then(|phase| Some(phase.rigid.get(*number)?.span())),
            Item::Time(number) => phase(number).and_then(|of| Some(of.time.as_ref()?.span())),
            Item::Course(number) => phase(number).and_then(|of| Some(of.course.as_ref()?.span())),
            Item::Activation {
                phase,
                group: of,
                is_activated,
            } => file.phases.get(*phase).and_then(|phase| {
                let names = if *is_activated {
                    &phase.activate
                } else {
                    &phase.deactivate
                };
                let (name, _) = group(*of)?;
                let mut same = names
                    .iter()
                    .filter(|other| other.get_ref() == name.get_ref());
                same.next_back().map(Spanned::span)
            }),
            Item::UnitWeight(phase, number) => file.phases.get(*phase).and_then(|phase| {
                let (_, weight) = phase.unit_weight.get_index(*number)?;
                Some(weight.span())
            }),
            Item::DrainageOf(phase, number) => file.phases.get(*phase).and_then(|phase| {
                let (_, drainage) = phase.drainage.get_index(*number)?;
                Some(drainage.span())
            }),
            Item::Water(None) => file
                .water
                .as_ref()
                .map(|water| water.get_ref().level.span()),
            Item::Water(Some(phase)) => file
                .phases
                .get(*phase)
                .and_then(|phase| Some(phase.water.as_ref()?.get_ref().level.span())),
        };
        found.unwrap_or(0..0)
    }

    /// The error of a law that cannot start from the stress it finds: at the law's place in the
    /// file, if that is what the law says.
    fn cannot_start(&self, failure: Box<PointFailure>) -> Error {
        let mut laws = self.file.laws.iter();
        let entry = laws.find(|(key, _)| key.get_ref() == &failure.law);
        let (outcome, group) = (failure.failure.outcome, failure.group.clone());
        let error = mechanics::Error::CannotStart(failure);
        match entry {
            Some((name, law)) if matches!(outcome, Outcome::Domain | Outcome::Parameter) => {
                let law = law.get_ref();
                // What the file gives to start from is what the law can refuse first.
                let given = law.initial.values().next().map(Spanned::span);
                let paths = [
                    format!("laws.{}.initial", name.get_ref()),
                    format!("groups.{group}.initial_stress"),
                ];
                let setting = paths.iter().find_map(|path| self.source.setting_of(path));
                let span = setting.or(given).unwrap_or_else(|| law.law.span());
                self.source.error(span, error.to_string()).into()
            }
            _ => error.into(),
        }
    }
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
        lists.chain(tables).chain(phase.drainage.keys())
    });
    for group in named {
        if !names().any(|name| name == group.get_ref()) {
            let message = format!("there is no group `{}`", group.get_ref());
            return Err(source
                .error(group.span(), message)
                .hint(suggestion(group.get_ref(), names().collect::<Vec<_>>()))
                .into());
        }
    }
    Ok(())
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
        let highest = level(source, written)?
            .values()
            .fold(f64::NEG_INFINITY, f64::max);
        let heights = mesh.solids.iter().flat_map(|solid| {
            let is_ground = active[solid.group] && is_wet[solid.group];
            let nodes = solid.nodes().iter();
            nodes.map(move |&node| (mesh.nodes[node][1], is_ground))
        });
        let (lowest, top) = heights.fold(
            (f64::INFINITY, f64::NEG_INFINITY),
            |(lowest, top), (at, is_ground)| {
                (lowest.min(at), if is_ground { top.max(at) } else { top })
            },
        );
        let place = source.place(&written.span());
        if highest < lowest {
            notes.push(format!(
                "{place}: the water table, {highest} m at its highest, lies below the lowest point of the mesh at {lowest} m: \
                 the ground is dry"
            ));
        } else if highest > top + ABOVE * (top - lowest) && top.is_finite() {
            notes.push(format!(
                "{place}: the water table, {highest} m at its highest, lies above the highest ground at {top} m: free water \
                 loads its surface"
            ));
        }
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
        phase.activate.iter().for_each(|&of| active[of] = true);
        phase.deactivate.iter().for_each(|&of| active[of] = false);
        if let Some(water) = &input.water {
            note(&water.get_ref().level, &active)?;
        }
    }
    Ok(notes)
}

/// A phase without its laws.
fn phase(source: &Source, file: &CaseFile, input: &PhaseInput) -> Result<Phase, Error> {
    let axes = |axes: &[crate::case::Axis]| -> Vec<Axis> {
        axes.iter().map(|&axis| axis.into()).collect()
    };
    // Unknown names were refused.
    let number = |name: &Spanned<String>| {
        file.groups
            .keys()
            .position(|key| key.get_ref() == name.get_ref())
    };
    let numbers = |names: &[Spanned<String>]| names.iter().filter_map(number).collect();
    let displacement = input.displacement.iter().map(|input| Displacement {
        line: input.line.get_ref().clone(),
        x: input.x,
        y: input.y,
    });
    let free = input.free.iter().map(|input| Free {
        line: input.line.get_ref().clone(),
        components: axes(&input.components),
    });
    let pressure = input.pressure.iter().map(|input| {
        Ok(Pressure {
            line: input.line.get_ref().clone(),
            value: input.value.get_ref().read(source, input.value.span())?,
        })
    });
    let force = input.force.iter().map(|input| Force {
        line: input.line.get_ref().clone(),
        x: input.x,
        y: input.y,
    });
    let weights = input.unit_weight.iter();
    let drainage = input.drainage.iter();
    let course = input.course.as_ref();
    let water = input.water.as_ref();
    Ok(Phase {
        name: input.name.get_ref().clone(),
        increments: *input.increments.get_ref(),
        time: input.time.as_ref().map(|time| *time.get_ref()),
        materials: Vec::new(),
        activate: numbers(&input.activate),
        deactivate: numbers(&input.deactivate),
        unit_weight: weights
            .filter_map(|(name, weight)| Some((number(name)?, *weight.get_ref())))
            .collect(),
        water_level: water
            .map(|water| level(source, &water.get_ref().level))
            .transpose()?,
        drainage: drainage
            .filter_map(|(name, drainage)| Some((number(name)?, *drainage.get_ref())))
            .collect(),
        rigid: input
            .rigid
            .iter()
            .map(|line| line.get_ref().clone())
            .collect(),
        course: match course {
            Some(course) if course.get_ref().is_empty() => {
                let message = "`course` is empty; left out, a phase's loads rise straight";
                return Err(source.error(course.span(), message).into());
            }
            course => course
                .map(|course| course.get_ref().clone())
                .unwrap_or_default(),
        },
        force: force.collect(),
        reset_displacements: input.reset_displacements,
        displacement: displacement.collect(),
        free: free.collect(),
        pressure: pressure.collect::<Result<_, Error>>()?,
    })
}

/// Laws built so far; each once for every hypothesis.
struct LawShelf<'a> {
    source: &'a Source,
    file: &'a CaseFile,
    search: SearchPath,
    laws: Laws,
}

impl<'a> LawShelf<'a> {
    /// What the file says under a law's name.
    fn entry(&self, name: &Spanned<String>) -> Result<&'a LawInput, Error> {
        let laws = &self.file.laws;
        let entry = laws.iter().find(|(key, _)| key.get_ref() == name.get_ref());
        entry.map(|(_, entry)| entry.get_ref()).ok_or_else(|| {
            let names: Vec<&str> = laws.keys().map(|k| k.get_ref().as_str()).collect();
            let message = format!("there is no law `{}` under [laws]", name.get_ref());
            self.source
                .error(name.span(), message)
                .hint(suggestion(name.get_ref(), names))
                .into()
        })
    }

    /// The law without its parameters.
    fn loaded(&self, entry: &LawInput) -> Result<LoadedLaw, Error> {
        self.tables().loaded(&self.search, entry)
    }

    fn tables(&self) -> LawTables<'a> {
        LawTables {
            source: self.source,
            tables: &self.file.laws,
        }
    }

    /// The law of this name, for a group.
    fn material(
        &mut self,
        group_name: &Spanned<String>,
        group: &GroupInput,
        name: &Spanned<String>,
    ) -> Result<Material, Error> {
        let entry = self.entry(name)?;
        let is_interface_law = group.formulation == Formulation::ThinLayer
            && self.loaded(entry).is_ok_and(|law| {
                let offered = law.description().formulation(Hypothesis::Interface2d);
                offered.is_some()
            });
        let hypothesis = model::hypothesis(self.file.analysis, group.formulation, is_interface_law);
        let key = (name.get_ref().clone(), hypothesis.name());
        let built = if let Some(built) = self.laws.get(&key) {
            Arc::clone(built)
        } else {
            let parameters = &self.tables().parameters(entry);
            let loaded = self.loaded(entry)?;
            let built = try_law(&loaded, hypothesis, parameters).map_err(|failure| {
                let error = place_failure(self.source, &entry.law, parameters, &failure);
                if !matches!(failure.cause, BuildCause::Hypothesis { .. }) {
                    error
                } else if let Some(adapter) =
                    entry.adapter.as_ref().filter(|_| entry.is_shear_zone())
                {
                    let message = format!(
                        "law `{}` is a shear zone, made for interface_2d, expected {}",
                        name.get_ref(),
                        hypothesis.name()
                    );
                    let error = self.source.error(adapter.span(), message);
                    self.explain(error.into(), group_name, group, name)
                } else {
                    let error = self.explain(error, group_name, group, name);
                    if is_solid_at_interface(&failure) {
                        error.with_hint(ZONE)
                    } else {
                        error
                    }
                }
            })?;
            let built = Arc::new(built);
            self.laws.insert(key, Arc::clone(&built));
            built
        };
        let mut material = Material::new(name.get_ref(), built);
        material.varying = self.varying(entry, hypothesis)?;
        for (variable, value) in &self.tables().initial(entry) {
            if !value.get_ref().is_finite() {
                let message = "expected a finite number";
                return Err(self.source.error(value.span(), message).into());
            }
            let law = Arc::clone(&material.built);
            let id = variable.get_ref();
            material = material
                .starting_with(id, *value.get_ref())
                .ok_or_else(|| {
                    let variables = &law.law.formulation().internal_variables;
                    let ids = variables.iter().map(|v| v.id.as_str()).collect();
                    self.no_variable(&law.law.description().id, variable, ids)
                })?;
        }
        Ok(material)
    }

    fn no_variable(&self, law: &str, variable: &Spanned<String>, ids: Vec<&str>) -> Error {
        let id = variable.get_ref();
        let message = format!("law `{law}` has no internal variable `{id}`");
        let error = self.source.error(variable.span(), message);
        error.hint(suggestion(id, ids)).into()
    }

    /// Parameters of a law that vary with the height; every value is held against its bounds.
    fn varying(
        &self,
        entry: &LawInput,
        hypothesis: Hypothesis,
    ) -> Result<Vec<(String, Profile)>, Error> {
        let given = self.tables().parameters(entry);
        let mut varying = Vec::new();
        for (id, value) in &given {
            if let ParameterValue::Varying(over) = value.get_ref() {
                let profile = ProfileInput::Over(over.clone()).read(self.source, value.span())?;
                varying.push((id.get_ref().clone(), profile));
            }
        }
        let most = varying
            .iter()
            .map(|(_, profile)| profile.points().len())
            .max();
        for point in 1..most.unwrap_or(0) {
            let mut parameters = given.clone();
            for value in parameters.values_mut() {
                if let ParameterValue::Varying(over) = value.get_mut() {
                    let last = over.z.len() - 1;
                    over.z = vec![over.z[point.min(last)]];
                }
            }
            let loaded = self.loaded(entry)?;
            try_law(&loaded, hypothesis, &parameters)
                .map_err(|failure| place_failure(self.source, &entry.law, &given, &failure))?;
        }
        Ok(varying)
    }

    /// Adds what the group expects to an error about the law's hypothesis.
    fn explain(
        &self,
        error: Error,
        name: &Spanned<String>,
        group: &GroupInput,
        law: &Spanned<String>,
    ) -> Error {
        let Error::Text(text::Error::Input(input)) = error else {
            return error;
        };
        let label = format!("taken by group `{}`", name.get_ref());
        let input = self.source.mark(*input, law.span(), label);
        let hint = format!(
            "group `{}` has the formulation `{}` in the analysis `{}`",
            name.get_ref(),
            group.formulation.name(),
            self.file.analysis.name()
        );
        input.hint(hint).into()
    }
}
