//! Laws in worker processes: what crashes, exits or never returns does so there.
//!
//! A worker is this program again, with one law and its parameters. Host and worker take turns. The
//! host writes a batch into shared memory and its size into a socket. The worker calls the law,
//! writes the results into the memory and the outcome into the socket. A worker that is gone closes
//! the socket. Each thread that calls at the same time has its own worker.
//!
//! | words of the memory | |
//! |---|---|
//! | inputs | gradients at start and end, fluxes, internal variables, point by point; places of the points |
//! | outputs | fluxes, internal variables, operators if wanted, step factors, status codes |

mod printed;
mod scratch;

use super::adapter::{self, Adapter, Foreign};
use super::description::LawDescription;
use super::library::{Call, SharedMemory, Strided, abaqus};
use crate::Error;
use crate::child::{self, Ending};
use crate::law::LawInstance;
use crate::open_library::Origin;
use crate::{Library, Moment, Opener, Site};
use abi::Hypothesis;
use abi::raw::{self, Status};
use printed::{Output, Printed};
use rustix::process::{Pid, Signal, WaitOptions};
use scratch::Scratch;
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, Read, Write};
use std::net::Shutdown;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The hidden command of a worker.
pub const COMMAND: &str = "law-worker";
/// How long a worker may take to open its library and build its law.
const START: Duration = Duration::from_secs(20);
/// How long one call may take if nothing is reported of it.
const CALL: Duration = Duration::from_secs(10);
/// How long a worker that is done with may take to write what it still keeps in buffers.
const LEAVE: Duration = Duration::from_secs(1);
/// Makes gfortran pass on at once what is printed.
const UNBUFFERED: &str = "GFORTRAN_UNBUFFERED_PRECONNECTED";
/// Longest message on the socket, in bytes: descriptions of laws.
const LONGEST: u32 = 1 << 24;
/// Words that are shared at first.
const FIRST_WORDS: usize = 1 << 13;
/// Words of a request on the socket.
const REQUEST: usize = 12;
/// Words of a point's place in the memory.
const SITE: usize = 5;

/// First message to a worker.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Start {
    path: OsString,
    sha256: String,
    foreign: Option<Foreign>,
    build: Option<Build>,
    /// The working directory of the law.
    folder: Option<PathBuf>,
}

/// The law that a worker builds.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Build {
    law: usize,
    formulation: u32,
    /// The bits of the parameters.
    parameters: Vec<u64>,
}

/// What it answers.
#[derive(Debug, Serialize, Deserialize)]
enum Started {
    /// The library cannot be used.
    Unusable(String),
    /// Its laws, as TOML: JSON has no infinity.
    Described(String),
    /// The law refuses its parameters: status and message.
    Refused(Status, String),
    /// The law is there.
    Built,
}

/// The description of a library. The number of a formulation is not part of what users see.
#[derive(Serialize, Deserialize)]
struct Descriptions {
    #[serde(default)]
    formulations: Vec<Vec<u32>>,
    #[serde(default)]
    laws: Vec<LawDescription>,
}

/// Why a worker gave no answer.
type Silence = String;

/// A worker process.
#[derive(Debug)]
struct Worker {
    child: Child,
    socket: UnixStream,
    memory: SharedMemory,
    output: Output,
    /// Arguments that its routine has overwritten, next to the last answers.
    overwritten: Vec<String>,
    /// It does not answer, or not any more.
    is_silent: bool,
}

impl Drop for Worker {
    fn drop(&mut self) {
        // What its law has printed or written to files may still stand in buffers.
        let _ = self.socket.shutdown(Shutdown::Both);
        let until = Instant::now() + LEAVE;
        while !self.is_silent && matches!(self.child.try_wait(), Ok(None)) {
            if Instant::now() > until {
                break;
            }
            std::thread::sleep(Duration::from_micros(200));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
        self.output.last_words();
    }
}

impl Worker {
    fn start(start: &Start, printed: &Arc<Printed>) -> Result<(Self, Started), Silence> {
        let failed = |why: io::Error| format!("its worker process cannot be started: {why}");
        let (socket, theirs) = UnixStream::pair().map_err(failed)?;
        let file = memory_file().map_err(failed)?;
        file.set_len((FIRST_WORDS * size_of::<u64>()) as u64)
            .map_err(failed)?;
        let shared = file.try_clone().map_err(failed)?;
        let mut command = Command::new(child::to_start().map_err(failed)?);
        if std::env::var_os(UNBUFFERED).is_none() {
            command.env(UNBUFFERED, "y");
        }
        let mut child = command
            .arg(COMMAND)
            .stdin(Stdio::from(OwnedFd::from(theirs)))
            .stdout(Stdio::from(shared))
            .stderr(Stdio::piped())
            .spawn()
            .map_err(failed)?;
        // It holds the worker's end of the socket, which must close with the worker.
        drop(command);
        let output = printed.follow(child.stderr.take());
        let memory = SharedMemory::new(file).map_err(failed)?;
        let mut worker = Self {
            child,
            socket,
            memory,
            output,
            overwritten: Vec::new(),
            is_silent: false,
        };
        let started = worker
            .introduce(start)
            .map_err(|why| worker.silence(&why, START))?;
        Ok((worker, started))
    }

