//! Estimate of a mesh's error: the distance of its strains from smoother, recovered ones.
//!
//! Strains of quadratic displacements are most accurate at a few points of an element (2 × 2 of a quad, 3 of a
//! triangle). Around every corner a polynomial of second degree is fitted to the strains at these points of the
//! adjacent elements. The estimated error of an element is the difference of its strains from the mean of its corners'
//! polynomials (recovery by patches, after Zienkiewicz & Zhu 1992).
//!
//! Strains come from the displacements of the nodes alone, so no law is asked. Neighbours are elements of the same
//! group that share a node: strains may jump from group to group, and across an interface. In
//! plastic ground strains need not be smooth, and the estimate shows the places.

mod fit;

use crate::element::kind::Elements;
use crate::element::{Axes, BadShape, Kind, Kinematics};
use crate::problem::{Analysis, Formulation};
use crate::simulation::Snapshot;
use fit::Fit;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;

/// A group of fewer elements has too few neighbours.
const LEAST_ELEMENTS: usize = 4;
/// Elements whose strains are formed at a time.
const PIECE: usize = 128;
/// Fewer points than this do not allow a fit.
const LEAST_POINTS: usize = 12;
/// Corners with less than this part of the points of the best corner of an element are not used: at a boundary they see
/// one side only.
const ONE_SIDED: f64 = 0.6;

/// Smaller strains (root of the mean square) are nothing but round-off.
const UNSTRAINED: f64 = 1e-12;

/// ∫ |ε* − ε|² dV, ∫ |ε|² dV, ∫ dV.
type Sums = [f64; 3];

/// Strain: 11, 22, 33, γ12.
type Strain = [f64; 4];

/// The estimated error of the strains on a mesh.
#[derive(Clone, Debug, Default)]
pub struct MeshError {
    /// By group; `None` where it is not estimated: interfaces and layers, absent groups, groups of few elements.
    groups: Vec<Option<GroupError>>,
    /// Over all of them.
    all: Sums,
}

/// For one group.
#[derive(Clone, Debug)]
struct GroupError {
    /// ∫ |ε* − ε|² dV of every element.
    elements: Vec<f64>,
    /// Over all of them.
    all: Sums,
}

impl MeshError {
    /// Estimates the error of a state.
    pub fn of(snapshot: &Snapshot<'_>) -> Self {
        let analysis = snapshot.problem.analysis;
        let groups = snapshot.groups.iter().map(|group| {
            let is_solid = group.formulation == Formulation::Solid;
            if !group.is_active || !is_solid || group.kinematics.n_elements() < LEAST_ELEMENTS {
                return None;
            }
            let view = View {
                analysis,
                nodes: &snapshot.mesh.nodes,
                displacement: snapshot.displacement,
                kinematics: &*group.kinematics,
            };
            view.error().ok()
        });
        let groups: Vec<Option<GroupError>> = groups.collect();
        let all = groups
            .iter()
            .flatten()
            .map(|group| group.all)
            .fold([0.0; 3], add);
        Self { groups, all }
    }

    /// ‖ε* − ε‖/‖ε*‖ over all groups that have an estimate; none where there are no strains.
    pub fn relative(&self) -> Option<f64> {
        ratio(self.all)
    }

    /// The same of a group alone.
    pub fn of_group(&self, group: usize) -> Option<f64> {
        ratio(self.groups.get(group)?.as_ref()?.all)
    }

    /// Share of an element: the squares of all add up to the square of [`Self::relative`].
    pub fn of_element(&self, group: usize, element: usize) -> Option<f64> {
        let own = self.groups.get(group)?.as_ref()?.elements.get(element)?;
        Some(ratio(self.all)? * (own / self.all[0].max(f64::MIN_POSITIVE)).sqrt())
    }
}

