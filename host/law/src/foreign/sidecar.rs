//! The sidecar of a library that cannot describe itself: `NAME.law.toml` next to `libNAME.so`.

use super::{Externals, Order, Scratch};
use crate::Error;
use crate::description::{
    Bounds, FormulationDescription, InternalVariable, LawDescription, ParameterDescription,
    Tangent, hypothesis_named, is_identifier,
};
use crate::process::library_bytes::hexadecimal_sha256;
use abi::Hypothesis;
use serde::Deserialize;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use text::{Source, Spanned};

/// Most components of an internal variable; a slip of the pen beyond.
const MOST_COMPONENTS: usize = 1000;
/// Length of a material's name in Abaqus.
const CMNAME: usize = 80;

#[expect(clippy::struct_excessive_bools, reason = "keys of the file")]
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    id: Spanned<String>,
    #[serde(default)]
    name: String,
    #[serde(default)]
    version: String,
    #[serde(default)]
    author: String,
    #[serde(default)]
    licence: String,
    #[serde(default)]
    doc: String,
    #[serde(default)]
    references: String,
    symbol: Option<String>,
    cmname: Option<Spanned<String>>,
    hypotheses: Spanned<Vec<Spanned<String>>>,
    ntens: Vec<Spanned<usize>>,
    #[serde(default)]
    expand: bool,
    #[serde(default)]
    thread_safe: bool,
    #[serde(default)]
    time_dependent: bool,
    #[serde(default)]
    symmetric: bool,
    #[serde(default)]
    tangent: Given,
    #[serde(default)]
    tangent_order: Order,
    externals: Option<Externals>,
    scratch: Option<Scratch>,
    #[serde(default)]
    parameter: Vec<Parameter>,
    #[serde(default)]
    internal: Vec<Internal>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Parameter {
    id: Spanned<String>,
    #[serde(default)]
    symbol: String,
    unit: String,
    doc: String,
    default: Option<Spanned<f64>>,
    lower: Option<Spanned<f64>>,
    upper: Option<f64>,
    #[serde(default)]
    open_lower: bool,
    #[serde(default)]
    open_upper: bool,
    usual: Option<Spanned<[f64; 2]>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Internal {
    id: Spanned<String>,
    #[serde(default)]
    symbol: String,
    unit: String,
    doc: String,
    #[serde(default)]
    initial: f64,
    components: Option<Spanned<usize>>,
}

/// Kind of DDSDDE: a routine always writes one.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Given {
    #[default]
    Consistent,
    Approximate,
}

/// What a sidecar says.
#[derive(Clone, Debug)]
pub(super) struct Sidecar {
    /// The description of the law.
    pub(super) law: LawDescription,
    /// The routine, if it has no usual name.
    pub(super) symbol: Option<String>,
    /// CMNAME.
    pub(super) cmname: String,
    /// NTENS that the routine is called with, by formulation.
    pub(super) ntens: Vec<usize>,
    /// Calls need not follow one another.
    pub(super) is_thread_safe: bool,
    /// How DDSDDE is in memory.
    pub(super) order: Order,
    /// What becomes of routines that nobody supplies, and of scratch files.
    pub(super) wishes: (Option<Externals>, Option<Scratch>),
    /// SHA-256 of the file.
    pub(super) sha256: String,
}

impl Sidecar {
    /// Reads the sidecar of a library.
    ///
    /// # Errors
    /// [`Error::Library`] if absent, [`text::Error::Unreadable`]; [`text::Error::Input`] at the place
    /// that does not fit.
    pub(super) fn read(library: &Path, given: Option<&Path>) -> Result<Self, Error> {
        let path = match given {
            Some(path) => path.to_owned(),
            None => find(library)?,
        };
        Self::of(&Source::read(&path)?)
    }

