//! The table `mesh`.

use super::one;
use crate::schema;
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::PathBuf;
use std::sync::Arc;
use text::{Named, Spanned};

/// A mesh: a grid of 8-node quads, or a file of Gmsh.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshInput {
    /// Instead of a grid: a file of Gmsh, relative to the case file.
    pub file: Option<Spanned<PathBuf>>,
    /// Metres in a unit of that file; default 1.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<Spanned<f64>>,
    /// Start of columns and rows; default (0, 0).
    pub origin: Option<Spanned<[f64; 2]>>,
    /// Columns, in the direction of x (r).
    pub columns: Option<Spanned<Vec<Spanned<PartInput>>>>,
    /// Rows, in the direction of y (z).
    pub rows: Option<Spanned<Vec<Spanned<PartInput>>>>,
    /// Groups of elements; later regions override earlier ones.
    #[serde(default, rename = "region")]
    pub regions: Vec<RegionInput>,
    /// Named lines.
    #[serde(default)]
    pub lines: Named<LineInput>,
    /// How often each element of the file is divided into four.
    #[serde(skip)]
    pub divisions: u32,
    /// Content of the file if it is not read: a mesh made in memory.
    #[serde(skip)]
    pub content: Option<Arc<[u8]>>,
}

/// Some columns or rows, following the previous ones.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartInput {
    /// Number.
    pub n: usize,
    /// Coordinate where they end.
    pub to: f64,
    /// Size of each over the size of the one before.
    #[serde(default = "one")]
    pub ratio: f64,
}

/// A rectangle of elements.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(transform = schema::radius_and_axis)]
#[serde(deny_unknown_fields)]
pub struct RegionInput {
    /// Group of the elements.
    pub group: Spanned<String>,
    /// Extent in x (r); default: all.
    #[serde(alias = "r")]
    pub x: Option<Spanned<[f64; 2]>>,
    /// Extent in y (z); default: all.
    #[serde(alias = "z")]
    pub y: Option<Spanned<[f64; 2]>>,
}

/// A line along a coordinate, or a point.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[schemars(transform = schema::radius_and_axis)]
#[serde(deny_unknown_fields)]
pub struct LineInput {
    /// Position or extent in x (r).
    #[serde(alias = "r")]
    pub x: Option<Coordinate>,
    /// Position or extent in y (z).
    #[serde(alias = "z")]
    pub y: Option<Coordinate>,
}

/// A position or an extent.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a number, or an extent such as `[0.0, 1.0]`"
)]
pub enum Coordinate {
    /// A position.
    At(f64),
    /// An extent.
    Between([f64; 2]),
}
