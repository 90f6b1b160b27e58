//! What cargo knows of the repository.

use crate::{Error, output};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Version, platform and packages.
#[derive(Clone, Debug)]
pub struct Metadata {
    /// The program's version.
    pub version: String,
    /// The platform that is built on and for, such as `x86_64-unknown-linux-gnu`.
    pub platform: String,
    /// The folder that cargo builds in.
    pub target: PathBuf,
    packages: BTreeMap<String, Package>,
}

/// A package and what is linked with it.
#[derive(Clone, Debug)]
pub(crate) struct Package {
    pub(crate) name: String,
    pub(crate) version: String,
    /// SPDX expression, or what stood for it once.
    pub(crate) licence: String,
    pub(crate) authors: Vec<String>,
    pub(crate) repository: Option<String>,
    pub(crate) folder: PathBuf,
    /// Whether it comes from a registry.
    pub(crate) is_foreign: bool,
    /// Code that runs in the compiler is in no library.
    is_of_compiler: bool,
    /// The library of a law.
    law: Option<String>,
    /// Ids of the packages that it needs when it runs.
    needs: Vec<String>,
}

impl Metadata {
    /// Asks cargo, without a network.
    ///
    /// # Errors
    /// [`Error::Command`], [`Error::Metadata`]
    pub fn of(repository: &Path) -> Result<Self, Error> {
        let told =
            |name: &str, default: &str| env::var(name).unwrap_or_else(|_| default.to_owned());
        let version = output(
            Command::new(told("RUSTC", "rustc"))
                .arg("-vV")
                .current_dir(repository),
        )?;
        let version = String::from_utf8_lossy(&version).into_owned();
        let platform = version.lines().find_map(|line| line.strip_prefix("host: "));
        let platform = platform.ok_or(Error::Metadata("platform"))?.to_owned();
        let mut command = Command::new(told("CARGO", "cargo"));
        command.args(["metadata", "--format-version", "1", "--locked", "--offline"]);
        command.args(["--filter-platform", &platform]);
        let told = output(command.current_dir(repository))?;
        let told: Value = serde_json::from_slice(&told).map_err(|_| Error::Metadata("JSON"))?;
        let target = told["target_directory"]
            .as_str()
            .ok_or(Error::Metadata("folder"))?;
        let packages = packages(&told, repository).ok_or(Error::Metadata("packages"))?;
        let program = packages.values().find(|package| package.name == PROGRAM);
        let version = program.ok_or(Error::Metadata("program"))?.version.clone();
        Ok(Self {
            version,
            platform,
            target: PathBuf::from(target),
            packages,
        })
    }

    /// Name of the archive and of the folder in it.
    pub fn name(&self) -> String {
        format!("pilum-{}-{}", self.version, self.platform)
    }

    /// Names of the laws' libraries in `models`.
    pub fn laws(&self) -> BTreeSet<&str> {
        let packages = self.packages.values();
        packages
            .filter_map(|package| package.law.as_deref())
            .collect()
    }

    /// All packages that are in the program, in a law, or in the library with this name, by name and version.
    pub(crate) fn linked(&self, library: Option<&str>) -> Vec<&Package> {
        let is_ours = |package: &Package| {
            let name = package.name.as_str();
            name == PROGRAM || package.law.is_some() || Some(name) == library
        };
        let ours = self.packages.iter().filter(|(_, package)| is_ours(package));
        let mut open: Vec<&String> = ours.map(|(id, _)| id).collect();
        let mut seen = BTreeSet::new();
        let mut linked = Vec::new();
        while let Some(id) = open.pop() {
            let Some(package) = self.packages.get(id) else {
                continue;
            };
            if seen.insert(id) && !package.is_of_compiler {
                open.extend(&package.needs);
                linked.push(package);
            }
        }
        linked.sort_by_key(|package| (&package.name, &package.version));
        linked
    }
}

/// The program's package.
const PROGRAM: &str = "pilum";

fn packages(told: &Value, repository: &Path) -> Option<BTreeMap<String, Package>> {
    let models = repository.join("models").canonicalize().ok()?;
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let mut needs = BTreeMap::new();
    for node in told["resolve"]["nodes"].as_array()? {
        let runs = |dep: &&Value| {
            let kinds = dep["dep_kinds"].as_array().into_iter().flatten();
            kinds.map(|kind| &kind["kind"]).any(Value::is_null)
        };
        let deps = node["deps"].as_array()?.iter().filter(runs);
        let ids: Option<Vec<String>> = deps.map(|dep| text(&dep["pkg"])).collect();
        needs.insert(text(&node["id"])?, ids?);
    }
    let package = |told: &Value| {
        let id = text(&told["id"])?;
        let folder = PathBuf::from(told["manifest_path"].as_str()?)
            .parent()?
            .to_owned();
        let target = |kind: &str| {
            let targets = told["targets"].as_array().into_iter().flatten();
            let is = |target: &&Value| {
                let kinds = target["kind"].as_array().into_iter().flatten();
                kinds.filter_map(Value::as_str).any(|other| other == kind)
            };
            targets.into_iter().find(is)
        };
        let is_model = folder
            .canonicalize()
            .is_ok_and(|folder| folder.starts_with(&models));
        let law = target("cdylib").filter(|_| is_model);
        let authors = told["authors"].as_array()?.iter();
        let package = Package {
            name: text(&told["name"])?,
            version: text(&told["version"])?,
            licence: text(&told["license"]).unwrap_or_else(|| "see its file".to_owned()),
            authors: authors.filter_map(text).collect(),
            repository: text(&told["repository"]),
            folder,
            is_foreign: !told["source"].is_null(),
            is_of_compiler: target("proc-macro").is_some(),
            law: law.and_then(|target| text(&target["name"])),
            needs: needs.get(&id).cloned().unwrap_or_default(),
        };
        Some((id, package))
    };
    told["packages"].as_array()?.iter().map(package).collect()
}
