// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/exr.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>
#include <stdexcept>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/isolated.h"
#include "io/bytes/lack_of_memory.h"
#include "io/images/exr_header.h"

namespace cgs {

namespace {

class MemoryOut : public Imf::OStream {
 public:
  MemoryOut() : Imf::OStream("memory") {}
  void write(const char* data, int size) override {
    const auto n = static_cast<size_t>(size);
    if (bytes.size() < position_ + n) bytes.resize(position_ + n);
    std::copy(data, data + n, bytes.begin() + static_cast<ptrdiff_t>(position_));
    position_ += n;
  }
  uint64_t tellp() override { return position_; }
  void seekp(uint64_t position) override { position_ = position; }

  std::string bytes;

 private:
  size_t position_ = 0;
};

class MemoryIn : public Imf::IStream {
 public:
  explicit MemoryIn(std::string_view bytes) : Imf::IStream("memory"), bytes_(bytes) {}
  bool read(char* out, int size) override {
    const auto n = static_cast<size_t>(size);
    if (size < 0 || position_ > bytes_.size() || n > bytes_.size() - position_) {
      throw std::runtime_error("read past the end");
    }
    std::memcpy(out, bytes_.data() + position_, n);
    position_ += n;
    return position_ < bytes_.size();
  }
  uint64_t tellg() override { return position_; }
  void seekg(uint64_t position) override { position_ = position; }

 private:
  std::string_view bytes_;
  uint64_t position_ = 0;
};

/// OpenEXR multiplies row vectors from the left.
Imath::M44f row_matrix(const Eigen::Matrix4f& m) {
  Imath::M44f out;
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) out[c][r] = m(r, c);
  }
  return out;
}

Eigen::Matrix4f column_matrix(const Imath::M44f& m) {
  Eigen::Matrix4f out;
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) out(r, c) = m[c][r];
  }
  return out;
}

void require_writable(const ExrImage& image) {
  require(image.width > 0 && image.height > 0, "ExrImage must have pixels; width", image.width);
  require(!image.channels.empty(), "ExrImage must have channels", 0);
  const size_t pixels = static_cast<size_t>(image.width) * static_cast<size_t>(image.height);
  std::set<std::string> names;
  for (const auto& [name, values] : image.channels) {
    require(!name.empty() && names.insert(name).second,
            "ExrImage channels must have names that differ",
            name);
    require(values.size() == pixels,
            "ExrImage channel " + name + " must be as large as the image",
            values.size());
  }
}

Imf::Slice slice_of(const float* values, int width) {
  auto* base = const_cast<char*>(reinterpret_cast<const char*>(values));
  return {Imf::FLOAT, base, sizeof(float), sizeof(float) * static_cast<size_t>(width)};
}

// The data window, if the other is empty or beyond use.
ExrWindow display_of(const Imath::Box2i& display, const Imath::Box2i& data) {
  constexpr int64_t kFar = int64_t{1} << 30;
  const auto side = [](int low, int high) { return int64_t{high} - low + 1; };
  const int64_t left = int64_t{display.min.x} - data.min.x;
  const int64_t top = int64_t{display.min.y} - data.min.y;
  const int64_t width = side(display.min.x, display.max.x);
  const int64_t height = side(display.min.y, display.max.y);
  const bool is_usable = width > 0 && height > 0 && width < kFar && height < kFar &&
                         std::abs(left) < kFar && std::abs(top) < kFar;
  if (!is_usable) {
    return {0,
            0,
            static_cast<int>(side(data.min.x, data.max.x)),
            static_cast<int>(side(data.min.y, data.max.y))};
  }
  return {static_cast<int>(left),
          static_cast<int>(top),
          static_cast<int>(width),
          static_cast<int>(height)};
}

ExrImage decode(std::string_view bytes, const std::filesystem::path& path) {
  MemoryIn stream(bytes);
  Imf::InputFile file(stream, 0);
  const Imath::Box2i window = file.header().dataWindow();
  ExrImage image;
  image.width = window.max.x - window.min.x + 1;
  image.height = window.max.y - window.min.y + 1;
  image.display = display_of(file.header().displayWindow(), window);
  const size_t pixels = static_cast<size_t>(image.width) * static_cast<size_t>(image.height);
  for (auto it = file.header().channels().begin(); it != file.header().channels().end(); ++it) {
    image.channels.emplace_back(it.name(), std::vector<float>(pixels));
  }
  if (image.channels.empty()) throw BadInput(Defect::Schema, path, "no channels");
  Imf::FrameBuffer frame_buffer;
  for (auto& [name, values] : image.channels) {
    // The library subtracts the window's corner itself, through a pointer to pixel (0, 0).
    frame_buffer.insert(name,
                        Imf::Slice::Make(Imf::FLOAT,
                                         values.data(),
                                         window,
                                         sizeof(float),
                                         sizeof(float) * static_cast<size_t>(image.width)));
  }
  file.setFrameBuffer(frame_buffer);
  file.readPixels(window.min.y, window.max.y);
  for (auto it = file.header().begin(); it != file.header().end(); ++it) {
    const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute());
    if (text != nullptr) image.text[it.name()] = text->value();
  }
  if (Imf::hasWorldToCamera(file.header())) {
    image.world_to_camera = column_matrix(Imf::worldToCamera(file.header()));
  }
  return image;
}

