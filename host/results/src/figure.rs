//! Figures as SVG: curves of probes, of stresses along a cut or of quantities along a pile, with
//! measured points.

mod mesh;

use crate::ends;
use crate::output_request::{Cut, Figure, Measured};
use crate::pile::{State, Station};
use crate::pressures::Pressure;
use mechanics::Place;
use mechanics::simulation::Snapshot;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::Path;
use text::Error;
use text::write::replace;

/// Size of a figure in points.
const SIZE: (u32, u32) = (640, 420);
/// Margins around a plot with its labels, in points; on the right half of a number of seven digits has room.
const MARGIN: u32 = 12;
const MARGIN_RIGHT: u32 = 24;
/// Room for the numbers and the name of the axis below a plot, and next to it.
const BELOW: u32 = 38;
const BESIDE: u32 = 58;
/// Radius of the marker of a measured point, in points.
const MARKER: i32 = 3;
/// Colours that stay apart for most eyes and in grey (Okabe & Ito), then some more.
pub const COLOURS: [RGBColor; 10] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(150, 150, 150),
    RGBColor(106, 61, 154),
    RGBColor(128, 128, 0),
];

/// A curve with its name.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Curve {
    /// Name, for the legend.
    name: String,
    /// Points in order.
    points: Vec<(f64, f64)>,
}

/// Texts of a figure.
#[derive(Clone, Debug, Default)]
struct Labels {
    /// Above the figure.
    title: String,
    /// Along the horizontal axis.
    x: String,
    /// Along the vertical axis.
    y: String,
    /// The vertical axis points downward.
    y_reversed: bool,
}

/// The figures of a run, filled as it goes.
#[derive(Clone, Debug)]
pub struct Figures {
    title: String,
    drawn: Vec<(Figure, Vec<Curve>)>,
    names: Vec<String>,
}

impl Figures {
    /// Figures whose curves are still empty. Values come in the order of `names`.
    pub fn new(title: &str, figures: &[Figure], names: Vec<String>) -> Self {
        let curves = |figure: &Figure| {
            if !figure.is_of_columns() {
                return Vec::new();
            }
            let named = |y: &String| Curve {
                name: y.clone(),
                points: Vec::new(),
            };
            figure.y.iter().map(named).collect()
        };
        Self {
            title: title.to_owned(),
            drawn: figures.iter().map(|f| (f.clone(), curves(f))).collect(),
            names,
        }
    }

    /// The curves so far, figure by figure.
    pub(crate) fn curves(&self) -> Vec<Vec<Curve>> {
        self.drawn
            .iter()
            .map(|(_, curves)| curves.clone())
            .collect()
    }

    /// Takes the curves of the same figures of an interrupted run.
    pub(crate) fn restore(&mut self, all: Vec<Vec<Curve>>) {
        for ((_, curves), restored) in self.drawn.iter_mut().zip(all) {
            *curves = restored;
        }
    }

    pub(crate) fn increment(&mut self, place: &Place, values: &[Option<f64>]) {
        self.add(values, |figure| {
            figure.is_of_columns() && drawn_in(figure, &place.phase)
        });
    }

    /// Takes a row of values for the figures that want it.
    pub fn add(&mut self, values: &[Option<f64>], wanted: impl Fn(&Figure) -> bool) {
        for (figure, curves) in &mut self.drawn {
            if !wanted(figure) {
                continue;
            }
            let value = |name: &str| {
                let number = self.names.iter().position(|n| n == name)?;
                values[number]
            };
            for curve in curves {
                if let (Some(x), Some(y)) = (value(&figure.x), value(&curve.name)) {
                    curve.points.push((x, y));
                }
            }
        }
    }

    /// Whether cuts are asked for after this increment, one of `of`.
    pub(crate) fn cuts_at(&self, place: &Place, of: usize) -> bool {
        let mut figures = self.drawn.iter();
        figures.any(|(figure, _)| cut_at(figure, place, of).is_some())
    }

    /// Takes the cuts that are asked for after this increment, one of `of`.
    pub(crate) fn cuts(&mut self, place: &Place, of: usize, snapshot: &Snapshot<'_>) {
        let Place { phase, increment } = place;
        for (figure, curves) in &mut self.drawn {
            let Some(cut) = cut_at(figure, place, of) else {
                continue;
            };
            for y in &figure.y {
                curves.push(Curve {
                    name: format!("{y}, {phase} {increment}"),
                    points: cut_points(cut, [&figure.x, y], snapshot),
                });
            }
        }
    }

