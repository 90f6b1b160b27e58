//! The driver file: reading it, and checking everything that can be checked before the first call.

use super::frame::Frame;
use super::restrictions::Restrictions;
use super::{N_MAX, Vector};
use crate::case::{FigureInput, base};
use crate::error::{Error, Source, suggestion};
use crate::input::{self, BuiltLaw, ForeignKeys, Named, ParameterTable, ParameterValue};
use crate::lock::Pins;
use crate::plugin::adapter::{Adapter, Externals, Scratch};
use crate::plugin::{Law, SearchPath, Strided};
use crate::schema;
use abi::Hypothesis;
use abi::status::Outcome;
use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// What a case file looks like among driver files.
const CASE: base::OtherKind = base::OtherKind {
    keys: &["analysis", "mesh", "groups", "supports", "phase"],
    message: "this is a case file; expected a driver file, which leads a law at one point",
    command: "pilum run",
};

/// Most increments of one file; a slip of the pen beyond.
const MAX_INCREMENTS: usize = 100_000_000;

/// The keys of a driver file. Units: kPa, m; angles in degrees; tension and opening positive.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Id of the law.
    #[schemars(with = "String")]
    law: Spanned<String>,
    /// SHA-256 of the law's library; another one is refused.
    #[schemars(with = "Option<String>")]
    sha256: Option<Spanned<String>>,
    /// What the law's library is made for, if not for the contract.
    #[schemars(with = "Option<Adapter>")]
    adapter: Option<Spanned<Adapter>>,
    /// That library.
    #[schemars(with = "Option<PathBuf>")]
    library: Option<Spanned<PathBuf>>,
    /// What describes it.
    #[schemars(with = "Option<PathBuf>")]
    sidecar: Option<Spanned<PathBuf>>,
    /// Call it in this process.
    #[schemars(with = "Option<bool>")]
    in_process: Option<Spanned<bool>>,
    /// Write the arguments of one call here.
    #[schemars(with = "Option<PathBuf>")]
    record: Option<Spanned<PathBuf>>,
    /// What becomes of routines that it calls and nobody supplies.
    #[schemars(with = "Option<Externals>")]
    externals: Option<Spanned<Externals>>,
    /// What becomes of its scratch files.
    #[schemars(with = "Option<Scratch>")]
    scratch: Option<Spanned<Scratch>>,
    /// What the driver is.
    #[serde(default)]
    title: String,
    /// Folders with law libraries, relative to the file.
    #[serde(default)]
    #[schemars(with = "Vec<PathBuf>")]
    law_path: Vec<Spanned<PathBuf>>,
    /// Hypothesis: what is led, and its components.
    #[schemars(with = "schema::HypothesisName")]
    hypothesis: Spanned<String>,
    /// Parameters of the law.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, ParameterValue>")]
    parameters: ParameterTable,
    /// The initial state; 0 where nothing is given.
    #[schemars(with = "Option<Initial>")]
    initial: Option<Spanned<Initial>>,
    /// The path, segment after segment.
    #[serde(default)]
    segment: Vec<SegmentTable>,
    /// Curves of columns of the table.
    #[serde(default, rename = "figure")]
    figures: Vec<FigureInput>,
}

/// The initial state.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Initial {
    /// Traction of an interface, kPa, by component `n`, `t`.
    #[schemars(with = "Option<schema::Components<f64>>")]
    traction: Option<Spanned<Named<f64>>>,
    /// Stress of a solid, kPa, by component `11` to `23`.
    #[schemars(with = "Option<schema::Components<f64>>")]
    stress: Option<Spanned<Named<f64>>>,
    /// Internal variables of the law, by id.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, f64>")]
    internal: Named<f64>,
}

/// A stretch of the path.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SegmentTable {
    /// Number of equal increments.
    #[schemars(with = "i64", range(min = 1))]
    increments: Spanned<i64>,
    /// How each component is led; one without control keeps its traction or stress.
    #[schemars(with = "schema::Components<ControlTable>")]
    control: IndexMap<Spanned<String>, Spanned<ControlTable>>,
}

