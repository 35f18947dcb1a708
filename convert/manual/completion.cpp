// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/manual/completion.h"

#include <algorithm>
#include <vector>

#include "convert/manual/option_words.h"

namespace cgs {

namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : " ") + word;
  return out;
}

std::vector<std::string> all_spellings(const CLI::App& command) {
  std::vector<std::string> out;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : spellings(*option)) out.push_back(name);
  }
  return out;
}

// Words that bash compares with "COMMAND OPTION", and what the option may be.
std::string bash_values(const CLI::App& command) {
  std::string out;
  for (const CLI::Option* option : command.get_options()) {
    const std::vector<std::string> values = closed_values(*option);
    if (values.empty()) continue;
    std::string patterns;
    for (const std::string& name : spellings(*option)) {
      patterns += (patterns.empty() ? "" : "|") + ("\"" + command.get_name() + " " + name + "\"");
    }
    if (patterns.empty()) continue;
    out += "    " + patterns + ") offered=\"" + joined(values) + "\" ;;\n";
  }
  return out;
}

// The first sentence or clause: a line of a menu has room for no more.
std::string in_short(const std::string& text) {
  size_t end = std::min(text.size(), text.find(" ..."));
  for (const char* mark : {"; ", ". ", ": ", ", e.g. "}) end = std::min(end, text.find(mark));
  return text.substr(0, end);
}

// Within single quotes.
std::string quoted(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
    } else {
      out += c;
    }
  }
  return "'" + out + "'";
}

// What _arguments() would take for its own: [ and ] end a description, a colon begins the next
// part.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string zsh_action(const CLI::Option& option) {
  const std::vector<std::string> values = closed_values(option);
  return values.empty() ? "_files" : "(" + joined(values) + ")";
}

// ":TEXT:_files" for each value that it takes.
std::string zsh_values(const CLI::Option& option) {
  std::string out;
  for (const std::string& word : value_words(option)) {
    out += ":" + escaped(word) + ":" + zsh_action(option);
  }
  return out;
}

// One specification for each spelling, which excludes what it cannot stand beside.
std::string zsh_option(const CLI::Option& option) {
  const std::vector<std::string> names = spellings(option);
  std::vector<std::string> excluded = main_names(option.get_excludes());
  const bool is_once = !is_repeatable(option);
  if (is_once) excluded.insert(excluded.end(), names.begin(), names.end());
  std::string before = excluded.empty() ? "" : "(" + joined(excluded) + ")";
  if (!is_once) before += "*";
  const std::string after =
      "[" + escaped(in_short(option.get_description())) + "]" + zsh_values(option);
  std::string out;
  for (const std::string& name : names) {
    std::string specification = before + name;
    if (takes_value(option)) specification += name.compare(0, 2, "--") == 0 ? "=" : "+";
    out += "        " + quoted(specification + after) + " \\\n";
  }
  return out;
}

std::string zsh_positional(const CLI::Option& option) {
  const std::string name = escaped(main_name(option));
  if (is_repeatable(option)) return "        " + quoted("*:" + name + ":_files") + " \\\n";
  const std::string colons = option.get_required() ? ":" : "::";
  return "        " + quoted(colons + name + ":_files") + " \\\n";
}

std::string zsh_arguments(const CLI::App& command) {
  std::string out = "      _arguments -s \\\n";
  for (const CLI::Option* option : command.get_options()) {
    out += option->get_positional() ? zsh_positional(*option) : zsh_option(*option);
  }
  return out.substr(0, out.size() - 3) + "\n";  // no backslash after the last
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  std::vector<std::string> first;
  std::string options, values;
  for (const CLI::App* command : commands_of(app)) {
    first.push_back(command->get_name());
    options +=
        "    " + command->get_name() + ") offered=\"" + joined(all_spellings(*command)) + "\" ;;\n";
    values += bash_values(*command);
  }
  const std::vector<std::string> of_program = all_spellings(app);
  first.insert(first.end(), of_program.begin(), of_program.end());
  return R"(# SPDX-License-Identifier: GPL-3.0-or-later
# What bash offers after cgs; made by cgs_manual of what `cgs --help` says.
_cgs() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} offered=
  # bash takes --name=value for three words.
  if [[ $word == "=" ]]; then
    word=
  elif [[ $before == "=" ]]; then
    before=${COMP_WORDS[COMP_CWORD-2]}
  fi
  COMPREPLY=()
  case "${COMP_WORDS[1]} $before" in
)" + values +
         R"(  esac
  if ((COMP_CWORD == 1)); then
    offered=")" +
         joined(first) + R"("
  elif [[ -z $offered && $word == -* ]]; then
    case ${COMP_WORDS[1]} in
)" + options +
         R"(    esac
  fi
  if [[ -z $offered ]]; then return; fi  # files, by -o default
  compopt +o default 2>/dev/null
  mapfile -t COMPREPLY < <(compgen -W "$offered" -- "$word")
}
complete -o default -F _cgs cgs
)";
}

std::string zsh_completion(const CLI::App& app) {
  std::string described, cases;
  for (const CLI::App* command : commands_of(app)) {
    described +=
        "    " + quoted(command->get_name() + ":" + in_short(command->get_description())) + "\n";
    cases += "    " + command->get_name() + ")\n" + zsh_arguments(*command) + "      ;;\n";
  }
  std::string options;
  for (const CLI::Option* option : app.get_options()) options += zsh_option(*option);
  return R"(#compdef cgs
# SPDX-License-Identifier: GPL-3.0-or-later
# What zsh offers after cgs; made by cgs_manual of what `cgs --help` says.
_cgs() {
  local curcontext=$curcontext state line
  local -a commands=(
)" + described +
         R"(  )
  _arguments -C \
)" + options +
         R"(        ':command:->command' '*::argument:->argument'
  case $state in
  command)
    _describe -t commands command commands
    ;;
  argument)
    case $words[1] in
)" + cases +
         R"(    esac
    ;;
  esac
}
_cgs "$@"
)";
}

}  // namespace cgs
