#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "base/text.h"
#include "scene/animation.h"
#include "scene/assembly.h"
#include "scene/gltf/animation_pointer.h"
#include "scene/gltf/builders.h"
#include "scene/gltf/procedure_builder.h"
#include "scene/gltf/validation.h"
#include "scene/pose.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

DMat4 matrix_from(const double* m) {
  DMat4 out;
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row) out[column][row] = m[4 * column + row];
  return out;
}

// Removes exporters' rounding from the last row.
DMat4 affine_from(const double* m) {
  DMat4 out = matrix_from(m);
  for (int column = 0; column < 4; ++column) out[column][3] = column == 3 ? 1 : 0;
  return out;
}

std::vector<Node> build_nodes(Document& document, const std::vector<Mesh>& meshes) {
  const json& array = list_of(document.json, "nodes");
  std::vector<Node> nodes(array.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const json& model = array[i];
    Node& node = nodes[i];
    node.name = model.value("name", std::string());
    const auto numbers = [&](const char* name) { return list_of(model, name).get<std::vector<double>>(); };
    node.children = list_of(model, "children").get<std::vector<int>>();
    for (const int child : node.children) nodes[static_cast<std::size_t>(child)].parent = static_cast<int>(i);
    if (const std::vector<double> t = numbers("translation"); !t.empty())
      node.transform.translation = {t[0], t[1], t[2]};
    if (const std::vector<double> s = numbers("scale"); !s.empty()) node.transform.scale = {s[0], s[1], s[2]};
    if (const std::vector<double> r = numbers("rotation"); !r.empty())
      node.transform.rotation = glm::normalize(DQuat(r[3], r[0], r[1], r[2]));
    if (const std::vector<double> m = numbers("matrix"); !m.empty()) node.matrix = affine_from(m.data());
    node.mesh = model.value("mesh", kNone);
    node.skin = node.mesh == kNone ? kNone : model.value("skin", kNone);
    node.camera = model.value("camera", kNone);
    if (const json* light = find_extension(model, "KHR_lights_punctual")) node.light = (*light)["light"].get<int>();
    if (const json* visibility = find_extension(model, "KHR_node_visibility"))
      node.visible = visibility->value("visible", true);
    if (node.mesh == kNone) continue;
    for (const double w : numbers("weights")) node.weights.push_back(static_cast<float>(w));
    if (node.weights.empty()) continue;
    const std::size_t targets = meshes[static_cast<std::size_t>(node.mesh)].default_weights.size();
    document.budget.charge(targets, sizeof(float), [&] { return document.root.at("nodes").at(i).pointer(); });
    node.weights.resize(targets);
  }
  return nodes;
}

// Vertices of its own that a drawable has at both motion keys.
std::uint64_t deformed_bytes(const Primitive& primitive) {
  return primitive.vertices.count() * 2 * (2 * sizeof(Vec3) + sizeof(Vec4));
}

// The most that the primitive may have.
std::size_t clusters_of(const Primitive& primitive) {
  return primitive.triangles_of_cluster.empty() ? cluster_count_bound(primitive.indices.size())
                                                : primitive.triangles_of_cluster.size();
}

// Bytes that posing keeps for a node or an instance: for each primitive of its mesh the drawable before and after
// posing, and a number for each base patch, of which a primitive has no more than triangles or patches.
std::uint64_t posed_bytes(const Mesh& mesh) {
  constexpr std::uint64_t kDrawableBytes = 1024, kPatchBytes = 8, kGridBytes = 24;
  std::uint64_t bytes = 0;
  for (const Primitive& primitive : mesh.primitives) {
    if (primitive.wire != Primitive::Wire::kSurface) bytes += deformed_bytes(primitive);
    bytes += kDrawableBytes + (primitive.kind == Primitive::Kind::kBezierPatches
                                   ? primitive.vertices.count() / 16 * kGridBytes
                                   : clusters_of(primitive) * kPatchBytes);
  }
  return bytes;
}

