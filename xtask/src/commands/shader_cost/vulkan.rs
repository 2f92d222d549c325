//! A bare Vulkan device that compiles compute shaders and reports their statistics.
//!
//! wgpu cannot be used here: Mesa's null hardware has no working memory or queue, so wgpu considers
//! the device lost at once.

#![expect(
    unsafe_code,
    reason = "bare Vulkan is unsafe to call, and wgpu cannot be used"
)]

use std::ffi::{CStr, c_char};

use anyhow::{Context, bail};
use ash::{khr, vk};

/// Statistics of a compiled shader: name and value, in the driver's order.
pub(super) type Statistics = Vec<(String, u64)>;

/// A compiled shader.
pub(super) struct Compiled {
    pub(super) statistics: Statistics,
    /// The driver's assembly text of the shader.
    pub(super) text: String,
}

/// The bindings of a shader by descriptor set.
pub(super) type Bindings = Vec<Vec<(u32, vk::DescriptorType)>>;

/// A Vulkan device that compiles compute shaders.
pub(super) struct Compiler {
    instance: ash::Instance,
    device: ash::Device,
    properties: khr::pipeline_executable_properties::Device,
    name: String,
    driver: String,
    // Dropped last, since it unloads the library.
    _entry: ash::Entry,
}

impl Compiler {
    /// Opens the first device of the drivers that the environment names.
    pub(super) fn new() -> anyhow::Result<Self> {
        // SAFETY: the Vulkan loader has no precondition, and its library is trusted like any other.
        let entry =
            unsafe { ash::Entry::load() }.context("cannot load Vulkan: install libvulkan1")?;
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        // SAFETY: the structures outlive the call, and name no layer or extension.
        let instance = unsafe { entry.create_instance(&info, None) }
            .context("cannot make a Vulkan instance: is the driver installed?")?;
        // SAFETY: the instance is alive.
        let devices = unsafe { instance.enumerate_physical_devices() }?;
        let physical = *devices.first().context("the driver has no device")?;
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut about = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: the device belongs to this instance; the chain holds structures of Vulkan 1.2.
        unsafe { instance.get_physical_device_properties2(physical, &mut about) };
        let name = text(&about.properties.device_name);
        let driver = text(&driver.driver_info);
        let device = device(&instance, physical)
            .with_context(|| format!("{name}: it cannot report pipeline statistics"))?;
        let properties = khr::pipeline_executable_properties::Device::new(&instance, &device);
        Ok(Self {
            instance,
            device,
            properties,
            name,
            driver,
            _entry: entry,
        })
    }

    /// Returns the names of the device and its driver, with version.
    pub(super) fn description(&self) -> String {
        format!("{}, {}", self.name, self.driver)
    }

    /// Compiles a compute shader.
    pub(super) fn compile(
        &self,
        spirv: &[u32],
        entry_point: &CStr,
        bindings: &Bindings,
    ) -> anyhow::Result<Compiled> {
        let module = vk::ShaderModuleCreateInfo::default().code(spirv);
        // SAFETY: naga validated the module and wrote the words.
        let module = unsafe { self.device.create_shader_module(&module, None) }?;
        let result = self.compile_module(module, entry_point, bindings);
        // SAFETY: nothing uses the module any more.
        unsafe { self.device.destroy_shader_module(module, None) };
        result
    }

    fn compile_module(
        &self,
        module: vk::ShaderModule,
        entry_point: &CStr,
        bindings: &Bindings,
    ) -> anyhow::Result<Compiled> {
        let sets = bindings.iter().map(|set| self.set_layout(set));
        let sets = sets.collect::<Result<Vec<_>, _>>()?;
        let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
        // SAFETY: the set layouts are alive.
        let layout = unsafe { self.device.create_pipeline_layout(&layout, None) }?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(entry_point);
        let keep = vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR
            | vk::PipelineCreateFlags::CAPTURE_INTERNAL_REPRESENTATIONS_KHR;
        let info = vk::ComputePipelineCreateInfo::default()
            .flags(keep)
            .stage(stage)
            .layout(layout);
        let cache = vk::PipelineCache::null();
        // SAFETY: module and layout are alive, and the layout has all bindings of the shader.
        let result = unsafe { self.device.create_compute_pipelines(cache, &[info], None) };
        let pipeline = result
            .map_err(|(_, error)| error)
            .context("it does not compile")?[0];
        let result = self.read(pipeline);
        // SAFETY: all were created above, are no longer used, and the device runs nothing.
        unsafe {
            self.device.destroy_pipeline(pipeline, None);
            self.device.destroy_pipeline_layout(layout, None);
            sets.iter()
                .for_each(|set| self.device.destroy_descriptor_set_layout(*set, None));
        }
        result
    }

