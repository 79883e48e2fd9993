#include "replay/stability/stability.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "replay/stability/case_tables.h"
#include "replay/stability/measures.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::replay::stability {

const std::vector<StabilitySection>& stability_sections() {
  static const std::vector<StabilitySection> kSections = {
      {kBounds,
       "A sub-patch is binned by a bound of its displaced, moving, defocused surface. The error is how far the surface "
       "in double precision, or a vertex of the machine, sticks out of the bound of any of the five methods; a "
       "negative "
       "one is how far all of it stays inside."},
      {kMotion,
       "Between motion keys the machine moves vertices along straight lines. The error is the distance on screen "
       "between a vertex and its true place at the same time; a case in ppm counts samples that see another side, and "
       "one in rms/255 compares with the mean of 64 still frames."},
      {kPlacesAndScales,
       "The same scene elsewhere, or of another size. The error is the distance of the machine's vertices from double "
       "precision, or the number of pixels that differ from the scene at its own size."},
      {kProcedures,
       "Surfaces that are formulas. The error is the distance of the machine's vertices from the formula in double "
       "precision."},
      {kBinning,
       "Binning decides which work is done, never its result. The error is the number of pixels "
       "that differ in any bit from the image with other tiles, lists or buffers."},
      {kVisibility,
       "The error counts samples, of a million (ppm), whose colour differs from the "
       "double-precision renderer's for the same samples: vertices lie on a grid of 1/256 pixel, so "
       "a few samples beside edges do. Where a surface covers the frame once, every sample must see "
       "it once."},
      {kLayers,
       "Surfaces in one plane. The error is the largest difference of a channel from the formula, in steps of 2^-24 of "
       "its value."},
      {kResolve,
       "Frames of which most pixels are reprojected or reconstructed. The error is the largest difference of a channel "
       "from the surface's colour after seven frames, in steps of 2^-24 of its value (ulp)."},
      {kShadows,
       "A floor seen from above, and shadows whose outlines are known. The error counts pixels that "
       "have light in the shadow, or lack some outside of it; pixels within two pixels of its edge "
       "do not count."},
  };
  return kSections;
}

const std::vector<StabilityCase>& stability_cases() {
  static const std::vector<StabilityCase> kCases = [] {
    std::vector<StabilityCase> all;
    for (const auto& section : {bound_cases, motion_cases, place_cases, procedure_cases, binning_cases,
                                visibility_cases, layer_cases, resolve_cases, shadow_cases})
      for (StabilityCase& one : section()) all.push_back(std::move(one));
    return all;
  }();
  return kCases;
}

StabilityResult measure(const StabilityCase& of) { return {&of, of.error(of.scene(), false)}; }

std::string error_text(double error) {
  if (error == 0) return "0";
  if (std::isinf(error)) return error > 0 ? "infinite" : "none";
  std::string digits = fmt::format("{:.2g}", error);
  if (std::abs(error) >= 10 && std::abs(error) < 1e6) digits = fmt::format("{:.0f}", std::stod(digits));
  return digits;
}

Image8 thumbnail(const StabilityCase& of) {
  Stage stage = of.scene();
  stage.keys.emplace_back("sampling.samples_per_pixel=64");
  const Image8 all = shaders::to_display(render(stage), 1.0f);
  Image8 image(kThumbnailWidth, kThumbnailHeight, all.channels);
  for (int y = 0; y < std::min(all.height, image.height); ++y)
    std::copy_n(all.at(0, y).begin(), std::min(all.width, image.width) * all.channels, image.at(0, y).begin());
  return image;
}

std::string thumbnail_file(const StabilityCase& of) {
  std::string name;
  for (const char c : of.law) {
    if (std::isupper(static_cast<unsigned char>(c)) != 0 && !name.empty()) name += '_';
    name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return name + ".webp";
}

namespace {

std::string tests_text(const StabilityCase& of) {
  std::string text =
      fmt::format("`Case/Stability.KeepsItsBound/{0}`, twin `Case/Stability.ATwinIsNoticed/{0}`", of.law);
  std::string_view rest = of.tests;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    text += fmt::format(", `{}`", rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return text;
}

// Cases of a section, and the largest error in each unit.
std::string summary_row(const StabilitySection& section, std::span<const StabilityResult> results) {
  std::vector<std::pair<std::string_view, double>> largest;
  int count = 0;
  for (const StabilityResult& result : results) {
    if (result.of->section != section.name) continue;
    ++count;
    const auto known = std::ranges::find(largest, result.of->unit, &std::pair<std::string_view, double>::first);
    if (known == largest.end())
      largest.emplace_back(result.of->unit, result.error);
    else
      known->second = std::max(known->second, result.error);
  }
  std::string errors;
  for (const auto& [unit, error] : largest)
    errors += fmt::format("{}{} {}", errors.empty() ? "" : ", ", error_text(error), unit);
  std::string anchor(section.name);
  std::ranges::replace(anchor, ' ', '-');
  std::ranges::transform(anchor, anchor.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return fmt::format("| [{}](#{}) | {} | {} |\n", section.name, anchor, count, errors);
}

}  // namespace

std::string page_row(const StabilityResult& result, std::string_view folder) {
  const StabilityCase& of = *result.of;
  return fmt::format("| ![{0}]({1}/{2}) | **{0}.** {3} *{4}* The twin has {5}.<br><sub>{6}</sub> | {7} {8} | {9} |\n",
                     of.name, folder, thumbnail_file(of), of.hard, of.kept, of.twin, tests_text(of),
                     error_text(result.error), of.unit, error_text(of.bound));
}

std::string stability_page(std::span<const StabilityResult> results, std::string_view folder) {
  const auto held = std::ranges::count_if(results, [](const StabilityResult& result) { return result.holds(); });
  std::string text = fmt::format("**{} of {} cases hold.**\n\n| section | cases | largest error |\n|---|---:|---|\n",
                                 held, results.size());
  for (const StabilitySection& section : stability_sections()) text += summary_row(section, results);
  text += "\n";
  for (const StabilitySection& section : stability_sections()) {
    text +=
        fmt::format("## {}\n\n{}\n\n| | case | error | bound |\n|---|---|---:|---:|\n", section.name, section.about);
    for (const StabilityResult& result : results)
      if (result.of->section == section.name) text += page_row(result, folder);
    text += "\n";
  }
  return text;
}

}  // namespace tessera::replay::stability
