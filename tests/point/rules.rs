//! The rules of the driver.
//!
//! Goal        each rule of the file format and the table, one by one.
//! Set-up      the shortest driver that shows it.
//! Law         elastic, coulomb_joint, mepi, mohr_coulomb.
//! Asserts     values, warnings, exit codes, files.

use crate::driver::{MEPI, attempt, csv, follow};
use approx::assert_relative_eq;
use runs::point::PointReport;
use std::fs;
use std::path::Path;
use std::path::PathBuf;
use tests::words::has;

const ELASTIC: &str = "[parameters]\nyoung_modulus = 1e5\npoisson_ratio = 0.25\n";
const JOINT: &str = "law = 'coulomb_joint'\nhypothesis = 'interface_2d'\n[parameters]\n\
    normal_stiffness = 1e6\nshear_stiffness = 4e5\ncohesion = 5\nfriction_angle = 35\n\
    dilatancy_angle = 13.5\n";

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| v.to_bits()).collect()
}

/// An empty folder for one test.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("pilum_point_{name}_{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

#[test]
fn components_without_control_keep_their_traction() {
    let run = follow(&format!(
        "{JOINT}[initial]\ntraction = {{ n = -100, t = 20 }}\n[[segment]]\nincrements = 3\n\
         control = {{ n = {{ jump = -1e-4 }} }}\n[[segment]]\nincrements = 3\n\
         control = {{ t = {{ jump = -1e-4 }} }}"
    ));
    for k in 0..=3 {
        assert_relative_eq!(run.at(k, "traction_t"), 20.0, max_relative = 1e-9);
    }
    // From 100 kPa by 1e6 kPa/m × 0.1 mm to 200 kPa, which then stay.
    for k in 3..=6 {
        assert_relative_eq!(run.at(k, "traction_n"), -200.0, max_relative = 1e-9);
    }
}

#[test]
fn missing_initial_components_are_zero_and_gradients_start_at_zero() {
    for initial in [
        "",
        "[initial]\n",
        "[initial]\nstress = {}\n",
        "[initial]\nstress = { 22 = -7 }\n",
    ] {
        let run = follow(&format!(
            "law = 'elastic'\nhypothesis = '3d'\n{ELASTIC}{initial}[[segment]]\nincrements = 1\ncontrol = {{}}"
        ));
        for c in ["11", "22", "33", "12", "13", "23"] {
            let given = if c == "22" && initial.contains("-7") {
                -7.0
            } else {
                0.0
            };
            assert_eq!(
                run.at(0, &format!("stress_{c}")).to_bits(),
                f64::to_bits(given)
            );
            assert_eq!(run.at(0, &format!("strain_{c}")).to_bits(), 0);
        }
    }
}

#[test]
fn controls_ramp_linearly_to_totals_and_end_on_them_exactly() {
    let run = follow(&format!(
        "{JOINT}[initial]\ntraction = {{ n = -100 }}\n[[segment]]\nincrements = 7\n\
         control = {{ t = {{ jump = 0.1e-3 }}, n = {{ traction = -170 }} }}\n[[segment]]\n\
         increments = 3\ncontrol = {{ t = {{ jump = 0.4e-3 }} }}"
    ));
    for k in 0..=7_u32 {
        let part = f64::from(k) / 7.0;
        assert_relative_eq!(
            run.at(k as usize, "jump_t"),
            0.1e-3 * part,
            max_relative = 1e-15
        );
        let normal = -100.0 - 70.0 * part;
        assert_relative_eq!(
            run.at(k as usize, "traction_n"),
            normal,
            max_relative = 1e-9
        );
    }
    assert_eq!(run.at(7, "jump_t").to_bits(), 0.1e-3_f64.to_bits());
    assert_relative_eq!(run.at(8, "jump_t"), 0.2e-3, max_relative = 1e-15);
    assert_eq!(run.at(10, "jump_t").to_bits(), 0.4e-3_f64.to_bits());
}

