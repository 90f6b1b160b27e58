//! Thick cylinder under pressure from inside, for tests of what happens on the way to its limit.
//!
//! Elastic and plastic answers are held against closed forms in `verification`.
//!
//! ```text
//!   axis     a          b = 2 a
//!   │        ├──────────┤
//!   │    p → │          │   height 0.4
//!   │        ├──────────┤
//! ```
//!
//! Boundary    u_z = 0 above and below; pressure, or displacement, of the inner wall.

const A: f64 = 1.0;
pub(crate) const B: f64 = 2.0;
const HEIGHT: f64 = 0.4;
const YOUNG: f64 = 30e3;
const POISSON: f64 = 0.3;

pub(crate) fn text(law: &str, n: usize, integration: &str, phase: &str, probes: &str) -> String {
    format!(
        r#"
analysis = "axisymmetric"
supports = [{{ line = "top", fixed = ["z"] }}, {{ line = "bottom", fixed = ["z"] }}]
[mesh]
origin = [{A:?}, 0.0]
columns = [{{ n = {n}, to = {B:?} }}]
rows = [{{ n = 1, to = {HEIGHT} }}]
region = [{{ group = "ground" }}]
lines = {{ inner = {{ r = {A:?} }}, outer = {{ r = {B:?} }}, top = {{ z = {HEIGHT} }}, bottom = {{ z = 0.0 }} }}
[laws]
{law}
[groups]
ground = {{ formulation = "solid", integration = "{integration}", law = "ground" }}
[[phase]]
name = "load"
{phase}
[probes]
inner = {{ line = "inner", quantity = "displacement_r" }}
outer = {{ line = "outer", quantity = "displacement_r" }}
force = {{ line = "inner", quantity = "reaction_r" }}
{probes}
"#
    )
}

/// Ground of cohesion c and friction φ, in σ_1 = N σ_3 + Y (compression positive).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strength {
    n: f64,
    y: f64,
}

impl Strength {
    pub(crate) fn new(cohesion: f64, friction_angle: f64) -> Self {
        let (sin, cos) = friction_angle.to_radians().sin_cos();
        Self {
            n: (1.0 + sin) / (1.0 - sin),
            y: 2.0 * cohesion * cos / (1.0 - sin),
        }
    }

    /// Pressure at the inner wall when the ground has yielded up to ρ.
    ///
    /// Outside, σ_r = D (b²/r² − 1), σ_θ = −D (b²/r² + 1), and D follows from yielding at ρ.
    /// Inside, equilibrium r σ_r' + σ_r − σ_θ = 0 with σ_θ = (σ_r − Y)/N gives
    /// σ_r + Y/(N − 1) ∝ r^(1/N − 1); for N = 1, σ_r falls by Y ln r.
    pub(crate) fn pressure(self, radius: f64) -> f64 {
        let Self { n, y } = self;
        let outer = (B / radius).powi(2);
        let at_radius = y * (outer - 1.0) / ((n + 1.0) * outer + n - 1.0);
        if n > 1.0 {
            let shift = y / (n - 1.0);
            (at_radius + shift) * (radius / A).powf(1.0 - 1.0 / n) - shift
        } else {
            at_radius + y * (radius / A).ln()
        }
    }

    /// The radius up to which the ground has yielded, from the displacement of the outer wall:
    /// u_b = 2 D b (1 − ν²)/E. At least a, at most b.
    pub(crate) fn radius(self, outer_displacement: f64) -> f64 {
        let Self { n, y } = self;
        let d = outer_displacement * YOUNG / (2.0 * B * (1.0 - POISSON * POISSON));
        let outer = (y / d - (n - 1.0)) / (n + 1.0);
        (B / outer.sqrt()).clamp(A, B)
    }
}

/// The case of a cylinder that is pressed from inside.
pub(crate) fn pressing(cohesion: f64, angles: [f64; 2], n: usize, integration: &str) -> String {
    let law = format!(
        "ground = {{ law = \"mohr_coulomb\", parameters = {{ young_modulus = {YOUNG:?}, \
         poisson_ratio = {POISSON}, cohesion = {cohesion:?}, friction_angle = {:?}, \
         dilatancy_angle = {:?} }} }}",
        angles[0], angles[1]
    );
    let load = "increments = 40\ndisplacement = [{ line = \"inner\", r = 0.02 }]";
    text(&law, n, integration, load, "")
}