    fn introduce(&mut self, start: &Start) -> io::Result<Started> {
        self.socket.set_read_timeout(Some(START))?;
        send(&mut self.socket, start)?;
        receive(&mut self.socket)
    }

    /// Why the socket gave no answer.
    fn silence(&mut self, why: &io::Error, limit: Duration) -> Silence {
        self.is_silent = true;
        if matches!(
            why.kind(),
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut
        ) {
            return format!("the law did not return within {} s", limit.as_secs_f64());
        }
        // It is gone already, or it has closed the socket and will never answer.
        let _ = self.child.kill();
        match self.child.wait().map(child::ending) {
            Ok(Ending::Signal(number)) => {
                format!("the law crashed: {}", Ending::Signal(number))
            }
            Ok(ending) => {
                let last = self.output.last_words();
                let last = last.map_or(String::new(), |line| format!("; it last printed: {line}"));
                format!("the law ended its process: {ending}{last}")
            }
            Err(_) => format!("its worker process cannot be heard: {why}"),
        }
    }

    /// A call of some of the points of a batch.
    fn call(
        &mut self,
        initial: bool,
        call: &mut Call<'_>,
        points: std::ops::Range<usize>,
        limit: Duration,
    ) -> Result<(Status, String), Silence> {
        self.exchange(initial, call, points, limit)
            .map_err(|why| self.silence(&why, limit))
    }

    fn exchange(
        &mut self,
        initial: bool,
        call: &mut Call<'_>,
        points: std::ops::Range<usize>,
        limit: Duration,
    ) -> io::Result<(Status, String)> {
        let sizes = Sizes {
            initial,
            request: call.request,
            n_points: points.len(),
            n_components: call.n_components,
            n_states: call.n_states,
            has_sites: !call.sites.is_empty(),
        };
        if self.memory.len() < sizes.end() {
            self.memory.grow(sizes.end().next_power_of_two())?;
        }
        let memory = &self.memory;
        let mut at = 0;
        for (values, place) in [call.gradient0, call.gradient1, Some(call.flux0)]
            .into_iter()
            .flatten()
        {
            at = write(memory, at, values, place, &points, call.n_components);
        }
        let states = Strided::rows(call.n_states);
        let state0 = if initial { &*call.state1 } else { call.state0 };
        let at = write(memory, at, state0, states, &points, call.n_states);
        let sites = call.sites.get(points.clone()).unwrap_or_default();
        memory.write(at, sites.iter().flat_map(site_words));
        let request = [
            u64::from(initial),
            u64::from(call.request),
            points.len() as u64,
            call.time.to_bits(),
            call.time_increment.to_bits(),
            memory.len() as u64,
            u64::from(call.moment.step),
            u64::from(call.moment.increment),
            call.moment.step_start.to_bits(),
            call.moment.step_length.to_bits(),
            u64::from(sizes.has_sites),
            u64::from(call.moment.is_undrained),
        ];
        self.socket.set_read_timeout(Some(limit))?;
        self.socket.write_all(&bytes(&request))?;
        let mut answer = [0; 3 * size_of::<u64>()];
        self.socket.read_exact(&mut answer)?;
        let [status, length, names] = words(&answer);
        let [message, names] = [length, names].map(|length| {
            let mut text = vec![0; (length as usize).min(LONGEST as usize)];
            self.socket.read_exact(&mut text).map(|()| text)
        });
        let (message, names) = (message?, names?);
        let names = String::from_utf8_lossy(&names);
        self.overwritten.extend(names.lines().map(str::to_owned));

        let mut at = sizes.outputs();
        let numbers = |at: usize, n: usize| memory.read(at, n).map(f64::from_bits);
        if let Some((flux, place)) = &mut call.flux1 {
            let n = sizes.n_points * sizes.n_components;
            let mut values = numbers(at, n);
            for point in points.clone() {
                let first = place.offset + point * place.point;
                for (c, value) in values.by_ref().take(sizes.n_components).enumerate() {
                    flux[first + c * place.component] = value;
                }
            }
            at += n;
        }
        let mut take = |target: &mut [f64], each: usize| {
            let n = points.len() * each;
            let target = &mut target[points.start * each..][..n];
            for (to, value) in target.iter_mut().zip(numbers(at, n)) {
                *to = value;
            }
            at += n;
        };
        take(call.state1, call.n_states);
        take(call.tangent, sizes.n_operator());
        take(call.step_factor, 1);
        let status_of = memory.read(at, points.len());
        for (to, word) in call.status[points].iter_mut().zip(status_of) {
            *to = word as u32 as Status;
        }
        let message = String::from_utf8_lossy(&message).into_owned();
        Ok((status as u32 as Status, message))
    }
}

/// What both sides compute the places in the memory from.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    initial: bool,
    request: u32,
    n_points: usize,
    n_components: usize,
    n_states: usize,
    has_sites: bool,
}

