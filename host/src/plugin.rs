//! Laws from shared libraries: finding, opening, building and calling them.

pub mod adapter;
#[cfg(unix)]
pub(crate) mod calls;
#[cfg(not(unix))]
#[path = "plugin/calls/none.rs"]
pub(crate) mod calls;
mod description;
mod image;
#[cfg(unix)]
pub mod isolate;
mod library;
mod search;
mod trust;
pub mod vetting;

pub use description::{
    Bounds, FormulationDescription, InternalVariable, LawDescription, ParameterDescription, Tangent,
};
#[doc(hidden)]
pub use library::describe_memory;
pub use library::{Strided, probe};
pub use search::SearchPath;
pub use trust::Trust;

use crate::custody;
use crate::error::Error;
use abi::Hypothesis;
use abi::raw::{self, Status};
use abi::status::Outcome;
use adapter::{Foreign, ForeignInstance, ForeignLaw};
use calls::Doing;
use image::Image;
#[cfg(target_os = "linux")]
pub(crate) use library::SharedMemory;
use library::{Call, LawHandle, OwnedInstance};
use sha2::{Digest, Sha256};
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

/// An opened library. It is never unloaded.
#[derive(Debug)]
pub struct Library {
    path: PathBuf,
    sha256: String,
    warnings: Vec<String>,
    stamp: Option<Stamp>,
    laws: Vec<(LawDescription, Origin)>,
    foreign: Option<Foreign>,
    /// SHA-256 of the file that describes it, where it does not do so itself.
    sidecar: Option<String>,
}

/// Where a law is called.
#[derive(Clone, Debug)]
enum Origin {
    /// In this process.
    Here(LawHandle),
    /// In this process, by an adapter.
    Foreign(Arc<dyn ForeignLaw>),
    /// In worker processes.
    #[cfg(unix)]
    Apart {
        /// Calls of one material must follow one another.
        is_serial: bool,
    },
}

/// What changes with a file's contents. Within one process a file with an equal stamp is not
/// hashed again.
type Stamp = (u64, SystemTime);

fn stamp(path: &Path) -> Option<Stamp> {
    let metadata = path.metadata().ok()?;
    Some((metadata.len(), metadata.modified().ok()?))
}

/// Libraries opened by this process so far. Equal bytes are opened once, wherever they lie.
static OPENED: Mutex<Vec<Arc<Library>>> = Mutex::new(Vec::new());

impl Library {
    /// Opens a library: permissions, hash, handshake, description, in this order.
    ///
    /// # Errors
    /// [`Error::Plugin`] with the path and what is wrong.
    pub fn open(path: &Path) -> Result<Arc<Self>, Error> {
        Self::open_if(path, |_| Ok(()))
    }

    /// Opens a library whose SHA-256 is approved; nothing of it runs before.
    ///
    /// # Errors
    /// As [`Library::open`], and those of `approve`.
    pub fn open_if(
        path: &Path,
        approve: impl Fn(&str) -> Result<(), Error>,
    ) -> Result<Arc<Self>, Error> {
        let mut opened = OPENED.lock().unwrap_or_else(PoisonError::into_inner);
        let stamp = stamp(path);
        let known = |library: &&Arc<Self>| library.path == path && library.stamp == stamp;
        if let Some(library) = opened.iter().find(known).filter(|_| stamp.is_some()) {
            approve(&library.sha256)?;
            return Ok(Arc::clone(library));
        }
        let fault = |why| Error::plugin(format!("library {} {why}", path.display()));
        let mut image = Image::read(path).map_err(fault)?;
        approve(&image.sha256)?;
        let sha256 = image.sha256.clone();
        let warnings = std::mem::take(&mut image.warnings);
        let same = opened.iter().find(|library| library.sha256 == sha256);
        let laws = if let Some(library) = same {
            library.laws.clone()
        } else {
            Self::laws_of(path, image)?
        };
        let library = Arc::new(Self {
            path: path.to_owned(),
            sha256,
            warnings,
            stamp,
            laws,
            sidecar: None,
            foreign: None,
        });
        opened.push(Arc::clone(&library));
        Ok(library)
    }

