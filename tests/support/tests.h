#pragma once

// Headers that all tests use, precompiled once for all programs.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/support/captures.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace tessera {

namespace fs = std::filesystem;
using nlohmann::json;
using test::ProcessResult;
using test::Random;
using test::run_tessera;
using testing::HasSubstr;

}  // namespace tessera
