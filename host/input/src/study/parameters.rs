//! Checks of a study's parameters before any case is read.

use super::{COLUMNS, Keys, MOST_RUNS, Method, Parameter, ParameterInput, Spread, StudyFile};
use crate::Error;
use crate::spanned::Given;
use std::ops::Range;
use text::{Source, Spanned};
use toml::Value;

/// Whether two values are one: 1 and 1.0 are.
fn is_equal(a: &Value, b: &Value) -> bool {
    let number = |value: &Value| match value {
        Value::Integer(number) => Some(*number as f64),
        Value::Float(number) => Some(*number),
        _ => None,
    };
    match (number(a), number(b)) {
        (Some(a), Some(b)) => a.total_cmp(&b).is_eq(),
        _ => a == b,
    }
}

/// Whether the keys of a parameter differ from those of earlier ones.
pub(super) fn check_keys(
    source: &Source,
    parameter: &Parameter,
    earlier: &[&str],
) -> Result<(), Error> {
    let of =
        |key: &str| -> Vec<String> { key.split('.').map(|part| part.trim().to_owned()).collect() };
    for (number, key) in parameter.keys.iter().enumerate() {
        let own = parameter.keys[..number].iter().map(String::as_str);
        for other in own.chain(earlier.iter().copied()) {
            let (a, b) = (of(key), of(other));
            let message = if a == b {
                format!("`{key}` is the key of two parameters, or twice that of one")
            } else if a.starts_with(&b) {
                format!(
                    "`{key}` is a part of `{other}`, which varies as well: one would undo the other"
                )
            } else if b.starts_with(&a) {
                format!(
                    "`{other}` is a part of `{key}`, and varies as well: one would undo the other"
                )
            } else {
                continue;
            };
            return Err(source.error(parameter.key.clone(), message).into());
        }
    }
    Ok(())
}

/// How many runs there are, and what chance has to do with it.
pub(super) fn check_counts(source: &Source, file: &StudyFile) -> Result<(), Error> {
    let method = file.method.name();
    let wrong = |span, message: String| Err(source.error(span, message).into());
    if file.parameters.is_empty() {
        let message = "a study needs a [[parameter]] that varies".to_owned();
        return wrong(0..0, message);
    }
    match &file.runs {
        Some(runs) if !file.method.is_sampled() => {
            let message = format!("`runs`: the values say how many runs a {method} has");
            return wrong(runs.span(), message);
        }
        Some(runs) if !(1..=MOST_RUNS).contains(runs.get_ref()) => {
            let message = format!("`runs`: {}, expected 1 to {MOST_RUNS}", runs.get_ref());
            return wrong(runs.span(), message);
        }
        Some(runs)
            if file.method == Method::Saltelli
                && runs.get_ref() * (file.parameters.len() + 2) > MOST_RUNS =>
        {
            let message = format!(
                "`runs`: {} base points of {} runs each, at most {MOST_RUNS} runs are possible",
                runs.get_ref(),
                file.parameters.len() + 2
            );
            return wrong(runs.span(), message);
        }
        None if file.method.is_sampled() => {
            let message = format!("missing key `runs`: how many points `{method}` has");
            return wrong(0..0, message);
        }
        _ => {}
    }
    match &file.seed {
        Some(seed) if !file.method.is_sampled() => {
            let message = format!("`seed`: nothing is random in a {method}");
            wrong(seed.span(), message)
        }
        _ => Ok(()),
    }
}