    /// Opens the library in this process, after it was tried in another, or asks a worker.
    fn laws_of(path: &Path, image: Image) -> Result<Vec<(LawDescription, Origin)>, Error> {
        let unusable = |why| Error::plugin(format!("library {}: {why}", path.display()));
        let trust = Trust::current();
        #[cfg(unix)]
        if trust.isolate.is_some() {
            return isolate::describe(path, &image.sha256).map_err(unusable);
        }
        if trust.probe {
            vetting::vet(path, &image.sha256)?;
        }
        let laws = library::open(path, image).map_err(unusable)?.laws;
        let here = |(law, handle)| (law, Origin::Here(handle));
        Ok(laws.into_iter().map(here).collect())
    }

    /// Opens a library that is made for another program, if its SHA-256 is approved. Its code runs
    /// in worker processes unless it is said to run in this one.
    ///
    /// # Errors
    /// [`Error::Plugin`] with the path and what is wrong, and those of `approve`.
    pub fn open_foreign(
        foreign: &Foreign,
        approve: impl Fn(&str) -> Result<(), Error>,
    ) -> Result<Arc<Self>, Error> {
        let path = &foreign.library;
        let fault = |why: String| Error::plugin(format!("library {} {why}", path.display()));
        let mut image = Image::read(path).map_err(fault)?;
        approve(&image.sha256)?;
        if cfg!(not(unix)) && !foreign.in_process {
            return Err(fault(
                "can only run in this process here: `in_process = true`".to_owned(),
            ));
        }
        let foreign = &foreign.completed();
        let opened = adapter::open(foreign, &image)?;
        let (externals, scratch) = opened.wishes;
        let foreign = Foreign {
            externals: foreign.externals.or(externals),
            scratch: foreign.scratch.or(scratch),
            ..foreign.clone()
        };
        #[cfg(unix)]
        let apart = !foreign.in_process || Trust::current().isolate.is_some();
        let origin = |law: Arc<dyn ForeignLaw>| {
            #[cfg(unix)]
            if apart {
                let is_serial = law.is_serial();
                return Origin::Apart { is_serial };
            }
            Origin::Foreign(law)
        };
        Ok(Arc::new(Self {
            path: path.clone(),
            warnings: std::mem::take(&mut image.warnings),
            sha256: image.sha256.clone(),
            stamp: None,
            laws: opened
                .laws
                .into_iter()
                .map(|(description, law)| (description, origin(law)))
                .collect(),
            sidecar: opened.sidecar,
            foreign: Some(foreign),
        }))
    }

    /// How it is named, if it is made for another program.
    pub fn foreign(&self) -> Option<&Foreign> {
        self.foreign.as_ref()
    }

    /// SHA-256 of the file that describes it, if there is one.
    pub fn sidecar_sha256(&self) -> Option<&str> {
        self.sidecar.as_deref()
    }

    /// Where the library was found.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it lies where the program's own laws do.
    pub fn is_beside_program(&self) -> bool {
        let folder = self.path.parent().map(Path::canonicalize);
        let Some(Ok(folder)) = folder else {
            return false;
        };
        let mut own = search::beside_program().into_iter();
        own.any(|own| own.canonicalize().is_ok_and(|own| own == folder))
    }

    /// SHA-256 of the file, in hexadecimal digits.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// What the user should know about the file.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Descriptions of its laws.
    pub fn laws(&self) -> impl Iterator<Item = &LawDescription> {
        self.laws.iter().map(|(description, _)| description)
    }

    /// The law with this id.
    pub fn law(self: &Arc<Self>, id: &str) -> Option<LoadedLaw> {
        let number = self
            .laws
            .iter()
            .position(|(description, _)| description.id == id)?;
        Some(LoadedLaw {
            library: Arc::clone(self),
            number,
        })
    }
}

