// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/manual/option_words.h"

#include <algorithm>
#include <sstream>

namespace cgs {

namespace {

std::vector<std::string> split_at_commas(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    out.push_back(word.substr(std::min(word.find_first_not_of(' '), word.size())));
  }
  return out;
}

std::string without_brackets(const std::string& text, char open, char close) {
  const bool is_within = text.size() > 1 && text.front() == open && text.back() == close;
  return is_within ? text.substr(1, text.size() - 2) : text;
}

}  // namespace

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<std::string> spellings(const CLI::Option& option) {
  std::vector<std::string> out;
  for (const std::string& name : option.get_snames()) out.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) out.push_back("--" + name);
  return out;
}

std::string main_name(const CLI::Option& option) {
  const std::vector<std::string> names = spellings(option);
  return names.empty() ? option.get_name(true) : names.back();
}

std::vector<std::string> main_names(const std::set<CLI::Option*>& options) {
  std::vector<std::string> out;
  out.reserve(options.size());
  for (const CLI::Option* option : options) out.push_back(main_name(*option));
  std::sort(out.begin(), out.end());
  return out;
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

bool is_repeatable(const CLI::Option& option) {
  return option.get_expected_max() >= CLI::detail::expected_max_vector_size;
}

std::vector<std::string> value_words(const CLI::Option& option) {
  if (!takes_value(option)) return {};
  const std::string full = option.get_type_name();
  const std::string type = without_brackets(full.substr(0, full.find(':')), '[', ']');
  std::vector<std::string> out = split_at_commas(type);
  const int count = is_repeatable(option) ? 1 : option.get_items_expected_max();
  if (out.size() == 1 && count > 1) out.resize(static_cast<size_t>(count), type);
  return out;
}

std::vector<std::string> closed_values(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const size_t colon = type.find(':');
  if (colon == std::string::npos) return {};
  std::vector<std::string> out =
      split_at_commas(without_brackets(type.substr(colon + 1), '{', '}'));
  const auto is_sentence = [](const std::string& word) {  // "0 to 5" is a rule, no list
    return word.empty() || word.find_first_of(" []") != std::string::npos;
  };
  if (out.size() < 2 || std::any_of(out.begin(), out.end(), is_sentence)) return {};
  return out;
}

}  // namespace cgs
