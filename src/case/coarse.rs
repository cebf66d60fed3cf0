//! Files in single precision whose coordinates are so large that the steps between them bend what they describe, or merge its corners.

#[cfg(feature = "mesh")]
use crate::shape::Unfit;

/// Steps of a file's coordinates over the spacing that are worth a word [-].
const COARSE: f64 = 1e-3;

/// What to say of a file whose coordinates are told in steps up to some place (both [m]), if these are coarse at a `spacing` [m].
pub(crate) fn coarse(steps: Option<(f64, f64)>, spacing: f64) -> Option<String> {
    let (step, at) = steps.filter(|(step, _)| *step > COARSE * spacing)?;
    Some(format!(
        "a binary STL file has single precision, steps of {step:.1e} m at its coordinates of up to {at:.0} m: \
         export it as OBJ or as STL in text, or about an origin nearby"
    ))
}

/// The refusal of such a file: what is wrong with it may be the steps alone.
#[cfg(feature = "mesh")]
pub(super) fn refused(unfit: Unfit, steps: Option<(f64, f64)>, spacing: f64) -> Unfit {
    match coarse(steps, spacing) {
        Some(coarse) => {
            Unfit { remedy: format!("{coarse}; if it is refused even so, {}", unfit.remedy), ..unfit }
        }
        None => unfit,
    }
}
