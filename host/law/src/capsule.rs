//! A failed call of a law in its own file: everything the call depends on, so that it can be
//! repeated bit for bit, without the case it comes from.

mod library;

pub use library::{LibraryCapsule, LibraryPart};

use crate::Error;
use crate::FormulationDescription;
use crate::adapter::{Adapter, Externals, Foreign, Order};
use crate::description::words;
use crate::library::probe::call_log::Function;
use crate::library::probe::{Form, PointStart};
use crate::{BatchFailure, Law, LoadedLaw, Moment, Operator, PointCall, Request, ShearZone, Site};
use abi::Hypothesis;
use abi::raw;
use abi::status::Outcome;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::{Path, PathBuf};
use text::{Source, suggestion, toml_error, write::replace};
use toml::de::DeTable;

/// Name of the file in a results folder.
pub const FILE_NAME: &str = "failure.toml";

/// A failed call, and where it comes from.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Capsule {
    /// Version of this form.
    version: u32,
    /// Whose law was called.
    pub law: LawPart,
    /// Its origin, by key.
    #[serde(rename = "where", default)]
    pub origin: IndexMap<String, toml::Value>,
    /// What became of the call.
    pub outcome: OutcomePart,
    /// Parameters of the law, by id.
    #[serde(default)]
    pub parameters: IndexMap<String, f64>,
    call: CallPart,
    #[serde(default)]
    start: Values,
    #[serde(default)]
    end: Values,
    /// How a check has called it, if replaying it is to do the same.
    pub probe: Option<ProbePart>,
    /// The points of its batch behind the first one.
    #[serde(default, rename = "point")]
    more: Vec<PointPart>,
    /// Points that were called for before.
    #[serde(default)]
    before: Vec<PointPart>,
    /// The file it was read from.
    #[serde(skip)]
    source: Option<Source>,
}

/// The law of a capsule.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LawPart {
    /// Id of the law.
    pub id: String,
    /// Its version.
    pub version: String,
    /// Name of its hypothesis.
    pub hypothesis: String,
    /// Its library.
    pub library: PathBuf,
    /// SHA-256 of that.
    pub sha256: String,
    /// The program that the library is made for, if not for the contract.
    pub adapter: Option<Adapter>,
    /// What describes it.
    pub sidecar: Option<PathBuf>,
    /// What becomes of routines that nobody supplies.
    pub externals: Option<Externals>,
    /// How the routine leaves its stiffness.
    pub tangent_order: Option<Order>,
    /// The zone that it fills, if the call is one of an interface that it is made to.
    pub shear_zone: Option<ShearZone>,
}

/// What became of a call.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutcomePart {
    /// Name of the outcome.
    pub status: String,
    /// The law's words.
    pub message: String,
    /// The smaller step that it asks for, as a fraction.
    pub step_factor: Option<f64>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CallPart {
    request: String,
    time: f64,
    time_increment: f64,
    moment: Option<MomentPart>,
    site: Option<SitePart>,
}

/// A call as a check makes it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProbePart {
    /// Which function.
    pub function: Function,
    /// How it is called; as usual if left out.
    pub form: Option<Form>,
}

/// A point of a batch.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PointPart {
    start: Values,
    #[serde(default)]
    end: Values,
}

/// Number of the step; laws of the contract do not ask.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MomentPart {
    step: u32,
    increment: u32,
    start: f64,
    #[serde(default = "one")]
    length: f64,
    #[serde(default)]
    undrained: bool,
}

impl MomentPart {
    fn of(moment: Moment) -> Self {
        Self {
            step: moment.step,
            increment: moment.increment,
            start: moment.step_start,
            length: moment.step_length,
            undrained: moment.is_undrained,
        }
    }
}

/// How long a phase or segment takes where nothing is reported of it.
fn one() -> f64 {
    1.0
}

/// Where the point lies; laws of the contract do not ask.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SitePart {
    position: [f64; 2],
    length: f64,
    element: u32,
    point: u32,
}

