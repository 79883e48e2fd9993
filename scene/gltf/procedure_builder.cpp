#include "scene/gltf/procedure_builder.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "scene/gltf/accessor_layout.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;
using shaders::ParameterDeclaration;
using shaders::ParameterLayout;
using shaders::StageDeclaration;

constexpr const char* kExtension = "TESSERA_procedure";
constexpr std::size_t kMaxCurves = 64;  // of a chain

// ---- Checks -----------------------------------------------------------------------------------------------------

const StageDeclaration* find_stage(std::span<const StageDeclaration> stages, const json& name) {
  if (!name.is_string()) return nullptr;
  for (const StageDeclaration& stage : stages)
    if (stage.name == name.get_ref<const std::string&>()) return &stage;
  return nullptr;
}

void check_number(const ParameterDeclaration& p, const json& value, const Place& place) {
  if (!value.is_number()) place.refuse("is not a number");
  const double v = value.get<double>();
  if (!(v >= static_cast<double>(p.min) && v <= static_cast<double>(p.max)))
    place.refuse("is {}, outside [{:g}, {:g}]", v, p.min, p.max);
}

void check_parameter(const ParameterDeclaration& p, const json& value, const Place& place) {
  if (p.layout == ParameterLayout::kNumbers && p.size == 1) return check_number(p, value, place);
  if (!value.is_array()) place.refuse("is not an array");
  if (p.layout == ParameterLayout::kNumbers) {
    if (value.size() != static_cast<std::size_t>(p.size))
      place.refuse("has {} numbers, needs {}", value.size(), p.size);
    for (std::size_t i = 0; i < value.size(); ++i) check_number(p, value[i], place.at(i));
    return;
  }
  if (value.size() < 4 || value.size() % 3 != 1 || value.size() > 3 * kMaxCurves + 1)
    place.refuse("has {} points; a chain of cubic curves has 3 n + 1, n from 1 to {}", value.size(), kMaxCurves);
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (!value[i].is_array() || value[i].size() != 2) place.at(i).refuse("is not a point of two numbers");
    for (std::size_t k = 0; k < 2; ++k) check_number(p, value[i][k], place.at(i).at(k));
  }
}

// Members of `object` are the stage's parameters, besides `apart`.
void check_parameters(const StageDeclaration& stage, const json& object, std::string_view apart, const Place& place) {
  if (!object.is_object()) place.refuse("is not an object");
  for (const auto& [name, value] : object.items()) {
    if (name == apart || name == "extensions" || name == "extras") continue;
    const auto found = std::find_if(stage.parameters.begin(), stage.parameters.end(),
                                    [&, &wanted = name](const ParameterDeclaration& p) { return p.name == wanted; });
    if (found == stage.parameters.end()) place.at(name).refuse("is no parameter of '{}'", stage.name);
    check_parameter(*found, value, place.at(name));
  }
  for (const ParameterDeclaration& p : stage.parameters)
    if (p.required() && !object.contains(p.name)) place.refuse("lacks the parameter '{}'", p.name);
}

// Chains along one parameter have one number of curves.
void check_chains(const StageDeclaration& shape, const json& parameters, const Place& place) {
  for (const ParameterLayout layout : {ParameterLayout::kChainU, ParameterLayout::kChainV}) {
    const ParameterDeclaration* first = nullptr;
    for (const ParameterDeclaration& p : shape.parameters) {
      if (p.layout != layout) continue;
      if (first == nullptr) first = &p;
      const std::size_t points = parameters[std::string(p.name)].size(),
                        others = parameters[std::string(first->name)].size();
      if (points != others)
        place.at(std::string(p.name)).refuse("has {} points, the chain '{}' has {}", points, first->name, others);
    }
  }
}

// A texture or shading model: {key: name, parameters...}.
void check_stage(std::span<const StageDeclaration> stages, const json& object, const char* key, const Place& place) {
  if (!object.is_object()) place.refuse("is not an object");
  if (!object.contains(key)) place.refuse("lacks the property '{}'", key);
  const StageDeclaration* stage = find_stage(stages, object[key]);
  if (stage == nullptr) place.at(key).refuse("is {}, which Tessera does not know", object[key].dump());
  check_parameters(*stage, object, key, place);
}

std::size_t whole_number(const json& value, std::size_t min, std::size_t max, const Place& place) {
  if (!value.is_number() || value.get<double>() != std::floor(value.get<double>()))
    place.refuse("is not a whole number");
  const double v = value.get<double>();
  if (!(v >= static_cast<double>(min) && v <= static_cast<double>(max)))
    place.refuse("is {:.0f}, outside [{}, {}]", v, min, max);
  return static_cast<std::size_t>(v);
}

