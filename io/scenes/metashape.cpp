// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/metashape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <pugixml.hpp>

#include "io/bytes/byte_reader.h"
#include "io/bytes/text_lines.h"
#include "io/scenes/camera_checks.h"
#include "io/scenes/fisheye_map.h"
#include "io/scenes/photograph_index.h"

namespace cgs {

namespace fs = std::filesystem;

namespace {

std::optional<std::string> xml_name(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (lower_extension(entry->path()) == ".xml") files.push_back(entry->path());
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    constexpr uint64_t kEnough = 4096;
    try {
      const std::string start = read_file_start(file, kEnough);
      const bool is_chunk =
          start.find("<document") != std::string::npos && start.find("<chunk") != std::string::npos;
      // Cameras come after sensors, of which there may be many.
      if (is_chunk && read_file_start(file, ReadLimits{}.max_json_bytes).find("<cameras") !=
                          std::string::npos) {
        return file.filename().string();
      }
    } catch (const Error&) {
      continue;  // what cannot be read is none
    }
  }
  return std::nullopt;
}

// An element of the file, for messages.
std::string place(const pugi::xml_node& node) {
  std::string out;
  for (pugi::xml_node n = node; n.type() == pugi::node_element; n = n.parent()) {
    const std::string id = n.attribute("id").value();
    std::string step = "/";
    step += n.name();
    if (!id.empty()) step.append("[").append(id).append("]");
    out.insert(0, step);
  }
  return out;
}

class MetashapeFile {
 public:
  explicit MetashapeFile(fs::path path) : path_(std::move(path)) {
    ReadLimits limits;
    limits.max_file_bytes = limits.max_json_bytes;
    const std::string bytes = read_file(path_, limits);
    refuse_foreign_content(path_, bytes, "Metashape XML");
    const pugi::xml_parse_result result = document_.load_buffer(bytes.data(), bytes.size());
    if (!result) {
      throw BadInput(Defect::Syntax,
                     path_,
                     "byte " + std::to_string(result.offset) + ": " + result.description());
    }
  }

  [[noreturn]] void fail(Defect defect, const pugi::xml_node& node, const std::string& why) const {
    throw BadInput(defect, path_, place(node) + ": " + why);
  }

  pugi::xml_node child(const pugi::xml_node& node, const char* name) const {
    const pugi::xml_node found = node.child(name);
    if (!found) fail(Defect::Schema, node, std::string("has no <") + name + ">");
    return found;
  }

  template <size_t N>
  std::array<double, N> numbers(const pugi::xml_node& node) const {
    const std::string_view text = node.child_value();
    std::array<double, N> out{};
    size_t count = 0;
    size_t at = 0;
    constexpr std::string_view kBlanks = " \t\r\n";
    while ((at = text.find_first_not_of(kBlanks, at)) != std::string_view::npos) {
      const size_t end = std::min(text.find_first_of(kBlanks, at), text.size());
      const std::string_view token = text.substr(at, end - at);
      double value = 0;
      if (!parse_number(token, value)) {
        fail(Defect::Syntax, node, "\"" + std::string(token.substr(0, 40)) + "\" is not a number");
      }
      if (!std::isfinite(value)) fail(Defect::Value, node, "a number is not finite");
      if (count < N) out[count] = value;
      ++count;
      at = end;
    }
    if (count != N) {
      fail(Defect::Schema,
           node,
           "expected " + std::to_string(N) + " numbers, found " + std::to_string(count));
    }
    return out;
  }

  double number_or_0(const pugi::xml_node& node, const char* name) const {
    const pugi::xml_node found = node.child(name);
    return found ? numbers<1>(found)[0] : 0;
  }

