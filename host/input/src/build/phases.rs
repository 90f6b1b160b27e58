//! Phases as a problem has them.

use crate::Error;
use crate::case::{CaseFile, DirectedStrain, PhaseInput, StrainInput};
use crate::ground::level;
use crate::spanned::Given;
use mechanics::problem::{Analysis, Axis, Displacement, Force, Free, Phase, Pressure, Until};
use text::Source;
use toml::Spanned;

/// A phase without its laws.
pub(super) fn phase(source: &Source, file: &CaseFile, input: &PhaseInput) -> Result<Phase, Error> {
    let axes = |axes: &[crate::case::Axis]| -> Vec<Axis> {
        axes.iter().map(|&axis| axis.into()).collect()
    };
    // Unknown names were refused.
    let number = |name: &Spanned<String>| {
        file.groups
            .keys()
            .position(|key| key.get_ref() == name.get_ref())
    };
    let numbers = |names: &[Spanned<String>]| names.iter().filter_map(number).collect();
    let displacement = input.displacement.iter().map(|input| Displacement {
        line: input.line.get_ref().clone(),
        x: input.x,
        y: input.y,
    });
    let free = input.free.iter().map(|input| Free {
        line: input.line.get_ref().clone(),
        components: axes(&input.components),
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
    let weights = input.unit_weight.iter();
    let drainage = input.drainage.iter();
    let course = input.course.as_ref();
    let water = input.water.as_ref();
    Ok(Phase {
        name: input.name.get_ref().clone(),
        increments: *input.increments.get_ref(),
        time: input.time.value(),
        materials: Vec::new(),
        activate: numbers(&input.activate),
        deactivate: numbers(&input.deactivate),
        unit_weight: weights
            .filter_map(|(name, weight)| Some((number(name)?, *weight.get_ref())))
            .collect(),
        water_level: water
            .map(|water| level(source, &water.get_ref().level))
            .transpose()?,
        drainage: drainage
            .filter_map(|(name, drainage)| Some((number(name)?, *drainage.get_ref())))
            .collect(),
        rigid: input
            .rigid
            .iter()
            .map(|line| line.get_ref().clone())
            .collect(),
        course: match course {
            Some(course) if course.get_ref().is_empty() => {
                let message = "`course` is empty; left out, a phase's loads rise straight";
                return Err(source.error(course.span(), message).into());
            }
            course => course
                .map(|course| course.get_ref().clone())
                .unwrap_or_default(),
        },
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
        // Unknown names were refused.
        let mut names = file.groups.keys();
        if let Some(number) = names.position(|key| key.get_ref() == name.get_ref()) {
            strains.push((number, strain));
        }
    }
    Ok(strains)
}
