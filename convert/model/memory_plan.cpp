// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/memory_plan.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <limits>
#include <numeric>
#include <string>

#include "io/images/image.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/neighbours.h"
#include "libcgs/priors/pixel_matches.h"

namespace cgs {

namespace {

constexpr double kMebi = 1 << 20;

// Above, voxels grow with the pixels: TsdfOptions::max_voxels.
constexpr double kMostPixels = 570e3;

/// Sizes of the pictures of some views [pixels].
struct PictureSizes {
  double all = 0;
  double largest = 0;
  double as_voxels = 0;  ///< Of all, were each as fine as the voxels.
};

// A voxel is as large as the median pixel on the surface, which is one of the larger pictures, and
// what smaller ones see gets as many voxels.
PictureSizes picture_sizes(const Scene& scene, const std::vector<int>& views, int downscale) {
  std::vector<double> sizes;
  for (const int i : views) {
    const Camera& camera = scene.views[static_cast<size_t>(i)].camera;
    sizes.push_back(double(camera.width) * camera.height / (double(downscale) * downscale));
  }
  if (sizes.empty()) return {};
  std::sort(sizes.begin(), sizes.end());
  PictureSizes out{std::accumulate(sizes.begin(), sizes.end(), 0.0), sizes.back(), 0};
  double smaller = 0;
  for (const double size : sizes) {
    smaller += size;
    if (smaller < out.all / 2) continue;
    out.as_voxels = size * double(sizes.size());
    break;
  }
  return out;
}

// What reading the largest of these photographs holds where it is larger than its camera: the
// file's bytes, linear pixels, and a copy of them without distortion. Measured at 6 million pixels.
double of_reading(const Scene& scene, const std::vector<int>& views, int downscale) {
  constexpr double kOfPixel = 3 + 12 + 12;
  double largest = 0;
  for (const int i : views) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (view.image_path.empty()) continue;
    const ImageSize size = image_size(view.image_path);
    const double pixels = double(size.width) * size.height;
    const double worked_on =
        double(view.camera.width) * view.camera.height / (double(downscale) * downscale);
    if (pixels > worked_on) largest = std::max(largest, pixels);
  }
  return kOfPixel * largest;
}

// What the networks of decoder=conv hold: feature maps of all views, and parameters with their
// gradients (one of each band of rows that is worked on) and means. Measured at 24,000 to 140,000
// pixels and widths of 10 to 30.
double of_networks(const CoherenceOptions& coherence, size_t views, double pixels) {
  if (coherence.decoder != ResidualDecoder::Conv) return 0;
  constexpr double kBase = 20 * kMebi;
  constexpr double kOfPixel = 55;          // bytes per unit of width
  constexpr double kOfParameters = 260e3;  // bytes per squared unit of width
  const auto of_one = [&](double width) {
    return kBase + width * kOfPixel * pixels + width * width * kOfParameters;
  };
  const ConvWidths widths = conv_widths(coherence, views);
  return of_one(widths.depth) + of_one(widths.opacity);
}

// What free Gaussians hold beyond coherent ones, of which there may be as many as pixels: colours
// of 16 harmonics, their derivatives and means. Measured at 63,504.
double of_free_splats(SplatMethod method, double pixels) {
  constexpr double kOfPixel = 1650;
  return method == SplatMethod::Classical ? kOfPixel * pixels : 0;
}

// Where each pixel lies in the views that its own is compared with.
double of_matches(double lists, size_t views, double pixels) {
  const size_t compared = std::min(std::max<size_t>(views, 1) - 1, kMostCompared);
  return lists * double(sizeof(PixelMatch) * compared) * pixels;
}

constexpr size_t kUnlimited = std::numeric_limits<size_t>::max();

size_t free_of_machine() {
  std::ifstream meminfo("/proc/meminfo");
  std::string key;
  size_t kibibytes = 0;
  std::string unit;
  while (meminfo >> key >> kibibytes >> unit) {
    if (key == "MemAvailable:") return kibibytes * 1024;
  }
  return kUnlimited;
}

// Refuses if the stage that most_at(1) names needs more than the budget, and says how much smaller
// pictures must be: most_at(n) is for pictures whose sides are an n-th.
template <typename MostAt>
void refuse_above(size_t budget, MostAt most_at) {
  constexpr int kMostDownscale = 32;  // beyond, nothing can be made out in a photograph
  const StageMemory most = most_at(1);
  if (most.bytes <= budget) return;
  int factor = 2;
  while (factor <= kMostDownscale && most_at(factor).bytes > budget) ++factor;
  const std::string fits = factor <= kMostDownscale
                               ? "a --downscale " + std::to_string(factor) +
                                     " times as large or fewer --views make it fit, a "
                               : "no --downscale makes it fit, only a ";
  throw LimitError("'" + std::string(traits(most.stage).title) + "' needs about " +
                   mebibytes(most.bytes) + " and " + mebibytes(budget) + " may be used; " + fits +
                   "larger --memory-limit allows it");
}

}  // namespace