/// SHA-256 of some bytes, in hexadecimal digits.
pub fn hexadecimal_sha256(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

pub(crate) fn hexadecimal(digest: &[u8]) -> String {
    digest
        .iter()
        .fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

/// A law of an opened library, without parameters yet.
#[derive(Clone, Debug)]
pub struct LoadedLaw {
    library: Arc<Library>,
    number: usize,
}

/// Why a law cannot be built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CreateFailure {
    /// The parameter to change, if the law names one.
    pub parameter: Option<String>,
    /// Why.
    pub reason: String,
    /// The fault is the library's, not the parameter's.
    pub library_at_fault: bool,
}

impl LoadedLaw {
    /// Its description.
    pub fn description(&self) -> &LawDescription {
        &self.library.laws[self.number].0
    }

    /// Its library.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// Calls `create` as a check does.
    ///
    /// # Errors
    /// There is no memory, or the law is in a worker process.
    pub fn probe(&self, form: &probe::CreateForm<'_>) -> std::io::Result<probe::Created> {
        probe::create(self.here()?, form)
    }

    /// Calls `destroy` with null.
    pub fn destroy_nothing(&self) {
        if let Ok(law) = self.here() {
            probe::destroy_nothing(law);
        }
    }

    /// The law in this process.
    fn here(&self) -> std::io::Result<LawHandle> {
        match self.library.laws[self.number].1 {
            Origin::Here(law) => Ok(law),
            _ => Err(std::io::Error::other("the law is not one of this process")),
        }
    }

    /// Fixes the parameters (in declared order; NaN: left out) under a hypothesis.
    ///
    /// # Errors
    /// The law's refusal, or a defect of the library.
    pub fn build(&self, hypothesis: Hypothesis, parameters: &[f64]) -> Result<Law, CreateFailure> {
        let (description, origin) = &self.library.laws[self.number];
        let defect = |reason: &str| CreateFailure {
            parameter: None,
            reason: reason.to_owned(),
            library_at_fault: true,
        };
        let formulation = description
            .formulation(hypothesis)
            .ok_or_else(|| defect("the hypothesis is not offered"))?
            .clone();
        let index = formulation.index;
        let name = calls::name(&format!(
            "law `{}` of library {}",
            description.id,
            self.library.path.display()
        ));
        calls::remember_process();
        let create = || match origin {
            Origin::Here(handle) => handle.create(index, parameters).map(LawInstance::Here),
            Origin::Foreign(law) => law.create(hypothesis, parameters).map(LawInstance::Foreign),
            #[cfg(unix)]
            Origin::Apart { is_serial } => {
                let library = &self.library;
                let law = (self.number, index);
                isolate::IsolatedInstance::create(library, law, parameters, *is_serial)
                    .map(|apart| LawInstance::Apart(Box::new(apart)))
            }
        };
        let created = calls::calling(name, Doing::Create, 0, Moment::default(), create);
        let changes = custody::restore().map_err(|why| defect(&why))?;
        let instance = created.map_err(|(status, message)| {
            let parameter = message
                .split_once(':')
                .map(|(id, _)| id.trim())
                .filter(|id| description.parameters.iter().any(|p| p.id == *id))
                .map(str::to_owned);
            CreateFailure {
                parameter,
                reason: message,
                library_at_fault: status != raw::PILUM_E_PARAMETER && status != raw::PILUM_E_DOMAIN,
            }
        })?;
        Ok(Law {
            loaded: self.clone(),
            hypothesis,
            formulation,
            parameters: parameters.to_vec(),
            instance,
            name,
            changes,
        })
    }
}

/// A law with its parameters fixed under a hypothesis: what elements call.
#[derive(Debug)]
pub struct Law {
    loaded: LoadedLaw,
    hypothesis: Hypothesis,
    formulation: FormulationDescription,
    parameters: Vec<f64>,
    instance: LawInstance,
    /// What it is called where calls are watched.
    name: u64,
    /// What it had changed of the process as it was built.
    changes: Vec<String>,
}

/// What a library made of the parameters, in this process or in workers.
#[derive(Debug)]
enum LawInstance {
    Here(OwnedInstance),
    Foreign(Box<dyn ForeignInstance>),
    #[cfg(unix)]
    Apart(Box<isolate::IsolatedInstance>),
}

impl LawInstance {
    /// Asks for initial internal variables. `None` if the law has no `init_state`.
    fn init_state(&self, call: Call<'_>) -> Option<(Status, String)> {
        match self {
            Self::Here(instance) => instance.init_state(call),
            Self::Foreign(instance) => instance.init_state(call),
            #[cfg(unix)]
            Self::Apart(instance) => instance.init_state(call),
        }
    }

    /// Carries the points over the increment. Returns the most severe status and a message.
    fn integrate(&self, call: Call<'_>) -> (Status, String) {
        match self {
            Self::Here(instance) => instance.integrate(call),
            Self::Foreign(instance) => instance.integrate(call),
            #[cfg(unix)]
            Self::Apart(instance) => instance.integrate(call),
        }
    }

    fn take_overwritten(&self) -> Vec<String> {
        match self {
            Self::Here(_) => Vec::new(),
            Self::Foreign(instance) => instance.take_overwritten(),
            #[cfg(unix)]
            Self::Apart(instance) => instance.take_overwritten(),
        }
    }
}

/// Which operator a call computes beside the fluxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// None.
    None,
    /// The tangent consistent with the update.
    Consistent,
    /// The elastic operator.
    Elastic,
}

