//! Modified Cam-clay of `models/foreign`, in C++ and in Fortran, by what their helpers offer.
//!
//! Goal        a law with an initial state, a choice, optional parameters and a tangent by
//!             differences can be written in either language, and answers as closed forms say.
//! Set-up      random paths in three dimensions; isotropic compression; shear at constant volume.
//! Asserts     both languages alike to round-off; normal compression line, critical state,
//!             undrained strength, elastic shear; `pilum check` passes.

use crate::compilers::{library, repository};
use crate::program::pilum;
use abi::Hypothesis;
use law::{End, Law, Operator, SearchPath, Start, Strided};
use std::path::Path;
use tempfile::TempDir;

const LAWS: [(&str, &str); 2] = [("cpp", "cam_clay_cpp"), ("f90", "cam_clay_fortran")];

/// λ, κ, M, `e_0`, choice of shear, ν, G, OCR.
type Parameters = [f64; 8];
const CLAY: Parameters = [0.2, 0.04, 1.1, 1.0, 0.0, 0.3, f64::NAN, f64::NAN];
const LAMBDA: f64 = CLAY[0];
const KAPPA: f64 = CLAY[1];
const M: f64 = CLAY[2];
const V: f64 = 1.0 + CLAY[3];

/// The libraries that can be compiled here, in a folder, with the ids of their laws.
fn compiled() -> (TempDir, Vec<&'static str>) {
    let folder = TempDir::new().unwrap();
    let built = LAWS.into_iter().filter(|(suffix, id)| {
        let source = repository(&format!("models/foreign/cam_clay.{suffix}"));
        library(&source, id, folder.path()).is_some()
    });
    let ids = built.map(|(_, id)| id).collect();
    (folder, ids)
}

fn law(id: &str, folder: &Path, parameters: &Parameters) -> Law {
    let search = SearchPath::new(&[folder.to_owned()]);
    let law = search.law(id).unwrap();
    law.build(Hypothesis::ThreeD, parameters).unwrap()
}

/// A point in three dimensions.
#[derive(Clone, Debug)]
struct Point {
    strain: [f64; 6],
    stress: [f64; 6],
    /// Preconsolidation pressure, void ratio.
    state: Vec<f64>,
    tangent: [f64; 36],
}

impl Point {
    fn start(law: &Law, stress: [f64; 6]) -> Self {
        let state = law.initial_state(1, (&stress, Strided::rows(6))).unwrap();
        Self {
            strain: [0.0; 6],
            stress,
            state,
            tangent: [0.0; 36],
        }
    }

    /// Moves by a strain increment.
    fn step(&mut self, law: &Law, increment: &[f64; 6]) {
        let end: [f64; 6] = std::array::from_fn(|i| self.strain[i] + increment[i]);
        let (stress, state) = (self.stress, self.state.clone());
        let start = Start {
            n_points: 1,
            gradient: (&self.strain, Strided::rows(6)),
            gradient_end: (&end, Strided::rows(6)),
            flux: (&stress, Strided::rows(6)),
            state: &state,
            time: 0.0,
            time_increment: 1.0,
            moment: law::Moment::default(),
            sites: &[],
        };
        let into = End {
            flux: (&mut self.stress, Strided::rows(6)),
            state: &mut self.state,
            operator: &mut self.tangent,
        };
        law.integrate(&start, Operator::Consistent, into).unwrap();
        self.strain = end;
    }

    /// Mean stress, compression positive, and deviatoric stress.
    fn invariants(&self) -> (f64, f64) {
        let s = &self.stress;
        let p = -(s[0] + s[1] + s[2]) / 3.0;
        let normal: f64 = s[..3].iter().map(|x| 1.5 * (x + p).powi(2)).sum();
        let shear: f64 = s[3..].iter().map(|x| 3.0 * x * x).sum();
        (p, (normal + shear).sqrt())
    }
}

const fn isotropic(p: f64) -> [f64; 6] {
    [-p, -p, -p, 0.0, 0.0, 0.0]
}

/// Compression along 1 at constant volume.
fn undrained(size: f64) -> [f64; 6] {
    [-size, 0.5 * size, 0.5 * size, 0.0, 0.0, 0.0]
}

fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    tests::tolerance::close(what, found, expected, tolerance * expected.abs());
}

