#pragma once

#include <cstdint>
#include <vector>

#include "base/counter.h"
#include "frontend/bounds/sub_patch_bounder.h"
#include "frontend/occlusion_candidate.h"
#include "frontend/settings.h"
#include "memory/ledger.h"
#include "scene/frame_geometry.h"

namespace tessera::frontend {

// Instances of a node are tested before anything of their mesh is fetched: a group of neighbours by one box, then each
// instance of a group that may be visible by its own box.
//
// Invariants (cited by the tests):
//   IC1  An instance's body holds every vertex that the machine computes of it, at both motion keys; a group's body
//        holds its instances' bodies. A dropped instance appears nowhere in the frame.
//   IC2  Every group of a visible node is tested, and every instance of a group that stays; each test reads one record.
//   IC3  Drawables that stay keep their order: each instance yields the sub-patches of its node, in instance order.

// [spec] an instance of VK_KHR_acceleration_structure and of Direct3D 12: a matrix of 3x4 floats, 16 bytes of numbers
inline constexpr std::uint64_t kInstanceRecordBytes = 64;
// [assumed] ranges of origin and linear part, first instance and count: scene::InstanceGroup
inline constexpr std::uint64_t kInstanceGroupBytes = sizeof(scene::InstanceGroup);

struct InstanceCounters {
  std::uint64_t instances = 0;
  std::uint64_t groups_tested = 0;
  std::uint64_t instances_tested = 0;
  std::uint64_t instances_culled = 0;
};

// Bytes that a unit which draws a patch of it reads besides the patch's record, which instances share.
inline std::uint64_t instance_record_bytes(const scene::PosedDrawable& drawable) {
  return drawable.drawable->instanced ? kInstanceRecordBytes : 0;
}

// Box of the mesh that a node's instances share, in object space at both motion keys, displacement included.
MovingBox instanced_box(const scene::FrameGeometry& frame, const scene::InstancedNode& node,
                        const PyramidLibrary& pyramids);

// That box placed by one instance; and a body that holds it as placed by every instance of a group.
SubPatchBody instance_body(const scene::FrameGeometry& frame, const scene::InstancedNode& node, const MovingBox& box,
                           std::uint32_t instance);
SubPatchBody group_body(const scene::FrameGeometry& frame, const scene::InstancedNode& node, const MovingBox& box,
                        const scene::InstanceGroup& group);

// `read`: 1 for each drawable that the front end reads, else 0; empty: it reads all. `boxes`: instanced_box() of each
// instanced node. Instances that `depth`, unless null, hides are deferred.
struct InstanceCulling {
  std::vector<std::uint8_t> read;
  std::vector<OcclusionCandidate> deferred;
  InstanceCounters counters;
  PreviousDepthCounters previous_depth;
  memory::Ledger ledger;
};
InstanceCulling cull_instances(const scene::FrameGeometry& frame, const std::vector<MovingBox>& boxes,
                               const FrontEndSpec& spec, const CoarseDepth* depth = nullptr);
InstanceCulling cull_instances(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids,
                               const FrontEndSpec& spec, const CoarseDepth* depth = nullptr);

// Number of drawables of the instance that begins with `first_drawable`.
std::uint32_t instance_drawables(const scene::Assembly& assembly, std::uint32_t first_drawable);

}  // namespace tessera::frontend

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<frontend::InstanceCounters> = true;
template <>
inline constexpr auto kCounterFields<frontend::InstanceCounters> =
    std::to_array<CounterField<frontend::InstanceCounters>>({
        {"frontend.instances", &frontend::InstanceCounters::instances, Combine::kSum, "instances",
         "Instances of nodes that have any (EXT_mesh_gpu_instancing).", ""},
        {"frontend.instance_groups_tested", &frontend::InstanceCounters::groups_tested, Combine::kSum, "groups",
         "Groups of neighbouring instances whose common box was tested against the view.", ""},
        {"frontend.instances_tested", &frontend::InstanceCounters::instances_tested, Combine::kSum, "instances",
         "Instances of visible groups whose own box was tested against the view.", ""},
        {"frontend.instances_culled", &frontend::InstanceCounters::instances_culled, Combine::kSum, "instances",
         "Instances dropped by their own box or their group's; none of their mesh was read for them.", ""},
    });
TESSERA_COUNTERS_COVER(frontend::InstanceCounters);

}  // namespace tessera
