// Prints the refusals of `tessera inspect` without the program: a sanitized build of decoders runs the reader's tests
// with it.
#include <cstdio>
#include <string_view>

#include "base/error.h"
#include "scene/capture_reader.h"

int main(int argc, char** argv) {
  using namespace tessera;
  const auto fail = [](ExitStatus status, const std::exception& error) {
    std::fprintf(stderr, "tessera: %s\n", error.what());
    return static_cast<int>(status);
  };
  try {
    scene::read_capture(argv[2], {.strict = argc > 3 && std::string_view(argv[3]) == "--strict"});
    return 0;
  } catch (const InputError& error) {
    return fail(ExitStatus::kBadInput, error);
  } catch (const LimitError& error) {
    return fail(ExitStatus::kLimit, error);
  } catch (const std::exception& error) {
    return fail(ExitStatus::kInternal, error);
  }
}
