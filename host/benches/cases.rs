//! The parts of a finite-element run, and whole runs: assembly and factorisation on the bonded
//! pile's meshes, the chamber of mesh 1 with its condensed sand, and the bonded pile on its
//! coarsest mesh. Wall-clock time.
#![allow(clippy::expect_used, reason = "a bench stops at the first fault")]

use algebra::{LinearSolver, mesh_lines};
use divan::Bencher;
use divan::counter::ItemsCount;
use input::Case;
use input::case::Axis;
use law::Operator;
use mechanics::assembly::{Places, System};
use mechanics::equilibrium::{self, Clock, Costs, Held, LinearDomain, Loads, Matrix, Newton};
use mechanics::group::Group;
use mechanics::{Mesh, Model, Place, Settings};
use runs::run::{Observer, run};
use std::path::Path;
use text::Source;

fn main() {
    divan::main();
}

/// A case of the repository.
fn case(name: &str, variant: Option<&str>) -> Case {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases");
    let mut cases = Case::load(&folder.join(name)).expect("the case is there");
    cases.retain(|case| case.variant.as_deref() == variant);
    cases.pop().expect("the variant is there")
}

/// For every degree of freedom, whether it is held or the head's push prescribes it.
fn prescribed(case: &Case, mesh: &Mesh) -> Vec<bool> {
    let mut prescribed = vec![false; 2 * mesh.nodes.len()];
    let supports = case.file.supports.iter();
    let supports = supports.map(|s| (s.line.get_ref().as_str(), s.fixed.as_slice()));
    for (line, fixed) in supports.chain([("pile_head", &[Axis::Y][..])]) {
        for node in &mesh.lines[line].nodes {
            for axis in fixed {
                prescribed[2 * node + usize::from(*axis == Axis::Y)] = true;
            }
        }
    }
    prescribed
}

/// The equations of the bonded pile's phase, with the tangents of its start.
struct Equations {
    groups: Vec<Group>,
    system: System,
    /// Mesh lines of the unknowns.
    lines: Vec<[u32; 2]>,
}

impl Equations {
    fn new(mesh: &str) -> Self {
        let case = case("bonded_pile", Some(mesh));
        let problem = case.pose().expect("the laws are built").problem;
        let mut model = Model::build(&problem).expect("the laws start");
        let prescribed = prescribed(&case, &problem.mesh);
        let still = vec![0.0; prescribed.len()];
        for group in &mut model.groups {
            let evaluated = group.evaluate(&still, Operator::Consistent, 0.0, 1.0);
            evaluated.expect("the law starts");
        }
        let system = System::new(&model.groups, |_, _| true, &prescribed, &model.ties, None);
        Self {
            lines: system.lines(&mesh_lines(&problem.mesh.nodes)),
            groups: model.groups,
            system,
        }
    }

    fn solver(&self, symmetric: bool) -> LinearSolver {
        let solver = LinearSolver::new(&self.system.pattern, symmetric, Some(&self.lines));
        solver.expect("the pattern is sound")
    }

    fn matrix(&self) -> Vec<f64> {
        let mut values = Vec::new();
        self.system.assemble(&self.groups, &mut values);
        values
    }
}

/// All element matrices, added up.
#[divan::bench(args = ["m2k"])]
fn assembly(bencher: Bencher<'_, '_>, mesh: &str) {
    let equations = Equations::new(mesh);
    let mut values = Vec::new();
    bencher
        .counter(ItemsCount::new(equations.system.n_equations()))
        .bench_local(|| equations.system.assemble(&equations.groups, &mut values));
}

/// Order and supernodes of a pattern.
#[divan::bench(args = ["m2k", "m5k"], sample_size = 1, sample_count = 20)]
fn analysis(bencher: Bencher<'_, '_>, mesh: &str) {
    let equations = Equations::new(mesh);
    bencher
        .counter(ItemsCount::new(equations.system.n_equations()))
        .bench_local(|| equations.solver(false));
}

