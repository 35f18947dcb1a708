// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/reference_conv_decoder.h"

#include <cmath>

namespace cgs::test {

namespace {

// Channels of an image, [channel][row][column].
struct Image {
  int channels, height, width;
  std::vector<double> data;

  Image(int c, int h, int w)
      : channels(c), height(h), width(w), data(static_cast<size_t>(c * h * w)) {}
  double& at(int c, int y, int x) {
    return data[static_cast<size_t>((c * height + y) * width + x)];
  }
  double at(int c, int y, int x) const {
    return data[static_cast<size_t>((c * height + y) * width + x)];
  }
};

// Bilinear, the four corners stay where they are.
Image resized(const Image& in, int height, int width) {
  Image out(in.channels, height, width);
  for (int c = 0; c < in.channels; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double sy = in.height == 1 ? 0 : y * double(in.height - 1) / (height - 1);
        const double sx = in.width == 1 ? 0 : x * double(in.width - 1) / (width - 1);
        const int y0 = std::min(int(sy + 1e-9), std::max(in.height - 2, 0));
        const int x0 = std::min(int(sx + 1e-9), std::max(in.width - 2, 0));
        const int y1 = std::min(y0 + 1, in.height - 1);
        const int x1 = std::min(x0 + 1, in.width - 1);
        const double ty = sy - y0;
        const double tx = sx - x0;
        out.at(c, y, x) = (1 - ty) * ((1 - tx) * in.at(c, y0, x0) + tx * in.at(c, y0, x1)) +
                          ty * ((1 - tx) * in.at(c, y1, x0) + tx * in.at(c, y1, x1));
      }
    }
  }
  return out;
}

struct Padding {
  int top, bottom, left, right;
};

Image reflection_padded(const Image& in, const Padding& by) {
  Image out(in.channels, in.height + by.top + by.bottom, in.width + by.left + by.right);
  const auto reflected = [](int i, int n) { return i < 0 ? -i : i >= n ? 2 * n - 2 - i : i; };
  for (int c = 0; c < out.channels; ++c) {
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) {
        out.at(c, y, x) =
            in.at(c, reflected(y - by.top, in.height), reflected(x - by.left, in.width));
      }
    }
  }
  return out;
}

// Convolution without padding; takes its weights and biases off the parameters.
Image convolved(const Image& in, int outputs, int kernel, const double*& parameters) {
  Image out(outputs, in.height - kernel + 1, in.width - kernel + 1);
  const double* biases = parameters + outputs * in.channels * kernel * kernel;
  for (int o = 0; o < outputs; ++o) {
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) {
        double sum = biases[o];
        for (int i = 0; i < in.channels; ++i) {
          for (int ky = 0; ky < kernel; ++ky) {
            for (int kx = 0; kx < kernel; ++kx) {
              sum += parameters[((o * in.channels + i) * kernel + ky) * kernel + kx] *
                     in.at(i, y + ky, x + kx);
            }
          }
        }
        out.at(o, y, x) = sum;
      }
    }
  }
  parameters = biases + outputs;
  return out;
}

Image leaky_relu(Image in) {
  for (double& v : in.data) v = v > 0 ? v : 0.2 * v;
  return in;
}

Image with_coordinates(const Image& in, bool reference) {
  Image out(in.channels + 2, in.height, in.width);
  std::copy(in.data.begin(), in.data.end(), out.data.begin());
  Image corners(2, 2, 2);
  corners.data = {-1, -1, 1, -1, -1, 1, 1, 1};
  const Image pattern = reflection_padded(corners, {0, in.height - 2, 0, in.width - 2});
  for (int y = 0; y < in.height; ++y) {
    for (int x = 0; x < in.width; ++x) {
      out.at(in.channels, y, x) = reference ? pattern.at(0, y, x) : -1 + 2.0 * x / (in.width - 1);
      out.at(in.channels + 1, y, x) =
          reference ? pattern.at(1, y, x) : -1 + 2.0 * y / (in.height - 1);
    }
  }
  return out;
}

// Per block, whether the axis doubles, and what is odd about the result.
struct Growth {
  int factor, parity;
};

std::vector<Growth> growth(int size, size_t blocks) {
  std::vector<Growth> out;
  for (; size > 1; size /= 2) out.insert(out.begin(), {2, size % 2});
  while (out.size() < blocks) out.push_back({1, 0});
  return out;
}

Image embedded(int view, int views) {
  Image out(20, 1, 1);
  const double t = views == 1 ? 0 : double(view) / (views - 1);
  for (int k = 0; k < 10; ++k) {
    out.at(2 * k, 0, 0) = std::sin(std::pow(2.0, k) * t);
    out.at(2 * k + 1, 0, 0) = std::cos(std::pow(2.0, k) * t);
  }
  return out;
}

}  // namespace

std::vector<std::vector<double>> reference_conv_decoder(
    const std::vector<Raster<uint8_t>>& layer_per_view,
    const ConvDecoderOptions& options,
    const std::vector<double>& parameters) {
  std::vector<std::vector<double>> out;
  const int views = static_cast<int>(layer_per_view.size());
  for (int view = 0; view < views; ++view) {
    const Raster<uint8_t>& layer = layer_per_view[static_cast<size_t>(view)];
    const size_t blocks = std::max(growth(layer.width, 0).size(), growth(layer.height, 0).size());
    const std::vector<Growth> along_x = growth(layer.width, blocks);
    const std::vector<Growth> along_y = growth(layer.height, blocks);
    const double* next = parameters.data();
    Image map = embedded(view, views);
    for (size_t k = 0; k < blocks; ++k) {
      const int channels = (k < 3 ? 16 : k < 6 ? 8 : 4) * options.width;
      const int around = k == 0 ? 0 : 1;
      map = resized(map, map.height * along_y[k].factor, map.width * along_x[k].factor);
      map = reflection_padded(
          map, {around, around + along_y[k].parity, around, around + along_x[k].parity});
      map = leaky_relu(convolved(map, channels, k == 0 ? 1 : 3, next));
      if (k == 0) map = with_coordinates(map, options.reference_coordinates);
    }
    map = convolved(reflection_padded(map, {1, 1, 1, 1}), options.layers, 3, next);
    std::vector<double> values;
    for (int y = 0; y < layer.height; ++y) {
      for (int x = 0; x < layer.width; ++x) values.push_back(map.at(layer(x, y), y, x));
    }
    out.push_back(values);
  }
  return out;
}

}  // namespace cgs::test