impl Sizes {
    fn n_operator(&self) -> usize {
        let operators = raw::PILUM_REQ_TANGENT | raw::PILUM_REQ_ELASTIC;
        if self.request & operators == 0 {
            0
        } else {
            self.n_components * self.n_components
        }
    }

    /// Where the outputs start.
    fn outputs(&self) -> usize {
        let gradients = if self.initial { 0 } else { 2 };
        let site = if self.has_sites { SITE } else { 0 };
        self.n_points * ((gradients + 1) * self.n_components + self.n_states + site)
    }

    /// Where they end.
    fn end(&self) -> usize {
        let flux = if self.initial { 0 } else { self.n_components };
        self.outputs() + self.n_points * (flux + self.n_states + self.n_operator() + 2)
    }
}

fn site_words(site: &Site) -> [u64; SITE] {
    let [x, y] = site.position.map(f64::to_bits);
    let [element, point] = [site.element, site.point].map(u64::from);
    [x, y, site.length.to_bits(), element, point]
}

fn site_of(words: &[u64; SITE]) -> Site {
    let [x, y, length, element, point] = *words;
    Site {
        position: [f64::from_bits(x), f64::from_bits(y)],
        length: f64::from_bits(length),
        element: element as u32,
        point: point as u32,
    }
}

/// Writes the values of some points; returns the place after them.
fn write(
    memory: &SharedMemory,
    at: usize,
    values: &[f64],
    place: Strided,
    points: &std::ops::Range<usize>,
    n: usize,
) -> usize {
    let value = |point: usize, c: usize| {
        values[place.offset + point * place.point + c * place.component].to_bits()
    };
    let words = points
        .clone()
        .flat_map(|point| (0..n).map(move |c| (point, c)));
    memory.write(at, words.map(|(point, c)| value(point, c)))
}

fn bytes(words: &[u64]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

fn words<const N: usize>(bytes: &[u8]) -> [u64; N] {
    let (chunks, _) = bytes.as_chunks::<8>();
    std::array::from_fn(|i| u64::from_le_bytes(chunks[i]))
}

fn send(socket: &mut impl Write, value: &impl Serialize) -> io::Result<()> {
    let text = serde_json::to_vec(value)?;
    let mut message = (text.len() as u32).to_le_bytes().to_vec();
    message.extend(text);
    socket.write_all(&message)
}

fn receive<T: for<'de> Deserialize<'de>>(socket: &mut impl Read) -> io::Result<T> {
    let mut length = [0; 4];
    socket.read_exact(&mut length)?;
    let length = u32::from_le_bytes(length).min(LONGEST);
    let mut text = vec![0; length as usize];
    socket.read_exact(&mut text)?;
    Ok(serde_json::from_slice(&text)?)
}

/// A file in memory.
#[cfg(target_os = "linux")]
///
/// # Errors
/// That of the system.
pub fn memory_file() -> io::Result<File> {
    use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, memfd_create};
    let flags = MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING;
    let memory = memfd_create("pilum_batch", flags)?;
    fcntl_add_seals(&memory, SealFlags::SHRINK)?;
    Ok(memory.into())
}

