// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/texture_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <system_error>

#include "io/bytes/scene_path.h"
#include "io/images/image.h"
#include "libcgs/core/error.h"
#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

std::string in_lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  });
  return text;
}

std::optional<fs::path> file_in(const SceneRoot& root,
                                const std::string& name,
                                const fs::path& mesh) {
  try {
    const fs::path out = resolve_in_scene(root, name, mesh);
    std::error_code none;
    if (fs::is_regular_file(out, none)) return out;
  } catch (const BadInput&) {  // leads out of the folder
  }
  return std::nullopt;
}

int64_t pixel_at(int64_t at, int size, bool is_clamped) {
  if (is_clamped) return std::clamp<int64_t>(at, 0, size - 1);
  return ((at % size) + size) % size;
}

}  // namespace

std::optional<fs::path> companion_of(const fs::path& mesh, const std::string& name) {
  const fs::path parent = mesh.parent_path();
  const SceneRoot root{parent.empty() ? fs::path(".") : parent};
  const std::string path = with_slashes(name);
  if (const auto found = file_in(root, path, mesh)) return found;
  const std::string bare = fs::path(path).filename().string();
  if (bare.empty()) return std::nullopt;
  if (const auto found = file_in(root, bare, mesh)) return found;
  for (const std::string& entry : sorted_entries(root.folder)) {
    if (in_lower_case(entry) == in_lower_case(bare)) return file_in(root, entry, mesh);
  }
  return std::nullopt;
}

Eigen::Vector3f picture_color(const ColorImage& picture,
                              const Eigen::Vector2f& texcoord,
                              const PictureFit& fit) {
  constexpr double kFarthest = 1e6;  // repetitions
  const Eigen::Vector2d stated = texcoord.cast<double>().cwiseProduct(fit.scale) + fit.offset;
  const double u = std::isfinite(stated.x()) ? std::clamp(stated.x(), -kFarthest, kFarthest) : 0;
  const double v = std::isfinite(stated.y()) ? std::clamp(stated.y(), -kFarthest, kFarthest) : 0;
  const double x = u * picture.width - 0.5;
  const double y = (1 - v) * picture.height - 0.5;
  const auto left = static_cast<int64_t>(std::floor(x));
  const auto top = static_cast<int64_t>(std::floor(y));
  Eigen::Vector3f out = Eigen::Vector3f::Zero();
  for (const int dy : {0, 1}) {
    for (const int dx : {0, 1}) {
      const double across = dx == 0 ? 1 - (x - double(left)) : x - double(left);
      const double down = dy == 0 ? 1 - (y - double(top)) : y - double(top);
      const int64_t column = pixel_at(left + dx, picture.width, fit.is_clamped);
      const int64_t row = pixel_at(top + dy, picture.height, fit.is_clamped);
      const Eigen::Vector3f& coded = picture(static_cast<int>(column), static_cast<int>(row));
      out += static_cast<float>(across * down) *
             coded.unaryExpr([](float c) { return linear_from_srgb(c); });
    }
  }
  return out.unaryExpr([](float c) { return srgb_from_linear(c); });
}

bool paint_corners(const fs::path& mesh,
                   const std::string& picture,
                   const PictureFit& fit,
                   const std::vector<PaintedCorner>& corners,
                   CornerColors& colors,
                   std::vector<std::string>& warnings) {
  const auto leave_out = [&](const std::string& why) {
    warnings.push_back("texture " + one_line(picture.substr(0, 100)) + " is left out: " + why);
    return false;
  };
  const auto path = companion_of(mesh, picture);
  if (!path) return leave_out("it does not lie in the folder of the file");
  ColorImage image;
  try {
    image = read_image(*path);
  } catch (const BadInput& error) {
    return leave_out(error.what());
  } catch (const LimitError& error) {
    return leave_out(error.what());
  }
  for (const PaintedCorner& corner : corners) {
    if (corner.texcoord.hasNaN()) continue;
    colors.add(corner.vertex, picture_color(image, corner.texcoord, fit));
  }
  return true;
}

}  // namespace cgs