/// Gradients, fluxes and internal variables by name.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Values {
    #[serde(alias = "strain")]
    jump: IndexMap<String, f64>,
    #[serde(alias = "stress")]
    traction: IndexMap<String, f64>,
    internal: IndexMap<String, f64>,
}

/// Names of the requests in files.
const REQUESTS: [(&str, Request); 4] = [
    ("fluxes", Request::Update(Operator::None)),
    (
        "fluxes and consistent tangent",
        Request::Update(Operator::Consistent),
    ),
    (
        "fluxes and elastic operator",
        Request::Update(Operator::Elastic),
    ),
    ("initial state", Request::InitialState),
];

/// Name in files of the request to `create`.
const CREATE: &str = "an instance";
/// Name in files of the request to `destroy`.
const DESTROY: &str = "the end of an instance";

/// The name of a request in files.
fn name(request: Request) -> &'static str {
    let mut all = REQUESTS.iter();
    all.find(|(_, other)| *other == request)
        .map_or(CREATE, |(name, _)| name)
}

/// The operator that a call of a check asks for.
fn operator(request: u32) -> Operator {
    if request & raw::PILUM_REQ_ELASTIC != 0 {
        Operator::Elastic
    } else if request & raw::PILUM_REQ_TANGENT != 0 {
        Operator::Consistent
    } else {
        Operator::None
    }
}

/// The form of a call of a check that is as usual.
fn usual(request: &str, time: f64, time_increment: f64) -> Form {
    let named = REQUESTS.iter().find(|(name, _)| *name == request);
    let bits = match named.map(|(_, request)| *request) {
        Some(Request::Update(Operator::Elastic)) => raw::PILUM_REQ_FLUX | raw::PILUM_REQ_ELASTIC,
        Some(Request::Update(Operator::Consistent)) => raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT,
        Some(Request::Update(Operator::None)) => raw::PILUM_REQ_FLUX,
        Some(Request::InitialState) | None => 0,
    };
    Form {
        time,
        time_increment,
        ..Form::of(bits)
    }
}

/// What capsules say of a library that keeps no contract, next to its file.
#[derive(Clone, Debug, Default)]
struct Made {
    adapter: Option<Adapter>,
    sidecar: Option<PathBuf>,
    externals: Option<Externals>,
    tangent_order: Option<Order>,
}

impl Made {
    fn of(foreign: Option<&Foreign>) -> Self {
        foreign.map_or_else(Self::default, |foreign| Self {
            adapter: Some(foreign.adapter),
            sidecar: foreign.sidecar.clone(),
            externals: foreign.externals,
            tangent_order: foreign.tangent_order,
        })
    }

    /// The library as a file would name it, called in this process, if it keeps no contract.
    fn foreign(self, library: &Path) -> Option<Foreign> {
        Some(Foreign {
            adapter: self.adapter?,
            library: library.to_owned(),
            sidecar: self.sidecar,
            in_process: true,
            record: None,
            records_once: false,
            externals: self.externals,
            scratch: None,
            tangent_order: self.tangent_order,
        })
    }
}

impl std::fmt::Display for Made {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let sidecar = self.sidecar.as_ref().map(|path| path.to_string_lossy());
        for (key, value) in [
            ("adapter", self.adapter.map(Adapter::name)),
            ("sidecar", sidecar.as_deref()),
            ("externals", self.externals.map(Externals::name)),
            ("tangent_order", self.tangent_order.map(Order::name)),
        ] {
            if let Some(value) = value {
                writeln!(f, "{key} = {}", text(value))?;
            }
        }
        Ok(())
    }
}

impl LawPart {
    fn made(&self) -> Made {
        Made {
            adapter: self.adapter,
            sidecar: self.sidecar.clone(),
            externals: self.externals,
            tangent_order: self.tangent_order,
        }
    }