// Segments along each side of a base patch.
void check_tessellation(const json& limits, const Place& place) {
  if (!limits.is_object()) place.refuse("is not an object");
  constexpr auto kMost = static_cast<std::size_t>(Procedure::kMaxSegments);
  std::size_t least = 1, most = kMost;
  for (const auto& [name, value] : limits.items()) {
    if (name == "min")
      least = whole_number(value, 1, kMost, place.at(name));
    else if (name == "max")
      most = whole_number(value, 1, kMost, place.at(name));
    else if (name != "extensions" && name != "extras")
      place.at(name).refuse("is no limit: min and max are");
  }
  if (least > most) place.at("min").refuse("is {}, above the max of {}", least, most);
}

// ---- Building ---------------------------------------------------------------------------------------------------

// A parameter's numbers from one curve (of chains) or from the whole value.
void put_numbers(const ParameterDeclaration& p, const json* value, std::size_t curve, float* out) {
  for (std::size_t k = 0; k < static_cast<std::size_t>(p.size); ++k) {
    if (value == nullptr)
      out[k] = p.default_value;
    else if (p.layout != ParameterLayout::kNumbers)
      out[k] = (*value)[3 * curve + k / 2][k % 2].get<float>();
    else
      out[k] = value->is_array() ? (*value)[k].get<float>() : value->get<float>();
  }
}

std::size_t curve_count(const StageDeclaration& shape, const json& parameters, ParameterLayout layout) {
  for (const ParameterDeclaration& p : shape.parameters)
    if (p.layout == layout) return parameters[std::string(p.name)].size() / 3;
  return 1;
}

// The numbers of a stage's parameters, in order.
std::vector<float> stage_numbers(const StageDeclaration& stage, const json& object) {
  std::vector<float> numbers;
  for (const ParameterDeclaration& p : stage.parameters) {
    numbers.resize(numbers.size() + static_cast<std::size_t>(p.size));
    put_numbers(p, find(object, p.name), 0, numbers.data() + numbers.size() - p.size);
  }
  return numbers;
}

// Binds the constants and the image of a user's shape, for each piece.
void bind_pieces(Document& document, const Place& place, Procedure& out) {
  const shaders::Program& program = *out.shape_program;
  const std::size_t each = program.constants.size();
  document.budget.charge(out.pieces.size() * each, sizeof(float), place);
  std::vector<float> constants;
  for (const Procedure::Piece& piece : out.pieces) {
    const std::vector<float> own = program.bind(piece.input.p);
    constants.insert(constants.end(), own.begin(), own.end());
  }
  out.shape_constants = std::make_shared<const std::vector<float>>(std::move(constants));
  for (std::size_t n = 0; n < out.pieces.size(); ++n) {
    out.pieces[n].input.program = &program;
    out.pieces[n].input.constants = out.shape_constants->data() + n * each;
  }
}

void build_pieces(Document& document, const json& parameters, const Place& place, Procedure& out) {
  const StageDeclaration& shape = out.declaration();
  const std::size_t along_u = curve_count(shape, parameters, ParameterLayout::kChainU),
                    along_v = curve_count(shape, parameters, ParameterLayout::kChainV);
  document.budget.charge(along_u * along_v, sizeof(Procedure::Piece), place);
  out.pieces.resize(along_u * along_v);
  for (std::size_t n = 0; n < out.pieces.size(); ++n) {
    const std::size_t i = n % along_u, j = n / along_u;
    Procedure::Piece& piece = out.pieces[n];
    piece.u_scale = 1.0f / static_cast<float>(along_u), piece.u_first = static_cast<float>(i) * piece.u_scale;
    piece.v_scale = 1.0f / static_cast<float>(along_v), piece.v_first = static_cast<float>(j) * piece.v_scale;
    float* to = piece.input.p.data();
    for (const ParameterDeclaration& p : shape.parameters) {
      put_numbers(p, find(parameters, p.name), p.layout == ParameterLayout::kChainU ? i : j, to);
      to += p.size;
    }
    piece.input.image = out.image.get();
  }
  if (out.shape_program) bind_pieces(document, place, out);
}

template <std::size_t N>
void build_stage(const StageDeclaration& stage, const json& object, std::array<float, N>& numbers) {
  const std::vector<float> from = stage_numbers(stage, object);
  std::copy(from.begin(), from.end(), numbers.begin());
}

std::shared_ptr<const shaders::GeometryImage> build_image(Document& document, const json& image) {
  const std::vector<float> values = read_floats(document, image["positions"].get<std::size_t>());
  auto out = std::make_shared<shaders::GeometryImage>();
  out->width = image["width"].get<int>();
  out->height = static_cast<int>(values.size() / 3) / out->width;
  document.budget.charge(values.size(), sizeof(float), kExtension);
  for (std::size_t i = 0; i + 2 < values.size(); i += 3) {
    out->x.push_back(values[i]);
    out->y.push_back(values[i + 1]);
    out->z.push_back(values[i + 2]);
  }
  return out;
}

