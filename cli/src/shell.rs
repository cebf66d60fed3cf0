//! What a shell and `man` should know of the program.

use super::{Args, Exit};
use clap::CommandFactory;
use seixo::console::say;
use seixo::error::{Error, Result};
use seixo::output::write_whole;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct ManArgs {
    /// Folder for the pages of all commands, seixo.1, seixo-run.1 and so on; without it the main page is printed.
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// `seixo completions`: a script that completes commands and options.
pub fn completions(shell: clap_complete::Shell) -> Exit {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Args::command(), "seixo", &mut script);
    say(String::from_utf8_lossy(&script).trim_end());
    Ok(0)
}

/// `seixo man`.
pub fn man(args: &ManArgs) -> Exit {
    let mut command = Args::command();
    command.build();
    match &args.out {
        None => say(&page(&command)?),
        Some(folder) => {
            std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
            pages(folder, &command)?;
        }
    }
    Ok(0)
}

/// A page for `command` and each one below it.
fn pages(folder: &Path, command: &clap::Command) -> Result<()> {
    let name = command.get_display_name().unwrap_or_else(|| command.get_name()).to_owned();
    write_whole(&folder.join(format!("{name}.1")), page(command)?.as_bytes())?;
    let mut below = command.get_subcommands().filter(|c| c.get_name() != "help");
    below.try_for_each(|c| pages(folder, c))
}

fn page(command: &clap::Command) -> Result<String> {
    let mut page = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut page).map_err(Error::io("man page"))?;
    Ok(String::from_utf8_lossy(&page).into_owned())
}
