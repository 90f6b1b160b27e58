//! The job array of `cases/study_slurm` in Slurm itself, on one machine (`fixtures/slurm.sh`).
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::Place;
use crate::study_cases::{by_itself, case, table, with_pilum};
use std::path::Path;
use std::process::{Child, Command, Output};
use std::time::{Duration, Instant};

/// Slurm, until it is dropped.
struct Cluster<'a> {
    place: &'a Place,
    daemons: Child,
}

impl<'a> Cluster<'a> {
    fn new(place: &'a Place) -> Self {
        let script = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/command_line/fixtures/slurm.sh"
        );
        let daemons = Command::new(script).arg(place.path("slurm")).spawn();
        let cluster = Self {
            place,
            daemons: daemons.unwrap(),
        };
        cluster.wait_for("the machine", Duration::from_mins(1), || {
            let told = cluster.ask("sinfo", &["--noheader", "--format=%T"]);
            String::from_utf8_lossy(&told.stdout).trim() == "idle"
        });
        cluster
    }

    fn ask(&self, program: &str, arguments: &[&str]) -> Output {
        let mut command = with_pilum(self.place, program);
        command.env("SLURM_CONF", self.place.path("slurm/slurm.conf"));
        command.env("STUDY", self.place.path("study"));
        command.env("OUT", self.place.path("out"));
        command.args(arguments).output().unwrap()
    }

    fn wait_for(&self, what: &str, patience: Duration, is_there: impl Fn() -> bool) {
        let since = Instant::now();
        while !is_there() {
            let log =
                |name: &str| std::fs::read_to_string(self.place.path(name)).unwrap_or_default();
            let logs = ["slurm/slurmctld.log", "slurm/slurmd.log", "log.1", "log.2"].map(log);
            assert!(since.elapsed() < patience, "{what}: {}", logs.join("\n"));
            std::thread::sleep(Duration::from_secs(1));
        }
    }
}

impl Drop for Cluster<'_> {
    fn drop(&mut self) {
        self.ask("scancel", &["--full", "--name=study_slurm"]);
        tests::needs::signal("TERM", &self.daemons.id().to_string());
        let _ = self.daemons.wait();
    }
}

/// Two runs that take longer than their two minutes, of which Slurm leaves them one at most. Each ends early with a
/// checkpoint, is submitted again, goes on, and gives the results of an uninterrupted run.
#[test]
#[ignore = "ten minutes, and Slurm"]
fn tasks_whose_time_is_over_are_sent_in_again_and_go_on() {
    let is_there = |folder: &str| Path::new(folder).join("slurmctld").is_file();
    if !is_there("/usr/sbin") {
        tests::needs::missing("Slurm (Debian's slurm-wlm and munge)");
        return;
    }
    let place = Place::new();
    let base = format!("base = \"{}/chamber.toml\"\n", case("study_parallel"));
    place.write(
        "study/long.toml",
        &(base + "[[phase]]\nname = \"loading\"\nincrements = 300000\n"),
    );
    place.write(
        "study/study.toml",
        "title = \"Two long runs\"\ncase = \"long.toml\"\nmethod = \"grid\"\n\n[[parameter]]\nname = \"mu_p\"\n\
         key = \"laws.mepi.parameters.mu_p\"\nvalues = [0.6, 0.8]\n\n[outputs]\nq_s = { probe = \"q_s\", phase = \"loading\" }\n",
    );
    let cluster = Cluster::new(&place);
    let script = format!("{}/study.sbatch", case("study_slurm"));
    let log = format!("--output={}", place.path("log.%a").display());
    let sent = cluster.ask("sbatch", &["--array=1-2", "--time=2", &log, &script]);
    assert!(sent.status.success(), "{sent:?}");
    let queue = || cluster.ask("squeue", &["--noheader", "--array"]);
    cluster.wait_for("the array", Duration::from_mins(30), || {
        queue().stdout.is_empty()
    });

    let found = table(&place);
    for task in ["log.1", "log.2"] {
        let log = place.read(task);
        assert!(log.contains("stopped as asked"), "{log}");
    }
    drop(cluster);
    let at_once = by_itself(&place.path("study").display().to_string());
    assert_eq!(found, at_once);
}
