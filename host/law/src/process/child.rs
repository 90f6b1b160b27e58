//! Work that may crash, hang or eat all memory runs in a child process: this program again, with a
//! hidden command, or the program that stands for it. The child's death is an outcome like any other.

#[cfg(target_os = "linux")]
mod copy;

#[cfg(target_os = "linux")]
pub use copy::{can_be_copied, copy};

use std::ffi::OsString;
use std::io::{self, Read};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Tells the child its limit of memory, in bytes.
const MEMORY: &str = "PILUM_CHILD_MEMORY";
/// Most bytes that are kept of each of the two outputs; the rest is read and dropped.
const MOST_OUTPUT: usize = 1 << 20;
/// How long outputs are waited for once the child has ended: only what it has left behind can
/// still hold them open.
const LAST_WORDS: Duration = Duration::from_secs(5);

/// Task and limits of a child process.
#[derive(Clone, Debug)]
pub struct Work {
    /// Arguments of this program: the hidden command and its own arguments.
    pub arguments: Vec<OsString>,
    /// Working directory; this process's if left out.
    pub folder: Option<PathBuf>,
    /// Variables of the environment that are others than this process's.
    pub variables: Vec<(&'static str, &'static str)>,
    /// The child is killed after this time.
    pub time: Duration,
    /// Most address space, in bytes. Kept by [`enter`], on Unix only.
    pub memory: Option<u64>,
}

impl Work {
    /// A child with these arguments in this process's surroundings, which may take all memory.
    pub fn new(arguments: Vec<OsString>, time: Duration) -> Self {
        Self {
            arguments,
            folder: None,
            variables: Vec::new(),
            time,
            memory: None,
        }
    }
}

/// How a child ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// By itself, with this code.
    Exited(i32),
    /// By a signal, its own fault or from outside.
    Signal(i32),
    /// It was killed when its time was over.
    TimedOut,
}

/// What became of a child.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// How it ended.
    pub ending: Ending,
    /// What it wrote to its standard output, the first mebibyte.
    pub stdout: Vec<u8>,
    /// What it wrote to its error stream, the first mebibyte.
    pub stderr: Vec<u8>,
}

impl std::fmt::Display for Ending {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::Exited(code) => write!(f, "exit code {code}"),
            Self::Signal(number) => match signal_name(number) {
                Some(name) => write!(f, "signal {number} ({name})"),
                None => write!(f, "signal {number}"),
            },
            Self::TimedOut => f.write_str("killed when its time was over"),
        }
    }
}

/// Names of the signals that end a process by its own fault, by the numbers they have everywhere,
/// and of those whose numbers differ on Linux.
fn signal_name(number: i32) -> Option<&'static str> {
    Some(match number {
        4 => "illegal instruction",
        5 => "trap",
        6 => "aborted",
        7 if cfg!(target_os = "linux") => "bus error",
        8 => "arithmetic exception",
        9 => "killed",
        11 => "segmentation fault",
        15 => "terminated",
        31 if cfg!(target_os = "linux") => "forbidden system call",
        _ => return None,
    })
}

// Of the whole process: where its program lies never changes.
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// Names the program to start as a child, whose folders hold the program's own laws. It is for a
/// process that is not the program, such as an interpreter that has loaded its rooms. The first name
/// counts.
pub fn stands_for(program: PathBuf) {
    let _ = PROGRAM.set(program);
}

/// The program that children are.
///
/// # Errors
/// The system does not say where this process's program lies.
pub(crate) fn program() -> io::Result<PathBuf> {
    PROGRAM
        .get()
        .cloned()
        .map_or_else(std::env::current_exe, Ok)
}

/// The same, to be started: where its file was replaced or removed meanwhile, as by a build, this process's image
/// takes its place.
///
/// # Errors
/// As [`program`].
pub(crate) fn to_start() -> io::Result<PathBuf> {
    let program = program()?;
    let image = PathBuf::from("/proc/self/exe");
    let is_gone = PROGRAM.get().is_none() && !program.is_file() && image.exists();
    Ok(if is_gone { image } else { program })
}

