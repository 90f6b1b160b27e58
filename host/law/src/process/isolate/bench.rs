//! A worker from inside: it opens its library, builds its law, and answers calls.

use super::exchange::{
    Build, Descriptions, Header, NO_INIT_STATE, Started, Task, bytes, receive, send, site_of,
};
use crate::Error;
use crate::call::{End, Outcomes, Request, Site, Start, Strided};
use crate::description::{LawDescription, hypothesis_named};
use crate::foreign::{self, Fault};
use crate::instance::{Answer, Described, Instance, Source};
use crate::library::{self, SharedMemory, abaqus};
use crate::process::child;
use crate::process::library_bytes::Image;
use abi::raw;
use rustix::process::{Pid, Signal, WaitOptions};
use std::fs::File;
use std::io::{self, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::Arc;

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
    let task: Task = receive(&mut socket)?;
    let laws = match open(&task) {
        Ok(laws) => laws,
        Err(why) => return send(&mut socket, &Started::Unusable(why)),
    };
    let Some(build) = task.build else {
        let laws = laws.into_iter().map(|(law, _)| law).collect();
        let text = toml::to_string(&Descriptions { laws }).map_err(io::Error::other)?;
        return send(&mut socket, &Started::Described(text));
    };
    let bench = match Bench::new(&laws, &build, SharedMemory::new(file)?) {
        Ok(bench) => bench,
        Err(answer) => return send(&mut socket, &answer),
    };
    if let Some(folder) = task.folder {
        abaqus::out_dir_is(std::env::current_dir().unwrap_or_default());
        std::env::set_current_dir(folder)?;
    }
    send(&mut socket, &Started::Built)?;
    bench.answer(&mut socket)
}

/// The laws of the library, in this process.
fn open(task: &Task) -> Result<Described, String> {
    let path = Path::new(&task.path);
    let image = Image::again(path, &task.sha256)?;
    let Some(foreign) = &task.foreign else {
        let laws = library::open(path, image)?.into_iter();
        let source = |law| -> Arc<dyn Source> { Arc::new(law) };
        return Ok(laws.map(|(law, handle)| (law, source(handle))).collect());
    };
    match foreign::open(foreign, &image) {
        Ok(opened) => Ok(opened.laws),
        Err(Fault::Library(why)) => Err(why),
        Err(Fault::Other(error)) => Err(error.to_string()),
    }
}

/// A worker's law and what it works on.
struct Bench {
    /// This process: a law may make copies of it.
    process: Pid,
    instance: Box<dyn Instance>,
    n_components: usize,
    n_states: usize,
    memory: SharedMemory,
    inputs: Vec<f64>,
    outputs: Vec<f64>,
    outcomes: Outcomes,
}

impl Bench {
    fn new(
        laws: &[(LawDescription, Arc<dyn Source>)],
        build: &Build,
        memory: SharedMemory,
    ) -> Result<Self, Started> {
        let unusable = |why: &str| Started::Unusable(why.to_owned());
        let process = rustix::process::getpid();
        let (description, law) = laws
            .get(build.law)
            .ok_or_else(|| unusable("it lacks a law"))?;
        let hypothesis =
            hypothesis_named(&build.hypothesis).ok_or_else(|| unusable("it lacks a hypothesis"))?;
        let formulation = description
            .formulation(hypothesis)
            .ok_or_else(|| unusable("it lacks a formulation"))?;
        let parameters = build.parameters.iter().map(|bits| f64::from_bits(*bits));
        let parameters: Vec<f64> = parameters.collect();
        let instance = law
            .create(hypothesis, formulation, &parameters)
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
            outcomes: Outcomes::default(),
        })
    }

    /// Answers requests until the host is gone.
    fn answer(mut self, socket: &mut UnixStream) -> io::Result<()> {
        while let Ok(header) = Header::receive(socket) {
            let (status, message) = self.call(&header)?;
            let names = self.instance.take_overwritten().join("\n");
            let lengths = [message.len() as u64, names.len() as u64];
            let mut answer = bytes(&[u64::from(status as u32), lengths[0], lengths[1]]);
            answer.extend(message.as_bytes());
            answer.extend(names.as_bytes());
            socket.write_all(&answer)?;
        }
        Ok(())
    }

    fn call(&mut self, header: &Header) -> io::Result<Answer> {
        let sizes = header.sizes(self.n_components, self.n_states);
        if self.memory.len() != header.memory {
            self.memory.follow()?;
        }
        let sites = self.take_over(sizes.inputs, sizes.sites);
        self.outputs.clear();
        let n_outputs = sizes.flux + sizes.state + sizes.operator;
        self.outputs.resize(n_outputs, f64::NAN);
        self.outcomes.clear(header.n_points);

        let rows = Strided::rows(self.n_components);
        let (given, state) = self.inputs.split_at(sizes.inputs - sizes.state);
        let mut fields = given.chunks((header.n_points * self.n_components).max(1));
        let mut next = || (fields.next().unwrap_or_default(), rows);
        let (flux_end, rest) = self.outputs.split_at_mut(sizes.flux);
        let (state_end, operator_end) = rest.split_at_mut(sizes.state);
        let mut end = End {
            flux: (flux_end, rows),
            state: state_end,
            operator: operator_end,
        };
        let outcomes = &mut self.outcomes;
        let start = if header.request == Request::InitialState {
            end.state.copy_from_slice(state);
            Start::of_fluxes(header.n_points, next())
        } else {
            Start {
                n_points: header.n_points,
                gradient: next(),
                gradient_end: next(),
                flux: next(),
                state,
                time: header.time,
                time_increment: header.time_increment,
                moment: header.moment,
                sites: &sites,
            }
        };
        let batch = (&start, &mut end, &mut *outcomes);
        let answer = self.instance.call(header.request, batch);
        let answer = answer.unwrap_or_else(|| (NO_INIT_STATE, String::new()));
        if has_copied(self.process) {
            outcomes.status.fill(raw::PILUM_E_INTERNAL);
            return Ok((raw::PILUM_E_INTERNAL, COPIED.to_owned()));
        }
        self.hand_over(sizes.outputs());
        Ok(answer)
    }

    /// Reads the inputs from the shared memory, and then the sites.
    fn take_over(&mut self, n_inputs: usize, n_sites: usize) -> Vec<Site> {
        let inputs = self.memory.read(0, n_inputs).map(f64::from_bits);
        self.inputs.clear();
        self.inputs.extend(inputs);
        let sites: Vec<u64> = self.memory.read(n_inputs, n_sites).collect();
        sites.as_chunks().0.iter().map(site_of).collect()
    }

    /// Writes results and outcomes to the shared memory.
    fn hand_over(&mut self, at: usize) {
        let Outcomes { status, factor } = &self.outcomes;
        let values = self.outputs.iter().chain(factor);
        let values = values.map(|value| value.to_bits());
        let at = self.memory.write(at, values);
        let status = status.iter();
        let status = status.map(|status| u64::from(*status as u32));
        self.memory.write(at, status);
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
