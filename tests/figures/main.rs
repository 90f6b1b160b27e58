//! The figures in `cases/` are those that the cases draw. Every case is run, which takes about a
//! minute, so the test is asked for by name:
//!
//! ```sh
//! cargo test --release -p tests --test figures                  # compares
//! PILUM_BLESS=1 cargo test --release -p tests --test figures    # rewrites those that differ
//! ```
#![allow(clippy::unwrap_used, clippy::panic, reason = "these are tests")]

use input::{Case, Kind};
use results::Figures;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use tests::case::Silent;
use tests::figure::{alike, bless};

/// An input file in `cases/`; one of its variants, or `-` for all of them together; what the committed files are
/// called, `*` standing for the figure; the figures.
const COMMITTED: &str = "
calibrate_mepi/calibration.toml - * fit_traction_t_over_u_t fit_u_n_over_u_t prediction_u_n_over_u_t
calibrate_mepi/calibration.toml - * profile_a
calibrate_stiffness/calibration.toml - * fit_sigma_n_over_u_t prediction_traction_t_over_u_t
calibrate_pile/calibration.toml - * fit_pile_head_load_over_pile_settlement
calibrate_pile/calibration.toml - * fit_gauge_2_over_pile_settlement profile_shear_stiffness
bored_pile/case.toml - * loads axial_force
textbook_pile/case.toml - * loads axial_force
hardening_piles/bored.toml - * bored_loads
hardening_piles/textbook.toml - * textbook_loads
hardening_piles/measured.toml - * load_settlement
hardening_soil_tests/triaxial.toml - * triaxial
hardening_soil_tests/oedometer.toml - * oedometer
hardening_soil_tests/undrained.toml - * undrained
calibrate_hardening_soil/calibration.toml - * fit_stress_22_over_strain_22
calibrate_hardening_soil/calibration.toml - * fit_strain_11_over_strain_22
tension_pile/case.toml - * loads axial_force
cyclic_head_load/case.toml - * loads axial_force
residual_stress/case.toml - * loads axial_force
footing/case.toml - * bearing_capacity
measured_pile_oneill/case.toml - * load_settlement
measured_interface_praai/driver.toml - * shear_stress normal_stress
measured_interface_praai/state.toml - * cycles_normal_stress cycles_slip
settling_clay_pile/case.toml floating *_floating axial_force
settling_clay_pile/case.toml on_rock *_on_rock axial_force
settling_clay_pile/case.toml floating * shaft_friction
belled_pile/case.toml pushed * loads axial_force
raft_pile/case.toml clay * shares contact_pressure
pushed_pulled_pile/case.toml - * loads
energy_pile/case.toml - * axial_force
aspect_ratio/case.toml - aspect_ratio_* tau u_n
aspect_ratio/joint.toml - joint_* tau
aspect_ratio/constant_volume.toml - constant_volume_* tau sigma_n
aspect_ratio/constant_volume_joint.toml - constant_volume_joint_* sigma_n
aspect_ratio/constant_modulus.toml - constant_modulus_* sigma_n
chamber_confinement/case.toml - * k_0_a k_0_b k_0_c
chamber_instability/case.toml - * normal_stress
chamber_interface_model/case.toml - * friction normal_stress
chamber_interface_model/dilating.toml - *_dilating friction normal_stress
chamber_loading/case.toml - * friction lateral_pressure
chamber_loading/case.toml dilating * loads friction_along_shaft normal_stress_along_shaft settlement
chamber_mesh/case.toml - * head_load normal_stress friction_along_shaft normal_stress_along_shaft
chamber_mesh1/case.toml - * mobilisation loads
chamber_soil_law/case.toml - * friction normal_stress toe_load
joint_laws/hyperbolic.toml - * hyperbolic_tau
joint_laws/cyclic.toml - * cyclic_tau cyclic_sigma_n
joint_laws/load_transfer.toml - * load_transfer_tau
shear_box/fontainebleau.toml - * fontainebleau_tau fontainebleau_mu fontainebleau_u_n
shear_box/fontainebleau_softening.toml - * softening_tau softening_mu softening_u_n
shear_box/silica.toml - * silica_tau silica_mu silica_sigma_n silica_u_n
shear_zone/mohr_coulomb.toml - mohr_coulomb_* tau u_n
";