  // All with cameras, also below others.
  std::vector<pugi::xml_node> chunks() const {
    std::vector<pugi::xml_node> out;
    const pugi::xml_node document = document_.child("document");
    for (const pugi::xml_node& parent : {document, document.child("chunks")}) {
      for (const pugi::xml_node& chunk : parent.children("chunk")) {
        if (chunk.child("cameras")) out.push_back(chunk);
      }
    }
    if (!out.empty()) return out;
    throw BadInput(Defect::Schema, path_, "no <document> with a <chunk> that has <cameras>");
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  pugi::xml_document document_;
};

// What a sensor says about its photographs.
struct Sensor {
  Camera camera;
  std::array<double, 5> distortion = {};
  std::optional<Fisheye> fisheye;
};

int side(const MetashapeFile& file, const pugi::xml_node& resolution, const char* name) {
  constexpr int kLargest = 1'000'000;
  const int value = resolution.attribute(name).as_int();
  if (value < 1 || value > kLargest) {
    file.fail(Defect::Value, resolution, std::string(name) + " must be in [1, 1e6]");
  }
  return value;
}

// Terms that OpenCV's model lacks must not move a pixel by more than a tenth.
void refuse_further_terms(const MetashapeFile& file,
                          const pugi::xml_node& calibration,
                          const Camera& camera) {
  const Eigen::Vector2d corner(std::max(camera.cx, camera.width - camera.cx) / camera.fx,
                               std::max(camera.cy, camera.height - camera.cy) / camera.fy);
  const double r2 = corner.squaredNorm();
  const double k4 = std::abs(file.number_or_0(calibration, "k4")) * std::pow(r2, 4.5) * camera.fx;
  const double skew = std::abs(file.number_or_0(calibration, "b2")) * corner.y();
  const double p =
      std::hypot(file.number_or_0(calibration, "p1"), file.number_or_0(calibration, "p2"));
  const double p34 = std::abs(file.number_or_0(calibration, "p3")) * r2 +
                     std::abs(file.number_or_0(calibration, "p4")) * r2 * r2;
  constexpr double kNoticeable = 0.1;  // [pixels]
  const double worst = std::max({k4, skew, 3 * r2 * p * p34 * camera.fx});
  if (worst > kNoticeable) {
    file.fail(Defect::Unsupported,
              calibration,
              "k4, p3, p4 and b2 are not read, and move pixels by up to " + std::to_string(worst) +
                  "; undistort the photographs first");
  }
}

// Of a fisheye the other terms are read.
void refuse_further_fisheye_terms(const MetashapeFile& file, const pugi::xml_node& calibration) {
  for (const char* name : {"p3", "p4", "b2"}) {
    if (file.number_or_0(calibration, name) == 0) continue;
    file.fail(Defect::Unsupported,
              calibration,
              std::string(name) + " of a fisheye is not read; undistort the photographs first");
  }
}

Sensor read_sensor(const MetashapeFile& file, const pugi::xml_node& node) {
  const std::string type = node.attribute("type").as_string("frame");
  const bool is_fisheye = type == "fisheye" || type == "equidistant_fisheye";
  if (type != "frame" && !is_fisheye) {
    file.fail(Defect::Unsupported, node, "sensors of type \"" + type + "\" are not read");
  }
  pugi::xml_node calibration = file.child(node, "calibration");
  for (const pugi::xml_node& candidate : node.children("calibration")) {
    if (std::string_view(candidate.attribute("class").value()) == "adjusted") {
      calibration = candidate;
    }
  }
  const pugi::xml_node own = calibration.child("resolution");
  const pugi::xml_node resolution = own ? own : file.child(node, "resolution");
  Sensor out;
  Camera& camera = out.camera;
  camera.width = side(file, resolution, "width");
  camera.height = side(file, resolution, "height");
  const auto get = [&](const char* name) { return file.number_or_0(calibration, name); };
  camera.fy = file.numbers<1>(file.child(calibration, "f"))[0];
  camera.fx = camera.fy + get("b1");
  camera.cx = 0.5 * camera.width + get("cx");
  camera.cy = 0.5 * camera.height + get("cy");
  const Refuse refuse = [&](Defect defect, const std::string& why) {
    file.fail(defect, calibration, why);
  };
  if (is_fisheye) {
    out.fisheye =
        Fisheye{camera, {get("k1"), get("k2"), get("k3"), get("k4")}, {get("p2"), get("p1")}, 0};
    check_fisheye(*out.fisheye, refuse);
    refuse_further_fisheye_terms(file, calibration);
    return out;
  }
  out.distortion = {get("k1"), get("k2"), get("p2"), get("p1"), get("k3")};
  check_intrinsics(camera, refuse);
  check_distortion(camera, out.distortion, refuse);
  refuse_further_terms(file, calibration, camera);
  return out;
}

// World coordinates of what a camera's matrix leads to.
struct Similarity {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  // without the scale
  double scale = 1;
};

Similarity read_similarity(const MetashapeFile& file, const pugi::xml_node& node) {
  Similarity out;
  const pugi::xml_node transform = node.child("transform");
  if (!transform) return out;
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  if (const auto part = transform.child("rotation")) {
    rotation = Eigen::Map<const RowMajor>(file.numbers<9>(part).data());
  }
  if (const auto part = transform.child("translation")) {
    translation = Eigen::Map<const Eigen::Vector3d>(file.numbers<3>(part).data());
  }
  if (const auto part = transform.child("scale")) out.scale = file.numbers<1>(part)[0];
  const Refuse refuse = [&](Defect defect, const std::string& why) {
    file.fail(defect, transform, why);
  };
  if (!(out.scale > 0)) refuse(Defect::Value, "the scale must be above 0");
  out.pose = checked_pose(rotation, translation, refuse);
  return out;
}

// A camera with what stands around it.
struct CameraNode {
  pugi::xml_node node;
  pugi::xml_node master;  // of a rig; null if it has a place of its own
  std::string group;      // its label; often the folder of the photographs
};

bool is_enabled(const pugi::xml_node& camera) {
  const std::string_view enabled = camera.attribute("enabled").as_string("true");
  return enabled != "false" && enabled != "0";
}

std::vector<CameraNode> cameras_of(const pugi::xml_node& chunk) {
  std::vector<CameraNode> out;
  const pugi::xml_node all = chunk.child("cameras");
  for (const pugi::xml_node& node : all.children("camera")) out.push_back({node, {}, {}});
  for (const pugi::xml_node& group : all.children("group")) {
    const std::string label = group.attribute("label").value();
    for (const pugi::xml_node& node : group.children("camera")) out.push_back({node, {}, label});
  }
  std::map<std::string, pugi::xml_node> by_id;
  for (const CameraNode& camera : out) by_id[camera.node.attribute("id").value()] = camera.node;
  for (CameraNode& camera : out) {
    const std::string master = camera.node.attribute("master_id").value();
    if (master.empty() || camera.node.child("transform")) continue;
    const auto found = by_id.find(master);
    if (found != by_id.end()) camera.master = found->second;
  }
  return out;
}

// The one that states the place: the camera itself, or the master of its rig.
const pugi::xml_node& placed(const CameraNode& camera) {
  return camera.master ? camera.master : camera.node;
}

bool is_used(const CameraNode& camera) {
  return placed(camera).child("transform") && is_enabled(camera.node);
}

std::string component_of(const CameraNode& camera) {
  const std::string own = camera.node.attribute("component_id").value();
  return own.empty() ? placed(camera).attribute("component_id").value() : own;
}

std::string label_of(const pugi::xml_node& chunk) { return chunk.attribute("label").value(); }

std::string labels_of(const std::vector<pugi::xml_node>& chunks) {
  std::string out;
  for (size_t i = 0; i < chunks.size(); ++i) {
    out += (i > 0 ? ", " : "") + std::to_string(i) + " \"" + one_line(label_of(chunks[i])) + "\"";
  }
  return out;
}

// The chunk of a label, else of an index; without a choice the first with a camera that is aligned.
size_t chosen_chunk(const std::vector<pugi::xml_node>& chunks, const std::string& choice) {
  if (choice.empty()) {
    const auto has_used = [](const pugi::xml_node& chunk) {
      const std::vector<CameraNode> cameras = cameras_of(chunk);
      return std::any_of(cameras.begin(), cameras.end(), is_used);
    };
    const auto found = std::find_if(chunks.begin(), chunks.end(), has_used);
    return found == chunks.end() ? 0 : static_cast<size_t>(found - chunks.begin());
  }
  std::vector<size_t> called;
  for (size_t i = 0; i < chunks.size(); ++i) {
    if (label_of(chunks[i]) == choice) called.push_back(i);
  }
  if (called.size() == 1) return called.front();
  uint64_t index = 0;
  if (called.empty() && parse_number(choice, index) && index < chunks.size()) return index;
  throw InvalidInput("chunk \"" + one_line(choice) + "\" " +
                     (called.empty() ? "does not exist" : "occurs more than once") +
                     "; there are " + labels_of(chunks));
}

class MetashapeReader {
 public:
  explicit MetashapeReader(const SceneRoot& root)
      : file_(resolve_in_scene(root, xml_name(root.folder).value_or("cameras.xml"), root.folder)),
        photographs_(root) {
    scene_.kind = SceneKind::Metashape;
    scene_.folder = root.folder;
  }

