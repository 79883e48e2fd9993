// Rules of every struct of settings: it is small, its enums have a word for each value, and nothing but the parser
// compares texts.
#include <regex>

#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "tests/support/tests.h"

namespace tessera::settings_test {
namespace {

// ---- Sizes ------------------------------------------------------------------------------------------------------

struct Anything {
  template <class T>
  operator T() const;  // NOLINT: implicit on purpose; never defined
};

template <class S, std::size_t... kMembers>
constexpr bool takes_members(std::index_sequence<kMembers...>) {
  return requires { S{(static_cast<void>(kMembers), Anything{})...}; };
}

// Number of members of an aggregate; a base class counts as one.
template <class S, std::size_t kCount = 100>
constexpr std::size_t member_count() {
  static_assert(std::is_aggregate_v<S> && kCount > 0);
  if constexpr (takes_members<S>(std::make_index_sequence<kCount>()))
    return kCount;
  else
    return member_count<S, kCount - 1>();
}

struct Three {
  int a;
  std::string b;
  double c;
};
static_assert(member_count<Three>() == 3);

template <class... S>
constexpr bool small_enough() {
  return ((member_count<S>() <= 20) && ...);
}
static_assert(small_enough<
              gpu::RunSettings, scene::TessellationSettings, tilecore::PatternSettings, tilecore::ShadingSettings,
              gpu::EffectSettings, tilecore::ProcedureSettings, tilecore::ResolveSettings, tilecore::RateSettings,
              tilecore::SpeedThresholds, tilecore::EdgeSettings, tilecore::DitherSettings, tilecore::AdvectionSettings,
              tilecore::DiscrepancySettings, tilecore::FoveationSettings, gpu::StereoSettings, gpu::OutputSettings>());
static_assert(small_enough<gpu::GpuConfiguration, frontend::Settings, binner::TileSize, binner::ParameterBufferSettings,
                           binner::Settings, tilecore::TessellatorSettings, gpu::BaselineCaches, tilecore::CoreSettings,
                           tilecore::VisibilityMethodSettings, tilecore::ShadingCacheSettings,
                           tilecore::FrameBufferSettings, hardware::Machine, hardware::TileCores, hardware::PixelShader,
                           hardware::Caches, hardware::MemoryInterface, hardware::OtherSilicon>());

// ---- Words ------------------------------------------------------------------------------------------------------

// Whether an enumerator has this value: compilers print a value without one as a cast.
template <auto kValue>
constexpr bool has_name() {
  constexpr std::string_view kText = __PRETTY_FUNCTION__, kStart = "kValue = ";
  return kText[kText.find(kStart) + kStart.size()] != '(';
}

template <WordEnum E, std::size_t... kValues>
constexpr bool are_named(std::index_sequence<kValues...>) {
  return (has_name<static_cast<E>(kValues)>() && ...);
}

// As many words as values.
template <WordEnum E>
constexpr bool words_fit() {
  constexpr std::size_t kWords = kEnumWords<E>.size();
  return are_named<E>(std::make_index_sequence<kWords>()) && !has_name<static_cast<E>(kWords)>();
}

template <WordEnum... E>
constexpr bool all_words_fit() {
  return (words_fit<E>() && ...);
}
static_assert(
    all_words_fit<tilecore::TemporalPattern, tilecore::TimeBits, tilecore::ShadingRate, tilecore::AttributePrecision,
                  gpu::EffectMode, gpu::EffectSwitch, tilecore::ProcedureSettings::Path,
                  tilecore::ProcedureSettings::Mode, tilecore::ProcedureSettings::Style, tilecore::Desampling,
                  tilecore::BlockSpeed, tilecore::EdgeMeasure, tilecore::DitherOrder, tilecore::Fetch,
                  tilecore::DiscrepancyCheck, tilecore::Reconstruction, tilecore::StencilReach>());
static_assert(all_words_fit<frontend::BoundMethod, frontend::SplitCriterion, binner::CoverageMethod, binner::FullPolicy,
                            tilecore::VisibilityMethod, tilecore::Traversal, tilecore::BranchNode,
                            tilecore::FrameBufferCompression, tilecore::FrameFormat>());

// The twins: a word too few, and one too many.
enum class Few { kOne, kTwo };
enum class Many { kOne };
}  // namespace
}  // namespace tessera::settings_test
template <>
inline constexpr auto tessera::kEnumWords<tessera::settings_test::Few> = std::to_array<std::string_view>({"one"});
template <>
inline constexpr auto tessera::kEnumWords<tessera::settings_test::Many> = std::to_array<std::string_view>({"one",
                                                                                                           "two"});