/// Where an integration point lies. Laws of the contract do not ask; routines made for other
/// programs do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Coordinates.
    pub position: [f64; 2],
    /// Characteristic length of the element.
    pub length: f64,
    /// Element within its group, from 1.
    pub element: u32,
    /// Integration point within the element, from 1.
    pub point: u32,
}

impl Default for Site {
    /// A point by itself.
    fn default() -> Self {
        Self {
            position: [0.0; 2],
            length: 1.0,
            element: 1,
            point: 1,
        }
    }
}

/// Which step of the loading it is, for routines that ask.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Phase, or segment of a driver, from 1.
    pub step: u32,
    /// Increment of it, from 1.
    pub increment: u32,
    /// Time at which it started.
    pub step_start: f64,
}

impl Default for Moment {
    /// The first increment of all.
    fn default() -> Self {
        Self {
            step: 1,
            increment: 1,
            step_start: 0.0,
        }
    }
}

/// Points of a batch at the start of an increment, and the gradients at its end.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// Number of points.
    pub n_points: usize,
    /// Gradients at the start, and their place.
    pub gradient: (&'a [f64], Strided),
    /// Gradients at the end, and their place.
    pub gradient_end: (&'a [f64], Strided),
    /// Fluxes at the start, and their place.
    pub flux: (&'a [f64], Strided),
    /// Internal variables at the start, point by point.
    pub state: &'a [f64],
    /// Time at the start.
    pub time: f64,
    /// Time increment.
    pub time_increment: f64,
    /// Which step and increment it is.
    pub moment: Moment,
    /// Where the points lie; empty if the law does not ask ([`Law::asks_for_sites`]).
    pub sites: &'a [Site],
}

/// Where the results of a call go.
#[derive(Debug)]
pub struct End<'a> {
    /// Fluxes, and their place.
    pub flux: (&'a mut [f64], Strided),
    /// Internal variables, point by point.
    pub state: &'a mut [f64],
    /// Operators, point by point, row-major; may be empty if none is wanted.
    pub operator: &'a mut [f64],
}

/// Why a batch cannot be used. The outputs are garbage then.
#[derive(Clone, Debug, PartialEq)]
pub struct BatchFailure {
    /// The first of the worst points.
    pub point: usize,
    /// What the law said of it.
    pub outcome: Outcome,
    /// In words; empty if the law gave none.
    pub message: String,
    /// The smallest step factor asked for, if only smaller steps are asked for.
    pub factor: Option<f64>,
    /// What the law was asked at the point.
    pub call: Option<Box<PointCall>>,
}

/// What a call asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// An update, with an operator or none.
    Update(Operator),
    /// Initial internal variables.
    InitialState,
}

/// A call of a law for one point: all that the answer depends on, beside the law and its
/// parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct PointCall {
    /// What is asked for.
    pub request: Request,
    /// Time at the start.
    pub time: f64,
    /// Time increment.
    pub time_increment: f64,
    /// Gradient at the start.
    pub gradient: Vec<f64>,
    /// Gradient at the end.
    pub gradient_end: Vec<f64>,
    /// Flux at the start.
    pub flux: Vec<f64>,
    /// Internal variables at the start.
    pub state: Vec<f64>,
    /// Which step and increment it is.
    pub moment: Moment,
    /// Where the point lies.
    pub site: Site,
}

