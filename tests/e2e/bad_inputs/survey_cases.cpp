// SPDX-License-Identifier: GPL-3.0-or-later
#include <sstream>

#include "io/scenes/control_points.h"
#include "tests/e2e/bad_inputs/valid_inputs.h"

namespace cgs::test {

namespace {

constexpr const char* kHeader = "name,x,y,z,sigma,role,view,px,py\n";

// A point before the three cameras of transforms(), which stand side by side and look along -z; so
// near that their few pixels tell its distance.
std::string point(const std::string& name, double right, double up, double along) {
  const double x = 0.1 + 0.1 * right;
  const double y = 0.2 * up;
  const double z = 0.2 * along;
  std::ostringstream out;
  out << name << ',' << x << ',' << y << ',' << z << ",0.01,,,,\n";
  for (int view = 0; view < 3; ++view) {
    out << name << ",,,,,," << view << ".png," << kFocal * (x - 0.1 * view) / -z + 15.5 << ','
        << kFocal * -y / -z + 11.5 << "\n";
  }
  return out.str();
}

std::string good_points() {
  return point("A", -0.2, -0.2, -1.5) + point("B", 0.3, -0.1, -1.4) + point("C", 0.1, 0.3, -1.6) +
         point("D", 0, 0, -1.3);
}

Call survey_call(const fs::path& folder, const std::string& table, bool use_reader) {
  write_transforms_scene(folder);
  const fs::path file = folder / "survey.csv";
  write_bytes(file, table);
  Call call = run_call(folder);
  call.arguments.insert(call.arguments.end(), {"--control-points", file.string()});
  if (use_reader) call.read = [file] { (void)read_control_points(file); };
  return call;
}

/// A table that is refused as it is read, or, without a reader, by the program.
Case table_case(const std::string& row,
                const std::string& damage,
                const std::string& expected,
                const std::vector<std::string>& words,
                const std::string& table,
                bool use_reader = true) {
  std::vector<std::string> all = words;
  all.emplace_back("survey.csv");
  return {row, damage, expected, all, [=](const fs::path& folder) {
            return survey_call(folder, table, use_reader);
          }};
}

Case rows_case(const std::string& row,
               const std::string& damage,
               const std::string& expected,
               const std::vector<std::string>& words,
               const std::string& rows) {
  return table_case(row, damage, expected, words, kHeader + good_points() + rows);
}

Case frame_case(const std::string& row,
                const std::string& damage,
                const std::string& expected,
                const std::vector<std::string>& words,
                const std::string& rows) {
  return table_case(row, damage, expected, words, kHeader + rows, false);
}

void add_tables(Cases& cases) {
  cases.push_back(table_case("S01", "no column view", "SCHEMA", {"view"}, "name,x,y,z,px,py\n"));
  cases.push_back(
      table_case("S02", "an unknown column", "SCHEMA", {"sgima"}, "name,x,y,z,view,px,py,sgima\n"));
  cases.push_back(table_case("S03", "nothing but a comment", "EMPTY", {}, "# soon\n"));
  cases.push_back(table_case("S04", "a spreadsheet", "MAGIC", {"compressed"}, "PK\x03\x04..."));
  cases.push_back(
      table_case("S05", "no line end in 2 MiB", "SCHEMA", {"line 1"}, std::string(2 << 20, 'a')));
}

void add_rows(Cases& cases) {
  for (const char* number : {"nan", "1e999", "0x10", "--1", "1e13"}) {
    cases.push_back(rows_case("S06",
                              std::string("coordinate ") + number,
                              "SYNTAX|VALUE",
                              {"18"},
                              std::string("E,1,2,") + number + ",,,,,\n"));
  }
  cases.push_back(
      rows_case("S07", "decimal commas", "SCHEMA", {"line 18"}, "E,1,5,2,5,3,5,,,0.png,4,5\n"));
  cases.push_back(rows_case("S08", "half a position", "SCHEMA", {"line 18"}, "E,1,2,,,,,,\n"));
  cases.push_back(rows_case("S09", "half a pick", "SCHEMA", {"line 18"}, "A,,,,,,0.png,3,\n"));
  cases.push_back(
      rows_case("S10", "two positions", "MISMATCH", {"line 18", "line 2"}, "A,1,2,3,,,,,\n"));
  cases.push_back(rows_case("S11", "a role", "VALUE", {"chekc", "check"}, "E,1,2,3,,chekc,,,\n"));
  cases.push_back(rows_case("S12",
                            "a name of control characters",
                            "SCHEMA",
                            {"line 18"},
                            std::string("\x1b[31m\x07,,,,,,0.png,1,1\n")));
}

void add_frames(Cases& cases) {
  cases.push_back(frame_case("S13",
                             "a view that is not there",
                             "REF",
                             {"line 18", "nave"},
                             good_points() + "D,,,,,,nave,1,1\n"));
  cases.push_back(frame_case("S14",
                             "a pixel outside",
                             "VALUE",
                             {"32 x 24", "line 3"},
                             "A,0,0,1,,,,,\nA,,,,,,0.png,32,1\n"));
  cases.push_back(frame_case("S15",
                             "points on a line",
                             "VALUE",
                             {"on one line"},
                             point("A", -0.3, 0, -1.5) + point("B", 0, 0, -1.5) +
                                 point("C", 0.3, 0, -1.5) + point("D", 0.2, 0, -1.5)));
  cases.push_back(frame_case("S16",
                             "two points",
                             "VALUE",
                             {"--known-distance"},
                             point("A", -0.2, -0.2, -1.5) + point("B", 0.3, -0.1, -1.4)));
}

}  // namespace

Cases survey_cases() {
  Cases cases;
  add_tables(cases);
  add_rows(cases);
  add_frames(cases);
  return cases;
}

}  // namespace cgs::test
