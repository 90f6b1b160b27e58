//! Meshes of columns and rows: grid, regions, lines, and elements inserted along lines.

use crate::Error;
use crate::build::line;
use crate::case::{CaseFile, Coordinate, LineInput, MeshInput, PartInput, RegionInput};
use indexmap::IndexMap;
use mechanics::mesh::{Joint, Line, Mesh, Solid};
use mechanics::problem::{Analysis, Formulation};
use std::collections::HashMap;
use text::{Source, suggestion};
use toml::Spanned;

/// Most columns times rows.
const MOST_ELEMENTS: usize = 4_000_000;
/// Largest coordinate, m.
const FARTHEST: f64 = 1e9;
/// Two coordinates are the same within this fraction of the mesh's size.
const SAME: f64 = 1e-9;

/// The mesh of a case.
///
/// # Errors
/// [`text::Error::Input`] at the key that does not fit.
pub fn build(source: &Source, file: &CaseFile) -> Result<Mesh, Error> {
    let input = &file.mesh;
    let (x, y) = grids(source, file)?;
    let groups = element_groups(source, file, &x, &y)?;
    let n_columns = x.len() - 1;
    let mut mesh = Mesh::grid(&x, &y, |column, row| groups[row * n_columns + column]);
    for (name, line) in &input.lines {
        let found = find_line(&mesh, [&x, &y], line.get_ref()).map_err(|why| {
            let message = format!("line `{}`: {why}", name.get_ref());
            source.error(line.span(), message)
        })?;
        mesh.lines.insert(name.get_ref().clone(), found);
    }
    insert_joints(source, file, &mut mesh)?;
    collect_line_nodes(&mut mesh);
    Ok(mesh)
}

/// A line along which the elements of a group are inserted.
struct Cut<'c> {
    group: usize,
    name: &'c Spanned<String>,
    line: &'c Spanned<String>,
}

/// Inserts the elements of all zero-thickness groups. Lines that go on from one another are one
/// line, cut once.
fn insert_joints(source: &Source, file: &CaseFile, mesh: &mut Mesh) -> Result<(), Error> {
    let wrong = |cut: &Cut<'_>, why: &str| {
        let message = format!("group `{}`: {why}", cut.name.get_ref());
        Error::from(source.error(cut.line.span(), message))
    };
    let mut taken: HashMap<usize, usize> = HashMap::new();
    let mut straight: IndexMap<(usize, u64), Vec<Cut<'_>>> = IndexMap::new();
    for (number, (name, group)) in file.groups.iter().enumerate() {
        let group = group.get_ref();
        match (group.formulation, &group.line) {
            (Formulation::ZeroThickness, Some(along)) => {
                let edges = &line(mesh, source, along)?.edges;
                let cut = Cut {
                    group: number,
                    name,
                    line: along,
                };
                let Some(&first) = edges.first() else {
                    return Err(wrong(&cut, "the line is a point"));
                };
                for &edge in edges {
                    let other = *taken.entry(mesh.edge(edge)[2]).or_insert(number);
                    if other != number {
                        let other = file.groups.get_index(other).map(|(name, _)| name);
                        let other = other.map_or("", |name| name.get_ref().as_str());
                        let why = format!("the line has elements of group `{other}` already");
                        return Err(wrong(&cut, &why));
                    }
                }
                let across = across(mesh, first);
                let position = mesh.nodes[mesh.edge(first)[0]][across];
                let cuts = straight.entry((across, position.to_bits())).or_default();
                cuts.push(cut);
            }
            (Formulation::ZeroThickness, None) => {
                let message = format!(
                    "group `{}` needs a `line` to be inserted along",
                    name.get_ref()
                );
                return Err(source.error(name.span(), message).into());
            }
            (_, Some(line)) => {
                let message = "`line` only belongs to the formulation `zero_thickness`";
                return Err(source.error(line.span(), message).into());
            }
            (_, None) => {}
        }
    }
    for cuts in straight.values() {
        split(mesh, cuts).map_err(|fault| match fault {
            Fault::OnBoundary => wrong(&cuts[0], "the line lies on the boundary: nothing to split"),
            Fault::Meets { group, other, at } => {
                let other = file.groups.get_index(other).map(|(name, _)| name);
                let other = other.map_or("", |name| name.get_ref().as_str());
                let cut = cuts.iter().find(|cut| cut.group == group);
                wrong(
                    cut.unwrap_or(&cuts[0]),
                    &format!(
                        "the line meets the line of the `zero_thickness` group `{other}` at ({}, {}) \
                         and one of them ends there: such lines may cross or go on from one \
                         another, but not end on each other",
                        at[0], at[1]
                    ),
                )
            }
        })?;
    }
    Ok(())
}

/// Why elements cannot be inserted along a straight line.
enum Fault {
    /// All of it lies on the boundary.
    OnBoundary,
    /// A group's line meets that of an earlier group, and one of them ends there.
    Meets {
        group: usize,
        other: usize,
        at: [f64; 2],
    },
}

/// Number of a quad and of its edge.
type Edge = (usize, usize);