void append_text(std::string& out, const std::string& text) {
  append_bytes(out, static_cast<uint64_t>(text.size()));
  out += text;
}

std::string take_text(ByteReader& in) {
  return std::string(in.take(in.get<uint64_t>("length of a text"), "text"));
}

// An image as one string, for the way out of a child process, and back.
std::string packed(const ExrImage& image, size_t decoded_bytes) {
  constexpr size_t kOfAttributes = size_t{1} << 20;
  std::string out;
  out.reserve(decoded_bytes + kOfAttributes);
  append_bytes(out, image.width);
  append_bytes(out, image.height);
  const ExrWindow& shown = image.display;
  for (const int number : {shown.left, shown.top, shown.width, shown.height}) {
    append_bytes(out, number);
  }
  append_bytes(out, static_cast<uint64_t>(image.channels.size()));
  for (const auto& [name, values] : image.channels) {
    append_text(out, name);
    out.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  }
  append_bytes(out, static_cast<uint64_t>(image.text.size()));
  for (const auto& [key, value] : image.text) {
    append_text(out, key);
    append_text(out, value);
  }
  append_bytes(out, static_cast<uint8_t>(image.world_to_camera.has_value()));
  if (image.world_to_camera) {
    for (int i = 0; i < 16; ++i) append_bytes(out, image.world_to_camera->data()[i]);
  }
  return out;
}

ExrImage unpacked(std::string_view bytes, const std::filesystem::path& path) {
  ByteReader in(bytes, path);
  ExrImage image;
  image.width = in.get<int>("width");
  image.height = in.get<int>("height");
  for (int* number :
       {&image.display.left, &image.display.top, &image.display.width, &image.display.height}) {
    *number = in.get<int>("display window");
  }
  const size_t pixels = static_cast<size_t>(image.width) * static_cast<size_t>(image.height);
  for (auto left = in.get<uint64_t>("channels"); left > 0; --left) {
    auto& [name, values] = image.channels.emplace_back(take_text(in), std::vector<float>());
    const std::string_view raw = in.take(pixels * sizeof(float), "channel");
    values.resize(pixels);
    std::memcpy(values.data(), raw.data(), raw.size());
  }
  for (auto left = in.get<uint64_t>("texts"); left > 0; --left) {
    const std::string key = take_text(in);
    image.text[key] = take_text(in);
  }
  if (in.get<uint8_t>("camera") != 0) {
    image.world_to_camera.emplace();
    for (int i = 0; i < 16; ++i) image.world_to_camera->data()[i] = in.get<float>("camera");
  }
  return image;
}

ExrImage decode_isolated(std::string_view bytes,
                         uint64_t decoded_bytes,
                         const std::filesystem::path& path) {
  constexpr uint64_t kLeast = uint64_t{256} << 20;
  // A row of tiles of the library, each tile as read and as decoded, all as floats, and packed.
  constexpr uint64_t kCopies = 6;
  IsolationLimits limits;
  limits.memory = kLeast + kCopies * decoded_bytes;
  return unpacked(
      run_isolated([&] { return packed(decode(bytes, path), decoded_bytes); }, path, limits), path);
}

}  // namespace

const std::vector<float>* ExrImage::find(const std::string& channel) const {
  for (const auto& [name, values] : channels) {
    if (name == channel) return &values;
  }
  return nullptr;
}

void write_exr(const std::filesystem::path& path, const ExrImage& image) {
  require_writable(image);
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer frame_buffer;
  for (const auto& [name, values] : image.channels) {
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    frame_buffer.insert(name, slice_of(values.data(), image.width));
  }
  for (const auto& [key, value] : image.text) header.insert(key, Imf::StringAttribute(value));
  if (image.world_to_camera) Imf::addWorldToCamera(header, row_matrix(*image.world_to_camera));
  MemoryOut stream;
  {
    Imf::OutputFile file(stream, header, 0);
    file.setFrameBuffer(frame_buffer);
    file.writePixels(image.height);
  }  // its destructor completes the table of chunks
  write_file(path, stream.bytes);
}

ExrImage read_exr(const std::filesystem::path& path, const ReadLimits& limits) {
  const std::string bytes = read_file(path, limits);
  const ExrScreening found = screen_exr(bytes, path, limits);
  if (!found.is_harmless) return decode_isolated(bytes, found.decoded_bytes, path);
  errno = 0;
  try {
    return decode(bytes, path);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw_if_memory_ran_out();
    throw BadInput(Defect::Syntax, path, error.what());
  }
}

}  // namespace cgs
