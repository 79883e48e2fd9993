#include "python/bindings.h"

namespace tessera::python {
namespace {

using namespace py::literals;

Eye eye_of(const std::string& name) {
  if (name == "left") return Eye::kLeft;
  if (name == "right") return Eye::kRight;
  throw UsageError("eye: left or right");
}

// Makes a read-only array over memory that `owner` keeps alive.
template <class T>
py::array array_over(const T* values, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides,
                     const py::object& owner) {
  py::array array(py::dtype::of<T>(), std::move(shape), std::move(strides), values, owner);
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

// Shape (height, width, channels); with one channel (height, width).
template <class T>
py::array image_array(const ImageView<T>& image, const py::object& owner) {
  constexpr py::ssize_t kBytes = sizeof(T);
  std::vector<py::ssize_t> shape = {image.height, image.width};
  std::vector<py::ssize_t> strides = {image.width * image.channels * kBytes, image.channels * kBytes};
  if (image.channels > 1) {
    shape.push_back(image.channels);
    strides.push_back(kBytes);
  }
  return array_over(image.values.data(), shape, strides, owner);
}

py::dict tile_maps(const py::object& self) {
  constexpr py::ssize_t kBytes = sizeof(std::uint64_t);
  py::dict maps;
  for (const TileMap& map : self.cast<const Frame&>().tile_maps()) {
    const auto tile = static_cast<py::ssize_t>(map.stride) * kBytes;
    maps[py::str(map.name)] = array_over(map.first, {map.rows, map.columns}, {map.columns * tile, tile}, self);
  }
  return maps;
}

// A row for each tile: its position and all its counts.
py::list tiles(const Frame& frame) {
  const std::vector<TileMap>& maps = frame.tile_maps();
  py::list rows;
  for (int y = 0; y < maps.front().rows; ++y)
    for (int x = 0; x < maps.front().columns; ++x) {
      py::dict row("x"_a = maps.front().x0 + x * maps.front().tile_width,
                   "y"_a = maps.front().y0 + y * maps.front().tile_height);
      for (const TileMap& map : maps) row[py::str(map.name)] = map.at(x, y);
      rows.append(row);
    }
  return rows;
}

py::list tile_map_rows(const Frame& frame) {
  py::list rows;
  for (const TileMap& map : frame.tile_maps()) {
    rows.append(
        py::dict("name"_a = map.name, "unit"_a = map.unit, "meaning"_a = map.meaning, "counter"_a = map.counter));
  }
  return rows;
}

// A row for each drawable: its identity and all its costs.
py::list drawables(const Frame& frame) {
  py::list rows;
  for (const DrawableCost& drawable : frame.drawables()) {
    py::dict row("node"_a = drawable.node, "node_name"_a = drawable.node_name, "mesh"_a = drawable.mesh,
                 "mesh_name"_a = drawable.mesh_name, "primitive"_a = drawable.primitive,
                 "material"_a = drawable.material, "material_name"_a = drawable.material_name,
                 "instances"_a = drawable.instances, "base_patches"_a = drawable.base_patches);
    for (const auto& [name, value] : drawable.costs) row[py::str(name)] = value;
    rows.append(row);
  }
  return rows;
}

py::list traffic_rows(const std::vector<TrafficRow>& traffic) {
  py::list rows;
  for (const TrafficRow& moved : traffic) {
    rows.append(py::dict("unit"_a = moved.unit, "purpose"_a = moved.purpose, "read_bytes"_a = moved.read_bytes,
                         "written_bytes"_a = moved.written_bytes));
  }
  return rows;
}

py::list traffic(const Frame& frame) { return traffic_rows(frame.traffic()); }

py::list passes(const Frame& frame) {
  py::list rows;
  for (const FramePass& pass : frame.passes())
    rows.append(py::dict("name"_a = pass.name, "begin_cycles"_a = pass.begin_cycles, "end_cycles"_a = pass.end_cycles,
                         "counters"_a = pass.counters, "traffic"_a = traffic_rows(pass.traffic)));
  return rows;
}

py::object timing(const Frame& frame) {
  if (!frame.timing()) return py::none();
  return py::dict("cycles"_a = frame.timing()->cycles, "latency_cycles"_a = frame.timing()->latency_cycles,
                  "busy_cycles"_a = frame.timing()->busy_cycles, "bound_by"_a = frame.timing()->bound_by,
                  "bound_by_cycles"_a = frame.timing()->bound_by_cycles);
}

py::object energy(const Frame& frame) {
  if (!frame.energy()) return py::none();
  return py::dict("total_nj"_a = frame.energy()->total_nj, "by_unit_nj"_a = frame.energy()->by_unit_nj);
}

py::object area(const Frame& frame) {
  if (!frame.area()) return py::none();
  return py::dict("total_mm2"_a = frame.area()->total_mm2, "by_unit_mm2"_a = frame.area()->by_unit_mm2);
}

}  // namespace

void add_frame(py::module_& module) {
  py::class_<Frame>(module, "Frame", "A rendered frame. Arrays are read-only views of it, not copies.")
      .def_property_readonly("number", &Frame::number)
      .def_property_readonly("has_right_eye", &Frame::has_right_eye)
      .def_property_readonly("layers", &Frame::layers, "Names that image() takes.")
      .def(
          "image",
          [](const py::object& self, const std::string& layer, const std::string& eye) {
            return image_array(self.cast<const Frame&>().image(layer, eye_of(eye)), self);
          },
          py::arg("layer") = "color", py::arg("eye") = "left",
          "(height, width, channels) or (height, width) of float32; \"color\" is linear RGB and coverage.")
      .def(
          "display",
          [](const py::object& self, const std::string& eye) {
            return image_array(self.cast<const Frame&>().display(eye_of(eye)), self);
          },
          py::arg("eye") = "left", "(height, width, 3) of uint8: the frame as a screen shows it.")
      .def(
          "patches",
          [](const py::object& self, const std::string& eye) {
            return image_array(self.cast<const Frame&>().patches(eye_of(eye)), self);
          },
          py::arg("eye") = "left", "(height, width) of uint32: base patch + 1; with auxiliary=True.")
      .def_property_readonly("counters", &Frame::counters, "\"unit.event\" -> count.")
      .def_property_readonly("traffic", &traffic, "Bytes over the memory interface: a dict per unit and purpose.")
      .def_property_readonly("passes", &passes, "A dict per pass: name, begin_cycles, end_cycles, counters, traffic.")
      .def_property_readonly("timing", &timing,
                             "cycles, latency_cycles, busy_cycles, bound_by, bound_by_cycles; or None.")
      .def_property_readonly("energy", &energy, "total_nj, by_unit_nj; or None.")
      .def_property_readonly("area", &area, "Area of the machine: total_mm2, by_unit_mm2; or None.")
      .def_property_readonly("tile_maps", &tile_maps, "Name -> (rows, columns) of uint64: the work of every tile.")
      .def_property_readonly("tile_map_descriptions", &tile_map_rows, "A dict per map: name, unit, meaning, counter.")
      .def_property_readonly("tiles", &tiles, "A dict per tile: x, y in pixels and all its counts.")
      .def_property_readonly("drawables", &drawables,
                             "A dict per drawable: node, mesh, primitive, material and its costs in the tile cores.")
      .def_property_readonly("effects", &Frame::effects, "Effect -> whether it ran.")
      .def_property_readonly("host_seconds", &Frame::host_seconds)
      .def_property_readonly("stage_seconds", &Frame::stage_seconds);
}

}  // namespace tessera::python
