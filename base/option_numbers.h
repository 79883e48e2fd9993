#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace tessera {

// Numbers in the value of an option. All throw UsageError: "OPTION TEXT: expected FORM".
[[noreturn]] void refuse_value(const std::string& option, const std::string& text, const char* form);

// `count` whole numbers from 0 to 100 000 000, separated by one character: "1280x720", "0:24", "0,0,64,64".
std::vector<long> parse_whole_numbers(const std::string& option, const std::string& text, char separator,
                                      std::size_t count, const char* form);

struct ImageSize {
  int width = 0, height = 0;
};
// "WxH", 1 to 16384 each.
ImageSize parse_size(const std::string& option, const std::string& text);

struct FrameRange {
  int first = 0, last = 0;  // `last` is not rendered
};
// "A:B" with A < B.
FrameRange parse_frames(const std::string& option, const std::string& text);

// "A:B", each a finite number.
struct NumberPair {
  double a = 0, b = 0;
};
NumberPair parse_pair(const std::string& option, const std::string& text, const char* form);

// `value` when it lies in [low, high], or in (low, high] when `open`; NaN lies nowhere.
double check_number(const std::string& option, double value, double low, double high, bool open = false);

// Whether one of the texts of --set ("KEY=VALUE") sets this key.
bool sets_key(const std::vector<std::string>& sets, const std::string& key);

}  // namespace tessera
