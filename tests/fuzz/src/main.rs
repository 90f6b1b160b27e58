//! One of the targets under libFuzzer: `run.sh` says which.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::run(data));
