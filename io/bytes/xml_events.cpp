// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/xml_events.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <new>

#include <expat.h>

#include "io/bytes/byte_reader.h"
#include "io/bytes/text_lines.h"

namespace cgs {

namespace {

constexpr char kBetween = '|';  // namespace and name

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string quoted(std::string_view text) { return "\"" + std::string(text.substr(0, 40)) + "\""; }

/// expat calls back through C, which exceptions must not cross.
class Reader {
 public:
  Reader(const std::filesystem::path& path, const XmlHandlers& handlers)
      : path_(path), handlers_(handlers), parser_(XML_ParserCreateNS(nullptr, kBetween)) {
    if (!parser_) throw std::bad_alloc();
    XML_SetUserData(parser_.get(), this);
    XML_SetElementHandler(parser_.get(), on_start, on_end);
    XML_SetCharacterDataHandler(parser_.get(), on_text);
    XML_SetStartNamespaceDeclHandler(parser_.get(), on_prefix);
    XML_SetStartDoctypeDeclHandler(parser_.get(), on_doctype);
  }

  void read(std::string_view bytes) {
    constexpr size_t kParsedAtOnce = size_t{1} << 20;
    for (size_t at = 0; at == 0 || at < bytes.size(); at += kParsedAtOnce) {
      const std::string_view piece = bytes.substr(at, kParsedAtOnce);
      const bool is_last = at + kParsedAtOnce >= bytes.size();
      const auto state =
          XML_Parse(parser_.get(), piece.data(), static_cast<int>(piece.size()), is_last ? 1 : 0);
      if (thrown_) std::rethrow_exception(thrown_);
      if (state != XML_STATUS_OK) refuse();
      refuse_long_token(at + piece.size());
    }
  }

 private:
  struct Free {
    void operator()(XML_Parser parser) const { XML_ParserFree(parser); }
  };

  // What is not told yet of the bytes that were given is one token.
  void refuse_long_token(size_t given) const {
    constexpr size_t kLongest = size_t{4} << 20;
    const XML_Index told = XML_GetCurrentByteIndex(parser_.get());
    if (told < 0 || given - static_cast<size_t>(told) <= kLongest) return;
    throw LimitError(printable(path_) + ": line " + std::to_string(line()) +
                     ": one tag, comment or text of more than 4 MiB");
  }

  uint64_t line() const { return XML_GetCurrentLineNumber(parser_.get()); }

  [[noreturn]] void refuse() const {
    const XML_Error code = XML_GetErrorCode(parser_.get());
    if (code == XML_ERROR_NO_MEMORY) throw std::bad_alloc();
    const bool is_cut = code == XML_ERROR_NO_ELEMENTS || code == XML_ERROR_UNCLOSED_TOKEN;
    throw BadInput(is_cut ? Defect::Truncated : Defect::Syntax,
                   path_,
                   "line " + std::to_string(line()) + ", column " +
                       std::to_string(XML_GetCurrentColumnNumber(parser_.get()) + 1) + ": " +
                       XML_ErrorString(code));
  }

  template <typename Action>
  static void guarded(void* self, const Action& action) {
    Reader& reader = *static_cast<Reader*>(self);
    if (reader.thrown_) return;
    try {
      action(reader);
    } catch (...) {
      reader.thrown_ = std::current_exception();
      XML_StopParser(reader.parser_.get(), XML_FALSE);
    }
  }
  static void on_start(void* self, const char* name, const char** attributes) {
    guarded(self, [&](Reader& reader) {
      constexpr int kDeepest = 64;
      if (++reader.depth_ > kDeepest) {
        throw LimitError(printable(reader.path_) + ": line " + std::to_string(reader.line()) +
                         ": elements more than 64 deep");
      }
      if (!reader.handlers_.start) return;
      reader.handlers_.start(XmlElement(name, attributes, reader.line(), reader.path_));
    });
  }
  static void on_end(void* self, const char* name) {
    guarded(self, [&](Reader& reader) {
      --reader.depth_;
      if (reader.handlers_.end) reader.handlers_.end(name);
    });
  }
  static void on_text(void* self, const char* text, int length) {
    guarded(self, [&](Reader& reader) {
      if (!reader.handlers_.text) return;
      reader.handlers_.text({text, static_cast<size_t>(length)});
    });
  }
  static void on_prefix(void* self, const char* prefix, const char* uri) {
    guarded(self, [&](Reader& reader) {
      if (!reader.handlers_.prefix) return;
      reader.handlers_.prefix(prefix != nullptr ? prefix : "", uri != nullptr ? uri : "");
    });
  }
  static void on_doctype(void* self, const char*, const char*, const char*, int) {
    guarded(self, [&](Reader& reader) {
      throw BadInput(Defect::Unsupported,
                     reader.path_,
                     "line " + std::to_string(reader.line()) +
                         ": a document type declaration, whose entities are not expanded");
    });
  }

  const std::filesystem::path& path_;
  const XmlHandlers& handlers_;
  std::unique_ptr<XML_ParserStruct, Free> parser_;
  std::exception_ptr thrown_;
  int depth_ = 0;
};

}  // namespace

std::optional<std::string_view> XmlElement::find(std::string_view attribute) const {
  for (const char** pair = attributes_; *pair != nullptr; pair += 2) {
    if (pair[0] == attribute) return pair[1];
  }
  return std::nullopt;
}

std::string_view XmlElement::at(std::string_view attribute) const {
  const auto found = find(attribute);
  if (!found) fail(Defect::Schema, "has no attribute " + std::string(attribute));
  return *found;
}

double XmlElement::number(std::string_view attribute) const {
  return parse(attribute, trimmed(at(attribute)));
}

double XmlElement::measured(std::string_view attribute) const {
  const std::string_view word = trimmed(at(attribute));
  double out = 0;
  if (!parse_measured(word, out)) {
    fail(Defect::Syntax, std::string(attribute) + ": " + quoted(word) + " is no number");
  }
  return out;
}

std::vector<double> XmlElement::numbers(std::string_view attribute) const {
  std::vector<double> out;
  for (const std::string_view word : tokens(at(attribute))) out.push_back(parse(attribute, word));
  return out;
}

double XmlElement::parse(std::string_view attribute, std::string_view word) const {
  double out = 0;
  if (!parse_number(word, out)) {
    fail(Defect::Syntax, std::string(attribute) + ": " + quoted(word) + " is no number");
  }
  if (!std::isfinite(out)) {
    fail(Defect::Value, std::string(attribute) + ": " + quoted(word) + " is not finite");
  }
  return out;
}

uint64_t XmlElement::count(std::string_view attribute) const {
  const std::string_view text = trimmed(at(attribute));
  uint64_t out = 0;
  if (!parse_number(text, out)) {
    fail(Defect::Syntax, std::string(attribute) + " is " + quoted(text) + ", no whole number");
  }
  return out;
}

void XmlElement::fail(Defect defect, const std::string& reason) const {
  const std::string_view bare = name_.substr(name_.find(kBetween) + 1);  // npos + 1 is 0
  throw BadInput(
      defect,
      path_,
      "line " + std::to_string(line_) + ", <" + std::string(bare.substr(0, 40)) + ">: " + reason);
}

void read_xml(std::string_view bytes,
              const std::filesystem::path& path,
              const XmlHandlers& handlers) {
  Reader(path, handlers).read(bytes);
}

}  // namespace cgs
