//! Two openers of libraries in one process.
//!
//! Goal        neither trust nor what is open goes from one to the other.
//! Set-up      a library that no one has seen before, opened in two threads by turns. Probing or
//!             isolating would start this program, which is not `pilum`: it is refused.
//! Law         elastic.
//! Asserts     who gets the library, and which copy.

use law::{Opener, SearchPath, Trust};
use std::fs;
use std::io::Write;
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::Duration;

#[test]
fn two_openers_do_not_see_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("unknown.so");
    let elastic = SearchPath::new(&[]).law("elastic").unwrap();
    fs::copy(elastic.library().path(), &path).unwrap();
    // What follows the last section is nobody's. Other bytes are another library, which no
    // earlier test has probed.
    let mut file = fs::File::options().append(true).open(&path).unwrap();
    write!(file, "{:?}", std::time::SystemTime::now()).unwrap();
    drop(file);

    let path = &path;
    let (opened, is_open) = mpsc::channel();
    let (tried, is_tried) = mpsc::channel();
    thread::scope(|scope| {
        scope.spawn(move || {
            let careless = Opener::default();
            let library = careless.open(path).unwrap();
            opened.send(()).unwrap();
            // The other tries, and fails.
            is_tried.recv().unwrap();
            let again = careless.clone().open(path).unwrap();
            assert!(Arc::ptr_eq(&library, &again));
            // Its law is still called in this process.
            library.law("elastic").unwrap().destroy_nothing();
            let other = Opener::default().open(path).unwrap();
            assert!(!Arc::ptr_eq(&library, &other));
            assert_eq!(library.sha256(), other.sha256());
            assert_eq!(careless.record(), None);
        });
        scope.spawn(move || {
            let trust = |probe, isolate| Trust { probe, isolate };
            // The first has it open.
            is_open.recv().unwrap();
            let probing = Opener::new(trust(true, None)).recording_to("calls.toml".into());
            let isolating = Opener::new(trust(false, Some(Duration::from_secs(5))));
            let refused = [&probing, &isolating].map(|opener| opener.open(path).map(|_| ()));
            tried.send(()).unwrap();
            let [probed, isolated] = refused.map(|refused| refused.unwrap_err().to_string());
            assert!(probed.contains("in a child process"), "{probed}");
            assert!(
                isolated.contains("worker") || isolated.contains("process"),
                "{isolated}"
            );
        });
    });
}