  Scene run(const std::string& choice) {
    const std::vector<pugi::xml_node> chunks = file_.chunks();
    const size_t index = chosen_chunk(chunks, choice);
    const pugi::xml_node& chunk = chunks[index];
    for (const auto& node : file_.child(chunk, "sensors").children("sensor")) {
      sensors_[node.attribute("id").value()] = node;
    }
    const std::vector<CameraNode> cameras = cameras_of(chunk);
    choose_component(chunk, cameras);
    whole_ = read_similarity(file_, chunk);  // of versions without components
    for (const CameraNode& camera : cameras) add_camera(camera);
    if (scene_.views.empty()) {
      throw BadInput(Defect::Empty,
                     file_.path(),
                     disabled_ > 0 ? "no camera that is enabled has a <transform>: none is aligned"
                                   : "no camera has a <transform>: none is aligned");
    }
    if (chunks.size() > 1) {
      scene_.notes.push_back("chunk " + std::to_string(index) + " \"" + one_line(label_of(chunk)) +
                             "\" was read, of " + labels_of(chunks));
    }
    tell_what_was_left_out();
    for (const std::string& note : photographs_.notes()) scene_.notes.push_back(note);
    return std::move(scene_);
  }

 private:
  void tell_what_was_left_out() {
    const auto tell = [&](size_t count, const std::string& why) {
      if (count == 0) return;
      scene_.warnings.push_back(std::to_string(count) + " cameras " + why + ", and were left out");
    };
    tell(left_out_, "are not aligned");
    tell(disabled_, "are disabled");
    tell(elsewhere_,
         "were aligned apart from the others (in another component than " + component_ + ")");
  }

