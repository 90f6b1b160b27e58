//! Elements, groups, lines and shapes of a mesh as text.

use crate::ends;
use mechanics::mesh::{Line, Mesh, Solid};
use mechanics::problem::{Analysis, Axis};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt::{self, Display, Write};
use text::counted;

/// A middle node is far off if it is farther than these parts of its side, along it and across it, from the middle
/// between the ends. A quarter along the side, the Jacobian is zero at its end.
const FAR_OFF: [f64; 2] = [0.125, 0.25];

/// Ends of a line that are listed.
const MOST_ENDS: usize = 4;

/// A mesh, and what its names mean.
#[derive(Clone, Debug)]
pub struct MeshTable {
    /// Path of its file, with the variant of a case.
    pub title: String,
    /// The mesh.
    pub mesh: Mesh,
    /// Names of its groups.
    pub groups: Vec<String>,
    /// For each solid element the number in its file; empty if there are none.
    pub numbers: Vec<u64>,
    /// Meaning of the axes.
    pub analysis: Analysis,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// An angle of an element.
#[derive(Clone, Copy, Debug)]
struct Angle {
    /// Degrees.
    value: f64,
    solid: usize,
}

impl MeshTable {
    /// Why no case could compute the mesh, if none could.
    pub fn refusal(&self) -> Option<String> {
        if self.groups.is_empty() {
            let message = "no surface has a name, so that a case finds no group: in Gmsh, `Physical \
                           Surface(\"soil\") = {1};`";
            return Some(message.to_owned());
        }
        if self.mesh.solids.is_empty() {
            return Some("the mesh has no element in a group".to_owned());
        }
        let bad = self.degenerate();
        let first = *bad.first()?;
        let (n, where_) = (bad.len(), self.place(first));
        let elements = if n == 1 { "element is" } else { "elements are" };
        Some(format!(
            "{n} {elements} degenerate: the Jacobian is not positive{}; the first is \
             {where_}",
            if self.analysis == Analysis::Axisymmetric {
                ", or they reach across the axis"
            } else {
                ""
            }
        ))
    }

    /// Numbers of the elements that no group can have.
    pub(crate) fn degenerate(&self) -> Vec<usize> {
        let solids = self.mesh.solids.iter().enumerate();
        let bad = solids.filter(|(_, s)| s.is_degenerate(self.analysis, &self.mesh.nodes));
        bad.map(|(number, _)| number).collect()
    }

    /// Middle nodes that lie far off.
    fn far_middles(&self) -> Option<String> {
        let mesh = &self.mesh;
        let solids = mesh.solids.iter().enumerate();
        let sides = solids.flat_map(|(solid, own)| own.edges().map(move |side| (solid, side)));
        let mut seen = HashSet::new();
        let far: Vec<(usize, usize)> = sides
            .filter(|(_, side)| {
                let off = mesh.off_middle(*side);
                off[0] > FAR_OFF[0] || off[1] > FAR_OFF[1]
            })
            .map(|(solid, [.., middle])| (solid, middle))
            .filter(|(_, middle)| seen.insert(*middle))
            .collect();
        let (solid, middle) = *far.first()?;
        let verb = if far.len() == 1 { "lies" } else { "lie" };
        Some(format!(
            "{} {verb} farther than 1/8 of its side along it, or 1/4 across it, from the middle between the ends, the first at \
             {}, {}: strains are less accurate there, and at 1/4 along the side the Jacobian is zero at its end",
            counted(far.len(), "middle node"),
            point(mesh.nodes[middle]),
            self.place(solid)
        ))
    }

    /// An element in words.
    fn place(&self, solid: usize) -> String {
        let corners = self.mesh.solids[solid].corners();
        let middle = [0, 1].map(|c| {
            let at = corners.iter().map(|&node| self.mesh.nodes[node][c]);
            at.sum::<f64>() / corners.len() as f64
        });
        let group = &self.groups[self.mesh.solids[solid].group];
        let number = self.numbers.get(solid);
        let number = number.map_or_else(|| "an element".to_owned(), |n| format!("element {n}"));
        format!("{number} of `{group}` at {}", point(middle))
    }

