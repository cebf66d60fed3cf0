//! `seixo compare`.

use super::{CaseArgs, DeviceArgs, Exit};
use seixo::error::Error;

#[derive(Debug, clap::Args)]
pub struct CompareArgs {
    #[command(flatten)]
    case: CaseArgs,
    #[command(flatten)]
    device: DeviceArgs,
    /// Steps over which the drift is followed.
    #[arg(long, value_name = "N", default_value_t = 20)]
    steps: u64,
    /// Steps on the CPU before the stages are compared, so that the state is not the lattice.
    #[arg(long, value_name = "N", default_value_t = 0)]
    warmup: u64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn compare(_args: &CompareArgs) -> Exit {
    Err(Error::Gpu("no GPU adapter was found to compare with".into()))
}
