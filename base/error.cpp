#include "base/error.h"

#include <string_view>
#include <utility>

#include "base/text.h"

namespace tessera {
namespace {

std::string one_line(const std::string& file, const std::string& place, const std::string& fault) {
  std::string line = escape_control(file) + ": ";
  if (!place.empty()) line += escape_control(place) + ": ";
  return line + escape_control(fault);
}

}  // namespace

InputError::InputError(std::string file, std::string place, std::string fault)
    : Error(one_line(file, place, fault)), file_(std::move(file)), place_(std::move(place)), fault_(std::move(fault)) {}

}  // namespace tessera
