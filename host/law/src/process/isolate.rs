//! Laws in worker processes: what crashes, exits or never returns does so there.
//!
//! A worker is this program again, with one law and its parameters. Host and worker take turns. The
//! host writes a batch into shared memory and its size into a socket. The worker calls the law,
//! writes the results into the memory and the outcome into the socket (`isolate/exchange.rs`). A worker that is gone closes
//! the socket. Each thread that calls at the same time has its own worker.

mod bench;
mod exchange;
mod printed;
mod scratch;
mod worker;

pub use bench::work;
pub use exchange::memory_file;

use crate::call::{Batch, End, Outcomes, PointCall, Request, Strided};
use crate::description::FormulationDescription;
use crate::foreign::{self, Adapter, Foreign};
use crate::instance::{Answer, Described, Instance, Source};
use abi::Hypothesis;
use abi::raw;
use exchange::{Build, Descriptions, NO_INIT_STATE, Started, Task};
use printed::Printed;
use scratch::Scratch;
use std::io;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use worker::Worker;

/// The hidden command of a worker.
pub const COMMAND: &str = "law-worker";
/// How long one call may take if nothing is reported of it.
const CALL: Duration = Duration::from_secs(10);

/// A library whose laws are called in workers.
#[derive(Clone, Debug)]
pub(crate) struct Workers {
    task: Task,
    /// How long one call may take.
    limit: Duration,
}

impl Workers {
    /// Workers for the library at `path`, which has this hash. `foreign`: what it is made for, if not for the contract.
    /// `limit`: how long a call may take, if its opener has said so.
    pub(crate) fn of(
        path: &Path,
        sha256: &str,
        foreign: Option<&Foreign>,
        limit: Option<Duration>,
    ) -> Self {
        Self {
            task: Task {
                path: path.as_os_str().to_owned(),
                sha256: sha256.to_owned(),
                foreign: foreign.cloned(),
                build: None,
                folder: None,
            },
            limit: limit.unwrap_or(CALL),
        }
    }

    /// Its laws, as a worker tells of them. `is_serial`: calls of one material must follow one another.
    ///
    /// # Errors
    /// The defect of the library, in words.
    pub(crate) fn laws(&self, is_serial: bool) -> Result<Described, String> {
        let path = Path::new(&self.task.path).display();
        let printed = Printed::by(format!("library {path}"));
        let text = match Worker::start(&self.task, &printed)?.1 {
            Started::Described(text) => text,
            Started::Unusable(why) => return Err(why),
            Started::Refused(..) | Started::Built => {
                return Err("its worker is confused".to_owned());
            }
        };
        let described: Descriptions = toml::from_str(&text)
            .map_err(|why| format!("its description cannot be read: {why}"))?;
        let laws = described.laws.into_iter().enumerate();
        let laws = laws.map(|(number, law)| {
            let source = self.law(number, &law.id, is_serial);
            (law, source)
        });
        Ok(laws.collect())
    }

    /// Its law with this number and id. `is_serial`: calls of one material must follow one another.
    pub(crate) fn law(&self, number: usize, id: &str, is_serial: bool) -> Arc<dyn Source> {
        Arc::new(IsolatedLaw {
            workers: self.clone(),
            number,
            id: id.to_owned(),
            is_serial,
        })
    }
}

/// A law that is called in workers.
#[derive(Debug)]
struct IsolatedLaw {
    workers: Workers,
    number: usize,
    id: String,
    is_serial: bool,
}

impl Source for IsolatedLaw {
    /// Starts the first worker and fixes the parameters in it.
    fn create(
        &self,
        hypothesis: Hypothesis,
        formulation: &FormulationDescription,
        parameters: &[f64],
    ) -> Result<Box<dyn Instance>, Answer> {
        let build = Build {
            law: self.number,
            hypothesis: hypothesis.name().to_owned(),
            parameters: parameters.iter().map(|value| value.to_bits()).collect(),
        };
        let n_states = formulation.internal_variables.len();
        let instance = IsolatedInstance {
            task: Task {
                build: Some(build),
                ..self.workers.task.clone()
            },
            limit: self.workers.limit,
            sizes: (hypothesis.n_components(), n_states),
            idle: Mutex::default(),
            turn: self.is_serial.then(Mutex::default),
            overwritten: Mutex::default(),
            scratch: self.scratch()?,
            printed: Printed::by(format!("law `{}`", self.id)),
        };
        let worker = instance.worker()?;
        instance.give_back(worker);
        Ok(Box::new(instance))
    }

