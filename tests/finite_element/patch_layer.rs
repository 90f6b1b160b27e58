//! Patch tests of `thin_layer`.
//!
//! Goal        a layer between two other materials carries constant stress, whatever its law, direction and
//!             integration. With an interface law its stresses are those of an elastic layer with M = K_n t, G =
//!             K_t t, so κ = λ/M = 1 − 2 K_t/K_n.
//! Geometry    horizontal or vertical layers, the thin one 20 mm; also one that ends inside.
//!
//! ```text
//!   ┌─────┬─┬─────┐        ┌─────┬─┬─────┐
//!   │  2  │ │  2  │        │     │l│     │
//!   ├─────┼─┼─────┤        │     │a│     │
//!   ├layer┼─┼─────┤        │     │y│     │
//!   │  1  │ │  1  │        ├─────┼─┼─────┤
//!   └─────┴─┴─────┘        └─────┴─┴─────┘
//! ```
//!
//! Boundary    displacements of all boundary nodes from the closed form of a laminate. With S, T the stresses
//!             across all layers and e the strain along them, ε_n = (S − λ e (plane strain) or 2 λ e
//!             (axisymmetric))/M, γ = T/G.
//! Law         elastic, oriented_mohr_coulomb, coulomb_joint, mepi, all in their elastic range.
//! Asserts     stresses of all points, tractions and jumps of the layer, PATCH.

use crate::patch::{Expected, Normal, PATCH, Patch, boundary_nodes};
use crate::setup::{Lame, elastic};

const INTEGRATION: [&str; 3] = ["full", "reduced", "mean"];
/// Thickness.
const T: f64 = 0.02;
/// Grid lines across the layers, and where the layer starts.
const ACROSS: [f64; 4] = [0.0, 1.0, 1.0 + T, 1.8];
/// Grid lines along them.
const ALONG: [f64; 4] = [0.0, 0.7, 0.8, 3.0];
/// Interface stiffnesses of 3.0e5 and 1.2e5 kPa/m.
const K_N: f64 = 3.0e5;
const K_T: f64 = 1.2e5;

/// A law for the layer and its constants M, λ, G.
struct LayerLaw {
    name: &'static str,
    text: String,
    interface: bool,
    constants: Lame,
    in_plane: &'static str,
}

fn layer_laws() -> Vec<LayerLaw> {
    let (young, poisson) = (9e3, 0.2);
    let continuum = |name, text| LayerLaw {
        name,
        text,
        interface: false,
        constants: Lame::new(young, poisson),
        in_plane: "",
    };
    let oriented = format!(
        "layer = {{ law = \"oriented_mohr_coulomb\", parameters = {{ young_modulus = {young}, \
         poisson_ratio = {poisson}, cohesion = 1e3, friction_angle = 30.0, \
         dilatancy_angle = 5.0 }} }}"
    );
    let joint = format!(
        "layer = {{ law = \"coulomb_joint\", parameters = {{ normal_stiffness = {K_N}, \
         shear_stiffness = {K_T}, cohesion = 1e3, friction_angle = 30.0, dilatancy_angle = 5.0, \
         tensile_strength = 1e3 }} }}"
    );
    // σ_ni = 100 kPa and n = 1/2 multiply the stiffnesses by 10.
    let mepi = format!(
        "layer = {{ law = \"mepi\", parameters = {{ k_n = {}, k_t = {}, n = 0.5, mu_0 = 0.4, \
         mu_p = 0.7, mu_c0 = 0.46, a = 0.008, c_0 = 40.0, t = {T}, p_0 = 100.0, \
         sigma_ni = 100.0 }} }}",
        K_N / 10.0,
        K_T / 10.0
    );
    // M = K_n t, G = K_t t.
    let elastic_layer = Lame {
        lambda: (K_N - 2.0 * K_T) * T,
        shear: K_T * T,
        oedometric: K_N * T,
    };
    let none = Lame {
        lambda: 0.0,
        ..elastic_layer
    };
    let interface = |name, text: &str, in_plane, constants| LayerLaw {
        name,
        text: text.to_owned(),
        interface: true,
        constants,
        in_plane,
    };
    vec![
        continuum("elastic", elastic("layer", young, poisson)),
        continuum("oriented_mohr_coulomb", oriented),
        interface("coulomb_joint", &joint, "elastic", elastic_layer),
        interface("coulomb_joint, in_plane none", &joint, "none", none),
        interface("mepi", &mepi, "elastic", elastic_layer),
        interface("mepi, in_plane none", &mepi, "none", none),
    ]
}