// Texture and sampling: of the programs where there are such.
void build_programs(const json& object, Procedure& out) {
  if (out.texture_program) {
    out.texture = shaders::TextureId::kProgram;
    const json parameters = object.value("texture", json::object());
    out.texture_constants = out.texture_program->bind(stage_numbers(out.texture_program->declaration, parameters));
  }
  if (out.rates_program) {
    const json parameters = object.value("sampling", json::object());
    out.rates_constants = out.rates_program->bind(stage_numbers(out.rates_program->declaration, parameters));
  }
}

Procedure build_procedure(Document& document, const json& object, ProgramCache& programs, const Place& place) {
  Procedure out;
  const auto number = [](std::span<const StageDeclaration> stages, const json& name) {
    return find_stage(stages, name) - stages.data();
  };
  if (const json* program = find(object, "program")) {
    const shaders::ProgramSet& set = programs.get(document.json, *program, place.at("program"));
    out.shape_program = set.shape, out.texture_program = set.texture, out.rates_program = set.rates;
  }
  out.shape = out.shape_program ? shaders::ShapeId::kProgram
                                : static_cast<shaders::ShapeId>(number(shaders::shape_declarations(), object["shape"]));
  if (object.contains("image")) out.image = build_image(document, object["image"]);
  build_pieces(document, object.value("parameters", json::object()), place, out);
  const json texture = object.value("texture", json{{"pattern", "plain"}}),
             shading = object.value("shading", json{{"model", "material"}});
  if (!out.texture_program) {
    out.texture = static_cast<shaders::TextureId>(number(shaders::texture_declarations(), texture["pattern"]));
    build_stage(shaders::texture_declarations()[static_cast<std::size_t>(out.texture)], texture, out.texture_numbers);
  }
  build_programs(object, out);
  out.shading = static_cast<shaders::ShadingId>(number(shaders::shading_declarations(), shading["model"]));
  build_stage(shaders::shading_declarations()[static_cast<std::size_t>(out.shading)], shading, out.shading_numbers);
  out.material = object.value("material", kNone);
  if (const json* limits = find(object, "tessellation")) {
    out.min_segments = limits->value("min", out.min_segments);
    out.max_segments = limits->value("max", out.max_segments);
  }
  return out;
}

}  // namespace

const shaders::ProgramSet& ProgramCache::get(const json& document, const json& value, const Place& place) {
  const json* text = &value;
  if (!value.is_string()) {
    const json* list = find_extension(document, kExtension);
    const std::size_t count = list == nullptr ? 0 : list_of(*list, "programs").size();
    if (count == 0) place.refuse("is neither a text nor the number of a program: the document lists none");
    text = &(*list)["programs"][whole_number(value, 0, count - 1, place)];
  }
  const auto& source = text->get_ref<const std::string&>();
  if (const auto known = compiled_.find(source); known != compiled_.end()) return known->second;
  if (compiled_.size() == kMaxPrograms) place.refuse("is one more than {} different programs", kMaxPrograms);
  shaders::CompiledText compiled = shaders::compile_programs(source);
  if (compiled.fault)
    place.refuse("line {}, column {}: {}", compiled.fault->line, compiled.fault->column, compiled.fault->message);
  return compiled_.emplace(source, std::move(compiled.programs)).first->second;
}

