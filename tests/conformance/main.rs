//! `pilum check`: the shipped laws pass it, and every bad library fails only the check that names
//! its fault. No bad library crashes `pilum check` or, if its fault can be seen in time, `pilum
//! point`.

mod aids;
mod bad;
mod good;
mod languages;
mod led;
mod minors;
mod program;
