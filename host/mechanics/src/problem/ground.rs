//! What makes ground of elements: stress at rest, water, drainage.

use super::ElementGroup;
use serde::{Deserialize, Serialize};

/// A value over the height y (z): linear between points, constant beyond.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Profile(Vec<[f64; 2]>);

impl Profile {
    /// Points (height, value) in rising order; `None` if the list is empty, holds a NaN, or does
    /// not rise.
    pub fn new(points: Vec<[f64; 2]>) -> Option<Self> {
        let is_finite = points.iter().flatten().all(|value| value.is_finite());
        let rises = points.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        (!points.is_empty() && is_finite && rises).then_some(Self(points))
    }

    /// Its points.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.0
    }

    /// Its values.
    pub fn values(&self) -> impl Iterator<Item = f64> {
        self.0.iter().map(|[_, value]| *value)
    }

    /// Whether it is the same everywhere.
    pub fn is_constant(&self) -> bool {
        self.values()
            .all(|value| value.to_bits() == self.0[0][1].to_bits())
    }

    /// The value at a height (of a water table: the level at x).
    pub fn at(&self, y: f64) -> f64 {
        let above = self.0.partition_point(|[at, _]| *at <= y);
        match (
            above.checked_sub(1).map(|i| self.0[i]),
            self.0.get(above).copied(),
        ) {
            (None, Some([_, value])) | (Some([_, value]), None) => value,
            (Some([y_0, v_0]), Some([y_1, v_1])) => v_0 + (v_1 - v_0) * (y - y_0) / (y_1 - y_0),
            (None, None) => 0.0,
        }
    }

    /// The profile a part of the way from this one to another.
    #[must_use]
    pub fn towards(&self, other: &Self, part: f64) -> Self {
        let mut at: Vec<f64> = self.0.iter().chain(&other.0).map(|[y, _]| *y).collect();
        at.sort_unstable_by(f64::total_cmp);
        at.dedup();
        let value = |y: f64| self.at(y) + part * (other.at(y) - self.at(y));
        Self(at.into_iter().map(|y| [y, value(y)]).collect())
    }
}

impl From<f64> for Profile {
    fn from(value: f64) -> Self {
        Self(vec![[0.0, value]])
    }
}

/// Effective stress before the first phase, tension positive, kPa.
#[derive(Clone, Debug, PartialEq)]
pub enum InitialStress {
    /// Components 11 22 33 12 in global axes, the same everywhere.
    Constant([f64; 4]),
    /// The same components over the height.
    Profiles(Box<[Profile; 4]>),
    /// That of ground at rest under its own weight.
    AtRest(AtRest),
}

impl From<[f64; 4]> for InitialStress {
    fn from(stress: [f64; 4]) -> Self {
        Self::Constant(stress)
    }
}

/// Earth pressure at rest: σ'_v is the weight of the ground above, less the pore pressure.
#[derive(Clone, Debug, PartialEq)]
pub struct AtRest {
    /// Ratio or formula of σ'_h and σ'_v.
    pub ratio: Ratio,
    /// Added to σ'_v here, and on the same vertical in all groups below without a surcharge, kPa. `None`: carried down
    /// from above.
    pub surcharge: Option<f64>,
}

/// Horizontal effective stress at rest from the vertical one.
#[derive(Clone, Debug, PartialEq)]
pub enum Ratio {
    /// σ'_h = K_0 σ'_v.
    K0(Profile),
    /// With K_0,nc = 1 − sin φ (Jáky) and elastic unloading from an earlier stress:
    /// σ'_h = K_0,nc (OCR σ'_v + POP) − ν/(1 − ν) ((OCR − 1) σ'_v + POP).
    Overconsolidated {
        /// φ, in degrees.
        friction_angle: Profile,
        /// Overconsolidation ratio.
        ocr: Profile,
        /// Pre-overburden pressure, kPa.
        pop: Profile,
        /// ν of the unloading.
        poisson_ratio: f64,
    },
}

impl Ratio {
    /// The overconsolidation ratio at a height, its K_0, and tan²(45° + φ/2), if K_0 exceeds that.
    pub fn beyond_passive(&self, y: f64) -> Option<[f64; 3]> {
        let Self::Overconsolidated {
            friction_angle,
            ocr,
            pop,
            ..
        } = self
        else {
            return None;
        };
        let half = 0.5 * friction_angle.at(y).to_radians();
        let passive = (std::f64::consts::FRAC_PI_4 + half).tan().powi(2);
        let k_0 = self.horizontal(1.0, y);
        (pop.at(y) == 0.0 && k_0 > passive).then(|| [ocr.at(y), k_0, passive])
    }

    /// σ'_h for σ'_v (compression positive) at a height.
    pub fn horizontal(&self, vertical: f64, y: f64) -> f64 {
        match self {
            Self::K0(ratio) => ratio.at(y) * vertical,
            Self::Overconsolidated {
                friction_angle,
                ocr,
                pop,
                poisson_ratio: nu,
            } => {
                let (ocr, pop) = (ocr.at(y), pop.at(y));
                let k_0nc = 1.0 - friction_angle.at(y).to_radians().sin();
                k_0nc * (ocr * vertical + pop) - nu / (1.0 - nu) * ((ocr - 1.0) * vertical + pop)
            }
        }
    }
}

/// State of a group as ground before the first phase.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Effective stress.
    pub initial_stress: Option<InitialStress>,
    /// Unit weights above and below the water, kN/m³.
    pub unit_weight: [f64; 2],
    /// Water fills its pores below the water table.
    pub pore_water: bool,
    /// It is there.
    pub is_active: bool,
}

impl From<&ElementGroup> for Ground {
    fn from(group: &ElementGroup) -> Self {
        let dry = group.unit_weight;
        Self {
            initial_stress: group.initial_stress.clone(),
            unit_weight: [dry, group.saturated_unit_weight.unwrap_or(dry)],
            pore_water: group.pore_water,
            is_active: group.is_active,
        }
    }
}

/// Ground water.
#[derive(Clone, Debug, PartialEq)]
pub struct Water {
    /// Level y (z) of the water table over x (r), m.
    pub level: Profile,
    /// kN/m³.
    pub unit_weight: f64,
}

impl Water {
    /// Hydrostatic pressure, kPa; zero above the table.
    pub fn pressure(&self, [x, y]: [f64; 2]) -> f64 {
        self.unit_weight * (self.level.at(x) - y).max(0.0)
    }
}

/// Whether pore water leaves the ground.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Drainage {
    /// It leaves freely.
    #[default]
    Drained,
    /// It does not leave, and resists compression.
    Undrained,
}