namespace tessera::settings_test {
namespace {
static_assert(!words_fit<Few>() && !words_fit<Many>());

template <class S>
void expect_every_word_sets_what_it_says(const KeyTable<S>& table) {
  for (const Key<S>& key : table.keys())
    for (const std::string_view choice : key.choices) {
      S object;
      table.set(object, key, std::string(choice));
      EXPECT_EQ(std::get<std::string>(table.value(object, key)), choice) << key.name;
    }
}

TEST(Settings, EveryWordOfEveryKeySetsItsValue) {
  expect_every_word_sets_what_it_says(gpu::settings_keys());
  expect_every_word_sets_what_it_says(gpu::gpu_keys());
}

// A value that the key may have and that is not the default.
nlohmann::json another_value(const KeyInfo& key, const KeyValue& value) {
  if (const bool* flag = std::get_if<bool>(&value)) return !*flag;
  if (const std::string* text = std::get_if<std::string>(&value))
    return key.choices.empty() ? std::string_view("another") : key.choices[*text == key.choices[0] ? 1 : 0];
  if (const double* number = std::get_if<double>(&value)) return *number == key.max ? key.min : key.max;
  const auto most = static_cast<std::int64_t>(key.max);
  return std::get<std::int64_t>(value) == most ? static_cast<std::int64_t>(key.min) : most;
}

template <class S>
void expect_every_key_fills_a_member_of_its_own(const KeyTable<S>& table) {
  for (const Key<S>& key : table.keys()) {
    S object;
    table.set(object, key, another_value(key, table.value(object, key)));
    for (const Key<S>& other : table.keys())
      EXPECT_EQ(table.value(object, other) != table.default_value(other), other.name == key.name)
          << key.name << " and " << other.name;
  }
}

TEST(Settings, EveryKeyFillsAMemberOfItsOwn) {
  expect_every_key_fills_a_member_of_its_own(gpu::settings_keys());
  expect_every_key_fills_a_member_of_its_own(gpu::gpu_keys());
}

// ---- Texts ------------------------------------------------------------------------------------------------------

// Comparisons with a word of a setting.
std::vector<std::string> compared_words(const std::string& text) {
  static const std::set<std::string, std::less<>> kWords = [] {
    std::set<std::string, std::less<>> words;
    for (const auto& key : gpu::settings_keys().keys()) words.insert(key.choices.begin(), key.choices.end());
    for (const auto& key : gpu::gpu_keys().keys()) words.insert(key.choices.begin(), key.choices.end());
    return words;
  }();
  static const std::regex kComparison("[=!]= \"([^\"]*)\"");
  std::vector<std::string> found;
  for (auto at = std::sregex_iterator(text.begin(), text.end(), kComparison); at != std::sregex_iterator(); ++at)
    if (kWords.contains((*at)[1].str())) found.push_back((*at)[0]);
  return found;
}

TEST(Settings, OnlyParsersCompareTexts) {
  const fs::path root = TESSERA_SOURCE_DIR;
  // "on" and "off" of flags; glTF's own words and members; words of --webp, --camera, --animation and --without, and of comparisons;
  // words of the language of programs, and of addresses of a view's points.
  const std::set<fs::path> parsers = {root / "base/key_table.cpp",
                                      root / "scene/gltf/scene_builder.cpp",
                                      root / "replay/pack_command.cpp",
                                      root / "replay/left_out.cpp",
                                      root / "shaders_cpp/procedures/program_compiler.cpp",
                                      root / "shaders_cpp/procedures/program_library.cpp",
                                      root / "scene/gltf/selection.cpp",
                                      root / "scene/gltf/procedure_builder.cpp",
                                      root / "scene/view_choices.h",
                                      root / "scene/view_choices.cpp",
                                      root / "replay/pack/stored_view.cpp",
                                      root / "replay/view/view_point.cpp",
                                      root / "replay/compare/image_comparison.cpp"};
  for (const char* folder : {"base", "shaders_cpp", "scene", "memory", "hardware", "timing", "frontend", "binner",
                             "tilecore", "gpu", "baselines", "reference", "replay"})
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string ending = entry.path().extension().string();
      if ((ending != ".h" && ending != ".cpp") || parsers.contains(entry.path())) continue;
      for (const std::string& found : compared_words(test::read_text(entry.path())))
        ADD_FAILURE() << entry.path() << " compares a setting's text: " << found;
    }
  EXPECT_EQ(compared_words("if (settings.rate == \"sample\" && name != \"pool\")").size(), 1u) << "the twin";
}

}  // namespace
}  // namespace tessera::settings_test
