//! Gradient and flux of each hypothesis, and the formulation of a law that has them.

use super::{Hypothesis, Variable};
use crate::raw;
use std::ffi::c_char;

impl Variable {
    const fn with_components(mut self, shape: raw::Shape, names: &'static [*const c_char]) -> Self {
        self.0.shape = shape;
        self.0.n_components = names.len() as u32;
        self.0.component_names = names.as_ptr();
        self
    }

    /// The strain under a hypothesis.
    const fn strain(names: &'static [*const c_char]) -> raw::Variable {
        Self::new(c"ε", c"-")
            .called(c"strain", c"Strain, tension positive, engineering shear.")
            .with_components(raw::PILUM_SYMMETRIC_TENSOR, names)
            .0
    }

    const fn stress(names: &'static [*const c_char]) -> raw::Variable {
        Self::new(c"σ", c"kPa")
            .called(c"stress", c"Stress, tension positive.")
            .with_components(raw::PILUM_SYMMETRIC_TENSOR, names)
            .0
    }

    /// The jump of an interface.
    const fn jump(names: &'static [*const c_char]) -> raw::Variable {
        let doc = c"Relative displacement across the interface, opening positive.";
        Self::new(c"[u]", c"m")
            .called(c"jump", doc)
            .with_components(raw::PILUM_VECTOR, names)
            .0
    }

    /// The traction on an interface.
    const fn traction(names: &'static [*const c_char]) -> raw::Variable {
        Self::new(c"t", c"kPa")
            .called(c"traction", c"Traction on the interface, tension positive.")
            .with_components(raw::PILUM_VECTOR, names)
            .0
    }
}

const NAMES_4: &[*const c_char] = &[
    c"11".as_ptr(),
    c"22".as_ptr(),
    c"33".as_ptr(),
    c"12".as_ptr(),
];
const NAMES_6: &[*const c_char] = &[
    c"11".as_ptr(),
    c"22".as_ptr(),
    c"33".as_ptr(),
    c"12".as_ptr(),
    c"13".as_ptr(),
    c"23".as_ptr(),
];
const NAMES_NT: &[*const c_char] = &[c"n".as_ptr(), c"t".as_ptr()];
const NAMES_NTS: &[*const c_char] = &[c"n".as_ptr(), c"t".as_ptr(), c"s".as_ptr()];
const STRAIN_4: &raw::Variable = &Variable::strain(NAMES_4);
const STRESS_4: &raw::Variable = &Variable::stress(NAMES_4);
const STRAIN_6: &raw::Variable = &Variable::strain(NAMES_6);
const STRESS_6: &raw::Variable = &Variable::stress(NAMES_6);
const JUMP_2: &raw::Variable = &Variable::jump(NAMES_NT);
const TRACTION_2: &raw::Variable = &Variable::traction(NAMES_NT);
const JUMP_3: &raw::Variable = &Variable::jump(NAMES_NTS);
const TRACTION_3: &raw::Variable = &Variable::traction(NAMES_NTS);

impl raw::Formulation {
    /// The formulation of a law under one hypothesis.
    pub(crate) const fn new(
        hypothesis: Hypothesis,
        flags: u32,
        state: &'static [Variable],
    ) -> Self {
        let (gradient, flux): (&'static raw::Variable, &'static raw::Variable) = match hypothesis {
            Hypothesis::PlaneStrain | Hypothesis::Axisymmetric => (STRAIN_4, STRESS_4),
            Hypothesis::ThreeD => (STRAIN_6, STRESS_6),
            Hypothesis::Interface2d => (JUMP_2, TRACTION_2),
            Hypothesis::Interface3d => (JUMP_3, TRACTION_3),
        };
        Self {
            struct_size: size_of::<Self>() as u32,
            hypothesis: hypothesis as i32,
            flags,
            n_gradients: 1,
            n_fluxes: 1,
            n_states: state.len() as u32,
            gradient,
            flux,
            state: state.as_ptr().cast(),
        }
    }
}