void check_procedure_schema(const json& document, const json& procedure, ProgramCache& programs, const Place& place) {
  if (!procedure.is_object()) place.refuse("is not an object");
  shaders::ProgramSet own;
  if (const json* program = find(procedure, "program")) own = programs.get(document, *program, place.at("program"));
  const StageDeclaration* shape = own.shape ? &own.shape->declaration : nullptr;
  if (shape != nullptr && procedure.contains("shape"))
    place.at("shape").refuse("is given, and the program has a shape");
  if (shape == nullptr) {
    if (!procedure.contains("shape")) place.refuse("lacks the property 'shape'");
    shape = find_stage(shaders::shape_declarations(), procedure["shape"]);
    if (shape == nullptr) place.at("shape").refuse("is {}, which Tessera does not know", procedure["shape"].dump());
  }
  const json parameters = procedure.value("parameters", json::object());
  check_parameters(*shape, parameters, "", place.at("parameters"));
  check_chains(*shape, parameters, place.at("parameters"));
  if (const json* limits = find(procedure, "tessellation")) check_tessellation(*limits, place.at("tessellation"));
  if (own.rates)
    check_parameters(own.rates->declaration, procedure.value("sampling", json::object()), "", place.at("sampling"));
  else if (procedure.contains("sampling"))
    place.at("sampling").refuse("is given, but there is no program of rates");
  if (own.texture)
    check_parameters(own.texture->declaration, procedure.value("texture", json::object()), "", place.at("texture"));
  else if (const json* texture = find(procedure, "texture"))
    check_stage(shaders::texture_declarations(), *texture, "pattern", place.at("texture"));
  if (const json* shading = find(procedure, "shading"))
    check_stage(shaders::shading_declarations(), *shading, "model", place.at("shading"));
  if (const json* material = find(procedure, "material")) {
    const std::size_t materials = list_of(document, "materials").size();
    if (materials == 0) place.at("material").refuse("points at a material, there are none");
    whole_number(*material, 0, materials - 1, place.at("material"));
  }
  const json* image = find(procedure, "image");
  const bool needs_image = own.shape ? own.shape->reads_image : shape->name == "geometryImage";
  if (needs_image && image == nullptr) place.refuse("lacks the property 'image', which this shape reads");
  if (!needs_image && image != nullptr) place.refuse("has an 'image', which this shape does not read");
  if (image == nullptr) return;
  const Place inner = place.at("image");
  if (!image->is_object()) inner.refuse("is not an object");
  for (const char* name : {"positions", "width"})
    if (!image->contains(name)) inner.refuse("lacks the property '{}'", name);
  const std::size_t accessors = list_of(document, "accessors").size();
  if (accessors == 0) inner.at("positions").refuse("points at an accessor, there are none");
  whole_number((*image)["positions"], 0, accessors - 1, inner.at("positions"));
  whole_number((*image)["width"], 2, 16384, inner.at("width"));
}

void check_procedure_links(const json& document, const json& procedure, const Place& place) {
  const json* image = find(procedure, "image");
  if (image == nullptr) return;
  const Place inner = place.at("image");
  const AccessorLayout layout = accessor_layout(document, (*image)["positions"].get<std::size_t>());
  if (layout.components != 3 || layout.columns != 1 || layout.component_type != kFloat)
    inner.at("positions").refuse("is not an accessor of three floats");
  const auto width = (*image)["width"].get<std::uint64_t>();
  if (layout.count % width != 0 || layout.count / width < 2)
    inner.at("width").refuse("is {}, the accessor has {} points: not a grid of whole rows, two at least", width,
                             layout.count);
}

std::optional<StageParameter> find_stage_parameter(const json& document, const json& procedure, std::string_view stage,
                                                   std::string_view name, ProgramCache& programs, const Place& place) {
  shaders::ProgramSet own;
  if (const json* program = find(procedure, "program")) own = programs.get(document, *program, place);
  const auto of = [&](const shaders::Program* program, std::span<const StageDeclaration> stages, const json* object,
                      const char* key) -> const StageDeclaration* {
    if (program != nullptr) return &program->declaration;
    return object == nullptr || !object->contains(key) ? nullptr : find_stage(stages, (*object)[key]);
  };
  const StageDeclaration* declaration = nullptr;
  AnimatedPath path = AnimatedPath::kShapeNumbers;
  if (stage == "parameters") {
    declaration = of(own.shape.get(), shaders::shape_declarations(), &procedure, "shape");
  } else if (stage == "texture") {
    path = AnimatedPath::kTextureNumbers;
    declaration = of(own.texture.get(), shaders::texture_declarations(), find(procedure, "texture"), "pattern");
  } else if (stage == "shading") {
    path = AnimatedPath::kShadingNumbers;
    declaration = of(nullptr, shaders::shading_declarations(), find(procedure, "shading"), "model");
  } else if (stage == "sampling" && own.rates) {
    path = AnimatedPath::kRatesNumbers;
    declaration = &own.rates->declaration;
  }
  if (declaration == nullptr) return std::nullopt;
  for (std::size_t part = 0; part < declaration->parameters.size(); ++part) {
    const ParameterDeclaration& p = declaration->parameters[part];
    if (p.name != name) continue;
    if (p.layout != ParameterLayout::kNumbers)
      return StageParameter{path, static_cast<int>(part), 2,
                            static_cast<int>(procedure["parameters"][std::string(name)].size())};
    const bool vector = p.size <= 4;
    return StageParameter{path, static_cast<int>(part), vector ? p.size : 1, vector ? 1 : p.size};
  }
  return std::nullopt;
}

void build_procedures(Document& document, Capture& capture) {
  ProgramCache programs;
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const json* object = find_extension(document.json["nodes"][n], kExtension);
    if (object == nullptr) continue;
    const Place place = document.root.at("nodes").at(n).at("extensions").at(kExtension);
    document.budget.charge(1, sizeof(Procedure), place);
    capture.nodes[n].procedure = static_cast<int>(capture.procedures.size());
    capture.procedures.push_back(build_procedure(document, *object, programs, place));
  }
}

}  // namespace tessera::scene::gltf