    fn set_layout(
        &self,
        set: &[(u32, vk::DescriptorType)],
    ) -> Result<vk::DescriptorSetLayout, vk::Result> {
        let binding = |&(binding, ty): &(u32, vk::DescriptorType)| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding)
                .descriptor_type(ty)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        };
        let bindings: Vec<_> = set.iter().map(binding).collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the bindings outlive the call.
        unsafe { self.device.create_descriptor_set_layout(&info, None) }
    }

    /// Reads the statistics of a pipeline's only shader.
    fn read(&self, pipeline: vk::Pipeline) -> anyhow::Result<Compiled> {
        let info = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline);
        // SAFETY: the pipeline was created with the flag to keep its statistics.
        let found = unsafe { self.properties.get_pipeline_executable_statistics(&info) }?;
        let statistics = found.iter().map(|s| (text(&s.name), value(s))).collect();
        Ok(Compiled {
            statistics,
            text: self.representations(&info)?,
        })
    }

    fn representations(&self, info: &vk::PipelineExecutableInfoKHR<'_>) -> anyhow::Result<String> {
        let get = self
            .properties
            .fp()
            .get_pipeline_executable_internal_representations_khr;
        let device = self.device.handle();
        let mut count = 0;
        // SAFETY: with a null pointer the call only writes the count.
        unsafe { get(device, info, &mut count, std::ptr::null_mut()) }.result()?;
        let mut list =
            vec![vk::PipelineExecutableInternalRepresentationKHR::default(); count as usize];
        // SAFETY: `list` has `count` elements; with null data each receives its size.
        unsafe { get(device, info, &mut count, list.as_mut_ptr()) }.result()?;
        let mut texts: Vec<_> = list.iter().map(|r| vec![0_u8; r.data_size]).collect();
        for (representation, text) in list.iter_mut().zip(&mut texts) {
            representation.p_data = text.as_mut_ptr().cast();
        }
        // SAFETY: each element now points to as many bytes as it asked for, which outlive the call.
        unsafe { get(device, info, &mut count, list.as_mut_ptr()) }.result()?;
        let assembly = list
            .iter()
            .zip(&texts)
            .filter(|(r, _)| text(&r.name).contains("ACO"));
        let assembly = assembly.map(|(_, text)| String::from_utf8_lossy(text).into_owned());
        Ok(assembly.collect())
    }
}

impl Drop for Compiler {
    fn drop(&mut self) {
        // SAFETY: everything created from the device is destroyed already; then goes the device
        // itself.
        unsafe {
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

/// Creates a device with one queue that can report pipeline statistics.
fn device(instance: &ash::Instance, physical: vk::PhysicalDevice) -> anyhow::Result<ash::Device> {
    let extensions = [khr::pipeline_executable_properties::NAME.as_ptr()];
    let queue = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
    let mut executables = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default()
        .pipeline_executable_info(true);
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queue)
        .enabled_extension_names(&extensions)
        .push_next(&mut executables);
    // SAFETY: the structures outlive the call; a missing extension is an error, not undefined.
    Ok(unsafe { instance.create_device(physical, &info, None) }?)
}

fn value(statistic: &vk::PipelineExecutableStatisticKHR<'_>) -> u64 {
    match statistic.format {
        // SAFETY: `format` says which member was written.
        vk::PipelineExecutableStatisticFormatKHR::UINT64 => unsafe { statistic.value.u64 },
        // SAFETY: as above.
        vk::PipelineExecutableStatisticFormatKHR::INT64 => unsafe { statistic.value.i64 as u64 },
        // SAFETY: as above.
        vk::PipelineExecutableStatisticFormatKHR::BOOL32 => unsafe { statistic.value.b32.into() },
        // SAFETY: as above.
        _ => unsafe { statistic.value.f64 as u64 },
    }
}

/// Converts a fixed-size, NUL-terminated string.
fn text(chars: &[c_char]) -> String {
    let bytes = chars.iter().take_while(|c| **c != 0).map(|c| *c as u8);
    String::from_utf8_lossy(&bytes.collect::<Vec<_>>()).into_owned()
}

/// Checks that the driver pretends to be the requested GPU.
pub(super) fn check_family(compiler: &Compiler, family: &str) -> anyhow::Result<()> {
    if !compiler
        .name
        .to_lowercase()
        .contains(&family.to_lowercase())
    {
        bail!(
            "the driver made {} instead of {family}: is its name misspelled?",
            compiler.name
        );
    }
    Ok(())
}
