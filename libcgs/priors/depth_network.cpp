// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/depth_network.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>

#include "libcgs/core/error.h"
#include "libcgs/core/opencv_memory.h"
#include "libcgs/priors/onnx_input.h"

namespace cgs {

namespace {

// OpenCV tells what it cannot run in many lines; the last that says something is the reason.
std::string reason_of(const cv::Exception& error) {
  std::string text = error.err.empty() ? error.what() : error.err;
  std::replace(text.begin(), text.end(), '\n', ' ');
  constexpr size_t kLongest = 200;
  return text.substr(0, kLongest);
}

/// One thread and no log of OpenCV's while it lives.
class Quietly {
 public:
  Quietly()
      : threads_(cv::getNumThreads()),
        level_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {
    cv::setNumThreads(1);
  }
  ~Quietly() {
    cv::setNumThreads(threads_);
    cv::utils::logging::setLogLevel(level_);
  }
  Quietly(const Quietly&) = delete;
  Quietly& operator=(const Quietly&) = delete;

 private:
  int threads_;
  cv::utils::logging::LogLevel level_;
};

cv::Mat input_blob(const ColorImage& image, const cv::Size& size) {
  const cv::Mat whole(image.height,
                      image.width,
                      CV_32FC3,
                      const_cast<Eigen::Vector3f*>(image.data.data()));  // NOLINT: no const matrix
  cv::Mat resized;
  const bool shrinks = size.width < image.width && size.height < image.height;
  cv::resize(whole, resized, size, 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
  // Of ImageNet, which networks are trained with.
  resized -= cv::Scalar(0.485, 0.456, 0.406);
  cv::divide(resized, cv::Scalar(0.229, 0.224, 0.225), resized);
  return cv::dnn::blobFromImage(resized);
}

}  // namespace

struct DepthNetwork::Net {
  cv::dnn::Net net;
  cv::Size size;
  std::filesystem::path file;

  [[noreturn]] void fail(Defect defect, const std::string& why) const {
    throw BadInput(defect, file, why);
  }
  void read_size(const std::vector<int64_t>& shape) {
    constexpr int64_t kUsual = 256;
    constexpr int64_t kLargest = 4096;
    if (!shape.empty() && (shape.size() != 4 || (shape[1] != 3 && shape[1] != 0))) {
      fail(Defect::Schema, "expected an input 1 x 3 x H x W");
    }
    const bool is_stated = shape.size() == 4 && shape[2] != 0 && shape[3] != 0;
    const int64_t height = is_stated ? shape[2] : kUsual;
    const int64_t width = is_stated ? shape[3] : kUsual;
    if (std::min(height, width) < 1 || std::max(height, width) > kLargest) {
      fail(Defect::Schema, "the sides of the input must be in [1, 4096]");
    }
    size = {static_cast<int>(width), static_cast<int>(height)};
  }
};

DepthNetwork::DepthNetwork(const std::string& onnx, const std::filesystem::path& file)
    : net_(std::make_unique<Net>()) {
  net_->file = file;
  const std::string defect = onnx_weights_defect(onnx);
  if (!defect.empty()) net_->fail(Defect::Unsupported, defect);
  net_->read_size(onnx_input_shape(onnx));
  const Quietly quietly;
  try {
    net_->net = cv::dnn::readNetFromONNX(onnx.data(), onnx.size());
    net_->net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
  } catch (const cv::Exception& error) {
    throw_if_out_of_memory(error);
    net_->fail(Defect::Unsupported, "OpenCV cannot run this network: " + reason_of(error));
  }
}

DepthNetwork::~DepthNetwork() = default;
DepthNetwork::DepthNetwork(DepthNetwork&&) noexcept = default;
DepthNetwork& DepthNetwork::operator=(DepthNetwork&&) noexcept = default;

DepthMap DepthNetwork::operator()(const View& view) {
  const ColorImage& image = view.image;
  cv::Mat output;
  try {
    const Quietly quietly;
    net_->net.setInput(input_blob(image, net_->size));
    output = net_->net.forward().clone();
  } catch (const cv::Exception& error) {
    throw_if_out_of_memory(error);
    net_->fail(Defect::Unsupported, "OpenCV cannot run this network: " + reason_of(error));
  }
  const int dimensions = output.dims;
  const bool is_map = dimensions >= 2 && output.type() == CV_32F &&
                      output.total() == static_cast<size_t>(output.size[dimensions - 1]) *
                                            static_cast<size_t>(output.size[dimensions - 2]);
  if (!is_map) net_->fail(Defect::Schema, "the network does not give one value per pixel");
  const cv::Mat values(
      output.size[dimensions - 2], output.size[dimensions - 1], CV_32F, output.data);
  double least = 0;
  double largest = 0;
  if (!cv::checkRange(values)) net_->fail(Defect::Value, "the network gives values without end");
  cv::minMaxLoc(values, &least, &largest);
  cv::Mat resized;
  cv::resize(values, resized, {image.width, image.height}, 0, 0, cv::INTER_LINEAR);
  const double lift = 0.01 * (largest - least) - least;
  DepthMap out(image.width, image.height, std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      if (!view.is_usable(x, y)) continue;
      out(x, y) = static_cast<float>(double(resized.at<float>(y, x)) + lift);
    }
  }
  return out;
}

}  // namespace cgs