/// The coordinate that is the same all along an edge.
fn across(mesh: &Mesh, edge: Edge) -> usize {
    let [a, b, _] = mesh.edge(edge).map(|node| mesh.nodes[node]);
    perpendicular(a, b)
}

/// The coordinate that two points of a grid line have in common.
fn perpendicular(a: [f64; 2], b: [f64; 2]) -> usize {
    usize::from((a[0] - b[0]).abs() >= (a[1] - b[1]).abs())
}

/// Coordinates of the grid lines in x and y.
fn grids(source: &Source, file: &CaseFile) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let MeshInput {
        origin,
        columns,
        rows,
        ..
    } = &file.mesh;
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
fn grid(
    source: &Source,
    name: &str,
    origin: f64,
    parts: &Spanned<Vec<Spanned<PartInput>>>,
) -> Result<Vec<f64>, Error> {
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
            let names: Vec<&str> = file
                .groups
                .keys()
                .map(|key| key.get_ref().as_str())
                .collect();
            return Err(source
                .error(
                    name.span(),
                    format!("there is no group `{}`", name.get_ref()),
                )
                .hint(suggestion(name.get_ref(), names))
                .into());
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
        let place = regions
            .last()
            .map_or(file.mesh.columns.span(), |region| region.group.span());
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
    let on = |node: usize| {
        [line.x, line.y]
            .iter()
            .zip(mesh.nodes[node])
            .all(|(wanted, at)| match wanted {
                None => true,
                Some(Coordinate::At(position)) => (at - position).abs() <= tolerance,
                Some(Coordinate::Between([from, to])) => {
                    at >= from - tolerance && at <= to + tolerance
                }
            })
    };
    for (coordinate, grid) in [line.x, line.y].into_iter().zip(grids) {
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
                edges: Vec::new(),
                nodes,
            })
        }
        (Some(Coordinate::At(at)), _) | (_, Some(Coordinate::At(at))) => {
            let along_y = matches!(line.x, Some(Coordinate::At(_)));
            grid_line(grids[usize::from(!along_y)], at, tolerance)?;
            let mut edges = Vec::new();
            for (q, quad) in mesh.solids.iter().enumerate() {
                for (e, edge) in quad.edges().enumerate() {
                    if edge.into_iter().all(on) {
                        edges.push((q, e));
                    }
                }
            }
            if edges.is_empty() {
                return Err("no edge of an element lies on it".to_owned());
            }
            Ok(Line {
                edges,
                nodes: Vec::new(),
            })
        }
        _ => Err("one coordinate must be a number, such as `x = 0.0`".to_owned()),
    }
}

/// Refuses a line that ends on an earlier one across it, or on which an earlier one ends: which
/// quads stay joined there would depend on the order. Lines may cross, also where lines go on from
/// one another. `pairs`: edges of the new line, `group_of`: their groups by mid-side node, `uses`:
/// in how many of them a node is.
fn refuse_meeting(
    mesh: &Mesh,
    pairs: &[(Edge, Edge)],
    group_of: &HashMap<usize, usize>,
    uses: &HashMap<usize, usize>,
) -> Result<(), Fault> {
    let key = |node: usize| mesh.nodes[node].map(f64::to_bits);
    // By direction and place: in how many elements, the first of them of which group.
    let mut earlier: IndexMap<(usize, [u64; 2]), (usize, usize)> = IndexMap::new();
    for joint in &mesh.joints {
        let [a, b, _] = joint.minus.map(|node| mesh.nodes[node]);
        let direction = perpendicular(a, b);
        for &node in &joint.minus {
            let entry = earlier.entry((direction, key(node)));
            entry.or_insert((0, joint.group)).0 += 1;
        }
    }
    // A node that the earlier line has doubled counts once. Mid-side nodes are in one edge too,
    // but no line meets another there.
    let mut new: HashMap<[u64; 2], usize> = HashMap::new();
    for (&node, count) in uses {
        *new.entry(key(node)).or_default() += count;
    }
    let ends = |at: &[u64; 2], others| {
        let count = new.get(at);
        count.is_some_and(|&count| count == 1 || others == 1)
    };
    let mut meetings = earlier
        .into_iter()
        .filter(|((_, at), (others, _))| ends(at, *others));
    let Some(((_, at), (_, other))) = meetings.next() else {
        return Ok(());
    };
    let mut edges = pairs.iter().map(|&(minus, _)| mesh.edge(minus));
    let edge = edges.find(|edge| edge.iter().any(|&node| key(node) == at));
    Err(Fault::Meets {
        group: edge.map_or(other, |edge| group_of[&edge[2]]),
        other,
        at: at.map(f64::from_bits),
    })
}

