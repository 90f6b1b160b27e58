//! Whether a law's tangents are the derivatives of its stresses. All points are tested in one direction. At a few of
//! those that fail, tangents are compared with differences of the law's own answers about their last increment.
//!
//! If both sides and two sizes of differences agree, the stress has a derivative, and the tangent
//! has to equal it. At a kink, or in noise, they differ, and the tangent is not judged.

use crate::group::{Group, MadeBy, Origin};
use law::{End, Operator, Strided};

/// Sizes of the differences, relative to the increment of the gradients.
const SIZES: [f64; 2] = [1e-2, 1e-3];
/// Gradients beyond this (strains of 100 %, jumps of 1 m) are those of iterates that lead nowhere.
const ABSURD: f64 = 1.0;
/// A tangent is off by more than this share of its largest entry, and by this many times the
/// scatter of the slopes.
const OFF: f64 = 5e-3;
const BEYOND: f64 = 4.0;
/// Looked at are this many of the suspected points, those that move most, and at most as many others.
const POINTS: usize = 6;
/// A law's tangents are wrong if they are off at this many points or more, and at this share of those where the stress
/// has a derivative.
const SEVERAL: usize = 2;
const SHARE: f64 = 0.3;
/// After this many checks that found them wrong, slow steps are no longer checked.
const TWICE: u8 = 2;
/// After this many in a row that found them right, only steps without equilibrium are checked.
const OFTEN: u8 = 8;

/// How far tangents are from the derivatives of the stresses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Points where they are off, and those at which stresses have derivatives.
    pub points: [usize; 2],
    /// Largest difference, relative to the largest entry of a point.
    pub largest: f64,
}

/// How a step went whose tangents are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Went {
    /// It took more iterations than consistent tangents mostly need.
    Slowly,
    /// It took so much longer that differences would have cost less.
    Badly,
    /// It found no equilibrium.
    Wrong,
}

/// Findings about a law's tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Notice {
    /// How far they are off.
    pub deviation: Deviation,
    /// From now on tangents are differences.
    pub by_differences: bool,
}

impl std::fmt::Display for Notice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Deviation {
            points: [off, of],
            largest,
        } = self.deviation;
        write!(
            f,
            "by up to {:.1} % at {off} of {of} points that were looked at: ",
            100.0 * largest
        )?;
        f.write_str(if self.by_differences {
            "from here on they are made by differences"
        } else {
            "they are kept as long as steps take few iterations with them, and made by differences \
             otherwise"
        })
    }
}

impl Group {
    /// Checks the tangents of the law after a step, unless their quality is known. Gives notice when they have turned
    /// out not to be derivatives, and again when differences take their place.
    pub fn look(&mut self, period: (f64, f64), went: Went) -> Option<Notice> {
        let Origin {
            differences,
            right,
            wrong,
        } = self.tangents.origin;
        let is_noticed = wrong >= TWICE;
        let is_known = self.tangents.are_constant
            || !self.is_active
            || differences.is_some()
            || right >= OFTEN && went != Went::Wrong
            || is_noticed && went == Went::Slowly;
        if is_known {
            return None;
        }
        let deviation = self.deviation(period);
        let [off, of] = deviation.points;
        if off < SEVERAL || (off as f64) < SHARE * of as f64 {
            if went != Went::Wrong && !is_noticed {
                self.tangents.origin.right += 1;
            }
            return None;
        }
        self.tangents.origin.right = 0;
        self.tangents.origin.wrong = wrong.saturating_add(1);
        let is_again = self.tangents.origin.wrong >= TWICE;
        let by_differences = went == Went::Wrong || went == Went::Badly && is_again;
        if by_differences {
            self.tangents.origin.differences = Some(MadeBy::Noticed);
        }
        (by_differences || is_again).then_some(Notice {
            deviation,
            by_differences,
        })
    }

    /// How far the law's tangents are off at some of the points that fail the test in one direction.
    fn deviation(&self, period: (f64, f64)) -> Deviation {
        let mut all = Deviation::default();
        for point in self.suspects(period).unwrap_or_default() {
            let Some(off) = self.off(point, period) else {
                continue;
            };
            all.points[1] += 1;
            if off > OFF {
                all.points[0] += 1;
                all.largest = all.largest.max(off);
            }
        }
        all
    }