    fn elements(&self) -> String {
        let mut counts: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for solid in &self.mesh.solids {
            let kind = (solid.n_corners(), solid.nodes().len());
            *counts.entry(kind).or_default() += 1;
        }
        let mut parts: Vec<String> = counts
            .into_iter()
            .map(|((corners, nodes), n)| {
                let name = if corners == 3 { "triangle" } else { "quad" };
                format!("{} of {nodes} nodes", counted(n, name))
            })
            .collect();
        if !self.mesh.joints.is_empty() {
            let n = counted(self.mesh.joints.len(), "element");
            parts.push(format!("{n} without thickness"));
        }
        if parts.is_empty() {
            parts.push("none".to_owned());
        }
        parts.join(", ")
    }

    fn extent(&self) -> String {
        let axes = [Axis::X, Axis::Y].into_iter().enumerate();
        let parts = axes.map(|(c, axis)| {
            let [low, high] = ends(self.mesh.nodes.iter().map(|node| node[c]));
            let name = axis.name(self.analysis);
            format!("{name} {} to {}", short(low), short(high))
        });
        parts.collect::<Vec<_>>().join(", ")
    }

    fn groups(&self) -> Vec<[String; 4]> {
        let mut sums = vec![(0, 0.0, 0.0); self.groups.len()];
        let mut least: Vec<Option<f64>> = vec![None; self.groups.len()];
        for solid in &self.mesh.solids {
            let sum = &mut sums[solid.group];
            sum.0 += 1;
            sum.1 += solid.area(&self.mesh.nodes);
            let own = solid.scaled_jacobian(&self.mesh.nodes);
            let least = &mut least[solid.group];
            *least = Some(least.map_or(own, |least| least.min(own)));
        }
        for joint in &self.mesh.joints {
            let sum = &mut sums[joint.group];
            sum.0 += 1;
            sum.2 += self.mesh.length(joint.minus);
        }
        let row = |(number, (n, area, length)): (usize, (usize, f64, f64))| {
            let size = if length > 0.0 {
                format!("{} long", short(length))
            } else {
                short(area)
            };
            let least = least[number].map_or_else(String::new, |least| format!("{least:.3}"));
            [self.groups[number].clone(), n.to_string(), size, least]
        };
        sums.into_iter().enumerate().map(row).collect()
    }

    fn lines(&self) -> Vec<[String; 4]> {
        let row = |(name, line): (&String, &Line)| {
            let edges = self.mesh.edges_once(line);
            if edges.is_empty() {
                let places = line.nodes.iter().map(|&node| self.mesh.nodes[node]);
                let places = listed(places.collect());
                return [name.clone(), "point".to_owned(), String::new(), places];
            }
            let length = edges.iter().map(|&edge| self.mesh.length(edge));
            let ends = self.ends(&edges);
            let ends = if ends.is_empty() {
                "closed".to_owned()
            } else {
                listed(ends)
            };
            let length = short(length.sum::<f64>());
            [name.clone(), edges.len().to_string(), length, ends]
        };
        self.mesh.lines.iter().map(row).collect()
    }

    /// Places where an odd number of edges ends, by their coordinates.
    fn ends(&self, edges: &[[usize; 3]]) -> Vec<[f64; 2]> {
        let mut met: HashMap<[u64; 2], ([f64; 2], usize)> = HashMap::new();
        for node in edges.iter().flat_map(|[a, b, _]| [*a, *b]) {
            let at = self.mesh.nodes[node].map(|c| c + 0.0);
            met.entry(at.map(f64::to_bits)).or_insert((at, 0)).1 += 1;
        }
        let odd = met.into_values().filter(|(_, n)| n % 2 == 1);
        let mut ends: Vec<[f64; 2]> = odd.map(|(at, _)| at).collect();
        ends.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        ends
    }

