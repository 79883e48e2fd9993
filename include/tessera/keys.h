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

// The value of a key. Keys of real numbers take whole numbers as well; every key takes its text as on the command
// line.
using Value = std::variant<bool, std::int64_t, double, std::string>;

// Description of a key; `tessera describe settings` and `tessera describe gpu` print the same.
struct KeyDescription {
  std::string name;  // "tile.width"
  std::string type;  // "integer", "number", "boolean", "choice", "text"
  std::string unit;  // "" for pure numbers and choices
  Value default_value;
  double min = 0, max = 0;           // range of a number, inclusive
  std::vector<std::string> choices;  // words of a choice
  std::string meaning;               // one sentence
  std::string source;                // source of the machine's number; "" for settings
};

// The described machine: every number and choice of docs/gpu.md, by its key. Copies are independent.
class TESSERA_API Gpu {
 public:
  // Takes a preset ("entry-mobile", "mid-mobile", "high-mobile", "v3d") or a JSON file of keys nested by their dots.
  // Throws UsageError for an unknown preset, InputError for a file that does not describe a machine.
  explicit Gpu(const std::string& preset_or_file = "mid-mobile");
  // Takes the same from JSON text: {"preset": "entry-mobile", "tile": {"width": 16}}. Keys that the text leaves out have the
  // values of its preset. Throws InputError.
  static Gpu from_json(std::string_view text);
  Gpu(const Gpu& other);
  Gpu(Gpu&& other) noexcept;
  Gpu& operator=(const Gpu& other);
  Gpu& operator=(Gpu&& other) noexcept;
  ~Gpu();

  // Both throw UsageError for an unknown key, naming the nearest known one; set() also for a value out of range. The
  // device checks keys that must fit each other.
  Gpu& set(std::string_view key, const Value& value);
  Value get(std::string_view key) const;

  // All keys as JSON, nested by the dots of the keys.
  std::string json() const;

  static std::vector<std::string> presets();
  static const std::vector<KeyDescription>& keys();

  struct Content;

 private:
  friend class Device;
  explicit Gpu(std::unique_ptr<Content> content);
  std::unique_ptr<Content> content_;
};

// How frames are rendered: every choice of docs/settings.md, by its key. Copies are independent.
class TESSERA_API Settings {
 public:
  Settings();
  Settings(const Settings& other);
  Settings(Settings&& other) noexcept;
  Settings& operator=(const Settings& other);
  Settings& operator=(Settings&& other) noexcept;
  ~Settings();

  // Both throw UsageError as Gpu's do.
  Settings& set(std::string_view key, const Value& value);
  Value get(std::string_view key) const;

  // All keys as JSON: {"key": value, ...}
  std::string json() const;

  static const std::vector<KeyDescription>& keys();

  struct Content;

 private:
  friend class Device;
  std::unique_ptr<Content> content_;
};

}  // namespace tessera
