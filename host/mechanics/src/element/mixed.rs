//! Elements of several shapes in one group.

use super::{Axes, Kinematics};
use std::ops::Range;

/// Elements of a group, one after the other, each part of one shape.
#[derive(Debug)]
pub struct Mixed {
    parts: Vec<Box<dyn Kinematics>>,
    /// First element and first point of every part, and what follows the last.
    starts: Vec<(usize, usize)>,
}

impl Mixed {
    /// Parts in the order of their elements.
    pub fn new(parts: Vec<Box<dyn Kinematics>>) -> Self {
        let mut starts = vec![(0, 0)];
        for part in &parts {
            let (element, point) = starts[starts.len() - 1];
            starts.push((element + part.n_elements(), point + part.n_points()));
        }
        Self { parts, starts }
    }

    fn of_element(&self, element: usize) -> (&dyn Kinematics, usize, usize) {
        let part = self.starts.partition_point(|start| start.0 <= element) - 1;
        let (first, point) = self.starts[part];
        (&*self.parts[part], element - first, point)
    }

    fn of_point(&self, point: usize) -> (&dyn Kinematics, usize, usize) {
        let part = self.starts.partition_point(|start| start.1 <= point) - 1;
        let (element, first) = self.starts[part];
        (&*self.parts[part], point - first, element)
    }

    fn n(&self) -> (usize, usize) {
        self.starts[self.starts.len() - 1]
    }
}

impl Kinematics for Mixed {
    fn n_elements(&self) -> usize {
        self.n().0
    }

    fn n_points(&self) -> usize {
        self.n().1
    }

    fn points_of(&self, element: usize) -> Range<usize> {
        let (part, own, first) = self.of_element(element);
        let points = part.points_of(own);
        first + points.start..first + points.end
    }

    fn place_of(&self, point: usize) -> (usize, usize) {
        let (part, own, first) = self.of_point(point);
        let (element, number) = part.place_of(own);
        (first + element, number)
    }

    fn n_components(&self) -> usize {
        4
    }

    fn nodes(&self, element: usize) -> &[usize] {
        let (part, own, _) = self.of_element(element);
        part.nodes(own)
    }

    fn position(&self, point: usize) -> [f64; 2] {
        let (part, own, _) = self.of_point(point);
        part.position(own)
    }

    fn weight(&self, point: usize) -> f64 {
        let (part, own, _) = self.of_point(point);
        part.weight(own)
    }

    fn volumes(&self, element: usize) -> &[f64] {
        let (part, own, _) = self.of_element(element);
        part.volumes(own)
    }

    fn length(&self, element: usize) -> f64 {
        let (part, own, _) = self.of_element(element);
        part.length(own)
    }

    fn axes(&self, element: usize) -> Axes {
        let (part, own, _) = self.of_element(element);
        part.axes(own)
    }

    fn add_gradients(&self, displacement: &[f64], out: &mut [f64]) {
        for (part, start) in self.parts.iter().zip(&self.starts) {
            let own = 4 * start.1..4 * (start.1 + part.n_points());
            part.add_gradients(displacement, &mut out[own]);
        }
    }

    fn add_forces(&self, flux: &[f64], force: &mut [f64]) {
        for (part, start) in self.parts.iter().zip(&self.starts) {
            let own = 4 * start.1..4 * (start.1 + part.n_points());
            part.add_forces(&flux[own], force);
        }
    }

    fn stiffness(&self, element: usize, tangent: &[f64], out: &mut [f64]) {
        let (part, own, _) = self.of_element(element);
        part.stiffness(own, tangent, out);
    }
}