// The extension leaves open how a skin acts on instances. A skinned mesh ignores its node's transform, so all instances
// would lie in one place; three.js draws the mesh in its rest pose, and so do we.
void build_instances(Document& document, Capture& capture) {
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const json* instancing = find_extension(document.json["nodes"][n], "EXT_mesh_gpu_instancing");
    if (instancing == nullptr || (*instancing)["attributes"].empty()) continue;
    const Place place = document.root.at("nodes").at(n).at("extensions").at("EXT_mesh_gpu_instancing").at("attributes");
    Node& node = capture.nodes[n];
    for (const auto& [name, index] : (*instancing)["attributes"].items()) {
      const auto accessor = index.get<std::size_t>();
      const auto count = document.json["accessors"][accessor]["count"].get<std::uint64_t>();
      if (count == 0) {
        node.mesh = node.skin = kNone;
        break;
      }
      if (node.instances.empty()) {
        document.budget.charge(
            count, sizeof(InstanceTransform) + posed_bytes(capture.meshes[static_cast<std::size_t>(node.mesh)]),
            place.pointer() + ": instances");
        node.instances.resize(count);
      }
      if (name != "TRANSLATION" && name != "ROTATION" && name != "SCALE") {
        document.notes.add(place.at(name), "such attributes of instances are not read", "belongs to the application");
        continue;
      }
      const std::vector<float> values = read_floats(document, accessor);
      for (std::size_t i = 0; i < count; ++i) {
        InstanceTransform& instance = node.instances[i];
        if (name == "TRANSLATION") std::copy_n(&values[3 * i], 3, instance.translation.begin());
        if (name == "SCALE") std::copy_n(&values[3 * i], 3, instance.scale.begin());
        if (name != "ROTATION") continue;
        std::copy_n(&values[4 * i], 4, instance.rotation.begin());
        double length2 = 0;
        for (const float c : instance.rotation) length2 += static_cast<double>(c) * static_cast<double>(c);
        if (length2 < validation::kLeastQuaternion) place.at(name).refuse("rotation of instance {} is zero", i);
      }
    }
    if (node.skin == kNone) continue;
    node.skin = kNone;
    document.notes.add(document.root.at("nodes").at(n), "they are drawn as the mesh rests",
                       "is skinned and has instances");
  }
}

// Charges the memory that posing keeps for nodes without instances, which may share a large mesh, and for vertices that
// deform.
void charge_poses(Document& document, const Capture& capture) {
  std::vector<std::uint64_t> rigid;
  for (const Mesh& mesh : capture.meshes) rigid.push_back(posed_bytes(mesh));
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const Node& node = capture.nodes[n];
    if (node.mesh == kNone) continue;
    std::uint64_t bytes = node.instances.empty() ? rigid[static_cast<std::size_t>(node.mesh)] : 0;
    for (const Primitive& primitive : capture.meshes[static_cast<std::size_t>(node.mesh)].primitives)
      if (primitive.wire == Primitive::Wire::kSurface && is_deforming(capture, static_cast<int>(n), primitive))
        bytes += deformed_bytes(primitive);
    if (bytes > 0) document.budget.charge(bytes, 1, [&] { return "posing /nodes/" + std::to_string(n); });
  }
}

// Roots of the scene to draw: the default one, else the first; without scenes every root.
std::vector<int> build_roots(const Document& document, const std::vector<Node>& nodes) {
  if (!document.model.scenes.empty()) {
    const auto scene = static_cast<std::size_t>(std::max(document.model.defaultScene, 0));
    const std::vector<int>& roots = document.model.scenes[scene].nodes;
    return {roots.begin(), roots.end()};
  }
  std::vector<int> roots;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (nodes[i].parent == kNone) roots.push_back(static_cast<int>(i));
  return roots;
}

std::vector<Skin> build_skins(Document& document) {
  std::vector<Skin> skins;
  for (const tinygltf::Skin& model : document.model.skins) {
    Skin& skin = skins.emplace_back();
    skin.joints.assign(model.joints.begin(), model.joints.end());
    skin.inverse_bind.assign(skin.joints.size(), DMat4(1.0));
    if (model.inverseBindMatrices < 0) continue;
    const std::vector<float> values = read_floats(document, static_cast<std::size_t>(model.inverseBindMatrices));
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      const std::vector<double> m(values.begin() + static_cast<std::ptrdiff_t>(16 * j),
                                  values.begin() + static_cast<std::ptrdiff_t>(16 * j + 16));
      skin.inverse_bind[j] = matrix_from(m.data());
      if (std::max({std::abs(m[3]), std::abs(m[7]), std::abs(m[11]), std::abs(m[15] - 1)}) >
          validation::kMatrixRounding)
        document.root.at("skins")
            .at(skins.size() - 1)
            .at("inverseBindMatrices")
            .refuse("matrix {} has a last row that is not 0 0 0 1", j);
    }
  }
  return skins;
}