#[test]
fn prescribed_gradients_gather_no_round_off() {
    let run = follow(&format!(
        "law = 'elastic'\nhypothesis = '3d'\n{ELASTIC}[[segment]]\nincrements = 9999\n\
         control = {{ 12 = {{ strain = 0.3 }} }}\n[[segment]]\nincrements = 9999\n\
         control = {{ 12 = {{ strain = 0.1 }} }}"
    ));
    let strain = run.column("strain_12");
    assert_eq!(
        strain[3333].to_bits(),
        (0.3_f64 * (3333.0 / 9999.0)).to_bits()
    );
    assert_eq!(bits(&[strain[9999], strain[19998]]), bits(&[0.3, 0.1]));
}

#[test]
fn stiffness_counts_the_jump_from_the_start_of_the_segment() {
    let run = follow(&format!(
        "{JOINT}[initial]\ntraction = {{ n = -100 }}\n[[segment]]\nincrements = 2\n\
         control = {{ n = {{ jump = -5e-5 }} }}\n[[segment]]\nincrements = 20\n\
         control = {{ t = {{ jump = 2e-3 }}, n = {{ stiffness = 3e5 }} }}"
    ));
    for k in 2..=22 {
        let spring = -150.0 - 3e5 * (run.at(k, "jump_n") + 5e-5);
        assert_relative_eq!(run.at(k, "traction_n"), spring, max_relative = 1e-9);
    }
    assert!(run.last("jump_n") > 1e-5, "it dilates against the spring");
}

#[test]
fn all_components_can_be_controlled_under_axial_symmetry() {
    let run = follow(&format!(
        "law = 'elastic'\nhypothesis = 'axisymmetric'\n{ELASTIC}[[segment]]\nincrements = 2\ncontrol = \
         {{ 11 = {{ strain = 1e-3 }}, 22 = {{ stress = 50 }}, 33 = {{ strain = -2e-3 }}, 12 = {{ stress = 8 }} }}"
    ));
    // λ = G = 4e4 kPa. σ_22 = λ (ε_11 + ε_22 + ε_33) + 2G ε_22 = 50 kPa.
    let axial = (50.0 + 4e4 * 1e-3) / 12e4;
    assert_relative_eq!(run.last("strain_22"), axial, max_relative = 1e-12);
    assert_relative_eq!(run.last("strain_12"), 8.0 / 4e4, max_relative = 1e-12);
}

#[test]
fn plane_strain_holds_the_strain_out_of_plane_at_zero() {
    for control in ["", ", 33 = { strain = 0.0 }", ", 33 = { strain = 0 }"] {
        let run = follow(&format!(
            "law = 'elastic'\nhypothesis = 'plane_strain'\n{ELASTIC}[initial]\nstress = {{ 33 = -9 }}\n\
             [[segment]]\nincrements = 3\ncontrol = {{ 22 = {{ strain = -1e-3 }}{control} }}"
        ));
        assert!(run.column("strain_33").iter().all(|e| e.to_bits() == 0));
        assert!(run.last("stress_33") < -9.0);
    }
}

#[test]
fn an_initial_state_outside_the_surface_is_returned_with_a_warning() {
    let run = follow(&format!(
        "{JOINT}[initial]\ntraction = {{ n = -100, t = 200 }}\n[[segment]]\nincrements = 2\n\
         control = {{ t = {{ jump = 1e-6 }} }}"
    ));
    assert_relative_eq!(run.at(0, "traction_t"), 200.0);
    let strength = 5.0 + 100.0 * 35_f64.to_radians().tan();
    assert_relative_eq!(run.at(1, "traction_t"), strength, max_relative = 1e-9);
    let warnings = &run.result.as_ref().unwrap().warnings;
    assert_eq!(warnings.len(), 1);
    has(&warnings[0], "outside");
    has(&warnings[0], "t = 200");
}

#[test]
fn a_state_inside_or_on_the_surface_gives_no_warning() {
    let strength = 5.0 + 100.0 * 35_f64.to_radians().tan();
    for t in [0.0, strength] {
        let run = follow(&format!(
            "{JOINT}[initial]\ntraction = {{ n = -100, t = {t} }}\n[[segment]]\nincrements = 1\n\
             control = {{ t = {{ jump = 1e-6 }} }}"
        ));
        assert!(run.result.unwrap().warnings.is_empty());
    }
}

