// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/convolution.h"

#include <cassert>
#include <new>
#include <unordered_map>

#include <dnnl.hpp>
#include <omp.h>
#include <tbb/parallel_for.h>

namespace cgs {

namespace {

using dnnl::algorithm;
using dnnl::memory;
using FormatTag = memory::format_tag;

constexpr auto kFloat = memory::data_type::f32;
constexpr int kWinogradPixels = 400;  // below, transforming the weights costs more than it saves

// Debian's oneDNN starts OpenMP threads, whose number is a setting of the calling thread. Ours
// come from oneTBB, which the program can limit, and work is split so that bits do not depend on
// them: oneDNN gets one.
class OneOpenMpThread {
 public:
  OneOpenMpThread() : before_(omp_get_max_threads()) { omp_set_num_threads(1); }
  ~OneOpenMpThread() { omp_set_num_threads(before_); }
  OneOpenMpThread(const OneOpenMpThread&) = delete;
  OneOpenMpThread& operator=(const OneOpenMpThread&) = delete;

 private:
  int before_;
};

// Does work that calls oneDNN. Lack of memory, which oneDNN tells in its own way, is told as
// everywhere else.
template <typename Work>
void with_dnnl(const Work& work) {
  const OneOpenMpThread one;
  try {
    work();
  } catch (const dnnl::error& error) {
    if (error.status == dnnl_out_of_memory) throw std::bad_alloc();
    throw;
  }
}

const dnnl::engine& cpu() {
  static const dnnl::engine engine(dnnl::engine::kind::cpu, 0);
  return engine;
}

void* handle(const float* data) { return const_cast<float*>(data); }

// The primitives that work on bands of one height.
struct BandPrimitives {
  dnnl::convolution_forward::primitive_desc forward_desc;
  dnnl::convolution_backward_data::primitive_desc input_desc;
  dnnl::convolution_backward_weights::primitive_desc weights_desc;
  dnnl::convolution_forward forward;
  dnnl::convolution_backward_data backward_input;
  dnnl::convolution_backward_weights backward_weights;
  memory forward_weights;
  memory backward_weights_in;
};

struct BandShape {
  memory::desc input, output, weights, gradient, bias;
};

// \return false if this processor has no such algorithm
bool create(algorithm how, const BandShape& shape, BandPrimitives& out) {
  const memory::dims stride{1, 1};
  const memory::dims padding{0, 0};
  dnnl::primitive_attr own_scratch;
  own_scratch.set_scratchpad_mode(dnnl::scratchpad_mode::user);
  out.forward_desc = {{dnnl::prop_kind::forward_training,
                       how,
                       shape.input,
                       shape.weights,
                       shape.bias,
                       shape.output,
                       stride,
                       padding,
                       padding},
                      own_scratch,
                      cpu(),
                      true};
  if (!out.forward_desc) return false;
  out.input_desc = {{how, shape.input, shape.weights, shape.output, stride, padding, padding},
                    own_scratch,
                    cpu(),
                    out.forward_desc,
                    true};
  out.weights_desc = {
      {how, shape.input, shape.gradient, shape.bias, shape.output, stride, padding, padding},
      own_scratch,
      cpu(),
      out.forward_desc,
      true};
  if (!out.input_desc || !out.weights_desc) return false;
  out.forward = dnnl::convolution_forward(out.forward_desc);
  out.backward_input = dnnl::convolution_backward_data(out.input_desc);
  out.backward_weights = dnnl::convolution_backward_weights(out.weights_desc);
  out.forward_weights = memory(out.forward_desc.weights_desc(), cpu());
  out.backward_weights_in = memory(out.input_desc.weights_desc(), cpu());
  return true;
}

memory scratch_memory(const memory::desc& desc, FloatBuffer& scratch) {
  const size_t floats = (desc.get_size() + sizeof(float) - 1) / sizeof(float);
  if (scratch.size() < floats) scratch.resize(floats);
  return {desc, cpu(), scratch.data()};
}

}  // namespace

struct Convolution::Primitives {
  size_t weight_count = 0;
  size_t out_channels = 0;
  memory::desc plain_weights;
  memory::desc gradient;  // of the weights, as oneDNN writes it
  memory bias;
  std::unordered_map<int, BandPrimitives> bands;  // by height

