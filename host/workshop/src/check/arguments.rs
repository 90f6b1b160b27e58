//! The command line of `pilum check`.

use super::Check;
use crate::Error;
use law::SearchPath;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use text::{file, suggestion};

/// Arguments of `pilum check`.
#[derive(Clone, Debug, Default, clap::Args)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "switches of the command line"
)]
pub struct Arguments {
    /// A library of the contract, a UMAT with its sidecar, with `--driver` a UDSM or MFront
    /// behaviours, or the id of a law as of `pilum laws`.
    #[arg(required_unless_present = "list")]
    pub(super) library: Option<String>,
    /// Write JSON.
    #[arg(long)]
    pub(super) json: bool,
    /// Run only this check, without those it depends on; may be repeated.
    #[arg(long, value_name = "ID")]
    pub(super) only: Vec<String>,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// Fix a parameter of the laws, where random ones are refused; may be repeated.
    #[arg(long, value_name = "ID=VALUE", value_parser = setting)]
    pub(super) set: Vec<(String, f64)>,
    /// Use the path, parameters and sidecar of this driver file instead of random ones.
    #[arg(long, value_name = "FILE", conflicts_with = "set")]
    pub(super) driver: Option<PathBuf>,
    /// Folder for the calls of failures and warnings, for `pilum replay`; default:
    /// `results/check/<library>`.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Print only failures, crashes and warnings.
    #[arg(long)]
    pub(super) only_failed: bool,
    /// Exit code 3 for warnings, too.
    #[arg(long)]
    pub(super) strict: bool,
    /// Seconds after which a check is ended.
    #[arg(long, default_value_t = 60.0, value_parser = positive)]
    pub(super) time_limit: f64,
    /// List the checks.
    #[arg(long)]
    pub(super) list: bool,
    /// Run the checks in this process, one by one, for a debugger: a crash ends the program, and
    /// there are no limits of time and memory.
    #[arg(long)]
    pub(super) in_process: bool,
    /// Run the one check as a child: every call is written to this file before it is made, and the answer next to it.
    #[arg(long, hide = true, conflicts_with = "in_process")]
    pub(super) child: Option<PathBuf>,
    /// Drive a routine a short way only.
    #[arg(long, hide = true, requires = "child")]
    pub(super) near: bool,
    /// Drive the law along the increment of this capsule alone, with its parameters.
    #[arg(long, hide = true, requires = "child", conflicts_with_all = ["set", "driver"])]
    pub(super) at: Option<PathBuf>,
    /// Make the last call in the child's file a capsule next to it, and run no check.
    #[arg(long, hide = true, requires = "child")]
    pub(super) tell: bool,
    /// Make the calls of the child's file, write their results next to it, and run no check.
    #[arg(long, hide = true, requires = "child")]
    pub(super) calls: bool,
}

fn setting(text: &str) -> Result<(String, f64), String> {
    let (id, value) = text.split_once('=').ok_or("expected ID=VALUE")?;
    let value = value
        .trim()
        .parse()
        .map_err(|_| format!("`{value}` is no number"))?;
    Ok((id.trim().to_owned(), value))
}

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number".to_owned())?;
    if value > 0.0 && value <= 1e6 {
        Ok(value)
    } else {
        Err("expected seconds".to_owned())
    }
}

impl Arguments {
    /// The same for children, which work in their own folders.
    pub(super) fn with_absolute_driver(&self) -> Result<Self, Error> {
        let mut own = self.clone();
        if let Some(driver) = &self.driver {
            let unreadable = |source| text::Error::Unreadable {
                path: driver.clone(),
                source,
            };
            let whole = std::path::absolute(driver).map_err(unreadable)?;
            file::read_text(&whole).map_err(unreadable)?;
            own.driver = Some(whole);
        }
        Ok(own)
    }

    /// Those that make one check the same again.
    pub(super) fn of_one(&self, check: &Check) -> Vec<OsString> {
        let mut own: Vec<OsString> = ["--only", check.id, "--seed", &self.seed.to_string()]
            .map(OsString::from)
            .to_vec();
        for (id, value) in &self.set {
            own.extend(["--set".into(), format!("{id}={value}").into()]);
        }
        for (option, file) in [("--driver", &self.driver), ("--at", &self.at)] {
            if let Some(file) = file {
                own.extend([option.into(), file.into()]);
            }
        }
        own
    }

    /// The command that runs one check alone.
    pub(super) fn command_of(&self, check: &Check, path: &Path) -> String {
        let own = self.of_one(check);
        let own: Vec<_> = own.iter().map(|a| a.to_string_lossy()).collect();
        format!("pilum check {} {}", path.display(), own.join(" "))
    }

    /// The library's file: a path unchanged, a law's id where `pilum laws` finds it. Nothing is opened.
    pub(super) fn library_path(&self) -> Result<PathBuf, Error> {
        let name = self.library.as_deref().unwrap_or_default();
        let path = Path::new(name);
        let looks_like_a_path = path.components().count() > 1 || name.ends_with(DLL_SUFFIX);
        if looks_like_a_path || path.is_file() {
            return std::path::absolute(path)
                .and_then(|path| std::fs::metadata(&path).map(|_| path))
                .map_err(|source| {
                    let path = path.to_owned();
                    text::Error::Unreadable { path, source }.into()
                });
        }
        let search = SearchPath::new(&[]);
        let installed = search.installed();
        let file = format!("{DLL_PREFIX}{name}{DLL_SUFFIX}");
        let mut named = search.places().iter().map(|place| place.folder.join(&file));
        named
            .find(|path| path.is_file())
            .or_else(|| installed.get(name).cloned())
            .ok_or_else(|| {
                let known = installed.keys().map(String::as_str);
                let error = law::Error::Library {
                    message: format!("there is no library or law `{name}`"),
                    hint: Some(suggestion(name, known.collect::<Vec<_>>())),
                };
                error.into()
            })
    }
}
