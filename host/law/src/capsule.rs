//! A failed call of a law in its own file: everything the call depends on, so that it can be
//! repeated bit for bit, without the case it comes from. Numbers are written with as many digits as lead back to them.

mod in_order;
mod library;

pub use library::{LibraryCapsule, LibraryPart};

use crate::call::PointStart;
use crate::description::{FormulationDescription, hypothesis_named};
use crate::foreign::Foreign;
use crate::library::probe::Form;
use crate::library::probe::call_log::Function;
use crate::{BatchFailure, Error, Law, LoadedLaw, Moment, Operator, Request, ShearZone, Site};
use abi::Hypothesis;
use abi::status::Outcome;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::{Path, PathBuf};
use text::{Source, suggestion, write::replace};
use toml::de::DeTable;

/// Name of the file in a results folder.
pub const FILE_NAME: &str = "failure.toml";
/// Version of the form of capsules.
const VERSION: u32 = 1;

/// Numbers by name.
type Named = IndexMap<String, f64>;

/// A failed call, and where it comes from.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Capsule {
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
    pub parameters: Named,
    call: CallPart,
    #[serde(default)]
    start: Values,
    #[serde(default, skip_serializing_if = "Values::is_empty")]
    end: Values,
    /// How a check has called it, if replaying it is to do the same.
    pub probe: Option<ProbePart>,
    /// The points of its batch behind the first one.
    #[serde(default, rename = "point", skip_serializing_if = "Vec::is_empty")]
    more: Vec<PointPart>,
    /// Points that were called for before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    before: Vec<PointPart>,
    /// The file it was read from.
    #[serde(skip)]
    source: Option<Source>,
}

/// The law of a capsule.
#[derive(Clone, Debug, Serialize, Deserialize)]
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
    /// The library as a file would name it, if it keeps no contract.
    foreign: Option<Foreign>,
    /// The zone that it fills, if the call is one of an interface that it is made to.
    pub shear_zone: Option<ShearZone>,
}

/// What became of a call.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutcomePart {
    /// Name of the outcome.
    pub status: String,
    /// The law's words.
    pub message: String,
    /// The smaller step that it asks for, as a fraction.
    pub step_factor: Option<f64>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CallPart {
    request: String,
    time: f64,
    time_increment: f64,
    /// Laws of the contract do not ask, nor for the next.
    moment: Option<Moment>,
    site: Option<Site>,
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
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PointPart {
    start: Values,
    #[serde(default, skip_serializing_if = "Values::is_empty")]
    end: Values,
}

/// Gradients, fluxes and internal variables by name: of a solid strains and stresses, of an interface jumps and tractions.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Values {
    #[serde(skip_serializing_if = "Named::is_empty")]
    strain: Named,
    #[serde(skip_serializing_if = "Named::is_empty")]
    jump: Named,
    #[serde(skip_serializing_if = "Named::is_empty")]
    stress: Named,
    #[serde(skip_serializing_if = "Named::is_empty")]
    traction: Named,
    #[serde(skip_serializing_if = "Named::is_empty")]
    internal: Named,
}

impl Values {
    fn of(hypothesis: Hypothesis, gradient: Named, flux: Named, internal: Named) -> Self {
        let none = Self {
            internal,
            ..Self::default()
        };
        if hypothesis.is_interface() {
            Self {
                jump: gradient,
                traction: flux,
                ..none
            }
        } else {
            Self {
                strain: gradient,
                stress: flux,
                ..none
            }
        }
    }

    fn gradient(&self) -> &Named {
        if self.jump.is_empty() {
            &self.strain
        } else {
            &self.jump
        }
    }

    fn flux(&self) -> &Named {
        if self.traction.is_empty() {
            &self.stress
        } else {
            &self.traction
        }
    }

    fn is_empty(&self) -> bool {
        [self.gradient(), self.flux(), &self.internal]
            .iter()
            .all(|values| values.is_empty())
    }
}

impl PointPart {
    fn of(
        point: &PointStart,
        hypothesis: Hypothesis,
        formulation: &FormulationDescription,
    ) -> Self {
        let components = |values: &[f64]| -> Named {
            let names = hypothesis.components().iter();
            let names = names.map(|name| (*name).to_owned());
            names.zip(values.iter().copied()).collect()
        };
        let ids = formulation.internal_variables.iter().map(|v| v.id.clone());
        let internal = ids.zip(point.state0.iter().copied()).collect();
        let (gradient, flux) = (components(&point.gradient0), components(&point.flux0));
        let gradient_end = components(&point.gradient1);
        Self {
            start: Values::of(hypothesis, gradient, flux, internal),
            end: Values::of(hypothesis, gradient_end, Named::new(), Named::new()),
        }
    }
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

/// The form of a call of a check that is as usual.
fn usual(request: &str, time: f64, time_increment: f64) -> Form {
    let named = REQUESTS.iter().find(|(name, _)| *name == request);
    let bits = match named.map(|(_, request)| *request) {
        Some(Request::Update(operator)) => operator.request(),
        Some(Request::InitialState) | None => 0,
    };
    Form {
        time,
        time_increment,
        ..Form::of(bits)
    }
}

impl LawPart {
    /// The library as a file would name it, called in this process, if it keeps no contract.
    pub fn foreign(&self) -> Option<Foreign> {
        let foreign = self.foreign.as_ref();
        foreign.map(|foreign| foreign.of_capsule(&self.library))
    }

