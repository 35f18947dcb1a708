// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/convolution.h"

#include <cstdlib>
#include <fstream>
#include <new>
#include <ostream>
#include <random>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

namespace cgs::convolution_test {
namespace {

struct Size {
  int in_channels, out_channels, width, rows;
};
void PrintTo(const Size& size, std::ostream* out) {
  *out << size.in_channels << " to " << size.out_channels << " channels, " << size.width << " x "
       << size.rows;
}

// A band of channels, indexed as such.
struct Block {
  int channels, width, rows;
  FloatBuffer data;

  Block(int c, int w, int r) : channels(c), width(w), rows(r) {
    const int lanes = convolution_lanes();
    data.resize(static_cast<size_t>((c + lanes - 1) / lanes * lanes * w * r), 0.0f);
  }
  float& at(int c, int x, int y) {
    const int lanes = convolution_lanes();
    return data[static_cast<size_t>(((c / lanes * rows + y) * width + x) * lanes + c % lanes)];
  }
  void fill(std::mt19937& random) {
    std::normal_distribution<float> normal;
    for (int c = 0; c < channels; ++c) {
      for (int y = 0; y < rows; ++y) {
        for (int x = 0; x < width; ++x) at(c, x, y) = normal(random);
      }
    }
  }
};

double dot(const FloatBuffer& a, const FloatBuffer& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += double(a[i]) * double(b[i]);
  return sum;
}

// Too few pixels for the Winograd transform, enough, and more channels than one group.
class ConvolutionCase : public testing::TestWithParam<Size> {
 protected:
  ConvolutionCase()
      : size(GetParam()),
        convolution(size.in_channels, size.out_channels, size.width, {size.rows, 3}),
        in(size.in_channels, size.width + 2, size.rows + 2),
        by_output(size.out_channels, size.width, size.rows),
        parameters(convolution.parameter_count()) {
    std::mt19937 random(1);
    std::normal_distribution<float> normal;
    in.fill(random);
    by_output.fill(random);
    for (float& p : parameters) p = normal(random);
    convolution.set_parameters(parameters);
  }
  size_t weight_count() const { return parameters.size() - static_cast<size_t>(size.out_channels); }
  Block forward() {
    Block out(size.out_channels, size.width, size.rows);
    convolution.forward(size.rows, in.data.data(), out.data.data(), scratch);
    return out;
  }

  Size size;
  Convolution convolution;
  Block in;
  Block by_output;
  std::vector<float> parameters;
  FloatBuffer scratch;
};

TEST_P(ConvolutionCase, IsThatOfPlainLoops) {
  ASSERT_EQ(weight_count(), static_cast<size_t>(size.in_channels * size.out_channels * 9));
  Block out = forward();
  for (int c = 0; c < size.out_channels; ++c) {
    for (int y = 0; y < size.rows; ++y) {
      for (int x = 0; x < size.width; ++x) {
        double sum = double(parameters[weight_count() + static_cast<size_t>(c)]);
        const float* weight = &parameters[static_cast<size_t>(c * size.in_channels * 9)];
        for (int k = 0; k < size.in_channels * 9; ++k) {
          sum += double(weight[k]) * double(in.at(k / 9, x + k % 3, y + k / 3 % 3));
        }
        ASSERT_NEAR(out.at(c, x, y), sum, 2e-4);
      }
    }
  }
}

TEST_P(ConvolutionCase, LeavesUnusedLanesZero) {
  Block out = forward();
  const int lanes = convolution_lanes();
  for (int c = size.out_channels; c < (size.out_channels + lanes - 1) / lanes * lanes; ++c) {
    EXPECT_EQ(out.at(c, 0, 0), 0);
    EXPECT_EQ(out.at(c, size.width - 1, size.rows - 1), 0);
  }
}

TEST_P(ConvolutionCase, GradientByTheInputIsTheTranspose) {
  const Block out = forward();
  double expected = dot(out.data, by_output.data);
  for (int c = 0; c < size.out_channels; ++c) {
    for (int y = 0; y < size.rows; ++y) {
      for (int x = 0; x < size.width; ++x) {
        expected -= double(parameters[weight_count() + static_cast<size_t>(c)]) *
                    double(by_output.at(c, x, y));
      }
    }
  }
  Block by_input(size.in_channels, size.width + 2, size.rows + 2);
  convolution.backward_input(size.rows, by_output.data.data(), by_input.data.data(), scratch);
  EXPECT_NEAR(dot(by_input.data, in.data), expected, 1e-5 * double(in.data.size()));
}

TEST_P(ConvolutionCase, GradientByTheParametersIsTheTransposeAndBandsAddUp) {
  const size_t step = convolution.gradient_size();
  FloatBuffer gradients(3 * step);
  for (size_t k = 0; k < 3; ++k) {
    convolution.backward_parameters(
        size.rows, {in.data.data(), by_output.data.data()}, gradients.data() + k * step, scratch);
  }
  std::vector<float> sum(parameters.size(), 1.0f);  // is added to
  convolution.add_gradients(gradients.data(), 3, sum);
  double found = 0;
  for (size_t i = 0; i < sum.size(); ++i) found += (double(sum[i]) - 1) * double(parameters[i]);
  const double expected = 3 * dot(forward().data, by_output.data);
  EXPECT_NEAR(found, expected, 1e-5 * double(in.data.size()) + 1e-5 * std::abs(expected));
}

TEST_P(ConvolutionCase, WorksOnAllItsHeights) {
  const Block whole = forward();
  Block low(size.in_channels, size.width + 2, 5);
  for (int c = 0; c < size.in_channels; ++c) {
    for (int y = 0; y < 5; ++y) {
      for (int x = 0; x < size.width + 2; ++x) low.at(c, x, y) = in.at(c, x, y);
    }
  }
  Block out(size.out_channels, size.width, 3);
  convolution.forward(3, low.data.data(), out.data.data(), scratch);
  Block expected = whole;
  for (int c = 0; c < size.out_channels; ++c) {
    EXPECT_NEAR(out.at(c, 1, 2), expected.at(c, 1, 2), 1e-4);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes,
                         ConvolutionCase,
                         testing::Values(Size{2, 3, 5, 4},
                                         Size{18, 17, 9, 6},
                                         Size{5, 4, 31, 20},
                                         Size{18, 33, 40, 12}));

// Addresses that this process has now [bytes].
rlim_t addresses() {
  std::ifstream file("/proc/self/statm");
  rlim_t pages = 0;
  file >> pages;
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

// Ends with 4 if lack of memory is told as such; runs in a process of its own.
[[noreturn]] void convolve_without_memory() {
  const Convolution first(8, 8, 8, {4});  // what oneDNN makes once
  const rlim_t most = addresses() + (rlim_t{16} << 20);
  const struct rlimit limit = {most, most};
  setrlimit(RLIMIT_AS, &limit);
  try {
    const Convolution large(1024, 1024, 8, {4});  // 38 MB of weights
  } catch (const std::bad_alloc&) {
    std::_Exit(4);
  } catch (...) {
    std::_Exit(1);
  }
  std::_Exit(0);
}

TEST(Convolution, LackOfMemoryIsTheUsualError) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers need addresses without limit";
#endif
  EXPECT_EXIT(convolve_without_memory(), testing::ExitedWithCode(4), "");
}

}  // namespace
}  // namespace cgs::convolution_test
