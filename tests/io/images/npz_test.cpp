// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/npz.h"

#include <gtest/gtest.h>

#include "io/scenes/depth_file.h"
#include "libcgs/core/error.h"
#include "tests/support/python.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"
#include "tests/support/zip_bytes.h"

namespace cgs::npz_test {
namespace {

std::string array(const std::string& shape, size_t count) {
  std::string data;
  for (size_t i = 0; i < count; ++i) data += test::packed(float(i));
  return test::npy("<f4", shape, data);
}

class Npz : public testing::Test {
 protected:
  using Files = std::vector<std::pair<std::string, std::string>>;

  NpyArray read(const Files& files, const test::ZipDamage& damage = {}) {
    test::write_bytes(dir_ / "a.npz", test::zip_bytes(files, damage));
    return read_npz_depth(dir_ / "a.npz");
  }
  std::string refused(const Files& files, const test::ZipDamage& damage = {}) {
    return test::defect_of([&] { (void)read(files, damage); });
  }
  test::TempDir dir_;
};

TEST_F(Npz, ReadsWhatNumPyWrites) {
  ASSERT_TRUE(test::run_python(R"(
import numpy as np
d = (np.arange(12, dtype=np.float32).reshape(3, 4) + 0.5)
np.savez_compressed("packed.npz", depth=d)
np.savez("stored.npz", depth=d, intrinsics=np.eye(3))
np.savez("unnamed.npz", d)
np.savez_compressed("doubles.npz", np.asfortranarray(d, dtype=">f8"))
np.savez_compressed("one_picture.npz", pred=d[None, :, :, None], focal=np.float32(55),
                    names=np.array(["a", "b"]), count=np.arange(12).reshape(3, 4))
np.savez_compressed("halves.npz", pred=d.astype(np.float16), ids=np.ones((3, 4), np.int64))
np.savez_compressed("millimetres.npz", mm=(1000 * d).astype(np.uint16), names=np.array(["a"]))
)",
                               dir_.path()))
      << "needs python3-numpy";
  for (const char* name : {"packed", "stored", "unnamed", "doubles", "one_picture", "halves"}) {
    const Raster<float> read = read_depth_file(dir_ / (std::string(name) + ".npz")).values;
    ASSERT_EQ(read.width, 4) << name;
    ASSERT_EQ(read.height, 3) << name;
    for (int i = 0; i < 12; ++i) EXPECT_EQ(read(i % 4, i / 4), float(i) + 0.5f) << name;
  }
  const StoredSamples whole = read_depth_file(dir_ / "millimetres.npz");
  EXPECT_EQ(whole.whole_bits, 16);
  EXPECT_EQ(whole.values(3, 2), 11500);
}

TEST_F(Npz, TakesTheArrayOfThatNameAmongPictures) {
  const Files files = {{"conf.npy", array("(3, 4)", 12)}, {"depth.npy", array("(2, 5)", 10)}};
  EXPECT_EQ(read(files).shape, (std::vector<size_t>{2, 5}));
  EXPECT_EQ(read(files, {.method = 8}).shape, (std::vector<size_t>{2, 5}));
}

TEST_F(Npz, RefusesSeveralPicturesAndListsThem) {
  const Files files = {{"conf.npy", array("(3, 4)", 12)},
                       {"f.npy", array("()", 1)},
                       {"ids.npy", test::npy("<i8", "(3, 4)", std::string(96, '\0'))},
                       {"pred.npy", array("(3, 4)", 12)}};
  EXPECT_EQ(refused(files), "SCHEMA");
  // Depth in millimetres and its confidence, or the other way round?
  EXPECT_EQ(refused({{"a.npy", array("(3, 4)", 12)},
                     {"b.npy", test::npy("<u2", "(3, 4)", std::string(24, 'x'))}}),
            "SCHEMA");
  const std::string said = test::message_of([&] { (void)read(files); });
  EXPECT_NE(
      said.find("conf (3 x 4), f (one number), ids (of a type that is not read), pred (3 x 4)"),
      std::string::npos)
      << said;
}

TEST_F(Npz, LooksIntoNoMoreThanItMay) {
  Files files;
  for (int i = 0; i < 65; ++i) files.emplace_back(std::to_string(i) + ".npy", array("(2,)", 2));
  EXPECT_THROW((void)read(files), LimitError);
  files.emplace_back("depth.npy", array("(3, 4)", 12));
  EXPECT_EQ(read(files).values.size(), 12u);
  ReadLimits limits;
  limits.max_pixels = 11;
  EXPECT_THROW((void)read_npz_depth(dir_ / "a.npz", limits), LimitError);
}

TEST_F(Npz, RefusesWhatHoldsNoDepth) {
  EXPECT_EQ(refused({{"readme.txt", "depth"}}), "EMPTY");
  EXPECT_EQ(refused({}), "EMPTY");
  EXPECT_EQ(refused({{"a.npy", "no array"}}), "MAGIC");
  EXPECT_EQ(refused({{"a.npy", array("(3, 4)", 12)}}, {.method = 12}), "UNSUPPORTED");
  EXPECT_EQ(refused({{"a.npy", array("(3, 4)", 12)}}, {.flags = 1}), "UNSUPPORTED");
  EXPECT_EQ(refused({{"a.npy", array("(3, 4)", 11)}}), "TRUNCATED");
  EXPECT_EQ(refused({{"a.npy", test::npy("|O", "(3, 4)", "cos\nsystem")}}), "UNSUPPORTED");
  test::write_bytes(dir_ / "b.npz", array("(3, 4)", 12));
  EXPECT_EQ(test::defect_of([&] { (void)read_npz_depth(dir_ / "b.npz"); }), "MAGIC");
  test::write_bytes(dir_ / "c.npz", test::zip_bytes({{"a.npy", array("(3,)", 3)}}));
  EXPECT_EQ(test::defect_of([&] { (void)read_depth_file(dir_ / "c.npz"); }), "SCHEMA");
}

}  // namespace
}  // namespace cgs::npz_test
