// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/manual/man_pages.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "convert/manual/help_footer.h"
#include "convert/manual/option_words.h"

namespace cgs {

namespace {

constexpr std::array<std::pair<const char*, const char*>, 9> kExitStatus = {{
    {"0", "Done."},
    {"1", "Something unexpected, a defect of the program."},
    {"2", "The command line cannot be used."},
    {"3", "A file or a scene cannot be used; with --strict, also a warning."},
    {"4", "Over a limit, or not enough memory."},
    {"5", "The file system: a file cannot be read or written, or the disk is full."},
    {"6", "No finite answer for this input."},
    {"130", "Interrupted (SIGINT); finished stages are kept."},
    {"143", "Terminated (SIGTERM); finished stages are kept."},
}};

// A name that is broken at the end of a line cannot be searched for, or copied.
constexpr const char* kNoHyphens = ".nh\n.ad l\n";

char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

// So that man prints the very characters: it takes - for a hyphen, ' for a closing quote …
std::string literal(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '\\':
        out += "\\e";
        break;
      case '-':
        out += "\\-";
        break;
      case '^':
        out += "\\(ha";
        break;
      case '~':
        out += "\\(ti";
        break;
      case '`':
        out += "\\(ga";
        break;
      case '\'':
        out += "\\(aq";
        break;
      default:
        out += c;
    }
  }
  return out;
}

// A line of its own; man takes one that begins with . or ' for a request.
std::string line_of(const std::string& text) {
  const bool looks_like_request = !text.empty() && text[0] == '.';
  return (looks_like_request ? "\\&" : "") + text + "\n";
}

std::string bold(const std::string& text) { return "\\fB" + literal(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + literal(text) + "\\fR"; }

std::string section(const std::string& title) { return ".SH " + title + "\n"; }

std::string paragraph(const std::string& text) { return ".PP\n" + line_of(literal(text)); }

std::string entry(const std::string& tag, const std::string& text) {
  return ".TP\n" + line_of(tag) + line_of(literal(text));
}

std::string as_they_are(const std::vector<std::string>& lines) {
  std::string out = ".EX\n";
  for (const std::string& line : lines) out += line_of(literal(line));
  return out + ".EE\n";
}

std::string sentence(const std::string& text) {
  const bool has_end = text.empty() || text.back() == '.' || text.back() == ':';
  return has_end ? text : text + ".";
}

std::string joined(const std::vector<std::string>& words, const std::string& between) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : between) + word;
  return out;
}

std::string values_tag(const CLI::Option& option) {
  std::string out;
  for (const std::string& word : value_words(option)) out += " " + italic(word);
  return out;
}

std::string option_tag(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : spellings(option)) names.push_back(bold(name));
  if (names.empty()) return italic(main_name(option));
  return joined(names, ", ") + values_tag(option);
}

std::string option_text(const CLI::Option& option) {
  std::string out = sentence(option.get_description());
  const std::vector<std::string> values = closed_values(option);
  if (!values.empty()) out += " One of: " + joined(values, ", ") + ".";
  const std::string standard = option.get_default_str();
  if (takes_value(option) && !standard.empty()) out += " Default: " + standard + ".";
  const bool has_name = !spellings(option).empty();
  if (option.get_required() && has_name) out += " Required.";
  const std::vector<std::string> needed = main_names(option.get_needs());
  if (!needed.empty()) out += " Only with " + joined(needed, " and ") + ".";
  const std::vector<std::string> excluded = main_names(option.get_excludes());
  if (!excluded.empty()) out += " Not with " + joined(excluded, ", ") + ".";
  return out;
}

std::string options_section(const CLI::App& command) {
  std::string out;
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_positional()) continue;
    out += entry(option_tag(*option), option_text(*option));
  }
  if (!out.empty()) out = section("ARGUMENTS") + out;
  out += section("OPTIONS");
  const std::vector<const CLI::Option*> options = command.get_options();
  for (const std::string& group : command.get_groups()) {
    std::string entries;
    for (const CLI::Option* option : options) {
      if (option->get_positional() || option->get_group() != group) continue;
      entries += entry(option_tag(*option), option_text(*option));
    }
    if (entries.empty()) continue;
    if (group != "Options") out += ".SS " + literal(group) + "\n";
    out += entries;
  }
  return out;
}

