// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the pages of the manual and the completion of shells, both of what `cgs --help` says, into
// a folder: cgs.1, cgs-run.1 …, cgs.bash and _cgs. Run while building.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <string>

#include "convert/commands/commands.h"
#include "convert/manual/completion.h"
#include "convert/manual/man_pages.h"
#include "convert/manual/option_words.h"
#include "io/bytes/atomic_file.h"

namespace {

// That of SOURCE_DATE_EPOCH [s], which those who package set; never today: the same sources give
// the same pages.
std::string release_date() {
  const char* epoch = std::getenv("SOURCE_DATE_EPOCH");  // NOLINT(concurrency-mt-unsafe)
  if (epoch == nullptr) return "";
  const std::time_t seconds = std::strtoll(epoch, nullptr, 10);
  std::tm date{};
  gmtime_r(&seconds, &date);
  char text[16];
  return {text, std::strftime(text, sizeof(text), "%Y-%m-%d", &date)};
}

void write_manual(const std::filesystem::path& folder) {
  const auto app = cgs::command_line();
  const cgs::PageOrigin origin{app->version(), release_date()};
  std::filesystem::create_directories(folder);
  cgs::write_file(folder / "cgs.1", cgs::program_page(*app, origin));
  for (const CLI::App* command : cgs::commands_of(*app)) {
    cgs::write_file(folder / ("cgs-" + command->get_name() + ".1"),
                    cgs::command_page(*app, *command, origin));
  }
  cgs::write_file(folder / "cgs.bash", cgs::bash_completion(*app));
  cgs::write_file(folder / "_cgs", cgs::zsh_completion(*app));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: cgs_manual FOLDER\n");
    return 2;
  }
  try {
    write_manual(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cgs_manual: %s\n", error.what());
    return 1;
  }
  return 0;
}