  // Components do not know where they lie relative to each other: one of them is the scene. That is
  // the active one, or else the one with most cameras.
  void choose_component(const pugi::xml_node& chunk, const std::vector<CameraNode>& cameras) {
    const pugi::xml_node list = chunk.child("components");
    for (const pugi::xml_node& node : list.children("component")) {
      components_[node.attribute("id").value()] = read_similarity(file_, node);
    }
    std::map<std::string, size_t> sizes;  // by component
    for (const CameraNode& camera : cameras) {
      const std::string id = component_of(camera);
      if (is_used(camera) && components_.contains(id)) ++sizes[id];
    }
    const std::string active = list.attribute("active_id").value();
    size_t most = 0;
    for (const auto& [id, count] : sizes) {
      if (count > most) component_ = id;
      most = std::max(most, count);
    }
    if (sizes.contains(active)) component_ = active;
  }

  void add_camera(const CameraNode& camera) {
    if (!is_used(camera)) {
      ++(is_enabled(camera.node) ? left_out_ : disabled_);
      return;
    }
    if (!component_.empty() && component_of(camera) != component_) {
      ++elsewhere_;
      return;
    }
    if (scene_.views.size() >= ReadLimits{}.max_views) {
      throw LimitError(printable(file_.path()) + ": more than " +
                       std::to_string(ReadLimits{}.max_views) + " cameras");
    }
    scene_.views.push_back(read_view(camera));
  }

