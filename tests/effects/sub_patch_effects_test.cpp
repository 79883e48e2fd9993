// Effects that the front end elides for a sub-patch, against the tile core's computation of it.
#include "frontend/sub_patch_effects.h"
#include "frontend/front_end.h"
#include "scene/subpixel.h"
#include "tests/effects/effect_scenes.h"
#include "tests/support/tests.h"
#include "tilecore/shading/alpha_test.h"
#include "tilecore/tessellation/tessellator.h"

namespace tessera::frontend::sub_patch_effects_test {
namespace {

using tilecore::MicroMesh;
using tilecore::Tessellator;

struct Posed {
  std::unique_ptr<scene::Capture> capture;
  scene::Assembly assembly;
  PyramidLibrary pyramids;
  std::unique_ptr<scene::FrameGeometry> frame;

  explicit Posed(std::unique_ptr<scene::Capture> made)
      : capture(std::move(made)), assembly(assemble(*capture)), pyramids(assembly) {
    scene::FrameRequest request;
    request.width = 320;
    request.height = 200;
    request.close_time = 1.0;
    request.interpolated_surfaces = true;
    frame = pose_frame(assembly, choose_camera(*capture, request.width, request.height), request);
  }
  std::vector<BoundedSubPatch> sub_patches() const { return run_front_end(*frame, pyramids, {}).sub_patches; }
  MicroMesh mesh(const BoundedSubPatch& s, bool displaced = true) const {
    Tessellator tessellator;
    MicroMesh mesh;
    tessellator.tessellate(*frame, s.base_patch, s.range, {true, true}, mesh, displaced);
    return mesh;
  }
};

// SE1 for one mesh.
bool stands_still(const MicroMesh& m) {
  for (std::size_t v = 0; v < m.vertex_count; ++v)
    if (!m.projected[v] || m.x0[v] != m.x1[v] || m.y0[v] != m.y1[v] || m.z0[v] != m.z1[v]) return false;
  return true;
}

// SE2 for one mesh: as the kernels compute the factor, at both motion keys and between.
bool is_sharp(const MicroMesh& m, const scene::Projection& projection) {
  const float focus = static_cast<float>(projection.inverse_focus), most = sharp_factor(projection);
  for (std::size_t v = 0; v < m.vertex_count; ++v)
    for (const float t : {0.0f, 0.25f, 0.7f, 1.0f}) {
      const float z = std::fma(t, m.z1[v] - m.z0[v], m.z0[v]),
                  factor = projection.orthographic ? 1.0f - z * focus : 1.0f / z - focus;
      if (!m.projected[v] || std::abs(factor) > most) return false;
    }
  return true;
}

TEST(SubPatchEffects, SE1AndSE2HoldForEverySubPatchThatGoesWithoutMotionOrLens) {
  std::size_t still = 0, moving = 0, sharp = 0, blurred = 0;
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    const Posed scene(test::slow_scene(seed));
    for (const BoundedSubPatch& s : scene.sub_patches()) {
      const MicroMesh mesh = scene.mesh(s);
      if ((s.effects & kEffectMotion) == 0) {
        EXPECT_TRUE(stands_still(mesh)) << "seed " << seed << " patch " << s.base_patch;
        still += scene.frame->drawable_of(s.base_patch).moving ? 1 : 0;
      } else {
        ++moving;
      }
      if ((s.effects & kEffectDefocus) == 0) {
        if (scene.frame->projection.lens_scale != 0) {
          EXPECT_TRUE(is_sharp(mesh, scene.frame->projection)) << "seed " << seed << " patch " << s.base_patch;
          ++sharp;
        }
      } else {
        ++blurred;
      }
    }
  }
  // The scenes hold all four kinds, or the test shows nothing.
  EXPECT_GT(still, 50u);
  EXPECT_GT(moving, 50u);
  EXPECT_GT(sharp, 50u);
  EXPECT_GT(blurred, 50u);
}

// The twin: with thresholds a few times wider than the tile core's rules, moving and blurred sub-patches lose their
// effects.
TEST(SubPatchEffects, AnElisionThatLeavesOutTooMuchBreaksSE1AndSE2) {
  std::size_t wrong_still = 0, wrong_sharp = 0;
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    const Posed scene(test::slow_scene(seed));
    const scene::Projection& projection = scene.frame->projection;
    for (const BoundedSubPatch& s : scene.sub_patches()) {
      SubPatchBounder bounder(*scene.frame, scene.pyramids, BoundMethod::kNpatch);
      bounder.begin(s.base_patch);
      const SubPatchBody body = bounder.body(s.range);
      const scene::PosedDrawable& drawable = scene.frame->drawable_of(s.base_patch);
      if (drawable.moving && !drawable.deforming &&
          stays_still(body, projection, 8 * static_cast<double>(scene::kStillPixels),
                      8 * static_cast<double>(scene::kStillDepth)))
        wrong_still += stands_still(scene.mesh(s)) ? 0 : 1;
      if (projection.lens_scale != 0 && stays_sharp(s.bounds, projection, 8 * static_cast<double>(scene::kSharpPixels)))
        wrong_sharp += is_sharp(scene.mesh(s), projection) ? 0 : 1;
    }
  }
  EXPECT_GT(wrong_still, 0u);
  EXPECT_GT(wrong_sharp, 0u);
}

