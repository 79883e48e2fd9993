// Main program of the fuzz targets, of all or of the decoders alone: tessera_fuzz TARGET [--corpus FOLDER]
// [libFuzzer's options and files]. It writes the target's seeds into the corpus folder and calls libFuzzer with the
// limits below; the caller's options come after these limits and replace them. `tessera_fuzz --list` names the
// targets.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "base/sha256.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed);

namespace tessera::fuzz {
namespace {

namespace fs = std::filesystem;

const Target* g_target = nullptr;

struct Scratch {
  fs::path path;
  Scratch() {
    const fs::path memory = "/dev/shm";
    std::error_code missing;
    std::string name =
        ((fs::is_directory(memory, missing) ? memory : fs::temp_directory_path()) / "tessera_fuzz_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      std::perror("tessera_fuzz: no folder for inputs");
      std::exit(1);
    }
    path = name;
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

[[noreturn]] void usage() {
  std::fprintf(stderr, "usage: tessera_fuzz TARGET [--corpus FOLDER] [OPTIONS OF LIBFUZZER] [FILES]\n");
  for (const Target& t : targets())
    std::fprintf(stderr, "  %-10s %s\n", std::string(t.name).c_str(), std::string(t.about).c_str());
  std::exit(2);
}

void write_seeds(const fs::path& folder) {
  fs::create_directories(folder);
  for (const std::string& seed : g_target->seeds()) {
    if (seed.size() > g_target->max_bytes) continue;
    std::ofstream(folder / ("seed_" + sha256_hex(seed).substr(0, 16)), std::ios::binary) << seed;
  }
}

}  // namespace

const fs::path& scratch_folder() {
  static const Scratch kFolder;
  return kFolder.path;
}

void write_scratch(const fs::path& file, Bytes bytes) {
  std::FILE* out = std::fopen(file.c_str(), "wb");
  require(out != nullptr && std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size() && std::fclose(out) == 0,
          "a file for the input could not be written");
}

void write_scratch(const fs::path& file, std::string_view text) {
  write_scratch(file, Bytes{reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

std::size_t mutate_bytes(std::uint8_t* data, std::size_t size, std::size_t max_size) {
  return LLVMFuzzerMutate(data, size, max_size);
}

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "tessera_fuzz: %s\n", what);
  std::abort();
}

}  // namespace tessera::fuzz

using tessera::fuzz::g_target;

// Short stacks per allocation: unwinding all of them takes longer than reading a document.
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "malloc_context_size=4:quarantine_size_mb=32"; }

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  namespace fuzz = tessera::fuzz;
  // libFuzzer starts itself again for some of its modes, without the name of the target.
  const char* const kVariable = "TESSERA_FUZZ_TARGET";
  std::vector<std::string> words(*argv, *argv + *argc);
  if (words.size() == 2 && words[1] == "--list") {
    for (const fuzz::Target& t : fuzz::targets()) std::printf("%s\n", std::string(t.name).c_str());
    std::exit(0);
  }
  const char* inherited = std::getenv(kVariable);
  std::string name = inherited != nullptr ? inherited : "";
  if (inherited == nullptr) {
    if (words.size() < 2) fuzz::usage();
    name = words[1];
    words.erase(words.begin() + 1);
    setenv(kVariable, name.c_str(), 1);
  }
  for (const fuzz::Target& t : fuzz::targets())
    if (t.name == name) g_target = &t;
  if (g_target == nullptr) fuzz::usage();

  // [assumed] ten seconds are a hang: the slowest input of a seed corpus takes a hundredth of that. With Draco, a
  // minute. Debian's Draco sizes a vector of bits by a number of the stream, 2^31 at most, before it looks at the
  // number, and then decodes as many bits: 256 MiB, and some seconds.
  const bool draco = name == "capture" || name == "draco" || name == "replay";
  const std::uint64_t most = fuzz::kMaxBytes + (draco ? 256u << 20 : 0u);
  std::vector<std::string> arguments = {words[0], "-max_len=" + std::to_string(g_target->max_bytes),
                                        std::string("-timeout=") + (draco ? "60" : "10"), "-rss_limit_mb=2048",
                                        "-malloc_limit_mb=" + std::to_string(most >> 20)};
  // Entropic schedules by the rarity of features, which takes longer to keep for captures than to read them.
  if (name == "capture" || name == "replay") arguments.emplace_back("-entropic=0");
  for (std::size_t i = 1; i < words.size(); ++i) {
    if (words[i] == "--corpus" && i + 1 < words.size()) {
      fuzz::write_seeds(words[i + 1]);
      continue;
    }
    arguments.push_back(words[i]);
  }
  static std::vector<std::string> g_arguments;
  static std::vector<char*> g_pointers;
  g_arguments = std::move(arguments);
  for (std::string& a : g_arguments) g_pointers.push_back(a.data());
  *argc = static_cast<int>(g_pointers.size());
  g_pointers.push_back(nullptr);
  *argv = g_pointers.data();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  g_target->run({data, size});
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  tessera::fuzz::Generator random(seed | 1u);
  // Plain bytes as well, always: the container's own checks are code, too.
  if (g_target->mutate == nullptr || random() % 4 == 0) return LLVMFuzzerMutate(data, size, max_size);
  return g_target->mutate(data, size, max_size, random);
}