impl BatchFailure {
    fn of_call(self, call: PointCall) -> Self {
        Self {
            call: Some(Box::new(call)),
            ..self
        }
    }
}

/// A batch that can be used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BatchSuccess {
    /// Points whose results are valid but inaccurate, and the law's message about them.
    pub unreliable: Option<(usize, String)>,
}

impl Law {
    /// Description of the law.
    pub fn description(&self) -> &LawDescription {
        self.loaded.description()
    }

    /// What it offers under the hypothesis it was built for.
    pub fn formulation(&self) -> &FormulationDescription {
        &self.formulation
    }

    /// Hypothesis it was built for.
    pub fn hypothesis(&self) -> Hypothesis {
        self.hypothesis
    }

    /// Library it comes from.
    pub fn library(&self) -> &Library {
        self.loaded.library()
    }

    /// The law without its parameters.
    pub fn loaded(&self) -> &LoadedLaw {
        &self.loaded
    }

    /// What it had changed of the process as it was built, and what was set back.
    pub fn changes(&self) -> &[String] {
        &self.changes
    }

    /// Values of its parameters, in declared order.
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// Whether a failure that no smaller step helps is trouble with the library, and not a limit of
    /// what the law can follow: numbers that are not finite under a claim of success, which is all
    /// that is numeric about routines made for other programs.
    pub fn breaks_down(&self, failure: &BatchFailure) -> bool {
        let is_foreign = self.library().foreign().is_some();
        failure.outcome == Outcome::Numeric && (is_foreign || failure.message == NOT_FINITE)
    }

    /// Whether the law is told where its points lie.
    pub fn asks_for_sites(&self) -> bool {
        self.library().foreign().is_some()
    }

    /// What the user should know of the calls since the last time that this was asked.
    pub fn take_notes(&self) -> Vec<String> {
        let names = self.instance.take_overwritten();
        let note = || {
            format!(
                "law `{}`: the routine overwrites {}, which it is given to read; here that is a \
                 copy, and what is left there is not used",
                self.description().id,
                names.join(", ")
            )
        };
        (!names.is_empty()).then(note).into_iter().collect()
    }

    /// Number of components of gradient and flux.
    pub fn n_components(&self) -> usize {
        self.hypothesis.n_components()
    }

    /// Number of internal variables.
    pub fn n_states(&self) -> usize {
        self.formulation.internal_variables.len()
    }

