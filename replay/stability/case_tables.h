#pragma once

#include <vector>

#include "replay/stability/stability.h"

namespace tessera::replay::stability {

// The cases of each section, in the order of the page.
std::vector<StabilityCase> bound_cases();
std::vector<StabilityCase> motion_cases();
std::vector<StabilityCase> place_cases();
std::vector<StabilityCase> procedure_cases();
std::vector<StabilityCase> binning_cases();
std::vector<StabilityCase> visibility_cases();
std::vector<StabilityCase> layer_cases();
std::vector<StabilityCase> resolve_cases();
std::vector<StabilityCase> shadow_cases();

inline constexpr std::string_view kBounds = "Bounds of patches", kMotion = "Motion",
                                  kPlacesAndScales = "Places and scales", kProcedures = "Procedural surfaces",
                                  kBinning = "Binning", kVisibility = "Visibility", kLayers = "Layers",
                                  kResolve = "Resolve", kShadows = "Shadows";

}  // namespace tessera::replay::stability
