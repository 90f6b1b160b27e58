//! The last of all test programs, by its name: `cargo test` runs them in the order of package names, then of program
//! names; examples in documentation come after. It prints in one line how many tests were skipped, and for lack of
//! what.
#![expect(clippy::print_stdout, reason = "what it is for")]

fn main() {
    // Asked for a list of tests it has none.
    if !std::env::args().any(|argument| argument == "--list") {
        println!("\n{}\n", tests::needs::skipped());
    }
}