impl LayerLaw {
    fn group(&self, integration: &str) -> String {
        let in_plane = match self.in_plane {
            "" => String::new(),
            value => format!(", in_plane = \"{value}\""),
        };
        format!(
            "layer = {{ formulation = \"thin_layer\", integration = \"{integration}\", \
             law = \"layer\"{in_plane} }}\n"
        )
    }
}

/// Stress (along, across, out of plane, shear) of a layer with these constants.
fn stress_in(
    constants: Lame,
    no_in_plane: bool,
    [s, t]: [f64; 2],
    [along, out]: [f64; 2],
) -> ([f64; 4], [f64; 2]) {
    let Lame {
        lambda,
        shear,
        oedometric,
    } = constants;
    let across = (s - lambda * (along + out)) / oedometric;
    let in_plane = |own: f64, other: f64| {
        if no_in_plane {
            0.0
        } else {
            oedometric * own + lambda * (other + across)
        }
    };
    (
        [in_plane(along, out), s, in_plane(out, along), t],
        [across, t / shear],
    )
}

/// A laminate of ground 1, layer, ground 2 under stresses S, T and strains along it.
fn laminate(analysis: &str, normal: Normal, law: &LayerLaw, integration: &str, shear_stress: f64) {
    let grounds = [(20e3, 0.3), (35e3, 0.15)];
    let laws = format!(
        "{}{}{}",
        elastic("ground_1", grounds[0].0, grounds[0].1),
        elastic("ground_2", grounds[1].0, grounds[1].1),
        law.text
    );
    let traction = [-90.0, shear_stress];
    let along = 0.4e-3;
    let out = if analysis == "axisymmetric" {
        along
    } else {
        0.0
    };
    let no_in_plane = law.in_plane == "none";
    let layers = [
        stress_in(
            Lame::new(grounds[0].0, grounds[0].1),
            false,
            traction,
            [along, out],
        ),
        stress_in(law.constants, no_in_plane, traction, [along, out]),
        stress_in(
            Lame::new(grounds[1].0, grounds[1].1),
            false,
            traction,
            [along, out],
        ),
    ];
    let field = |p: [f64; 2]| {
        let [s, n] = normal.turn(p);
        let mut u = [along * s, 0.0];
        for (i, (_, [across, gamma])) in layers.iter().enumerate() {
            let height = (n.min(ACROSS[i + 1]) - ACROSS[i]).max(0.0);
            u[0] += gamma * height;
            u[1] += across * height;
        }
        normal.turn(u)
    };
    let key = match normal {
        Normal::X => "x",
        Normal::Y => "y",
    };
    let region = |group: &str, i: usize| {
        format!(
            "[[mesh.region]]\ngroup = \"{group}\"\n{key} = [{:?}, {:?}]\n",
            ACROSS[i],
            ACROSS[i + 1]
        )
    };
    let regions = region("ground_1", 0) + &region("layer", 1) + &region("ground_2", 2);
    let groups = format!(
        "ground_1 = {{ formulation = \"solid\", integration = \"full\", law = \"ground_1\" }}\n\
         ground_2 = {{ formulation = \"solid\", integration = \"full\", law = \"ground_2\" }}\n{}",
        law.group(integration)
    );
    let (x, y) = match normal {
        Normal::X => (&ACROSS, &ALONG),
        Normal::Y => (&ALONG, &ACROSS),
    };
    let (lines, phases) = boundary_nodes(x, y, &field);
    let patch = Patch {
        analysis,
        x,
        y,
        regions: &regions,
        laws: &laws,
        groups: &groups,
        lines: &lines,
        phases: &phases,
    };
    let (layer_stress, [across, gamma]) = layers[1];
    // A law for interfaces sees t (ε_n + κ (ε_m + ε_θ)), equations (4), (18), (19); the jump of
    // a layer with a continuum law is its strain times its thickness.
    let opening = if law.interface {
        traction[0] / K_N
    } else {
        across * T
    };
    let what = format!("{}, {analysis}, normal {normal:?}, {integration}", law.name);
    patch.assert(
        &what,
        &[
            Expected::stress("ground_1", normal.turn_stress(layers[0].0)),
            Expected::stress("layer", normal.turn_stress(layer_stress)),
            Expected::interface("layer", traction, [opening, gamma * T]),
            Expected::stress("ground_2", normal.turn_stress(layers[2].0)),
        ],
    );
}

#[test]
fn laminate_in_plane_strain() {
    for law in layer_laws() {
        for integration in INTEGRATION {
            for normal in Normal::BOTH {
                laminate("plane_strain", normal, &law, integration, 25.0);
            }
        }
    }
}