    /// Takes the text of a sidecar.
    pub(super) fn of(source: &Source) -> Result<Self, Error> {
        let file: File = text::parse(source)?;
        let parameters = file.parameter.iter().map(|p| parameter(source, p));
        let parameters = parameters.collect::<Result<Vec<_>, _>>()?;
        unique(source, file.parameter.iter().map(|p| &p.id), "parameter")?;
        let variables = variables(source, &file.internal)?;
        let (formulations, ntens) = formulations(source, &file, &variables)?;
        let id = identifier(source, &file.id, "the law")?;
        let cmname = file.cmname.as_ref().map_or(&id, Spanned::get_ref);
        if cmname.len() > CMNAME || !cmname.is_ascii() {
            let at = file.cmname.as_ref().map_or(file.id.span(), Spanned::span);
            let message = format!("`cmname`: expected at most {CMNAME} ASCII characters");
            return Err(source.error(at, message).into());
        }
        let law = LawDescription {
            name: file.name,
            version: file.version,
            author: file.author,
            licence: file.licence,
            doc: file.doc,
            references: file.references,
            parameters,
            formulations,
            id: id.clone(),
        };
        Ok(Self {
            cmname: cmname.to_ascii_uppercase(),
            symbol: file.symbol,
            ntens,
            is_thread_safe: file.thread_safe,
            order: file.tangent_order,
            wishes: (file.externals, file.scratch),
            sha256: hexadecimal_sha256(source.text().as_bytes()),
            law: law.completed(),
        })
    }
}

/// The formulations, and the numbers of components that they are called with.
fn formulations(
    source: &Source,
    file: &File,
    variables: &[InternalVariable],
) -> Result<(Vec<FormulationDescription>, Vec<usize>), Error> {
    let hypotheses = file.hypotheses.get_ref();
    if hypotheses.is_empty() {
        let names = Hypothesis::ALL.map(Hypothesis::name).join(", ");
        return Err(source
            .error(file.hypotheses.span(), "`hypotheses` is empty")
            .hint(format!("name those that the routine is made for: {names}"))
            .into());
    }
    let mut formulations = Vec::new();
    let mut ntens = Vec::new();
    for name in hypotheses {
        let hypothesis = hypothesis_named(name.get_ref()).ok_or_else(|| {
            source.unknown("hypothesis", name, Hypothesis::ALL.map(Hypothesis::name))
        })?;
        ntens.push(called_with(source, file, name, hypothesis)?);
        formulations.push(FormulationDescription {
            hypothesis: hypothesis.name(),
            index: formulations.len() as u32,
            symmetric: file.symmetric,
            tangent: match file.tangent {
                Given::Consistent => Tangent::Consistent,
                Given::Approximate => Tangent::Approximate,
            },
            time_dependent: file.time_dependent,
            internal_variables: variables.to_vec(),
            ..FormulationDescription::default()
        });
    }
    unique(source, hypotheses.iter(), "hypothesis")?;
    Ok((formulations, ntens))
}

/// `libNAME.so` has `NAME.law.toml` or `libNAME.law.toml` next to it.
pub(super) fn find(library: &Path) -> Result<PathBuf, Error> {
    let stem = library.file_stem().unwrap_or_default().to_string_lossy();
    let names = [stem.strip_prefix("lib").unwrap_or(&stem), &stem];
    let paths = names.map(|name| library.with_file_name(format!("{name}.law.toml")));
    let found = paths.iter().find(|path| path.is_file());
    found.cloned().ok_or_else(|| Error::Library {
        message: format!("library {} has no sidecar", library.display()),
        hint: Some(format!(
            "a sidecar names parameters and internal variables: {}, or `sidecar = \"PATH\"`; `pilum \
             new-sidecar {} --nprops N --nstatv M` writes one to fill in",
            paths[0].display(),
            library.display()
        )),
    })
}

fn identifier(source: &Source, id: &Spanned<String>, what: &str) -> Result<String, Error> {
    let text = id.get_ref();
    if is_identifier(text) {
        return Ok(text.clone());
    }
    Err(source
        .error(id.span(), format!("the id `{text}` of {what} is malformed"))
        .hint("ids are made of a-z, 0-9 and _, and start with a letter")
        .into())
}

fn unique<'a>(
    source: &Source,
    ids: impl Iterator<Item = &'a Spanned<String>>,
    what: &str,
) -> Result<(), Error> {
    let mut seen = HashSet::new();
    for id in ids {
        if !seen.insert(id.get_ref()) {
            let message = format!("{what} `{}` is declared twice", id.get_ref());
            return Err(source.error(id.span(), message).into());
        }
    }
    Ok(())
}

/// Whether tables of results have a column of this name, whatever the law.
pub(super) fn is_column(id: &str) -> bool {
    let mut places = [
        "x",
        "y",
        "s",
        "iterations",
        "phase",
        "increment",
        "group",
        "element",
        "point",
    ]
    .into_iter();
    let is_component = |word: &str| {
        let rest = id
            .strip_prefix(word)
            .and_then(|rest| rest.strip_prefix('_'));
        let mut all = Hypothesis::ALL.into_iter();
        rest.is_some_and(|rest| all.any(|h| h.components().contains(&rest)))
    };
    let mut words = ["strain", "stress", "jump", "traction"].into_iter();
    places.any(|place| place == id) || words.any(is_component)
}