    /// Points whose tangents fail the test in one direction: those that move most, and some of the others. `None` if
    /// they cannot be judged.
    fn suspects(&self, period: (f64, f64)) -> Option<Vec<usize>> {
        let n = self.law.built.law.n_components();
        let gradient = self.gradient();
        if gradient.trial.len() != gradient.committed.len() {
            return None;
        }
        let sizes = self.sizes()?;
        let mut tangents = vec![0.0; sizes.len() * n * n];
        let end = End {
            flux: (&mut vec![0.0; sizes.len() * n], Strided::rows(n)),
            state: &mut vec![0.0; self.internal.committed.len()],
            operator: &mut tangents,
        };
        let at = (&gradient.trial[..], None);
        self.carry(at, Operator::Consistent, period, end).ok()?;
        let wrong = self.wrong(&sizes, period, &tangents);
        let points = gradient.committed.chunks_exact(n);
        let points = points.zip(gradient.trial.chunks_exact(n)).enumerate();
        let mut moving: Vec<(f64, usize)> = points
            .filter(|(point, _)| wrong[*point])
            .map(|(point, (start, end))| {
                let moved = start.iter().zip(end).map(|(a, b)| (b - a).abs());
                (moved.fold(0.0, f64::max), point)
            })
            .filter(|(moved, _)| *moved > 0.0 && *moved < ABSURD)
            .collect();
        moving.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let first = POINTS.min(moving.len());
        let apart = (moving.len() - first).div_ceil(POINTS).max(1);
        let chosen = (0..first).chain((first..moving.len()).step_by(apart));
        Some(chosen.map(|number| moving[number].1).collect())
    }

    /// How far the law's tangent is off at a point, relative to its largest entry; `None` where the stress
    /// has no derivative that could be told, or the law fails.
    fn off(&self, point: usize, period: (f64, f64)) -> Option<f64> {
        let n = self.law.built.law.n_components();
        let gradient = self.gradient();
        let of = n * point..n * (point + 1);
        let (start, end) = (&gradient.committed[of.clone()], &gradient.trial[of]);
        let (here, matrix) = self.answer(point, end, Operator::Consistent, period)?;
        let moved = start.iter().zip(end).map(|(a, b)| (b - a).abs());
        let reach = moved.fold(0.0, f64::max);
        let largest = matrix.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        if largest <= 0.0 {
            return None;
        }
        let mut worst = 0.0_f64;
        let mut is_smooth = true;
        for column in (0..n).filter(|column| self.moves(*column)) {
            let at = |h: f64| {
                let mut moved = end.to_vec();
                moved[column] += h;
                let apart = moved[column] - end[column];
                Some((self.answer(point, &moved, Operator::None, period)?.0, apart))
            };
            let slopes = SIZES.map(|size| Some([at(size * reach)?, at(-size * reach)?]));
            let [Some(wide), Some(narrow)] = slopes else {
                return None;
            };
            let (mut off, mut spread) = (0.0_f64, 0.0_f64);
            for row in 0..n {
                let slope = |(flux, apart): &(Vec<f64>, f64)| (flux[row] - here[row]) / apart;
                let middle = |[a, b]: &[(Vec<f64>, f64); 2]| 0.5 * (slope(a) + slope(b));
                let [wide_middle, narrow_middle] = [&wide, &narrow].map(middle);
                off = off.max((narrow_middle - matrix[row * n + column]).abs() / largest);
                let sides = (slope(&narrow[0]) - slope(&narrow[1])).abs();
                let sizes = (wide_middle - narrow_middle).abs();
                spread = spread.max(sides.max(sizes) / largest);
            }
            if off > OFF && off > BEYOND * spread {
                worst = worst.max(off);
            } else if spread > OFF {
                is_smooth = false;
            }
        }
        (is_smooth || worst > OFF).then_some(worst)
    }
}
