//! Ground in a case file: profiles over the height, water, stress before the first phase.

use crate::{Error, schema};
use mechanics::problem::{AtRest, InitialStress, Profile, Ratio, Water};
use schemars::JsonSchema;
use serde::Deserialize;
use std::ops::Range;
use text::{Source, Spanned};

/// A value, or values over the height.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(
    untagged,
    expecting = "expected a number, or values over the height such as `{ z = [[-10.0, 5.0], [0.0, 1.0]] }`"
)]
pub enum ProfileInput {
    /// The same everywhere.
    Number(f64),
    /// Points (height, value), height rising.
    Points(Vec<[f64; 2]>),
    /// The same under the name of the height.
    Over(Over),
}

/// Values over the height.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq)]
#[schemars(transform = schema::height)]
#[serde(deny_unknown_fields)]
pub struct Over {
    /// Points (height, value), height rising.
    #[serde(alias = "y")]
    pub z: Vec<[f64; 2]>,
}

impl ProfileInput {
    /// The profile it stands for.
    ///
    /// # Errors
    /// [`text::Error::Input`] if heights do not rise, or a number is not finite.
    pub(crate) fn read(&self, source: &Source, at: Range<usize>) -> Result<Profile, Error> {
        let points = match self {
            Self::Number(value) => vec![[0.0, *value]],
            Self::Points(points) | Self::Over(Over { z: points }) => points.clone(),
        };
        Profile::new(points).ok_or_else(|| {
            let message = "a profile needs points [height, value] of finite numbers, height rising";
            source.error(at, message).into()
        })
    }
}

/// Ground water.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaterInput {
    /// Level, or points (x, level) from left to right.
    pub level: Spanned<LevelInput>,
    /// Unit weight of water, kN/m³.
    #[serde(default = "of_water")]
    #[schemars(with = "f64")]
    pub unit_weight: Spanned<f64>,
}

/// The water table of a phase.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaterChange {
    /// Level at the end of the phase, or points (x, level).
    pub level: Spanned<LevelInput>,
}

/// Level of a water table.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a level, or points `[[x, z], …]` from left to right"
)]
pub enum LevelInput {
    /// The same everywhere.
    Level(f64),
    /// Points (x, level), x rising: linear between, constant beyond.
    Points(Vec<[f64; 2]>),
}

fn of_water() -> Spanned<f64> {
    Spanned::new(0..0, 9.81)
}

/// The profile of a level over x.
pub(crate) fn level(source: &Source, level: &Spanned<LevelInput>) -> Result<Profile, Error> {
    let points = match level.get_ref() {
        LevelInput::Level(level) => vec![[0.0, *level]],
        LevelInput::Points(points) => points.clone(),
    };
    Profile::new(points).ok_or_else(|| {
        let message = "a water table needs pairs of a distance x (r) and a level, finite numbers, each x greater than the one before. A vertical step takes two points a small distance apart";
        source.error(level.span(), message).into()
    })
}

impl WaterInput {
    /// The water it stands for.
    ///
    /// # Errors
    /// [`text::Error::Input`] if the level is not valid.
    pub(crate) fn read(&self, source: &Source) -> Result<Water, Error> {
        Ok(Water {
            level: level(source, &self.level)?,
            unit_weight: *self.unit_weight.get_ref(),
        })
    }
}

/// Effective stress before the first phase, tension positive, kPa: components, constant or over the
/// height; or earth pressure at rest under the weight of the ground, by `k_0` or by `friction_angle`.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[schemars(transform = schema::components_alone)]
#[serde(deny_unknown_fields, default)]
pub struct StressInput {
    /// Along x (r).
    #[serde(rename = "stress_11", alias = "11")]
    pub s11: Option<Spanned<ProfileInput>>,
    /// Along y (z).
    #[serde(rename = "stress_22", alias = "22")]
    pub s22: Option<Spanned<ProfileInput>>,
    /// Out of plane (hoop).
    #[serde(rename = "stress_33", alias = "33")]
    pub s33: Option<Spanned<ProfileInput>>,
    /// Shear.
    #[serde(rename = "stress_12", alias = "12")]
    pub s12: Option<Spanned<ProfileInput>>,
    /// At rest: horizontal over vertical effective stress.
    pub k_0: Option<Spanned<ProfileInput>>,
    /// At rest, instead of `k_0`: angle of friction, degrees.
    pub friction_angle: Option<Spanned<ProfileInput>>,
    /// At rest: overconsolidation ratio; default 1. Also `ocr` of the group's law, if that has one.
    pub ocr: Option<Spanned<ProfileInput>>,
    /// At rest: pre-overburden pressure, kPa; default 0. Also `pop` of the group's law, if that has one.
    pub pop: Option<Spanned<ProfileInput>>,
    /// At rest: Poisson's ratio of unloading, needed with `ocr` or `pop`.
    pub poisson_ratio: Option<f64>,
    /// At rest: added to the vertical effective stress here and below, kPa.
    pub surcharge: Option<f64>,
}

