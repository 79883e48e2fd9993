#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/image.h"
#include "replay/stability/stage.h"

namespace tessera::replay::stability {

// Hard cases of `tessera selfcheck --stability`: each is a small scene that breaks renderers of this kind, an error
// that is measured against double precision on this machine, and a bound on the error.
//
// Invariants (cited by the tests):
//   STB1  Every case keeps its bound.
//   STB2  Every case has a twin, the same scene with one deliberate fault, whose error exceeds the bound.
//   STB3  Errors are the same for any number of threads and on every instruction set.

struct StabilityCase {
  std::string_view section;  // one of stability_sections()
  std::string_view name;     // on the page and in the table
  std::string_view law;      // in names of tests
  std::string_view hard;     // why it is hard: a sentence
  std::string_view kept;     // the mechanism that keeps the bound, and its source: a sentence
  std::string_view twin;     // the fault of its twin: a phrase
  std::string_view tests;    // further tests of the same law, separated by spaces
  double bound;              // the case holds where the error is at most this
  std::string_view unit;
  std::function<Stage()> scene;  // scene of the image on the page
  std::function<double(const Stage&, bool twin)> error;
};

struct StabilitySection {
  std::string_view name, about;  // about: meaning of its errors
};
const std::vector<StabilitySection>& stability_sections();

// All cases, section by section.
const std::vector<StabilityCase>& stability_cases();

struct StabilityResult {
  const StabilityCase* of = nullptr;
  double error = 0;
  bool holds() const { return error <= of->bound; }
};
StabilityResult measure(const StabilityCase& of);
// "0.0021"; errors are rounded to two digits.
std::string error_text(double error);

// The case's scene rendered by the machine; kThumbnailWidth x kThumbnailHeight.
inline constexpr int kThumbnailWidth = 160, kThumbnailHeight = 90;
Image8 thumbnail(const StabilityCase& of);
// File of the image, without folder.
std::string thumbnail_file(const StabilityCase& of);

// A case's row of the page's table.
std::string page_row(const StabilityResult& result, std::string_view folder);
// The generated part of docs/hard_cases.md, whose images are in `folder` beside the page.
std::string stability_page(std::span<const StabilityResult> results, std::string_view folder);

}  // namespace tessera::replay::stability