/// How one component is led: exactly one of these, as the total at the end of the segment.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("minProperties" = 1, "maxProperties" = 1))]
struct ControlTable {
    /// Interfaces: jump, m.
    #[schemars(with = "Option<f64>")]
    jump: Option<Spanned<f64>>,
    /// Interfaces: traction, kPa.
    #[schemars(with = "Option<f64>")]
    traction: Option<Spanned<f64>>,
    /// Interfaces: the traction changes by −stiffness × jump, kPa/m.
    #[schemars(with = "Option<f64>")]
    stiffness: Option<Spanned<f64>>,
    /// Solids: strain.
    #[schemars(with = "Option<f64>")]
    strain: Option<Spanned<f64>>,
    /// Solids: stress, kPa.
    #[schemars(with = "Option<f64>")]
    stress: Option<Spanned<f64>>,
}

/// How one component is led through a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Control {
    /// The flux stays what it is at the start of the segment.
    Keep,
    /// Gradient at the end of the segment.
    Gradient(f64),
    /// Flux at the end of the segment.
    Flux(f64),
    /// The flux changes by −stiffness × jump.
    Stiffness(f64),
    /// Change of the gradient over the segment.
    GradientBy(f64),
    /// Change of the flux over the segment.
    FluxBy(f64),
}

/// A stretch of the path.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    pub(super) increments: usize,
    pub(super) control: [Control; N_MAX],
    /// Number of the step that it is part of, from 1.
    pub(super) step: u32,
    /// Increments of that step before it.
    pub(super) first: usize,
    /// What the components are.
    pub(super) frame: Frame,
    /// Time of an increment.
    pub(super) time_increment: f64,
    /// What holds in place of the controls.
    pub(super) restrictions: Option<Restrictions>,
}

/// A driver file, checked, with its law built.
#[derive(Debug)]
pub struct Driver {
    pub(super) law: Law,
    pub(super) warnings: Vec<String>,
    pub(super) flux: Vector,
    pub(super) internal: Vec<f64>,
    pub(super) segments: Vec<Segment>,
    pub(super) variant: Option<String>,
    pub(super) title: String,
    pub(super) figures: Vec<FigureInput>,
    source: Source,
    place_of_initial: Range<usize>,
    file: File,
    /// Who may want it to stop.
    pub(super) stop: crate::stop::Stop,
}

impl Driver {
    /// Reads a driver file and builds its law: one driver, or one for each `[[variant]]`.
    ///
    /// # Errors
    /// [`Error::Unreadable`], and those of [`Driver::from_source`].
    pub fn read(path: &Path) -> Result<Vec<Self>, Error> {
        Self::variants(Source::read(path)?, true)
    }

    /// As [`Driver::read`], whatever the lock beside the file says.
    pub(crate) fn read_unlocked(path: &Path) -> Result<Vec<Self>, Error> {
        Self::variants(Source::read(path)?, false)
    }

    /// Takes the text of a driver file without variants and builds its law.
    ///
    /// # Errors
    /// [`Error::Input`] at the place that does not fit; [`Error::Plugin`] if the law is not found
    /// or its library is defective; [`Error::Usage`] if the file has variants.
    pub fn from_source(source: &Source) -> Result<Self, Error> {
        let mut drivers = Self::variants(source.clone(), true)?;
        match (drivers.pop(), drivers.is_empty()) {
            (Some(driver), true) => Ok(driver),
            _ => Err(Error::Usage("the driver has several variants".to_owned())),
        }
    }

    pub(crate) fn variants(source: Source, locked: bool) -> Result<Vec<Self>, Error> {
        let (source, files) = base::read_kind(source, &CASE)?;
        let driver = |(variant, file)| Self::build(&source, variant, file, locked);
        files.into_iter().map(driver).collect()
    }

