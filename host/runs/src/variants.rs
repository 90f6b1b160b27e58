//! Selection among variants, for cases and drivers.

use crate::Error;
use std::path::{Path, PathBuf};
use text::suggestion;

/// Keeps the variant that is asked for; all, if none is.
///
/// # Errors
/// There is no such variant.
pub fn keep<T>(
    all: &mut Vec<T>,
    wanted: Option<&str>,
    name: impl Fn(&T) -> Option<String>,
) -> Result<(), Error> {
    let Some(wanted) = wanted else { return Ok(()) };
    let names: Vec<String> = all.iter().filter_map(&name).collect();
    all.retain(|one| name(one).as_deref() == Some(wanted));
    if all.is_empty() {
        let known = suggestion(wanted, names.iter().map(String::as_str).collect::<Vec<_>>());
        let message = format!("there is no variant `{wanted}`: {known}");
        return Err(Error::usage(message));
    }
    Ok(())
}

/// An error of one of several runs, which names the variant if it is of one.
#[must_use]
pub fn of_variant(error: Error, variant: Option<&str>) -> Error {
    match variant {
        Some(name) => error.with_hint(&format!("this is variant `{name}`")),
        None => error,
    }
}

/// Folder of results: `out`, or the one of this name under `results`; of one of several variants, none of which was
/// chosen, a folder inside it.
pub(crate) fn folder(
    out: Option<&Path>,
    name: &str,
    variant: Option<&str>,
    chosen: Option<&str>,
) -> PathBuf {
    let all = out.map_or_else(|| Path::new("results").join(name), Path::to_owned);
    match variant {
        Some(variant) if chosen.is_none() => all.join(variant),
        _ => all,
    }
}