    /// The library as a file would name it, called in this process, if it keeps no contract.
    pub fn foreign(&self) -> Option<Foreign> {
        self.made().foreign(&self.library)
    }

    fn of(law: &LoadedLaw, hypothesis: Hypothesis) -> Option<Self> {
        let description = law.description();
        let library = law.library();
        let made = Made::of(library.foreign());
        Some(Self {
            id: description.id.clone(),
            version: description.version.clone(),
            hypothesis: hypothesis.name().to_owned(),
            library: std::path::absolute(library.path()).ok()?,
            sha256: library.sha256().to_owned(),
            adapter: made.adapter,
            sidecar: made.sidecar,
            externals: made.externals,
            tangent_order: made.tangent_order,
            shear_zone: law.shear_zone(),
        })
    }
}

impl Capsule {
    /// The capsule of a failed call; `None` if it is not known. `origin` says where it happened, by
    /// key.
    pub fn of(law: &Law, failure: &BatchFailure, origin: Vec<(&str, toml::Value)>) -> Option<Self> {
        let call = failure.call.as_deref()?;
        let hypothesis = law.hypothesis();
        let description = law.description();
        let components = |values: &[f64]| -> IndexMap<String, f64> {
            let names = hypothesis.components().iter();
            let names = names.map(|name| (*name).to_owned());
            names.zip(values.iter().copied()).collect()
        };
        let variables = law.formulation().internal_variables.iter();
        let ids = description.parameters.iter().map(|p| p.id.clone());
        let request = REQUESTS.iter().find(|(_, r)| *r == call.request)?.0;
        let foreign = law.library().foreign();
        Some(Self {
            version: 1,
            law: LawPart::of(law.loaded(), hypothesis)?,
            origin: origin
                .into_iter()
                .map(|(key, value)| (key.to_owned(), value))
                .collect(),
            outcome: OutcomePart::of(failure),
            parameters: ids.zip(law.parameters().iter().copied()).collect(),
            call: CallPart {
                request: request.to_owned(),
                time: call.time,
                time_increment: call.time_increment,
                moment: foreign.map(|_| MomentPart::of(call.moment)),
                site: foreign.map(|_| SitePart {
                    position: call.site.position,
                    length: call.site.length,
                    element: call.site.element,
                    point: call.site.point,
                }),
            },
            start: Values {
                jump: components(&call.gradient),
                traction: components(&call.flux),
                internal: variables
                    .map(|v| v.id.clone())
                    .zip(call.state.iter().copied())
                    .collect(),
            },
            end: Values {
                jump: components(&call.gradient_end),
                ..Values::default()
            },
            probe: None,
            more: Vec::new(),
            before: Vec::new(),
            source: None,
        })
    }

