//! One law along a path at one integration point, in memory, with mixed control of its components.
//!
//! A [`Driver`] leads a point through [`Segment`]s. Each component follows a gradient (a jump or
//! strain), a flux (a traction or stress), or a stiffness ([`Control`]). The path is followed by
//! [`Driver::run`], which hands out a [`Row`] for each increment.
//!
//! Units are m and kPa, shear strains are γ = 2ε; opening and tension are positive. Components are
//! those of the law's [hypothesis](abi::Hypothesis::components), in their order; arrays over them
//! are padded to [`N_MAX`]. An increment lasts one unit of time unless its segment says otherwise.
//!
//! Failures come back as data ([`Error`]): where ([`Place`]), with which law, why ([`Cause`]),
//! and the call of the law behind it. Its `Display` says the same in a sentence.
//!
//! ```no_run
//! use abi::Hypothesis;
//! use law::SearchPath;
//! use point::{Control, Driver, Error, Segment};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A triaxial test: 100 kPa all around, then 10 % of compression in 200 increments. E and ν.
//! let three_d = Hypothesis::ThreeD;
//! let law = SearchPath::new(&[]).law("elastic")?.build(three_d, &[2e4, 0.3]);
//! let law = law.map_err(|failure| failure.reason)?;
//! let compression = Segment::new(three_d, 1, 200).lead(0, Control::Gradient(-0.1));
//! let start = [-100.0, -100.0, -100.0, 0.0, 0.0, 0.0];
//! let driver = Driver::new(law, &start, vec![compression])?;
//! let mut curve = Vec::new();
//! let course = driver.run(|row| {
//!     curve.push((row.gradient[0], row.flux[0]));
//!     Ok::<(), Error>(())
//! })?;
//! assert_eq!(course.increments, 200);
//! # Ok(())
//! # }
//! ```
//!
//! Inside, in the order in which data flows: `path` and `driver` say what is followed, `course` hands
//! out rows, `walk` carries the point over an increment in steps, `search` finds the equilibrium of a
//! step.

mod driver;
mod error;
mod follow;
mod frame;
mod ignored_input;
mod increments;
mod messages;
mod path;
mod restrictions;
mod search;
mod state;
mod tolerance_scale;

pub use driver::{Driver, TIME};
pub use error::{Cause, Criterion, Error, Failure, Misuse, NoEquilibrium, Place, Unmet};
pub use follow::{Course, Row};
pub use frame::Frame;
pub use path::{Control, MAX_INCREMENTS, Segment};
pub use restrictions::{Restrictions, Rows};
pub use state::{N_MAX, Vector};
