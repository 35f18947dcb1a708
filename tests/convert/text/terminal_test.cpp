// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/terminal.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::terminal_test {
namespace {

TEST(Terminal, IsStrictAboutWarningsButNotAboutNotes) {
  const Terminal strict(false, true);
  testing::internal::CaptureStderr();
  EXPECT_NO_THROW(strict.note({"worked on at half the size", "focal length solved for"}));
  EXPECT_THROW(strict.warn("odd"), Error);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "cgs: note: worked on at half the size\n"
            "cgs: note: focal length solved for\n"
            "cgs: warning: odd\n");
}

TEST(Terminal, TellsOnlyWarningsWhenQuiet) {
  const Terminal quiet(true);
  testing::internal::CaptureStderr();
  quiet.note({"ordinary"});
  quiet.warn("odd");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "cgs: warning: odd\n");
}

}  // namespace
}  // namespace cgs::terminal_test