    fn is_serial(&self) -> bool {
        self.is_serial
    }

    fn is_called_here(&self) -> bool {
        false
    }
}

impl IsolatedLaw {
    /// Routines of Abaqus and PLAXIS write files where they stand.
    fn scratch(&self) -> Result<Option<Scratch>, Answer> {
        let foreign = self.workers.task.foreign.as_ref();
        let Some(foreign) = foreign.filter(|foreign| foreign.adapter != Adapter::Mfront) else {
            return Ok(None);
        };
        let is_kept = foreign.scratch == Some(foreign::Scratch::Keep);
        let scratch = Scratch::new(&self.id, is_kept);
        scratch.map(Some).map_err(|why| no_folder(&why))
    }
}

/// A law with its parameters fixed, in separate processes.
#[derive(Debug)]
struct IsolatedInstance {
    task: Task,
    /// How long one call may take.
    limit: Duration,
    /// Components, and internal variables.
    sizes: (usize, usize),
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

impl Instance for IsolatedInstance {
    fn call(&self, request: Request, batch: Batch<'_, '_>) -> Option<Answer> {
        let answer = self.answer(request, batch);
        (answer.0 != NO_INIT_STATE).then_some(answer)
    }

    fn take_overwritten(&self) -> Vec<String> {
        let lock = self.overwritten.lock();
        let mut overwritten = lock.unwrap_or_else(PoisonError::into_inner);
        let (all, n_told) = &mut *overwritten;
        let new = all[*n_told..].to_vec();
        *n_told = all.len();
        new
    }
}

impl IsolatedInstance {
    fn worker(&self) -> Result<Worker, Answer> {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let one = idle().pop();
        if let Some(worker) = one {
            return Ok(worker);
        }
        let internal = |why| (raw::PILUM_E_INTERNAL, why);
        let folder = self.scratch.as_ref().map(Scratch::of_worker);
        let task = Task {
            folder: folder.transpose().map_err(|why| no_folder(&why))?,
            ..self.task.clone()
        };
        match Worker::start(&task, &self.printed).map_err(internal)? {
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

    fn answer(&self, request: Request, (start, end, outcomes): Batch<'_, '_>) -> Answer {
        let turn = self.turn.as_ref();
        let _turn = turn.map(|turn| turn.lock().unwrap_or_else(PoisonError::into_inner));
        let mut worker = match self.worker() {
            Ok(worker) => worker,
            Err(failure) => return failure,
        };
        let batch = (start, &mut *end, &mut *outcomes);
        match worker.call(request, self.sizes, batch, self.limit) {
            Ok(answer) => {
                self.give_back(worker);
                answer
            }
            Err(silence) => {
                drop(worker);
                let why = self.blame(request, (start, end, outcomes), &silence);
                (raw::PILUM_E_INTERNAL, why)
            }
        }
    }

    /// Finds the point that ends the law's process: each is called alone until one does it again.
    fn blame(
        &self,
        request: Request,
        (start, end, outcomes): Batch<'_, '_>,
        silence: &str,
    ) -> String {
        let (n, n_states) = self.sizes;
        outcomes.status.fill(raw::PILUM_E_INTERNAL);
        if start.n_points <= 1 {
            return silence.to_owned();
        }
        let Ok(mut worker) = self.worker() else {
            return format!("{silence}; another worker process cannot be started");
        };
        let (mut flux, mut operator) = (vec![0.0; n], vec![0.0; n * n]);
        for point in 0..start.n_points {
            let call = PointCall::of(request, start, point, self.sizes);
            let mut state = end.state[point * n_states..][..n_states].to_vec();
            let mut alone = End {
                flux: (&mut flux, Strided::rows(n)),
                state: &mut state,
                operator: &mut operator,
            };
            let batch = (&call.as_start(), &mut alone, &mut Outcomes::of(1));
            if let Err(silence) = worker.call(request, self.sizes, batch, self.limit) {
                outcomes.status.fill(raw::PILUM_OK);
                outcomes.status[point] = raw::PILUM_E_INTERNAL;
                return silence;
            }
        }
        let n = start.n_points;
        format!("{silence}, in a batch of {n} points, none of which does it alone")
    }
}

fn no_folder(why: &io::Error) -> Answer {
    let message = format!("there is no folder for its scratch files: {why}");
    (raw::PILUM_E_INTERNAL, message)
}
