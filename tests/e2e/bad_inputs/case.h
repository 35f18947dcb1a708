// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace cgs::test {

/// What is done with a bad input: the program is run with arguments, or one reader is called in a
/// process of its own that ends as the program would. Where both are there, the reader is quicker;
/// the environment variable CGS_BAD_INPUTS_THROUGH_PROGRAM asks for the program.
struct Call {
  std::vector<std::string> arguments;
  std::function<void()> read;
  uint64_t disk_bytes = 0;     ///< No file may grow larger, as on a full disk; 0 = no limit.
  bool has_no_rights = false;  ///< Root becomes nobody first.
};

/// One bad input. `make` writes it below a fresh folder and says how to use it; whatever the call
/// writes goes to `folder / "out"`, which must not exist afterwards if the input is refused.
struct Case {
  std::string row;       ///< Of the matrix, e.g. "P07".
  std::string damage;    ///< In words.
  std::string expected;  ///< Accepted ends, e.g. "TRUNCATED|SYNTAX"; "OK", "OK+W" with a warning.
  std::vector<std::string> words;  ///< That the message (or the warning) must contain.
  std::function<Call(const std::filesystem::path& folder)> make;
  bool may_leave_output = false;  ///< Finished stages are kept; temporary files are not.
};

using Cases = std::vector<Case>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

Cases general_cases();     ///< G: any file
Cases gaussian_cases();    ///< P: PLY of Gaussians and of meshes
Cases colmap_cases();      ///< C
Cases array_cases();       ///< L, N: poses_bounds.npy
Cases transforms_cases();  ///< T
Cases image_cases();       ///< I
Cases survey_cases();      ///< S: tables of control points
Cases exr_cases();         ///< X
Cases volume_cases();      ///< V
Cases output_cases();      ///< E: the environment, and files a run left behind
Cases mesh_cases();        ///< B, M: glTF, STL, OBJ, 3MF
Cases depth_cases();       ///< D: depth files; masks
Cases checkpoint_cases();  ///< K: the state of unfinished work

/// What is wrong with the way a case ends; empty if it ends as it should.
std::string verdict(const Case& bad);

}  // namespace cgs::test
