// SPDX-License-Identifier: GPL-3.0-or-later
#include <openvdb/openvdb.h>

#include "io/volumes/vdb.h"
#include "tests/e2e/bad_inputs/valid_inputs.h"

namespace cgs::test {

namespace {

Case bytes_case(const std::string& row,
                const std::string& damage,
                const std::string& expected,
                const std::function<void(std::string&)>& change) {
  std::vector<std::string> words;
  if (expected != "OK") words.emplace_back("volume.vdb");
  return {row, damage, expected, words, [change](const fs::path& folder) {
            write_volume_file(folder);
            std::string bytes = read_bytes(folder / "volume.vdb");
            bytes[21 + 14] = '4';  // no UUID of ours: the checksum does not stand in front
            change(bytes);
            write_bytes(folder / "volume.vdb", bytes);
            return mesh_call(folder);
          }};
}

// Every length of a compressed block: 8 bytes before a blosc header that states the same length.
std::vector<size_t> block_lengths(const std::string& bytes) {
  std::vector<size_t> out;
  for (size_t at = 0; at + 24 <= bytes.size(); ++at) {
    int64_t length = 0;
    uint32_t stated = 0;
    std::memcpy(&length, bytes.data() + at, 8);
    std::memcpy(&stated, bytes.data() + at + 20, 4);
    if (length >= 16 && length == int64_t{stated} && bytes[at + 8] == 2) out.push_back(at);
  }
  if (out.size() < 3) throw std::runtime_error("no compressed blocks");
  return out;
}

size_t behind(const std::string& bytes, const std::string& text) {
  const size_t at = bytes.find(text);
  if (at == std::string::npos) throw std::runtime_error("no " + text);
  return at + text.size();
}

// The grids of the volume, changed and written again.
Case grids_case(const std::string& row,
                const std::string& damage,
                const std::string& expected,
                const std::function<void(openvdb::GridPtrVec&)>& change) {
  return {row, damage, expected, {}, [change](const fs::path& folder) {
            write_volume_file(folder);
            openvdb::GridPtrVec grids = read_vdb(folder / "volume.vdb");
            change(grids);
            write_vdb(folder / "volume.vdb", {grids.begin(), grids.end()}, {});
            return mesh_call(folder);
          }};
}

template <typename Grid>
void change_grid(openvdb::GridPtrVec& grids,
                 const std::string& name,
                 const std::function<void(Grid&)>& change) {
  for (const auto& grid : grids) {
    if (grid->getName() == name) change(*openvdb::gridPtrCast<Grid>(grid));
  }
}

void add_bytes(Cases& cases) {
  cases.push_back(bytes_case("V01", "untouched twin", "OK", [](std::string&) {}));
  for (const int64_t lie : {int64_t{-1000000}, int64_t{-1}, int64_t{1} << 40, INT64_MIN}) {
    cases.push_back(bytes_case("V01",
                               "block of length " + std::to_string(lie),
                               "SYNTAX|TRUNCATED|COUNT",
                               [=](std::string& b) {
                                 const auto places = block_lengths(b);
                                 b.replace(places[places.size() / 2], 8, packed(lie));
                               }));
  }
  for (const int32_t count : {-1, INT32_MIN, 0, 0x7fffffff}) {
    cases.push_back(bytes_case(
        "V02",
        std::to_string(count) + " grids",
        "SYNTAX|UNSUPPORTED|EMPTY|COUNT",
        [=](std::string& b) { b.replace(b.find("Tree_float") - 4 - 8 - 4, 4, packed(count)); }));
  }
  cases.push_back(bytes_case("V02", "version 999", "UNSUPPORTED", [](std::string& b) {
    b.replace(8, 4, packed(uint32_t{999}));
  }));
  cases.push_back(bytes_case("V03", "name of 2^32 - 1 bytes", "LIMIT", [](std::string& b) {
    b.replace(b.find("creator") - 4, 4, "\xff\xff\xff\xff");
  }));
  cases.push_back(bytes_case("V03", "text of 2^32 - 1 bytes", "LIMIT", [](std::string& b) {
    b.replace(behind(b, "creator") + 4 + 6, 4, "\xff\xff\xff\xff");
  }));
  cases.push_back(bytes_case("V04", "another codec of blosc", "UNSUPPORTED", [](std::string& b) {
    for (const size_t at : block_lengths(b)) b[at + 10] = char(b[at + 10] & 0x1f);
  }));
  cases.push_back(bytes_case("V04", "LZ4 stream of 0xff", "SYNTAX|TRUNCATED", [](std::string& b) {
    for (const size_t at : block_lengths(b)) {
      int64_t length = 0;
      std::memcpy(&length, b.data() + at, 8);
      for (int64_t i = 24; i < length; ++i) b[at + 8 + size_t(i)] = '\xff';
    }
  }));
  for (const double scale : {0.0, double(NAN), double(INFINITY), -1.0}) {
    cases.push_back(
        bytes_case("V05", "scale " + std::to_string(scale), "VALUE", [=](std::string& b) {
          b.replace(behind(b, "UniformScaleTranslateMap") + 24, 8, packed(scale));
        }));
  }
}

void add_grids(Cases& cases) {
  using openvdb::Coord;
  using openvdb::FloatGrid;
  using openvdb::Int32Grid;
  for (const char* name : {"tsdf", "weight"}) {
    cases.push_back(
        grids_case("V06", std::string("tile of 4096^3 in ") + name, "OK|LIMIT", [=](auto& grids) {
          change_grid<FloatGrid>(grids, name, [](FloatGrid& grid) {
            grid.tree().addTile(3, Coord(8192, 0, 0), 0.01f, true);
          });
        }));
  }
  cases.push_back(grids_case("V06", "tile of 4096^3 in state", "OK|LIMIT", [](auto& grids) {
    change_grid<Int32Grid>(grids, "state", [](Int32Grid& grid) {
      grid.tree().addTile(3, Coord(8192, 0, 0), 2, true);
    });
  }));
  for (const float value : {NAN, INFINITY, 1e38f}) {
    for (const char* name : {"tsdf", "sigma", "weight"}) {
      cases.push_back(grids_case(
          "V05", std::string(name) + " of " + std::to_string(value), "OK|VALUE", [=](auto& grids) {
            change_grid<FloatGrid>(grids, name, [=](FloatGrid& grid) {
              int i = 0;
              for (auto it = grid.beginValueOn(); it; ++it) {
                if (++i % 5 == 0) it.setValue(value);
              }
            });
          }));
    }
  }
  cases.push_back(grids_case("V05", "background NaN", "OK|VALUE", [](auto& grids) {
    change_grid<FloatGrid>(
        grids, "tsdf", [](FloatGrid& grid) { grid.tree().root().setBackground(NAN, true); });
  }));
  cases.push_back(grids_case("V02", "no grid 'state'", "SCHEMA", [](auto& grids) {
    std::erase_if(grids, [](const auto& grid) { return grid->getName() == "state"; });
  }));
  cases.push_back(grids_case("V02", "empty grids", "OK|EMPTY|VALUE|NUMERICAL", [](auto& grids) {
    for (const auto& grid : grids) grid->clear();
  }));
  const auto meta = [&](const char* key, const std::string& text, const std::string& expected) {
    cases.push_back(grids_case(
        "V03", std::string(key) + " = " + text.substr(0, 60), expected, [=](auto& grids) {
          for (const auto& grid : grids) {
            if (grid->getName() != "tsdf") continue;
            grid->removeMeta(key);
            grid->insertMeta(key, openvdb::StringMetadata(text));
          }
        }));
  };
  meta("cgs_bounds", "[1, 2]", "SCHEMA");
  meta("cgs_bounds", "[NaN, 0, 0, 1, 1, 1]", "SCHEMA");
  meta("cgs_bounds", "[-1e300, 0, 0, 1e300, 1, 1]", "OK|VALUE|LIMIT");
  meta("cgs_bounds", "[1, 1, 1, -1, -1, -1]", "OK|VALUE");
  meta("cgs_frame", "{}", "SCHEMA");
  meta("cgs_frame", std::string(100000, '['), "SCHEMA|LIMIT");
  const auto frame = [](const char* scale) {
    return std::string(R"({"origin":[0,0,0],"scale":)") + scale +
           R"(,"file_origin":[0,0,0],"metres_per_unit":1.0,"metres_sigma":0.0,"scale_source":1})";
  };
  for (const char* scale : {"0", "-1", "1e-300", "1e300", "null", "\"1\""}) {
    meta("cgs_frame", frame(scale), "SCHEMA|VALUE");
  }
}

}  // namespace

Cases volume_cases() {
  Cases cases;
  add_bytes(cases);
  add_grids(cases);
  return cases;
}

}  // namespace cgs::test
