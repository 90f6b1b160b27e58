//! The files of this crate as texts, for programs that hand it on, as [`abi::sources`] has those of the
//! contract.

use abi::sources::File;

macro_rules! file {
    ($path:literal) => {
        ($path, include_str!(concat!("../", $path)))
    };
}

/// This crate, but for its manifest.
pub const CRATE: [File; 7] = [
    file!("src/calculix.rs"),
    file!("src/laws.rs"),
    file!("src/lib.rs"),
    file!("src/mfront.rs"),
    file!("src/mfront/call.rs"),
    file!("src/point.rs"),
    file!("src/umat.rs"),
];