double match_lists(const TrainingOptions& training) {
  const bool is_virtual = training.virtual_weight > 0 || training.virtual_tv_weight > 0;
  return (training.flow_weight > 0 ? 1 : 0) + (is_virtual ? 0.5 : 0);
}

std::vector<StageMemory> memory_plan(const Scene& scene, const PictureWork& work) {
  const PictureSizes input = picture_sizes(scene, scene.input, work.downscale);
  const PictureSizes held_out = picture_sizes(scene, scene.held_out, work.downscale);
  const double reading_input = of_reading(scene, scene.input, work.downscale);
  const double reading_held_out = of_reading(scene, scene.held_out, work.downscale);
  constexpr double kOfModel = 160;  // bytes per pixel of all input views
  std::vector<StageMemory> plan;
  for (const StageTraits& stage : stage_table()) {
    const MemoryFactors& f = stage.memory;
    const bool draws_held_out = stage.id == Stage::Evaluation;
    if (f.base == 0 || (draws_held_out && scene.held_out.empty())) continue;
    if (f.of_voxel > 0 && !work.chooses_voxels) continue;
    const bool measures = stage.id == Stage::Mesh ? work.measured.meshes : work.measured.asset;
    const double of_voxel = f.of_voxel + (measures ? f.of_fused : 0);
    // Voxels that must keep an error are not made coarser to save memory.
    const double voxel_pixels =
        work.measured.meshes ? input.as_voxels : std::min(input.as_voxels, kMostPixels);
    const double largest = draws_held_out ? held_out.largest : input.largest;
    const double reading = draws_held_out ? reading_held_out : reading_input;
    double bytes =
        f.base + f.of_pixel * input.all + f.of_largest * largest + of_voxel * voxel_pixels;
    if (stage.id == Stage::Model) {
      bytes += of_networks(work.coherence, scene.input.size(), input.all) +
               of_free_splats(work.method, input.all) +
               of_matches(work.match_lists, scene.input.size(), input.all);
    }
    // The report shows photographs beside all that it holds; other stages read them before.
    bytes = stage.id == Stage::Report ? bytes + std::max(reading_input, reading_held_out)
                                      : std::max(bytes, f.base + kOfModel * input.all + reading);
    plan.push_back({stage.id, static_cast<size_t>(bytes)});
  }
  return plan;
}

double pixels_of(const Scene& scene, const std::vector<int>& views) {
  double sum = 0;
  for (const int i : views) {
    const Camera& camera = scene.views[static_cast<size_t>(i)].camera;
    sum += double(camera.width) * camera.height;
  }
  return sum;
}

std::string mebibytes(size_t bytes) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.0f MiB", double(bytes) / kMebi);
  return text.data();
}

std::string memory_plan_text(const std::vector<StageMemory>& plan) {
  std::string out;
  for (const StageMemory& stage : plan) {
    out += (out.empty() ? "" : ", ") + std::string(traits(stage.stage).title) + " " +
           mebibytes(stage.bytes);
  }
  return out;
}

void check_memory_plan(const Scene& scene, const PictureWork& work, size_t budget) {
  refuse_above(budget, [&](int factor) {
    PictureWork smaller = work;
    smaller.downscale *= factor;
    const auto plan = memory_plan(scene, smaller);
    return *std::max_element(
        plan.begin(), plan.end(), [](const auto& a, const auto& b) { return a.bytes < b.bytes; });
  });
}

void check_training_memory(const Scene& scene, size_t budget, const TrainingOptions& training) {
  refuse_above(budget, [&](int factor) {
    return memory_plan(scene,
                       {.chooses_voxels = false,
                        .coherence = training.coherence,
                        .method = training.method,
                        .match_lists = match_lists(training),
                        .downscale = factor})
        .front();
  });
}

size_t free_of_group(const std::filesystem::path& folder, const char* most, const char* now) {
  std::ifstream most_file(folder / most);
  std::ifstream now_file(folder / now);
  size_t limit = 0;
  size_t used = 0;
  if (!(most_file >> limit) || !(now_file >> used)) return kUnlimited;  // "max": no limit
  std::ifstream stat(folder / "memory.stat");
  std::string key;
  size_t bytes = 0;
  size_t cached = 0;
  size_t cached_below = 0;  // with groups below, which version 1 tells apart and `used` holds
  while (stat >> key >> bytes) {
    if (key == "inactive_file" || key == "active_file") cached += bytes;
    if (key == "total_inactive_file" || key == "total_active_file") cached_below += bytes;
  }
  used -= std::min(used, std::max(cached, cached_below));
  return limit - std::min(limit, used);
}