#[test]
fn internal_variables_can_be_given() {
    let run = follow(&format!(
        "law = 'mepi'\nhypothesis = 'interface_2d'\n{MEPI}[initial]\ntraction = {{ n = -100 }}\n\
         internal = {{ plastic_slip = 1 }}\n[[segment]]\nincrements = 1\n\
         control = {{ t = {{ jump = 1e-3 }} }}"
    ));
    assert_relative_eq!(run.at(0, "plastic_slip"), 1.0);
    // After a metre of slip friction is fully mobilised: 70 kPa less a 1.6e-5 part.
    assert_relative_eq!(run.last("traction_t"), 70.0, max_relative = 1e-4);
}

#[test]
fn the_table_has_the_agreed_shape() {
    let (table, result) = csv(&format!(
        "{JOINT}[initial]\ntraction = {{ n = -100 }}\n[[segment]]\nincrements = 2\n\
         control = {{ t = {{ jump = 1e-3 }} }}\n[[segment]]\nincrements = 3\n\
         control = {{ t = {{ jump = 0 }}, n = {{ traction = -1e-200 }} }}"
    ));
    let report = result.unwrap();
    assert_eq!(report.increments, 5);
    let lines: Vec<&str> = table.lines().collect();
    assert!(lines[0].starts_with("increment,jump_n,jump_t,traction_n,traction_t,plastic_slip,"));
    assert!(lines[0].ends_with(",iterations"));
    assert_eq!(lines.len(), 1 + 6);
    for (k, line) in lines[1..].iter().enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), lines[0].split(',').count());
        assert_eq!(cells[0], k.to_string());
        assert!(cells[cells.len() - 1].parse::<usize>().is_ok());
        for cell in &cells[1..cells.len() - 1] {
            let mantissa = cell.split('e').next().unwrap();
            let digits = mantissa.chars().filter(char::is_ascii_digit).count();
            assert_eq!(digits, 17, "{cell}");
            assert!(cell.parse::<f64>().unwrap().is_finite());
        }
    }
    assert!(
        lines[1].ends_with(",0"),
        "the initial state takes no iterations"
    );
}

#[test]
fn solids_have_columns_of_strain_and_stress() {
    for (hypothesis, components) in [
        ("plane_strain", "11,22,33,12"),
        ("axisymmetric", "11,22,33,12"),
        ("3d", "11,22,33,12,13,23"),
    ] {
        let (table, _) = csv(&format!(
            "law = 'elastic'\nhypothesis = '{hypothesis}'\n{ELASTIC}[[segment]]\nincrements = 1\ncontrol = {{}}"
        ));
        let with = |word: &str| {
            let names: Vec<String> = components
                .split(',')
                .map(|c| format!("{word}_{c}"))
                .collect();
            names.join(",")
        };
        let header = format!("increment,{},{},iterations", with("strain"), with("stress"));
        assert_eq!(table.lines().next(), Some(header.as_str()));
    }
}

