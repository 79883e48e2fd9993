#include <mutex>
#include <optional>
#include <tuple>
#include <utility>

#include "python/bindings.h"

namespace tessera::python {
namespace {

using namespace py::literals;

// Turns an argument's name into a key: Python's names have no dots, so tile__width stands for tile.width. Both are accepted.
std::string key_of(const std::string& name) {
  std::string key = name;
  for (std::size_t at; (at = key.find("__")) != std::string::npos;) key.replace(at, 2, ".");
  return key;
}

// Sets the keys of a mapping. Nested mappings are groups of keys: {"tile": {"width": 16}} is {"tile.width": 16}.
template <class Machine>
void set_all(Machine& machine, const py::dict& values, const std::string& prefix = "") {
  for (const auto& [name, value] : values) {
    const std::string key = prefix + key_of(py::str(name));
    if (py::isinstance<py::dict>(value))
      set_all(machine, py::reinterpret_borrow<py::dict>(value), key + ".");
    else if (key != "preset")
      machine.set(key, value_of(value));
  }
}

// Takes a preset, a file, a mapping of keys with or without a "preset", or a machine.
Gpu gpu_of(const py::object& described) {
  if (described.is_none()) return Gpu();
  if (py::isinstance<Gpu>(described)) return described.cast<Gpu>();
  if (!py::isinstance<py::dict>(described)) return Gpu(py::str(described).cast<std::string>());
  const auto values = described.cast<py::dict>();
  Gpu gpu(values.contains("preset") ? py::str(values["preset"]).cast<std::string>() : "mid-mobile");
  set_all(gpu, values);
  return gpu;
}

Settings settings_of(const py::object& described) {
  if (described.is_none()) return Settings();
  if (py::isinstance<Settings>(described)) return described.cast<Settings>();
  Settings settings;
  set_all(settings, described.cast<py::dict>());
  return settings;
}

// A device for several Python threads: one renders at a time, and the others wait without holding Python's lock.
class SharedDevice {
 public:
  SharedDevice(const Scene& scene, const Gpu& gpu, const Settings& settings, const RenderOptions& options)
      : device_(scene, gpu, settings, options) {}