/// Runs this program once more and waits for its end. It has no input, and is gone with all
/// processes of its group when this function returns.
///
/// # Errors
/// The child cannot be started or waited for; [`io::ErrorKind::OutOfMemory`] if memory is what it lacks.
pub fn run(work: &Work) -> io::Result<Outcome> {
    let mut command = Command::new(to_start()?);
    command
        .args(&work.arguments)
        .env_remove(MEMORY)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command.envs(work.variables.iter().copied());
    if let Some(folder) = &work.folder {
        command.current_dir(folder);
    }
    if let Some(bytes) = work.memory {
        command.env(MEMORY, bytes.to_string());
    }
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let mut child = command.spawn()?;
    let outputs = (collect(child.stdout.take()), collect(child.stderr.take()));
    let (Ok(stdout), Ok(stderr)) = outputs else {
        kill_group(&mut child);
        child.wait()?;
        return Err(io::ErrorKind::OutOfMemory.into());
    };
    let status = wait(&mut child, work.time);
    // Whatever the child has started would keep its outputs open.
    kill_group(&mut child);
    let ending = if let Some(status) = status? {
        ending(status)
    } else {
        child.wait()?;
        Ending::TimedOut
    };
    Ok(Outcome {
        ending,
        stdout: last_words(&stdout),
        stderr: last_words(&stderr),
    })
}

/// The child's status, or none if it still runs after this time.
fn wait(child: &mut Child, time: Duration) -> io::Result<Option<ExitStatus>> {
    let start = Instant::now();
    let mut pause = Duration::from_micros(500);
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        let left = time.saturating_sub(start.elapsed());
        if left.is_zero() {
            return Ok(None);
        }
        std::thread::sleep(pause.min(left));
        pause = (2 * pause).min(Duration::from_millis(10));
    }
}

/// Kills the child, if it still runs, and what it has started. Failures mean that there is nothing
/// left to kill.
fn kill_group(child: &mut Child) {
    #[cfg(unix)]
    {
        use rustix::process::{Pid, Signal, kill_process_group};
        if let Some(group) = Pid::from_raw(child.id() as i32) {
            let _ = kill_process_group(group, Signal::KILL);
        }
    }
    let _ = child.kill();
}

/// Reads to the end in its own thread, since a full pipe would stop the child. A thread that cannot
/// be created mostly lacks memory.
fn collect(source: Option<impl Read + Send + 'static>) -> io::Result<Receiver<Vec<u8>>> {
    let (sender, receiver) = channel();
    std::thread::Builder::new().spawn(move || {
        let Some(mut source) = source else { return };
        let mut left = MOST_OUTPUT;
        let mut chunk = [0; 4096];
        while let Ok(n @ 1..) = source.read(&mut chunk) {
            let kept = n.min(left);
            left -= kept;
            if kept > 0 && sender.send(chunk[..kept].to_vec()).is_err() {
                return;
            }
        }
    })?;
    Ok(receiver)
}

/// All that was read.
fn last_words(pieces: &Receiver<Vec<u8>>) -> Vec<u8> {
    let until = Instant::now() + LAST_WORDS;
    let mut all = Vec::new();
    loop {
        match pieces.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(piece) => all.extend(piece),
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return all,
        }
    }
}

#[cfg(unix)]
/// How a process ended.
pub fn ending(status: ExitStatus) -> Ending {
    use std::os::unix::process::ExitStatusExt;
    match (status.code(), status.signal()) {
        (Some(code), _) => Ending::Exited(code),
        (None, signal) => Ending::Signal(signal.unwrap_or(0)),
    }
}

#[cfg(not(unix))]
/// How a process ended.
pub fn ending(status: ExitStatus) -> Ending {
    Ending::Exited(status.code().unwrap_or(-1))
}

// Of the whole process: what it was started for never changes.
static IS_CHILD: AtomicBool = AtomicBool::new(false);

/// Whether this process is a child: [`enter`] was called.
pub fn is_child() -> bool {
    IS_CHILD.load(Ordering::Relaxed)
}

/// The first thing a hidden command does: keeps the limits it was started with, leaves no core
/// file, and dies with its parent.
///
/// # Errors
/// A limit cannot be set.
pub fn enter() -> io::Result<()> {
    IS_CHILD.store(true, Ordering::Relaxed);
    #[cfg(unix)]
    {
        use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
        let limit = |bytes| Rlimit {
            current: Some(bytes),
            maximum: Some(bytes),
        };
        setrlimit(Resource::Core, limit(0))?;
        let memory = std::env::var(MEMORY)
            .ok()
            .and_then(|text| text.parse().ok());
        if let Some(bytes) = memory {
            // A limit of the user's (`ulimit -v`, a batch system) may be lower, and may not be raised.
            let least = getrlimit(Resource::As)
                .maximum
                .map_or(bytes, |most: u64| most.min(bytes));
            setrlimit(Resource::As, limit(least))?;
        }
    }
    // Those of the terminal are the parent's, who ends its children himself.
    #[cfg(unix)]
    block_requests()?;
    #[cfg(target_os = "linux")]
    rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::KILL))?;
    Ok(())
}

