//! The native half of the Python package: what the modules in `python/pocketsplat` make arrays and classes of.
//!
//! Numbers go over as bytes and tuples, so that this half needs no array library. What takes long does not hold Python's lock.

mod bundle;
mod camera;
mod error;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use pyo3::prelude::*;

/// Runs the command line in this process, which it takes over, and gives its exit code.
///
/// * `program`: the file that starts the command again. * `arguments`: without the program's name.
#[pyfunction]
fn run_command(py: Python<'_>, program: PathBuf, arguments: Vec<OsString>) -> u8 {
    let code = py.detach(|| pocketsplat_command::run(Some(program), arguments));
    // An exit code does not say its number.
    (0..=u8::MAX).find(|number| ExitCode::from(*number) == code).unwrap_or(1)
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("BundleError", module.py().get_type::<error::BundleError>())?;
    module.add("BudgetError", module.py().get_type::<error::BudgetError>())?;
    module.add_class::<bundle::Bundle>()?;
    module.add_function(wrap_pyfunction!(camera::orbited, module)?)?;
    module.add_function(wrap_pyfunction!(run_command, module)?)
}