std::string synopsis(const CLI::App& command) {
  std::string out = section("SYNOPSIS") + bold("cgs " + command.get_name());
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional() || !option->get_required()) continue;
    out += " " + bold(spellings(*option).front()) + values_tag(*option);
  }
  out += " [" + italic("OPTIONS") + "]";
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_positional()) continue;
    const std::string name = italic(main_name(*option));
    const std::string all = is_repeatable(*option) ? name + " ..." : name;
    out += option->get_required() ? " " + all : " [" + all + "]";
  }
  return out + "\n";
}

std::string in_words(const FooterPart& part) {
  if (part.kind == FooterPart::Kind::Table) return ".PP\n" + as_they_are(part.lines);
  std::string out = paragraph(sentence(part.text));
  for (const auto& [name, meaning] : part.terms) out += entry(bold(name), sentence(meaning));
  return out;
}

// What the help says besides its options, but for examples.
std::string description(const std::string& what, const std::vector<FooterPart>& parts) {
  std::string first = sentence(what);
  first.front() = upper(first.front());
  std::string out = section("DESCRIPTION") + line_of(literal(first));
  for (const FooterPart& part : parts) {
    if (part.kind != FooterPart::Kind::Example) out += in_words(part);
  }
  return out;
}

std::string examples(const std::vector<FooterPart>& parts) {
  std::string out;
  for (const FooterPart& part : parts) {
    if (part.kind != FooterPart::Kind::Example) continue;
    out += (out.empty() ? "" : ".PP\n") + as_they_are(part.lines);
  }
  return out.empty() ? "" : section("EXAMPLES") + out;
}

std::string exit_status() {
  std::string out = section("\"EXIT STATUS\"");
  for (const auto& [code, meaning] : kExitStatus) out += entry(bold(code), meaning);
  return out;
}

std::string page_name(const CLI::App& command) { return "cgs-" + command.get_name(); }

std::string reference(const std::string& name) { return bold(name) + "(1)"; }

std::string see_also(const CLI::App& app, const std::string& own_name) {
  std::vector<std::string> pages;
  if (own_name != "cgs") pages.push_back(reference("cgs"));
  for (const CLI::App* command : commands_of(app)) {
    if (page_name(*command) != own_name) pages.push_back(reference(page_name(*command)));
  }
  return section("\"SEE ALSO\"") + joined(pages, ",\n") + "\n" +
         paragraph("The guides are in /usr/share/doc/cgs, which README.md begins.");
}

std::string heading(const std::string& name, const std::string& what, const PageOrigin& origin) {
  std::string title = name;
  std::transform(title.begin(), title.end(), title.begin(), upper);
  return ".\\\" SPDX-License-Identifier: GPL-3.0-or-later\n.TH " + literal(title) + " 1 \"" +
         origin.date + "\" \"" + origin.version + "\" \"User Commands\"\n" + kNoHyphens +
         section("NAME") + literal(name) + " \\- " + literal(what) + "\n";
}

}  // namespace

std::string program_page(const CLI::App& app, const PageOrigin& origin) {
  const std::string full = app.get_description();  // "cgs - what it is for"
  const std::string what = full.substr(full.find(" - ") + 3);
  const std::vector<FooterPart> parts = footer_parts(app.get_footer());
  std::string out = heading("cgs", what, origin) + section("SYNOPSIS") + bold("cgs") + " " +
                    italic("COMMAND") + " [" + italic("OPTIONS") + "] ...\n" +
                    description(what, parts) + section("COMMANDS");
  for (const CLI::App* command : commands_of(app)) {
    out += entry(reference(page_name(*command)), sentence(command->get_description()));
  }
  return out + options_section(app) + examples(parts) + exit_status() + see_also(app, "cgs");
}

std::string command_page(const CLI::App& app, const CLI::App& command, const PageOrigin& origin) {
  const std::string name = page_name(command);
  const std::vector<FooterPart> parts = footer_parts(command.get_footer());
  return heading(name, command.get_description(), origin) + synopsis(command) +
         description(command.get_description(), parts) + options_section(command) +
         examples(parts) + exit_status() + see_also(app, name);
}

}  // namespace cgs
