//! `adapters`: the GPUs that could bake.

use aogrid_baker_gpu::wgpu::AdapterInfo;
use serde::Serialize;

use crate::console::Console;

/// List the GPUs of this machine, the preferred one first
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Report as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// The examples at the end of `adapters --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid adapters
  aogrid adapters --json";

#[derive(Serialize)]
struct Report {
    adapters: Vec<Adapter>,
}

#[derive(Serialize)]
struct Adapter {
    name: String,
    /// `discrete`, `integrated`, `virtual`, `software` or `other`.
    kind: &'static str,
    api: String,
    driver: String,
    /// Whether the adapter is used without being named.
    auto: bool,
}

impl Adapter {
    fn new(info: AdapterInfo) -> Self {
        use aogrid_baker_gpu::wgpu::DeviceType;
        let (kind, auto) = match info.device_type {
            DeviceType::DiscreteGpu => ("discrete", true),
            DeviceType::IntegratedGpu => ("integrated", true),
            DeviceType::VirtualGpu => ("virtual", true),
            DeviceType::Cpu => ("software", false),
            DeviceType::Other => ("other", false),
        };
        Self {
            kind,
            auto,
            api: format!("{:?}", info.backend),
            driver: format!("{} {}", info.driver, info.driver_info)
                .trim()
                .into(),
            name: info.name,
        }
    }
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let adapters = aogrid_baker_gpu::adapters().into_iter();
    let report = Report {
        adapters: adapters.map(Adapter::new).collect(),
    };
    if args.json {
        return console.json(&report);
    }
    for Adapter {
        name,
        kind,
        api,
        driver,
        auto,
    } in &report.adapters
    {
        let only = if *auto {
            ""
        } else {
            "; used only if --adapter names it"
        };
        console.result(&format!("{name} ({kind}, {api}, {driver}{only})"));
    }
    if report.adapters.is_empty() {
        console.note("no GPU was found: models are baked on the CPU");
    }
    Ok(())
}
