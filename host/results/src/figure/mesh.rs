//! A drawing of a mesh: groups in colours, lines, and elements that are refused.

use super::{
    Area, BELOW, BESIDE, COLOURS, Chart, Drawn, Labels, MARGIN, MARGIN_RIGHT, SIZE, axes, entry,
    name_beside,
};
use crate::ends;
use crate::mesh_table::MeshTable;
use mechanics::mesh::Solid;
use mechanics::problem::Axis;
use plotters::prelude::*;
use std::ops::Range;
use std::path::Path;
use text::Error;
use text::write::replace;

/// Most elements of a drawing: more are a surface of ink.
const MOST: usize = 100_000;
/// Room for the title, in points.
const CAPTION: u32 = 24;
/// Height of the plot, in points.
const HEIGHT: Range<f64> = 120.0..1600.0;

impl MeshTable {
    /// Draws the mesh as SVG, its axes in one scale.
    ///
    /// # Errors
    /// [`Error::Unwritable`]; the mesh has too many elements for a drawing, or none.
    pub fn draw(&self, path: &Path) -> Result<(), Error> {
        let n = self.mesh.solids.len();
        if n == 0 || n > MOST {
            let message = format!("a drawing has 1 to {MOST} elements, this mesh has {n}");
            return Err(Error::Usage(message));
        }
        let mut text = String::new();
        self.svg(&mut text)
            .map_err(|error| Error::Internal(format!("{}: {error}", path.display())))?;
        replace(path, text)
    }

    fn svg(&self, text: &mut String) -> Drawn<()> {
        let extent = [0, 1].map(|c| {
            let [low, high] = ends(self.mesh.nodes.iter().map(|node| node[c]));
            low..high
        });
        let width = SIZE.0 - BESIDE - MARGIN - MARGIN_RIGHT;
        let ([x, y], height) = one_scale(&extent, f64::from(width));
        let names = self.groups.iter().chain(self.mesh.lines.keys());
        let longest = names.map(|name| name.chars().count()).max();
        let entries = (self.groups.len() + self.mesh.lines.len()) as u32;
        let beside = 42 + 7 * longest.unwrap_or(0) as u32;
        let high = (height as u32 + BELOW + 2 * MARGIN + CAPTION).max(60 + 17 * entries);
        let area = SVGBackend::with_string(text, (SIZE.0 + beside, high)).into_drawing_area();
        area.fill(&WHITE)?;
        let (left, right) = area.split_horizontally(SIZE.0);
        let [x_name, y_name] = [Axis::X, Axis::Y].map(|axis| axis.name(self.analysis));
        let labels = Labels {
            title: self.title.clone(),
            x: format!("{x_name}, m"),
            y: format!("{y_name}, m"),
            y_reversed: false,
        };
        let plot = left.margin(
            0,
            high - (height as u32 + BELOW + 2 * MARGIN + CAPTION),
            0,
            0,
        );
        let mut chart = axes(&plot, &labels, [x, y])?;
        self.draw_elements(&mut chart, &right)?;
        self.draw_lines(&mut chart, &right)?;
        area.present()
    }

    fn draw_elements(&self, chart: &mut Chart<'_, '_>, legend: &Area<'_>) -> Drawn<()> {
        let outline = |solid: &Solid| -> Vec<(f64, f64)> {
            let nodes = solid.edges().flat_map(|[a, _, middle]| [a, middle]);
            nodes.map(|node| self.at(node)).collect()
        };
        let closed = |solid: &Solid| {
            let mut path = outline(solid);
            path.extend_from_within(..1);
            path
        };
        for (number, name) in self.groups.iter().enumerate() {
            let fill = COLOURS[number % COLOURS.len()].mix(0.35).filled();
            let own = || {
                self.mesh
                    .solids
                    .iter()
                    .filter(|solid| solid.group == number)
            };
            chart.draw_series(own().map(|solid| Polygon::new(outline(solid), fill)))?;
            chart
                .draw_series(own().map(|solid| PathElement::new(closed(solid), BLACK.mix(0.3))))?;
            let at = entry(number);
            legend.draw(&Rectangle::new([(0, at - 5), (18, at + 5)], fill))?;
            name_beside(legend, name, number)?;
        }
        let bad = self.degenerate().into_iter();
        let bad = bad.map(|solid| closed(&self.mesh.solids[solid]));
        chart.draw_series(bad.map(|path| PathElement::new(path, RED.stroke_width(3))))?;
        Ok(())
    }

    fn draw_lines(&self, chart: &mut Chart<'_, '_>, legend: &Area<'_>) -> Drawn<()> {
        for (number, (name, line)) in self.mesh.lines.iter().enumerate() {
            // Begun from the other end: a line beside a group has another colour.
            let colour = COLOURS[COLOURS.len() - 1 - number % COLOURS.len()];
            let style = colour.stroke_width(3);
            let at = entry(self.groups.len() + number);
            let edges = self.mesh.edges_once(line);
            if edges.is_empty() {
                let dot = |node: &usize| Circle::new(self.at(*node), 4, colour.filled());
                chart.draw_series(line.nodes.iter().map(dot))?;
                legend.draw(&Circle::new((9, at), 4, colour.filled()))?;
            } else {
                let paths = edges.into_iter().map(|[a, b, middle]| {
                    PathElement::new([a, middle, b].map(|node| self.at(node)), style)
                });
                chart.draw_series(paths)?;
                legend.draw(&PathElement::new([(0, at), (18, at)], style))?;
            }
            name_beside(legend, name, self.groups.len() + number)?;
        }
        Ok(())
    }

    fn at(&self, node: usize) -> (f64, f64) {
        let [x, y] = self.mesh.nodes[node];
        (x, y)
    }
}

/// Ranges in which a metre is as long on both axes of a plot of this width, in points, and its height.
fn one_scale([x, y]: &[Range<f64>; 2], width: f64) -> ([Range<f64>; 2], f64) {
    let length = |range: &Range<f64>| range.end - range.start;
    let margin = 0.02 * length(x).max(length(y)).max(f64::MIN_POSITIVE);
    let [dx, dy] = [x, y].map(|range| length(range) + margin);
    let metre = (width / dx).min(HEIGHT.end / dy);
    let height = (dy * metre).max(HEIGHT.start);
    let around = |range: &Range<f64>, points: f64| {
        let spare = 0.5 * (points / metre - length(range));
        range.start - spare..range.end + spare
    };
    ([around(x, width), around(y, height)], height)
}
