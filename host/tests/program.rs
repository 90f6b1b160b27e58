//! The program starts. Because this test names it, `cargo test --workspace` builds it, and the
//! tests of the command line find it.

use std::process::Command;

#[test]
fn says_its_version() {
    let output = Command::new(env!("CARGO_BIN_EXE_pilum"))
        .arg("--version")
        .output()
        .unwrap();
    assert!(output.status.success());
    let expected = concat!("pilum ", env!("CARGO_PKG_VERSION"), "\n");
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
}
