//! Opening a library with behaviours of MFront's generic interface, and calling one.

use crate::process::library_bytes::Image;
use std::ffi::{CStr, CString, c_char, c_int};
use std::path::Path;
use std::ptr::null_mut;
use std::sync::PoisonError;

/// Size of the buffer for messages that the interface demands.
const MESSAGE: usize = 512;

/// The state of a point, as the interface passes it. At the start of the increment nothing is
/// written.
#[repr(C)]
struct State {
    gradients: *mut f64,
    thermodynamic_forces: *mut f64,
    mass_density: *mut f64,
    material_properties: *mut f64,
    internal_state_variables: *mut f64,
    stored_energy: *mut f64,
    dissipated_energy: *mut f64,
    external_state_variables: *mut f64,
}

#[repr(C)]
struct Data {
    error_message: *mut c_char,
    dt: f64,
    k: *mut f64,
    rdt: *mut f64,
    speed_of_sound: *mut f64,
    s0: State,
    s1: State,
}

const _: () = assert!(size_of::<Data>() == 168);

type Integrate = unsafe extern "C" fn(*mut Data) -> c_int;
type SetParameter = unsafe extern "C" fn(*const c_char, f64) -> c_int;

/// A behaviour under one hypothesis, in an image of its library that nobody else uses: its
/// parameters hold for the whole image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Behaviour {
    integrate: Integrate,
}

/// Sizes of the arrays of a call.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sizes {
    /// Gradient and force.
    pub(crate) n: usize,
    /// Internal state variables.
    pub(crate) n_states: usize,
    /// Material properties.
    pub(crate) n_properties: usize,
    /// External state variables.
    pub(crate) n_external: usize,
}

/// The arrays of a call, in the interface's components.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    pub(crate) gradients: [Vec<f64>; 2],
    pub(crate) forces: [Vec<f64>; 2],
    pub(crate) states: [Vec<f64>; 2],
    pub(crate) properties: Vec<f64>,
    pub(crate) external: Vec<f64>,
    /// The request, then the operator.
    pub(crate) k: Vec<f64>,
    pub(crate) dt: f64,
    /// The largest step factor that is admitted, then the behaviour's.
    pub(crate) rdt: f64,
}

impl Behaviour {
    /// Opens another image of the library, finds the function and sets parameters.
    ///
    /// # Errors
    /// The defect of the library, in words.
    pub(crate) fn open(
        path: &Path,
        image: Image,
        function: &str,
        setter: &str,
        set: &[(&str, f64)],
    ) -> Result<Self, String> {
        let _guard = super::ONE_AT_A_TIME
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        // SAFETY: running the library's initialisers is what loading means; the user named it.
        let library: &'static libloading::Library =
            Box::leak(Box::new(unsafe { super::load_image(path, image, true) }?));
        // SAFETY: the interface: `<behaviour>_<hypothesis>` is of this type.
        let integrate = unsafe { library.get::<Integrate>(function.as_bytes()) }
            .map_err(|_| format!("it has no function {function}"))?;
        for (parameter, value) in set {
            // SAFETY: the interface: `<behaviour>_setParameter` is of this type.
            let setter = unsafe { library.get::<SetParameter>(setter.as_bytes()) }
                .map_err(|_| format!("its parameter {parameter} cannot be set"))?;
            let name = CString::new(*parameter).map_err(|_| "a name holds NUL".to_owned())?;
            // SAFETY: a text that ends in NUL.
            if unsafe { setter(name.as_ptr(), *value) } == 0 {
                return Err(format!("it refuses its parameter {parameter}"));
            }
        }
        Ok(Self {
            integrate: *integrate,
        })
    }

    /// Carries a point. The behaviour's verdict (1 good, 0 inaccurate, −1 failed) and message.
    ///
    /// # Panics
    /// An array of the point is not of its size.
    pub(crate) fn call(self, sizes: Sizes, point: &mut Point) -> (c_int, String) {
        let of_size = |arrays: &[Vec<f64>; 2], n| arrays.iter().all(|a| a.len() == n);
        assert!(
            of_size(&point.gradients, sizes.n)
                && of_size(&point.forces, sizes.n)
                && of_size(&point.states, sizes.n_states)
                && point.properties.len() == sizes.n_properties
                && point.external.len() == sizes.n_external
                && point.k.len() >= (sizes.n * sizes.n).max(1)
        );
        let mut message = [0 as c_char; MESSAGE];
        // Density, and stored and dissipated energy, at both ends.
        let mut scalars = [[0.0; 3]; 2];
        let mut sound = 0.0;
        let properties = point.properties.as_mut_ptr();
        let external = point.external.as_mut_ptr();
        let [s0, s1] = [0, 1].map(|end| {
            let [mass_density, stored_energy, dissipated_energy] =
                scalars[end].each_mut().map(std::ptr::from_mut);
            State {
                gradients: point.gradients[end].as_mut_ptr(),
                thermodynamic_forces: point.forces[end].as_mut_ptr(),
                mass_density,
                material_properties: properties,
                internal_state_variables: or_null(&mut point.states[end]),
                stored_energy,
                dissipated_energy,
                external_state_variables: external,
            }
        });
        let mut data = Data {
            error_message: message.as_mut_ptr(),
            dt: point.dt,
            k: point.k.as_mut_ptr(),
            rdt: &raw mut point.rdt,
            speed_of_sound: &raw mut sound,
            s0,
            s1,
        };
        // SAFETY: the interface: every array has the size that the library's own symbols give,
        // see above, and lives until the call has returned.
        let verdict = unsafe { (self.integrate)(&raw mut data) };
        message[MESSAGE - 1] = 0;
        // SAFETY: it ends in NUL.
        let text = unsafe { CStr::from_ptr(message.as_ptr()) };
        (verdict, text.to_string_lossy().trim().to_owned())
    }
}

fn or_null(values: &mut [f64]) -> *mut f64 {
    if values.is_empty() {
        null_mut()
    } else {
        values.as_mut_ptr()
    }
}
