//! The report of a run and the comparison of several: what is in the page, what it says of
//! folders in which something is missing or broken, and whether it works in a browser.
#![expect(clippy::unwrap_used, clippy::panic, reason = "part of the tests")]

mod broken;
mod browser;
mod folders;
mod many;
mod page;