/// Keeps requests to stop away from this thread, and from threads and processes that it starts from
/// now on.
///
/// # Errors
/// The system's.
#[cfg(unix)]
pub fn block_requests() -> io::Result<()> {
    requests().thread_block().map_err(io::Error::from)
}

/// The signals that ask a program to stop.
#[cfg(unix)]
pub fn requests() -> nix::sys::signal::SigSet {
    use nix::sys::signal::Signal;
    [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP]
        .into_iter()
        .collect()
}

/// Makes the user's limit on file size act like a full disk, not as a signal that ends the process.
/// Threads and processes started later inherit this.
#[cfg(unix)]
pub fn ignore_file_limit() {
    use nix::sys::signal::{SigSet, Signal};
    let mut signals = SigSet::empty();
    signals.add(Signal::SIGXFSZ);
    // Without it the signal ends the process, as it would have.
    let _ = signals.thread_block();
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs one of the tests below that is left out unless it is asked for by name.
    fn run_test(name: &str, seconds: u64, memory: Option<u64>) -> Outcome {
        let name = format!("process::child::tests::{name}");
        let arguments = [&name, "--exact", "--ignored", "--nocapture"].map(OsString::from);
        run(&Work {
            memory,
            ..Work::new(arguments.to_vec(), Duration::from_secs(seconds))
        })
        .unwrap()
    }

    #[test]
    fn an_end_by_itself_has_a_code_and_outputs() {
        let outcome = run_test("prints", 60, None);
        assert_eq!(outcome.ending, Ending::Exited(0));
        let stdout = String::from_utf8(outcome.stdout).unwrap();
        assert!(stdout.contains("to the output"), "{stdout}");
        assert_eq!(outcome.stderr, b"to the error stream\n");
    }

    #[test]
    #[ignore = "work for a child"]
    fn prints() {
        println!("to the output");
        eprintln!("to the error stream");
    }

    /// Processes started by the child hold its output open; they must not keep the parent waiting.
    #[test]
    #[cfg(unix)]
    fn a_hanging_child_is_killed_with_what_it_started() {
        let start = Instant::now();
        let outcome = run_test("hangs", 1, None);
        assert_eq!(outcome.ending, Ending::TimedOut);
        assert!(start.elapsed() < Duration::from_secs(10));
        let stdout = String::from_utf8(outcome.stdout).unwrap();
        let grandchild = stdout
            .lines()
            .find_map(|line| line.strip_prefix("started "))
            .unwrap();
        let grandchild = rustix::process::Pid::from_raw(grandchild.parse().unwrap()).unwrap();
        // Whoever inherits it may take a moment to reap it.
        let gone = (0..100).any(|_| {
            std::thread::sleep(Duration::from_millis(20));
            let stat = std::fs::read_to_string(format!("/proc/{grandchild}/stat"));
            rustix::process::test_kill_process(grandchild).is_err()
                || stat.is_ok_and(|stat| stat.contains(") Z "))
        });
        assert!(gone, "process {grandchild} still runs");
    }

    #[test]
    #[ignore = "work for a child"]
    fn hangs() {
        let mut sleeps = Command::new("sleep").arg("600").spawn().unwrap();
        println!("\nstarted {}", sleeps.id());
        sleeps.wait().unwrap();
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_limit_of_memory_is_kept() {
        let limited = run_test("allocates", 60, Some(1 << 29));
        assert!(String::from_utf8_lossy(&limited.stdout).contains("reserved: false"));
        let free = run_test("allocates", 60, None);
        assert!(String::from_utf8_lossy(&free.stdout).contains("reserved: true"));
    }

    #[test]
    #[ignore = "work for a child"]
    fn allocates() {
        enter().unwrap();
        let reserved = Vec::<u8>::new().try_reserve(1 << 30).is_ok();
        println!("reserved: {reserved}");
    }

    #[test]
    fn outputs_are_kept_up_to_a_bound() {
        let outcome = run_test("prints_a_lot", 60, None);
        assert_eq!(outcome.ending, Ending::Exited(0));
        assert_eq!(outcome.stdout.len(), MOST_OUTPUT);
    }

    #[test]
    #[ignore = "work for a child"]
    fn prints_a_lot() {
        println!("{}", "x".repeat(2 * MOST_OUTPUT));
    }
}
