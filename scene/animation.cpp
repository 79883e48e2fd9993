#include "scene/animation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "scene/pose.h"

namespace tessera::scene {
namespace {

constexpr double kFloatMax = static_cast<double>(std::numeric_limits<float>::max());
constexpr double kLeast = 1e-6;  // least value of a property that must be above zero

bool is_of_material(AnimatedPath path) {
  return path >= AnimatedPath::kMaterialNumber && path <= AnimatedPath::kTextureScale;
}
bool is_of_camera(AnimatedPath path) { return path >= AnimatedPath::kFieldOfView && path <= AnimatedPath::kFar; }
bool is_of_light(AnimatedPath path) { return path >= AnimatedPath::kLightColor && path <= AnimatedPath::kOuterCone; }

// Calls visit(channel, its values) for the played channels of the paths that `wanted` accepts.
template <class Wanted, class Visit>
void for_each_value(const Capture& capture, double time, const Wanted& wanted, const Visit& visit) {
  for (const int a : capture.played_animations)
    for (const AnimationChannel& channel : capture.animations[static_cast<std::size_t>(a)].channels)
      if (wanted(channel.path)) visit(channel, evaluate_channel(channel, time));
}

float within(double value, double low, double high) { return static_cast<float>(std::clamp(value, low, high)); }

void set_value(const AnimationChannel& channel, const std::vector<double>& v, Material& material) {
  const auto part = static_cast<std::size_t>(channel.part);
  if (channel.path == AnimatedPath::kMaterialNumber) {
    const MaterialNumber& number = material_numbers()[part];
    float* to = number.of(material);
    for (std::size_t c = 0; c < v.size(); ++c) to[c] = number.range.nearest(v[c]);
    if (to == &material.emissive_factor.x || to == &material.emissive_strength)
      material.emissive = material.emissive_factor * material.emissive_strength;
    return;
  }
  TextureSlot& slot = *material.slots()[part];
  const auto any = [](double value) { return within(value, -kFloatMax, kFloatMax); };
  if (channel.path == AnimatedPath::kTextureOffset) slot.shift.offset = {any(v[0]), any(v[1])};
  if (channel.path == AnimatedPath::kTextureRotation) slot.shift.rotation = any(v[0]);
  if (channel.path == AnimatedPath::kTextureScale) slot.shift.scale = {any(v[0]), any(v[1])};
  slot.transform = slot.shift.transform();
}

}  // namespace

void animate_materials(const Capture& capture, double time, std::span<const int> source,
                       std::vector<Material>& materials) {
  for_each_value(capture, time, is_of_material, [&](const AnimationChannel& channel, const std::vector<double>& v) {
    for (std::size_t m = 0; m < materials.size(); ++m)
      if (source[m] == channel.object) set_value(channel, v, materials[m]);
  });
}

Camera animate_camera(const Capture& capture, double time, int camera, Camera base) {
  for_each_value(capture, time, is_of_camera, [&](const AnimationChannel& channel, const std::vector<double>& v) {
    if (channel.object != camera) return;
    switch (channel.path) {
      case AnimatedPath::kFieldOfView:
        base.vertical_fov = within(v[0], kLeast, 3.14159);
        break;
      case AnimatedPath::kXMag:
        base.x_mag = within(std::abs(v[0]), kLeast, kFloatMax);
        break;
      case AnimatedPath::kYMag:
        base.y_mag = within(std::abs(v[0]), kLeast, kFloatMax);
        break;
      case AnimatedPath::kNear:
        base.near = within(v[0], base.type == Camera::Type::kPerspective ? kLeast : 0, kFloatMax);
        break;
      default:
        base.far = within(v[0], kLeast, kFloatMax);
        break;
    }
  });
  if (base.far != 0 && !(base.far > base.near))
    base.far = std::nextafter(base.near, std::numeric_limits<float>::infinity());
  return base;
}

std::vector<shaders::Light> animate_lights(const Capture& capture, double time) {
  std::vector<shaders::Light> lights = capture.lights;
  std::vector<LightParameters> parameters = capture.light_parameters;
  for_each_value(capture, time, is_of_light, [&](const AnimationChannel& channel, const std::vector<double>& v) {
    const auto l = static_cast<std::size_t>(channel.object);
    constexpr double kHalfPi = 1.5707963267948966;
    switch (channel.path) {
      case AnimatedPath::kLightColor:
        for (int c = 0; c < 3; ++c) parameters[l].color[c] = within(v[static_cast<std::size_t>(c)], 0, kFloatMax);
        break;
      case AnimatedPath::kLightIntensity:
        parameters[l].intensity = within(v[0], 0, kFloatMax);
        break;
      case AnimatedPath::kLightRange:
        lights[l].range = within(v[0], kLeast, kFloatMax);
        break;
      case AnimatedPath::kInnerCone:
        parameters[l].inner_cone = std::clamp(v[0], 0.0, kHalfPi);
        break;
      default:
        parameters[l].outer_cone = std::clamp(v[0], kLeast, kHalfPi);
        break;
    }
    // The inner cone is the smaller one.
    const double inner = std::min(parameters[l].inner_cone, parameters[l].outer_cone * (1 - kSharpestCone));
    LightParameters now = parameters[l];
    now.inner_cone = inner;
    now.apply(lights[l]);
  });
  return lights;
}

std::vector<MaterialValue> animated_material_values(const Capture& capture, double time) {
  std::vector<MaterialValue> values;
  for_each_value(capture, time, is_of_material, [&](const AnimationChannel& channel, const std::vector<double>& v) {
    for (const double value : v) values.push_back({channel.object, value});
  });
  return values;
}

namespace {

using shaders::ParameterDeclaration;
using shaders::ParameterLayout;

bool is_of_procedure(AnimatedPath path) { return path >= AnimatedPath::kShapeNumbers; }

// Calls visit(channel) for the played channels of procedures.
template <class Visit>
void for_each_channel(const Capture& capture, const Visit& visit) {
  for (const int a : capture.played_animations)
    for (const AnimationChannel& channel : capture.animations[static_cast<std::size_t>(a)].channels)
      if (is_of_procedure(channel.path)) visit(channel);
}

float within(const ParameterDeclaration& p, double value) {
  return static_cast<float>(std::clamp(value, static_cast<double>(p.min), static_cast<double>(p.max)));
}

// The parameter's place among the numbers of its stage.
std::size_t first_number(std::span<const ParameterDeclaration> parameters, std::size_t parameter) {
  std::size_t first = 0;
  for (std::size_t p = 0; p < parameter; ++p) first += static_cast<std::size_t>(parameters[p].size);
  return first;
}

// Sets a parameter of all pieces; a chain gives each piece its own curve.
void set_shape(const ParameterDeclaration& p, std::size_t first, const std::vector<double>& v, Procedure& out) {
  const std::size_t curves = p.layout == ParameterLayout::kNumbers ? 1 : v.size() / 6,
                    along_u = p.layout == ParameterLayout::kChainU ? curves : out.pieces.size() / curves;
  for (std::size_t n = 0; n < out.pieces.size(); ++n) {
    const std::size_t curve = p.layout == ParameterLayout::kNumbers  ? 0
                              : p.layout == ParameterLayout::kChainU ? n % along_u
                                                                     : n / along_u;
    for (std::size_t k = 0; k < static_cast<std::size_t>(p.size); ++k)
      out.pieces[n].input.p[first + k] = within(p, v[6 * curve + k]);
  }
}

void set_numbers(const ParameterDeclaration& p, std::size_t first, const std::vector<double>& v,
                 std::span<float> numbers) {
  for (std::size_t k = 0; k < static_cast<std::size_t>(p.size); ++k) numbers[first + k] = within(p, v[k]);
}

// Uniforms of the user's own stages follow from their parameters.
void bind_programs(Procedure& out) {
  const auto bind = [](const shaders::Program& program, std::vector<float>& constants) {
    constants = program.bind(std::vector<float>(
        constants.begin(), constants.begin() + static_cast<std::ptrdiff_t>(program.parameter_numbers)));
  };
  if (out.texture_program) bind(*out.texture_program, out.texture_constants);
  if (out.rates_program) bind(*out.rates_program, out.rates_constants);
  if (!out.shape_program) return;
  std::vector<float> constants;
  for (const Procedure::Piece& piece : out.pieces) {
    const std::vector<float> own = out.shape_program->bind(piece.input.p);
    constants.insert(constants.end(), own.begin(), own.end());
  }
  out.shape_constants = std::make_shared<const std::vector<float>>(std::move(constants));
  for (std::size_t n = 0; n < out.pieces.size(); ++n)
    out.pieces[n].input.constants = out.shape_constants->data() + n * out.shape_program->constants.size();
}

void set_parameter(const AnimationChannel& channel, const std::vector<double>& v, Procedure& out) {
  const auto part = static_cast<std::size_t>(channel.part);
  const auto set = [&](std::span<const ParameterDeclaration> parameters, auto&& numbers) {
    set_numbers(parameters[part], first_number(parameters, part), v, numbers);
  };
  switch (channel.path) {
    case AnimatedPath::kShapeNumbers: {
      const std::span<const ParameterDeclaration> parameters = out.declaration().parameters;
      set_shape(parameters[part], first_number(parameters, part), v, out);
      break;
    }
    case AnimatedPath::kTextureNumbers:
      if (out.texture_program)
        set(out.texture_program->declaration.parameters, std::span<float>(out.texture_constants));
      else
        set(shaders::texture_declarations()[static_cast<std::size_t>(out.texture)].parameters,
            std::span<float>(out.texture_numbers));
      break;
    case AnimatedPath::kShadingNumbers:
      set(shaders::shading_declarations()[static_cast<std::size_t>(out.shading)].parameters,
          std::span<float>(out.shading_numbers));
      break;
    case AnimatedPath::kRatesNumbers:
      if (out.rates_program) set(out.rates_program->declaration.parameters, std::span<float>(out.rates_constants));
      break;
    default:
      break;
  }
}

}  // namespace

std::vector<int> animated_procedures(const Capture& capture) {
  std::vector<int> nodes;
  for_each_channel(capture, [&](const AnimationChannel& channel) { nodes.push_back(channel.node); });
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  std::erase_if(nodes, [&](int node) { return capture.nodes[static_cast<std::size_t>(node)].procedure == kNone; });
  return nodes;
}

PosedProcedures pose_procedures(const Capture& capture, double open, double close) {
  PosedProcedures posed;
  const std::vector<int> nodes = animated_procedures(capture);
  if (nodes.empty()) return posed;
  const auto number = [&](int node) {
    return static_cast<std::size_t>(capture.nodes[static_cast<std::size_t>(node)].procedure);
  };
  posed.keys.resize(capture.procedures.size());
  std::vector<std::array<std::shared_ptr<Procedure>, 2>> copies(capture.procedures.size());
  const std::size_t keys = close == open ? 1 : 2;
  for (const int node : nodes)
    for (std::size_t key = 0; key < keys; ++key)
      copies[number(node)][key] = std::make_shared<Procedure>(capture.procedures[number(node)]);
  for_each_channel(capture, [&](const AnimationChannel& channel) {
    if (capture.nodes[static_cast<std::size_t>(channel.node)].procedure == kNone) return;
    for (std::size_t key = 0; key < keys; ++key) {
      const std::vector<double> v = evaluate_channel(channel, key == 0 ? open : close);
      posed.values.insert(posed.values.end(), v.begin(), v.end());
      set_parameter(channel, v, *copies[number(channel.node)][key]);
    }
  });
  for (const int node : nodes) {
    auto& of = copies[number(node)];
    for (std::size_t key = 0; key < keys; ++key) bind_programs(*of[key]);
    // Texture and shading use the numbers of shutter open.
    const bool same = keys == 1 || same_shape(*of[0], *of[1]);
    posed.keys[number(node)] = {of[0], same ? of[0] : of[1]};
  }
  return posed;
}

bool same_shape(const Procedure& a, const Procedure& b) {
  return std::equal(a.pieces.begin(), a.pieces.end(), b.pieces.begin(), b.pieces.end(),
                    [](const Procedure::Piece& x, const Procedure::Piece& y) {
                      return std::ranges::equal(std::as_bytes(std::span(x.input.p)),
                                                std::as_bytes(std::span(y.input.p)));
                    });
}

bool same_look(const Procedure& a, const Procedure& b) {
  return a.texture_numbers == b.texture_numbers && a.shading_numbers == b.shading_numbers &&
         a.texture_constants == b.texture_constants;
}

}  // namespace tessera::scene