    /// Takes what holds along the pile, where that is asked for after this increment, one of `of`. The curve is named by
    /// the head load, net if there is one, and by its increment if a curve under that load exists.
    pub(crate) fn along_pile(&mut self, place: &Place, of: usize, (state, unit): (&State, &str)) {
        let Place { phase, increment } = place;
        let load = state.net.map_or(state.loads.head, |net| net[0]);
        for (figure, curves) in &mut self.drawn {
            let increments = figure.along_pile.as_ref();
            if !increments.is_some_and(|increments| asks(figure, increments, place, of)) {
                continue;
            }
            for y in &figure.y {
                let pair = |station: &Station| Some((station.named(&figure.x)?, station.named(y)?));
                let name = match figure.y.len() {
                    1 => format!("{phase}, {load:.0} {unit}"),
                    _ => format!("{y}, {phase}, {load:.0} {unit}"),
                };
                let is_taken = curves.iter().any(|curve| curve.name == name);
                let name = if is_taken {
                    format!("{name}, increment {increment}")
                } else {
                    name
                };
                let points = state.stations.iter().filter_map(pair).collect();
                curves.push(Curve { name, points });
            }
        }
    }

    /// Draws all figures into a folder.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn draw(&self, folder: &Path) -> Result<(), Error> {
        for (figure, curves) in &self.drawn {
            let measured = coloured(&figure.measured, curves.len());
            draw_file(folder, figure, &self.title, (curves, &measured))?;
        }
        Ok(())
    }

    /// Draws the figures of several variants of a case over each other.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn draw_overlaid(folder: &Path, variants: &[(String, Self)]) -> Result<(), Error> {
        let Some((_, first)) = variants.first() else {
            return Ok(());
        };
        for (figure, _) in &first.drawn {
            let mut curves = Vec::new();
            for (variant, figures) in variants {
                let same = figures.drawn.iter().find(|(f, _)| f.name == figure.name);
                let same = same
                    .map(|(_, curves)| curves.as_slice())
                    .unwrap_or_default();
                for curve in same {
                    let name = if same.len() == 1 {
                        variant.clone()
                    } else {
                        format!("{variant}: {}", curve.name)
                    };
                    curves.push(Curve {
                        name,
                        points: curve.points.clone(),
                    });
                }
            }
            draw_file(folder, figure, &first.title, (&curves, &figure.measured))?;
        }
        Ok(())
    }
}

fn drawn_in(figure: &Figure, phase: &str) -> bool {
    figure.phase.as_ref().is_none_or(|p| p == phase)
}

/// The cut that a figure takes after this increment, one of `of`.
fn cut_at<'f>(figure: &'f Figure, place: &Place, of: usize) -> Option<&'f Cut> {
    let cut = figure.points.as_ref()?;
    asks(figure, &cut.increments, place, of).then_some(cut)
}

/// Whether a figure asks for curves after this increment, one of `of`.
fn asks(figure: &Figure, increments: &[usize], place: &Place, of: usize) -> bool {
    let Place { phase, increment } = place;
    let last = increments.is_empty() && *increment == of;
    drawn_in(figure, phase) && (last || increments.contains(increment))
}

