//! What is raised.

use pocketsplat_core::DecodeError;
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

create_exception!(
    pocketsplat,
    BundleError,
    PyValueError,
    "The bytes are no bundle, are damaged, or cannot be drawn so."
);
create_exception!(
    pocketsplat,
    BudgetError,
    BundleError,
    "No plan fits the memory; args[1] is the number of bytes with which the smallest one would."
);

/// What Python raises for it.
pub(crate) fn raised(error: DecodeError) -> PyErr {
    match error {
        DecodeError::BudgetTooSmall { needed, .. } => BudgetError::new_err((error.to_string(), needed)),
        _ => BundleError::new_err(error.to_string()),
    }
}
