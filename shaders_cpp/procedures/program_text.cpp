#include "shaders_cpp/procedures/program_compiler.h"

#include <charconv>
#include <cmath>

#include <fmt/format.h>

namespace tessera::shaders::program_text {
namespace {

bool starts_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Reads a text from its beginning and tracks the position.
class Splitter {
 public:
  explicit Splitter(std::string_view text) : text_(text) {}

  Token next() {
    skip_space();
    Token token;
    token.line = line_, token.column = column();
    if (at_ == text_.size()) return token;
    const char c = text_[at_];
    if (starts_name(c)) {
      token.kind = Token::Kind::kName;
      token.text = take([](char d) { return starts_name(d) || is_digit(d); });
    } else if (is_digit(c) || (c == '.' && at_ + 1 < text_.size() && is_digit(text_[at_ + 1]))) {
      read_number(token);
    } else if (c == '"') {
      read_text(token);
    } else if (std::string_view("{}()[],;:=+-*/<>?.").find(c) != std::string_view::npos) {
      token.kind = Token::Kind::kSymbol;
      token.text = text_.substr(at_++, 1);
    } else {
      const auto byte = static_cast<unsigned char>(c);
      refuse(token, c > ' ' && c <= '~' ? fmt::format("'{}' means nothing here", c)
                                        : fmt::format("byte 0x{:02x} means nothing here", byte));
    }
    return token;
  }

 private:
  int column() const { return static_cast<int>(at_ - line_start_) + 1; }

  void skip_space() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '/' && at_ + 1 < text_.size() && text_[at_ + 1] == '/') {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (c == '\n') {
        line_start_ = ++at_;
        ++line_;
      } else if (c == ' ' || c == '\t' || c == '\r') {
        ++at_;
      } else {
        return;
      }
    }
  }

  template <class Wanted>
  std::string_view take(const Wanted& wanted) {
    const std::size_t from = at_;
    while (at_ < text_.size() && wanted(text_[at_])) ++at_;
    return text_.substr(from, at_ - from);
  }

  void read_number(Token& token) {
    token.kind = Token::Kind::kNumber;
    const char* const from = text_.data() + at_;
    const auto [end, error] = std::from_chars(from, text_.data() + text_.size(), token.value);
    token.text = text_.substr(at_, static_cast<std::size_t>(end - from));
    at_ += token.text.size();
    if (error != std::errc() || !std::isfinite(token.value)) refuse(token, "the number is beyond single precision");
    if (at_ == text_.size() || !starts_name(text_[at_])) return;
    token.column = column();
    refuse(token, fmt::format("'{}' after a number", text_.substr(at_, 1)));
  }

  void read_text(Token& token) {
    token.kind = Token::Kind::kText;
    ++at_;
    token.text = take([](char c) { return c != '"' && c >= ' ' && c <= '~'; });
    if (at_ == text_.size() || text_[at_] != '"')
      refuse(token, "the text does not end on its line, or is not plain ASCII");
    ++at_;
  }

  std::string_view text_;
  std::size_t at_ = 0, line_start_ = 0;
  int line_ = 1;
};

}  // namespace

void refuse(const Token& at, std::string message) { throw Fault{{at.line, at.column, std::move(message)}}; }

std::string shown(const Token& token) {
  if (token.kind == Token::Kind::kEnd) return "the end";
  return fmt::format("'{}'", token.text.substr(0, 40));
}

std::vector<Token> split(std::string_view text) {
  Splitter splitter(text);
  std::vector<Token> tokens;
  do tokens.push_back(splitter.next());
  while (tokens.back().kind != Token::Kind::kEnd);
  return tokens;
}

}  // namespace tessera::shaders::program_text
