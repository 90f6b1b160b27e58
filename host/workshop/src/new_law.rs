//! `pilum new-law`: a small project for a law, in the author's language, that builds and runs.
//!
//! The templates are files in `new_law/`, complete laws called `my_law`. The program carries what
//! they need of the contract ([`abi::sources`]). So a project depends on nothing else, neither a
//! registry nor an installation, and stays with the version that it was written for.

use crate::Error;
use abi::sources::{self, CPP_HEADER, HEADER, MODULE, POINT_HEADER};
use law::SearchPath;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::{Path, PathBuf};

/// The language of a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Language {
    /// Rust, with cargo.
    Rust,
    /// C11.
    C,
    /// C++17.
    Cpp,
    /// Fortran 2008, with a C compiler for one line.
    Fortran,
}

/// Purpose of a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Kind {
    /// Jump to traction.
    Interface,
    /// Strain to stress.
    Continuum,
}

/// A project to write.
#[derive(Debug, clap::Args)]
pub struct NewLaw {
    /// Id of the law: lower-case letters, digits and `_`.
    name: String,
    /// Language.
    #[arg(long, value_enum)]
    language: Language,
    /// Purpose of the law.
    #[arg(long, value_enum, default_value = "interface")]
    kind: Kind,
    /// Folder of the project; there must be none yet [default: ./NAME].
    #[arg(long)]
    out: Option<PathBuf>,
}

/// A file of a project: where it goes, what it says.
type File = (&'static str, &'static str);

macro_rules! template {
    ($name:literal) => {
        include_str!(concat!("new_law/", $name))
    };
}

const CONTRACT: File = ("CONTRACT.md", sources::README);
const EXPORTS: File = ("exports.map", sources::EXPORTS.1);
const ABI_MANIFEST: &str = "abi/Cargo.toml";
const BRIDGES_MANIFEST: &str = "abi/bridges/Cargo.toml";

impl Language {
    /// Name in words.
    fn name(self) -> &'static str {
        match self {
            Self::Rust => "Rust",
            Self::C => "C",
            Self::Cpp => "C++",
            Self::Fortran => "Fortran",
        }
    }

    /// The file with the law.
    fn law(self, kind: Kind) -> File {
        match (self, kind) {
            (Self::Rust, Kind::Interface) => ("law.rs", template!("rust/interface.rs")),
            (Self::Rust, Kind::Continuum) => ("law.rs", template!("rust/continuum.rs")),
            (Self::C, Kind::Interface) => ("law.c", template!("c/interface.c")),
            (Self::C, Kind::Continuum) => ("law.c", template!("c/continuum.c")),
            (Self::Cpp, Kind::Interface) => ("law.cpp", template!("cpp/interface.cpp")),
            (Self::Cpp, Kind::Continuum) => ("law.cpp", template!("cpp/continuum.cpp")),
            (Self::Fortran, Kind::Interface) => ("law.f90", template!("fortran/interface.f90")),
            (Self::Fortran, Kind::Continuum) => ("law.f90", template!("fortran/continuum.f90")),
        }
    }

    /// Neighbouring files.
    fn rest(self) -> Vec<File> {
        match self {
            Self::Rust => vec![
                ("Cargo.toml", template!("rust/Cargo.toml.txt")),
                (ABI_MANIFEST, template!("rust/abi.toml.txt")),
                (BRIDGES_MANIFEST, template!("rust/bridges.toml.txt")),
            ],
            Self::C => vec![("build.sh", template!("c/build.sh"))],
            Self::Cpp => vec![("build.sh", template!("cpp/build.sh"))],
            Self::Fortran => vec![
                ("build.sh", template!("fortran/build.sh")),
                ("manifest.c", template!("fortran/manifest.c")),
            ],
        }
    }

    /// What it needs of the contract. In Rust that is the contract's crate without its optional
    /// features, and the one that exports laws to other programs.
    fn contract(self) -> Vec<(String, &'static str)> {
        let files = match self {
            Self::Rust => {
                let below = |folder: &'static str| {
                    move |(path, text): File| (format!("{folder}/{path}"), text)
                };
                let abi = sources::CRATE.into_iter().map(below("abi"));
                let bridges = bridges::sources::CRATE.into_iter();
                return abi.chain(bridges.map(below("abi/bridges"))).collect();
            }
            Self::C => vec![HEADER, POINT_HEADER, CONTRACT],
            Self::Cpp => vec![EXPORTS, HEADER, POINT_HEADER, CPP_HEADER, CONTRACT],
            Self::Fortran => vec![EXPORTS, HEADER, MODULE, CONTRACT],
        };
        let files = files.into_iter();
        files.map(|(path, text)| (path.to_owned(), text)).collect()
    }

    /// The command that builds the project, and the folder of the library.
    fn build(self) -> (&'static str, &'static str) {
        match self {
            Self::Rust => ("cargo build --release", "target/release"),
            Self::C | Self::Cpp | Self::Fortran => ("sh build.sh", "build"),
        }
    }

    /// Notes for the author.
    fn notes(self) -> &'static str {
        match self {
            Self::Rust => template!("rust/notes.md"),
            Self::C => template!("c/notes.md"),
            Self::Cpp => template!("cpp/notes.md"),
            Self::Fortran => template!("fortran/notes.md"),
        }
    }
}