    /// The capsule of a call as a check makes it, for these points, after a call for others. `None` if the
    /// library has no place.
    pub fn of_probe(
        law: &LoadedLaw,
        formulation: &FormulationDescription,
        (hypothesis, parameters): (Hypothesis, &[f64]),
        (function, form): (Function, Form),
        points: &[PointStart],
        before: &[PointStart],
    ) -> Option<Self> {
        let named = |values: &[f64]| -> IndexMap<String, f64> {
            let names = hypothesis.components().iter();
            let names = names.map(|name| (*name).to_owned());
            names.zip(values.iter().copied()).collect()
        };
        let part = |point: &PointStart| {
            let ids = formulation.internal_variables.iter().map(|v| v.id.clone());
            PointPart {
                start: Values {
                    jump: named(&point.gradient0),
                    traction: named(&point.flux0),
                    internal: ids.zip(point.state0.iter().copied()).collect(),
                },
                end: Values {
                    jump: named(&point.gradient1),
                    ..Values::default()
                },
            }
        };
        let mut parts = points.iter().map(part);
        let first = parts.next();
        let (start, end) = first.map_or_else(Default::default, |p| (p.start, p.end));
        let ids = law.description().parameters.iter().map(|p| p.id.clone());
        let request = match function {
            Function::Create => CREATE,
            Function::Destroy => DESTROY,
            Function::InitState => name(Request::InitialState),
            Function::Integrate => name(Request::Update(operator(form.request))),
        };
        let is_usual = form == usual(request, form.time, form.time_increment);
        // Those that keep no contract are called as in a run; before the first call there is none.
        let is_own = law.library().foreign().is_none() || function == Function::Create;
        // A routine is told which increment it is.
        let when = points.first().filter(|_| !is_own);
        let when = when.map(|point| form.when(point));
        let probe = is_own.then_some(ProbePart {
            function,
            form: (!is_usual).then_some(form),
        });
        Some(Self {
            version: 1,
            law: LawPart::of(law, hypothesis)?,
            origin: IndexMap::new(),
            outcome: OutcomePart {
                status: status(Outcome::Ok).to_owned(),
                message: String::new(),
                step_factor: None,
            },
            parameters: ids.zip(parameters.iter().copied()).collect(),
            call: CallPart {
                request: request.to_owned(),
                time: when.map_or(form.time, |(time, _)| time),
                time_increment: form.time_increment,
                moment: when.map(|(_, moment)| MomentPart::of(moment)),
                site: None,
            },
            start,
            end,
            probe,
            more: parts.collect(),
            before: before.iter().map(part).collect(),
            source: None,
        })
    }

    /// How a check has called it.
    pub fn form(&self) -> Form {
        let form = self.probe.and_then(|probe| probe.form);
        let (time, length) = (self.call.time, self.call.time_increment);
        form.unwrap_or_else(|| usual(&self.call.request, time, length))
    }

    /// The same with a part of the increment alone.
    #[must_use]
    pub fn shortened(&self, fraction: f64) -> Self {
        let mut shorter = self.clone();
        for (name, end) in &mut shorter.end.jump {
            let start = self.start.jump.get(name).copied().unwrap_or_default();
            *end = start + fraction * (*end - start);
        }
        shorter
    }

    /// Points of the batch, and those that were called for before, in the order of this law's values.
    ///
    /// # Errors
    /// A name that the law does not know, or that is missing.
    pub fn batch(
        &self,
        hypothesis: Hypothesis,
        formulation: &FormulationDescription,
    ) -> Result<[Vec<PointStart>; 2], Error> {
        let (gradient, flux) = words(hypothesis);
        let point = |start: &Values, end: &Values, key: &str| -> Result<PointStart, Error> {
            let components = |values: &IndexMap<String, f64>, what: &str| {
                if values.is_empty() {
                    return Ok(Vec::new());
                }
                let names = hypothesis.components().iter().copied();
                self.in_order(values, names, &[key, what], what)
            };
            let variables = formulation.internal_variables.iter();
            let state0 = if start.internal.is_empty() {
                Vec::new()
            } else {
                let ids = variables.map(|v| v.id.as_str());
                let what = "internal variable";
                self.in_order(&start.internal, ids, &[key, "internal"], what)?
            };
            Ok(PointStart {
                gradient0: components(&start.jump, gradient)?,
                gradient1: components(&end.jump, gradient)?,
                flux0: components(&start.traction, flux)?,
                state0,
            })
        };
        let all = |parts: &[PointPart], key: &str| -> Result<Vec<PointStart>, Error> {
            let parts = parts.iter();
            parts
                .map(|part| point(&part.start, &part.end, key))
                .collect()
        };
        let mut points = Vec::new();
        if !self.start.traction.is_empty() {
            points.push(point(&self.start, &self.end, "start")?);
        }
        points.extend(all(&self.more, "point")?);
        Ok([points, all(&self.before, "before")?])
    }

    /// The same for one of its points alone.
    #[must_use]
    pub fn of_one(&self, i: usize) -> Self {
        let mut one = self.clone();
        if let Some(point) = i.checked_sub(1).and_then(|i| self.more.get(i)) {
            one.start = point.start.clone();
            one.end = point.end.clone();
        }
        one.more.clear();
        one
    }

