//! `pilum export` and `pilum import`: problems for other programs, and their results.

use crate::arguments::Export;
use crate::output::{print, printing};
use input::{Case, Error};
use law::Opener;
use runs::variants;
use std::path::{Path, PathBuf};

pub(super) fn export(asked: &Export, opener: &Opener) -> Result<(), Error> {
    let mut cases = Case::load_with(&asked.case, &asked.set)?;
    let variant = asked.variant.as_deref();
    variants::keep(&mut cases, variant, |case| case.variant.clone())?;
    let [case] = cases.as_slice() else {
        let message = "the case has several variants: name one with --variant";
        return Err(Error::usage(message));
    };
    let case = case.clone().opened_by(opener);
    let program = asked.to;
    let folder = asked.out.clone().unwrap_or_else(|| {
        let name = format!("{}_{}", case.name(), program.name().to_lowercase());
        let folder = Path::new("results").join(name);
        case.variant
            .as_ref()
            .map_or_else(|| folder.clone(), |variant| folder.join(variant))
    });
    let not_carried = exchange::export(&case, program, &folder)
        .map_err(|error| variants::of_variant(error, case.variant.as_deref()))?;
    printing(|out| {
        if !not_carried.is_empty() {
            out.line("not carried:");
        }
        for key in &not_carried {
            out.line(&format!("  {key}"));
        }
        out.line(&format!("in {}: {}", folder.display(), program.command()));
        Ok(())
    })
}

pub(super) fn import(folder: &Path, out: Option<&Path>) -> Result<(), Error> {
    let into: PathBuf = exchange::import(folder, out)?;
    print(&format!("results in {}\n", into.display()))
}
