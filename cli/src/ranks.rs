//! `seixo run` as one of many processes that `mpirun` or `srun` started.

#[cfg(feature = "mpi")]
mod mpi;

use seixo::Processor;
use seixo::error::{Error, Result};
use seixo::on_ranks::tell_case;
use seixo::ranks::Team;
use std::cell::Cell;
use std::sync::Arc;

/// How many processes the launcher started, as its environment tells.
fn processes() -> usize {
    let number = |name: &str| std::env::var(name).ok()?.parse::<usize>().ok();
    let launched = ["PMIX_RANK", "PMI_RANK"].into_iter().any(|name| number(name).is_some());
    let of_step = || number("SLURM_STEP_NUM_TASKS").or_else(|| number("SLURM_NTASKS")).filter(|_| launched);
    number("OMPI_COMM_WORLD_SIZE").or_else(|| number("PMI_SIZE")).or_else(of_step).unwrap_or(1)
}

/// The processes that this one is one of; nothing where it is alone.
///
/// # Errors
/// [`Error::Usage`] for many processes of a program that was built without MPI: each would compute the whole case.
#[cfg(not(feature = "mpi"))]
pub fn team() -> Result<Option<Arc<dyn Team>>> {
    match processes() {
        0 | 1 => Ok(None),
        many => Err(Error::usage(
            "ranks",
            format!(
                "this is one of {many} processes, but this seixo was built without MPI: build it with `--features mpi` \
                 (docs/howto-ranks.md), or run it without mpirun or srun"
            ),
        )),
    }
}

/// The processes that this one is one of, on MPI; nothing where it is alone.
///
/// # Errors
/// [`Error::Usage`] if MPI does not start.
#[cfg(feature = "mpi")]
pub fn team() -> Result<Option<Arc<dyn Team>>> {
    use self::mpi::{Processes, abort};
    if processes() < 2 {
        return Ok(None);
    }
    let started = Processes::start().ok_or_else(|| {
        Error::usage("ranks", "MPI does not start, or bears one thread only: another MPI library is needed")
    })?;
    if started.ranks() < 2 {
        let text = "the launcher started many processes, but MPI knows of one: seixo was built with another MPI library than \
                    that of this mpirun or srun";
        return Err(Error::usage("ranks", text));
    }
    // A rank that fails where the others do not takes all of them along: they would wait for it for ever.
    let told = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |why| {
        told(why);
        abort(101);
    }));
    Ok(Some(Arc::new(started)))
}

/// A rank's place on its machine.
#[derive(Clone, Copy)]
pub struct Place {
    /// Threads of this rank.
    pub threads: u16,
    /// Ranks on this machine.
    pub here: usize,
    /// All ranks.
    pub all: usize,
}

/// The place of this rank, with as many threads as were `asked` for, or its part of the cores that it shares with other ranks.
pub fn place(team: &Arc<dyn Team>, asked: Option<u16>) -> Place {
    let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
    let status = read("/proc/self/status");
    // Launchers bind ranks to cores of their own, or to cores that several share.
    let cores = status.lines().find(|line| line.starts_with("Cpus_allowed_list")).unwrap_or_default();
    let machine = read("/proc/sys/kernel/hostname");
    let own = format!("{}\n{cores}", machine.trim());
    let places = team.gather(own.clone().into_bytes());
    let sharing = places.iter().filter(|other| **other == own.as_bytes()).count();
    let of_machine = format!("{}\n", machine.trim());
    let here = places.iter().filter(|other| other.starts_with(of_machine.as_bytes())).count();
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let threads = asked.unwrap_or((cores / sharing).clamp(1, 1024) as u16);
    Place { threads, here, all: team.ranks() }
}

/// The first rank's word to the others: the case, or that there is none to compute.
pub struct Call<'a> {
    team: Option<&'a Arc<dyn Team>>,
    told: Cell<bool>,
}

impl<'a> Call<'a> {
    /// Nothing is told yet.
    pub fn new(team: Option<&'a Arc<dyn Team>>) -> Self {
        Self { team, told: Cell::new(team.is_none()) }
    }

    /// Have the others set up the case `text`.
    pub fn tell(&self, text: &str) {
        if let Some(team) = self.team {
            self.told.set(true);
            tell_case(&**team, Some(text));
        }
    }
}

impl Drop for Call<'_> {
    fn drop(&mut self) {
        if let Some(team) = self.team.filter(|_| !self.told.get()) {
            tell_case(&**team, None);
        }
    }
}

/// The part of a rank that is not the first; there is none without MPI.
#[cfg(not(feature = "mpi"))]
pub fn serve(_: &Arc<dyn Team>, _: u16, _: &Processor) -> super::Exit {
    Ok(0)
}

/// Ends all ranks; there are no others without MPI.
#[cfg(not(feature = "mpi"))]
pub fn end_all(_: &Error) {}

/// Ends all ranks, as the first one's device is lost.
#[cfg(feature = "mpi")]
pub fn end_all(error: &Error) {
    seixo::console::remark(&format!("error: {error}"));
    mpi::abort(error.exit_code());
}

/// The part of a rank that is not the first.
#[cfg(feature = "mpi")]
pub fn serve(team: &Arc<dyn Team>, threads: u16, processor: &Processor) -> super::Exit {
    use seixo::on_ranks::hear_case;
    let Some(text) = hear_case(&**team) else { return Ok(0) };
    let set_up = || {
        // Signals are for the first rank: it saves the state, for which it needs the others.
        std::mem::forget(super::signals::watch(true)?.attend());
        seixo::threads::start(Some(threads))?;
        Ok(seixo::case::file::parse("case", text, &[])?.0)
    };
    if let Err(error) = seixo::on_ranks::serve_on(team, processor, set_up) {
        seixo::console::remark(&format!("rank {}: {error}", team.rank()));
        mpi::abort(5);
    }
    Ok(0)
}