fn factorise(bencher: Bencher<'_, '_>, mesh: &str, symmetric: bool) {
    let equations = Equations::new(mesh);
    let pattern = &equations.system.pattern;
    let mut solver = equations.solver(symmetric);
    let values = equations.matrix();
    bencher
        .counter(ItemsCount::new(pattern.n()))
        .bench_local(|| {
            solver
                .factorise(values.clone())
                .expect("the matrix is regular");
        });
    assert_eq!(solver.fallbacks, 0, "the fast method did the work");
}

/// L Lᵀ.
#[divan::bench(args = ["m2k", "m5k"], sample_size = 1, sample_count = 20)]
fn symmetric(bencher: Bencher<'_, '_>, mesh: &str) {
    factorise(bencher, mesh, true);
}

/// L U.
#[divan::bench(args = ["m2k", "m5k"], sample_size = 1, sample_count = 20)]
fn unsymmetric(bencher: Bencher<'_, '_>, mesh: &str) {
    factorise(bencher, mesh, false);
}

/// One right-hand side, with the check of the solution.
#[divan::bench(args = ["m2k", "m5k"], sample_size = 1, sample_count = 20)]
fn solution(bencher: Bencher<'_, '_>, mesh: &str) {
    let equations = Equations::new(mesh);
    let pattern = &equations.system.pattern;
    let mut solver = equations.solver(false);
    let factorised = solver.factorise(equations.matrix());
    factorised.expect("the matrix is regular");
    let right = vec![1.0; pattern.n()];
    bencher
        .counter(ItemsCount::new(pattern.n()))
        .bench_local(|| solver.solve(&right).expect("the matrix is regular"));
}

/// The chamber of mesh 1 under 100 kPa from all sides, its interface MEPI from the start.
fn stressed_chamber() -> Case {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/chamber_mesh1/case.toml");
    let text = std::fs::read_to_string(path).expect("the case is there");
    let stress = "initial_stress = { 11 = -100.0, 22 = -100.0, 33 = -100.0 }\n";
    let text = text
        .replace("formulation =", &format!("{stress}formulation ="))
        .replace("\"full\"\nlaw = \"sand\"", "\"full\"\nlaw = \"mepi\"");
    let source = Source::new("chamber.toml", text);
    let mut cases = Case::of(source).expect("a case");
    cases.pop().expect("one case")
}

/// The chamber's equations, the head pushed by 0.1 mm.
struct Chamber {
    mesh: Mesh,
    model: Model,
    prescribed: Vec<bool>,
    loads: Loads,
    settings: Settings,
}

impl Chamber {
    fn new() -> Self {
        let case = stressed_chamber();
        let problem = case.pose().expect("the laws are built").problem;
        let model = Model::build(&problem).expect("the laws start");
        let mesh = problem.mesh;
        let prescribed = prescribed(&case, &mesh);
        let head = &mesh.lines["pile_head"].nodes;
        let n_dofs = prescribed.len();
        let mut forces = vec![0.0; n_dofs];
        for group in &model.groups {
            let stress = &group.stress.committed;
            group.kinematics.add_forces(stress, &mut forces);
        }
        let push = |dof: usize| -> f64 {
            let is_head = dof % 2 == 1 && head.contains(&(dof / 2));
            if is_head { -1e-4 } else { 0.0 }
        };
        let held = (0..n_dofs).filter(|&dof| prescribed[dof]);
        let loads = Loads {
            leg: [0.0, 1.0],
            force_start: forces.clone(),
            force_end: forces,
            prescribed: held.map(|dof| (dof, 0.0, push(dof))).collect(),
            out_of_balance: vec![0.0; n_dofs],
            largest: vec![0.0; n_dofs],
            ..Loads::default()
        };
        Self {
            mesh,
            model,
            prescribed,
            loads,
            settings: *case.file.solver.get_ref(),
        }
    }