  View read_view(const CameraNode& camera) {
    View view;
    const std::string label = camera.node.attribute("label").value();
    if (label.empty()) file_.fail(Defect::Schema, camera.node, "has no label");
    view.image_path = photographs_.take(camera.group.empty() ? label : camera.group + "/" + label);
    view.name = label;
    if (view.image_path.empty()) {
      scene_.missing.push_back(label);
    } else {
      view.name = name_below(scene_.folder, view.image_path);
    }
    const auto sensor = sensors_.find(camera.node.attribute("sensor_id").value());
    if (sensor == sensors_.end()) {
      file_.fail(Defect::Ref, camera.node, "names a sensor that does not exist");
    }
    const Sensor read = read_sensor(file_, sensor->second);
    view.camera = read.camera;
    view.distortion = read.distortion;
    view.fisheye = read.fisheye;
    Eigen::Isometry3d pose = read_transform(placed(camera));
    if (camera.master) pose = pose * read_place_in_rig(sensor->second);
    const auto found = components_.find(component_of(camera));
    const Similarity& world = found != components_.end() ? found->second : whole_;
    pose.translation() *= world.scale;
    view.camera.world_from_cam = world.pose * pose;
    return view;
  }

  // From the axes of a slave to those of its master, in the unit of the component; that of the
  // master itself where nothing is stated.
  Eigen::Isometry3d read_place_in_rig(const pugi::xml_node& sensor) const {
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d location = Eigen::Vector3d::Zero();
    if (const auto part = sensor.child("rotation")) {
      rotation = Eigen::Map<const RowMajor>(file_.numbers<9>(part).data());
    }
    if (const auto part = sensor.child("location")) {
      location = Eigen::Map<const Eigen::Vector3d>(file_.numbers<3>(part).data());
    }
    return checked_pose(rotation, location, [&](Defect defect, const std::string& why) {
      file_.fail(defect, sensor, why);
    });
  }

  Eigen::Isometry3d read_transform(const pugi::xml_node& node) const {
    const pugi::xml_node transform = node.child("transform");
    const std::array<double, 16> m = file_.numbers<16>(transform);
    const Eigen::Matrix4d M =
        Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(m.data());
    const Refuse refuse = [&](Defect defect, const std::string& why) {
      file_.fail(defect, transform, why);
    };
    if ((M.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-9) {
      refuse(Defect::Value, "the last row must be 0 0 0 1");
    }
    return checked_pose(M.topLeftCorner<3, 3>(), M.topRightCorner<3, 1>(), refuse);
  }

  MetashapeFile file_;
  PhotographIndex photographs_;
  std::map<std::string, pugi::xml_node> sensors_;
  std::map<std::string, Similarity> components_;
  Similarity whole_;
  std::string component_;  // whose cameras are read; empty if the file has none
  size_t left_out_ = 0;
  size_t disabled_ = 0;
  size_t elsewhere_ = 0;  // aligned, in other components
  Scene scene_;
};

}  // namespace

bool is_metashape(const fs::path& folder) { return xml_name(folder).has_value(); }

Scene read_metashape(const SceneRoot& root) { return read_metashape_chunk(root, ""); }

Scene read_metashape_chunk(const SceneRoot& root, const std::string& chunk) {
  return MetashapeReader(root).run(chunk);
}

}  // namespace cgs