  size_t gradient_floats() const { return gradient.get_size() / sizeof(float); }
};

int convolution_lanes() {
  const auto isa = static_cast<unsigned>(dnnl::get_effective_cpu_isa());
  const auto wide = static_cast<unsigned>(dnnl::cpu_isa::avx512_core);
  return (isa & wide) == wide ? 16 : 8;
}

Convolution::Convolution(int in_channels, int out_channels, int width, const std::vector<int>& rows)
    : primitives_(std::make_unique<Primitives>()) {
  with_dnnl([&] {
    Primitives& own = *primitives_;
    own.weight_count = static_cast<size_t>(in_channels) * static_cast<size_t>(out_channels) * 9;
    own.out_channels = static_cast<size_t>(out_channels);
    const memory::dims weight_dims{out_channels, in_channels, 3, 3};
    own.plain_weights = memory::desc(weight_dims, kFloat, FormatTag::oihw);
    const memory::desc any_weights(weight_dims, kFloat, FormatTag::any);
    const memory::desc bias({out_channels}, kFloat, FormatTag::a);
    own.bias = memory(bias, cpu());
    own.gradient = any_weights;
    const bool wide = convolution_lanes() == 16;
    const FormatTag blocked = wide ? FormatTag::nChw16c : FormatTag::nChw8c;
    const bool winograd = wide && width * rows.front() >= kWinogradPixels;
    for (const int height : rows) {
      const BandShape shape{{{1, in_channels, height + 2, width + 2}, kFloat, blocked},
                            {{1, out_channels, height, width}, kFloat, blocked},
                            any_weights,
                            own.gradient,
                            bias};
      BandPrimitives& band = own.bands[height];
      const bool is_made = (winograd && create(algorithm::convolution_winograd, shape, band)) ||
                           create(algorithm::convolution_direct, shape, band);
      if (!is_made) throw std::bad_alloc();  // every processor has the direct one
      own.gradient = band.weights_desc.diff_weights_desc();
    }
  });
}

Convolution::~Convolution() = default;
Convolution::Convolution(Convolution&& other) noexcept = default;
Convolution& Convolution::operator=(Convolution&& other) noexcept = default;

size_t Convolution::parameter_count() const {
  return primitives_->weight_count + primitives_->out_channels;
}

void Convolution::set_parameters(std::span<const float> parameters) {
  assert(parameters.size() == parameter_count());
  with_dnnl([&] {
    Primitives& own = *primitives_;
    dnnl::stream stream(cpu());
    memory plain(own.plain_weights, cpu(), handle(parameters.data()));
    for (auto& [rows, band] : own.bands) {
      dnnl::reorder(plain, band.forward_weights).execute(stream, plain, band.forward_weights);
      dnnl::reorder(plain, band.backward_weights_in)
          .execute(stream, plain, band.backward_weights_in);
    }
    std::copy(parameters.begin() + static_cast<std::ptrdiff_t>(own.weight_count),
              parameters.end(),
              static_cast<float*>(own.bias.get_data_handle()));
  });
}

void Convolution::forward(int rows, const float* input, float* output, FloatBuffer& scratch) const {
  with_dnnl([&] {
    const BandPrimitives& band = primitives_->bands.at(rows);
    dnnl::stream stream(cpu());
    band.forward.execute(
        stream,
        {{DNNL_ARG_SRC, {band.forward_desc.src_desc(), cpu(), handle(input)}},
         {DNNL_ARG_WEIGHTS, band.forward_weights},
         {DNNL_ARG_BIAS, primitives_->bias},
         {DNNL_ARG_DST, {band.forward_desc.dst_desc(), cpu(), output}},
         {DNNL_ARG_SCRATCHPAD, scratch_memory(band.forward_desc.scratchpad_desc(), scratch)}});
    stream.wait();
  });
}

void Convolution::backward_input(int rows,
                                 const float* output_gradient,
                                 float* input_gradient,
                                 FloatBuffer& scratch) const {
  with_dnnl([&] {
    const BandPrimitives& band = primitives_->bands.at(rows);
    dnnl::stream stream(cpu());
    band.backward_input.execute(
        stream,
        {{DNNL_ARG_DIFF_SRC, {band.input_desc.diff_src_desc(), cpu(), input_gradient}},
         {DNNL_ARG_WEIGHTS, band.backward_weights_in},
         {DNNL_ARG_DIFF_DST, {band.input_desc.diff_dst_desc(), cpu(), handle(output_gradient)}},
         {DNNL_ARG_SCRATCHPAD, scratch_memory(band.input_desc.scratchpad_desc(), scratch)}});
    stream.wait();
  });
}

size_t Convolution::gradient_size() const {
  const size_t used = primitives_->gradient_floats() + primitives_->out_channels;
  return (used + 15) / 16 * 16;  // so that the next one starts on a cache line, too
}

void Convolution::backward_parameters(int rows,
                                      const Band& band,
                                      float* gradient,
                                      FloatBuffer& scratch) const {
  with_dnnl([&] {
    const BandPrimitives& with = primitives_->bands.at(rows);
    const auto& desc = with.weights_desc;
    float* bias = gradient + primitives_->gradient_floats();
    std::fill(bias, gradient + gradient_size(), 0.0f);
    dnnl::stream stream(cpu());
    with.backward_weights.execute(
        stream,
        {{DNNL_ARG_SRC, {desc.src_desc(), cpu(), handle(band.input)}},
         {DNNL_ARG_DIFF_DST, {desc.diff_dst_desc(), cpu(), handle(band.output_gradient)}},
         {DNNL_ARG_DIFF_WEIGHTS, {primitives_->gradient, cpu(), gradient}},
         {DNNL_ARG_DIFF_BIAS, {primitives_->bias.get_desc(), cpu(), bias}},
         {DNNL_ARG_SCRATCHPAD, scratch_memory(desc.scratchpad_desc(), scratch)}});
    stream.wait();
  });
}

void Convolution::add_gradients(float* gradients, size_t count, std::span<float> sum) const {
  assert(sum.size() == parameter_count());
  const Primitives& own = *primitives_;
  const size_t size = gradient_size();
  constexpr size_t kChunk = 4096;
  tbb::parallel_for(size_t{0}, (size + kChunk - 1) / kChunk, [&](size_t chunk) {
    const size_t end = std::min(size, (chunk + 1) * kChunk);
    for (size_t k = 1; k < count; ++k) {
      const float* next = gradients + k * size;
      for (size_t i = chunk * kChunk; i < end; ++i) gradients[i] += next[i];
    }
  });
  with_dnnl([&] {
    dnnl::stream stream(cpu());
    memory blocked(own.gradient, cpu(), gradients);
    memory plain(own.plain_weights, cpu());
    dnnl::reorder(blocked, plain).execute(stream, blocked, plain);
    stream.wait();
    const auto* weights = static_cast<const float*>(plain.get_data_handle());
    for (size_t i = 0; i < own.weight_count; ++i) sum[i] += weights[i];
  });
  const float* bias = gradients + own.gradient_floats();
  for (size_t i = 0; i < own.out_channels; ++i) sum[own.weight_count + i] += bias[i];
}

}  // namespace cgs
