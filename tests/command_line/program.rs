//! Running the program in its own folder, and tables of mistakes in a small case.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use tempfile::TempDir;
pub(crate) use tests::outcome::Outcome;
use tests::place::{built_program, deps};

/// Exit codes, `input::Error::exit_code`.
pub(crate) const DONE: i32 = 0;
pub(crate) const BAD_INPUT: i32 = 1;
pub(crate) const NO_EQUILIBRIUM: i32 = 2;
pub(crate) const PLUGIN_TROUBLE: i32 = 3;

/// A case that runs. The mistakes are edits of it.
pub(crate) const CASE: &str = r#"title = "A block beside a layer"
analysis = "plane_strain"

[mesh]
columns = [
  { n = 1, to = 1.0 },
  { n = 1, to = 1.01 },
  { n = 1, to = 2.0 },
]
rows = [{ n = 2, to = 1.0 }]

[[mesh.region]]
group = "soil"

[[mesh.region]]
group = "layer"
x = [1.0, 1.01]

[mesh.lines]
left = { x = 0.0 }
right = { x = 2.0 }
bottom = { y = 0.0 }
top = { y = 1.0 }
middle = { y = 0.5 }
corner = { x = 0.0, y = 0.5 }

[laws.soil]
law = "elastic"
parameters = { young_modulus = 1e4, poisson_ratio = 0.3 }

[laws.joint]
law = "coulomb_joint"
[laws.joint.parameters]
normal_stiffness = 1e6
shear_stiffness = 4e5
cohesion = 10.0
friction_angle = 30.0
dilatancy_angle = 5.0

[groups.soil]
formulation = "solid"
integration = "full"
law = "soil"

[groups.layer]
formulation = "thin_layer"
law = "joint"

[[supports]]
line = "bottom"
fixed = ["x", "y"]

[[phase]]
name = "weight"
increments = 2
pressure = [{ line = "top", value = 10.0 }]

[[phase]]
name = "push"
increments = 2
displacement = [{ line = "top", x = 1e-5 }]

[probes]
settlement = { line = "top", quantity = "displacement_y", scale = -1000.0 }
tau = { group = "layer", quantity = "traction_t" }
half = { combine = { tau = 0.5 } }

[solver]
tolerated_residual = 0.0
max_iterations = 20

[output]
profile = "phases"
"#;

/// Edits that put the joint along the middle, without thickness, in place of the layer.
pub(crate) const JOINT: &[&str] = &[
    r#"[[mesh.region]]\ngroup = "layer"\nx = [1.0, 1.01]\n => "#,
    r#"formulation = "thin_layer"\n => formulation = "zero_thickness"\nline = "middle"\n"#,
];

/// The case after some edits `from => to`.
pub(crate) fn edited(edits: &[&str]) -> String {
    tests::words::edited(CASE, edits)
}

/// A folder to run the program in.
#[derive(Debug)]
pub(crate) struct Place {
    folder: TempDir,
}

impl Place {
    pub(crate) fn new() -> Self {
        Self {
            folder: TempDir::new().unwrap(),
        }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, contents: impl AsRef<[u8]>) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, contents).unwrap();
    }

    /// The program with this folder as its working directory.
    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(built_program());
        command
            .args(arguments)
            .current_dir(self.folder.path())
            .env("PILUM_LAW_PATH", deps())
            .env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"))
            .env("NO_COLOR", "1")
            .env_remove("RUST_BACKTRACE");
        command
    }

    /// Starts the program, without its messages.
    pub(crate) fn start(&self, arguments: &[&str]) -> Child {
        let mut command = self.command(arguments);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command.spawn().unwrap()
    }

    /// Runs the program.
    pub(crate) fn run(&self, arguments: &[&str]) -> Outcome {
        self.run_with(arguments, &[])
    }

    /// Runs the program with variables of its environment.
    pub(crate) fn run_with(&self, arguments: &[&str], variables: &[(&str, &str)]) -> Outcome {
        let mut command = self.command(arguments);
        Outcome::of(command.envs(variables.iter().copied()))
    }

    /// Runs the program from a shell that has set limits to itself.
    #[cfg(unix)]
    pub(crate) fn run_limited(&self, limits: &str, arguments: &[&str]) -> Outcome {
        let inner = self.command(arguments);
        let mut command = Command::new("sh");
        command.args(["-c", &format!("{limits}; exec \"$0\" \"$@\"")]);
        command.arg(inner.get_program()).args(inner.get_args());
        command.current_dir(self.folder.path());
        for (name, value) in inner.get_envs() {
            match value {
                Some(value) => command.env(name, value),
                None => command.env_remove(name),
            };
        }
        Outcome::of(&mut command)
    }

    /// Runs a case given as the bytes of its file; results go to `out`.
    pub(crate) fn run_case(&self, text: impl AsRef<[u8]>) -> Outcome {
        self.write("case.toml", text);
        self.run(&["run", "case.toml", "--out", "out"])
    }

    /// Runs a command that must succeed.
    #[track_caller]
    pub(crate) fn done(&self, arguments: &[&str]) -> Outcome {
        self.run(arguments).ended(DONE)
    }

    /// Runs a command with input that must be refused.
    #[track_caller]
    pub(crate) fn refused(&self, arguments: &[&str]) -> Outcome {
        self.run(arguments).ended(BAD_INPUT)
    }

    /// Runs a case that must succeed.
    #[track_caller]
    pub(crate) fn done_case(&self, text: impl AsRef<[u8]>) -> Outcome {
        self.run_case(text).ended(DONE)
    }

    /// Runs a case that must be refused.
    #[track_caller]
    pub(crate) fn refused_case(&self, text: impl AsRef<[u8]>) -> Outcome {
        self.run_case(text).ended(BAD_INPUT)
    }

    /// The text of a file.
    #[track_caller]
    pub(crate) fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// The values of a JSON file.
    #[track_caller]
    pub(crate) fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }

    /// `summary.json` of the results in `out`.
    #[track_caller]
    pub(crate) fn summary(&self) -> serde_json::Value {
        self.json("out/summary.json")
    }

    /// Names of what lies in the folder, sorted.
    pub(crate) fn contents(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).unwrap();
        let name = |entry: std::fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
        let mut names: Vec<String> = entries.map(|entry| name(entry.unwrap())).collect();
        names.sort();
        names
    }
}

