//! `shader-cost`: statistics of the shaders from a real GPU's compiler, without that GPU.

mod kernels;
mod vulkan;

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail};
use ash::vk;
use naga::{back, front, valid};

use aogrid::console::Console;
use kernels::{Kernel, PASSES};
use vulkan::{Bindings, Compiled, Compiler};

/// Compile the shaders for a Radeon GPU, which need not be present, and print their cost
///
/// The figures are static, from Mesa's compiler: a loop counts once, memory bandwidth not at all.
/// The inverse throughput of a short shader is dominated by its latency: use the cost of one more
/// occluder, the slope, instead.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// GPU family, by Mesa's name
    #[arg(long, default_value = FAMILY, value_name = "NAME")]
    family: String,
    /// Also measure this compute shader: a WGSL file and an entry point in it
    #[arg(long, value_name = "FILE:ENTRY")]
    shader: Vec<String>,
}

/// The examples at the end of `shader-cost --help`.
const EXAMPLES: &str = "\
Examples:
  cargo xtask shader-cost
  cargo xtask shader-cost --family navi10
  cargo xtask shader-cost --shader my-shader.wgsl:main";

/// Mesa's name of an RDNA 2 GPU, the default.
const FAMILY: &str = "navi21";

/// The variable that makes Mesa's driver pretend to be a GPU; set for the child process.
const FAMILY_VARIABLE: &str = "RADV_FORCE_FAMILY";

/// The folder of driver manifests in Linux distributions.
const MANIFEST_FOLDER: &str = "/usr/share/vulkan/icd.d";

/// Numbers of passes between which the slope is taken. Beyond the first few passes, one-time work
/// and memory latency no longer matter.
const SLOPE_COUNTS: [u32; 2] = [4, 12];

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let shaders = args.shader.iter().map(|argument| from_file(argument));
    let shaders = shaders.collect::<anyhow::Result<Vec<_>>>()?;
    if std::env::var_os(FAMILY_VARIABLE).is_none() {
        return run_with_null_hardware(&args.family);
    }
    let compiler = Compiler::new()?;
    vulkan::check_family(&compiler, &args.family)?;
    console.result(&format!(
        "{}; all figures are static",
        compiler.description()
    ));
    console.result(&Row::header());
    for pass in &PASSES {
        let one = cost(&compiler, &pass.repeated(1))?;
        let ends = SLOPE_COUNTS.map(|count| cost(&compiler, &pass.repeated(count)));
        let [few, many] = ends;
        let row = Row {
            name: pass.name.to_owned(),
            slope: Some(slope(&few?, &many?)),
            cost: one,
        };
        console.result(&row.line());
    }
    let kernels = kernels::tiled().into_iter().chain(kernels::lights());
    for kernel in kernels.chain(bake_kernels()).chain(shaders) {
        let row = Row {
            cost: cost(&compiler, &kernel)?,
            name: kernel.name,
            slope: None,
        };
        console.result(&row.line());
    }
    Ok(())
}

/// Returns the kernels of GPU bakes; the naive reference kernel comes last.
fn bake_kernels() -> Vec<Kernel> {
    let kernel = |shader: aogrid_baker_gpu::Shader| Kernel {
        name: shader.name.to_owned(),
        wgsl: shader.source,
        entry_point: shader.entry_point.to_owned(),
        constants: Default::default(),
    };
    aogrid_baker_gpu::shaders()
        .into_iter()
        .map(kernel)
        .collect()
}

/// Runs this command again in a child process with Mesa's null hardware; drivers read the
/// environment when they are loaded.
fn run_with_null_hardware(family: &str) -> anyhow::Result<()> {
    let mut command = Command::new(std::env::current_exe()?);
    command
        .args(std::env::args_os().skip(1))
        .env(FAMILY_VARIABLE, family)
        .env("VK_ICD_FILENAMES", manifest()?)
        // Pipelines from the cache have no statistics.
        .env("MESA_SHADER_CACHE_DISABLE", "true");
    let status = command.status()?;
    std::process::exit(status.code().unwrap_or(1));
}

/// Returns the manifest of Mesa's Radeon driver.
fn manifest() -> anyhow::Result<PathBuf> {
    let missing =
        || format!("{MANIFEST_FOLDER}: no Radeon driver there: install mesa-vulkan-drivers");
    let entries = std::fs::read_dir(MANIFEST_FOLDER).with_context(missing)?;
    let mut paths = entries.filter_map(|entry| entry.ok().map(|e| e.path()));
    paths
        .find(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with("radeon_icd") && name.ends_with(".json")
        })
        .with_context(missing)
}

/// Static costs of one compiled shader.
struct Cost {
    instructions: u64,
    vgprs: u64,
    scratch: u64,
    /// Bytes of workgroup memory.
    lds: u64,
    /// Number of subgroups that a SIMD unit can hold.
    waves: u64,
    latency: u64,
    inverse_throughput: u64,
    fetches: usize,
}

/// Instructions and inverse throughput of one more occluder.
type Slope = [f64; 2];

fn slope(few: &Cost, many: &Cost) -> Slope {
    let passes = f64::from(SLOPE_COUNTS[1] - SLOPE_COUNTS[0]);
    let per_pass = |few: u64, many: u64| (many as f64 - few as f64) / passes;
    [
        per_pass(few.instructions, many.instructions),
        per_pass(few.inverse_throughput, many.inverse_throughput),
    ]
}

struct Row {
    name: String,
    cost: Cost,
    slope: Option<Slope>,
}

impl Row {
    fn header() -> String {
        format!(
            "{:<38} {:>12} {:>6} {:>8} {:>6} {:>6} {:>8} {:>8} {:>8}   one more occluder",
            "", "instructions", "VGPRs", "scratch", "LDS", "waves", "fetches", "latency", "inverse"
        )
    }

