//! Placeholder
use crate::console::Console;
/// Draw
#[derive(clap::Args)]
pub(crate) struct Args {}
pub(crate) fn run(_: &Args, _: &Console) -> anyhow::Result<()> {
    Ok(())
}