impl NewLaw {
    /// Writes the project. Returns what to say about it.
    ///
    /// # Errors
    /// [`text::Error::Usage`] for a name that cannot be used or a folder that exists,
    /// [`text::Error::Unwritable`].
    pub fn write(&self) -> Result<String, Error> {
        let name = self.name.as_str();
        check_name(name, self.language)?;
        if let Some(library) = SearchPath::new(&[]).installed().get(name) {
            return Err(Error::usage(format!(
                "there is a law `{name}` already, in {}; ids are public, so choose another",
                library.display()
            )));
        }
        let folder = self.out.clone().unwrap_or_else(|| PathBuf::from(name));
        let unwritable = |path: &Path| {
            let path = path.to_owned();
            move |source| text::Error::Unwritable { path, source }
        };
        if let Some(parent) = folder.parent() {
            fs::create_dir_all(parent).map_err(unwritable(parent))?;
        }
        fs::create_dir(&folder).map_err(|error| match error.kind() {
            std::io::ErrorKind::AlreadyExists => Error::usage(format!(
                "{} exists already; name another folder with --out",
                folder.display()
            )),
            _ => unwritable(&folder)(error).into(),
        })?;
        for (path, text) in self.files() {
            let path = folder.join(path);
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent).map_err(unwritable(parent))?;
            }
            fs::write(&path, text).map_err(unwritable(&path))?;
        }
        let (build, _) = self.language.build();
        Ok(format!(
            "law `{name}` in {0}; README.md there says how to go on:\n  cd {0}\n  {build}\n",
            folder.display()
        ))
    }

    /// All files of the project, filled in.
    fn files(&self) -> Vec<(String, String)> {
        let common = match self.kind {
            Kind::Interface => [
                ("point.toml", template!("interface/point.toml")),
                ("case.toml", template!("interface/case.toml")),
            ],
            Kind::Continuum => [
                ("point.toml", template!("continuum/point.toml")),
                ("case.toml", template!("continuum/case.toml")),
            ],
        };
        let mut templates = vec![
            ("README.md", template!("README.md")),
            (".gitignore", "build/\ntarget/\nresults/\n*.csv\n"),
            self.language.law(self.kind),
        ];
        templates.extend(common);
        templates.extend(self.language.rest());
        let filled = templates.into_iter();
        let filled = filled.map(|(path, text)| (path.to_owned(), self.fill(text)));
        // The contract is carried as it is.
        let contract = self.language.contract().into_iter();
        filled
            .chain(contract.map(|(path, text)| (path, text.to_owned())))
            .collect()
    }

    /// A template with the project's names in it.
    fn fill(&self, template: &str) -> String {
        let (build, libraries) = self.language.build();
        let (law, _) = self.language.law(self.kind);
        let contract = match self.language {
            Language::Rust => "abi/README.md",
            _ => CONTRACT.0,
        };
        let library = format!("{libraries}/{DLL_PREFIX}my_law{DLL_SUFFIX}");
        // Notes first: they hold names too. The law's name last, for the same reason.
        [
            ("@NOTES@", self.language.notes().trim_end()),
            ("@LANGUAGE@", self.language.name()),
            ("@BUILD@", build),
            ("@LIBRARIES@", libraries),
            ("@LIBRARY@", &library),
            ("@LAW@", law),
            ("@CONTRACT@", contract),
            ("@VERSION@", env!("CARGO_PKG_VERSION")),
            ("my_law", &self.name),
        ]
        .iter()
        .fold(template.to_owned(), |text, (mark, value)| {
            text.replace(mark, value)
        })
    }
}

/// Refuses what cannot be an id, or a crate's name.
fn check_name(name: &str, language: Language) -> Result<(), Error> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let refuse = |why: &str| {
        Err(Error::usage(format!(
            "`{name}` cannot be the id of a law: {why}"
        )))
    };
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) || !name.chars().all(plain) {
        return refuse("a lower-case letter, then lower-case letters, digits and _");
    }
    if name.len() > LONGEST_NAME {
        return refuse("more than 60 characters");
    }
    if language == Language::Rust && (KEYWORDS.contains(&name) || TAKEN.contains(&name)) {
        return refuse("Rust uses this name itself");
    }
    Ok(())
}

const LONGEST_NAME: usize = 60;

/// Keywords of Rust that would pass as ids.
const KEYWORDS: [&str; 50] = [
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate",
    "do", "dyn", "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl",
    "in", "let", "loop", "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref",
    "return", "self", "static", "struct", "super", "trait", "true", "try", "type", "typeof",
    "unsafe", "unsized", "use", "virtual", "where", "while",
];

/// Crates that a law's crate would get in the way of.
const TAKEN: [&str; 7] = [
    "abi",
    "alloc",
    "bridges",
    "core",
    "proc_macro",
    "std",
    "test",
];