/// Doubles the nodes of lines along one straight line and inserts zero-thickness elements between
/// the two sides. Where the lines end inside the mesh the last node stays single, so the two sides
/// stay joined there.
fn split(mesh: &mut Mesh, cuts: &[Cut<'_>]) -> Result<(), Fault> {
    let mut edges = Vec::new();
    let mut group_of = HashMap::new();
    for cut in cuts {
        for &edge in &mesh.lines[cut.line.get_ref()].edges {
            edges.push(edge);
            group_of.insert(mesh.edge(edge)[2], cut.group);
        }
    }
    let across = across(mesh, edges[0]);
    // Every edge of the line belongs to two quads; the one with smaller coordinates is `minus`.
    let centre = |q: usize| {
        let corners = mesh.solids[q].corners();
        [0, 1].map(|c| corners.iter().map(|&n| mesh.nodes[n][c]).sum::<f64>() / 4.0)
    };
    let mut sides: HashMap<usize, Vec<Edge>> = HashMap::new();
    for &(q, e) in &edges {
        sides.entry(mesh.edge((q, e))[2]).or_default().push((q, e));
    }
    let mut middles: Vec<usize> = sides.keys().copied().collect();
    middles.sort_unstable();
    let mut pairs = Vec::new();
    for middle in middles {
        let side = &sides[&middle];
        let &[a, b] = side.as_slice() else {
            return Err(Fault::OnBoundary);
        };
        let (ca, cb) = (centre(a.0), centre(b.0));
        pairs.push(if ca[0] + ca[1] < cb[0] + cb[1] {
            (a, b)
        } else {
            (b, a)
        });
    }
    // A node is doubled if the quads around it fall apart: ends on the boundary and inner nodes
    // do; an end inside the mesh does not.
    let on_boundary = boundary_nodes(mesh);
    let mut uses: HashMap<usize, usize> = HashMap::new();
    for &(minus, _) in &pairs {
        for node in mesh.edge(minus) {
            *uses.entry(node).or_default() += 1;
        }
    }
    refuse_meeting(mesh, &pairs, &group_of, &uses)?;
    let mut copy: HashMap<usize, usize> = HashMap::new();
    let mut joints = Vec::new();
    for &(minus, _) in &pairs {
        let mut minus = mesh.edge(minus);
        let group = group_of[&minus[2]];
        // Ends in the order of increasing coordinates, whatever way round the quad has them.
        let [a, b] = [minus[0], minus[1]].map(|n| mesh.nodes[n]);
        if a[0] + a[1] > b[0] + b[1] {
            minus.swap(0, 1);
        }
        let plus = [0, 1, 2].map(|i| {
            let node = minus[i];
            let inner = i == 2 || uses[&node] == 2;
            if !(inner || on_boundary[node]) {
                return node;
            }
            *copy.entry(node).or_insert_with(|| {
                mesh.nodes.push(mesh.nodes[node]);
                mesh.nodes.len() - 1
            })
        });
        joints.push(Joint { minus, plus, group });
    }
    // Quads on the far side of the line take the copies, also those that touch it in one node.
    let position = mesh.nodes[joints[0].minus[0]][across];
    for quad in &mut mesh.solids {
        let corners = quad.corners().iter();
        let at = corners.map(|&n| mesh.nodes[n][across]).sum::<f64>() / 4.0;
        if at > position {
            for node in quad.nodes_mut() {
                if let Some(&new) = copy.get(node) {
                    *node = new;
                }
            }
        }
    }
    // So do the elements of a line that this one crosses.
    for joint in &mut mesh.joints {
        let at = joint
            .minus
            .iter()
            .map(|&n| mesh.nodes[n][across])
            .sum::<f64>()
            / 3.0;
        if at > position {
            for node in joint.minus.iter_mut().chain(&mut joint.plus) {
                if let Some(&new) = copy.get(node) {
                    *node = new;
                }
            }
        }
    }
    mesh.joints.extend(joints);
    Ok(())
}

/// Whether a node lies on an edge that only one quad has.
fn boundary_nodes(mesh: &Mesh) -> Vec<bool> {
    let edges = || mesh.solids.iter().flat_map(Solid::edges);
    let mut owners: HashMap<usize, usize> = HashMap::new();
    for [_, _, middle] in edges() {
        *owners.entry(middle).or_default() += 1;
    }
    let mut on_boundary = vec![false; mesh.nodes.len()];
    for edge in edges().filter(|edge| owners[&edge[2]] == 1) {
        for node in edge {
            on_boundary[node] = true;
        }
    }
    on_boundary
}

/// Nodes of every line, after all splitting, in the order of the coordinates.
fn collect_line_nodes(mesh: &mut Mesh) {
    let mut lines = std::mem::take(&mut mesh.lines);
    for line in lines.values_mut() {
        if line.edges.is_empty() {
            // A point: all nodes there, both of a double one.
            if let Some(at) = line
                .nodes
                .first()
                .map(|&node| mesh.nodes[node].map(f64::to_bits))
            {
                let here = |&node: &usize| mesh.nodes[node].map(f64::to_bits) == at;
                line.nodes = (0..mesh.nodes.len()).filter(here).collect();
            }
        } else {
            line.nodes = line
                .edges
                .iter()
                .flat_map(|&edge| mesh.edge(edge))
                .collect();
        }
        line.nodes.sort_unstable_by(|&a, &b| {
            let (pa, pb) = (mesh.nodes[a], mesh.nodes[b]);
            pa[0]
                .total_cmp(&pb[0])
                .then(pa[1].total_cmp(&pb[1]))
                .then(a.cmp(&b))
        });
        line.nodes.dedup();
    }
    mesh.lines = lines;
}
