//! `seixo init`: a case to begin with.

use super::Exit;
use clap::ValueEnum;
use seixo::console::{say, tell};
use seixo::error::Error;
use std::io::Write;
use std::path::PathBuf;

/// Cases to begin with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Starter {
    /// A column of water collapses and runs against a step.
    DamBreak,
    /// A box floats in a tank.
    FloatingBody,
    /// A block slides down a slope, without water.
    SlidingBlock,
    /// A piston makes waves in a flume.
    Flume,
}

impl Starter {
    fn name(self) -> &'static str {
        match self {
            Self::DamBreak => "dam-break",
            Self::FloatingBody => "floating-body",
            Self::SlidingBlock => "sliding-block",
            Self::Flume => "flume",
        }
    }

    pub fn text(self) -> &'static str {
        match self {
            Self::DamBreak => include_str!("starters/dam-break.toml"),
            Self::FloatingBody => include_str!("starters/floating-body.toml"),
            Self::SlidingBlock => include_str!("starters/sliding-block.toml"),
            Self::Flume => include_str!("starters/flume.toml"),
        }
    }
}

#[derive(Debug, clap::Args)]
pub struct InitArgs {
    /// Which one.
    #[arg(value_enum, default_value_t = Starter::DamBreak)]
    starter: Starter,
    /// File to write [default: STARTER.toml here]; - for standard output.
    file: Option<PathBuf>,
}

/// Writes the case, unless there is a file already.
pub fn init(args: &InitArgs) -> Exit {
    let name = args.starter.name();
    let path = args.file.clone().unwrap_or_else(|| PathBuf::from(format!("{name}.toml")));
    if path.as_os_str() == "-" {
        say(args.starter.text().trim_end());
        return Ok(0);
    }
    let mut file = match std::fs::File::create_new(&path) {
        Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {
            let text =
                format!("{} is there already: name another file, `seixo init {name} FILE`", path.display());
            return Err(Error::usage("FILE", text));
        }
        file => file.map_err(Error::io(&path))?,
    };
    file.write_all(args.starter.text().as_bytes()).map_err(Error::io(&path))?;
    let path = path.display();
    tell(&format!("{path} is written: read it, then `seixo plan {path}` and `seixo run {path}`"));
    Ok(0)
}