/// Input file, variant, committed file, and figure, of each.
fn committed() -> impl Iterator<Item = (&'static str, &'static str, PathBuf, &'static str)> {
    COMMITTED.lines().skip(1).flat_map(|row| {
        let words: Vec<&str> = row.split(' ').collect();
        let (input, variant) = (words[0], words[1].trim_matches('-'));
        let files = words[3..].iter().map(|figure| {
            let name = format!("{}.svg", words[2].replace('*', figure));
            (
                input,
                variant,
                cases().join(input).with_file_name(name),
                *figure,
            )
        });
        files.collect::<Vec<_>>()
    })
}

fn cases() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases")
}

/// Pictures in the folders of the cases. Those of `trade_off` show measured times, which no run
/// repeats; the test target of that name draws them.
fn pictures() -> BTreeSet<PathBuf> {
    let entries = |folder: &Path| {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().path())
    };
    entries(&cases())
        .filter(|path| path.is_dir() && !path.ends_with("trade_off"))
        .flat_map(|folder| entries(&folder))
        .filter(|path| path.extension().is_some_and(|ending| ending == "svg"))
        .collect()
}

/// Draws the figures of an input file as the program does: those of a variant into a separate
/// folder, those over all variants next to these folders.
fn draw(input: &str) -> TempDir {
    let place = TempDir::new().unwrap();
    let path = cases().join(input);
    if input.starts_with("calibrate_") {
        let options = runs::calibration::Options {
            variant: None,
            settings: Vec::new(),
            out: Some(place.path().to_owned()),
            stop: law::Stop::never(),
            opener: law::Opener::default(),
            anew: false,
        };
        runs::calibration::run(&path, &options, &mut |_| (), &mut |_| ()).unwrap();
        return place;
    }
    if input::is_driver(&path).unwrap() {
        tests::driver::run(&path, None, Some(&place.path().join("rows.csv")), |_| ()).unwrap();
        return place;
    }
    let mut drawn = Vec::new();
    for case in Case::load(&path).unwrap() {
        let variant = case.variant.clone().unwrap_or_default();
        let folder = place.path().join(&variant);
        match runs::run::run(&case, &folder, &mut Silent::default()) {
            Ok(figures) => drawn.push((variant, figures)),
            Err(error) if error.kind() == Kind::NoEquilibrium => (),
            Err(error) => panic!("{input}, {variant}: {error}"),
        }
    }
    if drawn.len() > 1 {
        Figures::draw_overlaid(place.path(), &drawn).unwrap();
    }
    place
}

#[test]
fn every_figure_has_its_case() {
    let named = committed().map(|(_, _, file, _)| file);
    assert_eq!(named.collect::<BTreeSet<_>>(), pictures());
}

#[test]
fn the_committed_figures_are_those_of_the_cases() {
    let mut places: BTreeMap<&str, TempDir> = BTreeMap::new();
    let mut differing = Vec::new();
    for (input, variant, file, figure) in committed() {
        let place = places.entry(input).or_insert_with(|| draw(input));
        let drawn = place.path().join(variant).join(format!("{figure}.svg"));
        let drawn = std::fs::read_to_string(drawn).unwrap();
        let committed = std::fs::read_to_string(&file).unwrap_or_default();
        if alike(&committed, &drawn) {
            continue;
        }
        if bless() {
            std::fs::write(file, drawn).unwrap();
        } else {
            differing.push(file);
        }
    }
    assert!(
        differing.is_empty(),
        "figures differ from what the cases draw: {differing:#?}\nrewrite them with: \
         PILUM_BLESS=1 cargo test --release -p tests --test figures"
    );
}

#[test]
fn figures_a_point_apart_are_alike() {
    let figure = "<polyline points=\"10,20 30,40 \"/><text>1.5</text>";
    assert!(alike(figure, &figure.replace("20", "21")));
    assert!(!alike(figure, &figure.replace("20", "22")));
    assert!(!alike(figure, &figure.replace("1.5", "1.6")));
    assert!(!alike(figure, &figure.replace("30,40 ", "")));
}