#[test]
fn horizontal_laminate_on_the_axis() {
    // Constant shear stress on a horizontal plane is no equilibrium around an axis.
    for law in layer_laws() {
        for integration in INTEGRATION {
            laminate("axisymmetric", Normal::Y, &law, integration, 0.0);
        }
    }
}

/// A layer as stiff as the ground around it that ends inside: the strain is the same everywhere.
fn homogeneous(analysis: &str, normal: Normal, interface: bool, integration: &str) {
    // K_n t and K_t t are the ground's moduli.
    let (young, poisson) = (6e3, 0.25);
    let ground = Lame::new(young, poisson);
    let [k_n, k_t] = [ground.oedometric / T, ground.shear / T];
    let layer = if interface {
        format!(
            "layer = {{ law = \"coulomb_joint\", parameters = {{ normal_stiffness = {k_n}, \
             shear_stiffness = {k_t}, cohesion = 1e3, friction_angle = 30.0, \
             dilatancy_angle = 0.0 }} }}"
        )
    } else {
        elastic("layer", young, poisson)
    };
    let axisymmetric = analysis == "axisymmetric";
    let a = if axisymmetric {
        [[-3.0e-3, 0.0], [0.0, 1.0e-3]]
    } else {
        [[-3.0e-3, 1.2e-3], [-0.5e-3, -2.0e-3]]
    };
    let hoop = if axisymmetric { a[0][0] } else { 0.0 };
    let volume = a[0][0] + a[1][1] + hoop;
    let normal_stress = |e: f64| ground.lambda * volume + 2.0 * ground.shear * e;
    let stress = [
        normal_stress(a[0][0]),
        normal_stress(a[1][1]),
        normal_stress(hoop),
        ground.shear * (a[0][1] + a[1][0]),
    ];
    // With one point across a vertical layer, ∫ N r is exact but for t/(6 r) = 0.3 % of the moment
    // of the vertical stress over the layer's end.
    let tolerance = if axisymmetric && normal == Normal::X && integration == "mean" {
        2e-4
    } else {
        PATCH
    };
    // Grid lines around the layer, 1.0 to 1.02 across, along from 0.8 or up to there.
    let r_0 = if axisymmetric { 0.5 } else { 0.0 };
    let across = [r_0, 1.0, 1.0 + T, 2.0];
    let along = [r_0, 0.8, 0.9, 3.0];
    let (x, y) = match normal {
        Normal::X => (&across, &along),
        Normal::Y => (&along, &across),
    };
    let field = |[x, y]: [f64; 2]| [a[0][0] * x + a[0][1] * y, a[1][0] * x + a[1][1] * y];
    let (lines, phases) = boundary_nodes(x, y, &field);
    for [from, to] in [
        [along[1], along[3]],
        [along[0], along[2]],
        [along[1], along[2]],
    ] {
        let region = match normal {
            Normal::X => format!("x = [1.0, {:?}]\ny = [{from:?}, {to:?}]\n", 1.0 + T),
            Normal::Y => format!("y = [1.0, {:?}]\nx = [{from:?}, {to:?}]\n", 1.0 + T),
        };
        let axis = if normal == Normal::X { "x" } else { "y" };
        let patch = Patch {
            analysis,
            x,
            y,
            regions: &format!(
                "[[mesh.region]]\ngroup = \"ground\"\n[[mesh.region]]\ngroup = \"layer\"\n{region}"
            ),
            laws: &format!("{}{layer}", elastic("ground", young, poisson)),
            groups: &format!(
                "ground = {{ formulation = \"solid\", integration = \"full\", law = \"ground\" }}\n\
                 layer = {{ formulation = \"thin_layer\", normal = \"{axis}\", \
                 integration = \"{integration}\", law = \"layer\" }}\n"
            ),
            lines: &lines,
            phases: &phases,
        };
        let what = format!(
            "{analysis}, normal {normal:?}, {integration}, interface law {interface}, \
             layer from {from} to {to}"
        );
        patch.assert(
            &what,
            &["ground", "layer"].map(|group| Expected::stress(group, stress).within(tolerance)),
        );
    }
}

#[test]
fn layer_that_ends_inside_the_ground() {
    for analysis in ["plane_strain", "axisymmetric"] {
        for normal in Normal::BOTH {
            for integration in INTEGRATION {
                homogeneous(analysis, normal, false, integration);
                homogeneous(analysis, normal, true, integration);
            }
        }
    }
}