#[test]
fn a_traction_beyond_strength_keeps_the_rows_before() {
    let run = attempt(&format!(
        "{JOINT}[initial]\ntraction = {{ n = -100 }}\n[[segment]]\nincrements = 4\n\
         control = {{ t = {{ jump = 1e-5 }} }}\n[[segment]]\nincrements = 100\n\
         control = {{ t = {{ traction = 104 }} }}"
    ));
    let error = run.error();
    assert_eq!(error.exit_code(), 2);
    // Strength 75.02 kPa; from 4 kPa in steps of 1 kPa: 71 increments after the first four.
    assert_eq!(run.increments(), 75);
    assert_relative_eq!(run.last("traction_t"), 75.0, max_relative = 1e-9);
    let message = error.to_string();
    for part in [
        "segment 2, increment 72 of 100 (76 of the file)",
        "`t`",
        "residual",
        "reached: 0.02",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn one_row_per_increment_however_many_steps() {
    // One increment from compression through opening to a slid contact.
    let run = follow(&format!(
        "{JOINT}[initial]\ntraction = {{ n = -100 }}\n[[segment]]\nincrements = 1\n\
         control = {{ n = {{ jump = 1e-3 }}, t = {{ jump = 1e-3 }} }}\n[[segment]]\nincrements = 1\n\
         control = {{ n = {{ traction = -100 }}, t = {{ traction = 50 }} }}"
    ));
    assert_eq!(run.increments(), 2);
    assert!(run.last("iterations") >= 2.0);
    assert_relative_eq!(run.last("traction_t"), 50.0, max_relative = 1e-9);
}

/// Runs a driver file without variants.
fn run_file(path: &Path, csv: &Path) -> Result<PointReport, runs::Error> {
    let mut reports = Vec::new();
    tests::driver::run(path, None, Some(csv), |report| reports.push(report.clone()))?;
    Ok(reports.remove(0))
}

#[test]
fn rows_reach_the_file_also_when_the_path_ends_early() {
    let folder = folder("rows");
    let (driver, table) = (folder.join("driver.toml"), folder.join("rows.csv"));
    let path = format!(
        "{JOINT}[initial]\ntraction = {{ n = -100 }}\n[[segment]]\nincrements = 100\n\
         control = {{ t = {{ traction = 100 }} }}"
    );
    fs::write(&driver, path).unwrap();
    assert_eq!(run_file(&driver, &table).unwrap_err().exit_code(), 2);
    let rows = fs::read_to_string(&table).unwrap();
    assert_eq!(rows.lines().count(), 2 + 75);
    assert!(rows.ends_with('\n'));
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_report_says_what_was_run() {
    let folder = folder("report");
    let (driver, table) = (folder.join("driver.toml"), folder.join("rows.csv"));
    let path = format!(
        "law = 'elastic'\nhypothesis = '3d'\n{ELASTIC}[[segment]]\nincrements = 3\n\
         control = {{ 22 = {{ stress = -100 }} }}"
    );
    fs::write(&driver, path).unwrap();
    let report = run_file(&driver, &table).unwrap();
    assert_eq!((report.law.as_str(), report.increments), ("elastic", 3));
    let text = report.to_string();
    for part in [
        "law `elastic`",
        "3d",
        "3 increments",
        "stress_22",
        "rows.csv",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn bad_input_leaves_an_existing_table_alone() {
    let folder = folder("alone");
    let (driver, table) = (folder.join("driver.toml"), folder.join("rows.csv"));
    fs::write(&driver, "law = 'elastic'\n").unwrap();
    fs::write(&table, "kept").unwrap();
    assert_eq!(run_file(&driver, &table).unwrap_err().exit_code(), 1);
    assert_eq!(fs::read_to_string(&table).unwrap(), "kept");
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_driver_file_is_not_overwritten() {
    let folder = folder("overwritten");
    let driver = folder.join("driver.toml");
    let text = format!(
        "law = 'elastic'\nhypothesis = '3d'\n{ELASTIC}[[segment]]\nincrements = 1\ncontrol = {{}}"
    );
    fs::write(&driver, &text).unwrap();
    let same = folder.join(".").join("driver.toml");
    assert_eq!(run_file(&driver, &same).unwrap_err().exit_code(), 1);
    assert_eq!(fs::read_to_string(&driver).unwrap(), text);
    let nowhere = folder.join("no_such_folder").join("rows.csv");
    let error = run_file(&driver, &nowhere).unwrap_err();
    assert!(error.to_string().contains("cannot write"), "{error}");
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn law_path_is_relative_to_the_driver_file() {
    let folder = folder("law_path");
    fs::create_dir(folder.join("laws")).unwrap();
    let driver = folder.join("driver.toml");
    let text = |path: &str| {
        format!(
            "law = 'elastic'\n{path}hypothesis = '3d'\n{ELASTIC}[[segment]]\nincrements = 1\ncontrol = {{}}"
        )
    };
    fs::write(&driver, text("")).unwrap();
    let table = folder.join("rows.csv");
    let library = run_file(&driver, &table).unwrap().library;
    let copy = folder.join("laws").join(library.file_name().unwrap());
    fs::copy(&library, &copy).unwrap();
    fs::write(&driver, text("law_path = ['laws']\n")).unwrap();
    assert_eq!(run_file(&driver, &table).unwrap().library, copy);
    fs::remove_dir_all(folder).unwrap();
}