/// Internal variables are columns of tables: each has its own name, which none of the others
/// that are there has.
fn variables(source: &Source, internal: &[Internal]) -> Result<Vec<InternalVariable>, Error> {
    let mut seen = HashSet::new();
    let mut variables = Vec::new();
    for written in internal {
        for variable in components(source, written)? {
            let id = &variable.id;
            let fault = if is_column(id) {
                "has the name of another column in tables of results"
            } else if !seen.insert(id.clone()) {
                "is declared twice"
            } else {
                variables.push(variable);
                continue;
            };
            let message = format!("internal variable `{id}` {fault}");
            return Err(source.error(written.id.span(), message).into());
        }
    }
    Ok(variables)
}

/// NTENS that the routine is called with under a hypothesis.
fn called_with(
    source: &Source,
    file: &File,
    name: &Spanned<String>,
    hypothesis: Hypothesis,
) -> Result<usize, Error> {
    let can = |n: usize| file.ntens.iter().any(|ntens| *ntens.get_ref() == n);
    let n = hypothesis.n_components();
    if can(n) {
        return Ok(n);
    }
    let is_plane = matches!(
        hypothesis,
        Hypothesis::PlaneStrain | Hypothesis::Axisymmetric
    );
    let can_expand = can(6) && is_plane;
    if can_expand && file.expand {
        return Ok(6);
    }
    let message = format!("{} has NTENS = {n}, which `ntens` lacks", hypothesis.name());
    let error = source.error(name.span(), message);
    Err(if can_expand {
        error.hint("`expand = true` calls the routine with 6 components, 13 and 23 at zero")
    } else {
        error
    }
    .into())
}

fn parameter(source: &Source, p: &Parameter) -> Result<ParameterDescription, Error> {
    let id = identifier(source, &p.id, "a parameter")?;
    let lower = p.lower.as_ref().map_or(f64::NEG_INFINITY, |v| *v.get_ref());
    let bounds = Bounds {
        lower,
        open_lower: p.open_lower,
        upper: p.upper.unwrap_or(f64::INFINITY),
        open_upper: p.open_upper,
    };
    if let Some(written) = p.lower.as_ref().filter(|_| bounds.lower > bounds.upper) {
        let message = format!("parameter `{id}`: its bounds are not in order");
        return Err(source.error(written.span(), message).into());
    }
    if let Some(default) = p.default.as_ref().filter(|v| !bounds.contain(*v.get_ref())) {
        let message = format!("parameter `{id}`: the default is outside its bounds {bounds}");
        return Err(source.error(default.span(), message).into());
    }
    let usual = p
        .usual
        .as_ref()
        .map_or([f64::NEG_INFINITY, f64::INFINITY], |v| *v.get_ref());
    if let Some(written) = p.usual.as_ref().filter(|_| usual[0] > usual[1]) {
        let message = format!("parameter `{id}`: its usual values are not in order");
        return Err(source.error(written.span(), message).into());
    }
    Ok(ParameterDescription {
        id,
        symbol: p.symbol.clone(),
        unit: p.unit.clone(),
        doc: p.doc.clone(),
        default: p.default.as_ref().map(|v| *v.get_ref()),
        bounds,
        usual: Bounds::closed(usual[0], usual[1]),
        ..ParameterDescription::default()
    })
}

fn components(source: &Source, v: &Internal) -> Result<Vec<InternalVariable>, Error> {
    let id = identifier(source, &v.id, "an internal variable")?;
    let n = v.components.as_ref().map_or(1, |n| *n.get_ref());
    if let Some(written) = v
        .components
        .as_ref()
        .filter(|_| n == 0 || n > MOST_COMPONENTS)
    {
        let message = format!("`components`: {n} is outside [1, {MOST_COMPONENTS}]");
        return Err(source.error(written.span(), message).into());
    }
    let one = |c: usize| InternalVariable {
        id: if n == 1 {
            id.clone()
        } else {
            format!("{id}_{}", c + 1)
        },
        symbol: v.symbol.clone(),
        unit: v.unit.clone(),
        doc: v.doc.clone(),
        initial_value: v.initial,
        output_only: false,
    };
    Ok((0..n).map(one).collect())
}
