//! The driver file: reading it, and checking everything that can be checked before the first call.
//!
//! [`point`] defines what a driver does; this module locates it in a file.

mod path;

use crate::Error;
use crate::case::{FigureInput, LawInput};
use crate::figures::table_figures;
use crate::material::{
    self, LawTables, ParameterTable, ParameterValue, Route, build_law, internal_variable,
};
use crate::schema;
use indexmap::IndexMap;
use law::foreign::{Externals, Order, Scratch};
use law::{BuiltLaw, LoadedLaw, Opener, Pins, SearchPath};
use path::{finite, hypothesis, initial_flux, segments};
use point::{Segment, Vector};
use results::output_request::Figure;
use results::point_figure::drawable;
use schemars::JsonSchema;
use serde::Deserialize;
use std::ops::Range;
use std::path::{Path, PathBuf};
use text::base::{OtherKind, read_kind};
use text::{Named, Source, Spanned};

/// What a case file looks like among driver files.
const CASE: OtherKind = OtherKind {
    keys: &["analysis", "mesh", "groups", "supports", "phase"],
    message: "this is a case file; expected a driver file, which leads a law at one point",
    command: "pilum run",
};

/// The keys of a driver file. Units: kPa, m; angles in degrees; tension and opening positive.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "File")]
pub(crate) struct DriverFile {
    /// Id of the law.
    law: Spanned<String>,
    /// SHA-256 that the law's library must have, in hexadecimal digits.
    sha256: Option<Spanned<String>>,
    /// Program that the law's library is made for, if not for the contract; or another law as its
    /// source.
    adapter: Option<Spanned<Route>>,
    /// That library, relative to the file.
    library: Option<Spanned<PathBuf>>,
    /// Its sidecar, or description.
    sidecar: Option<Spanned<PathBuf>>,
    /// Call the law in this process.
    in_process: Option<Spanned<bool>>,
    /// File for the arguments of one call.
    record: Option<Spanned<PathBuf>>,
    /// Routines that the library calls and nobody supplies.
    externals: Option<Spanned<Externals>>,
    /// Scratch files of the library.
    scratch: Option<Spanned<Scratch>>,
    /// UDSM: order of its stiffness in memory; default `columns`.
    tangent_order: Option<Spanned<Order>>,
    /// Shear zone: its thickness, m. `law` is a law of solids, or a table of `laws`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    thickness: Option<Spanned<f64>>,
    /// Shear zone: initial stress along it and out of plane over the normal traction; default 1.
    #[schemars(range(min = 0))]
    lateral_ratio: Option<Spanned<f64>>,
    /// Shear zone: the law that fills it.
    #[serde(default)]
    laws: Named<LawInput>,
    /// Title.
    #[serde(default)]
    title: String,
    /// Folders with law libraries, relative to the file.
    #[serde(default)]
    law_path: Vec<Spanned<PathBuf>>,
    /// Hypothesis, with its components.
    #[schemars(with = "schema::HypothesisName")]
    hypothesis: Spanned<String>,
    /// Its parameters.
    #[serde(default)]
    parameters: ParameterTable,
    /// Initial state; default 0.
    initial: Option<Spanned<Initial>>,
    /// The path.
    #[serde(default)]
    segment: Vec<SegmentTable>,
    /// Curves of columns.
    #[serde(default, rename = "figure")]
    figures: Vec<FigureInput>,
}

impl DriverFile {
    /// Its law as a table of laws has it.
    fn entry(&self, initial: &Initial) -> LawInput {
        LawInput {
            law: self.law.clone(),
            sha256: self.sha256.clone(),
            adapter: self.adapter.clone(),
            library: self.library.clone(),
            sidecar: self.sidecar.clone(),
            in_process: self.in_process.clone(),
            record: self.record.clone(),
            externals: self.externals.clone(),
            scratch: self.scratch.clone(),
            tangent_order: self.tangent_order.clone(),
            thickness: self.thickness.clone(),
            lateral_ratio: self.lateral_ratio.clone(),
            parameters: self.parameters.clone(),
            initial: initial.internal.clone(),
        }
    }
}

/// A driver has one law: its tables of laws are for what that is made from.
fn refuse_unused(tables: LawTables<'_>, entry: &LawInput) -> Result<(), Error> {
    let used = tables.filler(entry);
    let is_used = |table: &LawInput| used.is_some_and(|used| std::ptr::eq(used, table));
    let mut all = tables.tables.iter();
    let Some((name, _)) = all.find(|(_, table)| !is_used(table.get_ref())) else {
        return Ok(());
    };
    let message = format!("law `{}` is not used", name.get_ref());
    let hint = "a driver has one law; with `adapter = \"shear_zone\"` its `law` may name a table";
    Err(tables.source.error(name.span(), message).hint(hint).into())
}