namespace {

// The least of a group below where groups are mounted, and those above it.
size_t free_up_from(const std::filesystem::path& mount,
                    std::filesystem::path group,
                    const char* most,
                    const char* now) {
  size_t out = kUnlimited;
  for (;; group = group.parent_path()) {
    out = std::min(out, free_of_group(mount / group, most, now));
    if (group.empty()) return out;
  }
}

}  // namespace

size_t free_of_groups(const std::filesystem::path& root, std::istream& of_process) {
  const auto in_first_version = [&](const std::filesystem::path& group) {
    return free_up_from(root / "memory", group, "memory.limit_in_bytes", "memory.usage_in_bytes");
  };
  const auto in_second = [&](const std::filesystem::path& group) {
    return free_up_from(root, group, "memory.max", "memory.current");
  };
  // A container may be told its path outside, which it does not have.
  size_t out = std::min(in_first_version({}), in_second({}));
  for (std::string line; std::getline(of_process, line);) {
    const size_t first = line.find(':');
    const size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const auto group = std::filesystem::path(line.substr(second + 1)).relative_path();
    if (controllers == ",,") out = std::min(out, in_second(group));
    if (controllers.find(",memory,") != std::string::npos) {
      out = std::min(out, in_first_version(group));
    }
  }
  return out;
}

std::vector<SplatMemory> splat_memory_plan(const SplatWork& work) {
  constexpr double kBase = 60 * kMebi;
  constexpr double kHarmonic = 12;                  // bytes per coefficient
  constexpr double kAsRead = 24 + 12 + 16 + 4 + 4;  // place in double, scale, rotation, opacity,
                                                    // and label, which splats of others lack
  constexpr double kMoved = 12 + 4 + 1;  // place, opacity and label, made anew for the frame
  constexpr double kInFrame = 12 + 12 + 16 + 4 + 1;
  constexpr double kProjected = 64 + 8 + 1;      // Splat, RowRange, SplatFate
  constexpr double kSorted = 2 * 8 + 4 + 4 * 4;  // keys, order, rows of tiles
  constexpr double kPicturePixel = 4 + 12 + 12;  // depth, colour, normal; kept for each picture
  constexpr double kDrawnPixel = 100;            // of the one that is being drawn
  const auto splats = double(work.splats);
  const double colors = kHarmonic * double(work.harmonics);
  const double as_read = splats * (kAsRead + colors);
  const double in_frame = splats * (kInFrame + colors);
  const auto bytes = [](double count) { return static_cast<size_t>(count); };
  constexpr const char* kFewer = "fewer splats or none of spherical harmonics need less, ";
  std::vector<SplatMemory> plan;
  if (work.file_bytes > 0) {
    // The file is gone before the splats are moved into their frame.
    const double beside = std::max(double(work.file_bytes), splats * kMoved);
    plan.push_back({"reading the splats", bytes(kBase + as_read + beside), kFewer});
  }
  if (work.finds_floaters) {
    constexpr double kCells = 304.0 * 304 * 304 * (4 + 1 + 4);  // opacity, at matter, part
    constexpr double kOfSplat = 12 + 1 + 1 + 4 + 4 + 8;  // place, kind, kept, part, size, tree
    plan.push_back(
        {"finding floaters", bytes(kBase + in_frame + kCells + splats * kOfSplat), kFewer});
  }
  if (work.read_back_bytes > 0) {
    const double file = double(work.read_back_bytes);
    plan.push_back({"reading back", bytes(kBase + in_frame + as_read + 2 * file), kFewer});
  }
  if (work.pictures > 0) {
    const double pixels = double(work.picture_pixels);
    plan.push_back({"taking pictures",
                    bytes(kBase + in_frame + splats * (kProjected + kSorted) +
                          pixels * (kPicturePixel * double(work.pictures) + kDrawnPixel)),
                    "fewer splats, --virtual-views or --virtual-size need less, "});
  }
  return plan;
}

void check_splat_memory_plan(const SplatWork& work, size_t budget) {
  for (const SplatMemory& part : splat_memory_plan(work)) {
    if (part.bytes <= budget) continue;
    throw LimitError("'" + std::string(part.work) + "' needs about " + mebibytes(part.bytes) +
                     " and " + mebibytes(budget) + " may be used; " + part.to_lower +
                     "a larger --memory-limit allows it");
  }
}

size_t memory_budget(size_t limit) {
  if (limit > 0) return limit;
  std::ifstream of_process("/proc/self/cgroup");
  const size_t free = std::min(free_of_machine(), free_of_groups("/sys/fs/cgroup", of_process));
  return free == kUnlimited ? size_t{4} << 30 : free / 10 * 8;
}

}  // namespace cgs