// Joints that a mesh's vertices name exist in the skin of every node that draws it.
void check_joints(const Document& document, const Capture& capture) {
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const Node& node = capture.nodes[n];
    if (node.mesh == kNone || node.skin == kNone) continue;
    const std::size_t joints = capture.skins[static_cast<std::size_t>(node.skin)].joints.size();
    for (const Primitive& primitive : capture.meshes[static_cast<std::size_t>(node.mesh)].primitives)
      for (std::size_t v = 0; v < primitive.vertices.influences.size(); ++v)
        for (std::size_t k = 0; k < 8; ++k) {
          const SkinInfluence& influence = primitive.vertices.influences[v];
          if (influence.weights[k] > 0 && influence.joints[k] >= joints)
            document.root.at("nodes").at(n).refuse("mesh {} vertex {} names joint {}, the skin has {}", node.mesh, v,
                                                   influence.joints[k], joints);
        }
  }
}

// Rotation keys are normalised when they are used (exporters round them); one of no length has no direction.
void check_rotation_keys(const AnimationChannel& channel, const Place& place) {
  const std::size_t parts = channel.interpolation == Interpolation::kCubicSpline ? 3 : 1;
  for (std::size_t key = 0; key < channel.times.size(); ++key) {
    double length2 = 0;
    for (std::size_t c = 0; c < 4; ++c) {
      const double v = static_cast<double>(channel.values[4 * (parts * key + parts / 2) + c]);
      length2 += v * v;
    }
    if (length2 < validation::kLeastQuaternion) place.refuse("rotation key {} is zero", key);
  }
}

// The target of a channel, or nothing where the channel is to be ignored.
std::optional<AnimationChannel> channel_target(const Document& document, const json& json_channel,
                                               ProgramCache& programs) {
  AnimationChannel channel;
  if (const std::string* pointer = animation_pointer(json_channel)) {
    const std::optional<PointerTarget> target = resolve_pointer(document.json, *pointer, programs, document.root);
    if (!target || !target->defined) return std::nullopt;
    channel.path = target->path;
    (moves_node(target->path) ? channel.node : channel.object) = target->object;
    channel.part = target->part;
    channel.components = target->components * std::max(target->values, 1);
    return channel;
  }
  const json& target = json_channel["target"];
  if (!target.contains("node")) return std::nullopt;
  channel.node = target["node"].get<int>();
  const auto& path = target["path"].get_ref<const std::string&>();
  channel.path = path == "translation" ? AnimatedPath::kTranslation
                 : path == "rotation"  ? AnimatedPath::kRotation
                 : path == "scale"     ? AnimatedPath::kScale
                                       : AnimatedPath::kWeights;
  return channel;
}

// Two keys at one time are a jump: the second one comes as soon after the first as times can tell apart.
void check_key_times(std::vector<float>& times, const Place& place, Notes& notes) {
  float before = 0;  // the time of the key before, as the file says it
  for (std::size_t k = 0; k < times.size(); ++k) {
    const float here = times[k];
    if (here < 0) notes.violation(place, "such keys are read as they are", "key time {} is negative", k);
    if (k > 0 && here < before) place.refuse("key time {} does not increase", k);
    if (k > 0 && here == before)
      notes.violation(place, "two keys at one time are a jump", "key time {} does not increase", k);
    constexpr float kApart = 1e-6f;  // seconds, or of the time
    if (k > 0 && here <= times[k - 1]) times[k] = times[k - 1] + kApart * std::max(1.0f, std::abs(times[k - 1]));
    before = here;
  }
}

void read_keys(Document& document, const json& sampler, const Capture& capture, AnimationChannel& channel) {
  const std::string interpolation = sampler.value("interpolation", std::string("LINEAR"));
  channel.interpolation = interpolation == "STEP"          ? Interpolation::kStep
                          : interpolation == "CUBICSPLINE" ? Interpolation::kCubicSpline
                                                           : Interpolation::kLinear;
  if (channel.path == AnimatedPath::kVisible) channel.interpolation = Interpolation::kStep;
  const auto input = sampler["input"].get<std::size_t>(), output = sampler["output"].get<std::size_t>();
  channel.times = read_floats(document, input);
  check_key_times(channel.times, document.root.at("accessors").at(input), document.notes);
  channel.values = read_floats(document, output);
  if (channel.path == AnimatedPath::kRotation) {
    channel.components = 4;
    check_rotation_keys(channel, document.root.at("accessors").at(output));
  }
  if (channel.path == AnimatedPath::kWeights) {
    std::size_t targets = 0;
    const auto mesh = static_cast<std::size_t>(capture.nodes[static_cast<std::size_t>(channel.node)].mesh);
    for (const json& primitive : document.json["meshes"][mesh]["primitives"])
      targets = std::max(targets, list_of(primitive, "targets").size());
    channel.components = static_cast<int>(targets);
  }
}