    fn of(law: &LoadedLaw, hypothesis: Hypothesis) -> Option<Self> {
        let (description, library) = (law.description(), law.library());
        let path = std::path::absolute(library.path()).ok()?;
        let foreign = library.foreign();
        Some(Self {
            id: description.id.clone(),
            version: description.version.clone(),
            hypothesis: hypothesis.name().to_owned(),
            foreign: foreign.map(|foreign| foreign.of_capsule(&path)),
            library: path.to_string_lossy().into_owned().into(),
            sha256: library.sha256().to_owned(),
            shear_zone: law.shear_zone(),
        })
    }
}

impl Capsule {
    /// The capsule of a failed call; `None` if it is not known. `origin` says where it happened, by
    /// key.
    pub fn of(law: &Law, failure: &BatchFailure, origin: Vec<(&str, toml::Value)>) -> Option<Self> {
        let call = failure.call.as_deref()?;
        let loaded = law.loaded();
        let foreign = loaded.library().foreign();
        let part = PointPart::of(&call.start, law.hypothesis(), law.formulation());
        let origin = origin.into_iter();
        Some(Self {
            version: VERSION,
            law: LawPart::of(loaded, law.hypothesis())?,
            origin: origin.map(|(key, value)| (key.to_owned(), value)).collect(),
            outcome: OutcomePart::of(failure),
            parameters: parameters(loaded, law.parameters()),
            call: CallPart {
                request: name(call.request).to_owned(),
                time: call.time,
                time_increment: call.time_increment,
                moment: foreign.map(|_| call.moment),
                site: foreign.map(|_| call.site),
            },
            start: part.start,
            end: part.end,
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
        (hypothesis, values): (Hypothesis, &[f64]),
        (function, form): (Function, Form),
        points: &[PointStart],
        before: &[PointStart],
    ) -> Option<Self> {
        let part = |point: &PointStart| PointPart::of(point, hypothesis, formulation);
        let mut parts = points.iter().map(part);
        let first = parts.next();
        let (start, end) = first.map_or_else(Default::default, |p| (p.start, p.end));
        let request = match function {
            Function::Create => CREATE,
            Function::Destroy => DESTROY,
            Function::InitState => name(Request::InitialState),
            Function::Integrate => name(Request::Update(Operator::of_request(form.request))),
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
            version: VERSION,
            law: LawPart::of(law, hypothesis)?,
            origin: IndexMap::new(),
            outcome: OutcomePart::of_success(),
            parameters: parameters(law, values),
            call: CallPart {
                request: request.to_owned(),
                time: when.map_or(form.time, |(time, _)| time),
                time_increment: form.time_increment,
                moment: when.map(|(_, moment)| moment),
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
        let starts = self.start.gradient();
        let ends = &mut shorter.end;
        for (name, end) in ends.jump.iter_mut().chain(&mut ends.strain) {
            let start = starts.get(name).copied().unwrap_or_default();
            *end = start + fraction * (*end - start);
        }
        shorter
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
        usize::from(!self.start.flux().is_empty()) + self.more.len()
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
        let mut capsule: Self = text::parse_any_numbers(&source)?;
        capsule.source = Some(source);
        if capsule.version != VERSION {
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
        hypothesis_named(&self.law.hypothesis)
    }

    fn request(&self) -> Option<Request> {
        let named = |(name, _): &&(&str, Request)| *name == self.call.request;
        REQUESTS.iter().find(named).map(|(_, request)| *request)
    }
}

impl OutcomePart {
    fn of_success() -> Self {
        Self {
            status: status(Outcome::Ok).to_owned(),
            message: String::new(),
            step_factor: None,
        }
    }

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

/// Values of a law's parameters by id.
fn parameters(law: &LoadedLaw, values: &[f64]) -> Named {
    let ids = law.description().parameters.iter().map(|p| p.id.clone());
    ids.zip(values.iter().copied()).collect()
}

impl std::fmt::Display for Capsule {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = toml::to_string(self).map_err(|_| std::fmt::Error)?;
        write!(
            f,
            "# A call of a law that failed. `pilum replay` repeats it: numbers read back to the same \
             bits.\n{text}"
        )
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
            f64::NEG_INFINITY,
            f64::NAN,
        ];
        for value in values {
            let text = toml::to_string(&Named::from([("x".to_owned(), value)])).unwrap();
            let read: Named = toml::from_str(&text).unwrap();
            assert_eq!(read["x"].to_bits(), value.to_bits(), "{text}");
        }
    }
}