/// A file whose name is gone.
#[cfg(not(target_os = "linux"))]
///
/// # Errors
/// That of the system.
pub fn memory_file() -> io::Result<File> {
    use std::sync::atomic::{AtomicU32, Ordering};
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let name = format!("pilum_batch_{}_{number}", std::process::id());
    let path = std::env::temp_dir().join(name);
    let file = File::options()
        .read(true)
        .write(true)
        .create_new(true)
        .open(&path)?;
    std::fs::remove_file(&path)?;
    Ok(file)
}

/// What a library says about its laws, asked in a worker. `foreign`: what it is made for, if not for the contract.
///
/// # Errors
/// The defect of the library, in words.
pub(crate) fn describe(
    path: &Path,
    sha256: &str,
    foreign: Option<&Foreign>,
) -> Result<Vec<(LawDescription, Origin)>, String> {
    let start = Start {
        path: path.as_os_str().to_owned(),
        sha256: sha256.to_owned(),
        foreign: foreign.cloned(),
        build: None,
        folder: None,
    };
    let printed = Printed::by(format!("library {}", path.display()));
    let text = match Worker::start(&start, &printed)?.1 {
        Started::Described(text) => text,
        Started::Unusable(why) => return Err(why),
        Started::Refused(..) | Started::Built => return Err("its worker is confused".to_owned()),
    };
    let described: Descriptions =
        toml::from_str(&text).map_err(|why| format!("its description cannot be read: {why}"))?;
    let mut laws = described.laws;
    for (law, numbers) in laws.iter_mut().zip(described.formulations) {
        for (formulation, number) in law.formulations.iter_mut().zip(numbers) {
            formulation.index = number;
        }
    }
    let is_serial = foreign.is_some();
    let apart = |law| (law, Origin::Apart { is_serial });
    Ok(laws.into_iter().map(apart).collect())
}

/// A law with its parameters fixed, in separate processes.
#[derive(Debug)]
pub(crate) struct IsolatedInstance {
    start: Start,
    /// How long one call may take.
    limit: Duration,
    /// Workers that have nothing to do.
    idle: Mutex<Vec<Worker>>,
    /// Whose turn it is, if calls must follow one another. They then share one worker.
    turn: Option<Mutex<()>>,
    /// Arguments that its routine has overwritten in any worker, and the number reported.
    overwritten: Mutex<(Vec<String>, usize)>,
    /// Their working folder, if it is not that of the program.
    scratch: Option<Scratch>,
    printed: Arc<Printed>,
}

impl IsolatedInstance {
    /// Starts the first worker and fixes the parameters in it.
    ///
    /// # Errors
    /// The law's status and message, or how its process ended.
    pub(crate) fn create(
        library: &Library,
        (law, formulation): (usize, u32),
        parameters: &[f64],
        is_serial: bool,
    ) -> Result<Self, (Status, String)> {
        let id = &library.laws[law].0.id;
        let scratch = Self::scratch(id, library.foreign())?;
        let instance = Self {
            start: Start {
                path: library.path.as_os_str().to_owned(),
                sha256: library.sha256().to_owned(),
                foreign: library.foreign().cloned(),
                build: Some(Build {
                    law,
                    formulation,
                    parameters: parameters.iter().map(|value| value.to_bits()).collect(),
                }),
                folder: None,
            },
            limit: library.call_limit.unwrap_or(CALL),
            idle: Mutex::default(),
            turn: is_serial.then(Mutex::default),
            overwritten: Mutex::default(),
            scratch,
            printed: Printed::by(format!("law `{id}`")),
        };
        let worker = instance.worker()?;
        instance.give_back(worker);
        Ok(instance)
    }

    /// Routines of Abaqus and PLAXIS write files where they stand.
    fn scratch(id: &str, foreign: Option<&Foreign>) -> Result<Option<Scratch>, (Status, String)> {
        let Some(foreign) = foreign.filter(|foreign| foreign.adapter != Adapter::Mfront) else {
            return Ok(None);
        };
        let is_kept = foreign.scratch == Some(adapter::Scratch::Keep);
        Scratch::new(id, is_kept)
            .map(Some)
            .map_err(|why| no_folder(&why))
    }

