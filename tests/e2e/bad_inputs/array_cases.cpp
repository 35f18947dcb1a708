// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/e2e/bad_inputs/valid_inputs.h"

namespace cgs::test {

namespace {

using Rows = std::vector<std::vector<double>>;

Case bytes_case(const std::string& row,
                const std::string& damage,
                const std::string& expected,
                const std::vector<std::string>& words,
                const std::function<std::string()>& bytes) {
  std::vector<std::string> all = words;
  if (expected != "OK") all.emplace_back("poses_bounds.npy");
  return {row, damage, expected, all, [bytes](const fs::path& folder) {
            write_llff_scene(folder, bytes());
            return info_call(folder);
          }};
}

Case rows_case(const std::string& row,
               const std::string& damage,
               const std::string& expected,
               const std::vector<std::string>& words,
               const std::function<void(Rows&)>& change) {
  return bytes_case(row, damage, expected, words, [change] {
    Rows rows = llff_rows();
    change(rows);
    return npy_of_rows(rows);
  });
}

std::string data_of(const Rows& rows) {
  std::string data;
  for (const auto& row : rows) {
    for (const double value : row) data += packed(value);
  }
  return data;
}

// A header of one's own before the values.
std::string with_header(const std::string& header) {
  return std::string("\x93NUMPY\x01\x00", 8) + packed(uint16_t(header.size())) + header +
         data_of(llff_rows());
}

void add_poses(Cases& cases) {
  cases.push_back(rows_case("L01", "16 columns", "SCHEMA", {"17"}, [](Rows& rows) {
    for (auto& row : rows) row.pop_back();
  }));
  cases.push_back(rows_case("L02", "4 rows, 3 images", "MISMATCH", {"4", "3"}, [](Rows& rows) {
    rows.push_back(rows[0]);
  }));
  cases.push_back(rows_case("L03", "near 0", "VALUE", {"row 1"}, [](Rows& r) { r[1][15] = 0; }));
  cases.push_back(
      rows_case("L03", "far < near", "VALUE", {"row 1"}, [](Rows& r) { r[1][16] = 0.5; }));
  cases.push_back(rows_case("L03", "NaN", "VALUE", {"row 1"}, [](Rows& r) { r[1][16] = NAN; }));
  cases.push_back(rows_case(
      "L03", "focal length Inf", "VALUE", {"row 1"}, [](Rows& r) { r[1][14] = INFINITY; }));
  cases.push_back(rows_case("L04", "mirrored", "VALUE", {"row 1"}, [](Rows& r) { r[1][1] = -1; }));
  cases.push_back(
      rows_case("L04", "not orthonormal", "VALUE", {"row 1"}, [](Rows& r) { r[1][1] = 1.1; }));
}

void add_npy(Cases& cases) {
  const std::string good = npy_of_rows(llff_rows());
  cases.push_back(
      bytes_case("N01", "wrong magic", "MAGIC", {}, [=] { return "X" + good.substr(1); }));
  cases.push_back(bytes_case("N01", "version 9", "MAGIC", {"9"}, [=] {
    std::string bytes = good;
    bytes[6] = 9;
    return bytes;
  }));
  cases.push_back(bytes_case("N02", "header of 4.3 GB", "COUNT", {}, [] {
    return std::string("\x93NUMPY\x02\x00", 8) + packed(uint32_t{0xFFFFFFF0});
  }));
  cases.push_back(bytes_case("N03", "header past the end", "TRUNCATED", {}, [] {
    return std::string("\x93NUMPY\x01\x00", 8) + packed(uint16_t{500}) + "{'descr'";
  }));
  const auto shape = [](const std::string& text) { return npy("<f8", text, data_of(llff_rows())); };
  cases.push_back(bytes_case(
      "N04", "2^33 x 2^33", "COUNT", {}, [=] { return shape("(8589934592, 8589934592)"); }));
  cases.push_back(
      bytes_case("N05", "more than there is", "TRUNCATED", {}, [=] { return shape("(9, 17)"); }));
  cases.push_back(bytes_case(
      "N06", "digits in groups", "TRUNCATED|SCHEMA", {}, [=] { return shape("(2,621, 401)"); }));
  for (const char* type : {"|O", "<ixy", "", "<i4"}) {
    cases.push_back(bytes_case(std::string(type) == "|O" ? "N07" : "N08",
                               std::string("type '") + type + "'",
                               "UNSUPPORTED|SYNTAX",
                               {},
                               [=] { return npy(type, "(3, 17)", data_of(llff_rows())); }));
  }
  cases.push_back(bytes_case("N08", "structured type", "UNSUPPORTED|SYNTAX", {}, [] {
    return with_header("{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (3, 17), }\n");
  }));
  cases.push_back(bytes_case("N09", "big endian", "OK", {}, [] {
    std::string data = data_of(llff_rows());
    for (size_t i = 0; i < data.size(); i += 8) {
      std::reverse(data.begin() + ptrdiff_t(i), data.begin() + ptrdiff_t(i) + 8);
    }
    return npy(">f8", "(3, 17)", data);
  }));
  cases.push_back(bytes_case("N09", "Fortran order", "OK", {}, [] {
    const Rows rows = llff_rows();
    std::string data;
    for (size_t c = 0; c < 17; ++c) {
      for (const auto& row : rows) data += packed(row[c]);
    }
    return npy("<f8", "(3, 17)", data, true);
  }));
  cases.push_back(bytes_case("N10", "code as header", "SYNTAX", {}, [] {
    return with_header("__import__('os').system('id')\n");
  }));
}

}  // namespace

Cases array_cases() {
  Cases cases;
  add_poses(cases);
  add_npy(cases);
  return cases;
}

}  // namespace cgs::test
