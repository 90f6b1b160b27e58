//! The work–precision diagram: error over cost, both logarithmic, as SVG.

use super::study::{Measurement, Row, Study};
use plotters::coord::combinators::LogCoord;
use plotters::prelude::*;
use results::figure::COLOURS;
use std::ops::Range;

/// Size of the diagram in points, and of the legend next to it.
const SIZE: (u32, u32) = (620, 440);
const LINE: i32 = 17;
/// Errors below this are drawn here.
const LEAST_ERROR: f64 = 1e-14;

type Failure = DrawingAreaErrorKind<std::io::Error>;
type Chart<'d, 'b> = ChartContext<'d, SVGBackend<'b>, Cartesian2d<LogCoord<f64>, LogCoord<f64>>>;

impl Study {
    /// The diagram.
    ///
    /// # Errors
    /// Why it cannot be drawn.
    pub(super) fn diagram(&self) -> Result<String, String> {
        let mut text = String::new();
        draw(&mut text, self).map_err(|error| error.to_string())?;
        Ok(text)
    }
}

/// Place of a setting: an error that cannot be distinguished from 0 lies at the uncertainty of the reference.
fn place(study: &Study, row: &Row, measured: &Measurement) -> (f64, f64) {
    let floor = study.references[row.reference].convergence.uncertainty;
    let error = measured.error.max(floor).max(LEAST_ERROR);
    (measured.seconds, error)
}

/// What nothing beats, from cheap to dear.
fn front(study: &Study) -> Vec<(f64, f64)> {
    let optimal = study.measured(0).filter(|(_, m)| m.is_optimal);
    let mut front: Vec<_> = optimal.map(|(row, m)| place(study, row, m)).collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    front
}

/// The axes: cost to the right, error upward.
fn axes<'d, 'b>(
    area: &'d DrawingArea<SVGBackend<'b>, plotters::coord::Shift>,
    title: &str,
    x: &Range<f64>,
    y: &Range<f64>,
) -> Result<Chart<'d, 'b>, Failure> {
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 15))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(62)
        .build_cartesian_2d(x.clone().log_scale(), y.clone().log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(BLACK.mix(0.04))
        .bold_line_style(BLACK.mix(0.14))
        .x_desc("CPU time (s)")
        .y_desc("largest relative error")
        .x_label_formatter(&|v| power(*v))
        .y_label_formatter(&|v| power(*v))
        .axis_desc_style(("sans-serif", 14))
        .label_style(("sans-serif", 12))
        .draw()?;
    Ok(chart)
}

fn draw(text: &mut String, study: &Study) -> Result<(), Failure> {
    let measured: Vec<(&Row, &Measurement)> = (0..study.references.len())
        .flat_map(|number| study.measured(number))
        .collect();
    let mut families: Vec<&str> = Vec::new();
    for (row, _) in &measured {
        if !families.contains(&row.family.as_str()) {
            families.push(&row.family);
        }
    }
    let places = measured.iter().map(|(row, m)| place(study, row, m));
    let places: Vec<(f64, f64)> = places.collect();
    let x = decades(places.iter().map(|p| p.0));
    let y = decades(places.iter().map(|p| p.1));
    let longest = families.iter().map(|f| f.chars().count()).max();
    let beside = 40 + 7 * longest.unwrap_or(0).max(24) as u32;
    let area = SVGBackend::with_string(text, (SIZE.0 + beside, SIZE.1)).into_drawing_area();
    area.fill(&WHITE)?;
    let (left, right) = area.split_horizontally(SIZE.0);
    let mut chart = axes(&left, &format!("{}: error and cost", study.name), &x, &y)?;
    let floor = study.references[0].convergence.uncertainty.max(LEAST_ERROR);
    let grey = BLACK.mix(0.45);
    if floor > y.start {
        chart.draw_series(DashedLineSeries::new(
            [(x.start, floor), (x.end, floor)],
            5,
            4,
            grey.stroke_width(1),
        ))?;
    }
    let front = LineSeries::new(front(study), BLACK.stroke_width(1));
    chart.draw_series(front)?;
    let colours: Vec<RGBColor> = COLOURS.into_iter().cycle().take(families.len()).collect();
    for ((row, _), at) in measured.iter().zip(&places) {
        let family = families.iter().position(|f| *f == row.family).unwrap_or(0);
        let colour = colours[family];
        if row.reference == 0 {
            chart.draw_series([Circle::new(*at, 4, colour.filled())])?;
        } else {
            chart.draw_series([TriangleMarker::new(*at, 6, colour.filled())])?;
        }
        if row.is_default && row.reference == 0 {
            chart.draw_series([Circle::new(*at, 9, BLACK.stroke_width(2))])?;
        }
    }
    legend(&right, &families, &colours)?;
    area.present()
}

fn legend(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    families: &[&str],
    colours: &[RGBColor],
) -> Result<(), Failure> {
    let words = |text: &str, y: i32| {
        let font = ("sans-serif", 12);
        area.draw(&Text::new(text.to_owned(), (20, y - 6), font))
    };
    let line = |from: i32, to: i32, y: i32, style: ShapeStyle| {
        area.draw(&PathElement::new([(from, y), (to, y)], style))
    };
    let mut y = 44;
    for (family, colour) in families.iter().zip(colours) {
        area.draw(&Circle::new((8, y), 4, colour.filled()))?;
        words(family, y)?;
        y += LINE;
    }
    y += LINE / 2;
    area.draw(&Circle::new((8, y), 7, BLACK.stroke_width(2)))?;
    words("as in the file", y)?;
    y += LINE;
    line(0, 16, y, BLACK.stroke_width(1))?;
    words("nothing beats these", y)?;
    y += LINE;
    let grey = BLACK.mix(0.45).stroke_width(1);
    line(0, 6, y, grey)?;
    line(10, 16, y, grey)?;
    words("uncertainty of the reference", y)
}

/// The label of a decade; a power of ten is not exact in binary.
fn power(value: f64) -> String {
    format!("1e{:.0}", value.log10())
}

/// Whole decades around some values.
fn decades(values: impl Iterator<Item = f64>) -> Range<f64> {
    let logarithms = values.map(f64::log10).filter(|v| v.is_finite());
    let (low, high) = logarithms.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    if low > high {
        return 1e-3..1.0;
    }
    let (low, high) = ((low - 0.1).floor(), (high + 0.1).ceil());
    10.0_f64.powf(low)..10.0_f64.powf(high)
}