/// The initial state.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Initial {
    /// Traction of an interface, kPa.
    #[schemars(with = "Option<schema::Components<f64>>")]
    traction: Option<Spanned<Named<f64>>>,
    /// Stress of a solid, kPa.
    #[schemars(with = "Option<schema::Components<f64>>")]
    stress: Option<Spanned<Named<f64>>>,
    /// Internal variables, by id.
    #[serde(default)]
    internal: Named<f64>,
}

/// A stretch of the path.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SegmentTable {
    /// Number of equal increments.
    #[schemars(range(min = 1))]
    increments: Spanned<i64>,
    /// Duration, in the law's unit of time; default: 1 for each increment.
    #[schemars(extend("exclusiveMinimum" = 0))]
    time: Option<Spanned<f64>>,
    /// Control of components; one without keeps its traction or stress.
    #[schemars(with = "schema::Components<ControlTable>")]
    control: IndexMap<Spanned<String>, Spanned<ControlTable>>,
}

/// How one component is led: exactly one of these, as the total at the end of the segment.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("minProperties" = 1, "maxProperties" = 1))]
struct ControlTable {
    /// Interfaces: jump, m.
    jump: Option<Spanned<f64>>,
    /// Interfaces: traction, kPa.
    traction: Option<Spanned<f64>>,
    /// Interfaces: the traction changes by −stiffness × jump since the start of the segment, kPa/m.
    stiffness: Option<Spanned<f64>>,
    /// Solids: strain.
    strain: Option<Spanned<f64>>,
    /// Solids: stress, kPa.
    stress: Option<Spanned<f64>>,
}

/// A driver with the file that it was read from.
#[derive(Debug)]
pub struct Driver {
    point: point::Driver,
    title: String,
    figures: Vec<Figure>,
    source: Source,
    place_of_initial: Range<usize>,
    /// Content of the file, if it is a driver file.
    file: Option<DriverFile>,
    /// Settings for opening the law's library, should it be built again.
    opener: Opener,
}

impl Driver {
    /// Reads a driver file and builds its law: one driver, or one for each `[[variant]]`. Settings,
    /// `KEY=VALUE`, go over what the file says, in every variant; the law's library is opened with this
    /// opener.
    ///
    /// # Errors
    /// The file cannot be read, and those of [`Driver::variants`]; at the place in a setting.
    pub fn read(opener: &Opener, path: &Path, settings: &[String]) -> Result<Vec<Self>, Error> {
        Self::variants(opener, Source::read(path)?.with_settings(settings), true)
    }

    /// As [`Driver::read`] without settings, whatever the lock next to the file says.
    ///
    /// # Errors
    /// As [`Driver::read`].
    pub fn read_unlocked(opener: &Opener, path: &Path) -> Result<Vec<Self>, Error> {
        Self::variants(opener, Source::read(path)?, false)
    }

    /// Takes the text of a driver file. `locked`: the lock next to it is honoured.
    ///
    /// # Errors
    /// At the place that does not fit; the law is not found or its library is defective.
    pub fn variants(opener: &Opener, source: Source, locked: bool) -> Result<Vec<Self>, Error> {
        let (source, files) = read_kind(source, &CASE)?;
        let driver = |(variant, file)| {
            let load = |file: &DriverFile| Self::load(opener, &source, file, locked);
            Self::build(opener, &source, variant, file, load)
        };
        files.into_iter().map(driver).collect()
    }

    /// The law of a driver file, without its parameters.
    fn load(
        opener: &Opener,
        source: &Source,
        file: &DriverFile,
        locked: bool,
    ) -> Result<LoadedLaw, Error> {
        let folders = file.law_path.iter();
        let folders = folders.map(|folder| source.file_named(folder.get_ref(), &folder.span()));
        let folders: Vec<PathBuf> = folders.collect();
        let entry = file.entry(&Initial::default());
        let tables = LawTables {
            source,
            tables: &file.laws,
        };
        refuse_unused(tables, &entry)?;
        let others = file.laws.values().map(Spanned::get_ref);
        let all = std::iter::once(&entry).chain(others);
        let laws = all.map(|law| (&law.law, law.sha256.as_ref()));
        let pins = if locked {
            Pins::of(source, laws)?
        } else {
            Pins::given(source, laws)?
        };
        let search = SearchPath::of(opener, &folders).pinned(pins);
        tables.loaded(&search, &entry)
    }

