//! The GPU that tests bake with. Where there is none they skip, and say so, unless
//! `AOGRID_GPU=require`.

use std::sync::OnceLock;

use aogrid_baker_gpu::{Choice, Context, adapters};

use crate::skip;

/// Whether a missing adapter is a failure.
const VARIABLE: &str = "AOGRID_GPU";

/// A device on the best adapter of this machine, software included, or none, with a note.
///
/// # Panics
///
/// If there is none and there has to be.
pub fn gpu() -> Option<&'static Context> {
    static CONTEXT: OnceLock<Result<Context, String>> = OnceLock::new();
    let found = CONTEXT.get_or_init(|| {
        let best = adapters().into_iter().next().ok_or("no adapter")?;
        Context::new(&Choice::Named(best.name)).map_err(|error| error.to_string())
    });
    match found {
        Ok(context) => Some(context),
        Err(why) if std::env::var(VARIABLE).as_deref() == Ok("require") => panic!("{why}"),
        Err(why) => {
            skip(&format!("{why} ({VARIABLE})"));
            None
        }
    }
}