    fn build(
        source: &Source,
        variant: Option<String>,
        file: File,
        locked: bool,
    ) -> Result<Self, Error> {
        let given = file.clone();
        let hypothesis = hypothesis(source, &file.hypothesis)?;
        let segments = segments(source, &file, hypothesis)?;
        let place_of_initial = file
            .initial
            .as_ref()
            .map_or_else(|| file.law.span(), Spanned::span);
        let none = Initial::default();
        let initial = file.initial.as_ref().map_or(&none, Spanned::get_ref);
        let flux = initial_flux(source, initial, hypothesis)?;

        let folder = |written: &Spanned<PathBuf>| {
            let file = source.path_at(&written.span());
            file.parent()
                .unwrap_or(Path::new(""))
                .join(written.get_ref())
        };
        let folders: Vec<PathBuf> = file.law_path.iter().map(folder).collect();
        let law = std::iter::once((&file.law, file.sha256.as_ref()));
        let pins = if locked {
            Pins::of(source, law)?
        } else {
            Pins::given(source, law)?
        };
        let search = SearchPath::new(&folders).pinned(pins);
        let keys = ForeignKeys {
            adapter: file.adapter.as_ref(),
            library: file.library.as_ref(),
            sidecar: file.sidecar.as_ref(),
            in_process: file.in_process.as_ref(),
            record: file.record.as_ref(),
            externals: file.externals.as_ref(),
            scratch: file.scratch.as_ref(),
        };
        let foreign = keys.read(source)?;
        let loaded = input::find_law(source, &search, &file.law, foreign.as_ref())?;
        let built = input::build_law(source, &loaded, &file.law, hypothesis, &file.parameters)?;
        let mut driver = Self {
            law: built.law,
            warnings: built.warnings,
            flux,
            internal: Vec::new(),
            segments,
            variant,
            title: file.title,
            figures: file.figures,
            source: source.clone(),
            place_of_initial,
            file: given,
            stop: crate::stop::Stop::never(),
        };
        driver.internal = driver.initial_internal(&initial.internal)?;
        driver.check_figures(source)?;
        Ok(driver)
    }

    /// A driver whose path is not written in a driver file.
    pub(super) fn assembled(
        source: &Source,
        id: Spanned<String>,
        built: BuiltLaw,
        (flux, internal): (Vector, Vec<f64>),
        segments: Vec<Segment>,
    ) -> Result<Self, Error> {
        let file = File {
            hypothesis: Spanned::new(0..0, built.law.hypothesis().name().to_owned()),
            law: id,
            sha256: None,
            adapter: None,
            library: None,
            sidecar: None,
            in_process: None,
            record: None,
            externals: None,
            scratch: None,
            title: String::new(),
            law_path: Vec::new(),
            parameters: ParameterTable::new(),
            initial: None,
            segment: Vec::new(),
            figures: Vec::new(),
        };
        let mut driver = Self {
            law: built.law,
            warnings: built.warnings,
            flux,
            internal: Vec::new(),
            segments,
            variant: None,
            title: String::new(),
            figures: Vec::new(),
            source: source.clone(),
            place_of_initial: 0..0,
            file,
            stop: crate::stop::Stop::never(),
        };
        // The law may refuse the stress, whatever its variables.
        driver.initial_internal(&Named::new())?;
        driver.internal = internal;
        Ok(driver)
    }

    /// Path of the file.
    pub(super) fn path(&self) -> &Path {
        self.source.path()
    }

    /// The law.
    pub fn law(&self) -> &Law {
        &self.law
    }

    /// Name of the variant, if the file stands for several drivers.
    pub fn variant(&self) -> Option<&str> {
        self.variant.as_deref()
    }

    /// Title.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Increments of each segment.
    pub fn segment_increments(&self) -> Vec<usize> {
        self.segments.iter().map(|s| s.increments).collect()
    }

    /// Follows the same path in other increments, one number for each segment.
    pub fn set_increments(&mut self, increments: &[usize]) {
        for (segment, &increments) in self.segments.iter_mut().zip(increments) {
            segment.increments = increments.max(1);
        }
    }

    /// The value of a parameter of the law, of a choice its number: as in the file, or the law's
    /// default.
    pub fn parameter(&self, id: &str) -> Option<f64> {
        let mut declared = self.law.description().parameters.iter();
        let declared = declared.find(|p| p.id == id)?;
        let mut written = self.file.parameters.iter();
        match written.find(|(key, _)| key.get_ref() == id) {
            None => declared.default,
            Some((_, value)) => match value.get_ref() {
                ParameterValue::Number(number) => Some(*number),
                ParameterValue::Integer(number) => Some(*number as f64),
                ParameterValue::Label(label) => {
                    let number = declared.choices.iter().position(|choice| choice == label);
                    number.map(|number| number as f64)
                }
            },
        }
    }