/// Two quantities at the points of a cut, by increasing first one.
fn cut_points(cut: &Cut, quantities: [&str; 2], snapshot: &Snapshot<'_>) -> Vec<(f64, f64)> {
    let inside = |extent: Option<[f64; 2]>, c| extent.is_none_or(|[from, to]| from < c && c < to);
    let groups = snapshot.groups.iter().enumerate();
    let groups = groups.filter(|(_, group)| {
        group.is_active && cut.group.as_ref().is_none_or(|name| *name == group.name)
    });
    let mut points = Vec::new();
    for (number, group) in groups {
        for point in 0..group.kinematics.n_points() {
            let [x, y] = group.kinematics.position(point);
            let Some(stress) = group.global_stress(point) else {
                break;
            };
            let value = |quantity| match quantity {
                "x" => x,
                "y" => y,
                "stress_11" => stress[0],
                "stress_22" => stress[1],
                "stress_33" => stress[2],
                "stress_12" => stress[3],
                "k_0" => stress[0] / stress[1],
                other => Pressure::named(other)
                    .and_then(|quantity| quantity.at(snapshot, number, point))
                    .unwrap_or(f64::NAN),
            };
            let [across, up] = quantities.map(value);
            let pair = (across, cut.scale * up);
            let is_number = pair.0.is_finite() && pair.1.is_finite();
            if inside(cut.x, x) && inside(cut.y, y) && is_number {
                points.push(pair);
            }
        }
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

/// Measured points with the colour of the curve that they belong to: the only one, or one for each table.
fn coloured(measured: &[Measured], n_curves: usize) -> Vec<Measured> {
    let is_one_each = n_curves == measured.len();
    let mut coloured = measured.to_vec();
    for (number, measured) in coloured.iter_mut().enumerate() {
        measured.colour_of = if n_curves == 1 {
            Some(0)
        } else {
            is_one_each.then_some(number)
        };
    }
    coloured
}

fn draw_file(
    folder: &Path,
    figure: &Figure,
    title: &str,
    (curves, measured): (&[Curve], &[Measured]),
) -> Result<(), Error> {
    let path = folder.join(format!("{}.svg", figure.name));
    let labels = Labels {
        title: figure.title.clone().unwrap_or_else(|| title.to_owned()),
        x: figure.x_label.clone().unwrap_or_else(|| figure.x.clone()),
        y: figure.y_label.clone().unwrap_or_default(),
        y_reversed: figure.y_reversed,
    };
    let text = svg(&labels, curves, measured)
        .map_err(|error| Error::Internal(format!("figure {}: {error}", path.display())))?;
    replace(&path, text)
}

/// Curves and measured points as a text in SVG.
fn svg(labels: &Labels, curves: &[Curve], measured: &[Measured]) -> Result<String, String> {
    let mut text = String::new();
    draw(&mut text, labels, curves, measured).map_err(|error| error.to_string())?;
    Ok(text)
}

type Area<'s> = DrawingArea<SVGBackend<'s>, Shift>;
type Chart<'a, 's> = ChartContext<'a, SVGBackend<'s>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Drawn<T> = Result<T, DrawingAreaErrorKind<std::io::Error>>;

/// An empty plot over these ranges.
fn axes<'a, 's>(
    area: &'a Area<'s>,
    labels: &Labels,
    [x, y]: [Range<f64>; 2],
) -> Drawn<Chart<'a, 's>> {
    let mut chart = ChartBuilder::on(area)
        .caption(&labels.title, ("sans-serif", 15))
        .margin(MARGIN)
        .margin_right(MARGIN_RIGHT)
        .x_label_area_size(BELOW)
        .y_label_area_size(BESIDE)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_desc(&labels.x)
        .y_desc(&labels.y)
        .axis_desc_style(("sans-serif", 14))
        .label_style(("sans-serif", 12))
        .draw()?;
    Ok(chart)
}

/// Height of an entry of a legend beside the plot.
fn entry(number: usize) -> i32 {
    40 + 17 * number as i32
}

/// Writes the name of an entry.
fn name_beside(legend: &Area<'_>, name: &str, number: usize) -> Drawn<()> {
    let at = (24, entry(number) - 6);
    legend.draw(&Text::new(name, at, ("sans-serif", 12)))
}

/// Curves in a plot, with their entries in a legend beside it if there is one.
fn draw_curves(
    chart: &mut Chart<'_, '_>,
    curves: &[Curve],
    legend: Option<&Area<'_>>,
) -> Drawn<()> {
    for (number, curve) in curves.iter().enumerate() {
        let style = COLOURS[number % COLOURS.len()].stroke_width(2);
        chart
            .draw_series(LineSeries::new(curve.points.iter().copied(), style))?
            .label(&curve.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
        if let Some(legend) = legend {
            let y = entry(number);
            legend.draw(&PathElement::new([(0, y), (18, y)], style))?;
            name_beside(legend, &curve.name, number)?;
        }
    }
    Ok(())
}

/// Measured points in a plot; their entries follow those of `number` curves.
fn draw_measured(
    chart: &mut Chart<'_, '_>,
    measured: &[Measured],
    mut number: usize,
    legend: Option<&Area<'_>>,
) -> Drawn<()> {
    for measured in measured {
        let own = measured.of_curve.or(measured.colour_of);
        let colour = COLOURS[own.unwrap_or(number) % COLOURS.len()];
        let style = colour.stroke_width(1);
        let markers = measured.points.iter();
        let drawn = chart.draw_series(markers.map(|&point| Circle::new(point, MARKER, style)))?;
        if measured.of_curve.is_some() {
            continue;
        }
        drawn
            .label(&measured.label)
            .legend(move |(x, y)| Circle::new((x + 9, y), MARKER, style));
        if let Some(legend) = legend {
            legend.draw(&Circle::new((9, entry(number)), MARKER, style))?;
            name_beside(legend, &measured.label, number)?;
        }
        number += 1;
    }
    Ok(())
}

fn draw(text: &mut String, labels: &Labels, curves: &[Curve], measured: &[Measured]) -> Drawn<()> {
    let points = || {
        let drawn = curves.iter().flat_map(|curve| &curve.points);
        drawn.chain(measured.iter().flat_map(|measured| &measured.points))
    };
    let has_entry = |measured: &&Measured| measured.of_curve.is_none();
    let names = || {
        let drawn = curves.iter().map(|curve| curve.name.as_str());
        let measured = measured.iter().filter(has_entry);
        drawn.chain(measured.map(|measured| measured.label.as_str()))
    };
    let entries = names().count();
    let x = range(points().map(|p| p.0), 0.0);
    let y = range(points().map(|p| p.1), 0.05);
    let y = if labels.y_reversed { y.end..y.start } else { y };
    let longest = names().map(|name| name.chars().count()).max();
    let legend = [42 + 7 * longest.unwrap_or(0), 16 + 17 * entries];
    let corner = empty_corner(curves, measured, [&x, &y], legend);
    let beside = entries > 1 && corner.is_none();
    let width = SIZE.0 + if beside { legend[0] as u32 } else { 0 };
    let area = SVGBackend::with_string(text, (width, SIZE.1)).into_drawing_area();
    area.fill(&WHITE)?;
    let (left, right) = area.split_horizontally(SIZE.0);
    let mut chart = axes(&left, labels, [x, y])?;
    let right = beside.then_some(&right);
    draw_curves(&mut chart, curves, right)?;
    draw_measured(&mut chart, measured, curves.len(), right)?;
    if let Some(corner) = corner.filter(|_| entries > 1) {
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .label_font(("sans-serif", 12))
            .position(corner)
            .draw()?;
    }
    area.present()
}

/// A corner where a legend of this size, in points, covers no curve and no measured point.
fn empty_corner(
    curves: &[Curve],
    measured: &[Measured],
    [x, y]: [&Range<f64>; 2],
    legend: [usize; 2],
) -> Option<SeriesLabelPosition> {
    // Parts of the plot, which is what labels and margins leave of the figure.
    let plot = SIZE.0 - BESIDE - MARGIN - MARGIN_RIGHT;
    let width = (legend[0] + 10) as f64 / f64::from(plot);
    let height = (legend[1] + 10) as f64 / f64::from(SIZE.1 - 84);
    let part = |v: f64, range: &Range<f64>| (v - range.start) / (range.end - range.start);
    let covered = |right: bool, upper: bool| {
        let inside = |u: f64, v: f64| {
            let (u, v) = (part(u, x), part(v, y));
            let (u, v) = (
                if right { 1.0 - u } else { u },
                if upper { 1.0 - v } else { v },
            );
            u < width && v < height
        };
        let mut markers = measured.iter().flat_map(|measured| &measured.points);
        let of_curves = curves.iter().flat_map(|c| c.points.windows(2)).any(|ends| {
            let [(u0, v0), (u1, v1)] = [ends[0], ends[1]];
            (0..=20)
                .map(|k| f64::from(k) / 20.0)
                .any(|s| inside(u0 + s * (u1 - u0), v0 + s * (v1 - v0)))
        });
        of_curves || markers.any(|&(u, v)| inside(u, v))
    };
    let corners = [
        (true, false, SeriesLabelPosition::LowerRight),
        (true, true, SeriesLabelPosition::UpperRight),
        (false, true, SeriesLabelPosition::UpperLeft),
        (false, false, SeriesLabelPosition::LowerLeft),
    ];
    let mut empty = corners.into_iter();
    let empty = empty.find(|(right, upper, _)| !covered(*right, *upper));
    empty.map(|(.., corner)| corner)
}

/// The range of some values, widened by a fraction of it; never empty.
fn range(values: impl Iterator<Item = f64>, margin: f64) -> Range<f64> {
    let [low, high] = ends(values);
    if !(low.is_finite() && high.is_finite()) {
        return 0.0..1.0;
    }
    let width = if high > low {
        high - low
    } else {
        high.abs().max(1.0)
    };
    // A range that nearly reaches zero starts there.
    let low = if low >= 0.0 && low < 0.2 * high {
        0.0
    } else {
        low - margin * width
    };
    let high = if high > low {
        high + margin * width
    } else {
        high + width
    };
    even(low, width)..even(high, width)
}

/// An end of a range, made even where it nearly is: whether the axis has a number there does not hang on last digits.
fn even(end: f64, width: f64) -> f64 {
    let unit = 10_f64.powf(width.log10().floor() - 2.0);
    let even = (end / unit).round() * unit;
    if (end - even).abs() < 0.01 * unit {
        even
    } else {
        end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[expect(clippy::float_cmp, reason = "made even, or left as they are")]
    fn an_end_that_is_nearly_even_has_its_number() {
        let high = |to: f64| range([0.0, to].into_iter(), 0.0).end;
        assert_eq!(high(1_999.999_95), 2_000.0);
        assert_eq!(high(2_000.000_04), 2_000.0);
        assert_eq!(high(1_996.0), 1_996.0);
        assert_eq!(high(2.002e-7), 2.002e-7);
    }
}