/// Fluxes and states to round-off, through two hundred increments that add it up; tangents to that
/// of differences.
#[test]
fn both_languages_answer_alike() {
    let (folder, ids) = compiled();
    let [first, second] = ids[..] else { return };
    let mut seed = 3_u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let with = |choice: f64, modulus: f64, ratio: f64| {
        let [lambda, kappa, m, void_ratio, _, nu, _, _] = CLAY;
        [lambda, kappa, m, void_ratio, choice, nu, modulus, ratio]
    };
    let mut plastic = 0;
    for parameters in [
        CLAY,
        with(0.0, f64::NAN, 4.0),
        with(1.0, 5e3, 1.5),
        with(1.0, 2e4, 9.0),
    ] {
        let laws = [first, second].map(|id| law(id, folder.path(), &parameters));
        let start = [-100.0, -150.0, -120.0, 10.0, -5.0, 20.0];
        let mut points = [0, 1].map(|i| Point::start(&laws[i], start));
        let mut direction = [0.0; 6];
        for k in 0..200 {
            if k % 10 == 0 {
                direction = std::array::from_fn(|_| 2e-4 * random());
            }
            let before = points[0].state[0];
            for (point, law) in points.iter_mut().zip(&laws) {
                point.step(law, &direction);
            }
            plastic += usize::from(points[0].state[0].to_bits() != before.to_bits());
            let [a, b] = &points;
            let differs = |a: &[f64], b: &[f64]| {
                let largest = a.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
                let pairs = a.iter().zip(b).map(|(x, y)| (x - y).abs());
                pairs.fold(0.0, f64::max) / largest
            };
            let error = [
                differs(&a.stress, &b.stress),
                differs(&a.state, &b.state),
                differs(&a.tangent, &b.tangent),
            ];
            assert!(
                error[0] < 1e-11 && error[1] < 1e-11 && error[2] < 1e-8,
                "{parameters:?}, increment {k}: {error:?}"
            );
        }
    }
    assert!(plastic > 50, "{plastic} plastic increments");
}

/// Along the normal compression line e = `e_0` − λ ln(p/`p_0`), down the swelling line with κ.
#[test]
fn isotropic_compression_follows_the_two_lines() {
    let (folder, ids) = compiled();
    for id in ids {
        let law = law(id, folder.path(), &CLAY);
        let mut point = Point::start(&law, isotropic(100.0));
        close(point.state[0], 100.0, 1e-14, "p_c at the start");
        for _ in 0..50 {
            point.step(&law, &isotropic(1e-3));
        }
        let (p, q) = point.invariants();
        close(p, 100.0 * (V * 0.15 / LAMBDA).exp(), 1e-11, id);
        assert!(q < 1e-9 * p, "{id}: q = {q}");
        close(
            point.state[1],
            CLAY[3] - LAMBDA * (p / 100.0).ln(),
            1e-11,
            id,
        );
        let preconsolidation = point.state[0];
        close(preconsolidation, p, 1e-12, id);
        for _ in 0..10 {
            point.step(&law, &isotropic(-1e-3));
        }
        let (swollen, _) = point.invariants();
        close(swollen, p * (-V * 0.03 / KAPPA).exp(), 1e-11, id);
        close(point.state[0], preconsolidation, 1e-14, id);
    }
}

/// At constant volume q/p ends at M, and p where the two lines say: `p_f` = `p_0` (OCR/2)^Λ with
/// Λ = 1 − κ/λ. OCR = 2 starts at the critical state's pressure.
#[test]
fn undrained_shear_ends_at_the_critical_state() {
    let (folder, ids) = compiled();
    for id in ids {
        for ratio in [f64::NAN, 1.2, 2.0, 8.0] {
            let mut parameters = CLAY;
            parameters[7] = ratio;
            let law = law(id, folder.path(), &parameters);
            let mut point = Point::start(&law, isotropic(100.0));
            let ocr = if ratio.is_nan() { 1.0 } else { ratio };
            close(point.state[0], 100.0 * ocr, 1e-14, "p_c at the start");
            for _ in 0..400 {
                point.step(&law, &undrained(2e-3));
            }
            let (p, q) = point.invariants();
            let expected = 100.0 * (ocr / 2.0).powf(1.0 - KAPPA / LAMBDA);
            let what = format!("{id}, OCR {ocr}");
            close(p, expected, 1e-9, &what);
            close(q / p, M, 1e-9, &what);
            // The strength of a triaxial test: half the difference of the principal stresses.
            let strength = 0.5 * (point.stress[1] - point.stress[0]);
            close(strength, 0.5 * M * expected, 1e-9, &what);
        }
    }
}

/// The choice `shear_modulus`: before yield q = 3 G ε, whatever the pressure; without the modulus,
/// or with κ above λ, the parameters are refused at their names.
#[test]
fn the_choice_of_shear_stiffness_is_kept() {
    let (folder, ids) = compiled();
    for id in ids {
        let mut parameters = CLAY;
        (parameters[4], parameters[6], parameters[7]) = (1.0, 7e3, 5.0);
        let law = law(id, folder.path(), &parameters);
        let mut point = Point::start(&law, isotropic(100.0));
        for _ in 0..4 {
            point.step(&law, &undrained(5e-4));
        }
        close(point.invariants().1, 3.0 * 7e3 * 2e-3, 1e-12, id);
        let loaded = SearchPath::new(&[folder.path().to_owned()])
            .law(id)
            .unwrap();
        let refused = |parameters: &Parameters| {
            let failure = loaded.build(Hypothesis::ThreeD, parameters).unwrap_err();
            assert!(!failure.library_at_fault, "{failure:?}");
            failure.reason
        };
        parameters[6] = f64::NAN;
        assert!(refused(&parameters).contains("shear_modulus"));
        parameters = CLAY;
        parameters[1] = 0.3;
        assert!(refused(&parameters).contains("swelling_index"));
    }
}

#[test]
fn the_law_passes_the_checks_in_both_languages() {
    let (folder, ids) = compiled();
    for id in ids {
        let file = format!(
            "./{}{id}{}",
            std::env::consts::DLL_PREFIX,
            std::env::consts::DLL_SUFFIX
        );
        pilum(folder.path(), &["check", &file]).ended(0);
    }
}