// Tells the target of a channel apart from all others.
std::tuple<AnimatedPath, int, int, int> moved_by(const AnimationChannel& c) {
  return {c.path, c.node, c.object, c.part};
}

std::vector<Animation> build_animations(Document& document, const Capture& capture) {
  std::vector<Animation> animations;
  ProgramCache programs;
  for (const json& json_animation : list_of(document.json, "animations")) {
    Animation& animation = animations.emplace_back();
    animation.name = json_animation.value("name", std::string());
    std::map<std::tuple<AnimatedPath, int, int, int>, std::size_t> places;  // channels by their targets
    for (const json& json_channel : json_animation["channels"])
      if (std::optional<AnimationChannel> channel = channel_target(document, json_channel, programs)) {
        read_keys(document, json_animation["samplers"][json_channel["sampler"].get<std::size_t>()], capture, *channel);
        if (channel->times.empty()) continue;
        const auto [at, fresh] = places.try_emplace(moved_by(*channel), animation.channels.size());
        if (fresh)
          animation.channels.push_back(std::move(*channel));
        else
          animation.channels[at->second] = std::move(*channel);  // the last one counts
      }
  }
  return animations;
}

// Charges the numbers at both motion keys of procedures whose parameters are animated.
void charge_procedures(Document& document, const Capture& capture) {
  for (const int n : animated_procedures(capture)) {
    const int number = capture.nodes[static_cast<std::size_t>(n)].procedure;
    const Procedure& procedure = capture.procedures[static_cast<std::size_t>(number)];
    std::uint64_t bytes = sizeof(Procedure) + procedure.pieces.size() * sizeof(Procedure::Piece);
    if (procedure.shape_constants) bytes += sizeof(float) * procedure.shape_constants->size();
    document.budget.charge(2 * bytes, 1, [&] { return "posing the procedure of /nodes/" + std::to_string(n); });
  }
}

// glTF leaves open which animations play. The first does, and each further one that moves nothing already moved.
std::vector<int> choose_animations(const std::vector<Animation>& animations) {
  std::vector<int> played;
  std::set<std::tuple<AnimatedPath, int, int, int>> moved;
  for (std::size_t a = 0; a < animations.size(); ++a) {
    bool free = true;
    for (const AnimationChannel& channel : animations[a].channels) free = free && !moved.contains(moved_by(channel));
    if (!free) continue;
    for (const AnimationChannel& channel : animations[a].channels) moved.insert(moved_by(channel));
    played.push_back(static_cast<int>(a));
  }
  return played;
}

// The selected animations, else the ones that the file names, else glTF's default.
std::vector<int> played_animations(const Document& document, const Selected& selected,
                                   const std::vector<Animation>& animations) {
  if (selected.animations) return *selected.animations;
  const json* extension = find_extension(document.json, "TESSERA_capture");
  if (!selected.all_animations && extension != nullptr && extension->contains("animations"))
    return (*extension)["animations"].get<std::vector<int>>();
  return choose_animations(animations);
}

// An effect that an animation turns on exists from the first frame on: shaders do not change from frame to frame.
void settle_effects(Capture& capture) {
  for (const int a : capture.played_animations)
    for (const AnimationChannel& channel : capture.animations[static_cast<std::size_t>(a)].channels) {
      if (channel.path != AnimatedPath::kMaterialNumber) continue;
      Material& material = capture.materials[static_cast<std::size_t>(channel.object)];
      const auto effect = material_numbers()[static_cast<std::size_t>(channel.part)].effect;
      if (effect && !material.unlit) material.effects.set(static_cast<std::size_t>(*effect));
    }
  // Effects that are not there have no textures.
  for (Material& m : capture.materials) {
    m.effects = drop_unsupported(m.effects);
    const auto slots = m.slots();
    for (std::size_t slot = kCoreTextureCount; slot < slots.size(); ++slot)
      if (!is_read(m, static_cast<MaterialTexture>(slot))) slots[slot]->texture = nullptr;
  }
}