    /// Number of points.
    pub fn n_points(&self) -> usize {
        usize::from(!self.start.traction.is_empty()) + self.more.len()
    }

    /// Reads a capsule.
    ///
    /// # Errors
    /// [`text::Error::Unreadable`]; [`text::Error::Input`] at the place that does not fit.
    #[inline]
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::of_source(Source::read(path)?)
    }

    /// Takes the text of a capsule.
    ///
    /// # Errors
    /// At the place that does not fit.
    // Compiled where it is used, in rooms that are not optimised: reading this and locks takes a seventh
    // of what this crate takes to compile.
    #[inline]
    pub fn of_source(source: Source) -> Result<Self, Error> {
        let mut capsule: Self =
            toml::from_str(source.text()).map_err(|why| toml_error(&source, &why))?;
        capsule.source = Some(source);
        if capsule.version != 1 {
            let message = format!("this is a capsule of version {}", capsule.version);
            return Err(capsule.error(&["version"], message));
        }
        if capsule.hypothesis().is_none() {
            let message = format!("there is no hypothesis `{}`", capsule.law.hypothesis);
            let known = Hypothesis::ALL.map(Hypothesis::name);
            let hint = suggestion(&capsule.law.hypothesis, known);
            return Err(capsule
                .error(&["law", "hypothesis"], message)
                .with_hint(&hint));
        }
        if capsule.request().is_none() && capsule.probe.is_none() {
            let message = format!("there is no request `{}`", capsule.call.request);
            let hint = suggestion(&capsule.call.request, REQUESTS.map(|(name, _)| name));
            return Err(capsule
                .error(&["call", "request"], message)
                .with_hint(&hint));
        }
        Ok(capsule)
    }

    /// An error about what stands under these keys, or about the last of them that is there.
    pub fn error(&self, keys: &[&str], message: impl Into<String>) -> Error {
        let Some(source) = &self.source else {
            return text::Error::Usage(message.into()).into();
        };
        source.error(place(source.text(), keys), message).into()
    }

    /// Id of the law.
    pub fn law_id(&self) -> &str {
        &self.law.id
    }

    /// Writes the capsule.
    ///
    /// # Errors
    /// [`text::Error::Unwritable`].
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        Ok(replace(path, self.to_string())?)
    }

    /// The hypothesis of the law.
    pub fn hypothesis(&self) -> Option<Hypothesis> {
        let mut all = Hypothesis::ALL.into_iter();
        all.find(|h| h.name() == self.law.hypothesis)
    }

    fn request(&self) -> Option<Request> {
        let named = |(name, _): &&(&str, Request)| *name == self.call.request;
        REQUESTS.iter().find(named).map(|(_, request)| *request)
    }
}

impl OutcomePart {
    /// That of a failure.
    pub fn of(failure: &BatchFailure) -> Self {
        Self {
            status: status(failure.outcome).to_owned(),
            message: failure.message.clone(),
            step_factor: failure.factor,
        }
    }
}

/// Name of an outcome in files.
pub fn status(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Ok => "ok",
        Outcome::Unreliable => "unreliable",
        Outcome::CutStep => "cut step",
        Outcome::Argument => "argument",
        Outcome::Parameter => "parameter",
        Outcome::Unsupported => "unsupported",
        Outcome::Domain => "domain",
        Outcome::Numeric => "numeric",
        Outcome::Internal => "internal",
        Outcome::Unknown(_) => "unknown",
    }
}

/// A number that reads back to the same bits.
fn real(value: f64) -> String {
    if value.is_nan() {
        "nan".to_owned()
    } else {
        format!("{value:?}")
    }
}

fn text(text: &str) -> String {
    toml::Value::from(text).to_string()
}

fn table(values: &IndexMap<String, f64>) -> String {
    let entries: Vec<String> = values
        .iter()
        .map(|(name, value)| format!("{name} = {}", real(*value)))
        .collect();
    format!("{{ {} }}", entries.join(", "))
}