    /// Arguments that the routine has overwritten, those that were not told before.
    pub(crate) fn take_overwritten(&self) -> Vec<String> {
        let lock = self.overwritten.lock();
        let mut overwritten = lock.unwrap_or_else(PoisonError::into_inner);
        let (all, n_told) = &mut *overwritten;
        let new = all[*n_told..].to_vec();
        *n_told = all.len();
        new
    }

    fn worker(&self) -> Result<Worker, (Status, String)> {
        let idle = self
            .idle
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop();
        if let Some(worker) = idle {
            return Ok(worker);
        }
        let internal = |why| (raw::PILUM_E_INTERNAL, why);
        let folder = self.scratch.as_ref().map(Scratch::of_worker);
        let start = Start {
            folder: folder.transpose().map_err(|why| no_folder(&why))?,
            ..self.start.clone()
        };
        match Worker::start(&start, &self.printed).map_err(internal)? {
            (worker, Started::Built) => Ok(worker),
            (_, Started::Refused(status, message)) => Err((status, message)),
            (_, Started::Unusable(why)) => Err(internal(why)),
            (_, Started::Described(_)) => Err(internal("its worker is confused".to_owned())),
        }
    }

    fn give_back(&self, mut worker: Worker) {
        for name in worker.overwritten.drain(..) {
            let lock = self.overwritten.lock();
            let all = &mut lock.unwrap_or_else(PoisonError::into_inner).0;
            if !all.contains(&name) {
                all.push(name);
            }
        }
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        idle.push(worker);
    }

    /// Asks for initial internal variables. `None` if the law has no `init_state`.
    pub(crate) fn init_state(&self, call: Call<'_>) -> Option<(Status, String)> {
        let answer = self.call(true, call);
        (answer.0 != NO_INIT_STATE).then_some(answer)
    }

    /// Carries the points over the increment. Returns the most severe status and a message.
    pub(crate) fn integrate(&self, call: Call<'_>) -> (Status, String) {
        self.call(false, call)
    }

    fn call(&self, initial: bool, mut call: Call<'_>) -> (Status, String) {
        let _turn = self
            .turn
            .as_ref()
            .map(|turn| turn.lock().unwrap_or_else(PoisonError::into_inner));
        let mut worker = match self.worker() {
            Ok(worker) => worker,
            Err(failure) => return failure,
        };
        let all = 0..call.n_points;
        match worker.call(initial, &mut call, all, self.limit) {
            Ok(answer) => {
                self.give_back(worker);
                answer
            }
            Err(silence) => {
                drop(worker);
                (
                    raw::PILUM_E_INTERNAL,
                    self.blame(initial, &mut call, &silence),
                )
            }
        }
    }

    /// Finds the point that ends the law's process: each is called alone until one does it again.
    fn blame(&self, initial: bool, call: &mut Call<'_>, silence: &str) -> String {
        let n = call.n_points;
        call.status[..n].fill(raw::PILUM_E_INTERNAL);
        if n <= 1 {
            return silence.to_owned();
        }
        let Ok(mut worker) = self.worker() else {
            return format!("{silence}; another worker process cannot be started");
        };
        for point in 0..n {
            let alone = worker.call(initial, call, point..point + 1, self.limit);
            if let Err(silence) = alone {
                call.status[..n].fill(raw::PILUM_OK);
                call.status[point] = raw::PILUM_E_INTERNAL;
                return silence;
            }
        }
        call.status[..n].fill(raw::PILUM_E_INTERNAL);
        format!("{silence}, in a batch of {n} points, none of which does it alone")
    }
}

fn no_folder(why: &io::Error) -> (Status, String) {
    let message = format!("there is no folder for its scratch files: {why}");
    (raw::PILUM_E_INTERNAL, message)
}

/// Stands for a law without `init_state`: no status code of the contract.
const NO_INIT_STATE: Status = Status::MIN;

/// A worker opens its library, builds its law, and answers calls until the host is gone.
///
/// # Errors
/// The socket or the memory fails. A host that has ended is no error.
pub fn work() -> Result<(), Error> {
    serve().map_err(|why| Error::internal(format!("worker: {why}")))
}