/// The error relative to the strains and the error together, from sums of squares.
fn ratio([error, strains, volume]: Sums) -> Option<f64> {
    let is_strained = strains > UNSTRAINED * UNSTRAINED * volume;
    is_strained.then(|| (error / (strains + error)).sqrt())
}

fn add(a: Sums, b: Sums) -> Sums {
    [0, 1, 2].map(|i| a[i] + b[i])
}

/// ε : ε.
fn square(strain: Strain) -> f64 {
    let [e_11, e_22, e_33, gamma] = strain;
    e_11 * e_11 + e_22 * e_22 + e_33 * e_33 + 0.5 * gamma * gamma
}

/// Data of a point of an element.
#[derive(Clone, Copy, Debug)]
struct Point {
    at: [f64; 2],
    weight: f64,
    strain: Strain,
}

/// The elements of a group, and how their nodes have moved.
#[derive(Clone, Copy)]
struct View<'a> {
    analysis: Analysis,
    nodes: &'a [[f64; 2]],
    displacement: &'a [f64],
    kinematics: &'a dyn Kinematics,
}

/// How strains of an element are looked at.
#[derive(Clone, Copy)]
enum Points {
    /// The superconvergent points.
    Best,
    /// The integration points.
    All,
}

impl View<'_> {
    fn error(&self) -> Result<GroupError, BadShape> {
        let n = self.kinematics.n_elements();
        let pieces = self.pieces();
        let best: Vec<Vec<Point>> = pieces
            .par_iter()
            .map(|piece| self.strains(piece.clone(), Points::Best))
            .collect::<Result<Vec<_>, _>>()?
            .into_iter()
            .flatten()
            .collect();
        let patches = Patches::of(self.kinematics, &best);
        let of_pieces: Vec<Vec<Sums>> = pieces
            .into_par_iter()
            .map(|piece| {
                let fine = self.strains(piece.clone(), Points::All)?;
                let both = piece.zip(fine);
                Ok(both
                    .map(|(element, points)| {
                        let fits = patches.around(element, &best);
                        let of = |point: &Point| {
                            let smooth = mean(&fits, point.at);
                            let off = [0, 1, 2, 3].map(|c| smooth[c] - point.strain[c]);
                            [square(off), square(point.strain), 1.0].map(|of| of * point.weight)
                        };
                        points.iter().map(of).fold([0.0; 3], add)
                    })
                    .collect())
            })
            .collect::<Result<_, _>>()?;
        let mut found = GroupError {
            elements: Vec::with_capacity(n),
            all: [0.0; 3],
        };
        for of_element in of_pieces.into_iter().flatten() {
            found.elements.push(of_element[0]);
            found.all = add(found.all, of_element);
        }
        Ok(found)
    }

    /// Elements in their order, by pieces of one kind.
    fn pieces(&self) -> Vec<Range<usize>> {
        let mut pieces: Vec<Range<usize>> = Vec::new();
        for element in 0..self.kinematics.n_elements() {
            let of = |element: usize| self.kinematics.nodes(element).len();
            match pieces.last_mut() {
                Some(last) if last.len() < PIECE && of(last.start) == of(element) => {
                    last.end = element + 1;
                }
                _ => pieces.push(element..element + 1),
            }
        }
        pieces
    }

    /// Strains of elements of one kind, by element.
    fn strains(&self, piece: Range<usize>, points: Points) -> Result<Vec<Vec<Point>>, BadShape> {
        let axes = vec![Axes::GLOBAL; piece.len()];
        let nodes: Vec<&[usize]> = piece
            .map(|element| self.kinematics.nodes(element))
            .collect();
        let Some(kind) = Kind::with_nodes(nodes[0].len()) else {
            return Err(BadShape { element: 0 });
        };
        let points = match points {
            Points::Best => kind.best,
            Points::All => kind.fine,
        };
        let elements = (kind.build)(Elements {
            analysis: self.analysis,
            coordinates: self.nodes,
            nodes: &nodes,
            axes,
            points: &|_| points,
        })?;
        let mut strains = vec![0.0; 4 * elements.n_points()];
        elements.add_gradients(self.displacement, &mut strains);
        let point = |point: usize| Point {
            at: elements.position(point),
            weight: elements.weight(point),
            strain: std::array::from_fn(|c| strains[4 * point + c]),
        };
        let of = |element: usize| elements.points_of(element).map(point).collect();
        Ok((0..elements.n_elements()).map(of).collect())
    }
}