    fn condense(&self) -> (LinearDomain, System) {
        let Model { groups, ties, .. } = &self.model;
        let lines = mesh_lines(&self.mesh.nodes);
        let linear: Vec<bool> = groups
            .iter()
            .map(mechanics::group::Group::is_linear)
            .collect();
        let of = (groups.as_slice(), linear.as_slice());
        let held = Held {
            now: &self.prescribed,
            sometimes: &vec![false; self.prescribed.len()],
        };
        let condensed = LinearDomain::new(of, &held, ties, &lines, true, None);
        condensed.expect("supported").expect("linear groups")
    }
}

/// Assembly, factorisation and condensation of the chamber's linear groups.
#[divan::bench(sample_size = 1, sample_count = 20)]
fn condensation(bencher: Bencher<'_, '_>) {
    let chamber = Chamber::new();
    bencher.bench_local(|| chamber.condense());
}

/// One increment of the condensed chamber, from its first prediction to equilibrium.
#[divan::bench(sample_size = 1, sample_count = 100)]
fn condensed_increment(bencher: Bencher<'_, '_>) {
    let mut chamber = Chamber::new();
    let (mut domain, system) = chamber.condense();
    let still = vec![0.0; chamber.prescribed.len()];
    let groups = &chamber.model.groups;
    let internal = domain.internal_forces(groups);
    domain.start(groups, internal, &chamber.loads, &still, 1e-9);
    let block = domain.block(&system);
    let solver = LinearSolver::with_block(&system.pattern, None, block);
    let mut solver = solver.expect("a sound pattern");
    let places = Places::new(&system, &chamber.prescribed);
    let clock = Clock {
        start: 0.0,
        length: 1.0,
    };
    let mut iterations = 0;
    bencher.bench_local(|| {
        let mut matrix = Matrix::default();
        let mut costs = Costs::default();
        let mut newton = Newton::new(
            equilibrium::Equations {
                system: &system,
                places: &places,
                domain: Some(&domain),
                solver: &mut solver,
                matrix: &mut matrix,
            },
            &mut chamber.model.groups,
            &chamber.settings,
            &mut costs,
        );
        let step = newton.step(&chamber.loads, [0.0, 1.0], clock, None);
        iterations = step.expect("equilibrium").iterations.len();
    });
    assert!(iterations > 2, "the interface slides: {iterations}");
}

/// Counts the increments of a run.
#[derive(Default)]
struct Increments(usize);

impl Observer for Increments {
    fn phase(&mut self, _: &str, _: usize) {}

    fn increment(&mut self, _: &Place, _: usize, _: usize) {
        self.0 += 1;
    }

    fn cut_back(&mut self, _: &Place, _: &str) {}

    fn warning(&mut self, _: &str) {}
}

/// A whole run with its results, without their report; items are increments. The chamber's are one
/// of confinement, 5 in which the law is swapped, and 50 of loading.
fn whole(bencher: Bencher<'_, '_>, case: &Case) {
    let results = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bench_{}", case.name()));
    let mut count = Increments::default();
    run(case, &results, &mut count).expect("the case runs");
    bencher
        .counter(ItemsCount::new(count.0))
        .bench_local(|| run(case, &results, &mut Increments::default()).is_ok());
    std::fs::remove_dir_all(&results).expect("the results are ours");
}

/// Elastic sand, condensed, and the interface law MEPI.
#[divan::bench(sample_size = 1, sample_count = 20)]
fn chamber_mesh1(bencher: Bencher<'_, '_>) {
    whole(bencher, &case("chamber_mesh1", None));
}

/// Mohr–Coulomb soil: every equation in every iteration.
#[divan::bench(sample_size = 1, sample_count = 20)]
fn bonded_pile_m200(bencher: Bencher<'_, '_>) {
    whole(bencher, &case("bonded_pile", Some("m200")));
}