    fn line(&self) -> String {
        let Cost {
            instructions,
            vgprs,
            scratch,
            lds,
            waves,
            latency,
            inverse_throughput,
            fetches,
        } = self.cost;
        let slope = self.slope.map_or(String::new(), |[instructions, inverse]| {
            format!("   {instructions:.1} instructions, {inverse:.1} inverse throughput")
        });
        format!(
            "{:<38} {instructions:>12} {vgprs:>6} {scratch:>8} {lds:>6} {waves:>6} {fetches:>8} {latency:>8} \
             {inverse_throughput:>8}{slope}",
            self.name
        )
    }
}

fn cost(compiler: &Compiler, kernel: &Kernel) -> anyhow::Result<Cost> {
    let explain = || format!("{}: cannot be compiled", kernel.name);
    let (spirv, bindings) = spirv(kernel).with_context(explain)?;
    let entry_point = CString::new(kernel.entry_point.as_str())?;
    let compiled = compiler
        .compile(&spirv, &entry_point, &bindings)
        .with_context(explain)?;
    read(&compiled).with_context(explain)
}

fn read(compiled: &Compiled) -> anyhow::Result<Cost> {
    let find = |name: &str| {
        let found = compiled.statistics.iter().find(|(n, _)| n == name);
        let (_, value) = found.with_context(|| {
            let names: Vec<_> = compiled
                .statistics
                .iter()
                .map(|(n, _)| n.as_str())
                .collect();
            format!(
                "the driver does not say `{name}`, only {}",
                names.join(", ")
            )
        })?;
        anyhow::Ok(*value)
    };
    Ok(Cost {
        instructions: find("Instructions")?,
        vgprs: find("VGPRs")?,
        scratch: find("Scratch size")?,
        lds: find("LDS size")?,
        waves: find("Subgroups per SIMD")?,
        latency: find("Latency")?,
        inverse_throughput: find("Inverse Throughput")?,
        fetches: fetches(&compiled.text),
    })
}

/// Counts texture reads, filtered or not, in the compiler's assembly text.
fn fetches(text: &str) -> usize {
    let is_fetch = |line: &&str| line.contains("image_sample") || line.contains("image_load");
    text.lines().filter(is_fetch).count()
}

/// Compiles WGSL to SPIR-V like wgpu for a driver with robust image access.
fn spirv(kernel: &Kernel) -> anyhow::Result<(Vec<u32>, Bindings)> {
    let module = front::wgsl::parse_str(&kernel.wgsl)
        .map_err(|e| anyhow::anyhow!(e.emit_to_string(&kernel.wgsl)))?;
    let all = valid::Capabilities::all();
    let info = valid::Validator::new(valid::ValidationFlags::all(), all).validate(&module)?;
    let named = kernel.constants.iter();
    let constants = named.map(|(name, value)| ((*name).to_owned(), *value));
    let (module, info) =
        back::pipeline_constants::process_overrides(&module, &info, None, &constants.collect())?;
    let options = back::spv::Options {
        lang_version: (1, 3),
        // Our shaders initialize the workgroup memory that they read.
        zero_initialize_workgroup_memory: back::spv::ZeroInitializeWorkgroupMemoryMode::None,
        ..Default::default()
    };
    let pipeline = back::spv::PipelineOptions {
        shader_stage: naga::ShaderStage::Compute,
        entry_point: kernel.entry_point.clone(),
    };
    let words = back::spv::write_vec(&module, &info, &options, Some(&pipeline))?;
    Ok((words, bindings(&module)?))
}

/// Returns the descriptors that a module binds.
fn bindings(module: &naga::Module) -> anyhow::Result<Bindings> {
    let mut sets = Bindings::new();
    for (_, variable) in module.global_variables.iter() {
        let Some(slot) = variable.binding else {
            continue;
        };
        let group = slot.group as usize;
        if sets.len() <= group {
            sets.resize(group + 1, Vec::new());
        }
        sets[group].push((slot.binding, descriptor_type(module, variable)?));
    }
    Ok(sets)
}

fn descriptor_type(
    module: &naga::Module,
    variable: &naga::GlobalVariable,
) -> anyhow::Result<vk::DescriptorType> {
    use naga::{AddressSpace, ImageClass, TypeInner};
    Ok(match (&module.types[variable.ty].inner, variable.space) {
        (_, AddressSpace::Uniform) => vk::DescriptorType::UNIFORM_BUFFER,
        (_, AddressSpace::Storage { .. }) => vk::DescriptorType::STORAGE_BUFFER,
        (TypeInner::Sampler { .. }, _) => vk::DescriptorType::SAMPLER,
        (
            TypeInner::Image {
                class: ImageClass::Storage { .. },
                ..
            },
            _,
        ) => vk::DescriptorType::STORAGE_IMAGE,
        (TypeInner::Image { .. }, _) => vk::DescriptorType::SAMPLED_IMAGE,
        _ => bail!("a binding is neither buffer, texture nor sampler"),
    })
}

/// Reads the user's compute shader, named `FILE:ENTRY`.
fn from_file(argument: &str) -> anyhow::Result<Kernel> {
    let (path, entry_point) = argument
        .rsplit_once(':')
        .with_context(|| format!("{argument}: name a file and an entry point, FILE:ENTRY"))?;
    let wgsl = std::fs::read_to_string(Path::new(path))
        .with_context(|| format!("{path}: cannot read it"))?;
    Ok(Kernel {
        name: argument.to_owned(),
        wgsl,
        entry_point: entry_point.to_owned(),
        constants: vec![],
    })
}