fn serve() -> io::Result<()> {
    child::enter()?;
    let mut socket = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
    let file = File::from(io::stdout().as_fd().try_clone_to_owned()?);
    // What the law prints goes to the error stream, which the host reads; it has nothing to read.
    rustix::stdio::dup2_stdin(File::open("/dev/null")?)?;
    rustix::stdio::dup2_stdout(io::stderr())?;
    let start: Start = receive(&mut socket)?;
    let same = |found: &str| {
        if found == start.sha256 {
            Ok(())
        } else {
            Err(Error::library("it was changed"))
        }
    };
    let opener = Opener::default();
    let opened = match start.foreign {
        None => opener.open_if(Path::new(&start.path), same),
        Some(foreign) => {
            let here = Foreign {
                in_process: true,
                ..foreign
            };
            opener.open_foreign(&here, same)
        }
    };
    let library = match opened {
        Ok(library) => library,
        Err(why) => {
            let prefix = format!("library {}: ", Path::new(&start.path).display());
            let why = why.to_string();
            let why = why.strip_prefix(&prefix).unwrap_or(&why);
            return send(&mut socket, &Started::Unusable(why.to_owned()));
        }
    };
    let Some(build) = start.build else {
        return send(&mut socket, &Started::Described(described(&library)?));
    };
    let bench = match Bench::new(&library, &build, SharedMemory::new(file)?) {
        Ok(bench) => bench,
        Err(answer) => return send(&mut socket, &answer),
    };
    if let Some(folder) = start.folder {
        abaqus::out_dir_is(std::env::current_dir().unwrap_or_default());
        std::env::set_current_dir(folder)?;
    }
    send(&mut socket, &Started::Built)?;
    bench.answer(&mut socket)
}

/// A worker's law and what it works on.
struct Bench {
    /// This process: a law may make copies of it.
    process: Pid,
    instance: LawInstance,
    n_components: usize,
    n_states: usize,
    memory: SharedMemory,
    inputs: Vec<f64>,
    outputs: Vec<f64>,
    status: Vec<Status>,
}

impl Bench {
    fn new(library: &Library, build: &Build, memory: SharedMemory) -> Result<Self, Started> {
        let unusable = |why: &str| Started::Unusable(why.to_owned());
        let process = rustix::process::getpid();
        let Some((description, origin)) = library.laws.get(build.law) else {
            return Err(unusable("it lacks a law"));
        };
        let mut formulations = description.formulations.iter();
        let formulation = formulations
            .find(|f| f.index == build.formulation)
            .ok_or_else(|| unusable("it lacks a formulation"))?;
        let hypothesis = Hypothesis::ALL
            .into_iter()
            .find(|h| h.name() == formulation.hypothesis)
            .ok_or_else(|| unusable("it lacks a hypothesis"))?;
        let parameters = build.parameters.iter().map(|bits| f64::from_bits(*bits));
        let parameters: Vec<f64> = parameters.collect();
        let instance = match origin {
            Origin::Here(handle) => handle
                .create(build.formulation, &parameters)
                .map(LawInstance::Here),
            Origin::Foreign(law) => law
                .create(hypothesis, &parameters)
                .map(LawInstance::Foreign),
            Origin::Apart { .. } | Origin::Zone(..) => {
                return Err(unusable("its worker has a worker"));
            }
        }
        .map_err(|(status, message)| Started::Refused(status, message))?;
        if has_copied(process) {
            return Err(unusable(COPIED));
        }
        Ok(Self {
            process,
            instance,
            n_components: hypothesis.n_components(),
            n_states: formulation.internal_variables.len(),
            memory,
            inputs: Vec::new(),
            outputs: Vec::new(),
            status: Vec::new(),
        })
    }

    /// Answers requests until the host is gone.
    fn answer(mut self, socket: &mut UnixStream) -> io::Result<()> {
        let mut request = [0; REQUEST * size_of::<u64>()];
        while let Ok(()) = socket.read_exact(&mut request) {
            let (status, message) = self.call(words(&request))?;
            let names = self.instance.take_overwritten().join("\n");
            let lengths = [message.len() as u64, names.len() as u64];
            let mut answer = bytes(&[u64::from(status as u32), lengths[0], lengths[1]]);
            answer.extend(message.as_bytes());
            answer.extend(names.as_bytes());
            socket.write_all(&answer)?;
        }
        Ok(())
    }