    /// The same path with other values of some parameters.
    ///
    /// # Errors
    /// [`Error::Input`] if the law does not take them.
    pub fn with_parameters(&self, values: &[(String, ParameterValue)]) -> Result<Self, Error> {
        let mut file = self.file.clone();
        input::set_parameters(&mut file.parameters, values);
        let mut driver = Self::build(&self.source, self.variant.clone(), file, true)?;
        driver.set_increments(&self.segment_increments());
        driver.stop = self.stop.clone();
        Ok(driver)
    }

    /// Lets the driver be stopped on its way.
    pub fn stop_on(&mut self, stop: &crate::stop::Stop) {
        self.stop = stop.clone();
    }

    /// Number of increments of all segments.
    pub fn n_increments(&self) -> usize {
        self.segments.iter().map(|segment| segment.increments).sum()
    }

    /// An error about the initial state.
    pub(super) fn initial_error(&self, why: &str) -> Error {
        self.source
            .error(
                self.place_of_initial.clone(),
                format!(
                    "law `{}` refuses the initial state: {why}",
                    self.law.description().id
                ),
            )
            .hint("tension is positive; a compressive stress is negative")
            .into()
    }

    fn initial_internal(&self, given: &Named<f64>) -> Result<Vec<f64>, Error> {
        let n = self.law.n_components();
        let mut internal = self
            .law
            .initial_state(1, (&self.flux[..n], Strided::rows(n)))
            .map_err(|failure| match failure.outcome {
                Outcome::Domain | Outcome::Numeric | Outcome::CutStep => {
                    self.initial_error(&failure.message)
                }
                outcome => Error::plugin(format!(
                    "law `{}` of library {}: the initial state failed ({outcome:?}): {}",
                    self.law.description().id,
                    self.law.library().path().display(),
                    failure.message
                )),
            })?;
        let variables = &self.law.formulation().internal_variables;
        for (name, value) in given {
            let Some(number) = variables.iter().position(|v| &v.id == name.get_ref()) else {
                return Err(self
                    .source
                    .error(
                        name.span(),
                        format!(
                            "law `{}` has no internal variable `{}`",
                            self.law.description().id,
                            name.get_ref()
                        ),
                    )
                    .hint(suggestion(
                        name.get_ref(),
                        variables.iter().map(|v| v.id.as_str()),
                    ))
                    .into());
            };
            internal[number] = finite(&self.source, name.get_ref(), value)?;
        }
        Ok(internal)
    }
}

fn hypothesis(source: &Source, name: &Spanned<String>) -> Result<Hypothesis, Error> {
    Hypothesis::ALL
        .into_iter()
        .find(|h| h.name() == name.get_ref())
        .ok_or_else(|| {
            source
                .error(
                    name.span(),
                    format!("there is no hypothesis `{}`", name.get_ref()),
                )
                .hint(suggestion(
                    name.get_ref(),
                    Hypothesis::ALL.map(Hypothesis::name),
                ))
                .into()
        })
}

fn finite(source: &Source, what: &str, value: &Spanned<f64>) -> Result<f64, Error> {
    let number = *value.get_ref();
    if number.is_finite() {
        Ok(number)
    } else {
        Err(source
            .error(value.span(), format!("`{what}`: {number} is not finite"))
            .into())
    }
}

/// Number of the component that a key names.
fn component(
    source: &Source,
    name: &Spanned<String>,
    hypothesis: Hypothesis,
) -> Result<usize, Error> {
    let names = hypothesis.components();
    names
        .iter()
        .position(|candidate| candidate == name.get_ref())
        .ok_or_else(|| {
            source
                .error(
                    name.span(),
                    format!(
                        "there is no component `{}` under {}",
                        name.get_ref(),
                        hypothesis.name()
                    ),
                )
                .hint(format!("components: {}", names.join(", ")))
                .into()
        })
}

fn initial_flux(
    source: &Source,
    initial: &Initial,
    hypothesis: Hypothesis,
) -> Result<Vector, Error> {
    let (_, word) = words(hypothesis);
    let (fits, misfit) = if hypothesis == Hypothesis::Interface2d {
        (&initial.traction, &initial.stress)
    } else {
        (&initial.stress, &initial.traction)
    };
    if let Some(misfit) = misfit {
        return Err(source
            .error(
                misfit.span(),
                format!(
                    "under {} the initial state is a {word}, components {}",
                    hypothesis.name(),
                    hypothesis.components().join(", ")
                ),
            )
            .into());
    }
    let mut flux = [0.0; N_MAX];
    for (name, value) in fits.iter().flat_map(Spanned::get_ref) {
        flux[component(source, name, hypothesis)?] = finite(source, name.get_ref(), value)?;
    }
    Ok(flux)
}

