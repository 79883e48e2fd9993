#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <tessera/tessera.h>

namespace tessera::python {

namespace py = pybind11;

// Each function adds its classes and functions to the module.
void add_machine(py::module_& module);  // Scene, Gpu, Settings, Device
void add_frame(py::module_& module);    // Frame

// A value of a key from Python's bool, int, float or str, or from any object that converts to a number. Throws TypeError.
Value value_of(py::handle object);
py::object object_of(const Value& value);

// Rows of dictionaries, for people, for pandas and for the stubs.
py::list key_rows(const std::vector<KeyDescription>& keys);

}  // namespace tessera::python
