//! `pilum new-sidecar`: the file that names what an Abaqus user subroutine has only numbers for, to be
//! filled in. It can be used as it is written.

use crate::Error;
use law::foreign::UMAT_SYMBOLS;
use law::inspect;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use text::Source;

/// Most values of PROPS or STATEV; a slip of the pen beyond.
const MOST: u32 = 10_000;

/// A sidecar to write.
#[derive(Debug, clap::Args)]
pub struct NewSidecar {
    /// The library of the routine.
    library: PathBuf,
    /// Number of parameters, NPROPS.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=i64::from(MOST)))]
    nprops: u32,
    /// Number of internal variables, NSTATV; none if left out.
    #[arg(long, value_name = "M", default_value_t = 0,
        value_parser = clap::value_parser!(u32).range(..=i64::from(MOST)))]
    nstatv: u32,
    /// What the routine was written for: 4 (plane strain, axisymmetry), 6 (3d), 2 or 3 (interfaces in the
    /// plane, in space).
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_values_t = [4, 6])]
    ntens: Vec<u32>,
    /// Name of the routine, if not `umat_`, `umat`, `UMAT` or `UMAT_`.
    #[arg(long)]
    symbol: Option<String>,
    /// The file to write; there must be none yet [default: NAME.law.toml next to libNAME.so].
    #[arg(long)]
    out: Option<PathBuf>,
}

impl NewSidecar {
    /// Writes it. Nothing of the library runs. Returns what to do with it.
    ///
    /// # Errors
    /// [`text::Error::Usage`] for numbers that do not go together, and a library without such a routine;
    /// what cannot be read or written.
    pub fn write(&self) -> Result<String, Error> {
        let hypotheses = self.hypotheses()?;
        let symbol = self.checked_symbol()?;
        let name = name_of(&self.library);
        let out = match &self.out {
            Some(out) => out.clone(),
            None => self.library.with_file_name(format!("{name}.law.toml")),
        };
        let text = self.text(&identifier(&name), &hypotheses, symbol);
        // What is written is what will be read.
        law::foreign::sidecar(&Source::new(&out, text.clone()))?;
        if out.exists() {
            let message = format!("{} is there already; `--out` names another", out.display());
            return Err(Error::usage(message));
        }
        std::fs::write(&out, text).map_err(|source| text::Error::unwritable(&out, source))?;
        Ok(self.next_steps(&out, &name, hypotheses[0]))
    }