impl StressInput {
    /// The stress it stands for; `at`: where it is written.
    ///
    /// # Errors
    /// [`text::Error::Input`] if keys do not go together, or a profile is not valid.
    pub(crate) fn read(&self, source: &Source, at: Range<usize>) -> Result<InitialStress, Error> {
        let components = [&self.s11, &self.s22, &self.s33, &self.s12];
        let profile = |input: &Spanned<ProfileInput>| input.get_ref().read(source, input.span());
        let optional =
            |input: &Option<Spanned<ProfileInput>>| input.as_ref().map(profile).transpose();
        let wrong = |at: Range<usize>, why: &str| Err(source.error(at, why).into());
        let is_at_rest = self.k_0.is_some() || self.friction_angle.is_some();
        if !is_at_rest {
            let alone = [("ocr", &self.ocr), ("pop", &self.pop)];
            if let Some((key, input)) = alone.into_iter().find_map(|(k, i)| Some((k, i.as_ref()?)))
            {
                return wrong(input.span(), &format!("`{key}` needs a `friction_angle`"));
            }
            if self.surcharge.is_some() || self.poisson_ratio.is_some() {
                return wrong(
                    at,
                    "`surcharge` and `poisson_ratio` go with `k_0` or `friction_angle`",
                );
            }
            let profiles = components.map(optional);
            let [s11, s22, s33, s12] = profiles;
            let profiles = [s11?, s22?, s33?, s12?].map(|p| p.unwrap_or_else(|| 0.0.into()));
            return Ok(if profiles.iter().all(Profile::is_constant) {
                InitialStress::Constant(profiles.map(|profile| profile.at(0.0)))
            } else {
                InitialStress::Profiles(Box::new(profiles))
            });
        }
        if let Some(given) = components.into_iter().flatten().next() {
            return wrong(
                given.span(),
                "`initial_stress` has stress components together with `k_0` or `friction_angle`: give one or the other (keys of a `base` file count, too)",
            );
        }
        Ok(InitialStress::AtRest(AtRest {
            ratio: self.ratio(source, at)?,
            surcharge: self.surcharge,
        }))
    }

    /// Ratio of the horizontal to the vertical effective stress.
    fn ratio(&self, source: &Source, at: Range<usize>) -> Result<Ratio, Error> {
        let profile = |input: &Spanned<ProfileInput>| input.get_ref().read(source, input.span());
        let optional =
            |input: &Option<Spanned<ProfileInput>>| input.as_ref().map(profile).transpose();
        let wrong = |at: Range<usize>, why: &str| Err(source.error(at, why).into());
        Ok(match (&self.k_0, &self.friction_angle) {
            (Some(_), Some(angle)) => {
                return wrong(angle.span(), "give `k_0` or `friction_angle`, not both");
            }
            (Some(k_0), None) => {
                let others = [&self.ocr, &self.pop].into_iter().flatten().next();
                if let Some(other) = others {
                    return wrong(
                        other.span(),
                        "`ocr` and `pop` go with `friction_angle`, not with `k_0`",
                    );
                }
                Ratio::K0(profile(k_0)?)
            }
            (None, Some(angle)) => {
                let unloads = self.ocr.is_some() || self.pop.is_some();
                if unloads && self.poisson_ratio.is_none() {
                    return wrong(at, "`ocr` and `pop` need a `poisson_ratio` of unloading");
                }
                Ratio::Overconsolidated {
                    friction_angle: profile(angle)?,
                    ocr: optional(&self.ocr)?.unwrap_or_else(|| 1.0.into()),
                    pop: optional(&self.pop)?.unwrap_or_else(|| 0.0.into()),
                    poisson_ratio: self.poisson_ratio.unwrap_or(0.0),
                }
            }
            (None, None) => Ratio::K0(1.0.into()),
        })
    }
}