std::vector<Camera> build_cameras(const Document& document) {
  std::vector<Camera> cameras;
  for (std::size_t c = 0; c < document.model.cameras.size(); ++c) {
    const tinygltf::Camera& model = document.model.cameras[c];
    Camera& camera = cameras.emplace_back();
    camera.name = model.name;
    if (model.type == "perspective") {
      camera.vertical_fov = static_cast<float>(model.perspective.yfov);
      camera.near = static_cast<float>(model.perspective.znear);
      camera.far = static_cast<float>(model.perspective.zfar);
    } else {
      camera.type = Camera::Type::kOrthographic;
      camera.x_mag = std::abs(static_cast<float>(model.orthographic.xmag));
      camera.y_mag = std::abs(static_cast<float>(model.orthographic.ymag));
      camera.near = static_cast<float>(model.orthographic.znear);
      camera.far = static_cast<float>(model.orthographic.zfar);
    }
    if (const json* lens = find_extension(document.json["cameras"][c], "TESSERA_lens")) {
      camera.lens.aperture_radius = (*lens)["apertureRadius"].get<float>();
      camera.lens.focus_distance = lens->value("focusDistance", std::numeric_limits<float>::infinity());
    }
  }
  return cameras;
}

void build_lights(const Document& document, Capture& capture) {
  for (const tinygltf::Light& model : document.model.lights) {
    shaders::Light& light = capture.lights.emplace_back();
    LightParameters& parameters = capture.light_parameters.emplace_back();
    light.type = model.type == "directional" ? shaders::Light::Type::kDirectional
                 : model.type == "point"     ? shaders::Light::Type::kPoint
                                             : shaders::Light::Type::kSpot;
    if (model.color.size() == 3) parameters.color = {model.color[0], model.color[1], model.color[2]};
    parameters.intensity = static_cast<float>(model.intensity);
    parameters.outer_cone = model.spot.outerConeAngle;
    parameters.inner_cone = model.spot.innerConeAngle < parameters.outer_cone
                                ? model.spot.innerConeAngle
                                : parameters.outer_cone * (1 - kSharpestCone);
    light.range = static_cast<float>(model.range);
    parameters.apply(light);
  }
}

std::vector<ShadowRequest> build_shadows(const json& extension) {
  std::vector<ShadowRequest> shadows;
  for (const json& row : list_of(extension, "shadows")) {
    ShadowRequest& shadow = shadows.emplace_back();
    shadow.light = row["light"].get<int>();
    shadow.size = row.value("size", shadow.size);
    shadow.cascades = row.value("cascades", shadow.cascades);
    shadow.distance = row.value("distance", shadow.distance);
  }
  return shadows;
}

CaptureSettings build_settings(const Document& document) {
  CaptureSettings settings;
  const json* extension = find_extension(document.json, "TESSERA_capture");
  if (extension == nullptr) return settings;
  settings.declared = true;
  if (extension->contains("resolution")) {
    settings.width = (*extension)["resolution"][0].get<int>();
    settings.height = (*extension)["resolution"][1].get<int>();
  }
  settings.frame_rate = extension->value("frameRate", settings.frame_rate);
  if (extension->contains("shutter")) {
    settings.shutter_open = (*extension)["shutter"][0].get<double>();
    settings.shutter_close = (*extension)["shutter"][1].get<double>();
  }
  if (extension->contains("frames")) {
    settings.first_frame = (*extension)["frames"].value("first", 0);
    settings.frame_count = (*extension)["frames"].value("count", 1);
  }
  settings.camera_node = extension->value("camera", kNone);
  settings.exposure = extension->value("exposure", 1.0f);
  if (const json* c = find(*extension, "background"))
    settings.background = {(*c)[0].get<float>(), (*c)[1].get<float>(), (*c)[2].get<float>()};
  settings.shadows = build_shadows(*extension);
  settings.graph = read_passes(*extension);
  return settings;
}

}  // namespace

void build_scene(Document& document, const Selected& selected, Capture& capture) {
  capture.nodes = build_nodes(document, capture.meshes);
  build_instances(document, capture);
  build_procedures(document, capture);
  capture.roots = build_roots(document, capture.nodes);
  capture.skins = build_skins(document);
  charge_poses(document, capture);
  check_joints(document, capture);
  capture.animations = build_animations(document, capture);
  capture.played_animations = played_animations(document, selected, capture.animations);
  charge_procedures(document, capture);
  settle_effects(capture);
  capture.cameras = build_cameras(document);
  build_lights(document, capture);
  capture.settings = build_settings(document);
  if (selected.camera_node != kNone) capture.settings.camera_node = selected.camera_node;
  build_environment(document, capture);
}

}  // namespace tessera::scene::gltf
