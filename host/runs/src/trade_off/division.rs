//! Finer meshes of the same case.

use crate::Error;
use input::case::{Axis, PartInput};
use input::{Case, mesh};
use mechanics::mesh::{Mesh, Solid};
use mechanics::problem::Formulation;
use text::Spanned;

/// Divides sides of elements by a whole number. In a grid columns and rows are divided, so that the
/// lines of the given mesh stay. Elements of a file have their sides halved until there are that
/// many parts. Across a thin layer of a grid the number of elements stays: the thickness of a layer
/// is its element's. A file with such a layer is not divided.
///
/// # Errors
/// Those of building the mesh.
pub(super) fn divide(case: &mut Case, by: usize) -> Result<(), Error> {
    if case.file.mesh.file.is_some() {
        case.file.mesh.divisions += by.next_power_of_two().ilog2();
        return Ok(());
    }
    let mesh = mesh::build(&case.source, &case.file)?.mesh;
    let layers = layers(case, &mesh);
    let input = &mut case.file.mesh;
    let origin = input.origin.as_ref().map_or([0.0; 2], |at| *at.get_ref());
    let directions = [&mut input.columns, &mut input.rows];
    for (axis, parts) in directions.into_iter().enumerate() {
        let Some(parts) = parts else {
            continue;
        };
        let mut start = origin[axis];
        for part in parts.get_mut().iter_mut().map(Spanned::get_mut) {
            let end = part.to;
            let across = |at: &f64| start < *at && *at < end;
            if !layers[axis].iter().any(across) {
                *part = divided(*part, by);
            }
            start = end;
        }
    }
    Ok(())
}

/// A part whose elements are divided; their sizes remain one geometric series.
fn divided(part: PartInput, by: usize) -> PartInput {
    PartInput {
        n: part.n * by,
        ratio: part.ratio.powf(1.0 / by as f64),
        ..part
    }
}

/// Middles of the elements of thin layers in the direction across them: x's, then y's.
fn layers(case: &Case, mesh: &Mesh) -> [Vec<f64>; 2] {
    let mut layers = [Vec::new(), Vec::new()];
    for (number, group) in case.file.groups.values().enumerate() {
        let group = group.get_ref();
        if group.formulation != Formulation::ThinLayer {
            continue;
        }
        for quad in mesh.solids.iter().filter(|quad| quad.group == number) {
            let [from, to] = extent(mesh, quad);
            let across = group.normal.as_ref().map_or_else(
                || usize::from(to[1] - from[1] < to[0] - from[0]),
                |normal| usize::from(*normal.get_ref() == Axis::Y),
            );
            layers[across].push(0.5 * (from[across] + to[across]));
        }
    }
    layers
}

/// Lower left and upper right corner.
fn extent(mesh: &Mesh, quad: &Solid) -> [[f64; 2]; 2] {
    [0, 2].map(|corner| mesh.nodes[quad.corners()[corner]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use text::{Source, parse};

    /// A layer of 0.1 m between a graded and an even part.
    const CASE: &str = r#"
analysis = "plane_strain"
mesh.columns = [{ n = 3, to = 1.0, ratio = 2.0 }, { n = 1, to = 1.1 }, { n = 2, to = 2.0 }]
mesh.rows = [{ n = 1, to = 1.0 }]
mesh.region = [{ group = "soil" }, { group = "layer", x = [1.0, 1.1] }]
laws.soil = { law = "elastic" }
groups.soil = { formulation = "solid", integration = "full", law = "soil" }
groups.layer = { formulation = "thin_layer", law = "soil" }
[[phase]]
name = "load"
increments = 1
"#;

    fn xs(case: &Case) -> Vec<f64> {
        let mesh = mesh::build(&case.source, &case.file).unwrap().mesh;
        let mut xs: Vec<f64> = mesh
            .solids
            .iter()
            .flat_map(|solid| extent(&mesh, solid).map(|corner| corner[0]))
            .collect();
        xs.sort_by(f64::total_cmp);
        xs.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
        xs
    }

    #[test]
    fn coarse_lines_stay_and_layers_are_not_divided_across() {
        let source = Source::new("case.toml", CASE);
        let mut case = Case {
            file: parse(&source).unwrap(),
            source,
            variant: None,
            opener: law::Opener::default(),
        };
        let coarse = xs(&case);
        divide(&mut case, 2).unwrap();
        let fine = xs(&case);
        assert_eq!(fine.len(), 2 * (coarse.len() - 1));
        for x in coarse {
            let nearest = fine.iter().map(|f| (f - x).abs()).fold(1.0, f64::min);
            assert_relative_eq!(nearest, 0.0, epsilon = 1e-14);
        }
        let between = fine.iter().filter(|x| **x > 1.0 + 1e-9 && **x < 1.1 - 1e-9);
        assert_eq!(between.count(), 0);
    }
}
