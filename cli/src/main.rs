//! The program `seixo`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(seixo_cli::main(std::env::args_os()))
}
