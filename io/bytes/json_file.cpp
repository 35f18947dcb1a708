// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/json_file.h"

#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace cgs {

namespace {

using nlohmann::json;

// "3:14" for a byte offset; both from 1.
std::string line_and_column(std::string_view text, size_t offset) {
  const std::string_view before = text.substr(0, std::min(offset, text.size()));
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const size_t start = before.rfind('\n');
  const size_t column = before.size() - (start == std::string_view::npos ? 0 : start + 1) + 1;
  return std::to_string(line) + ":" + std::to_string(column);
}

// The parser itself and the document's destructor survive deep nesting, but copies of it recurse:
// depth has to be known before a document exists.
void check_depth(std::string_view text, const std::filesystem::path& path, int max_depth) {
  int depth = 0;
  bool in_string = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > max_depth) {
        throw LimitError(printable(path) + ": " + line_and_column(text, i) +
                         ": nested deeper than " + std::to_string(max_depth));
      }
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
}

// Remembers the keys of every open object.
class DuplicateKeys {
 public:
  explicit DuplicateKeys(const std::filesystem::path& path) : path_(path) {}

  void see(json::parse_event_t event, const json& value) {
    if (event == json::parse_event_t::object_start) {
      open_.emplace_back();
    } else if (event == json::parse_event_t::object_end) {
      open_.pop_back();
    } else if (event == json::parse_event_t::key) {
      const auto& key = value.get_ref<const std::string&>();
      if (!open_.back().insert(key).second) {
        throw BadInput(Defect::Syntax, path_, "key \"" + key + "\" occurs twice in one object");
      }
    }
  }

 private:
  const std::filesystem::path& path_;
  std::vector<std::set<std::string>> open_;
};

}  // namespace

json read_json(const std::filesystem::path& path, const ReadLimits& limits) {
  ReadLimits file_limits = limits;
  file_limits.max_file_bytes = std::min(limits.max_file_bytes, limits.max_json_bytes);
  return parse_json(read_file(path, file_limits), path, limits);
}

json parse_json(std::string_view bytes,
                const std::filesystem::path& path,
                const ReadLimits& limits) {
  refuse_foreign_content(path, bytes, "JSON");
  std::string_view text = bytes;
  if (text.substr(0, 3) == "\xef\xbb\xbf") text.remove_prefix(3);
  check_depth(text, path, limits.max_json_depth);
  DuplicateKeys keys(path);
  try {
    return json::parse(text.begin(), text.end(), [&](int, json::parse_event_t event, json& value) {
      keys.see(event, value);
      return true;
    });
  } catch (const json::parse_error& error) {
    const size_t offset = error.byte == 0 ? 0 : error.byte - 1;
    const bool at_end = offset >= text.size();
    throw BadInput(Defect::Syntax,
                   path,
                   line_and_column(text, offset) +
                       (at_end ? ": the file ends inside the document" : ": not valid JSON here"));
  } catch (const json::out_of_range&) {
    throw BadInput(Defect::Value, path, "a number is too large for double precision");
  }
}

std::string json_text(const nlohmann::ordered_json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

nlohmann::ordered_json number_or_null(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

JsonValue::JsonValue(const json& value, std::filesystem::path path, std::string pointer)
    : value_(&value), path_(std::move(path)), pointer_(std::move(pointer)) {}

void JsonValue::fail(Defect defect, const std::string& reason) const {
  throw BadInput(defect, path_, (pointer_.empty() ? "/" : pointer_) + ": " + reason);
}

std::optional<JsonValue> JsonValue::find(std::string_view key) const {
  if (!value_->is_object()) {
    fail(Defect::Schema, std::string("expected an object, found ") + value_->type_name());
  }
  const auto member = value_->find(std::string(key));
  if (member == value_->end()) return std::nullopt;
  return JsonValue(*member, path_, pointer_ + "/" + std::string(key));
}

JsonValue JsonValue::at(std::string_view key) const {
  std::optional<JsonValue> member = find(key);
  if (!member) fail(Defect::Schema, "key \"" + std::string(key) + "\" is missing");
  return *std::move(member);
}

size_t JsonValue::size() const {
  if (!value_->is_array()) {
    fail(Defect::Schema, std::string("expected an array, found ") + value_->type_name());
  }
  return value_->size();
}

JsonValue JsonValue::at(size_t index) const {
  return {(*value_)[index], path_, pointer_ + "/" + std::to_string(index)};
}

double JsonValue::number() const {
  if (!value_->is_number()) {
    fail(Defect::Schema, std::string("expected a number, found ") + value_->type_name());
  }
  return value_->get<double>();
}

std::string JsonValue::text() const {
  if (!value_->is_string()) {
    fail(Defect::Schema, std::string("expected a string, found ") + value_->type_name());
  }
  return value_->get<std::string>();
}

bool JsonValue::boolean() const {
  if (!value_->is_boolean()) {
    fail(Defect::Schema, std::string("expected true or false, found ") + value_->type_name());
  }
  return value_->get<bool>();
}

int JsonValue::count() const {
  constexpr double kEnd = 2147483648.0;
  const double value = number();
  if (!(value >= 0 && value < kEnd && value == std::floor(value))) {
    fail(Defect::Schema, "expected a whole number in [0, 2^31), found " + value_->dump());
  }
  return static_cast<int>(value);
}

bool JsonValue::is_null() const { return value_->is_null(); }
bool JsonValue::is_array() const { return value_->is_array(); }
bool JsonValue::is_object() const { return value_->is_object(); }

bool JsonValue::is_text() const { return value_->is_string(); }

}  // namespace cgs
