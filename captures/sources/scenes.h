#pragma once

#include <filesystem>

namespace tessera::captures {

// Each function writes the source of one shipped capture: NAME.gltf with its files.
void make_eggs(const std::filesystem::path& folder);      // displaced Bezier patches, moving and defocused
void make_vases(const std::filesystem::path& folder);     // static, pinhole, undisplaced
void make_serpent(const std::filesystem::path& folder);   // a skinned mesh with a morph target
void make_workshop(const std::filesystem::path& folder);  // procedures only: a still life
void make_flyby(const std::filesystem::path& folder);     // fast motion across the whole screen
void make_stroll(const std::filesystem::path& folder);    // the scene of vases with a moving camera, 60 frames
void make_city(const std::filesystem::path& folder);      // deep, mostly hidden: walking along a street
void make_garden(const std::filesystem::path& folder);    // leaves, flowers and grass in the wind
// The same two scenes with cast shadows instead of baked ones.
void make_city_evening(const std::filesystem::path& folder);  // a low sun, long thin shadows, cars that drive
void make_garden_lamps(const std::filesystem::path& folder);  // eight spot lights at night, two of them swing

void make_corridor(const std::filesystem::path& folder);  // 128 lights of short range, four that cast, tubes that glow

// wall_LAYERS, for the study docs/when_it_pays.md: displaced patches that cover every pixel LAYERS times. In its three frames
// they rest and move by 8 and by 32 pixels. Without attributes (wall_LAYERS_plain) the pixel shader reads the normal alone.
void make_wall(const std::filesystem::path& folder, int layers, bool attributes);

}  // namespace tessera::captures
