// A unit of the machine is found by its name: in one file, whose path or text says it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string>

#include "tests/support/captures.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

struct UnitPlace {
  const char* unit;
  const char* file;
};

constexpr UnitPlace kUnits[] = {
    {"coverage", "binner/coverage.h"},
    {"device", "gpu/device.h"},
    {"dither", "tilecore/resolve/pattern_dither.h"},
    {"front end", "frontend/front_end.h"},
    {"L2", "memory/l2.h"},
    {"list builder", "binner/binner.h"},
    {"parameter buffer", "binner/parameter_buffer.h"},
    {"raster path", "tilecore/visibility/raster_kernel.cpp"},
    {"ray path", "tilecore/visibility/ray-inl.h"},
    {"resolve unit", "tilecore/resolve/resolve_unit.h"},
    {"sampling controller", "tilecore/procedural/sampling_controller.h"},
    {"shading cache", "tilecore/shading/shading_cache.h"},
    {"splitter", "frontend/patch_splitter.h"},
    {"stencil", "tilecore/visibility/stencil.h"},
    {"temporal reprojection", "tilecore/resolve/advection.h"},
    {"tessellator", "tilecore/tessellation/tessellator.h"},
    {"texture cache", "tilecore/shading/texture_unit.h"},
    {"tile core", "tilecore/tile_core.h"},
    {"tile scheduler", "gpu/tile_scheduler.h"},
    {"timing", "timing/timing_model.h"},
};

// Small letters; what parts words in a file's name parts them as in a sentence.
std::string plain(std::string text) {
  for (char& c : text) c = c == '_' ? ' ' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool says(const UnitPlace& place) {
  const fs::path file = fs::path(TESSERA_SOURCE_DIR) / place.file;
  return fs::is_regular_file(file) &&
         plain(place.file + test::read_text(file)).find(plain(place.unit)) != std::string::npos;
}

TEST(Units, AreFoundByTheirNames) {
  for (const UnitPlace& place : kUnits) EXPECT_TRUE(says(place)) << place.unit << ": " << place.file;
  EXPECT_FALSE(says({"tile core", "gpu/tile_core.h"})) << "the failing twins: no such file,";
  EXPECT_FALSE(says({"texture cache", "tilecore/shading/surface.h"})) << "a file that does not say it";
}

}  // namespace
}  // namespace tessera
