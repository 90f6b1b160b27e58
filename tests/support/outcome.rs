//! What became of a command.
#![expect(
    clippy::missing_panics_doc,
    clippy::return_self_not_must_use,
    clippy::unwrap_used,
    reason = "part of the tests, which panic to fail"
)]

use std::process::Command;

/// What became of a command.
#[derive(Debug)]
pub struct Outcome {
    /// Exit code.
    pub code: Option<i32>,
    /// What it prints.
    pub stdout: String,
    /// What it says.
    pub stderr: String,
}

fn squeezed(text: &str) -> String {
    text.split_whitespace().collect()
}

impl Outcome {
    /// Runs a command to its end.
    pub fn of(command: &mut Command) -> Self {
        let output = command.output().unwrap();
        Self {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Whether the message contains a text, however its lines are broken.
    pub fn says(&self, text: &str) -> bool {
        squeezed(&self.stderr).contains(&squeezed(text))
    }

    /// Asserts the exit code.
    #[track_caller]
    pub fn ended(self, code: i32) -> Self {
        let (stdout, stderr) = (&self.stdout, &self.stderr);
        assert_eq!(self.code, Some(code), "{stdout}\n{stderr}");
        self
    }

    /// Asserts that the message contains a text.
    #[track_caller]
    pub fn shows(&self, text: impl AsRef<str>) -> &Self {
        let text = text.as_ref();
        assert!(self.says(text), "no {text:?}: {}", self.stderr);
        self
    }

    /// Asserts that the message does not contain a text.
    #[track_caller]
    pub fn hides(&self, text: impl AsRef<str>) -> &Self {
        let text = text.as_ref();
        assert!(!self.says(text), "{text:?}: {}", self.stderr);
        self
    }

    /// Asserts that standard output contains a text, to the letter.
    #[track_caller]
    pub fn prints(&self, text: impl AsRef<str>) -> &Self {
        let text = text.as_ref();
        assert!(self.stdout.contains(text), "no {text:?}: {}", self.stdout);
        self
    }
}