    /// Internal variables of points that carry these fluxes before anything has happened.
    ///
    /// # Errors
    /// The law cannot start from one of the fluxes.
    pub fn initial_state(
        &self,
        n_points: usize,
        flux: (&[f64], Strided),
    ) -> Result<Vec<f64>, BatchFailure> {
        let n_states = self.n_states();
        let initial = self
            .formulation
            .internal_variables
            .iter()
            .map(|v| v.initial_value);
        let mut state: Vec<f64> = initial.cycle().take(n_points * n_states).collect();
        let mut status = vec![raw::PILUM_E_INTERNAL; n_points];
        let mut factor = vec![0.0; n_points];
        let call = Call {
            request: 0,
            n_points,
            n_components: self.n_components(),
            n_states,
            time: 0.0,
            time_increment: 0.0,
            moment: Moment::default(),
            sites: &[],
            gradient0: None,
            gradient1: None,
            flux0: flux,
            state0: &[],
            flux1: None,
            state1: &mut state,
            tangent: &mut [],
            status: &mut status,
            step_factor: &mut factor,
        };
        let result = calls::calling(self.name, Doing::Start, n_points, Moment::default(), || {
            self.instance.init_state(call)
        });
        match result {
            None => Ok(state),
            Some((worst, message)) => {
                let outputs = [(&*state, Strided::rows(n_states), n_states)];
                judge(worst, &status, &factor, message)
                    .and_then(|_| finite(&outputs, n_points))
                    .map_err(|failure| {
                        let call = PointCall {
                            request: Request::InitialState,
                            time: 0.0,
                            time_increment: 0.0,
                            gradient: Vec::new(),
                            gradient_end: Vec::new(),
                            flux: flux.1.of_point(flux.0, failure.point, self.n_components()),
                            state: Vec::new(),
                            moment: Moment::default(),
                            site: Site::default(),
                        };
                        failure.of_call(call)
                    })?;
                Ok(state)
            }
        }
    }

    /// Carries points over an increment.
    ///
    /// # Errors
    /// A point asks for a smaller step, or fails; also if it claims success with a result that
    /// is not finite, or if its outcome contradicts that of the batch.
    pub fn integrate(
        &self,
        start: &Start<'_>,
        operator: Operator,
        end: End<'_>,
    ) -> Result<BatchSuccess, BatchFailure> {
        OUTCOMES
            .with_borrow_mut(|outcomes| self.integrate_with(outcomes, start, operator, end))
            .map_err(|failure| {
                let (point, n) = (failure.point, self.n_components());
                let of_point =
                    |(values, place): (&[f64], Strided)| place.of_point(values, point, n);
                let rows = Strided::rows(self.n_states());
                let call = PointCall {
                    request: Request::Update(operator),
                    time: start.time,
                    time_increment: start.time_increment,
                    gradient: of_point(start.gradient),
                    gradient_end: of_point(start.gradient_end),
                    flux: of_point(start.flux),
                    state: rows.of_point(start.state, point, self.n_states()),
                    moment: start.moment,
                    site: start.sites.get(point).copied().unwrap_or_default(),
                };
                failure.of_call(call)
            })
    }

    fn integrate_with(
        &self,
        outcomes: &mut Outcomes,
        start: &Start<'_>,
        operator: Operator,
        end: End<'_>,
    ) -> Result<BatchSuccess, BatchFailure> {
        let n = self.n_components();
        let (status, factor) = outcomes.unwritten(start.n_points);
        let (flux, flux_place) = end.flux;
        let call = Call {
            request: raw::PILUM_REQ_FLUX
                | match operator {
                    Operator::None => 0,
                    Operator::Consistent => raw::PILUM_REQ_TANGENT,
                    Operator::Elastic => raw::PILUM_REQ_ELASTIC,
                },
            n_points: start.n_points,
            n_components: n,
            n_states: self.n_states(),
            time: start.time,
            time_increment: start.time_increment,
            moment: start.moment,
            sites: start.sites,
            gradient0: Some(start.gradient),
            gradient1: Some(start.gradient_end),
            flux0: start.flux,
            state0: start.state,
            flux1: Some((&mut *flux, flux_place)),
            state1: &mut *end.state,
            tangent: &mut *end.operator,
            status: &mut *status,
            step_factor: &mut *factor,
        };
        let update = || self.instance.integrate(call);
        let (worst, message) = calls::calling(
            self.name,
            Doing::Update,
            start.n_points,
            start.moment,
            update,
        );
        let success = judge(worst, status, factor, message)?;
        let n_states = self.n_states();
        let n_operator = if operator == Operator::None { 0 } else { n * n };
        let outputs = [
            (&*flux, flux_place, n),
            (&*end.state, Strided::rows(n_states), n_states),
            (&*end.operator, Strided::rows(n_operator), n_operator),
        ];
        finite(&outputs, start.n_points)?;
        Ok(success)
    }
}