    fn build(
        opener: &Opener,
        source: &Source,
        variant: Option<String>,
        file: DriverFile,
        load: impl Fn(&DriverFile) -> Result<LoadedLaw, Error>,
    ) -> Result<Self, Error> {
        let hypothesis = hypothesis(source, &file.hypothesis)?;
        let segments = segments(source, &file, hypothesis)?;
        let in_file = file
            .initial
            .as_ref()
            .map_or_else(|| file.law.span(), Spanned::span);
        let place_of_initial = source.setting_of("initial").unwrap_or(in_file);
        let none = Initial::default();
        let initial = file.initial.as_ref().map_or(&none, Spanned::get_ref);
        let flux = initial_flux(source, initial, hypothesis)?;
        let entry = file.entry(initial);
        let tables = LawTables {
            source,
            tables: &file.laws,
        };
        let parameters = tables.parameters(&entry);
        let loaded = load(&file)?;
        let built = build_law(source, &loaded, &file.law, hypothesis, &parameters)?;
        let place = (source, &place_of_initial);
        let mut point = started(built, &flux, segments).map_err(|error| located(place, error))?;
        let internal = internal(source, &point, &tables.initial(&entry))?;
        point.set_internal(internal)?;
        point.set_variant(variant);
        let names = drawable(&point);
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let figures = table_figures(source, &file.figures, &names)?;
        Ok(Self {
            point,
            title: file.title.clone(),
            figures,
            source: source.clone(),
            place_of_initial,
            file: Some(file),
            opener: opener.clone(),
        })
    }

    /// A driver whose path is not written in a driver file.
    pub(crate) fn assembled(
        source: &Source,
        built: BuiltLaw,
        (flux, internal): (Vector, Vec<f64>),
        segments: Vec<Segment>,
    ) -> Result<Self, Error> {
        let place_of_initial = 0..0;
        let place = (source, &place_of_initial);
        // The law may refuse the stress, whatever its variables.
        let mut point = started(built, &flux, segments).map_err(|error| located(place, error))?;
        point.set_internal(internal)?;
        Ok(Self {
            point,
            title: String::new(),
            figures: Vec::new(),
            source: source.clone(),
            place_of_initial,
            file: None,
            opener: Opener::default(),
        })
    }

    /// The driver itself.
    pub fn point(&self) -> &point::Driver {
        &self.point
    }

    /// The driver itself.
    pub fn point_mut(&mut self) -> &mut point::Driver {
        &mut self.point
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        self.source.path()
    }

    /// Text of the file.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// Title.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Curves of its columns.
    pub fn figures(&self) -> &[Figure] {
        &self.figures
    }

    /// The parameters that the file gives.
    pub fn parameters(&self) -> Option<&ParameterTable> {
        self.file.as_ref().map(|file| &file.parameters)
    }

    /// The same path with other values of some parameters; the law's library stays open.
    ///
    /// # Errors
    /// The law does not take them; the driver was not read from a driver file.
    pub fn with_parameters(&self, values: &[(String, ParameterValue)]) -> Result<Self, Error> {
        let Some(mut file) = self.file.clone() else {
            let message = format!("{} is no driver file", self.path().display());
            return Err(text::Error::Usage(message).into());
        };
        material::set_parameters(&mut file.parameters, values);
        let variant = self.point.variant().map(str::to_owned);
        let load = |_: &DriverFile| Ok(self.point.law().loaded().clone());
        let mut driver = Self::build(&self.opener, &self.source, variant, file, load)?;
        let point = driver.point_mut();
        point.set_increments(&self.point.segment_increments());
        point.stop_on(self.point.stop());
        Ok(driver)
    }

    /// Follows the path to its end; every row goes to `sink`.
    ///
    /// # Errors
    /// As [`point::Driver::run`], at the place in the file if it has one there.
    pub fn run(&self, mut sink: impl FnMut(&point::Row<'_>)) -> Result<point::Course, Error> {
        let course = self.point.run(|row| {
            sink(row);
            Ok::<_, point::Error>(())
        });
        course.map_err(|error| self.located(error))
    }

    /// An error of the driver, at its place in the file if it has one there.
    pub fn located(&self, error: point::Error) -> Error {
        located((&self.source, &self.place_of_initial), error)
    }
}

/// A driver that starts from the internal variables that its law gives.
fn started(
    built: BuiltLaw,
    flux: &Vector,
    segments: Vec<Segment>,
) -> Result<point::Driver, point::Error> {
    let n = built.law.n_components();
    let mut point = point::Driver::new(built.law, &flux[..n], segments)?;
    point.set_notes(built.warnings);
    Ok(point)
}

/// An error of a driver, at the place of its initial state if it is about that.
fn located((source, initial): (&Source, &Range<usize>), error: point::Error) -> Error {
    if !matches!(error, point::Error::InitialState { .. }) {
        return error.into();
    }
    let in_file = source.error(initial.clone(), error.to_string());
    match error.hint() {
        Some(hint) => in_file.hint(hint).into(),
        None => in_file.into(),
    }
}

/// Internal variables as given, and the law's where nothing is.
fn internal(source: &Source, point: &point::Driver, given: &Named<f64>) -> Result<Vec<f64>, Error> {
    let mut internal = point.internal().to_vec();
    let law = point.law();
    for (name, value) in given {
        let number = internal_variable(source, law, &law.description().id, name)?;
        internal[number] = finite(source, name.get_ref(), value)?;
    }
    Ok(internal)
}
