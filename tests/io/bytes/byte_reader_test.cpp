// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/byte_reader.h"

#include <functional>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/temp_dir.h"

namespace cgs::byte_reader_test {
namespace {

using namespace std::string_view_literals;

Defect defect_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const BadInput& error) {
    return error.defect();
  }
  ADD_FAILURE() << "nothing was refused";
  return Defect::Open;
}

TEST(ReadFile, RefusesWhatIsNotARegularFile) {
  const test::TempDir dir;
  mkfifo((dir / "fifo").c_str(), 0600);
  EXPECT_EQ(defect_of([&] { read_file(dir / "fifo"); }), Defect::Open);
  EXPECT_EQ(defect_of([&] { read_file(dir.path()); }), Defect::Open);
  EXPECT_EQ(defect_of([&] { read_file("/dev/zero"); }), Defect::Open);
  EXPECT_EQ(defect_of([&] { read_file(dir / "missing"); }), Defect::Open);
}

TEST(ReadFile, RefusesAnEmptyFileAndOneAboveTheLimit) {
  const test::TempDir dir;
  test::write_bytes(dir / "empty", "");
  test::write_bytes(dir / "big", std::string(100, 'x'));
  EXPECT_EQ(defect_of([&] { read_file(dir / "empty"); }), Defect::Empty);
  EXPECT_THROW(read_file(dir / "big", {.max_file_bytes = 99}), LimitError);
  EXPECT_EQ(read_file(dir / "big").size(), 100u);
}

TEST(ReadFileStart, ReadsNoMoreThanAsked) {
  const test::TempDir dir;
  test::write_bytes(dir / "ten", "0123456789");
  EXPECT_EQ(read_file_start(dir / "ten", 4), "0123");
  EXPECT_EQ(read_file_start(dir / "ten", 400), "0123456789");
  EXPECT_EQ(defect_of([&] { read_file_start(dir.path(), 4); }), Defect::Open);
}

TEST(RefuseForeignContent, NamesWhatItFound) {
  EXPECT_THROW(refuse_foreign_content("a.ply", "version https://git-lfs.github.com", "PLY"),
               BadInput);
  EXPECT_THROW(refuse_foreign_content("a.ply", "<html>", "PLY"), BadInput);
  EXPECT_THROW(refuse_foreign_content("a.ply", "PK\x03\x04", "PLY"), BadInput);
  EXPECT_NO_THROW(refuse_foreign_content("a.ply", "ply\n", "PLY"));
}

TEST(ByteReader, ReadsLittleEndianNumbers) {
  ByteReader reader("\x01\x02\x00\x00\xff"sv, "f");
  EXPECT_EQ(reader.get<uint32_t>("number"), 0x201u);
  EXPECT_EQ(reader.get<int8_t>("number"), -1);
  EXPECT_EQ(defect_of([&] { reader.get<uint8_t>("number"); }), Defect::Truncated);
}

TEST(ByteReader, RefusesCountsThatTheFileCannotHold) {
  const ByteReader reader("0123456789"sv, "f");
  EXPECT_NO_THROW(reader.expect_records(5, 2, "records"));
  EXPECT_EQ(defect_of([&] { reader.expect_records(6, 2, "records"); }), Defect::Count);
  EXPECT_EQ(defect_of([&] { reader.expect_records(uint64_t{1} << 61, 248, "records"); }),
            Defect::Count);
}

TEST(ByteReader, TakesStringsUpToTheirEnd) {
  ByteReader reader("name\0rest"sv, "f");
  EXPECT_EQ(reader.take_c_string(10, "name"), "name");
  EXPECT_EQ(defect_of([&] { reader.take_c_string(10, "name"); }), Defect::Truncated);
}

TEST(ParseNumber, WantsTheWholeToken) {
  double value = 0;
  EXPECT_TRUE(parse_number("1.5e3", value));
  EXPECT_EQ(value, 1500);
  EXPECT_TRUE(parse_number("+.5", value));
  EXPECT_EQ(value, 0.5);
  for (const auto* bad : {"", "1,5", "1.5x", "1e999", " 1", "+", "++1", "+-1", "+inf"}) {
    EXPECT_FALSE(parse_number(bad, value)) << bad;
  }
}

TEST(ParseMeasured, TakesWhatProgramsPrintForNumbersThatAreNone) {
  const auto value_of = [](const std::string& text) {
    double value = 7;
    EXPECT_TRUE(parse_measured(text, value)) << text;
    return value;
  };
  for (const char* text :
       {"nan", "-nan", "+nan", "NaN", "NAN", "-nan(ind)", "1.#QNAN", "-1.#IND"}) {
    EXPECT_TRUE(std::isnan(value_of(text))) << text;
  }
  for (const char* text : {"inf", "+inf", "Infinity", "1.#INF", "1e999", "+1E+999"}) {
    EXPECT_EQ(value_of(text), HUGE_VAL) << text;
  }
  for (const char* text : {"-inf", "-1.#INF00", "-1e999"}) EXPECT_EQ(value_of(text), -HUGE_VAL);
  for (const char* text : {"1e-999", "-1e-999"}) EXPECT_EQ(value_of(text), 0) << text;
  EXPECT_EQ(value_of("+2.5"), 2.5);
  double unused = 0;
  for (const char* text : {"", "-", "+", "--nan", "+-1", "nano", "1.5x", "1e999x", "x1.#INF"}) {
    EXPECT_FALSE(parse_measured(text, unused)) << text;
  }
}

}  // namespace
}  // namespace cgs::byte_reader_test