fn segments(source: &Source, file: &File, hypothesis: Hypothesis) -> Result<Vec<Segment>, Error> {
    if file.segment.is_empty() {
        return Err(source
            .error(file.law.span(), "the driver has no [[segment]]")
            .hint("a path is a list of [[segment]] tables with `increments` and `control`")
            .into());
    }
    let mut total = 0_usize;
    let mut number = 0;
    file.segment
        .iter()
        .map(|table| {
            let increments = usize::try_from(*table.increments.get_ref()).unwrap_or(0);
            total = total.saturating_add(increments);
            if increments == 0 || total > MAX_INCREMENTS {
                return Err(source
                    .error(
                        table.increments.span(),
                        format!(
                            "`increments`: {} is outside [1, {MAX_INCREMENTS}], all segments \
                             together",
                            table.increments.get_ref()
                        ),
                    )
                    .into());
            }
            let mut control = [Control::Keep; N_MAX];
            if hypothesis == Hypothesis::PlaneStrain {
                control[OUT_OF_PLANE] = Control::Gradient(0.0);
            }
            for (name, written) in &table.control {
                let i = component(source, name, hypothesis)?;
                control[i] = read_control(source, name.get_ref(), written, hypothesis)?;
                if hypothesis == Hypothesis::PlaneStrain
                    && i == OUT_OF_PLANE
                    && control[i] != Control::Gradient(0.0)
                {
                    return Err(source
                        .error(
                            written.span(),
                            "the strain 33 is 0 in plane strain and cannot be controlled",
                        )
                        .hint("leave `33` out, write `{ strain = 0.0 }`, or use another hypothesis")
                        .into());
                }
            }
            number += 1;
            Ok(Segment {
                increments,
                control,
                step: number,
                first: 0,
                frame: Frame::Cartesian,
                time_increment: 1.0,
                restrictions: None,
            })
        })
        .collect()
}

/// Number of the component 33.
const OUT_OF_PLANE: usize = 2;

fn read_control(
    source: &Source,
    component: &str,
    written: &Spanned<ControlTable>,
    hypothesis: Hypothesis,
) -> Result<Control, Error> {
    type Kind = fn(f64) -> Control;
    let table = written.get_ref();
    let interface = hypothesis == Hypothesis::Interface2d;
    // Keyword, value, whether it is made for interfaces, what it becomes.
    let kinds: [(&str, &Option<Spanned<f64>>, bool, Kind); 5] = [
        ("jump", &table.jump, true, Control::Gradient),
        ("traction", &table.traction, true, Control::Flux),
        ("stiffness", &table.stiffness, true, Control::Stiffness),
        ("strain", &table.strain, false, Control::Gradient),
        ("stress", &table.stress, false, Control::Flux),
    ];
    let choices: Vec<&str> = kinds
        .iter()
        .filter(|kind| kind.2 == interface)
        .map(|kind| kind.0)
        .collect();
    let mut given = kinds
        .iter()
        .filter_map(|(keyword, value, fits, kind)| Some((keyword, value.as_ref()?, fits, kind)));
    let (Some((keyword, value, fits, kind)), None) = (given.next(), given.next()) else {
        return Err(source
            .error(
                written.span(),
                format!(
                    "component `{component}` needs exactly one control, one of {}",
                    choices.join(", ")
                ),
            )
            .into());
    };
    if *fits != interface {
        return Err(source
            .error(
                value.span(),
                format!(
                    "component `{component}` cannot be controlled by `{keyword}` under {}",
                    hypothesis.name()
                ),
            )
            .hint(format!("it is controlled by one of {}", choices.join(", ")))
            .into());
    }
    let number = finite(source, keyword, value)?;
    if *keyword == "stiffness" && number < 0.0 {
        return Err(source
            .error(
                value.span(),
                format!("`stiffness`: {number} kPa/m is outside [0, ∞)"),
            )
            .hint("the traction changes by −stiffness × jump")
            .into());
    }
    Ok(kind(number))
}