/// A mistake: what it is, the edits that make it, what the message says.
type Mistake<'a> = (&'a str, Vec<(String, String)>, Vec<String>);

/// Mistakes in rows: what it is; below it, indented, edits as `from => to`, then what the message says. An edit may
/// also stand for what it is. `\n` is the end of a line. A `^` in an edit marks the place that the message has to
/// name, and is not part of the file.
fn mistakes(table: &str) -> Vec<Mistake<'_>> {
    let mut mistakes: Vec<Mistake<'_>> = Vec::new();
    for line in table.lines().filter(|line| !line.is_empty()) {
        let is_new = !line.starts_with("  ");
        if is_new {
            mistakes.push((line, Vec::new(), Vec::new()));
        }
        let (_, edits, says) = mistakes.last_mut().unwrap();
        let text = |text: &str| text.trim().replace("\\n", "\n");
        match line.split_once(" =>") {
            Some((from, to)) => edits.push((text(from), text(to))),
            None if !is_new => says.push(text(line)),
            None => (),
        }
    }
    mistakes
}

/// Makes each mistake in the case. All must be refused with a message at the place that says what it has to,
/// without leaving anything behind.
pub(crate) fn refuses(mistakes: &str) {
    refuses_in(CASE, BAD_INPUT, mistakes);
}

/// The same in this case, with this exit code.
pub(crate) fn refuses_in(case: &str, code: i32, mistakes: &str) {
    let run = ["run", "case.toml", "--out", "out"];
    refuses_file(&Place::new(), ("case.toml", case), &run, code, mistakes);
}

/// The same in this file, which these arguments run.
pub(crate) fn refuses_file(
    place: &Place,
    (file, contents): (&str, &str),
    run: &[&str],
    code: i32,
    table: &str,
) {
    let mut complaints = Vec::new();
    for (what, edits, says) in mistakes(table) {
        let text = edits.iter().fold(contents.to_owned(), |text, (from, to)| {
            assert!(text.contains(from), "{file} does not contain {from:?}");
            text.replacen(from, to, 1)
        });
        let is_told = !says.is_empty() || text.contains('^');
        assert!(is_told && !edits.is_empty(), "{what}");
        place.write(file, text.replacen('^', "", 1));
        let before = place.contents();
        let outcome = place.run(run);
        let mut wrong = Vec::new();
        if outcome.code != Some(code) {
            wrong.push(format!("exit code {:?}, expected {code}", outcome.code));
        }
        if let Some(at) = text.find('^').map(|at| position(&text, at))
            && !outcome.says(&format!("{file}:{at}"))
        {
            wrong.push(format!("the place is not {file}:{at}"));
        }
        let missing = says.iter().filter(|text| !outcome.says(text));
        wrong.extend(missing.map(|text| format!("it does not say: {text}")));
        if !outcome.stdout.is_empty() {
            wrong.push("something on standard output".to_owned());
        }
        if place.contents() != before {
            wrong.push(format!("left behind: {:?}", place.contents()));
        }
        if !wrong.is_empty() {
            let wrong = wrong.join("\n  ");
            complaints.push(format!("{what}:\n  {wrong}\n{}", outcome.stderr));
        }
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

/// Line and column, from 1.
fn position(text: &str, at: usize) -> String {
    let before = &text[..at];
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
    format!("{line}:{column}")
}

#[test]
fn the_case_itself_runs() {
    Place::new().done_case(CASE);
}
