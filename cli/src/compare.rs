//! `seixo compare`.

use super::setup::Setup;
use super::{CaseArgs, Exit};
use seixo::console::{say_json, tell};
use seixo::plan::ContactPlan;
use seixo_study::device_compare::{Drift, StageError, compare_stages, drift};

#[derive(Debug, clap::Args)]
pub struct CompareArgs {
    #[command(flatten)]
    case: CaseArgs,
    /// Number of the adapter as `seixo adapters` lists it, or a part of its name; the best one if absent.
    #[arg(long, value_name = "N")]
    adapter: Option<String>,
    /// Steps over which the drift is followed; 0 leaves it out.
    #[arg(long, value_name = "N", default_value_t = 20)]
    steps: u64,
    /// Steps on the CPU before the stages are compared, so that the state is more than the lattice.
    #[arg(long, value_name = "N", default_value_t = 0)]
    warmup: u64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Report {
    case: String,
    warmup: u64,
    stages: Vec<StageError>,
    /// Why contact is where it is.
    #[serde(skip)]
    contact: String,
    drift: Option<Drift>,
}

pub fn compare(args: &CompareArgs) -> Exit {
    seixo::threads::start(None)?;
    let setup = Setup::new(&args.case, args.json)?;
    let (case, scene, adapter) = (&setup.loaded.case, &setup.scene, args.adapter.as_deref());
    let report = Report {
        case: setup.name.clone(),
        warmup: args.warmup,
        stages: compare_stages(case, scene, adapter, args.warmup)?,
        contact: ContactPlan::on_device(case, scene).reason,
        drift: if args.steps > 0 { Some(drift(case, scene, adapter, args.steps)?) } else { None },
    };
    if args.json {
        say_json(&report);
    } else {
        tell(&words(&report));
    }
    Ok(u8::from(!report.stages.iter().all(StageError::is_explained)))
}

/// What the differences say.
fn verdict(stages: &[StageError]) -> Option<String> {
    let beyond: Vec<&StageError> = stages.iter().filter(|s| !s.is_explained()).collect();
    (!stages.is_empty()).then(|| match beyond.first() {
        None => "  all are such as single precision and the tolerance of the solve make".to_owned(),
        Some(s) => format!(
            "  {} of {} are larger than single precision and the tolerance of the solve make them, {} of {} first",
            beyond.len(),
            stages.len(),
            s.field,
            s.stage
        ),
    })
}

fn words(report: &Report) -> String {
    let mut lines =
        vec![format!("one step of {} after {} steps, GPU against CPU", report.case, report.warmup)];
    if report.stages.is_empty() {
        lines.push(format!(
            "  a dry scene has no stages on the GPU but contact, and that is the host's: {}",
            report.contact
        ));
    } else {
        lines.push(format!(
            "  {:<20}{:<16}{:>10}{:>10}{:>12}",
            "stage", "field", "largest", "rms", "rms may be"
        ));
    }
    lines.extend(report.stages.iter().map(|s| {
        let mark = if s.is_explained() { "" } else { "  <-" };
        format!(
            "  {:<20}{:<16}{:>10.1e}{:>10.1e}{:>12.0e}{mark}",
            s.stage, s.field, s.max_relative, s.l2_relative, s.bound
        )
    }));
    lines.extend(verdict(&report.stages));
    if let Some(drift) = &report.drift {
        lines.push(format!("\n{} steps from the start", drift.steps));
        lines.push(format!("  {:<28}{:>16}{:>16}{:>10}", "quantity", "CPU", "GPU", "relative"));
        lines.extend(
            drift
                .quantities
                .iter()
                .map(|q| format!("  {:<28}{:>16.8e}{:>16.8e}{:>10.1e}", q.name, q.cpu, q.gpu, q.relative)),
        );
        for k in 0..2 {
            let step = drift.seconds[k] / drift.steps.max(1) as f64;
            let iterations = drift.iterations[k];
            lines.push(format!(
                "  {:.3} s, {step:.3e} s a step, {iterations:.1} iterations a solve: {}",
                drift.seconds[k], drift.backends[k]
            ));
        }
    }
    lines.join("\n")
}
