//! The words between host and worker: messages at the start, then for each call a header on the socket and the values in the
//! shared memory, whose places both sides compute from the header.
//!
//! | words of the memory | |
//! |---|---|
//! | inputs | gradients at start and end, fluxes, internal variables, point by point; places of the points |
//! | outputs | fluxes, internal variables, operators if wanted, step factors, status codes |

use crate::call::{Moment, Operator, Request, Site};
use crate::description::LawDescription;
use crate::foreign::Foreign;
use abi::raw::Status;
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::PathBuf;

/// Longest message on the socket, in bytes: descriptions of laws.
pub(super) const LONGEST: u32 = 1 << 24;
/// Words of a header on the socket.
const HEADER: usize = 11;
/// Words of a point's place in the memory.
pub(super) const SITE: usize = 5;
/// Stands for a law without `init_state`: no status code of the contract.
pub(super) const NO_INIT_STATE: Status = Status::MIN;

/// First message to a worker.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Task {
    pub(super) path: OsString,
    pub(super) sha256: String,
    pub(super) foreign: Option<Foreign>,
    pub(super) build: Option<Build>,
    /// The working directory of the law.
    pub(super) folder: Option<PathBuf>,
}

/// The law that a worker builds.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Build {
    /// Its number in the library.
    pub(super) law: usize,
    /// Name of the hypothesis.
    pub(super) hypothesis: String,
    /// The bits of the parameters.
    pub(super) parameters: Vec<u64>,
}

/// What it answers.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Started {
    /// The library cannot be used.
    Unusable(String),
    /// [`Descriptions`] as TOML: JSON has no infinity.
    Described(String),
    /// The law refuses its parameters: status and message.
    Refused(Status, String),
    /// The law is there.
    Built,
}

/// The laws of a library.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Descriptions {
    #[serde(default)]
    pub(super) laws: Vec<LawDescription>,
}

/// What both sides know of a call.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    pub(super) request: Request,
    pub(super) n_points: usize,
    pub(super) has_sites: bool,
    pub(super) time: f64,
    pub(super) time_increment: f64,
    pub(super) moment: Moment,
    /// Words of the memory.
    pub(super) memory: usize,
}

/// Requests by their number on the socket.
const REQUESTS: [Request; 4] = [
    Request::InitialState,
    Request::Update(Operator::None),
    Request::Update(Operator::Consistent),
    Request::Update(Operator::Elastic),
];

impl Header {
    pub(super) fn bytes(&self) -> Vec<u8> {
        let request = REQUESTS.iter().position(|one| *one == self.request);
        let moment = &self.moment;
        bytes(&[
            request.unwrap_or_default() as u64,
            self.n_points as u64,
            u64::from(self.has_sites),
            self.time.to_bits(),
            self.time_increment.to_bits(),
            u64::from(moment.step),
            u64::from(moment.increment),
            moment.step_start.to_bits(),
            moment.step_length.to_bits(),
            u64::from(moment.is_undrained),
            self.memory as u64,
        ])
    }

    /// The next one; an error if the host is gone.
    pub(super) fn receive(socket: &mut impl Read) -> io::Result<Self> {
        let mut bytes = [0; HEADER * size_of::<u64>()];
        socket.read_exact(&mut bytes)?;
        let mut words = words::<HEADER>(&bytes).into_iter();
        let mut next = || words.next().unwrap_or_default();
        // In the order of `bytes`.
        Ok(Self {
            request: REQUESTS[next() as usize % REQUESTS.len()],
            n_points: next() as usize,
            has_sites: next() != 0,
            time: f64::from_bits(next()),
            time_increment: f64::from_bits(next()),
            moment: Moment {
                step: next() as u32,
                increment: next() as u32,
                step_start: f64::from_bits(next()),
                step_length: f64::from_bits(next()),
                is_undrained: next() != 0,
            },
            memory: next() as usize,
        })
    }

    /// Numbers of each kind for a law with this many components and internal variables.
    pub(super) fn sizes(&self, n_components: usize, n_states: usize) -> Sizes {
        let (gradients, fluxes, n_operator) = match self.request {
            Request::InitialState => (0, 0, 0),
            Request::Update(operator) => (2, 1, operator.n_entries(n_components)),
        };
        let n = self.n_points;
        Sizes {
            inputs: n * ((gradients + 1) * n_components + n_states),
            sites: if self.has_sites { n * SITE } else { 0 },
            flux: n * fluxes * n_components,
            state: n * n_states,
            operator: n * n_operator,
            n_points: n,
        }
    }
}

/// Words of each kind in the memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sizes {
    /// Gradients, fluxes and internal variables.
    pub(super) inputs: usize,
    /// Places of the points.
    pub(super) sites: usize,
    /// Fluxes at the end.
    pub(super) flux: usize,
    /// Internal variables at the end.
    pub(super) state: usize,
    /// Operators.
    pub(super) operator: usize,
    n_points: usize,
}

impl Sizes {
    /// Where the outputs start.
    pub(super) fn outputs(&self) -> usize {
        self.inputs + self.sites
    }

    /// Where they end.
    pub(super) fn end(&self) -> usize {
        self.outputs() + self.flux + self.state + self.operator + 2 * self.n_points
    }
}

pub(super) fn site_words(site: &Site) -> [u64; SITE] {
    let [x, y] = site.position.map(f64::to_bits);
    let [element, point] = [site.element, site.point].map(u64::from);
    [x, y, site.length.to_bits(), element, point]
}

pub(super) fn site_of(words: &[u64; SITE]) -> Site {
    let [x, y, length, element, point] = *words;
    Site {
        position: [f64::from_bits(x), f64::from_bits(y)],
        length: f64::from_bits(length),
        element: element as u32,
        point: point as u32,
    }
}

pub(super) fn bytes(words: &[u64]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

pub(super) fn words<const N: usize>(bytes: &[u8]) -> [u64; N] {
    let (chunks, _) = bytes.as_chunks::<8>();
    std::array::from_fn(|i| u64::from_le_bytes(chunks[i]))
}

pub(super) fn send(socket: &mut impl Write, value: &impl Serialize) -> io::Result<()> {
    let text = serde_json::to_vec(value)?;
    let mut message = (text.len() as u32).to_le_bytes().to_vec();
    message.extend(text);
    socket.write_all(&message)
}

pub(super) fn receive<T: for<'de> Deserialize<'de>>(socket: &mut impl Read) -> io::Result<T> {
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