    fn call(&mut self, request: [u64; REQUEST]) -> io::Result<(Status, String)> {
        let [
            initial,
            flags,
            n_points,
            time,
            time_increment,
            length,
            step,
            increment,
            start,
            duration,
            sites,
            undrained,
        ] = request;
        if self.memory.len() != length as usize {
            self.memory.follow()?;
        }
        let (n_components, n_states) = (self.n_components, self.n_states);
        let sizes = Sizes {
            initial: initial != 0,
            request: flags as u32,
            n_points: n_points as usize,
            n_components,
            n_states,
            has_sites: sites != 0,
        };
        let n = sizes.n_points;
        let first_output = sizes.outputs();
        let n_site = if sizes.has_sites { n * SITE } else { 0 };
        let n_inputs = first_output - n_site;
        let words: Vec<u64> = self.memory.read(n_inputs, n_site).collect();
        let sites: Vec<Site> = words.as_chunks().0.iter().map(site_of).collect();
        let inputs = self.memory.read(0, n_inputs).map(f64::from_bits);
        self.inputs.clear();
        self.inputs.extend(inputs);
        self.outputs.clear();
        self.outputs
            .resize(sizes.end() - first_output - n, f64::NAN);
        self.status.clear();
        self.status.resize(n, raw::PILUM_E_INTERNAL);

        let rows = Strided::rows(n_components);
        let (given, state0) = self.inputs.split_at(n_inputs - n * n_states);
        let mut fields = given.chunks((n * n_components).max(1));
        let mut next = || (fields.next().unwrap_or_default(), rows);
        let (gradient0, gradient1) = if sizes.initial {
            (None, None)
        } else {
            (Some(next()), Some(next()))
        };
        let flux0 = next();
        let n_flux = if sizes.initial { 0 } else { n * n_components };
        let (flux1, rest) = self.outputs.split_at_mut(n_flux);
        let (state1, rest) = rest.split_at_mut(n * n_states);
        let (tangent, step_factor) = rest.split_at_mut(n * sizes.n_operator());
        if sizes.initial {
            state1.copy_from_slice(state0);
        }
        let call = Call {
            request: sizes.request,
            n_points: n,
            n_components,
            n_states,
            time: f64::from_bits(time),
            time_increment: f64::from_bits(time_increment),
            moment: Moment {
                step: step as u32,
                increment: increment as u32,
                step_start: f64::from_bits(start),
                step_length: f64::from_bits(duration),
                is_undrained: undrained != 0,
            },
            sites: &sites,
            gradient0,
            gradient1,
            flux0,
            state0: if sizes.initial { &[] } else { state0 },
            flux1: (!sizes.initial).then_some((flux1, rows)),
            state1,
            tangent,
            status: &mut self.status,
            step_factor,
        };
        let answer = if sizes.initial {
            let none = (NO_INIT_STATE, String::new());
            self.instance.init_state(call).unwrap_or(none)
        } else {
            self.instance.integrate(call)
        };
        if has_copied(self.process) {
            return Ok(copied(&mut self.status));
        }
        let outputs = self.outputs.iter().map(|value| value.to_bits());
        let at = self.memory.write(first_output, outputs);
        let status = self.status.iter().map(|status| u64::from(*status as u32));
        self.memory.write(at, status);
        Ok(answer)
    }
}

/// Report on a law that forks.
const COPIED: &str = "the law made a copy of its process (fork)";

/// Whether a law has made a copy of this process. The copy ends here: it must not answer, too.
fn has_copied(process: Pid) -> bool {
    if rustix::process::getpid() != process {
        let _ = rustix::process::kill_process(rustix::process::getpid(), Signal::KILL);
        std::process::abort();
    }
    // A worker starts no processes of its own.
    !matches!(
        rustix::process::waitpid(None, WaitOptions::NOHANG),
        Err(rustix::io::Errno::CHILD)
    )
}

/// The outcome of a call that is not to be trusted.
fn copied(status: &mut [Status]) -> (Status, String) {
    status.fill(raw::PILUM_E_INTERNAL);
    (raw::PILUM_E_INTERNAL, COPIED.to_owned())
}

/// Descriptions of a library's laws, for the host.
fn described(library: &Library) -> io::Result<String> {
    let laws: Vec<LawDescription> = library.laws().cloned().collect();
    let numbers = |law: &LawDescription| law.formulations.iter().map(|f| f.index).collect();
    let descriptions = Descriptions {
        formulations: laws.iter().map(numbers).collect(),
        laws,
    };
    toml::to_string(&descriptions).map_err(io::Error::other)
}
