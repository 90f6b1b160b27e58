//! Meshes of columns and rows: grid, regions and lines.

use crate::Error;
use crate::case::{CaseFile, Coordinate, LineInput, PartInput, RegionInput};
use mechanics::mesh::{Line, Mesh, Solid};
use mechanics::problem::{Analysis, Formulation};
use text::{Source, Spanned};

/// Columns or rows as the file says them.
type Parts = Spanned<Vec<Spanned<PartInput>>>;

/// Most columns times rows.
const MOST_ELEMENTS: usize = 4_000_000;
/// Largest coordinate, m.
const FARTHEST: f64 = 1e9;
/// Two coordinates are the same within this fraction of the mesh's size.
const SAME: f64 = 1e-9;

/// The grid of a case, without what is inserted along its lines.
///
/// # Errors
/// [`text::Error::Input`] at the key that does not fit.
pub(crate) fn grid_mesh(
    source: &Source,
    file: &CaseFile,
    parts: [&Parts; 2],
) -> Result<Mesh, Error> {
    let (x, y) = grids(source, file, parts)?;
    let groups = element_groups(source, file, &x, &y)?;
    let n_columns = x.len() - 1;
    let mut mesh = Mesh::grid(&x, &y, |column, row| groups[row * n_columns + column]);
    for (name, line) in &file.mesh.lines {
        let found = find_line(&mesh, [&x, &y], line.get_ref()).map_err(|why| {
            let message = format!("line `{}`: {why}", name.get_ref());
            source.error(line.span(), message)
        })?;
        mesh.lines.insert(name.get_ref().clone(), found);
    }
    Ok(mesh)
}

/// Coordinates of the grid lines in x and y.
fn grids(
    source: &Source,
    file: &CaseFile,
    [columns, rows]: [&Parts; 2],
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let origin = &file.mesh.origin;
    let start = origin.as_ref().map_or([0.0; 2], |origin| *origin.get_ref());
    let span = origin.as_ref().map_or(columns.span(), Spanned::span);
    if start.iter().any(|at| at.abs() > FARTHEST) {
        let message = format!("`origin` is {start:?}, expected at most {FARTHEST:e} m");
        return Err(source.error(span, message).into());
    }
    if file.analysis == Analysis::Axisymmetric && start[0] < 0.0 {
        let message = format!("the mesh starts at r = {}, across the axis", start[0]);
        return Err(source
            .error(span, message)
            .hint("r is 0 on the axis and grows outward")
            .into());
    }
    let x = grid(source, "columns", start[0], columns)?;
    let y = grid(source, "rows", start[1], rows)?;
    let (n_columns, n_rows) = (x.len() - 1, y.len() - 1);
    if n_columns.saturating_mul(n_rows) > MOST_ELEMENTS {
        let message = format!(
            "{n_columns} columns × {n_rows} rows: at most {MOST_ELEMENTS} elements are possible"
        );
        return Err(source.error(columns.span(), message).into());
    }
    // Lines must be able to tell the two sides of an element apart.
    let least = 4.0 * tolerance([&x, &y]);
    for (grid, parts) in [(&x, columns), (&y, rows)] {
        let mut sides = grid.iter().zip(&grid[1..]);
        if let Some((from, to)) = sides.find(|(from, to)| *to - *from < least) {
            let message = format!(
                "elements between {from:?} and {to:?} are thinner than {least:.1e} m, {:.0e} of \
                 the mesh",
                4.0 * SAME
            );
            return Err(source.error(parts.span(), message).into());
        }
    }
    Ok((x, y))
}

/// Within this distance two coordinates are the same.
fn tolerance(grids: [&[f64]; 2]) -> f64 {
    let [width, height] = grids.map(|grid| grid[grid.len() - 1] - grid[0]);
    SAME * width.max(height)
}

/// Coordinates of the grid lines in one direction.
fn grid(source: &Source, name: &str, origin: f64, parts: &Parts) -> Result<Vec<f64>, Error> {
    let mut at = vec![origin];
    for part in parts.get_ref() {
        let PartInput { n, to, ratio } = *part.get_ref();
        let error = |message: String| Err(source.error(part.span(), message).into());
        let start = at[at.len() - 1];
        if n == 0 || n > MOST_ELEMENTS {
            return error(format!("`n` is {n}, expected 1 to {MOST_ELEMENTS}"));
        }
        if at.len() + n > MOST_ELEMENTS {
            return error(format!("more than {MOST_ELEMENTS} {name} up to here"));
        }
        if !ratio.is_finite() || ratio <= 0.0 {
            return error(format!("`ratio` is {ratio}, expected a positive number"));
        }
        if to <= start {
            return error(format!(
                "`to` is {to}, expected more than {start}, where the part starts"
            ));
        }
        if to > FARTHEST {
            return error(format!("`to` is {to:e}, expected at most {FARTHEST:e} m"));
        }
        // Sizes first, first·ratio, first·ratio², … add up to the whole part.
        let sizes: Vec<f64> = (0..n).map(|i| ratio.powi(i as i32)).collect();
        let total: f64 = sizes.iter().sum();
        if !total.is_finite() || sizes.iter().any(|s| s / total < 1e-12) {
            return error(format!(
                "`ratio` {ratio} over {n} parts leaves parts of no size"
            ));
        }
        let mut sum = 0.0;
        for size in &sizes[..n - 1] {
            sum += size;
            at.push(start + (to - start) * sum / total);
        }
        at.push(to);
    }
    if at.len() < 2 {
        let message = format!("`{name}` is empty, the mesh needs some");
        return Err(source.error(parts.span(), message).into());
    }
    Ok(at)
}