/// Mean of some polynomials at a place.
fn mean(fits: &[Cow<'_, Fit>], at: [f64; 2]) -> Strain {
    let mut sum = [0.0; 4];
    for fit in fits {
        let values = fit.at(at);
        sum.iter_mut()
            .zip(values)
            .for_each(|(sum, value)| *sum += value);
    }
    sum.map(|sum| sum / fits.len() as f64)
}

/// Polynomials around the corners of a group's elements.
struct Patches {
    /// Corners of every element, counted within the group.
    corners: Vec<Vec<usize>>,
    /// Elements at each of them.
    elements: Vec<Vec<usize>>,
    /// The polynomial at each corner and its number of points; no polynomial if they are few.
    fits: Vec<Option<(usize, Fit)>>,
}

impl Patches {
    fn of(kinematics: &dyn Kinematics, best: &[Vec<Point>]) -> Self {
        let mut numbers = HashMap::new();
        let mut elements: Vec<Vec<usize>> = Vec::new();
        let mut corners = Vec::with_capacity(kinematics.n_elements());
        for element in 0..kinematics.n_elements() {
            // Corners come first, then as many middles of sides, and at most one node more.
            let nodes = kinematics.nodes(element);
            let own = nodes[..nodes.len() / 2].iter().map(|&node| {
                let number = *numbers.entry(node).or_insert_with(|| {
                    elements.push(Vec::new());
                    elements.len() - 1
                });
                elements[number].push(element);
                number
            });
            corners.push(own.collect());
        }
        let fit = |patch: &Vec<usize>| {
            let points = points(patch, best);
            (points.len() >= LEAST_POINTS).then(|| (points.len(), Fit::of(&points)))
        };
        let fits = elements.par_iter().map(fit).collect();
        Self {
            corners,
            elements,
            fits,
        }
    }

    /// The polynomials around an element: of its corners that see as much as the others, or one through the
    /// neighbours where no corner sees enough.
    fn around<'a>(&'a self, element: usize, best: &[Vec<Point>]) -> Vec<Cow<'a, Fit>> {
        let corners = self.corners[element].iter();
        let fits: Vec<&(usize, Fit)> = corners.filter_map(|&c| self.fits[c].as_ref()).collect();
        let most = fits.iter().map(|(n, _)| *n).max().unwrap_or_default();
        let sees = |n: usize| n as f64 >= ONE_SIDED * most as f64;
        if most > 0 {
            let seeing = fits.into_iter().filter(|(n, _)| sees(*n));
            return seeing.map(|(_, fit)| Cow::Borrowed(fit)).collect();
        }
        let mut patch = self.with(&[element]);
        let mut found = points(&patch, best);
        if found.len() < LEAST_POINTS {
            patch = self.with(&patch);
            found = points(&patch, best);
        }
        vec![Cow::Owned(Fit::of(&found))]
    }

    /// These elements and all that share a corner with one of them, sorted.
    fn with(&self, elements: &[usize]) -> Vec<usize> {
        let corners = elements.iter().flat_map(|&element| &self.corners[element]);
        let all = corners.flat_map(|&corner| self.elements[corner].iter().copied());
        let mut all: Vec<usize> = all.collect();
        all.sort_unstable();
        all.dedup();
        all
    }
}

/// The best points of some elements.
fn points(elements: &[usize], best: &[Vec<Point>]) -> Vec<Point> {
    let points = elements.iter().flat_map(|&element| best[element].iter());
    points.copied().collect()
}