  Frame render(int frame) {
    std::optional<Frame> rendered;
    {
      const py::gil_scoped_release unlocked;
      const std::scoped_lock lock(mutex_);
      rendered = device_.render(frame);
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    return *std::move(rendered);
  }
  bool automatic_camera() const { return device_.automatic_camera(); }

 private:
  std::mutex mutex_;
  Device device_;
};

using RegionTuple = std::tuple<int, int, int, int>;

std::unique_ptr<SharedDevice> make_device(const Scene& scene, const py::object& gpu, const py::object& settings,
                                          int width, int height, const std::optional<RegionTuple>& region,
                                          bool auxiliary, bool resolve_auxiliary, std::uint64_t max_image_bytes,
                                          const py::kwargs& keys) {
  const Gpu machine = gpu_of(gpu);
  Settings choices = settings_of(settings);
  set_all(choices, keys);
  RenderOptions options;
  options.width = width;
  options.height = height;
  if (region) options.region = std::make_from_tuple<Region>(*region);
  options.auxiliary = auxiliary;
  options.resolve_auxiliary = resolve_auxiliary;
  options.max_image_bytes = max_image_bytes;
  const py::gil_scoped_release unlocked;
  return std::make_unique<SharedDevice>(scene, machine, choices, options);
}

// A word of a View from a text or a number: camera=1 is camera="1".
std::optional<std::string> word_of(const py::object& object) {
  if (object.is_none()) return std::nullopt;
  static_cast<void>(value_of(object));  // raises TypeError for any other type
  return py::str(object).cast<std::string>();
}

void add_scene(py::module_& module) {
  py::class_<Scene>(module, "Scene", "A capture: a scene and the way in which its file wants it drawn. Immutable.")
      .def(py::init([](const std::filesystem::path& file, std::uint64_t max_bytes, std::uint64_t max_file_bytes,
                       bool strict, std::optional<std::string> variant, const py::object& scene,
                       const py::object& camera, const py::object& animation, const py::object& orbit,
                       const py::object& lens, const py::object& shutter) {
             const View view{word_of(scene), word_of(camera), word_of(animation),
                             word_of(orbit), word_of(lens),   word_of(shutter)};
             const py::gil_scoped_release unlocked;
             return Scene(file, {max_bytes, max_file_bytes, strict, std::move(variant)}, view);
           }),
           py::arg("file"), py::kw_only(), py::arg("max_bytes") = ReadLimits().max_bytes,
           py::arg("max_file_bytes") = ReadLimits().max_file_bytes, py::arg("strict") = false,
           py::arg("variant") = py::none(), py::arg("scene") = py::none(), py::arg("camera") = py::none(),
           py::arg("animation") = py::none(), py::arg("orbit") = py::none(), py::arg("lens") = py::none(),
           py::arg("shutter") = py::none(),
           "Reads any glTF 2.0 asset (.gltf or .glb). A violation of glTF whose meaning is clear becomes one of the "
           "notices; with strict it raises InputError. variant: one of variants, whose materials are drawn. scene, "
           "camera, animation, orbit, lens, shutter: as the options of `tessera replay`; numbers may be numbers or "
           "text: camera=1, lens=\"0.1:3\". Raises InputError, UsageError for a name that the file lacks (the message "
           "lists its names), LimitError, SystemError.")
      .def_property_readonly("file", [](const Scene& scene) { return scene.file().string(); })
      .def_property_readonly("width", &Scene::width, "Width of the image that the file asks for, in pixels.")
      .def_property_readonly("height", &Scene::height)
      .def_property_readonly("frame_rate", &Scene::frame_rate, "Frames per second.")
      .def_property_readonly(
          "frames",
          [](const Scene& scene) {
            return py::module_::import("builtins")
                .attr("range")(scene.first_frame(), scene.first_frame() + scene.frame_count());
          },
          "The frames that the file asks for, as a range.")
      .def_property_readonly("variants", &Scene::variants, "Names of the file's variants of materials.")
      .def_property_readonly(
          "shadows",
          [](const Scene& scene) {
            py::list rows;
            for (const Shadow& shadow : scene.shadows()) {
              py::dict row;
              row["light"] = shadow.light;
              row["size"] = shadow.size;
              row["cascades"] = shadow.cascades;
              row["distance"] = shadow.distance;
              rows.append(std::move(row));
            }
            return rows;
          },
          "The lights that the file wants to cast shadows: light, size, cascades, distance.")
      .def_property_readonly(
          "passes", &Scene::passes,
          "Names of the passes that the file describes. A Device refuses passes that it does not render.")
      .def_property_readonly("notices", &Scene::notices,
                             "Messages about content that the reader skipped or assumed, one line each.");
}

// Adds the methods that Gpu and Settings share.
template <class Machine>
void add_keys(py::class_<Machine>& type) {
  type.def(
          "set",
          [](Machine& machine, const std::string& key, const py::object& value) {
            machine.set(key_of(key), value_of(value));
          },
          py::arg("key"), py::arg("value"), "Sets a key. Raises UsageError for an unknown key or a value out of range.")
      .def(
          "get", [](const Machine& machine, const std::string& key) { return object_of(machine.get(key_of(key))); },
          py::arg("key"))
      .def("__setitem__", [](Machine& machine, const std::string& key,
                             const py::object& value) { machine.set(key_of(key), value_of(value)); })
      .def("__getitem__",
           [](const Machine& machine, const std::string& key) { return object_of(machine.get(key_of(key))); })
      .def("json", &Machine::json, "All keys as JSON text.");
}

std::string with_keys(std::string head, const std::vector<KeyDescription>& keys) {
  head += "\n\nKeys:\n";
  for (const KeyDescription& key : keys) head += "  " + key.name + ": " + key.meaning + "\n";
  return head;
}

void add_gpu(py::module_& module) {
  static const std::string kDoc = with_keys(
      "The described machine. Gpu(\"small\", tile__width=16) is Gpu({\"preset\": \"small\", \"tile.width\": 16}): a "
      "preset, a JSON file or a dict, then keys; two underscores stand for the dot of a key.",
      Gpu::keys());
  py::class_<Gpu> type(module, "Gpu", kDoc.c_str());
  type.def(py::init([](const py::object& machine, const py::kwargs& keys) {
             Gpu gpu = gpu_of(machine);
             set_all(gpu, keys);
             return gpu;
           }),
           py::arg("machine") = "mid-mobile");
  type.def_static("from_json", &Gpu::from_json, py::arg("text"), "The same from JSON text.");
  type.def_static("presets", &Gpu::presets, "Names of the built-in machines.");
  add_keys(type);
}

void add_settings(py::module_& module) {
  static const std::string kDoc = with_keys(
      "How frames are rendered. Settings({\"shading.rate\": \"sample\"}) is Settings(shading__rate=\"sample\").",
      Settings::keys());
  py::class_<Settings> type(module, "Settings", kDoc.c_str());
  type.def(py::init([](const py::object& values, const py::kwargs& keys) {
             Settings settings = settings_of(values);
             set_all(settings, keys);
             return settings;
           }),
           py::arg("values") = py::none());
  add_keys(type);
}

void add_device(py::module_& module) {
  py::class_<SharedDevice>(module, "Device",
                           "The described machine with a scene in it. Different devices may render at once, each in a "
                           "thread; calls on one wait for each other.")
      .def(py::init(&make_device), py::arg("scene"), py::arg("gpu") = py::none(), py::arg("settings") = py::none(),
           py::kw_only(), py::arg("width") = 0, py::arg("height") = 0, py::arg("region") = py::none(),
           py::arg("auxiliary") = false, py::arg("resolve_auxiliary") = false,
           py::arg("max_image_bytes") = RenderOptions().max_image_bytes,
           "`gpu`: a Gpu or any value that Gpu() takes. `settings`: Settings or a dict; further keyword arguments are "
           "keys of Settings. `width`, `height`: size of the frame, 0 takes the scene's; `region`: (x, y, width, "
           "height) in the frame. `auxiliary` and `resolve_auxiliary`: further layers of the frame.")
      .def("render", &SharedDevice::render, py::arg("frame"),
           "Renders a frame; other Python threads run meanwhile. Ctrl-C takes effect when the frame is done.")
      .def_property_readonly(
          "automatic_camera", &SharedDevice::automatic_camera,
          "Whether the camera was made up, because the scene has none or camera=\"auto\" was given.");
}

}  // namespace

Value value_of(py::handle object) {
  if (py::isinstance<py::bool_>(object)) return object.cast<bool>();
  if (py::isinstance<py::str>(object)) return object.cast<std::string>();
  if (PyIndex_Check(object.ptr())) return object.cast<std::int64_t>();
  if (PyNumber_Check(object.ptr())) return object.cast<double>();
  throw py::type_error("a key's value is a bool, a number or a text");
}

py::object object_of(const Value& value) {
  return std::visit([](const auto& held) { return py::object(py::cast(held)); }, value);
}

py::list key_rows(const std::vector<KeyDescription>& keys) {
  py::list rows;
  for (const KeyDescription& key : keys) {
    rows.append(py::dict("key"_a = key.name, "type"_a = key.type, "unit"_a = key.unit,
                         "default"_a = object_of(key.default_value), "min"_a = key.min, "max"_a = key.max,
                         "choices"_a = key.choices, "meaning"_a = key.meaning, "source"_a = key.source));
  }
  return rows;
}

void add_machine(py::module_& module) {
  add_scene(module);
  add_gpu(module);
  add_settings(module);
  add_device(module);
}

}  // namespace tessera::python
