// docs/images/accuracy/all.csv is current: its rows are rendered and timed again, against the references that are checked in.
#include "tests/support/tests.h"

namespace tessera::replay::accuracy_table_test {
namespace {

namespace fs = std::filesystem;

struct MeasuredRow {
  std::string setting;
  double psnr_db = 0, ms = 0;
};

// The cells of a line of CSV, which have no line breaks.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (const char c : line)
    if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      cells.emplace_back();
    else
      cells.back() += c;
  return cells;
}

std::vector<MeasuredRow> rows_of(const fs::path& file, const std::string& capture, const std::string& knob) {
  std::vector<MeasuredRow> rows;
  std::istringstream lines(test::read_text(file));
  for (std::string line; std::getline(lines, line);)
    if (const std::vector<std::string> c = cells_of(line); c[0] == capture && c[1] == knob)
      rows.push_back({c[2], std::stod(c[4]), std::stod(c[7])});
  return rows;
}

// The published rows that are no longer true: ms is off by 1 %, PSNR by 0.1 dB, or no row measures the setting now.
std::vector<std::string> stale_rows(const std::vector<MeasuredRow>& published, const std::vector<MeasuredRow>& now) {
  std::vector<std::string> stale;
  for (const MeasuredRow& row : published) {
    const auto found =
        std::find_if(now.begin(), now.end(), [&](const MeasuredRow& other) { return other.setting == row.setting; });
    if (found == now.end() || std::abs(found->ms / row.ms - 1) > 0.01 || std::abs(found->psnr_db - row.psnr_db) > 0.1)
      stale.push_back(row.setting);
  }
  return stale;
}

const fs::path kTable = fs::path(TESSERA_SOURCE_DIR) / "docs/images/accuracy/all.csv";
const fs::path kReferences = fs::path(TESSERA_SOURCE_DIR) / "captures/references";

class AccuracyTable : public testing::TestWithParam<const char*> {};

TEST_P(AccuracyTable, IsCurrent) {
  const std::string capture = GetParam();
  const std::vector<MeasuredRow> published = rows_of(kTable, capture, "samples");
  ASSERT_GE(published.size(), 3u);
  const test::TemporaryFolder folder;
  fs::copy(kReferences, folder / "references");
  const test::ProcessResult r =
      test::run_tessera({"tradeoff", test::shipped_capture(capture).string(), "--out", (folder / "out").string(),
                         "--size", "320x180", "--reference-samples", "256", "--rounds", "1", "--knobs", "samples",
                         "--reference-folder", (folder / "references").string()});
  ASSERT_EQ(r.status, 0) << r.errors;
  EXPECT_THAT(r.errors, testing::Not(testing::HasSubstr(" is old"))) << "run docs/images/accuracy/make.sh";
  std::vector<MeasuredRow> now;
  const auto result = nlohmann::json::parse(test::read_text(folder / "out" / "tradeoff.json"));
  for (const auto& setting : result["knobs"][0]["settings"])
    now.push_back({setting["label"], setting["error"]["psnr_db"], setting["ms"]});
  EXPECT_THAT(stale_rows(published, now), testing::IsEmpty()) << "run docs/images/accuracy/make.sh";
  // The twin: a row that was changed is noticed.
  for (std::size_t row = 0; row < published.size(); ++row)
    for (const auto& [ms, db] :
         {std::pair(1.02, 0.0), std::pair(0.98, 0.0), std::pair(1.0, 0.2), std::pair(1.0, -0.2)}) {
      std::vector<MeasuredRow> changed = published;
      changed[row].ms *= ms;
      changed[row].psnr_db += db;
      EXPECT_THAT(stale_rows(changed, now), testing::ElementsAre(published[row].setting));
    }
}

INSTANTIATE_TEST_SUITE_P(Captures, AccuracyTable,
                         testing::Values("eggs", "vases", "stroll", "flyby", "serpent", "city", "garden", "workshop"),
                         [](const auto& of) { return std::string(of.param); });

// Each reference is the one that references.csv tells of, and small enough to be checked in.
TEST(CheckedInReferences, AreSmallAndSayTheirNoise) {
  int images = 0;
  for (const auto& file : fs::directory_iterator(kReferences)) {
    if (file.path().extension() != ".exr") continue;
    ++images;
    EXPECT_LE(file.file_size(), 1500000u) << file.path();
    const auto info = nlohmann::json::parse(test::read_text(fs::path(file.path()).replace_extension(".json")));
    EXPECT_GT(info["psnr_db"].get<double>(), 40) << file.path();
    EXPECT_EQ(info["probe"].get<std::string>().size(), 64u);
  }
  EXPECT_EQ(images, 8);
}

}  // namespace
}  // namespace tessera::replay::accuracy_table_test
