//! Phases as a problem has them.

use crate::Error;
use crate::case::{CaseFile, DirectedStrain, PhaseInput, StrainInput};
use crate::ground::level;
use crate::spanned::Given;
use mechanics::problem::{Analysis, Displacement, Force, Free, Phase, Pressure, Until};
use text::{Named, Source, Spanned};

/// A phase without its laws.
pub(super) fn phase(source: &Source, file: &CaseFile, input: &PhaseInput) -> Result<Phase, Error> {
    let number = |name: &Spanned<String>| number(file, name);
    let numbers = |names: &[Spanned<String>]| names.iter().filter_map(number).collect();
    let lines = |names: &[Spanned<String>]| names.iter().map(|n| n.get_ref().clone()).collect();
    let displacement = input.displacement.iter().map(|input| Displacement {
        line: input.line.get_ref().clone(),
        x: input.x,
        y: input.y,
    });
    let free = input.free.iter().map(|input| Free {
        line: input.line.get_ref().clone(),
        components: input.components.iter().map(|&axis| axis.into()).collect(),
    });
    let pressure = input.pressure.iter().map(|input| {
        Ok(Pressure {
            line: input.line.get_ref().clone(),
            value: input.value.get_ref().read(source, input.value.span())?,
        })
    });
    let force = input.force.iter().map(|input| Force {
        line: input.line.get_ref().clone(),
        x: input.x,
        y: input.y,
    });
    let water = input.water.as_ref();
    let water_level = water.map(|water| level(source, &water.get_ref().level));
    Ok(Phase {
        name: input.name.get_ref().clone(),
        increments: *input.increments.get_ref(),
        time: input.time.value(),
        materials: Vec::new(),
        activate: numbers(&input.activate),
        deactivate: numbers(&input.deactivate),
        unit_weight: of_groups(file, &input.unit_weight),
        water_level: water_level.transpose()?,
        drainage: of_groups(file, &input.drainage),
        rigid: lines(&input.rigid),
        course: course(source, input)?,
        until: input.until.as_ref().map(|until| Until {
            quantity: until.get_ref().quantity.get_ref().clone(),
            reaches: until.get_ref().reaches,
        }),
        strain: strains(source, file, input)?,
        force: force.collect(),
        reset_displacements: input.reset_displacements,
        displacement: displacement.collect(),
        free: free.collect(),
        pressure: pressure.collect::<Result<_, Error>>()?,
    })
}

/// The number of a group; unknown names were refused.
fn number(file: &CaseFile, name: &Spanned<String>) -> Option<usize> {
    let mut names = file.groups.keys();
    names.position(|key| key.get_ref() == name.get_ref())
}

/// Values by the numbers of their groups.
fn of_groups<T: Copy>(file: &CaseFile, given: &Named<T>) -> Vec<(usize, T)> {
    let given = given.iter();
    given
        .filter_map(|(name, value)| Some((number(file, name)?, *value.get_ref())))
        .collect()
}

/// The course of a phase's changes; empty where they rise straight.
fn course(source: &Source, input: &PhaseInput) -> Result<Vec<[f64; 2]>, Error> {
    let course = input.course.as_ref();
    if let Some(course) = course.filter(|course| course.get_ref().is_empty()) {
        let message = "`course` is empty; left out, a phase's loads rise straight";
        return Err(source.error(course.span(), message).into());
    }
    Ok(course
        .map(|course| course.get_ref().clone())
        .unwrap_or_default())
}

/// The stress-free strains that a phase gives groups, along 11 22 33.
fn strains(
    source: &Source,
    file: &CaseFile,
    input: &PhaseInput,
) -> Result<Vec<(usize, [f64; 3])>, Error> {
    let mut strains = Vec::new();
    for (name, written) in &input.strain {
        let strain = match written.get_ref() {
            StrainInput::Isotropic(strain) => [*strain; 3],
            StrainInput::Directed(strain) => {
                let DirectedStrain { r, theta, x, y, z } = strain;
                let (own, others) = match file.analysis {
                    Analysis::Axisymmetric => ([r, z, theta], [("x", x), ("y", y)]),
                    Analysis::PlaneStrain => ([x, y, z], [("r", r), ("theta", theta)]),
                };
                let mut others = others.into_iter();
                if let Some((key, _)) = others.find(|(_, value)| value.is_some()) {
                    let analysis = file.analysis.name();
                    let message = format!("`{key}` is no direction of the analysis `{analysis}`");
                    let hint = match file.analysis {
                        Analysis::Axisymmetric => "there is: r, z, theta",
                        Analysis::PlaneStrain => "there is: x, y, z (out of plane)",
                    };
                    return Err(source.error(written.span(), message).hint(hint).into());
                }
                own.map(|value| value.unwrap_or(0.0))
            }
        };
        if let Some(number) = number(file, name) {
            strains.push((number, strain));
        }
    }
    Ok(strains)
}