/// Definition of the values: its key, its place, the values.
type NamedSpread = (&'static str, Range<usize>, Spread);

/// All of them that are given.
fn spreads(source: &Source, input: &ParameterInput) -> Result<Vec<NamedSpread>, Error> {
    let wrong = |span: Range<usize>, message: String| Err(source.error(span, message).into());
    let mut spreads: Vec<NamedSpread> = Vec::new();
    if let Some(listed) = &input.values {
        if listed.get_ref().is_empty() {
            return wrong(listed.span(), "`values`: there is none".to_owned());
        }
        let listed_values = listed.get_ref().iter().map(|value| value.get_ref().clone());
        spreads.push((
            "values",
            listed.span(),
            Spread::Values(listed_values.collect()),
        ));
    }
    if let Some(range) = &input.uniform {
        let &[from, to] = range.get_ref();
        if from >= to {
            let message = format!("`uniform`: {from} is not below {to}");
            return wrong(range.span(), message);
        }
        spreads.push(("uniform", range.span(), Spread::Uniform([from, to])));
    }
    if let Some(range) = &input.log_uniform {
        let &[from, to] = range.get_ref();
        if from >= to || from <= 0.0 {
            let message = format!(
                "`log_uniform`: expected two numbers above 0, the smaller one first, found {from} and {to}"
            );
            return wrong(range.span(), message);
        }
        spreads.push(("log_uniform", range.span(), Spread::LogUniform([from, to])));
    }
    if let Some(normal) = &input.normal {
        let of = *normal.get_ref();
        if of.deviation <= 0.0 || of.min >= of.max {
            let message = "`normal`: expected a `deviation` above 0, and `min` below `max`";
            return wrong(normal.span(), message.to_owned());
        }
        spreads.push(("normal", normal.span(), Spread::Normal(of)));
    }
    Ok(spreads)
}

/// Whether there are values at all, and in a grid each once; `places` is where they stand.
fn check_values(
    source: &Source,
    (method, is_whole): (Method, bool),
    spread: &Spread,
    places: &[Range<usize>],
) -> Result<(), Error> {
    let wrong =
        |number: usize, message: String| Err(source.error(places[number].clone(), message).into());
    if is_whole
        && let Some([from, to]) = spread.ends()
        && from.ceil() > to.floor()
    {
        let message = format!("`whole`: there is no whole number from {from} to {to}");
        return wrong(0, message);
    }
    if method == Method::Grid
        && let Spread::Values(listed) = spread
    {
        let equal =
            (1..listed.len()).find(|&i| listed[..i].iter().any(|v| is_equal(v, &listed[i])));
        if let Some(i) = equal {
            let message = format!(
                "`values`: {} is there twice: a grid would repeat its runs",
                listed[i]
            );
            return wrong(i, message);
        }
    }
    Ok(())
}

/// Place and reason if `levels` do not fit the method or the spread, given by its name and place.
fn wrong_levels(
    input: &ParameterInput,
    method: Method,
    is_listed: bool,
    (called, place): (&str, &Range<usize>),
) -> Option<(Range<usize>, String)> {
    match &input.levels {
        Some(levels) if method != Method::Grid || is_listed => {
            let message = "`levels` is for distributions in a grid".to_owned();
            Some((levels.span(), message))
        }
        Some(levels) if !(1..=MOST_RUNS).contains(levels.get_ref()) => {
            let message = format!("`levels`: {}, expected 1 to {MOST_RUNS}", levels.get_ref());
            Some((levels.span(), message))
        }
        None if method == Method::Grid && !is_listed => {
            let message =
                format!("`{called}`: a grid needs `levels`, how many values of it there are");
            Some((place.clone(), message))
        }
        _ => None,
    }
}

/// The keys that a parameter sets, and its name, the first of them where it has no other.
fn keys_and_name(source: &Source, input: &ParameterInput) -> Result<(Vec<String>, String), Error> {
    let key = input.key.span();
    let keys = match input.key.get_ref() {
        Keys::One(key) => vec![key.trim().to_owned()],
        Keys::Several(keys) => keys.iter().map(|key| key.trim().to_owned()).collect(),
    };
    let are_named = keys.iter().all(|key| !key.is_empty());
    let Some(first) = keys.first().filter(|_| are_named) else {
        let message = "`key`: expected the dotted path of a key of the case";
        return Err(source.error(key, message).into());
    };
    let name = input.name.as_ref().map_or(first, Spanned::get_ref).clone();
    if name.is_empty() || COLUMNS.contains(&name.as_str()) {
        let span = input.name.as_ref().map_or(key, Spanned::span);
        let message = format!(
            "`{name}` is no name for a parameter: the table of runs has a column of this name"
        );
        return Err(source.error(span, message).into());
    }
    Ok((keys, name))
}

/// The spread of a parameter whose table is at `span`; exactly one kind of spread is allowed.
fn spread(
    source: &Source,
    input: &ParameterInput,
    name: &str,
    span: Range<usize>,
) -> Result<NamedSpread, Error> {
    let mut spreads = spreads(source, input)?;
    if spreads.len() > 1 {
        let names = spreads.iter().map(|(name, ..)| format!("`{name}`"));
        let names = names.collect::<Vec<_>>().join(" and ");
        let message = format!("{names} are given: a parameter has one of them");
        return Err(source.error(spreads[1].1.clone(), message).into());
    }
    spreads.pop().ok_or_else(|| {
        let message = format!(
            "`{name}` has no values: expected `values`, `uniform`, `log_uniform` or `normal`"
        );
        let end = span.start + source.text()[span.clone()].find('\n').unwrap_or(span.len());
        source.error(span.start..end, message).into()
    })
}

pub(super) fn parameter(
    source: &Source,
    method: Method,
    input: &Spanned<ParameterInput>,
) -> Result<Parameter, Error> {
    let span = input.span();
    let input = input.get_ref();
    let wrong = |span: Range<usize>, message: String| Err(source.error(span, message).into());
    let (keys, name) = keys_and_name(source, input)?;
    let (called, place, spread) = spread(source, input, &name, span)?;
    let is_listed = matches!(spread, Spread::Values(_));
    let values = match &input.values {
        Some(listed) => listed.get_ref().iter().map(Spanned::span).collect(),
        None => vec![place.clone()],
    };
    if method == Method::List && !is_listed {
        return wrong(place, format!("`{called}`: a list takes `values`"));
    }
    if let Some((at, message)) = wrong_levels(input, method, is_listed, (called, &place)) {
        return wrong(at, message);
    }
    if input.whole && is_listed {
        return wrong(
            place,
            "`whole` is for distributions: these are the values".to_owned(),
        );
    }
    check_values(source, (method, input.whole), &spread, &values)?;
    Ok(Parameter {
        name,
        keys,
        spread,
        whole: input.whole,
        levels: input.levels.value(),
        key: input.key.span(),
        values,
    })
}