    /// The hypotheses of NTENS.
    fn hypotheses(&self) -> Result<Vec<&'static str>, Error> {
        let mut hypotheses = Vec::new();
        for n in &self.ntens {
            let own: &[&str] = match n {
                2 => &["interface_2d"],
                3 => &["interface_3d"],
                4 => &["plane_strain", "axisymmetric"],
                6 => &["3d"],
                _ => {
                    let message = format!("--ntens {n}: expected 2, 3, 4 or 6");
                    return Err(Error::usage(message));
                }
            };
            let new = own.iter().filter(|name| !hypotheses.contains(*name));
            hypotheses.extend(new.collect::<Vec<_>>());
        }
        Ok(hypotheses)
    }

    /// The routine's name, if the sidecar has to say it.
    fn checked_symbol(&self) -> Result<Option<&str>, Error> {
        let inspection = inspect::inspect(&self.library)?;
        let has = |name: &str| inspection.exported.iter().any(|other| other == name);
        let symbol = self.symbol.as_deref();
        let found = match symbol {
            Some(name) => has(name),
            None => UMAT_SYMBOLS.into_iter().any(has),
        };
        if found {
            return Ok(symbol);
        }
        let wanted = symbol.map_or_else(|| UMAT_SYMBOLS.join(", "), str::to_owned);
        let exported = if inspection.exported.is_empty() {
            "no symbol".to_owned()
        } else {
            inspection.exported.join(", ")
        };
        let message = format!(
            "library {} has no routine {wanted}; it exports {exported}",
            self.library.display()
        );
        let error: Error = law::Error::library(message).into();
        Err(error.with_hint("`--symbol` names the routine"))
    }

    fn text(&self, id: &str, hypotheses: &[&str], symbol: Option<&str>) -> String {
        let quoted: Vec<String> = hypotheses.iter().map(|h| format!("\"{h}\"")).collect();
        let ntens: Vec<String> = self.ntens.iter().map(u32::to_string).collect();
        let mut text = format!(
            "# What the numbers of a UMAT are called. Give every parameter and internal variable its name, unit\n\
             # and meaning: messages, tables and reports have them. Keys behind `#` may be wanted.\n\
             id = \"{id}\"                  # the `law` of case and driver files\n\
             # name = \"\"                  # and version, author, licence, doc, references\n\
             hypotheses = [{}]\n\
             ntens = [{}]\n",
            quoted.join(", "),
            ntens.join(", ")
        );
        if let Some(symbol) = symbol {
            let _ = writeln!(text, "symbol = {}", toml::Value::from(symbol));
        }
        text.push_str(
            "# time_dependent = true       # it creeps, relaxes or hardens with the rate: phases and segments say `time`\n\
             # tangent = \"approximate\"     # DDSDDE is not the derivative of the update, such as an elastic one\n\
             # tangent_order = \"rows\"      # DDSDDE row by row, as C routines leave it\n\
             # symmetric = true            # DDSDDE always is\n\
             # thread_safe = true          # several points at a time: no SAVE, no COMMON, no files\n",
        );
        let names = ["[[parameter]]", "PROPS", "prop", "Parameter"];
        let hints = "# lower = 0.0                # and upper, open_lower, open_upper, usual = [a, b]\n\
                     # default = 0.0\n";
        tables(&mut text, self.nprops, names, hints);
        let names = ["[[internal]]", "STATEV", "statev", "Internal variable"];
        let hints =
            "# initial = 0.0\n# components = 6             # several values under one name\n";
        tables(&mut text, self.nstatv, names, hints);
        text
    }

    fn next_steps(&self, out: &Path, name: &str, hypothesis: &str) -> String {
        let id = identifier(name);
        let library = self.library.display();
        format!(
            "sidecar in {}: {} parameters, {} internal variables\n\
             It can be used as it is. Name its entries, then:\n\
             \x20 pilum laws {library}        # its page\n\
             \x20 pilum check {library}       # what the routine does\n\
             In a driver or under [laws.NAME] of a case:\n\
             \x20 adapter = \"umat\"\n  library = \"{library}\"\n  law = \"{id}\"          # hypothesis {hypothesis} and others\n",
            out.display(),
            self.nprops,
            self.nstatv
        )
    }
}

/// `libNAME.so` is called NAME.
fn name_of(library: &Path) -> String {
    let stem = library.file_stem().unwrap_or_default().to_string_lossy();
    stem.strip_prefix("lib").unwrap_or(&stem).to_owned()
}

/// The id that a name makes: small letters, digits and `_`, a letter first.
fn identifier(name: &str) -> String {
    let fits = |c: char| {
        if c.is_ascii_alphanumeric() {
            c.to_ascii_lowercase()
        } else {
            '_'
        }
    };
    let id: String = name.chars().map(fits).collect();
    if id.starts_with(|c: char| c.is_ascii_lowercase()) {
        id
    } else {
        format!("umat_{id}")
    }
}

/// Tables of an array of the routine, with hints in the first one.
fn tables(text: &mut String, n: u32, [table, array, id, word]: [&str; 4], hints: &str) {
    for i in 1..=n {
        let hints = if i == 1 { hints } else { "" };
        let _ = write!(
            text,
            "\n{table:<31}# {array}({i})\n\
             id = \"{id}_{i}\"\n\
             unit = \"-\"\n\
             doc = \"{word} {i}\"\n\
             {hints}"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_become_ids() {
        for (file, id) in [
            ("libmysand.so", "mysand"),
            ("dir/libMySand-2.so", "mysand_2"),
            ("umat.so", "umat"),
            ("lib2phase.so", "umat_2phase"),
        ] {
            assert_eq!(identifier(&name_of(Path::new(file))), id, "{file}");
        }
    }
}
