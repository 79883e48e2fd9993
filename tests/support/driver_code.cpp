// Prints the code that a Vulkan driver's compiler makes of a fragment shader, and its statistics, as
// VK_KHR_pipeline_executable_properties gives them. With RADV_FORCE_FAMILY=navi21 Mesa compiles for that GPU without
// one.
//
//   driver_code VERTEX.spv FRAGMENT.spv
//
// Ends with status 2 where no driver of the wanted kind is there.
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

#include <vulkan/vulkan.h>

// Called by the sanitizers' runtime: Mesa's driver keeps memory that it never frees.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libvulkan_radeon\n"; }

namespace {

void check(VkResult result, const char* what, int status = 1) {
  if (result == VK_SUCCESS || result == VK_INCOMPLETE) return;
  std::fprintf(stderr, "driver_code: %s: VkResult %d\n", what, static_cast<int>(result));
  std::exit(status);
}

struct Driver {
  VkInstance instance = VK_NULL_HANDLE;
  VkPhysicalDevice gpu = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
};

bool knows_its_code(VkPhysicalDevice gpu) {
  std::uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(gpu, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> all(count);
  vkEnumerateDeviceExtensionProperties(gpu, nullptr, &count, all.data());
  for (const VkExtensionProperties& one : all)
    if (std::strcmp(one.extensionName, VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME) == 0) return true;
  return false;
}

// The first GPU of RADV.
Driver open_driver() {
  Driver driver;
  VkApplicationInfo application{};
  application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  application.apiVersion = VK_API_VERSION_1_3;
  VkInstanceCreateInfo instance{};
  instance.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  instance.pApplicationInfo = &application;
  check(vkCreateInstance(&instance, nullptr, &driver.instance), "no Vulkan driver", 2);
  std::uint32_t count = 0;
  check(vkEnumeratePhysicalDevices(driver.instance, &count, nullptr), "devices", 2);
  std::vector<VkPhysicalDevice> gpus(count);
  check(vkEnumeratePhysicalDevices(driver.instance, &count, gpus.data()), "devices", 2);
  for (VkPhysicalDevice gpu : gpus) {
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(gpu, &properties);
    if (std::strstr(properties.deviceName, "RADV") == nullptr || !knows_its_code(gpu)) continue;
    std::printf("device %s\n", properties.deviceName);
    driver.gpu = gpu;
    break;
  }
  if (driver.gpu == VK_NULL_HANDLE) {
    std::fprintf(stderr, "driver_code: no device of RADV\n");
    std::exit(2);
  }
  VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR executable{};
  executable.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR;
  executable.pipelineExecutableInfo = VK_TRUE;
  VkPhysicalDeviceDynamicRenderingFeatures rendering{};
  rendering.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DYNAMIC_RENDERING_FEATURES;
  rendering.dynamicRendering = VK_TRUE;
  rendering.pNext = &executable;
  const float priority = 1.0f;
  VkDeviceQueueCreateInfo queue{};
  queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  const char* extension = VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME;
  VkDeviceCreateInfo device{};
  device.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  device.pNext = &rendering;
  device.queueCreateInfoCount = 1;
  device.pQueueCreateInfos = &queue;
  device.enabledExtensionCount = 1;
  device.ppEnabledExtensionNames = &extension;
  check(vkCreateDevice(driver.gpu, &device, nullptr, &driver.device), "device", 2);
  return driver;
}

VkShaderModule module_of(const Driver& driver, const char* file) {
  std::ifstream stream(file, std::ios::binary);
  std::vector<char> bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  std::vector<std::uint32_t> words(bytes.size() / 4);
  if (words.empty()) {
    std::fprintf(stderr, "driver_code: cannot read %s\n", file);
    std::exit(1);
  }
  std::memcpy(words.data(), bytes.data(), words.size() * 4);
  VkShaderModuleCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  info.codeSize = words.size() * 4;
  info.pCode = words.data();
  VkShaderModule shader = VK_NULL_HANDLE;
  check(vkCreateShaderModule(driver.device, &info, nullptr, &shader), file);
  return shader;
}

// A uniform buffer, six storage buffers and three textures, all of one set.
VkPipelineLayout layout_of(const Driver& driver) {
  std::array<VkDescriptorSetLayoutBinding, 10> bindings{};
  for (std::uint32_t i = 0; i < bindings.size(); ++i) {
    bindings[i].binding = i;
    bindings[i].descriptorType = i == 0  ? VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER
                                 : i < 7 ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER
                                         : VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
    bindings[i].descriptorCount = 1;
    bindings[i].stageFlags = VK_SHADER_STAGE_FRAGMENT_BIT;
  }
  VkDescriptorSetLayoutCreateInfo set_info{};
  set_info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  set_info.bindingCount = static_cast<std::uint32_t>(bindings.size());
  set_info.pBindings = bindings.data();
  VkDescriptorSetLayout set = VK_NULL_HANDLE;
  check(vkCreateDescriptorSetLayout(driver.device, &set_info, nullptr, &set), "set layout");
  VkPipelineLayoutCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  info.setLayoutCount = 1;
  info.pSetLayouts = &set;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  check(vkCreatePipelineLayout(driver.device, &info, nullptr, &layout), "layout");
  return layout;
}

// Colours of 32-bit floats, which take no conversion.
VkPipeline pipeline_of(const Driver& driver, const char* vertex, const char* fragment) {
  std::array<VkPipelineShaderStageCreateInfo, 2> stages{};
  for (std::size_t i = 0; i < 2; ++i) {
    stages[i].sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    stages[i].stage = i == 0 ? VK_SHADER_STAGE_VERTEX_BIT : VK_SHADER_STAGE_FRAGMENT_BIT;
    stages[i].module = module_of(driver, i == 0 ? vertex : fragment);
    stages[i].pName = "main";
  }
  const VkVertexInputBindingDescription binding{0, 40, VK_VERTEX_INPUT_RATE_VERTEX};
  const std::array<VkVertexInputAttributeDescription, 3> attributes = {{{0, 0, VK_FORMAT_R32G32B32A32_SINT, 0},
                                                                        {1, 0, VK_FORMAT_R32G32_SFLOAT, 16},
                                                                        {2, 0, VK_FORMAT_R32G32B32A32_SFLOAT, 24}}};
  VkPipelineVertexInputStateCreateInfo input{};
  input.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO;
  input.vertexBindingDescriptionCount = 1;
  input.pVertexBindingDescriptions = &binding;
  input.vertexAttributeDescriptionCount = 3;
  input.pVertexAttributeDescriptions = attributes.data();
  VkPipelineInputAssemblyStateCreateInfo assembly{};
  assembly.sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO;
  assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  const VkViewport viewport{0, 0, 64, 64, 0, 1};
  const VkRect2D scissor{{0, 0}, {64, 64}};
  VkPipelineViewportStateCreateInfo view{};
  view.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO;
  view.viewportCount = view.scissorCount = 1;
  view.pViewports = &viewport, view.pScissors = &scissor;
  VkPipelineRasterizationStateCreateInfo raster{};
  raster.sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO;
  raster.lineWidth = 1;
  VkPipelineMultisampleStateCreateInfo samples{};
  samples.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO;
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
  VkPipelineColorBlendAttachmentState attachment{};
  attachment.colorWriteMask = 15;
  VkPipelineColorBlendStateCreateInfo blend{};
  blend.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO;
  blend.attachmentCount = 1;
  blend.pAttachments = &attachment;
  const VkFormat format = VK_FORMAT_R32G32B32A32_SFLOAT;
  VkPipelineRenderingCreateInfo rendering{};
  rendering.sType = VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO;
  rendering.colorAttachmentCount = 1;
  rendering.pColorAttachmentFormats = &format;
  VkGraphicsPipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO;
  info.pNext = &rendering;
  info.flags =
      VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR | VK_PIPELINE_CREATE_CAPTURE_INTERNAL_REPRESENTATIONS_BIT_KHR;
  info.stageCount = 2;
  info.pStages = stages.data();
  info.pVertexInputState = &input;
  info.pInputAssemblyState = &assembly;
  info.pViewportState = &view;
  info.pRasterizationState = &raster;
  info.pMultisampleState = &samples;
  info.pColorBlendState = &blend;
  info.layout = layout_of(driver);
  VkPipeline pipeline = VK_NULL_HANDLE;
  check(vkCreateGraphicsPipelines(driver.device, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline), "pipeline");
  return pipeline;
}

void print_statistics(const Driver& driver, const VkPipelineExecutableInfoKHR& executable) {
  const auto get = reinterpret_cast<PFN_vkGetPipelineExecutableStatisticsKHR>(
      vkGetDeviceProcAddr(driver.device, "vkGetPipelineExecutableStatisticsKHR"));
  std::uint32_t count = 0;
  check(get(driver.device, &executable, &count, nullptr), "statistics");
  std::vector<VkPipelineExecutableStatisticKHR> all(count);
  for (auto& one : all) one = {}, one.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_STATISTIC_KHR;
  check(get(driver.device, &executable, &count, all.data()), "statistics");
  for (const auto& one : all)
    if (one.format == VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_UINT64_KHR)
      std::printf("statistic %s: %llu\n", one.name, static_cast<unsigned long long>(one.value.u64));
}

void print_code(const Driver& driver, const VkPipelineExecutableInfoKHR& executable) {
  const auto get = reinterpret_cast<PFN_vkGetPipelineExecutableInternalRepresentationsKHR>(
      vkGetDeviceProcAddr(driver.device, "vkGetPipelineExecutableInternalRepresentationsKHR"));
  std::uint32_t count = 0;
  check(get(driver.device, &executable, &count, nullptr), "code");
  std::vector<VkPipelineExecutableInternalRepresentationKHR> all(count);
  for (auto& one : all) one = {}, one.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INTERNAL_REPRESENTATION_KHR;
  check(get(driver.device, &executable, &count, all.data()), "code");
  std::vector<std::vector<char>> texts(count);
  for (std::uint32_t i = 0; i < count; ++i) texts[i].resize(all[i].dataSize + 1), all[i].pData = texts[i].data();
  check(get(driver.device, &executable, &count, all.data()), "code");
  for (std::uint32_t i = 0; i < count; ++i)
    if (std::strcmp(all[i].name, "Assembly") == 0) std::printf("%s\n", texts[i].data());
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) {
    std::fprintf(stderr, "driver_code VERTEX.spv FRAGMENT.spv\n");
    return 1;
  }
  const Driver driver = open_driver();
  const VkPipeline pipeline = pipeline_of(driver, arguments[1], arguments[2]);
  const auto get = reinterpret_cast<PFN_vkGetPipelineExecutablePropertiesKHR>(
      vkGetDeviceProcAddr(driver.device, "vkGetPipelineExecutablePropertiesKHR"));
  VkPipelineInfoKHR info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_INFO_KHR;
  info.pipeline = pipeline;
  std::uint32_t executables = 0;
  check(get(driver.device, &info, &executables, nullptr), "executables");
  std::vector<VkPipelineExecutablePropertiesKHR> all(executables);
  for (auto& one : all) one = {}, one.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_PROPERTIES_KHR;
  check(get(driver.device, &info, &executables, all.data()), "executables");
  for (std::uint32_t i = 0; i < executables; ++i) {
    if ((all[i].stages & VK_SHADER_STAGE_FRAGMENT_BIT) == 0) continue;
    VkPipelineExecutableInfoKHR executable{};
    executable.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INFO_KHR;
    executable.pipeline = pipeline;
    executable.executableIndex = i;
    print_statistics(driver, executable);
    print_code(driver, executable);
  }
  return 0;
}
