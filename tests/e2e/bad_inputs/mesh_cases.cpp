// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdio>

#include "io/meshes/gltf.h"
#include "io/meshes/mesh_file.h"
#include "libcgs/core/error.h"
#include "tests/e2e/bad_inputs/valid_inputs.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/threemf_file.h"
#include "tests/support/triangle_glb.h"

namespace cgs::test {

namespace {

using Json = nlohmann::json;
using Pointer = Json::json_pointer;

/// A mesh file of some bytes, given to "info".
Case file_case(const std::string& row,
               const std::string& damage,
               const std::string& expected,
               const std::string& name,
               const std::string& bytes,
               std::vector<std::string> words = {}) {
  if (expected.rfind("OK", 0) != 0) words.push_back(name);
  return {row, name + ": " + damage, expected, words, [=](const fs::path& folder) {
            const fs::path file = folder / name;
            write_bytes(file, bytes);
            return Call{{"info", file.string()}, [file] {
                          for (const std::string& warning : read_mesh_file(file).warnings) {
                            std::fprintf(stderr, "cgs: warning: %s\n", one_line(warning).c_str());
                          }
                        }};
          }};
}

Case glb_case(const std::string& row,
              const std::string& damage,
              const std::string& expected,
              const std::string& bytes) {
  return file_case(row, damage, expected, "mesh.glb", bytes);
}

/// The triangle with one value of its JSON changed.
Case json_case(const std::string& row,
               const std::string& damage,
               const std::string& expected,
               const std::string& pointer,
               const Json& value) {
  TriangleGlb triangle;
  triangle.json[Pointer(pointer)] = value;
  return glb_case(row, damage, expected, triangle.bytes());
}

std::string with_number(std::string bytes, size_t offset, uint32_t number) {
  return bytes.replace(offset, 4, packed(number));
}

void add_containers(Cases& cases) {
  const std::string good = TriangleGlb().bytes();
  const size_t binary = good.find(std::string("BIN\0", 4)) - 4;
  cases.push_back(
      glb_case("B01", "length 2^32-1", "COUNT|TRUNCATED", with_number(good, 8, 0xFFFFFFFF)));
  cases.push_back(glb_case(
      "B02", "JSON longer than the file", "TRUNCATED|COUNT", with_number(good, 12, 0x10000000)));
  cases.push_back(
      glb_case("B03", "BIN of 2^32-4", "COUNT|TRUNCATED", with_number(good, binary, 0xFFFFFFFC)));
  cases.push_back(json_case("B16", "version 1.0", "UNSUPPORTED", "/asset/version", "1.0"));
  cases.push_back(json_case("B16",
                            "an extension nobody knows is required",
                            "UNSUPPORTED",
                            "/extensionsRequired",
                            {"ACME_shape"}));
}

// Pictures are not needed for a mesh: whatever their address says, it is not followed.
void add_addresses(Cases& cases) {
  cases.push_back(json_case("B04", "picture at '.'", "OK", "/images/0/uri", "."));
  cases.push_back(json_case("B06", "picture at '`touch x`'", "OK", "/images/0/uri", "`touch x`"));
  for (const char* uri : {"/etc/passwd", "../../../etc/passwd", "file:///etc/passwd"}) {
    cases.push_back(json_case(
        "B05", std::string("buffer at ") + uri, "UNSUPPORTED|PATH", "/buffers/0/uri", uri));
  }
  const char* const damaged = "data:application/octet-stream;base64,*";
  cases.push_back(
      json_case("B11", "buffer in damaged base64", "SYNTAX", "/buffers/0/uri", damaged));
  for (const char* uri : {"data:,", "data:;base64,AAAA"}) {  // shorter than what lies in it
    cases.push_back(
        json_case("B11", std::string("buffer in ") + uri, "COUNT", "/buffers/0/uri", uri));
  }
}

void add_accessors(Cases& cases) {
  TriangleGlb no_view;
  no_view.json["accessors"][1].erase("bufferView");
  no_view.json["accessors"][1]["count"] = 4294967295u;
  cases.push_back(glb_case(
      "B07", "2^32-1 elements without a view", "COUNT|SCHEMA|UNSUPPORTED", no_view.bytes()));
  cases.push_back(json_case("B07", "2^32-1 elements", "COUNT", "/accessors/1/count", 4294967295u));
  TriangleGlb wraps;
  wraps.json["bufferViews"][1]["byteOffset"] = 18446744073709551608u;
  cases.push_back(glb_case("B08", "a view that wraps", "COUNT|SCHEMA", wraps.bytes()));
  cases.push_back(json_case("B08",
                            "an accessor that wraps",
                            "COUNT|SCHEMA",
                            "/accessors/1/byteOffset",
                            18446744073709551608u));
  cases.push_back(
      json_case("B09",
                "sparse indices out of range",
                "REF",
                "/accessors/1/sparse",
                {{"count", 1},  // the index is half of a float of a position
                 {"indices", {{"bufferView", 1}, {"byteOffset", 18}, {"componentType", 5123}}},
                 {"values", {{"bufferView", 1}}}}));
  TriangleGlb corner;
  corner.binary[2] = 3;
  cases.push_back(glb_case("B10", "corner 3 of 3 vertices", "REF", corner.bytes()));
}

void add_nodes(Cases& cases) {
  cases.push_back(json_case("B12", "a node is its own child", "REF", "/nodes/0/children", {0}));
  TriangleGlb cycle;
  cycle.json["nodes"] = {
      {{"children", {1}}}, {{"children", {2}}}, {{"children", {1}}, {"mesh", 0}}};
  cases.push_back(glb_case("B12", "a cycle of nodes", "REF", cycle.bytes()));
  TriangleGlb chain;
  constexpr int kDeep = 100000;
  chain.json["nodes"] = Json::array();
  for (int i = 1; i < kDeep; ++i) chain.json["nodes"].push_back({{"children", {i}}});
  chain.json["nodes"].push_back({{"mesh", 0}});
  cases.push_back(glb_case("B12", "100 000 nodes in a chain", "LIMIT|REF|OK", chain.bytes()));
  cases.push_back(json_case("B13",
                            "a matrix with what is no number",
                            "VALUE|SCHEMA",
                            "/nodes/0/matrix",
                            {1, 0, 0, 0, 0, nullptr, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}));
  TriangleGlb infinite;
  infinite.json["nodes"][0]["translation"] = {1e308, 1e308, 1e308};
  infinite.json["nodes"][0]["scale"] = {1e308, 1e308, 1e308};
  cases.push_back(glb_case("B13", "nodes at infinity", "VALUE", infinite.bytes()));
  cases.push_back(json_case("B13", "scale 0", "VALUE|EMPTY", "/nodes/0/scale", {0, 0, 0}));
}

/// What write_glb() makes of a sphere with Draco, with one thing changed.
Case draco_case(const std::string& row,
                const std::string& damage,
                const std::string& expected,
                const std::function<void(Json& json, std::string& binary)>& change) {
  return {row, "Draco: " + damage, expected, {"mesh.glb"}, [=](const fs::path& folder) {
            const fs::path file = folder / "mesh.glb";
            write_glb(file, labelled_sphere(), Frame{});
            const std::string bytes = read_bytes(file);
            const size_t at = bytes.find(std::string("BIN\0", 4));
            Json json = Json::parse(bytes.substr(20, at - 24));
            std::string binary = bytes.substr(at + 4);
            change(json, binary);
            write_bytes(file, glb(json.dump(), binary));
            return Call{{"info", file.string()}, [file] { (void)read_mesh_file(file); }};
          }};
}

void add_draco(Cases& cases) {
  const auto extension = [](Json& json) -> Json& {
    return json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"];
  };
  cases.push_back(draco_case("B14", "no such view", "REF", [=](Json& json, std::string&) {
    extension(json)["bufferView"] = 99;
  }));
  cases.push_back(draco_case("B14", "no view", "SCHEMA|MISSING|REF", [=](Json& json, std::string&) {
    extension(json).erase("bufferView");
  }));
  cases.push_back(draco_case("B14", "cut", "SYNTAX|COUNT", [=](Json& json, std::string&) {
    json["bufferViews"][extension(json)["bufferView"].get<size_t>()]["byteLength"] = 40;
  }));
  cases.push_back(draco_case(
      "B14", "an attribute that is not there", "REF|SCHEMA", [=](Json& json, std::string&) {
        extension(json)["attributes"]["POSITION"] = 77;
      }));
  // Version 2.2, a mesh; sequential connectivity, 2^31 faces and points (as varints), or
  // edgebreaker of the standard kind with as many.
  const std::string many = "\x80\x80\x80\x80\x08";
  for (const char method : {'\0', '\1'}) {
    const std::string start = std::string("DRACO\2\2\1", 8) + method + std::string(2, '\0');
    const std::string kind = method == '\0' ? "" : std::string(1, '\0');
    cases.push_back(draco_case("B15",
                               "2^31 faces, method " + std::to_string(int{method}),
                               "SYNTAX|LIMIT",
                               [=](Json& json, std::string& binary) {
                                 const size_t view = extension(json)["bufferView"].get<size_t>();
                                 const size_t at =
                                     json["bufferViews"][view].value("byteOffset", size_t{0});
                                 const std::string bytes = start + kind + many + many;
                                 binary.replace(at, bytes.size(), bytes);
                               }));
  }
}

std::string binary_stl(uint32_t declared, const std::vector<std::array<float, 9>>& facets) {
  std::string out = "solid but binary";
  out.resize(80, ' ');
  out += packed(declared);
  for (const auto& corners : facets) {
    out += packed(0.0f, 0.0f, 1.0f);
    for (const float c : corners) out += packed(c);
    out += std::string(2, '\0');
  }
  return out;
}

void add_stl(Cases& cases) {
  const std::array<float, 9> facet = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const float nan = std::nanf("");
  cases.push_back(file_case(
      "M01", "2^32-1 facets", "COUNT|TRUNCATED|SYNTAX", "m.stl", binary_stl(0xFFFFFFFF, {})));
  cases.push_back(
      file_case("M02", "binary, yet it starts with solid", "OK", "m.stl", binary_stl(1, {facet})));
  cases.push_back(file_case("M03",
                            "a facet is never closed",
                            "SYNTAX|TRUNCATED",
                            "m.stl",
                            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n",
                            {"line"}));
  cases.push_back(file_case("M04",
                            "a corner is no number",
                            "VALUE",
                            "m.stl",
                            binary_stl(1, {{0, 0, nan, 1, 0, 0, 0, 1, 0}})));
  cases.push_back(file_case("M05",
                            "faces without area, and twice the same",
                            "OK",
                            "m.stl",
                            binary_stl(3, {facet, facet, {0, 0, 0, 0, 0, 0, 1, 0, 0}})));
}

void add_obj(Cases& cases) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const auto obj = [&](const char* row,
                       const std::string& damage,
                       const std::string& expected,
                       const std::string& text,
                       const std::vector<std::string>& words = {}) {
    cases.push_back(file_case(row, damage, expected, "m.obj", text, words));
  };
  obj("M04",
      "a vertex is no number",
      "VALUE|SYNTAX",
      "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
      {"the first is 1"});
  obj("M04",
      "a vertex is infinite",
      "VALUE|SYNTAX",
      "v 0 0 1e999\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
      {"the first is 1"});
  obj("M05",
      "faces without area, and twice the same",
      "OK",
      vertices + "f 1 2 3\nf 1 2 3\nf 1 1 2\n");
  obj("M06", "corner 0", "REF|SYNTAX", vertices + "f 0 1 2\n", {"line"});
  obj("M06", "corner -99", "REF", vertices + "f -99 1 2\n", {"line"});
  obj("M06", "corner 4 of 3", "REF", vertices + "f 1 2 4\n", {"line"});
  obj("M07",
      "materials outside of the folder",
      "OK",
      "mtllib ../../x.mtl\nmtllib /etc/passwd\nmap_Kd /etc/passwd\n" + vertices + "f 1 2 3\n");
  std::string polygon = "f";
  for (int i = 0; i < 1'000'000; ++i) polygon += " " + std::to_string(1 + i % 3);
  std::string continued = "f";
  for (int i = 0; i < 3'000'000; ++i) continued += " \\\n";
  obj("M08", "a line of 8 MB", "LIMIT", vertices + "#" + std::string(8 << 20, 'x') + "\n");
  obj("M08", "a line that goes on and on", "LIMIT|SYNTAX", vertices + continued);
  // Its corners are in memory anyway, and its triangles are no more than those.
  obj("M08", "a face of a million corners", "OK+W", vertices + polygon + "\n");
}

void add_3mf(Cases& cases) {
  using File = ThreeMfFile;
  const auto bytes = [&](const char* row,
                         const std::string& damage,
                         const std::string& expected,
                         const std::string& content) {
    cases.push_back(file_case(row, damage, expected, "m.3mf", content));
  };
  const auto changed = [&](const char* row,
                           const std::string& damage,
                           const std::string& expected,
                           const std::function<void(File&)>& change,
                           const ZipDamage& archive = {.method = 8}) {
    File file;
    change(file);
    bytes(row, damage, expected, file.bytes(archive));
  };
  const auto nothing = [](File&) {};
  changed("M09", "untouched twin", "OK", nothing);
  changed("M11", "64-bit sizes that are right", "OK", nothing, {.method = 8, .is_64_bits = true});
  const std::string zeros(size_t{50} << 20, ' ');
  changed("M09", "a model of 50 MB of blanks and another", "LIMIT", [&](File& file) {
    file.build += zeros;
    file.more_files = {{"3D/b.model", zeros}};
  });
  changed("M09",
          "65 536 files",
          "LIMIT",
          [](File& file) {
            for (int i = 0; i < 65536; ++i) file.more_files.emplace_back(std::to_string(i), "");
          },
          {.is_64_bits = true});
  for (const char* name : {"../../.bashrc", "/etc/passwd", "..\\..\\.bashrc", "3D/../../x"}) {
    changed("M10", std::string("a file ") + name, "PATH", [&](File& file) {
      file.more_files = {{name, "alias ls=rm"}};
    });
  }
  changed("M10", "the model at ../x", "PATH", [](File& file) { file.target = "/3D/../../x"; });
  changed("M10", "a part at ../x", "PATH", [](File& file) {
    file.build = "<item objectid=\"1\" p:path=\"/../x\"/>";
  });
  for (const int64_t lie : {int64_t{-50}, int64_t{50}, int64_t{1} << 40}) {
    changed("M11",
            "64-bit sizes off by " + std::to_string(lie),
            "COUNT",
            nothing,
            {.method = 8, .size_change = lie, .is_64_bits = true});
  }
  std::string laughs = "<!DOCTYPE model [<!ENTITY a0 \"ha\">";
  for (int i = 1; i < 20; ++i) {
    laughs += "<!ENTITY a" + std::to_string(i) + " \"";
    for (int k = 0; k < 10; ++k) laughs += "&a" + std::to_string(i - 1) + ";";
    laughs += "\">";
  }
  for (const std::string& before :
       {std::string("<!DOCTYPE model SYSTEM \"http://localhost/a.dtd\">"),
        std::string("<!DOCTYPE model [<!ENTITY e SYSTEM \"file:///etc/passwd\">]>"),
        laughs + "]>"}) {
    changed("M12", before.substr(0, 40), "UNSUPPORTED", [&](File& file) {
      file.before = before;
      file.build += "&e;&a19;";
    });
  }
  changed("M13", "corner 4 of 4", "REF", [](File& file) {
    file.resources.replace(file.resources.find("v3=\"3\""), 6, "v3=\"4\"");
  });
  changed("M13", "its own component", "REF", [](File& file) {
    file.resources = File::object(1, File::components({{1, ""}}));
  });
  changed("M13", "a cycle of components", "REF", [](File& file) {
    file.resources = File::object(1, File::components({{2, ""}})) +
                     File::object(2, File::components({{3, ""}})) +
                     File::object(3, File::components({{1, ""}}));
  });
  changed("M13", "components that multiply to 10^20", "LIMIT", [](File& file) {
    for (int id = 2; id < 22; ++id) {
      file.resources += File::object(
          id, File::components(std::vector<std::pair<int, std::string>>(10, {id - 1, ""})));
    }
    file.build = "<item objectid=\"21\"/>";
  });
}

}  // namespace

Cases mesh_cases() {
  Cases cases;
  add_containers(cases);
  add_addresses(cases);
  add_accessors(cases);
  add_nodes(cases);
  add_draco(cases);
  add_stl(cases);
  add_obj(cases);
  add_3mf(cases);
  return cases;
}

}  // namespace cgs::test
