//! Curves of probes as SVG.

use super::unwritable;
use crate::case::{Case, FigureInput};
use crate::error::{Error, Place, suggestion};
use crate::probe::Probes;
use plotters::prelude::*;
use std::path::Path;

/// Size of a figure in points.
const SIZE: (u32, u32) = (640, 420);
/// Colours that stay apart for most eyes and in grey (Okabe & Ito).
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
];

/// A curve with its name.
#[derive(Clone, Debug, Default)]
struct Curve {
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
}

/// Refuses figures whose probes or phase do not exist, or two with one name.
///
/// # Errors
/// [`Error::Input`] at the name.
pub fn check_figures(case: &Case, probes: &Probes) -> Result<(), Error> {
    let source = &case.source;
    let names: Vec<&str> = probes.names().collect();
    let phases: Vec<&str> = case
        .file
        .phases
        .iter()
        .map(|phase| phase.name.get_ref().as_str())
        .collect();
    let mut seen: Vec<&str> = Vec::new();
    for figure in &case.file.figures {
        let name = figure.name.get_ref().as_str();
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if name.is_empty() || !name.chars().all(plain) {
            let message = format!("`{name}` cannot be a file's name: letters, digits, _ and -");
            return Err(source.error(figure.name.span(), message).into());
        }
        if seen.contains(&name) {
            let message = format!("two figures are called `{name}`");
            return Err(source.error(figure.name.span(), message).into());
        }
        seen.push(name);
        for probe in figure.y.iter().chain([&figure.x]) {
            if !names.contains(&probe.get_ref().as_str()) {
                return Err(source
                    .error(
                        probe.span(),
                        format!("there is no probe `{}`", probe.get_ref()),
                    )
                    .hint(suggestion(probe.get_ref(), names))
                    .into());
            }
        }
        if let Some(phase) = &figure.phase
            && !phases.contains(&phase.get_ref().as_str())
        {
            return Err(source
                .error(
                    phase.span(),
                    format!("there is no phase `{}`", phase.get_ref()),
                )
                .hint(suggestion(phase.get_ref(), phases))
                .into());
        }
    }
    Ok(())
}

/// The figures of a run, filled as it goes.
#[derive(Clone, Debug)]
pub struct Figures {
    title: String,
    drawn: Vec<(FigureInput, Vec<Curve>)>,
    names: Vec<String>,
}

impl Figures {
    pub(super) fn new(case: &Case, probes: &Probes) -> Self {
        let curves = |figure: &FigureInput| {
            let named = |y: &toml::Spanned<String>| Curve {
                name: y.get_ref().clone(),
                points: Vec::new(),
            };
            figure.y.iter().map(named).collect()
        };
        Self {
            title: case.file.title.clone(),
            drawn: case
                .file
                .figures
                .iter()
                .map(|f| (f.clone(), curves(f)))
                .collect(),
            names: probes.names().map(str::to_owned).collect(),
        }
    }

    pub(super) fn increment(&mut self, place: &Place, values: &[Option<f64>]) {
        for (figure, curves) in &mut self.drawn {
            if figure
                .phase
                .as_ref()
                .is_some_and(|phase| phase.get_ref() != &place.phase)
            {
                continue;
            }
            let value = |name: &str| {
                let number = self.names.iter().position(|n| n == name)?;
                values[number]
            };
            for curve in curves {
                if let (Some(x), Some(y)) = (value(figure.x.get_ref()), value(&curve.name)) {
                    curve.points.push((x, y));
                }
            }
        }
    }

    pub(super) fn draw(&self, folder: &Path) -> Result<(), Error> {
        for (figure, curves) in &self.drawn {
            draw_file(folder, figure, &self.title, curves)?;
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
                let same = figures
                    .drawn
                    .iter()
                    .find(|(f, _)| f.name.get_ref() == figure.name.get_ref());
                for curve in same
                    .map(|(_, curves)| curves.as_slice())
                    .unwrap_or_default()
                {
                    let name = if figure.y.len() == 1 {
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
            draw_file(folder, figure, &first.title, &curves)?;
        }
        Ok(())
    }
}

fn draw_file(
    folder: &Path,
    figure: &FigureInput,
    title: &str,
    curves: &[Curve],
) -> Result<(), Error> {
    let path = folder.join(format!("{}.svg", figure.name.get_ref()));
    let labels = Labels {
        title: figure.title.clone().unwrap_or_else(|| title.to_owned()),
        x: figure
            .x_label
            .clone()
            .unwrap_or_else(|| figure.x.get_ref().clone()),
        y: figure.y_label.clone().unwrap_or_default(),
    };
    let text = svg(&labels, curves)
        .map_err(|error| Error::Internal(format!("figure {}: {error}", path.display())))?;
    std::fs::write(&path, text).map_err(|error| unwritable(&path, error))
}

/// Curves as a text in SVG.
fn svg(labels: &Labels, curves: &[Curve]) -> Result<String, String> {
    let mut text = String::new();
    draw(&mut text, labels, curves).map_err(|error| error.to_string())?;
    Ok(text)
}

fn draw(
    text: &mut String,
    labels: &Labels,
    curves: &[Curve],
) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let area = SVGBackend::with_string(text, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let x = range(points().map(|p| p.0), 0.0);
    let y = range(points().map(|p| p.1), 0.05);
    let mut chart = ChartBuilder::on(&area)
        .caption(&labels.title, ("sans-serif", 15))
        .margin(12)
        .x_label_area_size(38)
        .y_label_area_size(58)
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
    for (curve, colour) in curves.iter().zip(COLOURS.into_iter().cycle()) {
        let style = colour.stroke_width(2);
        chart
            .draw_series(LineSeries::new(curve.points.iter().copied(), style))?
            .label(&curve.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
    }
    if curves.len() > 1 {
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .label_font(("sans-serif", 12))
            .position(SeriesLabelPosition::LowerRight)
            .draw()?;
    }
    area.present()
}

/// The range of some values, widened by a fraction of it; never empty.
fn range(values: impl Iterator<Item = f64>, margin: f64) -> std::ops::Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    if !(low.is_finite() && high.is_finite()) {
        return 0.0..1.0;
    }
    let width = if high > low {
        high - low
    } else {
        high.abs().max(1.0)
    };
    // A range that nearly reaches zero starts there.
    let low = if low >= 0.0 && low < 0.3 * high {
        0.0
    } else {
        low - margin * width
    };
    low..if high > low {
        high + margin * width
    } else {
        high + width
    }
}