/// Group number of every element, row by row.
fn element_groups(
    source: &Source,
    file: &CaseFile,
    x: &[f64],
    y: &[f64],
) -> Result<Vec<usize>, Error> {
    let (n_columns, n_rows) = (x.len() - 1, y.len() - 1);
    let mut group = vec![usize::MAX; n_columns * n_rows];
    for region in &file.mesh.regions {
        let RegionInput {
            group: name,
            x: in_x,
            y: in_y,
        } = region;
        let number = file
            .groups
            .keys()
            .position(|key| key.get_ref() == name.get_ref());
        let Some(number) = number else {
            let names = file.groups.keys().map(|key| key.get_ref().as_str());
            return Err(source.unknown("group", name, names).into());
        };
        if file.groups[number].get_ref().formulation == Formulation::ZeroThickness {
            let message = "a `zero_thickness` group is inserted along a line, it takes no region";
            return Err(source.error(name.span(), message).into());
        }
        let columns = interval(source, name.get_ref(), x, in_x.as_ref())?;
        let rows = interval(source, name.get_ref(), y, in_y.as_ref())?;
        for row in rows {
            group[row * n_columns..][columns.clone()].fill(number);
        }
    }
    if let Some(e) = group.iter().position(|&g| g == usize::MAX) {
        let (i, j) = (e % n_columns, e / n_columns);
        let regions = &file.mesh.regions;
        let columns = file.mesh.columns.as_ref().map_or(0..0, Spanned::span);
        let place = regions.last().map_or(columns, |region| region.group.span());
        let message = format!(
            "the element at ({:.6}, {:.6}) belongs to no region",
            f64::midpoint(x[i], x[i + 1]),
            f64::midpoint(y[j], y[j + 1])
        );
        return Err(source
            .error(place, message)
            .hint("a first [[mesh.region]] with only a `group` covers everything")
            .into());
    }
    Ok(group)
}

/// Which columns (or rows) an extent covers. Its ends must be grid lines.
fn interval(
    source: &Source,
    group: &str,
    grid: &[f64],
    extent: Option<&Spanned<[f64; 2]>>,
) -> Result<std::ops::Range<usize>, Error> {
    let Some(extent) = extent else {
        return Ok(0..grid.len() - 1);
    };
    let tolerance = SAME * (grid[grid.len() - 1] - grid[0]);
    let error = |why: String| {
        let message = format!("region of group `{group}`: {why}");
        Error::from(source.error(extent.span(), message))
    };
    let index = |at: f64| grid_line(grid, at, tolerance).map_err(error);
    let [from, to] = *extent.get_ref();
    let (from, to) = (index(from)?, index(to)?);
    if from >= to {
        return Err(error(
            "its extent is empty, expected [smaller, larger]".to_owned(),
        ));
    }
    Ok(from..to)
}

/// Number of the grid line at a coordinate.
fn grid_line(grid: &[f64], at: f64, tolerance: f64) -> Result<usize, String> {
    let nearest = (0..grid.len())
        .min_by(|&a, &b| (grid[a] - at).abs().total_cmp(&(grid[b] - at).abs()))
        .unwrap_or(0);
    if (grid[nearest] - at).abs() <= tolerance {
        Ok(nearest)
    } else {
        Err(format!(
            "{at} is no grid line, the nearest is {}",
            grid[nearest]
        ))
    }
}

/// Edges (or the node) of the mesh on a line.
fn find_line(mesh: &Mesh, grids: [&[f64]; 2], line: &LineInput) -> Result<Line, String> {
    let tolerance = tolerance(grids);
    let within = |(wanted, at): (Option<Coordinate>, f64)| match wanted {
        None => true,
        Some(Coordinate::At(position)) => (at - position).abs() <= tolerance,
        Some(Coordinate::Between([from, to])) => at >= from - tolerance && at <= to + tolerance,
    };
    let wanted = [line.x, line.y];
    let on = |node: usize| wanted.into_iter().zip(mesh.nodes[node]).all(within);
    for (coordinate, grid) in wanted.into_iter().zip(grids) {
        if let Some(Coordinate::Between([from, to])) = coordinate {
            let from = grid_line(grid, from, tolerance)?;
            if from >= grid_line(grid, to, tolerance)? {
                return Err("its extent is empty, expected [smaller, larger]".to_owned());
            }
        }
    }
    match (line.x, line.y) {
        (Some(Coordinate::At(_)), Some(Coordinate::At(_))) => {
            let nodes: Vec<usize> = (0..mesh.nodes.len()).filter(|&n| on(n)).collect();
            if nodes.is_empty() {
                return Err("there is no node at this point".to_owned());
            }
            Ok(Line {
                nodes,
                ..Line::default()
            })
        }
        (Some(Coordinate::At(at)), _) | (_, Some(Coordinate::At(at))) => {
            let along_y = matches!(line.x, Some(Coordinate::At(_)));
            grid_line(grids[usize::from(!along_y)], at, tolerance)?;
            let is_on: Vec<bool> = (0..mesh.nodes.len()).map(on).collect();
            let touches = |quad: &Solid| quad.nodes().iter().any(|&node| is_on[node]);
            let mut line = Line::default();
            for (q, quad) in mesh.solids.iter().enumerate().filter(|(_, s)| touches(s)) {
                for (e, edge) in quad.edges().enumerate() {
                    if edge.into_iter().all(|node| is_on[node]) {
                        line.edges.push((q, e));
                    }
                }
            }
            if line.edges.is_empty() {
                return Err("no edge of an element lies on it".to_owned());
            }
            Ok(line)
        }
        _ => Err("one coordinate must be a number, such as `x = 0.0`".to_owned()),
    }
}
