//! The command line of seixo.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
