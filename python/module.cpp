#include "python/bindings.h"

// The module tessera._tessera, whose names python/tessera/__init__.py exports as tessera.
namespace tessera::python {
namespace {

using namespace py::literals;

// Registers Python's exceptions of the same names: tessera.Error and its subclasses. More general ones come first,
// since they are tried last.
void add_errors(py::module_& module) {
  const auto error = py::register_exception<Error>(module, "Error", PyExc_RuntimeError);
  error.doc() = "Base class of all errors of Tessera.";
  py::register_exception<InputError>(module, "InputError", error).doc() =
      "Bad input: names the file, the place in it and the fault.";
  py::register_exception<LimitError>(module, "LimitError", error).doc() = "A stated resource limit would be exceeded.";
  py::register_exception<UsageError>(module, "UsageError", error).doc() =
      "Unknown key, impossible value, missing argument.";
  const auto system = py::register_exception<SystemError>(module, "SystemError", error);
  system.doc() = "The operating system refused something: permission denied, file vanished.";
  py::register_exception<WriteError>(module, "WriteError", system).doc() = "A result could not be written.";
}

py::list counter_rows() {
  py::list rows;
  for (const CounterDescription& counter : counter_descriptions()) {
    rows.append(py::dict("name"_a = counter.name, "unit"_a = counter.unit, "over_frames"_a = counter.over_frames,
                         "meaning"_a = counter.meaning, "vendor"_a = counter.vendor));
  }
  return rows;
}

}  // namespace

PYBIND11_MODULE(_tessera, module) {
  const py::object real_name = module.attr("__name__");
  module.attr("__name__") = "tessera";  // the module name that classes report
  add_errors(module);
  add_frame(module);
  add_machine(module);
  module.def(
      "gpu_keys", [] { return key_rows(Gpu::keys()); },
      "Every key of Gpu: dicts of key, type, unit, default, min, max, choices, meaning, source.");
  module.def(
      "settings_keys", [] { return key_rows(Settings::keys()); }, "The same for Settings.");
  module.def("counter_descriptions", &counter_rows,
             "Every counter that a frame can have: dicts of name, unit, over_frames, meaning, vendor.");
  module.def("simd_target", &simd_target, "The instruction set that kernels use; chosen once per process.");
  module.attr("__version__") = version();
  module.attr("__name__") = real_name;
}

}  // namespace tessera::python