TEST(SubPatchEffects, SE3SubPatchesWithoutDisplacementHaveTheSameVerticesWithAndWithoutIt) {
  std::size_t flat = 0, displaced = 0, different = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const Posed scene(test::partly_displaced_scene(seed));
    for (const BoundedSubPatch& s : scene.sub_patches()) {
      const MicroMesh with = scene.mesh(s, true), without = scene.mesh(s, false);
      const bool same = with.x0 == without.x0 && with.y0 == without.y0 && with.z0 == without.z0 &&
                        with.x1 == without.x1 && with.z1 == without.z1;
      EXPECT_TRUE(same || (s.effects & kEffectDisplacement) != 0) << "seed " << seed << " patch " << s.base_patch;
      flat += (s.effects & kEffectDisplacement) == 0 ? 1 : 0;
      displaced += (s.effects & kEffectDisplacement) != 0 ? 1 : 0;
      different += same ? 0 : 1;
    }
  }
  EXPECT_GT(flat, 50u);
  EXPECT_GT(displaced, 50u);
  EXPECT_GT(different, 50u);  // leaving displacement out everywhere would be noticed
}

TEST(SubPatchEffects, SE4NoPointOfASubPatchWithoutAlphaTestIsBelowTheCutoff) {
  std::size_t opaque = 0, tested = 0, below = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const Posed scene(test::masked_scene(seed));
    test::Random random(seed);
    tilecore::AlphaTest test;
    for (const BoundedSubPatch& s : scene.sub_patches()) {
      const scene::PosedDrawable& drawable = scene.frame->drawable_of(s.base_patch);
      if (drawable.material->alpha_mode != scene::AlphaMode::kMask) continue;
      const bool elided = (s.effects & kEffectAlphaTest) == 0;
      (elided ? opaque : tested) += 1;
      const bool grid = has_grid(*drawable.drawable);
      for (int k = 0; k < 200; ++k) {
        const int i = random.integer(s.range.i0, s.range.i1 - 1), j = random.integer(s.range.j0, s.range.j1 - 1);
        const int cell = grid ? j * scene.frame->pattern_of(s.base_patch).nu + i : i;
        tilecore::SurfaceLocation at{s.base_patch, static_cast<std::uint32_t>(2 * cell), random.uniform(0, 1), 0, 0};
        at.b2 = random.uniform(0, 1.0f - at.b1);
        test.begin(*scene.frame, drawable);
        const bool fails = tilecore::point_alpha(*scene.frame, at) < drawable.material->alpha_cutoff ||
                           test.alpha(at, nullptr) < drawable.material->alpha_cutoff;
        EXPECT_FALSE(elided && fails) << "seed " << seed << " patch " << s.base_patch;
        below += fails ? 1 : 0;
      }
    }
  }
  EXPECT_GT(opaque, 50u);
  EXPECT_GT(tested, 50u);
  EXPECT_GT(below, 50u);  // leaving the test out everywhere would be noticed
}

}  // namespace
}  // namespace tessera::frontend::sub_patch_effects_test