    /// Least and largest angle.
    fn angles(&self) -> Option<[Angle; 2]> {
        let solids = self.mesh.solids.iter().enumerate();
        let all = || {
            solids.clone().flat_map(|(solid, own): (usize, &Solid)| {
                let angles = own.angles(&self.mesh.nodes);
                angles.map(move |angle| Angle {
                    value: angle.to_degrees(),
                    solid,
                })
            })
        };
        let least = all().min_by(|a, b| a.value.total_cmp(&b.value))?;
        // Of equal ones the first.
        let largest = all().reduce(|a, b| if b.value > a.value { b } else { a })?;
        Some([least, largest])
    }

    /// Shortest and longest side of an element, m.
    fn sides(&self) -> [f64; 2] {
        let edges = self.mesh.solids.iter().flat_map(Solid::edges);
        let lengths = edges.map(|edge| self.mesh.length(edge));
        lengths.fold([f64::INFINITY, 0.0], |[low, high], length| {
            [low.min(length), high.max(length)]
        })
    }
}

impl Display for MeshTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title)?;
        writeln!(f, "  elements       {}", self.elements())?;
        writeln!(f, "  nodes          {}", self.mesh.nodes.len())?;
        if let Some([least, largest]) = self.angles() {
            writeln!(f, "  extent, m      {}", self.extent())?;
            let [low, high] = self.sides().map(short);
            writeln!(f, "  sides, m       {low} to {high}")?;
            for (what, angle) in [("least angle", least), ("largest angle", largest)] {
                let place = self.place(angle.solid);
                writeln!(f, "  {what:13}  {:.1}°, {place}", angle.value)?;
            }
        }
        if !self.groups.is_empty() {
            let head = ["group", "elements", "area, m²", "least scaled Jacobian"];
            table(f, head, &self.groups())?;
        }
        if !self.mesh.lines.is_empty() {
            table(f, ["line", "edges", "length, m", "ends"], &self.lines())?;
        }
        let mut notes = self
            .notes
            .iter()
            .cloned()
            .chain(self.far_middles())
            .peekable();
        if notes.peek().is_some() {
            writeln!(f)?;
        }
        notes.try_for_each(|note| writeln!(f, "note: {note}"))
    }
}

/// Columns after an empty line: the first and last to the left, numbers to the right.
fn table<const N: usize>(
    f: &mut fmt::Formatter<'_>,
    head: [&str; N],
    rows: &[[String; N]],
) -> fmt::Result {
    let head = head.map(str::to_owned);
    let all = || std::iter::once(&head).chain(rows);
    let widths: [usize; N] = std::array::from_fn(|column| {
        let widths = all().map(|row| row[column].chars().count());
        widths.max().unwrap_or_default()
    });
    writeln!(f)?;
    for row in all() {
        let mut line = String::new();
        for (column, cell) in row.iter().enumerate() {
            let width = widths[column];
            match column {
                0 => write!(line, "{cell:width$}")?,
                3 => write!(line, "  {cell}")?,
                _ => write!(line, "  {cell:>width$}")?,
            }
        }
        writeln!(f, "{}", line.trim_end())?;
    }
    Ok(())
}

/// Some places, and how many more there are.
fn listed(places: Vec<[f64; 2]>) -> String {
    let more = places.len().saturating_sub(MOST_ENDS);
    let shown = places.into_iter().take(MOST_ENDS).map(point);
    let shown = shown.collect::<Vec<_>>().join(", ");
    if more == 0 {
        shown
    } else {
        format!("{shown}, and {more} more")
    }
}

fn point([x, y]: [f64; 2]) -> String {
    format!("({}, {})", short(x), short(y))
}

/// A number to six digits.
fn short(value: f64) -> String {
    let rounded = format!("{value:.5e}").parse().unwrap_or(value);
    // No negative zero.
    format!("{}", rounded + 0.0)
}
