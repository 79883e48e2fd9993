#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <tessera/error.h>

namespace tessera {

// The value of a key. Whole numbers are taken where real ones are asked for; a text, as on the command line, for all.
using Value = std::variant<bool, std::int64_t, double, std::string>;

// What there is to know of a key; `tessera describe settings` and `tessera describe gpu` print the same.
struct KeyDescription {
  std::string name;  // "tile.width"
  std::string type;  // "integer", "number", "boolean", "choice", "text"
  std::string unit;  // "" for pure numbers and choices
  Value default_value;
  double min = 0, max = 0;           // of numbers, inclusive
  std::vector<std::string> choices;  // of choices
  std::string meaning;               // one sentence
  std::string source;                // where a number of the machine is from; "" for settings
};

// The described machine: every number and choice of docs/gpu.md, by its key. A value.
class TESSERA_API Gpu {
 public:
  // A preset ("entry-mobile", "mid-mobile", "high-mobile", "v3d"), or a JSON file of keys nested by their dots.
  // Throws UsageError for an unknown preset, InputError for a file that is no such machine.
  explicit Gpu(const std::string& preset_or_file = "mid-mobile");
  // The same from JSON text: {"preset": "small", "tile": {"width": 16}}; what it leaves out is that of its preset.
  // Throws InputError.
  static Gpu from_json(std::string_view text);
  Gpu(const Gpu& other);
  Gpu(Gpu&& other) noexcept;
  Gpu& operator=(const Gpu& other);
  Gpu& operator=(Gpu&& other) noexcept;
  ~Gpu();

  // Throw UsageError for an unknown key, naming the nearest known one, or a value out of range. Keys that must fit each
  // other are checked by the device.
  Gpu& set(std::string_view key, const Value& value);
  Value get(std::string_view key) const;

  // All of it, nested by the dots of the keys.
  std::string json() const;

  static std::vector<std::string> presets();
  static const std::vector<KeyDescription>& keys();

  struct Content;

 private:
  friend class Device;
  explicit Gpu(std::unique_ptr<Content> content);
  std::unique_ptr<Content> content_;
};

// How frames are rendered: every choice of docs/settings.md, by its key. A value; as made, all are the defaults.
class TESSERA_API Settings {
 public:
  Settings();
  Settings(const Settings& other);
  Settings(Settings&& other) noexcept;
  Settings& operator=(const Settings& other);
  Settings& operator=(Settings&& other) noexcept;
  ~Settings();

  // As those of Gpu.
  Settings& set(std::string_view key, const Value& value);
  Value get(std::string_view key) const;

  // {"key": value, ...}
  std::string json() const;

  static const std::vector<KeyDescription>& keys();

  struct Content;

 private:
  friend class Device;
  std::unique_ptr<Content> content_;
};

}  // namespace tessera
