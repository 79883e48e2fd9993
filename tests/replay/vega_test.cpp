// Vega's modules are found where they are, at run time.
#include "replay/report/page_parts.h"
#include "tests/support/tests.h"

namespace tessera::replay::vega_test {
namespace {

class Vega : public testing::Test {
 protected:
  Vega() {
    for (const char* name : {"TESSERA_VEGA", "XDG_DATA_HOME", "XDG_DATA_DIRS"}) {
      const char* value = std::getenv(name);
      before_[name] = value == nullptr ? std::nullopt : std::optional<std::string>(value);
    }
    unsetenv("TESSERA_VEGA");
    setenv("XDG_DATA_HOME", (folder_ / "home").c_str(), 1);
    setenv("XDG_DATA_DIRS", ((folder_ / "a/share").string() + ":" + (folder_ / "b/share").string()).c_str(), 1);
  }
  // Tests of the same process start programs that look for Vega.
  ~Vega() override {
    for (const auto& [name, value] : before_) value ? setenv(name.c_str(), value->c_str(), 1) : unsetenv(name.c_str());
  }
  fs::path put(const std::string& name) {
    const fs::path file = folder_ / name;
    fs::create_directories(file.parent_path());
    test::write_text(file, "module");
    return file;
  }
  test::TemporaryFolder folder_;

 private:
  std::map<std::string, std::optional<std::string>> before_;
};

TEST_F(Vega, IsFoundBelowEveryDataFolderAsDistributionsAndNpmHaveIt) {
  EXPECT_EQ(find_vega_module("vega-none"), "");
  for (const char* place : {"b/lib/node_modules/vega/node_modules/vega-x/build/vega-x.min.js",
                            "b/lib/node_modules/vega-x/build/vega-x.min.js", "b/share/vega/vega-x.min.js",
                            "b/share/javascript/vega/vega-x.min.js", "a/share/javascript/vega/vega-x.min.js",
                            "home/javascript/vega/vega-x.min.js"}) {
    const fs::path file = put(place);  // each before the files already there
    EXPECT_EQ(find_vega_module("vega-x"), file);
  }
}

TEST_F(Vega, TheVariableIsTheOnlyFolderWhereItIsSet) {
  put("a/share/javascript/vega/vega-x.min.js");
  const fs::path mine = put("mine/vega-y.min.js");
  setenv("TESSERA_VEGA", (folder_ / "mine").c_str(), 1);
  EXPECT_EQ(find_vega_module("vega-x"), "");
  EXPECT_EQ(find_vega_module("vega-y"), mine);
}

TEST_F(Vega, WithoutVariablesTheUsualFoldersAreLookedAt) {
  unsetenv("XDG_DATA_DIRS");
  EXPECT_THAT(vega_folders(),
              testing::IsSupersetOf({fs::path("/usr/local/share/javascript/vega"),
                                     fs::path("/usr/share/javascript/vega"), fs::path("/usr/lib/node_modules")}));
}

}  // namespace
}  // namespace tessera::replay::vega_test
