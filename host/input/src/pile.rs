//! The pile of a case: names resolved to groups and lines.

use crate::Error;
use crate::build::line;
use crate::case::{Case, GroupNames, PileInput};
use mechanics::Simulation;
use results::pile::{Base, Misfit, Parts, Pile};
use text::{Source, Spanned, suggestion};

/// The base of the pile: a group other than its shaft, or a line.
fn base(
    source: &Source,
    written: &Spanned<String>,
    simulation: &Simulation,
    shaft: &[usize],
) -> Result<Base, Error> {
    let name = written.get_ref();
    let lines = &simulation.problem().mesh.lines;
    let groups = || simulation.groups().iter().map(|group| group.name.as_str());
    match groups().position(|other| other == name) {
        Some(number) if shaft.contains(&number) => {
            let message = format!("[pile]: group `{name}` cannot be both shaft and base");
            Err(source.error(written.span(), message).into())
        }
        Some(number) => Ok(Base::Group(number)),
        None if lines.contains_key(name) => Ok(Base::Line(name.clone())),
        None => {
            let message = format!("[pile]: there is neither a group nor a line `{name}`");
            let names = groups().chain(lines.keys().map(String::as_str));
            let error = source.error(written.span(), message);
            Err(error
                .hint(suggestion(name, names.collect::<Vec<_>>()))
                .into())
        }
    }
}

/// Numbers of the groups that a key of `pile` names: at least one, none twice. The table is at `table`.
fn numbers(
    case: &Case,
    simulation: &Simulation,
    (names, key): (&GroupNames, &str),
    table: &Spanned<String>,
) -> Result<Vec<usize>, Error> {
    let (source, GroupNames(names)) = (&case.source, names);
    let known = || simulation.groups().iter().map(|group| group.name.as_str());
    let number = |name: &Spanned<String>| {
        let number = known().position(|other| other == name.get_ref());
        number.ok_or_else(|| {
            let message = format!("[pile]: there is no group `{}`", name.get_ref());
            let names: Vec<&str> = known().collect();
            let error = source.error(name.span(), message);
            Error::from(error.hint(suggestion(name.get_ref(), names)))
        })
    };
    let numbers = names.iter().map(number).collect::<Result<Vec<_>, _>>()?;
    for (number, name) in names.iter().enumerate() {
        if names[..number].contains(name) {
            let message = format!("[pile]: `{key}` names group `{}` twice", name.get_ref());
            return Err(source.error(name.span(), message).into());
        }
    }
    if numbers.is_empty() {
        let message = format!("[pile]: `{key}` is an empty list; it needs a group");
        return Err(source.error(table.span(), message).into());
    }
    Ok(numbers)
}

/// The pile that a case names, within its mesh.
///
/// # Errors
/// [`text::Error::Input`] at the name that does not fit.
pub fn resolve(case: &Case, simulation: &Simulation) -> Result<Option<Pile>, Error> {
    let Some(input) = &case.file.pile else {
        return Ok(None);
    };
    let source = &case.source;
    let mesh = &simulation.problem().mesh;
    let of_pile = numbers(case, simulation, (&input.group, "group"), &input.head)?;
    let shaft = numbers(case, simulation, (&input.shaft, "shaft"), &input.head)?;
    line(mesh, source, &input.head)?;
    let base = base(source, &input.base, simulation, &shaft)?;
    let diameter = input.diameter.as_ref();
    if let Some(diameter) = diameter
        && !(*diameter.get_ref() > 0.0 && diameter.get_ref().is_finite())
    {
        let message = format!("[pile]: a diameter of {} m is none", diameter.get_ref());
        return Err(source.error(diameter.span(), message).into());
    }
    let parts = Parts {
        groups: of_pile,
        shaft,
        base,
        head: input.head.get_ref().clone(),
        diameter: diameter.map(|diameter| *diameter.get_ref()),
    };
    let placed = |misfit| {
        let (at, what) = told(&misfit, input);
        let message = format!("[pile]: `{}` {what}", at.get_ref());
        source.error(at.span(), message).into()
    };
    Pile::new(parts, simulation).map(Some).map_err(placed)
}

/// Place of a mismatch, and the mismatch.
fn told<'i>(misfit: &Misfit, input: &'i PileInput) -> (&'i Spanned<String>, &'static str) {
    match *misfit {
        Misfit::NotSolid(number) => (
            &input.group.0[number],
            "is an interface; a pile is made of `solid` groups",
        ),
        Misfit::Head => (
            &input.head,
            "has no edge of the pile's elements: name the line along the top of the pile",
        ),
        Misfit::NotAnInterface(number) => (
            &input.shaft.0[number],
            "is no interface; a shaft has `zero_thickness` or `thin_layer` groups",
        ),
        Misfit::ApartFromShaft(number) => {
            (&input.shaft.0[number], "does not touch the pile's groups")
        }
        Misfit::BaseNotAnInterface => (
            &input.base,
            "is no interface; a base is a `zero_thickness` or `thin_layer` group, or a line",
        ),
        Misfit::Base => (&input.base, "does not touch the pile's groups"),
        Misfit::BaseInside => (
            &input.base,
            "lies inside the pile's groups; the base is where they end below",
        ),
        Misfit::UpsideDown => (&input.base, "is not below the pile's head"),
    }
}
