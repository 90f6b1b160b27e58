//! `pilum check`: the shipped laws pass it, every bad library fails the check that names its fault
//! and no other, and neither `pilum check` nor, where a fault can be seen in time, `pilum point`
//! goes down with it.

mod aids;
mod bad;
mod good;
mod languages;
mod led;
mod minors;
mod program;