impl std::fmt::Display for Capsule {
    #[expect(clippy::too_many_lines, reason = "the file from its head to its end")]
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (gradient, flux) = self.hypothesis().map_or(("jump", "traction"), words);
        writeln!(
            f,
            "# A call of a law that failed. `pilum replay` repeats it: numbers read back to the same \
             bits.\nversion = {}\n",
            self.version
        )?;
        let law = &self.law;
        writeln!(
            f,
            "[law]\nid = {}\nversion = {}\nhypothesis = {}\nlibrary = {}\nsha256 = {}",
            text(&law.id),
            text(&law.version),
            text(&law.hypothesis),
            text(&law.library.to_string_lossy()),
            text(&law.sha256)
        )?;
        write!(f, "{}", law.made())?;
        if let Some(zone) = law.shear_zone {
            writeln!(f, "shear_zone = {zone}")?;
        }
        writeln!(f)?;
        writeln!(f, "[where]")?;
        for (key, value) in &self.origin {
            writeln!(f, "{key} = {value}")?;
        }
        let outcome = &self.outcome;
        writeln!(
            f,
            "\n[outcome]\nstatus = {}\nmessage = {}",
            text(&outcome.status),
            text(&outcome.message)
        )?;
        if let Some(factor) = outcome.step_factor {
            writeln!(f, "step_factor = {}", real(factor))?;
        }
        writeln!(f, "\n[parameters]")?;
        for (id, value) in &self.parameters {
            writeln!(f, "{id} = {}", real(*value))?;
        }
        writeln!(
            f,
            "\n[call]\nrequest = {}\ntime = {}\ntime_increment = {}",
            text(&self.call.request),
            real(self.call.time),
            real(self.call.time_increment)
        )?;
        if let Some(moment) = &self.call.moment {
            let (step, increment) = (moment.step, moment.increment);
            let [start, length] = [moment.start, moment.length].map(real);
            let undrained = if moment.undrained {
                ", undrained = true"
            } else {
                ""
            };
            writeln!(
                f,
                "moment = {{ step = {step}, increment = {increment}, start = {start}, length = {length}{undrained} }}"
            )?;
        }
        if let Some(site) = &self.call.site {
            let [x, y] = site.position.map(real);
            writeln!(
                f,
                "site = {{ position = [{x}, {y}], length = {}, element = {}, point = {} }}",
                real(site.length),
                site.element,
                site.point
            )?;
        }
        writeln!(f, "\n[start]")?;
        let entries = |values: &Values| -> Vec<String> {
            [
                (gradient, &values.jump),
                (flux, &values.traction),
                ("internal", &values.internal),
            ]
            .into_iter()
            .filter(|(_, values)| !values.is_empty())
            .map(|(name, values)| format!("{name} = {}", table(values)))
            .collect()
        };
        entries(&self.start)
            .iter()
            .try_for_each(|line| writeln!(f, "{line}"))?;
        if !self.end.jump.is_empty() {
            writeln!(f, "\n[end]\n{gradient} = {}", table(&self.end.jump))?;
        }
        if let Some(probe) = &self.probe {
            let whole = toml::Value::try_from(probe).map_err(|_| std::fmt::Error)?;
            writeln!(f, "\n[probe]")?;
            for (key, value) in whole.as_table().into_iter().flatten() {
                writeln!(f, "{key} = {value}")?;
            }
        }
        for (key, points) in [("point", &self.more), ("before", &self.before)] {
            for point in points {
                writeln!(
                    f,
                    "\n[[{key}]]\nstart = {{ {} }}",
                    entries(&point.start).join(", ")
                )?;
                if !point.end.jump.is_empty() {
                    writeln!(f, "end = {{ {} }}", entries(&point.end).join(", "))?;
                }
            }
        }
        Ok(())
    }
}