/// Room for the outcomes of one call. Each thread keeps its own from call to call, so that a call
/// allocates nothing once the largest batch has been seen.
#[derive(Debug, Default)]
struct Outcomes {
    status: Vec<Status>,
    factor: Vec<f64>,
}

thread_local! {
    static OUTCOMES: RefCell<Outcomes> = RefCell::default();
}

impl Outcomes {
    /// Outcomes of so many points as they are before a law has written them.
    fn unwritten(&mut self, n_points: usize) -> (&mut [Status], &mut [f64]) {
        self.status.clear();
        self.status.resize(n_points, raw::PILUM_E_INTERNAL);
        self.factor.clear();
        self.factor.resize(n_points, f64::NAN);
        (&mut self.status, &mut self.factor)
    }
}

/// Turns status codes into a verdict over the batch.
fn judge(
    worst: Status,
    status: &[Status],
    factor: &[f64],
    message: String,
) -> Result<BatchSuccess, BatchFailure> {
    // `PILUM_OK` is 0.
    if status.iter().fold(worst, |all, s| all | s) == raw::PILUM_OK {
        return Ok(BatchSuccess::default());
    }
    let severity = |s: Status| if s < 0 { 100 - s } else { s };
    let point = (0..status.len())
        .rev()
        .max_by_key(|&i| severity(status[i]))
        .unwrap_or(0);
    let at_point = status.get(point).copied().unwrap_or(worst);
    let code = abi::status::most_severe(worst, at_point);
    match Outcome::from_code(code) {
        Outcome::Ok => Ok(BatchSuccess::default()),
        Outcome::Unreliable => Ok(BatchSuccess {
            unreliable: Some((point, message)),
        }),
        Outcome::CutStep => {
            // A law that leaves the factor alone leaves the choice to the host.
            let smallest = factor
                .iter()
                .zip(status)
                .filter(|(f, s)| **s == raw::PILUM_CUT_STEP && **f > 0.0 && **f < 1.0)
                .map(|(f, _)| *f)
                .fold(f64::INFINITY, f64::min);
            let factor = if smallest.is_finite() { smallest } else { 0.25 };
            Err(BatchFailure {
                point,
                outcome: Outcome::CutStep,
                message,
                factor: Some(factor),
                call: None,
            })
        }
        outcome => Err(BatchFailure {
            point,
            outcome,
            message,
            factor: None,
            call: None,
        }),
    }
}

/// What is said of a success that is none.
const NOT_FINITE: &str = "the law claims success with a result that is not finite";

/// Distrusts success: every output must be finite.
fn finite(outputs: &[(&[f64], Strided, usize)], n_points: usize) -> Result<(), BatchFailure> {
    let whole = |(values, place, n): &(&[f64], Strided, usize)| {
        let packed = place.component == 1 && place.point == *n;
        packed && all_finite(&values[place.offset..place.offset + n_points * n])
    };
    if outputs.iter().all(whole) {
        return Ok(());
    }
    for point in 0..n_points {
        for (values, place, n) in outputs {
            let first = place.offset + point * place.point;
            if !(0..*n).all(|c| values[first + c * place.component].is_finite()) {
                return Err(BatchFailure {
                    point,
                    outcome: Outcome::Numeric,
                    message: NOT_FINITE.to_owned(),
                    factor: None,
                    call: None,
                });
            }
        }
    }
    Ok(())
}

/// Whether all values are finite: 0 times a finite number is 0. Eight sums at a time and no branch,
/// so that it costs little more than reading the values.
fn all_finite(values: &[f64]) -> bool {
    let (chunks, rest) = values.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for chunk in chunks {
        for (sum, value) in sums.iter_mut().zip(chunk) {
            *sum += 0.0 * value;
        }
    }
    sums.iter().sum::<f64>() == 0.0 && rest.iter().all(|v| v.is_finite())
}
