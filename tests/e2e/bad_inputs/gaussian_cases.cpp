// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/mesh_ply.h"
#include "io/splats/gaussian_ply.h"
#include "tests/e2e/bad_inputs/valid_inputs.h"

namespace cgs::test {

namespace {

// A model folder whose Gaussians are these bytes.
Call render_with(const fs::path& folder, const std::string& ply) {
  write_model_folder(folder);
  write_bytes(folder / "model/gaussians.ply", ply);
  return render_call(folder);
}

/// Cases of one file, written from the splats of `change`.
class Table {
 public:
  void text(const std::string& row,
            const std::string& damage,
            const std::string& expected,
            const std::vector<std::string>& words,
            const std::function<std::string()>& bytes) {
    std::vector<std::string> all = words;
    if (expected.rfind("OK", 0) != 0) all.emplace_back("gaussians.ply");
    cases.push_back({row, damage, expected, all, [bytes](const fs::path& folder) {
                       return render_with(folder, bytes());
                     }});
  }
  void splat(const std::string& row,
             const std::string& damage,
             const std::string& expected,
             const std::vector<std::string>& words,
             const std::function<void(SplatPly&)>& change) {
    text(row, damage, expected, words, [change] {
      SplatPly ply = splats();
      change(ply);
      return ply.bytes();
    });
  }
  Cases cases;
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error("no " + from);
  return text.replace(at, from.size(), to);
}

std::string edited(const std::string& from, const std::string& to) {
  return replaced(splats().bytes(), from, to);
}

void add_header_rows(Table& t) {
  t.splat("P01", "2 MiB of comments", "LIMIT", {}, [](SplatPly& ply) {
    for (int i = 0; i < 32768; ++i) ply.before_elements += "comment " + std::string(56, 'x') + "\n";
  });
  t.splat("P02", "2^64 - 1 vertices", "COUNT", {"18446744073709551615"}, [](SplatPly& ply) {
    ply.count = "18446744073709551615";
  });
  t.splat("P03", "-1 vertices", "SYNTAX", {"line"}, [](SplatPly& ply) { ply.count = "-1"; });
  for (const char* count : {"1e6", "10 abc", " "}) {
    t.splat("P04", std::string("count '") + count + "'", "SYNTAX", {"line"}, [=](SplatPly& ply) {
      ply.count = count;
    });
  }
  t.splat("P05", "2^32 vertices", "COUNT|TRUNCATED", {}, [](SplatPly& ply) {
    ply.count = "4294967296";
  });
  t.splat("P06", "vertices whose bytes wrap 64 bits", "COUNT", {}, [](SplatPly& ply) {
    ply.count = "2305843009213693952";
  });
  for (const char* format : {"binary_little_endian", "ascii"}) {
    t.splat(
        "P07", std::string("one row short, ") + format, "TRUNCATED|COUNT", {}, [=](SplatPly& ply) {
          ply.format = format;
          ply.count = std::to_string(ply.rows.size() + 1);
        });
  }
  t.splat("P08", "one row too many", "OK+W", {"trailing"}, [](SplatPly& ply) {
    ply.count = std::to_string(ply.rows.size() - 1);
  });
  t.text("P11", "list counted in floats", "UNSUPPORTED|SYNTAX", {}, [] {
    return edited("property float opacity", "property list float int bad\nproperty float opacity");
  });
  t.text("P12", "type float128", "UNSUPPORTED|SYNTAX", {"float128"}, [] {
    return edited("property float opacity", "property float128 opacity");
  });
  t.text("P13", "property x twice", "SYNTAX", {"x"}, [] {
    return edited("property float y", "property float x");
  });
  t.text("P14", "property before any element", "SYNTAX", {"line"}, [] {
    return edited("element vertex", "property float early\nelement vertex");
  });
  t.text("P16", "middle endian", "UNSUPPORTED|SYNTAX", {"middle"}, [] {
    return edited("binary_little_endian", "binary_middle_endian");
  });
  t.text("P16", "version 2.0", "UNSUPPORTED|SYNTAX", {"2.0"}, [] {
    return edited("endian 1.0", "endian 2.0");
  });
  t.text("P17", "two elements vertex", "SYNTAX", {"vertex"}, [] {
    return edited("end_header", "element vertex 3\nproperty float x\nend_header");
  });
  t.splat("P34", "5000 properties", "LIMIT", {}, [](SplatPly& ply) {
    for (int i = 0; i < 5000; ++i) {
      ply.properties.emplace_back("float", "extra_" + std::to_string(i));
      for (auto& row : ply.rows) row.push_back(0);
    }
  });
  t.splat("P34", "a header line of 8 MiB", "LIMIT", {}, [](SplatPly& ply) {
    ply.before_elements = "comment " + std::string(8 << 20, 'x') + "\n";
  });
  t.splat("P35", "comments and obj_info anywhere", "OK", {}, [](SplatPly& ply) {
    ply.before_elements = "obj_info made elsewhere\ncomment first\n";
  });
  t.splat("P37", "0 vertices", "EMPTY", {"0 vertices"}, [](SplatPly& ply) { ply.rows.clear(); });
}

void add_schema_rows(Table& t) {
  t.splat("P15", "big endian", "OK", {}, [](SplatPly& ply) { ply.format = "binary_big_endian"; });
  t.splat("P18", "no z", "SCHEMA", {"missing property z"}, [](SplatPly& ply) { ply.remove("z"); });
  for (const char* name : {"scale_1", "rot_3", "opacity", "f_dc_2"}) {
    t.splat("P19", std::string("no ") + name, "SCHEMA", {name}, [=](SplatPly& ply) {
      ply.remove(name);
    });
  }
  for (const int count : {44, 10, 46}) {
    t.text("P20", std::to_string(count) + " f_rest_*", "SCHEMA", {std::to_string(count)}, [=] {
      return splats(3, count).bytes();
    });
  }
  t.splat("P21", "f_rest_* with a gap", "SCHEMA", {"f_rest_1"}, [](SplatPly& ply) {
    for (auto& [type, name] : ply.properties) {
      if (name == "f_rest_1") name = "f_rest_9";
    }
  });
  t.splat("P31", "positions in double, far away", "OK", {}, [](SplatPly& ply) {
    for (size_t i = 0; i < 3; ++i) ply.properties[i].first = "double";
    for (auto& row : ply.rows) {
      row[0] += 4.5e5;
      row[1] += 5.4e6;
    }
  });
  for (const char* token : {"1e400", "0x1p3", "1,5"}) {
    t.text("P32", std::string("token ") + token, "SYNTAX|VALUE", {}, [=] {
      SplatPly ply = splats(3);
      ply.format = "ascii";
      return replaced(ply.bytes(), "\n0.02 ", std::string("\n") + token + " ");
    });
  }
  for (const char* token : {"nan", "inf"}) {
    t.text("P32", std::string("token ") + token, "OK+W", {"dropped 1"}, [=] {
      SplatPly ply = splats(3);
      ply.format = "ascii";
      return replaced(ply.bytes(), "\n0.02 ", std::string("\n") + token + " ");
    });
  }
  for (const char* with : {" ", " 1 2 "}) {
    t.text("P33", std::string("row with '") + with + "' for a token", "SYNTAX", {}, [=] {
      SplatPly ply = splats(3);
      ply.format = "ascii";
      return replaced(ply.bytes(), "\n0.02 ", std::string("\n") + with);
    });
  }
}

void set_all(SplatPly& ply, const std::string& name, double value) {
  for (size_t i = 0; i < ply.rows.size(); ++i) ply.set(i, name, value);
}

void add_value_rows(Table& t) {
  t.splat("P22", "one position NaN", "OK+W", {"dropped 1 splat"}, [](SplatPly& ply) {
    ply.set(3, "x", kNan);
  });
  t.splat("P23", "every position NaN", "VALUE", {"no finite splats"}, [](SplatPly& ply) {
    set_all(ply, "x", kNan);
  });
  t.splat("P24", "opacity +Inf", "OK+W", {"clamped"}, [](SplatPly& ply) {
    ply.set(2, "opacity", kInf);
  });
  t.splat("P24", "opacity -Inf", "OK+W", {"dropped 1"}, [](SplatPly& ply) {
    ply.set(2, "opacity", -kInf);
  });
  t.splat("P25", "linear scales", "OK+W", {"look linear"}, [](SplatPly& ply) {
    for (const char* name : {"scale_0", "scale_1", "scale_2"}) set_all(ply, name, 0.01);
  });
  t.splat("P25", "opacity as probability", "OK+W", {"probability"}, [](SplatPly& ply) {
    set_all(ply, "opacity", 0.9);
  });
  t.splat("P26", "exp(scale) infinite", "OK+W", {"dropped 1"}, [](SplatPly& ply) {
    ply.set(4, "scale_0", 89);
  });
  t.splat("P26", "exp(scale) zero", "OK+W", {"clamped"}, [](SplatPly& ply) {
    ply.set(4, "scale_0", -104);
  });
  t.splat(
      "P27", "rotation 0", "OK+W", {"dropped 1"}, [](SplatPly& ply) { ply.set(4, "rot_0", 0); });
  for (const double length : {1e20, 1e-23}) {
    t.splat("P28", "rotation of extreme length", "OK", {}, [=](SplatPly& ply) {
      set_all(ply, "rot_0", length);
      set_all(ply, "rot_2", length);
    });
  }
  t.splat("P29", "splats wider than the scene", "OK+W", {"fill ratio"}, [](SplatPly& ply) {
    for (const char* name : {"scale_0", "scale_1"}) set_all(ply, name, 3);
  });
  t.splat("P30", "outliers at 2e7", "OK", {}, [](SplatPly& ply) {
    ply.set(0, "x", 2e7);
    ply.set(1, "y", -2e7);
  });
}

// Meshes have no command of their own: `run` reads them when it resumes.
Case mesh_case(const std::string& row,
               const std::string& damage,
               const std::string& expected,
               const std::string& vertices,
               const std::string& faces) {
  return {row, damage, expected, {"mesh.ply"}, [=](const fs::path& folder) {
            write_bytes(folder / "mesh.ply",
                        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                        "property float y\nproperty float z\nelement face 1\n"
                        "property list int int vertex_indices\nend_header\n" +
                            vertices + faces);
            return Call{{}, [=] { (void)read_mesh_ply(folder / "mesh.ply"); }};
          }};
}

}  // namespace

Cases gaussian_cases() {
  Table t;
  add_header_rows(t);
  add_schema_rows(t);
  add_value_rows(t);
  const std::string good = "0 0 0\n1 0 0\n0 1 0\n";
  t.cases.push_back(mesh_case("P09", "list cut", "TRUNCATED|SYNTAX|COUNT", good, "255 0 1 2\n"));
  t.cases.push_back(mesh_case("P10", "list count -1", "COUNT|SYNTAX", good, "-1 0 1 2\n"));
  t.cases.push_back(
      mesh_case("P10", "list count 2^31 - 1", "COUNT|SYNTAX|TRUNCATED", good, "2147483647 0 1\n"));
  t.cases.push_back(mesh_case("P36", "corner 3 of 3 vertices", "REF", good, "3 0 1 3\n"));
  t.cases.push_back(mesh_case("P36", "corner -1", "REF|SYNTAX", good, "3 0 1 -1\n"));
  t.cases.push_back(
      mesh_case("M04", "vertex NaN", "VALUE", "0 nan 0\n1 0 0\n0 1 0\n", "3 0 1 2\n"));
  t.cases.push_back(
      mesh_case("M04", "vertex Inf", "VALUE", "0 inf 0\n1 0 0\n0 1 0\n", "3 0 1 2\n"));
  return t.cases;
}

}  // namespace cgs::test
