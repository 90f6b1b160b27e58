//! The core of studies of settings, searches for an accuracy and calibrations. A case is carried out many times in one
//! [`Scratch`] folder, each time a [`Trial`] with its [`Rows`]. Results are [`Kept`], so that stopped work goes on from
//! there. Tables are written by [`csv`], pages by [`page`].

pub(crate) mod bits;
pub(crate) mod clock;
mod kept;
pub(crate) mod progress;
pub(crate) mod rows;
mod trial;
mod write;

pub(crate) use kept::{Earlier, Kept};
pub(crate) use rows::Rows;
pub(crate) use trial::{Counts, Scratch, Timing, Trial, measure, repetitions};
pub(crate) use write::{csv, digits, page, write};
