// SPDX-License-Identifier: GPL-3.0-or-later
#include <limits>

#include "tests/e2e/bad_inputs/valid_inputs.h"
#include "tests/support/zip_bytes.h"

namespace cgs::test {

namespace {

/// A picture of one number per pixel.
using Values = std::function<double(int x, int y)>;

std::string npy_depth(const Values& value, int width = kWidth, int height = kHeight) {
  std::string data;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) data += packed(static_cast<float>(value(x, y)));
  }
  return npy("<f4", "(" + std::to_string(height) + ", " + std::to_string(width) + ")", data);
}

std::string png16_depth(const Values& value) {
  std::vector<std::string> rows;
  for (int y = 0; y < kHeight; ++y) {
    std::string row;
    for (int x = 0; x < kWidth; ++x) {
      const auto level = static_cast<unsigned>(value(x, y));
      row += {static_cast<char>(level >> 8), static_cast<char>(level & 0xFF)};
    }
    rows.push_back(row);
  }
  return png(kWidth, rows, {.color_type = 0, .bit_depth = 16});
}

/// The same file as the depth of every photograph, in the folder "depth" that the program is told
/// of.
Case depth_case(const std::string& row,
                const std::string& damage,
                const std::string& expected,
                const std::string& extension,
                const std::string& bytes,
                const std::vector<std::string>& options = {}) {
  return {row, damage, expected, {}, [=](const fs::path& folder) {
            write_transforms_scene(folder);
            for (const char* name : {"0", "1", "2"}) {
              write_bytes(folder / "depth" / (name + extension), bytes);
            }
            Call call = train_call(folder);
            const std::vector<std::string> told = {
                "--set", "steps=0", "--depth", (folder / "depth").string()};
            call.arguments.insert(call.arguments.end(), told.begin(), told.end());
            call.arguments.insert(call.arguments.end(), options.begin(), options.end());
            return call;
          }};
}

// The pictures show what is 1.5 units away.
double plane(int /*x*/, int /*y*/) { return 1.5; }

void add_values(Cases& cases) {
  const auto nothing = [](int, int) { return 0.0; };
  cases.push_back(depth_case("D01", "no depth anywhere", "OK+W", ".png", png16_depth(nothing)));
  // What phones and depth cameras write is that; the photographs show whether it fits.
  cases.push_back(depth_case(
      "D02", "whole numbers count as millimetres", "OK|OK+W", ".png", png16_depth([](int, int) {
        return 1500.0;
      })));
  const auto holed = [](double odd) {
    return [odd](int x, int y) { return x % 4 == 0 ? odd : plane(x, y); };
  };
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  constexpr double kFar = std::numeric_limits<double>::infinity();
  for (const double odd : {-1.0, kNone, kFar, -kFar, 1e30, 1e-30}) {
    cases.push_back(depth_case("D03",
                               "every fourth column is " + std::to_string(odd),
                               "OK|OK+W",
                               ".npy",
                               npy_depth(holed(odd)),
                               {"--depth-kind", "metric"}));
  }
  cases.push_back(depth_case(
      "D03", "every fourth column is 65535", "OK|OK+W", ".png", png16_depth([](int x, int) {
        return x % 4 == 0 ? 65535.0 : 1500.0;
      })));
  for (const double odd : {0.0, -2.0}) {
    cases.push_back(depth_case("D04",
                               "every fourth disparity is " + std::to_string(odd),
                               "OK|OK+W",
                               ".npy",
                               npy_depth(holed(odd)),
                               {"--depth-kind", "disparity"}));
  }
}

void add_sizes(Cases& cases) {
  cases.push_back(depth_case(
      "D05", "half the size", "OK|OK+W", ".npy", npy_depth(plane, kWidth / 2, kHeight / 2)));
  cases.push_back(depth_case(
      "D05", "another shape", "MISMATCH", ".npy", npy_depth(plane, kHeight, kWidth / 2)));
  cases.push_back(
      {"I15", "a mask of another size", "MISMATCH", {"masks"}, [](const fs::path& folder) {
         write_transforms_scene(folder);
         write_bytes(folder / "scene/masks/0.png", rgb_png(kWidth, kHeight / 2));
         return train_call(folder);
       }});
}

void add_archives(Cases& cases) {
  const auto npz = [&](const char* row,
                       const std::string& damage,
                       const std::string& expected,
                       const std::string& array,
                       const ZipDamage& lie) {
    cases.push_back(depth_case(
        row, "npz: " + damage, expected, ".npz", zip_bytes({{"depth.npy", array}}, lie)));
  };
  const std::string good = npy_depth(plane);
  npz("N12", "good, deflated", "OK|OK+W", good, {.method = 8});
  npz("N12", "good, with 64-bit sizes", "OK|OK+W", good, {.method = 8, .is_64_bits = true});
  npz("N11", "100 kB unpack to 100 MB", "LIMIT", std::string(100 << 20, '\0'), {.method = 8});
  std::string noise(11 << 20, '\0');
  uint32_t state = 1;
  for (char& byte : noise) byte = static_cast<char>((state = state * 1664525 + 1013904223) >> 24);
  npz("N11",
      "11 MB unpack to 10 GB",
      "LIMIT",
      noise,
      {.method = 8, .size_change = 10'000'000'000, .is_64_bits = true});
  for (const int64_t lie : {-100, -1, 1, 1000, 100'000'000}) {
    for (const uint16_t method : {uint16_t{0}, uint16_t{8}}) {
      npz("N12",
          "size off by " + std::to_string(lie),
          "COUNT",
          good,
          {.method = method, .size_change = lie});
    }
  }
  npz("N12", "encrypted", "UNSUPPORTED", good, {.flags = 1});
  npz("N12", "bzip2", "UNSUPPORTED", good, {.method = 12});
}

void add_colmap_maps(Cases& cases) {
  std::string values;
  for (int i = 0; i < kWidth * kHeight; ++i) values += packed(1.5f);
  const std::string size = std::to_string(kWidth) + "&" + std::to_string(kHeight) + "&";
  const auto map = [&](const char* row, const std::string& expected, const std::string& bytes) {
    cases.push_back(
        depth_case(row, "\"" + bytes.substr(0, 16) + "\"", expected, ".png.geometric.bin", bytes));
  };
  map("C28", "OK|OK+W", size + "1&" + values);
  map("C28", "COUNT", "99999&99999&1&" + values.substr(0, 12));
  map("C28", "COUNT", "4294967295&4294967295&1&" + values);
  map("C28", "COUNT", size + "1&" + values + values);
  map("C28", "SCHEMA", size + "3&" + values + values + values);
  for (const char* start : {"0&0&0&", "-5&4&1&", "5&4&1", "5&4", "5.5&4&1&", "&&&", "5;4;1;"}) {
    map("C29", "SYNTAX", start + values);
  }
}

}  // namespace

Cases depth_cases() {
  Cases cases;
  add_archives(cases);
  add_colmap_maps(cases);
  add_values(cases);
  add_sizes(cases);
  return cases;
}

}  // namespace cgs::test
