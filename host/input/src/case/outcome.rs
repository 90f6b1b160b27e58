//! What a case gives: probes, the forces of a pile, figures.

use super::{GroupInput, GroupNames, MeasuredTables, one};
use crate::schema;
use results::output_request::Reduce;
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::PathBuf;
use text::{Named, Spanned};

/// A quantity written for every increment.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(transform = schema::radius_and_axis)]
#[serde(deny_unknown_fields)]
pub struct ProbeInput {
    /// Line of nodes.
    pub line: Option<Spanned<String>>,
    /// Group of integration points; with a line, its forces.
    pub group: Option<Spanned<String>>,
    /// On a line `displacement_…`, `reaction_…`, with a group `force_…`. In a group a stress, strain,
    /// traction, jump, internal variable, `pore_pressure`, `excess_pore_pressure` or `total_stress_…`.
    pub quantity: Option<Spanned<String>>,
    /// How values become one; default `sum` for forces, else `mean`.
    pub reduce: Option<Reduce>,
    /// Only points strictly inside this extent.
    #[serde(alias = "r")]
    pub x: Option<[f64; 2]>,
    /// Only points strictly inside this extent.
    #[serde(alias = "z")]
    pub y: Option<[f64; 2]>,
    /// Factor.
    #[serde(default = "one")]
    pub scale: f64,
    /// Instead: a sum of earlier probes with factors.
    pub combine: Option<Named<f64>>,
}

/// A pile: what of the model it is.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PileInput {
    /// Group of its elements, or several.
    pub group: GroupNames,
    /// Interface groups of its shaft, from head to toe.
    pub shaft: GroupNames,
    /// Base: an interface group, or its line on the ground.
    pub base: Spanned<String>,
    /// Line of its head.
    pub head: Spanned<String>,
    /// Diameter (plane strain: width) for its resistance, m; default: twice the largest radius of the
    /// base, in plane strain its extent in x.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub diameter: Option<Spanned<f64>>,
}

impl PileInput {
    pub(super) fn line_names<'a>(
        &'a self,
        groups: &'a Named<GroupInput>,
    ) -> impl Iterator<Item = &'a Spanned<String>> {
        let is_group = groups.contains_key(self.base.get_ref().as_str());
        std::iter::once(&self.head).chain((!is_group).then_some(&self.base))
    }
}

/// Curves of probes over another probe, of a stress over the integration points of a cut, or of what
/// holds along the pile.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FigureInput {
    /// Name of the file, without `.svg`.
    pub name: Spanned<String>,
    /// Title; default: the case's.
    pub title: Option<String>,
    /// Horizontal axis: probe, quantity of a point, or column of `pile.csv`.
    pub x: Spanned<String>,
    /// Text of this axis.
    pub x_label: Option<String>,
    /// Vertical axis: the same, one or more.
    pub y: Vec<Spanned<String>>,
    /// Text of this axis.
    pub y_label: Option<String>,
    /// The vertical axis points downward, as for settlements.
    #[serde(default)]
    pub y_reversed: bool,
    /// Only this phase; default: all.
    pub phase: Option<Spanned<String>>,
    /// Integration points of a cut, instead of probes.
    pub points: Option<CutInput>,
    /// Along the pile, instead of probes.
    pub along_pile: Option<Spanned<AlongInput>>,
    /// Measured points, as markers.
    pub measured: Option<MeasuredTables>,
}

impl FigureInput {
    /// Increments of its phase after which a figure over points or along the pile has a curve.
    pub fn increments(&mut self) -> Option<&mut Vec<usize>> {
        let of_cut = self.points.as_mut().map(|cut| &mut cut.increments);
        let along = self.along_pile.as_mut();
        of_cut.or(along.map(|along| &mut along.get_mut().increments))
    }
}

/// Integration points inside extents (ends excluded), at chosen increments.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(transform = schema::radius_and_axis)]
#[serde(deny_unknown_fields)]
pub struct CutInput {
    /// Group; default: all.
    pub group: Option<Spanned<String>>,
    /// Extent in x (r).
    #[serde(alias = "r")]
    pub x: Option<[f64; 2]>,
    /// Extent in y (z).
    #[serde(alias = "z")]
    pub y: Option<[f64; 2]>,
    /// A curve after each of these increments of the phase; default: the last one.
    #[serde(default)]
    pub increments: Vec<usize>,
    /// Factor of the vertical axis.
    #[serde(default = "one")]
    pub scale: f64,
}

/// What holds along the pile, at chosen increments.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AlongInput {
    /// A curve after each of these increments of the phase; default: the last one.
    #[serde(default)]
    pub increments: Vec<usize>,
}

/// Points from two columns of a file of comma-separated values.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredInput {
    /// The file, relative to this one. Columns named in the first line, separated by `,`, `;` or tabs;
    /// lines with `#` and rows without a value do not count.
    pub file: Spanned<PathBuf>,
    /// Column for the horizontal axis.
    pub x: Spanned<String>,
    /// Column for the vertical axis.
    pub y: Spanned<String>,
    /// Name in the legend.
    #[serde(default = "measured")]
    pub label: String,
    /// Factor of its values.
    #[serde(default = "one")]
    pub x_scale: f64,
    /// Factor of its values.
    #[serde(default = "one")]
    pub y_scale: f64,
    /// Added to its values after the factor.
    #[serde(default)]
    pub x_offset: f64,
    /// Added to its values after the factor.
    #[serde(default)]
    pub y_offset: f64,
}

fn measured() -> String {
    "measured".to_owned()
}
