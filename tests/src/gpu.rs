//! The GPU that tests bake with. Without one they skip with a note, or fail with
//! `AOGRID_GPU=require`.

use std::sync::OnceLock;

use aogrid_baker_gpu::{AdapterSelector, Context, adapters};
use aogrid_gpu_support::skip;

/// Returns a device on the best adapter of this machine, including software rasterizers. Returns
/// `None` and notes the skip if there is none.
///
/// # Panics
///
/// If there is no adapter and `AOGRID_GPU=require` is set.
pub fn gpu() -> Option<&'static Context> {
    static CONTEXT: OnceLock<Result<Context, String>> = OnceLock::new();
    let found = CONTEXT.get_or_init(|| {
        let best = adapters().into_iter().next().ok_or("no adapter")?;
        Context::new(&AdapterSelector::Named(best.name)).map_err(|error| error.to_string())
    });
    match found {
        Ok(context) => Some(context),
        Err(why) => {
            skip(why);
            None
        }
    }
}