/// Place of the value under these keys, or else of the last key that exists; for a whole table, of
/// its head.
fn place(text: &str, keys: &[&str]) -> Range<usize> {
    let mut at = 0..0;
    let Ok(root) = DeTable::parse(text) else {
        return at;
    };
    let mut table = Some(root.get_ref());
    for key in keys {
        let found = table.and_then(|table| table.iter().find(|(name, _)| name.get_ref() == key));
        let Some((name, value)) = found else { break };
        table = value.get_ref().as_table();
        at = if table.is_some() {
            name.span()
        } else {
            value.span()
        };
    }
    at
}

impl Capsule {
    /// The values of a table in the order of some names. `keys`: what leads to the table.
    ///
    /// # Errors
    /// The name that is missing, or too much.
    pub fn in_order<'a>(
        &self,
        values: &IndexMap<String, f64>,
        names: impl Iterator<Item = &'a str> + Clone,
        keys: &[&str],
        what: &str,
    ) -> Result<Vec<f64>, Error> {
        if let Some(other) = values.keys().find(|key| !names.clone().any(|n| n == *key)) {
            let keys = [keys, &[other]].concat();
            let names: Vec<&str> = names.collect();
            let message = format!("law `{}` has no {what} `{other}`", self.law.id);
            return Err(self
                .error(&keys, message)
                .with_hint(&suggestion(other, names)));
        }
        names
            .map(|name| {
                let value = values.get(name).copied();
                value.ok_or_else(|| self.error(keys, format!("the {what} `{name}` is missing")))
            })
            .collect()
    }

    /// The call, with its values in the order of this law.
    ///
    /// # Errors
    /// A name that the law does not know, or that is missing.
    pub fn point_call(&self, law: &Law) -> Result<PointCall, Error> {
        let request = self.request().ok_or_else(|| {
            let message = format!("there is no request `{}`", self.call.request);
            self.error(&["call", "request"], message)
        })?;
        let (gradient, flux) = words(law.hypothesis());
        let components = |values: &IndexMap<String, f64>, part: &str, what: &str| {
            if values.is_empty() && request == Request::InitialState {
                return Ok(Vec::new());
            }
            let names = law.hypothesis().components().iter().copied();
            self.in_order(values, names, &[part, what], what)
        };
        let variables = law.formulation().internal_variables.iter();
        let state = if request == Request::InitialState {
            Vec::new()
        } else {
            let ids = variables.map(|v| v.id.as_str());
            self.in_order(
                &self.start.internal,
                ids,
                &["start", "internal"],
                "internal variable",
            )?
        };
        Ok(PointCall {
            request,
            time: self.call.time,
            time_increment: self.call.time_increment,
            gradient: components(&self.start.jump, "start", gradient)?,
            gradient_end: components(&self.end.jump, "end", gradient)?,
            flux: components(&self.start.traction, "start", flux)?,
            state,
            moment: self
                .call
                .moment
                .map_or_else(Moment::default, |moment| Moment {
                    step: moment.step,
                    increment: moment.increment,
                    step_start: moment.start,
                    step_length: moment.length,
                    is_undrained: moment.undrained,
                }),
            site: self.call.site.map_or_else(Site::default, |site| Site {
                position: site.position,
                length: site.length,
                element: site.element,
                point: site.point,
            }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_to_the_same_bits() {
        let values = [
            0.1 + 0.2,
            -0.0,
            f64::MIN_POSITIVE,
            5e-324,
            f64::MAX,
            1e16,
            -1.0 / 3.0,
            f64::INFINITY,
        ];
        for value in values {
            let line = format!("x = {}", real(value));
            let read: IndexMap<String, f64> = toml::from_str(&line).unwrap();
            assert_eq!(read["x"].to_bits(), value.to_bits(), "{line}");
        }
        let read: IndexMap<String, f64> =
            toml::from_str(&format!("x = {}", real(f64::NAN))).unwrap();
        assert!(read["x"].is_nan());
    }
}
