//! A worker process as the host sees it.

use super::exchange::{
    Header, LONGEST, Started, Task, memory_file, receive, send, site_words, words,
};
use super::printed::{Output, Printed};
use crate::call::{Batch, End, Outcomes, Request, Start, Strided};
use crate::instance::Answer;
use crate::library::SharedMemory;
use crate::process::child::{self, Ending};
use abi::raw::Status;
use std::io::{self, Read, Write};
use std::net::Shutdown;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a worker may take to open its library and build its law.
const START: Duration = Duration::from_secs(20);
/// How long a worker that is done with may take to write what it still keeps in buffers.
const LEAVE: Duration = Duration::from_secs(1);
/// Makes gfortran pass on at once what is printed.
const UNBUFFERED: &str = "GFORTRAN_UNBUFFERED_PRECONNECTED";
/// Words that are shared at first.
const FIRST_WORDS: usize = 1 << 13;

/// Why a worker gave no answer.
pub(super) type Silence = String;

/// A worker process.
#[derive(Debug)]
pub(super) struct Worker {
    child: Child,
    socket: UnixStream,
    memory: SharedMemory,
    output: Output,
    /// Arguments that its routine has overwritten, next to the last answers.
    pub(super) overwritten: Vec<String>,
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
    pub(super) fn start(task: &Task, printed: &Arc<Printed>) -> Result<(Self, Started), Silence> {
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
            .arg(super::COMMAND)
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
            .introduce(task)
            .map_err(|why| worker.silence(&why, START))?;
        Ok((worker, started))
    }

    fn introduce(&mut self, task: &Task) -> io::Result<Started> {
        self.socket.set_read_timeout(Some(START))?;
        send(&mut self.socket, task)?;
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

    /// A call for a batch of points of a law with this many components and internal variables.
    pub(super) fn call(
        &mut self,
        request: Request,
        sizes: (usize, usize),
        (start, end, outcomes): Batch<'_, '_>,
        limit: Duration,
    ) -> Result<Answer, Silence> {
        self.socket
            .set_read_timeout(Some(limit))
            .and_then(|()| {
                let header = self.ask(request, sizes, start, end)?;
                self.take_answer(&header, sizes, end, outcomes)
            })
            .map_err(|why| self.silence(&why, limit))
    }

    /// Writes the inputs into the memory, and the header into the socket.
    fn ask(
        &mut self,
        request: Request,
        (n, n_states): (usize, usize),
        start: &Start<'_>,
        end: &End<'_>,
    ) -> io::Result<Header> {
        let mut header = Header {
            request,
            n_points: start.n_points,
            has_sites: !start.sites.is_empty(),
            time: start.time,
            time_increment: start.time_increment,
            moment: start.moment,
            memory: 0,
        };
        let wanted = header.sizes(n, n_states).end();
        if self.memory.len() < wanted {
            self.memory.grow(wanted.next_power_of_two())?;
        }
        header.memory = self.memory.len();
        let memory = &self.memory;
        let mut at = 0;
        let mut put = |(values, place): (&[f64], Strided), n: usize| {
            let places =
                (0..start.n_points).flat_map(|point| (0..n).map(move |c| place.at(point, c)));
            at = memory.write(at, places.map(|place| values[place].to_bits()));
        };
        let rows = Strided::rows(n_states);
        if request == Request::InitialState {
            put(start.flux, n);
            put((&*end.state, rows), n_states);
        } else {
            put(start.gradient, n);
            put(start.gradient_end, n);
            put(start.flux, n);
            put((start.state, rows), n_states);
        }
        memory.write(at, start.sites.iter().flat_map(site_words));
        self.socket.write_all(&header.bytes())?;
        Ok(header)
    }

    /// Reads the outcome from the socket, and the outputs from the memory.
    fn take_answer(
        &mut self,
        header: &Header,
        (n, n_states): (usize, usize),
        end: &mut End<'_>,
        outcomes: &mut Outcomes,
    ) -> io::Result<Answer> {
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

        let sizes = header.sizes(n, n_states);
        let mut at = sizes.outputs();
        let mut words = |n: usize| {
            let first = at;
            at += n;
            self.memory.read(first, n)
        };
        let mut flux = words(sizes.flux).map(f64::from_bits);
        let (to, place) = &mut end.flux;
        for point in 0..header.n_points {
            for (c, value) in flux.by_ref().take(n).enumerate() {
                to[place.at(point, c)] = value;
            }
        }
        for (values, n) in [
            (&mut *end.state, sizes.state),
            (&mut *end.operator, sizes.operator),
            (&mut *outcomes.factor, header.n_points),
        ] {
            let words = words(n).map(f64::from_bits);
            values.iter_mut().zip(words).for_each(|(to, v)| *to = v);
        }
        let status_of = words(header.n_points).map(|word| word as u32 as Status);
        let to = outcomes.status.iter_mut();
        to.zip(status_of).for_each(|(to, status)| *to = status);
        let message = String::from_utf8_lossy(&message).into_owned();
        Ok((status as u32 as Status, message))
    }
}
