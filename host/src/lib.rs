//! The Pilum host: a finite-element program that knows no constitutive law.
//!
//! In the order in which data flows: a [`case`] file, its [`mesh`], the laws from their libraries
//! ([`plugin`], built by [`input`]), both joined in a [`model`] of [`group`]s of [`element`]s;
//! [`run`] leads it through phases and increments with [`assembly`] and [`solver`]; [`probe`]s and
//! [`output`] write what comes out. Beside them: [`point`], one law at one integration point, and
//! [`laws`], what there is to know about a law, and [`trade_off`], what accuracy costs. [`inspect`]
//! and [`lock`] say what a library is and hold a case to it, a [`capsule`] repeats a call that failed,
//! and what may crash or hang runs in a [`child`] process. For authors there
//! is [`new_law`], and [`mod@check`] says whether a library keeps the contract; for editors [`schema`].

pub mod assembly;
pub mod capsule;
pub mod case;
pub mod check;
pub mod checkpoint;
pub mod child;
pub mod custody;
pub mod element;
pub mod error;
mod file;
#[doc(hidden)]
pub mod fuzzing;
pub mod group;
pub mod input;
pub mod inspect;
pub mod laws;
pub mod lock;
#[expect(unsafe_code, reason = "the program's allocator")]
#[cfg(unix)]
pub mod memory;
pub mod mesh;
pub mod model;
pub mod new_law;
pub mod output;
pub mod plugin;
pub mod point;
pub mod probe;
pub mod report;
pub mod run;
pub mod schema;
pub mod solver;
pub mod stop;
#[cfg(target_os = "linux")]
pub mod supervision;
pub mod trade_off;
