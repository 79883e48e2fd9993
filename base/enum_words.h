#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <type_traits>

namespace tessera {

// Words of an enum that a user may set, in the order of its values from 0 on. Specialised beside each enum:
//   template <> inline constexpr auto kEnumWords<ShadingRate> = std::to_array<std::string_view>({"pixel", "sample"});
template <class E>
inline constexpr std::array<std::string_view, 0> kEnumWords{};

template <class E>
concept WordEnum = std::is_enum_v<E> &&(kEnumWords<E>.size() > 0);

template <WordEnum E>
constexpr std::string_view word(E value) {
  return kEnumWords<E>[static_cast<std::size_t>(value)];
}
template <WordEnum E>
constexpr std::optional<E> from_word(std::string_view text) {
  for (std::size_t k = 0; k < kEnumWords<E>.size(); ++k)
    if (kEnumWords<E>[k] == text) return static_cast<E>(k);
  return std::nullopt;
}

}  // namespace tessera
